//! Unit normals of arbitrary sign from k-neighborhoods.
//!
//! Neighborhoods without a plane still get a unit normal: one perpendicular to the line of collinear points, +z for
//! points in one place.

pub(crate) mod eigen;
mod obne;
mod pca;
mod rrht;
mod wpca;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

pub use obne::obne;
pub(crate) use pca::fit as plane_of_least_squares;
pub use pca::pca;
pub use rrht::rrht;
pub use wpca::wpca;

use crate::progress::{Part, Steps};
use crate::{Cancelled, Neighbors, PointCloud, Progress};

/// How a normal is fitted to a neighborhood.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// Principal component analysis: the plane of least squared distance.
    Pca,
    /// PCA with weights that fall with distance (Liu et al. eq. 1).
    Wpca,
    /// Robust randomized Hough transform, which keeps sharp edges (Boulch and Marlet 2012).
    Rrht,
    /// Orientation-benefit normal estimation (Liu et al. eq. 2–4).
    #[default]
    Obne,
}

impl Estimator {
    /// All estimators, in the order of menus.
    pub const ALL: [Self; 4] = [Self::Pca, Self::Wpca, Self::Rrht, Self::Obne];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pca => "pca",
            Self::Wpca => "wpca",
            Self::Rrht => "rrht",
            Self::Obne => "obne",
        }
    }

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Pca => "PCA",
            Self::Wpca => "WPCA",
            Self::Rrht => "RRHT",
            Self::Obne => "OBNE",
        }
    }

    /// Neighbors that a normal is usually fitted to.
    ///
    /// A plane is fitted best to the nearest few. The Hough transform lives on many different triples, of which 12 neighbors have
    /// 286 and 24 have 2300. Boulch and Marlet take 100 to 500 on dense scans; on the clouds here, where thin parts are few spacings
    /// wide, normals got worse from there on (mean angle on sharp clouds 4.2° with 24, 6.8° with 64, 8.5° with 100).
    pub fn usual_k(self) -> usize {
        match self {
            Self::Pca | Self::Wpca | Self::Obne => 12,
            Self::Rrht => 24,
        }
    }
}

/// Estimates one unit normal per point from the `k` nearest of each row of `neighbors`.
///
/// Returns `n` unit vectors in the order of the cloud; each sign is arbitrary. [`Estimator::Obne`] starts from the normals
/// of [`Estimator::Wpca`] with the same `k`.
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
    match estimator {
        Estimator::Pca => pca(cloud, neighbors, k, progress),
        Estimator::Wpca => wpca(cloud, neighbors, k, progress),
        Estimator::Rrht => rrht(cloud, neighbors, k, progress),
        Estimator::Obne => {
            let initial = wpca(cloud, neighbors, k, &Part::new(progress, 0.0..0.35))?;
            obne(cloud, neighbors, k, &initial, &Part::new(progress, 0.35..1.0))
        }
    }
}

/// Points that one task handles at a time.
const POINTS: usize = 1024;

/// Calls `normal_of(point, offsets)` for each point, in parallel; `offsets` are the positions of its first `k` neighbors
/// relative to its own.
fn for_each_neighborhood(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    k: usize,
    progress: &dyn Progress,
    normal_of: impl Fn(usize, &[DVec3]) -> Vec3 + Sync,
) -> Result<Vec<Vec3>, Cancelled> {
    let k = k.min(neighbors.k());
    let steps = Steps::new(progress, cloud.n_points());
    let mut normals = vec![Vec3::ZERO; cloud.n_points()];
    normals.par_chunks_mut(POINTS).enumerate().try_for_each_init(
        || Vec::with_capacity(k),
        |offsets, (task, normals)| {
            for (i, normal) in normals.iter_mut().enumerate() {
                let point = task * POINTS + i;
                offsets.clear();
                let row = &neighbors.of(point)[..k];
                offsets.extend(row.iter().map(|&neighbor| cloud.offset(point, neighbor as usize)));
                *normal = normal_of(point, offsets);
            }
            steps.advance(normals.len())
        },
    )?;
    Ok(normals)
}

/// Square of the reach of the weights `exp(−d²/ρ²)` within a neighborhood: ρ is half the largest distance between two of
/// its points, the center (offset zero) among them.
fn squared_rho(offsets: &[DVec3]) -> f64 {
    let mut largest: f64 = 0.0;
    for (i, a) in offsets.iter().enumerate() {
        largest = largest.max(a.length_squared());
        for b in &offsets[..i] {
            largest = largest.max((*a - *b).length_squared());
        }
    }
    0.25 * largest
}

#[cfg(test)]
mod tests;
