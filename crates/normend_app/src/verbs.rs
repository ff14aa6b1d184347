//! What can be done with the selected points, and the commands that select and hide.

use normend_core::document::{FlipReason, Viewer};
use normend_core::{Change, Document, Edit, EditError, PointSet};

use crate::app::App;
use crate::command::Command;
use crate::selection::Answer;
use crate::theme;
use crate::tools::Tool;

/// The brush's radius, in points: as thin as a splat, up to a third of a small window.
const BRUSH_RADII: std::ops::RangeInclusive<f32> = 2.0..=200.0;
/// What one key press grows the brush by.
const BRUSH_STEP: f32 = 1.25;
/// Points that the wheel scrolls to grow the brush by the factor e.
const SCROLL_PER_BRUSH: f32 = 250.0;

/// An edit that is shown before it is made.
pub(crate) struct Proposal {
    edit: Edit,
    /// How many points would turn.
    pub n_points: u64,
    /// The document that it is for.
    revision: u64,
}

/// The points that verbs are about: the selected ones that are shown.
pub(crate) fn chosen_points(document: &Document) -> PointSet {
    document.selected() - document.hidden()
}

/// How many points [`chosen_points`] has; O(n / 64) at most, less where few are selected or hidden.
pub(crate) fn n_chosen_points(document: &Document) -> u64 {
    document.selected().len() - document.selected().intersection_len(document.hidden())
}

fn all_points(document: &Document) -> PointSet {
    let mut all = PointSet::new();
    all.insert_range(0..document.cloud().n_points() as u32);
    all
}

fn n_pinned_of(document: &Document, points: &PointSet) -> u64 {
    let marks = document.marks();
    if marks.n_pinned() == 0 {
        return 0;
    }
    points.iter().filter(|&point| marks.is_pinned(point)).count() as u64
}

fn points_in_words(n_points: u64) -> String {
    theme::counted(n_points, "point", "points")
}

/// "; 12 pinned stayed", or nothing.
fn stayed(n_pinned: u64) -> String {
    match n_pinned {
        0 => String::new(),
        n_pinned => format!("; {} pinned stayed", theme::thousands(n_pinned)),
    }
}

