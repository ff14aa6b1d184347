//! How the user moves in the view.

use egui::{ComboBox, Ui};
use normend_render::UpAxis;

use crate::theme;
use crate::viewport::{Navigation, NavigationSettings, Touchpad};

/// The rows of a section.
pub fn ui(ui: &mut Ui, settings: &mut NavigationSettings) {
    theme::rows(ui, "navigation", |ui| {
        theme::input_row(
            ui,
            "Up",
            "The axis of the scan that stands upright; views are named after it",
            |ui| {
                ComboBox::from_id_salt("up axis")
                    .selected_text(settings.up_axis.label())
                    .show_ui(ui, |ui| {
                        for each in UpAxis::ALL {
                            ui.selectable_value(&mut settings.up_axis, each, each.label());
                        }
                    })
                    .response
            },
        );
        theme::input_row(ui, "Drag", settings.style.tooltip(), |ui| {
            ComboBox::from_id_salt("navigation")
                .selected_text(settings.style.label())
                .show_ui(ui, |ui| {
                    for each in Navigation::ALL {
                        ui.selectable_value(&mut settings.style, each, each.label())
                            .on_hover_text(each.tooltip());
                    }
                })
                .response
        });
        let tooltip = "What two fingers that slide on a touchpad do, where the system tells them from a wheel";
        theme::input_row(ui, "Two fingers", tooltip, |ui| {
            ComboBox::from_id_salt("touchpad")
                .selected_text(settings.touchpad.label())
                .show_ui(ui, |ui| {
                    for each in Touchpad::ALL {
                        ui.selectable_value(&mut settings.touchpad, each, each.label());
                    }
                })
                .response
        });
    });
    ui.checkbox(&mut settings.orbit_under_pointer, "Turn around what is dragged")
        .on_hover_text("A drag turns the view around the point that it begins on; else around the point that was last double-clicked");
}
