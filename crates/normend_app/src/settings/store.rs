//! The file of the settings: one small TOML file in the user's configuration folder.
//!
//! Each value is judged for itself: one that is not understood gets its default, and a copy of the file stays as
//! `settings.toml.broken`. A file that is no TOML, or of a newer program, is set aside as that, never silently overwritten.
//!
//! Two editors may run at once: only what changed here is written into what the file says by then.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use normend_io::io_words;
use serde::Deserialize;
use toml::{Table, Value};

use super::{Settings, VERSION};
use crate::folders;

const FILE_NAME: &str = "settings.toml";
/// More are no settings: a hundred times what all values take.
const MOST_BYTES: u64 = 1 << 20;
const BROKEN_NAME: &str = "settings.toml.broken";
/// Held while the file is read and written again.
const LOCK_NAME: &str = "settings.lock";

/// The settings and the file they are kept in.
#[derive(Debug)]
pub struct SettingsStore {
    /// As they are now.
    pub settings: Settings,
    saved: Settings,
    folder: Option<PathBuf>,
    /// Of journals and crash reports.
    state_folder: Option<PathBuf>,
}

impl SettingsStore {
    /// Reads the settings of the user, or of the folder that `NORMEND_CONFIG_DIR` names.
    ///
    /// The second value says in words what was wrong with the file, if anything.
    pub fn load() -> (Self, Option<String>) {
        match folders::config_folder() {
            Some(folder) => {
                let (store, problem) = Self::load_from(&folder);
                let state_folder = folders::state_folder();
                (Self { state_folder, ..store }, problem)
            }
            None => (
                Self {
                    settings: Settings::default(),
                    saved: Settings::default(),
                    folder: None,
                    state_folder: folders::state_folder(),
                },
                Some("Settings are not kept: this system names no configuration folder.".to_owned()),
            ),
        }
    }

    /// Reads the settings kept in `folder`; a missing file gives the defaults. Journals lie in `state` inside it.
    pub fn load_from(folder: &Path) -> (Self, Option<String>) {
        let (settings, problem) = read(folder);
        (
            Self {
                saved: settings.clone(),
                settings,
                folder: Some(folder.to_path_buf()),
                state_folder: Some(folder.join("state")),
            },
            problem,
        )
    }

    /// Where journals lie; `None` when the system names no folder for them. It need not exist.
    pub fn journals_folder(&self) -> Option<PathBuf> {
        Some(self.state_folder.as_ref()?.join("journals"))
    }

    /// Writes what changed since the last call, if anything. What another editor wrote meanwhile stays.
    ///
    /// # Errors
    /// In words, once for each change.
    pub fn save_if_changed(&mut self) -> Result<(), String> {
        if self.settings == self.saved {
            return Ok(());
        }
        let before = std::mem::replace(&mut self.saved, self.settings.clone());
        let Some(folder) = &self.folder else { return Ok(()) };
        write(folder, &before, &self.settings).map_err(|error| {
            let reason = error
                .downcast_ref::<io::Error>()
                .map_or_else(|| error.to_string(), io_words);
            format!("The settings could not be saved in {}: {reason}.", folder.display())
        })
    }
}

/// Why a file gives no settings.
enum Unread {
    Missing,
    Unreadable(io::Error),
    NotUnderstood(String),
}

/// What the file says, in the form of this version.
fn read_table(file: &Path) -> Result<Table, Unread> {
    let metadata = fs::metadata(file).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => Unread::Missing,
        _ => Unread::Unreadable(error),
    })?;
    // A pipe would be waited for, a device read without end.
    if !metadata.is_file() {
        return Err(Unread::NotUnderstood("it is no file".to_owned()));
    }
    if metadata.len() > MOST_BYTES {
        return Err(Unread::NotUnderstood("it is larger than settings are".to_owned()));
    }
    let text = fs::read_to_string(file).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => Unread::Missing,
        io::ErrorKind::InvalidData => Unread::NotUnderstood("it is no text".to_owned()),
        _ => Unread::Unreadable(error),
    })?;
    let mut table: Table = text
        .parse()
        .map_err(|error: toml::de::Error| Unread::NotUnderstood(error.message().to_owned()))?;
    // The first files that were kept by hand had no version.
    match table.get("version").map_or(Some(1), Value::as_integer) {
        Some(version) if (1..=i64::from(VERSION)).contains(&version) => migrate(&mut table, version),
        Some(version) => return Err(Unread::NotUnderstood(format!("version {version} is not known"))),
        None => return Err(Unread::NotUnderstood("its version is not a number".to_owned())),
    }
    Ok(table)
}

