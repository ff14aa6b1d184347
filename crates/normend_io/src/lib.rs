//! Point cloud files in and out, with every attribute kept. The only crate that touches files.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec3, Vec3};
use normend_core::{PointCloud, Progress};

/// The formats that can be read and written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileFormat {
    /// Polygon File Format: ascii, binary little-endian, binary big-endian.
    Ply,
    /// Text, a point a line: `x y z [nx ny nz …]`.
    Xyz,
}

impl FileFormat {
    /// All formats, in the order of dialogs.
    pub const ALL: [Self; 2] = [Self::Ply, Self::Xyz];

    /// The name in dialogs.
    pub fn label(self) -> &'static str {
        match self {
            Self::Ply => "PLY",
            Self::Xyz => "XYZ text",
        }
    }

    /// File name extensions, lower case, without the dot; the first is the usual one.
    pub fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Ply => &["ply"],
            Self::Xyz => &["xyz", "txt", "pts", "csv"],
        }
    }
}

/// A scan as it was read: the points, and the file itself so that it can be written again with other normals.
#[derive(Clone)]
pub struct Scan {
    /// The finite points.
    pub cloud: Arc<PointCloud>,
    /// The file's normals by point (zero where not finite or missing), if it has any.
    pub given_normals: Option<Arc<Vec<Vec3>>>,
    /// The file's row of each point; `None` when every row is a point.
    pub rows: Option<Arc<Vec<u32>>>,
    /// Rows that are left out because a coordinate is not finite.
    pub n_left_out: usize,
    /// What it was read as.
    pub format: FileFormat,
    // plus private: the file's bytes and where the vertex rows are
}

/// Why a file cannot be read: one sentence with the place and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// Stopped by the caller.
    #[error(transparent)]
    Cancelled(#[from] normend_core::Cancelled),
    // more: Io { path, source }, Broken { path, place: byte or line, reason }, …
}

/// What is written besides the normals.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WriteOptions {
    /// The rule that decided the sides, for the comment line ("farthest along +z up", "as given").
    pub rule: String,
    /// Write over the file that was read. Without it that is refused.
    pub overwrite_input: bool,
}

/// Why a file cannot be written; the target is as it was.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// Stopped by the caller.
    #[error(transparent)]
    Cancelled(#[from] normend_core::Cancelled),
}

/// Reads a scan; the format is recognised by content, then by extension.
///
/// # Errors
/// [`ReadError`].
pub fn read(path: &Path, progress: &dyn Progress) -> Result<Scan, ReadError> {
    let _ = (path, progress);
    unimplemented!()
}

/// Reads a scan from memory; `name` stands for the path in messages and for the extension.
///
/// # Errors
/// [`ReadError`].
pub fn read_bytes(bytes: Vec<u8>, name: &str, progress: &dyn Progress) -> Result<Scan, ReadError> {
    let _ = (bytes, name, progress);
    unimplemented!()
}

/// Positions of a cloud that did not come from a file, in the file's coordinates.
#[derive(Clone, Copy, Debug)]
pub enum Positions<'a> {
    /// Written as `float`.
    Float(&'a [Vec3]),
    /// Written as `double`.
    Double(&'a [DVec3]),
}

/// Writes a fresh cloud, with `n` unit normals or without, as [`Scan::write`] does: binary little-endian PLY, or text
/// when the extension says so. A file that is there is replaced.
///
/// # Errors
/// [`WriteError`]; the target is as it was then.
pub fn write_points(
    path: &Path,
    positions: Positions<'_>,
    normals: Option<&[Vec3]>,
    progress: &dyn Progress,
) -> Result<(), WriteError> {
    let _ = (path, positions, normals, progress);
    unimplemented!()
}

impl Scan {
    /// Where it was read from; `None` for [`read_bytes`].
    pub fn path(&self) -> Option<&PathBuf> {
        unimplemented!()
    }

    /// Writes the file that came in with `normals` (by point of the cloud) to `path`: beside it first, synced, renamed.
    /// The format is that of `path`'s extension when it names one, else the input's.
    ///
    /// # Errors
    /// [`WriteError`]; the target is as it was then.
    pub fn write(
        &self,
        normals: &[Vec3],
        path: &Path,
        options: &WriteOptions,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        let _ = (normals, path, options, progress);
        unimplemented!()
    }
}

impl fmt::Debug for Scan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scan")
            .field("n_points", &self.cloud.n_points())
            .field("format", &self.format)
            .finish()
    }
}
