//! What moves the camera: drags, wheel, touchpad, touch screen, flying, and the way to a view that was asked for.

use egui::{CursorIcon, Event, MouseWheelSource, PointerButton, Ui, Vec2};
use glam::Vec3;
use normend_render::DrawSettings;

use super::hold::notches;
use super::{Navigation, Touchpad, Viewport};

/// Points that a wheel scrolls to come closer by the factor e.
const SCROLL_PER_ZOOM: f32 = 250.0;
/// Points that a wheel scrolls to grow splats by the factor e.
const SCROLL_PER_SPLAT_SCALE: f32 = 400.0;
/// How deep one notch of the wheel cuts, as a part of the scene's depth.
const CLIP_PER_NOTCH: f32 = 0.02;
/// The deepest cut: something is left to see what it was.
const MAX_NEAR: f32 = 0.98;

/// What wheel, touchpad and touch screen did in a frame.
struct Scroll {
    /// Zoom in by this factor.
    pinch: f32,
    /// Slide the picture, in points.
    pan: Vec2,
    /// The wheel, in points, away from the user positive.
    wheel: f32,
    /// The wheel with Ctrl, in notches.
    clip: f32,
    alt: bool,
}

impl Viewport {
    /// Goes on with what moves by itself: a flight, or keys that are held while flying.
    pub(super) fn advance(&mut self, ui: &Ui) {
        let (now, secs, modifiers, interrupted) = ui.input(|input| {
            let interrupted = input.events.iter().any(is_interruption);
            (input.time, input.stable_dt, input.modifiers, interrupted)
        });
        if let Some(mut flight) = self.flight.take() {
            if interrupted && flight.is_under_way() {
                self.camera = flight.to();
            } else {
                let (camera, arrived) = flight.at(now);
                self.camera = camera;
                self.flight = Some(flight).filter(|_| !arrived);
            }
        }
        if let Some(fly) = self.fly.as_ref().filter(|fly| fly.is_moving()) {
            self.camera.travel(fly.step(modifiers, secs, self.bounds.radius()));
        }
    }

