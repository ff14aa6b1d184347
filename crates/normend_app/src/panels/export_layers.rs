//! The export window of a scan of several files: each goes to a file of its own. Replacing files needs a second word.

use std::path::{Path, PathBuf};

use egui::{Checkbox, Label, RichText, ScrollArea, TextEdit, Ui};
use normend_io::{Scan, is_same_file};

use super::export::{ExportOrder, NO_CONFIDENCE};
use super::modal;
use super::open_path::typed_path;
use crate::theme::{self, SPACE_S};

const WIDTH: f32 = 560.0;
/// Room for the files before they scroll, in points: about eight.
const LIST_HEIGHT: f32 = 250.0;
/// Room for the reason why nothing was exported, two lines of it, so that the window keeps its size.
const PROBLEM_HEIGHT: f32 = 38.0;
/// Width of a file's own name beside its target, in points.
const NAME_WIDTH: f32 = 170.0;

/// The window with a target for each file.
#[derive(Clone, Debug)]
pub struct LayersWindow {
    rows: Vec<Row>,
    /// Empty: each beside its source.
    folder: String,
    replace: bool,
    with_confidence: bool,
    knows_confidence: bool,
    /// What the targets were when [`Self::found`] was looked up.
    checked: Option<Vec<Option<PathBuf>>>,
    found: Found,
    problem: Option<String>,
    is_input_changed: bool,
}

/// A file of the scan and the name of its target.
#[derive(Clone, Debug)]
struct Row {
    name: String,
    source: Option<PathBuf>,
    target: String,
}

/// What is at the targets.
#[derive(Clone, Debug, Default)]
struct Found {
    /// Files that would be replaced, and how many of them are inputs.
    n_existing: usize,
    n_inputs: usize,
    refusal: Option<String>,
}

/// What the user decided.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Not yet.
    Wait,
    /// Nothing is exported.
    Close,
    /// Pick the folder with the system's dialog.
    Browse,
    /// Write them.
    Export(ExportOrder),
}

impl LayersWindow {
    /// Suggests a name for each file of `scan`, in `folder` or, without one, beside each file.
    pub fn new(scan: &Scan, folder: Option<&Path>, knows_confidence: bool) -> Self {
        let row = |layer: &normend_io::Layer| {
            let name = Path::new(&layer.name);
            let stem = name.file_stem().unwrap_or_default().to_string_lossy();
            let usual = layer.format.extensions().first().copied().unwrap_or("ply");
            let extension = name
                .extension()
                .map_or(usual.into(), |extension| extension.to_string_lossy());
            Row {
                name: layer.name.clone(),
                source: layer.path().cloned(),
                target: format!("{stem}_oriented.{extension}"),
            }
        };
        Self {
            rows: scan.layers().iter().map(row).collect(),
            folder: folder.map(|folder| folder.display().to_string()).unwrap_or_default(),
            replace: false,
            with_confidence: false,
            knows_confidence,
            checked: None,
            found: Found::default(),
            problem: None,
            is_input_changed: scan.is_changed_on_disk(),
        }
    }

    /// The same window after an export failed, with its targets and the reason.
    pub fn after_failure(mut self, order: &ExportOrder, problem: String) -> Self {
        self.folder = String::new();
        for (row, path) in self.rows.iter_mut().zip(order.paths()) {
            row.target = path.display().to_string();
        }
        self.with_confidence = order.with_confidence;
        self.problem = Some(problem);
        self
    }

    /// The folder in the field; empty where files go beside their sources.
    pub fn folder(&self) -> &str {
        &self.folder
    }

    /// Puts the folder that the system's dialog gave into the field.
    pub fn set_folder(&mut self, folder: &Path) {
        self.folder = folder.display().to_string();
        self.problem = None;
    }

