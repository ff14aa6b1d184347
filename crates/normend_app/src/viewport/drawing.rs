//! The main button for tools that draw in the view, and the picture's place in the window.

use egui::{Event, Modifiers, PointerButton, Pos2, Rect, Ui};

use normend_core::document::Viewer;
use normend_render::{Camera, Projection};

use super::Viewport;

/// What the main button does while a tool draws, in the order it happened; places in points of the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DrawEvent {
    /// It is pressed on the view.
    Press {
        /// Where.
        place: Pos2,
        /// The modifier keys that are held.
        modifiers: Modifiers,
    },
    /// It is dragged there.
    Move(Pos2),
    /// It is released there.
    Release(Pos2),
}

/// Where the picture is in the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewPlace {
    /// In points.
    pub rect: Rect,
    /// In physical pixels.
    pub size: [u32; 2],
    /// Physical pixels of a point.
    pub pixels_per_point: f32,
}

impl ViewPlace {
    /// A place of the window in physical pixels of the view; it may lie outside.
    pub fn pixels(&self, place: Pos2) -> glam::Vec2 {
        let offset = (place - self.rect.min) * self.pixels_per_point;
        glam::Vec2::new(offset.x, offset.y)
    }
}

impl Viewport {
    /// From now on the main button draws instead of turning the view, or turns it again. While it draws, the right button turns the
    /// view, and so does the main one with Alt; the middle one and the right one with Shift move it.
    pub fn set_draws(&mut self, draws: bool) {
        self.draws = draws;
    }

    /// Where the picture is.
    pub fn view_place(&self) -> ViewPlace {
        ViewPlace {
            rect: self.rect,
            size: self.size,
            pixels_per_point: self.pixels_per_point,
        }
    }

    /// From where the picture is seen, in the cloud's own space.
    pub fn viewer(&self) -> Viewer {
        viewer_of(&self.camera)
    }

    /// Whether the main button draws instead of turning the view: flying looks with it.
    pub(super) fn is_for_drawing(&self) -> bool {
        self.draws && self.fly.is_none()
    }

    /// Whether a drag draws at this moment.
    pub(super) fn is_drawing(&self) -> bool {
        self.is_pressed_to_draw
    }

    pub(super) fn follow_drawing(&mut self, ui: &Ui, response: &egui::Response) -> Vec<DrawEvent> {
        let mut events = Vec::new();
        if !self.is_for_drawing() {
            self.is_pressed_to_draw = false;
            return events;
        }
        let on_view = response.contains_pointer() || response.is_pointer_button_down_on();
        let pressed_elsewhere = self.face_drag.is_some();
        ui.input(|input| {
            for event in &input.events {
                match *event {
                    Event::PointerButton {
                        pos: place,
                        button: PointerButton::Primary,
                        pressed,
                        modifiers,
                    } => {
                        if pressed && on_view && !pressed_elsewhere && !modifiers.alt && self.rect.contains(place) {
                            self.is_pressed_to_draw = true;
                            events.push(DrawEvent::Press { place, modifiers });
                        } else if !pressed && std::mem::take(&mut self.is_pressed_to_draw) {
                            events.push(DrawEvent::Release(place));
                        }
                    }
                    Event::PointerMoved(place) if self.is_pressed_to_draw => events.push(DrawEvent::Move(place)),
                    _ => {}
                }
            }
            // A release outside of the window is not always told.
            if self.is_pressed_to_draw && !input.pointer.primary_down() {
                self.is_pressed_to_draw = false;
                events.extend(input.pointer.latest_pos().map(DrawEvent::Release));
            }
        });
        events
    }
}

/// From where a camera sees, in the cloud's own space.
pub fn viewer_of(camera: &Camera) -> Viewer {
    match camera.projection {
        Projection::Perspective => Viewer::At(camera.eye()),
        Projection::Orthographic => Viewer::Toward(camera.back()),
    }
}
