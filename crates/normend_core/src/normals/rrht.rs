//! Robust randomized Hough transform: the normal that most planes through three neighbors agree on.

use std::f64::consts::PI;

use glam::{DMat3, DVec3, Vec3};

use super::{for_each_neighborhood, pca};
use crate::shapes::random::Random;
use crate::{Cancelled, Neighbors, PointCloud, Progress};

/// Estimates one unit normal per point by a robust randomized Hough transform (Boulch and Marlet, *Fast and robust normal
/// estimation for point clouds with sharp features*, 2012).
///
/// Planes through random triples of the point and its `k` nearest vote in an accumulator of directions until the fullest bin
/// leads by more than its confidence interval; so near an edge one of its two faces wins, where others average both. The
/// accumulator is turned at random several times, and the group of results with the most votes is averaged, because a peak on the
/// border of two bins would be split.
///
/// Triples are of ranks by distance and the same for each point, so the result depends neither on the order of points, ties
/// aside, nor on the number of threads. Turning the cloud draws other votes, so normals turn with it only nearly. A neighborhood
/// without a plane has the normal of [`pca`](super::pca()). O(n) draws of a triple, at most `ROTATIONS` × `TRIPLES` a point and
/// some ten times fewer where points are on a plane; parallel over points.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub fn rrht(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    k: usize,
    progress: &dyn Progress,
) -> Result<Vec<Vec3>, Cancelled> {
    let n_around = k.min(neighbors.k()) + 1;
    let bands = Bands::new();
    let draws = Draws::new(n_around);
    for_each_neighborhood(cloud, neighbors, k, progress, |_, offsets| {
        // Small clouds have no three points around.
        if offsets.len() < 2 {
            return pca::fit(offsets).as_vec3();
        }
        let mut accumulator = Accumulator::new(&bands);
        let mut found = [(DVec3::ZERO, 0.0); ROTATIONS];
        for (rotation, found) in found.iter_mut().enumerate() {
            accumulator.clear();
            *found = accumulator.fill(offsets, &draws, rotation);
        }
        fullest_group(&found).unwrap_or_else(|| pca::fit(offsets)).as_vec3()
    })
}

/// Accumulators a point: turned at random, so that a peak split in one is whole in most others.
const ROTATIONS: usize = 5;

/// Triples drawn at most for each: by Hoeffding's inequality 700 tell the shares of all bins to within 0.08 with a confidence of
/// 95 % (Boulch and Marlet, eq. 1).
const TRIPLES: usize = 700;

/// Bands of directions from pole to pole: bins of 12° (Boulch and Marlet's n_φ).
const BANDS: usize = 15;

/// Results within this angle of each other are one group: 45°, half the angle between the faces of a cube (Boulch and Marlet).
const SAME_GROUP: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Narrower triples do not vote: three points nearly on a line magnify the rounding and noise of positions sixteen times and more.
const SMALLEST_SINE: f64 = 0.0625;

/// Which bin a direction of either sign is in.
struct Bands {
    /// First bin of each band of the upper half, and one past the last.
    starts: [usize; BANDS / 2 + 3],
    /// The height above which a unit vector is in a band, from the pole down.
    heights: [f64; BANDS / 2 + 1],
}

impl Bands {
    fn new() -> Self {
        let mut starts = [0; BANDS / 2 + 3];
        for band in 0..BANDS / 2 + 2 {
            let circumference = (PI * band as f64 / BANDS as f64).sin();
            starts[band + 1] = starts[band] + ((2.0 * BANDS as f64 * circumference).round() as usize).max(1);
        }
        let middle = |band: usize| PI * (band as f64 + 0.5) / BANDS as f64;
        Self {
            starts,
            heights: std::array::from_fn(|band| middle(band).cos()),
        }
    }

    fn n_bins(&self) -> usize {
        self.starts[self.starts.len() - 1]
    }

    /// The bin of a unit vector of the upper half.
    fn bin(&self, direction: DVec3) -> usize {
        let band = self.heights.iter().take_while(|&&height| direction.z <= height).count();
        let (start, end) = (self.starts[band], self.starts[band + 1]);
        let turn = direction.y.atan2(direction.x) / (2.0 * PI);
        let n = end - start;
        start + ((turn.rem_euclid(1.0) * n as f64).round() as usize) % n
    }
}

