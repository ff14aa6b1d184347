//! The mend tool: hovering shows exactly what a click would turn, a click turns it.
//!
//! Picking reads ids back from the GPU, which takes a frame or more, so at most one pick is under way. A click at the
//! pixel and picture of the last answer acts at once; another click is picked first and acts when the answer arrives.
//!
//! A click turns a patch where the document offers patches, by default the likeliest; the user can choose a larger or a
//! smaller one, and that choice holds while the pointer stays on it. Elsewhere, and with Alt, it mends along the tree.

use egui::Modifiers;
use normend_core::patches::{Offer, Patch};
use normend_core::{Change, Document, Edit};
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
    /// The patch that the user chose instead of the default, at a revision of the document.
    chosen: Option<(Patch, u64)>,
    /// Steps to larger (or, negative, smaller) patches that were asked for and not taken yet.
    steps: i32,
}

struct Preview {
    of: Previewed,
    aim: Aim,
    change: Change,
}

/// What a preview depends on.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Previewed {
    point: u32,
    means: Means,
    revision: u64,
    chosen: Option<Patch>,
}

/// Which region of a point is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Means {
    /// The chosen patch, or the default one.
    Patch,
    /// What the tree says.
    Tree,
    /// All that hangs together.
    Whole,
}

impl Means {
    fn of(modifiers: Modifiers) -> Self {
        if modifiers.command {
            Self::Whole
        } else if modifiers.alt {
            Self::Tree
        } else {
            Self::Patch
        }
    }
}

/// What a click would do.
struct Aim {
    edit: Edit,
    patch: Option<AimedPatch>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
struct AimedPatch {
    patch: Patch,
    /// How many of the offered patches are not larger, and how many are offered.
    level: (usize, usize),
}

impl Aim {
    fn preview(&self, document: &Document) -> Option<Change> {
        let change = match self.edit {
            Edit::TurnPatch { point, n_points } => document.preview_turn_patch(point, n_points),
            Edit::TurnWhole(point) => document.preview_turn_whole(point),
            Edit::Mend(point) => document.preview_mend(point),
            ref edit => document.preview(edit),
        };
        // Before the scan is oriented there is nothing to show.
        change.ok()
    }
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

    /// Which of the offered patches a click would turn, the smallest is 1, and how many there are; `None` when it would turn no
    /// patch.
    pub fn level(&self) -> Option<(usize, usize)> {
        let preview = self.preview.as_ref()?;
        preview.aim.patch.map(|aimed| aimed.level)
    }

