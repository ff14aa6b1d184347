//! What the editor remembers between runs: one small TOML file in the user's configuration folder.
//!
//! A file that cannot be understood is set aside as `settings.toml.broken` and said so, never silently overwritten.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// The environment variable that names another folder for the settings.
pub const FOLDER_VARIABLE: &str = "NORMEND_CONFIG_DIR";

const FILE_NAME: &str = "settings.toml";
const VERSION: u32 = 1;
const MAX_RECENT: usize = 10;

/// Bounds of [`Settings::splat_scale`].
pub const SPLAT_SCALES: std::ops::RangeInclusive<f32> = 0.25..=4.0;

/// Light or dark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ThemeChoice {
    /// As the desktop says.
    #[default]
    System,
    /// Always light.
    Light,
    /// Always dark.
    Dark,
}

impl ThemeChoice {
    /// All choices, in the order of menus.
    pub const ALL: [Self; 3] = [Self::System, Self::Light, Self::Dark];

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::System => "As the system",
            Self::Light => "Light",
            Self::Dark => "Dark",
        }
    }

    /// egui's name for it.
    pub fn preference(self) -> egui::ThemePreference {
        match self {
            Self::System => egui::ThemePreference::System,
            Self::Light => egui::ThemePreference::Light,
            Self::Dark => egui::ThemePreference::Dark,
        }
    }
}

/// The colors of front and back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PaletteChoice {
    /// Front blue, back orange: told apart by color-blind users too.
    #[default]
    BlueOrange,
    /// Front light gray, back black, as in the figures of Liu et al.
    Paper,
}

impl PaletteChoice {
    /// All choices, in the order of menus.
    pub const ALL: [Self; 2] = [Self::BlueOrange, Self::Paper];

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::BlueOrange => "Blue and orange",
            Self::Paper => "Paper",
        }
    }
}

/// What is remembered. Every field has a default, so that older files stay readable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Of the file; this program writes and reads 1.
    pub version: u32,
    /// Light or dark.
    pub theme: ThemeChoice,
    /// Front and back colors.
    pub palette: PaletteChoice,
    /// Factor on splat radii.
    pub splat_scale: f32,
    /// Inner size of the window, in points.
    pub window_size: [f32; 2],
    /// Where the last scan was opened.
    pub open_folder: Option<PathBuf>,
    /// Where the last export went.
    pub export_folder: Option<PathBuf>,
    /// Scans opened last, newest first, at most ten.
    pub recent: Vec<PathBuf>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            version: VERSION,
            theme: ThemeChoice::default(),
            palette: PaletteChoice::default(),
            splat_scale: 1.0,
            window_size: [1280.0, 800.0],
            open_folder: None,
            export_folder: None,
            recent: Vec::new(),
        }
    }
}

impl Settings {
    /// Puts `path` first among the recent scans.
    pub fn remember_scan(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        self.open_folder = path.parent().map(Path::to_path_buf);
        self.recent.retain(|recent| *recent != path);
        self.recent.insert(0, path);
        self.recent.truncate(MAX_RECENT);
    }

    fn into_sane(mut self) -> Self {
        let default = Self::default();
        if !self.splat_scale.is_finite() {
            self.splat_scale = default.splat_scale;
        }
        self.splat_scale = self.splat_scale.clamp(*SPLAT_SCALES.start(), *SPLAT_SCALES.end());
        if !self
            .window_size
            .iter()
            .all(|side| side.is_finite() && (200.0..=20_000.0).contains(side))
        {
            self.window_size = default.window_size;
        }
        self.recent.truncate(MAX_RECENT);
        self
    }
}

/// The settings and the file they are kept in.
#[derive(Debug)]
pub struct SettingsStore {
    /// As they are now.
    pub settings: Settings,
    saved: Settings,
    folder: Option<PathBuf>,
}

impl SettingsStore {
    /// Reads the settings of the user, or of the folder that `NORMEND_CONFIG_DIR` names.
    ///
    /// The second value says in words what was wrong with the file, if anything.
    pub fn load() -> (Self, Option<String>) {
        let folder = std::env::var_os(FOLDER_VARIABLE).map(PathBuf::from).or_else(|| {
            directories::ProjectDirs::from("", "", "normend").map(|folders| folders.config_dir().to_path_buf())
        });
        match folder {
            Some(folder) => Self::load_from(&folder),
            None => (
                Self {
                    settings: Settings::default(),
                    saved: Settings::default(),
                    folder: None,
                },
                Some("Settings are not kept: this system names no configuration folder.".to_owned()),
            ),
        }
    }

