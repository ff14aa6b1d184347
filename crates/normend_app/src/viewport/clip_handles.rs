//! The clip box in the view: its edges, and a handle on each face that drags the face along its axis.

use egui::{Color32, EventFilter, Key, Modifiers, Pos2, Rect, Sense, Stroke, Ui, Vec2};
use glam::Vec3;

use super::overlay::{HALO, LINE};
use super::{SceneBounds, Viewport};
use crate::theme;

/// Radius of a handle, in points.
const RADIUS: f32 = 7.0;
/// Side of the square around a handle that takes the pointer, in points.
const REACH: f32 = 22.0;
/// A new box is so much larger than the scan on each side, as a part of the diagonal: it cuts nothing.
const ROOM: f32 = 0.01;
/// Two faces stay this far apart, as a part of the scan's diagonal.
const THINNEST: f32 = 1e-4;
/// A face moves by this part of the scan's diagonal with a key.
const KEY_STEP: f32 = 0.01;
/// Along an axis that the view looks along (cosine) a face cannot be dragged: it would move toward the eye.
const HEAD_ON: f32 = 0.985;

/// One of the six faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Face {
    /// 0, 1, 2 for x, y, z.
    axis: usize,
    is_high: bool,
}

impl Face {
    const ALL: [Self; 6] = [
        Self::new(0, false),
        Self::new(0, true),
        Self::new(1, false),
        Self::new(1, true),
        Self::new(2, false),
        Self::new(2, true),
    ];

    const fn new(axis: usize, is_high: bool) -> Self {
        Self { axis, is_high }
    }

    fn label(self) -> &'static str {
        match (self.axis, self.is_high) {
            (0, false) => "Clip box, low x",
            (0, true) => "Clip box, high x",
            (1, false) => "Clip box, low y",
            (1, true) => "Clip box, high y",
            (_, false) => "Clip box, low z",
            (_, true) => "Clip box, high z",
        }
    }

    fn direction(self) -> Vec3 {
        Vec3::AXES[self.axis]
    }

    fn center([min, max]: [Vec3; 2]) -> Vec3 {
        min + 0.5 * (max - min)
    }

    /// Its coordinate along its axis.
    fn value(self, bounds: [Vec3; 2]) -> f32 {
        bounds[usize::from(self.is_high)][self.axis]
    }

    /// The middle of the face.
    fn place(self, bounds: [Vec3; 2]) -> Vec3 {
        let mut place = Self::center(bounds);
        place[self.axis] = self.value(bounds);
        place
    }

    /// The box with this face at `value`, kept inside `outer` and before the opposite face.
    fn moved(self, mut bounds: [Vec3; 2], value: f32, outer: [Vec3; 2], thinnest: f32) -> [Vec3; 2] {
        if !value.is_finite() {
            return bounds;
        }
        let axis = self.axis;
        let opposite = bounds[usize::from(!self.is_high)][axis];
        bounds[usize::from(self.is_high)][axis] = if self.is_high {
            value.min(outer[1][axis]).max(opposite + thinnest)
        } else {
            value.max(outer[0][axis]).min(opposite - thinnest)
        };
        bounds
    }
}

/// A face is being dragged.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaceDrag {
    face: Face,
    before: [Vec3; 2],
    /// From where the pointer took it to the face, along the axis, in world length.
    grip: f32,
}

impl FaceDrag {
    /// The box as it was when the drag began.
    pub(super) fn before(&self) -> [Vec3; 2] {
        self.before
    }
}

impl SceneBounds {
    /// The largest clip box: around the whole scan with some room, so that it cuts nothing.
    fn outer_box(&self) -> [Vec3; 2] {
        let room = Vec3::splat(ROOM * 2.0 * self.radius());
        [self.min - room, self.max + room]
    }

    fn thinnest(&self) -> f32 {
        THINNEST * 2.0 * self.radius()
    }
}

impl Viewport {
    /// Shows a clip box around the whole scan, or takes the present one away.
    pub fn toggle_clip_box(&mut self) {
        self.face_drag = None;
        self.clip.bounds = match self.clip.bounds {
            Some(_) => None,
            None => Some(self.bounds.outer_box()),
        };
    }

