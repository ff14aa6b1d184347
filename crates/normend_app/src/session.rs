//! One open scan: the file, the document made of it, and what the user has chosen but not applied yet.

use std::cell::Cell;
use std::cmp::Ordering;
use std::collections::{BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use normend_core::document::{ScannerChoice, Step};
use normend_core::evidence::{Station, Track};
use normend_core::{
    Change, Document, Edit, EditError, EditKind, Parameters, PointSet, Propagation, SpanningTree, Start, StateChange,
    confidence,
};
use normend_io::Scan;
use normend_io::recipe::{Event, Head, Recipe, RecordedStep, ScanIdentity};

use crate::components::Components;
use crate::journal::Journal;
use crate::journal::found::Offer;
use crate::scanner_view::ScannerView;
use crate::source_kinds::SourceKinds;
use crate::suspects_list::SuspectsList;
use crate::viewpoints::Viewpoints;

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
    /// How many of them are left, and the document's revision it was counted at.
    counted_undecided: Cell<Option<(u64, usize)>>,
    saved_revision: u64,
    /// Of the signs as the scan came in, which need no export.
    opened_revision: u64,
    /// Clicks, strokes and verbs so far; undo takes none back.
    pub n_interactions: u64,
    /// Points that were selected or deselected, and hidden or shown, since the picture last took them; `None` when the picture
    /// has to be told all.
    toggled: Option<[PointSet; 2]>,
    /// What turned with each change since colors and marks were last brought in step.
    pub turned: Vec<Change>,
    /// What was accepted when the newest edits were last exported.
    exported_accepted: PointSet,
    /// Where edits are written as they happen; `None` without a folder for it.
    pub journal: Option<Journal>,
    /// The user wants none of the edits so far; only until the next.
    pub is_discarded: bool,
    /// Journals that were left behind, until the user has said what becomes of them.
    pub offers: VecDeque<Offer>,
    /// What probably points to the wrong side.
    pub suspects: SuspectsList,
    /// What says the side of points, by kind.
    pub kinds: SourceKinds,
    /// The parts that hang together.
    pub components: Components,
    /// The viewpoints while they are moved.
    pub viewpoints: Viewpoints,
    /// The viewpoints of the running propagation, or of the last one when none runs.
    pub requested_viewpoints: Arc<[glam::Vec3]>,
    /// Where the scanner was, by the files, and what it says of the points.
    pub scanner: ScannerView,
    /// What of the scanner's places the running propagation was to use, or the last one when none runs.
    pub requested_scanner: ScannerChoice,
    /// The end of the intervals of votes while it is dragged.
    pub eta_draft: Option<f32>,
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
            counted_undecided: Cell::new(None),
            saved_revision: document.signs_revision(),
            opened_revision: document.signs_revision(),
            n_interactions: 0,
            toggled: None,
            turned: Vec::new(),
            exported_accepted: PointSet::new(),
            journal: None,
            is_discarded: false,
            offers: VecDeque::new(),
            suspects: SuspectsList::default(),
            kinds: SourceKinds::default(),
            components: Components::default(),
            viewpoints: Viewpoints::default(),
            requested_viewpoints: Arc::default(),
            scanner: ScannerView::default(),
            requested_scanner: ScannerChoice::default(),
            eta_draft: None,
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
        ![self.saved_revision, self.opened_revision].contains(&self.document.signs_revision())
    }

    /// Whether the signs are not those that the state asks for: other parameters, or viewpoints that vote, are wanted than those in
    /// force. A propagation is due then.
    pub fn is_due(&self) -> bool {
        let Some(propagation) = self.document.propagation() else {
            return true;
        };
        let has_old_votes = propagation.votes.is_some() && self.document.state().viewpoints != propagation.viewpoints;
        self.document.parameters() != propagation.parameters || has_old_votes || !self.has_places_of(propagation)
    }

    /// The places of the scanner that the document wants: those that came with the scan, unless they are to count for nothing, then
    /// the user's own.
    pub fn stations(&self) -> impl Iterator<Item = &Station> {
        let choice = &self.document.state().scanner;
        let of_file = self.scanner.places.stations.iter().filter(|_| !choice.without_file);
        of_file.chain(choice.own.iter())
    }

    /// The way of the scanner that came with the scan, unless it is to count for nothing.
    pub fn track(&self) -> Option<&Arc<Track>> {
        let is_wanted = !self.document.state().scanner.without_file;
        self.scanner.places.track.as_ref().filter(|_| is_wanted)
    }

    /// Whether the document wants any place of the scanner.
    pub fn has_scanner(&self) -> bool {
        self.stations().next().is_some() || self.track().is_some()
    }

    /// Whether a propagation was made with the scanner's places that the document wants.
    pub fn has_places_of(&self, propagation: &Propagation) -> bool {
        propagation.has_track == self.track().is_some() && propagation.stations.iter().eq(self.stations())
    }

    /// Whether there are mends among what is unsaved; else other parameters alone.
    pub fn has_unsaved_mends(&self) -> bool {
        let mends = |step: &Step| step.change().is_of_signs() && step.kind() != EditKind::SetParameters;
        self.is_unsaved() && self.document.steps().take(self.document.n_done()).any(mends)
    }

    /// Whether the propagation in force tells how sure it is of each point.
    pub fn knows_confidence(&self) -> bool {
        self.document.propagation().is_some_and(confidence::is_known)
    }

    /// Whether the edits are in a journal, so that a crash does not lose them.
    pub fn is_kept(&self) -> bool {
        (self.journal.as_ref()).is_some_and(|journal| journal.is_kept() && journal.path().is_some())
    }

    /// Remembers that the signs of `revision` are in an exported file.
    pub fn mark_saved(&mut self, revision: u64) {
        self.saved_revision = revision;
        let is_newest = self.document.signs_revision() == revision;
        if is_newest {
            self.exported_accepted = self.document.state().accepted.clone();
        }
        let scan = self.identity();
        if let Some(journal) = &mut self.journal {
            if is_newest {
                journal.exported();
            }
            // The export may have replaced the file that was opened.
            journal.follow(scan);
        }
    }

    /// What tells the scan from others in recipes.
    pub fn identity(&self) -> ScanIdentity {
        self.scan.identity(&self.name)
    }

    /// Keeps a journal of the edits from now on, in `folder`. For a session without edits.
    pub fn keep_journal(&mut self, folder: &Path) {
        let head = Head::new(self.identity(), self.document.parameters());
        self.journal = Some(Journal::new(folder, head));
    }

    /// Makes the edits of a journal again, with those that were undone, and goes on with it. For a session without edits; a propagation
    /// may be due after it.
    ///
    /// # Errors
    /// [`EditError`] when they do not fit the cloud; the document is as it was opened then, not oriented, and the journal is left as it is.
    pub fn restore(&mut self, offer: Offer) -> Result<(), EditError> {
        let before = self.document.parameters();
        self.begin_with(offer.reading.recipe.head.parameters);
        let (steps, n_done) = offer.reading.recipe.history();
        if let Err(error) = steps.iter().try_for_each(|step| self.make_again(step).map(drop)) {
            let cloud = Arc::clone(&self.scan.cloud);
            self.document = Document::new(cloud, self.scan.given_normals.clone()).with_parameters(before);
            return Err(error);
        }
        for _ in n_done..steps.len() {
            self.turned.extend(self.document.undo());
        }
        let kinds = offer.reading.recipe.events.iter().filter_map(|event| match event {
            Event::Step(step) => Some(step.kind),
            _ => None,
        });
        self.n_interactions = kinds.filter(|&kind| is_interaction(kind)).count() as u64;
        self.journal = Some(Journal::resume(offer));
        Ok(())
    }

    /// Takes other parameters as those that the document began with, which are no edit. For a session without edits.
    pub fn begin_with(&mut self, parameters: Parameters) {
        let document = std::mem::replace(&mut self.document, Document::new(Arc::clone(&self.scan.cloud), None));
        self.document = document.with_parameters(parameters);
    }

    /// Makes a recorded step again. It is not written into the journal.
    fn make_again(&mut self, step: &RecordedStep) -> Result<Change, EditError> {
        self.toggled = None;
        let change = self
            .document
            .apply_recorded(step.kind, step.change.clone(), step.n_turned)?;
        self.turned.push(change.clone());
        Ok(change)
    }

    /// Makes a recorded step as an edit of its own, as when the user does the same once more.
    ///
    /// # Errors
    /// [`EditError`] when it does not fit the cloud.
    pub fn repeat(&mut self, step: &RecordedStep) -> Result<Change, EditError> {
        let before = self.document.revision();
        let change = self.make_again(step)?;
        self.record(before);
        if self.document.revision() != before {
            self.n_interactions += u64::from(is_interaction(step.kind));
        }
        self.prune_selection();
        Ok(change)
    }

    /// Brings the document to the state at the end of a recipe, as one edit: sources, marks, sets, parameters and viewpoints are the
    /// recipe's, and no others. A propagation may be due after it.
    ///
    /// # Errors
    /// [`EditError`] when the recipe does not fit the cloud; the document is unchanged then.
    pub fn take_recipe(&mut self, recipe: &Recipe) -> Result<Change, EditError> {
        let change = StateChange::between(self.document.state(), &recipe.state());
        self.repeat(&RecordedStep {
            kind: EditKind::Recipe,
            n_turned: 0,
            change,
        })
    }

    /// Ends the session: the journal goes, unless it has edits that no exported file has and that the user has not given up.
    pub fn finish(mut self) {
        // No exported file tells what was accepted, but with the export the work was done up to there.
        let has_more = self.is_unsaved() || self.document.state().accepted != self.exported_accepted;
        if let Some(journal) = self.journal.take().filter(|_| self.is_discarded || !has_more) {
            journal.remove();
        }
    }

    /// Takes the points that were selected or deselected, and hidden or shown, since the last call; `None` when the picture has to
    /// be told all.
    pub fn take_toggled(&mut self) -> Option<[PointSet; 2]> {
        self.toggled.replace(Default::default())
    }

    /// Writes the last step into the journal, if there is one since the document's revision `before`.
    fn record(&mut self, before: u64) {
        if self.document.revision() == before {
            return;
        }
        self.is_discarded = false;
        if let (Some(journal), Some(step)) = (&mut self.journal, self.document.next_undo()) {
            journal.step(step.kind(), step.change(), step.n_turned());
        }
    }

    /// Makes a propagation the one in force. The first is what the file is without the user, so it is nothing to lose.
    pub fn install(&mut self, propagation: Propagation) {
        let voted: BTreeSet<usize> = (propagation.voted_sources.iter())
            .map(|source| component_of(&propagation.tree, source.point))
            .collect();
        self.counted_undecided.set(None);
        self.undecided = (propagation.sides.iter().enumerate())
            .filter(|(component, side)| side.rule.is_none() && !voted.contains(component))
            .map(|(component, _)| component)
            .collect();
        self.requested = propagation.parameters;
        self.requested_viewpoints = Arc::clone(&propagation.viewpoints);
        // What was asked for is a step of the history from now on; the first parameters are none.
        // It names no points, so it cannot be refused.
        let before = self.document.revision();
        drop(self.document.apply(Edit::SetParameters(self.requested)));
        self.record(before);
        self.document.install(propagation);
    }

    /// How many components could face either way: nothing tells their right side, and the user has not said it. Counted anew only
    /// after an edit or another propagation, so it may be asked in each frame.
    pub fn n_undecided(&self) -> usize {
        let revision = self.document.revision();
        if let Some((_, n_undecided)) = self
            .counted_undecided
            .get()
            .filter(|&(counted_at, _)| counted_at == revision)
        {
            return n_undecided;
        }
        let n_undecided = self.count_undecided();
        self.counted_undecided.set(Some((revision, n_undecided)));
        n_undecided
    }

    fn count_undecided(&self) -> usize {
        let Some(propagation) = self.document.propagation().filter(|_| !self.undecided.is_empty()) else {
            return 0;
        };
        let said: BTreeSet<usize> = (self.document.sources().iter())
            .map(|source| component_of(&propagation.tree, source.point))
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
        let is_interaction = is_interaction(edit.kind());
        let before = self.document.revision();
        let change = self.document.apply(edit)?;
        self.turned.push(change.clone());
        self.record(before);
        if self.document.revision() != before {
            self.n_interactions += u64::from(is_interaction);
            self.toggled = toggled_with(self.toggled.take(), self.document.next_undo());
        }
        self.reveal = made;
        self.prune_selection();
        Ok(change)
    }

    /// Takes the last edit back.
    pub fn undo(&mut self) -> Option<Change> {
        let change = self.document.undo();
        self.turned.extend(change.clone());
        if change.is_some() {
            self.toggled = toggled_with(self.toggled.take(), self.document.next_redo());
        }
        if let Some(journal) = self.journal.as_mut().filter(|_| change.is_some()) {
            journal.undo();
        }
        self.prune_selection();
        change
    }

    /// Applies the last undone edit again.
    pub fn redo(&mut self) -> Option<Change> {
        let change = self.document.redo();
        self.turned.extend(change.clone());
        if change.is_some() {
            self.toggled = toggled_with(self.toggled.take(), self.document.next_undo());
        }
        if let Some(journal) = self.journal.as_mut().filter(|_| change.is_some()) {
            journal.redo();
        }
        self.prune_selection();
        change
    }

    /// Takes steps back, or does them again, until so many are done or none is left; returns what turned on the whole, `None` when
    /// no step was taken. O(what the steps changed).
    pub fn go_to_step(&mut self, n_steps: usize) -> Option<Change> {
        let mut flips = Vec::new();
        let before = self.document.n_done();
        while let Some(change) = match self.document.n_done().cmp(&n_steps) {
            Ordering::Less => self.redo(),
            Ordering::Equal => None,
            Ordering::Greater => self.undo(),
        } {
            flips.extend_from_slice(change.ranges());
        }
        (self.document.n_done() != before).then(|| Change::from_flips(&flips))
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

    /// Where a recipe goes unless the user says otherwise: `<name>.normend` beside the scan, or in `folder` where there is no such
    /// place.
    pub fn suggested_recipe(&self, folder: Option<&Path>) -> PathBuf {
        let stem = Path::new(&self.name).file_stem().unwrap_or_default().to_string_lossy();
        let beside = self.scan.path().and_then(|path| path.parent()).map(Path::to_path_buf);
        let folder = beside
            .or_else(|| folder.map(Path::to_path_buf))
            .or_else(documents)
            .unwrap_or_default();
        folder.join(format!("{stem}.{}", normend_io::recipe::EXTENSION))
    }

    /// Where an export goes unless the user says otherwise: `<name>_oriented.ply` in `folder`, or beside the scan.
    pub fn suggested_export(&self, folder: Option<&Path>) -> PathBuf {
        let name = Path::new(&self.name);
        let stem = name.file_stem().unwrap_or_default().to_string_lossy();
        let extension = name.extension().map_or_else(
            || {
                self.scan
                    .format()
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

/// Whether an edit of this kind is a click, a stroke or a verb, which the user's effort is counted by.
fn is_interaction(kind: EditKind) -> bool {
    !matches!(
        kind,
        EditKind::SetParameters | EditKind::SetViewpoints | EditKind::SetScanner | EditKind::Accept
    )
}

/// What is toggled once a step was made or taken back as well. O(what it toggles, and what was toggled before).
fn toggled_with(toggled: Option<[PointSet; 2]>, step: Option<&Step>) -> Option<[PointSet; 2]> {
    let [selected, hidden] = toggled?;
    let change = step?.change();
    Some([selected ^ &change.selected, hidden ^ &change.hidden])
}

/// The component that `point` belongs to, as an index of the tree's roots. O(log components).
fn component_of(tree: &SpanningTree, point: u32) -> usize {
    tree.component(tree.position(point))
}

/// The user's folder for documents, else the home folder.
fn documents() -> Option<PathBuf> {
    let folders = directories::UserDirs::new()?;
    let documents = folders.document_dir().filter(|folder| folder.is_dir());
    Some(documents.unwrap_or_else(|| folders.home_dir()).to_path_buf())
}
