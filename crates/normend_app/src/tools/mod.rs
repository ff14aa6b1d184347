//! What the pointer does in the 3D view: each tool turns pointer events into points.

pub mod mend;

/// What the pointer is for in the 3D view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// Turn the wrong region under the pointer.
    #[default]
    Mend,
}

impl Tool {
    /// How it is used, in one line.
    pub fn hint(self) -> &'static str {
        match self {
            Self::Mend => "Mend: point at a wrong region, click to turn what is highlighted",
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
