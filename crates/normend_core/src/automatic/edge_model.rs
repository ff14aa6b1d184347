//! How the normals of neighbors belong together, learned from the cloud itself.
//!
//! Neighbors on a smooth surface are like each other; across a sharp edge or a thin wall they are mirror images
//! (Xie et al. 2004; König & Gumhold 2009); in noise neither is sure. Which it is depends on the cloud. Where evidence knows the side
//! of both ends, it knows whether they belong together as they are: such edges are counted by what can be seen of them without
//! signs, and edges that look the same elsewhere follow what was counted.
//!
//! The features of an edge with direction `u`, after one normal is turned so that `c = n_i·n_j ≥ 0`: `c`, `ab = (n_i·u)(n_j·u)`
//! (negative along an arc, positive across a step between two sheets), and the length in radii of the points.

use glam::Vec3;
use rayon::prelude::*;

use super::cluster_graph::COUPLING_UNIT;
use crate::PointCloud;
use crate::evidence::{Evidence, UNIT};

/// Bins of `c`: the width of one, 7° at right angles, is about what normals of neighbors differ by for no reason.
const C_BINS: usize = 8;
/// Bins of the signed fourth root of `ab`: the step of an edge between two sheets that all but touch is small, and on clean
/// surfaces no other edge has it.
const AB_BINS: usize = 12;
/// Bins of the length, two fifths of a radius each; the last holds all longer ones.
const LENGTH_BINS: usize = 4;
const BINS: usize = C_BINS * AB_BINS * LENGTH_BINS;

/// The weight of what is known before anything is counted, in edges: the prior says that reflection is right, as sure as
/// `r|r|` is large. Twenty edges are the neighborhoods of a few points, which may all be wrong for one reason.
const PRIOR_EDGES: f64 = 20.0;

/// The logarithm of the odds that make a coupling of 1. With four, an edge of perfect reflection is right 98 times of 100 before
/// anything is known of the cloud.
const LOG_ODDS_OF_ONE: f64 = 4.0;

/// The largest coupling: past it edges differ only by how many were counted.
const LARGEST: f64 = 1.5;

/// What an edge looks like.
struct Features {
    bin: usize,
    /// Whether one normal was turned to make `c` positive.
    folded: bool,
    /// How far the folded normals look like mirror images of each other, −1..=3.
    reflection: f64,
}

/// The points, their normals and radii: what edges are seen by.
#[derive(Clone, Copy)]
pub(super) struct Surface<'a> {
    pub cloud: &'a PointCloud,
    pub normals: &'a [Vec3],
    pub radii: &'a [f32],
}

impl Surface<'_> {
    fn features(&self, a: u32, b: u32) -> Features {
        // From the smaller id, so that both ends see the same bits.
        let (a, b) = (a.min(b) as usize, a.max(b) as usize);
        let edge = self.cloud.offset(a, b).as_vec3();
        let length = edge.length();
        let direction = if length > 0.0 { edge / length } else { Vec3::ZERO };
        let (normal_a, normal_b) = (self.normals[a], self.normals[b]);
        let c = normal_a.dot(normal_b);
        let folded = c < 0.0;
        let ab = normal_a.dot(direction) * normal_b.dot(direction);
        let (c, ab) = if folded { (-c, -ab) } else { (c, ab) };
        let bin = |value: f32, n_bins: usize| ((value * n_bins as f32) as usize).min(n_bins - 1);
        let lengths = length / (self.radii[a] + self.radii[b]).max(f32::MIN_POSITIVE) * 2.0;
        let c_bin = bin(c, C_BINS);
        let ab_bin = bin(0.5 * (ab.signum() * ab.abs().sqrt().sqrt() + 1.0), AB_BINS);
        let length_bin = ((lengths * 2.5) as usize).min(LENGTH_BINS - 1);
        // Along an arc, the mirror image. Across a step, where edge and normals enclose an acute angle on both sides, sheets are likely
        // two long before the mirror says so: there the sign turns at 60° from the normals and not at 45°.
        let reflection = if ab > 0.0 {
            c * (1.0 - 2.0 * ab.sqrt())
        } else {
            c - 2.0 * ab
        };
        Features {
            bin: (length_bin * AB_BINS + ab_bin) * C_BINS + c_bin,
            folded,
            reflection: f64::from(reflection),
        }
    }
}

