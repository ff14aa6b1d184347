//! Journals that were left behind: what they hold, and whether they are of the scan that is opened.
//!
//! A journal that another editor holds is none of ours. One whose edits are all exported is removed without a word.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use normend_core::EditKind;
use normend_io::io_words;
use normend_io::recipe::{self, End, Reading, ScanIdentity};

use super::{EXTENSION, stem};

/// How often a lock is tried that another editor is about to give up.
const LOCK_POLL: Duration = Duration::from_millis(50);
/// Longest first line that is looked at: names and paths are not longer.
const MOST_HEAD: u64 = 1 << 16;
/// Files without a name that are older than this were left by editors that ended while they made them.
const STALE: Duration = Duration::from_secs(24 * 3600);

/// A journal that can be gone on with. It is locked, so that no other editor takes it meanwhile.
#[derive(Debug)]
pub struct Offer {
    /// What it holds.
    pub reading: Reading,
    /// Whether it is of the file as it is now; else of one that was at the same path before.
    pub is_same: bool,
    /// When it was last written.
    pub modified: Option<SystemTime>,
    pub(super) path: PathBuf,
    pub(super) file: File,
}

/// What was found for a scan.
#[derive(Debug, Default)]
pub struct Findings {
    /// Journals to go on with, those of the same content first, then the newest first.
    pub offers: Vec<Offer>,
    /// What cannot be read, in words.
    pub problems: Vec<String>,
    /// Journals of the same scan that an editor held.
    pub held: Vec<PathBuf>,
}

impl Offer {
    /// How many edits there are that are not undone.
    pub fn n_edits(&self) -> usize {
        self.reading.recipe.history().1
    }

    /// How many edits can be done again.
    pub fn n_undone(&self) -> usize {
        let (steps, n_done) = self.reading.recipe.history();
        steps.len() - n_done
    }

    /// How many edits of each kind are not undone, the most first.
    pub fn kinds(&self) -> Vec<(EditKind, usize)> {
        let (steps, n_done) = self.reading.recipe.history();
        let mut counts = BTreeMap::new();
        for step in &steps[..n_done] {
            *counts.entry(step.kind).or_insert(0) += 1;
        }
        let mut counts: Vec<(EditKind, usize)> = counts.into_iter().collect();
        counts.sort_by_key(|&(kind, n)| (std::cmp::Reverse(n), kind));
        counts
    }

    /// What is wrong with the file, in words; `None` when nothing is.
    pub fn damage(&self) -> Option<String> {
        match &self.reading.end {
            // The line that was being written when the editor ended.
            End::Whole | End::CutOff => None,
            End::Damaged(broken) => Some(broken.to_string()),
        }
    }

    /// Copies the file to one beside it, whose path is returned; for when it is damaged, because whoever goes on with it writes over
    /// what cannot be read.
    ///
    /// # Errors
    /// In words.
    pub fn keep_damaged(&self) -> Result<PathBuf, String> {
        let copy = self.path.with_extension("damaged");
        // Not by its name: where locks bind, only who holds the file can read it.
        let mut file = &self.file;
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(0))
            .and_then(|_| file.read_to_end(&mut bytes))
            .map_err(|error| io_words(&error))?;
        normend_io::write_bytes(&copy, &bytes).map_err(|error| error.to_string())?;
        Ok(copy)
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Removes the journal.
    ///
    /// # Errors
    /// What the system says.
    pub fn remove(self) -> std::io::Result<()> {
        fs::remove_file(&self.path)
    }
}

