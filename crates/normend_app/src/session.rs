//! One open scan: the file, the document made of it, and what the user has chosen but not applied yet.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use normend_core::document::Step;
use normend_core::{Change, Document, Edit, EditError, EditKind, Parameters, Propagation, SpanningTree, Start};
use normend_io::Scan;

/// An open scan.
pub struct Session {
    /// The file.
    pub scan: Arc<Scan>,
    /// Its name, without folders.
    pub name: String,
    /// Cloud, parameters, sources, history.
    pub document: Document,
    /// The parameters that the panel shows; applied by Propagate.
    pub draft: Parameters,
    /// The parameters of the running propagation, or of the last one when none runs.
    pub requested: Parameters,
    /// Points whose source is selected.
    pub selected: BTreeSet<u32>,
    /// The source that the last edit made, until the list has shown it.
    pub reveal: Option<u32>,
    /// Points without a normal in the file, which is fitted also where given normals are kept.
    pub n_without_normal: usize,
    /// Components whose right side nothing tells but a source of the user, ascending, as indices of the tree's roots.
    undecided: Vec<usize>,
    saved_revision: u64,
}

impl Session {
    /// A session for a scan that was just read. Given normals are kept as the start: they may come from another
    /// program, and mending them is what the user came for.
    pub fn new(scan: Scan, name: String) -> Self {
        let parameters = Parameters {
            start: if scan.given_normals.is_some() {
                Start::Keep
            } else {
                Start::Estimate
            },
            ..Parameters::default()
        };
        let document = Document::new(Arc::clone(&scan.cloud), scan.given_normals.clone()).with_parameters(parameters);
        let n_points = scan.cloud.n_points();
        let n_without_normal = scan.given_normals.as_ref().map_or(n_points, |normals| {
            normals.iter().filter(|&&normal| normal == glam::Vec3::ZERO).count()
        });
        Self {
            reveal: None,
            n_without_normal,
            undecided: Vec::new(),
            saved_revision: document.signs_revision(),
            scan: Arc::new(scan),
            name,
            document,
            draft: parameters,
            requested: parameters,
            selected: BTreeSet::new(),
        }
    }

    /// Whether there are mends, or other parameters than the first, that no exported file has.
    pub fn is_unsaved(&self) -> bool {
        self.document.signs_revision() != self.saved_revision
    }

    /// Whether there are mends among what is unsaved; else other parameters alone.
    pub fn has_unsaved_mends(&self) -> bool {
        let mends = |step: &Step| step.change().is_of_signs() && step.kind() != EditKind::SetParameters;
        self.is_unsaved() && self.document.steps().take(self.document.n_done()).any(mends)
    }

    /// Remembers that the signs of `revision` are in an exported file.
    pub fn mark_saved(&mut self, revision: u64) {
        self.saved_revision = revision;
    }

    /// Makes a propagation the one in force. The first is what the file is without the user, so it is nothing to lose.
    pub fn install(&mut self, propagation: Propagation) {
        let voted: BTreeSet<usize> = (propagation.voted_sources.iter())
            .map(|source| component(&propagation.tree, source.point))
            .collect();
        self.undecided = (propagation.sides.iter().enumerate())
            .filter(|(component, side)| side.rule.is_none() && !voted.contains(component))
            .map(|(component, _)| component)
            .collect();
        self.requested = propagation.parameters;
        // What was asked for is a step of the history from now on; the first parameters are none.
        // It names no points, so it cannot be refused.
        drop(self.document.apply(Edit::SetParameters(self.requested)));
        self.document.install(propagation);
    }

    /// How many components could face either way: nothing tells their right side, and the user has not said it.
    pub fn n_undecided(&self) -> usize {
        let Some(propagation) = self.document.propagation().filter(|_| !self.undecided.is_empty()) else {
            return 0;
        };
        let said: BTreeSet<usize> = (self.document.sources().iter())
            .map(|source| component(&propagation.tree, source.point))
            .collect();
        self.undecided
            .iter()
            .filter(|component| !said.contains(component))
            .count()
    }

    /// Applies an edit and keeps the selection to points that are sources.
    ///
    /// # Errors
    /// As [`Document::apply`].
    pub fn apply(&mut self, edit: Edit) -> Result<Change, EditError> {
        let made = match edit {
            Edit::Mend(point) | Edit::TurnPatch { point, .. } | Edit::TurnWhole(point) => Some(point),
            _ => None,
        };
        let change = self.document.apply(edit)?;
        self.reveal = made;
        self.prune_selection();
        Ok(change)
    }

    /// Takes the last edit back.
    pub fn undo(&mut self) -> Option<Change> {
        let change = self.document.undo();
        self.prune_selection();
        change
    }

    /// Applies the last undone edit again.
    pub fn redo(&mut self) -> Option<Change> {
        let change = self.document.redo();
        self.prune_selection();
        change
    }

    fn prune_selection(&mut self) {
        let sources = self.document.sources();
        self.selected.retain(|&point| sources.get(point).is_some());
    }

    /// The rule that decided the sides, for the exported file's comment; `None` before the first propagation.
    pub fn rule(&self) -> Option<String> {
        let start = self.document.propagation()?.rule();
        Some(match self.document.sources().len() {
            0 => start.to_owned(),
            1 => format!("{start}, 1 source"),
            n_sources => format!("{start}, {n_sources} sources"),
        })
    }

    /// Where an export goes unless the user says otherwise: `<name>_oriented.ply` in `folder`, or beside the scan.
    pub fn suggested_export(&self, folder: Option<&Path>) -> PathBuf {
        let name = Path::new(&self.name);
        let stem = name.file_stem().unwrap_or_default().to_string_lossy();
        let extension = name.extension().map_or_else(
            || {
                self.scan
                    .format
                    .extensions()
                    .first()
                    .copied()
                    .unwrap_or("ply")
                    .to_owned()
            },
            |extension| extension.to_string_lossy().into_owned(),
        );
        let beside = self.scan.path().and_then(|path| path.parent()).map(Path::to_path_buf);
        let folder = folder
            .map(Path::to_path_buf)
            .or(beside)
            .or_else(documents)
            .unwrap_or_default();
        folder.join(format!("{stem}_oriented.{extension}"))
    }
}

/// The component that `point` belongs to, as an index of the tree's roots. O(log components).
fn component(tree: &SpanningTree, point: u32) -> usize {
    let position = tree.position(point);
    // The first root is at position 0, so at least one counts.
    tree.roots().partition_point(|&root| root <= position) - 1
}

/// The user's folder for documents, else the home folder.
fn documents() -> Option<PathBuf> {
    let folders = directories::UserDirs::new()?;
    let documents = folders.document_dir().filter(|folder| folder.is_dir());
    Some(documents.unwrap_or_else(|| folders.home_dir()).to_path_buf())
}
