//! The journal: every edit is in a file the moment it happens, so that a crash takes none along.
//!
//! A journal is a recipe ([`normend_io::recipe`]) in the user's state folder, one for each scan and editor, locked while the editor
//! lives. It comes into being with the first edit. Lines are written at once; a thread of its own syncs them to the disk within a
//! second, and shortens a file that holds much that nobody can reach any more, by writing another one beside it.
//!
//! What cannot be written is kept and tried again; editing goes on. Not here: what is done with a journal that was left behind,
//! see [`found`].

pub mod found;

use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use normend_core::{EditKind, StateChange};
use normend_io::recipe::{self, Event, Head, LineWriter, Recipe};
use tempfile::NamedTempFile;

use self::found::Offer;

/// Ends the names of journals.
const EXTENSION: &str = "journal";
/// How long a written line may wait to be synced; the promise is one second.
const SYNC_DELAY: Duration = Duration::from_millis(400);
/// How long after a failure the next attempt comes.
pub const RETRY_DELAY: Duration = Duration::from_secs(5);
/// A journal shorter than this is not worth shortening.
const LEAST_TO_SHORTEN: u64 = 32 << 20;
/// What a shortened journal keeps as steps of their own: more than the document's history remembers, as lines.
const MOST_KEPT: usize = 2 * normend_core::Document::HISTORY_BYTES;
/// Characters of the scan's name in the journal's.
const MOST_NAME: usize = 60;
/// Journals of one scan that are tried before giving up; there are as many as editors that crashed on it.
const MOST_JOURNALS: u32 = 1000;

/// The name of journals of a scan, without number and extension: the beginning of its hash, and its name.
fn stem(scan: &recipe::ScanIdentity) -> String {
    let hash: String = scan.hash[..8].iter().map(|byte| format!("{byte:02x}")).collect();
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || matches!(letter, '.' | '-' | '_');
    let name = scan
        .name
        .chars()
        .map(|letter| if is_plain(letter) { letter } else { '_' });
    format!("{hash}-{}", name.take(MOST_NAME).collect::<String>())
}

/// What the user should hear of the journal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum News {
    /// Edits are not being written, and why.
    Failing(String),
    /// They are again, all of them.
    Works,
}

/// The journal of one open scan.
#[derive(Debug)]
pub struct Journal {
    out: Arc<Mutex<Out>>,
    /// Asks for a sync; dropped to end the thread.
    sync: Option<mpsc::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// The file, and what is not in it yet.
#[derive(Debug)]
struct Out {
    folder: PathBuf,
    head: Head,
    /// `None` before the first edit, or while the file cannot be made.
    file: Option<(File, PathBuf)>,
    /// `None` before the first edit.
    lines: Option<LineWriter>,
    /// Bytes of whole lines in the file.
    n_bytes: u64,
    /// How many of them were there when they were last synced.
    n_synced: u64,
    /// The last sync failed, so nothing after those may be on the disk.
    is_unsynced: bool,
    /// Lines that are not in the file yet.
    pending: Vec<u8>,
    failed: Option<Instant>,
    news: Option<News>,
    /// The file is shortened when it is longer.
    shorten_above: u64,
    /// The head in the file is not [`Self::head`] any more.
    has_old_head: bool,
}

impl Journal {
    /// A journal in `folder` that makes its file with the first edit. `head` is of the document as it was opened.
    pub fn new(folder: &Path, head: Head) -> Self {
        Self::start(Out {
            folder: folder.to_path_buf(),
            head,
            file: None,
            lines: None,
            n_bytes: 0,
            n_synced: 0,
            is_unsynced: false,
            pending: Vec::new(),
            failed: None,
            news: None,
            shorten_above: LEAST_TO_SHORTEN,
            has_old_head: false,
        })
    }

