//! The formats that can be read and written, and how a file's is told.

use std::ffi::OsStr;
use std::path::Path;

use normend_core::Progress;

use crate::error::{Broken, WriteError};
use crate::new_file::{Loss, NewFile};
use crate::output::Output;
use crate::{e57, las, new_text, obj, pcd, ply, ptx, xyz};

/// The formats that can be read and written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileFormat {
    /// Polygon File Format: ascii, binary little-endian, binary big-endian.
    Ply,
    /// Of the American Society for Photogrammetry, plain or packed (LAZ).
    Las,
    /// Point Cloud Data of PCL: ascii, binary, packed.
    Pcd,
    /// Wavefront OBJ: `v` and `vn` lines.
    Obj,
    /// Text, a point a line: `x y z [nx ny nz …]`.
    Xyz,
    /// Scans with poses, packed, as laser scanners exchange them (ASTM E2807).
    E57,
    /// Text of scanned grids with poses.
    Ptx,
}

impl FileFormat {
    /// All formats, in the order of dialogs.
    pub const ALL: [Self; 7] = [
        Self::Ply,
        Self::Las,
        Self::Pcd,
        Self::Obj,
        Self::Xyz,
        Self::E57,
        Self::Ptx,
    ];

    /// The name in dialogs.
    pub fn label(self) -> &'static str {
        match self {
            Self::Ply => "PLY",
            Self::Las => "LAS/LAZ",
            Self::Pcd => "PCD",
            Self::Obj => "OBJ",
            Self::Xyz => "XYZ text",
            Self::E57 => "E57",
            Self::Ptx => "PTX",
        }
    }

    /// File name extensions, lower case, without the dot; the first is the usual one.
    pub fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Ply => &["ply"],
            Self::Las => &["las", "laz"],
            Self::Pcd => &["pcd"],
            Self::Obj => &["obj"],
            Self::E57 => &["e57"],
            Self::Ptx => &["ptx"],
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

impl FileFormat {
    /// Drops from a new file what this format cannot hold; `path` is the target, whose extension says how a text is laid out.
    pub(crate) fn limit(self, file: &mut NewFile<'_>, path: &Path) -> Vec<Loss> {
        match self {
            Self::Ply => ply::new::limit(file),
            Self::Las => las::new::limit(file, path),
            Self::Pcd => pcd::new::limit(file),
            Self::Obj => obj::new::limit(file),
            Self::Xyz => new_text::limit(file, path),
            Self::E57 => e57::new::limit(file),
            Self::Ptx => ptx::new::limit(file),
        }
    }

    /// Whether a new file at `path` can hold confidence.
    pub(crate) fn can_hold_side(self, path: &Path) -> bool {
        match self {
            Self::Ply | Self::Las | Self::Pcd | Self::E57 => true,
            Self::Xyz => new_text::can_hold_side(path),
            Self::Ptx | Self::Obj => false,
        }
    }

    /// Whether a new file holds rows without finite coordinates, which are no points.
    pub(crate) fn can_hold_left_out(self) -> bool {
        // Coordinates of LAS are whole numbers of steps, and most programs that read OBJ know no NaN.
        !matches!(self, Self::Las | Self::Obj)
    }

    /// Writes a new file, from which [`Self::limit`] has dropped what the format cannot hold.
    pub(crate) fn write_new(
        self,
        file: &mut NewFile<'_>,
        out: &mut Output<'_>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        match self {
            Self::Ply => ply::new::write(file, out, progress),
            Self::Las => las::new::write(file, out, progress),
            Self::Pcd => pcd::new::write(file, out, progress),
            Self::Obj => obj::new::write(file, out, progress),
            Self::Xyz => new_text::write(file, out, progress),
            Self::E57 => e57::new::write(file, out, progress),
            Self::Ptx => ptx::new::write(file, out, progress),
        }
    }
}

/// Tells the format by the first bytes, then by the extension of `path`.
pub(crate) fn recognize(bytes: &[u8], path: &Path) -> Result<FileFormat, Broken> {
    const OTHERS: [(&[u8], &str); 3] = [
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
    if las::sniff(bytes) {
        return Ok(FileFormat::Las);
    }
    if pcd::sniff(bytes) {
        return Ok(FileFormat::Pcd);
    }
    if bytes.starts_with(e57::SIGNATURE) {
        return Ok(FileFormat::E57);
    }
    if ptx::sniff(bytes) {
        return Ok(FileFormat::Ptx);
    }
    if let Some((_, what)) = OTHERS.iter().find(|(start, _)| bytes.starts_with(start)) {
        return Err(Broken::whole(format!(
            "this is {what}, which Normend does not read: convert it to PLY"
        )));
    }
    match FileFormat::of_path(path) {
        Some(format) => Ok(format),
        None if obj::sniff(bytes) => Ok(FileFormat::Obj),
        None if xyz::sniff(bytes) => Ok(FileFormat::Xyz),
        None => Err(Broken::whole(
            "this is neither PLY nor text with a point a line: convert it to PLY",
        )),
    }
}
