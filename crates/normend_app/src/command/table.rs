//! Every command of the editor, in the order of the menus: one row is one command.
//!
//! A row is `Name: Menu group, "Label", "Tooltip", [keys];`. The name is also what the settings call the command, so it is
//! never changed. Commands of one group stand between the same two lines of a menu.

use egui::{Key, KeyboardShortcut, Modifiers};

use super::Menu;

const fn key(logical_key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::NONE, logical_key)
}

const fn ctrl(logical_key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND, logical_key)
}

const fn shift(logical_key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::SHIFT, logical_key)
}

const fn alt(logical_key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::ALT, logical_key)
}

const fn ctrl_shift(logical_key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), logical_key)
}

/// What a row says of its command.
pub(super) struct Row {
    pub(super) name: &'static str,
    pub(super) menu: Menu,
    pub(super) group: u8,
    pub(super) label: &'static str,
    pub(super) tooltip: &'static str,
    pub(super) keys: &'static [KeyboardShortcut],
}

macro_rules! commands {
    ($($name:ident: $menu:ident $group:literal, $label:literal, $tooltip:literal, [$($keys:expr),*];)*) => {
        /// Something the user can ask for without further data.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Command {
            $(#[doc = $tooltip] $name,)*
        }

        impl Command {
            /// All commands, in the order of menus.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            pub(super) fn row(self) -> &'static Row {
                match self {
                    $(Self::$name => const {
                        &Row {
                            name: stringify!($name),
                            menu: Menu::$menu,
                            group: $group,
                            label: $label,
                            tooltip: $tooltip,
                            keys: &[$($keys),*],
                        }
                    },)*
                }
            }
        }
    };
}

