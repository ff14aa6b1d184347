//! The 3D view: pointer and camera, the picture, and the marks drawn over it.

mod clip_handles;
mod drawing;
mod flight;
mod fly;
mod gizmo;
mod hold;
mod motion;
mod overlay;
mod preferences;
mod section;

use egui::{Modifiers, PointerButton, Pos2, Rect, Sense, Ui, Vec2};
use glam::{DVec3, Vec3};
use normend_core::PointCloud;
use normend_render::{Camera, Clip, DrawSettings, Projection, StandardView};

use crate::pace::Pace;
use crate::scene_sync::Scene;
use clip_handles::FaceDrag;
pub use drawing::{DrawEvent, ViewPlace, viewer_of};
use flight::Flight;
use fly::Fly;
pub use gizmo::WIDTH as GIZMO_WIDTH;
use hold::Hold;
pub use overlay::{HALO as LINE_HALO, LINE, ground};
pub use preferences::{Navigation, NavigationSettings, Touchpad};

/// A pixel of the view, physical, from its top left corner.
pub type Pixel = [u32; 2];

/// Points that framing looks at.
const FRAMED_POINTS: usize = 1 << 18;
/// The least distance that framing goes to, as a part of the scene's radius: a single point is seen with what is around it.
const NEAREST_FRAME: f32 = 0.2;

/// The box around the scan, in world space.
#[derive(Clone, Copy, Debug)]
struct SceneBounds {
    min: Vec3,
    max: Vec3,
    /// What is added to a world position to give the file's coordinates.
    origin: DVec3,
}

impl SceneBounds {
    /// Half the diagonal, > 0.
    fn radius(&self) -> f32 {
        let radius = 0.5 * (self.max - self.min).length();
        if radius > 0.0 { radius } else { 1.0 }
    }
}

/// The camera and how the user moves it.
#[derive(Clone, Debug)]
pub struct Viewport {
    /// Where the view is seen from.
    camera: Camera,
    /// What is cut away: how deep, and the box outside of which nothing is drawn.
    pub clip: Clip,
    /// Where the view is in the window, in points.
    pub rect: Rect,
    size: [u32; 2],
    pixels_per_point: f32,
    id: Option<egui::Id>,
    preferences: NavigationSettings,
    /// The camera jumps instead of flying.
    reduces_motion: bool,
    bounds: SceneBounds,
    flight: Option<Flight>,
    fly: Option<Fly>,
    /// The point that zooming keeps in place, for as long as the pointer rests.
    zoom_anchor: Option<(Pos2, Vec3)>,
    /// What the main button was last pressed on, until a drag begins there.
    pressed_on: Option<Vec3>,
    pace: Pace,
    /// How far the present drag has come, in points.
    dragged: Vec2,
    hold: Option<Hold>,
    /// The wheel was turned while the button was held, and egui still smooths that out: it is no zooming.
    is_wheel_settling: bool,
    /// The last scrolling came from fingers on a touchpad.
    is_scroll_of_fingers: bool,
    face_drag: Option<FaceDrag>,
    /// The main button draws instead of turning the view.
    draws: bool,
    /// It is pressed and draws.
    is_pressed_to_draw: bool,
    /// What the wheel with Alt turned while a tool draws, in points, until the frame ends.
    sizing: f32,
}

/// What the pointer did in the view this frame.
#[derive(Clone, Debug, Default)]
pub struct PointerOnView {
    /// The pixel under the resting pointer, or at the crosshair; `None` outside, while a button moves the camera, or while the camera moves.
    pub hovered: Option<Pixel>,
    /// Where the pointer is, in points.
    pub position: Option<Pos2>,
    /// Where keys point, in points: the middle, while the view has the keyboard and the pointer is elsewhere.
    pub crosshair: Option<Pos2>,
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
    /// What the main button did for a tool that draws.
    pub drawn: Vec<DrawEvent>,
    /// How far the wheel was turned with Alt while a tool draws, in points, away from the user positive.
    pub sizing: f32,
    /// The view as a widget, for a menu at the pointer.
    pub response: Option<egui::Response>,
}

impl Viewport {
    /// Looks at an empty scene.
    pub fn new() -> Self {
        let (min, max) = (Vec3::splat(-1.0), Vec3::splat(1.0));
        Self {
            camera: Camera::framing(min, max, StandardView::Corner, 1.0),
            clip: Clip::default(),
            rect: Rect::ZERO,
            size: [1, 1],
            pixels_per_point: 1.0,
            id: None,
            preferences: NavigationSettings::default(),
            reduces_motion: false,
            bounds: SceneBounds {
                min,
                max,
                origin: DVec3::ZERO,
            },
            flight: None,
            fly: None,
            zoom_anchor: None,
            pressed_on: None,
            pace: Pace::new(),
            dragged: Vec2::ZERO,
            hold: None,
            is_wheel_settling: false,
            is_scroll_of_fingers: false,
            face_drag: None,
            draws: false,
            is_pressed_to_draw: false,
            sizing: 0.0,
        }
    }

