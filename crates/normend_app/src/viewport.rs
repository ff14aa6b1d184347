//! The 3D view: pointer and camera, the picture, and the marks drawn over it.

use egui::{Align2, Color32, FontId, Modifiers, PointerButton, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, Vec2};
use glam::Vec3;
use normend_core::PointCloud;
use normend_render::{Camera, DrawSettings, Projection, StandardView};

use crate::pace::Pace;
use crate::scene_sync::Scene;

/// A pixel of the view, physical, from its top left corner.
pub type Pixel = [u32; 2];

/// Points that framing looks at.
const FRAMED_POINTS: usize = 1 << 18;

/// The camera and how the user moves it.
#[derive(Clone, Debug)]
pub struct Viewport {
    /// Where the view is seen from.
    pub camera: Camera,
    /// Where the view is in the window, in points.
    pub rect: Rect,
    size: [u32; 2],
    pixels_per_point: f32,
    id: Option<egui::Id>,
    /// The point that zooming keeps in place, for as long as the pointer rests.
    zoom_anchor: Option<(Pos2, Vec3)>,
    pace: Pace,
    /// How far the present drag has come, in points.
    dragged: Vec2,
    hold: Option<Hold>,
    /// The wheel was turned while the button was held, and egui still smooths that out: it is no zooming.
    is_wheel_settling: bool,
}

/// The main button is held down in the view, and the pointer rests.
#[derive(Clone, Copy, Debug)]
struct Hold {
    pixel: Pixel,
    position: Pos2,
    /// The wheel was turned meanwhile, so the release is a click, however late.
    is_choosing: bool,
    /// What the wheel turned and was not given out yet, in notches.
    notches: f32,
}

/// How much a touchpad scrolls for one notch of a wheel, in points: about a line of text and a half, so that a swipe is a
/// few notches.
const POINTS_PER_NOTCH: f32 = 24.0;

/// What the pointer did in the view this frame.
#[derive(Clone, Debug, Default)]
pub struct PointerOnView {
    /// The pixel under the resting pointer; `None` outside, while a button moves the camera, or while the camera moves.
    pub hovered: Option<Pixel>,
    /// Where the pointer is, in points.
    pub position: Option<Pos2>,
    /// A click with the main button.
    pub clicked: Option<Pixel>,
    /// The modifier keys that are held.
    pub modifiers: Modifiers,
    /// Notches that the wheel was turned while the main button was held, away from the user positive.
    pub steps: i32,
    /// A double-click or a middle click: the pivot goes there.
    pub pivot: Option<Pixel>,
    /// The pivot was asked for by a double-click, whose first click counted as a click.
    pub by_double_click: bool,
}

impl Viewport {
    /// Looks at an empty scene.
    pub fn new() -> Self {
        Self {
            camera: Camera::framing(Vec3::splat(-1.0), Vec3::splat(1.0), StandardView::Corner, 1.0),
            rect: Rect::ZERO,
            size: [1, 1],
            pixels_per_point: 1.0,
            id: None,
            zoom_anchor: None,
            pace: Pace::new(),
            dragged: Vec2::ZERO,
            hold: None,
            is_wheel_settling: false,
        }
    }

    /// Looks at the whole of a new scan from the corner.
    pub fn look_at(&mut self, cloud: &PointCloud) {
        let (min, max) = cloud.bounding_box();
        let projection = self.camera.projection;
        self.camera = Camera::framing(min, max, StandardView::Corner, self.aspect());
        self.camera.projection = projection;
        self.zoom_anchor = None;
        self.frame_all(cloud);
    }

    /// Shows the whole scan from the present direction.
    pub fn frame_all(&mut self, cloud: &PointCloud) {
        // A part of very many points shows their outline as well as all, and a key must not wait.
        let step = cloud.n_points().div_ceil(FRAMED_POINTS).max(1);
        let points = cloud.positions().iter().copied().step_by(step);
        self.camera.frame_points(points, self.aspect());
    }

