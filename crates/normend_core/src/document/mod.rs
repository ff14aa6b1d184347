//! The document: cloud, state, and its history. [`Document::apply`] is the only way to change the state.
//!
//! Ground are the cloud and the [`State`]: sources, marks, selection, parameters. The [`Propagation`] is computed elsewhere and
//! installed, and the signs follow from all of them.
//!
//! Invariants: with a propagation, the region of each source has the sign that the source vouches for, and each marked point
//! shows its mark; a failed edit changes nothing; undo restores every bit.
//! Not here: how signs follow from sources is [`crate::regions`]; jobs and files belong to the editor.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::Vec3;

use crate::patches::{Offer, Patch};
use crate::propagation::VIEWS;
use crate::sources::{Origin, SourcePatch};
use crate::{Change, Orientation, Parameters, PointCloud, PointSet, Propagation, Regions, Source, Sources};

mod changes;
mod components;
mod edit;
mod history;
mod marks;
mod region_names;
mod spread;
mod state;
mod turned_patches;
mod viewer;

#[cfg(test)]
mod component_tests;
#[cfg(test)]
mod patch_tests;
#[cfg(test)]
mod state_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod thousand_tests;
#[cfg(test)]
mod voted_tests;

pub use components::ComponentSide;
pub use edit::{Edit, EditError, EditKind, FlipReason};
use history::{History, Revisions};
pub use history::{SetSizes, Step};
use marks::Overlay;
pub use marks::{Mark, Marks};
pub use region_names::{RegionNames, RegionOutline};
pub use state::{ScannerChoice, State, StateChange};
use turned_patches::TurnedPatches;
pub use viewer::Viewer;

/// A cloud with its state, and everything derived from them.
#[derive(Debug)]
pub struct Document {
    cloud: Arc<PointCloud>,
    given: Option<Arc<Vec<Vec3>>>,
    state: State,
    derived: Option<Derived>,
    history: History,
    revisions: Revisions,
    n_revisions: u64,
}

/// What follows from the cloud and the state.
#[derive(Clone, Debug)]
struct Derived {
    propagation: Arc<Propagation>,
    /// The signs by sources and patches.
    regions: Regions,
    /// `None` without patches.
    turned: Option<TurnedPatches>,
    /// The marks over the signs of the regions.
    overlay: Overlay,
}

impl Derived {
    /// Brings the regions in line with the sources at some points.
    fn set(&mut self, sources: impl IntoIterator<Item = (u32, Option<Source>)>) -> Change {
        let sources: Vec<_> = sources.into_iter().collect();
        let Self {
            propagation,
            regions,
            turned,
            overlay: _,
        } = self;
        let propagation = &*propagation;
        let patches = turned.as_mut().map_or_else(Change::default, |turned| {
            turned.set(
                sources.iter().copied(),
                |source| is_flipped(propagation, source),
                &propagation.tree,
            )
        });
        let turns = |source: Source| source.turns(propagation.normals[source.point as usize]);
        // Where no source of the document is left, the voted one holds again, turned with the patches around it.
        let voted = |point: u32| {
            let is_amid_turned = || turned.as_ref().is_some_and(|turned| turned.turns_at(point));
            propagation
                .voted_source(point)
                .map(|source| turns(source) != is_amid_turned())
        };
        let wanted = |&(point, source): &(u32, Option<Source>)| (point, source.map(turns).or_else(|| voted(point)));
        // What is vouched for stays as it is when a patch around it turns.
        let held = turned.iter().flat_map(TurnedPatches::sources);
        let held = held.filter(|source| patches.contains(propagation.tree.position(source.point)));
        let held = held.map(|source| (source.point, Some(turns(*source))));
        regions.set_and_turn(sources.iter().map(wanted).chain(held), &patches)
    }

    /// An existing point as the source that a click on it makes, in place of the one it may have.
    fn mended(&self, point: u32, sources: &Sources) -> Source {
        let patch = sources
            .get(point)
            .and_then(|source| source.opposite_amid_opposite().patch);
        Source {
            point,
            normal: -self.region_normal(point),
            origin: Origin::Picked,
            patch,
        }
    }

    /// The patch that `Edit::TurnPatch` names.
    fn patch_to_turn(&self, point: u32, n_points: u32) -> Result<(&TurnedPatches, Patch), EditError> {
        let turned = self.turned.as_ref().ok_or(EditError::NoPatches)?;
        let patch = turned.patches().find(point, n_points);
        match turned.n_hindering(patch, point) {
            0 => Ok((turned, patch)),
            n_vouched => Err(EditError::Vouched { n_vouched }),
        }
    }

