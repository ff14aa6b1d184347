//! How splats are colored.

/// A way of coloring splats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DisplayMode {
    /// Front and back in two colors, with a headlight.
    #[default]
    Facing,
    /// Normals as colors.
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
}
