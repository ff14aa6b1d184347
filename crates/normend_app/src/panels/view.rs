//! How the scan is shown.

use egui::{Color32, ComboBox, RichText, Slider, Stroke, StrokeKind, Ui, Vec2};
use normend_render::{DisplayMode, Palette};

use super::navigation;
use crate::settings::{PaletteChoice, SPLAT_SCALES, Settings, ThemeChoice};
use crate::theme::{self, SPACE_S, SPACE_XS};

/// The tab.
pub fn ui(ui: &mut Ui, settings: &mut Settings, mode: &mut DisplayMode, palette: &Palette) {
    theme::section(ui, "Display", |ui| view(ui, settings, mode, palette));
    theme::section(ui, "Moving around", |ui| navigation::ui(ui, &mut settings.navigation));
}

fn view(ui: &mut Ui, settings: &mut Settings, mode: &mut DisplayMode, palette: &Palette) {
    theme::rows(ui, "view", |ui| {
        theme::input_row(ui, "Display", "How splats are colored", |ui| {
            ComboBox::from_id_salt("display mode")
                .selected_text(mode.label())
                .show_ui(ui, |ui| {
                    for each in DisplayMode::ALL {
                        ui.selectable_value(mode, each, each.label());
                    }
                })
                .response
        });
        if *mode == DisplayMode::Facing {
            theme::input_row(ui, "Colors", "The colors of front and back", |ui| {
                ComboBox::from_id_salt("palette")
                    .selected_text(settings.palette.label())
                    .show_ui(ui, |ui| {
                        for each in PaletteChoice::ALL {
                            ui.selectable_value(&mut settings.palette, each, each.label());
                        }
                    })
                    .response
            });
            ui.label(RichText::new("Meaning").weak());
            ui.horizontal(|ui| {
                swatch(ui, palette.front, "Front");
                ui.add_space(SPACE_XS);
                swatch(ui, palette.back, "Back");
            });
            ui.end_row();
        }
        theme::input_row(ui, "Splat size", "Factor on the size of all splats (+ and −)", |ui| {
            ui.add(
                Slider::new(&mut settings.splat_scale, SPLAT_SCALES)
                    .logarithmic(true)
                    .fixed_decimals(2),
            )
        });
        theme::input_row(ui, "Theme", "Light or dark", |ui| {
            ComboBox::from_id_salt("theme")
                .selected_text(settings.theme.label())
                .show_ui(ui, |ui| {
                    for each in ThemeChoice::ALL {
                        ui.selectable_value(&mut settings.theme, each, each.label());
                    }
                })
                .response
        });
    });
}

fn swatch(ui: &mut Ui, color: [f32; 3], label: &str) {
    ui.spacing_mut().item_spacing.x = SPACE_S;
    let (rect, _) = ui.allocate_exact_size(Vec2::splat(14.0), egui::Sense::hover());
    let [r, g, b] = color.map(|channel| (channel * 255.0).round() as u8);
    ui.painter().rect_filled(rect, 3.0, Color32::from_rgb(r, g, b));
    // A front or back as dark or as bright as the panel has an edge.
    let edge = Stroke::new(1.0, ui.visuals().weak_text_color());
    ui.painter().rect_stroke(rect, 3.0, edge, StrokeKind::Inside);
    ui.label(label);
}
