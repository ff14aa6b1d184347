//! The tools that act on what is under the pointer: hovering shows exactly what a click would turn or select, a click does it.
//!
//! Picking reads ids back from the GPU, which takes a frame or more, so at most one pick is under way. A click at the
//! pixel and picture of the last answer acts at once; another click is picked first and acts when the answer arrives.
//!
//! A click turns a patch where the document offers patches, by default the likeliest; the user can choose a larger or a
//! smaller one, and that choice holds while the pointer stays on it. Elsewhere, and with Alt, it mends along the tree.

use egui::Modifiers;
use normend_core::{Change, Document, Edit, EditError, PointSet};
use normend_render::PickRequest;

pub use super::aim::Means;
use super::aim::{Aim, Deed, Reach};
use super::{Combine, Tool, ToolEvent};
use crate::point_ranges;
use crate::scene_sync::{Scene, Target};
use crate::session::Session;
use crate::theme;
use crate::viewport::{Pixel, PointerOnView};

/// A pixel of one picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    pixel: Pixel,
    picture_id: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Purpose {
    Look,
    Click { means: Means, modifiers: Modifiers },
    Pivot,
}

struct Pending {
    pixel: Pixel,
    purpose: Purpose,
    /// `None` until there is a picture with the present ids to ask.
    question: Option<Question>,
}

struct Question {
    request: PickRequest,
    place: Place,
    ids_version: u64,
}

impl Pending {
    fn new(scene: &Scene, pixel: Pixel, purpose: Purpose) -> Self {
        Self {
            pixel,
            purpose,
            question: Question::ask(scene, pixel),
        }
    }
}

impl Question {
    fn ask(scene: &Scene, pixel: Pixel) -> Option<Self> {
        let place = Place {
            pixel,
            picture_id: scene.picture_id(),
        };
        let request = scene.pick(pixel)?;
        Some(Self {
            request,
            place,
            ids_version: scene.ids_version(),
        })
    }
}

/// What the tools know of the pointer.
#[derive(Default)]
pub struct PointTool {
    pending: Option<Pending>,
    hovered: Option<(Place, Option<Target>)>,
    preview: Option<Preview>,
    /// The pixel that was just clicked: what was turned stays plain to see until the pointer moves on.
    quiet: Option<Pixel>,
    /// Which patch is meant.
    reach: Reach,
}

struct Preview {
    of: Previewed,
    /// Why a click would be refused, otherwise.
    shown: Result<Shown, EditError>,
}

/// What a click would do, and to which points.
struct Shown {
    aim: Aim,
    change: Change,
    /// Pinned points that stay.
    n_pinned: u64,
    /// Vouched points that hinder the next larger patch, where this is the largest that is offered.
    n_hindering: usize,
}

/// What a preview depends on.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Previewed {
    point: u32,
    means: Means,
    revision: u64,
    reach: Reach,
}

impl PointTool {
    /// What is under the pointer, as far as it is known.
    pub fn target(&self) -> Option<Target> {
        self.hovered.and_then(|(_, target)| target)
    }

    /// What is at a pixel of the present picture; `None` when that is not known yet.
    pub fn target_at(&self, scene: &Scene, pixel: Pixel) -> Option<Option<Target>> {
        let place = Place {
            pixel,
            picture_id: scene.picture_id(),
        };
        self.hovered
            .filter(|(known, _)| *known == place)
            .map(|(_, target)| target)
    }

    fn shown(&self) -> Option<&Shown> {
        self.preview.as_ref().and_then(|preview| preview.shown.as_ref().ok())
    }

    /// How many points a click would turn; `None` when the pointer is not on the scan, or the tool turns nothing.
    pub fn n_would_turn(&self) -> Option<u64> {
        let shown = self.shown()?;
        matches!(shown.aim.deed, Deed::Turn(_)).then(|| shown.change.n_points())
    }

    /// Which of the offered patches a click would turn or select, the smallest is 1, and how many there are; `None` when it would be
    /// no patch.
    pub fn level(&self) -> Option<(usize, usize)> {
        self.shown()?.aim.level
    }

    /// What a click would do, in a few words; `None` when it is not known.
    pub fn badge(&self) -> Option<String> {
        let Preview { of, shown } = self.preview.as_ref()?;
        let shown = match shown {
            Ok(shown) => shown,
            Err(EditError::Pinned { .. }) => return Some("Pinned: nothing turns it until you unpin it".to_owned()),
            Err(_) => return None,
        };
        let n_points = theme::counted(shown.change.n_points(), "point", "points");
        let mut text = match of.means {
            Means::Patch | Means::Tree | Means::Whole => format!("Turns {n_points}"),
            Means::SelectPatch => format!("Patch of {n_points}"),
            Means::SelectComponent => format!("Component of {n_points}"),
            Means::PinPatch => format!("Pins {n_points}"),
        };
        if let Some((level, n_levels)) = shown.aim.level.filter(|&(_, n_levels)| n_levels > 1) {
            text += &format!(" ({level} of {n_levels})");
        }
        if shown.n_pinned > 0 {
            text += &format!(" · {} pinned stay", theme::thousands(shown.n_pinned));
        }
        if shown.n_hindering > 0 {
            let points = theme::counted(shown.n_hindering as u64, "point", "points");
            text += &format!(" · larger patches hold {points} you vouched for");
        }
        Some(text)
    }

