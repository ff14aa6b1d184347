//! Point cloud files in and out, with every attribute kept. The only crate that touches files.
//!
//! A [`Scan`] keeps the file's bytes and where its rows are. Writing copies these bytes and changes nothing but the
//! normals and one comment line, so whatever else a file holds comes out as it went in.
//!
//! Invariants: nothing is allocated that the size of the file does not justify; a file is replaced whole or not at all;
//! results do not depend on the number of threads. Not here: what a normal should be, that is `normend_core`.

mod error;

mod value;

mod table;

mod ply;

mod xyz;

mod rewrite;

mod new_file;

mod save;

mod scalars;

mod stations;

pub mod recipe;

#[cfg(test)]
mod confidence_tests;

use std::ffi::OsStr;
use std::fmt;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec3};
use normend_core::progress::Part;
use normend_core::{PointCloud, Progress};
use rayon::prelude::*;

pub use error::{Broken, Place, ReadError, WriteError};
pub use stations::{read_stations, stations_of_bytes};

use crate::new_file::{NewFile, TextStyle, narrowest};
use crate::ply::PlyLayout;
use crate::recipe::ScanIdentity;
use crate::rewrite::{RowNormals, rewrite, write_text};
use crate::table::{Layout, Values, read_values};
use crate::value::Scalar;
use crate::xyz::XyzLayout;

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
            Self::Xyz => &["xyz", "txt", "asc", "pts", "csv"],
        }
    }

    /// The format that the extension of `path` names, in any case of letters.
    pub fn of_path(path: &Path) -> Option<Self> {
        let extension = path.extension().and_then(OsStr::to_str)?.to_ascii_lowercase();
        Self::ALL
            .into_iter()
            .find(|format| format.extensions().contains(&extension.as_str()))
    }

    /// The format in which `path` would be written: the one that its extension names; `None`, the input's format, when it
    /// has no extension or that of `input`.
    ///
    /// # Errors
    /// [`WriteError::Extension`]: a file must not look like what it is not.
    pub fn of_target(path: &Path, input: Option<&Path>) -> Result<Option<Self>, WriteError> {
        let format = Self::of_path(path);
        let extension = path.extension();
        if format.is_some() || extension.is_none() || extension == input.and_then(Path::extension) {
            return Ok(format);
        }
        Err(WriteError::Extension { path: path.to_owned() })
    }
}

/// A scan as it was read: the points, and the file itself so that it can be written again with other normals.
#[derive(Clone)]
pub struct Scan {
    /// The finite points.
    pub cloud: Arc<PointCloud>,
    /// The file's normals by point, of any length (zero where not finite), if it has any.
    pub given_normals: Option<Arc<Vec<Vec3>>>,
    /// The file's row of each point, ascending; `None` when every row is a point.
    pub rows: Option<Arc<Vec<u32>>>,
    /// Rows that are left out because a coordinate is not finite.
    pub n_left_out: usize,
    /// What it was read as.
    pub format: FileFormat,
    file: Arc<SourceFile>,
}

/// The file that a scan was read from.
struct SourceFile {
    path: Option<PathBuf>,
    bytes: Vec<u8>,
    layout: SourceLayout,
    /// BLAKE3 of the bytes, once it was asked for.
    hash: OnceLock<[u8; 32]>,
}

enum SourceLayout {
    Ply(PlyLayout),
    Xyz(XyzLayout),
}

impl SourceLayout {
    fn as_layout(&self) -> &dyn Layout {
        match self {
            Self::Ply(layout) => layout,
            Self::Xyz(layout) => layout,
        }
    }
}

/// What is written besides the normals.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WriteOptions {
    /// The rule that decided the sides, for the comment line ("farthest along +z up", "as given").
    pub rule: String,
    /// Write over the file that was read. Without it that is refused.
    pub overwrite_input: bool,
}

/// Reads a scan; the format is recognized by content, then by extension. Takes the size of the file and, for a while,
/// 36 bytes a point besides the cloud.
///
/// # Errors
/// [`ReadError`]; its message names the file, the place, the reason and what to do.
pub fn read(path: &Path, progress: &dyn Progress) -> Result<Scan, ReadError> {
    progress.stage("Reading");
    let bytes = read_file(path, &Part::new(progress, 0.0..0.3))?;
    let name = path.display().to_string();
    read_content(bytes, &name, Some(path), &Part::new(progress, 0.3..1.0))
}