    /// Chooses a larger patch, that many steps; a smaller one when negative.
    pub fn step(&mut self, steps: i32) {
        self.steps = self.steps.saturating_add(steps);
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

    /// Asks for the patch at `pixel` to be turned; with Alt, for what the tree says to be turned; with Ctrl (Command on macOS),
    /// for all that hangs together with it. On a source, selects it; with Shift, beside the others.
    pub fn click(
        &mut self,
        scene: &Scene,
        document: &Document,
        pixel: Pixel,
        modifiers: Modifiers,
    ) -> Option<ToolEvent> {
        self.quiet = Some(pixel);
        self.act(scene, document, pixel, Purpose::Click(modifiers))
    }

    /// Asks for the point at `pixel` to become the pivot.
    pub fn pivot(&mut self, scene: &Scene, document: &Document, pixel: Pixel) -> Option<ToolEvent> {
        self.act(scene, document, pixel, Purpose::Pivot)
    }

    fn act(&mut self, scene: &Scene, document: &Document, pixel: Pixel, purpose: Purpose) -> Option<ToolEvent> {
        let place = Place {
            pixel,
            picture_id: scene.picture_id(),
        };
        if let Some((known, target)) = self.hovered
            && known == place
        {
            return self.event(document, purpose, target);
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
                    result = self.event(&session.document, pending.purpose, target);
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
        self.follow(scene, &session.document, Means::of(pointer.modifiers));
        result
    }

    fn follow(&mut self, scene: &mut Scene, document: &Document, means: Means) {
        let revision = document.revision();
        let point = match self.target() {
            Some(Target::Point { point, .. }) if self.quiet.is_none() => Some(point),
            _ => None,
        };
        self.choose(document, point);
        let wanted = point.map(|point| Previewed {
            point,
            means,
            revision,
            chosen: self.chosen.map(|(patch, _)| patch),
        });
        if wanted == self.preview.as_ref().map(|preview| preview.of) {
            return;
        }
        let before = self.preview.take();
        self.preview = wanted.and_then(|of| {
            let aim = self.aim(document, of.point, of.means);
            let known = before.filter(|before| {
                aim.patch.is_some() && aim.patch == before.aim.patch && before.of.revision == revision
            });
            // Another point of the same patch turns the same points.
            let change = known.map_or_else(|| aim.preview(document), |known| Some(known.change))?;
            Some(Preview { of, aim, change })
        });
        scene.highlight(self.preview.as_ref().map(|preview| &preview.change));
    }

    /// Takes the steps that were asked for, from where the pointer is, and forgets a choice that was made for another place
    /// or another state of the document.
    fn choose(&mut self, document: &Document, point: Option<u32>) {
        let revision = document.revision();
        let holds = |&(patch, chosen_at): &(Patch, u64)| {
            chosen_at == revision && point.is_none_or(|point| is_in(document, patch, point))
        };
        self.chosen = self.chosen.filter(holds);
        if let Some(point) = point
            && self.steps != 0
            && let Some(aimed) = self.aim(document, point, Means::Patch).patch
        {
            self.chosen = Some((aimed.patch, revision));
            self.steps = 0;
        }
    }

    /// What a click on a point does.
    fn aim(&self, document: &Document, point: u32, means: Means) -> Aim {
        let offer = match means {
            Means::Patch => document.offer(point).ok().flatten(),
            Means::Tree | Means::Whole => None,
        };
        let Some(Offer { patches, default }) = offer else {
            let edit = if means == Means::Whole {
                Edit::TurnWhole(point)
            } else {
                Edit::Mend(point)
            };
            return Aim { edit, patch: None };
        };
        let chosen = self.chosen.map(|(patch, _)| patch);
        let mut patch = chosen
            .filter(|&patch| is_in(document, patch, point))
            .unwrap_or(patches[default]);
        for _ in 0..self.steps.unsigned_abs().min(patches.len() as u32) {
            let next = if self.steps > 0 {
                patches.iter().find(|next| next.n_points > patch.n_points)
            } else {
                patches.iter().rfind(|next| next.n_points < patch.n_points)
            };
            patch = next.copied().unwrap_or(patch);
        }
        let not_larger = patches
            .iter()
            .filter(|offered| offered.n_points <= patch.n_points)
            .count();
        Aim {
            edit: Edit::TurnPatch {
                point,
                n_points: patch.n_points,
            },
            patch: Some(AimedPatch {
                patch,
                level: (not_larger.max(1), patches.len()),
            }),
        }
    }

    fn event(&mut self, document: &Document, purpose: Purpose, target: Option<Target>) -> Option<ToolEvent> {
        match (purpose, target) {
            (Purpose::Hover, _) | (Purpose::Pivot, None) => None,
            (Purpose::Pivot, Some(target)) => Some(ToolEvent::Pivot(target.position())),
            (Purpose::Click(modifiers), Some(Target::Point { point, .. })) => {
                let aim = self.aim(document, point, Means::of(modifiers));
                self.steps = 0;
                Some(ToolEvent::Edit(aim.edit))
            }
            (Purpose::Click(modifiers), Some(Target::Source { point, .. })) => Some(ToolEvent::SelectSource {
                point,
                extend: modifiers.shift || modifiers.command,
            }),
            (Purpose::Click(_), None) => Some(ToolEvent::Deselect),
        }
    }
}

/// Whether a patch of the propagation in force holds a point.
fn is_in(document: &Document, patch: Patch, point: u32) -> bool {
    let patches = document
        .propagation()
        .and_then(|propagation| propagation.patches.as_ref());
    patches.is_some_and(|patches| patch.leaves().contains(&patches.leaf(point)))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DVec3, Vec3};
    use normend_core::patches::{Level, Patches};
    use normend_core::{Parameters, PointCloud, Propagation, Regions, RiemannianGraph, Silent, SpanningTree};

    use super::*;

    /// Sixteen points in a row, all normals up, in patches of 1, 2, 4, 8 and all; those of four have the weakest boundary.
    fn row() -> Document {
        let edges: Vec<_> = (0..15).map(|a| (a, a + 1, 0.1, false)).collect();
        let tree = SpanningTree::new(&RiemannianGraph::from_edges(16, &edges), &Silent).unwrap();
        let tree = Arc::new(tree);
        let halves = |n: u32| -> Vec<u32> { (0..n).map(|cluster| cluster / 2).collect() };
        let parents = [halves(16), halves(8), halves(4), halves(2)];
        let strengths = [vec![0.9; 16], vec![0.5; 8], vec![0.1; 4], vec![0.3; 2]];
        let levels: Vec<_> = parents
            .iter()
            .zip(&strengths)
            .map(|(parents, strengths)| Level { parents, strengths })
            .collect();
        let positions = (0..16).map(|point| Vec3::X * point as f32).collect();
        let cloud = PointCloud::new(DVec3::ZERO, positions).unwrap();
        let mut document = Document::new(Arc::new(cloud), None);
        document.install(Propagation {
            parameters: Parameters::default(),
            normals: Arc::new(vec![Vec3::Z; 16]),
            splat_radii: Arc::new(vec![1.0; 16]),
            base_regions: Regions::new(Arc::clone(&tree), Default::default(), Default::default()),
            default_sources: vec![0],
            voted_sources: Arc::default(),
            sides: Vec::new(),
            patches: Some(Arc::new(Patches::new(&tree, &levels))),
            tree,
            evidence: None,
            found_station: None,
            seconds: Vec::new(),
        });
        document
    }

    fn n_aimed(tool: &MendTool, document: &Document, point: u32) -> Option<u32> {
        tool.aim(document, point, Means::Patch)
            .patch
            .map(|aimed| aimed.patch.n_points)
    }

    #[test]
    fn modifiers_say_which_region_is_meant() {
        let (tool, document) = (MendTool::default(), row());
        let edit = |modifiers| tool.aim(&document, 5, Means::of(modifiers)).edit;
        assert_eq!(edit(Modifiers::NONE), Edit::TurnPatch { point: 5, n_points: 4 });
        assert_eq!(edit(Modifiers::ALT), Edit::Mend(5));
        assert_eq!(edit(Modifiers::COMMAND), Edit::TurnWhole(5));
        assert_eq!(
            tool.aim(&document, 5, Means::Tree).preview(&document),
            document.preview_mend(5).ok()
        );
        let aim = tool.aim(&document, 5, Means::Patch);
        assert_eq!(aim.preview(&document).unwrap().n_points(), 4);
        assert_eq!(aim.patch.unwrap().level, (3, 5));
    }

    #[test]
    fn steps_choose_patches_within_what_is_offered() {
        let (mut tool, document) = (MendTool::default(), row());
        for (step, expect) in [(1, 8), (1, 16), (1, 16), (-1, 8), (-2, 2), (-5, 1), (3, 8)] {
            tool.step(step);
            tool.choose(&document, Some(5));
            assert_eq!(n_aimed(&tool, &document, 5), Some(expect), "{step}");
        }
    }

    #[test]
    fn a_choice_holds_on_its_patch_and_until_an_edit() {
        let (mut tool, mut document) = (MendTool::default(), row());
        tool.step(1);
        tool.choose(&document, None);
        assert_eq!(n_aimed(&tool, &document, 5), Some(8), "a step waits for a place");
        tool.choose(&document, Some(5));
        tool.choose(&document, Some(0));
        assert_eq!(n_aimed(&tool, &document, 0), Some(8));
        tool.choose(&document, Some(9));
        assert_eq!(n_aimed(&tool, &document, 9), Some(4));
        tool.choose(&document, Some(0));
        assert_eq!(n_aimed(&tool, &document, 0), Some(4), "what was left is forgotten");

        tool.step(-1);
        tool.choose(&document, Some(0));
        assert_eq!(n_aimed(&tool, &document, 0), Some(2));
        document.apply(tool.aim(&document, 0, Means::Patch).edit).unwrap();
        tool.choose(&document, Some(1));
        assert_eq!(n_aimed(&tool, &document, 1), Some(1), "point 0 is vouched for");
        assert_eq!(tool.aim(&document, 0, Means::Patch).edit, Edit::Mend(0));
        let beside = tool.aim(&document, 2, Means::Patch);
        assert_eq!(beside.patch.as_ref().map(|aimed| aimed.patch.n_points), Some(4));
        let n_turned = beside.preview(&document).unwrap().n_points();
        assert_eq!(n_turned, 2, "the patch that point 0 vouches for stays");
    }
}
