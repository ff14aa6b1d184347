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
    Open: File 0, "Open…", "Open a scan with the system's file dialog; several files become layers of one", [ctrl(Key::O)];
    OpenPath: File 0, "Open path…", "Open a scan by typing its path", [ctrl_shift(Key::O)];
    AddFiles: File 0, "Add files…", "Open more files as layers of this scan; what you decided stays", [];
    OpenSample: File 0, "Open the sample", "Open the small scan that comes with Normend", [];
    Columns: File 0, "Columns…", "See what the columns of this text were taken for, and change it", [];
    OpenReference: File 0, "Compare with reference…",
        "Count the wrong points against another file of the same scan", [];
    OpenReferencePath: File 0, "Compare with reference by path…", "Type the path of the reference", [];
    Export: File 1, "Export…", "Write the scan with oriented normals", [ctrl(Key::E)];
    Screenshot: File 1, "Picture of the view…", "Save or copy a picture of the view, in any size",
        [ctrl_shift(Key::S), key(Key::F12)];
    Turntable: File 1, "Turntable…", "Save pictures of the scan turning around, for a film", [];
    OpenRecipe: File 2, "Open recipe…", "Do again what a recipe says, as one step", [];
    OpenRecipePath: File 2, "Open recipe by path…", "Open a recipe by typing its path", [];
    SaveRecipe: File 2, "Save recipe…", "Keep what you decided as a file, to open it again or to replay it", [ctrl(Key::S)];
    Quit: File 3, "Quit", "Close the editor", [ctrl(Key::Q)];

    // Edit.
    Undo: Edit 0, "Undo", "Take the last edit back", [ctrl(Key::Z)];
    Redo: Edit 0, "Redo", "Apply the last undone edit again", [ctrl_shift(Key::Z), ctrl(Key::Y)];
    Cancel: Edit 1, "Cancel", "Close what is open, stop the running work, or deselect", [key(Key::Escape)];
    Preferences: Edit 9, "Preferences…", "Change the look and the keys", [ctrl(Key::Comma)];

    // Select.
    BrushTool: Select 0, "Brush tool", "Select what a disc is dragged over", [key(Key::B)];
    LassoTool: Select 0, "Lasso tool", "Select within a line drawn by hand", [key(Key::L)];
    RectangleTool: Select 0, "Rectangle tool", "Select within a rectangle", [key(Key::R)];
    PolygonTool: Select 0, "Polygon tool", "Select within a polygon of clicked corners", [key(Key::O)];
    PatchTool: Select 0, "Patch tool", "Select patches with a click each; the wheel under a held button makes them larger or smaller",
        [key(Key::A)];
    ComponentTool: Select 0, "Component tool", "Select all that hangs together with a click", [key(Key::C)];
    VisibleOnly: Select 0, "Visible only",
        "Let brush, lasso, rectangle and polygon select only what is seen, or also what lies behind it", [key(Key::V)];
    SelectAll: Select 1, "Select all", "Select every point that is shown", [ctrl(Key::A)];
    SelectNone: Select 1, "Select none", "Select no point", [ctrl_shift(Key::A)];
    InvertSelection: Select 1, "Invert selection", "Select what is shown and not selected", [ctrl(Key::I)];
    GrowSelection: Select 2, "Grow selection", "Add what touches the selection, whatever its normals",
        [shift(Key::CloseBracket), key(Key::CloseCurlyBracket)];
    ShrinkSelection: Select 2, "Shrink selection", "Take away the border of the selection",
        [shift(Key::OpenBracket), key(Key::OpenCurlyBracket)];
    SelectPatchHere: Select 3, "Select patch here", "Select the patch under the pointer", [ctrl(Key::G)];
    SelectComponentHere: Select 3, "Select component here",
        "Select all that hangs together with the point under the pointer", [ctrl_shift(Key::G)];
    SelectBacks: Select 3, "Select what shows its back", "Select the visible points that face away from you", [];
    SelectPinned: Select 3, "Select pinned points", "Select what nothing turns", [];
    SelectUndecided: Select 3, "Select undecided points", "Select the points whose side is a coin's throw", [];
    SelectAllSources: Select 4, "Select all sources", "Select every source", [alt(Key::A)];
    HideSelected: Select 5, "Hide selected", "Show the selected points no longer; tools then reach what is behind", [key(Key::H)];
    Isolate: Select 5, "Show only selected", "Hide all but the selected points", [shift(Key::H)];
    ShowAll: Select 5, "Show all", "Show the hidden points again", [alt(Key::H)];

    // Mend.
    MendTool: Mend 0, "Mend tool", "Turn what is under the pointer with a click", [key(Key::M)];
    MendHere: Mend 0, "Mend here", "Turn the region under the pointer", [key(Key::Enter)];
    MendAlongTreeHere: Mend 0, "Mend along the tree here",
        "Turn what the heaviest edge of the tree separates from the other sources, instead of a patch", [alt(Key::Enter)];
    TurnWholeHere: Mend 0, "Turn whole region here",
        "Turn all that hangs together with the point under the pointer", [shift(Key::Enter)];
    LargerPatch: Mend 1, "Larger patch",
        "Let a click turn the next larger patch around the pointer", [key(Key::CloseBracket)];
    SmallerPatch: Mend 1, "Smaller patch",
        "Let a click turn the next smaller patch around the pointer", [key(Key::OpenBracket)];
    Flip: Mend 2, "Flip selection", "Turn the selected points, or else the selected sources", [key(Key::X)];
    SelectionFacesMe: Mend 2, "Selection faces me",
        "Turn those of the selected points that face away from you", [shift(Key::G)];
    WhatISeeFacesMe: Mend 2, "What I see faces me",
        "Turn the patches that you see from behind; shown first, the same key again applies it", [key(Key::G)];
    Pin: Mend 2, "Pin as right", "The selected points are right: nothing turns them until they are unpinned", [key(Key::P)];
    Unpin: Mend 2, "Unpin", "Let the selected points turn again", [shift(Key::P)];
    PropagateFrom: Mend 2, "Selection is right, propagate",
        "Let all that hangs together with the selected points follow them; their sources go", [shift(Key::X)];
    PropagateInside: Mend 2, "Propagate inside selection",
        "Find the sides of the selected points again, from what is around them", [alt(Key::X)];
    FlipSources: Mend 2, "Flip sources", "Turn the selected sources", [];
    RemoveSources: Mend 2, "Remove sources", "Remove the selected sources", [key(Key::Delete), key(Key::Backspace)];
    NextSuspect: Mend 3, "Next suspect", "Fly to the next patch that probably points to the wrong side", [key(Key::N)];
    PreviousSuspect: Mend 3, "Previous suspect", "Fly to the suspect before", [shift(Key::N)];
    FlipSuspect: Mend 3, "Flip suspect", "Turn the suspect in the view, and go on to the next; Mend here does so too", [];
    AcceptSuspect: Mend 3, "Accept suspect",
        "The suspect in the view is right as it is: it is not listed again", [key(Key::Space)];
    FindSuspects: Mend 3, "Look for suspects", "Look for what seems wrong, with the signs as they are now", [];
    Propagate: Mend 4, "Propagate", "Orient again with the parameters of the panel; sources stay", [ctrl(Key::Enter)];

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
    Section: View 6, "Section", "Show only a thin slice across the view, or everything again", [shift(Key::S)];
    CutDeeper: View 6, "Cut deeper", "Cut away more of what is near (or Ctrl and the wheel)", [shift(Key::PageUp)];
    CutLess: View 6, "Cut less", "Cut away less of what is near (or Ctrl and the wheel)", [shift(Key::PageDown)];
    LargerSplats: View 7, "Larger splats", "Draw larger splats", [key(Key::Plus), key(Key::Equals)];
    SmallerSplats: View 7, "Smaller splats", "Draw smaller splats", [key(Key::Minus)];
    NextDisplayMode: View 7, "Next display mode", "Color the splats in the next way", [key(Key::D)];
    PreviousDisplayMode: View 7, "Previous display mode", "Color the splats in the way before", [shift(Key::D)];
    ToggleHair: View 7, "Normals as hair", "Show normals as short lines, or hide them", [key(Key::I)];
    ToggleSpheres: View 7, "Sources as spheres", "Show sources as spheres, or hide them", [shift(Key::I)];
    CompareSplit: View 8, "Compare side by side",
        "Show the input, the automatic result or a reference left of a line, and the present right of it", [key(Key::K)];
    CompareBlink: View 8, "Compare in turn", "Show the other and the present in turn; or the other for as long as the key is held", [shift(Key::K)];
    NextWrong: View 8, "Next wrong region", "Fly to the next region that is wrong against the reference", [key(Key::W)];
    PreviousWrong: View 8, "Previous wrong region",
        "Fly to the region before that is wrong against the reference", [shift(Key::W)];
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
