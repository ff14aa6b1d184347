//! Normals that keep to one sheet where sheets are close, and take a wider look where points are noisy.
//!
//! The plane of least squares over a k-neighborhood tilts where the neighborhood holds parts of two sheets. There, a plane through
//! the point that passes close by many neighbors is the point's own sheet. Noise has no such plane: what fits best fits few, and that
//! tells noise from sheets without knowing either.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::normals::eigen::Symmetric3;
use crate::normals::plane_of_least_squares;
use crate::progress::Steps;
use crate::{Cancelled, Neighbors, PointCloud, Progress};

/// Neighbors of a normal on a plain surface.
const K_PLAIN: usize = 12;
/// Neighbors that may support a plane: about two rings around a point, or one on each of two sheets.
const K_SUPPORT: usize = 20;
/// Neighbors of a normal in noise. Twice as many halve the points whose normal is more than 60° off.
pub(super) const K_NOISY: usize = 24;
/// Neighbors whose pairs span candidate planes: 28 pairs, most of them on the own sheet even if every other neighbor is not.
const K_CANDIDATES: usize = 8;

/// A neighbor at this distance from a plane, in radii of the point, supports it by half.
const CLOSE: f64 = 0.1;
/// Mean support around a point below which it counts as noisy. On surfaces, however thin, it was measured above 0.43 and in
/// noise of 0.3 of the spacing or more below 0.40.
const NOISY: f32 = 0.39;
/// Mean support around a point from which on sheets are looked for.
const CLEAN: f32 = 0.43;
/// How much more support than the plane of least squares a sheet must have, as a share of the neighbors.
const LEAST_GAIN: f64 = 0.2;
/// Share of the other neighbors that a second plane through the point explains at a sharp edge. At an edge the normal between both
/// faces is wanted: its sign is clear, as seen from either.
const EDGE: f64 = 0.6;

/// The normals, and where they are noisy.
pub(super) struct SheetNormals {
    /// `n` unit normals of any sign.
    pub normals: Vec<Vec3>,
    /// By point: whether its neighborhood has no plane to speak of.
    pub noisy: Vec<bool>,
}

/// What one point's neighborhood says.
#[derive(Clone, Copy, Default)]
struct Fit {
    plain: Vec3,
    sheet: Vec3,
    support: f32,
    is_sheet: bool,
}

/// Estimates normals from neighborhoods of at least [`K_NOISY`] (fewer in smaller clouds); `radii` by point.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub(super) fn sheet_normals(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    radii: &[f32],
    progress: &dyn Progress,
) -> Result<SheetNormals, Cancelled> {
    let n_points = cloud.n_points();
    let k_support = K_SUPPORT.min(neighbors.k());
    let steps = Steps::new(progress, n_points);
    let mut fits = vec![Fit::default(); n_points];
    fits.par_chunks_mut(POINTS).enumerate().try_for_each_init(
        || Vec::with_capacity(K_SUPPORT),
        |offsets, (task, fits)| {
            for (point, fit) in (task * POINTS..).zip(fits.iter_mut()) {
                offsets_of(cloud, point, &neighbors.of(point)[..k_support], radii[point], offsets);
                *fit = Fit::of(offsets);
            }
            steps.advance(fits.len())
        },
    )?;
    let mean_support: Vec<f32> = (0..n_points)
        .into_par_iter()
        .with_min_len(POINTS)
        .map(|point| {
            let row = neighbors.of(point);
            let sum: f32 = row.iter().map(|&neighbor| fits[neighbor as usize].support).sum();
            (sum + fits[point].support) / (row.len() + 1) as f32
        })
        .collect();
    let k_noisy = K_NOISY.min(neighbors.k());
    let normals = (0..n_points)
        .into_par_iter()
        .with_min_len(POINTS)
        .map_init(Vec::new, |offsets, point| {
            let fit = fits[point];
            if mean_support[point] < NOISY {
                offsets_of(cloud, point, &neighbors.of(point)[..k_noisy], radii[point], offsets);
                plane_of_least_squares(offsets).as_vec3()
            } else if fit.is_sheet && mean_support[point] > CLEAN {
                fit.sheet
            } else {
                fit.plain
            }
        })
        .collect();
    let noisy = mean_support.iter().map(|&support| support < NOISY).collect();
    Ok(SheetNormals { normals, noisy })
}