    /// Chooses a larger patch, that many steps; a smaller one when negative.
    pub fn step(&mut self, steps: i32) {
        self.reach.step(steps);
        if steps != 0 {
            self.quiet = None;
        }
    }

    /// Whether an answer of the GPU is awaited.
    pub fn is_picking(&self) -> bool {
        self.pending.is_some()
    }

    /// Forgets everything, as when another scan is opened.
    pub fn reset(&mut self, scene: &mut Scene) {
        *self = Self::default();
        scene.highlight(None);
    }

    fn highlight(&self, scene: &mut Scene) {
        scene.highlight(self.shown().map(|shown| &shown.change));
    }

    /// A click at `pixel`, for what `means` says. On the sphere of a source, one that would turn something selects the source
    /// instead; with Shift or Ctrl (Command on macOS), beside the others.
    pub fn click(
        &mut self,
        scene: &Scene,
        document: &Document,
        pixel: Pixel,
        means: Means,
        modifiers: Modifiers,
    ) -> Option<ToolEvent> {
        self.quiet = Some(pixel).filter(|_| means.turns());
        self.act(scene, document, pixel, Purpose::Click { means, modifiers })
    }

    /// Asks for the point at `pixel` to become the pivot.
    pub fn pivot(&mut self, scene: &Scene, document: &Document, pixel: Pixel) -> Option<ToolEvent> {
        self.act(scene, document, pixel, Purpose::Pivot)
    }

    /// Asks what is at `pixel`, for [`Self::target_at`].
    pub fn look(&mut self, scene: &Scene, pixel: Pixel) {
        if self.pending.is_none() {
            self.pending = Some(Pending::new(scene, pixel, Purpose::Look));
        }
    }

    fn act(&mut self, scene: &Scene, document: &Document, pixel: Pixel, purpose: Purpose) -> Option<ToolEvent> {
        if let Some(target) = self.target_at(scene, pixel) {
            return self.event(document, purpose, target);
        }
        self.pending = Some(Pending::new(scene, pixel, purpose));
        None
    }

    /// Takes the answer of the GPU if it is there, follows the pointer, and keeps the highlight up to date.
    pub fn update(
        &mut self,
        scene: &mut Scene,
        session: &Session,
        pointer: &PointerOnView,
        tool: Tool,
    ) -> Option<ToolEvent> {
        let mut result = None;
        if let Some(mut pending) = self.pending.take() {
            let mut question = pending
                .question
                .take()
                .filter(|question| question.ids_version == scene.ids_version());
            let answer = question
                .as_mut()
                .and_then(|question| Some((question.place, scene.poll(&mut question.request)?)));
            match answer {
                Some((place, target)) => {
                    self.hovered = Some((place, target));
                    result = self.event(&session.document, pending.purpose, target);
                }
                None => {
                    // Without a question, or when its ids mean other points now, it is asked of the newest picture.
                    pending.question = question.or_else(|| Question::ask(scene, pending.pixel));
                    self.pending = Some(pending);
                }
            }
        }
        if pointer.hovered.is_none() {
            // When it points again, it is at something else.
            self.quiet = None;
        }
        match pointer.hovered {
            Some(pixel) => {
                if self.quiet.is_some_and(|quiet| quiet != pixel) {
                    self.quiet = None;
                }
                if self.pending.is_none() && self.target_at(scene, pixel).is_none() {
                    self.pending = Some(Pending::new(scene, pixel, Purpose::Look));
                }
            }
            None if self
                .pending
                .as_ref()
                .is_none_or(|pending| pending.purpose == Purpose::Look) =>
            {
                self.pending = None;
                self.hovered = None;
            }
            None => {}
        }
        self.follow(scene, &session.document, Means::of(tool, pointer.modifiers));
        result
    }

    fn follow(&mut self, scene: &mut Scene, document: &Document, means: Option<Means>) {
        let revision = document.signs_revision();
        let point = match self.target() {
            _ if self.quiet.is_some() => None,
            Some(Target::Point { point, .. }) => Some(point),
            Some(Target::Source { point, .. }) => Some(point).filter(|_| means.is_some_and(|means| !means.turns())),
            None => None,
        };
        self.reach.settle(document, point, means);
        let wanted = point.zip(means).map(|(point, means)| Previewed {
            point,
            means,
            revision,
            reach: self.reach,
        });
        if wanted == self.preview.as_ref().map(|preview| preview.of) {
            return;
        }
        let before = self.preview.take();
        self.preview = wanted.map(|of| {
            let known = before.filter(|before| before.of.revision == revision && before.of.means == of.means);
            Preview {
                of,
                shown: self.show(document, of, known.and_then(|known| known.shown.ok())),
            }
        });
        self.highlight(scene);
    }

