//! A scan: the points of a file or of several, and the files themselves so that they can be written again.

use std::fmt;
use std::fs::{self, File};
use std::io::{self, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec3};
use normend_core::evidence::Station;
use normend_core::progress::Part;
use normend_core::{PointCloud, Progress};

use crate::error::{ReadError, Stop};
use crate::format::{FileFormat, recognize};
use crate::on_disk::{Content, OnDisk};
use crate::recipe::ScanIdentity;
use crate::table::{Layout, read_place, read_points};
use crate::xyz::TextColumns;
use crate::{e57, las, obj, pcd, ply, ptx, xyz};

/// A scan as it was read: the points, and the files themselves so that they can be written again with other normals. Most scans are
/// of one file; [`Scan::together`] makes one of several.
#[derive(Clone)]
pub struct Scan {
    /// The finite points, file by file.
    pub cloud: Arc<PointCloud>,
    /// The files' normals by point, of any length (zero where not finite, or where a file has none), if any file has some.
    pub given_normals: Option<Arc<Vec<Vec3>>>,
    /// Rows that are left out because a coordinate is not finite, of all files.
    pub n_left_out: usize,
    /// The files, in the order of their points; at least one.
    pub(crate) layers: Vec<Layer>,
}

/// One of the files that a scan is made of, and which points are from it.
#[derive(Clone)]
pub struct Layer {
    /// The file's name, without folders.
    pub name: String,
    /// Its points, which follow each other in the scan.
    pub points: Range<u32>,
    /// What it was read as.
    pub format: FileFormat,
    /// Whether it has normals.
    pub has_normals: bool,
    /// Rows that are left out because a coordinate is not finite.
    pub n_left_out: usize,
    /// The file's row of each of its points, ascending; `None` when every row is a point.
    pub(crate) rows: Option<Arc<Vec<u32>>>,
    pub(crate) file: Arc<SourceFile>,
}

/// The file that a scan was read from.
pub(crate) struct SourceFile {
    path: Option<PathBuf>,
    /// The file's bytes; of a file that is packed, what its layout unpacked them to.
    pub bytes: Vec<u8>,
    pub layout: Box<dyn Layout>,
    /// Size of the file in bytes.
    n_bytes: u64,
    /// BLAKE3 of the file, once it was asked for.
    hash: OnceLock<[u8; 32]>,
    pub on_disk: OnDisk,
}

/// What a reader is told that the file does not say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// Names of a text's columns from the first on, in place of what stands in it and of how they look: `x y z`, `nx ny nz` and
    /// any others; `-` for none. Other formats say themselves what their columns are, and this is not looked at.
    pub columns: Option<Vec<String>>,
}

/// Reads a scan; the format is recognized by content, then by extension. Takes no more than the file's
/// rows unpacked, and what is returned.
///
/// # Errors
/// [`ReadError`]; its message names the file, the place, the reason and what to do.
pub fn read(path: &Path, progress: &dyn Progress) -> Result<Scan, ReadError> {
    read_with(path, &ReadOptions::default(), progress)
}

/// Like [`read`], with what the caller knows of the file.
///
/// # Errors
/// As [`read`].
pub fn read_with(path: &Path, options: &ReadOptions, progress: &dyn Progress) -> Result<Scan, ReadError> {
    progress.stage("Reading");
    // Before it is read: what changes meanwhile is a change.
    let source = Some((path, OnDisk::of(path)));
    let bytes = read_file(path, &Part::new(progress, 0.0..0.3))?;
    let name = path.display().to_string();
    read_content(bytes, &name, source, options, &Part::new(progress, 0.3..1.0))
}

/// Reads a scan from memory; `name` stands for the path in messages and for the extension.
///
/// # Errors
/// [`ReadError`], as [`read`].
pub fn read_bytes(bytes: Vec<u8>, name: &str, progress: &dyn Progress) -> Result<Scan, ReadError> {
    progress.stage("Reading");
    read_content(bytes, name, None, &ReadOptions::default(), progress)
}

