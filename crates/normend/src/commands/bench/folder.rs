//! A folder of clouds with known normals, and the threads that work through it.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use anyhow::{Context, bail};
use normend_core::{Cancelled, Progress};

use super::super::wrong_use;
use crate::console::{self, Bar};

/// What ends the name of a cloud's file without normals.
const RAW: &str = ".raw.ply";

/// One cloud: `DIR/<class>/<name>.raw.ply`, and its truth beside it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Case {
    /// The folder that it is in.
    pub class: String,
    /// The file's name without endings.
    pub name: String,
    /// Positions only.
    pub raw: PathBuf,
    /// The same points with the right normals.
    pub truth: PathBuf,
}

/// The clouds of a folder.
#[derive(Debug)]
pub struct Found {
    /// Those with a truth, by class and name.
    pub cases: Vec<Case>,
    /// How many others there are.
    pub n_without_truth: usize,
}

/// The clouds of a folder whose class or name is one of `only`; all when it is empty.
///
/// # Errors
/// A folder that cannot be read or has no cloud with a truth; names that no cloud has.
pub fn find(folder: &Path, only: &[String]) -> anyhow::Result<Found> {
    let mut all = Vec::new();
    for class in names_in(folder)? {
        let path = folder.join(&class);
        if !path.is_dir() {
            continue;
        }
        for file in names_in(&path)? {
            if let Some(name) = file.strip_suffix(RAW) {
                all.push(Case {
                    class: class.clone(),
                    name: name.to_owned(),
                    raw: path.join(&file),
                    truth: path.join(format!("{name}.ply")),
                });
            }
        }
    }
    if all.is_empty() {
        bail!(
            "{0} holds no clouds: they are named <class>/<name>.raw.ply, as `normend bench clouds {0}` writes them",
            folder.display()
        );
    }
    let is = |case: &Case, name: &String| case.class == *name || case.name == *name;
    if let Some(unknown) = only.iter().find(|name| !all.iter().any(|case| is(case, name))) {
        return Err(wrong_use(format!(
            "no cloud and no class of {} is called {unknown}",
            folder.display()
        )));
    }
    all.retain(|case| only.is_empty() || only.iter().any(|name| is(case, name)));
    let n_all = all.len();
    all.retain(|case| case.truth.is_file());
    if all.is_empty() {
        bail!(
            "none of the clouds in {} has a truth: it is the file <name>.ply beside <name>.raw.ply, with nx ny nz",
            folder.display()
        );
    }
    Ok(Found {
        n_without_truth: n_all - all.len(),
        cases: all,
    })
}

/// Names of files and folders in `folder`, sorted; names that are not Unicode are none of ours.
fn names_in(folder: &Path) -> anyhow::Result<Vec<String>> {
    let entries = fs::read_dir(folder).with_context(|| format!("cannot read the folder {}", folder.display()))?;
    let mut names = Vec::new();
    for entry in entries {
        let entry = entry.with_context(|| format!("cannot read the folder {}", folder.display()))?;
        names.extend(entry.file_name().into_string().ok());
    }
    names.sort();
    Ok(names)
}

/// Stops when the user asked to, and shows nothing: many clouds are worked on at once.
struct Stoppable;

impl Progress for Stoppable {
    fn report(&self, _fraction: f32) -> Result<(), Cancelled> {
        if console::is_stopped() { Err(Cancelled) } else { Ok(()) }
    }
}

/// Does `work` for every cloud, `n_threads` clouds at a time, and gives the results in the order of `cases`.
///
/// Each cloud has one thread to itself: so its seconds are its own, and small clouds, whose stages have little to share, keep
/// all processors busy.
///
/// # Errors
/// Ctrl-C, or a system that gives no threads. What fails in one cloud is its result.
pub fn for_each_case<T: Send>(
    cases: &[Case],
    n_threads: usize,
    bar: &Bar,
    work: impl Fn(&Case, &dyn Progress) -> anyhow::Result<T> + Sync,
) -> anyhow::Result<Vec<anyhow::Result<T>>> {
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let results = Mutex::new(Vec::with_capacity(cases.len()));
    let go_on = || -> anyhow::Result<()> {
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        while let Some((index, case)) = cases.iter().enumerate().nth(next.fetch_add(1, Ordering::Relaxed)) {
            let result = alone.install(|| work(case, &Stoppable));
            // A result is pushed whole or not at all, whatever happened to another thread.
            let mut results = results.lock().unwrap_or_else(PoisonError::into_inner);
            results.push((index, result));
            drop(results);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            bar.report(done as f32 / cases.len() as f32)?;
        }
        Ok(())
    };
    thread::scope(|scope| -> anyhow::Result<()> {
        let workers = (0..n_threads.clamp(1, cases.len().max(1)))
            .map(|worker| {
                thread::Builder::new()
                    .name(format!("bench {worker}"))
                    .spawn_scoped(scope, go_on)
                    .context("cannot start a thread")
            })
            .collect::<anyhow::Result<Vec<_>>>()?;
        for worker in workers {
            match worker.join() {
                Ok(finished) => finished?,
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        Ok(())
    })?;
    let mut results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.sort_by_key(|&(index, _)| index);
    Ok(results.into_iter().map(|(_, result)| result).collect())
}

/// How many clouds are worked on at once: as many as was typed, or one for each processor.
pub fn n_threads(typed: Option<usize>) -> usize {
    typed.unwrap_or_else(|| thread::available_parallelism().map_or(1, usize::from))
}