/// Reads a scan from memory; `name` stands for the path in messages and for the extension.
///
/// # Errors
/// [`ReadError`], as [`read`].
pub fn read_bytes(bytes: Vec<u8>, name: &str, progress: &dyn Progress) -> Result<Scan, ReadError> {
    progress.stage("Reading");
    read_content(bytes, name, None, progress)
}

fn read_file(path: &Path, progress: &dyn Progress) -> Result<Vec<u8>, ReadError> {
    const BLOCK: u64 = 8 << 20;
    let fail = |source| ReadError::Io {
        path: path.to_owned(),
        source,
    };
    // Before it is opened: opening a pipe waits until somebody writes into it.
    let metadata = fs::metadata(path).map_err(fail)?;
    if metadata.is_dir() {
        return Err(fail(io::ErrorKind::IsADirectory.into()));
    }
    if !metadata.is_file() {
        return Err(fail(io::Error::other(
            "this is a device or a pipe, not a file: save it as a file first",
        )));
    }
    let mut file = File::open(path).map_err(fail)?;
    let n_bytes = metadata.len();
    let mut bytes = Vec::new();
    let n_reserved = usize::try_from(n_bytes).map_err(|_| fail(io::ErrorKind::OutOfMemory.into()))?;
    bytes
        .try_reserve_exact(n_reserved)
        .map_err(|_| fail(io::ErrorKind::OutOfMemory.into()))?;
    // A file that grows meanwhile is read as long as it was.
    while (bytes.len() as u64) < n_bytes {
        let n_wanted = BLOCK.min(n_bytes - bytes.len() as u64);
        let n_read = (&mut file).take(n_wanted).read_to_end(&mut bytes).map_err(fail)?;
        if n_read == 0 {
            break;
        }
        progress.report(bytes.len() as f32 / n_bytes as f32)?;
    }
    Ok(bytes)
}

fn read_content(bytes: Vec<u8>, name: &str, path: Option<&Path>, progress: &dyn Progress) -> Result<Scan, ReadError> {
    let broken = |broken| ReadError::Broken {
        name: name.to_owned(),
        broken,
    };
    let format = recognize(&bytes, Path::new(name)).map_err(broken)?;
    let finding = Part::new(progress, 0.0..0.5);
    let layout = match format {
        FileFormat::Ply => ply::read(&bytes, &finding).map(SourceLayout::Ply),
        FileFormat::Xyz => xyz::read(&bytes, &finding).map(SourceLayout::Xyz),
    };
    let layout = layout.map_err(|stop| stop.in_file(name))?;
    let values = read_values(layout.as_layout(), &bytes, &Part::new(progress, 0.5..1.0));
    let Values {
        mut positions,
        mut normals,
    } = values.map_err(|stop| stop.in_file(name))?;

    let n_rows = positions.len();
    let mut rows = None;
    if !positions.iter().all(|position| position.is_finite()) {
        // Row numbers fit, because no layout has more rows than ids.
        let finite: Vec<u32> = (0..n_rows as u32)
            .filter(|row| positions[*row as usize].is_finite())
            .collect();
        if let Some(normals) = &mut normals {
            *normals = finite.iter().map(|row| normals[*row as usize]).collect();
        }
        positions.retain(|position| position.is_finite());
        rows = Some(Arc::new(finite));
    }
    if positions.is_empty() {
        return Err(broken(Broken::whole(
            "no point has finite coordinates: export the file again",
        )));
    }
    let n_left_out = n_rows - positions.len();
    let cloud = PointCloud::from_f64(&positions).map_err(|error| broken(Broken::whole(error.to_string())))?;
    Ok(Scan {
        cloud: Arc::new(cloud),
        given_normals: normals.map(Arc::new),
        rows,
        n_left_out,
        format,
        file: Arc::new(SourceFile {
            path: path.map(Path::to_owned),
            bytes,
            layout,
            hash: OnceLock::new(),
        }),
    })
}

