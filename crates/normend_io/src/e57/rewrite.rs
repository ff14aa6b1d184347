//! A copy of an E57 file with other normals: all else bit for bit.

use std::collections::BTreeMap;
use std::ops::Range;

use e57::RecordDataType;
use glam::Vec3;
use normend_core::Progress;
use normend_core::confidence::UNDECIDED;
use normend_core::progress::Part;

use super::E57Layout;
use super::metadata::{Edits, NORMALS_URI, NewRecord, OWN_URI};
use super::pages::PageWriter;
use super::rows::PackedScan;
use super::sections::write_streams;
use crate::error::{Stop, WriteError};
use crate::output::Output;
use crate::rewrite::{NO_NORMAL, RowNormals, share_of};
use crate::table::{Frame, NORMAL, NewContent, SIDE, VALUE_NAMES};

/// E57's names of what is written, by slot from the first of the normal on.
const TAGS: [&str; 5] = ["normalX", "normalY", "normalZ", "confidence", "oriented"];

/// How a value that is written is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stored {
    Single,
    Double,
    /// A byte.
    Flag,
}

impl Stored {
    fn bits(self) -> usize {
        match self {
            Self::Single => 32,
            Self::Double => 64,
            Self::Flag => 8,
        }
    }
}

/// The copy.
pub(super) fn write(
    layout: &E57Layout,
    content: &NewContent<'_>,
    out: &mut Output<'_>,
    progress: &dyn Progress,
) -> Result<(), WriteError> {
    let mut pages = PageWriter::new(out)?;
    let source = &layout.source;
    let n_rows = layout.records.table.n_rows.max(1) as f32;
    let mut scans = Vec::new();
    for (scan, frame) in source.scans.iter().zip(&layout.records.table.frames) {
        let end = frame.first_row + scan.info.n_rows;
        let part = Part::new(progress, frame.first_row as f32 / n_rows..end as f32 / n_rows);
        let rewritten = Rewritten::new(scan, frame, content.normals);
        let bits: Vec<usize> = rewritten.streams.iter().map(|&(bits, _)| bits).collect();
        let push = |stream: usize, rows: Range<usize>, out: &mut Vec<u8>| rewritten.push(stream, rows, out);
        let offset = write_streams(&mut pages, scan.info.n_rows, &bits, push, &part)?;
        scans.push((offset, rewritten.records));
    }
    let mut others = BTreeMap::new();
    for (&offset, copied) in &source.others {
        others.insert(offset, copied.write(&mut pages)?);
    }
    let edits = Edits::new(&source.xml, &scans, &others, content.comment).map_err(Stop::from)?;
    pages.finish(edits.apply(&source.xml).as_bytes())
}

/// A scan with other normals.
struct Rewritten<'a> {
    scan: &'a PackedScan,
    frame: &'a Frame,
    normals: RowNormals<'a>,
    /// Whether each row has a normal already.
    has_normals: bool,
    /// The bits of each stream of the copy, and the slot that is written into it; the others stay.
    streams: Vec<(usize, Option<(usize, Stored)>)>,
    /// What the XML section must say of that.
    records: Vec<NewRecord>,
}

impl<'a> Rewritten<'a> {
    fn new(scan: &'a PackedScan, frame: &'a Frame, normals: RowNormals<'a>) -> Self {
        let info = &scan.info;
        let mut streams: Vec<_> = info.records.iter().map(|record| (record.bits, None)).collect();
        let mut records = Vec::new();
        let end = if normals.has_confidence() { SIDE.end } else { NORMAL.end };
        for slot in NORMAL.start..end {
            let replaces = info.record(VALUE_NAMES[slot]);
            let former = replaces.map(|record| &info.records[record].kind);
            let is_flag = slot + 1 == SIDE.end;
            let stored = match former {
                Some(RecordDataType::Double { .. }) if !is_flag => Stored::Double,
                _ if is_flag => Stored::Flag,
                _ => Stored::Single,
            };
            let stream = (stored.bits(), Some((slot, stored)));
            match replaces {
                Some(record) => streams[record] = stream,
                None => streams.push(stream),
            }
            let is_declared = !is_flag
                && matches!(
                    former,
                    Some(RecordDataType::Single { .. } | RecordDataType::Double { .. })
                );
            if !is_declared {
                let is_normal = NORMAL.contains(&slot);
                let kind = match stored {
                    Stored::Flag => "type=\"Integer\" minimum=\"0\" maximum=\"255\"".to_owned(),
                    _ => format!(
                        "type=\"Float\" precision=\"single\" minimum=\"{}\" maximum=\"1\"",
                        if is_normal { "-1" } else { "0" }
                    ),
                };
                records.push(NewRecord {
                    replaces,
                    uri: if is_normal { NORMALS_URI } else { OWN_URI },
                    tag: TAGS[slot - NORMAL.start],
                    kind,
                });
            }
        }
        Self {
            scan,
            frame,
            normals,
            has_normals: NORMAL.into_iter().all(|slot| info.record(VALUE_NAMES[slot]).is_some()),
            streams,
            records,
        }
    }

    /// Appends the bytes of some rows of a stream.
    fn push(&self, stream: usize, rows: Range<usize>, out: &mut Vec<u8>) {
        let Some((slot, stored)) = self.streams[stream].1 else {
            return out.extend_from_slice(self.scan.streams[stream].bytes_of(rows));
        };
        let points = self.normals.points_since_row(self.frame.first_row + rows.start);
        for (row, point) in rows.zip(points) {
            let value = match stored {
                Stored::Single | Stored::Double if NORMAL.contains(&slot) => self.component(slot, row, point),
                _ => self.side(slot, stream, row, point),
            };
            match stored {
                Stored::Single => out.extend((value as f32).to_le_bytes()),
                Stored::Double => out.extend(value.to_le_bytes()),
                Stored::Flag => out.push(value as u8),
            }
        }
    }

    /// A component of the normal of a row, in the scan's own coordinates: the former number when the normal stays or turns.
    fn component(&self, slot: usize, row: usize, point: Option<usize>) -> f64 {
        let former = |slot: usize| {
            let record = self.scan.info.record(VALUE_NAMES[slot]);
            record.map_or(f64::NAN, |record| self.scan.value(record, row))
        };
        let axis = slot - NORMAL.start;
        let Some(point) = point else {
            return match self.has_normals {
                true => former(slot),
                false => f64::from(NO_NORMAL[axis]),
            };
        };
        let normal = self.normals.normal_of(point);
        if self.has_normals {
            let stored = Vec3::from_array([0, 1, 2].map(|axis| former(NORMAL.start + axis) as f32));
            let given = self.frame.normal_from_stored(stored);
            if given == normal {
                return former(slot);
            }
            if given == -normal {
                // Zero stays without a sign.
                return 0.0 - former(slot);
            }
        }
        f64::from(self.frame.stored_from_normal(normal)[axis] + 0.0)
    }

    /// How sure the side is, or whether it is more than nothing; a row that is no point keeps what it has.
    fn side(&self, slot: usize, stream: usize, row: usize, point: Option<usize>) -> f64 {
        let confidence = point.and_then(|point| self.normals.confidence_of(point));
        match confidence {
            Some(confidence) if slot == SIDE.start => f64::from(share_of(confidence)),
            Some(confidence) => f64::from(u8::from(confidence > UNDECIDED)),
            None if stream < self.scan.streams.len() => self.scan.value(stream, row),
            None => 0.0,
        }
    }
}
