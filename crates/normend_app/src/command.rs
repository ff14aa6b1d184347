//! Every command of the editor: the one table behind menus, shortcuts, toolbar and the sheet of shortcuts.

use std::path::PathBuf;

use egui::{Key, KeyboardShortcut, ModifierNames, Modifiers};
use normend_core::Parameters;
use normend_render::StandardView;

/// Something the user can ask for without further data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Open a scan with the system's file dialog.
    Open,
    /// Open a scan by typing its path.
    OpenPath,
    /// Open the bundled scan.
    OpenSample,
    /// Write the oriented scan.
    Export,
    /// Close the editor.
    Quit,
    /// Take the last edit back.
    Undo,
    /// Apply the last undone edit again.
    Redo,
    /// Mend what is under the pointer.
    MendHere,
    /// Mend what is under the pointer along the tree, whatever patch it is in.
    MendAlongTreeHere,
    /// Turn all that hangs together with what is under the pointer.
    TurnWholeHere,
    /// Let a click turn a larger patch.
    LargerPatch,
    /// Let a click turn a smaller patch.
    SmallerPatch,
    /// Select every source.
    SelectAllSources,
    /// Turn the selected sources.
    FlipSources,
    /// Remove the selected sources.
    RemoveSources,
    /// Run the propagation with the parameters of the panel.
    Propagate,
    /// Close what is open, stop what runs, deselect: the first of these that applies.
    Cancel,
    /// Show the whole scan.
    FrameAll,
    /// Turn the view around the point under the pointer.
    SetPivot,
    /// Look along an axis.
    View(StandardView),
    /// Parallel or perspective projection.
    ToggleOrthographic,
    /// Come closer.
    ZoomIn,
    /// Go farther.
    ZoomOut,
    /// Turn the view to the left.
    OrbitLeft,
    /// Turn the view to the right.
    OrbitRight,
    /// Turn the view upward.
    OrbitUp,
    /// Turn the view downward.
    OrbitDown,
    /// Draw larger splats.
    LargerSplats,
    /// Draw smaller splats.
    SmallerSplats,
    /// The next way of coloring.
    NextDisplayMode,
    /// The sheet of shortcuts.
    Shortcuts,
    /// All messages of this run.
    Log,
    /// Version and graphics adapter.
    About,
}

/// What a user asks for, with its data.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// A command of the table.
    Run(Command),
    /// Open this scan.
    OpenScan(PathBuf),
    /// Forget the recent scans.
    ClearRecent,
    /// Propagate again with these parameters; the sources stay.
    Propagate(Parameters),
    /// Select the source at this point; `extend` keeps the others.
    SelectSource {
        /// The point's id.
        point: u32,
        /// Add to or take from the selection instead of replacing it.
        extend: bool,
    },
    /// Bring this point into view.
    FlyTo(u32),
    /// Turn the sources at these points.
    FlipSources(Vec<u32>),
    /// Remove the sources at these points.
    RemoveSources(Vec<u32>),
    /// Ask the running job to stop.
    CancelJob,
    /// Let the user pick the target of the export with the system's dialog.
    BrowseExport,
    /// Write the oriented scan there.
    ExportTo {
        /// The file.
        path: PathBuf,
        /// The user agreed to replace the file that was opened.
        overwrite_input: bool,
    },
}

impl From<Command> for Action {
    fn from(command: Command) -> Self {
        Self::Run(command)
    }
}

/// A menu of the menu bar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Menu {
    /// Scans in and out.
    File,
    /// The document.
    Edit,
    /// The camera and the colors.
    View,
    /// The editor itself.
    Help,
}

impl Menu {
    /// All menus, from left to right.
    pub const ALL: [Self; 4] = [Self::File, Self::Edit, Self::View, Self::Help];

    /// The name in the menu bar.
    pub fn label(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::Edit => "Edit",
            Self::View => "View",
            Self::Help => "Help",
        }
    }
}

