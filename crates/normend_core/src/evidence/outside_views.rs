//! Which side of each point is seen from outside: depth pictures of oriented discs from directions all around.

use std::f32::consts::PI;

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::depth_buffer::Disc;
use super::scene::{Look, MAX_LOOKS, PIXEL, Picture, Scene, Splat};
use super::{Evidence, Origin, UNIT, Vote};
use crate::progress::Part;
use crate::{Cancelled, PointCloud, Progress};

/// Views that are enough for scans of any size: with 26 the wrong share of whole results was a quarter larger.
pub const N_VIEWS: usize = 2 * MAX_LOOKS;

/// Looks at the cloud from `n_views` directions outside and asks for each point which of its sides is seen.
///
/// * `radii` – `n` distances to about the sixth neighbor, by point, positive and in the cloud's unit
/// * `normals` – `n` unit normals of any sign; votes are for these
/// * `n_views` – from 2 to [`N_VIEWS`]; even, as opposite views share a picture
///
/// Each point is a disc across its normal, in a parallel projection. A look counts when at most a fifth of the disc is hidden,
/// and weighs `exp(−(angle / 30°)²)` for the angle between normal and line of sight. Directions are spread evenly in the
/// frame of the cloud's principal axes, so results turn with the cloud; where two axes are equally long (a regular lattice on
/// a sphere or a cube) they are one of several as good. Surfaces nearer to each other than about their points' spacing
/// count as one.
///
/// O(n · views) time, in parallel over views; about 60 bytes a point and 8 a pixel while it works.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub fn outside_views(
    cloud: &PointCloud,
    radii: &[f32],
    normals: &[Vec3],
    n_views: usize,
    progress: &dyn Progress,
) -> Result<Evidence, Cancelled> {
    if cloud.n_points() == 0 {
        return Ok(Evidence::new(Origin::OutsideViews, Vec::new()));
    }
    let scene = Scene::new(cloud, normals, radii);
    progress.report(0.05)?;
    let axes = axes((n_views / 2).clamp(1, MAX_LOOKS));
    let masks = scene.masks(axes.len(), &Part::new(progress, 0.05..0.95), |index, look| {
        look_along(&scene, axes[index], look);
    })?;
    let axes: Vec<Vec3> = axes.iter().map(|&axis| scene.cloud_from_frame * axis).collect();
    drop(scene);
    let weights = Weights::new();
    let votes = (masks.par_iter().zip(normals))
        .map(|(&mask, &normal)| {
            let mut vote = Vote::default();
            let mut left = mask;
            while left != 0 {
                let view = left.trailing_zeros() as usize;
                left &= left - 1;
                let cosine = normal.dot(axes[view % MAX_LOOKS]);
                weights.cast(&mut vote, if view < MAX_LOOKS { cosine } else { -cosine });
            }
            vote
        })
        .collect();
    Ok(Evidence::new(Origin::OutsideViews, votes))
}

/// The angle between normal and line of sight that a look fades with, radians: `exp(−(angle / 30°)²)`.
const FADE: f32 = PI / 6.0;

/// Cosine of the angle from which on a look is not taken: at 66° it weighs less than a hundredth.
pub(super) const LEAST_COSINE: f32 = 0.4;

/// The weights of looks by cosine, in steps fine enough that rounding moves none by more than a few thousandths.
pub(super) struct Weights(Vec<i32>);

impl Weights {
    const STEPS: f32 = 1024.0;

    pub fn new() -> Self {
        let weight = |cosine: f32| ((-(cosine.acos() / FADE).powi(2)).exp() * UNIT as f32).round() as i32;
        Self(
            (0..=Self::STEPS as usize)
                .map(|step| weight(step as f32 / Self::STEPS))
                .collect(),
        )
    }

    /// What a look weighs whose line of sight has this cosine with the normal, of any sign, in units of 1/[`UNIT`].
    #[inline]
    pub fn of(&self, cosine: f32) -> i32 {
        self.0[(cosine.abs().min(1.0) * Self::STEPS + 0.5) as usize]
    }

    /// Casts into `vote` a look whose line of sight, towards the viewer, has this cosine with the stored normal.
    #[inline]
    fn cast(&self, vote: &mut Vote, cosine: f32) {
        let weight = self.of(cosine);
        vote.cast(if cosine > 0.0 { weight } else { -weight });
    }
}

/// A parallel projection of a scene onto a picture: where it shows a splat.
pub(super) struct View {
    view_from_frame: Mat3,
    min: Vec3,
    /// Side of a pixel, in the cloud's unit.
    pub pixel: f32,
    pub width: usize,
    pub height: usize,
}

