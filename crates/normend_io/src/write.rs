//! Writing scans and fresh clouds: whole or not at all, in the format that the target's extension names.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use normend_core::Progress;
use rayon::prelude::*;

use crate::error::WriteError;
use crate::format::FileFormat;
use crate::new_file::{Loss, NewFile, Origin};
use crate::output::Output;
use crate::rewrite::RowNormals;
use crate::save;
use crate::scan::Layer;
use crate::table::NewContent;
use crate::value::Scalar;

/// What is written besides the normals.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WriteOptions {
    /// The rule that decided the sides, for the comment line ("farthest along +z up", "as given").
    pub rule: String,
    /// Write over the file that was read. Without it that is refused.
    pub overwrite_input: bool,
    /// Write over it even when another program has changed it since, so that those changes are lost.
    pub overwrite_changed: bool,
}

impl Layer {
    /// Writes the file that came in with `normals` (unit, by point of this file: those of the scan in [`Layer::points`]) to `path`: beside it first, synced,
    /// renamed. The format is that of `path`'s extension, or the input's ([`FileFormat::of_target`]); in another format than
    /// the input's goes all that it can hold ([`Self::losses`] names the rest), in text with what the extension asks for: names
    /// and commas in `.csv`, the number of points in `.pts`. A row that is no point keeps the normal it has, or gets `0 0 1`.
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

    /// What a file at `path` would not hold of this one: nothing in the format that came in. O(1).
    ///
    /// # Errors
    /// [`WriteError::Extension`].
    pub fn losses(&self, path: &Path) -> Result<Vec<Loss>, WriteError> {
        let format = FileFormat::of_target(path, self.path().map(PathBuf::as_path))?.unwrap_or(self.format);
        if format == self.format {
            return Ok(self.file.layout.remarks());
        }
        let mut file = NewFile::of_file(self.file.layout.as_ref(), &self.file.bytes, None);
        let besides = self.file.layout.besides_rows(&self.file.bytes);
        let mut losses: Vec<Loss> = besides
            .into_iter()
            .map(|what| Loss {
                what,
                why: format!(
                    "{} made from {} holds points alone",
                    format.label(),
                    self.format.label()
                ),
            })
            .collect();
        losses.extend(format.limit(&mut file, path));
        losses.extend(self.lost_scans(format));
        if self.n_left_out > 0 && !format.can_hold_left_out() {
            let rows = if self.n_left_out == 1 { "row" } else { "rows" };
            losses.push(Loss {
                what: format!("{} {rows} without a place", self.n_left_out),
                why: format!("{} holds points alone", format.label()),
            });
        }
        Ok(losses)
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
        check_normals(normals, self.n_points())?;
        if let Some(confidence) = confidence {
            if confidence.len() != normals.len() {
                return Err(WriteError::Count {
                    n_normals: confidence.len(),
                    n_points: normals.len(),
                });
            }
            let can_hold = match format == self.format {
                true => self.file.layout.can_hold_side(),
                false => format.can_hold_side(path),
            };
            if !can_hold {
                return Err(WriteError::NoConfidence { path: path.to_owned() });
            }
        }
        let layout = self.file.layout.as_ref();
        let bytes = &self.file.bytes[..];
        let normals = RowNormals::new(normals, confidence, self.rows.as_ref().map(|rows| rows.as_slice()));
        let comment = format!(
            "Normend {}: normals oriented, rule: {}",
            env!("CARGO_PKG_VERSION"),
            one_line(&options.rule)
        );
        self.place(path, options, |out| {
            if format == self.format {
                let content = NewContent {
                    normals,
                    comment: &comment,
                };
                return layout.rewrite(bytes, &content, out, progress);
            }
            self.write_new(format, Some(normals), &comment, out, progress)
        })
    }