/// Points that one task handles at a time.
const POINTS: usize = 1024;

/// The neighbors' positions relative to the point's, in its radii.
fn offsets_of(cloud: &PointCloud, point: usize, row: &[u32], radius: f32, offsets: &mut Vec<DVec3>) {
    let radius = f64::from(radius).max(f64::MIN_POSITIVE);
    offsets.clear();
    offsets.extend(
        row.iter()
            .map(|&neighbor| cloud.offset(point, neighbor as usize) / radius),
    );
}

/// How far a neighbor at `offset` supports the plane through the point with this normal: 1 on it, ½ at [`CLOSE`].
#[inline]
fn closeness(normal: DVec3, offset: DVec3) -> f64 {
    let distance = normal.dot(offset) * (1.0 / CLOSE);
    let square = distance * distance;
    1.0 / (1.0 + square * square)
}

fn support(normal: DVec3, offsets: &[DVec3]) -> f64 {
    offsets.iter().map(|&offset| closeness(normal, offset)).sum()
}

impl Fit {
    fn of(offsets: &[DVec3]) -> Self {
        let plain = plane_of_least_squares(&offsets[..K_PLAIN.min(offsets.len())]);
        let most = offsets.len().max(1) as f64;
        let plain_support = support(plain, offsets);
        if plain_support >= (1.0 - LEAST_GAIN) * most {
            // No other plane can have so much more.
            return Self {
                plain: plain.as_vec3(),
                sheet: plain.as_vec3(),
                support: (plain_support / most) as f32,
                is_sheet: false,
            };
        }
        let mut best = (plain_support, plain);
        let mut second = (0.0, plain);
        for_each_plane(&offsets[..K_CANDIDATES.min(offsets.len())], 0.3, |normal| {
            let found = (support(normal, offsets), normal);
            if found.0 > best.0 {
                second = best;
                best = found;
            } else if found.0 > second.0 {
                second = found;
            }
        });
        for start in [best.1, second.1] {
            let normal = settled(start, offsets);
            let found = support(normal, offsets);
            if found > best.0 {
                best = (found, normal);
            }
        }
        let is_sheet = best.0 > plain_support + LEAST_GAIN * most && !is_edge(best.1, offsets);
        Self {
            plain: plain.as_vec3(),
            sheet: best.1.as_vec3(),
            support: (best.0 / most) as f32,
            is_sheet,
        }
    }
}

/// Calls `found` with the unit normal of the plane through the point and each two of the offsets that are not nearly on a line: the
/// sine of the angle between them is at least `least_sine`.
fn for_each_plane(offsets: &[DVec3], least_sine: f64, mut found: impl FnMut(DVec3)) {
    for (i, a) in offsets.iter().enumerate() {
        for b in &offsets[..i] {
            let normal = a.cross(*b);
            let length = normal.length();
            if length > 0.0 && length >= least_sine * a.length() * b.length() {
                found(normal / length);
            }
        }
    }
}

/// Repeats of the weighted fit; more change the fourth digit.
const REPEATS: usize = 4;

/// The plane through the point that its close neighbors settle on, from a first guess, by least squares with weights that fall with the
/// distance from the plane.
fn settled(mut normal: DVec3, offsets: &[DVec3]) -> DVec3 {
    for _ in 0..REPEATS {
        let mut scatter = Symmetric3::default();
        for &offset in offsets {
            scatter.add_outer(closeness(normal, offset).powi(2), offset);
        }
        normal = scatter.eigen().vectors[0];
    }
    normal
}

/// Whether the neighbors off the plane are on another plane through the point: then the point is on a sharp edge.
fn is_edge(normal: DVec3, offsets: &[DVec3]) -> bool {
    let mut off = [DVec3::ZERO; K_SUPPORT];
    let mut n_off = 0;
    for &offset in offsets.iter().filter(|offset| normal.dot(**offset).abs() > 1.5 * CLOSE) {
        off[n_off] = offset;
        n_off += 1;
    }
    let off = &off[..n_off];
    if off.len() < 3 {
        return true;
    }
    let mut most: f64 = 0.0;
    for_each_plane(&off[..K_CANDIDATES.min(n_off)], 0.2, |other| {
        most = most.max(support(other, off))
    });
    most >= EDGE * n_off as f64
}