/// The random numbers of all points.
struct Draws {
    /// For each rotation [`TRIPLES`] triples of different numbers: 0 for the point, 1 for its nearest neighbor, ….
    triples: Vec<[u16; 3]>,
    /// To the accumulators' frames.
    rotations: [DMat3; ROTATIONS],
}

impl Draws {
    /// Triples of numbers below `n_around`.
    fn new(n_around: usize) -> Self {
        let mut random = Random::new(1);
        let mut number = || (random.bits() % n_around.max(3) as u64) as u16;
        let mut triples = Vec::with_capacity(ROTATIONS * TRIPLES);
        while triples.len() < ROTATIONS * TRIPLES {
            let [a, b, c] = [number(), number(), number()];
            if a != b && b != c && c != a {
                triples.push([a, b, c]);
            }
        }
        let rotations = [(); ROTATIONS].map(|()| {
            let pole = random.direction();
            let (x, y) = pole.any_orthonormal_pair();
            DMat3::from_cols(x, y, pole).transpose()
        });
        Self { triples, rotations }
    }
}

/// Votes by direction.
struct Accumulator<'a> {
    bands: &'a Bands,
    counts: Vec<u16>,
    sums: Vec<DVec3>,
}

impl<'a> Accumulator<'a> {
    fn new(bands: &'a Bands) -> Self {
        Self {
            bands,
            counts: vec![0; bands.n_bins()],
            sums: vec![DVec3::ZERO; bands.n_bins()],
        }
    }

    fn clear(&mut self) {
        self.counts.fill(0);
        self.sums.fill(DVec3::ZERO);
    }

    /// Draws until the fullest bin is sure, and returns its mean direction and its share of the votes; zero when no triple spans a
    /// plane.
    fn fill(&mut self, offsets: &[DVec3], draws: &Draws, rotation: usize) -> (DVec3, f64) {
        let at = |number: u16| match number.checked_sub(1) {
            Some(neighbor) => offsets[usize::from(neighbor)],
            None => DVec3::ZERO,
        };
        let turned = draws.rotations[rotation];
        let (mut first, mut second) = (0, 0);
        let mut n_votes = 0_u16;
        for &[a, b, c] in &draws.triples[rotation * TRIPLES..(rotation + 1) * TRIPLES] {
            let (origin, u, v) = (at(a), at(b), at(c));
            let (u, v) = (u - origin, v - origin);
            let normal = u.cross(v);
            let squared_length = normal.length_squared();
            // Points in one place span nothing either.
            if squared_length <= SMALLEST_SINE * SMALLEST_SINE * u.length_squared() * v.length_squared() {
                continue;
            }
            let direction = turned * (normal / squared_length.sqrt());
            let direction = if direction.z < 0.0 { -direction } else { direction };
            let bin = self.bands.bin(direction);
            n_votes += 1;
            self.counts[bin] += 1;
            self.sums[bin] += direction;
            if bin != first {
                if self.counts[bin] > self.counts[first] {
                    (first, second) = (bin, first);
                } else if second == first || self.counts[bin] > self.counts[second] {
                    second = bin;
                }
            }
            let runner_up = if second == first { 0 } else { self.counts[second] };
            let lead = u32::from(self.counts[first] - runner_up);
            // Two intervals of half-width 1/√T do not overlap (Boulch and Marlet, eq. 2).
            if lead * lead > 4 * u32::from(n_votes) {
                break;
            }
        }
        if n_votes == 0 {
            return (DVec3::ZERO, 0.0);
        }
        let share = f64::from(self.counts[first]) / f64::from(n_votes);
        (turned.transpose() * self.sums[first].normalize_or_zero(), share)
    }
}

/// The mean direction of the group of results, of any sign, with the largest sum of shares; of equal ones the first.
fn fullest_group(found: &[(DVec3, f64)]) -> Option<DVec3> {
    let group = |&(center, _): &(DVec3, f64)| {
        let members = found.iter().filter(|(other, _)| other.dot(center).abs() > SAME_GROUP);
        members.fold((DVec3::ZERO, 0.0), |(sum, shares), &(other, share)| {
            let sign = if other.dot(center) < 0.0 { -share } else { share };
            (sum + sign * other, shares + share)
        })
    };
    let fullest = found
        .iter()
        .map(group)
        .reduce(|best, next| if next.1 > best.1 { next } else { best })?;
    fullest.0.try_normalize()
}
