//! Principal component analysis of k-neighborhoods.

use glam::{DVec3, Vec3};

use super::eigen::Symmetric3;
use super::for_each_neighborhood;
use crate::{Cancelled, Neighbors, PointCloud, Progress};

/// Fits the plane of least squared distance to each point and its `k` nearest.
///
/// Returns `n` unit normals in the order of the cloud; each sign is arbitrary. O(n k) time, parallel over points.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub fn pca(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    k: usize,
    progress: &dyn Progress,
) -> Result<Vec<Vec3>, Cancelled> {
    for_each_neighborhood(cloud, neighbors, k, progress, |_, offsets| fit(offsets).as_vec3())
}

/// The normal of the plane of least squared distance to a point and its neighbors at `offsets`.
pub(crate) fn fit(offsets: &[DVec3]) -> DVec3 {
    // The point itself has offset zero.
    let mean = offsets.iter().sum::<DVec3>() / (offsets.len() + 1) as f64;
    let mut scatter = Symmetric3::default();
    scatter.add_outer(1.0, mean);
    for &offset in offsets {
        scatter.add_outer(1.0, offset - mean);
    }
    scatter.eigen().vectors[0]
}
