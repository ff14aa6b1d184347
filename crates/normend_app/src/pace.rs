//! How many splats are drawn while the camera moves: as many as the graphics adapter draws in time, all when it rests.

/// After this rest, in seconds, everything is drawn again.
const SETTLE_SECS: f64 = 0.15;
/// A frame while moving should take about this long.
const AIM_SECS: f32 = 0.033;
/// Frames this near to the aim change nothing.
const TOLERANCE: std::ops::RangeInclusive<f32> = 0.5..=1.8;
const MAX_STRIDE: u32 = 64;

/// The stride of the next picture, from the time of the last ones.
#[derive(Clone, Debug)]
pub struct Pace {
    stride: u32,
    /// What the last motion settled on, so that the next one begins with it.
    moving_stride: u32,
    last_moved: f64,
    /// The last frame moved and asked for this one at once, so the time between them is what a frame costs.
    measuring: bool,
}

impl Pace {
    /// Everything is drawn until a moving frame was slow.
    pub fn new() -> Self {
        Self {
            stride: 1,
            moving_stride: 1,
            last_moved: f64::NEG_INFINITY,
            measuring: false,
        }
    }

    /// 1 draws every splat, s each s-th.
    pub fn stride(&self) -> u32 {
        self.stride
    }

    /// Decides about the frame at `now` (seconds), which comes `frame_secs` after the last one. `moved`: the camera moved
    /// since; `held`: the user still holds it. Returns in how many seconds another frame is needed, if at all.
    pub fn frame(&mut self, moved: bool, held: bool, now: f64, frame_secs: f32) -> Option<f64> {
        if std::mem::take(&mut self.measuring) && !TOLERANCE.contains(&(frame_secs / AIM_SECS)) {
            let ratio = (frame_secs / AIM_SECS).clamp(0.5, 8.0);
            let wanted = (self.moving_stride as f32 * ratio).round() as u32;
            self.moving_stride = wanted.clamp(1, MAX_STRIDE);
        }
        if moved {
            self.last_moved = now;
            self.measuring = true;
            self.stride = self.moving_stride;
            return Some(0.0);
        }
        if self.stride == 1 || held {
            return None;
        }
        let left = self.last_moved + SETTLE_SECS - now;
        if left > 0.0 {
            return Some(left);
        }
        self.stride = 1;
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
            frame_secs = (whole_secs / pace.stride() as f32).max(0.004);
            now += f64::from(frame_secs);
        }
        pace.frame(false, true, now, frame_secs);
        now
    }

    #[test]
    fn slow_adapters_draw_less_while_moving_and_all_at_rest() {
        let mut pace = Pace::new();
        let now = move_for(&mut pace, 8, 1.0, 10.0);
        assert!((16..=64).contains(&pace.stride()), "{}", pace.stride());
        assert_eq!(pace.frame(false, true, now + 5.0, 5.0), None, "a held camera may go on");
        assert!(pace.stride() > 1);
        assert_eq!(pace.frame(false, false, now + 6.0, 1.0), None);
        assert_eq!(pace.stride(), 1);
        // The next motion begins where the last one ended, whatever the rest took.
        pace.frame(true, true, now + 60.0, 54.0);
        assert!((16..=64).contains(&pace.stride()), "{}", pace.stride());
    }

    #[test]
    fn fast_adapters_draw_everything() {
        let mut pace = Pace::new();
        move_for(&mut pace, 50, 0.010, 0.0);
        assert_eq!(pace.stride(), 1);
    }

    #[test]
    fn a_stride_that_is_no_longer_needed_goes_away() {
        let mut pace = Pace::new();
        let now = move_for(&mut pace, 8, 1.0, 0.0);
        move_for(&mut pace, 20, 0.010, now);
        assert_eq!(pace.stride(), 1);
    }
}
