//! Finite positions in `f32` around an `f64` origin, with what `f32` rounds away where that matters.
//!
//! `f32` has 24 bits, which are spent on the extent: 0.03 mm in a scan of 1 km, 4 mm in one of 100 km. Where points stand nearly as
//! close as that, neighbors and normals would be those of the rounding. Such a cloud keeps the next 8 bits too, as *remainders*:
//! [`PointCloud::offset`] and [`PointCloud::relative`] are what neighbors, normals and edges are computed from, everywhere.

use std::ops::RangeInclusive;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// The points of a scan: finite positions, in the file's order, relative to an origin in the file's coordinates.
///
/// A file point is `origin + position`, up to rounding. Points of the file that are not finite are not in the cloud; who reads the
/// file keeps them (see `normend_io::Scan::rows`). 12 bytes a point, and 3 more with remainders.
#[derive(Clone, Debug)]
pub struct PointCloud {
    origin: DVec3,
    positions: Vec<Vec3>,
    /// By point what its position lacks, in [`Self::remainder_step`]; empty where `f32` is fine enough.
    remainders: Vec<[i8; 3]>,
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
    #[error(
        "the points span {extent:e} units; Normend works with spans between 1e-15 and 1e15: change the unit, or take out points that are \
         far from all others"
    )]
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
            remainders: Vec::new(),
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
        let positions = points.par_iter().map(|&point| (point - origin).as_vec3()).collect();
        let mut cloud = Self::new(origin, positions)?;
        let is_rounded = |(id, &point): (usize, &DVec3)| cloud.remainder(id, point) != [0; 3];
        if points.par_iter().enumerate().any(is_rounded) && cloud.is_coarse() {
            let remainders = (points.par_iter().enumerate()).map(|(id, &point)| cloud.remainder(id, point));
            cloud.remainders = remainders.collect();
        }
        Ok(cloud)
    }

    /// One cloud of several, their points one after another in the order given. Each is dropped as soon as its points are taken over. O(n).
    ///
    /// # Errors
    /// [`PointCloudError`]: too many points, an extent out of range.
    pub fn together(clouds: Vec<Arc<Self>>) -> Result<Self, PointCloudError> {
        let n_points = clouds.iter().map(|cloud| cloud.n_points()).sum();
        check_count(n_points)?;
        let corners = clouds.iter().filter(|cloud| cloud.n_points() > 0);
        let corners = corners.map(|cloud| [cloud.min, cloud.max].map(|corner| cloud.origin + corner.as_dvec3()));
        let corners = corners.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        let Some([min, max]) = corners else {
            return Self::new(DVec3::ZERO, Vec::new());
        };
        let origin = Self::origin_for(min, max)?;
        // The corners of what is stored, which the unit of remainders goes by, before the first remainder is taken.
        let stored = |cloud: &Self, point: usize| (cloud.relative(point) + (cloud.origin - origin)).as_vec3();
        let (min, max) = clouds
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |corners, cloud| {
                let positions = (0..cloud.n_points()).into_par_iter().map(|point| stored(cloud, point));
                positions
                    .map(|position| (position, position))
                    .reduce(|| corners, |a, b| (a.0.min(b.0), a.1.max(b.1)))
            });
        let mut joined = Self {
            origin,
            positions: Vec::with_capacity(n_points),
            remainders: Vec::with_capacity(n_points),
            min,
            max,
        };
        for cloud in clouds {
            let points = 0..cloud.n_points();
            joined
                .positions
                .par_extend(points.clone().into_par_iter().map(|point| stored(&cloud, point)));
            let mut remainders = std::mem::take(&mut joined.remainders);
            let first = remainders.len();
            remainders.par_extend(points.into_par_iter().map(|point| {
                let lacks =
                    cloud.relative(point) + (cloud.origin - origin) - joined.positions[first + point].as_dvec3();
                joined.in_remainder_steps(lacks)
            }));
            joined.remainders = remainders;
        }
        let is_rounded = joined.remainders.par_iter().any(|remainder| *remainder != [0; 3]);
        if !(is_rounded && joined.is_coarse()) {
            joined.remainders = Vec::new();
        }
        Ok(joined)
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

    /// Whether points stand so close that `f32`, over the extent of the cloud, rounds away what matters: one in a hundred or more
    /// shares a cell of `COARSE` steps with another one. Where not, normals are off by less than a twentieth of a degree for that.
    /// O(n log n), in parallel; 8 bytes a point while it works.
    pub fn is_coarse(&self) -> bool {
        let cell = COARSE * self.float_step();
        if cell <= 0.0 {
            return false;
        }
        let keys = self.positions.par_iter().map(|position| {
            let cell = ((*position - self.min).as_dvec3() / cell).as_u64vec3();
            // Each axis has about 2^21 cells at most.
            (cell.x << 42) ^ (cell.y << 21) ^ cell.z
        });
        let mut keys: Vec<u64> = keys.collect();
        keys.par_sort_unstable();
        let n_sharing: usize = keys
            .par_chunk_by(|a, b| a == b)
            .map(|same| if same.len() > 1 { same.len() } else { 0 })
            .sum();
        n_sharing as f64 > COARSE_SHARE * keys.len() as f64
    }

    /// What the position of `point` lacks of the exact place in the file's coordinates, to be given to
    /// [`Self::with_remainders`].
    pub fn remainder(&self, point: usize, exact: DVec3) -> [i8; 3] {
        self.in_remainder_steps((exact - self.origin) - self.positions[point].as_dvec3())
    }

    fn in_remainder_steps(&self, lacks: DVec3) -> [i8; 3] {
        let steps = lacks / self.remainder_step().max(f64::MIN_POSITIVE);
        // The cast saturates: half a step of f32 up is 128.
        steps.round().to_array().map(|steps| steps as i8)
    }

    /// The same cloud with what each of its positions lacks, see [`Self::remainder`].
    ///
    /// # Panics
    /// When there are not as many remainders as points.
    pub fn with_remainders(mut self, remainders: Vec<[i8; 3]>) -> Self {
        assert_eq!(remainders.len(), self.n_points(), "a remainder for each point");
        self.remainders = remainders;
        self
    }

    /// Whether it keeps what `f32` rounds away.
    pub fn has_remainders(&self) -> bool {
        !self.remainders.is_empty()
    }

    /// The largest distance between neighboring `f32` coordinates of the cloud; 0 when all are 0.
    fn float_step(&self) -> f64 {
        let largest = self.min.abs().max(self.max.abs()).max_element();
        // The exponent without the mantissa, and 23 bits down from there.
        f64::from(f32::from_bits(largest.to_bits() & 0x7f80_0000)) * 2.0_f64.powi(-23)
    }

    /// The unit of remainders.
    fn remainder_step(&self) -> f64 {
        self.float_step() / 256.0
    }

    /// The place of `point` relative to [`Self::origin`], as exactly as it is known.
    #[inline]
    pub fn relative(&self, point: usize) -> DVec3 {
        let position = self.positions[point].as_dvec3();
        match self.remainders.get(point) {
            None => position,
            Some(&[x, y, z]) => position + DVec3::new(x.into(), y.into(), z.into()) * self.remainder_step(),
        }
    }

    /// The way from one point to another, as exactly as both are known.
    #[inline]
    pub fn offset(&self, from: usize, to: usize) -> DVec3 {
        self.relative(to) - self.relative(from)
    }

    /// The cloud of some of the points, in their order, around the same origin.
    pub(crate) fn subset(&self, points: &[u32]) -> Self {
        let position = |&point: &u32| self.positions[point as usize];
        let positions: Vec<Vec3> = points.par_iter().map(position).collect();
        let has_remainders = self.has_remainders();
        let remainders = points.par_iter().filter(|_| has_remainders);
        let remainders = remainders.map(|&point| self.remainders[point as usize]).collect();
        // Corners of the whole, so that the unit of remainders and all that goes by the extent stay the same.
        Self {
            origin: self.origin,
            positions,
            remainders,
            min: self.min,
            max: self.max,
        }
    }

    /// Two numbers that are equal for points in one place.
    #[inline]
    pub(crate) fn place_key(&self, point: usize) -> u64 {
        // 0 and −0 are one place.
        let [x, y, z] = (self.positions[point] + 0.0)
            .to_array()
            .map(|value| u64::from(value.to_bits()));
        let [a, b, c] = self
            .remainders
            .get(point)
            .copied()
            .unwrap_or_default()
            .map(|value| u64::from(value as u8));
        mixed(mixed(x << 32 | y) ^ (z << 24 | a << 16 | b << 8 | c))
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

/// Steps of `f32` along a cell in which more than one point means that rounding matters. Coordinates are off by up to half a step,
/// by 0.3 typically; on points 16 steps apart that turns normals by about half a degree.
const COARSE: f64 = 16.0;

/// Share of the points in such company from which on it matters: 1 in 100 on a surface whose points are ten cells apart.
const COARSE_SHARE: f64 = 0.01;

/// A number as good as random that belongs to `number`; no two numbers have the same.
pub(crate) fn mixed(number: u64) -> u64 {
    let number = (number ^ number >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let number = (number ^ number >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    number ^ number >> 31
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

    /// A square of `side × side` points so far apart, around a corner, and one point far away.
    fn square_and_outlier(side: u32, spacing: f64, corner: DVec3, away: f64) -> Vec<DVec3> {
        let square = (0..side * side).map(|i| corner + DVec3::new((i % side).into(), (i / side).into(), 0.0) * spacing);
        square.chain([corner + DVec3::X * away]).collect()
    }

    #[test]
    fn what_f32_rounds_away_is_kept_where_points_are_as_close() {
        let corner = DVec3::new(500_000.123, 4_500_000.456, 78.9);
        for (spacing, away, expect) in [
            (1e-3, 100.0, false),
            (1e-2, 1e3, false),
            (1e-3, 1e4, true),
            (1e-3, 1e5, true),
            (1e-2, 1e5, true),
            (1.0, 1e5, false),
        ] {
            let points = square_and_outlier(100, spacing, corner, away);
            let cloud = PointCloud::from_f64(&points).unwrap();
            assert_eq!(cloud.has_remainders(), expect, "{spacing} of {away}");
            for (id, &point) in points.iter().enumerate() {
                let error = (cloud.origin() + cloud.relative(id) - point).abs().max_element();
                // Half a step of 24 bits without, of 32 with remainders; and f64 itself, of millions of meters.
                let bits = if expect { 32 } else { 24 };
                assert!(
                    error <= away * 2.0_f64.powi(-bits) + 2e-9,
                    "{error} of {spacing} of {away}"
                );
            }
        }
    }

    #[test]
    fn clouds_together_are_as_if_read_at_once() {
        let corner = DVec3::new(500_000.123, 4_500_000.456, 78.9);
        for (spacing, away) in [(1e-3, 1e4), (1e-2, 1e3), (1.0, 1e5)] {
            let near = square_and_outlier(60, spacing, corner, spacing * 70.0);
            let far = square_and_outlier(60, spacing, corner + DVec3::X * away, spacing * 70.0);
            let parts = [&near, &far].map(|points| Arc::new(PointCloud::from_f64(points).unwrap()));
            let joined = PointCloud::together(parts.to_vec()).unwrap();
            let points: Vec<DVec3> = near.iter().chain(&far).copied().collect();
            let at_once = PointCloud::from_f64(&points).unwrap();
            assert_eq!(joined.origin(), at_once.origin());
            assert_eq!(joined.has_remainders(), at_once.has_remainders(), "{spacing} {away}");
            assert_eq!(joined.n_points(), points.len());
            let (min, max) = joined.bounding_box();
            for (id, &point) in points.iter().enumerate() {
                let error = (joined.origin() + joined.relative(id) - point).abs().max_element();
                // Half a step of the parts, which have 24 bits of less than a hundred spacings, and half a step of the whole.
                let bits = if joined.has_remainders() { 32 } else { 24 };
                let most = 100.0 * spacing * 2.0_f64.powi(-24) + (away + 100.0) * 2.0_f64.powi(-bits) + 2e-9;
                assert!(error <= most, "{error} of {spacing} of {away}");
                let position = joined.positions()[id];
                assert!(position.cmpge(min).all() && position.cmple(max).all());
            }
        }
        let one = Arc::new(PointCloud::from_f64(&[DVec3::ONE, corner]).unwrap());
        let same = PointCloud::together(vec![Arc::clone(&one)]).unwrap();
        assert_eq!((same.origin(), same.positions()), (one.origin(), one.positions()));
        assert_eq!(PointCloud::together(Vec::new()).unwrap().n_points(), 0);
    }

    #[test]
    fn what_f32_holds_needs_no_remainders() {
        // Points 1/64 apart and one 100 km away are exact.
        let points = square_and_outlier(100, 1.0 / 64.0, DVec3::ZERO, 1e5);
        let cloud = PointCloud::from_f64(&points).unwrap();
        assert!(cloud.is_coarse() && !cloud.has_remainders());
        assert!(
            points
                .iter()
                .enumerate()
                .all(|(id, &point)| cloud.origin() + cloud.relative(id) == point)
        );
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
