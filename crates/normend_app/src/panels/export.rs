//! The export window: where the oriented scan goes, or a recipe. Replacing a file needs a second word.

use std::path::{Path, PathBuf};

use egui::{Checkbox, Label, RichText, TextEdit, Ui};
use normend_io::{is_same_file, n_other_names};

use super::modal;
use super::open_path::typed_path;
use crate::theme::{self, SPACE_S};

const WIDTH: f32 = 520.0;
/// Room for the reason why nothing was exported, two lines of it, so that the window keeps its size.
const PROBLEM_HEIGHT: f32 = 38.0;
/// What confidence is, in the window.
const CONFIDENCE: &str = "Adds two values to each point: confidence, from 0 to 1, how sure the automatic method was of \
                          its side before any mend, and oriented, 0 where that was no more than a guess.\n\
                          To PLY from PLY, or text whose columns have names.";
/// What is to be known before the opened scan is replaced.
const INPUT_CHANGED: &str = "Another program has changed this file since it was opened. The export is made of what was opened: type \
                             another name to keep both.";
/// Why there is none.
pub(crate) const NO_CONFIDENCE: &str =
    "Only the automatic method knows how sure it is: propagate with the preset Automatic first";

/// The window with the target's path.
#[derive(Clone, Debug)]
pub struct ExportWindow {
    words: &'static Words,
    path: String,
    input: Option<PathBuf>,
    replace: bool,
    /// Whether confidence is written too, where it can be.
    with_confidence: bool,
    /// Confidence is known; `None` for what has none at all.
    knows_confidence: Option<bool>,
    wants_focus: bool,
    checked: Option<(String, Existing)>,
    problem: Option<String>,
    /// Another program has changed the input since it was opened.
    is_input_changed: bool,
    /// Other names of the file at the target, which keep the old content.
    n_other_names: u64,
}

/// What the window is about.
#[derive(Debug)]
struct Words {
    title: &'static str,
    about: &'static str,
    field: &'static str,
    button: &'static str,
    /// The file that was opened can be the target.
    may_replace_input: bool,
}

const EXPORT: Words = Words {
    title: "Export",
    about: "The file as it was read, with oriented unit normals nx ny nz.",
    field: "Export to",
    button: "Export",
    may_replace_input: true,
};

const RECIPE: Words = Words {
    title: "Save recipe",
    about: "What you decided, without the points: it can be opened with this scan again, or replayed without a window.",
    field: "Save to",
    button: "Save",
    may_replace_input: false,
};

/// What is at the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Existing {
    Nothing,
    File,
    Input,
    Folder,
}

/// What the user decided.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Not yet.
    Wait,
    /// Nothing is exported.
    Close,
    /// Pick the target with the system's dialog.
    Browse,
    /// Write there.
    Export(ExportOrder),
}

/// What is written, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportOrder {
    /// The file; of a scan of several, the first one's.
    pub path: PathBuf,
    /// Where the other files of the scan go, in their order; empty for a scan of one.
    pub further: Vec<PathBuf>,
    /// The user agreed to replace the file that was opened.
    pub overwrite_input: bool,
    /// And that the changes of another program are lost with it.
    pub overwrite_changed: bool,
    /// How sure the automatic method is of each point is written too.
    pub with_confidence: bool,
}

impl ExportWindow {
    /// Suggests `path`. `input` is the file that was opened, which is never replaced without asking.
    pub fn new(path: &Path, input: Option<PathBuf>) -> Self {
        Self {
            words: &EXPORT,
            path: path.display().to_string(),
            input,
            replace: false,
            with_confidence: false,
            knows_confidence: None,
            wants_focus: true,
            checked: None,
            problem: None,
            is_input_changed: false,
            n_other_names: 0,
        }
    }

    /// The same window about an input that another program has changed since it was opened, or not.
    pub fn with_changed_input(self, is_input_changed: bool) -> Self {
        Self {
            is_input_changed,
            ..self
        }
    }

    /// The same window with a box for confidence, which can be ticked where it is `known`.
    pub fn with_confidence(self, known: bool) -> Self {
        Self {
            knows_confidence: Some(known),
            ..self
        }
    }

    /// The window for a recipe. `input` is the scan that was opened, which is never replaced.
    pub fn for_recipe(path: &Path, input: Option<PathBuf>) -> Self {
        Self {
            words: &RECIPE,
            ..Self::new(path, input)
        }
    }

    /// The window again after an export failed, with the reason.
    pub fn after_failure(order: &ExportOrder, input: Option<PathBuf>, reason: String) -> Self {
        Self {
            problem: Some(reason),
            with_confidence: order.with_confidence,
            ..Self::new(&order.path, input)
        }
    }

    /// The path in the field.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Puts the path that the system's dialog gave into the field. Such a dialog asks before it names an existing file.
    pub fn set_path(&mut self, path: &Path) {
        self.path = path.display().to_string();
        self.checked = None;
        self.problem = None;
        self.replace = self.existing() == Existing::File;
    }

    fn existing(&mut self) -> Existing {
        if let Some((path, existing)) = &self.checked
            && *path == self.path
        {
            return *existing;
        }
        let existing = match typed_path(&self.path) {
            None => Existing::Nothing,
            Some(path) if path.is_dir() => Existing::Folder,
            Some(path) if !path.exists() => Existing::Nothing,
            Some(path) if self.input.as_ref().is_some_and(|input| is_same_file(input, &path)) => Existing::Input,
            Some(_) => Existing::File,
        };
        self.n_other_names = typed_path(&self.path).map_or(0, |path| n_other_names(&path));
        self.checked = Some((self.path.clone(), existing));
        existing
    }

