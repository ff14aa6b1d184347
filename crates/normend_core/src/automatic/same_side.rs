//! A second look at each point with the neighbors that turned out to be on its own sheet.

use fixedbitset::FixedBitSet;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::sheet_normals::K_NOISY;
use crate::normals::plane_of_least_squares;
use crate::{Neighbors, PointCloud};

/// Nearest neighbors among which those on the same side are looked for.
const K_NEAR: usize = 16;
/// Those of them that a normal is fitted to.
const K_FIT: usize = 12;
/// Fewer span no plane that could be trusted more than the one before.
const LEAST_FIT: usize = 4;
/// Cosine between oriented normals from which on a neighbor is on the same side: far from right angles, where noise decides.
const SAME_SIDE: f32 = 0.2;
/// Same-side neighbors in the graph.
const K_SAME: usize = 8;
/// Nearest neighbors in the graph, whichever side: they connect sheets.
const K_ANY: usize = 4;
/// Length of a row of the graph.
pub(super) const K_ROW: usize = K_SAME + K_ANY;

/// New normals, with the signs of the old ones, and the rows of a graph that mostly stays on one side of each sheet.
pub(super) struct SecondLook {
    pub normals: Vec<Vec3>,
    /// [`K_ROW`] neighbors a point, [`u32::MAX`] where there are fewer.
    pub rows: Vec<u32>,
}

/// Fits normals to same-side neighbors by the signs found so far. O(n), in parallel.
pub(super) fn second_look(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    normals: &[Vec3],
    noisy: &[bool],
    turned: &FixedBitSet,
) -> SecondLook {
    let n_points = normals.len();
    let oriented = |point: usize| {
        if turned.contains(point) {
            -normals[point]
        } else {
            normals[point]
        }
    };
    let mut rows = vec![u32::MAX; n_points * K_ROW];
    let normals = rows
        .par_chunks_mut(K_ROW)
        .with_min_len(1024)
        .enumerate()
        .map_init(
            || (Vec::<u32>::new(), Vec::<DVec3>::new()),
            |(same, offsets), (point, row)| {
                let (k_near, k_fit) = if noisy[point] {
                    (K_NOISY, K_NOISY)
                } else {
                    (K_NEAR, K_FIT)
                };
                let near = &neighbors.of(point)[..k_near.min(neighbors.k())];
                let normal = oriented(point);
                same.clear();
                same.extend(
                    near.iter()
                        .filter(|&&other| normal.dot(oriented(other as usize)) > SAME_SIDE)
                        .take(k_fit),
                );
                let in_graph = same.iter().take(K_SAME);
                let any = near
                    .iter()
                    .take(K_ANY)
                    .filter(|other| !same.iter().take(K_SAME).any(|s| s == *other));
                for (place, &other) in row.iter_mut().zip(in_graph.chain(any)) {
                    *place = other;
                }
                if same.len() < LEAST_FIT {
                    return normals[point];
                }
                offsets.clear();
                offsets.extend(same.iter().map(|&other| cloud.offset(point, other as usize)));
                let fitted = plane_of_least_squares(offsets).as_vec3();
                if fitted.dot(normals[point]) < 0.0 {
                    -fitted
                } else {
                    fitted
                }
            },
        )
        .collect();
    SecondLook { normals, rows }
}
