//! The way of a scanner that moved: where it was when it measured each point.
//!
//! A point knows how far along the way it was measured, in one number of 4 bytes; the place follows from the corners of the way.

use glam::DVec3;
use rayon::prelude::*;

/// Where a moving scanner was when it measured each point, as far as that is known. 4 bytes a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// The way, in the file's coordinates.
    corners: Vec<DVec3>,
    /// Steps from one corner to the next.
    steps: u32,
    /// How many steps from the first corner each point was measured; [`UNKNOWN`] where that is not known.
    of_points: Vec<u32>,
}

const UNKNOWN: u32 = u32::MAX;

/// Most steps from corner to corner: finer than any clock, and a share of a step is what the place of a point is off by at most.
const MOST_STEPS: usize = 1 << 20;

impl Track {
    /// The way over `corners`, in the file's coordinates, on which `along` says of each of `n_points` where it was measured: 2.25 is a
    /// quarter of the way from the third corner to the fourth. `None`, what is not finite and what is off the way is not known.
    /// O(n), in parallel.
    pub fn new(corners: Vec<DVec3>, n_points: usize, along: impl Fn(usize) -> Option<f64> + Sync) -> Self {
        let n_segments = corners.len().saturating_sub(1);
        let steps = ((UNKNOWN as usize - 1) / n_segments.max(1)).clamp(1, MOST_STEPS) as u32;
        let is_on = |place: &f64| *place >= 0.0 && *place <= n_segments as f64 && !corners.is_empty();
        let of_points = (0..n_points).into_par_iter().map(|point| {
            let place = along(point).filter(is_on);
            // Of more corners than steps can be counted the last ones are out of reach.
            let step = place.map(|place| (place * f64::from(steps)).round());
            step.filter(|&step| step < f64::from(UNKNOWN))
                .map_or(UNKNOWN, |step| step as u32)
        });
        Self {
            of_points: of_points.collect(),
            steps,
            corners,
        }
    }

    /// Where the scanner was when it measured `point`, in the file's coordinates, if that is known. O(1).
    pub fn place(&self, point: usize) -> Option<DVec3> {
        let step = *self.of_points.get(point).filter(|&&step| step != UNKNOWN)?;
        let (corner, share) = (
            (step / self.steps) as usize,
            f64::from(step % self.steps) / f64::from(self.steps),
        );
        let from = *self.corners.get(corner)?;
        // The last corner has none after it, and is reached without a share.
        Some(self.corners.get(corner + 1).map_or(from, |to| from.lerp(*to, share)))
    }

    /// The corners of the way, in the file's coordinates.
    pub fn corners(&self) -> &[DVec3] {
        &self.corners
    }

    /// How many points have a place. O(n), in parallel.
    pub fn n_located(&self) -> usize {
        self.of_points.par_iter().filter(|&&step| step != UNKNOWN).count()
    }

    /// The same for other points, each of which is measured where one of these was.
    pub(crate) fn of(&self, points: impl Iterator<Item = u32>) -> Self {
        Self {
            corners: self.corners.clone(),
            steps: self.steps,
            of_points: points.map(|point| self.of_points[point as usize]).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn places_lie_between_corners() {
        let corners = vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 4.0, 0.0)];
        let along = [
            Some(0.0),
            Some(0.5),
            Some(1.0),
            Some(1.25),
            Some(2.0),
            Some(2.001),
            Some(-0.1),
            None,
        ];
        let track = Track::new(corners, along.len(), |point| along[point]);
        let places: Vec<_> = (0..9).map(|point| track.place(point)).collect();
        let at = |x, y| Some(DVec3::new(x, y, 0.0));
        assert_eq!(
            places,
            [
                at(0.0, 0.0),
                at(0.5, 0.0),
                at(1.0, 0.0),
                at(1.0, 1.0),
                at(1.0, 4.0),
                None,
                None,
                None,
                None
            ]
        );
        assert_eq!(track.n_located(), 5);
        let other = track.of([3, 7].into_iter());
        assert_eq!([other.place(0), other.place(1)], [at(1.0, 1.0), None]);
    }

    #[test]
    fn ways_of_one_corner_or_none() {
        let one = Track::new(vec![DVec3::ONE], 2, |point| Some(point as f64));
        assert_eq!([one.place(0), one.place(1)], [Some(DVec3::ONE), None]);
        let none = Track::new(Vec::new(), 1, |_| Some(0.0));
        assert_eq!((none.place(0), none.n_located()), (None, 0));
        let nan = Track::new(vec![DVec3::ONE], 1, |_| Some(f64::NAN));
        assert_eq!(nan.place(0), None);
    }

    proptest! {
        #[test]
        fn places_are_exact_to_a_step(n in 2..2000_usize, share in 0.0..1.0_f64) {
            let corners: Vec<DVec3> = (0..n).map(|i| DVec3::new(i as f64, (i * i % 17) as f64, 5e6)).collect();
            let along = share * (n - 1) as f64;
            let place = Track::new(corners.clone(), 1, |_| Some(along)).place(0).unwrap();
            let corner = (along.floor() as usize).min(n - 2);
            let expect = corners[corner].lerp(corners[corner + 1], along - corner as f64);
            prop_assert!(place.distance(expect) < 1e-4, "{place} {expect}");
        }
    }
}
