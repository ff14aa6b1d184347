//! What is remembered of how the scan is shown.

use std::ops::RangeInclusive;

use normend_render::{Hair, HairLen};
use serde::{Deserialize, Serialize};

/// Lengths of hair, in points of the user interface.
pub const HAIR_LENGTHS: RangeInclusive<f32> = 4.0..=60.0;
/// From one hair to the next, in points of the scan.
pub const HAIR_STEPS: RangeInclusive<u32> = 1..=200;

/// How the scan is shown, apart from its coloring.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DisplaySettings {
    /// Normals are shown as lines.
    pub hair: bool,
    /// How long, in points of the user interface.
    pub hair_length: f32,
    /// From one hair to the next, in points of the scan.
    pub hair_step: u32,
    /// Sources and pins are shown as spheres.
    pub spheres: bool,
    /// How dark edges and creases are, 0 to 1.
    pub eye_dome: f32,
    /// Bars of histograms grow with the logarithm.
    pub log_bars: bool,
}

impl Default for DisplaySettings {
    fn default() -> Self {
        Self {
            hair: false,
            hair_length: 14.0,
            hair_step: 4,
            spheres: true,
            eye_dome: 0.5,
            log_bars: false,
        }
    }
}

impl DisplaySettings {
    /// The hair as the renderer draws it, when there is any.
    pub fn hair(&self, pixels_per_point: f32) -> Option<Hair> {
        self.hair.then_some(Hair {
            len: HairLen::Pixels(self.hair_length * pixels_per_point),
            every: self.hair_step,
            color: None,
        })
    }

    /// Brings every value into its bounds.
    pub(super) fn into_sane(mut self) -> Self {
        let default = Self::default();
        let sane = |value: f32, bounds: RangeInclusive<f32>, default: f32| {
            let value = if value.is_finite() { value } else { default };
            value.clamp(*bounds.start(), *bounds.end())
        };
        self.hair_length = sane(self.hair_length, HAIR_LENGTHS, default.hair_length);
        self.eye_dome = sane(self.eye_dome, 0.0..=1.0, default.eye_dome);
        self.hair_step = self.hair_step.clamp(*HAIR_STEPS.start(), *HAIR_STEPS.end());
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_out_of_range_are_tamed() {
        let wild = DisplaySettings {
            hair_length: f32::NAN,
            hair_step: 0,
            eye_dome: 7.0,
            ..DisplaySettings::default()
        };
        let sane = wild.into_sane();
        assert_eq!((sane.hair_length, sane.hair_step, sane.eye_dome), (14.0, 1, 1.0));
    }
}
