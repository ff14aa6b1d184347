//! What a viewer sees: normals that face the viewer are right there.

use glam::Vec3;

use super::spread::{self, Anchor};
use super::{Derived, Document, Edit, EditError};
use crate::sources::Origin;
use crate::{PointSet, Source};

/// Cosines between normal and direction to the eye up to which a surface is seen too much from the side to say which of its sides
/// is seen: 5 degrees, about the error of a fitted normal.
const GRAZING: f32 = 0.09;

/// The share of the votes that must say the same about a patch: fewer leave it open whether the whole of it is wrong.
const CONSENSUS: f64 = 0.9;

/// The votes that a patch needs, in full looks: less is noise of single normals.
const LEAST_VOTES: f64 = 3.0;

/// Sources that a view adds at most where there are no patches: as many as vote from all sides elsewhere.
const MOST_SOURCES: usize = 2000;

/// How far from the ends of the votes, −1 and 1, sources are taken: the η of Liu et al. §3.4.
const ETA: f32 = 0.07;

/// Where a viewer is, in the cloud's own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Viewer {
    /// At a place.
    At(Vec3),
    /// Far away in this direction, of any length: parallel projection.
    Toward(Vec3),
}

impl Viewer {
    /// The unit direction from a point to the viewer; zero at the viewer itself.
    pub fn direction_from(self, point: Vec3) -> Vec3 {
        match self {
            Self::At(eye) => (eye - point).normalize_or_zero(),
            Self::Toward(direction) => direction.normalize_or_zero(),
        }
    }
}

impl Document {
    /// Of `points` those whose normals must turn so that all face `viewer`. Those that are seen edge-on follow the others.
    ///
    /// # Errors
    /// [`EditError::NotReady`], [`EditError::NoSuchPoint`].
    pub fn facing_away(&self, points: &PointSet, viewer: Viewer) -> Result<PointSet, EditError> {
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        self.check_points(points)?;
        let tree = &derived.propagation.tree;
        let shown = derived.overlay.shown();
        let mut positions: Vec<u32> = points.iter().map(|point| tree.position(point)).collect();
        positions.sort_unstable();
        let wanted = spread::inside(tree, &positions, shown, |position| {
            let vote = self.vote(derived, tree.order()[position as usize], viewer);
            if vote.abs() < GRAZING {
                Anchor::Follows
            } else {
                Anchor::Holds(shown.is_turned(position) != (vote < 0.0))
            }
        });
        let away = wanted
            .into_iter()
            .filter(|&(position, turned)| shown.is_turned(position) != turned);
        Ok(away.map(|(position, _)| tree.order()[position as usize]).collect())
    }

    /// The edit that makes what `viewer` sees face the viewer, who sees the points `visible`; `None` when all faces the viewer already.
    ///
    /// Each visible point votes with c = n·v of its shown normal n and the direction v to the viewer (Liu et al. eq. 6, with the
    /// viewer as the viewpoint). The largest patches turn whose votes are nearly all against them and that hold nothing vouched for;
    /// where the propagation has no patches, the clearest votes become sources. O(visible points · depth of patches).
    ///
    /// # Errors
    /// [`EditError::NotReady`], [`EditError::NoSuchPoint`].
    pub fn seen(&self, visible: &PointSet, viewer: Viewer) -> Result<Option<Edit>, EditError> {
        let derived = self.derived.as_ref().ok_or(EditError::NotReady)?;
        self.check_points(visible)?;
        let free = visible.iter().filter(|&point| !self.state.marks.is_pinned(point));
        let votes: Vec<(u32, f32)> = free
            .map(|point| (point, self.vote(derived, point, viewer)))
            .filter(|(_, vote)| vote.abs() >= GRAZING)
            .collect();
        let Some(turned) = &derived.turned else {
            return Ok(self.seen_sources(derived, &votes));
        };
        let patches = turned.patches();
        // Patches are ranges of leaves, so their votes are differences of running sums.
        let mut by_leaf: Vec<_> = votes.iter().map(|&(point, vote)| (patches.leaf(point), vote)).collect();
        by_leaf.sort_unstable_by_key(|&(leaf, _)| leaf);
        let mut sums = vec![(0.0, 0.0)];
        for &(_, vote) in &by_leaf {
            let (sum, weight) = sums[sums.len() - 1];
            sums.push((sum + f64::from(vote), weight + f64::from(vote.abs())));
        }
        let is_behind = |leaves: std::ops::Range<u32>| {
            let [start, end] = [leaves.start, leaves.end].map(|at| by_leaf.partition_point(|&(leaf, _)| leaf < at));
            let (sum, weight) = (sums[end].0 - sums[start].0, sums[end].1 - sums[start].1);
            weight >= LEAST_VOTES && -sum >= (2.0 * CONSENSUS - 1.0) * weight
        };
        let mut chosen = Vec::new();
        let mut covered = PointSet::new();
        for &(point, vote) in &votes {
            if vote > 0.0 || covered.contains(patches.leaf(point)) {
                continue;
            }
            let fits =
                |patch: &crate::patches::Patch| is_behind(patch.leaves()) && turned.n_hindering(*patch, point) == 0;
            if let Some(patch) = patches.around(point).filter(fits).last() {
                covered.insert_range(patch.leaves());
                chosen.push((point, patch.n_points));
            }
        }
        Ok((!chosen.is_empty()).then_some(Edit::TurnSeenPatches(chosen)))
    }

    /// Sources at the points with the clearest votes, evenly thinned out.
    fn seen_sources(&self, derived: &Derived, votes: &[(u32, f32)]) -> Option<Edit> {
        if votes.iter().all(|&(_, vote)| vote > 0.0) {
            return None;
        }
        let clear: Vec<_> = votes.iter().filter(|(_, vote)| vote.abs() >= 1.0 - 2.0 * ETA).collect();
        let thinned = clear.iter().step_by(clear.len().div_ceil(MOST_SOURCES).max(1));
        let sources = thinned.map(|&&(point, vote)| Source {
            point,
            normal: derived.oriented_normal(point) * vote.signum(),
            origin: Origin::Seen,
            patch: None,
        });
        let sources: Vec<_> = sources
            .filter(|source| !self.state.sources.contains(source.point))
            .collect();
        (!sources.is_empty()).then_some(Edit::AddSources(sources))
    }

    /// n·v of an existing point: positive where its shown normal faces the viewer.
    fn vote(&self, derived: &Derived, point: u32, viewer: Viewer) -> f32 {
        let place = self.cloud.positions()[point as usize];
        derived.oriented_normal(point).dot(viewer.direction_from(place))
    }
}
