//! Version, method and graphics adapter.

use egui::{Align2, RichText, Ui, Vec2};

use crate::theme::{self, SPACE_S};

/// The window about the program.
pub fn ui(ui: &Ui, open: &mut bool, adapter: &str) {
    egui::Window::new("About Normend")
        .open(open)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, Vec2::ZERO)
        .show(ui.ctx(), |ui| {
            ui.set_width(420.0);
            let what = "An editor for the consistent orientation of point clouds, after Liu et al., \
                        “Mendable Consistent Orientation of Point Clouds”.";
            ui.add(egui::Label::new(what).wrap());
            ui.add_space(SPACE_S);
            theme::facts(ui, "about", |ui| {
                theme::row(ui, "Version", env!("CARGO_PKG_VERSION"));
                theme::row(ui, "License", env!("CARGO_PKG_LICENSE"));
                ui.label(RichText::new("Graphics").weak());
                ui.add(egui::Label::new(adapter).wrap());
                ui.end_row();
            });
        });
}
