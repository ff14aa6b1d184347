//! LAS and LAZ, versions 1.0 to 1.4, point formats 0 to 10.
//!
//! Rows are the point records as they are; x, y and z stay whole numbers, of which the header's scale makes coordinates. A
//! packed file (LAZ) is unpacked at reading, so that both kinds are the same afterwards: what stands before the points, the
//! points, what stands after them. Writing copies all three and changes the normals, which are extra bytes.

mod dimensions;
mod head;
mod laz;
mod rewrite;

pub(crate) mod new;

#[cfg(test)]
mod tests;

use normend_core::Progress;

use self::dimensions::{EXTRA_BYTES, ExtraBytes, extra_bytes, standard_fields};
use self::head::{Head, standard_size};
pub(crate) use self::head::{is_packed, sniff};
use self::laz::{PACKING, Packing, unpack};
use crate::columns::Column;
use crate::error::{Broken, Place, Stop, WriteError};
use crate::new_file::Loss;
use crate::output::Output;
use crate::records::Records;
use crate::table::{Layout, NewContent, Rows, Table};
use crate::value::Scale;

/// The records of an index of packed chunks (COPC), which do not fit chunks that are packed anew.
const INDEX: &str = "copc";
/// The record that says how the normals were oriented: of this user, with this number.
const COMMENT: (&str, u16) = ("Normend", 1);

/// A LAS file whose parts are known, unpacked.
#[derive(Clone, Debug)]
pub(crate) struct LasLayout {
    head: Head,
    extra: ExtraBytes,
    /// Fields before those of extra bytes.
    n_standard: usize,
    records: Records,
    /// How it was packed, if it was.
    packing: Option<Packing>,
    /// The byte of the original file that is the first after the points here.
    rest_in_file: usize,
}

/// Finds the parts of a LAS or LAZ file. Returns the bytes to be kept: of a LAZ file, those unpacked.
pub(crate) fn read(bytes: Vec<u8>, progress: &dyn Progress) -> Result<(Vec<u8>, LasLayout), Stop> {
    let mut head = head::parse(&bytes)?;
    let rest_in_file = head.rest_at;
    let mut descriptions = Vec::new();
    for record in head
        .records
        .iter()
        .filter(|record| record.is(EXTRA_BYTES.0, EXTRA_BYTES.1))
    {
        dimensions::check_descriptions(record.span.start, record.data.end - record.data.start)?;
        descriptions.extend_from_slice(record.data.of(&bytes));
    }
    let standard = standard_size(head.format).unwrap_or(head.stride);
    let extra = extra_bytes(descriptions, standard, head.stride - standard)?;
    let (bytes, packing) = if head.is_packed {
        let (image, packing) = unpack(&bytes, &head, progress)?;
        head.rest_at = head.points_at + head.n_points * head.stride;
        for record in head.records.iter_mut().filter(|record| record.is_extended) {
            for span in [&mut record.span, &mut record.data] {
                span.start = span.start - rest_in_file + head.rest_at;
                span.end = span.end - rest_in_file + head.rest_at;
            }
        }
        (image, Some(packing))
    } else {
        (bytes, None)
    };
    let header = &head.header;
    let scales = [
        Scale::new(header.x_scale_factor, header.x_offset),
        Scale::new(header.y_scale_factor, header.y_offset),
        Scale::new(header.z_scale_factor, header.z_offset),
    ];
    let mut fields = standard_fields(head.format, scales);
    let n_standard = fields.len();
    fields.extend(extra.fields.iter().cloned());
    let chosen = dimensions::chosen(&fields, n_standard);
    let records = Records::new(fields, chosen, head.points_at, head.stride, head.n_points);
    let layout = LasLayout {
        head,
        extra,
        n_standard,
        records,
        packing,
        rest_in_file,
    };
    Ok((bytes, layout))
}

impl LasLayout {
    /// Whether the chunks have an index, which is lost when they are packed anew.
    fn has_index(&self) -> bool {
        self.head.records.iter().any(|record| record.user_id == INDEX)
    }
}

impl Layout for LasLayout {
    fn table(&self) -> &Table {
        &self.records.table
    }

    fn rows<'a>(&'a self, _bytes: &'a [u8], start: usize) -> Box<dyn Rows + 'a> {
        self.records.rows(start)
    }

    fn place(&self, _bytes: &[u8], byte: usize) -> Place {
        Place::Byte(byte)
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
            ..self.clone()
        };
        (Box::new(layout), slots)
    }

    fn besides_rows(&self, _bytes: &[u8]) -> Vec<String> {
        let mut besides = vec!["the header's date, identifiers and encoding".to_owned()];
        let own = [PACKING, EXTRA_BYTES, COMMENT];
        let is_own = |user_id: &str, record_id: u16| user_id == INDEX || own.contains(&(user_id, record_id));
        for record in &self.head.records {
            if !is_own(&record.user_id, record.record_id) {
                besides.push(format!(
                    "the record {} of \"{}\"",
                    record.record_id,
                    record.user_id.escape_debug()
                ));
            }
        }
        if self.extra.n_unnamed > 0 {
            besides.push(format!(
                "{} bytes of each point that have no name",
                self.extra.n_unnamed
            ));
        }
        besides
    }

    fn can_hold_side(&self) -> bool {
        true
    }

    fn remarks(&self) -> Vec<Loss> {
        if !self.has_index() {
            return Vec::new();
        }
        vec![Loss {
            what: "the index of the chunks (COPC)".into(),
            why: "points with normals are packed anew, into chunks at other places; build it again from the new file"
                .into(),
        }]
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        content: &NewContent<'_>,
        out: &mut Output<'_>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        rewrite::rewrite(self, bytes, Some(content), out, progress)
    }

    fn copy(&self, bytes: &[u8], out: &mut Output<'_>, progress: &dyn Progress) -> Option<Result<(), WriteError>> {
        Some(rewrite::rewrite(self, bytes, None, out, progress))
    }
}

/// Whether a file of this name has packed points; `None` when the name does not say.
fn is_packed_name(path: &std::path::Path) -> Option<bool> {
    let extension = path.extension()?;
    if extension.eq_ignore_ascii_case("laz") {
        Some(true)
    } else if extension.eq_ignore_ascii_case("las") {
        Some(false)
    } else {
        None
    }
}

/// That a number does not fit into the fields of the format.
fn too_large(what: &str) -> WriteError {
    WriteError::Source(Broken::whole(format!(
        "{what}, more than LAS can hold: write another format"
    )))
}
