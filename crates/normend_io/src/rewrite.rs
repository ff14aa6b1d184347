//! Writing rows: the file that came in with other normals, or its points in another format.

use glam::Vec3;
use normend_core::Progress;

use crate::error::{Stop, WriteError};
use crate::new_file::TextStyle;
use crate::table::{Layout, Part, Span, Spans, for_each_part};
use crate::value::{Scalar, ValueType, push_number};

/// What a row gets that is no point, because a coordinate is not finite, where the file has no normal to keep.
pub(crate) const NO_NORMAL: Vec3 = Vec3::Z;

/// The new normals by row of the file.
#[derive(Clone, Copy)]
pub(crate) struct RowNormals<'a> {
    normals: &'a [Vec3],
    /// The row of each point, ascending; `None` when every row is a point.
    rows: Option<&'a [u32]>,
}

impl<'a> RowNormals<'a> {
    pub fn new(normals: &'a [Vec3], rows: Option<&'a [u32]>) -> Self {
        Self { normals, rows }
    }

    /// The normals of the rows from `first_row` on, without end; `None` for a row that is no point.
    pub fn since_row(self, first_row: usize) -> impl Iterator<Item = Option<Vec3>> + 'a {
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
            self.normals.get(point - 1).copied()
        })
    }
}

/// Writes the bytes of a file with `edits` before the rows and other normals in them.
pub(crate) fn rewrite(
    layout: &dyn Layout,
    bytes: &[u8],
    edits: &[(Span, Vec<u8>)],
    normals: RowNormals<'_>,
    write: &mut dyn FnMut(&[u8]) -> Result<(), WriteError>,
    progress: &dyn Progress,
) -> Result<(), WriteError> {
    let table = layout.table();
    let mut done = 0;
    for (span, replacement) in edits {
        write(&bytes[done..span.start])?;
        write(replacement)?;
        done = span.end;
    }
    write(&bytes[done..table.start()])?;
    for_each_part(
        table.n_parts(),
        progress,
        |index, out| Ok(rewrite_part(layout, bytes, table.part(index), normals, out)?),
        &mut *write,
    )?;
    write(&bytes[table.end..])
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
    for normal in normals.since_row(part.first_row).take(part.n_rows) {
        let Some(spans) = rows.next_row()? else {
            break;
        };
        if table.has_normals {
            let change = Change::between(table.types, bytes, &spans, normal);
            for &component in &table.normal_order {
                let span = spans[3 + component];
                out.extend_from_slice(&bytes[done..span.start]);
                change.write(table.types[3 + component], component, span.of(bytes), out);
                done = span.end;
            }
        } else {
            let last = spans[..3]
                .iter()
                .max_by_key(|span| span.end)
                .copied()
                .unwrap_or_default();
            out.extend_from_slice(&bytes[done..last.end]);
            insert(layout, bytes, last, normal.unwrap_or(NO_NORMAL), out);
            done = last.end;
        }
    }
    out.extend_from_slice(&bytes[done..part.bytes.end]);
    Ok(())
}

/// Appends a normal after the coordinates of a row, the last of which is at `last`.
fn insert(layout: &dyn Layout, bytes: &[u8], last: Span, normal: Vec3, out: &mut Vec<u8>) {
    let value_type = match layout.table().types[0] {
        ValueType::Text => ValueType::Text,
        ValueType::LittleEndian(_) => ValueType::LittleEndian(Scalar::Float),
        ValueType::BigEndian(_) => ValueType::BigEndian(Scalar::Float),
    };
    for component in normal.to_array() {
        if value_type == ValueType::Text {
            out.extend_from_slice(separator_before(layout, bytes, last.start));
        }
        value_type.write(component, out);
    }
}

/// What separates the value at byte `start` from the one before it in a text.
pub(crate) fn separator_before<'a>(layout: &dyn Layout, bytes: &'a [u8], start: usize) -> &'a [u8] {
    let length = bytes[..start]
        .iter()
        .rev()
        .take_while(|byte| layout.is_separator(**byte))
        .count();
    &bytes[start - length..start]
}

/// What becomes of the normal that a row has.
enum Change {
    /// The bytes stay.
    Keep,
    /// The opposite: the bytes stay, but for the sign.
    Negate,
    /// Another normal.
    Replace(Vec3),
}

impl Change {
    fn between(types: [ValueType; 6], bytes: &[u8], spans: &Spans, normal: Option<Vec3>) -> Self {
        let Some(normal) = normal else {
            return Self::Keep;
        };
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

    fn write(&self, value_type: ValueType, component: usize, former: &[u8], out: &mut Vec<u8>) {
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

/// Writes `x y z nx ny nz` for each row, in text of this style: a text's coordinates as they are, others as short as they read back.
pub(crate) fn write_text(
    layout: &dyn Layout,
    bytes: &[u8],
    style: TextStyle,
    normals: RowNormals<'_>,
    write: &mut dyn FnMut(&[u8]) -> Result<(), WriteError>,
    progress: &dyn Progress,
) -> Result<(), WriteError> {
    let table = layout.table();
    write(style.head(table.n_rows, true).as_bytes())?;
    let make = |index: usize, out: &mut Vec<u8>| -> Result<(), WriteError> {
        let part = table.part(index);
        let mut rows = layout.rows(bytes, part.bytes.start);
        for normal in normals.since_row(part.first_row).take(part.n_rows) {
            let Some(spans) = rows.next_row().map_err(Stop::from)? else {
                break;
            };
            for (axis, (value_type, span)) in table.types.iter().zip(&spans).take(3).enumerate() {
                if axis > 0 {
                    out.push(style.separator());
                }
                match value_type {
                    ValueType::Text => out.extend_from_slice(span.of(bytes)),
                    ValueType::LittleEndian(scalar) | ValueType::BigEndian(scalar) => {
                        let value = value_type.read(span.of(bytes)).unwrap_or(f64::NAN);
                        push_number(value, *scalar == Scalar::Float, out);
                    }
                }
            }
            push_normal(normal.unwrap_or(NO_NORMAL), style.separator(), out);
            out.push(b'\n');
        }
        Ok(())
    };
    for_each_part(table.n_parts(), progress, make, write)
}

/// Appends a normal in text, with `separator` before each component.
pub(crate) fn push_normal(normal: Vec3, separator: u8, out: &mut Vec<u8>) {
    for value in normal.to_array() {
        out.push(separator);
        ValueType::Text.write(value, out);
    }
}