    /// Writes the file to `path` as it is, in the format of `path`'s extension: the normals that it has, which are `given`, if any,
    /// and all else that the format can hold ([`Self::losses`] names the rest).
    ///
    /// # Errors
    /// [`WriteError`]; the target is as it was then. [`WriteError::Target`] where the format is the input's already.
    pub(crate) fn convert(
        &self,
        given: Option<&[Vec3]>,
        path: &Path,
        options: &WriteOptions,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        progress.stage("Writing");
        let format = FileFormat::of_target(path, self.path().map(PathBuf::as_path))?.unwrap_or(self.format);
        if format == self.format {
            let copied = || WriteError::Target {
                path: path.to_owned(),
                reason: "would be of the format that came in: copy the file",
            };
            if path.extension() == self.path().and_then(|input| input.extension()) {
                return Err(copied());
            }
            // A format may have two forms, one of them packed.
            return self.place(path, options, |out| {
                let file = &self.file;
                file.layout
                    .copy(&file.bytes, out, progress)
                    .unwrap_or_else(|| Err(copied()))
            });
        }
        let rows = self.rows.as_ref().map(|rows| rows.as_slice());
        let normals = given.map(|given| RowNormals::new(given, None, rows));
        let comment = format!(
            "Normend {}: converted from {}",
            env!("CARGO_PKG_VERSION"),
            self.format.label()
        );
        self.place(path, options, |out| {
            self.write_new(format, normals, &comment, out, progress)
        })
    }

    /// What another format does not say of the scans that the points are from.
    fn lost_scans(&self, format: FileFormat) -> Option<Loss> {
        let frames = &self.file.layout.table().frames;
        let n_named = frames.iter().filter(|frame| !frame.name.is_empty()).count();
        let n_placed = frames.iter().filter(|frame| frame.station.is_some()).count();
        let (n_named, n_placed) = match format {
            FileFormat::E57 => (0, 0),
            // PCD says itself which viewpoints it has no room for.
            FileFormat::Ptx | FileFormat::Pcd => (n_named, 0),
            _ => (n_named, n_placed),
        };
        let names = (n_named > 0).then(|| format!("names of scans ({n_named})"));
        let places = (n_placed > 0).then(|| format!("places of scanners ({n_placed})"));
        let parts: Vec<String> = names.into_iter().chain(places).collect();
        (!parts.is_empty()).then(|| Loss {
            what: parts.join(" and "),
            why: format!("{} has no room for them", format.label()),
        })
    }

    /// Writes all that another format can hold.
    fn write_new(
        &self,
        format: FileFormat,
        normals: Option<RowNormals<'_>>,
        comment: &str,
        out: &mut Output<'_>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        let mut file = NewFile::of_file(self.file.layout.as_ref(), &self.file.bytes, normals);
        file.comment = Some(comment);
        format.limit(&mut file, out.path);
        format.write_new(&mut file, out, progress)
    }

    /// Puts what `fill` writes in the place of `path`, over the input only if `options` allow it.
    fn place(
        &self,
        path: &Path,
        options: &WriteOptions,
        fill: impl FnOnce(&mut Output<'_>) -> Result<(), WriteError>,
    ) -> Result<(), WriteError> {
        let is_input = || self.path().is_some_and(|input| save::is_same_file(input, path));
        if is_input() {
            if !options.overwrite_input {
                return Err(WriteError::OverInput { path: path.to_owned() });
            }
            if !options.overwrite_changed && self.is_changed_on_disk() {
                return Err(WriteError::InputChanged { path: path.to_owned() });
            }
        }
        let written = save::place(path, |file| fill(&mut Output { path, file }))?;
        // Another name of the input (a hard link) is a file of its own by now.
        if is_input() {
            // Where it cannot be read again, a journal of this scan is not taken for one of the new content. It is written all the same.
            let _ = self.file.on_disk.replaced_by(written);
        }
        Ok(())
    }
}

/// A rule in words as it may stand in a comment.
fn one_line(rule: &str) -> String {
    rule.replace(char::is_control, " ")
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

/// Writes a fresh cloud, with `n` unit normals or without, as [`crate::Scan::write`] does: binary little-endian PLY, or text
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
    let mut file = NewFile {
        n_rows: n_points,
        origin: Origin::Positions(&|row| match positions {
            Positions::Float(positions) => positions[row].as_dvec3(),
            Positions::Double(positions) => positions[row],
        }),
        coordinates: match positions {
            Positions::Float(_) => Scalar::Float,
            Positions::Double(_) => Scalar::Double,
        },
        normals: normals.map(|normals| RowNormals::new(normals, None, None)),
        fields: Vec::new(),
        comment: None,
    };
    let format = format.unwrap_or(FileFormat::Ply);
    save::replace(path, |out| {
        let mut out = Output { path, file: out };
        format.write_new(&mut file, &mut out, progress)
    })
}

/// Writes `bytes` to `path` as [`crate::Scan::write`] writes scans, whole or not at all: for pictures and the like. A file that is
/// there is replaced.
///
/// # Errors
/// [`WriteError`]; the target is as it was then.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    save::replace(path, |file| Output { path, file }.write(bytes))
}
