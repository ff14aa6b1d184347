//! The keys of the real editor without a window: recording, conflicts, removing, resetting, keeping, and moving by keyboard alone.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::collections::BTreeSet;

use egui::accesskit::Role;
use egui::{Key, KeyboardShortcut, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use normend_app::SettingsStore;
use normend_app::command::{Command, Keymap};
use normend_app::settings::ThemeChoice;

use driver::{Editor, sphere_with_wrong_cap, start};

fn key(key: Key) -> KeyboardShortcut {
    KeyboardShortcut::new(Modifiers::NONE, key)
}

/// The editor with the list of keys open.
fn start_with_keys() -> Option<Editor> {
    let mut editor = start(|_| None)?;
    editor.key(Modifiers::COMMAND, Key::Comma);
    assert!(editor.shows("Preferences"));
    editor.click_button("Keys");
    Some(editor)
}

/// Lists only the commands with this text, so that all of them are in view.
fn search(editor: &mut Editor, text: &str) {
    let label = "Search a command or a key";
    editor.harness.get_by_role_and_label(Role::TextInput, label).focus();
    editor.harness.run_steps(1);
    editor.key(Modifiers::COMMAND, Key::A);
    editor
        .harness
        .get_by_role_and_label(Role::TextInput, label)
        .type_text(text);
    editor.harness.run_steps(2);
}

fn keys_of(editor: &Editor, command: Command) -> Vec<KeyboardShortcut> {
    Keymap::of(&editor.harness.ctx).keys(command).to_vec()
}

fn about_is_open(editor: &Editor) -> bool {
    editor.shows("An editor for the consistent orientation")
}

#[test]
fn a_held_modifier_is_part_of_the_recorded_key() {
    let Some(mut editor) = start_with_keys() else { return };
    search(&mut editor, "about");
    editor.click_button("Add a key to About Normend");
    let held = [
        (Key::ControlLeft, Modifiers::COMMAND | Modifiers::CTRL),
        (Key::ShiftLeft, Modifiers::COMMAND | Modifiers::CTRL | Modifiers::SHIFT),
        (Key::AltRight, Modifiers::NONE),
        (Key::SuperLeft, Modifiers::NONE),
    ];
    // As they arrive from a keyboard: each goes down by itself.
    for (key, modifiers) in held {
        editor.harness.event(egui::Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers,
        });
        editor.harness.run_steps(1);
        assert!(
            editor.shows("Press the key for “About Normend”"),
            "{key:?} alone was taken"
        );
        assert!(keys_of(&editor, Command::About).is_empty());
    }
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::K);
    let expect = KeyboardShortcut::new(Modifiers::COMMAND | Modifiers::SHIFT, Key::K);
    assert_eq!(keys_of(&editor, Command::About), [expect]);
}

#[test]
fn a_recorded_key_gives_its_command_and_is_shown_and_kept() {
    let Some(mut editor) = start_with_keys() else { return };
    // A command without a key gets one; while it is recorded the key does nothing else.
    search(&mut editor, "about");
    editor.click_button("Add a key to About Normend");
    assert!(editor.shows("Press the key for “About Normend”"));
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::F9);
    assert!(!about_is_open(&editor));
    let expect = KeyboardShortcut::new(Modifiers::COMMAND | Modifiers::SHIFT, Key::F9);
    assert_eq!(keys_of(&editor, Command::About), [expect]);
    editor.key(Modifiers::NONE, Key::Escape);
    assert!(!editor.shows("Preferences"));
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::F9);
    assert!(about_is_open(&editor));
    editor.key(Modifiers::NONE, Key::Escape);
    // The sheet and the palette show it.
    editor.key(Modifiers::NONE, Key::F1);
    assert!(editor.shows("Ctrl+Shift+F9"));
    editor.key(Modifiers::NONE, Key::Escape);
    let (kept, problem) = SettingsStore::load_from(&editor.folder.path().join("settings"));
    assert_eq!(problem, None);
    assert_eq!(kept.settings.keys.keys(Command::About), [expect]);
    let text = std::fs::read_to_string(editor.folder.path().join("settings/settings.toml")).unwrap();
    assert!(
        text.contains("About = [") && !text.contains("Undo"),
        "only what differs: {text}"
    );
}