    /// Goes on with a journal that was left behind, after its edits were restored. What of it is damaged is written over: see
    /// [`Offer::keep_damaged`].
    pub fn resume(offer: Offer) -> Self {
        let Offer {
            reading,
            path,
            mut file,
            ..
        } = offer;
        // A tail that stays is overwritten by the next lines.
        let _ = file.set_len(reading.n_bytes);
        let mut last = [0];
        let read = file
            .seek(SeekFrom::Start(reading.n_bytes.saturating_sub(1)))
            .and_then(|_| file.read_exact(&mut last));
        let pending = if read.is_ok() && last != *b"\n" {
            vec![b'\n']
        } else {
            Vec::new()
        };
        Self::start(Out {
            folder: path.parent().map(Path::to_path_buf).unwrap_or_default(),
            head: reading.recipe.head,
            shorten_above: LEAST_TO_SHORTEN.max(2 * reading.n_bytes),
            file: Some((file, path)),
            lines: Some(reading.writer),
            n_bytes: reading.n_bytes,
            n_synced: reading.n_bytes,
            is_unsynced: false,
            pending,
            failed: None,
            news: None,
            has_old_head: false,
        })
    }

    fn start(out: Out) -> Self {
        let out = Arc::new(Mutex::new(out));
        let (sync, asked) = mpsc::channel();
        let shared = Arc::clone(&out);
        let thread = thread::Builder::new()
            .name("normend journal".to_owned())
            .spawn(move || keep_synced(&shared, &asked));
        if let Err(error) = &thread {
            lock(&out).news = Some(News::Failing(format!(
                "the system gives no thread to sync them ({})",
                normend_io::io_words(error)
            )));
        }
        Self {
            out,
            sync: Some(sync),
            thread: thread.ok(),
        }
    }

    /// A step was done. The line is written before this returns.
    pub fn step(&mut self, kind: EditKind, change: &StateChange, n_turned: u64) {
        self.write(|lines| lines.step(kind, change, n_turned));
    }

    /// The last step was taken back. As [`Self::step`].
    pub fn undo(&mut self) {
        self.write(|lines| lines.event(&Event::Undo));
    }

    /// The last step that was taken back was done again. As [`Self::step`].
    pub fn redo(&mut self) {
        self.write(|lines| lines.event(&Event::Redo));
    }

    /// The present state was exported. As [`Self::step`].
    pub fn exported(&mut self) {
        if lock(&self.out).lines.is_some() {
            self.write(|lines| lines.event(&Event::Exported));
        }
    }

    /// The scan's file has another content from now on, with the same points: it was written over with what was exported. The journal
    /// is found with that one; its file is written anew for it, soon.
    pub fn follow(&mut self, scan: recipe::ScanIdentity) {
        let mut out = lock(&self.out);
        if out.head.scan == scan {
            return;
        }
        out.head.scan = scan;
        out.has_old_head = out.lines.is_some();
        drop(out);
        if let Some(sync) = &self.sync {
            // Without its thread the journal is known for one of the former content.
            let _ = sync.send(());
        }
    }

    fn write(&mut self, line: impl FnOnce(&mut LineWriter) -> io::Result<Vec<u8>>) {
        let mut out = lock(&self.out);
        out.push(line);
        out.flush();
        if out.failed.is_none() {
            tracing::debug!("an edit is in the journal, {} bytes", out.n_bytes);
        }
        drop(out);
        if let Some(sync) = &self.sync {
            // Without its thread the system syncs when it likes.
            let _ = sync.send(());
        }
    }

    /// What the user was not told yet. Tries again what could not be written, from time to time.
    pub fn news(&mut self) -> Option<News> {
        let mut out = lock(&self.out);
        if out.failed.is_some_and(|failed| failed.elapsed() >= RETRY_DELAY) {
            out.flush();
            if let (true, Some(sync)) = (out.is_unsynced, &self.sync) {
                out.failed = Some(Instant::now());
                // Without its thread nothing was synced before either.
                let _ = sync.send(());
            }
        }
        out.news.take()
    }

    /// Whether edits are kept now; where not, they are lost with the editor.
    pub fn is_kept(&self) -> bool {
        let out = lock(&self.out);
        out.failed.is_none()
    }

    /// The file, once there is one.
    pub fn path(&self) -> Option<PathBuf> {
        lock(&self.out).file.as_ref().map(|(_, path)| path.clone())
    }

    /// Ends the journal and removes its file: what it holds is exported, or not wanted.
    pub fn remove(mut self) {
        self.finish();
        if let Some((file, path)) = lock(&self.out).file.take() {
            // A file that stays is offered once more, which is no harm.
            if let Err(error) = fs::remove_file(&path) {
                tracing::warn!("{}: {error}", path.display());
            }
            drop(file);
        }
    }

