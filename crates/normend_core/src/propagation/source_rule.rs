//! Who vouches for the first signs: one default source a component, or many found by visibility votes.

use std::ops::RangeInclusive;

/// Where signs start when they are estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SourceRule {
    /// One source a component: its point farthest along +z, which points up.
    #[default]
    Highest,
    /// Points that many viewpoints agree on, as Liu et al. §3.4 have it: corners of the bounding box, an absolute η.
    HiddenPoints,
    /// The same votes mended: viewpoints pushed out, directions to each point, a share instead of an absolute η.
    HiddenPointsMended,
}

impl SourceRule {
    /// All rules, in the order of menus.
    pub const ALL: [Self; 3] = [Self::Highest, Self::HiddenPoints, Self::HiddenPointsMended];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Highest => "highest",
            Self::HiddenPoints => "hidden-points",
            Self::HiddenPointsMended => "hidden-points-mended",
        }
    }

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Highest => "Highest point",
            Self::HiddenPoints => "Visible points",
            Self::HiddenPointsMended => "Visible points, mended",
        }
    }
}

/// How many viewpoints can vote: the corners of the bounding box, its faces, its edges, and no more.
pub const VIEWS: RangeInclusive<usize> = 1..=26;

/// The share or distance from the ends of the votes within which points are sources: none of the points, to all of those
/// within one whole vote.
pub const ETA: RangeInclusive<f32> = 0.0..=1.0;
