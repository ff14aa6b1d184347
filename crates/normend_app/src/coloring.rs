//! The ways of coloring that the user chooses from, and the color that each gives to a point.
//!
//! Not here: when points are painted anew, see [`crate::paint`]; what is front and back, which the renderer knows by itself.

use std::ops::Range;

use normend_core::evidence::Vote;
use normend_core::{Orientation, Propagation};
use normend_render::DisplayMode;
use rayon::prelude::*;

/// A way of coloring points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coloring {
    /// Front and back in two colors.
    #[default]
    Facing,
    /// One color in the light of a lamp.
    Lit,
    /// Normals as colors.
    Normals,
    /// How sure the automatic method is of each side.
    Confidence,
    /// Where evidence says the opposite of what is shown.
    Conflict,
    /// Each region in a color of its own.
    Regions,
    /// The colors of the file.
    File,
    /// A column of numbers of the file.
    Scalar,
    /// Each file of the scan in a color of its own.
    Layers,
}

impl Coloring {
    /// All ways, in the order of lists.
    pub const ALL: [Self; 9] = [
        Self::Facing,
        Self::Lit,
        Self::Normals,
        Self::Confidence,
        Self::Conflict,
        Self::Regions,
        Self::File,
        Self::Scalar,
        Self::Layers,
    ];

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Facing => "Front and back",
            Self::Lit => "Lit surface",
            Self::Normals => "Normals as colors",
            Self::Confidence => "Confidence",
            Self::Conflict => "Evidence conflict",
            Self::Regions => "Regions",
            Self::File => "Colors of the file",
            Self::Scalar => "Values of the file",
            Self::Layers => "Layers",
        }
    }

    /// What it shows, in a sentence.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Facing => "The side that normals point to in one color, the other side in another",
            Self::Lit => "One color in the light of a lamp beside you; back sides are dark",
            Self::Normals => "The direction of each normal as red, green and blue",
            Self::Confidence => "How likely each normal is on its right side, by the automatic method",
            Self::Conflict => "Where what is known of the sides speaks against the side that is shown",
            Self::Regions => "What turns together, each region in a color of its own",
            Self::File => "Red, green and blue as the file has them",
            Self::Scalar => "Any column of numbers in the file",
            Self::Layers => "Each file of the scan in a color of its own",
        }
    }

    /// What the renderer draws for it.
    pub fn mode(self) -> DisplayMode {
        match self {
            Self::Facing => DisplayMode::Facing,
            Self::Lit => DisplayMode::Lit,
            Self::Normals => DisplayMode::Normals,
            Self::Confidence | Self::Conflict | Self::Regions | Self::File | Self::Scalar | Self::Layers => {
                DisplayMode::Colors
            }
        }
    }

    /// Whether points must be painted for it.
    pub fn is_painted(self) -> bool {
        self.mode() == DisplayMode::Colors
    }

    /// Whether its colors change with the signs.
    pub fn depends_on_signs(self) -> bool {
        matches!(self, Self::Conflict | Self::Regions)
    }
}

/// Colors of the first files, those of Okabe and Ito's palette that lie between light and dark; further ones are told apart by hue.
const LAYERS: [[u8; 3]; 6] = [
    [86, 180, 233],
    [230, 159, 0],
    [0, 158, 115],
    [204, 121, 167],
    [240, 228, 66],
    [0, 114, 178],
];

/// The color of the file with this index, as the renderer takes it.
pub fn of_layer(index: usize) -> u32 {
    match LAYERS.get(index) {
        Some(&[red, green, blue]) => u32::from_le_bytes([red, green, blue, 255]),
        None => of_region(index as u32),
    }
}

/// A color as displayed: red, green, blue in 0..=1.
pub type Rgb = [f32; 3];

/// No color: the renderer shows its color of surfaces instead.
pub const NO_COLOR: u32 = 0;
/// Points whose side is a coin's throw: apart from every color of the scale.
pub const UNDECIDED: Rgb = [0.93, 0.36, 0.13];
/// Where nothing speaks against the shown side.
pub const AGREED: Rgb = [0.80, 0.80, 0.78];
/// Where nothing is known of the side.
pub const UNKNOWN: Rgb = [0.45, 0.52, 0.62];
/// Where all that is known speaks against the shown side: vermilion of Okabe and Ito's palette for all kinds of color vision.
pub const AGAINST: Rgb = [0.835, 0.369, 0.0];