    /// Brings `point` into the middle, at most `distance` away.
    pub fn fly_to(&mut self, point: Vec3, distance: f32) {
        self.camera.pivot = point;
        if distance > 0.0 {
            self.camera.distance = self.camera.distance.min(distance);
        }
    }

    /// Switches between parallel and perspective projection.
    pub fn toggle_orthographic(&mut self) {
        self.camera.projection = match self.camera.projection {
            Projection::Perspective => Projection::Orthographic,
            Projection::Orthographic => Projection::Perspective,
        };
    }

    /// Zooms around the middle of the view; > 1 comes closer.
    pub fn zoom(&mut self, factor: f32) {
        let size = self.size_in_pixels();
        self.camera.zoom(factor, size * 0.5, size, None);
    }

    /// Orbits by an angle given as a pointer motion in points.
    pub fn orbit(&mut self, delta: Vec2) {
        self.camera.orbit(glam::Vec2::new(delta.x, delta.y));
    }

    /// The widget's id, once it was drawn.
    pub fn id(&self) -> Option<egui::Id> {
        self.id
    }

    /// The pixel in the middle of the view.
    pub fn center(&self) -> Pixel {
        [self.size[0] / 2, self.size[1] / 2]
    }

    fn aspect(&self) -> f32 {
        self.size[0] as f32 / self.size[1] as f32
    }

    fn size_in_pixels(&self) -> glam::Vec2 {
        glam::Vec2::new(self.size[0] as f32, self.size[1] as f32)
    }

    fn pixel(&self, position: Pos2) -> Option<Pixel> {
        let pixel = ((position - self.rect.min) * self.pixels_per_point).floor();
        let inside = pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x < self.size[0] as f32 && pixel.y < self.size[1] as f32;
        inside.then_some([pixel.x as u32, pixel.y as u32])
    }

    /// The place of a world point in the window, in points; `None` behind the eye.
    pub fn place(&self, point: Vec3) -> Option<Pos2> {
        let pixel = self.camera.project(point, self.size_in_pixels())?;
        Some(self.rect.min + Vec2::new(pixel.x, pixel.y) / self.pixels_per_point)
    }