impl App {
    /// Whether a command that is about selected points can be run now, and if not, why.
    pub(crate) fn availability_for_points(&self, command: Command) -> Result<(), &'static str> {
        let check = |holds: bool, reason| if holds { Ok(()) } else { Err(reason) };
        let document = self.document().ok_or("no scan is open")?;
        let oriented = || check(document.orientation().is_some(), "the scan is not oriented yet");
        let chosen = || check(n_chosen_points(document) > 0, "no point is selected");
        match command {
            Command::GrowSelection | Command::ShrinkSelection => oriented().and_then(|()| chosen()),
            Command::SelectNone => check(!document.selected().is_empty(), "no point is selected"),
            Command::SelectBacks | Command::SelectPatchHere | Command::SelectComponentHere => oriented(),
            Command::SelectPinned => check(document.marks().n_pinned() > 0, "no point is pinned"),
            Command::SelectUndecided => {
                oriented()?;
                let propagation = document.propagation();
                check(
                    propagation
                        .is_some_and(|propagation| propagation.patches.is_some() && propagation.evidence.is_some()),
                    "how sure points are is known only with Estimate and the preset Automatic",
                )
            }
            Command::HideSelected | Command::Isolate => chosen(),
            Command::ShowAll => check(!document.hidden().is_empty(), "nothing is hidden"),
            Command::Flip if n_chosen_points(document) == 0 => {
                let n_sources = self.session.as_ref().map_or(0, |session| session.selected.len());
                check(n_sources > 0, "no point and no source is selected")
            }
            Command::Flip | Command::SelectionFacesMe | Command::PropagateFrom | Command::PropagateInside => {
                oriented()?;
                chosen()
            }
            Command::Pin => oriented().and_then(|()| chosen()),
            Command::Unpin => {
                chosen()?;
                check(document.marks().n_pinned() > 0, "no point is pinned")
            }
            Command::WhatISeeFacesMe => oriented(),
            _ => Ok(()),
        }
    }

    /// Does what a command that is about selected points says.
    pub(crate) fn run_for_points(&mut self, command: Command) {
        let Some(document) = self.document() else { return };
        let (selected, hidden) = (document.selected(), document.hidden());
        match command {
            Command::SelectAll => self.apply_edit(Edit::Select(all_points(document) - hidden)),
            Command::SelectNone => self.apply_edit(Edit::Select(PointSet::new())),
            Command::InvertSelection => self.apply_edit(Edit::Select(all_points(document) - hidden - selected)),
            Command::SelectPinned => {
                let pinned = document.marks().iter().filter(|(_, mark)| mark.pinned);
                let pinned: PointSet = pinned.map(|(point, _)| point).collect();
                let n_pinned = pinned.len();
                self.apply_edit(Edit::Select(pinned - self.hidden_points()));
                self.messages.note(format!("{} pinned.", are(n_pinned)));
            }
            Command::GrowSelection => self.selecting.step(true),
            Command::ShrinkSelection => self.selecting.step(false),
            Command::SelectUndecided => {
                if let Some(session) = &self.session {
                    self.selecting.undecided(&self.ctx, &session.document);
                }
            }
            Command::SelectBacks => {
                if let Some(scene) = &self.scene {
                    self.selecting.backs(scene, &self.viewport);
                }
            }
            Command::HideSelected => self.apply_edit(Edit::Hide(hidden | selected)),
            Command::Isolate => {
                let others = all_points(document) - chosen_points(document);
                self.apply_edit(Edit::Hide(others));
            }
            Command::ShowAll => self.apply_edit(Edit::Hide(PointSet::new())),
            Command::VisibleOnly => self.visible_only = !self.visible_only,
            Command::Flip => self.flip(),
            Command::Pin => self.pin(),
            Command::Unpin => self.unpin(),
            Command::SelectionFacesMe => self.selection_faces_me(),
            Command::WhatISeeFacesMe => {
                if self.proposal.is_some() {
                    self.accept_proposal();
                } else if let Some(scene) = &self.scene {
                    self.selecting.seen(scene, &self.viewport);
                }
            }
            Command::PropagateFrom => {
                let points = chosen_points(document);
                let n_points = points.len();
                if let Some(change) = self.try_edit(Edit::PropagateFrom(points)) {
                    let given = points_in_words(n_points);
                    let turned = points_in_words(change.n_points());
                    self.messages
                        .note(format!("What hangs together with {given} follows: {turned} turned."));
                }
            }
            Command::PropagateInside => {
                let points = chosen_points(document);
                let n_pinned = n_pinned_of(document, &points);
                let n_points = points_in_words(points.len());
                if let Some(change) = self.try_edit(Edit::PropagateInside(points)) {
                    let turned = points_in_words(change.n_points());
                    self.messages.note(format!(
                        "{n_points} follow what is around them: {turned} turned{}.",
                        stayed(n_pinned)
                    ));
                }
            }
            command => {
                if let Some(tool) = Tool::ALL.into_iter().find(|tool| tool.command() == command) {
                    self.choose_tool(tool);
                }
            }
        }
    }

    fn hidden_points(&self) -> PointSet {
        self.document()
            .map(|document| document.hidden().clone())
            .unwrap_or_default()
    }

    fn choose_tool(&mut self, tool: Tool) {
        if tool != self.tool {
            self.painting.cancel();
            self.tool = tool;
        }
    }

    /// Applies an edit that may find nothing to do; says so then.
    fn try_edit(&mut self, edit: Edit) -> Option<Change> {
        let before = self.document()?.revision();
        let kind = edit.kind();
        let change = self.apply_edit_or_say(edit)?;
        if self.document()?.revision() == before {
            self.messages.note(format!("{}: nothing had to change.", kind.label()));
            return None;
        }
        Some(change)
    }

    fn flip(&mut self) {
        let Some(document) = self.document() else { return };
        let points = chosen_points(document);
        if points.is_empty() {
            self.run(Command::FlipSources);
            return;
        }
        let n_pinned = n_pinned_of(document, &points);
        let edit = Edit::FlipPoints {
            points,
            reason: FlipReason::Asked,
        };
        if let Some(change) = self.try_edit(edit) {
            let turned = points_in_words(change.n_points());
            self.messages.note(format!("Turned {turned}{}.", stayed(n_pinned)));
        }
    }

    fn pin(&mut self) {
        let Some(document) = self.document() else { return };
        let points = chosen_points(document);
        let n_new = points.len() - n_pinned_of(document, &points);
        if self.try_edit(Edit::Pin(points)).is_some() {
            let pinned = points_in_words(n_new);
            self.messages
                .note(format!("Pinned {pinned}: nothing turns them until you unpin them."));
        }
    }

    fn unpin(&mut self) {
        let Some(document) = self.document() else { return };
        let points = chosen_points(document);
        let n_pinned = n_pinned_of(document, &points);
        if self.try_edit(Edit::Unpin(points)).is_some() {
            self.messages.note(format!("Unpinned {}.", points_in_words(n_pinned)));
        }
    }

    fn selection_faces_me(&mut self) {
        let Some(document) = self.document() else { return };
        let points = chosen_points(document);
        match document.facing_away(&points, self.viewport.viewer()) {
            Ok(away) if away.is_empty() => {
                let n_points = points_in_words(points.len());
                self.messages
                    .note(format!("Nothing turned: {n_points} face you already."));
            }
            Ok(away) => {
                let n_pinned = n_pinned_of(document, &away);
                let edit = Edit::FlipPoints {
                    points: away,
                    reason: FlipReason::FaceMe,
                };
                if let Some(change) = self.try_edit(edit) {
                    let turned = points_in_words(change.n_points());
                    self.messages
                        .note(format!("Turned {turned} so that they face you{}.", stayed(n_pinned)));
                }
            }
            Err(error) => self.refuse(&error),
        }
    }

    /// Says that an edit cannot be made.
    pub(crate) fn refuse(&mut self, error: &EditError) {
        self.messages.note(format!("Nothing changed: {error}."));
    }

    /// Takes what became of the wishes for points.
    pub(crate) fn take_answers(&mut self) {
        while let (Some(scene), Some(session)) = (&self.scene, &self.session) {
            let answer = self.selecting.poll(&self.ctx, scene, &self.viewport, &session.document);
            match answer {
                None => break,
                Some(Answer::Select { points, combine }) => self.select_points(points, combine),
                Some(Answer::Backs(points)) => {
                    let n_points = points.len();
                    self.select_points(points, crate::tools::Combine::Replace);
                    self.messages.note(format!("{} seen from the back.", are(n_points)));
                }
                Some(Answer::Seen { points, viewer }) => self.propose_seen(&points, viewer),
                Some(Answer::Failed(reason)) => self.messages.note(reason),
            }
        }
        if self.selecting.is_busy() {
            self.ctx.request_repaint();
        }
        let revision = self.document().map(Document::revision);
        if self
            .proposal
            .as_ref()
            .is_some_and(|proposal| Some(proposal.revision) != revision)
        {
            self.drop_proposal();
        }
    }

    /// Selects points, hidden ones left out.
    pub(crate) fn select_points(&mut self, points: PointSet, combine: crate::tools::Combine) {
        let Some(document) = self.document() else { return };
        let selected = combine.apply(document.selected(), points - document.hidden());
        self.apply_edit(Edit::Select(selected));
    }

    fn propose_seen(&mut self, visible: &PointSet, viewer: Viewer) {
        let Some(document) = self.document() else { return };
        let proposed = document
            .seen(visible, viewer)
            .and_then(|edit| edit.map(|edit| Ok((document.preview(&edit)?, edit))).transpose());
        let revision = document.revision();
        match proposed {
            Ok(Some((change, edit))) if !change.is_empty() => {
                let n_points = change.n_points();
                if let Some(scene) = &mut self.scene {
                    scene.outline(Some(change));
                }
                self.proposal = Some(Proposal {
                    edit,
                    n_points,
                    revision,
                });
            }
            Ok(_) => {
                let n_points = points_in_words(visible.len());
                self.messages.note(format!(
                    "Nothing to turn: what you see ({n_points}) faces you already, or no patch of it clearly does not."
                ));
            }
            Err(error) => self.refuse(&error),
        }
    }

    /// Makes the edit that is shown.
    pub(crate) fn accept_proposal(&mut self) {
        if let Some(Proposal { edit, .. }) = self.drop_proposal()
            && let Some(change) = self.try_edit(edit)
        {
            let turned = points_in_words(change.n_points());
            self.messages.note(format!("Turned {turned} so that they face you."));
        }
    }

    /// Leaves what is shown as it is; returns it.
    pub(crate) fn drop_proposal(&mut self) -> Option<Proposal> {
        let proposal = self.proposal.take()?;
        if let Some(scene) = &mut self.scene {
            scene.outline(None);
        }
        Some(proposal)
    }

    /// Gives a command another meaning while something is under way: a proposal that waits for an answer, or a polygon. `true` when
    /// it did.
    pub(crate) fn take_for_what_is_under_way(&mut self, command: Command) -> bool {
        match command {
            Command::MendHere if self.proposal.is_some() => self.accept_proposal(),
            Command::Cancel if self.windows.modal.is_none() && self.drop_proposal_or_figure() => {}
            Command::MendHere if self.painting.has_corners() => {
                let stroke = self.painting.close(&self.viewport.view_place());
                if stroke.is_none() {
                    self.messages.note("A polygon needs three corners.");
                }
                stroke.into_iter().for_each(|stroke| self.take_stroke(stroke));
            }
            Command::RemoveSources if self.painting.has_corners() => {
                self.painting.take_corner_back();
            }
            Command::LargerPatch if self.tool == Tool::Brush => self.scale_brush(BRUSH_STEP),
            Command::SmallerPatch if self.tool == Tool::Brush => self.scale_brush(BRUSH_STEP.recip()),
            _ => return false,
        }
        true
    }

    /// Forgets what is about the present points of the picture, as when others come.
    pub(crate) fn forget_what_is_under_way(&mut self) {
        self.proposal = None;
        self.painting.cancel();
        self.selecting.reset();
        if let Some(scene) = &mut self.scene {
            self.point_tool.reset(scene);
        }
    }

    /// Escape with nothing else to leave: deselects sources, or else points.
    pub(crate) fn deselect_first(&mut self) {
        let has_sources = self
            .session
            .as_ref()
            .is_some_and(|session| !session.selected.is_empty());
        let has_points = self.document().is_some_and(|document| !document.selected().is_empty());
        if has_points && !has_sources {
            self.apply_edit(Edit::Select(PointSet::new()));
        } else {
            self.deselect();
        }
    }

    fn drop_proposal_or_figure(&mut self) -> bool {
        self.drop_proposal().is_some() || self.painting.cancel()
    }

    pub(crate) fn take_stroke(&mut self, stroke: crate::tools::painting::Stroke) {
        if let (Some(scene), Some(session)) = (&self.scene, &self.session) {
            let through = !self.visible_only;
            self.selecting
                .stroke(&self.ctx, scene, &self.viewport, &session.document, stroke, through);
        }
    }

    fn scale_brush(&mut self, factor: f32) {
        self.brush_radius = (self.brush_radius * factor).clamp(*BRUSH_RADII.start(), *BRUSH_RADII.end());
    }

    /// Sizes the brush by what the wheel turned with Alt, in points.
    pub(crate) fn size_brush(&mut self, scrolled: f32) {
        if self.tool == Tool::Brush && scrolled != 0.0 {
            self.scale_brush((scrolled / SCROLL_PER_BRUSH).exp());
        }
    }
}

/// "1 point is", "12 points are".
fn are(n_points: u64) -> String {
    let verb = if n_points == 1 { "is" } else { "are" };
    format!("{} {verb}", points_in_words(n_points))
}