/// Viridis by Stéfan van der Walt and Nathaniel Smith (CC0), at eleven even steps: lightness grows evenly, and it is told apart
/// with every kind of color vision.
const SCALE: [Rgb; 11] = [
    [0.267, 0.005, 0.329],
    [0.282, 0.145, 0.462],
    [0.255, 0.267, 0.529],
    [0.208, 0.376, 0.553],
    [0.165, 0.471, 0.557],
    [0.129, 0.565, 0.549],
    [0.133, 0.659, 0.518],
    [0.263, 0.749, 0.443],
    [0.478, 0.820, 0.3176],
    [0.733, 0.875, 0.153],
    [0.993, 0.906, 0.144],
];

/// The color of the scale at `share` in 0..=1.
pub fn scale(share: f32) -> Rgb {
    let at = share.clamp(0.0, 1.0) * (SCALE.len() - 1) as f32;
    let index = (at as usize).min(SCALE.len() - 2);
    mix(SCALE[index], SCALE[index + 1], at - index as f32)
}

/// The color of a conflict of `share` in 0..=1.
pub fn conflict_scale(share: f32) -> Rgb {
    mix(AGREED, AGAINST, share.clamp(0.0, 1.0))
}

fn mix(a: Rgb, b: Rgb, share: f32) -> Rgb {
    [0, 1, 2].map(|channel| a[channel] + (b[channel] - a[channel]) * share)
}

/// As the renderer takes it: RGBA8 with red in the lowest byte, opaque.
pub fn packed(color: Rgb) -> u32 {
    let [red, green, blue] = color.map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8);
    u32::from_le_bytes([red, green, blue, 255])
}

/// The color of a value in `range`; none for what is not finite.
pub fn of_value(value: f64, [low, high]: [f64; 2]) -> u32 {
    if !value.is_finite() {
        return NO_COLOR;
    }
    let share = if high > low { (value - low) / (high - low) } else { 0.5 };
    packed(scale(share as f32))
}

/// The color of a confidence in units of 1/255.
pub fn of_confidence(confidence: u8) -> u32 {
    packed(if confidence <= normend_core::confidence::UNDECIDED {
        UNDECIDED
    } else {
        scale(f32::from(confidence) / 255.0)
    })
}

/// The color of the region called `name`: any hue, three lightnesses, the same for the same name always.
pub fn of_region(name: u32) -> u32 {
    // Fibonacci hashing: names that follow each other land far apart.
    let hash = name.wrapping_add(1).wrapping_mul(0x9e37_79b9);
    let hue = (hash >> 8) as f32 / (1 << 24) as f32 * std::f32::consts::TAU;
    let lightness = 0.60 + 0.11 * (hash >> 5 & 3).min(2) as f32;
    packed(of_lightness_and_hue(lightness, hue))
}

/// A color of even chroma in Oklab (Björn Ottosson, 2020, public domain).
fn of_lightness_and_hue(lightness: f32, hue: f32) -> Rgb {
    // As much as most hues of these lightnesses have in sRGB.
    const CHROMA: f32 = 0.125;
    let (b, a) = (CHROMA * hue.sin(), CHROMA * hue.cos());
    let l = (lightness + 0.396_337_78 * a + 0.215_803_76 * b).powi(3);
    let m = (lightness - 0.105_561_346 * a - 0.063_854_17 * b).powi(3);
    let s = (lightness - 0.089_484_18 * a - 1.291_485_5 * b).powi(3);
    let linear = [
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_94 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_4 * s,
        -0.004_196_086_3 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    ];
    linear.map(|value| {
        let value = value.clamp(0.0, 1.0);
        if value <= 0.003_130_8 {
            12.92 * value
        } else {
            1.055 * value.powf(1.0 / 2.4) - 0.055
        }
    })
}

