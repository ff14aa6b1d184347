//! What the pointer does in the 3D view: each tool turns pointer events into points.

mod hints;
pub mod mend;

pub use hints::{Hint, How};

/// What the pointer is for in the 3D view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// Turn the wrong region under the pointer.
    #[default]
    Mend,
}

impl Tool {
    /// All tools, in the order of the toolbar.
    pub const ALL: [Self; 1] = [Self::Mend];

    /// The name in the toolbar and in the sheet of shortcuts.
    pub fn label(self) -> &'static str {
        match self {
            Self::Mend => "Mend",
        }
    }
}

/// What a tool asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum ToolEvent {
    /// Change the sources.
    Edit(normend_core::Edit),
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
