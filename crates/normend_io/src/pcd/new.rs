//! Points in a new PCD file: binary, version .7, with the names that PCL gives things.

use glam::DVec3;
use normend_core::Progress;
use normend_core::progress::Part;

use super::header::type_and_size;
use super::{CHANNELS, PCL_NORMAL};
use crate::columns::{ColumnKind, color_byte, colors_among};
use crate::error::WriteError;
use crate::new_file::{Field, Loss, NewFile, plain_names};
use crate::output::Output;
use crate::rewrite::write_side;
use crate::table::{COORDINATES, NORMAL, SIDE, VALUE_NAMES};
use crate::value::{Scalar, ValueType};

/// Drops what PCD cannot hold.
pub(crate) fn limit(file: &mut NewFile<'_>) -> Vec<Loss> {
    let mut losses = file.drop_fields(|field| {
        let is_text = field.kind == ColumnKind::Words;
        is_text.then(|| "PCD holds numbers only".to_owned())
    });
    if let Some(colors) = colors_of(file)
        && colors
            .iter()
            .any(|&field| !is_byte(&file.fields[field]) && file.fields[field].kind != ColumnKind::Decimal)
    {
        let names = colors.map(|field| file.fields[field].name.as_str());
        losses.push(Loss {
            what: format!("\"{}\", \"{}\" and \"{}\" beyond 8 bits", names[0], names[1], names[2]),
            why: "PCD packs a color in 8 bits each".to_owned(),
        });
    }
    let n_stations = file.frames().iter().filter(|frame| frame.station.is_some()).count();
    if n_stations > 1 {
        losses.push(Loss {
            what: format!("the places of {n_stations} scanners"),
            why: "PCD holds one viewpoint for all points".to_owned(),
        });
    }
    losses
}

fn is_byte(field: &Field) -> bool {
    field.kind == ColumnKind::Number(Scalar::UChar)
}

fn colors_of(file: &NewFile<'_>) -> Option<[usize; 3]> {
    colors_among(file.fields.iter().map(|field| field.name.as_str()))
}

/// What the fields of the file are, besides coordinates, normal and confidence.
struct Plan {
    /// The fields that are packed into one number, from blue to red and perhaps opacity, and what white is in them.
    packed: Vec<usize>,
    white: f64,
    /// The others, with their types and names.
    others: Vec<(usize, Scalar, String)>,
}

/// Writes the file.
pub(crate) fn write(file: &mut NewFile<'_>, out: &mut Output<'_>, progress: &dyn Progress) -> Result<(), WriteError> {
    let is_decimal = |&field: &usize| file.fields[field].kind == ColumnKind::Decimal;
    // Nothing was said to be lost of colors in text.
    let may_round = colors_of(file).is_some_and(|colors| !colors.iter().any(is_decimal));
    file.narrow(&Part::new(progress, 0.0..0.3))?;
    // PCL reads `float` only, other programs floats of both sizes; whole numbers are neither.
    let coordinates = match file.coordinates {
        Scalar::Char | Scalar::UChar | Scalar::Short | Scalar::UShort | Scalar::Float => Scalar::Float,
        Scalar::Int | Scalar::UInt | Scalar::Long | Scalar::ULong | Scalar::Double => Scalar::Double,
    };
    let plan = plan(file, may_round, &Part::new(progress, 0.3..0.5))?;
    out.write(head(file, coordinates, &plan).as_bytes())?;
    file.write_rows(
        |row, out| {
            row.push_binary_coordinates(coordinates, out);
            for component in row.normal.iter().flat_map(glam::Vec3::to_array) {
                ValueType::LittleEndian(Scalar::Float).write(component, out);
            }
            if let Some(confidence) = row.confidence {
                write_side(SIDE.start, confidence, ValueType::LittleEndian(Scalar::Float), out);
                write_side(SIDE.start + 1, confidence, ValueType::LittleEndian(Scalar::UChar), out);
            }
            if !plan.packed.is_empty() {
                let mut bytes = [0; 4];
                for (byte, &field) in bytes.iter_mut().zip(&plan.packed) {
                    *byte = color_byte(row.cells[field].number(), plan.white);
                }
                out.extend(bytes);
            }
            for (field, scalar, _) in &plan.others {
                row.cells[*field].push_binary(*scalar, out);
            }
        },
        out,
        &Part::new(progress, 0.5..1.0),
    )
}