    /// Syncs and ends the thread.
    fn finish(&mut self) {
        self.sync = None;
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has nothing more to sync.
            let _ = thread.join();
        }
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        lock(&self.out).flush();
        self.finish();
    }
}

impl Out {
    /// Adds a line to what is to be written.
    fn push(&mut self, line: impl FnOnce(&mut LineWriter) -> io::Result<Vec<u8>>) {
        let encoded = match &mut self.lines {
            Some(lines) => line(lines),
            None => LineWriter::begin(&self.head).and_then(|(mut lines, mut first)| {
                first.extend(line(&mut lines)?);
                self.lines = Some(lines);
                Ok(first)
            }),
        };
        match encoded {
            Ok(bytes) => self.pending.extend(bytes),
            Err(error) => self.fail(&error),
        }
    }

    /// Writes what is not written yet.
    fn flush(&mut self) {
        if self.pending.is_empty() {
            return;
        }
        match self.try_flush() {
            Ok(()) => {
                self.n_bytes += self.pending.len() as u64;
                self.pending = Vec::new();
                self.succeed();
            }
            Err(error) => self.fail(&error),
        }
    }

    fn try_flush(&mut self) -> io::Result<()> {
        match &mut self.file {
            Some((file, _)) => {
                // A former attempt may have left a part of a line behind.
                file.seek(SeekFrom::Start(self.n_bytes))?;
                file.write_all(&self.pending)
            }
            None => {
                self.file = Some(create(&self.folder, &stem(&self.head.scan), &self.pending)?);
                Ok(())
            }
        }
    }

    /// Writes once more what may not be on the disk: a system that fails to sync forgets that it has to.
    fn write_again(&mut self) -> io::Result<()> {
        let Some((file, _)) = &mut self.file else { return Ok(()) };
        let mut bytes = vec![0; (self.n_bytes - self.n_synced) as usize];
        file.seek(SeekFrom::Start(self.n_synced))?;
        file.read_exact(&mut bytes)?;
        file.seek(SeekFrom::Start(self.n_synced))?;
        file.write_all(&bytes)
    }

    /// Something is written or synced that was not before.
    fn succeed(&mut self) {
        let is_whole = self.pending.is_empty() && !self.is_unsynced;
        if is_whole && self.failed.take().is_some() {
            self.news = Some(News::Works);
        }
    }

    fn fail(&mut self, error: &io::Error) {
        let is_first = self.failed.replace(Instant::now()).is_none();
        if is_first {
            self.news = Some(News::Failing(in_words(error)));
        }
    }
}

/// What went wrong, and what to do.
fn in_words(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "the disk is full: free some space".to_owned(),
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "the folder cannot be written to: check its permissions".to_owned()
        }
        _ => normend_io::io_words(error),
    }
}

/// A new, locked journal in `folder` with its first lines. It has its name only when they are all there.
fn create(folder: &Path, stem: &str, bytes: &[u8]) -> io::Result<(File, PathBuf)> {
    fs::create_dir_all(folder)?;
    let mut temporary = beside(folder, bytes)?;
    for number in 1..=MOST_JOURNALS {
        let number = if number == 1 {
            String::new()
        } else {
            format!("-{number}")
        };
        let path = folder.join(format!("{stem}{number}.{EXTENSION}"));
        match temporary.persist_noclobber(&path) {
            Ok(file) => {
                sync_folder(folder);
                return Ok((file, path));
            }
            Err(error) if error.error.kind() == io::ErrorKind::AlreadyExists => temporary = error.file,
            Err(error) => return Err(error.error),
        }
    }
    Err(io::Error::other(
        "too many journals of this scan were left behind: remove some",
    ))
}

/// A locked file in `folder` that is removed unless it gets a name.
fn beside(folder: &Path, bytes: &[u8]) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    let mut temporary = builder.prefix(".").suffix(".part").tempfile_in(folder)?;
    match temporary.as_file().try_lock() {
        // Where the system has no locks, two editors at once must not be.
        Ok(()) | Err(TryLockError::Error(_)) => {}
        Err(TryLockError::WouldBlock) => return Err(io::ErrorKind::WouldBlock.into()),
    }
    temporary.write_all(bytes)?;
    Ok(temporary)
}