    /// An existing point as the source that turns a patch around it.
    fn patch_source(&self, point: u32, n_points: u32, origin: Origin) -> Result<Source, EditError> {
        let (turned, patch) = self.patch_to_turn(point, n_points)?;
        let position = self.propagation.tree.position(point);
        let starts_turned = starts_turned(&self.propagation, point) != turned.turns(patch, point);
        let patch = SourcePatch {
            n_points: patch.n_points,
            amid_mended: self.regions.orientation().is_turned(position) != starts_turned,
        };
        Ok(Source {
            point,
            normal: -self.region_normal(point),
            origin,
            patch: Some(patch),
        })
    }

    /// The default source that is vouched for together with a mend at an existing point: another point of its region, which
    /// has no source yet.
    fn default_source_beside(&self, point: u32, sources: &Sources) -> Option<u32> {
        let position = self.propagation.tree.position(point);
        let component = self.propagation.tree.component(position);
        let &default = self.propagation.default_sources.get(component)?;
        // After the first mend the default source is a source itself, which spares the climbs up the tree.
        let is_beside = default != point
            && !sources.contains(default)
            && self.regions.source_of(point).is_none()
            && self.regions.in_one_region(default, point);
        is_beside.then_some(default)
    }

    /// The stored normal of an existing point as its region turns it, whatever its mark says.
    fn region_normal(&self, point: u32) -> Vec3 {
        let position = self.propagation.tree.position(point);
        self.normal(point, self.regions.orientation().is_turned(position))
    }

    /// The stored normal of an existing point as it is shown.
    fn oriented_normal(&self, point: u32) -> Vec3 {
        let position = self.propagation.tree.position(point);
        self.normal(point, self.overlay.shown().is_turned(position))
    }

    /// The stored normal of an existing point, turned or not.
    fn normal(&self, point: u32, turned: bool) -> Vec3 {
        let stored = self.propagation.normals[point as usize];
        if turned { -stored } else { stored }
    }
}

/// Whether a source vouches for another side than the one that its existing point starts with.
fn is_flipped(propagation: &Propagation, source: &Source) -> bool {
    let stored = propagation.normals[source.point as usize];
    source.turns(stored) != starts_turned(propagation, source.point)
}

/// Whether an existing point's stored normal is turned without any source of the document.
fn starts_turned(propagation: &Propagation, point: u32) -> bool {
    let position = propagation.tree.position(point);
    propagation.base_regions.orientation().is_turned(position)
}

impl Document {
    /// Bytes that the history may take by default: 256 MiB.
    pub const HISTORY_BYTES: usize = 256 << 20;

    /// A document without orientation yet. `given` are the file's normals by point.
    pub fn new(cloud: Arc<PointCloud>, given: Option<Arc<Vec<Vec3>>>) -> Self {
        Self {
            cloud,
            given,
            state: State::default(),
            derived: None,
            history: History::new(Self::HISTORY_BYTES),
            revisions: Revisions::default(),
            n_revisions: 1,
        }
    }

    /// The same document that wants other parameters from the beginning: nothing to undo.
    pub fn with_parameters(mut self, parameters: Parameters) -> Self {
        self.state.parameters = parameters;
        self
    }

    /// Sets how many bytes the history may take, [`Self::HISTORY_BYTES`] at first. Past it the oldest edits cannot be
    /// undone any more; the newest always can.
    pub fn set_history_bytes(&mut self, bytes: usize) {
        self.history.set_limit(bytes);
    }

    /// The points.
    pub fn cloud(&self) -> &Arc<PointCloud> {
        &self.cloud
    }

    /// The file's normals by point, if it has any.
    pub fn given_normals(&self) -> Option<&Arc<Vec<Vec3>>> {
        self.given.as_ref()
    }

    /// Takes a finished propagation in place of the present one; the state stays and is applied to it, and so does the
    /// history. The parameters of the propagation are the wanted ones from now on. O(n).
    ///
    /// # Panics
    /// When the propagation is of another number of points than the cloud.
    pub fn install(&mut self, propagation: Propagation) {
        assert_eq!(
            propagation.tree.n_points(),
            self.cloud.n_points(),
            "the propagation is of another cloud"
        );
        self.state.parameters = propagation.parameters;
        let regions = propagation.base_regions.clone();
        let turned = propagation.patches.clone().map(TurnedPatches::new);
        let overlay = Overlay::new(&regions);
        let mut derived = Derived {
            propagation: Arc::new(propagation),
            regions,
            turned,
            overlay,
        };
        derived.set((self.state.sources.iter()).map(|&source| (source.point, Some(source))));
        let Derived {
            propagation,
            regions,
            overlay,
            ..
        } = &mut derived;
        *overlay = Overlay::new(regions);
        let marks = &self.state.marks;
        overlay.show(
            propagation,
            regions,
            marks,
            &Change::default(),
            marks.iter().map(|(point, _)| point),
        );
        self.derived = Some(derived);
    }

