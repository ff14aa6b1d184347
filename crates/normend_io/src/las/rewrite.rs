//! Writing a LAS or LAZ file again with other normals: what stands before the points, the points, what stands after them.

use std::io::SeekFrom;

use glam::Vec3;
use normend_core::Progress;

use super::dimensions::{EXTRA_BYTES, forget_range, push_description, push_unnamed};
use super::head::{PACKED_BIT, Record, at, new_record};
use super::laz::{PACKING, Packer, Packing};
use super::{COMMENT, INDEX, LasLayout, is_packed_name, too_large};
use crate::error::WriteError;
use crate::output::Output;
use crate::rewrite::{NO_NORMAL, RowNormals, write_side};
use crate::table::{NORMAL, NewContent, SIDE, for_each_part};
use crate::value::{Scalar, ValueType};

/// What new extra bytes are called, by component of the normal.
pub(super) const NORMAL_FIELDS: [&str; 3] = ["NormalX", "NormalY", "NormalZ"];
/// The same where one of these names is taken by something else.
const OTHER_NORMAL_FIELDS: [[&str; 3]; 2] = [["nx", "ny", "nz"], ["normal_x", "normal_y", "normal_z"]];
/// What they are, for who reads the file's descriptions.
pub(super) const ABOUT_NORMAL: &str = "unit normal, oriented";
/// The same for confidence and its flag.
pub(super) const SIDE_FIELDS: [(&str, Scalar, &str); 2] = [
    ("confidence", Scalar::Float, "how sure the side is, 0 to 1"),
    ("oriented", Scalar::UChar, "0 where the side is a guess"),
];

/// A value of a row that is written.
#[derive(Clone, Copy)]
struct NewValue {
    slot: usize,
    /// Its first byte in a row of the new file.
    offset: usize,
    value_type: ValueType,
    /// Whether the rows that came in have it too.
    is_old: bool,
}

/// What is written into rows.
struct Plan {
    values: Vec<NewValue>,
    descriptions: Vec<u8>,
    stride: usize,
}

impl Plan {
    /// Normals and confidence go where rows have them, or behind all that they have.
    fn new(layout: &LasLayout, normals: Option<RowNormals<'_>>) -> Self {
        let mut plan = Self {
            values: Vec::new(),
            descriptions: layout.extra.descriptions.clone(),
            stride: layout.head.stride,
        };
        let Some(normals) = normals else {
            return plan;
        };
        // There may be one of a name that cannot hold it; the three of a normal are called in one way.
        let is_taken = |name: &str| (layout.extra.fields.iter()).any(|field| field.name.eq_ignore_ascii_case(name));
        let is_free = |names: &&[&str; 3]| !names.iter().any(|name| is_taken(name));
        let normal_names = OTHER_NORMAL_FIELDS.iter().find(is_free);
        let normal_names = normal_names
            .filter(|_| !is_free(&&NORMAL_FIELDS))
            .unwrap_or(&NORMAL_FIELDS);
        let mut is_described = false;
        let end = if normals.has_confidence() { SIDE.end } else { NORMAL.end };
        for slot in NORMAL.start..end {
            if let Some(field) = layout.records.column_of(slot) {
                let field_of_row = &layout.records.fields[field];
                plan.values.push(NewValue {
                    slot,
                    offset: field_of_row.offset,
                    value_type: field_of_row.value_type,
                    is_old: true,
                });
                let description = layout.extra.description_of[field - layout.n_standard];
                forget_range(&mut plan.descriptions, description);
                continue;
            }
            if !is_described {
                // Those that follow would be taken for bytes that nothing is said of.
                let standard_and_described = layout.head.stride - layout.extra.n_described;
                let standard = super::standard_size(layout.head.format).unwrap_or(0);
                push_unnamed(standard_and_described - standard, &mut plan.descriptions);
                is_described = true;
            }
            let (name, scalar, about) = if NORMAL.contains(&slot) {
                (normal_names[slot - NORMAL.start], Scalar::Float, ABOUT_NORMAL)
            } else {
                SIDE_FIELDS[slot - SIDE.start]
            };
            let name = if is_taken(name) {
                format!("{name}_normend")
            } else {
                name.to_owned()
            };
            push_description(&name, scalar, about, &mut plan.descriptions);
            plan.values.push(NewValue {
                slot,
                offset: plan.stride,
                value_type: ValueType::LittleEndian(scalar),
                is_old: false,
            });
            plan.stride += scalar.size();
        }
        plan
    }

