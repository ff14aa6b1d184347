//! Several files with one command: where each goes, and one report of all.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use normend_io::is_same_file;
use serde::Serialize;

use super::{Outcome, check_is_file_name, check_may_write, check_scan_name, title_of, wrong_use};
use crate::console::{self, Bar};

/// Files and where they go.
#[derive(Debug, PartialEq, Eq)]
pub struct Plan {
    /// The folder that the outputs go to, unless one file was named.
    folder: Option<PathBuf>,
    pub jobs: Vec<Job>,
}

/// One file to work on.
#[derive(Debug, PartialEq, Eq)]
pub struct Job {
    pub input: PathBuf,
    pub output: PathBuf,
}

/// What was typed of where files go.
#[derive(Clone, Copy, Debug)]
pub struct Typed<'a> {
    pub inputs: &'a [PathBuf],
    pub output: &'a Path,
    /// The extension of files that go to a folder; `None` keeps the input's.
    pub extension: Option<&'a str>,
    pub overwrite: bool,
    pub json: Option<&'a Path>,
}

/// A line of the report about a file that failed.
#[derive(Debug, Serialize)]
struct Failure<'a> {
    input: &'a Path,
    error: String,
}

impl Plan {
    /// Where each input goes, with everything refused that would lose a file.
    ///
    /// # Errors
    /// Wrong use, in words.
    pub fn new(typed: Typed<'_>) -> anyhow::Result<Self> {
        let output = typed.output;
        check_is_file_name(output)?;
        let is_folder = typed.inputs.len() > 1 || output.is_dir() || ends_with_separator(output);
        if is_folder && output.exists() && !output.is_dir() {
            return Err(wrong_use(format!(
                "{} is a file, but several inputs need a folder: give -o the name of a folder",
                output.display()
            )));
        }
        // A folder may have any name, but a new one that ends like a file is most likely a slip.
        if is_folder && !output.is_dir() && !ends_with_separator(output) && output.extension().is_some() {
            return Err(wrong_use(format!(
                "{0} is the name of a file, but several inputs need a folder: give -o the name of a folder, or {0}{1} if \
                 this is one",
                output.display(),
                std::path::MAIN_SEPARATOR
            )));
        }
        let mut outputs = BTreeSet::new();
        let mut jobs = Vec::with_capacity(typed.inputs.len());
        for input in typed.inputs {
            let output = if is_folder {
                let name = input
                    .file_name()
                    .ok_or_else(|| wrong_use(format!("{} is not a file", input.display())))?;
                let mut output = output.join(name);
                if let Some(extension) = typed.extension {
                    output.set_extension(extension);
                }
                output
            } else {
                check_scan_name(output, Some(input))?;
                output.to_owned()
            };
            if !outputs.insert(output.clone()) {
                return Err(wrong_use(format!(
                    "two inputs would both be written to {}: rename one, or take them one by one",
                    output.display()
                )));
            }
            jobs.push(Job {
                input: input.clone(),
                output,
            });
        }
        for job in &jobs {
            let is_input = |path: &Path| jobs.iter().any(|other| is_same_file(&other.input, path));
            if !typed.overwrite && is_input(&job.output) {
                return Err(wrong_use(format!(
                    "{} is an input: name another output, or allow it with --overwrite",
                    job.output.display()
                )));
            }
            if typed
                .json
                .is_some_and(|report| is_input(report) || report == job.output)
            {
                return Err(wrong_use(
                    "the report of --json would take the place of a scan: give it another name",
                ));
            }
        }
        Ok(Self {
            folder: is_folder.then(|| output.to_owned()),
            jobs,
        })
    }

    /// Does `work` for each file; one that fails is said and reported, and does not stop the rest. A line of the report is there
    /// the moment its file is done.
    ///
    /// # Errors
    /// A folder that cannot be made, a report that cannot be written, Ctrl-C.
    pub fn run<T: Serialize>(
        &self,
        typed: Typed<'_>,
        quiet: bool,
        mut work: impl FnMut(&Job, &Bar) -> anyhow::Result<T>,
    ) -> anyhow::Result<Outcome> {
        let mut report = typed.json.map(|path| open_report(path, typed.overwrite)).transpose()?;
        if let Some(folder) = &self.folder {
            fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
        }
        let mut outcome = Outcome::Done;
        for job in &self.jobs {
            let bar = Bar::new(&title_of(&job.input), quiet);
            let line = match work(job, &bar) {
                Ok(done) => serde_json::to_vec(&done),
                Err(error) if console::is_stopped() => return Err(error),
                Err(error) => {
                    outcome = Outcome::Failed;
                    let error = console::in_words(&error);
                    bar.say_error(&format!("error: {error}"));
                    serde_json::to_vec(&Failure {
                        input: &job.input,
                        error,
                    })
                }
            };
            if let Some(report) = &mut report {
                let mut line = line.context("cannot put the report into JSON")?;
                line.push(b'\n');
                report
                    .write_all(&line)
                    .and_then(|()| report.flush())
                    .context("cannot write the report")?;
            }
        }
        Ok(outcome)
    }
}

fn ends_with_separator(path: &Path) -> bool {
    path.as_os_str()
        .as_encoded_bytes()
        .last()
        .is_some_and(|&last| std::path::is_separator(char::from(last)))
}

/// Standard output for `-`, else a new file; opened before the work, so that a wrong path costs no time. It is not written beside
/// its target: each line is there the moment its scan is done, whatever becomes of the rest.
pub fn open_report(path: &Path, overwrite: bool) -> anyhow::Result<Box<dyn Write>> {
    if path == Path::new("-") {
        return Ok(Box::new(io::stdout()));
    }
    check_may_write(path, overwrite)?;
    let file = File::create(path).with_context(|| format!("cannot write the report {}", path.display()))?;
    Ok(Box::new(file))
}
