//! The editor: the only place where core, io and render meet.

use std::path::PathBuf;

/// Opens the editor's window, with `scan` when one is given, and runs until it is closed.
///
/// # Errors
/// In words for the user: no display, no graphics driver, and the package that gives it.
pub fn run(scan: Option<PathBuf>) -> anyhow::Result<()> {
    let _ = scan;
    unimplemented!()
}
