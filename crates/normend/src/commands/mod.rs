//! What each command means.

pub mod check;
pub mod generate;
pub mod orient;
pub mod render;

use std::path::Path;

use anyhow::Context;
use clap::CommandFactory;
use clap::error::ErrorKind;

use crate::arguments::{Arguments, CommonArguments};
use crate::console;

/// How a command ended when nothing stopped it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All was done.
    Done,
    /// Something failed, and was said already.
    Failed,
}

/// Prepares threads and Ctrl-C, as every command does before its work.
///
/// # Errors
/// When the system gives no threads or signal handlers.
fn prepare(common: &CommonArguments) -> anyhow::Result<()> {
    console::stop_on_interrupt()?;
    if let Some(n_threads) = common.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build_global()
            .with_context(|| format!("cannot work with {n_threads} threads"))?;
    }
    Ok(())
}

/// An error of wrong use: clap's sentence with the usage, and exit code 2.
fn wrong_use(sentence: impl std::fmt::Display) -> anyhow::Error {
    Arguments::command().error(ErrorKind::ValueValidation, sentence).into()
}

/// Whether both paths name the same existing file.
fn is_same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// The name of a file for the title of a bar.
fn title_of(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}