/// Looks in `folder` for journals of a scan. Waits up to `patience` for those that another editor holds, for when that one is
/// about to end. Reads what it finds, so this is work for a job.
pub fn find(folder: &Path, scan: &ScanIdentity, patience: Duration) -> Findings {
    let mut findings = Findings::default();
    // Without a folder there are none.
    let Ok(entries) = fs::read_dir(folder) else {
        return findings;
    };
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.sort();
    let stem = stem(scan);
    let hash = stem.split_once('-').map_or("", |(hash, _)| hash);
    let deadline = Instant::now() + patience;
    for path in paths {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with('.') {
            remove_stale(&path);
            continue;
        }
        if path.extension().is_none_or(|extension| extension != EXTENSION) {
            continue;
        }
        // A pipe would be waited for, a device read without end, a link written through to whatever it names.
        if !fs::symlink_metadata(&path).is_ok_and(|metadata| metadata.is_file()) {
            continue;
        }
        let head = head_of(&path);
        let may_be_same = name.starts_with(hash) || head.as_ref().is_some_and(|head| head.is_same_content(scan));
        let is_of_path = scan.path.is_some() && head.is_some_and(|head| head.path == scan.path);
        if !may_be_same && !is_of_path {
            continue;
        }
        match take(&path, scan, may_be_same.then_some(deadline)) {
            Ok(Taken::Useless) => {}
            Ok(Taken::Held) => findings.held.push(path),
            Ok(Taken::Offer(offer)) => findings.offers.push(*offer),
            Err(problem) => findings.problems.push(problem),
        }
    }
    findings
        .offers
        .sort_by_key(|offer| (!offer.is_same, std::cmp::Reverse(offer.modified)));
    findings
}

/// The scan that the first line of a journal names: at the same path it may be of another content, and one that was written over is
/// known by its head alone.
fn head_of(journal: &Path) -> Option<ScanIdentity> {
    let mut line = Vec::new();
    let file = File::open(journal).ok()?.take(MOST_HEAD);
    BufReader::new(file).read_until(b'\n', &mut line).ok()?;
    let reading = recipe::parse(&line, "journal").ok()?;
    Some(reading.recipe.head.scan)
}

/// Whether an editor holds this journal now.
pub fn is_held(journal: &Path) -> bool {
    let file = OpenOptions::new().read(true).write(true).open(journal);
    file.is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
}

/// What became of a journal that was looked at.
enum Taken {
    /// Another editor holds it.
    Held,
    /// It is not of this scan, or nobody needs it any more.
    Useless,
    Offer(Box<Offer>),
}

/// Locks and reads a journal.
fn take(path: &Path, scan: &ScanIdentity, deadline: Option<Instant>) -> Result<Taken, String> {
    let unreadable = |error: &std::io::Error| {
        format!(
            "A journal of this scan cannot be used. {}: {}.",
            path.display(),
            io_words(error)
        )
    };
    let mut file = OpenOptions::new()
        .read(true)
        .write(true)
        .open(path)
        .map_err(|error| unreadable(&error))?;
    loop {
        match file.try_lock() {
            Ok(()) | Err(TryLockError::Error(_)) => break,
            Err(TryLockError::WouldBlock) if deadline.is_some_and(|deadline| Instant::now() < deadline) => {
                std::thread::sleep(LOCK_POLL);
            }
            Err(TryLockError::WouldBlock) => return Ok(Taken::Held),
        }
    }
    let modified = file.metadata().and_then(|metadata| metadata.modified()).ok();
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(0))
        .and_then(|_| file.read_to_end(&mut bytes))
        .map_err(|error| unreadable(&error))?;
    let reading = recipe::parse(&bytes, &path.display().to_string())
        .map_err(|error| format!("A journal of this scan cannot be used. {error}."))?;
    let is_same = reading.recipe.head.scan.is_same_content(scan);
    if !is_same && reading.recipe.head.scan.path != scan.path {
        return Ok(Taken::Useless);
    }
    let is_of_use = !reading.recipe.is_exported() && !reading.recipe.history().0.is_empty();
    if !is_of_use && reading.end == End::Whole {
        // One that stays is looked at again the next time.
        let _ = fs::remove_file(path);
    }
    if !is_of_use {
        return Ok(Taken::Useless);
    }
    Ok(Taken::Offer(Box::new(Offer {
        reading,
        is_same,
        modified,
        path: path.to_path_buf(),
        file,
    })))
}

/// Removes what an editor left behind that ended while it made a journal.
fn remove_stale(path: &Path) {
    let age = fs::metadata(path)
        .and_then(|metadata| metadata.modified())
        .ok()
        .and_then(|modified| modified.elapsed().ok());
    if age.is_some_and(|age| age > STALE) && path.extension().is_some_and(|extension| extension == "part") {
        // Then the next time.
        let _ = fs::remove_file(path);
    }
}
