//! Asking what the columns of a text are, and remembering the answer.

use std::path::{Path, PathBuf};

use normend_io::ReadOptions;
use serde::{Deserialize, Serialize};

use crate::app::{App, Leaving};
use crate::panels::columns::{ColumnsWindow, Decision};
use crate::panels::modal::Modal;
use crate::settings::Settings;
use crate::work::ScanOrigin;

/// Texts whose columns are remembered.
const MOST_KNOWN: usize = 50;

/// What the user said of a text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KnownColumns {
    /// The file.
    path: PathBuf,
    /// The names of its columns; none where they are right as they are read.
    names: Vec<String>,
}

impl Settings {
    /// How the user wants a scan to be read.
    pub fn read_options(&self, origin: &ScanOrigin) -> ReadOptions {
        let known = match origin {
            ScanOrigin::File(path) => self.known_columns(path).filter(|known| !known.names.is_empty()),
            ScanOrigin::Files(_) | ScanOrigin::Sample => None,
        };
        ReadOptions {
            columns: known.map(|known| known.names.clone()),
        }
    }

    fn known_columns(&self, path: &Path) -> Option<&KnownColumns> {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        self.columns.iter().find(|known| known.path == path)
    }

    fn remember_columns(&mut self, path: &Path, names: Vec<String>) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        self.columns.retain(|known| known.path != path);
        self.columns.insert(0, KnownColumns { path, names });
        self.columns.truncate(MOST_KNOWN);
    }
}

impl App {
    /// Shows what the columns of the open text are.
    pub(crate) fn ask_columns(&mut self) {
        let Some(session) = &self.session else { return };
        if let Some(columns) = session.scan.text_columns() {
            self.windows.modal = Some(Modal::Columns(ColumnsWindow::new(session.name.clone(), columns)));
        }
    }

    /// Shows them where nobody can be certain, unless the user said it before.
    pub(crate) fn ask_doubtful_columns(&mut self) {
        let Some(session) = &self.session else { return };
        let path = session.scan.path();
        let is_known = path.is_some_and(|path| self.settings.settings.known_columns(path).is_some());
        let is_certain = (session.scan.text_columns()).is_none_or(|columns| columns.is_certain);
        if self.windows.modal.is_none() && !is_known && !is_certain {
            self.ask_columns();
        }
    }

    /// Does what was decided in the window.
    pub(crate) fn decide_columns(&mut self, window: ColumnsWindow, decision: Decision) {
        let path = self.session.as_ref().and_then(|session| session.scan.path().cloned());
        match decision {
            Decision::Wait => self.windows.modal = Some(Modal::Columns(window)),
            Decision::Keep => {
                let given = self.session.as_ref().and_then(|session| session.scan.columns_given());
                if let (None, Some(path)) = (given, &path) {
                    self.settings.settings.remember_columns(path, Vec::new());
                }
            }
            Decision::Read(names) => {
                if let Some(path) = path {
                    self.settings.settings.remember_columns(&path, names);
                    self.leave(Leaving::Open(ScanOrigin::File(path)));
                }
            }
        }
    }
}
