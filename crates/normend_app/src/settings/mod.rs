//! What the editor remembers between runs: the values. [`store`](SettingsStore) keeps them in a file.

mod display;
mod store;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::command::Keymap;
use crate::panels::side::SideTab;
use crate::text_columns::KnownColumns;
use crate::theme;
use crate::viewport::NavigationSettings;
pub use display::{DisplaySettings, HAIR_LENGTHS, HAIR_STEPS};
pub use store::SettingsStore;

/// Of the file. 1 had the window's size and the folders in fields of their own.
const VERSION: u32 = 2;
const MAX_RECENT: usize = 10;
/// Commands that the palette offers first.
const MAX_RECENT_COMMANDS: usize = 8;

/// Bounds of [`Settings::splat_scale`].
pub const SPLAT_SCALES: RangeInclusive<f32> = 0.25..=4.0;
/// Bounds of [`Settings::ui_scale`]: smaller is unreadable, larger leaves no room for the view.
pub const UI_SCALES: RangeInclusive<f32> = 0.7..=2.5;
/// Bounds of the window's sides, in points at scale 1.
const WINDOW_SIDES: RangeInclusive<f32> = 200.0..=20_000.0;

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
    /// Front blue, back orange.
    #[default]
    BlueOrange,
    /// Front green, back purple.
    GreenPurple,
    /// Front yellow, back deep blue.
    YellowBlue,
    /// Front light gray, back black, as in the figures of Liu et al.
    Paper,
}

impl PaletteChoice {
    /// All choices, in the order of menus. Each is told apart by color-blind users too.
    pub const ALL: [Self; 4] = [Self::BlueOrange, Self::GreenPurple, Self::YellowBlue, Self::Paper];

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::BlueOrange => "Blue and orange",
            Self::GreenPurple => "Green and purple",
            Self::YellowBlue => "Yellow and blue",
            Self::Paper => "Paper",
        }
    }
}

/// What a file is for; each purpose remembers its folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Purpose {
    /// Scans that are opened.
    Open,
    /// Oriented scans.
    Export,
    /// Recipes.
    Recipe,
    /// Scans to compare with.
    Reference,
    /// Screenshots and turntables.
    Picture,
}

/// Where the window is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct WindowPlace {
    /// Inner size, in points at scale 1.
    pub size: [f32; 2],
    /// Upper left corner on the first screen, in points at scale 1; `None` lets the desktop choose.
    pub position: Option<[f32; 2]>,
    /// Fills the screen; `size` is what it returns to.
    pub maximized: bool,
}

impl Default for WindowPlace {
    fn default() -> Self {
        Self {
            size: [1280.0, 800.0],
            position: None,
            maximized: false,
        }
    }
}

/// What is remembered. Every field has a default, so that older files stay readable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Of the file.
    pub version: u32,
    /// Light or dark.
    pub theme: ThemeChoice,
    /// Front and back colors.
    pub palette: PaletteChoice,
    /// Factor on splat radii.
    pub splat_scale: f32,
    /// How the scan is shown, apart from its coloring.
    pub display: DisplaySettings,
    /// Factor on text and widgets.
    pub ui_scale: f32,
    /// Things jump instead of gliding.
    pub reduce_motion: bool,
    /// How the user moves in the view.
    pub navigation: NavigationSettings,
    /// Where the window is.
    pub window: WindowPlace,
    /// What the side panel shows.
    pub side_tab: SideTab,
    /// Width of the side panel, in points.
    pub side_width: f32,
    /// The folder used last, for each purpose.
    pub folders: BTreeMap<Purpose, PathBuf>,
    /// Scans opened last, newest first, at most ten.
    pub recent: Vec<PathBuf>,
    /// Names of commands that were chosen in the palette, newest first.
    pub recent_commands: Vec<String>,
    /// Keys that differ from the table of commands.
    pub keys: Keymap,
    /// Hints for the first steps come.
    pub shows_hints: bool,
    /// Names of the hints that were dismissed.
    pub dismissed_hints: BTreeSet<String>,
    /// The file name of the last crash report that the user was told of.
    pub told_crash: String,
    /// What the user said of the columns of texts, newest first.
    pub columns: Vec<KnownColumns>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            version: VERSION,
            theme: ThemeChoice::default(),
            palette: PaletteChoice::default(),
            splat_scale: 1.0,
            display: DisplaySettings::default(),
            ui_scale: 1.0,
            reduce_motion: false,
            navigation: NavigationSettings::default(),
            window: WindowPlace::default(),
            side_tab: SideTab::default(),
            side_width: theme::SIDE_PANEL_WIDTH,
            folders: BTreeMap::new(),
            recent: Vec::new(),
            recent_commands: Vec::new(),
            keys: Keymap::default(),
            shows_hints: true,
            dismissed_hints: BTreeSet::new(),
            told_crash: String::new(),
            columns: Vec::new(),
        }
    }
}

impl Settings {
    /// Puts `path` first among the recent scans.
    pub fn remember_scan(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        self.remember_folder(Purpose::Open, &path);
        self.recent.retain(|recent| *recent != path);
        self.recent.insert(0, path);
        self.recent.truncate(MAX_RECENT);
    }

    /// Where the last file of this purpose was.
    pub fn folder(&self, purpose: Purpose) -> Option<&Path> {
        self.folders.get(&purpose).map(PathBuf::as_path)
    }

    /// Remembers the folder of `file` for its purpose.
    pub fn remember_folder(&mut self, purpose: Purpose, file: &Path) {
        if let Some(folder) = file.parent() {
            self.folders.insert(purpose, folder.to_path_buf());
        }
    }

    /// Puts a command first among those of the palette, by its name.
    pub fn remember_command(&mut self, name: &str) {
        self.recent_commands.retain(|recent| recent != name);
        self.recent_commands.insert(0, name.to_owned());
        self.recent_commands.truncate(MAX_RECENT_COMMANDS);
    }

    /// Brings every value into its bounds.
    fn into_sane(mut self) -> Self {
        let default = Self::default();
        let tame = |value: &mut f32, bounds: RangeInclusive<f32>, default: f32| {
            let sane = if value.is_finite() { *value } else { default };
            *value = sane.clamp(*bounds.start(), *bounds.end());
        };
        tame(&mut self.splat_scale, SPLAT_SCALES, default.splat_scale);
        self.display = self.display.into_sane();
        tame(&mut self.ui_scale, UI_SCALES, default.ui_scale);
        tame(&mut self.side_width, theme::SIDE_PANEL_WIDTHS, default.side_width);
        if !self.window.size.iter().all(|side| WINDOW_SIDES.contains(side)) {
            self.window.size = default.window.size;
        }
        let is_on_screen = |position: &[f32; 2]| position.iter().all(|at| (0.0..*WINDOW_SIDES.end()).contains(at));
        self.window.position = self.window.position.filter(is_on_screen);
        self.recent.truncate(MAX_RECENT);
        self.recent_commands.truncate(MAX_RECENT_COMMANDS);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(settings.folder(Purpose::Open), Some(Path::new("/scans")));
        assert_eq!(settings.folder(Purpose::Export), None);
    }
}
