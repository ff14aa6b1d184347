//! What goes wrong with files, in one sentence each: where, why, and what to do.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use normend_core::Cancelled;

use crate::FileFormat;

/// Why a file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// Stopped by the caller.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The system does not give the file out.
    #[error("{}: {}", path.display(), io_words(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The content is not what its format says, or not a format that is read.
    #[error("{name}{}{broken}", if broken.place == Place::Whole { ": " } else { ", " })]
    Broken {
        /// The file as the caller named it.
        name: String,
        /// The place and the reason.
        broken: Broken,
    },
}

/// Why a file cannot be written; the target is as it was.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// Stopped by the caller.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The target is the file that was read.
    #[error("{} is the file that was read: choose another name, or allow it to be written over", path.display())]
    OverInput {
        /// The target.
        path: PathBuf,
    },
    /// The target is the file that was read, with another content by now.
    #[error(
        "{} was changed by another program after it was read: open it again, choose another name, or allow the changes to be lost",
        path.display()
    )]
    InputChanged {
        /// The target.
        path: PathBuf,
    },
    /// The target's name promises a format that is not written.
    #[error("{} cannot be written: Normend writes {}; choose a name that ends with one of these", path.display(), written())]
    Extension {
        /// The target.
        path: PathBuf,
    },
    /// The target is something that cannot be replaced by a file.
    #[error("{} {reason}", path.display())]
    Target {
        /// The target.
        path: PathBuf,
        /// What it is and what to do.
        reason: &'static str,
    },
    /// The target cannot hold confidence.
    #[error(
        "{} cannot hold confidence: write a PLY file from a PLY file (without lists named confidence or oriented), or text from text whose columns have names",
        path.display()
    )]
    NoConfidence {
        /// The target.
        path: PathBuf,
    },
    /// The scan is of several files, each of which is written by itself.
    #[error("the scan is of {n_files} files: write each of them to a file of its own")]
    SeveralFiles {
        /// Files of the scan.
        n_files: usize,
    },
    /// Not one normal for each point.
    #[error("{n_normals} normals were given for {n_points} points: give one for each")]
    Count {
        /// Normals given.
        n_normals: usize,
        /// Points to write.
        n_points: usize,
    },
    /// A normal is not of unit length, so it has no place in a file.
    #[error("the normal of point {point} is ({}, {}, {}), not a unit vector: propagate again", normal.x, normal.y, normal.z)]
    NotUnit {
        /// Index of the first such point.
        point: usize,
        /// Its normal.
        normal: glam::Vec3,
    },
    /// The system does not take the file.
    #[error("{} cannot be written: {}", path.display(), io_words(source))]
    Io {
        /// The target.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// There is no room for the file.
    #[error(
        "{} cannot be written: the disk is full, there was room for only {} of it; free some space there, or choose another disk",
        path.display(),
        size_in_words(*n_bytes)
    )]
    Full {
        /// The target.
        path: PathBuf,
        /// Bytes that there was room for.
        n_bytes: u64,
    },
    /// The bytes that were read no longer make sense.
    #[error("the file that was read cannot be copied: {0}")]
    Source(Broken),
}

impl WriteError {
    pub(crate) fn io(path: &Path) -> impl Fn(io::Error) -> Self + '_ {
        |source| Self::Io {
            path: path.to_owned(),
            source,
        }
    }
}

/// A place in a file and what is wrong there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Broken {
    /// Where.
    pub place: Place,
    /// What is wrong and what to do.
    pub reason: String,
}

/// Where in a file something is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// A line, counted from 1.
    Line(usize),
    /// A byte, counted from 0.
    Byte(usize),
}

impl Broken {
    pub(crate) fn whole(reason: impl Into<String>) -> Self {
        Self::new(Place::Whole, reason)
    }

    pub(crate) fn new(place: Place, reason: impl Into<String>) -> Self {
        Self {
            place,
            reason: printable(reason.into()),
        }
    }
}

/// A sentence that a terminal can be given: names in files may be anything, commands to the terminal and whole books among it.
/// The end says what to do, so what is too long loses its middle.
fn printable(sentence: String) -> String {
    /// Characters that are kept of the beginning and of the end; sentences of Normend's own words are shorter.
    const MOST: [usize; 2] = [240, 160];
    if !sentence.contains(char::is_control) && sentence.len() <= MOST[0] + MOST[1] {
        return sentence;
    }
    let mut letters: Vec<char> = Vec::new();
    for letter in sentence.chars() {
        if letter.is_control() {
            letters.extend(letter.escape_default());
        } else {
            letters.push(letter);
        }
    }
    if letters.len() > MOST[0] + MOST[1] {
        letters.splice(MOST[0]..letters.len() - MOST[1], ['…']);
    }
    letters.into_iter().collect()
}

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place {
            Place::Whole => {}
            Place::Line(line) => write!(f, "line {line}: ")?,
            Place::Byte(byte) => write!(f, "byte {byte}: ")?,
        }
        f.write_str(&self.reason)
    }
}

