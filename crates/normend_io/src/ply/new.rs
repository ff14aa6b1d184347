//! Points in a new PLY file: binary little-endian, each value by its name.

use normend_core::Progress;

use crate::columns::ColumnKind;
use crate::error::WriteError;
use crate::new_file::{Field, Loss, NewFile, plain_names};
use crate::output::Output;
use crate::rewrite::write_side;
use crate::table::{NORMAL, SIDE, VALUE_NAMES};
use crate::value::{Scalar, ValueType};

/// Drops what PLY cannot hold.
pub(crate) fn limit(file: &mut NewFile<'_>) -> Vec<Loss> {
    file.drop_fields(|field| (field.kind == ColumnKind::Words).then(|| "PLY holds numbers, not words".into()))
}

/// Writes the file.
pub(crate) fn write(file: &mut NewFile<'_>, out: &mut Output<'_>, progress: &dyn Progress) -> Result<(), WriteError> {
    file.narrow(&normend_core::progress::Part::new(progress, 0.0..0.4))?;
    let scalars: Vec<Scalar> = file.fields.iter().map(scalar).collect();
    out.write(header(file, &scalars).as_bytes())?;
    file.write_rows(
        |row, out| {
            row.push_binary_coordinates(file.coordinates, out);
            for component in row.normal.iter().flat_map(glam::Vec3::to_array) {
                ValueType::LittleEndian(Scalar::Float).write(component, out);
            }
            if let Some(confidence) = row.confidence {
                write_side(SIDE.start, confidence, ValueType::LittleEndian(Scalar::Float), out);
                write_side(SIDE.start + 1, confidence, ValueType::LittleEndian(Scalar::UChar), out);
            }
            for (cell, &scalar) in row.cells.iter().zip(&scalars) {
                cell.push_binary(scalar, out);
            }
        },
        out,
        &normend_core::progress::Part::new(progress, 0.4..1.0),
    )
}

/// The type of a field in a PLY file, which has no whole numbers of 64 bits.
fn scalar(field: &Field) -> Scalar {
    match field.kind {
        ColumnKind::Number(Scalar::Long | Scalar::ULong) | ColumnKind::Decimal | ColumnKind::Words => Scalar::Double,
        ColumnKind::Number(scalar) => scalar,
    }
}

fn header(file: &NewFile<'_>, scalars: &[Scalar]) -> String {
    let mut lines = vec!["ply".to_owned(), "format binary_little_endian 1.0".to_owned()];
    lines.extend(file.comment.map(|comment| format!("comment {comment}")));
    lines.push(format!("element vertex {}", file.n_rows));
    let mut property = |scalar: Scalar, name: &str| lines.push(format!("property {} {name}", type_name(scalar)));
    for name in &VALUE_NAMES[..3] {
        property(file.coordinates, name);
    }
    if file.normals.is_some() {
        NORMAL.for_each(|slot| property(Scalar::Float, VALUE_NAMES[slot]));
    }
    if file.has_confidence() {
        property(Scalar::Float, VALUE_NAMES[SIDE.start]);
        property(Scalar::UChar, VALUE_NAMES[SIDE.start + 1]);
    }
    let names = plain_names(&file.fields, &VALUE_NAMES);
    for (name, &scalar) in names.iter().zip(scalars) {
        property(scalar, name);
    }
    lines.push("end_header\n".to_owned());
    lines.join("\n")
}

fn type_name(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::Char => "char",
        Scalar::UChar => "uchar",
        Scalar::Short => "short",
        Scalar::UShort => "ushort",
        Scalar::Int => "int",
        Scalar::UInt => "uint",
        Scalar::Float => "float",
        Scalar::Long | Scalar::ULong | Scalar::Double => "double",
    }
}
