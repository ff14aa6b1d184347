//! Opening a scan or a recipe by typing its path: works where no file dialog does.

use std::path::PathBuf;

use egui::{RichText, TextEdit, Ui};

use super::modal;
use crate::theme::{self, SPACE_S};

/// The window with the path field.
#[derive(Clone, Debug, Default)]
pub struct OpenPathWindow {
    /// What is opened.
    pub what: What,
    path: String,
    note: Option<String>,
    focused_once: bool,
}

/// What is opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum What {
    /// A scan.
    #[default]
    Scan,
    /// A file that is added to the open scan.
    Layer,
    /// A recipe, for the scan that is open.
    Recipe,
    /// A file that the open scan is compared with.
    Reference,
}

/// What the user decided.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Not yet.
    Wait,
    /// Nothing is opened.
    Close,
    /// Open this file.
    Open(PathBuf),
}

impl OpenPathWindow {
    /// An empty field; `note` says why it is shown when the user did not ask for it.
    pub fn new(what: What, note: Option<String>) -> Self {
        Self {
            what,
            note,
            ..Self::default()
        }
    }

    /// Shows the window.
    pub fn ui(&mut self, ui: &Ui) -> Decision {
        let title = match self.what {
            What::Scan => "Open a scan",
            What::Layer => "Add a file",
            What::Recipe => "Open a recipe",
            What::Reference => "Compare with a reference",
        };
        modal::show(ui, title, 460.0, |ui| self.content(ui))
    }

    fn content(&mut self, ui: &mut Ui) -> Decision {
        let mut decision = Decision::Wait;
        if let Some(note) = &self.note {
            ui.add(egui::Label::new(RichText::new(note).weak()).wrap());
        }
        let label = ui.label(match self.what {
            What::Scan => "Path of the scan",
            What::Layer => "Path of the file",
            What::Recipe => "Path of the recipe",
            What::Reference => "Path of the reference",
        });
        let field = ui.add(TextEdit::singleline(&mut self.path).desired_width(f32::INFINITY));
        let field = field.labelled_by(label.id);
        let path = typed_path(&self.path);
        let enter = modal::enter_pressed(ui);
        // An Enter without a path opens nothing, and typing goes on.
        if !self.focused_once || (enter && path.is_none()) {
            field.request_focus();
            self.focused_once = true;
        }
        ui.add_space(SPACE_S);
        ui.horizontal(|ui| {
            let open = ui.add_enabled(path.is_some(), theme::primary_button(ui, "Open"));
            let open = open.on_hover_text("Open this file (Enter)");
            let open = open.on_disabled_hover_text("Type a path first");
            if (open.clicked() || enter)
                && let Some(path) = path
            {
                decision = Decision::Open(path);
            }
            if modal::cancel_button(ui) {
                decision = Decision::Close;
            }
        });
        decision
    }
}

/// The path that the user means: without spaces or quotes around it, and with `~/` as the home folder.
pub fn typed_path(text: &str) -> Option<PathBuf> {
    let text = text.trim();
    let text = ['"', '\'']
        .iter()
        .find_map(|&quote| text.strip_prefix(quote)?.strip_suffix(quote))
        .unwrap_or(text);
    if text.is_empty() {
        return None;
    }
    if let Some(rest) = text.strip_prefix("~/")
        && let Some(folders) = directories::BaseDirs::new()
    {
        return Some(folders.home_dir().join(rest));
    }
    Some(PathBuf::from(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typed_paths_are_what_the_user_means() {
        let check = |text, expect: Option<&str>| assert_eq!(typed_path(text), expect.map(PathBuf::from));
        check("", None);
        check("  ", None);
        check("\"\"", None);
        check(" /scans/a b.ply ", Some("/scans/a b.ply"));
        check("'/scans/a b.ply'", Some("/scans/a b.ply"));
        let home = directories::BaseDirs::new().unwrap().home_dir().join("a.ply");
        assert_eq!(typed_path("~/a.ply"), Some(home));
    }
}
