//! E57, the exchange format of laser scanners (ASTM E2807): several scans with poses, images and whatever else.
//!
//! The rows of all scans are unpacked one after the other, with the columns of all of them; each scan is a frame. The values
//! themselves are kept packed as they came, so a copy holds them bit for bit, and its XML section differs from the file's in
//! the places of sections and the declarations of normals alone. The crate `e57` says what the XML means and makes new files.
//! Packets are read and written here, because their sizes must be checked before anything is allocated for them.

#[cfg(test)]
mod broken_tests;
mod metadata;
pub(crate) mod new;
mod pages;
mod rewrite;
mod rows;
mod sections;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use normend_core::Progress;
use normend_core::progress::Part;

use self::metadata::Metadata;
use self::rows::PackedScan;
use self::sections::{Budget, Copied};
use crate::columns::Column;
use crate::error::{Broken, Place, Stop, WriteError};
use crate::output::Output;
use crate::records::{RecordField, Records, fields_by_name};
use crate::table::{COORDINATES, Frame, Layout, NewContent, Rows, Table};

/// How a file of this format begins.
pub(crate) const SIGNATURE: &[u8] = b"ASTM-E57";

/// An E57 file whose rows have been unpacked.
#[derive(Clone)]
pub(crate) struct E57Layout {
    records: Records,
    source: Arc<Source>,
}

/// What a copy is made of.
struct Source {
    xml: String,
    scans: Vec<PackedScan>,
    /// What is copied as it is, by physical offset.
    others: BTreeMap<u64, Copied>,
    n_images: usize,
    has_coordinate_system: bool,
}

/// Unpacks a file; returns the rows and what they are.
pub(crate) fn read(mut bytes: Vec<u8>, progress: &dyn Progress) -> Result<(Vec<u8>, E57Layout), Stop> {
    pages::check_header(&bytes)?;
    pages::check_pages(&bytes)?;
    progress.report(0.05)?;
    let n_bytes = bytes.len();
    let Metadata {
        xml,
        scans,
        others,
        n_images,
        has_coordinate_system,
    } = metadata::read(&bytes)?;
    pages::strip(&mut bytes);
    progress.report(0.1)?;

    let content = &bytes[..];
    let mut budget = Budget(content.len());
    let n_scans = scans.len();
    let mut packed = Vec::new();
    for (index, info) in scans.into_iter().enumerate() {
        let bits: Vec<usize> = info.records.iter().map(|record| record.bits).collect();
        let share = |index: usize| 0.1 + 0.4 * index as f32 / n_scans as f32;
        let part = Part::new(progress, share(index)..share(index + 1));
        let streams = sections::read_streams(content, info.offset, info.n_rows, &bits, &mut budget, &part)?;
        packed.push(PackedScan { info, streams });
    }
    let others = others.into_iter().map(|(offset, length)| {
        let copied = match length {
            Some(length) => Copied::read_blob(content, offset, length, &mut budget)?,
            None => Copied::read_packets(content, offset, &mut budget)?,
        };
        Ok((offset, copied))
    });
    let source = Source {
        xml,
        scans: packed,
        others: others.collect::<Result<_, Broken>>()?,
        n_images,
        has_coordinate_system,
    };
    drop(bytes);

    let (fields, stride) = rows::columns(&source.scans, n_bytes)?;
    let rows = rows::unpack(&source.scans, &fields, stride, &Part::new(progress, 0.5..1.0))?;
    let chosen =
        fields_by_name(&fields).ok_or_else(|| Broken::whole("the file has no coordinates: export it again"))?;
    let n_rows = rows.len() / stride;
    let mut records = Records::new(fields, chosen, 0, stride, n_rows);
    let mut first_row = 0;
    for PackedScan { info, .. } in &source.scans {
        let rows_of_scan = &rows[first_row * stride..(first_row + info.n_rows) * stride];
        let frame = frame(info, first_row, || {
            surrounds_origin(rows_of_scan, &records.fields, stride)
        });
        records.table.frames.push(frame);
        first_row += info.n_rows;
    }
    let source = Arc::new(source);
    Ok((rows, E57Layout { records, source }))
}

/// The frame of a scan. Where the scanner stood is where its pose puts the origin, unless the pose is something else: programs
/// also write poses that only move a cloud of many scans near zero. So the pose of a grid or of ranges and angles is a
/// scanner's, one that turns as well; one that only moves, when a scanner is named or the points surround the origin.
fn frame(info: &metadata::ScanInfo, first_row: usize, surrounds_origin: impl Fn() -> bool) -> Frame {
    let (turn, place) = info.pose.unwrap_or((DMat3::IDENTITY, DVec3::ZERO));
    let is_turned = turn != DMat3::IDENTITY;
    let is_measured = info.is_spherical() || info.pose.is_some() && (info.is_grid() || is_turned);
    let is_station = is_measured || place != DVec3::ZERO && (info.has_sensor || surrounds_origin());
    Frame {
        first_row,
        name: info.name.clone(),
        from_stored: DAffine3::from_mat3_translation(turn, place),
        turn,
        station: is_station.then_some(place),
    }
}

/// Whether the origin lies within the bounding box of some rows.
fn surrounds_origin(rows: &[u8], fields: &[RecordField], stride: usize) -> bool {
    fields[COORDINATES].iter().all(|field| {
        let span = field.offset..field.offset + field.value_type.size();
        let values = rows
            .chunks_exact(stride)
            .filter_map(|row| field.value_type.read(&row[span.clone()]));
        let (min, max) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), value| {
            (value.min(min), value.max(max))
        });
        min < 0.0 && 0.0 < max
    })
}

impl Layout for E57Layout {
    fn table(&self) -> &Table {
        &self.records.table
    }

    fn rows<'a>(&'a self, _bytes: &'a [u8], start: usize) -> Box<dyn Rows + 'a> {
        self.records.rows(start)
    }

    fn place(&self, _bytes: &[u8], _byte: usize) -> Place {
        // Rows were unpacked: their bytes are none of the file's.
        Place::Whole
    }

    fn columns(&self, _bytes: &[u8]) -> Vec<Column> {
        self.records.columns()
    }

    fn column_of(&self, slot: usize) -> Option<usize> {
        self.records.column_of(slot)
    }

    fn with_columns(&self, columns: &[usize]) -> (Box<dyn Layout>, Vec<usize>) {
        let (records, slots) = self.records.with_columns(columns);
        let layout = Self {
            records,
            source: Arc::clone(&self.source),
        };
        (Box::new(layout), slots)
    }

    fn besides_rows(&self, _bytes: &[u8]) -> Vec<String> {
        let count = |n: usize, what: &str| match n {
            0 => None,
            1 => Some(format!("1 {what}")),
            n => Some(format!("{n} {what}s")),
        };
        let n_vectors = (self.source.others.values())
            .filter(|copied| matches!(copied, Copied::Packets(_)))
            .count();
        let mut besides: Vec<String> = count(self.source.n_images, "image").into_iter().collect();
        besides.extend(count(n_vectors, "table"));
        if self.source.has_coordinate_system {
            besides.push("the coordinate system".to_owned());
        }
        besides.push("descriptions, times and sensors of the scans".to_owned());
        besides
    }

    fn can_hold_side(&self) -> bool {
        true
    }

    fn rewrite(
        &self,
        _bytes: &[u8],
        content: &NewContent<'_>,
        out: &mut Output<'_>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        rewrite::write(self, content, out, progress)
    }
}