    /// Reads the settings kept in `folder`; a missing file gives the defaults.
    pub fn load_from(folder: &Path) -> (Self, Option<String>) {
        let (settings, problem) = read(&folder.join(FILE_NAME));
        (
            Self {
                saved: settings.clone(),
                settings,
                folder: Some(folder.to_path_buf()),
            },
            problem,
        )
    }

    /// Writes the file if the settings changed since the last call.
    ///
    /// # Errors
    /// In words, once for each change.
    pub fn save_if_changed(&mut self) -> Result<(), String> {
        if self.settings == self.saved {
            return Ok(());
        }
        self.saved = self.settings.clone();
        let Some(folder) = &self.folder else { return Ok(()) };
        write(folder, &self.settings)
            .map_err(|error| format!("The settings could not be saved in {}: {error}.", folder.display()))
    }
}

fn read(file: &Path) -> (Settings, Option<String>) {
    let text = match fs::read_to_string(file) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return (Settings::default(), None),
        Err(error) => {
            let problem = format!(
                "The settings in {} cannot be read ({error}); defaults are used.",
                file.display()
            );
            return (Settings::default(), Some(problem));
        }
    };
    let reason = match toml::from_str::<Settings>(&text) {
        Ok(settings) if settings.version == VERSION => return (settings.into_sane(), None),
        Ok(settings) => format!("version {} is not known", settings.version),
        Err(error) => error.message().to_owned(),
    };
    let aside = file.with_extension("toml.broken");
    let outcome = match fs::rename(file, &aside) {
        Ok(()) => format!("it is now {}", aside.display()),
        Err(error) => format!("it could not be renamed: {error}"),
    };
    let problem = format!(
        "The settings in {} are not understood ({reason}); defaults are used, {outcome}.",
        file.display()
    );
    (Settings::default(), Some(problem))
}

fn write(folder: &Path, settings: &Settings) -> Result<(), Box<dyn std::error::Error>> {
    fs::create_dir_all(folder)?;
    // Beside it first, then renamed: a full disk leaves the old settings whole.
    let beside = folder.join(format!("{FILE_NAME}.new"));
    fs::write(&beside, toml::to_string_pretty(settings)?)?;
    fs::rename(&beside, folder.join(FILE_NAME))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_survive_a_restart() {
        let folder = tempfile::tempdir().unwrap();
        let (mut store, problem) = SettingsStore::load_from(folder.path());
        assert_eq!((store.settings.clone(), problem), (Settings::default(), None));
        store.settings.theme = ThemeChoice::Light;
        store.settings.splat_scale = 1.5;
        store.settings.remember_scan(Path::new("/scans/a.ply"));
        store.save_if_changed().unwrap();
        let (again, problem) = SettingsStore::load_from(folder.path());
        assert_eq!((again.settings, problem), (store.settings, None));
    }

    #[test]
    fn a_broken_file_is_set_aside() {
        for content in ["theme = 3", "version = 99", "= ]"] {
            let folder = tempfile::tempdir().unwrap();
            fs::write(folder.path().join(FILE_NAME), content).unwrap();
            let (store, problem) = SettingsStore::load_from(folder.path());
            assert_eq!(store.settings, Settings::default());
            let problem = problem.unwrap();
            assert!(problem.contains("settings.toml.broken"), "{problem}");
            assert_eq!(
                fs::read_to_string(folder.path().join("settings.toml.broken")).unwrap(),
                content
            );
            assert!(!folder.path().join(FILE_NAME).exists());
        }
    }

    #[test]
    fn values_out_of_range_are_tamed() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(
            folder.path().join(FILE_NAME),
            "splat_scale = inf\nwindow_size = [-3.0, nan]",
        )
        .unwrap();
        let (store, problem) = SettingsStore::load_from(folder.path());
        assert_eq!((store.settings, problem), (Settings::default(), None));
    }

    #[test]
    fn recent_scans_are_unique_and_few() {
        let mut settings = Settings::default();
        for index in 0..15 {
            settings.remember_scan(Path::new(&format!("/scans/{index}.ply")));
        }
        settings.remember_scan(Path::new("/scans/10.ply"));
        assert_eq!(settings.recent.len(), MAX_RECENT);
        assert_eq!(settings.recent[0], Path::new("/scans/10.ply"));
        assert_eq!(
            settings.recent.iter().filter(|path| path.ends_with("10.ply")).count(),
            1
        );
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