/// Like [`read_bytes`], with what the caller knows of the content.
///
/// # Errors
/// As [`read`].
pub fn read_bytes_with(
    bytes: Vec<u8>,
    name: &str,
    options: &ReadOptions,
    progress: &dyn Progress,
) -> Result<Scan, ReadError> {
    progress.stage("Reading");
    read_content(bytes, name, None, options, progress)
}

pub(crate) fn read_file(path: &Path, progress: &dyn Progress) -> Result<Vec<u8>, ReadError> {
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

fn read_content(
    bytes: Vec<u8>,
    name: &str,
    source: Option<(&Path, OnDisk)>,
    options: &ReadOptions,
    progress: &dyn Progress,
) -> Result<Scan, ReadError> {
    let in_file = |stop: Stop| stop.in_file(name);
    let format = recognize(&bytes, Path::new(name)).map_err(|broken| in_file(broken.into()))?;
    let n_bytes = bytes.len() as u64;
    let Decoded { bytes, layout, hash } =
        decode(format, bytes, options, &Part::new(progress, 0.0..0.5)).map_err(in_file)?;
    let points = read_points(layout.as_ref(), &bytes, &Part::new(progress, 0.5..1.0)).map_err(in_file)?;
    let n_left_out = layout.table().n_rows - points.cloud.n_points();
    let (path, on_disk) = source.unzip();
    let layer = Layer {
        name: Path::new(name)
            .file_name()
            .map_or_else(|| name.to_owned(), |name| name.to_string_lossy().into_owned()),
        // A cloud has no more points than ids.
        points: 0..points.cloud.n_points() as u32,
        format,
        has_normals: points.normals.is_some(),
        n_left_out,
        rows: points.rows.map(Arc::new),
        file: Arc::new(SourceFile {
            path: path.map(Path::to_owned),
            bytes,
            layout,
            n_bytes,
            hash,
            on_disk: on_disk.unwrap_or_default(),
        }),
    };
    Ok(Scan {
        cloud: Arc::new(points.cloud),
        given_normals: points.normals.map(Arc::new),
        n_left_out,
        layers: vec![layer],
    })
}

/// A file whose rows can be found.
struct Decoded {
    bytes: Vec<u8>,
    layout: Box<dyn Layout>,
    hash: OnceLock<[u8; 32]>,
}

/// Finds the rows of a file, or unpacks them.
fn decode(format: FileFormat, bytes: Vec<u8>, options: &ReadOptions, progress: &dyn Progress) -> Result<Decoded, Stop> {
    let layout: Box<dyn Layout> = match format {
        FileFormat::Ply => Box::new(ply::read(&bytes, progress)?),
        FileFormat::Las => {
            // What is unpacked is another content than the file's.
            let hash = if las::is_packed(&bytes) {
                OnceLock::from(hash(&bytes))
            } else {
                OnceLock::new()
            };
            let (bytes, layout) = las::read(bytes, progress)?;
            return Ok(Decoded {
                bytes,
                layout: Box::new(layout),
                hash,
            });
        }
        FileFormat::Pcd => {
            let pcd = pcd::read(&bytes, progress)?;
            if let Some(unpacked) = pcd.unpacked {
                return Ok(Decoded {
                    hash: OnceLock::from(hash(&bytes)),
                    bytes: unpacked,
                    layout: Box::new(pcd.layout),
                });
            }
            Box::new(pcd.layout)
        }
        FileFormat::Obj => Box::new(obj::read(&bytes, progress)?),
        FileFormat::Xyz => Box::new(xyz::read(&bytes, options.columns.as_deref(), progress)?),
        FileFormat::Ptx => Box::new(ptx::read(&bytes, progress)?),
        FileFormat::E57 => {
            let hash = OnceLock::from(hash(&bytes));
            let (bytes, layout) = e57::read(bytes, progress)?;
            return Ok(Decoded {
                bytes,
                layout: Box::new(layout),
                hash,
            });
        }
    };
    Ok(Decoded {
        bytes,
        layout,
        hash: OnceLock::new(),
    })
}

pub(crate) fn hash(bytes: &[u8]) -> [u8; 32] {
    *blake3::Hasher::new().update_rayon(bytes).finalize().as_bytes()
}

impl Layer {
    /// Number of points. O(1).
    pub fn n_points(&self) -> usize {
        self.points.len()
    }

    /// Where it was read from; `None` for [`read_bytes`].
    pub fn path(&self) -> Option<&PathBuf> {
        self.file.path.as_ref()
    }

    /// Where the scan's `point` is, with all digits that the file has; `None` when it is of another file. Reads up to some thousand
    /// rows.
    pub fn coordinates(&self, point: u32) -> Option<DVec3> {
        let point = point.checked_sub(self.points.start)?;
        let row = match &self.rows {
            Some(rows) => *rows.get(point as usize)?,
            None => point,
        };
        read_place(&*self.file.layout, &self.file.bytes, row as usize)
    }

    /// Whether another program has changed the file since it was read, or since it was written over. One look at the disk, not into
    /// the file.
    pub fn is_changed_on_disk(&self) -> bool {
        self.path().is_some_and(|path| self.file.on_disk.is_changed(path))
    }

    /// What tells this file from others in recipes; `name` is the file's without folders. That is the content that was read or, once
    /// that was written over, the one that took its place: it has the same points. The first call hashes the file's bytes on all
    /// processors; later ones cost nothing.
    pub fn identity(&self, name: &str) -> ScanIdentity {
        let Content { n_bytes, hash } = self.file.on_disk.content().unwrap_or_else(|| Content {
            n_bytes: self.file.n_bytes,
            hash: *self.file.hash.get_or_init(|| hash(&self.file.bytes)),
        });
        ScanIdentity {
            name: name.to_owned(),
            path: self.path().map(|path| {
                let path = std::path::absolute(path).unwrap_or_else(|_| path.clone());
                path.display().to_string()
            }),
            n_bytes,
            hash,
            n_points: self.n_points() as u64,
            columns: self.columns_given().map(<[String]>::to_vec),
            files: Vec::new(),
        }
    }

    /// What the columns of a text are and how they were told; `None` for other formats. Looks at the first thousand rows.
    pub fn text_columns(&self) -> Option<TextColumns> {
        Some(self.file.layout.as_text()?.text_columns(&self.file.bytes))
    }

    /// The names that the columns were given by [`ReadOptions`], if the scan is a text and they were.
    pub fn columns_given(&self) -> Option<&[String]> {
        self.file.layout.as_text()?.given()
    }

    /// Places that the file says its points were measured from, with the scan's points of each, ascending. O(number of places).
    pub fn stations(&self) -> Vec<Station> {
        self.named_stations().into_iter().map(|(station, _)| station).collect()
    }

    /// [`Self::stations`] with the names of their scans, empty where the file gives none. O(number of places).
    pub(crate) fn named_stations(&self) -> Vec<(Station, String)> {
        let table = self.file.layout.table();
        let end_of = |index: usize| table.frames.get(index + 1).map_or(table.n_rows, |next| next.first_row);
        let frames = table.frames.iter().enumerate();
        frames
            .filter_map(|(index, frame)| {
                let station = Station {
                    points: self.point_of_row(frame.first_row)..self.point_of_row(end_of(index)),
                    position: frame.station?,
                };
                Some((station, frame.name.clone()))
            })
            .collect()
    }

    /// The scan's point that a row of the file is or, when it is none, the next that follows. O(log n).
    pub(crate) fn point_of_row(&self, row: usize) -> u32 {
        let point = match &self.rows {
            Some(rows) => rows.partition_point(|&other| (other as usize) < row) as u32,
            None => row as u32,
        };
        self.points.start + point
    }
}

impl fmt::Debug for Layer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Layer")
            .field("name", &self.name)
            .field("points", &self.points)
            .field("format", &self.format)
            .finish_non_exhaustive()
    }
}

impl fmt::Debug for Scan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scan")
            .field("n_points", &self.cloud.n_points())
            .field("layers", &self.layers)
            .finish()
    }
}
