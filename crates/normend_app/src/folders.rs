//! Where Normend keeps things of its own: settings in one folder, what a crash must not take along in another.

use std::path::PathBuf;

/// The environment variable that names another folder for the settings.
pub const CONFIG_VARIABLE: &str = "NORMEND_CONFIG_DIR";
/// The environment variable that names another folder for journals and crash reports.
pub const STATE_VARIABLE: &str = "NORMEND_STATE_DIR";

/// The folder of the settings; `None` when the system names none. It need not exist.
pub fn config_folder() -> Option<PathBuf> {
    named_by(CONFIG_VARIABLE).or_else(|| Some(project()?.config_dir().to_path_buf()))
}

/// The folder of journals and crash reports; `None` when the system names none. It need not exist.
pub fn state_folder() -> Option<PathBuf> {
    named_by(STATE_VARIABLE).or_else(|| {
        let project = project()?;
        // Only Linux has a folder for state; elsewhere it lies with the data of this machine.
        let folder = project.state_dir().unwrap_or_else(|| project.data_local_dir());
        Some(folder.to_path_buf())
    })
}

fn named_by(variable: &str) -> Option<PathBuf> {
    std::env::var_os(variable)
        .filter(|folder| !folder.is_empty())
        .map(PathBuf::from)
}

fn project() -> Option<directories::ProjectDirs> {
    directories::ProjectDirs::from("", "", "normend")
}