    /// Appends a row with its new values; `None` for a row that is no point.
    fn push_row(&self, row: &[u8], point: Option<(Vec3, Option<u8>)>, scratch: &mut Vec<u8>, out: &mut Vec<u8>) {
        let start = out.len();
        out.extend_from_slice(row);
        out.resize(start + self.stride, 0);
        let change = self.change(row, point.map(|(normal, _)| normal));
        for value in &self.values {
            scratch.clear();
            let former = row.get(value.offset..value.offset + value.value_type.size());
            match (former, point) {
                (Some(_), None) => continue,
                (Some(_), Some(_)) if NORMAL.contains(&value.slot) && change == Change::Keep => continue,
                (Some(former), Some(_)) if NORMAL.contains(&value.slot) && change == Change::Negate => {
                    value.value_type.write_negated(former, scratch);
                }
                _ if NORMAL.contains(&value.slot) => {
                    let normal = point.map_or(NO_NORMAL, |(normal, _)| normal);
                    value.value_type.write(normal[value.slot - NORMAL.start], scratch);
                }
                _ => {
                    let confidence = point.and_then(|(_, confidence)| confidence);
                    write_side(value.slot, confidence.unwrap_or(0), value.value_type, scratch);
                }
            }
            out[start + value.offset..][..scratch.len()].copy_from_slice(scratch);
        }
    }

    /// What becomes of the normal that a row has.
    fn change(&self, row: &[u8], normal: Option<Vec3>) -> Change {
        let old = self
            .values
            .iter()
            .filter(|value| value.is_old && NORMAL.contains(&value.slot));
        let mut former = Vec3::NAN;
        for value in old {
            let bytes = &row[value.offset..value.offset + value.value_type.size()];
            former[value.slot - NORMAL.start] = value.value_type.read(bytes).map_or(f32::NAN, |value| value as f32);
        }
        match normal {
            Some(normal) if former == normal => Change::Keep,
            Some(normal) if former == -normal => Change::Negate,
            _ => Change::Replace,
        }
    }
}

/// What becomes of the normal that a row has.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Change {
    /// The bytes stay.
    Keep,
    /// The opposite: the bytes stay, but for the sign.
    Negate,
    /// Another normal.
    Replace,
}

/// Writes the file with the normals of `content`, or as it is, packed or not as the target's name says.
pub(super) fn rewrite(
    layout: &LasLayout,
    bytes: &[u8],
    content: Option<&NewContent<'_>>,
    out: &mut Output<'_>,
    progress: &dyn Progress,
) -> Result<(), WriteError> {
    let normals = content.map(|content| content.normals);
    let plan = Plan::new(layout, normals);
    let stride =
        u16::try_from(plan.stride).map_err(|_| too_large(&format!("a point would have {} bytes", plan.stride)))?;
    let n_added = stride - layout.head.stride as u16;
    let packing = match (
        is_packed_name(out.path).unwrap_or(layout.packing.is_some()),
        &layout.packing,
    ) {
        (false, _) => None,
        (true, Some(packing)) => Some(packing.with_extra(n_added)),
        (true, None) => {
            let standard = super::standard_size(layout.head.format).unwrap_or(0);
            Some(Packing::fresh(layout.head.format, stride - standard as u16).map_err(WriteError::Source)?)
        }
    };
    let mut head = Before::new(layout, bytes);
    head.copy_records(&plan, packing.as_ref(), content.map(|content| content.comment))?;
    let mut before = head.finish(stride, packing.is_some())?;
    out.write(&before)?;

    let after_rows = write_rows(layout, bytes, &plan, normals, packing.as_ref(), out, progress)?;
    let dropped: Vec<&Record> = layout
        .head
        .records
        .iter()
        .filter(|record| is_dropped_after(record))
        .collect();
    let mut done = layout.head.rest_at;
    for record in &dropped {
        out.write(&bytes[done..record.span.start])?;
        done = record.span.end;
    }
    out.write(&bytes[done..])?;

    // Where they are is known by now.
    patch_places(layout, &dropped, after_rows, &mut before);
    let failed = WriteError::io(out.path);
    let end = out.file.stream_position().map_err(&failed)?;
    out.file.seek(SeekFrom::Start(0)).map_err(&failed)?;
    out.write(&before[..usize::from(layout.head.header.header_size)])?;
    out.file.seek(SeekFrom::Start(end)).map_err(&failed)?;
    Ok(())
}

