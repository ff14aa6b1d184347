//! Orientation-benefit normal estimation.

use glam::{DVec3, Vec3};

use super::eigen::Symmetric3;
use super::{for_each_neighborhood, squared_rho};
use crate::{Cancelled, Neighbors, PointCloud, Progress};

/// Estimates one unit normal per point by orientation-benefit normal estimation (OBNE, Liu et al. eq. 2–4).
///
/// * `neighbors` – the first `k` of each row count; with fewer than 2 every normal stays initial
/// * `initial` – `n` unit normals of any sign, as [`wpca`](super::wpca()) gives them
///
/// Minimizes `Σ_jk (w_jk + d_jk) (n_i · (p_j − p_k))²` over the pairs of neighbors, with `w_jk` as in WPCA and
/// `d_jk = 1 − |n_j · n_k| d̄ / (1 + len)`, where len is the pair's distance in units of the bounding box's diagonal. With
/// u the direction from p_j to p_k, a = n_j · u, b = n_k · u and c = n_j · n_k, the largest distance of the paper's four
/// midpoints from the line is `d̄ = ½ √(2 − a² − b² + 2 |c − a b|)`.
///
/// Returns `n` unit vectors in the order of the cloud; each sign is arbitrary. A neighborhood without a plane (one line, one
/// place) keeps its initial normal. O(n k²) time, parallel over points, same result for any number of threads.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub fn obne(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    k: usize,
    initial: &[Vec3],
    progress: &dyn Progress,
) -> Result<Vec<Vec3>, Cancelled> {
    let diagonal = f64::from(cloud.diagonal());
    for_each_neighborhood(cloud, neighbors, k, progress, |point, offsets| {
        let squared_rho = squared_rho(offsets);
        if squared_rho == 0.0 {
            return initial[point];
        }
        let row = neighbors.of(point);
        let mut scatter = Symmetric3::default();
        for (j, &offset_j) in offsets.iter().enumerate() {
            let normal_j = initial[row[j] as usize].as_dvec3();
            for (&offset_l, &l) in offsets[..j].iter().zip(row) {
                let edge = offset_j - offset_l;
                let squared_length = edge.length_squared();
                // Two neighbors in one place have no edge, and nothing to add.
                if squared_length > 0.0 {
                    let normal_l = initial[l as usize].as_dvec3();
                    let near = (-squared_length / squared_rho).exp();
                    let varied = variation(normal_j, normal_l, edge, squared_length, diagonal);
                    scatter.add_outer(near + varied, edge);
                }
            }
        }
        let eigen = scatter.eigen();
        if eigen.values[1] > FLAT * eigen.values[2] {
            eigen.vectors[0].as_vec3()
        } else {
            initial[point]
        }
    })
}

/// Second eigenvalues below this share of the first are rounding: the neighborhood is a line.
const FLAT: f64 = 1e-12;

/// `d_jk`, the extent of normal variation between two neighbors, in 0..=1 up to rounding.
#[inline]
fn variation(normal_j: DVec3, normal_k: DVec3, edge: DVec3, squared_length: f64, diagonal: f64) -> f64 {
    // a and b times the length: the edge stays as it is, and no direction is computed.
    let (a, b, c) = (normal_j.dot(edge), normal_k.dot(edge), normal_j.dot(normal_k));
    let scale = squared_length.recip();
    let squared_distance = (2.0 - (a * a + b * b) * scale + 2.0 * (c - a * b * scale).abs()).max(0.0);
    1.0 - c.abs() * 0.5 * squared_distance.sqrt() / (1.0 + squared_length.sqrt() / diagonal)
}
