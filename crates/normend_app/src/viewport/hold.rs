//! The main button held down in the view while the pointer rests: the wheel chooses, the release clicks.

use egui::{Pos2, Ui};

use super::{Pixel, Viewport};

/// How much a touchpad scrolls for one notch of a wheel, in points: about a line of text and a half, so that a swipe is a
/// few notches.
const POINTS_PER_NOTCH: f32 = 24.0;

/// The main button is held down in the view, and the pointer rests.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hold {
    pub(super) pixel: Pixel,
    position: Pos2,
    /// The wheel was turned meanwhile, so the release is a click, however late.
    pub(super) is_choosing: bool,
    /// What the wheel turned and was not given out yet, in notches.
    notches: f32,
}

impl Viewport {
    /// Follows the wheel while the main button is held. Returns the notches of this frame, and the pixel of a release
    /// after such.
    pub(super) fn follow_hold(&mut self, ui: &Ui, response: &egui::Response) -> (i32, Option<Pixel>) {
        let max_distance = ui.ctx().options(|options| options.input_options.max_click_dist);
        let (pressed, down, position) = ui.input(|input| {
            let pointer = &input.pointer;
            (pointer.primary_pressed(), pointer.primary_down(), pointer.latest_pos())
        });
        let holds = pressed && response.is_pointer_button_down_on() && !self.is_drawing();
        if let Some(position) = position.filter(|_| holds) {
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
}

/// How far an event turns the wheel, in notches away from the user.
pub(super) fn notches(event: &egui::Event) -> f32 {
    match event {
        // With Shift held, some systems turn the wheel sideways.
        egui::Event::MouseWheel { unit, delta, .. } => match unit {
            egui::MouseWheelUnit::Point => (delta.x + delta.y) / POINTS_PER_NOTCH,
            egui::MouseWheelUnit::Line | egui::MouseWheelUnit::Page => delta.x + delta.y,
        },
        _ => 0.0,
    }
}
