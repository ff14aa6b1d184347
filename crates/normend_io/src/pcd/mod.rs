//! Point Cloud Data (PCD), in and out: ascii, binary, and packed (`binary_compressed`), versions .5 to .7.
//!
//! Of `pcd_rs` come the grammar of the header and its types. Rows are not read by it, because its records lose comments, unknown
//! entries and the bytes of numbers, which all come out again as they went in; what is packed is unpacked to rows once.
//!
//! The viewpoint is taken for the place of the scanner in the coordinates of the points, as PCL's normal estimation does
//! (`pcl::NormalEstimation` turns normals toward `sensor_origin_`) and CloudCompare, and the points are where they are. PCL's
//! viewer moves the points by it instead; a file that was meant so shows the same cloud, elsewhere.

mod header;
mod lzf;
mod rows;

pub(crate) mod new;

#[cfg(test)]
mod tests;

use std::io::{Cursor, SeekFrom};

use normend_core::progress::Part;
use normend_core::{PointCloud, PointCloudError, Progress};
use pcd_rs::DataKind;

use self::header::Header;
pub(crate) use self::header::sniff;
use self::rows::{TextRows, Transposed, line_of, next_word};
use crate::columns::{Column, ColumnKind};
use crate::error::{Broken, Place, Stop, WriteError};
use crate::output::Output;
use crate::records::{NORMAL_NAMES, RecordField, Records, fields_by_name};
use crate::rewrite::rewrite;
use crate::table::{
    Frame, Layout, N_VALUES, NORMAL, NewContent, Rows, SIDE, Span, Starts, VALUE_NAMES, find_parts, for_each_part,
};
use crate::value::{Scalar, ValueType};

/// What PCL calls a normal's components.
const PCL_NORMAL: [&str; 3] = ["normal_x", "normal_y", "normal_z"];
/// Names of colors in a number of 32 bits.
const PACKED_COLORS: [&str; 2] = ["rgb", "rgba"];
/// The bytes of such a number, from the lowest on.
const CHANNELS: [&str; 4] = ["blue", "green", "red", "alpha"];
/// How many times smaller than its rows a packed file may be, besides some bytes that any may have. LZF packs up to 88 times, but
/// that takes coordinates that hardly differ; a grid of which nine in ten cells are empty comes to 12.
const MOST_REPEATED: usize = 32;
const LEAST_ALLOWED: usize = 8 << 20;
/// Bytes of columns that are packed together.
const PIECE: usize = 1 << 20;

/// A PCD file whose parts are known.
#[derive(Clone, Debug)]
pub(crate) struct PcdLayout {
    header: Header,
    /// The numbers of a row. In text, the offset of each is which word of the line it is, and the stride the number of words.
    records: Records,
    /// What each of these numbers is, and the field of the header that it belongs to.
    numbers: Vec<(ColumnKind, usize)>,
    /// Whether rows hold the fields that only fill space.
    has_padding: bool,
}

/// A PCD file whose rows can be found.
pub(crate) struct Pcd {
    pub layout: PcdLayout,
    /// What a packed file becomes: the header, rows one after the other, and what comes after them.
    pub unpacked: Option<Vec<u8>>,
}

/// Finds out where everything is in a PCD file, and refuses broken ones. A packed one is unpacked: that takes its rows' size.
pub(crate) fn read(bytes: &[u8], progress: &dyn Progress) -> Result<Pcd, Stop> {
    let header = header::parse(bytes)?;
    let n_rows = header.n_points;
    if n_rows == 0 {
        return Err(Broken::whole("the file has no points: open one that has").into());
    }
    if n_rows > PointCloud::MAX_POINTS {
        return Err(Broken::whole(PointCloudError::TooMany { n_points: n_rows }.to_string()).into());
    }
    match header.data {
        DataKind::Ascii => read_text(bytes, header, progress),
        DataKind::Binary => {
            let layout = PcdLayout::new(header, true)?;
            let n_left = bytes.len() - layout.header.end;
            if layout.records.stride * n_rows > n_left {
                return Err(layout.too_short(n_left).into());
            }
            Ok(Pcd { layout, unpacked: None })
        }
        DataKind::BinaryCompressed => unpack(bytes, header, progress),
    }
}

