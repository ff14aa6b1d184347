//! How each tool is used: the rows behind the hint line of the status bar and the sheet of shortcuts.

use super::Tool;
use crate::command::Command;

/// What the user does to get something done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum How {
    /// With the pointer, in words ("Alt+click").
    Pointer(&'static str),
    /// With the keys of a command.
    Keys(Command),
}

/// One thing that a tool does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hint {
    /// What is done.
    pub what: &'static str,
    /// How.
    pub how: How,
}

impl Hint {
    /// Something done with the pointer.
    pub const fn pointer(how: &'static str, what: &'static str) -> Self {
        Self {
            what,
            how: How::Pointer(how),
        }
    }

    /// Something done with the keys of a command.
    pub const fn keys(command: Command, what: &'static str) -> Self {
        Self {
            what,
            how: How::Keys(command),
        }
    }

    /// Whether it says how to choose among patches, which only some propagations have.
    pub fn is_about_sizes(&self) -> bool {
        *self == RESIZE
    }

    /// How, in words, with the user's keys; `None` for a command without keys.
    pub fn how_text(&self, ctx: &egui::Context) -> Option<String> {
        match self.how {
            How::Pointer(how) => Some(how.to_owned()),
            How::Keys(command) => Some(command.keys_text(ctx)).filter(|keys| !keys.is_empty()),
        }
    }
}

impl Tool {
    /// How it is used, the most important first: a narrow window shows only the first ones.
    pub fn hints(self) -> &'static [Hint] {
        match self {
            Self::Mend => MEND,
            Self::Brush => BRUSH,
            Self::Lasso => LASSO,
            Self::Rectangle => RECTANGLE,
            Self::Polygon => POLYGON,
            Self::Patch => PATCH,
            Self::Component => COMPONENT,
        }
    }
}

const COMBINE: Hint = Hint::pointer("Shift adds, Ctrl removes, both intersect", "with what is selected");
const THROUGH: Hint = Hint::keys(Command::VisibleOnly, "Visible only, or through");
const ORBIT: Hint = Hint::pointer("Right drag or Alt+drag", "Orbit");
const PAN: Hint = Hint::pointer("Middle or Shift+right drag", "Pan");
const RESIZE: Hint = Hint::pointer("Press, turn the wheel, release", "Larger or smaller patch");
const MENU: Hint = Hint::pointer("Right click", "What can be done here");

const MEND: &[Hint] = &[
    Hint::pointer("Click", "Mend here"),
    RESIZE,
    Hint::pointer("Ctrl+click", "Turn whole region here"),
    Hint::pointer("Alt+click", "Mend along the tree here"),
    Hint::pointer("Click a sphere (Shift adds)", "Select a source"),
    MENU,
];

const BRUSH: &[Hint] = &[
    Hint::pointer("Drag", "Select under the brush"),
    COMBINE,
    Hint::pointer("Alt+wheel", "Brush size"),
    Hint::keys(Command::LargerPatch, "Larger brush"),
    Hint::keys(Command::SmallerPatch, "Smaller brush"),
    THROUGH,
    ORBIT,
    PAN,
    MENU,
];

const LASSO: &[Hint] = &[
    Hint::pointer("Drag around", "Select within the line"),
    COMBINE,
    THROUGH,
    ORBIT,
    PAN,
    MENU,
];

const RECTANGLE: &[Hint] = &[
    Hint::pointer("Drag from corner to corner", "Select within the rectangle"),
    COMBINE,
    THROUGH,
    ORBIT,
    PAN,
    MENU,
];

const POLYGON: &[Hint] = &[
    Hint::pointer("Click corners", "Select within the polygon"),
    Hint::pointer("Double-click, the first corner, or Enter", "Close"),
    Hint::pointer("Backspace", "Take a corner back"),
    COMBINE,
    THROUGH,
    ORBIT,
    PAN,
    MENU,
];

const PATCH: &[Hint] = &[Hint::pointer("Click", "Select the patch"), RESIZE, COMBINE, MENU];

const COMPONENT: &[Hint] = &[Hint::pointer("Click", "Select the component"), COMBINE, MENU];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn menu_and_mouse_call_the_same_thing_the_same() {
        for command in [Command::MendHere, Command::MendAlongTreeHere, Command::TurnWholeHere] {
            assert!(MEND.iter().any(|hint| hint.what == command.label()), "{command:?}");
        }
    }

    #[test]
    fn every_tool_says_how_it_is_used() {
        let ctx = egui::Context::default();
        for tool in Tool::ALL {
            assert!(!tool.hints().is_empty(), "{tool:?}");
            for hint in tool.hints() {
                assert!(hint.how_text(&ctx).is_some(), "{hint:?} has no key");
            }
        }
        assert_eq!(Hint::keys(Command::Undo, "Undo").how_text(&ctx).unwrap(), "Ctrl+Z");
        assert_eq!(Hint::keys(Command::About, "About").how_text(&ctx), None);
    }
}
