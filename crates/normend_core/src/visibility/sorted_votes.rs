//! All votes in order, so that the sources which any threshold gives are counted without voting again.
//!
//! Invariant: [`SortedVotes::n_sources`] is what [`super::sources`] finds with the same threshold.

use rayon::prelude::*;

use super::voting::Vote;
use crate::propagation::{ETA, SourceRule};

/// The weakest vote that is one: as much as a single viewpoint at 60° says.
const REAL: f32 = 0.018;

/// The share of what is said that must agree: a point that is seen from both sides is on a thin sheet, or seen through a hole.
const UNANIMOUS: f32 = 0.9;

/// The votes of the points that are seen, in order.
#[derive(Clone, Debug, PartialEq)]
pub struct SortedVotes {
    rule: SourceRule,
    /// `C_i`, ascending.
    sums: Vec<f32>,
    /// `|C_i|` of those that can be sources with [`SourceRule::HiddenPointsMended`], ascending; empty with others.
    strengths: Vec<f32>,
}

impl SortedVotes {
    /// Sorts the votes of all points, for sources by `rule`. O(n log n), in parallel; 4 to 8 bytes a point.
    pub fn new(votes: &[Vote], rule: SourceRule) -> Self {
        let seen = votes.par_iter().filter(|vote| vote.weight > 0.0);
        let mut sums: Vec<f32> = seen.map(|vote| vote.sum).collect();
        sums.par_sort_unstable_by(f32::total_cmp);
        let mut strengths = Vec::new();
        if rule == SourceRule::HiddenPointsMended {
            strengths.par_extend(votes.par_iter().filter(|vote| is_real(vote)).map(|vote| vote.sum.abs()));
            strengths.par_sort_unstable_by(f32::total_cmp);
        }
        Self { rule, sums, strengths }
    }

    /// Number of points that are seen at all.
    pub fn n_seen(&self) -> usize {
        self.sums.len()
    }

    /// The smallest and the largest `C_i`, 0 included.
    pub fn ends(&self) -> [f32; 2] {
        let end = |sum: Option<&f32>| sum.copied().unwrap_or_default();
        [end(self.sums.first()).min(0.0), end(self.sums.last()).max(0.0)]
    }

    /// The two intervals of sources: `C_i` up to the first number, and from the second on.
    pub fn thresholds(&self, eta: f32) -> [f32; 2] {
        let eta = eta.clamp(*ETA.start(), *ETA.end());
        if self.rule != SourceRule::HiddenPointsMended {
            let [min, max] = self.ends();
            return [min + eta, max - eta];
        }
        let n_real = self.strengths.len();
        // At least one, else a small cloud would have none at all.
        let n_wanted = ((eta * self.n_seen() as f32).round() as usize).clamp(1, n_real.max(1));
        match self.strengths.get(n_real.wrapping_sub(n_wanted)) {
            Some(&weakest) => [-weakest, weakest],
            None => [f32::NEG_INFINITY, f32::INFINITY],
        }
    }

    /// How many sources `eta` gives. O(log n).
    pub fn n_sources(&self, eta: f32) -> usize {
        let [low, high] = self.thresholds(eta);
        if self.rule == SourceRule::HiddenPointsMended {
            return self.strengths.len() - self.strengths.partition_point(|&strength| strength < high);
        }
        let n_low = self.sums.partition_point(|&sum| sum < 0.0 && sum <= low);
        let n_below_high = self.sums.partition_point(|&sum| sum <= 0.0 || sum < high);
        n_low + self.sums.len() - n_below_high
    }

    /// The `eta` whose lower, or upper, interval ends at `value`, as far as [`ETA`] allows.
    pub fn eta_at(&self, value: f32, is_high: bool) -> f32 {
        let eta = if self.rule == SourceRule::HiddenPointsMended {
            let value = if is_high { value } else { -value };
            let n_stronger = self.strengths.len() - self.strengths.partition_point(|&strength| strength < value);
            n_stronger as f32 / self.n_seen().max(1) as f32
        } else {
            let [min, max] = self.ends();
            if is_high { max - value } else { value - min }
        };
        eta.clamp(*ETA.start(), *ETA.end())
    }

    /// How many `C_i` are in each of `n_bins` equal parts between the [`Self::ends`]. O(bins · log n).
    pub fn histogram(&self, n_bins: usize) -> Vec<u32> {
        let [min, max] = self.ends();
        let below = |bin: usize| {
            let end = min + (max - min) * bin as f32 / n_bins as f32;
            self.sums.partition_point(|&sum| sum < end)
        };
        (0..n_bins)
            .map(|bin| {
                let end = if bin + 1 == n_bins {
                    self.sums.len()
                } else {
                    below(bin + 1)
                };
                (end - below(bin)) as u32
            })
            .collect()
    }

    /// Whether `vote` makes its point a source between these [`Self::thresholds`].
    pub(super) fn is_source(&self, vote: &Vote, [low, high]: [f32; 2]) -> bool {
        if self.rule == SourceRule::HiddenPointsMended {
            is_real(vote) && vote.sum.abs() >= high
        } else {
            (vote.sum < 0.0 && vote.sum <= low) || (vote.sum > 0.0 && vote.sum >= high)
        }
    }
}

/// Whether a vote can make its point a source by [`SourceRule::HiddenPointsMended`].
fn is_real(vote: &Vote) -> bool {
    vote.sum.abs() >= REAL && vote.sum.abs() >= UNANIMOUS * vote.weight
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::super::sources;
    use super::*;

    fn some_votes() -> impl Strategy<Value = Vec<Vote>> {
        let vote = (-8_i8..=8, 0_u8..4).prop_map(|(sum, more)| Vote {
            sum: f32::from(sum) / 10.0,
            weight: f32::from(sum).abs() / 10.0 + f32::from(more) / 20.0,
        });
        proptest::collection::vec(vote, 0..60)
    }

    proptest! {
        #[test]
        fn counts_are_those_of_the_sources(votes in some_votes(), eta in 0.0_f32..1.2) {
            for rule in [SourceRule::HiddenPoints, SourceRule::HiddenPointsMended] {
                let sorted = SortedVotes::new(&votes, rule);
                let normals = vec![Vec3::Z; votes.len()];
                prop_assert_eq!(sorted.n_sources(eta), sources(&votes, &normals, &sorted, eta).len());
                prop_assert_eq!(sorted.histogram(7).iter().sum::<u32>() as usize, sorted.n_seen());
            }
        }

        #[test]
        fn a_threshold_leads_back_to_its_eta(votes in some_votes(), eta in 0.0_f32..=1.0) {
            let sorted = SortedVotes::new(&votes, SourceRule::HiddenPoints);
            let [low, high] = sorted.thresholds(eta);
            prop_assert!((sorted.eta_at(low, false) - eta).abs() < 1e-5);
            prop_assert!((sorted.eta_at(high, true) - eta).abs() < 1e-5);
            let mended = SortedVotes::new(&votes, SourceRule::HiddenPointsMended);
            let [low, high] = mended.thresholds(eta);
            for found in [mended.eta_at(low, false), mended.eta_at(high, true)] {
                // As many sources; a share between two points is any of those in between.
                prop_assert_eq!(mended.n_sources(found), mended.n_sources(eta));
            }
        }
    }
}
