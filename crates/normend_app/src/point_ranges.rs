//! Sets of points as ranges under another numbering. A set that is nearly all points costs as little as one that is nearly none,
//! which is what "select all", "invert" and "show only" ask of a large scan.

use std::ops::Range;

use fixedbitset::FixedBitSet;
use normend_core::PointSet;

/// The new numbers of a set out of `0..n`, as ascending ranges that do not touch; `renumber` is a bijection of `0..n`. Members past
/// the end are left out. O(n / 64), and the members or else the others, whichever are fewer.
pub fn renumbered(set: &PointSet, n: usize, renumber: impl Fn(u32) -> u32) -> Vec<Range<u32>> {
    let mut all = PointSet::new();
    all.insert_range(0..n as u32);
    let n_members = all.intersection_len(set);
    let is_few = n_members <= n as u64 - n_members;
    let fewer = if is_few { set & &all } else { all - set };
    let mut bits = FixedBitSet::with_capacity(n);
    for member in &fewer {
        bits.insert(renumber(member) as usize);
    }
    let runs = runs(&bits);
    if is_few { runs } else { gaps(&runs, n as u32) }
}

/// The members of ranges.
pub fn set_of(ranges: &[Range<u32>]) -> PointSet {
    let mut set = PointSet::new();
    for range in ranges {
        set.insert_range(range.clone());
    }
    set
}

fn runs(bits: &FixedBitSet) -> Vec<Range<u32>> {
    let mut runs: Vec<Range<u32>> = Vec::new();
    for bit in bits.ones() {
        let bit = bit as u32;
        match runs.last_mut() {
            Some(run) if run.end == bit => run.end += 1,
            _ => runs.push(bit..bit + 1),
        }
    }
    runs
}

/// What lies in `0..n` between ascending ranges.
fn gaps(ranges: &[Range<u32>], n: u32) -> Vec<Range<u32>> {
    let starts = std::iter::once(0).chain(ranges.iter().map(|range| range.end));
    let ends = ranges.iter().map(|range| range.start).chain([n]);
    let gaps = starts.zip(ends).map(|(start, end)| start..end);
    gaps.filter(|gap| !gap.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use proptest::prelude::*;

    use super::*;

    /// Numbers `0..n` in another order: the step is a prime and larger than any `n` here, so no two come to the same.
    fn shuffle(n: usize) -> impl Fn(u32) -> u32 {
        move |member| (u64::from(member) * 1_000_003 % n as u64) as u32
    }

    proptest! {
        #[test]
        fn ranges_are_the_renumbered_members_and_no_others(
            n in 1_usize..300,
            members in proptest::collection::vec(0_u32..300, 0..600),
        ) {
            let set: PointSet = members.into_iter().collect();
            let ranges = renumbered(&set, n, shuffle(n));
            prop_assert!(ranges.windows(2).all(|pair| pair[0].end < pair[1].start));
            prop_assert!(ranges.iter().all(|range| !range.is_empty()));
            let inside = set.iter().filter(|&member| (member as usize) < n);
            prop_assert_eq!(set_of(&ranges), inside.map(shuffle(n)).collect::<PointSet>());
        }
    }

    #[test]
    fn nearly_all_points_cost_as_little_as_nearly_none() {
        let n = 100_000;
        let mut all = PointSet::new();
        all.insert_range(0..n as u32);
        let n_asked = Cell::new(0);
        let count = |member| {
            n_asked.set(n_asked.get() + 1);
            member
        };
        assert_eq!(
            renumbered(&all, n, count),
            [Range {
                start: 0,
                end: n as u32
            }]
        );
        all.remove(7);
        assert_eq!(renumbered(&all, n, count), [0..7, 8..n as u32]);
        assert_eq!(n_asked.get(), 1);
        assert_eq!(renumbered(&PointSet::new(), n, count), []);
    }
}