impl View {
    /// The view along `axis` with pixels of so many median spacings; larger ones where the picture would get too large.
    /// Heights are those along the axis. O(n).
    pub fn along(scene: &Scene, axis: Vec3, spacings: f32) -> Self {
        let (x, y) = axis.any_orthonormal_pair();
        let view_from_frame = Mat3::from_cols(x, y, axis).transpose();
        let near = |splat: &&Splat| splat.position.length() <= scene.reach;
        let bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (min, max) = scene.splats.iter().filter(near).fold(bounds, |(min, max), splat| {
            let position = view_from_frame * splat.position;
            (min.min(position), max.max(position))
        });
        let size = max - min;
        let most = scene.most_pixels();
        let pixel = (spacings * scene.spacing)
            .max((size.x * size.y / most).sqrt())
            .max(size.x.max(size.y) / most)
            .max(f32::MIN_POSITIVE);
        Self {
            view_from_frame,
            min,
            pixel,
            width: (size.x / pixel) as usize + 1,
            height: (size.y / pixel) as usize + 1,
        }
    }

    /// The disc of a splat, in pixels, and the cosine between its normal and the axis.
    #[inline]
    pub fn disc(&self, splat: &Splat) -> (Disc, f32) {
        let center = (self.view_from_frame * splat.position - self.min) / self.pixel;
        let normal = self.view_from_frame * splat.normal;
        let slope = [-normal.x / normal.z, -normal.y / normal.z];
        let disc = Disc {
            x: center.x,
            y: center.y,
            height: center.z,
            slope,
            radius: splat.radius() / self.pixel,
            ellipse: [
                1.0 + slope[0] * slope[0],
                slope[0] * slope[1],
                1.0 + slope[1] * slope[1],
            ],
            tolerance: splat.tolerance() / self.pixel,
        };
        (disc, normal.z)
    }

    /// The first and the last row that a splat's disc may touch.
    #[inline]
    pub fn rows(&self, splat: &Splat) -> (usize, usize) {
        let row = self.view_from_frame.row(1);
        let y = (row.dot(splat.position) - self.min.y) / self.pixel;
        let across = row.dot(splat.normal);
        let reach = splat.radius() / self.pixel * (1.0 - across * across).max(0.0).sqrt();
        // Casts saturate: what is left of the picture becomes row 0.
        let row = |y: f32| (y as usize).min(self.height - 1);
        (row(y - reach), row(y + reach))
    }
}

/// Takes the picture along `axis`: its front is seen from the axis's end, its back from the other end.
fn look_along(scene: &Scene, axis: Vec3, look: &mut Look<'_>) {
    let view = View::along(scene, axis, PIXEL);
    look.take(Picture {
        width: view.width,
        height: view.height,
        least_cosine: LEAST_COSINE,
        project: |splat: &Splat| Some(view.disc(splat)),
    });
}

