//! Rows of one size made of named binary numbers, for the formats whose rows are that.

use crate::columns::{Column, ColumnKind, slots_for};
use crate::table::{COORDINATES, FixedRows, N_VALUES, NORMAL, Rows, SIDE, Span, Spans, Starts, Table, VALUE_NAMES};
use crate::value::{Scalar, ValueType};

/// A named number of a row.
#[derive(Clone, Debug)]
pub(crate) struct RecordField {
    pub name: String,
    /// Its first byte within the row.
    pub offset: usize,
    pub value_type: ValueType,
}

/// Rows of one size.
#[derive(Clone, Debug)]
pub(crate) struct Records {
    pub fields: Vec<RecordField>,
    pub stride: usize,
    /// The field of each value, by slot.
    chosen: [Option<usize>; N_VALUES],
    pub table: Table,
}

impl Records {
    /// `n_rows` rows of `stride` bytes from byte `first` on, the values taken from the fields `chosen`, by slot: all of the
    /// coordinates, all or none of the normal. The caller has checked that they are within the file.
    pub fn new(
        fields: Vec<RecordField>,
        chosen: [Option<usize>; N_VALUES],
        first: usize,
        stride: usize,
        n_rows: usize,
    ) -> Self {
        let types = types(&fields, &chosen);
        let mut order: Vec<usize> = (0..N_VALUES).filter(|&slot| chosen[slot].is_some()).collect();
        order.sort_unstable_by_key(|&slot| chosen[slot].map(|field| fields[field].offset));
        let table = Table {
            n_rows,
            types,
            has_normals: chosen[NORMAL].iter().all(Option::is_some),
            order,
            starts: Starts::Stride { first, stride },
            end: first + stride * n_rows,
            frames: Vec::new(),
        };
        Self {
            fields,
            stride,
            chosen,
            table,
        }
    }

    /// The rows from byte `start` on.
    pub fn rows(&self, start: usize) -> Box<dyn Rows> {
        Box::new(FixedRows::new(start, self.stride, self.offsets()))
    }

    /// The bytes of each value within a row.
    pub fn offsets(&self) -> Spans {
        self.chosen.map(|field| {
            let span = |field: usize| {
                let field = &self.fields[field];
                Span {
                    start: field.offset,
                    end: field.offset + field.value_type.size(),
                }
            };
            field.map_or(Span::default(), span)
        })
    }

    /// The fields as columns.
    pub fn columns(&self) -> Vec<Column> {
        let column = |(index, field): (usize, &RecordField)| Column {
            name: field.name.clone(),
            index,
            kind: field.value_type.scalar().map_or(ColumnKind::Words, ColumnKind::Number),
        };
        self.fields.iter().enumerate().map(column).collect()
    }

    /// The field that holds the value of a slot.
    pub fn column_of(&self, slot: usize) -> Option<usize> {
        self.chosen[slot]
    }

    /// The same rows with other values: the coordinates, and the fields `columns`. Returns the slots of these.
    pub fn with_columns(&self, columns: &[usize]) -> (Self, Vec<usize>) {
        let (chosen, slots) = slots_for(&self.chosen[COORDINATES], columns);
        let mut records = self.clone();
        records.table.types = types(&records.fields, &chosen);
        records.chosen = chosen;
        (records, slots)
    }
}

/// The types of the values; what is not there is written as `float`, a flag as a byte.
fn types(fields: &[RecordField], chosen: &[Option<usize>; N_VALUES]) -> [ValueType; N_VALUES] {
    std::array::from_fn(|slot| match chosen[slot] {
        Some(field) => fields[field].value_type,
        None if slot == SIDE.end - 1 => ValueType::LittleEndian(Scalar::UChar),
        None => ValueType::LittleEndian(Scalar::Float),
    })
}

/// The fields of coordinates, normals, confidence and its flag by their usual names, in any case of letters; `None` without
/// x, y and z.
pub(crate) fn fields_by_name(fields: &[RecordField]) -> Option<[Option<usize>; N_VALUES]> {
    let find = |wanted: &[&str]| {
        let is_wanted = |field: &RecordField| wanted.iter().any(|name| field.name.eq_ignore_ascii_case(name));
        fields.iter().position(is_wanted)
    };
    let mut chosen = [None; N_VALUES];
    for slot in COORDINATES {
        chosen[slot] = Some(find(&[VALUE_NAMES[slot]])?);
    }
    let normal = NORMAL_NAMES.map(find);
    if normal.iter().all(Option::is_some) {
        chosen[NORMAL].copy_from_slice(&normal);
    }
    for slot in SIDE {
        chosen[slot] = find(&[VALUE_NAMES[slot]]);
    }
    Some(chosen)
}

/// Names of a normal's components, in lower case.
pub(crate) const NORMAL_NAMES: [&[&str]; 3] = [
    &["nx", "normal_x", "normalx"],
    &["ny", "normal_y", "normaly"],
    &["nz", "normal_z", "normalz"],
];
