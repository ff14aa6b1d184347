//! The export window: where the oriented scan goes. Replacing a file needs a second word.

use std::path::{Path, PathBuf};

use egui::{Align2, Key, RichText, TextEdit, Ui, Vec2};

use super::open_path::typed_path;
use crate::theme::{self, SPACE_S};

/// The window with the target's path.
#[derive(Clone, Debug)]
pub struct ExportWindow {
    path: String,
    input: Option<PathBuf>,
    replace: bool,
    focused_once: bool,
    checked: Option<(String, Existing)>,
}

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
    Export {
        /// The file.
        path: PathBuf,
        /// The user agreed to replace the file that was opened.
        overwrite_input: bool,
    },
}

impl ExportWindow {
    /// Suggests `path`. `input` is the file that was opened, which is never replaced without asking.
    pub fn new(path: &Path, input: Option<PathBuf>) -> Self {
        Self {
            path: path.display().to_string(),
            input,
            replace: false,
            focused_once: false,
            checked: None,
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
            Some(path) if self.input.as_ref().is_some_and(|input| same_file(input, &path)) => Existing::Input,
            Some(_) => Existing::File,
        };
        self.checked = Some((self.path.clone(), existing));
        existing
    }

    /// Shows the window.
    pub fn ui(&mut self, ui: &Ui) -> Decision {
        let mut decision = Decision::Wait;
        egui::Window::new("Export")
            .collapsible(false)
            .resizable(false)
            .anchor(Align2::CENTER_CENTER, Vec2::ZERO)
            .show(ui.ctx(), |ui| {
                ui.set_width(520.0);
                let about = "The file as it was read, with oriented unit normals nx ny nz.";
                ui.add(egui::Label::new(RichText::new(about).weak()).wrap());
                let label = ui.label("Export to");
                let mut enter = false;
                ui.horizontal(|ui| {
                    let field = ui.add(TextEdit::singleline(&mut self.path).desired_width(416.0));
                    let field = field.labelled_by(label.id);
                    if field.changed() {
                        self.replace = false;
                    }
                    if !self.focused_once {
                        field.request_focus();
                        self.focused_once = true;
                    }
                    enter = field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
                    if ui
                        .button("Browse…")
                        .on_hover_text("Pick the file with the system's dialog")
                        .clicked()
                    {
                        decision = Decision::Browse;
                    }
                });
                let existing = self.existing();
                match existing {
                    Existing::Nothing => {}
                    Existing::File => {
                        ui.checkbox(&mut self.replace, "Replace the existing file");
                    }
                    Existing::Input => {
                        ui.checkbox(&mut self.replace, "Replace the scan that was opened");
                    }
                    Existing::Folder => {
                        let text = "This is a folder: add a file name.";
                        ui.label(RichText::new(text).color(ui.visuals().warn_fg_color));
                    }
                }
                let allowed = match existing {
                    Existing::Nothing => true,
                    Existing::File | Existing::Input => self.replace,
                    Existing::Folder => false,
                };
                let path = typed_path(&self.path).filter(|_| allowed);
                ui.add_space(SPACE_S);
                ui.horizontal(|ui| {
                    let export = ui.add_enabled(path.is_some(), theme::primary_button(ui, "Export"));
                    if (export.clicked() || enter)
                        && let Some(path) = path
                    {
                        decision = Decision::Export {
                            path,
                            overwrite_input: existing == Existing::Input,
                        };
                    }
                    if ui.button("Cancel").clicked() {
                        decision = Decision::Close;
                    }
                });
            });
        decision
    }
}

fn same_file(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
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