/// Writes the points; returns the byte after them.
fn write_rows(
    layout: &LasLayout,
    bytes: &[u8],
    plan: &Plan,
    normals: Option<RowNormals<'_>>,
    packing: Option<&Packing>,
    out: &mut Output<'_>,
    progress: &dyn Progress,
) -> Result<u64, WriteError> {
    let table = &layout.records.table;
    let make = |index: usize, rows: &mut Vec<u8>| -> Result<(), WriteError> {
        let part = table.part(index);
        let mut scratch = Vec::new();
        let old_rows = part.bytes.of(bytes).chunks_exact(layout.head.stride);
        match normals {
            None => rows.extend_from_slice(part.bytes.of(bytes)),
            Some(normals) => {
                for (row, point) in old_rows.zip(normals.points_since_row(part.first_row)) {
                    let point = point.map(|point| (normals.normal_of(point), normals.confidence_of(point)));
                    plan.push_row(row, point, &mut scratch, rows);
                }
            }
        }
        Ok(())
    };
    match packing {
        None => {
            for_each_part(table.n_parts(), progress, make, |rows| out.write(rows))?;
            out.file.stream_position().map_err(WriteError::io(out.path))
        }
        Some(packing) => {
            let mut packer = Packer::new(packing, plan.stride, out)?;
            for_each_part(table.n_parts(), progress, make, |rows| packer.push(rows))?;
            packer.finish()
        }
    }
}

/// What stands before the points, as it grows.
struct Before<'a> {
    layout: &'a LasLayout,
    bytes: &'a [u8],
    before: Vec<u8>,
    n_records: u32,
}

impl<'a> Before<'a> {
    fn new(layout: &'a LasLayout, bytes: &'a [u8]) -> Self {
        Self {
            layout,
            bytes,
            before: bytes[..usize::from(layout.head.header.header_size)].to_vec(),
            n_records: 0,
        }
    }

    /// Copies the records in their order; those that change stay where they are, new ones come last.
    fn copy_records(
        &mut self,
        plan: &Plan,
        packing: Option<&Packing>,
        comment: Option<&str>,
    ) -> Result<(), WriteError> {
        let comment = comment.map(|comment| super::dimensions::short(comment, usize::from(u16::MAX)).as_bytes());
        let mut new = [
            (
                EXTRA_BYTES,
                "",
                (!plan.descriptions.is_empty()).then_some(&plan.descriptions[..]),
            ),
            (COMMENT, "how normals were oriented", comment),
            (PACKING, "", packing.map(|packing| &packing.record[..])),
        ];
        for record in self.layout.head.records.iter().filter(|record| !record.is_extended) {
            let place = new.iter_mut().find(|(id, ..)| record.is(id.0, id.1));
            match place {
                // The comment of a file that is only packed or unpacked stays.
                Some((COMMENT, _, None)) | None if record.user_id != INDEX => self.push(record.span.of(self.bytes)),
                Some((_, _, content)) => {
                    // A second record of the kind was joined to the first, or is not needed any more.
                    if let Some(content) = content.take() {
                        let head = &self.bytes[record.span.start..record.data.start];
                        self.push_changed(head, content)?;
                    }
                }
                None => {}
            }
        }
        for ((user_id, record_id), description, content) in new {
            if let Some(content) = content {
                check_length(content)?;
                self.push(&new_record(user_id, record_id, description, content));
            }
        }
        Ok(())
    }

