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
    /// Go on; the mends are offered again when the scan is opened the next time.
    Keep,
    /// Go on without the mends.
    Discard,
    /// Stay.
    Cancel,
}

/// Asks about the scan called `name`: about its mends, or else about its new propagation. They can be kept where `is_journaled`.
pub fn ui(ui: &Ui, name: &str, mends: bool, is_journaled: bool) -> Decision {
    let name = theme::elided(name, 60);
    let (title, what) = if mends {
        (
            "Unsaved mends",
            format!("The mends of {name} are in no exported file yet."),
        )
    } else {
        (
            "Unsaved propagation",
            format!("The new propagation of {name} is in no exported file yet."),
        )
    };
    modal::show(ui, title, 420.0, |ui| {
        let mut decision = Decision::Wait;
        ui.add(Label::new(what).wrap());
        ui.add_space(SPACE_S);
        ui.horizontal(|ui| {
            let enter = modal::enter_pressed(ui);
            let export = ui.add(theme::primary_button(ui, "Export…"));
            if export.on_hover_text("Write the oriented scan first (Enter)").clicked() || enter {
                decision = Decision::Export;
            }
            let keep = ui.add_enabled(is_journaled, egui::Button::new("Keep for next time"));
            let keep = keep.on_hover_text("They are offered when this scan is opened again");
            let keep = keep.on_disabled_hover_text("Edits are not being journaled, see the messages");
            if keep.clicked() {
                decision = Decision::Keep;
            }
            if ui
                .button("Discard")
                .on_hover_text("Go on and forget the edits")
                .clicked()
            {
                decision = Decision::Discard;
            }
            if modal::cancel_button(ui) {
                decision = Decision::Cancel;
            }
        });
        decision
    })
}
