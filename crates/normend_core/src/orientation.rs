//! One sign bit per point, and what an edit turned.

use std::ops::Range;

/// The positions (preorder) whose normals turned: ascending, disjoint, not touching.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Change {
    ranges: Vec<Range<u32>>,
}

impl Change {
    /// The turned ranges of preorder positions.
    pub fn ranges(&self) -> &[Range<u32>] {
        &self.ranges
    }

    /// How many points turned.
    pub fn n_points(&self) -> u64 {
        self.ranges.iter().map(|range| u64::from(range.end - range.start)).sum()
    }

    /// Whether nothing turned.
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty()
    }
}

/// One bit per preorder position: whether the stored normal there is turned.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Orientation {
    turned: fixedbitset::FixedBitSet,
}

impl Orientation {
    /// Whether the normal at `position` is turned.
    pub fn is_turned(&self, position: u32) -> bool {
        self.turned.contains(position as usize)
    }

    /// The bits, by preorder position.
    pub fn bits(&self) -> &fixedbitset::FixedBitSet {
        &self.turned
    }
}