    fn push(&mut self, record: &[u8]) {
        self.before.extend_from_slice(record);
        self.n_records += 1;
    }

    /// The head of a record with another content.
    fn push_changed(&mut self, head: &[u8], content: &[u8]) -> Result<(), WriteError> {
        let start = self.before.len();
        let length = check_length(content)?;
        self.push(head);
        self.before[start + 20..start + 22].copy_from_slice(&length.to_le_bytes());
        self.before.extend_from_slice(content);
        Ok(())
    }

    /// Copies what stands between the records and the points, and says in the header what has changed.
    fn finish(mut self, stride: u16, is_packed: bool) -> Result<Vec<u8>, WriteError> {
        let head = &self.layout.head;
        self.before
            .extend_from_slice(&self.bytes[head.records_end..head.points_at]);
        let points_at =
            u32::try_from(self.before.len()).map_err(|_| too_large("the points would begin beyond 4 GB"))?;
        self.before[at::POINTS..][..4].copy_from_slice(&points_at.to_le_bytes());
        self.before[at::N_RECORDS..][..4].copy_from_slice(&self.n_records.to_le_bytes());
        self.before[at::STRIDE..][..2].copy_from_slice(&stride.to_le_bytes());
        if is_packed != head.is_packed {
            self.before[at::FORMAT] = head.format | if is_packed { PACKED_BIT } else { 0 };
        }
        Ok(self.before)
    }
}

fn check_length(content: &[u8]) -> Result<u16, WriteError> {
    u16::try_from(content.len()).map_err(|_| too_large(&format!("a record would have {} bytes", content.len())))
}

/// Whether a record after the points is left out: descriptions are joined with those before them, an index does not fit any more.
fn is_dropped_after(record: &Record) -> bool {
    record.is_extended && (record.user_id == INDEX || record.is(EXTRA_BYTES.0, EXTRA_BYTES.1))
}

/// Moves the places of what stands after the points, of which the first is at byte `after_rows` now.
fn patch_places(layout: &LasLayout, dropped: &[&Record], after_rows: u64, before: &mut [u8]) {
    let head = &layout.head;
    let moved = |place_in_file: u64| -> u64 {
        let from_rest = place_in_file - layout.rest_in_file as u64;
        let place = head.rest_at as u64 + from_rest;
        let is_before = |record: &&&Record| (record.span.start as u64) < place;
        let n_dropped: usize = dropped
            .iter()
            .filter(is_before)
            .map(|record| record.span.end - record.span.start)
            .sum();
        after_rows + from_rest - n_dropped as u64
    };
    let is_after = |place: &u64| *place >= layout.rest_in_file as u64;
    let mut put = |byte: usize, number: &[u8]| before[byte..byte + number.len()].copy_from_slice(number);
    if let Some(place) = head.header.start_of_waveform_data_packet_record.filter(is_after) {
        put(at::WAVEFORMS, &moved(place).to_le_bytes());
    }
    if let Some(evlr) = head.header.evlr.filter(|evlr| evlr.number_of_evlrs > 0) {
        let n_left = evlr.number_of_evlrs - dropped.len() as u32;
        let place = if n_left > 0 { moved(evlr.start_of_first_evlr) } else { 0 };
        put(at::EXTENDED, &place.to_le_bytes());
        put(at::N_EXTENDED, &n_left.to_le_bytes());
    }
}