    /// Where the view is seen from in this frame.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Moves as the user likes from now on. Another up axis stands the scan upright, a turntable takes the roll out. With
    /// `reduces_motion` the camera jumps instead of flying.
    pub fn set_preferences(&mut self, preferences: NavigationSettings, reduces_motion: bool) {
        self.reduces_motion = reduces_motion;
        if preferences == self.preferences {
            return;
        }
        let levels = preferences.style == Navigation::Turntable && self.preferences.style != Navigation::Turntable;
        self.preferences = preferences;
        let mut to = self.destination();
        if preferences.up_axis != to.up_axis {
            to.set_up_axis(preferences.up_axis);
        }
        if levels {
            to.level();
        }
        self.go(to);
    }

    /// Looks at the whole of a new scan from the corner, and shows all of it.
    pub fn look_at(&mut self, cloud: &PointCloud) {
        let (min, max) = cloud.bounding_box();
        self.bounds = SceneBounds {
            min,
            max,
            origin: cloud.origin(),
        };
        let projection = self.camera.projection;
        self.camera = Camera::new(StandardView::Corner, self.preferences.up_axis);
        self.camera.frame(min, max, self.aspect());
        self.camera.projection = projection;
        (self.flight, self.fly, self.face_drag) = (None, None, None);
        (self.zoom_anchor, self.pressed_on) = (None, None);
        self.clip = Clip::default();
        self.camera.frame_points(some_of(cloud), self.aspect());
    }

    /// Shows the whole scan from the present direction.
    pub fn frame_all(&mut self, cloud: &PointCloud) {
        let mut to = self.destination();
        to.frame_points(some_of(cloud), self.aspect());
        self.go(to);
    }

    /// Shows these world positions from the present direction, not closer than makes sense in this scene. No positions change
    /// nothing. O(n), so of very many a part is enough.
    pub fn frame_points(&mut self, points: impl IntoIterator<Item = Vec3> + Clone) {
        let empty = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let corners = points.clone().into_iter();
        let (min, max) = corners.fold(empty, |(min, max), point| (min.min(point), max.max(point)));
        if !(min.is_finite() && max.is_finite()) {
            return;
        }
        let mut to = self.destination();
        to.frame_points(points, self.aspect());
        let nearest = NEAREST_FRAME * self.bounds.radius();
        to.distance = if min == max { nearest } else { to.distance.max(nearest) };
        self.go(to);
    }

    /// As [`Self::frame_points`], looking at a part of these `n_points` when they are very many.
    pub fn frame_some(&mut self, n_points: u64, points: impl Iterator<Item = Vec3> + Clone) {
        let step = n_points.div_ceil(FRAMED_POINTS as u64).max(1);
        self.frame_points(points.step_by(step as usize));
    }

    /// Brings `point` into the middle, at most `distance` away (world length), seen from the side that `direction` points to from it, if
    /// one is given.
    pub fn fly_to(&mut self, point: Vec3, distance: f32, direction: Option<Vec3>) {
        let mut to = self.destination();
        to.pivot = point;
        to.pivot_offset = glam::Vec2::ZERO;
        if distance > 0.0 {
            to.distance = to.distance.min(distance);
        }
        if let Some(direction) = direction {
            to.look_from(direction);
        }
        self.go(to);
    }

    /// Looks along an axis.
    pub fn look_along(&mut self, view: StandardView) {
        let mut to = self.destination();
        to.set_view(view);
        self.go(to);
    }

    /// Turns around `point` (world) from now on; the picture stays.
    pub fn set_pivot(&mut self, point: Vec3) {
        self.land();
        self.camera.set_pivot(point);
    }

    /// Switches between parallel and perspective projection.
    pub fn toggle_orthographic(&mut self) {
        self.land();
        self.camera.projection = match self.camera.projection {
            Projection::Perspective => Projection::Orthographic,
            Projection::Orthographic => Projection::Perspective,
        };
    }

    /// Zooms around the middle of the view; > 1 comes closer.
    pub fn zoom(&mut self, factor: f32) {
        self.land();
        let size = self.size_in_pixels();
        self.camera.zoom(factor, size * 0.5, size, None);
    }

    /// Orbits by an angle given as a pointer motion in points.
    pub fn orbit(&mut self, delta: Vec2) {
        self.land();
        let delta = glam::Vec2::new(delta.x, delta.y);
        match self.preferences.style {
            Navigation::Turntable => self.camera.orbit(delta),
            Navigation::Trackball => self.camera.turn(delta),
        }
    }

    /// Pans by a pointer motion in points.
    pub fn pan(&mut self, delta: Vec2) {
        self.land();
        let pixels = delta * self.pixels_per_point;
        self.camera
            .pan(glam::Vec2::new(pixels.x, pixels.y), self.size_in_pixels());
    }

    /// Begins to fly through the scan, or ends it. In perspective: without, going forward shows nothing.
    pub fn toggle_fly(&mut self) {
        self.land();
        self.fly = match self.fly {
            Some(_) => None,
            None => {
                self.camera.projection = Projection::Perspective;
                Some(Fly::new())
            }
        };
    }

