//! What each command means.

pub mod batch;
pub mod bench;
pub mod check;
pub mod convert;
pub mod generate;
pub mod orient;
pub mod render;
pub mod replay;
pub mod scanner;
pub mod suspects;

use std::fmt;
use std::path::Path;

use anyhow::{Context, bail};
use normend_core::Progress;
use normend_io::{FileFormat, ReadError, Scan};

use crate::arguments::{CommonArguments, ReadArguments};
use crate::console::{self, Bar};

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

/// Wrong use that the parser cannot see, in words. The program says it with the usage of the command; exit code 2.
#[derive(Debug)]
pub struct WrongUse(String);

impl fmt::Display for WrongUse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for WrongUse {}

/// An error of wrong use.
pub fn wrong_use(sentence: impl fmt::Display) -> anyhow::Error {
    WrongUse(sentence.to_string()).into()
}

/// Refuses the name of standard output for a file.
fn check_is_file_name(output: &Path) -> anyhow::Result<()> {
    if output == Path::new("-") {
        return Err(wrong_use(
            "the output cannot go to standard output (-): give -o the name of a file",
        ));
    }
    Ok(())
}

/// Refuses, before the work, a name for a scan whose extension promises another format than is written.
fn check_scan_name(output: &Path, input: Option<&Path>) -> anyhow::Result<()> {
    check_is_file_name(output)?;
    FileFormat::of_target(output, input).map(drop).map_err(wrong_use)
}

/// Reads a scan, and says what the columns of a text were taken for where that is not certain.
///
/// # Errors
/// As [`normend_io::read`].
fn read(path: &Path, reading: &ReadArguments, bar: &Bar, progress: &dyn Progress) -> Result<Scan, ReadError> {
    let scan = normend_io::read_with(path, &reading.options(), progress)?;
    if let Some(columns) = scan.text_columns().filter(|columns| !columns.is_certain) {
        let name = |name: &String| if name.is_empty() { "-".to_owned() } else { name.clone() };
        let names: Vec<String> = columns.names.iter().map(name).collect();
        bar.say(&format!(
            "{}: its columns have no names; taken for \"{}\" (--columns says it otherwise)",
            path.display(),
            names.join(" ")
        ));
    }
    Ok(scan)
}

/// Refuses, before the work, to replace a file that nobody allowed to replace.
fn check_may_write(output: &Path, overwrite: bool) -> anyhow::Result<()> {
    if !overwrite && output.is_file() {
        bail!(
            "{} exists already: name another output, or allow it to be replaced with --overwrite",
            output.display()
        );
    }
    Ok(())
}

/// Says of a file that is about to be replaced that it has other names, which keep the old content.
fn say_other_names(output: &Path, bar: &Bar) {
    let n_others = normend_io::n_other_names(output);
    if n_others > 0 {
        let others = console::counted(n_others as usize, "other name");
        bar.say(&format!(
            "{} has {others} (hard links): what is written gets this name alone, the rest keeps the old content",
            output.display()
        ));
    }
}

/// The name of a file for the title of a bar.
fn title_of(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}