fn plan(file: &NewFile<'_>, may_round: bool, progress: &dyn Progress) -> Result<Plan, WriteError> {
    let mut packed = Vec::new();
    let mut white = 255.0;
    if let Some([red, green, blue]) = colors_of(file) {
        let scale = file.color_scale([red, green, blue], progress)?;
        white = scale.white;
        if scale.is_exact || may_round {
            packed = vec![blue, green, red];
            let alpha = file
                .fields
                .iter()
                .position(|field| field.name.eq_ignore_ascii_case(CHANNELS[3]) && is_byte(field));
            packed.extend(alpha.filter(|_| white == 255.0));
        }
    }
    let is_other = |field: &usize| !packed.contains(field);
    let others: Vec<usize> = (0..file.fields.len()).filter(is_other).collect();
    let fields: Vec<Field> = others.iter().map(|&field| renamed(&file.fields[field])).collect();
    let n_taken = if file.has_confidence() { SIDE.end } else { SIDE.start };
    let taken = [&VALUE_NAMES[..n_taken], &PCL_NORMAL, &["rgb", "rgba", "_"]].concat();
    let names = plain_names(&fields, &taken);
    let others = others.into_iter().zip(fields).zip(names);
    Ok(Plan {
        packed,
        white,
        others: others
            .map(|((index, field), name)| (index, scalar(&field), name))
            .collect(),
    })
}

/// A field under the name by which PCL finds it.
fn renamed(field: &Field) -> Field {
    let is_intensity = ["intensity", "scalar_intensity"]
        .iter()
        .any(|name| field.name.eq_ignore_ascii_case(name));
    let mut field = field.clone();
    if is_intensity {
        field.name = "intensity".to_owned();
        // PCL's is a float, which holds these as they are.
        if let ColumnKind::Number(Scalar::Char | Scalar::UChar | Scalar::Short | Scalar::UShort) = field.kind {
            field.kind = ColumnKind::Number(Scalar::Float);
        }
    }
    field
}

fn scalar(field: &Field) -> Scalar {
    match field.kind {
        ColumnKind::Number(scalar) => scalar,
        ColumnKind::Decimal | ColumnKind::Words => Scalar::Double,
    }
}

fn head(file: &NewFile<'_>, coordinates: Scalar, plan: &Plan) -> String {
    let mut fields: Vec<(&str, Scalar)> = COORDINATES.map(|slot| (VALUE_NAMES[slot], coordinates)).collect();
    if file.normals.is_some() {
        fields.extend(NORMAL.map(|slot| (PCL_NORMAL[slot - NORMAL.start], Scalar::Float)));
    }
    if file.has_confidence() {
        fields.extend([
            (VALUE_NAMES[SIDE.start], Scalar::Float),
            (VALUE_NAMES[SIDE.start + 1], Scalar::UChar),
        ]);
    }
    match plan.packed.len() {
        0 => {}
        // A float, as PCL and all that follow it have it: its bits are meant.
        3 => fields.push(("rgb", Scalar::Float)),
        _ => fields.push(("rgba", Scalar::UInt)),
    }
    fields.extend(plan.others.iter().map(|(_, scalar, name)| (name.as_str(), *scalar)));
    let line = |keyword: &str, word: &dyn Fn(&(&str, Scalar)) -> String| {
        let words: Vec<String> = fields.iter().map(word).collect();
        format!("{keyword} {}\n", words.join(" "))
    };
    let mut stations = file.frames().iter().map(|frame| frame.station);
    let station = match (stations.next(), stations.next()) {
        (Some(station), None) => station.unwrap_or(DVec3::ZERO),
        _ => DVec3::ZERO,
    };
    let n_rows = file.n_rows;
    [
        "# .PCD v0.7 - Point Cloud Data file format\n".to_owned(),
        file.comment.map(|comment| format!("# {comment}\n")).unwrap_or_default(),
        match coordinates {
            Scalar::Double => {
                "# x y z are of 8 bytes, because 4 would lose digits; PCL itself reads 4 only\n".to_owned()
            }
            _ => String::new(),
        },
        "VERSION 0.7\n".to_owned(),
        line("FIELDS", &|(name, _)| (*name).to_owned()),
        line("SIZE", &|(_, scalar)| type_and_size(*scalar).1.to_string()),
        line("TYPE", &|(_, scalar)| type_and_size(*scalar).0.to_string()),
        line("COUNT", &|_| "1".to_owned()),
        format!("WIDTH {n_rows}\nHEIGHT 1\n"),
        format!("VIEWPOINT {} {} {} 1 0 0 0\n", station.x, station.y, station.z),
        format!("POINTS {n_rows}\nDATA binary\n"),
    ]
    .concat()
}