    /// Gives the keys that fly to the view, when the user flies; they are no shortcuts then. `elsewhere`: a text field or a window has
    /// the keyboard.
    pub fn take_keys(&mut self, ctx: &egui::Context, elsewhere: bool) {
        match &mut self.fly {
            Some(fly) if elsewhere => fly.stop(),
            Some(fly) => fly.take_keys(ctx),
            None => {}
        }
    }

    /// Escape: takes back the face of the clip box that is being dragged, or ends flying. `false` when there was neither.
    pub fn cancel(&mut self) -> bool {
        if let Some(drag) = self.face_drag.take() {
            self.clip.bounds = Some(drag.before());
            return true;
        }
        self.fly.take().is_some()
    }

    /// The widget's id, once it was drawn.
    pub fn id(&self) -> Option<egui::Id> {
        self.id
    }

    /// The size of the view in physical pixels.
    pub fn size_in_pixels(&self) -> glam::Vec2 {
        glam::Vec2::new(self.size[0] as f32, self.size[1] as f32)
    }

    fn aspect(&self) -> f32 {
        self.size[0] as f32 / self.size[1] as f32
    }

    /// Where the camera is, or where it is going.
    fn destination(&self) -> Camera {
        self.flight.map_or(self.camera, |flight| flight.to())
    }

    fn go(&mut self, to: Camera) {
        if self.reduces_motion {
            (self.camera, self.flight) = (to, None);
        } else if to != self.camera {
            self.flight = Some(Flight::new(self.camera, to));
        }
    }

    /// Ends a flight where it was going.
    fn land(&mut self) {
        self.camera = self.destination();
        self.flight = None;
    }

    /// The pixel at a place of the window; `None` outside of the view.
    pub fn pixel(&self, position: Pos2) -> Option<Pixel> {
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
        self.take_place(ui);
        let response = ui.allocate_rect(self.rect, Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::Image, true, "3D view"));
        self.id = Some(response.id);

        let drawn = self.follow_drawing(ui, &response);
        let (steps, chosen) = self.follow_hold(ui, &response);
        let before = (self.camera, settings.clip);
        self.advance(ui);
        self.follow_pointer(ui, &response, settings, under_pointer);
        // The handles lie over the view, and what they move is drawn with it.
        self.clip_handles(ui);
        settings.clip = self.clip;
        let moved = (self.camera, self.clip) != before;
        let (now, frame_secs) = ui.input(|input| (input.time, input.unstable_dt));
        let held = (response.dragged() && !self.is_drawing()) || self.face_drag.is_some();
        if let Some(secs) = self.pace.frame(moved, held, now, frame_secs) {
            ui.request_repaint_after(std::time::Duration::from_secs_f64(secs));
        }
        if self.flight.is_some() {
            // Also from the frame before it leaves.
            ui.request_repaint();
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
            self.picture(ui, texture);
        }
        let moves = self.camera != before.0 && self.flight.is_none() && self.fly.is_none();
        let drags = response.dragged() && self.hold.is_none() && self.fly.is_none() && !self.is_drawing();
        if drags || moves {
            self.pivot_mark(ui);
        }
        self.draw_clip_box(ui);
        if let Some(direction) = gizmo::ui(ui, self.rect, &self.camera) {
            let mut to = self.destination();
            to.look_from(direction);
            self.go(to);
        }
        self.notices(ui);

        let position = response.hover_pos();
        let crosshair = (position.is_none() && response.has_focus()).then(|| self.rect.center());
        let resting = !moved && (self.hold.is_some() || !response.dragged()) && self.pace.is_full();
        let clicked_at = response
            .interact_pointer_pos()
            .and_then(|position| self.pixel(position));
        let clicks = !self.is_for_drawing();
        let double_clicked = clicks && response.double_clicked_by(PointerButton::Primary);
        let pivot = double_clicked || response.clicked_by(PointerButton::Middle);
        PointerOnView {
            hovered: position
                .or(crosshair)
                .filter(|_| resting)
                .and_then(|position| self.hold.map_or_else(|| self.pixel(position), |hold| Some(hold.pixel))),
            position,
            crosshair,
            clicked: clicked_at
                .filter(|_| clicks && response.clicked_by(PointerButton::Primary) && !double_clicked)
                .or(chosen),
            steps,
            modifiers: ui.input(|input| input.modifiers),
            pivot: clicked_at.filter(|_| pivot),
            by_double_click: double_clicked,
            drawn,
            sizing: std::mem::take(&mut self.sizing),
            response: Some(response),
        }
    }

    fn take_place(&mut self, ui: &Ui) {
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
    }
}

/// A part of very many points shows their outline as well as all, and a key must not wait.
fn some_of(cloud: &PointCloud) -> impl Iterator<Item = Vec3> + Clone + '_ {
    let step = cloud.n_points().div_ceil(FRAMED_POINTS).max(1);
    cloud.positions().iter().copied().step_by(step)
}

impl Default for Viewport {
    fn default() -> Self {
        Self::new()
    }
}