    /// Takes the handles' widgets and moves the faces.
    pub(super) fn clip_handles(&mut self, ui: &Ui) {
        let Some(mut bounds) = self.clip.bounds else {
            self.face_drag = None;
            return;
        };
        for face in self.faces_by_depth(bounds) {
            let Some(place) = self.handle_place(face, bounds) else {
                continue;
            };
            let id = ui.scope_id().with(face.label());
            let response = ui.interact(
                Rect::from_center_size(place, Vec2::splat(REACH)),
                id,
                Sense::click_and_drag(),
            );
            let value = f64::from(face.value(bounds)) + self.bounds.origin[face.axis];
            response.widget_info(|| egui::WidgetInfo::slider(true, value, face.label()));
            if response.drag_started() {
                self.face_drag = self
                    .pointer_along(face, bounds, response.interact_pointer_pos())
                    .map(|along| FaceDrag {
                        face,
                        before: bounds,
                        grip: face.value(bounds) - along,
                    });
            }
            let drag = self.face_drag.filter(|drag| drag.face == face);
            if let (Some(drag), true) = (drag, response.dragged()) {
                if let Some(along) = self.pointer_along(face, drag.before, response.interact_pointer_pos()) {
                    bounds = face.moved(
                        bounds,
                        along + drag.grip,
                        self.bounds.outer_box(),
                        self.bounds.thinnest(),
                    );
                }
                ui.set_cursor_icon(egui::CursorIcon::Grabbing);
            }
            if response.drag_stopped() {
                self.face_drag = None;
            }
            bounds = self.keys(ui, &response, face, bounds);
            response.on_hover_text(format!("{}: drag it, or use the arrow keys", face.label()));
        }
        self.clip.bounds = Some(bounds);
    }