    /// The propagation in force.
    pub fn propagation(&self) -> Option<&Propagation> {
        self.derived.as_ref().map(|derived| &*derived.propagation)
    }

    /// The propagation in force, to be shared with other threads.
    pub fn shared_propagation(&self) -> Option<Arc<Propagation>> {
        self.derived.as_ref().map(|derived| Arc::clone(&derived.propagation))
    }

    /// The parameters that are wanted. Those in force are the [`Self::propagation`]'s; where the two differ, a propagation is due.
    pub fn parameters(&self) -> Parameters {
        self.state.parameters
    }

    /// All that the user has decided.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The sources, by point.
    pub fn sources(&self) -> &Sources {
        &self.state.sources
    }

    /// The marks, by point.
    pub fn marks(&self) -> &Marks {
        &self.state.marks
    }

    /// The selected points.
    pub fn selected(&self) -> &PointSet {
        &self.state.selected
    }

    /// The points that are not shown.
    pub fn hidden(&self) -> &PointSet {
        &self.state.hidden
    }

    /// Whether a source is *flipped*: it vouches for the other side than the one its point has without any source. Before
    /// the first [`Self::install`] none is, and neither is one past the end of the cloud.
    pub fn is_flipped(&self, source: &Source) -> bool {
        let exists = self.check_point(source.point).is_ok();
        exists
            && self
                .propagation()
                .is_some_and(|propagation| is_flipped(propagation, source))
    }

    /// Applies an edit, remembers its inverse, forgets what was undone. Returns what turned.
    ///
    /// An edit that leaves the state as it is (adding what is there already) is not remembered. Before the first
    /// [`Self::install`] nothing turns, and what depends on signs is refused.
    ///
    /// # Errors
    /// [`EditError`]; the document is unchanged then.
    pub fn apply(&mut self, edit: Edit) -> Result<Change, EditError> {
        let change = self.change_of(&edit)?;
        Ok(self.perform(edit.kind(), change, None))
    }

    /// Makes a change of the state that was recorded before, as one step of the history that says it turned `n_turned` points.
    /// Returns what turned now, which is nothing before the first [`Self::install`].
    ///
    /// # Errors
    /// [`EditError`] when the change does not fit the cloud; the document is unchanged then.
    pub fn apply_recorded(&mut self, kind: EditKind, change: StateChange, n_turned: u64) -> Result<Change, EditError> {
        if let Some(point) = change.largest_point() {
            self.check_point(point)?;
        }
        let sources = change.sources.iter();
        let sources = sources.filter_map(|(point, source)| Some((*point, source.as_ref()?.normal)));
        let marks = change.marks.iter();
        let marks = marks.filter_map(|(point, mark)| Some((*point, mark.as_ref()?.normal)));
        for (point, normal) in sources.chain(marks) {
            check_direction(point, normal)?;
        }
        check_viewpoints(change.viewpoints.as_deref().unwrap_or_default())?;
        change.scanner.as_ref().map_or(Ok(()), check_scanner)?;
        Ok(self.perform(kind, change, Some(n_turned)))
    }

    /// Makes a change and remembers it. A new one takes the marked points of its regions along; one that was recorded has them
    /// already, and the number of points that it turned.
    fn perform(&mut self, kind: EditKind, mut change: StateChange, recorded: Option<u64>) -> Change {
        if change.is_empty() {
            return Change::default();
        }
        let before = self.revisions;
        self.revisions.all = self.n_revisions;
        if change.is_of_signs() {
            self.revisions.signs = self.n_revisions;
        }
        self.n_revisions += 1;
        let sizes_before = SetSizes::of(&self.state);
        let (turned, backward) = make(&mut self.state, self.derived.as_mut(), &mut change, recorded.is_none());
        self.history.record(Step {
            kind,
            forward: change,
            backward,
            n_turned: recorded.unwrap_or_else(|| turned.n_points()),
            revisions: [before, self.revisions],
            sizes: [sizes_before, SetSizes::of(&self.state)],
        });
        turned
    }

