//! A short smooth way of the camera from one view to another, so that the eye can follow. Any input ends it at its end.

use normend_render::Camera;

/// How long it takes, in seconds: long enough to follow, too short to wait for.
const FLIGHT_SECS: f64 = 0.25;

/// The camera is on its way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flight {
    from: Camera,
    to: Camera,
    /// When the first picture of it was drawn, in seconds; `None` before.
    started: Option<f64>,
}

impl Flight {
    /// Leaves with the next frame.
    pub(super) fn new(from: Camera, to: Camera) -> Self {
        Self {
            from,
            to,
            started: None,
        }
    }

    /// Where it ends.
    pub(super) fn to(&self) -> Camera {
        self.to
    }

    /// Whether it has left, so that input ends it; what started it does not.
    pub(super) fn is_under_way(&self) -> bool {
        self.started.is_some()
    }

    /// The camera at `now` (seconds), and whether it has arrived.
    pub(super) fn at(&mut self, now: f64) -> (Camera, bool) {
        let started = *self.started.get_or_insert(now);
        let t = ((now - started) / FLIGHT_SECS).clamp(0.0, 1.0) as f32;
        // It leaves and arrives gently.
        let eased = t * t * (3.0 - 2.0 * t);
        (self.from.toward(&self.to, eased), t >= 1.0)
    }
}

#[cfg(test)]
mod tests {
    use normend_render::{StandardView, UpAxis};

    use super::*;

    #[test]
    fn a_flight_begins_where_the_camera_is_and_ends_exactly_there() {
        let from = Camera::new(StandardView::Front, UpAxis::ZUp);
        let to = Camera::new(StandardView::Right, UpAxis::ZUp);
        let mut flight = Flight::new(from, to);
        assert!(!flight.is_under_way());
        let (first, arrived) = flight.at(100.0);
        assert!(!arrived && flight.is_under_way());
        assert!(first.back().distance(from.back()) < 1e-6);
        let (between, arrived) = flight.at(100.125);
        assert!(!arrived);
        assert!(between.back().distance(from.back()) > 0.3 && between.back().distance(to.back()) > 0.3);
        assert_eq!(flight.at(100.3), (to, true));
        assert_eq!(flight.to(), to);
    }
}
