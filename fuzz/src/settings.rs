//! What the editor keeps of its user: the file of settings, and keys.

use std::fs;

use egui::KeyboardShortcut;
use normend_app::SettingsStore;
use normend_app::command::{Command, Keymap};
use normend_app::settings::{PaletteChoice, Settings, ThemeChoice};

use crate::limits::{folder, limited};

/// Reads `bytes` as the file of settings; they are used, changed and saved, and what is read again is what was saved.
pub fn check(bytes: &[u8]) {
    let folder = folder().join("settings");
    // What an earlier input left behind, if anything.
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("no folder for settings");
    fs::write(folder.join("settings.toml"), bytes).expect("settings cannot be written");
    limited(bytes.len(), || {
        let (mut store, problem) = SettingsStore::load_from(&folder);
        if let Some(problem) = problem {
            assert!(
                problem.ends_with('.') && problem.len() < 4000 + 8 * bytes.len(),
                "{problem}"
            );
            assert!(!problem.chars().any(char::is_control), "{problem:?}");
        }
        check_sane(&store.settings);
        change(&mut store.settings);
        store.save_if_changed().expect("settings cannot be saved");
        let (again, problem) = SettingsStore::load_from(&folder);
        assert_eq!(again.settings, store.settings, "{problem:?}");
    });
}

/// What the window is made of must be usable, whatever the file says.
fn check_sane(settings: &Settings) {
    for value in [settings.splat_scale, settings.ui_scale, settings.side_width] {
        assert!(value.is_finite() && value > 0.0);
    }
    assert!(
        settings
            .window
            .size
            .iter()
            .all(|side| (100.0..100_000.0).contains(side))
    );
    assert!(settings.recent.len() <= 100 && settings.recent_commands.len() <= 100);
}

fn change(settings: &mut Settings) {
    settings.theme = match settings.theme {
        ThemeChoice::Dark => ThemeChoice::Light,
        _ => ThemeChoice::Dark,
    };
    settings.palette = PaletteChoice::Paper;
    settings.remember_command("Undo");
    settings.remember_scan("/scans/a.ply".as_ref());
    settings.keys.reset(Command::Undo);
}

/// Reads `bytes` as keys, a line a command: its name, and then its keys. They are written and read again; no key ends up with two
/// commands, whatever is changed.
pub fn check_keymap(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    limited(bytes.len(), || {
        let named = text.lines().filter_map(|line| {
            let mut words = line.split(' ');
            let name = words.next()?.to_owned();
            Some((name, toml::Value::from(words.map(str::to_owned).collect::<Vec<_>>())))
        });
        let table = toml::Table::from_iter(named);
        let Ok(mut keymap) = table.try_into::<Keymap>() else {
            return;
        };
        check_again(&keymap);
        for &command in Command::ALL {
            let keys: Vec<KeyboardShortcut> = keymap.keys(command).to_vec();
            for key in keys {
                keymap.add(command, key);
                assert_eq!(keymap.owner(key), Some(command));
                let owners = Command::ALL.iter().filter(|&&other| keymap.keys(other).contains(&key));
                assert_eq!(owners.count(), 1, "{key:?} belongs to two commands");
            }
        }
        check_again(&keymap);
        for &command in Command::ALL {
            keymap.reset(command);
        }
        assert!(keymap.is_default());
    });
}

fn check_again(keymap: &Keymap) {
    let written = toml::Table::try_from(keymap).expect("keys can be written");
    assert_eq!(written.try_into::<Keymap>().as_ref(), Ok(keymap));
}
