//! Finite positions in `f32` around an `f64` origin.

use glam::{DVec3, Vec3};

/// The points of a scan: finite positions, in the file's order, relative to an origin in the file's coordinates.
///
/// A file point is `origin + position`. Points of the file that are not finite are not in the cloud; who reads the file
/// keeps them (see `normend_io::Scan::rows`).
#[derive(Clone, Debug)]
pub struct PointCloud {
    origin: DVec3,
    positions: Vec<Vec3>,
    min: Vec3,
    max: Vec3,
}

/// Why positions do not make a [`PointCloud`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PointCloudError {
    /// A coordinate is NaN or infinite.
    #[error("point {point} is not finite: leave it out")]
    NotFinite {
        /// Index of the first such point.
        point: usize,
    },
    /// More points than ids (`u32`).
    #[error("{n_points} points are more than the 4 294 967 294 that Normend can number: split the scan")]
    TooMany {
        /// How many there are.
        n_points: usize,
    },
    /// The extent is so small or so large that squared distances leave the range of `f32`.
    #[error("the points span {extent:e} units; Normend works with spans between 1e-15 and 1e15: change the unit")]
    Extent {
        /// Diagonal of the bounding box.
        extent: f64,
    },
}

impl PointCloud {
    /// Checks `positions` (relative to `origin`) and takes them.
    ///
    /// # Errors
    /// [`PointCloudError`]: a position that is not finite, too many points, an extent out of range.
    pub fn new(origin: DVec3, positions: Vec<Vec3>) -> Result<Self, PointCloudError> {
        let _ = (origin, positions);
        unimplemented!()
    }

    /// Number of points.
    pub fn n_points(&self) -> usize {
        self.positions.len()
    }

    /// The origin in the file's coordinates.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// `n` positions relative to [`Self::origin`], in the file's order and unit.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Smallest and largest corner of the bounding box, relative to the origin; both zero for an empty cloud.
    pub fn bounding_box(&self) -> (Vec3, Vec3) {
        (self.min, self.max)
    }

    /// Length of the bounding box's diagonal.
    pub fn diagonal(&self) -> f32 {
        (self.max - self.min).length()
    }
}