fn read_text(bytes: &[u8], header: Header, progress: &dyn Progress) -> Result<Pcd, Stop> {
    // PCL writes no words for fields that only fill space, and expects none.
    let mut layout = PcdLayout::new(header, false)?;
    let n_rows = layout.header.n_points;
    let n_left = bytes.len() - layout.header.end;
    // Each value has a digit at least and what separates it from the next, but for the last of the file.
    if 2 * layout.records.stride * n_rows > n_left + 1 {
        return Err(layout.too_short(n_left).into());
    }
    let mut rows = layout.rows(bytes, layout.header.end);
    let (starts, n_found, end) = find_parts(rows.as_mut(), n_rows, bytes.len(), progress)?;
    if n_found < n_rows {
        return Err(layout.too_short(n_left).into());
    }
    // Points that nothing is said of would be lost without a word.
    if let Some(more) = next_word(bytes, end) {
        return Err(Broken::new(
            line_of(bytes, more),
            format!(
                "{n_rows} points are announced, but more lines follow: correct POINTS and WIDTH, or remove the lines"
            ),
        )
        .into());
    }
    drop(rows);
    layout.records.table.starts = Starts::Parts(starts);
    layout.records.table.end = end;
    Ok(Pcd { layout, unpacked: None })
}

fn unpack(bytes: &[u8], header: Header, progress: &dyn Progress) -> Result<Pcd, Stop> {
    let (head, n_rows) = (header.end, header.n_points);
    let size = |at: usize| {
        let bytes = bytes.get(head + at..head + at + 4)?.try_into().ok()?;
        Some(u32::from_le_bytes(bytes) as usize)
    };
    let first = head + 8;
    let sizes = size(0)
        .zip(size(4))
        .filter(|(n_packed, _)| *n_packed <= bytes.len() - first);
    let Some((n_packed, n_unpacked)) = sizes else {
        return Err(Broken::new(
            Place::Byte(head),
            "the packed points do not fit into the file: it is cut off, copy or export it again",
        )
        .into());
    };
    // PCL packs no fields that only fill space, others do; the size tells.
    let layouts = [PcdLayout::new(header.clone(), true)?, PcdLayout::new(header, false)?];
    let fits = |layout: &PcdLayout| layout.records.stride * n_rows == n_unpacked;
    let Some(layout) = layouts.into_iter().find(fits) else {
        return Err(Broken::new(
            Place::Byte(head + 4),
            format!(
                "{n_rows} points do not have the {n_unpacked} bytes that are said to be packed: export the file again"
            ),
        )
        .into());
    };
    let packed = &bytes[first..first + n_packed];
    // Nothing is allocated before it is known to be there.
    if lzf::unpacked_size(packed, first)? != n_unpacked {
        return Err(Broken::new(
            Place::Byte(head + 4),
            "the packed points are not as many as announced: the file is damaged, copy or export it again",
        )
        .into());
    }
    if n_unpacked > MOST_REPEATED * n_packed + LEAST_ALLOWED {
        return Err(Broken::new(
            Place::Byte(head + 4),
            format!(
                "the packed points unpack to more than {MOST_REPEATED} times their size, as those of no scan do: export the file \
                 as binary"
            ),
        )
        .into());
    }
    let after = &bytes[first + n_packed..];
    let n_bytes = head + n_unpacked + after.len();
    let mut unpacked = Vec::new();
    if unpacked.try_reserve_exact(n_bytes).is_err() {
        return Err(Broken::whole("the points do not fit into memory: split the scan").into());
    }
    unpacked.extend_from_slice(&bytes[..head]);
    unpacked.resize(head + n_unpacked, 0);
    let columns = layout.transposed(&[]);
    let mut done = 0;
    lzf::unpack(packed, first, |piece| {
        progress.report(done as f32 / n_unpacked as f32)?;
        let mut rest = piece;
        let range = Span {
            start: done,
            end: done + piece.len(),
        };
        columns.for_each_run(range, |at, length| {
            let (run, after) = rest.split_at(length);
            unpacked[head + at..head + at + length].copy_from_slice(run);
            rest = after;
        });
        done += piece.len();
        Ok(())
    })?;
    unpacked.extend_from_slice(after);
    Ok(Pcd {
        layout,
        unpacked: Some(unpacked),
    })
}