    /// Left and down lower the face that has the keyboard, right and up raise it.
    fn keys(&self, ui: &Ui, response: &egui::Response, face: Face, bounds: [Vec3; 2]) -> [Vec3; 2] {
        if !response.has_focus() {
            return bounds;
        }
        // Else the arrows would go to the next widget.
        let arrows = EventFilter {
            horizontal_arrows: true,
            vertical_arrows: true,
            ..EventFilter::default()
        };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, arrows));
        let steps = ui.input_mut(|input| {
            let mut n_times = |key| input.count_and_consume_key(Modifiers::NONE, key) as f32;
            n_times(Key::ArrowRight) + n_times(Key::ArrowUp) - n_times(Key::ArrowLeft) - n_times(Key::ArrowDown)
        });
        if steps == 0.0 {
            return bounds;
        }
        let value = face.value(bounds) + steps * KEY_STEP * 2.0 * self.bounds.radius();
        face.moved(bounds, value, self.bounds.outer_box(), self.bounds.thinnest())
    }

    /// The farthest first.
    fn faces_by_depth(&self, bounds: [Vec3; 2]) -> [Face; 6] {
        let back = self.camera.back();
        let mut faces = Face::ALL;
        // The face that is dragged stays above the others.
        let is_dragged = |face| self.face_drag.is_some_and(|drag| drag.face == face);
        faces.sort_by(|a, b| {
            let nearness = |face: Face| face.place(bounds).dot(back);
            is_dragged(*a)
                .cmp(&is_dragged(*b))
                .then(nearness(*a).total_cmp(&nearness(*b)))
        });
        faces
    }

    /// Where a handle is shown; `None` when it is out of the view, or the view looks along its axis.
    fn handle_place(&self, face: Face, bounds: [Vec3; 2]) -> Option<Pos2> {
        let place = self
            .place(face.place(bounds))
            .filter(|&place| self.rect.contains(place))?;
        let (_, ray) = self.ray(place);
        let is_dragged = self.face_drag.is_some_and(|drag| drag.face == face);
        (is_dragged || ray.dot(face.direction()).abs() < HEAD_ON).then_some(place)
    }

    /// The eye's ray through a place in the window: where it begins, and its direction of unit length.
    fn ray(&self, place: Pos2) -> (Vec3, Vec3) {
        let pixel = (place - self.rect.min) * self.pixels_per_point;
        self.camera
            .ray(glam::Vec2::new(pixel.x, pixel.y), self.size_in_pixels())
    }

    /// The coordinate on the axis through the face's middle that is nearest to the pointer's ray.
    fn pointer_along(&self, face: Face, bounds: [Vec3; 2], pointer: Option<Pos2>) -> Option<f32> {
        let (from, ray) = self.ray(pointer?);
        let (place, axis) = (face.place(bounds), face.direction());
        let cos = ray.dot(axis);
        let across = 1.0 - cos * cos;
        if across < 1.0 - HEAD_ON * HEAD_ON {
            return None;
        }
        let between = from - place;
        let along = (between.dot(axis) - cos * between.dot(ray)) / across;
        let value = face.value(bounds) + along;
        value.is_finite().then_some(value)
    }

    /// Paints the edges and the handles.
    pub(super) fn draw_clip_box(&self, ui: &Ui) {
        let Some(bounds) = self.clip.bounds else { return };
        let painter = ui.painter_at(self.rect);
        let corner = |bits: usize| Vec3::from_array([0, 1, 2].map(|axis| bounds[bits >> axis & 1][axis]));
        let is_lit = |face: Face| {
            let response = ui.ctx().read_response(ui.scope_id().with(face.label()));
            response.is_some_and(|response| response.hovered() || response.dragged() || response.has_focus())
        };
        let lit = Face::ALL.into_iter().find(|&face| is_lit(face));
        for bits in 0..8 {
            for axis in [0, 1, 2].into_iter().filter(|axis| bits >> axis & 1 == 0) {
                let Some(ends) = self.segment(corner(bits), corner(bits | 1 << axis)) else {
                    continue;
                };
                // The face that a handle moves is framed, so that nobody has to guess it.
                let is_of_lit =
                    lit.is_some_and(|face| face.axis != axis && (bits >> face.axis & 1 == 1) == face.is_high);
                let (width, color) = if is_of_lit {
                    (2.5, theme::accent(ui))
                } else {
                    (1.0, Color32::from_white_alpha(190))
                };
                painter.line_segment(ends, Stroke::new(width + 1.5, Color32::from_black_alpha(90)));
                painter.line_segment(ends, Stroke::new(width, color));
            }
        }
        for face in self.faces_by_depth(bounds) {
            let Some(place) = self.handle_place(face, bounds) else {
                continue;
            };
            let radius = if lit == Some(face) { RADIUS + 2.0 } else { RADIUS };
            painter.circle_filled(place, radius + 1.5, HALO);
            painter.circle_filled(place, radius, if lit == Some(face) { Color32::WHITE } else { LINE });
            painter.circle_filled(place, 0.5 * radius, ui.visuals().selection.bg_fill);
        }
        if let Some(drag) = self.face_drag
            && let Some(place) = self.handle_place(drag.face, bounds)
        {
            let axis = drag.face.axis;
            let value = f64::from(drag.face.value(bounds)) + self.bounds.origin[axis];
            // Digits down to a ten-thousandth of the scan.
            let digits = (4.0 - (2.0 * self.bounds.radius()).log10().floor()).clamp(0.0, 12.0) as usize;
            self.badge(ui, place, "", &format!("{} = {value:.digits$}", ["x", "y", "z"][axis]));
        }
    }

    /// The ends in the window of what is before the eye of a line in the world.
    fn segment(&self, a: Vec3, b: Vec3) -> Option<[Pos2; 2]> {
        let (eye, back) = (self.camera.eye(), self.camera.back());
        let depth = |point: Vec3| (eye - point).dot(back);
        let nearest = 1e-3 * self.camera.distance;
        let (depth_a, depth_b) = (depth(a), depth(b));
        let is_parallel = self.camera.projection == normend_render::Projection::Orthographic;
        if is_parallel || depth_a.min(depth_b) >= nearest {
            return Some([self.place(a)?, self.place(b)?]);
        }
        if depth_a.max(depth_b) <= nearest {
            return None;
        }
        let cut = a.lerp(b, (nearest - depth_a) / (depth_b - depth_a));
        let seen = if depth_a > depth_b { a } else { b };
        Some([self.place(seen)?, self.place(cut)?])
    }
}

#[cfg(test)]
mod tests {
    use normend_render::{StandardView, UpAxis};
    use proptest::prelude::*;

    use super::*;

