//! The viewpoints that vote: shown in the view as small cameras, moved by dragging, added where the user looks from.
//!
//! Ground is the document's list, empty for the usual ones; the first change of a usual one makes all of them the user's.
//! Invariant: a drag is one edit, made when it ends.

use std::sync::Arc;

use egui::{Color32, CursorIcon, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, Vec2};
use glam::Vec3;
use normend_core::propagation::VIEWS;
use normend_core::{Document, Edit, visibility};

use crate::app::App;
use crate::command::Action;
use crate::panels::side::SideTab;
use crate::theme;
use crate::viewport::Viewport;

/// Most viewpoints: as many as there are usual ones.
pub const MOST: usize = *VIEWS.end();
/// Side of the square around a mark that takes the pointer, in points.
const REACH: f32 = 22.0;

/// What a user asks for about viewpoints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ViewpointAction {
    /// Select one, or none.
    Select(Option<usize>),
    /// Add one where the camera is.
    AddHere,
    /// Remove one.
    Remove(usize),
    /// The usual ones again.
    Reset,
    /// Bring all and the scan into view.
    ShowAll,
    /// Make what was moved an edit.
    Commit,
}

impl From<ViewpointAction> for Action {
    fn from(action: ViewpointAction) -> Self {
        Self::Viewpoints(action)
    }
}

/// The list while it is edited.
#[derive(Clone, Debug, Default)]
pub struct Viewpoints {
    /// What is moved and not let go yet.
    draft: Option<Vec<Vec3>>,
    /// The selected one.
    pub selected: Option<usize>,
}

impl Viewpoints {
    /// The places in the cloud's own space: moved ones where they are now, else the user's, else the usual ones.
    pub fn places(&self, document: &Document) -> Vec<Vec3> {
        if let Some(draft) = &self.draft {
            return draft.clone();
        }
        match &*document.state().viewpoints {
            [] => usual(document),
            own => own.to_vec(),
        }
    }

    /// Moves one, until [`Self::take_moved`].
    pub fn move_to(&mut self, document: &Document, index: usize, place: Vec3) {
        let mut places = self.places(document);
        if let Some(moved) = places.get_mut(index).filter(|_| place.is_finite()) {
            *moved = place;
            self.draft = Some(places);
        }
    }

    /// The edit that makes what was moved the document's; `None` where nothing was.
    pub fn take_moved(&mut self) -> Option<Edit> {
        self.draft.take().map(|places| Edit::SetViewpoints(places.into()))
    }

    /// Forgets what was moved.
    pub fn forget(&mut self) {
        self.draft = None;
    }

    /// Whether viewpoints vote in the propagation in force.
    pub fn are_asked(document: &Document) -> bool {
        document
            .propagation()
            .is_some_and(|propagation| propagation.votes.is_some())
    }
}

fn usual(document: &Document) -> Vec<Vec3> {
    let parameters = document.parameters();
    let places = visibility::viewpoints(document.cloud(), parameters.sources, parameters.views);
    places.into_iter().map(|place| place.as_vec3()).collect()
}

impl App {
    /// Does what is asked for about viewpoints.
    pub(crate) fn act_on_viewpoints(&mut self, action: ViewpointAction) {
        let Some(session) = &mut self.session else { return };
        let viewpoints = &mut session.viewpoints;
        let mut places = viewpoints.places(&session.document);
        let edit = match action {
            ViewpointAction::Select(index) => {
                viewpoints.selected = index;
                None
            }
            ViewpointAction::AddHere if places.len() < MOST => {
                viewpoints.selected = Some(places.len());
                places.push(self.viewport.camera().eye());
                Some(Edit::SetViewpoints(places.into()))
            }
            ViewpointAction::AddHere => {
                self.messages
                    .note(format!("There are {MOST} viewpoints already; remove one first."));
                None
            }
            ViewpointAction::Remove(index) if places.len() > 1 && index < places.len() => {
                places.remove(index);
                viewpoints.selected = None;
                Some(Edit::SetViewpoints(places.into()))
            }
            ViewpointAction::Remove(_) => None,
            ViewpointAction::Reset => {
                viewpoints.forget();
                viewpoints.selected = None;
                Some(Edit::SetViewpoints(Arc::default()))
            }
            ViewpointAction::ShowAll => {
                let (min, max) = session.document.cloud().bounding_box();
                places.extend([min, max]);
                self.viewport.frame_points(places);
                None
            }
            ViewpointAction::Commit => viewpoints.take_moved(),
        };
        if let Some(edit) = edit {
            self.apply_edit(edit);
        }
    }

