//! The sheet of shortcuts, from the table of commands and the rows of the tools.

use egui::{Align2, RichText, ScrollArea, TextEdit, Ui, Vec2};

use crate::command::{MOUSE, Menu};
use crate::theme::{self, SPACE_L, SPACE_S, SPACE_XS};
use crate::tools::Tool;

/// Width of what is done and of the keys, so that they align from section to section.
const COLUMN: f32 = 208.0;
/// What two columns of sections need, with the window's margins.
const WIDE: f32 = 2.0 * (2.0 * COLUMN + SPACE_L) + 8.0 * SPACE_L;
/// The title bar, the search and the margins above and below the sheet.
const AROUND: f32 = 152.0;

/// A part of the sheet: a title, and what is done how.
struct Section {
    title: String,
    rows: Vec<(&'static str, String)>,
}

/// The window with every key and what the mouse does. Only what has all of `search` is shown.
pub fn ui(ui: &Ui, open: &mut bool, search: &mut String) {
    let room = ui.ctx().content_rect();
    egui::Window::new("Keys and mouse")
        .open(open)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, Vec2::ZERO)
        .show(ui.ctx(), |ui| {
            let field = TextEdit::singleline(search)
                .hint_text("Search what is done, or a key")
                .desired_width(2.0 * COLUMN);
            ui.add(field).widget_info(|| {
                egui::WidgetInfo::labeled(egui::accesskit::Role::TextInput, true, "Search what is done, or a key")
            });
            ui.add_space(SPACE_S);
            let height = (room.height() - AROUND).max(160.0);
            ScrollArea::vertical()
                .max_height(height)
                .min_scrolled_height(height)
                .show(ui, |ui| {
                    let sections = sections(ui.ctx(), search);
                    if sections.is_empty() {
                        ui.label(RichText::new("Nothing has this in its name or its keys.").weak());
                    } else if room.width() < WIDE {
                        ui.vertical(|ui| show(ui, &sections));
                    } else {
                        let (left, right) = sections.split_at(middle(&sections));
                        ui.horizontal_top(|ui| {
                            ui.spacing_mut().item_spacing.x = 2.0 * SPACE_L;
                            ui.vertical(|ui| show(ui, left));
                            ui.vertical(|ui| show(ui, right));
                        });
                    }
                });
        });
}

/// The parts of the sheet that have rows with `search` in them.
fn sections(ctx: &egui::Context, search: &str) -> Vec<Section> {
    let search = search.trim().to_lowercase();
    let mouse = Section {
        title: "Mouse".to_owned(),
        rows: MOUSE.into_iter().map(|(what, how)| (what, how.to_owned())).collect(),
    };
    let tools = Tool::ALL.into_iter().map(|tool| Section {
        title: format!("Tool: {}", tool.label()),
        rows: tool
            .hints()
            .iter()
            .map(|hint| (hint.what, hint.how_text(ctx).unwrap_or_else(in_menu)))
            .collect(),
    });
    let menus = Menu::ALL.into_iter().map(|menu| Section {
        title: menu.label().to_owned(),
        rows: menu
            .commands()
            .map(|command| {
                let keys = command.keys_text(ctx);
                (command.label(), if keys.is_empty() { in_menu() } else { keys })
            })
            .collect(),
    });
    std::iter::once(mouse)
        .chain(tools)
        .chain(menus)
        .map(|mut section| {
            section
                .rows
                .retain(|(what, how)| format!("{what} {how}").to_lowercase().contains(&search));
            section
        })
        .filter(|section| !section.rows.is_empty())
        .collect()
}

fn in_menu() -> String {
    "in the menu".to_owned()
}

/// The section that the second column begins with, so that both are about as long.
fn middle(sections: &[Section]) -> usize {
    // A title takes the room of about two rows.
    let length = |section: &Section| section.rows.len() + 2;
    let total: usize = sections.iter().map(length).sum();
    let mut above = 0;
    sections
        .iter()
        .position(|section| {
            above += length(section);
            2 * above > total
        })
        .map_or(0, |index| index.max(1))
}

fn show(ui: &mut Ui, sections: &[Section]) {
    for section in sections {
        theme::section(ui, &section.title, |ui| {
            egui::Grid::new(&section.title)
                .num_columns(2)
                .min_col_width(COLUMN)
                .min_row_height(theme::FACT_HEIGHT)
                .spacing([SPACE_L, SPACE_XS])
                .show(ui, |ui| {
                    for (what, how) in &section.rows {
                        ui.label(*what);
                        ui.label(RichText::new(how).weak());
                        ui.end_row();
                    }
                });
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sheet_is_searched_by_words_and_by_keys() {
        let ctx = egui::Context::default();
        let rows = |search: &str| -> Vec<&str> {
            let sections = sections(&ctx, search);
            sections
                .iter()
                .flat_map(|section| section.rows.iter().map(|(what, _)| *what))
                .collect()
        };
        assert!(rows("").len() > 40);
        assert_eq!(rows("ctrl+shift+z"), ["Redo"]);
        assert!(rows(" ORBIT ").contains(&"Orbit left"));
        assert!(rows("no such thing").is_empty());
    }
}