/// Tells the format by the first bytes, then by the extension of `path`.
fn recognize(bytes: &[u8], path: &Path) -> Result<FileFormat, Broken> {
    const OTHERS: [(&[u8], &str); 6] = [
        (b"LASF", "a LAS or LAZ file"),
        (b"ASTM-E57", "an E57 file"),
        (b"# .PCD", "a PCD file"),
        (b"\x1f\x8b", "compressed with gzip"),
        (b"PK\x03\x04", "a zip archive"),
        (b"\xff\xfe", "text in UTF-16"),
    ];
    if bytes.is_empty() {
        return Err(Broken::whole("the file is empty: copy or export it again"));
    }
    if ply::sniff(bytes) {
        return Ok(FileFormat::Ply);
    }
    if let Some((_, what)) = OTHERS.iter().find(|(start, _)| bytes.starts_with(start)) {
        return Err(Broken::whole(format!(
            "this is {what}, which Normend does not read: convert it to PLY"
        )));
    }
    match FileFormat::of_path(path) {
        Some(format) => Ok(format),
        None if xyz::sniff(bytes) => Ok(FileFormat::Xyz),
        None => Err(Broken::whole(
            "this is neither PLY nor text with a point a line: convert it to PLY",
        )),
    }
}

impl Scan {
    /// Where it was read from; `None` for [`read_bytes`].
    pub fn path(&self) -> Option<&PathBuf> {
        self.file.path.as_ref()
    }

    /// What tells this scan from others in recipes; `name` is the file's without folders. The first call hashes the file's bytes
    /// on all processors; later ones cost nothing.
    pub fn identity(&self, name: &str) -> ScanIdentity {
        let hash = || {
            *blake3::Hasher::new()
                .update_rayon(&self.file.bytes)
                .finalize()
                .as_bytes()
        };
        ScanIdentity {
            name: name.to_owned(),
            path: self.path().map(|path| {
                let path = std::path::absolute(path).unwrap_or_else(|_| path.clone());
                path.display().to_string()
            }),
            n_bytes: self.file.bytes.len() as u64,
            hash: *self.file.hash.get_or_init(hash),
            n_points: self.cloud.n_points() as u64,
        }
    }

    /// Writes the file that came in with `normals` (unit, by point of the cloud) to `path`: beside it first, synced,
    /// renamed. The format is that of `path`'s extension, or the input's ([`FileFormat::of_target`]); to another format than
    /// the input's go positions and normals only, in text with what the extension asks for: names and commas in `.csv`, the
    /// number of points in `.pts`. A row that is no point keeps the normal it has, or gets `0 0 1`.
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
        self.write_with_confidence(normals, None, path, options, progress)
    }

    /// Whether a file of this format can hold confidence: PLY from PLY, or text from text whose columns have names.
    fn can_hold_confidence(&self, format: FileFormat) -> bool {
        match (&self.file.layout, format) {
            (SourceLayout::Ply(ply), FileFormat::Ply) => ply.can_hold_side(),
            (SourceLayout::Xyz(xyz), FileFormat::Xyz) => xyz.can_hold_side(),
            _ => false,
        }
    }

    /// Like [`Self::write`], with how sure each normal is of its side (by point, in units of 1/255) when it is given: as
    /// `float confidence` in 0..=1, and `uchar oriented`, 0 where that is no more than a guess. Both stand after the normal, or
    /// where the file has such values already. A row that is no point keeps what it has, or gets 0.
    ///
    /// # Errors
    /// [`WriteError`]; the target is as it was then.
    pub fn write_with_confidence(
        &self,
        normals: &[Vec3],
        confidence: Option<&[u8]>,
        path: &Path,
        options: &WriteOptions,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        progress.stage("Writing");
        let format = FileFormat::of_target(path, self.path().map(PathBuf::as_path))?.unwrap_or(self.format);
        check_normals(normals, self.cloud.n_points())?;
        if let Some(confidence) = confidence {
            if confidence.len() != normals.len() {
                return Err(WriteError::Count {
                    n_normals: confidence.len(),
                    n_points: normals.len(),
                });
            }
            if !self.can_hold_confidence(format) {
                return Err(WriteError::NoConfidence { path: path.to_owned() });
            }
        }
        if !options.overwrite_input && self.path().is_some_and(|input| save::is_same_file(input, path)) {
            return Err(WriteError::OverInput { path: path.to_owned() });
        }
        let layout = self.file.layout.as_layout();
        let bytes = &self.file.bytes[..];
        let row_normals = RowNormals::new(normals, confidence, self.rows.as_ref().map(|rows| rows.as_slice()));
        let comment = comment(&options.rule);
        save::replace(path, |out| {
            let io = WriteError::io(path);
            let mut write = |bytes: &[u8]| out.write_all(bytes).map_err(&io);
            match (&self.file.layout, format) {
                (SourceLayout::Ply(ply), FileFormat::Ply) => rewrite(
                    layout,
                    bytes,
                    &ply.header_edits(&comment, confidence.is_some()),
                    row_normals,
                    &mut write,
                    progress,
                ),
                (SourceLayout::Xyz(xyz), FileFormat::Xyz) => rewrite(
                    layout,
                    bytes,
                    &xyz.header_edits(bytes, confidence.is_some()),
                    row_normals,
                    &mut write,
                    progress,
                ),
                (_, FileFormat::Xyz) => write_text(
                    layout,
                    bytes,
                    TextStyle::of_path(path),
                    row_normals,
                    &mut write,
                    progress,
                ),
                (_, FileFormat::Ply) => {
                    let positions = read_values(layout, bytes, &Part::new(progress, 0.0..0.5))?.positions;
                    let file = NewFile {
                        n_points: positions.len(),
                        position: &|row| positions[row],
                        coordinates: narrowest(&positions),
                        normals: Some(row_normals),
                        comment: Some(&comment),
                    };
                    file.write_ply(&mut write, &Part::new(progress, 0.5..1.0))
                }
            }
        })
    }
}

