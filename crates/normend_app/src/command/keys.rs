//! Which keys give which command: the defaults of the table, and what the user made of them.

use std::collections::BTreeMap;
use std::sync::Arc;

use egui::{Id, Key, KeyboardShortcut, ModifierNames, Modifiers};
use serde::{Deserialize, Serialize};

use super::Command;

/// The keys of all commands. Only what differs from the table is kept.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "NamedKeys", try_from = "NamedKeys")]
pub struct Keymap {
    changed: BTreeMap<Command, Vec<KeyboardShortcut>>,
}

/// As settings have it: keys in words by the name of their command.
type NamedKeys = BTreeMap<String, Vec<String>>;

impl From<Keymap> for NamedKeys {
    fn from(keymap: Keymap) -> Self {
        let named = |(command, keys): (Command, Vec<KeyboardShortcut>)| {
            let keys = keys.iter().map(written).collect();
            (command.name().to_owned(), keys)
        };
        keymap.changed.into_iter().map(named).collect()
    }
}

impl TryFrom<NamedKeys> for Keymap {
    type Error = String;

    /// Commands that are not known may be of another version, and are left out.
    fn try_from(named: NamedKeys) -> Result<Self, String> {
        let mut keymap = Self::default();
        for (name, keys) in named {
            let parsed: Result<Vec<_>, String> = keys
                .iter()
                .map(|text| parsed(text).ok_or_else(|| format!("“{text}” is no key")))
                .collect();
            let keys = parsed?;
            if let Some(command) = Command::from_name(&name) {
                keymap.set(command, keys);
            }
        }
        Ok(keymap)
    }
}

/// A key for files, the same on every system: "Ctrl+Shift+Z", "Alt+ArrowUp".
fn written(shortcut: &KeyboardShortcut) -> String {
    let held = shortcut.modifiers;
    let mut text = String::new();
    for (is_held, name) in [
        (held.command || held.ctrl, "Ctrl+"),
        (held.alt, "Alt+"),
        (held.shift, "Shift+"),
    ] {
        if is_held {
            text.push_str(name);
        }
    }
    text + shortcut.logical_key.name()
}

/// The key that [`written`] wrote.
fn parsed(text: &str) -> Option<KeyboardShortcut> {
    let mut modifiers = Modifiers::NONE;
    let mut rest = text;
    while let Some((held, key)) = rest.split_once('+') {
        modifiers |= match held {
            "Ctrl" => Modifiers::COMMAND,
            "Alt" => Modifiers::ALT,
            "Shift" => Modifiers::SHIFT,
            _ => return None,
        };
        rest = key;
    }
    let key = Key::from_name(rest).filter(|&key| !is_modifier(key))?;
    Some(KeyboardShortcut::new(modifiers, key))
}

/// Whether a key is only held down for another one, so that alone it is no shortcut.
pub fn is_modifier(key: Key) -> bool {
    matches!(
        key,
        Key::ShiftLeft
            | Key::ShiftRight
            | Key::ControlLeft
            | Key::ControlRight
            | Key::AltLeft
            | Key::AltRight
            | Key::SuperLeft
            | Key::SuperRight
    )
}

impl Keymap {
    /// Makes these the keys that [`Keymap::keys`] and everything that shows keys in `ctx` use.
    pub fn install(self, ctx: &egui::Context) {
        ctx.data_mut(|data| data.insert_temp(Id::NULL, Arc::new(self)));
    }

    /// The keys in force; those of the table before [`Self::install`].
    pub fn of(ctx: &egui::Context) -> Arc<Self> {
        ctx.data(|data| data.get_temp(Id::NULL)).unwrap_or_default()
    }

    /// The keys of a command, the usual one first.
    pub fn keys(&self, command: Command) -> &[KeyboardShortcut] {
        self.changed.get(&command).map_or(command.row().keys, Vec::as_slice)
    }

    /// Gives a command these keys, which may be none.
    pub fn set(&mut self, command: Command, keys: Vec<KeyboardShortcut>) {
        if keys == command.row().keys {
            self.changed.remove(&command);
        } else {
            self.changed.insert(command, keys);
        }
    }

