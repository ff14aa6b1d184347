//! What the columns of a text are: shown with the first rows, for the user to confirm or to correct.

use egui::{ComboBox, Grid, RichText, ScrollArea, Ui};
use normend_io::TextColumns;

use super::modal;
use crate::theme::{self, SPACE_M, SPACE_S};

/// What a column can be besides what the file calls it.
const ROLES: [&str; 10] = ["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "intensity"];
/// Width of a column, in points.
const COLUMN_WIDTH: f32 = 92.0;

/// The window with the columns.
#[derive(Clone, Debug)]
pub struct ColumnsWindow {
    /// The file's name.
    name: String,
    columns: TextColumns,
    /// What each column is; empty for nothing in particular.
    chosen: Vec<String>,
}

/// What the user decided.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Not yet.
    Wait,
    /// It is right as it was read.
    Keep,
    /// Read it again with these names.
    Read(Vec<String>),
}

impl ColumnsWindow {
    /// The columns of the text called `name`, as they were read.
    pub fn new(name: String, columns: TextColumns) -> Self {
        Self {
            name,
            chosen: columns.names.clone(),
            columns,
        }
    }

    /// Shows the window.
    pub fn ui(&mut self, ui: &Ui) -> Decision {
        let width = (self.chosen.len() as f32 * (COLUMN_WIDTH + SPACE_M)).clamp(420.0, 900.0);
        modal::show(ui, "What the columns are", width, |ui| self.content(ui))
    }

    fn content(&mut self, ui: &mut Ui) -> Decision {
        let marks = if self.columns.has_decimal_commas {
            "commas"
        } else {
            "points"
        };
        let how = format!(
            "{} has {} with {} between them and numbers with decimal {marks}. Columns that are nothing in particular are kept as \
             they are.",
            self.name,
            theme::counted(self.chosen.len() as u64, "column", "columns"),
            self.columns.separator,
        );
        ui.add(egui::Label::new(RichText::new(how).weak()).wrap());
        ui.add_space(SPACE_S);
        ScrollArea::horizontal().show(ui, |ui| {
            Grid::new("columns")
                .striped(true)
                .spacing([SPACE_M, SPACE_S])
                .show(ui, |ui| {
                    for (index, chosen) in self.chosen.iter_mut().enumerate() {
                        role(ui, index, &self.columns.names[index], chosen);
                    }
                    ui.end_row();
                    for row in &self.columns.sample {
                        for value in row {
                            ui.label(RichText::new(theme::elided(value, 12)).monospace());
                        }
                        ui.end_row();
                    }
                });
        });
        ui.add_space(SPACE_S);
        let problem = problem(&self.chosen);
        let is_changed = self.chosen != self.columns.names;
        let mut decision = Decision::Wait;
        if let Some(problem) = problem {
            ui.colored_label(ui.visuals().warn_fg_color, problem);
        }
        ui.horizontal(|ui| {
            let label = if is_changed { "Read again" } else { "They are right" };
            let button = ui.add_enabled(problem.is_none(), theme::primary_button(ui, label));
            let tooltip = if is_changed {
                "Read the file with these columns (Enter)"
            } else {
                "Go on with the columns as they were read (Enter)"
            };
            let clicked = button.on_hover_text(tooltip).clicked();
            if clicked || (problem.is_none() && modal::enter_pressed(ui)) {
                decision = if is_changed {
                    Decision::Read(names(&self.chosen))
                } else {
                    Decision::Keep
                };
            }
            if is_changed && modal::cancel_button(ui) {
                decision = Decision::Keep;
            }
        });
        decision
    }
}

/// The list of what a column can be.
fn role(ui: &mut Ui, index: usize, own: &str, chosen: &mut String) {
    let shown = |name: &str| {
        if name.is_empty() {
            "–".to_owned()
        } else {
            name.to_owned()
        }
    };
    let list = ComboBox::from_id_salt(("column", index))
        .width(COLUMN_WIDTH)
        .selected_text(shown(chosen))
        .show_ui(ui, |ui| {
            let is_role = |name: &str| ROLES.contains(&name);
            // Nothing comes first: it is chosen most, and the end of the list has to be scrolled to.
            let own = [own].into_iter().filter(|name| !name.is_empty() && !is_role(name));
            for name in [""].into_iter().chain(own).chain(ROLES) {
                ui.selectable_value(chosen, name.to_owned(), shown(name));
            }
        });
    let label = format!("Column {} is", index + 1);
    list.response.widget_info(|| {
        let mut info = egui::WidgetInfo::labeled(egui::Role::ComboBox, true, &label);
        info.current_text_value = Some(shown(chosen));
        info
    });
    list.response.on_hover_text(label);
}

/// What has to be mended first.
fn problem(chosen: &[String]) -> Option<&'static str> {
    let count = |wanted: &str| chosen.iter().filter(|name| name.eq_ignore_ascii_case(wanted)).count();
    if ["x", "y", "z"].iter().any(|axis| count(axis) != 1) {
        return Some("One column has to be x, one y and one z.");
    }
    let normal = ["nx", "ny", "nz"].map(count);
    (normal != [0; 3] && normal != [1; 3]).then_some("A normal is nx, ny and nz, once each.")
}

/// The names as the reader takes them.
fn names(chosen: &[String]) -> Vec<String> {
    let name = |name: &String| if name.is_empty() { "-".to_owned() } else { name.clone() };
    chosen.iter().map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_and_normals_are_named_whole() {
        let check = |names: &str, expect: bool| {
            let chosen: Vec<String> = names.split(' ').map(|name| name.replace('-', "")).collect();
            assert_eq!(problem(&chosen).is_none(), expect, "{names}");
        };
        check("x y z", true);
        check("- z y x - nx ny nz", true);
        check("X Y Z", true);
        check("x y", false);
        check("x y z x", false);
        check("x y z nx ny", false);
        check("x y z nx ny nz nx", false);
        assert_eq!(names(&["x".into(), String::new()]), ["x", "-"]);
    }
}
