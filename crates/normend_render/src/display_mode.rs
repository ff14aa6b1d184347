//! How splats are colored: mode, palette, and the settings of one picture.

/// A way of coloring splats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DisplayMode {
    /// Front and back in two colors, with a headlight.
    #[default]
    Facing,
    /// Normals as colors: (n + 1)/2 as red, green, blue.
    Normals,
}

impl DisplayMode {
    /// All modes, in the order of menus.
    pub const ALL: [Self; 2] = [Self::Facing, Self::Normals];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Facing => "facing",
            Self::Normals => "normals",
        }
    }

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Facing => "Front and back",
            Self::Normals => "Normals as colors",
        }
    }

    /// The number that the shader knows this mode by.
    pub(crate) fn code(self) -> u32 {
        match self {
            Self::Facing => 0,
            Self::Normals => 1,
        }
    }
}

/// Colors of a picture, each as red, green, blue in 0..=1, gamma-encoded as displayed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Palette {
    /// Front side of a splat.
    pub front: [f32; 3],
    /// Back side of a splat.
    pub back: [f32; 3],
    /// Behind everything.
    pub background: [f32; 3],
    /// Mixed into the highlighted points.
    pub highlight: [f32; 3],
}

impl Palette {
    /// Blue front, orange back: told apart with every common kind of color blindness.
    pub const BLUE_ORANGE: Self = Self {
        front: [0.42, 0.66, 0.96],
        back: [0.95, 0.50, 0.16],
        background: [0.145, 0.155, 0.175],
        highlight: [1.0, 0.93, 0.25],
    };

    /// Light gray front, black back, on white, as the figures of Liu et al. show orientation.
    pub const PAPER: Self = Self {
        front: [0.86, 0.86, 0.84],
        back: [0.0, 0.0, 0.0],
        background: [1.0, 1.0, 1.0],
        highlight: [0.98, 0.55, 0.10],
    };
}

impl Default for Palette {
    fn default() -> Self {
        Self::BLUE_ORANGE
    }
}

/// How the next picture is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawSettings {
    /// Coloring.
    pub mode: DisplayMode,
    /// Colors.
    pub palette: Palette,
    /// Factor on all splat radii.
    pub splat_scale: f32,
    /// 1 draws every point; s draws each s-th with radii grown by √s, for a quick picture while the camera moves.
    pub stride: u32,
}

impl Default for DrawSettings {
    fn default() -> Self {
        Self {
            mode: DisplayMode::default(),
            palette: Palette::default(),
            splat_scale: 1.0,
            stride: 1,
        }
    }
}