    /// Why nothing can be exported to the path in the field as things are; `None` when it can.
    fn refusal(&mut self) -> Option<&'static str> {
        if typed_path(&self.path).is_none() {
            return Some("Type the path of the file to write.");
        }
        match self.existing() {
            Existing::Nothing => None,
            Existing::Folder => Some("This is a folder: add a file name."),
            Existing::Input if !self.words.may_replace_input => Some("This is the opened scan: type another name."),
            Existing::File | Existing::Input if self.replace => None,
            Existing::File => Some("This file exists: tick “Replace the existing file”, or type another name."),
            Existing::Input => Some("This is the opened scan: tick “Replace the scan”, or type another name."),
        }
    }

    /// Shows the window.
    pub fn ui(&mut self, ui: &Ui) -> Decision {
        modal::show(ui, self.words.title, WIDTH, |ui| self.content(ui))
    }

    fn content(&mut self, ui: &mut Ui) -> Decision {
        let mut decision = Decision::Wait;
        ui.add(Label::new(RichText::new(self.words.about).weak()).wrap());
        let label = ui.label(self.words.field);
        ui.horizontal(|ui| {
            let field = ui.add(TextEdit::singleline(&mut self.path).desired_width(416.0));
            let field = field.labelled_by(label.id);
            if field.changed() {
                self.replace = false;
                self.problem = None;
            }
            if std::mem::take(&mut self.wants_focus) {
                field.request_focus();
            }
            let browse = ui.button("Browse…");
            if browse.on_hover_text("Pick the file with the system's dialog").clicked() {
                decision = Decision::Browse;
            }
        });
        let existing = self.existing();
        ui.horizontal(|ui| {
            ui.set_min_height(ui.spacing().interact_size.y);
            let replace = match existing {
                Existing::Nothing | Existing::Folder => return,
                Existing::Input if !self.words.may_replace_input => return,
                Existing::File => "Replace the existing file",
                Existing::Input if self.is_input_changed => "Replace the scan, and lose those changes",
                Existing::Input => "Replace the scan that was opened",
            };
            if ui.checkbox(&mut self.replace, replace).changed() {
                self.problem = None;
            }
        });
        if let Some(known) = self.knows_confidence {
            self.with_confidence &= known;
            let confidence = ui.add_enabled(known, Checkbox::new(&mut self.with_confidence, "With confidence"));
            let confidence = confidence
                .on_hover_text(CONFIDENCE)
                .on_disabled_hover_text(NO_CONFIDENCE);
            if confidence.changed() {
                self.problem = None;
            }
        }
        ui.vertical(|ui| {
            ui.set_min_height(PROBLEM_HEIGHT);
            let is_never = existing == Existing::Input && !self.words.may_replace_input;
            if (existing == Existing::Folder || is_never) && self.problem.is_none() {
                self.problem = self.refusal().map(str::to_owned);
            }
            if let Some(problem) = &self.problem {
                ui.add(Label::new(RichText::new(problem).color(ui.visuals().error_fg_color)).wrap());
            } else if existing == Existing::Input && self.is_input_changed {
                ui.add(Label::new(RichText::new(INPUT_CHANGED).color(ui.visuals().warn_fg_color)).wrap());
            } else if self.n_other_names > 0 && !is_never {
                let others = theme::counted(self.n_other_names, "other name", "other names");
                let note = format!("This file has {others} (hard links). They keep the old content.");
                ui.add(Label::new(RichText::new(note).weak()).wrap());
            }
        });
        ui.add_space(SPACE_S);
        ui.horizontal(|ui| {
            let enter = modal::enter_pressed(ui);
            let refusal = self.refusal();
            let export = ui.add_enabled(refusal.is_none(), theme::primary_button(ui, self.words.button));
            let export = export.on_hover_text("Write the file (Enter)");
            let export = export.on_disabled_hover_text(refusal.unwrap_or_default());
            if export.clicked() || enter {
                match (refusal, typed_path(&self.path)) {
                    (None, Some(path)) => {
                        decision = Decision::Export(ExportOrder {
                            path,
                            further: Vec::new(),
                            overwrite_input: existing == Existing::Input,
                            overwrite_changed: existing == Existing::Input && self.is_input_changed,
                            with_confidence: self.with_confidence,
                        });
                    }
                    (refusal, _) => {
                        self.problem = refusal.map(str::to_owned);
                        self.wants_focus = true;
                    }
                }
            }
            if modal::cancel_button(ui) {
                decision = Decision::Close;
            }
        });
        decision
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn existing_targets_are_told_apart() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("in.ply");
        let other = folder.path().join("other.ply");
        std::fs::write(&input, "in").unwrap();
        std::fs::write(&other, "other").unwrap();
        let check = |path: &Path, expect| {
            let mut window = ExportWindow::new(path, Some(input.clone()));
            assert_eq!(window.existing(), expect, "{}", path.display());
        };
        check(&folder.path().join("new.ply"), Existing::Nothing);
        check(&other, Existing::File);
        check(&input, Existing::Input);
        check(&folder.path().join("./in.ply"), Existing::Input);
        check(folder.path(), Existing::Folder);
    }

    #[test]
    fn the_dialog_agrees_to_other_files_but_not_to_the_input() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("in.ply");
        let other = folder.path().join("other.ply");
        std::fs::write(&input, "in").unwrap();
        std::fs::write(&other, "other").unwrap();
        let mut window = ExportWindow::new(&folder.path().join("new.ply"), Some(input.clone()));
        window.set_path(&other);
        assert!(window.replace);
        window.set_path(&input);
        assert!(!window.replace);
    }
}
