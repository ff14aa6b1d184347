//! The list of sources: select, flip, remove, fly to. Only the rows in sight are laid out.

use egui::{Button, Color32, RichText, ScrollArea, Ui, Vec2};
use normend_core::sources::Origin;

use crate::command::{Action, Command};
use crate::session::Session;
use crate::theme::{self, SPACE_S, SPACE_XS};

const ROW_HEIGHT: f32 = 24.0;
const LIST_HEIGHT: f32 = 180.0;

/// What the words of the rows mean.
pub const ABOUT: &str = "Points whose side you decided.\nFlipped: the source turned its point.\n\
                         Kept: it holds the side that the point has without sources.";

/// The list and its buttons.
pub fn ui(ui: &mut Ui, session: &mut Session) -> Option<Action> {
    let reveal = session.reveal.take();
    let session = &*session;
    let sources = session.document.sources();
    let n_voted = session
        .document
        .propagation()
        .map_or(0, |propagation| propagation.voted_sources.len());
    if n_voted > 0 {
        let voted = theme::counted(n_voted as u64, "source", "sources");
        ui.label(RichText::new(format!("{voted} voted for by viewpoints")).weak())
            .on_hover_text("Found by visibility. Those you make overrule them. Some are shown as yellow spheres.");
    }
    if sources.is_empty() {
        let hint = "None yet. Click a wrong region in the view: it turns, and its point becomes a source.";
        ui.add(egui::Label::new(RichText::new(hint).weak()).wrap());
        return None;
    }
    let mut action = None;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = SPACE_XS;
        let n_selected = session.selected.len();
        for command in [Command::FlipSources, Command::RemoveSources] {
            let short = if command == Command::FlipSources {
                "Flip"
            } else {
                "Remove"
            };
            let button = ui.add_enabled(n_selected > 0, Button::new(short));
            let tooltip = format!("{} ({})", command.tooltip(), command.keys_text(ui.ctx()));
            if button
                .on_hover_text(tooltip)
                .on_disabled_hover_text("Select sources first")
                .clicked()
            {
                action = Some(command.into());
            }
        }
        let one = session.selected.first().filter(|_| n_selected == 1);
        let button = ui.add_enabled(one.is_some(), Button::new("Show"));
        let button = button.on_hover_text("Bring this source into view");
        if button.on_disabled_hover_text("Select one source first").clicked() {
            action = one.map(|&point| Action::FlyTo(point));
        }
        if n_selected > 0 {
            ui.label(RichText::new(format!("{} of {}", theme::thousands(n_selected as u64), sources.len())).weak());
        }
    });
    ui.add_space(SPACE_XS);
    let mut list = ScrollArea::vertical()
        .id_salt("sources")
        .max_height(LIST_HEIGHT)
        .auto_shrink([false, true]);
    // A source that was just made is brought into the middle of the list.
    if let Some(index) = reveal.and_then(|point| sources.iter().position(|source| source.point == point)) {
        let pitch = ROW_HEIGHT + ui.spacing().item_spacing.y;
        list = list.vertical_scroll_offset((index as f32 * pitch - 0.5 * (LIST_HEIGHT - pitch)).max(0.0));
    }
    list.show_rows(ui, ROW_HEIGHT, sources.len(), |ui, rows| {
        for source in sources.iter().skip(rows.start).take(rows.len()) {
            let flipped = session.document.is_flipped(source);
            let response = row(
                ui,
                source.point,
                flipped,
                source.origin,
                session.selected.contains(&source.point),
            );
            if response.double_clicked() {
                action = Some(Action::FlyTo(source.point));
            } else if response.clicked() {
                let extend = ui.input(|input| input.modifiers.shift || input.modifiers.command);
                action = Some(Action::SelectSource {
                    point: source.point,
                    extend,
                });
            }
        }
    });
    action
}

fn row(ui: &mut Ui, point: u32, flipped: bool, origin: Origin, selected: bool) -> egui::Response {
    let state = if flipped { "flipped" } else { "kept" };
    let text = format!("      Point {}", theme::thousands(u64::from(point)));
    let button = Button::selectable(selected, text)
        .shortcut_text(format!("{state}, {}", origin.label().to_lowercase()))
        .min_size(Vec2::new(ui.available_width(), ROW_HEIGHT));
    let response = ui
        .add(button)
        .on_hover_text("Click to select, double-click to bring into view");
    let [r, g, b] = if flipped {
        theme::SOURCE_FLIPPED
    } else {
        theme::SOURCE_KEPT
    }
    .map(|channel| (channel * 255.0).round() as u8);
    let center = response.rect.left_center() + Vec2::new(SPACE_S + 8.0, 0.0);
    ui.painter().circle_filled(center, 5.0, Color32::from_rgb(r, g, b));
    response
}