/// The new name itself should reach the disk too; where a folder cannot be synced, it does when the system likes.
fn sync_folder(folder: &Path) {
    #[cfg(unix)]
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
    #[cfg(not(unix))]
    let _ = folder;
}

/// Syncs soon after it is asked to, until there is nobody to ask.
fn keep_synced(out: &Mutex<Out>, asked: &mpsc::Receiver<()>) {
    while asked.recv().is_ok() {
        let due = Instant::now() + SYNC_DELAY;
        // Many lines need one sync.
        let is_last = loop {
            match asked.recv_timeout(due.saturating_duration_since(Instant::now())) {
                Ok(()) => {}
                Err(RecvTimeoutError::Timeout) => break false,
                Err(RecvTimeoutError::Disconnected) => break true,
            }
        };
        sync(out, File::sync_data);
        let must_be_anew = lock(out).has_old_head;
        if (!is_last || must_be_anew)
            && let Err(error) = write_anew(out)
        {
            // The long one is as good. One with an old head is offered as of a former content.
            tracing::warn!("the journal was not written anew: {error}");
        }
    }
}

/// Syncs what is written, by `sync_data`.
fn sync(out: &Mutex<Out>, sync_data: impl Fn(&File) -> io::Result<()>) {
    let (file, n_bytes) = {
        let mut out = lock(out);
        let again = if out.is_unsynced { out.write_again() } else { Ok(()) };
        let Some((file, _)) = &out.file else { return };
        (again.and_then(|()| file.try_clone()), out.n_bytes)
    };
    // Not while others wait to write: a sync may take long.
    let synced = file.and_then(|file| sync_data(&file));
    let mut out = lock(out);
    out.is_unsynced = synced.is_err();
    match synced {
        Ok(()) => {
            out.n_synced = n_bytes;
            out.succeed();
        }
        Err(error) => {
            out.fail(&error);
            tracing::warn!("the journal was not synced: {error}");
        }
    }
}

/// Writes a journal that is long, or of another scan than its head says, once more, without what nobody can reach.
fn write_anew(out: &Mutex<Out>) -> io::Result<()> {
    let (path, n_bytes, head) = {
        let mut out = lock(out);
        let (n_bytes, above) = (out.n_bytes, out.shorten_above);
        let is_due = n_bytes > above || out.has_old_head;
        let Some((_, path)) = out.file.as_ref().filter(|_| is_due) else {
            return Ok(());
        };
        let (path, head) = (path.clone(), out.head.clone());
        // Whatever becomes of this attempt, the next comes when there is as much again.
        out.shorten_above = 2 * n_bytes;
        (path, n_bytes, head)
    };
    let mut bytes = Vec::new();
    File::open(&path)?.take(n_bytes).read_to_end(&mut bytes)?;
    let reading = recipe::parse(&bytes, "journal").map_err(io::Error::other)?;
    if reading.end != recipe::End::Whole {
        return Err(io::Error::other("it is not as it was written"));
    }
    drop(bytes);
    let shortened = reading.recipe.shortened(MOST_KEPT)?;
    let (writer, bytes) = Recipe { head, ..shortened }.encode()?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let temporary = beside(folder, &bytes)?;
    temporary.as_file().sync_data()?;
    let mut out = lock(out);
    if out.n_bytes == n_bytes && out.pending.is_empty() {
        let file = temporary.persist(&path).map_err(|error| error.error)?;
        out.file = Some((file, path));
        out.lines = Some(writer);
        (out.n_bytes, out.n_synced) = (bytes.len() as u64, bytes.len() as u64);
        out.is_unsynced = false;
        out.has_old_head = false;
        out.succeed();
    }
    // Else there was an edit meanwhile; the present file has it, and it is tried again after that one's sync.
    out.shorten_above = LEAST_TO_SHORTEN.max(2 * out.n_bytes);
    Ok(())
}

fn lock(out: &Mutex<Out>) -> MutexGuard<'_, Out> {
    out.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests;