    /// Takes all of `ui`: moves the camera, draws the scene, and tells what the pointer did. `under_pointer` is the
    /// world point last seen under the pointer, for zooming to it.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        scene: &mut Scene,
        settings: &mut DrawSettings,
        under_pointer: Option<Vec3>,
    ) -> PointerOnView {
        self.pixels_per_point = ui.pixels_per_point();
        let available = ui.available_rect_before_wrap();
        // The picture is drawn pixel for pixel, so the view begins and ends on whole pixels.
        let snap = |value: f32| (value * self.pixels_per_point).round() / self.pixels_per_point;
        self.rect = Rect::from_min_max(
            Pos2::new(snap(available.min.x), snap(available.min.y)),
            Pos2::new(snap(available.max.x), snap(available.max.y)),
        );
        let pixels = (self.rect.size() * self.pixels_per_point).round();
        self.size = [pixels.x.max(1.0) as u32, pixels.y.max(1.0) as u32];

        let response = ui.allocate_rect(self.rect, Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::Image, true, "3D view"));
        self.id = Some(response.id);

        let (steps, chosen) = self.follow_hold(ui, &response);
        let before = self.camera;
        self.move_camera(ui, &response, settings, under_pointer);
        let (now, frame_secs) = ui.input(|input| (input.time, input.unstable_dt));
        let moved = self.camera != before;
        if let Some(secs) = self.pace.frame(moved, response.dragged(), now, frame_secs) {
            ui.request_repaint_after(std::time::Duration::from_secs_f64(secs));
        }
        let detail = self.pace.detail();
        settings.stride = detail.stride;

        if let Some(texture) = scene.draw(
            &self.camera,
            self.size,
            detail.pixel_side,
            self.pixels_per_point,
            settings,
        ) {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            ui.painter().image(texture, self.rect, whole, Color32::WHITE);
        }
        if (response.dragged() && self.hold.is_none()) || moved {
            self.pivot_mark(ui);
        }
        self.axis_gizmo(ui);

        let position = response.hover_pos();
        let resting = !moved && (self.hold.is_some() || !response.dragged()) && self.pace.is_full();
        let clicked_at = response
            .interact_pointer_pos()
            .and_then(|position| self.pixel(position));
        let double_clicked = response.double_clicked_by(PointerButton::Primary);
        let pivot = double_clicked || response.clicked_by(PointerButton::Middle);
        PointerOnView {
            hovered: position
                .filter(|_| resting)
                .and_then(|position| self.hold.map_or_else(|| self.pixel(position), |hold| Some(hold.pixel))),
            position,
            clicked: clicked_at
                .filter(|_| response.clicked_by(PointerButton::Primary) && !double_clicked)
                .or(chosen),
            steps,
            modifiers: ui.input(|input| input.modifiers),
            pivot: clicked_at.filter(|_| pivot),
            by_double_click: double_clicked,
        }
    }

    /// Follows the wheel while the main button is held. Returns the notches of this frame, and the pixel of a release
    /// after such.
    fn follow_hold(&mut self, ui: &Ui, response: &egui::Response) -> (i32, Option<Pixel>) {
        let max_distance = ui.ctx().options(|options| options.input_options.max_click_dist);
        let (pressed, down, position) = ui.input(|input| {
            let pointer = &input.pointer;
            (pointer.primary_pressed(), pointer.primary_down(), pointer.latest_pos())
        });
        if let Some(position) = position.filter(|_| pressed && response.is_pointer_button_down_on()) {
            self.hold = self.pixel(position).map(|pixel| Hold {
                pixel,
                position,
                is_choosing: false,
                notches: 0.0,
            });
        }
        let Some(mut hold) = self.hold.take() else {
            return (0, None);
        };
        let rests = position.is_some_and(|position| position.distance(hold.position) <= max_distance);
        if !down {
            // Who drags away from the place before the release means no click after all.
            return (0, Some(hold.pixel).filter(|_| hold.is_choosing && rests));
        }
        if !rests && !hold.is_choosing {
            return (0, None);
        }
        hold.notches += ui.input(|input| input.events.iter().map(notches).sum::<f32>());
        let steps = hold.notches.trunc();
        hold.notches -= steps;
        hold.is_choosing |= steps != 0.0;
        self.is_wheel_settling |= hold.is_choosing;
        self.hold = Some(hold);
        (steps as i32, None)
    }

    fn move_camera(
        &mut self,
        ui: &Ui,
        response: &egui::Response,
        settings: &mut DrawSettings,
        under_pointer: Option<Vec3>,
    ) {
        let shift = ui.input(|input| input.modifiers.shift);
        // From the whole way: in a slow frame the pointer may have moved before the drag was known to be one.
        let dragged = response.total_drag_delta().unwrap_or_default();
        let delta = (dragged - self.dragged) * self.pixels_per_point;
        self.dragged = dragged;
        let pixels = glam::Vec2::new(delta.x, delta.y);
        if self.hold.is_some_and(|hold| hold.is_choosing) {
            return;
        }
        let panning = response.dragged_by(PointerButton::Secondary)
            || response.dragged_by(PointerButton::Middle)
            || (shift && response.dragged_by(PointerButton::Primary));
        if panning {
            self.camera.pan(pixels, self.size_in_pixels());
            ui.set_cursor_icon(egui::CursorIcon::Grabbing);
        } else if response.dragged_by(PointerButton::Primary) {
            // Orbiting by points, so that a turn needs the same motion of the hand on every screen.
            self.camera.orbit(pixels / self.pixels_per_point);
            ui.set_cursor_icon(egui::CursorIcon::Grabbing);
        }
        let Some(pointer) = response.hover_pos() else {
            self.zoom_anchor = None;
            return;
        };
        let (scroll, pinch, alt) =
            ui.input(|input| (input.smooth_scroll_delta(), input.zoom_delta(), input.modifiers.alt));
        let scroll = scroll.x + scroll.y;
        self.is_wheel_settling &= scroll != 0.0;
        if self.is_wheel_settling || (self.hold.is_some() && scroll != 0.0) {
            return;
        }
        if alt && scroll != 0.0 {
            settings.splat_scale *= (scroll / 400.0).exp();
            return;
        }
        let factor = pinch * (scroll / 250.0).exp();
        if factor == 1.0 {
            return;
        }
        // The pick is late while the camera moves; the point under a resting pointer stays the same.
        let anchor = match self.zoom_anchor {
            Some((at, point)) if at.distance(pointer) < 1.0 => Some(point),
            _ => under_pointer,
        };
        self.zoom_anchor = anchor.map(|point| (pointer, point));
        let pixel = (pointer - self.rect.min) * self.pixels_per_point;
        self.camera
            .zoom(factor, glam::Vec2::new(pixel.x, pixel.y), self.size_in_pixels(), anchor);
    }

    fn pivot_mark(&self, ui: &Ui) {
        let Some(place) = self.place(self.camera.pivot) else {
            return;
        };
        let painter = ui.painter_at(self.rect);
        for (width, color) in [
            (3.0, Color32::from_black_alpha(140)),
            (1.5, Color32::from_white_alpha(230)),
        ] {
            painter.circle_stroke(place, 6.0, Stroke::new(width, color));
            painter.circle_filled(place, width * 0.75, color);
        }
    }

    /// The directions of x, y and z in the lower left corner, the nearest drawn last.
    fn axis_gizmo(&self, ui: &Ui) {
        let painter = ui.painter_at(self.rect);
        let center = self.rect.left_bottom() + Vec2::new(44.0, -44.0);
        let (right, up, back) = (self.camera.right(), self.camera.up(), self.camera.back());
        let mut axes = [
            ("x", Vec3::X, Color32::from_rgb(0xe0, 0x5a, 0x5a)),
            ("y", Vec3::Y, Color32::from_rgb(0x5f, 0xb3, 0x4d)),
            ("z", Vec3::Z, Color32::from_rgb(0x5b, 0x8d, 0xef)),
        ]
        .map(|(name, axis, color)| (name, Vec3::new(right.dot(axis), up.dot(axis), back.dot(axis)), color));
        axes.sort_by(|a, b| a.1.z.total_cmp(&b.1.z));
        for (name, direction, color) in axes {
            let end = center + Vec2::new(direction.x, -direction.y) * 26.0;
            painter.line_segment([center, end], Stroke::new(2.0, color));
            painter.circle_filled(end, 7.0, color);
            painter.text(
                end,
                Align2::CENTER_CENTER,
                name,
                FontId::proportional(11.0),
                Color32::from_rgb(0x10, 0x12, 0x15),
            );
        }
    }

    /// A few words beside the pointer.
    pub fn badge(&self, ui: &Ui, pointer: Pos2, text: &str) {
        let painter = ui.painter_at(self.rect);
        let color = ui.visuals().strong_text_color();
        let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(13.0), color);
        let padding = Vec2::new(8.0, 4.0);
        let size = galley.size() + 2.0 * padding;
        let mut min = pointer + Vec2::new(18.0, 14.0);
        if min.x + size.x > self.rect.right() {
            min.x = pointer.x - 12.0 - size.x;
        }
        if min.y + size.y > self.rect.bottom() {
            min.y = pointer.y - 8.0 - size.y;
        }
        let rect = Rect::from_min_size(min, size);
        painter.rect(
            rect,
            5.0,
            ui.visuals().window_fill,
            ui.visuals().window_stroke,
            StrokeKind::Inside,
        );
        painter.galley(min + padding, galley, color);
    }
}

/// How far an event turns the wheel, in notches away from the user.
fn notches(event: &egui::Event) -> f32 {
    match event {
        // With Shift held, some systems turn the wheel sideways.
        egui::Event::MouseWheel { unit, delta, .. } => match unit {
            egui::MouseWheelUnit::Point => (delta.x + delta.y) / POINTS_PER_NOTCH,
            egui::MouseWheelUnit::Line | egui::MouseWheelUnit::Page => delta.x + delta.y,
        },
        _ => 0.0,
    }
}

impl Default for Viewport {
    fn default() -> Self {
        Self::new()
    }
}