/// One row of the table.
struct Row {
    menu: Menu,
    /// Commands of one group stand between the same two lines of a menu.
    group: u8,
    label: &'static str,
    tooltip: &'static str,
    keys: &'static [KeyboardShortcut],
}

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

macro_rules! row {
    ($menu:ident $group:literal, $label:literal, $tooltip:literal, [$($keys:expr),*]) => {
        Row { menu: Menu::$menu, group: $group, label: $label, tooltip: $tooltip, keys: const { &[$($keys),*] } }
    };
}

impl Command {
    /// All commands, in the order of menus.
    pub const ALL: [Self; 39] = [
        Self::Open,
        Self::OpenPath,
        Self::OpenSample,
        Self::Export,
        Self::Quit,
        Self::Undo,
        Self::Redo,
        Self::MendHere,
        Self::MendAlongTreeHere,
        Self::TurnWholeHere,
        Self::LargerPatch,
        Self::SmallerPatch,
        Self::SelectAllSources,
        Self::FlipSources,
        Self::RemoveSources,
        Self::Propagate,
        Self::Cancel,
        Self::FrameAll,
        Self::SetPivot,
        Self::View(StandardView::Front),
        Self::View(StandardView::Back),
        Self::View(StandardView::Right),
        Self::View(StandardView::Left),
        Self::View(StandardView::Top),
        Self::View(StandardView::Bottom),
        Self::View(StandardView::Corner),
        Self::ToggleOrthographic,
        Self::ZoomIn,
        Self::ZoomOut,
        Self::OrbitLeft,
        Self::OrbitRight,
        Self::OrbitUp,
        Self::OrbitDown,
        Self::LargerSplats,
        Self::SmallerSplats,
        Self::NextDisplayMode,
        Self::Shortcuts,
        Self::Log,
        Self::About,
    ];