    /// What a click would do; `known` is what it would have done at another point.
    fn show(&self, document: &Document, of: Previewed, known: Option<Shown>) -> Result<Shown, EditError> {
        let aim = self.reach.aim(document, of.point, of.means);
        // Another point of the same patch means the same points, unless it is pinned.
        if let Some(known) = known
            && aim.patch.is_some()
            && aim.patch == known.aim.patch
            && !document.marks().is_pinned(of.point)
        {
            return Ok(Shown { aim, ..known });
        }
        let change = aim.change(document, of.point)?;
        Ok(Shown {
            n_pinned: aim.n_pinned(document, of.point),
            n_hindering: aim.n_hindering(document, of.point),
            change,
            aim,
        })
    }

    fn event(&mut self, document: &Document, purpose: Purpose, target: Option<Target>) -> Option<ToolEvent> {
        match (purpose, target) {
            (Purpose::Look, _) | (Purpose::Pivot, None) => None,
            (Purpose::Pivot, Some(target)) => Some(ToolEvent::Pivot(target.position())),
            (Purpose::Click { means, modifiers }, Some(Target::Source { point, .. })) if means.turns() => {
                Some(ToolEvent::SelectSource {
                    point,
                    extend: modifiers.shift || modifiers.command,
                })
            }
            (Purpose::Click { means, modifiers }, Some(Target::Point { point, .. } | Target::Source { point, .. })) => {
                let aim = self.reach.aim(document, point, means);
                self.reach.rest();
                match aim.deed {
                    Deed::Turn(edit) => Some(ToolEvent::Edit(edit)),
                    Deed::Select | Deed::Pin => {
                        let points = points_of(document, &aim.change(document, point).ok()?);
                        Some(match aim.deed {
                            Deed::Pin => ToolEvent::Edit(Edit::Pin(points)),
                            _ => ToolEvent::Select {
                                points,
                                combine: Combine::of(modifiers),
                            },
                        })
                    }
                }
            }
            (Purpose::Click { means, modifiers }, None) => {
                if means.turns() {
                    Some(ToolEvent::Deselect)
                } else {
                    // As a stroke beside the scan: it picks nothing.
                    (Combine::of(modifiers) == Combine::Replace).then(|| ToolEvent::Select {
                        points: PointSet::new(),
                        combine: Combine::Replace,
                    })
                }
            }
        }
    }
}

/// The points at some positions. O(n / 64), and the positions or else the others, whichever are fewer.
pub fn points_of(document: &Document, change: &Change) -> PointSet {
    let Some(propagation) = document.propagation() else {
        return PointSet::new();
    };
    let order = propagation.tree.order();
    let positions = point_ranges::set_of(change.ranges());
    let ranges = point_ranges::renumbered(&positions, order.len(), |position| order[position as usize]);
    point_ranges::set_of(&ranges)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn badge(means: Means, shown: Result<(u64, u64, usize), EditError>) -> Option<String> {
        let shown = shown.map(|(n_points, n_pinned, n_hindering)| Shown {
            aim: Aim {
                means,
                deed: Deed::Select,
                patch: None,
                level: Some((3, 7)),
            },
            change: Change::from_flips(std::slice::from_ref(&(0..n_points as u32))),
            n_pinned,
            n_hindering,
        });
        let of = Previewed {
            point: 0,
            means,
            revision: 0,
            reach: Reach::default(),
        };
        let tool = PointTool {
            preview: Some(Preview { of, shown }),
            ..PointTool::default()
        };
        tool.badge()
    }

    #[test]
    fn the_badge_says_what_a_click_does_and_what_it_does_not() {
        assert_eq!(PointTool::default().badge(), None);
        assert_eq!(
            badge(Means::Patch, Ok((4812, 0, 0))).unwrap(),
            "Turns 4,812 points (3 of 7)"
        );
        assert_eq!(
            badge(Means::Patch, Ok((1, 120, 2))).unwrap(),
            "Turns 1 point (3 of 7) · 120 pinned stay · larger patches hold 2 points you vouched for"
        );
        assert_eq!(
            badge(Means::SelectPatch, Ok((2, 0, 0))).unwrap(),
            "Patch of 2 points (3 of 7)"
        );
        let pinned = badge(Means::Patch, Err(EditError::Pinned { n_pinned: 1 })).unwrap();
        assert!(pinned.starts_with("Pinned"), "{pinned}");
        assert_eq!(badge(Means::Patch, Err(EditError::NotReady)), None);
    }
}
