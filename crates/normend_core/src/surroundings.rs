//! What lies around a set of points in space: grows and shrinks selections by steps of about a splat.
//!
//! A point touches those whose places its disc reaches: on a surface, those around it. That follows the density of the cloud, and it
//! does not care what the normals say, so a step also crosses creases and thin walls.
//!
//! Invariant: growing never loses points and shrinking never gains any; results do not depend on the number of threads.
//! Not here: which points hang together, see [`crate::spanning_tree`].

use fixedbitset::FixedBitSet;
use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use crate::progress::Steps;
use crate::{Cancelled, PointCloud, PointSet, Progress};

/// Points that one task handles at a time.
const POINTS: usize = 4096;

/// A disc reaches so much farther than its radius, which may be the very distance to a neighbor.
const ROUNDING: f32 = 1e-3;

/// A cloud prepared for questions about what touches what. About 30 bytes a point.
pub struct Surroundings {
    /// Positions and radii in parts of the cloud's diagonal, so that squared distances stay within `f32`.
    places: Vec<[f32; 3]>,
    radii: Vec<f32>,
    tree: ImmutableKdTree<f32, 3>,
}

impl std::fmt::Debug for Surroundings {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Surroundings of {} points", self.places.len())
    }
}

impl Surroundings {
    /// Prepares a cloud whose points have discs of these radii (world length, as many as points). O(n log n), in parallel.
    ///
    /// # Errors
    /// [`Cancelled`] when `progress` asks to stop; nothing else.
    ///
    /// # Panics
    /// When there are not as many radii as points.
    pub fn new(cloud: &PointCloud, radii: &[f32], progress: &dyn Progress) -> Result<Self, Cancelled> {
        assert_eq!(radii.len(), cloud.n_points(), "a radius for each point");
        progress.report(0.0)?;
        let diagonal = cloud.diagonal();
        let scale = if diagonal.is_normal() { diagonal.recip() } else { 1.0 };
        let place = |&position: &Vec3| (position * scale).to_array();
        let places: Vec<[f32; 3]> = cloud.positions().par_iter().map(place).collect();
        let tree = ImmutableKdTree::<f32, 3>::new_from_slice_parallel(&places)
            .expect("ids fit into u32, as PointCloud checks, and arena leaves hold any number of equal coordinates");
        progress.report(1.0)?;
        Ok(Self {
            places,
            radii: radii.iter().map(|radius| radius * scale).collect(),
            tree,
        })
    }

    /// The set with all points that one of it touches. Points past the end of the cloud are left as they are. O(set · log n), in
    /// parallel.
    ///
    /// # Errors
    /// [`Cancelled`] when `progress` asks to stop; nothing else.
    pub fn grow(&self, set: &PointSet, progress: &dyn Progress) -> Result<PointSet, Cancelled> {
        let inside = self.bits(set);
        let points: Vec<u32> = inside.ones().map(|point| point as u32).collect();
        let steps = Steps::new(progress, points.len());
        let added: Vec<Vec<u32>> = points
            .par_chunks(POINTS)
            .map(|chunk| {
                let mut added = Vec::new();
                for &point in chunk {
                    self.visit_touching(point, |other| {
                        if !inside.contains(other as usize) {
                            added.push(other);
                        }
                        true
                    });
                }
                steps.advance(chunk.len())?;
                Ok(added)
            })
            .collect::<Result<_, Cancelled>>()?;
        let mut grown = set.clone();
        for points in added {
            grown.extend(points);
        }
        Ok(grown)
    }

