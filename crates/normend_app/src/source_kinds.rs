//! Who says which side is right, by kind: counted, shown in the view or not, and dropped as a whole.

use std::sync::Arc;

use egui::Color32;
use normend_core::document::{FlipReason, ScannerChoice};
use normend_core::sources::Origin;
use normend_core::{Document, Edit, SideRule, SourceRule, SpanningTree, Start};

use crate::app::App;
use crate::command::{Action, Command};
use crate::theme;

/// A kind of what says the side of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SourceKind {
    /// The user's clicks.
    Picked,
    /// What was vouched for beside the first click.
    Default,
    /// Selections that the rest follows.
    Selection,
    /// The user's own view.
    Seen,
    /// Rules for the right side of a component.
    Rule,
    /// Points that were flipped for themselves alone.
    Flipped,
    /// Protected points.
    Pinned,
    /// Viewpoints.
    Voted,
    /// The places that the scan was taken from, known or found.
    Scanner,
    /// The normals that came with the file.
    File,
}

impl SourceKind {
    /// All kinds, in the order of the list.
    pub const ALL: [Self; 10] = [
        Self::Picked,
        Self::Default,
        Self::Selection,
        Self::Seen,
        Self::Rule,
        Self::Flipped,
        Self::Pinned,
        Self::Voted,
        Self::Scanner,
        Self::File,
    ];

    /// The kind of a source.
    pub fn of(origin: Origin) -> Self {
        match origin {
            Origin::Picked => Self::Picked,
            Origin::Default => Self::Default,
            Origin::Selected => Self::Selection,
            Origin::Seen => Self::Seen,
            Origin::Rule(_) => Self::Rule,
            Origin::Voted => Self::Voted,
        }
    }

    /// The name in the list.
    pub fn label(self) -> &'static str {
        match self {
            Self::Picked => "Picked",
            Self::Default => "Kept beside a pick",
            Self::Selection => "Selection",
            Self::Seen => "Seen by me",
            Self::Rule => "Rule",
            Self::Flipped => "Flipped alone",
            Self::Pinned => "Pinned",
            Self::Voted => "Voted",
            Self::Scanner => "Scanner",
            Self::File => "File",
        }
    }

    /// What it is, in plain words.
    pub fn about(self) -> &'static str {
        match self {
            Self::Picked => {
                "Points that you clicked because they were wrong. What hangs together with each follows it."
            }
            Self::Default => {
                "When you first mended a part, its highest point was held as it was, so that only the patch turned and not \
                 the whole part."
            }
            Self::Selection => "Points of selections that you said are right, from which signs spread.",
            Self::Seen => "Points that you turned toward yourself with “What I see faces me”.",
            Self::Rule => "One point for each part whose side you let a rule decide, such as outward or up.",
            Self::Flipped => {
                "Points that you flipped by brush, lasso or as a suspect. They turned alone; nothing around them follows."
            }
            Self::Pinned => "Points that you pinned as right. Nothing turns them until you unpin them.",
            Self::Voted => "Points that viewpoints around the scan see clearly. Those that you make overrule them.",
            Self::Scanner => {
                "The places that the scan was taken from: of its file, a table beside it or your own, or the one that the points tell. \
                 Normals face them."
            }
            Self::File => "The normals that came with the file, and their sides.",
        }
    }

    /// What dropping it does.
    pub fn drop_tooltip(self) -> &'static str {
        match self {
            Self::Picked | Self::Default | Self::Selection | Self::Seen | Self::Rule => "Remove these sources",
            Self::Flipped => "Flip these points back",
            Self::Pinned => "Unpin these points; nothing turns",
            Self::Voted => "Orient again without votes: the highest point of each part points up",
            Self::Scanner => "Orient again without the scanner's places: normals point outward",
            Self::File => "Orient again from estimated normals, not from those of the file",
        }
    }

    /// The color of its mark in the list; `None` where the color says something else in the view.
    pub fn color(self) -> Option<Color32> {
        let color = match self {
            Self::Picked | Self::Default | Self::Selection | Self::Seen | Self::Rule | Self::Scanner => return None,
            Self::Flipped => theme::SOURCE_FLIPPED,
            Self::Pinned => theme::SOURCE_PINNED,
            Self::Voted => theme::SOURCE_VOTED,
            Self::File => theme::SOURCE_GIVEN,
        };
        let [r, g, b] = color.map(|channel| (channel * 255.0).round() as u8);
        Some(Color32::from_rgb(r, g, b))
    }
}

/// How many there are of each kind, and which are shown.
#[derive(Clone, Debug)]
pub struct SourceKinds {
    counts: [u64; SourceKind::ALL.len()],
    shown: [bool; SourceKind::ALL.len()],
    /// What the counts are of.
    of: Option<(u64, Arc<SpanningTree>)>,
}

