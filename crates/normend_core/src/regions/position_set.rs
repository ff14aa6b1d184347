//! A set of positions that finds the next member fast, however far away it is.

/// A bitset with summaries: bit `i` of a level says whether word `i` of the level below holds anything.
///
/// Membership is one bit test; inserting, removing and finding the next member take one step a level, which is at most
/// six for `u32` positions. It takes `n / 8` bytes and a sixty-third of that.
#[derive(Clone, Debug)]
pub(super) struct PositionSet {
    levels: Vec<Vec<u64>>,
}

impl PositionSet {
    /// An empty set of positions below `n_positions`.
    pub fn new(n_positions: usize) -> Self {
        let mut levels = Vec::new();
        let mut n_bits = n_positions;
        loop {
            let n_words = n_bits.div_ceil(64);
            levels.push(vec![0; n_words]);
            if n_words <= 1 {
                return Self { levels };
            }
            n_bits = n_words;
        }
    }

    /// Number of members. O(n / 64).
    pub fn len(&self) -> usize {
        self.levels[0].iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Whether `position` is a member.
    #[inline]
    pub fn contains(&self, position: u32) -> bool {
        self.levels[0][position as usize / 64] >> (position % 64) & 1 == 1
    }

    /// Makes `position` a member.
    pub fn insert(&mut self, position: u32) {
        let mut bit = position as usize;
        for level in &mut self.levels {
            level[bit / 64] |= 1 << (bit % 64);
            bit /= 64;
        }
    }

    /// Takes `position` out.
    pub fn remove(&mut self, position: u32) {
        let mut bit = position as usize;
        for level in &mut self.levels {
            level[bit / 64] &= !(1 << (bit % 64));
            if level[bit / 64] != 0 {
                return;
            }
            bit /= 64;
        }
    }

    /// The smallest member that is not below `from`.
    pub fn next(&self, from: u32) -> Option<u32> {
        let mut bit = from as usize;
        for (height, level) in self.levels.iter().enumerate() {
            let rest = level.get(bit / 64)? >> (bit % 64);
            if rest != 0 {
                bit += rest.trailing_zeros() as usize;
                for below in self.levels[..height].iter().rev() {
                    bit = 64 * bit + below[bit].trailing_zeros() as usize;
                }
                return u32::try_from(bit).ok();
            }
            bit = bit / 64 + 1;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn is_an_ordered_set(
            n in 0_u32..300_000,
            steps in prop::collection::vec((any::<prop::sample::Index>(), any::<bool>()), 0..60),
            ends in prop::collection::vec(any::<prop::sample::Index>(), 0..20),
        ) {
            let mut set = PositionSet::new(n as usize);
            let mut expect = BTreeSet::new();
            for (position, inserts) in steps {
                let Some(position) = (n > 0).then(|| position.index(n as usize) as u32) else { continue };
                if inserts {
                    set.insert(position);
                    expect.insert(position);
                } else if let Some(&near) = expect.range(position..).next() {
                    set.remove(near);
                    expect.remove(&near);
                }
            }
            let members = std::iter::successors(set.next(0), |member| set.next(member + 1));
            prop_assert_eq!(members.collect::<Vec<_>>(), expect.iter().copied().collect::<Vec<_>>());
            for from in ends.into_iter().map(|end| end.index(n as usize + 2) as u32) {
                prop_assert_eq!(set.next(from), expect.range(from..).next().copied());
            }
            prop_assert!(expect.iter().all(|&member| set.contains(member)));
        }
    }
}
