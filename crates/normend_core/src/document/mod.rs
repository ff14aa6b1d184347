//! The document: cloud, parameters, sources, and their history. [`Document::apply`] is the only way to change its
//! sources.
//!
//! Ground state are the cloud and the sources; the [`Propagation`] is computed elsewhere and installed, and the signs
//! follow from both.
//!
//! Invariants: with a propagation, each source's point has the sign that the source vouches for; a failed edit changes
//! nothing; undo restores every bit.
//! Not here: how signs follow from sources is [`crate::regions`]; jobs and files belong to the editor.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use crate::patches::{Offer, Patch};
use crate::sources::{Origin, SourcePatch};
use crate::{Change, Orientation, Parameters, PointCloud, Propagation, Regions, Source, Sources};

mod edit;
mod history;
mod turned_patches;

#[cfg(test)]
mod patch_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod voted_tests;

pub use edit::{Edit, EditError};
use history::{History, SourceChange, Step};
use turned_patches::TurnedPatches;

/// A cloud with its sources, and everything derived from them.
#[derive(Debug)]
pub struct Document {
    cloud: Arc<PointCloud>,
    given: Option<Arc<Vec<Vec3>>>,
    sources: Sources,
    derived: Option<Derived>,
    history: History,
    revision: u64,
    n_revisions: u64,
}

/// What follows from the cloud, the parameters and the sources.
#[derive(Debug)]
struct Derived {
    propagation: Propagation,
    regions: Regions,
    /// `None` without patches.
    turned: Option<TurnedPatches>,
}

