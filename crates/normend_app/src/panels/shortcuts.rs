//! The sheet of shortcuts, from the table of commands.

use egui::{Align2, RichText, ScrollArea, Ui, Vec2};

use crate::command::{MOUSE, Menu};
use crate::theme::{self, SPACE_L, SPACE_XS};

/// Width of what is done and of the keys, so that they align from section to section.
const COLUMN: f32 = 208.0;
/// What two columns of sections need, with the window's margins.
const WIDE: f32 = 2.0 * (2.0 * COLUMN + SPACE_L) + 8.0 * SPACE_L;
/// The title bar and the margins above and below the sheet.
const AROUND: f32 = 112.0;

/// The window with every key and what the mouse does.
pub fn ui(ui: &Ui, open: &mut bool) {
    let room = ui.ctx().content_rect();
    egui::Window::new("Keys and mouse")
        .open(open)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, Vec2::ZERO)
        .show(ui.ctx(), |ui| {
            let height = (room.height() - AROUND).max(160.0);
            ScrollArea::vertical()
                .max_height(height)
                .min_scrolled_height(height)
                .show(ui, |ui| {
                    if room.width() < WIDE {
                        ui.vertical(|ui| {
                            mouse(ui);
                            for menu in Menu::ALL {
                                keys(ui, menu);
                            }
                        });
                        return;
                    }
                    ui.horizontal_top(|ui| {
                        ui.spacing_mut().item_spacing.x = 2.0 * SPACE_L;
                        ui.vertical(|ui| {
                            mouse(ui);
                            for menu in [Menu::File, Menu::Edit, Menu::Select, Menu::Mend] {
                                keys(ui, menu);
                            }
                        });
                        ui.vertical(|ui| {
                            keys(ui, Menu::View);
                            keys(ui, Menu::Help);
                        });
                    });
                });
        });
}

fn mouse(ui: &mut Ui) {
    theme::section(ui, "Mouse", |ui| {
        sheet(ui, "mouse", MOUSE.into_iter().map(|(what, how)| (what, how.to_owned())));
    });
}

fn keys(ui: &mut Ui, menu: Menu) {
    let ctx = ui.ctx().clone();
    theme::section(ui, menu.label(), |ui| {
        sheet(
            ui,
            menu.label(),
            menu.commands()
                .map(|command| (command.label(), command.keys_text(&ctx))),
        );
    });
}

fn sheet(ui: &mut Ui, id: &str, rows: impl Iterator<Item = (&'static str, String)>) {
    egui::Grid::new(id)
        .num_columns(2)
        .min_col_width(COLUMN)
        .min_row_height(theme::FACT_HEIGHT)
        .spacing([SPACE_L, SPACE_XS])
        .show(ui, |ui| {
            for (what, keys) in rows {
                ui.label(what);
                ui.label(
                    RichText::new(if keys.is_empty() {
                        "in the menu".to_owned()
                    } else {
                        keys
                    })
                    .weak(),
                );
                ui.end_row();
            }
        });
}