#[test]
fn a_key_of_another_command_is_not_taken_silently() {
    let Some(mut editor) = start_with_keys() else { return };
    search(&mut editor, "about normend");
    editor.click_button("Add a key to About Normend");
    editor.key(Modifiers::COMMAND, Key::E);
    assert!(editor.shows("Ctrl+E is the key of “Export…”"));
    assert!(keys_of(&editor, Command::About).is_empty());
    editor.click_button("Leave it");
    assert_eq!(keys_of(&editor, Command::Export), Command::Export.default_keys());
    editor.click_button("Add a key to About Normend");
    editor.key(Modifiers::COMMAND, Key::E);
    editor.click_button("Take it for “About Normend”");
    assert!(keys_of(&editor, Command::Export).is_empty());
    assert_eq!(keys_of(&editor, Command::About), Command::Export.default_keys());
    // What belongs to text fields, the focus and Escape is no key of a command.
    search(&mut editor, "ctrl+z");
    editor.click_button("Add a key to Undo");
    editor.harness.event(egui::Event::Copy);
    editor.harness.run_steps(2);
    assert!(editor.shows("stay with text"));
    editor.key(Modifiers::NONE, Key::Tab);
    assert!(editor.shows("Tab moves between buttons"));
    editor.key(Modifiers::NONE, Key::Escape);
    assert!(editor.shows("Preferences"), "Escape only ends the recording");
    assert_eq!(keys_of(&editor, Command::Undo), Command::Undo.default_keys());
    // Resetting a command takes its keys back; the other has none.
    search(&mut editor, "export…");
    editor.click_button("Reset the keys of Export…");
    assert_eq!(keys_of(&editor, Command::Export), Command::Export.default_keys());
    assert!(keys_of(&editor, Command::About).is_empty());
}

#[test]
fn keys_are_changed_removed_and_reset() {
    let Some(mut editor) = start_with_keys() else { return };
    search(&mut editor, "ctrl+z");
    editor.click_button("Change Ctrl+Z of Undo");
    editor.key(Modifiers::NONE, Key::F20);
    assert_eq!(keys_of(&editor, Command::Undo), [key(Key::F20)]);
    // The list is searched by keys as well.
    search(&mut editor, "ctrl+y");
    editor.click_button("Remove Ctrl+Y from Redo");
    assert_eq!(keys_of(&editor, Command::Redo), Command::Redo.default_keys()[..1]);
    editor.click_button("Reset all");
    assert!(Keymap::of(&editor.harness.ctx).is_default());
    assert_eq!(keys_of(&editor, Command::Undo), Command::Undo.default_keys());
}

fn theme(editor: &Editor) -> ThemeChoice {
    let (kept, _) = SettingsStore::load_from(&editor.folder.path().join("settings"));
    kept.settings.theme
}

#[test]
fn lists_are_used_by_keyboard() {
    let Some(mut editor) = start(|_| None) else { return };
    editor.key(Modifiers::COMMAND, Key::Comma);
    // Opened by keyboard: the arrows stay in the list, whatever lies under it.
    editor.harness.get_by_role_and_label(Role::ComboBox, "Theme").focus();
    editor.harness.run_steps(2);
    editor.key(Modifiers::NONE, Key::Enter);
    for _ in 0..2 {
        editor.key(Modifiers::NONE, Key::ArrowDown);
    }
    assert!(editor.is_focused(Role::Button, ThemeChoice::Light.label()));
    editor.key(Modifiers::NONE, Key::Enter);
    editor.harness.run_steps(2);
    assert_eq!(theme(&editor), ThemeChoice::Light);
    assert!(
        !egui::Popup::is_any_open(&editor.harness.ctx),
        "what is chosen closes the list"
    );
    assert!(editor.is_focused(Role::ComboBox, "Theme"));
    // Opened by a click, when egui's own search finds nothing to begin with.
    editor.harness.get_by_role_and_label(Role::ComboBox, "Theme").click();
    editor.harness.run_steps(2);
    editor.key(Modifiers::NONE, Key::Home);
    assert!(editor.is_focused(Role::Button, ThemeChoice::System.label()));
    editor.key(Modifiers::NONE, Key::ArrowUp);
    assert!(
        editor.is_focused(Role::Button, ThemeChoice::Dark.label()),
        "past the top comes the end"
    );
    editor.key(Modifiers::NONE, Key::Enter);
    editor.harness.run_steps(2);
    assert_eq!(theme(&editor), ThemeChoice::Dark);
    // Escape closes the list and changes nothing; the window under it stays.
    editor.harness.get_by_role_and_label(Role::ComboBox, "Theme").click();
    editor.harness.run_steps(2);
    editor.key(Modifiers::NONE, Key::Home);
    editor.key(Modifiers::NONE, Key::Escape);
    assert_eq!(theme(&editor), ThemeChoice::Dark);
    assert!(editor.shows("Interface size"));
    // Down opens the closed list that has the focus, and then goes through it.
    editor.harness.get_by_role_and_label(Role::ComboBox, "Theme").focus();
    editor.harness.run_steps(2);
    for modifiers in [Modifiers::NONE, Modifiers::ALT] {
        editor.key(modifiers, Key::ArrowDown);
        assert!(egui::Popup::is_any_open(&editor.harness.ctx), "{modifiers:?}");
        editor.key(Modifiers::NONE, Key::ArrowDown);
        assert!(editor.is_focused(Role::Button, ThemeChoice::System.label()));
        editor.key(Modifiers::NONE, Key::Enter);
        editor.harness.run_steps(2);
        assert_eq!(theme(&editor), ThemeChoice::System);
        assert!(editor.is_focused(Role::ComboBox, "Theme"));
    }
    // What is no list is left by the same key.
    editor
        .harness
        .get_by_role_and_label(Role::CheckBox, "Reduce motion")
        .focus();
    editor.harness.run_steps(2);
    editor.key(Modifiers::NONE, Key::ArrowDown);
    assert!(!egui::Popup::is_any_open(&editor.harness.ctx));
}

