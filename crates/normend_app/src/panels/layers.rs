//! The files that the scan is made of: which are shown, and what can be done with each.

use egui::{Button, Checkbox, RichText, ScrollArea, Ui};

use crate::coloring;
use crate::command::{Action, Command};
use crate::layers::{LayerAction, n_hidden};
use crate::session::Session;
use crate::theme::{self, SPACE_XS};

/// What the section is.
pub const ABOUT: &str =
    "The files that this scan is made of. They are oriented as one cloud, and each is exported to its own file.";

/// Height of the list before it scrolls, in points: six files.
const LIST_HEIGHT: f32 = 300.0;
/// Characters of a name before it is shortened; the tooltip has all of it.
const MAX_NAME: usize = 26;

/// The section; nothing for a scan of one file.
pub fn ui(ui: &mut Ui, session: &Session) -> Option<Action> {
    let layers = session.scan.layers();
    if layers.len() < 2 {
        return None;
    }
    theme::section_about(ui, "Layers", ABOUT, |ui| {
        let mut action = None;
        ScrollArea::vertical()
            .id_salt("layers")
            .max_height(LIST_HEIGHT)
            .auto_shrink([false, true])
            .show(ui, |ui| {
                for index in 0..layers.len() {
                    action = row(ui, session, index).or(action.take());
                }
            });
        let is_any_hidden = !session.document.hidden().is_empty();
        ui.horizontal(|ui| {
            let all = ui.add_enabled(is_any_hidden, Button::new("Show all"));
            let all = all.on_hover_text(Command::ShowAll.tooltip_with_keys(ui.ctx()));
            if all.on_disabled_hover_text("Nothing is hidden").clicked() {
                action = Some(Command::ShowAll.into());
            }
            let add = ui.button("Add files…");
            if add
                .on_hover_text(Command::AddFiles.tooltip_with_keys(ui.ctx()))
                .clicked()
            {
                action = Some(Command::AddFiles.into());
            }
        });
        action
    })
}

fn row(ui: &mut Ui, session: &Session, index: usize) -> Option<Action> {
    let layer = &session.scan.layers()[index];
    let mut action = None;
    let n_points = layer.n_points() as u64;
    let n_hidden = n_hidden(&session.document, &session.scan, index);
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE_XS;
        let mut is_shown = n_hidden < n_points;
        let is_part = n_hidden > 0 && is_shown;
        let name = theme::elided(&layer.name, MAX_NAME);
        let [red, green, blue, _] = coloring::of_layer(index).to_le_bytes();
        let (place, _) = ui.allocate_exact_size(egui::Vec2::splat(12.0), egui::Sense::hover());
        ui.painter()
            .rect_filled(place, 2.0, egui::Color32::from_rgb(red, green, blue));
        let shown = ui.add(Checkbox::new(&mut is_shown, name).indeterminate(is_part));
        let shown = shown.on_hover_ui(|ui| {
            let path = layer
                .path()
                .map_or_else(|| layer.name.clone(), |path| path.display().to_string());
            ui.label(path);
            ui.label("Untick to hide its points");
        });
        if shown.changed() {
            action = Some(LayerAction::Show(index, is_shown || is_part).into());
        }
    });
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE_XS;
        ui.add_space(16.0);
        let mut words = format!(
            "{}, {}",
            layer.format.label(),
            theme::counted(n_points, "point", "points")
        );
        if n_hidden > 0 && n_hidden < n_points {
            words += &format!(", {} hidden", theme::thousands(n_hidden));
        }
        let mut about = String::new();
        if layer.n_left_out > 0 {
            let rows = theme::counted(layer.n_left_out as u64, "row", "rows");
            about += &format!("{rows} with a coordinate that is not finite are left out\n");
        }
        about += if layer.has_normals {
            "Has normals"
        } else {
            "Has no normals"
        };
        ui.label(RichText::new(words).weak()).on_hover_text(about);
    });
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE_XS;
        ui.add_space(16.0);
        let mut button = |text: &str, tooltip: &str, means: LayerAction| {
            let response = ui.add(Button::new(text).small());
            let response = response.accessible_name(format!("{text} {}", layer.name));
            let response = response.on_hover_text(tooltip);
            if response.clicked() {
                action = Some(means.into());
            }
        };
        button("Only", "Hide the points of all other files", LayerAction::Only(index));
        button("Select", "Select its points", LayerAction::Select(index));
        button("Zoom to", "Bring it into view", LayerAction::Frame(index));
    });
    action
}
