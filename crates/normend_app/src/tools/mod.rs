//! What the pointer does in the 3D view: each tool turns pointer events into points.

pub mod mend;

/// A tool of the toolbar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// Turn the wrong region under the pointer.
    #[default]
    Mend,
}

impl Tool {
    /// All tools, in the order of the toolbar.
    pub const ALL: [Self; 1] = [Self::Mend];

    /// The name in the toolbar.
    pub fn label(self) -> &'static str {
        match self {
            Self::Mend => "Mend",
        }
    }

    /// What it does, in a few words.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Mend => "Point at a wrong region: what a click would turn is highlighted. Click to turn it.",
        }
    }
}

/// What a tool asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ToolEvent {
    /// Mend at this point.
    Mend(u32),
    /// Turn all that hangs together with this point.
    TurnWhole(u32),
    /// Select the source at this point.
    SelectSource {
        /// The point's id.
        point: u32,
        /// Keep the others selected.
        extend: bool,
    },
    /// A click on the background.
    Deselect,
    /// Turn the view around this world point.
    Pivot(glam::Vec3),
}
