//! The files of a scan as layers: opening several, adding more, hiding, selecting and showing them, exporting each.

use std::path::{Path, PathBuf};

use normend_core::document::State;
use normend_core::{Document, Edit, EditKind, PointSet, StateChange};
use normend_io::recipe::RecordedStep;
use normend_io::{LayerTarget, Scan, WriteOptions};

use crate::app::{App, Leaving};
use crate::command::{Action, Command};
use crate::panels::export::{ExportOrder, ExportWindow};
use crate::panels::export_layers::LayersWindow;
use crate::panels::modal::Modal;
use crate::session::Session;
use crate::settings::Purpose;
use crate::work::ScanOrigin;

/// What can be done with a file of the scan, by its index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayerAction {
    /// Show its points, or hide them.
    Show(usize, bool),
    /// Hide the points of all other files.
    Only(usize),
    /// Select its points.
    Select(usize),
    /// Bring it into view.
    Frame(usize),
}

impl From<LayerAction> for Action {
    fn from(action: LayerAction) -> Self {
        Self::Layers(action)
    }
}

/// What is carried over to the same scan with more files.
pub(crate) struct Added {
    /// The files that are opened then.
    paths: Vec<PathBuf>,
}

/// The points of a file of `scan`.
fn points_of(scan: &Scan, layer: usize) -> PointSet {
    let mut points = PointSet::new();
    if let Some(layer) = scan.layers().get(layer) {
        points.insert_range(layer.points.clone());
    }
    points
}

/// How many points of a file are hidden. O(containers of the set).
pub fn n_hidden(document: &Document, scan: &Scan, layer: usize) -> u64 {
    let points = scan.layers().get(layer).map_or(0..0, |layer| layer.points.clone());
    document.hidden().range_cardinality(points)
}

impl App {
    pub(crate) fn act_on_layers(&mut self, action: LayerAction) {
        let Some(session) = &self.session else { return };
        let hidden = session.document.hidden();
        let edit = match action {
            LayerAction::Show(layer, true) => Edit::Hide(hidden - points_of(&session.scan, layer)),
            LayerAction::Show(layer, false) => Edit::Hide(hidden | points_of(&session.scan, layer)),
            LayerAction::Only(layer) => {
                let mut others = PointSet::new();
                others.insert_range(0..session.scan.cloud.n_points() as u32);
                Edit::Hide(others - points_of(&session.scan, layer))
            }
            LayerAction::Select(layer) => Edit::Select(points_of(&session.scan, layer)),
            LayerAction::Frame(layer) => {
                let cloud = session.document.cloud();
                if let Some(layer) = session.scan.layers().get(layer) {
                    let place = |point: u32| cloud.positions()[point as usize];
                    let n_points = layer.n_points() as u64;
                    self.viewport.frame_some(n_points, layer.points.clone().map(place));
                }
                return;
            }
        };
        self.apply_edit(edit);
    }

    /// Opens files as the layers of one scan.
    pub(crate) fn open_files(&mut self, paths: Vec<PathBuf>) {
        if let Some(origin) = ScanOrigin::of_paths(paths) {
            self.leave(Leaving::Open(origin));
        }
    }

    /// Opens files as further layers of the open scan. What was decided stays.
    pub(crate) fn add_files(&mut self, more: Vec<PathBuf>) {
        let Some(session) = &self.session else {
            return self.open_files(more);
        };
        if let Err(reason) = self.availability(Command::AddFiles) {
            self.messages.error(format!("No file was added: {reason}."));
            return;
        }
        let layers = session.scan.layers().iter();
        let mut paths: Vec<PathBuf> = layers.filter_map(|layer| layer.path().cloned()).collect();
        let n_before = paths.len();
        for path in more {
            let is_same = |other: &PathBuf| *other == path || normend_io::is_same_file(other, &path);
            if paths.iter().any(is_same) {
                let name = ScanOrigin::File(path).name();
                self.messages.note(format!("{name} is a layer of this scan already."));
            } else {
                paths.push(path);
            }
        }
        if paths.len() > n_before {
            self.open(ScanOrigin::Files(paths.clone()));
            self.added = Some(Added { paths });
        }
    }

