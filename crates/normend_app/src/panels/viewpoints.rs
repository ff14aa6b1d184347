//! The viewpoints that vote for sources, as a list with their places.

use egui::{Button, DragValue, RichText, Ui, Vec2};
use glam::DVec3;

use crate::command::Action;
use crate::session::Session;
use crate::theme::{self, SPACE_S, SPACE_XS};
use crate::viewpoints::{MOST, ViewpointAction, Viewpoints};

/// What the section is.
pub const ABOUT: &str = "The places that vote. They are shown in the view as small cameras; drag one, or set its place here, \
                         in the file's coordinates.";

/// Width of the number of a viewpoint, in points.
const NUMBER_WIDTH: f32 = 30.0;
/// A drag over one point of a field moves a viewpoint by this part of the scan's diagonal.
const SPEED: f64 = 0.005;

/// The section; only where viewpoints vote.
pub fn ui(ui: &mut Ui, session: &mut Session) -> Option<Action> {
    if !Viewpoints::are_asked(&session.document) {
        return None;
    }
    theme::section_about(ui, "Viewpoints", ABOUT, |ui| list(ui, session))
}

fn list(ui: &mut Ui, session: &mut Session) -> Option<Action> {
    let mut action: Option<Action> = None;
    let document = &session.document;
    let is_usual = document.state().viewpoints.is_empty();
    let places = session.viewpoints.places(document);
    let text = if is_usual {
        format!("The usual {}", places.len())
    } else {
        format!("{} of your own", places.len())
    };
    ui.label(RichText::new(text).weak());
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE_XS;
        // All four stand in one row of a panel of the usual width.
        ui.spacing_mut().button_padding.x = SPACE_S;
        let add = ui.add_enabled(places.len() < MOST, Button::new("Add here"));
        let add = add.on_hover_text("Let the place that you look from vote too");
        if add
            .on_disabled_hover_text("There are as many as can be; remove one first")
            .clicked()
        {
            action = Some(ViewpointAction::AddHere.into());
        }
        let selected = session.viewpoints.selected.filter(|_| places.len() > 1);
        let remove = ui.add_enabled(selected.is_some(), Button::new("Remove"));
        let remove = remove.on_hover_text("Remove the selected viewpoint");
        if remove
            .on_disabled_hover_text("Select one first; the last one stays")
            .clicked()
        {
            action = selected.map(|index| ViewpointAction::Remove(index).into());
        }
        let reset = ui.add_enabled(!is_usual, Button::new("Reset"));
        let reset = reset.on_hover_text("The usual viewpoints again");
        if reset.on_disabled_hover_text("They are the usual ones").clicked() {
            action = Some(ViewpointAction::Reset.into());
        }
        let show = ui.button("Show all");
        if show
            .on_hover_text("Bring the scan and all viewpoints into view")
            .clicked()
        {
            action = Some(ViewpointAction::ShowAll.into());
        }
    });
    let origin = document.cloud().origin();
    let speed = SPEED * f64::from(document.cloud().diagonal());
    let decimals = theme::decimals(document.cloud().diagonal().into());
    let mut moved = None;
    for (index, place) in places.into_iter().enumerate() {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = SPACE_XS;
            let is_selected = session.viewpoints.selected == Some(index);
            let number =
                Button::selectable(is_selected, format!("{}", index + 1)).min_size(Vec2::new(NUMBER_WIDTH, 0.0));
            let number = ui.add(number).on_hover_text("Select this viewpoint");
            if number.clicked() {
                action = Some(ViewpointAction::Select((!is_selected).then_some(index)).into());
            }
            let mut values = (origin + place.as_dvec3()).to_array();
            let width = (theme::content_width(ui) - NUMBER_WIDTH - 3.0 * SPACE_XS) / 3.0;
            for (value, axis) in values.iter_mut().zip(["x", "y", "z"]) {
                let field = DragValue::new(value)
                    .speed(speed)
                    .max_decimals(decimals)
                    .update_while_editing(false);
                let response = ui.add_sized(Vec2::new(width, ui.spacing().interact_size.y), field);
                let response = response.accessible_name(format!("Viewpoint {}, {axis}", index + 1));
                if response.changed() {
                    moved = Some(index);
                }
                if response.drag_stopped() || response.lost_focus() || (response.changed() && !response.dragged()) {
                    action = Some(ViewpointAction::Commit.into());
                }
                response.on_hover_text(format!("{axis} of viewpoint {}", index + 1));
            }
            if moved == Some(index) {
                let place = (DVec3::from_array(values) - origin).as_vec3();
                session.viewpoints.move_to(&session.document, index, place);
            }
        });
    }
    action
}