/// The colors of [`Coloring::Conflict`] for the positions of `range`. O(positions), parallel.
pub fn conflict_colors(propagation: &Propagation, orientation: &Orientation, range: Range<u32>) -> Vec<u32> {
    range
        .into_par_iter()
        .map(|position| match conflict(propagation, orientation, position) {
            Some(share) => packed(conflict_scale(share)),
            None => packed(UNKNOWN),
        })
        .collect()
}

/// How much of what is known of a position speaks against its shown sign, in 0..=1; `None` where nothing is known.
///
/// The largest of three: its vote against the sign; the share of its couplings that the automatic result violates; 1 where the
/// edge to its parent says that the two signs do not belong together.
pub fn conflict(propagation: &Propagation, orientation: &Orientation, position: u32) -> Option<f32> {
    let tree = &propagation.tree;
    let point = tree.order()[position as usize];
    let is_turned = orientation.is_turned(position);
    let vote: Option<Vote> = propagation
        .evidence
        .as_ref()
        .map(|evidence| evidence.votes()[point as usize]);
    // As much as a third of a look counts as known, as elsewhere.
    let vote = vote.filter(|vote| vote.visible() >= 1.0 / 3.0);
    let against = vote.map(|vote| if is_turned { vote.pull() } else { -vote.pull() });
    let patches = propagation.patches.as_ref();
    let violated = patches.map(|patches| 0.5 * (1.0 - patches.find(point, 1).strength()));
    let is_broken = tree
        .parent(position)
        .is_some_and(|parent| (is_turned != tree.phi(position)) != (orientation.is_turned(parent) != tree.phi(parent)));
    let broken = is_broken.then_some(1.0);
    let known = [against, violated.filter(|_| vote.is_some()), broken];
    known
        .into_iter()
        .flatten()
        .reduce(f32::max)
        .map(|share| share.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn oklab_lightness(color: Rgb) -> f32 {
        let linear = color.map(|value| {
            if value <= 0.04045 {
                value / 12.92
            } else {
                ((value + 0.055) / 1.055).powf(2.4)
            }
        });
        let cone = |weights: Rgb| {
            (0..3)
                .map(|channel| weights[channel] * linear[channel])
                .sum::<f32>()
                .cbrt()
        };
        0.210_454_26 * cone([0.412_221_46, 0.536_332_55, 0.051_445_995])
            + 0.793_617_8 * cone([0.211_903_5, 0.680_699_5, 0.107_396_96])
            - 0.004_072_047 * cone([0.088_302_46, 0.281_718_85, 0.629_978_7])
    }

    #[test]
    fn the_scale_grows_lighter_evenly() {
        let lightness: Vec<f32> = (0..=20)
            .map(|step| oklab_lightness(scale(step as f32 / 20.0)))
            .collect();
        let steps: Vec<f32> = lightness.windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(steps.iter().all(|&step| (0.01..0.06).contains(&step)), "{steps:?}");
        assert_eq!(scale(-1.0), SCALE[0]);
        assert_eq!(scale(2.0), SCALE[10]);
    }

    #[test]
    fn values_that_are_none_have_no_color() {
        assert_eq!(of_value(f64::NAN, [0.0, 1.0]), NO_COLOR);
        assert_eq!(of_value(0.0, [0.0, 1.0]), packed(SCALE[0]));
        assert_eq!(of_value(5.0, [0.0, 1.0]), packed(SCALE[10]));
        assert_eq!(of_value(7.0, [7.0, 7.0]), packed(scale(0.5)), "all values are the same");
        assert_eq!(of_confidence(128), packed(UNDECIDED));
        assert_eq!(of_confidence(255), packed(SCALE[10]));
    }

    #[test]
    fn regions_have_their_lightness_and_differ() {
        let colors: std::collections::BTreeSet<u32> = (0..200).map(of_region).collect();
        assert!(colors.len() > 190, "{} colors", colors.len());
        for name in 0..200 {
            let [red, green, blue, alpha] = of_region(name).to_le_bytes();
            let lightness = oklab_lightness([red, green, blue].map(|channel| f32::from(channel) / 255.0));
            assert!((0.55..0.87).contains(&lightness) && alpha == 255, "{name}: {lightness}");
        }
    }
}