impl Default for SourceKinds {
    fn default() -> Self {
        Self {
            counts: [0; SourceKind::ALL.len()],
            // All points of a file with normals have one, which is nothing to look at unasked; and flipped points show their side.
            shown: SourceKind::ALL.map(|kind| !matches!(kind, SourceKind::File | SourceKind::Flipped)),
            of: None,
        }
    }
}

impl SourceKinds {
    /// Counts again if the document changed. O(sources) then.
    pub fn follow(&mut self, document: &Document, n_without_normal: usize) {
        let Some(propagation) = document.propagation() else {
            return;
        };
        let is_same = |(revision, tree): &(u64, Arc<SpanningTree>)| {
            *revision == document.revision() && Arc::ptr_eq(tree, &propagation.tree)
        };
        if self.of.as_ref().is_some_and(is_same) {
            return;
        }
        self.of = Some((document.revision(), Arc::clone(&propagation.tree)));
        let counts = &mut self.counts;
        *counts = [0; SourceKind::ALL.len()];
        for source in document.sources().iter() {
            counts[SourceKind::of(source.origin) as usize] += 1;
        }
        let marks = document.marks();
        counts[SourceKind::Flipped as usize] = marks.free().len();
        counts[SourceKind::Pinned as usize] = marks.pinned().len();
        counts[SourceKind::Voted as usize] += propagation.voted_sources.len() as u64;
        counts[SourceKind::Scanner as usize] =
            u64::from(propagation.found_station.is_some()) + u64::from(propagation.has_track);
        let mut places: Vec<_> = propagation.stations.iter().map(|station| station.position).collect();
        // Pieces of one place follow one another.
        places.dedup();
        counts[SourceKind::Scanner as usize] += places.len() as u64;
        if propagation.parameters.start == Start::Keep && document.given_normals().is_some() {
            counts[SourceKind::File as usize] = (document.cloud().n_points() - n_without_normal) as u64;
        }
    }

    /// How many there are, when last counted.
    pub fn count(&self, kind: SourceKind) -> u64 {
        self.counts[kind as usize]
    }

    /// Whether the view shows them.
    pub fn is_shown(&self, kind: SourceKind) -> bool {
        self.shown[kind as usize]
    }

    /// Lets the view show them, or not.
    pub fn show(&mut self, kind: SourceKind, shown: bool) {
        self.shown[kind as usize] = shown;
    }
}

impl App {
    /// Drops all that is of a kind, in one step.
    pub(crate) fn drop_kind(&mut self, kind: SourceKind) {
        let Some(session) = &self.session else { return };
        let document = &session.document;
        let wanted = document.parameters();
        let again = |parameters| Some(Action::Propagate(parameters));
        let (edit, action) = match kind {
            SourceKind::Picked | SourceKind::Default | SourceKind::Selection | SourceKind::Seen | SourceKind::Rule => {
                let of_kind = document
                    .sources()
                    .iter()
                    .filter(|source| SourceKind::of(source.origin) == kind);
                (
                    Some(Edit::RemoveSources(of_kind.map(|source| source.point).collect())),
                    None,
                )
            }
            SourceKind::Flipped => {
                let points = document.flipped_alone();
                if points.is_empty() {
                    self.messages
                        .note("These points show what their surroundings say by now: there is nothing to flip back.");
                    return;
                }
                let reason = FlipReason::Asked;
                (Some(Edit::FlipPoints { points, reason }), None)
            }
            SourceKind::Pinned => (Some(Edit::Unpin(document.marks().pinned().clone())), None),
            SourceKind::Voted => (
                None,
                again(normend_core::Parameters {
                    sources: SourceRule::Highest,
                    ..wanted
                }),
            ),
            SourceKind::Scanner if session.has_scanner() => {
                let none = ScannerChoice {
                    without_file: true,
                    ..ScannerChoice::default()
                };
                (Some(Edit::SetScanner(none)), None)
            }
            SourceKind::Scanner => (
                None,
                again(normend_core::Parameters {
                    rule: SideRule::Outward,
                    ..wanted
                }),
            ),
            SourceKind::File => (
                None,
                again(normend_core::Parameters {
                    start: Start::Estimate,
                    ..wanted
                }),
            ),
        };
        if let Some(edit) = edit {
            self.apply_edit(edit);
        }
        if let Some(action) = action {
            self.propagate_if_possible(action);
        }
    }

    /// Orients again, unless something else runs that must not be disturbed; then it says so.
    pub(crate) fn propagate_if_possible(&mut self, action: Action) {
        match self.availability(Command::Propagate) {
            Ok(()) => self.act(action),
            Err(reason) => self.messages.note(format!("Not oriented again: {reason}.")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_one_place_in_the_list() {
        for (index, kind) in SourceKind::ALL.into_iter().enumerate() {
            assert_eq!(kind as usize, index);
        }
        let mut labels = SourceKind::ALL.map(SourceKind::label);
        labels.sort_unstable();
        assert!(labels.windows(2).all(|pair| pair[0] != pair[1]));
        for origin in Origin::ALL {
            assert!(SourceKind::ALL.contains(&SourceKind::of(origin)));
        }
    }
}