    fn row(self) -> Row {
        use StandardView::{Back, Bottom, Corner, Front, Left, Right, Top};
        match self {
            Self::Open => row!(File 0, "Open…", "Open a scan with the system's file dialog", [ctrl(Key::O)]),
            Self::OpenPath => row!(File 0, "Open path…", "Open a scan by typing its path", [ctrl_shift(Key::O)]),
            Self::OpenSample => row!(File 0, "Open the sample", "Open the small scan that comes with Normend", []),
            Self::Export => row!(File 1, "Export…", "Write the scan with oriented normals", [ctrl(Key::E)]),
            Self::Quit => row!(File 2, "Quit", "Close the editor", [ctrl(Key::Q)]),
            Self::Undo => row!(Edit 0, "Undo", "Take the last edit back", [ctrl(Key::Z)]),
            Self::Redo => {
                row!(Edit 0, "Redo", "Apply the last undone edit again", [ctrl_shift(Key::Z), ctrl(Key::Y)])
            }
            Self::MendHere => row!(Edit 1, "Mend here", "Turn the region under the pointer", [key(Key::Enter)]),
            Self::MendAlongTreeHere => {
                row!(Edit 1, "Mend along the tree here", "Turn what the heaviest edge of the tree separates from the other sources, instead of a patch", [alt(Key::Enter)])
            }
            Self::TurnWholeHere => {
                row!(Edit 1, "Turn whole region here", "Turn all that hangs together with the point under the pointer", [shift(Key::Enter)])
            }
            Self::LargerPatch => {
                row!(Edit 1, "Larger patch", "Let a click turn the next larger patch around the pointer", [key(Key::CloseBracket)])
            }
            Self::SmallerPatch => {
                row!(Edit 1, "Smaller patch", "Let a click turn the next smaller patch around the pointer", [key(Key::OpenBracket)])
            }
            Self::SelectAllSources => row!(Edit 2, "Select all sources", "Select every source", [ctrl(Key::A)]),
            Self::FlipSources => row!(Edit 2, "Flip sources", "Turn the selected sources", [key(Key::X)]),
            Self::RemoveSources => {
                row!(Edit 2, "Remove sources", "Remove the selected sources", [key(Key::Delete), key(Key::Backspace)])
            }
            Self::Propagate => {
                row!(Edit 3, "Propagate", "Orient again with the parameters of the panel; sources stay", [ctrl(Key::Enter)])
            }
            Self::Cancel => {
                row!(Edit 3, "Cancel", "Close what is open, stop the running work, or deselect", [key(Key::Escape)])
            }
            Self::FrameAll => row!(View 0, "Frame all", "Show the whole scan", [key(Key::F)]),
            Self::SetPivot => {
                row!(View 0, "Turn around this point", "Make the point under the pointer the pivot of the view (or double-click it)", [key(Key::Period)])
            }
            Self::View(Front) => row!(View 1, "Front", "Look along +y", [key(Key::Num1)]),
            Self::View(Back) => row!(View 1, "Back", "Look along −y", [ctrl(Key::Num1)]),
            Self::View(Right) => row!(View 1, "Right", "Look along −x", [key(Key::Num3)]),
            Self::View(Left) => row!(View 1, "Left", "Look along +x", [ctrl(Key::Num3)]),
            Self::View(Top) => row!(View 1, "Top", "Look along −z", [key(Key::Num7)]),
            Self::View(Bottom) => row!(View 1, "Bottom", "Look along +z", [ctrl(Key::Num7)]),
            Self::View(Corner) => row!(View 1, "Corner", "Look from the front, the right and above", [key(Key::Num9)]),
            Self::ToggleOrthographic => {
                row!(View 2, "Parallel projection", "Switch between parallel and perspective projection", [key(Key::Num5)])
            }
            Self::ZoomIn => row!(View 3, "Zoom in", "Come closer (or turn the wheel)", [key(Key::PageUp)]),
            Self::ZoomOut => row!(View 3, "Zoom out", "Go farther (or turn the wheel)", [key(Key::PageDown)]),
            Self::OrbitLeft => row!(View 4, "Orbit left", "Turn the view to the left (or drag)", [key(Key::ArrowLeft)]),
            Self::OrbitRight => {
                row!(View 4, "Orbit right", "Turn the view to the right (or drag)", [key(Key::ArrowRight)])
            }
            Self::OrbitUp => row!(View 4, "Orbit up", "Turn the view upward (or drag)", [key(Key::ArrowUp)]),
            Self::OrbitDown => row!(View 4, "Orbit down", "Turn the view downward (or drag)", [key(Key::ArrowDown)]),
            Self::LargerSplats => {
                row!(View 5, "Larger splats", "Draw larger splats", [key(Key::Plus), key(Key::Equals)])
            }
            Self::SmallerSplats => row!(View 5, "Smaller splats", "Draw smaller splats", [key(Key::Minus)]),
            Self::NextDisplayMode => {
                row!(View 5, "Next display mode", "Color the splats in the next way", [key(Key::D)])
            }
            Self::Shortcuts => {
                row!(Help 0, "Keys and mouse", "Show what every key and button does", [key(Key::F1), key(Key::Questionmark)])
            }
            Self::Log => row!(Help 0, "Messages", "Show all messages of this run", [key(Key::F2)]),
            Self::About => row!(Help 1, "About Normend", "Version and graphics adapter", []),
        }
    }

    /// The name in menus and in the sheet of shortcuts.
    pub fn label(self) -> &'static str {
        self.row().label
    }

    /// What it does, in a few words.
    pub fn tooltip(self) -> &'static str {
        self.row().tooltip
    }

    /// The keys, the usual one first.
    pub fn keys(self) -> &'static [KeyboardShortcut] {
        self.row().keys
    }

    /// The menu it stands in.
    pub fn menu(self) -> Menu {
        self.row().menu
    }

    /// Which group of its menu it stands in; lines separate groups.
    pub fn group(self) -> u8 {
        self.row().group
    }

    /// The keys in words ("Ctrl+Shift+Z or Ctrl+Y"); empty without keys.
    pub fn keys_text(self, ctx: &egui::Context) -> String {
        let keys: Vec<_> = self
            .keys()
            .iter()
            .map(|shortcut| shortcut_text(ctx, shortcut))
            .collect();
        keys.join(" or ")
    }
}

