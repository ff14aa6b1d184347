//! What can be done to a document.

use std::sync::Arc;

use glam::Vec3;

use super::ScannerChoice;
use crate::propagation::VIEWS;
use crate::sources::Origin;
use crate::{Parameters, PointSet, Source};

/// A change that a user asks for.
///
/// Lists are taken as sets of points: a point that stands in one twice is removed or flipped once, and the last of two
/// sources at one point holds. Sets replace the ones before.
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
    /// Patches that do not overlap turn, as [`Self::TurnPatch`] does, each named by a point and a number of points; they are seen
    /// from behind ([`super::Document::seen`]).
    TurnSeenPatches(Vec<(u32, u32)>),
    /// All that hangs together with this point is wrong: the source that orients it changes to the opposite direction, or
    /// where no source is vouched for, the point alone becomes one and its whole region turns.
    TurnWhole(u32),
    /// Sources are added, or take the place of those at the same points.
    AddSources(Vec<Source>),
    /// The sources at these points go.
    RemoveSources(Vec<u32>),
    /// The sources at these points change to the opposite direction.
    FlipSources(Vec<u32>),
    /// These points turn and no others; pinned ones stay.
    FlipPoints {
        /// The points.
        points: PointSet,
        /// What it is called in the history.
        reason: FlipReason,
    },
    /// These points are right as they are: nothing turns them until they are unpinned.
    Pin(PointSet),
    /// These points are protected no longer; nothing turns.
    Unpin(PointSet),
    /// These points are right, and what hangs together with them follows: sources and marks of their components go, pins and these
    /// points stay as they are, and signs spread from them along the whole tree, across the places where given signs disagree.
    PropagateFrom(PointSet),
    /// The signs of these points are found again from what is around them: signs spread into them along the tree from the points
    /// beside them, and from sources and pins among them.
    PropagateInside(PointSet),
    /// These points are selected, and no others.
    Select(PointSet),
    /// These points are hidden, and no others.
    Hide(PointSet),
    /// These points are accepted as they are, and no others: they are no suspects.
    Accept(PointSet),
    /// Orientation with these parameters is wanted. Nothing turns before [`super::Document::install`].
    SetParameters(Parameters),
    /// These viewpoints vote for sources, in the cloud's own space; the usual ones when empty. Nothing turns before
    /// [`super::Document::install`].
    SetViewpoints(Arc<[Vec3]>),
    /// These places of the scanner count. Nothing turns before [`super::Document::install`].
    SetScanner(ScannerChoice),
}

/// Why points are flipped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlipReason {
    /// The user says so.
    Asked,
    /// They shall face the viewer.
    FaceMe,
    /// They are a suspect that the user agrees with.
    Suspect,
}

/// What an edit did, without its data: for histories and files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EditKind {
    /// [`Edit::Mend`].
    Mend,
    /// [`Edit::TurnPatch`].
    TurnPatch,
    /// [`Edit::TurnSeenPatches`], or sources from the user's view.
    Seen,
    /// [`Edit::TurnWhole`].
    TurnWhole,
    /// [`Edit::AddSources`].
    AddSources,
    /// [`Edit::AddSources`] by a rule for the right side.
    Rule,
    /// [`Edit::RemoveSources`].
    RemoveSources,
    /// [`Edit::FlipSources`].
    FlipSources,
    /// [`Edit::FlipPoints`].
    FlipPoints,
    /// [`Edit::FlipPoints`] for [`FlipReason::FaceMe`].
    FaceMe,
    /// [`Edit::FlipPoints`] for [`FlipReason::Suspect`].
    FlipSuspect,
    /// [`Edit::Pin`].
    Pin,
    /// [`Edit::Unpin`].
    Unpin,
    /// [`Edit::PropagateFrom`].
    PropagateFrom,
    /// [`Edit::PropagateInside`].
    PropagateInside,
    /// [`Edit::Select`].
    Select,
    /// [`Edit::Hide`].
    Hide,
    /// [`Edit::Accept`].
    Accept,
    /// [`Edit::SetParameters`].
    SetParameters,
    /// [`Edit::SetViewpoints`].
    SetViewpoints,
    /// [`Edit::SetScanner`].
    SetScanner,
    /// The whole state of a recipe, or of older steps that are not told apart any more; recorded only.
    Recipe,
}