/// The comment line that names program, version and rule.
fn comment(rule: &str) -> String {
    let rule = rule.replace(char::is_control, " ");
    format!(
        "comment Normend {}: normals oriented, rule: {rule}",
        env!("CARGO_PKG_VERSION")
    )
}

fn check_normals(normals: &[Vec3], n_points: usize) -> Result<(), WriteError> {
    if normals.len() != n_points {
        return Err(WriteError::Count {
            n_normals: normals.len(),
            n_points,
        });
    }
    let is_unit = |normal: &Vec3| (normal.length_squared() - 1.0).abs() < 0.01;
    match normals.par_iter().position_first(|normal| !is_unit(normal)) {
        None => Ok(()),
        Some(point) => Err(WriteError::NotUnit {
            point,
            normal: normals[point],
        }),
    }
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
/// when the extension says so ([`FileFormat::of_target`]). A file that is there is replaced.
///
/// # Errors
/// [`WriteError`]; the target is as it was then.
pub fn write_points(
    path: &Path,
    positions: Positions<'_>,
    normals: Option<&[Vec3]>,
    progress: &dyn Progress,
) -> Result<(), WriteError> {
    progress.stage("Writing");
    let format = FileFormat::of_target(path, None)?;
    let n_points = match positions {
        Positions::Float(positions) => positions.len(),
        Positions::Double(positions) => positions.len(),
    };
    if let Some(normals) = normals {
        check_normals(normals, n_points)?;
    }
    let file = NewFile {
        n_points,
        position: &|row| match positions {
            Positions::Float(positions) => positions[row].as_dvec3(),
            Positions::Double(positions) => positions[row],
        },
        coordinates: match positions {
            Positions::Float(_) => Scalar::Float,
            Positions::Double(_) => Scalar::Double,
        },
        normals: normals.map(|normals| RowNormals::new(normals, None, None)),
        comment: None,
    };
    save::replace(path, |out| {
        let io = WriteError::io(path);
        let mut write = |bytes: &[u8]| out.write_all(bytes).map_err(&io);
        match format {
            Some(FileFormat::Xyz) => file.write_text(TextStyle::of_path(path), &mut write, progress),
            Some(FileFormat::Ply) | None => file.write_ply(&mut write, progress),
        }
    })
}

/// Writes `bytes` to `path` as [`Scan::write`] writes scans, whole or not at all: for pictures and the like. A file that is
/// there is replaced.
///
/// # Errors
/// [`WriteError`]; the target is as it was then.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    save::replace(path, |out| out.write_all(bytes).map_err(WriteError::io(path)))
}

impl fmt::Debug for Scan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scan")
            .field("n_points", &self.cloud.n_points())
            .field("format", &self.format)
            .finish()
    }
}
