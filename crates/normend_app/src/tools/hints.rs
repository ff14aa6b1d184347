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
        }
    }
}

const MEND: &[Hint] = &[
    Hint::pointer("Click", "Mend here"),
    Hint::pointer("Press, turn the wheel, release", "Larger or smaller patch"),
    Hint::pointer("Ctrl+click", "Turn whole region here"),
    Hint::pointer("Alt+click", "Mend along the tree here"),
    Hint::pointer("Click a sphere (Shift adds)", "Select a source"),
];

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
