//! The question before mends are lost.

use egui::{Align2, Ui, Vec2};

use crate::theme::{self, SPACE_S};

/// What the user decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Not yet.
    Wait,
    /// Export first, then go on.
    Export,
    /// Go on without the mends.
    Discard,
    /// Stay.
    Cancel,
}

/// Asks about the mends of the scan called `name`.
pub fn ui(ui: &Ui, name: &str) -> Decision {
    let mut decision = Decision::Wait;
    egui::Window::new("Unsaved mends")
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, Vec2::ZERO)
        .show(ui.ctx(), |ui| {
            ui.set_width(400.0);
            ui.add(egui::Label::new(format!("The mends of {name} are in no exported file yet.")).wrap());
            ui.add_space(SPACE_S);
            ui.horizontal(|ui| {
                if ui.add(theme::primary_button(ui, "Export…")).clicked() {
                    decision = Decision::Export;
                }
                if ui.button("Discard").clicked() {
                    decision = Decision::Discard;
                }
                if ui.button("Cancel").clicked() {
                    decision = Decision::Cancel;
                }
            });
        });
    decision
}