impl PcdLayout {
    /// The rows that a header announces, without having looked at them.
    fn new(header: Header, has_padding: bool) -> Result<Self, Broken> {
        let is_text = header.data == DataKind::Ascii;
        let has_color = header.fields.iter().any(|field| {
            let names = ["red", "green", "blue", "r", "g", "b"];
            names.iter().any(|name| field.name.eq_ignore_ascii_case(name))
        });
        let mut fields = Vec::new();
        let mut numbers = Vec::new();
        let mut offset = 0;
        for (index, field) in header.fields.iter().enumerate() {
            if field.is_padding() {
                offset += if has_padding { field.size() } else { 0 };
                continue;
            }
            let step = if is_text { 1 } else { field.scalar.size() };
            let is_color = !has_color
                && (field.count, field.scalar.size()) == (1, 4)
                && PACKED_COLORS.iter().any(|name| field.name.eq_ignore_ascii_case(name));
            if is_color {
                // Its bytes are values of their own; the highest is a color's opacity only where the name says so.
                for byte in (0..field.name.len()).rev() {
                    let value_type = if is_text {
                        ValueType::TextByte {
                            shift: 8 * byte as u8,
                            is_float: field.scalar.is_float(),
                        }
                    } else {
                        ValueType::LittleEndian(Scalar::UChar)
                    };
                    fields.push(RecordField {
                        name: CHANNELS[byte].to_owned(),
                        offset: if is_text { offset } else { offset + byte },
                        value_type,
                    });
                    numbers.push((ColumnKind::Number(Scalar::UChar), index));
                }
            } else {
                for item in 0..field.count {
                    let name = match field.count {
                        1 => field.name.clone(),
                        _ => format!("{}_{item}", field.name),
                    };
                    fields.push(RecordField {
                        name,
                        offset: offset + item * step,
                        value_type: if is_text {
                            ValueType::Text
                        } else {
                            ValueType::LittleEndian(field.scalar)
                        },
                    });
                    numbers.push((ColumnKind::Number(field.scalar), index));
                }
            }
            offset += step * field.count;
        }
        let chosen = chosen_fields(&header, &fields)?;
        let (first, n_rows) = (header.end, header.n_points);
        let mut records = Records::new(fields, chosen, first, offset, n_rows);
        if let Some(station) = header.station {
            records.table.frames.push(Frame {
                station: Some(station),
                ..Frame::plain(0)
            });
        }
        Ok(Self {
            header,
            records,
            numbers,
            has_padding,
        })
    }

    fn is_text(&self) -> bool {
        self.header.data == DataKind::Ascii
    }

    fn too_short(&self, n_left: usize) -> Broken {
        Broken::whole(format!(
            "{} points do not fit into the {n_left} bytes after the header: the file is cut off or POINTS is wrong, export it again",
            self.header.n_points
        ))
    }

    /// How rows are packed, the fields of `added` (after which field, and their sizes) in them.
    fn transposed(&self, edits: &[(usize, Edit)]) -> Transposed {
        let mut sizes = Vec::new();
        for (index, field) in self.header.fields.iter().enumerate() {
            let mut size = if field.is_padding() && !self.has_padding {
                0
            } else {
                field.size()
            };
            let edits = edits.iter().filter(|(field, _)| *field == index);
            let mut added = Vec::new();
            for (_, edit) in edits {
                match edit {
                    Edit::Retyped => size = Scalar::Float.size(),
                    Edit::Added(_, scalar) => added.push(scalar.size()),
                }
            }
            sizes.push(size);
            sizes.extend(added);
        }
        sizes.retain(|&size| size > 0);
        Transposed::new(sizes, self.header.n_points)
    }

    /// What becomes of the fields when normals, and `with_side` confidence, are written.
    fn edits(&self, with_side: bool) -> Vec<(usize, Edit)> {
        let field_of = |slot: usize| Some(self.numbers[self.records.column_of(slot)?].1);
        let anchor = field_of(self.records.table.anchor()).unwrap_or(0);
        let written = if with_side { NORMAL.start..SIDE.end } else { NORMAL };
        let edit = |slot: usize| {
            let is_flag = slot + 1 == SIDE.end;
            match field_of(slot) {
                Some(field) if self.header.fields[field].scalar.is_float() || is_flag => None,
                // No whole number holds a component of a unit vector.
                Some(field) => Some((field, Edit::Retyped)),
                None => {
                    let name = if NORMAL.contains(&slot) {
                        PCL_NORMAL[slot - NORMAL.start]
                    } else {
                        VALUE_NAMES[slot]
                    };
                    let scalar = if is_flag { Scalar::UChar } else { Scalar::Float };
                    Some((anchor, Edit::Added(name, scalar)))
                }
            }
        };
        written.filter_map(edit).collect()
    }
}

/// What becomes of a field of the header.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Edit {
    /// It becomes a `float`.
    Retyped,
    /// Another comes after it.
    Added(&'static str, Scalar),
}

/// The fields of coordinates, normal, confidence and its flag.
fn chosen_fields(header: &Header, fields: &[RecordField]) -> Result<[Option<usize>; N_VALUES], Broken> {
    let is_normal = |name: &str| {
        let names = NORMAL_NAMES.iter().flat_map(|names| names.iter());
        names.into_iter().any(|normal| normal.eq_ignore_ascii_case(name))
    };
    let is_value = |name: &str| is_normal(name) || VALUE_NAMES.iter().any(|value| value.eq_ignore_ascii_case(name));
    if let Some(field) = header
        .fields
        .iter()
        .find(|field| field.count > 1 && is_value(&field.name))
    {
        return Err(Broken::whole(format!(
            "COUNT of \"{}\" is {}, but it is one number: correct the header",
            field.name, field.count
        )));
    }
    let Some(chosen) = fields_by_name(fields) else {
        return Err(Broken::whole(
            "FIELDS does not name x, y and z: export the file with them",
        ));
    };
    if chosen[NORMAL].contains(&None)
        && let Some(part) = header.fields.iter().find(|field| is_normal(&field.name))
    {
        return Err(Broken::whole(format!(
            "FIELDS names \"{}\", but not all of {}: add or remove them",
            part.name,
            PCL_NORMAL.join(", ")
        )));
    }
    Ok(chosen)
}

