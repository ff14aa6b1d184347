//! One sign bit per point, and what an edit turned.

use std::ops::Range;

use fixedbitset::FixedBitSet;

/// The positions (preorder) whose normals turned: ascending, disjoint, not touching.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Change {
    ranges: Vec<Range<u32>>,
}

impl Change {
    /// What is turned in the end by flipping each of `flips` in turn: positions in an odd number of them.
    ///
    /// Overlap and order are free. O(m log m) for m ranges, linear when they are sorted.
    pub fn from_flips(flips: &[Range<u32>]) -> Self {
        // A position is turned when an odd number of range ends lie at or before it; two equal ends cancel.
        let mut ends: Vec<u32> = flips.iter().flat_map(|range| [range.start, range.end]).collect();
        ends.sort_unstable();
        let mut odd: Vec<u32> = Vec::with_capacity(ends.len());
        for end in ends {
            if odd.last() == Some(&end) {
                odd.pop();
            } else {
                odd.push(end);
            }
        }
        Self {
            ranges: odd.chunks_exact(2).map(|ends| ends[0]..ends[1]).collect(),
        }
    }

    /// The turned ranges of preorder positions.
    pub fn ranges(&self) -> &[Range<u32>] {
        &self.ranges
    }

    /// How many points turned.
    pub fn n_points(&self) -> u64 {
        self.ranges.iter().map(|range| u64::from(range.end - range.start)).sum()
    }

    /// Whether `position` turned. O(log m) for m ranges.
    pub fn contains(&self, position: u32) -> bool {
        let n_begun = self.ranges.partition_point(|range| range.start <= position);
        n_begun > 0 && position < self.ranges[n_begun - 1].end
    }

    /// Whether nothing turned.
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty()
    }
}

/// One bit per preorder position: whether the stored normal there is turned.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Orientation {
    turned: FixedBitSet,
}

impl Orientation {
    /// The orientation whose turned positions are the set bits of `turned`, one bit per position.
    pub fn new(turned: FixedBitSet) -> Self {
        Self { turned }
    }

    /// Number of positions.
    pub fn n_points(&self) -> usize {
        self.turned.len()
    }

    /// Whether the normal at `position` is turned.
    pub fn is_turned(&self, position: u32) -> bool {
        self.turned.contains(position as usize)
    }

    /// The bits, by preorder position.
    pub fn bits(&self) -> &FixedBitSet {
        &self.turned
    }

    /// The bits in words of 32, lowest bit first, the last word filled up with zeros: `ceil(n / 32)` words. O(n / 32).
    pub fn to_words(&self) -> Vec<u32> {
        const WORDS_PER_BLOCK: usize = usize::BITS as usize / 32;
        let n_words = self.turned.len().div_ceil(32);
        let mut words = Vec::with_capacity(n_words + WORDS_PER_BLOCK);
        for block in self.turned.as_slice() {
            words.extend((0..WORDS_PER_BLOCK).map(|word| (*block as u64 >> (32 * word)) as u32));
        }
        words.truncate(n_words);
        words
    }

    /// Turns every position of `range`, a word at a time.
    pub(crate) fn flip(&mut self, range: Range<u32>) {
        const BITS: usize = usize::BITS as usize;
        let (start, end) = (range.start as usize, range.end as usize);
        let (first_word, end_word) = (start.div_ceil(BITS), end / BITS);
        if first_word >= end_word {
            self.turned.toggle_range(start..end);
            return;
        }
        // The whole words by hand: `toggle_range` builds a mask for each, which takes six times as long.
        self.turned.toggle_range(start..first_word * BITS);
        for word in &mut self.turned.as_mut_slice()[first_word..end_word] {
            *word = !*word;
        }
        self.turned.toggle_range(end_word * BITS..end);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn flips_cancel_and_join() {
        check(&[], &[]);
        check(&[(3, 3)], &[]);
        check(&[(2, 5), (2, 5)], &[]);
        check(&[(5, 9), (2, 5)], &[(2, 9)]);
        check(&[(0, 10), (3, 4)], &[(0, 3), (4, 10)]);

        fn check(flips: &[(u32, u32)], expect: &[(u32, u32)]) {
            let flips: Vec<_> = flips.iter().map(|&(start, end)| start..end).collect();
            let change = Change::from_flips(&flips);
            assert_eq!(
                change
                    .ranges()
                    .iter()
                    .map(|range| (range.start, range.end))
                    .collect::<Vec<_>>(),
                expect
            );
        }
    }

    proptest! {
        #[test]
        fn flips_turn_their_range_alone(a in 0_u32..400, b in 0_u32..400) {
            let range = a.min(b)..a.max(b);
            let mut orientation = Orientation::new(FixedBitSet::with_capacity(400));
            orientation.flip(range.clone());
            prop_assert!((0..400).all(|position| orientation.is_turned(position) == range.contains(&position)));
            orientation.flip(0..400);
            prop_assert!((0..400).all(|position| orientation.is_turned(position) != range.contains(&position)));
            prop_assert_eq!(orientation.bits().count_ones(..), 400 - range.len());
        }

        #[test]
        fn flips_are_exclusive_or(flips in prop::collection::vec((0_u32..130, 0_u32..130), 0..12)) {
            let flips: Vec<_> = flips.into_iter().map(|(a, b)| a.min(b)..a.max(b)).collect();
            let mut expect = Orientation::new(FixedBitSet::with_capacity(130));
            flips.iter().for_each(|range| expect.flip(range.clone()));
            let change = Change::from_flips(&flips);
            let mut actual = Orientation::new(FixedBitSet::with_capacity(130));
            change.ranges().iter().for_each(|range| actual.flip(range.clone()));
            prop_assert_eq!(&actual, &expect);
            prop_assert_eq!(change.n_points(), expect.bits().count_ones(..) as u64);
            prop_assert!((0..131).all(|position| change.contains(position) == expect.is_turned(position)));
            prop_assert!(change.ranges().iter().all(|range| range.start < range.end));
            prop_assert!(change.ranges().windows(2).all(|pair| pair[0].end < pair[1].start));
        }

        #[test]
        fn words_hold_the_bits(bits in prop::collection::vec(any::<bool>(), 0..200)) {
            let mut turned = FixedBitSet::with_capacity(bits.len());
            bits.iter().enumerate().for_each(|(index, &bit)| turned.set(index, bit));
            let words = Orientation::new(turned).to_words();
            prop_assert_eq!(words.len(), bits.len().div_ceil(32));
            for index in 0..32 * words.len() {
                let expect = bits.get(index).copied().unwrap_or(false);
                prop_assert_eq!(words[index / 32] >> (index % 32) & 1 == 1, expect);
            }
        }
    }
}