    /// Where a file goes; `None` where no name is typed.
    fn target(&self, row: &Row) -> Option<PathBuf> {
        let name = typed_path(&row.target)?;
        let beside = row.source.as_ref().and_then(|source| source.parent());
        let folder = typed_path(&self.folder).or_else(|| beside.map(Path::to_path_buf));
        // A full path stays as it is.
        Some(folder.unwrap_or_default().join(name))
    }

    /// Looks at the targets, when they have changed since the last time.
    fn look(&mut self) {
        let targets: Vec<Option<PathBuf>> = self.rows.iter().map(|row| self.target(row)).collect();
        if self.checked.as_ref() == Some(&targets) {
            return;
        }
        let mut found = Found::default();
        for (index, (row, target)) in self.rows.iter().zip(&targets).enumerate() {
            let Some(target) = target else {
                found.refusal.get_or_insert(format!("Type a name for {}.", row.name));
                continue;
            };
            let is_source = |row: &Row| row.source.as_ref().is_some_and(|source| is_same_file(source, target));
            let others = self.rows.iter().enumerate().filter(|(other, _)| *other != index);
            if targets[..index].contains(&Some(target.clone())) {
                let twice = format!(
                    "Two files would be written to {}: give each its own name.",
                    target.display()
                );
                found.refusal.get_or_insert(twice);
            } else if others.map(|(_, row)| row).any(is_source) {
                let other = format!("{} is another file of this scan: type another name.", target.display());
                found.refusal.get_or_insert(other);
            } else if target.is_dir() {
                found
                    .refusal
                    .get_or_insert(format!("{} is a folder: type a file name.", target.display()));
            } else if target.exists() {
                found.n_existing += 1;
                found.n_inputs += usize::from(is_source(row));
            }
        }
        (self.checked, self.found) = (Some(targets), found);
    }

    /// Why nothing can be exported as things are; `None` when it can.
    fn refusal(&self) -> Option<String> {
        let asks = self.found.n_existing > 0 && !self.replace;
        let word = || "Files with these names exist: tick “Replace”, or choose other names.".to_owned();
        self.found.refusal.clone().or_else(|| asks.then(word))
    }

    /// Shows the window.
    pub fn ui(&mut self, ui: &Ui) -> Decision {
        modal::show(ui, "Export", WIDTH, |ui| self.content(ui))
    }

