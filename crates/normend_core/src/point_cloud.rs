//! Finite positions in `f32` around an `f64` origin.

use std::ops::RangeInclusive;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

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
    #[error(
        "{n_points} points are more than the {} that Normend can number: split the scan",
        PointCloud::MAX_POINTS
    )]
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
    /// The most points that ids (`u32`) can number; `u32::MAX` stays free for "no point".
    pub const MAX_POINTS: usize = u32::MAX as usize - 1;

    /// Checks `positions` (relative to `origin`) and takes them. O(n).
    ///
    /// # Errors
    /// [`PointCloudError`]: a position that is not finite, too many points, an extent out of range.
    pub fn new(origin: DVec3, positions: Vec<Vec3>) -> Result<Self, PointCloudError> {
        check_count(positions.len())?;
        if let Some(point) = positions.par_iter().position_first(|position| !position.is_finite()) {
            return Err(PointCloudError::NotFinite { point });
        }
        let (min, max) = if positions.is_empty() {
            (Vec3::ZERO, Vec3::ZERO)
        } else {
            positions.par_iter().map(|&position| (position, position)).reduce(
                || (Vec3::INFINITY, Vec3::NEG_INFINITY),
                |a, b| (a.0.min(b.0), a.1.max(b.1)),
            )
        };
        check_extent((max.as_dvec3() - min.as_dvec3()).length())?;
        Ok(Self {
            origin,
            positions,
            min,
            max,
        })
    }

    /// Takes `points` in the file's coordinates and chooses the origin. O(n).
    ///
    /// On each axis the origin is 0 when the points are near 0 relative to their extent; then coordinates that are `f32`
    /// stay as they are. Else it is the middle of the bounding box rounded to a power of two about as large as the
    /// extent, so that `f32` spends its 24 bits on the extent (georeferenced scans) and round coordinates stay round.
    ///
    /// # Errors
    /// [`PointCloudError`], as [`Self::new`].
    pub fn from_f64(points: &[DVec3]) -> Result<Self, PointCloudError> {
        check_count(points.len())?;
        if let Some(point) = points.par_iter().position_first(|point| !point.is_finite()) {
            return Err(PointCloudError::NotFinite { point });
        }
        if points.is_empty() {
            return Self::new(DVec3::ZERO, Vec::new());
        }
        let (min, max) = points.par_iter().map(|&point| (point, point)).reduce(
            || (DVec3::INFINITY, DVec3::NEG_INFINITY),
            |a, b| (a.0.min(b.0), a.1.max(b.1)),
        );
        let origin = Self::origin_for(min, max)?;
        Self::new(
            origin,
            points.par_iter().map(|&point| (point - origin).as_vec3()).collect(),
        )
    }

    /// The origin that [`Self::from_f64`] chooses for points with this bounding box, in the file's coordinates.
    ///
    /// # Errors
    /// [`PointCloudError::Extent`].
    pub fn origin_for(min: DVec3, max: DVec3) -> Result<DVec3, PointCloudError> {
        let extent = (max - min).length();
        check_extent(extent)?;
        // The largest power of two up to the extent: its exponent, without the mantissa.
        let step = f64::from_bits(extent.to_bits() & 0x7ff0_0000_0000_0000);
        let origin_on_axis = |min: f64, max: f64| {
            let middle = min + 0.5 * (max - min);
            if extent == 0.0 {
                min
            } else if middle.abs() <= extent {
                0.0
            } else {
                (middle / step).round() * step
            }
        };
        Ok(DVec3::new(
            origin_on_axis(min.x, max.x),
            origin_on_axis(min.y, max.y),
            origin_on_axis(min.z, max.z),
        ))
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

/// Spans whose squared distances `f32` can tell apart.
const EXTENTS: RangeInclusive<f64> = 1e-15..=1e15;

fn check_count(n_points: usize) -> Result<(), PointCloudError> {
    if n_points <= PointCloud::MAX_POINTS {
        Ok(())
    } else {
        Err(PointCloudError::TooMany { n_points })
    }
}

fn check_extent(extent: f64) -> Result<(), PointCloudError> {
    // All points in one place have no extent, and no distances that could go wrong.
    if extent == 0.0 || EXTENTS.contains(&extent) {
        Ok(())
    } else {
        Err(PointCloudError::Extent { extent })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn refuses_what_is_not_finite() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(0.0, f32::NAN, 0.0), Vec3::INFINITY];
        let expect = PointCloudError::NotFinite { point: 2 };
        assert_eq!(PointCloud::new(DVec3::ZERO, positions.clone()).unwrap_err(), expect);
        let points: Vec<DVec3> = positions.iter().map(|position| position.as_dvec3()).collect();
        assert_eq!(PointCloud::from_f64(&points).unwrap_err(), expect);
    }

    #[test]
    fn refuses_extents_out_of_range() {
        for extent in [1e-20_f32, 1e20] {
            let result = PointCloud::new(DVec3::ZERO, vec![Vec3::ZERO, Vec3::X * extent]);
            assert!(matches!(result, Err(PointCloudError::Extent { .. })), "{extent}");
        }
        let result = PointCloud::from_f64(&[DVec3::ZERO, DVec3::X * 1e300]);
        assert!(matches!(result, Err(PointCloudError::Extent { .. })));
    }

    #[test]
    fn takes_empty_and_single() {
        let empty = PointCloud::from_f64(&[]).unwrap();
        assert_eq!(empty.bounding_box(), (Vec3::ZERO, Vec3::ZERO));
        let far = DVec3::new(512_345.678_9, 5_412_345.678_9, 123.4);
        let single = PointCloud::from_f64(&[far, far]).unwrap();
        assert_eq!(single.diagonal(), 0.0);
        assert_eq!(single.origin() + single.positions()[1].as_dvec3(), far);
    }

    #[test]
    fn keeps_f32_coordinates_near_zero() {
        let points = [
            DVec3::new(0.1_f32.into(), 0.2_f32.into(), (-0.3_f32).into()),
            DVec3::ONE,
        ];
        let cloud = PointCloud::from_f64(&points).unwrap();
        assert_eq!(cloud.origin(), DVec3::ZERO);
        assert_eq!(cloud.positions()[0], Vec3::new(0.1, 0.2, -0.3));
    }

    #[test]
    fn bounding_box_is_exact() {
        let cloud = PointCloud::new(DVec3::ZERO, vec![Vec3::new(1.0, -2.0, 3.0), Vec3::new(-1.0, 2.0, 5.0)]).unwrap();
        assert_eq!(
            cloud.bounding_box(),
            (Vec3::new(-1.0, -2.0, 3.0), Vec3::new(1.0, 2.0, 5.0))
        );
        assert_eq!(cloud.diagonal(), 24.0_f32.sqrt());
    }

    proptest! {
        #[test]
        fn georeferenced_millimeters_survive(
            corner in (-1e7_f64..1e7, -1e7_f64..1e7, -1e3_f64..1e3),
            steps in prop::collection::vec((0_u32..200_000, 0_u32..200_000, 0_u32..50_000), 2..50),
        ) {
            let corner = DVec3::from(corner).round();
            let points: Vec<DVec3> = steps
                .iter()
                .map(|&(x, y, z)| corner + DVec3::new(x.into(), y.into(), z.into()) * 1e-3)
                .collect();
            let cloud = PointCloud::from_f64(&points).unwrap();
            for (point, position) in points.iter().zip(cloud.positions()) {
                let error = (cloud.origin() + position.as_dvec3() - *point).abs().max_element();
                // 24 bits over 300 m are 0.02 mm.
                prop_assert!(error <= 2e-5, "{error}");
            }
        }

        #[test]
        fn a_binary_lattice_stays_exact(
            corner in (-1_000_000_i32..1_000_000, -1_000_000_i32..1_000_000, -1000_i32..1000),
            steps in prop::collection::vec((0_u32..4096, 0_u32..4096, 0_u32..4096), 2..50),
        ) {
            let corner = DVec3::new(corner.0.into(), corner.1.into(), corner.2.into());
            let points: Vec<DVec3> =
                steps.iter().map(|&(x, y, z)| corner + DVec3::new(x.into(), y.into(), z.into()) / 64.0).collect();
            let cloud = PointCloud::from_f64(&points).unwrap();
            for (point, position) in points.iter().zip(cloud.positions()) {
                prop_assert_eq!(cloud.origin() + position.as_dvec3(), *point);
            }
        }
    }
}