/// One shortcut as it is written on the keys ("Ctrl+Shift+Z", "+").
pub fn shortcut_text(ctx: &egui::Context, shortcut: &KeyboardShortcut) -> String {
    let is_mac = ctx.os().is_mac();
    let held = ModifierNames::NAMES.format(&shortcut.modifiers, is_mac);
    let plus = if held.is_empty() { "" } else { "+" };
    let key = match shortcut.logical_key {
        Key::Plus => "+",
        Key::Minus => "−",
        Key::Equals => "=",
        Key::OpenBracket => "[",
        Key::CloseBracket => "]",
        Key::Period => ".",
        Key::Questionmark => "?",
        Key::ArrowLeft => "Left arrow",
        Key::ArrowRight => "Right arrow",
        Key::ArrowUp => "Up arrow",
        Key::ArrowDown => "Down arrow",
        Key::PageUp => "Page up",
        Key::PageDown => "Page down",
        key => key.name(),
    };
    format!("{held}{plus}{key}")
}

/// What the mouse does in the 3D view, and how: the first part of the sheet of shortcuts.
pub const MOUSE: [(&str, &str); 12] = [
    ("Show what a click would turn", "Move over the scan"),
    ("Mend here", "Click"),
    ("Mend along the tree here", "Alt+click"),
    ("Turn whole region here", "Ctrl+click"),
    ("Larger or smaller patch", "Press, turn the wheel, release"),
    ("Select a source (Shift adds)", "Click its sphere"),
    ("Orbit", "Left drag"),
    ("Pan", "Right, middle or Shift+left drag"),
    ("Zoom to the pointer", "Wheel"),
    ("Larger or smaller splats", "Alt+wheel"),
    ("Turn around this point", "Double-click or middle click"),
    ("Open a scan (not on Wayland)", "Drop its file"),
];

/// Takes the commands out of the keyboard input. With `typing`, a text field has the keyboard and gets all keys but
/// Escape; plain keys are also left alone when a widget has the focus.
pub fn take_shortcuts(ctx: &egui::Context, typing: bool, widget_focused: bool) -> Vec<Command> {
    let mut rows: Vec<_> = Command::ALL
        .iter()
        .flat_map(|&command| command.keys().iter().map(move |shortcut| (command, shortcut)))
        .collect();
    // A shortcut also matches with Shift held, so those that ask for more modifiers come first.
    rows.sort_by_key(|(_, shortcut)| std::cmp::Reverse(n_modifiers(shortcut.modifiers)));
    ctx.input_mut(|input| {
        rows.into_iter()
            .filter(|(command, shortcut)| {
                let available = if typing {
                    *command == Command::Cancel
                } else {
                    !widget_focused || n_modifiers(shortcut.modifiers) > 0 || *command == Command::Cancel
                };
                available && input.consume_shortcut(shortcut)
            })
            .map(|(command, _)| command)
            .collect()
    })
}

