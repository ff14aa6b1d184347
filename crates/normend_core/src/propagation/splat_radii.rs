//! Radii of discs that close the surface between neighbors.

use rayon::prelude::*;

use crate::{Neighbors, PointCloud};

/// Neighbors that a radius looks at: on a surface about as many as stand around a point.
pub(super) const K: usize = 6;

/// One radius per point, in the cloud's unit, positive and finite.
///
/// Discs as large as the distance to the sixth neighbor leave half a thousandth of a surface open when its points are
/// random, and nothing when they are even. A point alone far outside would be a disc as large as its distance, so a radius
/// is at most three times that of the neighbors' middle.
pub(super) fn splat_radii(cloud: &PointCloud, neighbors: &Neighbors) -> Vec<f32> {
    let k = K.min(neighbors.k());
    let reach: Vec<f32> = (0..cloud.n_points())
        .into_par_iter()
        .map(|point| {
            let row = neighbors.of(point);
            let distance = |neighbor: u32| cloud.offset(point, neighbor as usize).as_vec3().length();
            // With copies in one place the first neighbor elsewhere counts.
            row[k.saturating_sub(1)..]
                .iter()
                .map(|&neighbor| distance(neighbor))
                .find(|&length| length > 0.0)
                .unwrap_or(0.0)
        })
        .collect();
    let fallback = fallback(cloud, &reach);
    let reach_or_fallback = |point: usize| if reach[point] > 0.0 { reach[point] } else { fallback };
    (0..cloud.n_points())
        .into_par_iter()
        .map(|point| {
            let mut around = [f32::INFINITY; K];
            for (place, &neighbor) in around.iter_mut().zip(&neighbors.of(point)[..k]) {
                *place = reach_or_fallback(neighbor as usize);
            }
            around.sort_unstable_by(f32::total_cmp);
            reach_or_fallback(point).min(3.0 * around[k / 2])
        })
        .collect()
}

/// For points with all neighbors in one place: the middle of the other points' reaches, or some part of the cloud.
fn fallback(cloud: &PointCloud, reach: &[f32]) -> f32 {
    let mut positive: Vec<f32> = reach.iter().copied().filter(|&length| length > 0.0).collect();
    if positive.is_empty() {
        return if cloud.diagonal() > 0.0 {
            0.05 * cloud.diagonal()
        } else {
            // All is in one place, which a view shows from a distance of 1.
            0.05
        };
    }
    let middle = positive.len() / 2;
    *positive.select_nth_unstable_by(middle, f32::total_cmp).1
}
