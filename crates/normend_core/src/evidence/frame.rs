//! A coordinate frame that turns with the cloud, so that what is seen of it does not depend on how it lies in the file.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::PointCloud;
use crate::normals::eigen::Symmetric3;

/// The principal axes of a cloud around the middle of its points.
///
/// Each axis points to where the points reach farther out (their third moment is positive), and the axes are right-handed.
/// All sums are of whole numbers, so the frame does not depend on the order of points. Where two principal directions have
/// equal moments (a regular lattice on a sphere or cube), or a third moment is zero, rounding decides: the frame is then
/// one of several that are equally good, and need not turn with the cloud.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Relative to the cloud's origin.
    pub center: DVec3,
    /// Rows are the axes.
    pub frame_from_cloud: DMat3,
}

/// Steps of the whole numbers along the longest side of the bounding box: squares of 2^20 and their sums over all points stay
/// far within `i128`, and moments of real surfaces differ by more than their 2^-20.
const STEPS: f64 = (1 << 20) as f64;

impl Frame {
    /// The frame of `cloud`; the cloud's own axes when all points are in one place. O(n), in parallel.
    pub fn of(cloud: &PointCloud) -> Self {
        let (min, max) = cloud.bounding_box();
        let (min, max) = (min.as_dvec3(), max.as_dvec3());
        let size = (max - min).max_element();
        if size <= 0.0 {
            return Self {
                center: min,
                frame_from_cloud: DMat3::IDENTITY,
            };
        }
        let middle = 0.5 * (min + max);
        let step = size / STEPS;
        let positions = cloud.positions();
        let sums = sum_of(positions.len(), |point| {
            let [x, y, z] = ((positions[point].as_dvec3() - middle) / step)
                .to_array()
                .map(|value| value.round() as i128);
            [x, y, z, x * x, x * y, x * z, y * y, y * z, z * z]
        });
        let n = positions.len() as f64;
        let [x, y, z, xx, xy, xz, yy, yz, zz] = sums.map(|sum| sum as f64 / n);
        let mean = DVec3::new(x, y, z);
        let scatter = Symmetric3 {
            xx: xx - x * x,
            xy: xy - x * y,
            xz: xz - x * z,
            yy: yy - y * y,
            yz: yz - y * z,
            zz: zz - z * z,
        };
        let [_, b, a] = scatter.eigen().vectors;
        let center = middle + mean * step;
        let [a_sum, b_sum] = sum_of(positions.len(), |point| {
            let offset = (positions[point].as_dvec3() - center) / step;
            [offset.dot(a), offset.dot(b)].map(|value| (value.round() as i128).pow(3))
        });
        let outward = |axis: DVec3, sum: i128| if sum < 0 { -axis } else { axis };
        let (a, b) = (outward(a, a_sum), outward(b, b_sum));
        Self {
            center,
            frame_from_cloud: DMat3::from_cols(a, b, a.cross(b)).transpose(),
        }
    }
}

/// The sums of `terms` over `0..n`; whole numbers, so in any order.
fn sum_of<const N: usize>(n: usize, terms: impl Fn(usize) -> [i128; N] + Sync) -> [i128; N] {
    let add = |mut a: [i128; N], b: [i128; N]| {
        for (a, b) in a.iter_mut().zip(b) {
            *a += b;
        }
        a
    };
    (0..n)
        .into_par_iter()
        .with_min_len(1 << 14)
        .fold(|| [0; N], |sums, point| add(sums, terms(point)))
        .reduce(|| [0; N], add)
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, Vec3};
    use proptest::prelude::*;

    use super::*;

    /// Positions in their frame.
    fn in_frame(positions: &[DVec3]) -> Vec<DVec3> {
        let positions = positions.iter().map(|position| position.as_vec3()).collect();
        let cloud = PointCloud::new(DVec3::ZERO, positions).unwrap();
        let frame = Frame::of(&cloud);
        let to_frame = |position: &Vec3| frame.frame_from_cloud * (position.as_dvec3() - frame.center);
        cloud.positions().iter().map(to_frame).collect()
    }

    proptest! {
        #[test]
        fn it_turns_and_moves_with_the_cloud(
            points in prop::collection::vec((0.0..1.0_f64, 0.0..1.0_f64, 0.0..1.0_f64), 20..100),
            axis in (-1.0..1.0_f64, -1.0..1.0_f64, 0.1..1.0_f64),
            angle in 0.0..6.0_f64,
        ) {
            // Unequal lengths, and more points at one end of each axis.
            let points: Vec<DVec3> = points
                .into_iter()
                .map(|(x, y, z)| DVec3::new(9.0 * x * x * x, 3.0 * y * y * y, z * z * z))
                .collect();
            let rotation = DQuat::from_axis_angle(DVec3::from(axis).try_normalize().unwrap(), angle);
            let moved: Vec<DVec3> = points.iter().map(|&point| rotation * point + DVec3::splat(2.0)).collect();
            let same = |a: &DVec3, b: &DVec3| (*a - *b).abs().max_element() < 1e-3;
            prop_assert!(in_frame(&points).iter().zip(&in_frame(&moved)).all(|(a, b)| same(a, b)));
        }
    }

    #[test]
    fn one_place_has_the_axes_of_the_cloud() {
        assert_eq!(in_frame(&[DVec3::ONE; 3]), [DVec3::ZERO; 3]);
    }
}
