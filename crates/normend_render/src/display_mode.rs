//! How splats are colored: mode, palette, and the settings of one picture.

use glam::Vec3;

/// A way of coloring splats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DisplayMode {
    /// Front and back in two colors, with a headlight.
    #[default]
    Facing,
    /// One neutral color in the light of a lamp beside the eye; back sides dark.
    Lit,
    /// Normals as colors: (n + 1)/2 as red, green, blue.
    Normals,
    /// The colors given to [`crate::SplatRenderer::set_colors`], lightly shaded; without any, as [`Self::Lit`].
    Colors,
}

impl DisplayMode {
    /// All modes, in the order of menus.
    pub const ALL: [Self; 4] = [Self::Facing, Self::Lit, Self::Normals, Self::Colors];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Facing => "facing",
            Self::Lit => "lit",
            Self::Normals => "normals",
            Self::Colors => "colors",
        }
    }

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Facing => "Front and back",
            Self::Lit => "Lit surface",
            Self::Normals => "Normals as colors",
            Self::Colors => "Colors of the points",
        }
    }

    /// The number that the shader knows this mode by.
    pub(crate) fn code(self) -> u32 {
        match self {
            Self::Facing => 0,
            Self::Lit => 1,
            Self::Normals => 2,
            Self::Colors => 3,
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
    /// Stripes and outline of the selected points.
    pub selected: [f32; 3],
    /// Surfaces that are shown in one color.
    pub surface: [f32; 3],
    /// Balls on wrong points.
    pub wrong: [f32; 3],
}

impl Palette {
    /// Blue front, orange back: told apart with every common kind of color blindness.
    pub const BLUE_ORANGE: Self = Self {
        front: [0.42, 0.66, 0.96],
        back: [0.95, 0.50, 0.16],
        background: [0.145, 0.155, 0.175],
        highlight: [1.0, 0.93, 0.25],
        selected: [0.86, 0.10, 0.58],
        surface: [0.80, 0.79, 0.77],
        wrong: [0.01, 0.02, 0.30],
    };

    /// Light gray front, black back, on white, as the figures of Liu et al. show orientation.
    pub const PAPER: Self = Self {
        front: [0.86, 0.86, 0.84],
        back: [0.0, 0.0, 0.0],
        background: [1.0, 1.0, 1.0],
        highlight: [0.98, 0.55, 0.10],
        wrong: [0.06, 0.13, 0.86],
        ..Self::BLUE_ORANGE
    };
}

impl Default for Palette {
    fn default() -> Self {
        Self::BLUE_ORANGE
    }
}

/// Normals drawn as short lines from the points that are seen, hidden by nearer surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hair {
    /// How long.
    pub len: HairLen,
    /// 1 draws a hair on every drawn instance, m on each m-th; 0 counts as 1.
    pub every: u32,
    /// One color for all; none for the color of the side that the normal shows to the eye.
    pub color: Option<[f32; 3]>,
}

/// Length of a hair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HairLen {
    /// In pixels of the picture, at any distance.
    Pixels(f32),
    /// In world length.
    World(f32),
}

/// What is cut away: instances whose center lies there are neither drawn nor picked, and spheres there are not drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clip {
    /// How far into the scene nothing is drawn: 0 at its nearest point (or at the eye, when that is inside), 1 at its
    /// farthest. 0 cuts nothing.
    pub near: f32,
    /// Low and high corner, in world space, of a box outside of which nothing is drawn.
    pub bounds: Option<[Vec3; 2]>,
    /// A slab outside of which nothing is drawn.
    pub section: Option<Section>,
}

/// A slab of world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// In the middle of the slab.
    pub point: Vec3,
    /// Across the slab, of any length but zero.
    pub direction: Vec3,
    /// World length from one side to the other.
    pub thickness: f32,
}

/// Where the signs given to [`crate::SplatRenderer::set_compared`] are shown instead of the present ones. Without any
/// such signs the present ones are shown everywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Compare {
    /// Nowhere.
    #[default]
    Off,
    /// Left of so many pixels of the picture, with a line there.
    Split(f32),
    /// Everywhere.
    All,
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
    /// Eye-dome lighting: how dark edges and creases are, 0 to 1.
    pub eye_dome: f32,
    /// How far what is not selected fades into the background, 0 to 1.
    pub dim_unselected: f32,
    /// What is cut away.
    pub clip: Clip,
    /// Which signs are shown where.
    pub compare: Compare,
    /// Normals as lines.
    pub hair: Option<Hair>,
    /// Whether the spheres are drawn.
    pub spheres: bool,
}

impl Default for DrawSettings {
    fn default() -> Self {
        Self {
            mode: DisplayMode::default(),
            palette: Palette::default(),
            splat_scale: 1.0,
            stride: 1,
            eye_dome: 0.5,
            dim_unselected: 0.0,
            clip: Clip::default(),
            compare: Compare::default(),
            hair: None,
            spheres: true,
        }
    }
}
