//! Which side of each point is seen from outside: depth pictures of oriented discs from directions all around.

use std::f32::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Mat3, Vec3, Vec3Swizzles};
use rayon::prelude::*;

use super::depth_buffer::{DepthBuffer, Disc};
use super::frame::Frame;
use super::{Evidence, Origin, UNIT, Vote};
use crate::progress::Steps;
use crate::{Cancelled, PointCloud, Progress};

/// Looks at the cloud from `n_views` directions outside and asks for each point which of its sides is seen.
///
/// * `radii` – `n` distances to about the sixth neighbor, by point
/// * `normals` – `n` unit normals of any sign; votes are for these
/// * `n_views` – an even number, as opposite views share a picture; 64 is good
///
/// Each point is a disc across its normal. A look weighs `exp(−(angle/30°)²)` for the angle between normal and line of
/// sight. Directions are spread evenly in the frame of the cloud's principal axes. O(n · views) time, in parallel over views.
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
    let n_points = cloud.n_points();
    if n_points == 0 {
        return Ok(Evidence::new(Origin::OutsideViews, Vec::new()));
    }
    let scene = Scene::new(cloud, radii, normals);
    progress.report(0.05)?;
    let axes = axes(n_views.div_ceil(2));
    let next = AtomicUsize::new(0);
    let steps = Steps::new(progress, axes.len());
    let n_lanes = rayon::current_num_threads().min(axes.len()).max(1);
    let lanes: Vec<Vec<(usize, Seen)>> = (0..n_lanes)
        .into_par_iter()
        .with_max_len(1)
        .map(|_| {
            let mut buffer = DepthBuffer::default();
            let mut seen = Vec::new();
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(&axis) = axes.get(index) else {
                    return Ok(seen);
                };
                seen.push((index, scene.look(axis, &mut buffer)));
                steps.advance(1)?;
            }
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut by_axis: Vec<(usize, Seen)> = lanes.into_iter().flatten().collect();
    by_axis.sort_unstable_by_key(|&(index, _)| index);
    Ok(Evidence::new(Origin::OutsideViews, scene.votes(&axes, &by_axis)))
}

/// Spacing of points by the distance to the sixth neighbor: on a surface six of them stand in a circle of that radius.
const SPACING_PER_RADIUS: f32 = 0.72;
/// Size of a pixel in spacings.
const PIXEL: f32 = 0.5;
/// Radius of a disc in spacings.
const DISC: f32 = 1.2;
/// How far below the surface in front a point still is on it, in spacings.
const TOLERANCE: f32 = 0.5;
/// The angle that looks fade with, radians.
const FADE: f32 = PI / 6.0;
/// Cosine below which a look weighs too little to be taken.
const LEAST_COSINE: f32 = 0.4;
/// Most pixels a point.
const PIXELS_PER_POINT: f32 = 16.0;

/// The points in the frame of their principal axes, along a curve that keeps neighbors together.
struct Scene {
    points: Vec<Splat>,
    ids: Vec<u32>,
    pixel: f32,
}

/// One point.
#[derive(Clone, Copy)]
struct Splat {
    position: Vec3,
    normal: Vec3,
    radius: f32,
}

/// One bit for each point of a scene: seen from above, seen from below.
struct Seen {
    above: Vec<u64>,
    below: Vec<u64>,
}

impl Scene {
    fn new(cloud: &PointCloud, radii: &[f32], normals: &[Vec3]) -> Self {
        let frame = Frame::of(cloud);
        let rotation = frame.frame_from_cloud;
        let mut ids: Vec<u32> = (0..cloud.n_points() as u32).collect();
        let positions: Vec<Vec3> = cloud
            .positions()
            .par_iter()
            .map(|&position| (rotation * (position.as_dvec3() - frame.center)).as_vec3())
            .collect();
        let cell = cloud.diagonal().max(f32::MIN_POSITIVE) / 1024.0;
        let key = |id: u32| {
            let p = (positions[id as usize] / cell).to_array().map(|v| (v + 1024.0) as u32);
            (0..11).rev().fold(0_u64, |key, bit| {
                p.iter().fold(key, |key, axis| key << 1 | u64::from(axis >> bit & 1))
            })
        };
        ids.par_sort_by_cached_key(|&id| key(id));
        let rotation = rotation.as_mat3();
        let points = ids
            .par_iter()
            .map(|&id| Splat {
                position: positions[id as usize],
                normal: rotation * normals[id as usize],
                radius: radii[id as usize] * SPACING_PER_RADIUS,
            })
            .collect();
        let mut spacings: Vec<f32> = radii.to_vec();
        let middle = spacings.len() / 2;
        let median = *spacings.select_nth_unstable_by(middle, f32::total_cmp).1;
        Self {
            points,
            ids,
            pixel: median * SPACING_PER_RADIUS * PIXEL,
        }
    }

