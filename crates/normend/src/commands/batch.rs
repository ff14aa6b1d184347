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

    /// Makes the folder that the outputs go to, if there is one.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn make_folder(&self) -> anyhow::Result<()> {
        if let Some(folder) = &self.folder {
            fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
        }
        Ok(())
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
        let one_by_one: Vec<&[Job]> = self.jobs.chunks(1).collect();
        self.run_groups(typed, &one_by_one, quiet, |jobs, bar| {
            jobs.iter().map(|job| work(job, bar)).collect()
        })
    }

    /// Does `work` for each group of files, which gives a line of the report for each file. Where it fails, all files of the group have
    /// failed, and the next group goes on.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn run_groups<T: Serialize>(
        &self,
        typed: Typed<'_>,
        groups: &[&[Job]],
        quiet: bool,
        mut work: impl FnMut(&[Job], &Bar) -> anyhow::Result<Vec<T>>,
    ) -> anyhow::Result<Outcome> {
        let mut report = typed.json.map(|path| open_report(path, typed.overwrite)).transpose()?;
        self.make_folder()?;
        let mut outcome = Outcome::Done;
        for &jobs in groups {
            let bar = Bar::new(&title_of_all(jobs), quiet);
            let lines: Result<Vec<Vec<u8>>, serde_json::Error> = match work(jobs, &bar) {
                Ok(done) => done.iter().map(serde_json::to_vec).collect(),
                Err(error) if console::is_stopped() => return Err(error),
                Err(error) => {
                    outcome = Outcome::Failed;
                    let error = console::in_words(&error);
                    bar.say_error(&format!("error: {error}"));
                    let failure = |job: &Job| {
                        serde_json::to_vec(&Failure {
                            input: &job.input,
                            error: error.clone(),
                        })
                    };
                    jobs.iter().map(failure).collect()
                }
            };
            if let Some(report) = &mut report {
                for mut line in lines.context("cannot put the report into JSON")? {
                    line.push(b'\n');
                    report.write_all(&line).context("cannot write the report")?;
                }
                report.flush().context("cannot write the report")?;
            }
        }
        Ok(outcome)
    }
}

/// What files are called that are worked on at once.
pub fn title_of_all(jobs: &[Job]) -> String {
    let first = jobs.first().map(|job| title_of(&job.input)).unwrap_or_default();
    match jobs.len() {
        ..=1 => first,
        n => format!("{first} + {} more", n - 1),
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
