//! The question before mends are lost.

use egui::{Label, Ui};

use super::modal;
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
    modal::show(ui, "Unsaved mends", 400.0, |ui| {
        let mut decision = Decision::Wait;
        ui.add(Label::new(format!("The mends of {name} are in no exported file yet.")).wrap());
        ui.add_space(SPACE_S);
        ui.horizontal(|ui| {
            let enter = modal::enter_pressed(ui);
            if ui.add(theme::primary_button(ui, "Export…")).clicked() || enter {
                decision = Decision::Export;
            }
            if ui.button("Discard").clicked() {
                decision = Decision::Discard;
            }
            if ui.button("Cancel").clicked() {
                decision = Decision::Cancel;
            }
        });
        decision
    })
}
