//! Writing the rows of the file that came in, with other normals.

use glam::Vec3;
use normend_core::Progress;
use normend_core::confidence::UNDECIDED;

use crate::error::{Stop, WriteError};
use crate::output::Output;
use crate::table::{Layout, N_VALUES, NORMAL, Part, SIDE, Span, Spans, for_each_part};
use crate::value::{Scalar, ValueType};

/// What a row gets that is no point, because a coordinate is not finite, where the file has no normal to keep.
pub(crate) const NO_NORMAL: Vec3 = Vec3::Z;

/// The new normals by row of the file, and how sure they are of their sides.
#[derive(Clone, Copy)]
pub(crate) struct RowNormals<'a> {
    normals: &'a [Vec3],
    /// By point, in units of 1/255; `None` when it is not written.
    confidence: Option<&'a [u8]>,
    /// The row of each point, ascending; `None` when every row is a point.
    rows: Option<&'a [u32]>,
}

impl<'a> RowNormals<'a> {
    pub fn new(normals: &'a [Vec3], confidence: Option<&'a [u8]>, rows: Option<&'a [u32]>) -> Self {
        Self {
            normals,
            confidence,
            rows,
        }
    }

    /// Whether confidence is written.
    pub fn has_confidence(self) -> bool {
        self.confidence.is_some()
    }

    /// How sure the normal of a point is of its side, in units of 1/255; `None` when it is not written.
    pub fn confidence_of(self, point: usize) -> Option<u8> {
        self.confidence.map(|confidence| confidence[point])
    }

    /// The normal of a point, unit.
    pub fn normal_of(self, point: usize) -> Vec3 {
        self.normals[point]
    }

    /// The points of the rows from `first_row` on, without end; `None` for a row that is no point.
    pub fn points_since_row(self, first_row: usize) -> impl Iterator<Item = Option<usize>> + 'a {
        let mut point = self.rows.map_or(first_row, |rows| {
            rows.partition_point(|row| (*row as usize) < first_row)
        });
        (first_row..).map(move |row| {
            if self
                .rows
                .is_some_and(|rows| rows.get(point).is_none_or(|next| *next as usize != row))
            {
                return None;
            }
            point += 1;
            (point <= self.normals.len()).then_some(point - 1)
        })
    }
}

/// Writes the bytes of a file with `edits` before the rows and other normals in them.
pub(crate) fn rewrite(
    layout: &dyn Layout,
    bytes: &[u8],
    edits: &[(Span, Vec<u8>)],
    normals: RowNormals<'_>,
    out: &mut Output<'_>,
    progress: &dyn Progress,
) -> Result<(), WriteError> {
    let table = layout.table();
    let mut done = 0;
    for (span, replacement) in edits {
        out.write(&bytes[done..span.start])?;
        out.write(replacement)?;
        done = span.end;
    }
    out.write(&bytes[done..table.start()])?;
    for_each_part(
        table.n_parts(),
        progress,
        |index, out| Ok(rewrite_part(layout, bytes, table.part(index), normals, out)?),
        |part| out.write(part),
    )?;
    out.write(&bytes[table.end..])
}

fn rewrite_part(
    layout: &dyn Layout,
    bytes: &[u8],
    part: Part,
    normals: RowNormals<'_>,
    out: &mut Vec<u8>,
) -> Result<(), Stop> {
    let table = layout.table();
    let mut rows = layout.rows(bytes, part.bytes.start);
    let mut done = part.bytes.start;
    let anchor = table.anchor();
    let frames = table.frames_since_row(part.first_row);
    for (point, frame) in normals.points_since_row(part.first_row).zip(frames).take(part.n_rows) {
        let Some(spans) = rows.next_row()? else {
            break;
        };
        let normal = point.map(|point| normals.normals[point]);
        let normal = normal.map(|normal| frame.map_or(normal, |frame| frame.stored_from_normal(normal)));
        let confidence = normals
            .confidence
            .map(|confidence| point.map(|point| confidence[point]));
        let change = Change::between(&table.types, bytes, &spans, normal);
        for &slot in &table.order {
            let (span, value_type) = (spans[slot], table.types[slot]);
            if NORMAL.contains(&slot) {
                out.extend_from_slice(&bytes[done..span.start]);
                change.write(value_type, slot - NORMAL.start, span.of(bytes), out);
                done = span.end;
            } else if let (true, Some(Some(confidence))) = (SIDE.contains(&slot), confidence) {
                out.extend_from_slice(&bytes[done..span.start]);
                write_side(slot, confidence, value_type, out);
                done = span.end;
            }
            if slot == anchor {
                out.extend_from_slice(&bytes[done..span.end]);
                done = span.end;
                insert(layout, bytes, span, (normal, confidence), out);
            }
        }
    }
    out.extend_from_slice(&bytes[done..part.bytes.end]);
    Ok(())
}