/// The couplings of edges by what they look like.
pub(super) struct EdgeModel {
    /// By bin, for folded normals: never 0.
    couplings: Vec<i32>,
}

/// What was counted of the edges in one bin. Whole numbers, so that the order of edges does not matter.
#[derive(Clone, Copy, Default)]
struct Count {
    /// Weight of edges whose ends evidence has on the same side, as folded, in units of 1/[`UNIT`].
    same: i64,
    opposite: i64,
    /// Sum of `r|r|` in units of 1/[`UNIT`].
    reflection: i64,
    n_edges: i64,
}

impl EdgeModel {
    /// Counts the edges between each point and its neighbors in `rows` (`k` a point, [`u32::MAX`] for none). O(edges), in parallel.
    pub fn learn(surface: Surface<'_>, rows: &[u32], k: usize, evidence: &Evidence) -> Self {
        // How sure the side of a point is: unanimous votes count, divided ones almost nothing.
        let sides: Vec<i32> = evidence
            .votes()
            .par_iter()
            .map(|vote| {
                if vote.weight == 0 {
                    return 0;
                }
                let agreement = f64::from(vote.signed) / f64::from(vote.weight);
                (agreement * agreement.abs() * agreement * agreement * f64::from(vote.weight.min(UNIT))) as i32
            })
            .collect();
        let n_points = surface.normals.len();
        let counts = (0..n_points)
            .into_par_iter()
            .with_min_len(4096)
            .fold(
                || vec![Count::default(); BINS],
                |mut counts, point| {
                    for &other in rows[point * k..(point + 1) * k]
                        .iter()
                        .filter(|&&other| other != u32::MAX)
                    {
                        let features = surface.features(point as u32, other);
                        let count = &mut counts[features.bin];
                        count.reflection +=
                            (features.reflection * features.reflection.abs() * f64::from(UNIT)).round() as i64;
                        count.n_edges += 1;
                        let weight = i64::from(sides[point]) * i64::from(sides[other as usize]) / i64::from(UNIT);
                        let weight = if features.folded { -weight } else { weight };
                        count.same += weight.max(0);
                        count.opposite += (-weight).max(0);
                    }
                    counts
                },
            )
            .reduce(
                || vec![Count::default(); BINS],
                |mut sum, counts| {
                    for (sum, count) in sum.iter_mut().zip(counts) {
                        sum.same += count.same;
                        sum.opposite += count.opposite;
                        sum.reflection += count.reflection;
                        sum.n_edges += count.n_edges;
                    }
                    sum
                },
            );
        Self {
            couplings: counts.into_iter().map(Count::coupling).collect(),
        }
    }

    /// How strongly two neighbors belong together as their normals are (positive) or with one turned (negative), in units of
    /// 1/[`COUPLING_UNIT`]; never 0, the same from both ends.
    pub fn coupling(&self, surface: Surface<'_>, a: u32, b: u32) -> i32 {
        let features = surface.features(a, b);
        let coupling = self.couplings[features.bin];
        if features.folded { -coupling } else { coupling }
    }
}

impl Count {
    /// The logarithm of the odds of "same" against "opposite".
    fn coupling(self) -> i32 {
        let unit = f64::from(UNIT);
        let prior = self.reflection as f64 / unit / self.n_edges.max(1) as f64;
        let prior_same = 1.0 / (1.0 + (-LOG_ODDS_OF_ONE * prior).exp());
        let same = self.same as f64 / unit + PRIOR_EDGES * prior_same;
        let opposite = self.opposite as f64 / unit + PRIOR_EDGES * (1.0 - prior_same);
        let coupling = ((same / opposite).ln() / LOG_ODDS_OF_ONE).clamp(-LARGEST, LARGEST);
        let coupling = (coupling * f64::from(COUPLING_UNIT)).round() as i32;
        if coupling == 0 { 1 } else { coupling }
    }
}
