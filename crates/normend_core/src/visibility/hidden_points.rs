//! Hidden point removal: which points of a cloud a viewpoint sees, without a surface.
//!
//! Katz, Tal and Basri, "Direct visibility of point sets" (2007): turn every point over at a large sphere around the viewpoint
//! (the spherical flip); the visible ones are those whose images are corners of the convex hull of all images and the
//! viewpoint. Noise hides points of the visible side from each other, because a hull has room for the outermost only. So
//! after Mehra et al., "Visibility of noisy point cloud data" (2010), visibility is relaxed by the noise: a point is visible too
//! when it would be on the hull if it were nearer to the viewpoint by no more than the noise.

use fixedbitset::FixedBitSet;
use glam::DVec3;
use rayon::prelude::*;

use super::hull::{Facet, convex_hull};
use crate::PointCloud;
use crate::neighbors::morton_order;

/// Radius of the sphere in distances of the farthest point: 10 to the power of 2, a parameter of 2 in the program of Katz et al.
/// A larger sphere sees further into hollows, and through sheets where points are sparse.
const RADIUS: f64 = 100.0;

/// Points that one task looks at at a time.
const POINTS: usize = 4096;

/// A cloud to be looked at.
pub struct HiddenPoints {
    /// Point ids so that neighbors follow each other, which is kind to caches.
    ids: Vec<u32>,
    /// Positions in the order of `ids`.
    positions: Vec<DVec3>,
    noise: f64,
}

impl HiddenPoints {
    /// Prepares `cloud`; `noise` is how far points may be off the surface, in the cloud's unit (0: Katz et al. as they are).
    /// O(n log n).
    pub fn new(cloud: &PointCloud, noise: f64) -> Self {
        let ids = morton_order(cloud);
        let positions = ids
            .iter()
            .map(|&id| cloud.positions()[id as usize].as_dvec3())
            .collect();
        Self { ids, positions, noise }
    }

    /// The points that `viewpoint` sees, by id. `viewpoint` is relative to the cloud's origin, and may be inside.
    ///
    /// A cloud that is in one plane with the viewpoint is seen edge-on: nothing of it is visible. O(n log n) time, about 300 bytes
    /// a point while it works.
    pub fn seen_from(&self, viewpoint: DVec3) -> FixedBitSet {
        let flipped = self.flipped(viewpoint);
        let mut seen = FixedBitSet::with_capacity(self.ids.len());
        let Some(facets) = convex_hull(&flipped) else {
            return seen;
        };
        let mut visible = vec![false; flipped.len()];
        for facet in &facets {
            for vertex in facet.vertices {
                visible[vertex as usize] = true;
            }
        }
        let (images, visible) = (&flipped[..self.ids.len()], &mut visible[..self.ids.len()]);
        visible
            .par_chunks_mut(POINTS)
            .zip(images.par_chunks(POINTS))
            .for_each(|(visible, images)| {
                let mut facet = 0;
                for (visible, &image) in visible.iter_mut().zip(images) {
                    if !*visible {
                        facet = facet_towards(&facets, &flipped, facet, image);
                        *visible = self.is_near(&facets[facet], image);
                    }
                }
            });
        for (&id, visible) in self.ids.iter().zip(visible) {
            seen.set(id as usize, *visible);
        }
        seen
    }

    /// The images of the spherical flip around `viewpoint`, relative to it, and at last the viewpoint itself.
    fn flipped(&self, viewpoint: DVec3) -> Vec<DVec3> {
        let farthest = self.positions.iter().fold(0.0, |farthest: f64, &position| {
            farthest.max((position - viewpoint).length())
        });
        let diameter = 2.0 * RADIUS * farthest;
        let flip = |&position: &DVec3| {
            let offset = position - viewpoint;
            let distance = offset.length();
            // A point at the viewpoint itself has no image; it stays where it is and hides nothing.
            if distance > 0.0 {
                offset * ((diameter - distance) / distance)
            } else {
                DVec3::ZERO
            }
        };
        self.positions.iter().map(flip).chain([DVec3::ZERO]).collect()
    }

    /// Whether `image` would be on the hull if its point were nearer by the noise; `facet` is the one in its direction.
    ///
    /// Nearer by the noise is an image farther by the noise. What rounding cannot tell from the facet is on it, so points in one
    /// place are seen together.
    fn is_near(&self, facet: &Facet, image: DVec3) -> bool {
        let distance = image.length();
        let nearer = image * (1.0 + self.noise / distance.max(f64::MIN_POSITIVE));
        facet.normal.dot(nearer) >= facet.offset - facet.doubt
    }
}

/// The points of `cloud` that `viewpoint` sees: [`HiddenPoints::seen_from`] for a single look.
pub fn visible_points(cloud: &PointCloud, viewpoint: DVec3, noise: f64) -> FixedBitSet {
    HiddenPoints::new(cloud, noise).seen_from(viewpoint)
}