impl EditKind {
    /// All kinds.
    pub const ALL: [Self; 22] = [
        Self::Mend,
        Self::TurnPatch,
        Self::Seen,
        Self::TurnWhole,
        Self::AddSources,
        Self::Rule,
        Self::RemoveSources,
        Self::FlipSources,
        Self::FlipPoints,
        Self::FaceMe,
        Self::FlipSuspect,
        Self::Pin,
        Self::Unpin,
        Self::PropagateFrom,
        Self::PropagateInside,
        Self::Select,
        Self::Hide,
        Self::Accept,
        Self::SetParameters,
        Self::SetViewpoints,
        Self::SetScanner,
        Self::Recipe,
    ];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mend => "mend",
            Self::TurnPatch => "turn-patch",
            Self::Seen => "seen",
            Self::TurnWhole => "turn-whole",
            Self::AddSources => "add-sources",
            Self::Rule => "rule",
            Self::RemoveSources => "remove-sources",
            Self::FlipSources => "flip-sources",
            Self::FlipPoints => "flip-points",
            Self::FaceMe => "face-me",
            Self::FlipSuspect => "flip-suspect",
            Self::Pin => "pin",
            Self::Unpin => "unpin",
            Self::PropagateFrom => "propagate-from",
            Self::PropagateInside => "propagate-inside",
            Self::Select => "select",
            Self::Hide => "hide",
            Self::Accept => "accept",
            Self::SetParameters => "parameters",
            Self::SetViewpoints => "viewpoints",
            Self::SetScanner => "scanner",
            Self::Recipe => "recipe",
        }
    }

    /// In words for menus and the history: "Mend", "Remove sources".
    pub fn label(self) -> &'static str {
        match self {
            Self::Mend => "Mend",
            Self::TurnPatch => "Turn patch",
            Self::Seen => "What I see faces me",
            Self::TurnWhole => "Turn whole region",
            Self::AddSources => "Add sources",
            Self::Rule => "Rule for the right side",
            Self::RemoveSources => "Remove sources",
            Self::FlipSources => "Flip sources",
            Self::FlipPoints => "Flip points",
            Self::FaceMe => "Points face me",
            Self::FlipSuspect => "Flip suspect",
            Self::Pin => "Pin",
            Self::Unpin => "Unpin",
            Self::PropagateFrom => "Propagate from here",
            Self::PropagateInside => "Propagate inside",
            Self::Select => "Select",
            Self::Hide => "Hide or show",
            Self::Accept => "Accept",
            Self::SetParameters => "Parameters",
            Self::SetViewpoints => "Viewpoints",
            Self::SetScanner => "Scanner places",
            Self::Recipe => "Recipe",
        }
    }
}

impl Edit {
    /// What it does, without its data.
    pub fn kind(&self) -> EditKind {
        match self {
            Self::Mend(_) => EditKind::Mend,
            Self::TurnPatch { .. } => EditKind::TurnPatch,
            Self::TurnSeenPatches(_) => EditKind::Seen,
            Self::TurnWhole(_) => EditKind::TurnWhole,
            Self::AddSources(sources) => match sources.first().map(|source| source.origin) {
                Some(Origin::Rule(_)) => EditKind::Rule,
                Some(Origin::Seen) => EditKind::Seen,
                _ => EditKind::AddSources,
            },
            Self::RemoveSources(_) => EditKind::RemoveSources,
            Self::FlipSources(_) => EditKind::FlipSources,
            Self::FlipPoints { reason, .. } => match reason {
                FlipReason::Asked => EditKind::FlipPoints,
                FlipReason::FaceMe => EditKind::FaceMe,
                FlipReason::Suspect => EditKind::FlipSuspect,
            },
            Self::Pin(_) => EditKind::Pin,
            Self::Unpin(_) => EditKind::Unpin,
            Self::PropagateFrom(_) => EditKind::PropagateFrom,
            Self::PropagateInside(_) => EditKind::PropagateInside,
            Self::Select(_) => EditKind::Select,
            Self::Hide(_) => EditKind::Hide,
            Self::Accept(_) => EditKind::Accept,
            Self::SetParameters(_) => EditKind::SetParameters,
            Self::SetViewpoints(_) => EditKind::SetViewpoints,
            Self::SetScanner(_) => EditKind::SetScanner,
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
    /// All points that would turn are pinned.
    #[error("{}: unpin first", if *n_pinned == 1 { "the point is pinned".to_owned() } else { format!("all {n_pinned} points are pinned") })]
    Pinned {
        /// How many.
        n_pinned: u64,
    },
    /// The direction of a new source or mark is not one.
    #[error("the source at point {point} vouches for no direction: its normal must be finite and not zero")]
    NoDirection {
        /// The id.
        point: u32,
    },
    /// A viewpoint is not a place.
    #[error("viewpoint {} is nowhere: its coordinates must be finite numbers", index + 1)]
    NoPlace {
        /// Which one, from 0.
        index: usize,
    },
    /// A place of the scanner is not one.
    #[error("scanner place {} is nowhere: its coordinates must be finite numbers", index + 1)]
    NoScannerPlace {
        /// Which one, from 0.
        index: usize,
    },
    /// There are more viewpoints than can vote.
    #[error("{n_viewpoints} viewpoints are too many: at most {} can vote", VIEWS.end())]
    TooManyViewpoints {
        /// How many.
        n_viewpoints: usize,
    },
}
