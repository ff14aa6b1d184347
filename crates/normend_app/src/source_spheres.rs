//! The spheres in the view: sources, pins, and points of other kinds that say a side.

use normend_core::{PointSet, Source, Start};
use normend_render::Sphere;

use crate::session::Session;
use crate::source_kinds::SourceKind;
use crate::theme;

/// Most spheres of kinds that come by the thousand: enough to see where they are, too few to hide the scan or slow it down.
const MOST: usize = 500;
/// Most spheres of pins, which lie close together: a sphere is as large as many points, and what is pinned is to be seen.
const MOST_OF_MARKS: u64 = 60;

/// Spheres with their points: first the user's own sources, which can be selected, then the others.
#[derive(Default)]
pub struct SourceSpheres {
    /// The point of each sphere.
    pub points: Vec<u32>,
    /// The spheres.
    pub spheres: Vec<Sphere>,
    /// How many are sources of the document.
    pub n_own: usize,
}

impl SourceSpheres {
    /// All kinds that are shown: green where a source keeps the side that was there, pink where it flipped it; of what comes by the
    /// thousand some, evenly picked. O(sources).
    pub fn of(session: &Session) -> Self {
        let mut all = Self::default();
        let (document, kinds) = (&session.document, &session.kinds);
        let sources = document.sources();
        let is_of_rule = |source: &Source| SourceKind::of(source.origin) == SourceKind::Rule;
        let n_of_rules = sources.iter().filter(|source| is_of_rule(source)).count();
        let step = n_of_rules.div_ceil(MOST).max(1);
        let mut rank = 0;
        for source in sources.iter() {
            // A rule for all parts makes as many sources as there are parts.
            rank += usize::from(is_of_rule(source));
            let is_left_out = is_of_rule(source) && rank % step != 0;
            if is_left_out || !kinds.is_shown(SourceKind::of(source.origin)) {
                continue;
            }
            let color = if document.is_flipped(source) {
                theme::SOURCE_FLIPPED
            } else {
                theme::SOURCE_KEPT
            };
            all.add(session, source.point, color, session.selected.contains(&source.point));
        }
        all.n_own = all.points.len();
        let marks = document.marks();
        for (kind, points, color) in [
            (SourceKind::Flipped, marks.free(), theme::SOURCE_FLIPPED),
            (SourceKind::Pinned, marks.pinned(), theme::SOURCE_PINNED),
        ] {
            if kinds.is_shown(kind) {
                for point in some_of(points) {
                    all.add(session, point, color, false);
                }
            }
        }
        let Some(propagation) = document.propagation() else {
            return all;
        };
        let voted = &propagation.voted_sources;
        if kinds.is_shown(SourceKind::Voted) {
            let step = voted.len().div_ceil(MOST).max(1);
            for source in voted
                .iter()
                .step_by(step)
                .filter(|source| !sources.contains(source.point))
            {
                all.add(session, source.point, theme::SOURCE_VOTED, false);
            }
        }
        if kinds.is_shown(SourceKind::File) && propagation.parameters.start == Start::Keep {
            let given = document.given_normals().map_or(&[][..], |given| given.as_slice());
            let step = given.len().div_ceil(MOST).max(1);
            for (point, normal) in (0_u32..).zip(given).step_by(step) {
                if *normal != glam::Vec3::ZERO {
                    all.add(session, point, theme::SOURCE_GIVEN, false);
                }
            }
        }
        all
    }

    fn add(&mut self, session: &Session, point: u32, color: [f32; 3], selected: bool) {
        if let Some(&center) = session.document.cloud().positions().get(point as usize) {
            self.points.push(point);
            self.spheres.push(Sphere {
                center,
                color,
                selected,
            });
        }
    }
}

/// Some of the points, evenly picked: O([`MOST_OF_MARKS`]), however many there are.
fn some_of(points: &PointSet) -> impl Iterator<Item = u32> {
    let step = points.len().div_ceil(MOST_OF_MARKS).max(1);
    let ranks = (0..points.len()).step_by(step as usize);
    ranks.filter_map(|rank| points.select(rank as u32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn some_are_evenly_picked_and_few_are_all() {
        let few: PointSet = [3, 9, 70_000].into_iter().collect();
        assert_eq!(some_of(&few).collect::<Vec<_>>(), [3, 9, 70_000]);
        let many: PointSet = (0..1_200_000).map(|point| 2 * point).collect();
        let some: Vec<u32> = some_of(&many).collect();
        assert_eq!(some.len() as u64, MOST_OF_MARKS);
        assert_eq!((some[0], some[1]), (0, 40_000));
    }
}