    /// What `Edit::Mend(point)` would turn, without changing anything.
    ///
    /// # Errors
    /// [`EditError`] as [`Self::apply`].
    pub fn preview_mend(&self, point: u32) -> Result<Change, EditError> {
        let derived = self.derived_at(point)?;
        let beside = derived.default_source_beside(point, &self.state.sources);
        let region = derived.regions.preview_beside(point, beside);
        Ok(derived.overlay.without_pinned(region))
    }

    /// The patches that a click on `point` can turn, and which by default; `None` where the propagation has no patches or the
    /// point is vouched for itself. In time of their nesting, which is some tens deep.
    ///
    /// # Errors
    /// [`EditError`] as [`Self::apply`].
    pub fn offer(&self, point: u32) -> Result<Option<Offer>, EditError> {
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        self.check_point(point)?;
        Ok(derived.turned.as_ref().and_then(|turned| turned.offer(point)))
    }

    /// What `Edit::TurnPatch` would turn, without changing anything.
    ///
    /// # Errors
    /// [`EditError`] as [`Self::apply`].
    pub fn preview_turn_patch(&self, point: u32, n_points: u32) -> Result<Change, EditError> {
        let derived = self.derived_at(point)?;
        let (turned, patch) = derived.patch_to_turn(point, n_points)?;
        let patch = turned.positions(patch, &derived.propagation.tree);
        Ok(derived.overlay.without_pinned(patch))
    }

    /// What `Edit::TurnWhole(point)` would turn, without changing anything.
    ///
    /// # Errors
    /// [`EditError`] as [`Self::apply`].
    pub fn preview_turn_whole(&self, point: u32) -> Result<Change, EditError> {
        let derived = self.derived_at(point)?;
        Ok(derived.overlay.without_pinned(derived.regions.region_of(point)))
    }

    /// What any edit would turn, without changing anything. O(n / 8) bytes and what the edit costs; clicks have their own previews,
    /// which are cheaper.
    ///
    /// # Errors
    /// [`EditError`] as [`Self::apply`].
    pub fn preview(&self, edit: &Edit) -> Result<Change, EditError> {
        let mut change = self.change_of(edit)?;
        let (mut state, mut derived) = (self.state.clone(), self.derived.clone());
        let (turned, _) = make(&mut state, derived.as_mut(), &mut change, true);
        Ok(turned)
    }

    /// How many pinned points stay as they are while what is around them turns, by [`Edit::TurnPatch`].
    ///
    /// # Errors
    /// [`EditError`] as [`Self::apply`].
    pub fn n_pinned_in_patch(&self, point: u32, n_points: u32) -> Result<u64, EditError> {
        let derived = self.derived_at(point)?;
        let (turned, patch) = derived.patch_to_turn(point, n_points)?;
        let patch = turned.positions(patch, &derived.propagation.tree);
        Ok(derived.overlay.n_pinned_in(&patch))
    }

    /// Takes the last edit back; `None` when there is none. Returns what turned.
    pub fn undo(&mut self) -> Option<Change> {
        let step = self.history.undo()?;
        let [before, _] = step.revisions;
        let mut change = step.backward.clone();
        self.revisions = before;
        Some(make(&mut self.state, self.derived.as_mut(), &mut change, false).0)
    }

    /// Applies the last undone edit again; `None` when there is none. Returns what turned.
    pub fn redo(&mut self) -> Option<Change> {
        let step = self.history.redo()?;
        let [_, after] = step.revisions;
        let mut change = step.forward.clone();
        self.revisions = after;
        Some(make(&mut self.state, self.derived.as_mut(), &mut change, false).0)
    }

    /// The step that [`Self::undo`] would take back.
    pub fn next_undo(&self) -> Option<&Step> {
        self.history.last_done()
    }

    /// The step that [`Self::redo`] would apply.
    pub fn next_redo(&self) -> Option<&Step> {
        self.history.last_undone()
    }

    /// All steps that are remembered, in the order they were done, undone ones last; the first [`Self::n_done`] are in force.
    pub fn steps(&self) -> impl Iterator<Item = &Step> {
        self.history.steps()
    }

    /// The state before the first of the [`Self::steps`]: as opened, unless older steps are forgotten. O(state and history).
    pub fn state_before_steps(&self) -> State {
        let mut state = self.state.clone();
        for step in self
            .history
            .steps()
            .take(self.n_done())
            .collect::<Vec<_>>()
            .into_iter()
            .rev()
        {
            state.change(&step.backward);
        }
        state
    }

