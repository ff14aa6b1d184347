//! In how much detail the picture is drawn while the camera moves: as much as the graphics adapter draws in time, all when
//! it rests.
//!
//! First the picture gets coarser, because that shows the same surfaces with the same colors. Only when that is not enough
//! are splats left out and the others grown, which hides and invents small patches.

/// After this rest, in seconds, everything is drawn again.
const SETTLE_SECS: f64 = 0.15;
/// A frame while moving should take about this long.
const AIM_SECS: f32 = 0.04;
/// Frames this near to the aim change nothing.
const TOLERANCE: std::ops::RangeInclusive<f32> = 0.5..=2.0;
/// The coarsest picture has a pixel for a square of so many pixels of the screen each way.
const MAX_PIXEL_SIDE: u32 = 3;
const MAX_STRIDE: u32 = 16;
const MAX_SAVING: u32 = MAX_PIXEL_SIDE * MAX_PIXEL_SIDE * MAX_STRIDE;

/// How a picture is made cheaper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Detail {
    /// A pixel of the picture covers a square of this many pixels of the screen each way.
    pub pixel_side: u32,
    /// 1 draws every splat, s each s-th.
    pub stride: u32,
}

impl Detail {
    /// The detail that makes a picture about `saving` times cheaper.
    fn of_saving(saving: u32) -> Self {
        let pixel_side = (1..=MAX_PIXEL_SIDE)
            .find(|side| side * side >= saving)
            .unwrap_or(MAX_PIXEL_SIDE);
        Self {
            pixel_side,
            stride: saving.div_ceil(pixel_side * pixel_side).clamp(1, MAX_STRIDE),
        }
    }
}

/// The detail of the next picture, from the time of the last ones.
#[derive(Clone, Debug)]
pub struct Pace {
    /// How many times cheaper the picture is made.
    saving: u32,
    /// What the last motion settled on, so that the next one begins with it.
    moving_saving: u32,
    last_moved: f64,
    /// The last frame moved and asked for this one at once, so the time between them is what a frame costs.
    measuring: bool,
}

impl Pace {
    /// Everything is drawn until a moving frame was slow.
    pub fn new() -> Self {
        Self {
            saving: 1,
            moving_saving: 1,
            last_moved: f64::NEG_INFINITY,
            measuring: false,
        }
    }

    /// How the next picture is drawn.
    pub fn detail(&self) -> Detail {
        Detail::of_saving(self.saving)
    }

    /// Whether the next picture is drawn in full.
    pub fn is_full(&self) -> bool {
        self.saving == 1
    }

    /// Decides about the frame at `now` (seconds), which comes `frame_secs` after the last one. `moved`: the camera moved
    /// since; `held`: the user still holds it. Returns in how many seconds another frame is needed, if at all.
    pub fn frame(&mut self, moved: bool, held: bool, now: f64, frame_secs: f32) -> Option<f64> {
        if std::mem::take(&mut self.measuring) && !TOLERANCE.contains(&(frame_secs / AIM_SECS)) {
            let ratio = (frame_secs / AIM_SECS).clamp(0.5, 8.0);
            let wanted = (self.moving_saving as f32 * ratio).round() as u32;
            self.moving_saving = wanted.clamp(1, MAX_SAVING);
        }
        if moved {
            self.last_moved = now;
            self.measuring = true;
            self.saving = self.moving_saving;
            return Some(0.0);
        }
        if self.saving == 1 || held {
            return None;
        }
        let left = self.last_moved + SETTLE_SECS - now;
        if left > 0.0 {
            return Some(left);
        }
        self.saving = 1;
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Moves for `n_frames` on an adapter that draws everything in `whole_secs`; returns the time after it.
    fn move_for(pace: &mut Pace, n_frames: usize, whole_secs: f32, mut now: f64) -> f64 {
        let mut frame_secs = 1.0;
        for _ in 0..n_frames {
            assert_eq!(pace.frame(true, true, now, frame_secs), Some(0.0));
            frame_secs = (whole_secs / pace.saving as f32).max(0.004);
            now += f64::from(frame_secs);
        }
        pace.frame(false, true, now, frame_secs);
        now
    }

    #[test]
    fn slow_adapters_draw_less_while_moving_and_all_at_rest() {
        let mut pace = Pace::new();
        let now = move_for(&mut pace, 8, 1.0, 10.0);
        assert!((13..=64).contains(&pace.saving), "{}", pace.saving);
        assert_eq!(pace.frame(false, true, now + 5.0, 5.0), None, "a held camera may go on");
        assert!(!pace.is_full());
        assert_eq!(pace.frame(false, false, now + 6.0, 1.0), None);
        assert!(pace.is_full());
        // The next motion begins where the last one ended, whatever the rest took.
        pace.frame(true, true, now + 60.0, 54.0);
        assert!((13..=64).contains(&pace.saving), "{}", pace.saving);
    }

    #[test]
    fn fast_adapters_draw_everything() {
        let mut pace = Pace::new();
        move_for(&mut pace, 50, 0.010, 0.0);
        assert!(pace.is_full());
    }

    #[test]
    fn a_saving_that_is_no_longer_needed_goes_away() {
        let mut pace = Pace::new();
        let now = move_for(&mut pace, 8, 1.0, 0.0);
        move_for(&mut pace, 20, 0.010, now);
        assert!(pace.is_full());
    }

    #[test]
    fn the_picture_gets_coarse_before_splats_are_left_out() {
        let check = |saving, pixel_side, stride| {
            assert_eq!(Detail::of_saving(saving), Detail { pixel_side, stride }, "{saving}");
        };
        check(1, 1, 1);
        check(2, 2, 1);
        check(4, 2, 1);
        check(9, 3, 1);
        check(10, 3, 2);
        check(MAX_SAVING, 3, MAX_STRIDE);
    }
}
