//! What the pointer does in the 3D view. Some tools act on what is under the pointer ([`point_tool`]); the others paint a mask
//! ([`painting`]).

mod aim;
mod combine;
mod hints;
pub mod mask;
pub mod painting;
pub mod point_tool;

pub use combine::Combine;
pub use hints::{Hint, How};

use crate::command::Command;

/// What the pointer is for in the 3D view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// Turn the wrong region under the pointer.
    #[default]
    Mend,
    /// Select under a disc that is dragged along.
    Brush,
    /// Select within a line drawn by hand.
    Lasso,
    /// Select within a rectangle.
    Rectangle,
    /// Select within a polygon of clicked corners.
    Polygon,
    /// Select the patch under the pointer.
    Patch,
    /// Select all that hangs together with what is under the pointer.
    Component,
}

impl Tool {
    /// All tools, in the order of the toolbar.
    pub const ALL: [Self; 7] = [
        Self::Mend,
        Self::Brush,
        Self::Lasso,
        Self::Rectangle,
        Self::Polygon,
        Self::Patch,
        Self::Component,
    ];

    /// The name in the toolbar and in the sheet of shortcuts.
    pub fn label(self) -> &'static str {
        match self {
            Self::Mend => "Mend",
            Self::Brush => "Brush",
            Self::Lasso => "Lasso",
            Self::Rectangle => "Rectangle",
            Self::Polygon => "Polygon",
            Self::Patch => "Patch",
            Self::Component => "Component",
        }
    }

    /// The command that chooses it, with its tooltip and keys.
    pub fn command(self) -> Command {
        match self {
            Self::Mend => Command::MendTool,
            Self::Brush => Command::BrushTool,
            Self::Lasso => Command::LassoTool,
            Self::Rectangle => Command::RectangleTool,
            Self::Polygon => Command::PolygonTool,
            Self::Patch => Command::PatchTool,
            Self::Component => Command::ComponentTool,
        }
    }

    /// Whether the main button paints a mask instead of turning the view.
    pub fn paints(self) -> bool {
        match self {
            Self::Brush | Self::Lasso | Self::Rectangle | Self::Polygon => true,
            Self::Mend | Self::Patch | Self::Component => false,
        }
    }
}

/// What a tool asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum ToolEvent {
    /// Change the document.
    Edit(normend_core::Edit),
    /// Select these points.
    Select {
        /// What was picked.
        points: normend_core::PointSet,
        /// How it joins what is selected.
        combine: Combine,
    },
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