fn n_modifiers(modifiers: Modifiers) -> u32 {
    u32::from(modifiers.shift) + u32::from(modifiers.alt) + u32::from(modifiers.command || modifiers.ctrl)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_command_is_complete_and_listed_once() {
        let mut labels = BTreeSet::new();
        for command in Command::ALL {
            assert!(!command.tooltip().is_empty(), "{command:?} has no tooltip");
            assert!(!command.label().is_empty(), "{command:?} has no label");
            assert!(
                labels.insert(command.label()),
                "{command:?} has the label of another command"
            );
        }
        for view in StandardView::ALL {
            assert!(Command::ALL.contains(&Command::View(view)), "{view:?} is missing");
        }
    }

    #[test]
    fn no_two_commands_share_a_key() {
        let mut keys: Vec<(KeyboardShortcut, Command)> = Vec::new();
        for command in Command::ALL {
            for &shortcut in command.keys() {
                if let Some((_, other)) = keys.iter().find(|(taken, _)| *taken == shortcut) {
                    panic!("{command:?} and {other:?} share {shortcut:?}");
                }
                keys.push((shortcut, command));
            }
        }
        assert!(keys.len() > 30);
    }

    #[test]
    fn groups_of_a_menu_are_contiguous() {
        for menu in Menu::ALL {
            let groups: Vec<_> = Command::ALL
                .iter()
                .filter(|command| command.menu() == menu)
                .map(|c| c.group())
                .collect();
            assert!(!groups.is_empty());
            assert!(groups.is_sorted(), "{menu:?}: {groups:?}");
        }
    }

    #[test]
    fn keys_are_named_as_they_are_written() {
        let ctx = egui::Context::default();
        let check = |command: Command, expect: &str| assert_eq!(command.keys_text(&ctx), expect);
        check(Command::Open, "Ctrl+O");
        check(Command::Redo, "Ctrl+Shift+Z or Ctrl+Y");
        check(Command::SetPivot, ".");
        check(Command::LargerSplats, "+ or =");
        check(Command::SmallerSplats, "−");
        check(Command::LargerPatch, "]");
        check(Command::MendAlongTreeHere, "Alt+Enter");
        check(Command::Shortcuts, "F1 or ?");
        check(Command::OrbitLeft, "Left arrow");
        check(Command::About, "");
    }

    #[test]
    fn menu_and_mouse_call_the_same_thing_the_same() {
        for command in [
            Command::MendHere,
            Command::MendAlongTreeHere,
            Command::TurnWholeHere,
            Command::SetPivot,
        ] {
            assert!(MOUSE.iter().any(|(what, _)| *what == command.label()), "{command:?}");
        }
    }

    fn check(modifiers: Modifiers, key: Key, typing: bool, widget_focused: bool, expect: &[Command]) {
        let ctx = egui::Context::default();
        let input = egui::RawInput {
            events: vec![egui::Event::Key {
                key,
                physical_key: None,
                pressed: true,
                repeat: false,
                modifiers,
            }],
            ..Default::default()
        };
        let mut taken = Vec::new();
        let mut output = ctx.run_ui(input, |ui| {
            taken.extend(take_shortcuts(ui.ctx(), typing, widget_focused))
        });
        // Nothing is painted here.
        output.textures_delta.clear();
        assert_eq!(taken, expect, "{modifiers:?} {key:?}");
    }

    #[test]
    fn keys_give_their_command() {
        let ctrl = Modifiers::COMMAND | Modifiers::CTRL;
        check(ctrl, Key::Z, false, false, &[Command::Undo]);
        check(ctrl | Modifiers::SHIFT, Key::Z, false, false, &[Command::Redo]);
        check(ctrl, Key::Y, false, false, &[Command::Redo]);
        check(
            Modifiers::NONE,
            Key::Num1,
            false,
            false,
            &[Command::View(StandardView::Front)],
        );
        check(ctrl, Key::Num1, false, false, &[Command::View(StandardView::Back)]);
        check(Modifiers::SHIFT, Key::Questionmark, false, false, &[Command::Shortcuts]);
    }

    #[test]
    fn text_fields_keep_their_keys() {
        let ctrl = Modifiers::COMMAND | Modifiers::CTRL;
        check(Modifiers::NONE, Key::F, true, true, &[]);
        check(ctrl, Key::Z, true, true, &[]);
        check(Modifiers::NONE, Key::Escape, true, true, &[Command::Cancel]);
        check(Modifiers::NONE, Key::Enter, false, true, &[]);
        check(ctrl, Key::O, false, true, &[Command::Open]);
    }
}