/// Brings the values of an older version to where this one has them.
fn migrate(table: &mut Table, version: i64) {
    if version < 2 {
        for (old, group, name) in [
            ("window_size", "window", "size"),
            ("open_folder", "folders", "open"),
            ("export_folder", "folders", "export"),
        ] {
            if let Some(value) = table.remove(old)
                && let Some(group) = table
                    .entry(group)
                    .or_insert_with(|| Value::Table(Table::new()))
                    .as_table_mut()
            {
                group.entry(name).or_insert(value);
            }
        }
    }
    table.insert("version".to_owned(), Value::Integer(i64::from(VERSION)));
}

fn read(folder: &Path) -> (Settings, Option<String>) {
    let file = folder.join(FILE_NAME);
    let aside = folder.join(BROKEN_NAME);
    match read_table(&file) {
        Ok(table) => {
            let (settings, wrong) = take_values(&table);
            if wrong.is_empty() {
                return (settings, None);
            }
            // The next change writes the file, so what the user wrote is kept beside it.
            let copied = fs::read(&file)
                .map_err(|error| io_words(&error))
                .and_then(|bytes| normend_io::write_bytes(&aside, &bytes).map_err(|error| error.to_string()));
            let kept = match copied {
                Ok(()) => format!("a copy is {}", aside.display()),
                Err(error) => format!("it could not be copied: {error}"),
            };
            let problem = format!(
                "In the settings {} is not understood and has its default ({}; {kept}).",
                wrong.join(", "),
                file.display()
            );
            (settings, Some(problem))
        }
        Err(Unread::Missing) => (Settings::default(), None),
        Err(Unread::Unreadable(error)) => {
            let problem = format!(
                "The settings in {} cannot be read ({}); defaults are used.",
                file.display(),
                io_words(&error)
            );
            (Settings::default(), Some(problem))
        }
        Err(Unread::NotUnderstood(reason)) => {
            let outcome = match fs::rename(&file, &aside) {
                Ok(()) => format!("it is now {}", aside.display()),
                Err(error) => format!("it could not be renamed: {}", io_words(&error)),
            };
            let problem = format!(
                "The settings in {} are not understood ({reason}); defaults are used, {outcome}.",
                file.display()
            );
            (Settings::default(), Some(problem))
        }
    }
}

/// The settings that `table` describes, and the names of the values that are not understood.
fn take_values(table: &Table) -> (Settings, Vec<String>) {
    let mut accepted = Table::new();
    let mut wrong = Vec::new();
    for (name, value) in table {
        match value {
            Value::Table(group) => {
                for (inner, value) in group {
                    let mut part = Table::new();
                    part.insert(inner.clone(), value.clone());
                    let is_understood = is_understood(name, Value::Table(part));
                    if !is_understood {
                        wrong.push(format!("“{name}.{inner}”"));
                    } else if let Some(group) = accepted
                        .entry(name.clone())
                        .or_insert_with(|| Value::Table(Table::new()))
                        .as_table_mut()
                    {
                        group.insert(inner.clone(), value.clone());
                    }
                }
            }
            _ if is_understood(name, value.clone()) => {
                accepted.insert(name.clone(), value.clone());
            }
            _ => wrong.push(format!("“{name}”")),
        }
    }
    // Every value was understood alone and every other has a default.
    let settings = Settings::deserialize(accepted).unwrap_or_default();
    (settings.into_sane(), wrong)
}

/// Whether settings can have this value; names that are not known may be of another version, and do no harm.
fn is_understood(name: &str, value: Value) -> bool {
    let mut alone = Table::new();
    alone.insert(name.to_owned(), value);
    Settings::deserialize(alone).is_ok()
}

/// Writes what differs between `before` and `now` into the file.
fn write(folder: &Path, before: &Settings, now: &Settings) -> Result<(), Box<dyn std::error::Error>> {
    fs::create_dir_all(folder)?;
    // Until the end of this function. A file system without locks has them all unlocked.
    let lock = File::create(folder.join(LOCK_NAME))?;
    let _ = lock.lock();
    let file = folder.join(FILE_NAME);
    let (before, now) = (Table::try_from(before)?, Table::try_from(now)?);
    let table = match read_table(&file) {
        Ok(mut table) => {
            merge(&mut table, &before, &now);
            table
        }
        Err(_) => now,
    };
    normend_io::write_bytes(&file, toml::to_string_pretty(&table)?.as_bytes())?;
    Ok(())
}

