//! A number for each point: its scale, its histogram, and the points in a range of it.

use std::sync::Arc;

use normend_core::PointSet;
use rayon::prelude::*;

/// Bars of a histogram.
pub const N_BARS: usize = 96;
/// Values that the usual range is told from: percentiles of so many are near those of all.
const N_SAMPLED: usize = 1 << 16;
/// The part of values at either end that the usual range leaves out.
const OUTLIERS: f64 = 0.005;

/// A number for each point; what is not finite is none.
#[derive(Clone, Debug)]
pub struct Values {
    /// By point.
    pub by_point: Arc<Vec<f64>>,
    /// The range to show at first: without the few lowest and highest values.
    pub usual: [f64; 2],
}

impl Values {
    /// Looks for the usual range. O(n), parallel.
    pub fn new(by_point: Vec<f64>) -> Self {
        let step = by_point.len().div_ceil(N_SAMPLED).max(1);
        let sampled = by_point.iter().copied().step_by(step);
        let mut sampled: Vec<f64> = sampled.filter(|value| value.is_finite()).collect();
        sampled.sort_unstable_by(f64::total_cmp);
        let last = sampled.len().saturating_sub(1) as f64;
        let at = |share: f64| sampled.get((share * last).round() as usize).copied();
        let usual = match (at(OUTLIERS), at(1.0 - OUTLIERS)) {
            (Some(low), Some(high)) if low < high => [low, high],
            // All but a few are equal.
            (Some(_), Some(_)) => [sampled[0], sampled[sampled.len() - 1]],
            _ => [0.0, 1.0],
        };
        Self {
            by_point: Arc::new(by_point),
            usual,
        }
    }

    /// Values with a range that is known.
    pub fn with_range(by_point: Vec<f64>, usual: [f64; 2]) -> Self {
        Self {
            by_point: Arc::new(by_point),
            usual,
        }
    }
}

/// How many values there are in each of [`N_BARS`] equal parts of a range. What lies beyond counts at its ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// The range.
    pub range: [f64; 2],
    /// By part.
    pub counts: Vec<u64>,
    /// Points without a value.
    pub n_missing: u64,
}

impl Histogram {
    /// Counts. O(n), parallel; the result does not depend on the number of threads.
    pub fn new(values: &[f64], range: [f64; 2]) -> Self {
        const BLOCK: usize = 1 << 16;
        let counts = values
            .par_chunks(BLOCK)
            .map(|block| {
                // One more for what is missing.
                let mut counts = vec![0_u64; N_BARS + 1];
                for &value in block {
                    counts[bar_of(value, range).unwrap_or(N_BARS)] += 1;
                }
                counts
            })
            .reduce(
                || vec![0; N_BARS + 1],
                |a, b| a.iter().zip(&b).map(|(a, b)| a + b).collect(),
            );
        Self {
            range,
            n_missing: counts[N_BARS],
            counts: counts[..N_BARS].to_vec(),
        }
    }

    /// The value at `share` of the range, in 0..=1.
    pub fn value_at(&self, share: f32) -> f64 {
        self.range[0] + (self.range[1] - self.range[0]) * f64::from(share.clamp(0.0, 1.0))
    }

    /// The range of values that stands between two shares of the range in any order; at its ends it includes what lies beyond.
    pub fn between(&self, a: f32, b: f32) -> [f64; 2] {
        let (low, high) = (a.min(b), a.max(b));
        let low = if low <= 0.0 {
            f64::NEG_INFINITY
        } else {
            self.value_at(low)
        };
        let high = if high >= 1.0 {
            f64::INFINITY
        } else {
            self.value_at(high)
        };
        [low, high]
    }
}

fn bar_of(value: f64, [low, high]: [f64; 2]) -> Option<usize> {
    if !value.is_finite() {
        return None;
    }
    let share = if high > low { (value - low) / (high - low) } else { 0.5 };
    // The cast brings what lies below to 0.
    Some(((share * N_BARS as f64) as usize).min(N_BARS - 1))
}

/// The points whose value is in `range`, both ends included. O(n).
pub fn points_between(values: &[f64], [low, high]: [f64; 2]) -> PointSet {
    let inside = |value: f64| value.is_finite() && (low..=high).contains(&value);
    let points = (0_u32..).zip(values).filter(|&(_, &value)| inside(value));
    points.map(|(point, _)| point).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_usual_range_leaves_outliers_out() {
        let mut values: Vec<f64> = (0..1000).map(f64::from).collect();
        values[0] = -1e9;
        values[999] = 1e9;
        values.push(f64::NAN);
        let usual = Values::new(values).usual;
        assert_eq!(usual, [5.0, 994.0]);
        assert_eq!(Values::new(vec![3.0; 10]).usual, [3.0, 3.0]);
        assert_eq!(Values::new(vec![f64::NAN]).usual, [0.0, 1.0]);
    }

    #[test]
    fn the_ends_of_a_selection_take_what_lies_beyond() {
        let histogram = Histogram::new(&[-5.0, 0.0, 5.0, 10.0, 50.0, f64::INFINITY], [0.0, 10.0]);
        assert_eq!((histogram.counts[0], histogram.counts[N_BARS - 1]), (2, 2));
        assert_eq!(histogram.n_missing, 1);
        assert_eq!(histogram.between(0.5, 0.0), [f64::NEG_INFINITY, 5.0]);
        assert_eq!(histogram.between(0.5, 1.0), [5.0, f64::INFINITY]);
    }

    proptest! {
        #[test]
        fn every_value_is_counted_once_and_selected_where_it_is(
            values in proptest::collection::vec(prop_oneof![-20.0_f64..20.0, Just(f64::NAN)], 0..300),
            low in -20.0_f64..0.0,
            size in 0.0_f64..20.0,
        ) {
            let range = [low, low + size];
            let histogram = Histogram::new(&values, range);
            let n_counted: u64 = histogram.counts.iter().sum();
            prop_assert_eq!(n_counted + histogram.n_missing, values.len() as u64);
            let points = points_between(&values, range);
            for (point, value) in values.iter().enumerate() {
                let expect = *value >= range[0] && *value <= range[1];
                prop_assert_eq!(points.contains(point as u32), expect);
            }
        }
    }
}