    /// Follows the pointer's buttons, the wheel and the fingers. `under_pointer` is the world point under the pointer.
    pub(super) fn follow_pointer(
        &mut self,
        ui: &Ui,
        response: &egui::Response,
        settings: &mut DrawSettings,
        under_pointer: Option<Vec3>,
    ) {
        self.follow_drag(ui, response, under_pointer);
        let Some(pointer) = response.hover_pos() else {
            self.zoom_anchor = None;
            return;
        };
        let scroll = self.scroll(ui);
        self.is_wheel_settling &= scroll.wheel != 0.0;
        // The mask of a figure under way is of the picture as it is.
        if self.is_drawing() || self.is_wheel_settling || (self.hold.is_some() && scroll.wheel != 0.0) {
            return;
        }
        if scroll.clip != 0.0 {
            self.cut_deeper(scroll.clip);
        }
        if scroll.pan != Vec2::ZERO {
            self.pan(scroll.pan);
        }
        if scroll.alt && scroll.wheel != 0.0 {
            if self.is_for_drawing() {
                self.sizing += scroll.wheel;
            } else {
                settings.splat_scale *= (scroll.wheel / SCROLL_PER_SPLAT_SCALE).exp();
            }
            return;
        }
        let factor = scroll.pinch * (scroll.wheel / SCROLL_PER_ZOOM).exp();
        if factor == 1.0 {
            return;
        }
        if let Some(fly) = &mut self.fly {
            fly.change_speed(factor);
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

    fn follow_drag(&mut self, ui: &Ui, response: &egui::Response, under_pointer: Option<Vec3>) {
        let (held, pressed, touches) = ui.input(|input| {
            let pressed = input.pointer.primary_pressed();
            (input.modifiers, pressed, input.multi_touch().is_some())
        });
        if pressed && response.is_pointer_button_down_on() {
            self.pressed_on = under_pointer;
        }
        // From the whole way: in a slow frame the pointer may have moved before the drag was known to be one.
        let dragged = response.total_drag_delta().unwrap_or_default();
        let delta = dragged - self.dragged;
        self.dragged = dragged;
        if self.hold.is_some_and(|hold| hold.is_choosing) || touches {
            return;
        }
        if self.is_drawing() {
            return;
        }
        let by = |button| response.dragged_by(button);
        let draws = self.is_for_drawing();
        let turns_right = draws && !held.shift && by(PointerButton::Secondary);
        let panning = (by(PointerButton::Secondary) && !turns_right)
            || by(PointerButton::Middle)
            || (held.shift && by(PointerButton::Primary) && self.fly.is_none() && !draws);
        if panning {
            self.pan(delta);
            ui.set_cursor_icon(CursorIcon::Grabbing);
        } else if turns_right || by(PointerButton::Primary) {
            if self.fly.is_some() {
                let pixels = delta * self.pixels_per_point;
                let size = self.size_in_pixels();
                self.camera.look(glam::Vec2::new(pixels.x, pixels.y), size);
            } else {
                self.drag_orbit(response, delta);
            }
            ui.set_cursor_icon(CursorIcon::Grabbing);
        }
    }

    fn drag_orbit(&mut self, response: &egui::Response, delta: Vec2) {
        if let Some(point) = self.pressed_on.take().filter(|_| self.preferences.orbit_under_pointer) {
            self.camera.set_pivot(point);
        }
        // By points, so that a turn needs the same motion of the hand on every screen.
        match (self.preferences.style, response.interact_pointer_pos()) {
            (Navigation::Trackball, Some(position)) => {
                let to = position - self.rect.min;
                let from = to - delta;
                let size = self.rect.size();
                self.camera.roll_ball(
                    glam::Vec2::new(from.x, from.y),
                    glam::Vec2::new(to.x, to.y),
                    glam::Vec2::new(size.x, size.y),
                );
            }
            (Navigation::Turntable, _) | (Navigation::Trackball, None) => self.orbit(delta),
        }
    }

    fn scroll(&mut self, ui: &Ui) -> Scroll {
        ui.input(|input| {
            let (mut pinch, mut clip) = (1.0, 0.0);
            for event in &input.events {
                match event {
                    Event::Zoom(factor) => pinch *= factor,
                    Event::MouseWheel { source, modifiers, .. } => {
                        self.is_scroll_of_fingers =
                            matches!(source, MouseWheelSource::Trackpad | MouseWheelSource::Momentum);
                        // egui makes zooming of the wheel with Ctrl; here pinching zooms, and Ctrl cuts.
                        if modifiers.command {
                            clip += notches(event);
                        }
                    }
                    _ => {}
                }
            }
            let (mut pan, mut wheel) = (Vec2::ZERO, 0.0);
            let delta = input.smooth_scroll_delta();
            if self.is_scroll_of_fingers && self.preferences.touchpad == Touchpad::Pan && !input.modifiers.alt {
                pan = delta;
            } else {
                // With Shift held, egui and some systems turn the wheel sideways. It zooms all the same.
                wheel = delta.x + delta.y;
            }
            if let Some(touch) = input.multi_touch() {
                pinch *= touch.zoom_delta;
                pan += touch.translation_delta;
            }
            Scroll {
                pinch,
                pan,
                wheel,
                clip,
                alt: input.modifiers.alt,
            }
        })
    }

    /// Cuts away more of what is near (positive), or less, in notches of the wheel.
    pub fn cut_deeper(&mut self, notches: f32) {
        let near = self.clip.near + CLIP_PER_NOTCH * notches;
        // Whole steps back to nothing leave no rest of rounding that cuts.
        self.clip.near = if near < 0.5 * CLIP_PER_NOTCH {
            0.0
        } else {
            near.min(MAX_NEAR)
        };
    }
}

/// Whether the user does something, so that a flight shall not hold them up.
fn is_interruption(event: &Event) -> bool {
    match event {
        Event::Key { pressed, .. } | Event::PointerButton { pressed, .. } => *pressed,
        Event::Touch { phase, .. } => *phase == egui::TouchPhase::Start,
        Event::MouseWheel { .. } | Event::Zoom(_) => true,
        _ => false,
    }
}