    /// What of the session so far goes on in one that is opened from `origin`: its state, where the new scan is the same one with more
    /// files.
    pub(crate) fn state_to_carry(&mut self, origin: &ScanOrigin, scan: &Scan) -> Option<State> {
        let added = self.added.take()?;
        let session = self.session.as_mut()?;
        let ScanOrigin::Files(paths) = origin else { return None };
        let is_same = |(a, b): (&normend_io::Layer, &normend_io::Layer)| {
            a.identity(&a.name).is_same_content(&b.identity(&b.name)) && a.points == b.points
        };
        let is_prefix = session.scan.layers().len() <= scan.layers().len()
            && session.scan.layers().iter().zip(scan.layers()).all(is_same);
        if added.paths != *paths || !is_prefix {
            return None;
        }
        let mut state = session.document.state().clone();
        // Viewpoints are measured from the cloud's origin.
        let moved = (session.scan.cloud.origin() - scan.cloud.origin()).as_vec3();
        state.viewpoints = state.viewpoints.iter().map(|&place| place + moved).collect();
        if state.parameters.start == normend_core::Start::Estimate && session.document.n_done() == 0 {
            // Nothing was decided: the parameters are those that suit what is open.
            return None;
        }
        // Its journal is not needed any more once its edits are in that of the new session.
        session.is_discarded = true;
        Some(state)
    }

    /// Goes on with the state of the same scan with fewer files, as one edit.
    pub(crate) fn carry_on(&mut self, state: &State) {
        let Some(session) = &mut self.session else { return };
        let step = RecordedStep {
            kind: EditKind::Recipe,
            n_turned: 0,
            change: StateChange::between(session.document.state(), state),
        };
        if step.change.is_empty() {
            return;
        }
        match session.repeat(&step) {
            Ok(change) => {
                if let Some(scene) = &mut self.scene {
                    scene.apply(&change, session);
                }
                self.orient_as_wanted();
            }
            Err(error) => self
                .messages
                .error(format!("The edits so far were not taken over: {error}.")),
        }
    }

    /// Asks where the oriented scan goes, or each of its files.
    pub(crate) fn ask_export_target(&mut self) {
        let Some(session) = &self.session else { return };
        let folder = self.settings.settings.folder(Purpose::Export);
        self.windows.modal = Some(if session.scan.layers().len() > 1 {
            Modal::ExportLayers(LayersWindow::new(&session.scan, folder, session.knows_confidence()))
        } else {
            let window = ExportWindow::new(&session.suggested_export(folder), session.scan.path().cloned())
                .with_changed_input(session.scan.is_changed_on_disk());
            Modal::Export(window.with_confidence(session.knows_confidence()))
        });
    }

    /// The window that asks once more after an export failed.
    pub(crate) fn export_window_after(session: &Session, order: &ExportOrder, problem: String) -> Modal {
        if order.further.is_empty() {
            let window = ExportWindow::after_failure(order, session.scan.path().cloned(), problem)
                .with_changed_input(session.scan.is_changed_on_disk())
                .with_confidence(session.knows_confidence());
            return Modal::Export(window);
        }
        let window = LayersWindow::new(&session.scan, None, session.knows_confidence());
        Modal::ExportLayers(window.after_failure(order, problem))
    }
}

impl ExportOrder {
    /// Where each file of the scan goes.
    pub(crate) fn targets(&self, rule: &str) -> Vec<LayerTarget> {
        let options = WriteOptions {
            rule: rule.to_owned(),
            overwrite_input: self.overwrite_input,
            overwrite_changed: self.overwrite_changed,
        };
        let target = |path: &PathBuf| LayerTarget {
            path: path.clone(),
            options: options.clone(),
        };
        self.paths().map(target).collect()
    }

    /// The files to write, in the order of the scan's.
    pub(crate) fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        std::iter::once(&self.path).chain(&self.further)
    }

    /// The same with full paths: a relative path means the folder that the editor was started in.
    pub(crate) fn absolute(mut self) -> Self {
        let absolute = |path: &mut PathBuf| {
            if let Ok(full) = std::path::absolute(&*path) {
                *path = full;
            }
        };
        absolute(&mut self.path);
        self.further.iter_mut().for_each(absolute);
        self
    }

    /// What is written, in words.
    pub(crate) fn words(&self) -> String {
        let name = |path: &Path| ScanOrigin::File(path.to_path_buf()).name();
        match self.further.len() {
            0 => name(&self.path),
            n => format!("{} + {n} more", name(&self.path)),
        }
    }
}