    fn content(&mut self, ui: &mut Ui) -> Decision {
        let mut decision = Decision::Wait;
        let about = "Each file as it was read, with oriented unit normals nx ny nz, to a file of its own.";
        ui.add(Label::new(RichText::new(about).weak()).wrap());
        let label = ui.label("Folder");
        ui.horizontal(|ui| {
            let field = TextEdit::singleline(&mut self.folder).desired_width(456.0);
            let field = ui.add(field.hint_text("Beside each file")).labelled_by(label.id);
            if field.changed() {
                (self.replace, self.problem) = (false, None);
            }
            let browse = ui.button("Browse…");
            if browse
                .on_hover_text("Pick the folder with the system's dialog")
                .clicked()
            {
                decision = Decision::Browse;
            }
        });
        ui.add_space(SPACE_S);
        ScrollArea::vertical()
            .max_height(LIST_HEIGHT)
            .auto_shrink([false, true])
            .show(ui, |ui| {
                for row in &mut self.rows {
                    ui.horizontal(|ui| {
                        let size = egui::Vec2::new(NAME_WIDTH, ui.spacing().interact_size.y);
                        let layout = egui::Layout::left_to_right(egui::Align::Center);
                        let label = ui.allocate_ui_with_layout(size, layout, |ui| {
                            ui.set_min_width(NAME_WIDTH);
                            ui.add(Label::new(&row.name).truncate())
                        });
                        let field = ui.add(TextEdit::singleline(&mut row.target).desired_width(f32::INFINITY));
                        if field.labelled_by(label.inner.id).changed() {
                            (self.replace, self.problem) = (false, None);
                        }
                    });
                }
            });
        self.look();
        ui.horizontal(|ui| {
            ui.set_min_height(ui.spacing().interact_size.y);
            if self.found.n_existing > 0 {
                let files = theme::counted(self.found.n_existing as u64, "existing file", "existing files");
                let words = match (self.found.n_inputs, self.is_input_changed) {
                    (0, _) => format!("Replace {files}"),
                    (n, false) => format!("Replace {files}, {n} of them opened here"),
                    (n, true) => {
                        format!("Replace {files}, {n} of them opened here, and lose changes of other programs")
                    }
                };
                if ui.checkbox(&mut self.replace, words).changed() {
                    self.problem = None;
                }
            }
        });
        self.with_confidence &= self.knows_confidence;
        let confidence = ui.add_enabled(
            self.knows_confidence,
            Checkbox::new(&mut self.with_confidence, "With confidence"),
        );
        if confidence.on_disabled_hover_text(NO_CONFIDENCE).changed() {
            self.problem = None;
        }
        let refusal = self.refusal();
        ui.vertical(|ui| {
            ui.set_min_height(PROBLEM_HEIGHT);
            if let Some(problem) = self.problem.as_ref().or(self.found.refusal.as_ref()) {
                ui.add(Label::new(RichText::new(problem).color(ui.visuals().error_fg_color)).wrap());
            }
        });
        ui.add_space(SPACE_S);
        ui.horizontal(|ui| {
            let enter = modal::enter_pressed(ui);
            let n_files = theme::counted(self.rows.len() as u64, "file", "files");
            let export = theme::primary_button(ui, &format!("Export {n_files}"));
            let export = ui.add_enabled(refusal.is_none(), export);
            let export = export.on_hover_text("Write the files (Enter)");
            let export = export.on_disabled_hover_text(refusal.clone().unwrap_or_default());
            if export.clicked() || enter {
                let targets: Option<Vec<PathBuf>> = self.rows.iter().map(|row| self.target(row)).collect();
                match (refusal, targets.unwrap_or_default().split_first()) {
                    (None, Some((path, further))) => {
                        let is_input = self.found.n_inputs > 0;
                        decision = Decision::Export(ExportOrder {
                            path: path.clone(),
                            further: further.to_vec(),
                            overwrite_input: is_input,
                            overwrite_changed: is_input && self.is_input_changed,
                            with_confidence: self.with_confidence,
                        });
                    }
                    (refusal, _) => self.problem = refusal,
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
    use normend_core::Silent;

    use super::*;

    #[test]
    fn targets_are_looked_at_before_anything_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for name in ["a.xyz", "b.xyz"] {
            std::fs::write(path(name), "1 2 3\n4 5 6\n").unwrap();
        }
        let read = |name: &str| normend_io::read(&path(name), &Silent).unwrap();
        let scan = Scan::together(vec![read("a.xyz"), read("b.xyz")], &Silent).unwrap();
        let mut window = LayersWindow::new(&scan, None, true);
        window.look();
        assert_eq!(window.refusal(), None);
        assert_eq!(window.target(&window.rows[1]), Some(path("b_oriented.xyz")));

        std::fs::write(path("b_oriented.xyz"), "").unwrap();
        window.checked = None;
        window.look();
        assert_eq!((window.found.n_existing, window.found.n_inputs), (1, 0));
        assert!(window.refusal().is_some());
        window.replace = true;
        assert_eq!(window.refusal(), None);

        for (target, words) in [
            ("a_oriented.xyz", "Two files"),
            ("a.xyz", "another file"),
            ("", "Type a name"),
        ] {
            window.rows[1].target = target.to_owned();
            window.look();
            assert!(
                window.refusal().unwrap().contains(words),
                "{target}: {:?}",
                window.refusal()
            );
        }
        window.rows[1].target = "b.xyz".to_owned();
        window.look();
        assert_eq!((window.found.n_existing, window.found.n_inputs), (1, 1));
    }
}