    /// What is seen along `axis`, from above (its end) and from below.
    fn look(&self, axis: Vec3, buffer: &mut DepthBuffer) -> Seen {
        let (x, y) = axis.any_orthonormal_pair();
        let view_from_frame = Mat3::from_cols(x, y, axis).transpose();
        let mut min = Vec3::INFINITY;
        let mut max = Vec3::NEG_INFINITY;
        for splat in &self.points {
            let position = view_from_frame * splat.position;
            min = min.min(position);
            max = max.max(position);
        }
        let size = max - min;
        let most = PIXELS_PER_POINT * self.points.len() as f32 + 4096.0;
        let pixel = self
            .pixel
            .max((size.x * size.y / most).sqrt())
            .max(size.x.max(size.y) / most);
        let disc = |splat: &Splat| {
            let position = (view_from_frame * splat.position - min) / pixel;
            let normal = view_from_frame * splat.normal;
            let slopes = -normal.xy() / normal.z;
            (
                Disc {
                    x: position.x,
                    y: position.y,
                    z: position.z,
                    radius: splat.radius * DISC / pixel,
                    slope_x: slopes.x,
                    slope_y: slopes.y,
                },
                normal.z.abs(),
            )
        };
        buffer.clear((size.x / pixel) as usize + 1, (size.y / pixel) as usize + 1);
        for splat in &self.points {
            let (disc, cosine) = disc(splat);
            if cosine > 0.1 {
                buffer.draw(&disc);
            }
        }
        let n_words = self.points.len().div_ceil(64);
        let mut seen = Seen {
            above: vec![0; n_words],
            below: vec![0; n_words],
        };
        for (word, splats) in self.points.chunks(64).enumerate() {
            for (bit, splat) in splats.iter().enumerate() {
                let (disc, cosine) = disc(splat);
                if cosine > LEAST_COSINE {
                    let (above, below) = buffer.sees(&disc, TOLERANCE * splat.radius / pixel);
                    seen.above[word] |= u64::from(above) << bit;
                    seen.below[word] |= u64::from(below) << bit;
                }
            }
        }
        seen
    }

    /// The votes by point id.
    fn votes(&self, axes: &[Vec3], seen: &[(usize, Seen)]) -> Vec<Vote> {
        let in_order: Vec<Vote> = self
            .points
            .par_iter()
            .enumerate()
            .map(|(place, splat)| {
                let (word, bit) = (place / 64, place % 64);
                let mut vote = Vote::default();
                for (&axis, (_, seen)) in axes.iter().zip(seen) {
                    let above = (seen.above[word] >> bit & 1) as i32;
                    let below = (seen.below[word] >> bit & 1) as i32;
                    if above + below > 0 {
                        let cosine = splat.normal.dot(axis);
                        let angle = cosine.abs().min(1.0).acos();
                        let weight = ((-(angle / FADE).powi(2)).exp() * UNIT as f32).round() as i32;
                        let weight = if cosine < 0.0 { -weight } else { weight };
                        vote.signed += weight * (above - below);
                        vote.weight += weight.abs() * (above + below);
                    }
                }
                vote
            })
            .collect();
        let mut votes = vec![Vote::default(); in_order.len()];
        for (&id, vote) in self.ids.iter().zip(in_order) {
            votes[id as usize] = vote;
        }
        votes
    }
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