/// Makes the changes from `before` to `now` in `table`, value by value.
fn merge(table: &mut Table, before: &Table, now: &Table) {
    for (name, value) in now {
        match (before.get(name), value) {
            (Some(old), value) if old == value => {}
            (Some(Value::Table(before)), Value::Table(now)) => {
                let group = table.entry(name.clone()).or_insert_with(|| Value::Table(Table::new()));
                match group {
                    Value::Table(group) => merge(group, before, now),
                    _ => *group = Value::Table(now.clone()),
                }
            }
            _ => {
                table.insert(name.clone(), value.clone());
            }
        }
    }
    for name in before.keys().filter(|name| !now.contains_key(*name)) {
        table.remove(name);
    }
}

#[cfg(test)]
mod tests {
    use egui::{Key, KeyboardShortcut, Modifiers};

    use super::super::{PaletteChoice, Purpose, ThemeChoice};
    use super::*;
    use crate::command::Command;

    fn written(content: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(FILE_NAME), content).unwrap();
        folder
    }

    #[test]
    fn settings_survive_a_restart() {
        let folder = tempfile::tempdir().unwrap();
        let (mut store, problem) = SettingsStore::load_from(folder.path());
        assert_eq!((store.settings.clone(), problem), (Settings::default(), None));
        store.settings.theme = ThemeChoice::Light;
        store.settings.splat_scale = 1.5;
        store.settings.ui_scale = 1.25;
        store.settings.window.position = Some([10.0, 20.0]);
        store.settings.dismissed_hints.insert("point".to_owned());
        store.settings.remember_command("Undo");
        let key = KeyboardShortcut::new(Modifiers::COMMAND | Modifiers::SHIFT, Key::U);
        store.settings.keys.set(Command::Undo, vec![key]);
        store.settings.keys.set(Command::Quit, Vec::new());
        store.settings.remember_scan(Path::new("/scans/a.ply"));
        store.save_if_changed().unwrap();
        let (again, problem) = SettingsStore::load_from(folder.path());
        assert_eq!((again.settings, problem), (store.settings, None));
    }

    #[test]
    fn a_broken_file_is_set_aside() {
        for content in ["version = 99", "version = \"two\"", "= ]"] {
            let folder = written(content);
            let (store, problem) = SettingsStore::load_from(folder.path());
            assert_eq!(store.settings, Settings::default());
            let problem = problem.unwrap();
            assert!(problem.contains(BROKEN_NAME), "{problem}");
            assert_eq!(fs::read_to_string(folder.path().join(BROKEN_NAME)).unwrap(), content);
            assert!(!folder.path().join(FILE_NAME).exists());
        }
    }

    #[test]
    fn a_file_that_is_too_large_is_set_aside() {
        let folder = written(&format!("# {}", "a".repeat(1 << 20)));
        let (store, problem) = SettingsStore::load_from(folder.path());
        assert_eq!(store.settings, Settings::default());
        assert!(problem.unwrap().contains("larger than settings are"));
    }

    #[cfg(unix)]
    #[test]
    fn what_is_no_file_is_set_aside() {
        for target in ["pipe", "/dev/zero"] {
            let folder = tempfile::tempdir().unwrap();
            let file = folder.path().join(FILE_NAME);
            if target == "pipe" {
                assert!(
                    std::process::Command::new("mkfifo")
                        .arg(&file)
                        .status()
                        .unwrap()
                        .success()
                );
            } else {
                std::os::unix::fs::symlink(target, &file).unwrap();
            }
            let (mut store, problem) = SettingsStore::load_from(folder.path());
            assert!(problem.unwrap().contains("it is no file"));
            store.settings.theme = ThemeChoice::Dark;
            store.save_if_changed().unwrap();
            assert_eq!(
                SettingsStore::load_from(folder.path()).0.settings.theme,
                ThemeChoice::Dark
            );
        }
    }

    #[test]
    fn one_wrong_value_costs_only_itself() {
        let content = "version = 2\ntheme = 3\npalette = \"paper\"\n[keys]\nUndo = [\"Ctrl+Nothing\"]\nFlip = [\"ShiftLeft\"]\nRedo = [\"Ctrl+R\"]\n\
                       [window]\nsize = \"large\"\nmaximized = true";
        let folder = written(content);
        let (store, problem) = SettingsStore::load_from(folder.path());
        let problem = problem.unwrap();
        for name in ["“theme”", "“keys.Undo”", "“keys.Flip”", "“window.size”"] {
            assert!(problem.contains(name), "{name}: {problem}");
        }
        assert!(!problem.contains("palette") && !problem.contains("Redo"), "{problem}");
        let settings = &store.settings;
        assert_eq!(settings.palette, PaletteChoice::Paper);
        assert_eq!(settings.theme, ThemeChoice::System);
        assert!(settings.window.maximized);
        assert_eq!(settings.keys.keys(Command::Undo), Command::Undo.default_keys());
        assert_eq!(
            settings.keys.keys(Command::Redo),
            [KeyboardShortcut::new(Modifiers::COMMAND, Key::R)]
        );
        assert_eq!(fs::read_to_string(folder.path().join(BROKEN_NAME)).unwrap(), content);
    }

    #[test]
    fn the_first_version_is_still_read() {
        let content = "version = 1\npalette = \"paper\"\nwindow_size = [700.0, 500.0]\nopen_folder = \"/in\"\nexport_folder = \"/out\"";
        let folder = written(content);
        let (mut store, problem) = SettingsStore::load_from(folder.path());
        assert_eq!(problem, None);
        assert_eq!(store.settings.palette, PaletteChoice::Paper);
        assert_eq!(store.settings.window.size, [700.0, 500.0]);
        assert_eq!(store.settings.folder(Purpose::Open), Some(Path::new("/in")));
        assert_eq!(store.settings.folder(Purpose::Export), Some(Path::new("/out")));
        store.settings.splat_scale = 2.0;
        store.save_if_changed().unwrap();
        let text = fs::read_to_string(folder.path().join(FILE_NAME)).unwrap();
        assert!(text.contains("version = 2") && !text.contains("open_folder"), "{text}");
        assert_eq!(SettingsStore::load_from(folder.path()).0.settings, store.settings);
    }

    #[test]
    fn values_out_of_range_are_tamed() {
        let folder = written("splat_scale = inf\nui_scale = nan\n[window]\nsize = [-3.0, nan]\nposition = [-5.0, 1e9]");
        let (store, problem) = SettingsStore::load_from(folder.path());
        assert_eq!((store.settings, problem), (Settings::default(), None));
    }

    #[test]
    fn two_editors_keep_what_the_other_changed() {
        let folder = written("of_a_newer_program = 7\n[keys]\nOfANewerProgram = [\"F12\"]");
        let (mut one, _) = SettingsStore::load_from(folder.path());
        let (mut other, _) = SettingsStore::load_from(folder.path());
        one.settings.theme = ThemeChoice::Dark;
        one.settings.keys.set(Command::Undo, Vec::new());
        one.settings.folders.insert(Purpose::Open, PathBuf::from("/in"));
        one.save_if_changed().unwrap();
        other.settings.palette = PaletteChoice::Paper;
        other.settings.keys.set(Command::Redo, Vec::new());
        other.settings.folders.insert(Purpose::Export, PathBuf::from("/out"));
        other.save_if_changed().unwrap();
        let (both, problem) = SettingsStore::load_from(folder.path());
        assert_eq!(problem, None);
        let settings = both.settings;
        assert_eq!(
            (settings.theme, settings.palette),
            (ThemeChoice::Dark, PaletteChoice::Paper)
        );
        assert!(settings.keys.keys(Command::Undo).is_empty() && settings.keys.keys(Command::Redo).is_empty());
        assert_eq!(settings.folders.len(), 2);
        // A value that went back to its default leaves the file.
        one.settings.keys.reset_all();
        one.save_if_changed().unwrap();
        let text = fs::read_to_string(folder.path().join(FILE_NAME)).unwrap();
        assert!(!text.contains("Undo") && text.contains("Redo"), "{text}");
        assert!(text.contains("of_a_newer_program") && text.contains("OfANewerProgram"));
    }

    #[test]
    fn many_writers_never_break_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        std::thread::scope(|scope| {
            for writer in 0..4 {
                scope.spawn(move || {
                    for round in 0..25 {
                        let (mut store, problem) = SettingsStore::load_from(path);
                        assert_eq!(problem, None);
                        store.settings.dismissed_hints.insert(format!("{writer}"));
                        store.settings.remember_command(&format!("{writer} {round}"));
                        store.save_if_changed().unwrap();
                    }
                });
            }
        });
        let (store, problem) = SettingsStore::load_from(path);
        assert_eq!(problem, None);
        assert!(!store.settings.recent_commands.is_empty());
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_said_once() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        let (mut store, _) = SettingsStore::load_from(&file);
        store.settings.theme = ThemeChoice::Dark;
        assert!(store.save_if_changed().is_err());
        assert!(store.save_if_changed().is_ok());
    }
}