#[test]
fn tab_reaches_every_button_in_the_order_they_are_read() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let mut reached = Vec::new();
    for _ in 0..120 {
        editor.key(Modifiers::NONE, Key::Tab);
        let focused = editor
            .harness
            .query_all(egui_kittest::kittest::by().predicate(|node| node.is_focused()))
            .next()
            .map(|node| {
                let widget = node.accesskit_node();
                (widget.role(), widget.label().unwrap_or_default())
            });
        let Some(focused) = focused else { continue };
        if reached.first().is_some_and(|first| *first == focused) {
            break;
        }
        reached.push(focused);
    }
    let names: BTreeSet<&str> = reached.iter().map(|(_, label)| label.as_str()).collect();
    for name in ["File", "Help", "Open…", "Export…", "Undo", "3D view"] {
        let is_enabled = name != "Undo";
        assert_eq!(names.contains(name), is_enabled, "{name}: {names:?}");
    }
    let place = |name: &str| reached.iter().position(|(_, label)| label == name).unwrap();
    assert!(place("File") < place("Help") && place("Help") < place("Open…") && place("Open…") < place("Export…"));
    // The view comes before the panel beside it, as one reads; then the edge of the panel and its tabs.
    let order = ["Export…", "3D view", "Width of the side panel", "Orient", "History"].map(place);
    assert!(order.is_sorted(), "{order:?}: {reached:?}");
}

#[test]
fn keys_mend_where_the_user_points_or_at_the_crosshair() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let before = editor.bits();
    // In the middle of the view nobody points at anything.
    editor.hover(egui::pos2(5.0, 5.0));
    for (modifiers, key) in [
        (Modifiers::NONE, Key::Enter),
        (Modifiers::SHIFT, Key::Enter),
        (Modifiers::ALT, Key::Enter),
        (Modifiers::COMMAND, Key::G),
    ] {
        editor.key(modifiers, key);
        editor.harness.run_steps(20);
    }
    assert!(editor.said("Point at the scan first"));
    let document = editor.app().document().unwrap();
    assert_eq!((document.n_done(), editor.app().n_would_turn()), (0, None));

    let n_tabs = (0..60).find(|_| {
        editor.key(Modifiers::NONE, Key::Tab);
        editor.is_focused(Role::Image, "3D view")
    });
    assert!(n_tabs.is_some(), "Tab never comes to the view");
    editor.wait("a preview at the crosshair", |app| app.n_would_turn().is_some());
    editor.harness.run_steps(2);
    let n_points = editor.app().n_would_turn().unwrap();
    let turns = format!(
        "A click turns {}",
        normend_app::theme::counted(n_points, "point", "points")
    );
    assert!(editor.shows(&turns), "{turns}");
    editor.key(Modifiers::NONE, Key::Enter);
    editor.wait("a mend", |app| app.document().unwrap().n_done() == 1);
    let n_turned: u32 = std::iter::zip(&before, editor.bits())
        .map(|(a, b)| (a ^ b).count_ones())
        .sum();
    assert_eq!(u64::from(n_turned), n_points);
}