impl std::error::Error for Broken {}

/// Why reading stopped, before the file's name is known.
pub(crate) enum Stop {
    Cancelled(Cancelled),
    Broken(Broken),
}

impl Stop {
    pub(crate) fn in_file(self, name: &str) -> ReadError {
        match self {
            Self::Cancelled(cancelled) => ReadError::Cancelled(cancelled),
            Self::Broken(broken) => ReadError::Broken {
                name: name.to_owned(),
                broken,
            },
        }
    }
}

impl From<Cancelled> for Stop {
    fn from(cancelled: Cancelled) -> Self {
        Self::Cancelled(cancelled)
    }
}

impl From<Broken> for Stop {
    fn from(broken: Broken) -> Self {
        Self::Broken(broken)
    }
}

impl From<Stop> for WriteError {
    fn from(stop: Stop) -> Self {
        match stop {
            Stop::Cancelled(cancelled) => Self::Cancelled(cancelled),
            Stop::Broken(broken) => Self::Source(broken),
        }
    }
}

/// An excerpt of a file for a message: short, printable, quoted.
pub(crate) fn quoted(bytes: &[u8]) -> String {
    const LONGEST: usize = 40;
    let shown = String::from_utf8_lossy(&bytes[..bytes.len().min(LONGEST)]);
    let dots = if bytes.len() > LONGEST { "…" } else { "" };
    format!("\"{}{dots}\"", shown.escape_debug())
}

/// The extensions that can be written, in words.
fn written() -> String {
    let extensions = FileFormat::ALL.iter().flat_map(|format| format.extensions());
    let dotted: Vec<String> = extensions.map(|extension| format!(".{extension}")).collect();
    dotted.join(" ")
}

/// What to say of a drive that does not answer any more.
const DRIVE_IS_GONE: &str = "its drive does not answer: connect it again and try once more";

/// What the system says of a file, in words and with what to do; every message that names such an error takes it from here.
pub fn io_words(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file or folder: check the path".to_owned(),
        io::ErrorKind::PermissionDenied => "the system forbids it: check the permissions".to_owned(),
        io::ErrorKind::IsADirectory => "this is a folder: name a file".to_owned(),
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "the disk is full: free some space and try again".to_owned()
        }
        io::ErrorKind::ReadOnlyFilesystem => "the disk is read-only: choose a place on another one".to_owned(),
        io::ErrorKind::InvalidFilename => {
            "the name is too long, or has signs that this disk cannot hold: shorten it".to_owned()
        }
        io::ErrorKind::NotADirectory => "a file stands where a folder should: check the path".to_owned(),
        io::ErrorKind::FileTooLarge => "this disk holds no file that large: choose another one".to_owned(),
        io::ErrorKind::StaleNetworkFileHandle
        | io::ErrorKind::NetworkDown
        | io::ErrorKind::HostUnreachable
        | io::ErrorKind::NotConnected
        | io::ErrorKind::TimedOut => DRIVE_IS_GONE.to_owned(),
        // EIO, ENXIO and ENODEV, of a drive that was pulled out; these are their numbers on Linux, macOS and the BSDs.
        _ if cfg!(unix) && matches!(error.raw_os_error(), Some(5 | 6 | 19)) => DRIVE_IS_GONE.to_owned(),
        io::ErrorKind::OutOfMemory => "it does not fit into memory: split the scan".to_owned(),
        _ => {
            let words = error.to_string();
            // The number is for programs.
            let end = words.find(" (os error ").unwrap_or(words.len());
            words[..end].to_owned()
        }
    }
}

/// A number of bytes in words, as disks are sold: `12.3 MB`.
fn size_in_words(n_bytes: u64) -> String {
    match n_bytes {
        0..1000 => format!("{n_bytes} bytes"),
        1000..1_000_000 => format!("{:.1} kB", n_bytes as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", n_bytes as f64 / 1e6),
        _ => format!("{:.1} GB", n_bytes as f64 / 1e9),
    }
}
