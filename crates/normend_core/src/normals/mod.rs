//! Unit normals of arbitrary sign from k-neighborhoods.

use glam::Vec3;

use crate::{Cancelled, Neighbors, PointCloud, Progress};

/// How a normal is fitted to a neighborhood.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// Principal component analysis: the plane of least squared distance.
    Pca,
    /// PCA with weights that fall with distance (Liu et al. eq. 1).
    Wpca,
    /// Orientation-benefit normal estimation (Liu et al. eq. 2–4).
    #[default]
    Obne,
}

impl Estimator {
    /// All estimators, in the order of menus.
    pub const ALL: [Self; 3] = [Self::Pca, Self::Wpca, Self::Obne];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pca => "pca",
            Self::Wpca => "wpca",
            Self::Obne => "obne",
        }
    }

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Pca => "PCA",
            Self::Wpca => "WPCA",
            Self::Obne => "OBNE",
        }
    }
}

/// Estimates one unit normal per point from the `k` nearest of each row of `neighbors`.
///
/// Returns `n` unit vectors in the order of the cloud; each sign is arbitrary.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub fn estimate(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    k: usize,
    estimator: Estimator,
    progress: &dyn Progress,
) -> Result<Vec<Vec3>, Cancelled> {
    let _ = (cloud, neighbors, k, estimator, progress);
    unimplemented!()
}
