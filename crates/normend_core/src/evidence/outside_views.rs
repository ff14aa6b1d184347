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
const LEAST_COSINE: f32 = 0.4;

/// The weights of looks by cosine, in steps fine enough that rounding moves none by more than a few thousandths.
struct Weights(Vec<i32>);

impl Weights {
    const STEPS: f32 = 1024.0;

    fn new() -> Self {
        let weight = |cosine: f32| ((-(cosine.acos() / FADE).powi(2)).exp() * UNIT as f32).round() as i32;
        Self(
            (0..=Self::STEPS as usize)
                .map(|step| weight(step as f32 / Self::STEPS))
                .collect(),
        )
    }

    /// Casts into `vote` a look whose line of sight, towards the viewer, has this cosine with the stored normal.
    #[inline]
    fn cast(&self, vote: &mut Vote, cosine: f32) {
        let weight = self.0[(cosine.abs().min(1.0) * Self::STEPS + 0.5) as usize];
        vote.cast(if cosine > 0.0 { weight } else { -weight });
    }
}

/// Takes the picture along `axis`: its front is seen from the axis's end, its back from the other end.
fn look_along(scene: &Scene, axis: Vec3, look: &mut Look<'_>) {
    let (x, y) = axis.any_orthonormal_pair();
    let view_from_frame = Mat3::from_cols(x, y, axis).transpose();
    let (min, max) = (scene.splats.iter()).fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), splat| {
        let position = view_from_frame * splat.position;
        (min.min(position), max.max(position))
    });
    let size = max - min;
    let most = scene.most_pixels();
    let pixel = (PIXEL * scene.spacing)
        .max((size.x * size.y / most).sqrt())
        .max(size.x.max(size.y) / most)
        .max(f32::MIN_POSITIVE);
    look.take(Picture {
        width: (size.x / pixel) as usize + 1,
        height: (size.y / pixel) as usize + 1,
        least_cosine: LEAST_COSINE,
        project: |splat: &Splat| {
            let center = (view_from_frame * splat.position - min) / pixel;
            let normal = view_from_frame * splat.normal;
            let slope = [-normal.x / normal.z, -normal.y / normal.z];
            let disc = Disc {
                x: center.x,
                y: center.y,
                height: center.z,
                slope,
                radius: splat.radius() / pixel,
                ellipse: [
                    1.0 + slope[0] * slope[0],
                    slope[0] * slope[1],
                    1.0 + slope[1] * slope[1],
                ],
                tolerance: splat.tolerance() / pixel,
            };
            Some((disc, normal.z))
        },
    });
}

/// `n` directions, spread evenly over a half sphere by the golden angle.
fn axes(n: usize) -> Vec<Vec3> {
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
