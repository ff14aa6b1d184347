//! The mend tool: hovering shows exactly what a click would turn, a click turns it.
//!
//! Picking reads ids back from the GPU, which takes a frame or more, so at most one pick is under way. A click at the
//! pixel and picture of the last answer acts at once; another click is picked first and acts when the answer arrives.

use egui::Modifiers;
use normend_core::Change;
use normend_render::PickRequest;

use super::ToolEvent;
use crate::scene_sync::{Scene, Target};
use crate::session::Session;
use crate::viewport::{Pixel, PointerOnView};

/// A pixel of one picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    pixel: Pixel,
    picture_id: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Purpose {
    Hover,
    Click(Modifiers),
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

/// The state of the tool.
#[derive(Default)]
pub struct MendTool {
    pending: Option<Pending>,
    hovered: Option<(Place, Option<Target>)>,
    preview: Option<Preview>,
    /// The pixel that was just clicked: what was turned stays plain to see until the pointer moves on.
    quiet: Option<Pixel>,
}

struct Preview {
    of: Previewed,
    change: Change,
}

/// What a preview depends on.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Previewed {
    point: u32,
    whole: bool,
    revision: u64,
}

impl MendTool {
    /// What is under the pointer, as far as it is known.
    pub fn target(&self) -> Option<Target> {
        self.hovered.and_then(|(_, target)| target)
    }

    /// How many points a click would turn; `None` when the pointer is not on the scan.
    pub fn n_would_turn(&self) -> Option<u64> {
        self.preview.as_ref().map(|preview| preview.change.n_points())
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

    /// Asks for the point at `pixel` to be mended; with Ctrl (Command on macOS), for all that hangs together with it to
    /// be turned. On a source, selects it; with Shift, beside the others.
    pub fn click(&mut self, scene: &Scene, pixel: Pixel, modifiers: Modifiers) -> Option<ToolEvent> {
        self.quiet = Some(pixel);
        self.act(scene, pixel, Purpose::Click(modifiers))
    }

    /// Asks for the point at `pixel` to become the pivot.
    pub fn pivot(&mut self, scene: &Scene, pixel: Pixel) -> Option<ToolEvent> {
        self.act(scene, pixel, Purpose::Pivot)
    }

    fn act(&mut self, scene: &Scene, pixel: Pixel, purpose: Purpose) -> Option<ToolEvent> {
        let place = Place {
            pixel,
            picture_id: scene.picture_id(),
        };
        if let Some((known, target)) = self.hovered
            && known == place
        {
            return event(purpose, target);
        }
        self.pending = Some(Pending::new(scene, pixel, purpose));
        None
    }

    /// Takes the answer of the GPU if it is there, follows the pointer, and keeps the highlight up to date.
    pub fn update(&mut self, scene: &mut Scene, session: &Session, pointer: &PointerOnView) -> Option<ToolEvent> {
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
                    result = event(pending.purpose, target);
                }
                None => {
                    // Without a question, or when its ids mean other points now, it is asked of the newest picture.
                    pending.question = question.or_else(|| Question::ask(scene, pending.pixel));
                    self.pending = Some(pending);
                }
            }
        }
        match pointer.hovered {
            Some(pixel) => {
                if self.quiet.is_some_and(|quiet| quiet != pixel) {
                    self.quiet = None;
                }
                let place = Place {
                    pixel,
                    picture_id: scene.picture_id(),
                };
                if self.pending.is_none() && self.hovered.is_none_or(|(known, _)| known != place) {
                    self.pending = Some(Pending::new(scene, pixel, Purpose::Hover));
                }
            }
            None if self
                .pending
                .as_ref()
                .is_none_or(|pending| pending.purpose == Purpose::Hover) =>
            {
                self.pending = None;
                self.hovered = None;
            }
            None => {}
        }
        self.follow(scene, session, pointer.modifiers.command);
        result
    }

    fn follow(&mut self, scene: &mut Scene, session: &Session, whole: bool) {
        let revision = session.document.revision();
        let point = match self.target() {
            Some(Target::Point { point, .. }) if self.quiet.is_none() => Some(point),
            _ => None,
        };
        let wanted = point.map(|point| Previewed { point, whole, revision });
        if wanted == self.preview.as_ref().map(|preview| preview.of) {
            return;
        }
        let document = &session.document;
        self.preview = wanted.and_then(|of| {
            let change = if whole {
                document.preview_turn_whole(of.point)
            } else {
                document.preview_mend(of.point)
            };
            // Before the scan is oriented there is nothing to show.
            Some(Preview {
                of,
                change: change.ok()?,
            })
        });
        scene.highlight(self.preview.as_ref().map(|preview| &preview.change));
    }
}

fn event(purpose: Purpose, target: Option<Target>) -> Option<ToolEvent> {
    match (purpose, target) {
        (Purpose::Hover, _) | (Purpose::Pivot, None) => None,
        (Purpose::Pivot, Some(target)) => Some(ToolEvent::Pivot(target.position())),
        (Purpose::Click(modifiers), Some(Target::Point { point, .. })) if modifiers.command => {
            Some(ToolEvent::TurnWhole(point))
        }
        (Purpose::Click(_), Some(Target::Point { point, .. })) => Some(ToolEvent::Mend(point)),
        (Purpose::Click(modifiers), Some(Target::Source { point, .. })) => Some(ToolEvent::SelectSource {
            point,
            extend: modifiers.shift || modifiers.command,
        }),
        (Purpose::Click(_), None) => Some(ToolEvent::Deselect),
    }
}
