//! The file that a scan was read from, as it is on the disk since.

use std::fs::File;
use std::io::{self, Seek};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::save::{Stamp, stamp};

/// What was last known of the file on the disk.
#[derive(Debug, Default)]
pub(crate) struct OnDisk(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    /// `None` for what was not read from a file.
    stamp: Option<Stamp>,
    content: Option<Content>,
}

/// What tells a content from others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Content {
    pub n_bytes: u64,
    /// BLAKE3 of the bytes.
    pub hash: [u8; 32],
}

impl OnDisk {
    /// The file at `path` as it is now. Where the system does not tell, changes are not noticed.
    pub(crate) fn of(path: &Path) -> Self {
        Self(Mutex::new(State {
            stamp: stamp(path),
            content: None,
        }))
    }

    /// Whether there is another file at `path` than was read or written last, or another content. A change that leaves size, time
    /// and place as they were is not noticed, nor one within a tick of the file system's clock. False when there is no file: nothing
    /// is lost then.
    pub(crate) fn is_changed(&self, path: &Path) -> bool {
        let known = self.lock().stamp;
        known.is_some() && stamp(path).is_some_and(|now| Some(now) != known)
    }

    /// Remembers that `file` was written in its place. O(size).
    ///
    /// # Errors
    /// When it cannot be read.
    pub(crate) fn replaced_by(&self, mut file: File) -> io::Result<()> {
        // In the order in which it matters: one that is changed while it is read has another stamp.
        let metadata = file.metadata()?;
        file.rewind()?;
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(file)?;
        *self.lock() = State {
            stamp: Some(Stamp::of(&metadata)),
            content: Some(Content {
                n_bytes: metadata.len(),
                hash: *hasher.finalize().as_bytes(),
            }),
        };
        Ok(())
    }

    /// What was written in its place; `None` when nothing was, so that it is as it was read.
    pub(crate) fn content(&self) -> Option<Content> {
        self.lock().content
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
