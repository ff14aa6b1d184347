//! Weighted principal component analysis of k-neighborhoods.

use glam::Vec3;

use super::eigen::Symmetric3;
use super::{for_each_neighborhood, squared_rho};
use crate::{Cancelled, Neighbors, PointCloud, Progress};

/// Fits a plane through each point to its `k` nearest, with weights that fall with distance (WPCA, Liu et al. eq. 1).
///
/// Minimizes `Σ_j w_ij (n_i · (p_j − p_i))²` with `w_ij = exp(−|p_i − p_j|² / ρ²)`, where ρ is half the largest distance
/// within the neighborhood. Returns `n` unit normals in the order of the cloud; each sign is arbitrary. O(n k²) time,
/// parallel over points.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub fn wpca(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    k: usize,
    progress: &dyn Progress,
) -> Result<Vec<Vec3>, Cancelled> {
    for_each_neighborhood(cloud, neighbors, k, progress, |_, offsets| {
        let squared_rho = squared_rho(offsets);
        let mut scatter = Symmetric3::default();
        if squared_rho > 0.0 {
            for &offset in offsets {
                scatter.add_outer((-offset.length_squared() / squared_rho).exp(), offset);
            }
        }
        scatter.eigen().vectors[0].as_vec3()
    })
}
