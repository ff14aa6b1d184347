//! Wrong normals against a reference while signs change: counts that cost no more than what turned.
//!
//! The counts are those of [`crate::metrics::compare`]; what is kept is by position of the tree, as changes are.

use std::ops::Range;

use fixedbitset::FixedBitSet;
use glam::Vec3;

use crate::metrics::{K, Verdict, components};
use crate::progress::Part;
use crate::{Cancelled, Change, Neighbors, Orientation, PointCloud, Progress, SpanningTree};

/// How many normals point to the wrong side, kept up while they turn.
#[derive(Clone, Debug)]
pub struct LiveComparison {
    /// Wrong as stored.
    wrong_as_stored: FixedBitSet,
    /// Wrong when turned.
    wrong_when_turned: FixedBitSet,
    /// Wrong as shown.
    wrong: FixedBitSet,
    /// The component of each position in the graph of [`crate::metrics::compare`].
    component: Vec<u32>,
    /// By component: wrong as shown, and wrong when it is flipped.
    tallies: Vec<[u32; 2]>,
    n_judged: u64,
    n_wrong: u64,
    n_wrong_component_flip: u64,
}

impl LiveComparison {
    /// Compares `normals` as `orientation` turns them with `reference` (both by point, the latter of any length, zero where there
    /// is none). `neighbors` are at least [`K`] of each point. O(n).
    ///
    /// # Errors
    /// [`Cancelled`] when `progress` asks to stop; nothing else.
    pub fn new(
        cloud: &PointCloud,
        neighbors: &Neighbors,
        reference: &[Vec3],
        normals: &[Vec3],
        tree: &SpanningTree,
        orientation: &Orientation,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        let graph = components(cloud, neighbors, &Part::new(progress, 0.0..0.8))?;
        let n_points = tree.n_points();
        let mut live = Self {
            wrong_as_stored: FixedBitSet::with_capacity(n_points),
            wrong_when_turned: FixedBitSet::with_capacity(n_points),
            wrong: FixedBitSet::with_capacity(n_points),
            component: Vec::with_capacity(n_points),
            tallies: vec![[0; 2]; graph.roots().len()],
            n_judged: 0,
            n_wrong: 0,
            n_wrong_component_flip: 0,
        };
        for (position, &point) in tree.order().iter().enumerate() {
            let verdict = Verdict::of(reference[point as usize], normals[point as usize]);
            let component = graph.component(graph.position(point));
            live.component.push(component as u32);
            live.n_judged += u64::from(verdict.judged());
            live.wrong_as_stored.set(position, verdict.wrong());
            live.wrong_when_turned.set(position, verdict.wrong_when_flipped());
            let mut sides = [verdict.wrong(), verdict.wrong_when_flipped()];
            if orientation.is_turned(position as u32) {
                sides.swap(0, 1);
            }
            live.wrong.set(position, sides[0]);
            let tally = &mut live.tallies[component];
            *tally = [tally[0] + u32::from(sides[0]), tally[1] + u32::from(sides[1])];
            live.n_wrong += u64::from(sides[0]);
        }
        live.n_wrong_component_flip = live
            .tallies
            .iter()
            .map(|&[shown, flipped]| u64::from(shown.min(flipped)))
            .sum();
        progress.report(1.0)?;
        Ok(live)
    }

    /// Points that the reference says something of.
    pub fn n_judged(&self) -> u64 {
        self.n_judged
    }

    /// Points that are wrong as they are shown.
    pub fn n_wrong(&self) -> u64 {
        self.n_wrong
    }

    /// The same when each component of the graph may be flipped.
    pub fn n_wrong_component_flip(&self) -> u64 {
        self.n_wrong_component_flip
    }

    /// The wrong points, by position.
    pub fn wrong(&self) -> &FixedBitSet {
        &self.wrong
    }

    /// Keeps up with a change of the signs. Returns the positions that became wrong or right. O(positions that turned).
    pub fn turn(&mut self, change: &Change) -> Change {
        let mut toggled: Vec<Range<u32>> = Vec::new();
        for position in change.ranges().iter().flat_map(Clone::clone) {
            let index = position as usize;
            let (stored, turned) = (
                self.wrong_as_stored.contains(index),
                self.wrong_when_turned.contains(index),
            );
            // Neither at right angles or unjudged, both without a normal.
            if stored == turned {
                continue;
            }
            let is_wrong = !self.wrong.contains(index);
            self.wrong.set(index, is_wrong);
            let tally = &mut self.tallies[self.component[index] as usize];
            self.n_wrong_component_flip -= u64::from(tally[0].min(tally[1]));
            if is_wrong {
                *tally = [tally[0] + 1, tally[1] - 1];
                self.n_wrong += 1;
            } else {
                *tally = [tally[0] - 1, tally[1] + 1];
                self.n_wrong -= 1;
            }
            self.n_wrong_component_flip += u64::from(tally[0].min(tally[1]));
            match toggled.last_mut() {
                Some(last) if last.end == position => last.end += 1,
                _ => toggled.push(position..position + 1),
            }
        }
        Change::from_flips(&toggled)
    }
}

/// The number of neighbors that [`LiveComparison::new`] needs.
pub const NEIGHBORS: usize = K;

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::metrics::compare;
    use crate::shapes::ShapeKind;
    use crate::{Document, Edit, Preset, Propagation, Silent};

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn counts_are_those_of_the_comparison_after_every_edit(
            edits in proptest::collection::vec((0_u8..4, 0..300_u32), 1..12),
            odd in proptest::collection::vec((0..300_usize, 0_u8..3), 0..20),
        ) {
            let shape = ShapeKind::Torus.generate(300);
            let mut reference = shape.normals.clone();
            for (point, kind) in odd {
                reference[point] = [Vec3::ZERO, -reference[point], reference[point].any_orthonormal_vector()][kind as usize];
            }
            let cloud = Arc::new(PointCloud::new(DVec3::ZERO, shape.positions).unwrap());
            let propagation = Propagation::new(&cloud, None, Preset::Auto.parameters(), &Silent).unwrap();
            let mut document = Document::new(Arc::clone(&cloud), None);
            document.install(propagation);
            let neighbors = Neighbors::find(&cloud, NEIGHBORS, &Silent).unwrap();
            let tree = Arc::clone(&document.propagation().unwrap().tree);
            let normals = Arc::clone(&document.propagation().unwrap().normals);
            let orientation = document.orientation().unwrap();
            let mut live =
                LiveComparison::new(&cloud, &neighbors, &reference, &normals, &tree, orientation, &Silent).unwrap();
            for (kind, point) in edits {
                let change = match kind {
                    0 | 1 => document.apply(Edit::Mend(point)).ok(),
                    2 => document.apply(Edit::TurnPatch { point, n_points: 30 }).ok(),
                    _ => document.undo(),
                };
                let before = live.wrong().clone();
                let toggled = live.turn(&change.unwrap_or_default());
                let expect = compare(&cloud, &reference, &document.oriented_normals().unwrap(), &Silent).unwrap();
                prop_assert_eq!(live.n_judged(), expect.n_judged as u64);
                prop_assert_eq!(live.n_wrong(), expect.n_wrong as u64);
                prop_assert_eq!(live.n_wrong_component_flip(), expect.n_wrong_component_flip as u64);
                for position in 0..300_u32 {
                    let point = tree.order()[position as usize] as usize;
                    prop_assert_eq!(live.wrong().contains(position as usize), expect.wrong.contains(point));
                    let changed = before.contains(position as usize) != live.wrong().contains(position as usize);
                    prop_assert_eq!(changed, toggled.contains(position));
                }
            }
        }
    }
}