commands! {
    // File.
    Open: File 0, "Open…", "Open a scan with the system's file dialog", [ctrl(Key::O)];
    OpenPath: File 0, "Open path…", "Open a scan by typing its path", [ctrl_shift(Key::O)];
    OpenSample: File 0, "Open the sample", "Open the small scan that comes with Normend", [];
    Export: File 1, "Export…", "Write the scan with oriented normals", [ctrl(Key::E)];
    Quit: File 2, "Quit", "Close the editor", [ctrl(Key::Q)];

    // Edit.
    Undo: Edit 0, "Undo", "Take the last edit back", [ctrl(Key::Z)];
    Redo: Edit 0, "Redo", "Apply the last undone edit again", [ctrl_shift(Key::Z), ctrl(Key::Y)];
    Cancel: Edit 1, "Cancel", "Close what is open, stop the running work, or deselect", [key(Key::Escape)];
    Preferences: Edit 9, "Preferences…", "Change the look and the keys", [ctrl(Key::Comma)];

    // Select.
    SelectAllSources: Select 0, "Select all sources", "Select every source", [ctrl(Key::A)];

    // Mend.
    MendHere: Mend 0, "Mend here", "Turn the region under the pointer", [key(Key::Enter)];
    MendAlongTreeHere: Mend 0, "Mend along the tree here",
        "Turn what the heaviest edge of the tree separates from the other sources, instead of a patch", [alt(Key::Enter)];
    TurnWholeHere: Mend 0, "Turn whole region here",
        "Turn all that hangs together with the point under the pointer", [shift(Key::Enter)];
    LargerPatch: Mend 1, "Larger patch",
        "Let a click turn the next larger patch around the pointer", [key(Key::CloseBracket)];
    SmallerPatch: Mend 1, "Smaller patch",
        "Let a click turn the next smaller patch around the pointer", [key(Key::OpenBracket)];
    FlipSources: Mend 2, "Flip sources", "Turn the selected sources", [key(Key::X)];
    RemoveSources: Mend 2, "Remove sources", "Remove the selected sources", [key(Key::Delete), key(Key::Backspace)];
    Propagate: Mend 3, "Propagate", "Orient again with the parameters of the panel; sources stay", [ctrl(Key::Enter)];

    // View.
    Frame: View 0, "Frame", "Show what is selected, or else the whole scan", [key(Key::F)];
    FrameAll: View 0, "Frame all", "Show the whole scan", [key(Key::Home)];
    SetPivot: View 0, "Turn around this point",
        "Make the point under the pointer the pivot of the view (or double-click it)", [key(Key::Period)];
    ViewFront: View 1, "Front", "Look from the front: along +y where z is up", [key(Key::Num1)];
    ViewBack: View 1, "Back", "Look from behind: along −y where z is up", [ctrl(Key::Num1)];
    ViewRight: View 1, "Right", "Look from the right: along −x where z is up", [key(Key::Num3)];
    ViewLeft: View 1, "Left", "Look from the left: along +x where z is up", [ctrl(Key::Num3)];
    ViewTop: View 1, "Top", "Look from above, along the up axis", [key(Key::Num7)];
    ViewBottom: View 1, "Bottom", "Look from below, along the up axis", [ctrl(Key::Num7)];
    ViewCorner: View 1, "Corner", "Look from the front, the right and above", [key(Key::Num9)];
    ToggleOrthographic: View 2, "Parallel projection",
        "Switch between parallel and perspective projection", [key(Key::Num5)];
    ZoomIn: View 3, "Zoom in", "Come closer (or turn the wheel)", [key(Key::PageUp)];
    ZoomOut: View 3, "Zoom out", "Go farther (or turn the wheel)", [key(Key::PageDown)];
    OrbitLeft: View 4, "Orbit left", "Turn the view to the left (or drag)", [key(Key::ArrowLeft)];
    OrbitRight: View 4, "Orbit right", "Turn the view to the right (or drag)", [key(Key::ArrowRight)];
    OrbitUp: View 4, "Orbit up", "Turn the view upward (or drag)", [key(Key::ArrowUp)];
    OrbitDown: View 4, "Orbit down", "Turn the view downward (or drag)", [key(Key::ArrowDown)];
    PanLeft: View 5, "Pan left", "Move the picture to the left (or drag with the right button)", [shift(Key::ArrowLeft)];
    PanRight: View 5, "Pan right", "Move the picture to the right (or drag with the right button)", [shift(Key::ArrowRight)];
    PanUp: View 5, "Pan up", "Move the picture up (or drag with the right button)", [shift(Key::ArrowUp)];
    PanDown: View 5, "Pan down", "Move the picture down (or drag with the right button)", [shift(Key::ArrowDown)];
    Fly: View 6, "Fly", "Fly through the scan with W A S D, Q and E; again or Escape ends it", [shift(Key::F)];
    ClipBox: View 6, "Clip box", "Show only what is inside a box with handles on its faces, or everything again", [shift(Key::B)];
    CutDeeper: View 6, "Cut deeper", "Cut away more of what is near (or Ctrl and the wheel)", [shift(Key::PageUp)];
    CutLess: View 6, "Cut less", "Cut away less of what is near (or Ctrl and the wheel)", [shift(Key::PageDown)];
    LargerSplats: View 7, "Larger splats", "Draw larger splats", [key(Key::Plus), key(Key::Equals)];
    SmallerSplats: View 7, "Smaller splats", "Draw smaller splats", [key(Key::Minus)];
    NextDisplayMode: View 7, "Next display mode", "Color the splats in the next way", [key(Key::D)];
    LargerInterface: View 9, "Larger interface", "Make text and buttons larger",
        [ctrl(Key::Plus), ctrl(Key::Equals)];
    SmallerInterface: View 9, "Smaller interface", "Make text and buttons smaller", [ctrl(Key::Minus)];
    UsualInterface: View 9, "Usual interface size", "Text and buttons as they were at first", [ctrl(Key::Num0)];

    // Help.
    Palette: Help 0, "Find a command…", "Find a command, a recent scan or a display mode by a few letters",
        [ctrl(Key::P)];
    Shortcuts: Help 0, "Keys and mouse", "Show what every key and button does", [key(Key::F1), key(Key::Questionmark)];
    Log: Help 0, "Messages", "Show all messages of this run", [key(Key::F2)];
    ShowHints: Help 1, "Show hints again", "Let the hints for the first steps come again", [];
    About: Help 2, "About Normend", "Version and graphics adapter", [];
}