    /// The set without the points that touch one outside of it. O(set · log n), in parallel.
    ///
    /// # Errors
    /// [`Cancelled`] when `progress` asks to stop; nothing else.
    pub fn shrink(&self, set: &PointSet, progress: &dyn Progress) -> Result<PointSet, Cancelled> {
        let inside = self.bits(set);
        let points: Vec<u32> = inside.ones().map(|point| point as u32).collect();
        let steps = Steps::new(progress, points.len());
        let lost: Vec<Vec<u32>> = points
            .par_chunks(POINTS)
            .map(|chunk| {
                let mut lost = Vec::new();
                for &point in chunk {
                    let mut is_within = true;
                    self.visit_touching(point, |other| {
                        is_within = inside.contains(other as usize);
                        is_within
                    });
                    if !is_within {
                        lost.push(point);
                    }
                }
                steps.advance(chunk.len())?;
                Ok(lost)
            })
            .collect::<Result<_, Cancelled>>()?;
        let mut shrunk = set.clone();
        for point in lost.into_iter().flatten() {
            shrunk.remove(point);
        }
        Ok(shrunk)
    }

    /// Gives `take` the points that touch an existing one, itself among them, until it says no.
    fn visit_touching(&self, point: u32, mut take: impl FnMut(u32) -> bool) {
        let reach = self.radii[point as usize] * (1.0 + ROUNDING);
        let results = self
            .tree
            .query(&self.places[point as usize])
            .within::<SquaredEuclidean<f32>>(reach * reach)
            .unsorted()
            .execute();
        for result in results {
            if !take(result.item) {
                return;
            }
        }
    }

    fn bits(&self, set: &PointSet) -> FixedBitSet {
        let mut bits = FixedBitSet::with_capacity(self.places.len());
        set.range(..self.places.len() as u32)
            .for_each(|point| bits.insert(point as usize));
        bits
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::Silent;

    fn surroundings(positions: Vec<Vec3>, radius: f32) -> Surroundings {
        let radii = vec![radius; positions.len()];
        let cloud = PointCloud::new(DVec3::ZERO, positions).unwrap();
        Surroundings::new(&cloud, &radii, &Silent).unwrap()
    }

    #[test]
    fn a_step_along_a_row_reaches_the_next_point_and_back() {
        for scale in [1e-12, 1.0, 1e6] {
            let row = (0..20).map(|x| Vec3::X * (x as f32 * scale)).collect();
            let row = surroundings(row, scale);
            let middle: PointSet = (8..12).collect();
            let grown = row.grow(&middle, &Silent).unwrap();
            assert_eq!(grown, (7..13).collect());
            assert_eq!(row.shrink(&grown, &Silent).unwrap(), middle);
            assert_eq!(row.shrink(&(0..3).collect(), &Silent).unwrap(), (0..2).collect());
            assert!(row.grow(&PointSet::new(), &Silent).unwrap().is_empty());
        }
    }

    #[test]
    fn points_in_one_place_go_together() {
        let places = surroundings(vec![Vec3::ZERO; 300], 0.1);
        let grown = places.grow(&PointSet::from([7]), &Silent).unwrap();
        assert_eq!(grown.len(), 300);
        assert!(places.shrink(&(1..300).collect(), &Silent).unwrap().is_empty());
    }

    proptest! {
        #[test]
        fn steps_are_as_distances_say(
            points in prop::collection::vec((0_u8..12, 0_u8..12, 0_u8..3), 1..80),
            bits in prop::collection::vec(any::<bool>(), 80),
        ) {
            let at = |&(x, y, z): &(u8, u8, u8)| Vec3::new(f32::from(x), f32::from(y), f32::from(z));
            let places: Vec<Vec3> = points.iter().map(at).collect();
            let set: PointSet = (0..places.len() as u32).filter(|&point| bits[point as usize]).collect();
            let cloud = surroundings(places.clone(), 1.0);
            let touches = |a: u32, b: u32| places[a as usize].distance(places[b as usize]) <= 1.05;
            let all = 0..places.len() as u32;
            let grown: PointSet = all.clone().filter(|&a| set.iter().any(|b| touches(a, b))).collect();
            prop_assert_eq!(cloud.grow(&set, &Silent).unwrap(), grown);
            let shrunk: PointSet = (set.iter())
                .filter(|&a| all.clone().all(|b| set.contains(b) || !touches(a, b)))
                .collect();
            prop_assert_eq!(cloud.shrink(&set, &Silent).unwrap(), shrunk);
        }
    }
}
