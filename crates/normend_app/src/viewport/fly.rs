//! Flying through the scan: keys move the eye, a drag looks around.
//!
//! The keys are those at the places of W, A, S, D, Q and E on a keyboard with English letters, whatever is printed on them.

use egui::{Event, Key, Modifiers};
use glam::Vec3;

/// The part of the scene's radius that is flown in a second at speed 1: from the middle to the border in about three.
const RADII_PER_SEC: f32 = 0.35;
/// How much faster with Shift.
const FAST: f32 = 4.0;
/// Bounds of the speed that the wheel chooses.
const SPEEDS: std::ops::RangeInclusive<f32> = 1e-3..=1e2;
/// A frame that took longer moves as if it took this long, in seconds, so that a pause is no leap.
const MAX_STEP_SECS: f32 = 0.1;

/// The keys that move, and where they move the eye: right, up, forward.
const KEYS: [(Key, Vec3); 6] = [
    (Key::W, Vec3::Z),
    (Key::S, Vec3::NEG_Z),
    (Key::A, Vec3::NEG_X),
    (Key::D, Vec3::X),
    (Key::E, Vec3::Y),
    (Key::Q, Vec3::NEG_Y),
];

/// The user flies.
#[derive(Clone, Debug)]
pub(super) struct Fly {
    held: [bool; KEYS.len()],
    /// Times the usual speed.
    speed: f32,
}

impl Fly {
    /// At rest, at the usual speed.
    pub(super) fn new() -> Self {
        Self {
            held: [false; KEYS.len()],
            speed: 1.0,
        }
    }

    /// Takes the moving keys out of the input, so that they are no shortcuts.
    pub(super) fn take_keys(&mut self, ctx: &egui::Context) {
        ctx.input_mut(|input| input.events.retain(|event| !self.takes(event)));
    }

    fn takes(&mut self, event: &Event) -> bool {
        match event {
            Event::Key {
                key,
                physical_key,
                pressed,
                modifiers,
                ..
            } => {
                let meant = physical_key.unwrap_or(*key);
                let Some(index) = KEYS.iter().position(|(key, _)| *key == meant) else {
                    return false;
                };
                // With Ctrl or Alt it is a shortcut; its release ends a motion all the same.
                let is_plain = !(modifiers.command || modifiers.ctrl || modifiers.alt);
                self.held[index] = *pressed && is_plain;
                is_plain
            }
            // Keys that are released while another window has the keyboard are never heard of.
            Event::WindowFocused(false) => {
                self.stop();
                false
            }
            _ => false,
        }
    }

    /// All keys count as released.
    pub(super) fn stop(&mut self) {
        self.held = [false; KEYS.len()];
    }

    /// Whether a key is held.
    pub(super) fn is_moving(&self) -> bool {
        self.held.contains(&true)
    }

    /// Flies faster (> 1) or slower.
    pub(super) fn change_speed(&mut self, factor: f32) {
        if factor.is_finite() {
            self.speed = (self.speed * factor).clamp(*SPEEDS.start(), *SPEEDS.end());
        }
    }

    /// Times the usual speed.
    pub(super) fn speed(&self) -> f32 {
        self.speed
    }

    /// How far the eye moves in a frame: right, up and forward, in world lengths. `scene_radius` as well.
    pub(super) fn step(&self, modifiers: Modifiers, secs: f32, scene_radius: f32) -> Vec3 {
        let held = KEYS.iter().zip(self.held).filter(|(_, held)| *held);
        let direction: Vec3 = held.map(|((_, direction), _)| *direction).sum();
        let fast = if modifiers.shift { FAST } else { 1.0 };
        direction.normalize_or_zero() * (scene_radius * RADII_PER_SEC * self.speed * fast * secs.min(MAX_STEP_SECS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(key: Key, physical_key: Option<Key>, pressed: bool, modifiers: Modifiers) -> Event {
        Event::Key {
            key,
            physical_key,
            pressed,
            repeat: false,
            modifiers,
        }
    }

    #[test]
    fn keys_count_by_their_place_and_not_with_ctrl() {
        let mut fly = Fly::new();
        // On a French keyboard, Z is where W is.
        assert!(fly.takes(&key(Key::Z, Some(Key::W), true, Modifiers::NONE)));
        let step = fly.step(Modifiers::NONE, 0.05, 10.0);
        assert!(step.z > 0.0 && step.x == 0.0 && step.y == 0.0);
        assert_eq!(fly.step(Modifiers::SHIFT, 0.05, 10.0), FAST * step);
        assert!(fly.takes(&key(Key::Z, Some(Key::W), false, Modifiers::NONE)));
        assert!(!fly.is_moving());
        assert!(!fly.takes(&key(Key::S, Some(Key::S), true, Modifiers::COMMAND | Modifiers::CTRL)));
        assert!(!fly.takes(&key(Key::F, Some(Key::F), true, Modifiers::NONE)));
        assert!(!fly.is_moving());
    }

    #[test]
    fn opposite_keys_cancel_and_two_keys_are_not_faster_than_one() {
        let mut fly = Fly::new();
        for letter in [Key::A, Key::W] {
            fly.takes(&key(letter, None, true, Modifiers::NONE));
        }
        let step = fly.step(Modifiers::NONE, 0.1, 1.0);
        assert!((step.length() - 0.1 * RADII_PER_SEC).abs() < 1e-6, "{step}");
        fly.takes(&key(Key::S, None, true, Modifiers::NONE));
        fly.takes(&key(Key::D, None, true, Modifiers::NONE));
        assert_eq!(fly.step(Modifiers::NONE, 0.1, 1.0), Vec3::ZERO);
    }

    #[test]
    fn losing_the_keyboard_stops() {
        let mut fly = Fly::new();
        fly.takes(&key(Key::W, None, true, Modifiers::NONE));
        assert!(!fly.takes(&Event::WindowFocused(false)));
        assert!(!fly.is_moving());
    }

    #[test]
    fn the_speed_has_bounds_and_a_pause_is_no_leap() {
        let mut fly = Fly::new();
        for factor in [1e9, f32::NAN, f32::INFINITY] {
            fly.change_speed(factor);
        }
        assert_eq!(fly.speed(), *SPEEDS.end());
        fly.takes(&key(Key::W, None, true, Modifiers::NONE));
        assert_eq!(
            fly.step(Modifiers::NONE, 60.0, 1.0),
            fly.step(Modifiers::NONE, MAX_STEP_SECS, 1.0)
        );
    }
}