/// The facet that a ray from the viewpoint towards `image` meets, found by walking from facet to facet, from `start` on.
///
/// Seen from within, a hull is a regular triangulation of directions, in which such walks never turn in circles (Edelsbrunner,
/// 1990); the limit is for rounding alone, and then the image is not near.
fn facet_towards(facets: &[Facet], points: &[DVec3], start: usize, image: DVec3) -> usize {
    let mut at = start;
    'walk: for _ in 0..facets.len() {
        let facet = &facets[at];
        let corners = facet.vertices.map(|vertex| points[vertex as usize]);
        for edge in 0..3 {
            if corners[edge].cross(corners[(edge + 1) % 3]).dot(image) < 0.0 {
                at = facet.neighbors[edge] as usize;
                continue 'walk;
            }
        }
        break;
    }
    at
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::shapes;

    fn cloud(positions: Vec<Vec3>) -> PointCloud {
        PointCloud::new(DVec3::ZERO, positions).unwrap()
    }

    /// Of the points that are seen, how many face the viewpoint or nearly so, because a hull sees a little around the silhouette; of
    /// those that clearly face it, how many are seen.
    fn purity_and_coverage(shape: &shapes::Shape, viewpoint: DVec3, noise: f64) -> (f64, f64) {
        let seen = visible_points(&cloud(shape.positions.clone()), viewpoint, noise);
        let facing = |point: usize| {
            let towards = viewpoint.as_vec3() - shape.positions[point];
            towards.normalize_or_zero().dot(shape.normals[point])
        };
        let n_right = seen.ones().filter(|&point| facing(point) > -0.2).count();
        let clear: Vec<usize> = (0..shape.positions.len())
            .filter(|&point| facing(point) > 0.5)
            .collect();
        let n_covered = clear.iter().filter(|&&point| seen.contains(point)).count();
        (
            n_right as f64 / seen.count_ones(..) as f64,
            n_covered as f64 / clear.len() as f64,
        )
    }

    #[test]
    fn a_sphere_hides_its_back() {
        let (purity, coverage) = purity_and_coverage(&shapes::sphere(5000), DVec3::new(3.0, 2.0, 1.0), 0.0);
        assert!(purity == 1.0 && coverage == 1.0, "{purity} {coverage}");
    }

    #[test]
    fn noise_hides_points_unless_it_is_allowed_for() {
        let shape = shapes::sphere(5000).with_noise(0.01, 3);
        let viewpoint = DVec3::new(3.0, 2.0, 1.0);
        let (_, strict) = purity_and_coverage(&shape, viewpoint, 0.0);
        // The deviation is a share of the diagonal.
        let (purity, relaxed) = purity_and_coverage(&shape, viewpoint, 0.01 * 12.0_f64.sqrt());
        assert!(strict < 0.85, "{strict} {relaxed} {purity}");
        assert!(relaxed > strict + 0.08 && purity > 0.99, "{relaxed} {purity}");
    }

    #[test]
    fn a_wall_hides_what_is_behind_it() {
        // Two parallel grids: the far one is as large as the shadow of the near one.
        let grid = |z: f32| (0..900).map(move |i| Vec3::new((i % 30) as f32 - 14.5, (i / 30) as f32 - 14.5, z));
        let seen = visible_points(&cloud(grid(0.0).chain(grid(-5.0)).collect()), DVec3::Z * 100.0, 0.0);
        assert!((0..900).all(|point| seen.contains(point)));
        let inner = (900..1800).filter(|i| (3..27).contains(&(i % 30)) && (3..27).contains(&((i - 900) / 30)));
        assert_eq!(inner.filter(|&point| seen.contains(point)).count(), 0);
    }

    #[test]
    fn points_in_one_place_are_seen_together() {
        let sphere = shapes::sphere(300).positions;
        let twice: Vec<Vec3> = sphere.iter().chain(&sphere).copied().collect();
        let seen = visible_points(&cloud(twice), DVec3::X * 5.0, 0.0);
        assert!((0..300).all(|point| seen.contains(point) == seen.contains(point + 300)));
        assert!((100..500).contains(&seen.count_ones(..)));
    }

    #[test]
    fn from_within_everything_is_seen() {
        let seen = visible_points(&cloud(shapes::sphere(2000).positions), DVec3::new(0.1, 0.2, 0.0), 0.0);
        assert_eq!(seen.count_ones(..), 2000);
    }

    #[test]
    fn nothing_to_see() {
        assert_eq!(visible_points(&cloud(Vec::new()), DVec3::X, 0.0).count_ones(..), 0);
        let plane = (0..100)
            .map(|i| Vec3::new((i % 10) as f32, (i / 10) as f32, 0.0))
            .collect();
        assert_eq!(visible_points(&cloud(plane), DVec3::X * 30.0, 0.0).count_ones(..), 0);
        let place = vec![Vec3::ONE; 7];
        assert_eq!(visible_points(&cloud(place), DVec3::ONE, 0.0).count_ones(..), 0);
    }
}