impl Derived {
    /// Brings the regions in line with the sources at some points.
    fn set(&mut self, sources: impl IntoIterator<Item = (u32, Option<Source>)>) -> Change {
        let sources: Vec<_> = sources.into_iter().collect();
        let Self {
            propagation,
            regions,
            turned,
        } = self;
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
            normal: -self.oriented_normal(point),
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
    fn patch_source(&self, point: u32, n_points: u32) -> Result<Source, EditError> {
        let (turned, patch) = self.patch_to_turn(point, n_points)?;
        let position = self.propagation.tree.position(point);
        let starts_turned = starts_turned(&self.propagation, point) != turned.turns(patch, point);
        let patch = SourcePatch {
            n_points: patch.n_points,
            amid_mended: self.regions.orientation().is_turned(position) != starts_turned,
        };
        Ok(Source {
            point,
            normal: -self.oriented_normal(point),
            origin: Origin::Picked,
            patch: Some(patch),
        })
    }

    /// The default source that is vouched for together with a mend at an existing point: another point of its region, which
    /// has no source yet.
    fn default_source_beside(&self, point: u32, sources: &Sources) -> Option<u32> {
        let position = self.propagation.tree.position(point);
        let component = self.propagation.tree.roots().partition_point(|&root| root <= position) - 1;
        let &default = self.propagation.default_sources.get(component)?;
        // After the first mend the default source is a source itself, which spares the climbs up the tree.
        let is_beside = default != point
            && !sources.contains(default)
            && self.regions.source_of(point).is_none()
            && self.regions.in_one_region(default, point);
        is_beside.then_some(default)
    }

    /// The stored normal of an existing point, turned or not.
    fn oriented_normal(&self, point: u32) -> Vec3 {
        let stored = self.propagation.normals[point as usize];
        let position = self.propagation.tree.position(point);
        if self.regions.orientation().is_turned(position) {
            -stored
        } else {
            stored
        }
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
            sources: Sources::default(),
            derived: None,
            history: History::new(Self::HISTORY_BYTES),
            revision: 0,
            n_revisions: 1,
        }
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

    /// Takes a finished propagation in place of the present one; the sources stay and are applied to it, and so does the
    /// history. O(n).
    ///
    /// # Panics
    /// When the propagation is of another number of points than the cloud.
    pub fn install(&mut self, propagation: Propagation) {
        assert_eq!(
            propagation.tree.n_points(),
            self.cloud.n_points(),
            "the propagation is of another cloud"
        );
        let regions = propagation.base_regions.clone();
        let turned = propagation.patches.clone().map(TurnedPatches::new);
        let derived = self.derived.insert(Derived {
            propagation,
            regions,
            turned,
        });
        derived.set(self.sources.iter().map(|&source| (source.point, Some(source))));
    }

    /// The propagation in force.
    pub fn propagation(&self) -> Option<&Propagation> {
        self.derived.as_ref().map(|derived| &derived.propagation)
    }

    /// The parameters in force (the default ones before the first [`Self::install`]).
    pub fn parameters(&self) -> Parameters {
        self.propagation()
            .map_or_else(Parameters::default, |propagation| propagation.parameters)
    }

    /// The sources, by point.
    pub fn sources(&self) -> &Sources {
        &self.sources
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
    /// An edit that leaves every source as it is (adding what is there already) is not remembered. Before the first
    /// [`Self::install`] sources can be set, but not picked, and nothing turns.
    ///
    /// # Errors
    /// [`EditError`]; the document is unchanged then.
    pub fn apply(&mut self, edit: Edit) -> Result<Change, EditError> {
        let changes = self.changes_of(&edit)?;
        if changes.is_empty() {
            return Ok(Change::default());
        }
        let after: Vec<_> = changes.iter().map(|change| (change.point, change.after)).collect();
        let change = self.set_sources(&after);
        let revision_before = std::mem::replace(&mut self.revision, self.n_revisions);
        self.n_revisions += 1;
        self.history.record(Step {
            edit,
            changes,
            revision_before,
            revision_after: self.revision,
        });
        Ok(change)
    }

    /// What `Edit::Mend(point)` would turn, without changing anything.
    ///
    /// # Errors
    /// [`EditError`] as [`Self::apply`].
    pub fn preview_mend(&self, point: u32) -> Result<Change, EditError> {
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        self.check_point(point)?;
        Ok(derived
            .regions
            .preview_beside(point, derived.default_source_beside(point, &self.sources)))
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
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        self.check_point(point)?;
        let (turned, patch) = derived.patch_to_turn(point, n_points)?;
        Ok(turned.positions(patch, &derived.propagation.tree))
    }

    /// What `Edit::TurnWhole(point)` would turn, without changing anything.
    ///
    /// # Errors
    /// [`EditError`] as [`Self::apply`].
    pub fn preview_turn_whole(&self, point: u32) -> Result<Change, EditError> {
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        self.check_point(point)?;
        Ok(derived.regions.region_of(point))
    }

    /// Takes the last edit back; `None` when there is none.
    pub fn undo(&mut self) -> Option<Change> {
        let step = self.history.undo()?;
        self.revision = step.revision_before;
        // Backwards, because a cut undone in reverse has the region it made.
        let before: Vec<_> = step
            .changes
            .iter()
            .rev()
            .map(|change| (change.point, change.before))
            .collect();
        Some(self.set_sources(&before))
    }

    /// Applies the last undone edit again; `None` when there is none.
    pub fn redo(&mut self) -> Option<Change> {
        let step = self.history.redo()?;
        self.revision = step.revision_after;
        let after: Vec<_> = step.changes.iter().map(|change| (change.point, change.after)).collect();
        Some(self.set_sources(&after))
    }

    /// The edit that [`Self::undo`] would take back.
    pub fn next_undo(&self) -> Option<&Edit> {
        self.history.last_done().map(|step| &step.edit)
    }

    /// The edit that [`Self::redo`] would apply.
    pub fn next_redo(&self) -> Option<&Edit> {
        self.history.last_undone().map(|step| &step.edit)
    }

    /// A number that names the state of the sources: equal numbers, equal sources. Undo returns to the number of
    /// before; so "unsaved" is `revision() != revision_at_last_export`.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// The signs, by preorder position; `None` before the first [`Self::install`].
    pub fn orientation(&self) -> Option<&Orientation> {
        self.derived.as_ref().map(|derived| derived.regions.orientation())
    }

    /// The oriented normal of one point; `None` before the first [`Self::install`] or past the end of the cloud.
    pub fn oriented_normal(&self, point: u32) -> Option<Vec3> {
        self.check_point(point).ok()?;
        Some(self.derived.as_ref()?.oriented_normal(point))
    }

    /// `n` oriented unit normals by point: O(n), in parallel; for export.
    pub fn oriented_normals(&self) -> Option<Vec<Vec3>> {
        let derived = self.derived.as_ref()?;
        let points = 0..self.cloud.n_points() as u32;
        Some(
            points
                .into_par_iter()
                .map(|point| derived.oriented_normal(point))
                .collect(),
        )
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
        self.sources.get(point).copied().ok_or(EditError::NotASource { point })
    }

    /// What an edit does to the sources, one entry for each point that changes, ascending by point.
    fn changes_of(&self, edit: &Edit) -> Result<Box<[SourceChange]>, EditError> {
        let change = |point, after| SourceChange {
            point,
            before: self.sources.get(point).copied(),
            after,
        };
        Ok(match edit {
            &Edit::Mend(point) => {
                let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
                self.check_point(point)?;
                let mut changes = vec![change(point, Some(derived.mended(point, &self.sources)))];
                if let Some(default) = derived.default_source_beside(point, &self.sources) {
                    let normal = derived.oriented_normal(default);
                    let source = Source {
                        point: default,
                        normal,
                        origin: Origin::Default,
                        patch: None,
                    };
                    changes.push(change(default, Some(source)));
                    changes.sort_unstable_by_key(|change| change.point);
                }
                changes.into()
            }
            &Edit::TurnPatch { point, n_points } => {
                let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
                self.check_point(point)?;
                Box::new([change(point, Some(derived.patch_source(point, n_points)?))])
            }
            &Edit::TurnWhole(point) => {
                let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
                self.check_point(point)?;
                let source = match derived.regions.source_of(point) {
                    Some(source) => match self.sources.get(source) {
                        Some(source) => source.opposite_amid_opposite(),
                        // A voted source is overruled where it stands.
                        None => derived.mended(source, &self.sources),
                    },
                    None => derived.mended(point, &self.sources),
                };
                Box::new([change(source.point, Some(source))])
            }
            Edit::AddSources(sources) => {
                let mut after = BTreeMap::new();
                for source in sources {
                    let point = source.point;
                    self.check_point(point)?;
                    if !source.normal.is_finite() || source.normal == Vec3::ZERO {
                        return Err(EditError::NoDirection { point });
                    }
                    after.insert(point, *source);
                }
                after.retain(|&point, source| self.sources.get(point) != Some(source));
                after
                    .into_iter()
                    .map(|(point, source)| change(point, Some(source)))
                    .collect()
            }
            Edit::RemoveSources(points) => {
                points.iter().try_for_each(|&point| self.source(point).map(drop))?;
                BTreeSet::from_iter(points)
                    .into_iter()
                    .map(|&point| change(point, None))
                    .collect()
            }
            Edit::FlipSources(points) => BTreeSet::from_iter(points)
                .into_iter()
                .map(|&point| Ok(change(point, Some(self.source(point)?.opposite()))))
                .collect::<Result<_, _>>()?,
        })
    }

    /// Sets the source at each point to what is given and turns what follows from it.
    fn set_sources(&mut self, sources: &[(u32, Option<Source>)]) -> Change {
        for &(point, source) in sources {
            match source {
                Some(source) => self.sources.insert(source),
                None => self.sources.remove(point),
            };
        }
        self.derived
            .as_mut()
            .map_or_else(Change::default, |derived| derived.set(sources.iter().copied()))
    }
}