    /// Adds a key to those of a command. Another command that had it loses it.
    pub fn add(&mut self, command: Command, shortcut: KeyboardShortcut) {
        while let Some(other) = self.owner(shortcut) {
            self.remove(other, shortcut);
        }
        let mut keys = self.keys(command).to_vec();
        keys.push(shortcut);
        self.set(command, keys);
    }

    /// Takes a key from a command.
    pub fn remove(&mut self, command: Command, shortcut: KeyboardShortcut) {
        let keys = self.keys(command).iter().copied().filter(|&key| key != shortcut);
        let keys = keys.collect();
        self.set(command, keys);
    }

    /// Gives a command the keys of the table, and takes them from others.
    pub fn reset(&mut self, command: Command) {
        self.changed.remove(&command);
        for &shortcut in command.default_keys() {
            let others = Command::ALL.iter().copied().filter(|&other| other != command);
            for other in others
                .filter(|&other| self.keys(other).contains(&shortcut))
                .collect::<Vec<_>>()
            {
                self.remove(other, shortcut);
            }
        }
    }

    /// Gives every command the keys of the table.
    pub fn reset_all(&mut self) {
        self.changed.clear();
    }

    /// Whether a command has other keys than in the table.
    pub fn is_changed(&self, command: Command) -> bool {
        self.changed.contains_key(&command)
    }

    /// Whether every command has the keys of the table.
    pub fn is_default(&self) -> bool {
        self.changed.is_empty()
    }

    /// The command that a key gives.
    pub fn owner(&self, shortcut: KeyboardShortcut) -> Option<Command> {
        Command::ALL
            .iter()
            .copied()
            .find(|&command| self.keys(command).contains(&shortcut))
    }
}