    const OUTER: [Vec3; 2] = [Vec3::splat(-2.0), Vec3::splat(2.0)];

    fn viewport(scale: f32) -> Viewport {
        let mut viewport = Viewport::new();
        viewport.bounds.min = Vec3::splat(-scale);
        viewport.bounds.max = Vec3::splat(scale);
        viewport.rect = Rect::from_min_size(Pos2::new(10.0, 20.0), Vec2::new(800.0, 600.0));
        viewport.size = [1600, 1200];
        viewport.pixels_per_point = 2.0;
        viewport.camera = normend_render::Camera::new(StandardView::Corner, UpAxis::ZUp);
        viewport
            .camera
            .frame(Vec3::splat(-scale), Vec3::splat(scale), 4.0 / 3.0);
        viewport
    }

    #[test]
    fn a_face_stops_at_the_scan_and_before_its_opposite() {
        let bounds = [Vec3::splat(-1.0), Vec3::splat(1.0)];
        for face in Face::ALL {
            for value in [-9.0, -1.5, 0.0, 1.5, 9.0] {
                let [min, max] = face.moved(bounds, value, OUTER, 0.1);
                assert!((max - min).min_element() > 0.099, "{face:?} {value}");
                assert!(
                    min.cmpge(OUTER[0]).all() && max.cmple(OUTER[1]).all(),
                    "{face:?} {value}"
                );
            }
            assert_eq!(face.moved(bounds, f32::NAN, OUTER, 0.1), bounds);
            assert!((face.value(face.moved(bounds, 0.25, OUTER, 0.1)) - 0.25).abs() < 1e-6);
        }
    }

    #[test]
    fn labels_are_different_and_places_lie_on_the_faces() {
        let labels: std::collections::BTreeSet<_> = Face::ALL.iter().map(|face| face.label()).collect();
        assert_eq!(labels.len(), 6);
        let bounds = [Vec3::ZERO, Vec3::new(2.0, 4.0, 6.0)];
        assert_eq!(Face::new(1, true).place(bounds), Vec3::new(1.0, 4.0, 3.0));
        assert_eq!(Face::new(2, false).place(bounds), Vec3::new(1.0, 2.0, 0.0));
    }

    #[test]
    fn a_new_box_holds_the_scan_and_goes_when_it_is_asked_for_again() {
        let mut viewport = viewport(1.0);
        viewport.toggle_clip_box();
        let [min, max] = viewport.clip.bounds.unwrap();
        assert!(min.cmplt(Vec3::splat(-1.0)).all() && max.cmpgt(Vec3::splat(1.0)).all());
        viewport.toggle_clip_box();
        assert_eq!(viewport.clip.bounds, None);
    }

    proptest! {
        /// The face follows the pointer, from a millionth to ten million units.
        #[test]
        fn the_pointers_place_on_the_axis_is_found(exponent in -6_i32..=7, index in 0..6_usize, value in -0.8_f32..0.8) {
            let scale = 10.0_f32.powi(exponent);
            let viewport = viewport(scale);
            let bounds = [Vec3::splat(-scale), Vec3::splat(scale)];
            let face = Face::ALL[index];
            let mut there = face.place(bounds);
            there[face.axis] = value * scale;
            let pointer = viewport.place(there).unwrap();
            let along = viewport.pointer_along(face, bounds, Some(pointer)).unwrap();
            prop_assert!((along - value * scale).abs() < 2e-3 * scale, "{along} from {}", value * scale);
        }

        #[test]
        fn lines_through_the_eyes_plane_are_cut_there(
            from in prop::array::uniform3(-9.0_f32..9.0), to in prop::array::uniform3(-9.0_f32..9.0)
        ) {
            let viewport = viewport(1.0);
            let (from, to) = (Vec3::from_array(from), Vec3::from_array(to));
            let depth = |point: Vec3| (viewport.camera.eye() - point).dot(viewport.camera.back());
            let segment = viewport.segment(from, to);
            let is_before_the_eye = depth(from).max(depth(to)) > 1e-3 * viewport.camera.distance;
            prop_assert_eq!(segment.is_some(), is_before_the_eye);
            prop_assert!(segment.is_none_or(|ends| ends.iter().all(|end| end.is_finite())));
        }
    }
}
