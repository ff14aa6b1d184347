//! A propagation of the places of a cloud as one of all its points, copies among them.

use std::sync::Arc;

use fixedbitset::FixedBitSet;
use glam::Vec3;

use super::Propagation;
use super::given::{self, GivenNormals};
use crate::copies::Copies;
use crate::{PointCloud, Regions, Source};

impl Propagation {
    /// Gives the copies of `cloud` their part of what was found for its places. `given` are the file's normals by point where
    /// the propagation started from them: each point keeps its own. O(n).
    pub(super) fn with_copies(self, cloud: &PointCloud, copies: &Copies, given: Option<&[Vec3]>) -> Self {
        let places = &copies.places;
        let n_points = places.n_points();
        let mut normals = places.by_point(&self.normals);
        // Copies whose own normal points away from that of their place.
        let mut differs = FixedBitSet::with_capacity(n_points);
        if let Some(given) = given.map(GivenNormals::new) {
            for (point, normal) in normals.iter_mut().enumerate() {
                if !given.missing.contains(point) {
                    let own = given.normals[point];
                    differs.set(point, own.dot(*normal) < 0.0);
                    *normal = own;
                }
            }
        }
        let (tree, positions) = self.tree.with_copies(places, &differs);
        let tree = Arc::new(tree);
        let mut cuts = FixedBitSet::with_capacity(n_points);
        let mut initially_turned = FixedBitSet::with_capacity(n_points);
        for (top, is_turned) in self.base_regions.base_signs() {
            let top = positions[top as usize] as usize;
            cuts.insert(top);
            initially_turned.set(top, is_turned);
        }
        // A given normal keeps its sign, whatever its place has.
        cuts.extend(differs.ones().map(|point| tree.position(point as u32) as usize));
        let default_sources = match given {
            Some(_) => given::default_sources(cloud, &tree, &cuts),
            None => self.default_sources.iter().map(|&place| places.first(place)).collect(),
        };
        let voted_sources: Vec<Source> = (self.voted_sources.iter())
            .map(|source| Source {
                point: places.first(source.point),
                ..*source
            })
            .collect();
        let mut base_regions = Regions::new(Arc::clone(&tree), cuts, initially_turned);
        base_regions.set(voted_sources.iter().map(|source| {
            let turned = source.turns(normals[source.point as usize]);
            (source.point, Some(turned))
        }));
        Self {
            normals: Arc::new(normals),
            splat_radii: Arc::new(places.by_point(&self.splat_radii)),
            base_regions,
            default_sources,
            voted_sources: Arc::new(voted_sources),
            patches: (self.patches.as_ref()).map(|patches| Arc::new(patches.with_copies(places, &tree))),
            evidence: (self.evidence.as_ref()).map(|evidence| Arc::new(evidence.with_copies(places))),
            tree,
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{Parameters, Preset, Silent, Start, shapes};

    /// Positions with copies: point `i` of the shape comes `1 + i % 4` times, the copies in rounds after all the first ones but one.
    /// And of each point the one of the shape that it is.
    fn with_copies(positions: &[Vec3]) -> (Vec<Vec3>, Vec<usize>) {
        let rounds = (0..4).flat_map(|round| (0..positions.len()).filter(move |i| i % 4 >= round));
        let mut shape_points: Vec<usize> = rounds.collect();
        shape_points.insert(3, 1);
        (shape_points.iter().map(|&i| positions[i]).collect(), shape_points)
    }

    fn propagate(positions: &[Vec3], given: Option<&[Vec3]>, parameters: Parameters) -> Propagation {
        let cloud = PointCloud::new(DVec3::new(5e5, 4.5e6, 100.0), positions.to_vec()).unwrap();
        Propagation::new(&cloud, given, parameters, &Silent).unwrap()
    }

    #[test]
    fn copies_change_nothing() {
        let mut shape = shapes::thin_plate(1500, 0.04).with_noise(0.003, 5);
        // A second component, and one of a single place.
        shape.positions.extend(
            shapes::sphere(300)
                .positions
                .iter()
                .map(|&place| place + 100.0 * Vec3::X),
        );
        shape.positions.push(Vec3::Y * 1000.0);
        let (positions, shape_points) = with_copies(&shape.positions);
        assert!(positions.len() > 2 * shape.positions.len());
        for preset in Preset::ALL {
            let without = propagate(&shape.positions, None, preset.parameters());
            let with = propagate(&positions, None, preset.parameters());
            assert_eq!(with.tree.n_points(), positions.len());
            assert_eq!(with.tree.roots().len(), without.tree.roots().len());
            assert_eq!(with.base_regions.n_regions(), without.base_regions.n_regions());
            assert_eq!(with.voted_sources.len(), without.voted_sources.len());
            assert_eq!(with.sides, without.sides);
            let (expect, found) = (without.initial_normals(), with.initial_normals());
            for (point, &i) in shape_points.iter().enumerate() {
                assert_eq!(found[point], expect[i], "{} {point}", preset.name());
                assert_eq!(with.splat_radii[point], without.splat_radii[i]);
                assert_eq!(
                    with.tree.order()[with.tree.position(point as u32) as usize],
                    point as u32
                );
            }
            for position in 0..with.tree.n_points() as u32 {
                if let Some(parent) = with.tree.parent(position) {
                    assert!(parent < position);
                    assert!(with.tree.subtree(parent).end >= with.tree.subtree(position).end);
                }
            }
            let (a, b) = (
                crate::confidence::confidence(&with),
                crate::confidence::confidence(&without),
            );
            assert_eq!(a.is_some(), b.is_some());
            let (Some(a), Some(b)) = (a, b) else { continue };
            assert!(shape_points.iter().enumerate().all(|(point, &i)| a[point] == b[i]));
            // What can be turned are whole places: all points of one are in the smallest patch.
            let patches = with.patches.as_ref().unwrap();
            for (point, &i) in (0..).zip(&shape_points).step_by(7) {
                let smallest = patches.around(point).next().unwrap();
                let n_same = shape_points.iter().filter(|&&other| other == i).count();
                assert_eq!(smallest.n_points as usize, n_same);
                let positions = patches.positions(smallest, &with.tree);
                assert_eq!(positions.n_points() as usize, n_same);
            }
        }
    }

    #[test]
    fn given_normals_of_copies_are_kept_bit_by_bit() {
        let shape = shapes::sphere(400);
        let (positions, shape_points) = with_copies(&shape.positions);
        let given: Vec<Vec3> = (shape_points.iter().enumerate())
            .map(|(point, &i)| match point % 5 {
                // Some are missing, some copies point the other way.
                0 => Vec3::ZERO,
                1 => -shape.normals[i],
                _ => shape.normals[i],
            })
            .collect();
        let parameters = Parameters {
            start: Start::Keep,
            ..Preset::Tree.parameters()
        };
        let found = propagate(&positions, Some(&given), parameters).initial_normals();
        for (point, &given) in given.iter().enumerate() {
            if given == Vec3::ZERO {
                assert!(found[point].is_normalized());
            } else {
                assert_eq!(found[point], given, "{point}");
            }
        }
    }

    #[test]
    fn two_planes_of_copies_are_oriented_as_without() {
        let side = 30;
        let mut plane: Vec<Vec3> = (0..side * side)
            .map(|i| Vec3::new((i % side) as f32, (i / side) as f32, 0.0))
            .collect();
        let upper: Vec<Vec3> = plane.iter().map(|&place| place + 4.0 * Vec3::Z).collect();
        plane.extend(upper);
        let many: Vec<Vec3> = plane.iter().flat_map(|&place| [place; 40]).collect();
        for preset in Preset::ALL {
            let (with, without) = (
                propagate(&many, None, preset.parameters()),
                propagate(&plane, None, preset.parameters()),
            );
            assert_eq!(with.tree.roots().len(), 2);
            let (with, without) = (with.initial_normals(), without.initial_normals());
            assert!(
                with.chunks(40)
                    .zip(&without)
                    .all(|(with, without)| with.iter().all(|normal| normal == without))
            );
            assert!(without.iter().all(|normal| normal.z.abs() > 0.999), "{}", preset.name());
        }
    }
}