impl Command {
    /// The keys of the table, which the user may have changed.
    pub fn default_keys(self) -> &'static [KeyboardShortcut] {
        self.row().keys
    }

    /// The user's keys in words ("Ctrl+Shift+Z or Ctrl+Y"); empty without keys.
    pub fn keys_text(self, ctx: &egui::Context) -> String {
        let keymap = Keymap::of(ctx);
        let keys: Vec<_> = keymap
            .keys(self)
            .iter()
            .map(|shortcut| shortcut_text(ctx, shortcut))
            .collect();
        keys.join(" or ")
    }

    /// The first of the user's keys in words; `None` without keys.
    pub fn key_text(self, ctx: &egui::Context) -> Option<String> {
        let keymap = Keymap::of(ctx);
        keymap.keys(self).first().map(|shortcut| shortcut_text(ctx, shortcut))
    }

    /// What it does with its key: "Take the last edit back (Ctrl+Z)".
    pub fn tooltip_with_keys(self, ctx: &egui::Context) -> String {
        let keys = self.keys_text(ctx);
        if keys.is_empty() {
            self.tooltip().to_owned()
        } else {
            format!("{} ({keys})", self.tooltip())
        }
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
        Key::Comma => ",",
        Key::Semicolon => ";",
        Key::Colon => ":",
        Key::Slash => "/",
        Key::Backslash => "\\",
        Key::Pipe => "|",
        Key::Quote => "'",
        Key::Backtick => "`",
        Key::Exclamationmark => "!",
        Key::OpenCurlyBracket => "{",
        Key::CloseCurlyBracket => "}",
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

/// What the mouse does in the 3D view with every tool, and how: the first part of the sheet of shortcuts.
pub const MOUSE: [(&str, &str); 6] = [
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
    let keymap = Keymap::of(ctx);
    let mut rows: Vec<_> = Command::ALL
        .iter()
        .flat_map(|&command| keymap.keys(command).iter().map(move |shortcut| (command, shortcut)))
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
    use super::*;

    #[test]
    fn no_two_commands_share_a_key() {
        let mut keys: Vec<(KeyboardShortcut, Command)> = Vec::new();
        for &command in Command::ALL {
            for &shortcut in command.default_keys() {
                if let Some((_, other)) = keys.iter().find(|(taken, _)| *taken == shortcut) {
                    panic!("{command:?} and {other:?} share {shortcut:?}");
                }
                keys.push((shortcut, command));
            }
        }
        assert!(keys.len() > 30);
    }

    #[test]
    fn every_key_can_be_kept_in_a_file() {
        for &key in Key::ALL.iter().filter(|&&key| !is_modifier(key)) {
            for modifiers in [
                Modifiers::NONE,
                Modifiers::COMMAND,
                Modifiers::ALT | Modifiers::SHIFT,
                Modifiers::COMMAND | Modifiers::ALT | Modifiers::SHIFT,
            ] {
                let shortcut = KeyboardShortcut::new(modifiers, key);
                assert_eq!(parsed(&written(&shortcut)), Some(shortcut), "{}", written(&shortcut));
            }
        }
        for text in [
            "",
            "Ctrl",
            "Ctrl+",
            "Hyper+A",
            "Ctrl+Nothing",
            "+",
            "ShiftLeft",
            "Ctrl+AltRight",
        ] {
            assert_eq!(parsed(text), None, "{text}");
        }
    }

    #[test]
    fn a_key_belongs_to_one_command() {
        let mut keymap = Keymap::default();
        let z = Command::Undo.default_keys()[0];
        keymap.add(Command::Export, z);
        assert_eq!(keymap.owner(z), Some(Command::Export));
        assert_eq!(
            keymap.keys(Command::Export),
            [Command::Export.default_keys(), &[z]].concat()
        );
        assert!(keymap.keys(Command::Undo).is_empty());
        keymap.reset(Command::Undo);
        assert_eq!(keymap.owner(z), Some(Command::Undo));
        assert!(keymap.is_default());
        keymap.remove(Command::Undo, z);
        assert_eq!((keymap.owner(z), keymap.is_changed(Command::Undo)), (None, true));
        keymap.reset_all();
        assert!(keymap.is_default());
    }

    #[test]
    fn the_keys_of_the_user_are_shown_and_taken() {
        let ctx = egui::Context::default();
        let mut keymap = Keymap::default();
        keymap.set(Command::Undo, vec![key(Key::U)]);
        keymap.install(&ctx);
        assert_eq!(Command::Undo.keys_text(&ctx), "U");
        assert_eq!(Command::Undo.tooltip_with_keys(&ctx), "Take the last edit back (U)");
        press(&ctx, Modifiers::NONE, Key::U, false, false, &[Command::Undo]);
        press(&ctx, Modifiers::COMMAND | Modifiers::CTRL, Key::Z, false, false, &[]);
    }

    fn key(key: Key) -> KeyboardShortcut {
        KeyboardShortcut::new(Modifiers::NONE, key)
    }

    #[test]
    fn keys_are_named_as_they_are_written() {
        let ctx = egui::Context::default();
        let check = |command: Command, expect: &str| assert_eq!(command.keys_text(&ctx), expect);
        check(Command::Open, "Ctrl+O");
        check(Command::Redo, "Ctrl+Shift+Z or Ctrl+Y");
        check(Command::SetPivot, ".");
        check(Command::Preferences, "Ctrl+,");
        check(Command::LargerSplats, "+ or =");
        check(Command::SmallerSplats, "−");
        check(Command::LargerPatch, "]");
        check(Command::MendAlongTreeHere, "Alt+Enter");
        check(Command::Shortcuts, "F1 or ?");
        check(Command::OrbitLeft, "Left arrow");
        check(Command::About, "");
    }

    fn check(modifiers: Modifiers, key: Key, typing: bool, widget_focused: bool, expect: &[Command]) {
        press(
            &egui::Context::default(),
            modifiers,
            key,
            typing,
            widget_focused,
            expect,
        );
    }

    fn press(
        ctx: &egui::Context,
        modifiers: Modifiers,
        key: Key,
        typing: bool,
        widget_focused: bool,
        expect: &[Command],
    ) {
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
        check(Modifiers::NONE, Key::Num1, false, false, &[Command::ViewFront]);
        check(ctrl, Key::Num1, false, false, &[Command::ViewBack]);
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