/// `n` directions, spread evenly over a half sphere by the golden angle.
pub(super) fn axes(n: usize) -> Vec<Vec3> {
    let golden = PI * (3.0 - 5.0_f32.sqrt());
    (0..n)
        .map(|i| {
            let z = (i as f32 + 0.5) / n as f32;
            let (sin, cos) = (golden * i as f32).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            Vec3::new(radius * cos, radius * sin, z)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Quat};
    use proptest::prelude::*;

    use super::*;
    use crate::{Neighbors, Silent, shapes};

    /// The votes on the normals of a shape from all views.
    fn votes(shape: &shapes::Shape) -> Vec<Vote> {
        let cloud = PointCloud::new(DVec3::ZERO, shape.positions.clone()).unwrap();
        let neighbors = Neighbors::find(&cloud, 6, &Silent).unwrap();
        let reach = |point: usize| {
            let farthest = neighbors.of(point).last().copied().unwrap_or(0);
            shape.positions[point].distance(shape.positions[farthest as usize])
        };
        let radii: Vec<f32> = (0..cloud.n_points()).map(reach).collect();
        let evidence = outside_views(&cloud, &radii, &shape.normals, N_VIEWS, &Silent).unwrap();
        assert_eq!(evidence.origins(), [Origin::OutsideViews]);
        evidence.votes().to_vec()
    }

    fn share(votes: &[Vote], what: impl Fn(&Vote) -> bool) -> f32 {
        votes.iter().filter(|&vote| what(vote)).count() as f32 / votes.len() as f32
    }

    /// A shape with three unequal axes whose points are at no regular places.
    fn odd_shape() -> shapes::Shape {
        let mut shape = shapes::torus(6000).with_noise(0.0005, 3);
        for position in &mut shape.positions {
            *position += Vec3::new(0.3 * position.x.abs(), 0.25 * position.x, 0.0);
        }
        shape
    }

    #[test]
    fn shapes_are_seen_from_outside() {
        for kind in shapes::ShapeKind::ALL {
            let mut shape = kind.generate(20_000);
            for (point, normal) in shape.normals.iter_mut().enumerate() {
                // Of any sign, as estimated ones are.
                *normal *= if point.is_multiple_of(2) { 1.0 } else { -1.0 };
            }
            let votes = votes(&shape);
            let right = |point: usize| votes[point].pull() * if point.is_multiple_of(2) { 1.0 } else { -1.0 };
            let n_right = (0..votes.len()).filter(|&point| right(point) > 0.5).count();
            let n_wrong = (0..votes.len()).filter(|&point| right(point) < 0.0).count();
            assert!(
                n_right > 18_000 && n_wrong < 100,
                "{}: {n_right} right, {n_wrong} wrong",
                kind.name()
            );
        }
    }

    #[test]
    fn what_is_within_is_not_seen() {
        let mut shape = shapes::sphere(20_000);
        let inner = shapes::sphere(5000);
        shape
            .positions
            .extend(inner.positions.iter().map(|&position| 0.5 * position));
        shape.normals.extend(inner.normals);
        let votes = votes(&shape);
        assert_eq!(share(&votes[20_000..], |vote| vote.weight > 0), 0.0);
        assert_eq!(share(&votes[..20_000], |vote| vote.pull() > 0.9), 1.0);
    }

    #[test]
    fn a_sheet_is_seen_from_both_sides() {
        let positions = (0..10_000)
            .map(|i| Vec3::new((i % 100) as f32, (i / 100) as f32, 0.0))
            .collect();
        let votes = votes(&shapes::Shape {
            positions,
            normals: vec![Vec3::Z; 10_000],
        });
        assert_eq!(share(&votes, |vote| vote.visible() == 1.0 && vote.signed == 0), 1.0);
    }

    #[test]
    fn a_point_far_away_does_not_blind() {
        let mut shape = shapes::sphere(5000);
        shape.positions.push(Vec3::new(2e4, -1e4, 5e3));
        shape.normals.push(Vec3::Z);
        assert_eq!(share(&votes(&shape)[..5000], |vote| vote.pull() > 0.9), 1.0);
    }

    #[test]
    fn few_points_and_no_extent() {
        for n_points in 0..4 {
            let shape = shapes::sphere(n_points);
            assert_eq!(votes(&shape).len(), n_points);
        }
        let cloud = PointCloud::new(DVec3::ZERO, vec![Vec3::ONE; 3]).unwrap();
        let evidence = outside_views(&cloud, &[1.0; 3], &[Vec3::Z; 3], N_VIEWS, &Silent).unwrap();
        assert!(evidence.votes().iter().all(|vote| vote.signed == 0), "{evidence:?}");
    }

    #[test]
    fn the_order_of_points_and_the_number_of_threads_change_nothing() {
        let shape = odd_shape();
        let expect = votes(&shape);
        let order: Vec<usize> = (0..6000).map(|i| i * 2957 % 6000).collect();
        let shuffled = votes(&shapes::Shape {
            positions: order.iter().map(|&point| shape.positions[point]).collect(),
            normals: order.iter().map(|&point| shape.normals[point]).collect(),
        });
        for (&point, vote) in order.iter().zip(&shuffled) {
            assert_eq!(*vote, expect[point]);
        }
        let single = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(single.install(|| votes(&shape)), expect);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(6))]
        #[test]
        fn votes_turn_and_grow_with_the_cloud(
            axis in (-1.0_f32..1.0, -1.0_f32..1.0, 0.1_f32..1.0),
            angle in 0.0_f32..6.0,
            exponent in -20_i32..20,
            stretch in 1.0_f32..2.0,
        ) {
            let shape = odd_shape();
            let expect = votes(&shape);
            let rotation = Quat::from_axis_angle(Vec3::from(axis).try_normalize().unwrap(), angle);
            let scale = stretch * 2.0_f32.powi(exponent);
            let moved = votes(&shapes::Shape {
                positions: shape.positions.iter().map(|&position| rotation * position * scale).collect(),
                normals: shape.normals.iter().map(|&normal| rotation * normal).collect(),
            });
            // Rounding moves a few discs across the border of a pixel.
            let differs = |(a, b): (&Vote, &Vote)| (a.pull() - b.pull()).abs() > 0.05;
            let n_different = expect.iter().zip(&moved).filter(|&pair| differs(pair)).count();
            prop_assert!(n_different < 30, "{n_different}");
        }
    }
}
