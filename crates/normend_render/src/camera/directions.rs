//! Which way is up, and the views along the axes.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use glam::{Mat3, Vec3};

/// The axis that stands upright in the picture. Scans with y up come from modeling programs, with y down from cameras and
/// depth sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// z up, the front is seen along +y: surveying, most scanners.
    #[default]
    ZUp,
    /// y up, the front is seen along −z: modeling programs.
    YUp,
    /// y down, the front is seen along +z: cameras and depth sensors.
    YDown,
    /// z down, the front is seen along −y: bathymetry, aircraft.
    ZDown,
    /// x up, the front is seen along +z.
    XUp,
}

impl UpAxis {
    /// All choices, in the order of menus.
    pub const ALL: [Self; 5] = [Self::ZUp, Self::YUp, Self::YDown, Self::ZDown, Self::XUp];

    /// The name in menus ("z up").
    pub fn label(self) -> &'static str {
        match self {
            Self::ZUp => "z up",
            Self::YUp => "y up",
            Self::YDown => "y down",
            Self::ZDown => "z down",
            Self::XUp => "x up",
        }
    }

    /// The name in settings and on the command line ("+z").
    pub fn name(self) -> &'static str {
        match self {
            Self::ZUp => "+z",
            Self::YUp => "+y",
            Self::YDown => "-y",
            Self::ZDown => "-z",
            Self::XUp => "+x",
        }
    }

    /// The unit vector that points up, in world space.
    pub fn direction(self) -> Vec3 {
        self.frame().z_axis
    }

    /// The rotation from a world with z up and its front along +y: its columns point right, away and up, seen from the front.
    pub(super) fn frame(self) -> Mat3 {
        match self {
            Self::ZUp => Mat3::IDENTITY,
            Self::YUp => Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y),
            Self::YDown => Mat3::from_cols(Vec3::X, Vec3::Z, Vec3::NEG_Y),
            Self::ZDown => Mat3::from_cols(Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z),
            Self::XUp => Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X),
        }
    }
}

/// Views along an axis. The axes in words are those of a world with z up; with another [`UpAxis`] all turn along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandardView {
    /// From −y.
    Front,
    /// From +y.
    Back,
    /// From +x.
    Right,
    /// From −x.
    Left,
    /// From +z.
    Top,
    /// From −z.
    Bottom,
    /// From the corner between front, right and top.
    Corner,
}

impl StandardView {
    /// All views, in the order of menus.
    pub const ALL: [Self; 7] = [
        Self::Front,
        Self::Back,
        Self::Right,
        Self::Left,
        Self::Top,
        Self::Bottom,
        Self::Corner,
    ];

    /// The name in menus ("Front").
    pub fn label(self) -> &'static str {
        match self {
            Self::Front => "Front",
            Self::Back => "Back",
            Self::Right => "Right",
            Self::Left => "Left",
            Self::Top => "Top",
            Self::Bottom => "Bottom",
            Self::Corner => "Corner",
        }
    }

    /// The name on the command line ("front").
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Back => "back",
            Self::Right => "right",
            Self::Left => "left",
            Self::Top => "top",
            Self::Bottom => "bottom",
            Self::Corner => "corner",
        }
    }

    /// Azimuth and elevation in radians, see [`super::Camera::angles`].
    pub(super) fn angles(self) -> (f32, f32) {
        match self {
            Self::Front => (0.0, 0.0),
            Self::Back => (PI, 0.0),
            Self::Right => (FRAC_PI_2, 0.0),
            Self::Left => (-FRAC_PI_2, 0.0),
            Self::Top => (0.0, FRAC_PI_2),
            Self::Bottom => (0.0, -FRAC_PI_2),
            // The diagonal of a cube rises by asin(1/√3).
            Self::Corner => (FRAC_PI_4, 0.615_479_7),
        }
    }
}