impl Layout for PcdLayout {
    fn table(&self) -> &crate::table::Table {
        &self.records.table
    }

    fn rows<'a>(&'a self, bytes: &'a [u8], start: usize) -> Box<dyn Rows + 'a> {
        if self.is_text() {
            let words = std::array::from_fn(|slot| Some(self.records.fields[self.records.column_of(slot)?].offset));
            return Box::new(TextRows::new(bytes, words, self.records.stride, start));
        }
        self.records.rows(start)
    }

    fn place(&self, bytes: &[u8], byte: usize) -> Place {
        match self.header.data {
            DataKind::Ascii => line_of(bytes, byte),
            DataKind::Binary => Place::Byte(byte),
            DataKind::BinaryCompressed => Place::Whole,
        }
    }

    fn columns(&self, _bytes: &[u8]) -> Vec<Column> {
        let mut columns = self.records.columns();
        for (column, (kind, _)) in columns.iter_mut().zip(&self.numbers) {
            column.kind = *kind;
        }
        columns
    }

    fn column_of(&self, slot: usize) -> Option<usize> {
        self.records.column_of(slot)
    }

    fn with_columns(&self, columns: &[usize]) -> (Box<dyn Layout>, Vec<usize>) {
        let (records, slots) = self.records.with_columns(columns);
        let layout = Self {
            records,
            ..self.clone()
        };
        (Box::new(layout), slots)
    }

    fn besides_rows(&self, _bytes: &[u8]) -> Vec<String> {
        let Header { width, height, .. } = self.header;
        match height {
            0 | 1 => Vec::new(),
            _ => vec![format!("the order of the points in a grid of {width} x {height}")],
        }
    }

    fn can_hold_side(&self) -> bool {
        true
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        content: &NewContent<'_>,
        out: &mut Output<'_>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        let fields = self.edits(content.normals.has_confidence());
        let edits = self.header.edits(content.comment, &fields);
        if self.header.data != DataKind::BinaryCompressed {
            return rewrite(self, bytes, &edits, content.normals, out, progress);
        }
        let columns = self.transposed(&fields);
        let path = out.path;
        let as_size = |n_bytes: usize| {
            u32::try_from(n_bytes).map_err(|_| WriteError::Target {
                path: path.to_owned(),
                reason: "would hold more than the 4 GiB of points that a packed PCD file can: write .ply instead",
            })
        };
        let n_unpacked = as_size(columns.n_bytes())?;
        let mut plain = Cursor::new(Vec::new());
        let mut rows = Output { path, file: &mut plain };
        rewrite(
            self,
            bytes,
            &edits,
            content.normals,
            &mut rows,
            &Part::new(progress, 0.0..0.4),
        )?;
        let plain = plain.into_inner();
        let n_after = bytes.len() - self.records.table.end;
        let (rows, after) = plain.split_at(plain.len() - n_after);
        let (head, rows) = rows.split_at(rows.len() - columns.n_bytes());
        out.write(head)?;
        let sizes_at = out.file.stream_position().map_err(WriteError::io(path))?;
        // Its first half is known once all is packed.
        out.write(&[[0; 4], n_unpacked.to_le_bytes()].concat())?;
        let mut n_packed = 0;
        for_each_part(
            columns.n_bytes().div_ceil(PIECE),
            &Part::new(progress, 0.4..1.0),
            |index, packed| -> Result<(), WriteError> {
                let range = Span {
                    start: index * PIECE,
                    end: ((index + 1) * PIECE).min(columns.n_bytes()),
                };
                let mut piece = Vec::with_capacity(PIECE);
                columns.for_each_run(range, |at, length| piece.extend_from_slice(&rows[at..at + length]));
                lzf::pack(&piece, packed);
                Ok(())
            },
            |part| {
                n_packed += part.len();
                out.write(part)
            },
        )?;
        let n_packed = as_size(n_packed)?;
        out.write(after)?;
        let end = out.file.stream_position().map_err(WriteError::io(path))?;
        out.file.seek(SeekFrom::Start(sizes_at)).map_err(WriteError::io(path))?;
        out.write(&n_packed.to_le_bytes())?;
        out.file.seek(SeekFrom::Start(end)).map_err(WriteError::io(path))?;
        Ok(())
    }
}
