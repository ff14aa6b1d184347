//! What can be done to the sources of a document.

use crate::Source;

/// A change of the sources. Small and replayable.
///
/// Lists are taken as sets of points: a point that stands in one twice is removed or flipped once, and the last of two
/// sources at one point holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// The click: what the user sees at this point is wrong. The point becomes a source of the opposite sign.
    ///
    /// Where no source is vouched for yet, the component's default source is vouched for as it is in the same step (Liu et
    /// al. §3.3 propagate from `p_0` and the picked `p_1`): so a patch turns and not the whole component.
    Mend(u32),
    /// The click on a patch: it is wrong as a whole. The patch turns and nothing else, whatever vouched points are around it,
    /// and the point becomes a source that the patch belongs to.
    TurnPatch {
        /// The point that was clicked.
        point: u32,
        /// Names the patch: the smallest around the point of at least so many points.
        n_points: u32,
    },
    /// All that hangs together with this point is wrong: the source that orients it changes to the opposite direction, or
    /// where no source is vouched for, the point alone becomes one and its whole region turns.
    TurnWhole(u32),
    /// Sources are added, or take the place of those at the same points.
    AddSources(Vec<Source>),
    /// The sources at these points go.
    RemoveSources(Vec<u32>),
    /// The sources at these points change to the opposite direction.
    FlipSources(Vec<u32>),
}

impl Edit {
    /// In words for menus and the history: "Mend", "Remove source".
    pub fn label(&self) -> &'static str {
        match self {
            Self::Mend(_) => "Mend",
            Self::TurnPatch { .. } => "Turn patch",
            Self::TurnWhole(_) => "Turn whole region",
            Self::AddSources(sources) if sources.len() == 1 => "Add source",
            Self::AddSources(_) => "Add sources",
            Self::RemoveSources(points) if points.len() == 1 => "Remove source",
            Self::RemoveSources(_) => "Remove sources",
            Self::FlipSources(points) if points.len() == 1 => "Flip source",
            Self::FlipSources(_) => "Flip sources",
        }
    }

    /// Bytes on the heap.
    pub(super) fn heap_bytes(&self) -> usize {
        match self {
            Self::Mend(_) | Self::TurnPatch { .. } | Self::TurnWhole(_) => 0,
            Self::AddSources(sources) => size_of::<Source>() * sources.capacity(),
            Self::RemoveSources(points) | Self::FlipSources(points) => size_of::<u32>() * points.capacity(),
        }
    }
}

/// Why an edit cannot be applied; the document is as it was.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EditError {
    /// Nothing is propagated yet.
    #[error("the orientation is not computed yet")]
    NotReady,
    /// A point id past the end of the cloud.
    #[error("point {point} does not exist: the cloud has {n_points} points")]
    NoSuchPoint {
        /// The id.
        point: u32,
        /// Number of points.
        n_points: usize,
    },
    /// No source at this point.
    #[error("point {point} is not a source")]
    NotASource {
        /// The id.
        point: u32,
    },
    /// The propagation has no patches.
    #[error("there are no patches to turn with these parameters: mend the point instead")]
    NoPatches,
    /// The patch holds points of sources.
    #[error(
        "the patch would turn {n_vouched} of the points you vouched for: choose a smaller one, or flip or remove those sources"
    )]
    Vouched {
        /// How many.
        n_vouched: usize,
    },
    /// The normal of a new source is not a direction.
    #[error("the source at point {point} vouches for no direction: its normal must be finite and not zero")]
    NoDirection {
        /// The id.
        point: u32,
    },
}