/// Appends the values of a row that the file does not have after the one at `last`. A row that is no point is not sure of
/// anything.
fn insert(
    layout: &dyn Layout,
    bytes: &[u8],
    last: Span,
    (normal, confidence): (Option<Vec3>, Option<Option<u8>>),
    out: &mut Vec<u8>,
) {
    let table = layout.table();
    for slot in NORMAL.start..SIDE.end {
        let is_written = NORMAL.contains(&slot) || confidence.is_some();
        if table.has(slot) || !is_written {
            continue;
        }
        let value_type = match table.types[0] {
            text @ (ValueType::Text | ValueType::TextComma) => text,
            ValueType::BigEndian(_) => ValueType::BigEndian(new_type(slot)),
            _ => ValueType::LittleEndian(new_type(slot)),
        };
        if matches!(value_type, ValueType::Text | ValueType::TextComma) {
            out.extend_from_slice(separator_before(layout, bytes, last.start));
        }
        if NORMAL.contains(&slot) {
            value_type.write(normal.unwrap_or(NO_NORMAL)[slot - NORMAL.start], out);
        } else {
            write_side(slot, confidence.flatten().unwrap_or(0), value_type, out);
        }
    }
}

/// The type of a value that the file did not have.
fn new_type(slot: usize) -> Scalar {
    if slot + 1 == SIDE.end {
        Scalar::UChar
    } else {
        Scalar::Float
    }
}

/// Appends confidence as a number in 0..=1, or whether it is enough to call the normal oriented: 1 or 0.
pub(crate) fn write_side(slot: usize, confidence: u8, value_type: ValueType, out: &mut Vec<u8>) {
    if slot == SIDE.start {
        value_type.write(share_of(confidence), out);
    } else {
        value_type.write_flag(confidence > UNDECIDED, out);
    }
}

/// Confidence in units of 1/255 as a number in 0..=1.
pub(crate) fn share_of(confidence: u8) -> f32 {
    f32::from(confidence) / 255.0
}

/// What separates the value at byte `start` from the one before it in a text.
pub(crate) fn separator_before<'a>(layout: &dyn Layout, bytes: &'a [u8], start: usize) -> &'a [u8] {
    let length = bytes[..start]
        .iter()
        .rev()
        .take_while(|byte| layout.is_separator(**byte))
        .count();
    let separator = &bytes[start - length..start];
    // Of several commas all but the last stand after empty values.
    let mut marks = (0..length).filter(|&at| matches!(separator[at], b',' | b';'));
    match (marks.next(), marks.next_back()) {
        (Some(_), Some(last)) => &separator[last..],
        _ => separator,
    }
}

/// What becomes of the normal that a row has.
pub(crate) enum Change {
    /// The bytes stay.
    Keep,
    /// The opposite: the bytes stay, but for the sign.
    Negate,
    /// Another normal.
    Replace(Vec3),
}

impl Change {
    pub fn between(types: &[ValueType; N_VALUES], bytes: &[u8], spans: &Spans, normal: Option<Vec3>) -> Self {
        let Some(normal) = normal else {
            return Self::Keep;
        };
        if spans[NORMAL].iter().all(|span| span.start == span.end) {
            return Self::Replace(normal);
        }
        let former = |component: usize| {
            let value = types[3 + component].read(spans[3 + component].of(bytes));
            value.map_or(f32::NAN, |value| value as f32)
        };
        let former = Vec3::new(former(0), former(1), former(2));
        if former == normal {
            Self::Keep
        } else if former == -normal {
            Self::Negate
        } else {
            Self::Replace(normal)
        }
    }

    pub fn write(&self, value_type: ValueType, component: usize, former: &[u8], out: &mut Vec<u8>) {
        if let ValueType::LittleEndian(scalar) | ValueType::BigEndian(scalar) = value_type
            && !scalar.is_float()
        {
            // The header declares a float now.
            let value = match self {
                Self::Replace(normal) => normal[component],
                Self::Keep => value_type.read(former).map_or(0.0, |value| value as f32),
                Self::Negate => value_type.read(former).map_or(0.0, |value| -value as f32),
            };
            return value_type.write(value, out);
        }
        match self {
            Self::Replace(normal) => value_type.write(normal[component], out),
            Self::Keep => out.extend_from_slice(former),
            Self::Negate => value_type.write_negated(former, out),
        }
    }
}