    /// How many of the [`Self::steps`] are in force.
    pub fn n_done(&self) -> usize {
        self.history.n_done()
    }

    /// A number that names the state: equal numbers, equal states. Undo returns to the number of before.
    pub fn revision(&self) -> u64 {
        self.revisions.all
    }

    /// A number that names what signs depend on, which selecting and hiding do not change; so "unsaved" is
    /// `signs_revision() != signs_revision_at_last_export`.
    pub fn signs_revision(&self) -> u64 {
        self.revisions.signs
    }

    /// The signs, by preorder position; `None` before the first [`Self::install`].
    pub fn orientation(&self) -> Option<&Orientation> {
        self.derived.as_ref().map(|derived| derived.overlay.shown())
    }

    /// The oriented normal of one point; `None` before the first [`Self::install`] or past the end of the cloud.
    pub fn oriented_normal(&self, point: u32) -> Option<Vec3> {
        self.check_point(point).ok()?;
        Some(self.derived.as_ref()?.oriented_normal(point))
    }

    /// `n` oriented unit normals by point: O(n), in parallel; for export.
    pub fn oriented_normals(&self) -> Option<Vec<Vec3>> {
        let derived = self.derived.as_ref()?;
        Some(derived.propagation.oriented_normals(derived.overlay.shown()))
    }

    fn check_point(&self, point: u32) -> Result<(), EditError> {
        let n_points = self.cloud.n_points();
        if (point as usize) < n_points {
            Ok(())
        } else {
            Err(EditError::NoSuchPoint { point, n_points })
        }
    }

    /// The source at an existing point.
    fn source(&self, point: u32) -> Result<Source, EditError> {
        self.check_point(point)?;
        self.state
            .sources
            .get(point)
            .copied()
            .ok_or(EditError::NotASource { point })
    }

    /// What is derived, for an edit that a click on `point` makes.
    fn derived_at(&self, point: u32) -> Result<&Derived, EditError> {
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        self.check_point(point)?;
        if self.state.marks.is_pinned(point) {
            return Err(EditError::Pinned { n_pinned: 1 });
        }
        Ok(derived)
    }

    fn check_points(&self, points: &PointSet) -> Result<(), EditError> {
        points.max().map_or(Ok(()), |point| self.check_point(point))
    }
}

/// Makes a change of the state and of what is derived from it. Returns what turned, and the change that takes it back. Where
/// `takes_along`, the marked points of regions that turn are added to the change, unless they are pinned or it names them itself.
fn make(
    state: &mut State,
    derived: Option<&mut Derived>,
    change: &mut StateChange,
    takes_along: bool,
) -> (Change, StateChange) {
    let Some(derived) = derived else {
        return (Change::default(), state.change(change));
    };
    let turned = derived.set(change.sources.iter().copied());
    if takes_along {
        let named: BTreeSet<u32> = change.marks.iter().map(|&(point, _)| point).collect();
        let along = derived.overlay.along(&turned).into_iter();
        let along = along.map(|position| derived.propagation.tree.order()[position as usize]);
        let along = along.filter(|point| !named.contains(point));
        let along = along.map(|point| (point, state.marks.get(point).map(|mark| mark.opposite())));
        change.marks.extend(along);
    }
    let backward = state.change(change);
    let marked = change.marks.iter().map(|&(point, _)| point);
    let Derived {
        propagation,
        regions,
        overlay,
        ..
    } = derived;
    let shown = overlay.show(propagation, regions, &state.marks, &turned, marked);
    (shown, backward)
}

fn check_viewpoints(places: &[Vec3]) -> Result<(), EditError> {
    if let Some(index) = places.iter().position(|place| !place.is_finite()) {
        return Err(EditError::NoPlace { index });
    }
    if places.len() > *VIEWS.end() {
        let n_viewpoints = places.len();
        return Err(EditError::TooManyViewpoints { n_viewpoints });
    }
    Ok(())
}

fn check_scanner(scanner: &ScannerChoice) -> Result<(), EditError> {
    match scanner.own.iter().position(|station| !station.position.is_finite()) {
        Some(index) => Err(EditError::NoScannerPlace { index }),
        None => Ok(()),
    }
}

fn check_direction(point: u32, normal: Vec3) -> Result<(), EditError> {
    if normal.is_finite() && normal != Vec3::ZERO {
        Ok(())
    } else {
        Err(EditError::NoDirection { point })
    }
}