    /// The marks over the picture, while the tab Sources is open: what votes, and where the scan was found to be taken from.
    pub(crate) fn viewpoint_marks(&mut self, ui: &Ui) -> Option<Action> {
        if self.settings.settings.side_tab != SideTab::Sources {
            return None;
        }
        let session = self.session.as_mut()?;
        let document = &session.document;
        let (min, max) = document.cloud().bounding_box();
        let center = 0.5 * (min + max);
        let painter = ui.painter_at(self.viewport.rect);
        let station = document.propagation().and_then(|propagation| propagation.found_station);
        let is_shown = session.kinds.is_shown(crate::source_kinds::SourceKind::Scanner);
        if let Some(place) = station.filter(|_| is_shown) {
            let place = place.position.as_vec3();
            if let Some(at) = in_view(&self.viewport, place) {
                camera_mark(
                    &painter,
                    at,
                    toward(&self.viewport, at, center),
                    theme::accent(ui),
                    false,
                );
                crate::scanner_view::named(ui, &painter, at, "Scanner");
            }
        }
        if !Viewpoints::are_asked(document) {
            return None;
        }
        let mut action = None;
        for (index, place) in session.viewpoints.places(document).into_iter().enumerate() {
            let Some(at) = in_view(&self.viewport, place) else {
                continue;
            };
            let label = format!("Viewpoint {}", index + 1);
            let id = ui.scope_id().with(("viewpoint", index));
            let rect = Rect::from_center_size(at, Vec2::splat(REACH));
            let response = ui.interact(rect, id, Sense::click_and_drag());
            response.widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::Button, true, &label));
            if response.clicked() || response.drag_started() {
                action = Some(ViewpointAction::Select(Some(index)).into());
            }
            if response.dragged() {
                let delta = response.drag_delta() * ui.pixels_per_point();
                let moved = moved(&self.viewport, place, glam::Vec2::new(delta.x, delta.y));
                session.viewpoints.move_to(document, index, moved);
                ui.set_cursor_icon(CursorIcon::Grabbing);
            }
            if response.drag_stopped() {
                action = Some(ViewpointAction::Commit.into());
            }
            let is_selected = session.viewpoints.selected == Some(index);
            let color = if is_selected {
                theme::accent(ui)
            } else {
                Color32::from_gray(200)
            };
            camera_mark(
                &painter,
                at,
                toward(&self.viewport, at, center),
                color,
                is_selected || response.hovered(),
            );
            response.on_hover_text(format!("{label}: drag it, or set its place in the panel"));
        }
        action
    }
}

/// The place in the window of a world point; `None` out of the view.
pub(crate) fn in_view(viewport: &Viewport, place: Vec3) -> Option<Pos2> {
    viewport
        .place(place)
        .filter(|&at| viewport.rect.shrink(4.0).contains(at))
}

/// The direction in the window from a mark to a world point, unit length or none.
pub(crate) fn toward(viewport: &Viewport, from: Pos2, to: Vec3) -> Vec2 {
    viewport.place(to).map_or(Vec2::ZERO, |to| (to - from).normalized())
}

/// A world point moved by so many pixels, in its plane parallel to the screen.
fn moved(viewport: &Viewport, place: Vec3, pixels: glam::Vec2) -> Vec3 {
    let (camera, size) = (viewport.camera(), viewport.size_in_pixels());
    let Some(pixel) = camera.project(place, size) else {
        return place;
    };
    let back = camera.back();
    let at_depth = |pixel: glam::Vec2| {
        let (from, ray) = camera.ray(pixel, size);
        let along = (place - from).dot(back) / ray.dot(back);
        from + ray * along
    };
    // The difference of two places, so that rounding does not move what the pointer does not.
    place + (at_depth(pixel + pixels) - at_depth(pixel))
}

/// A small camera that looks in a direction of the window.
pub(crate) fn camera_mark(painter: &egui::Painter, at: Pos2, direction: Vec2, color: Color32, strong: bool) {
    let halo = Color32::from_black_alpha(170);
    let lens = [at + direction * 7.0, at + direction * 14.0];
    painter.line_segment(lens, Stroke::new(5.0, halo));
    painter.line_segment(lens, Stroke::new(2.5, color));
    let body = Rect::from_center_size(at, Vec2::new(14.0, 11.0));
    painter.rect(body.expand(1.5), 4.0, halo, Stroke::NONE, StrokeKind::Inside);
    painter.rect(body, 3.0, color, Stroke::NONE, StrokeKind::Inside);
    painter.circle_filled(at, 3.0, halo);
    if strong {
        painter.rect_stroke(body.expand(4.0), 5.0, Stroke::new(1.5, color), StrokeKind::Inside);
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use normend_core::PointCloud;

    use super::*;

    fn document() -> Document {
        let positions = vec![Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)];
        Document::new(Arc::new(PointCloud::new(DVec3::ZERO, positions).unwrap()), None)
    }

    #[test]
    fn the_first_move_makes_the_usual_ones_the_users() {
        let mut document = document();
        let mut viewpoints = Viewpoints::default();
        let usual = viewpoints.places(&document);
        assert_eq!(usual.len(), 8);
        viewpoints.move_to(&document, 2, Vec3::splat(7.0));
        viewpoints.move_to(&document, 2, Vec3::splat(8.0));
        viewpoints.move_to(&document, 99, Vec3::ZERO);
        viewpoints.move_to(&document, 1, Vec3::NAN);
        assert!(
            document.state().viewpoints.is_empty(),
            "nothing is applied before it is let go"
        );
        document.apply(viewpoints.take_moved().unwrap()).unwrap();
        assert_eq!(document.steps().count(), 1);
        let places = viewpoints.places(&document);
        assert_eq!(places[2], Vec3::splat(8.0));
        assert_eq!((places.len(), places[0]), (8, usual[0]));
        assert_eq!(viewpoints.take_moved(), None);
        document.undo();
        assert_eq!(viewpoints.places(&document), usual);
    }

    #[test]
    fn a_drag_moves_parallel_to_the_screen_under_the_pointer() {
        let viewport = Viewport::new();
        let (camera, size) = (*viewport.camera(), viewport.size_in_pixels());
        let place = camera.pivot + 0.1 * camera.right();
        let to = moved(&viewport, place, glam::Vec2::new(0.2, -0.1));
        assert!((to - place).dot(camera.back()).abs() < 1e-4);
        let expect = camera.project(place, size).unwrap() + glam::Vec2::new(0.2, -0.1);
        assert!(camera.project(to, size).unwrap().distance(expect) < 1e-3);
    }
}
