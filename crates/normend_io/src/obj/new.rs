//! Points in a new OBJ file: a `v` line each, with its color, and a `vn` line.

use normend_core::Progress;
use normend_core::progress::Part;

use crate::columns::{ColumnKind, colors_among};
use crate::error::WriteError;
use crate::new_file::{Loss, NewFile};
use crate::output::Output;
use crate::value::{ValueType, push_number};

/// Drops what OBJ cannot hold.
pub(crate) fn limit(file: &mut NewFile<'_>) -> Vec<Loss> {
    let is_number = |field: usize| file.fields[field].kind != ColumnKind::Words;
    let colors = colors_of(file).filter(|colors| colors.iter().all(|&field| is_number(field)));
    let names = colors.map(|colors| colors.map(|field| file.fields[field].name.clone()));
    file.drop_fields(|field| {
        let is_color = names.as_ref().is_some_and(|names| names.contains(&field.name));
        (!is_color).then(|| "OBJ holds points, normals and colors only".to_owned())
    })
}

fn colors_of(file: &NewFile<'_>) -> Option<[usize; 3]> {
    colors_among(file.fields.iter().map(|field| field.name.as_str()))
}

/// Writes the file. Colors are shares of 1, as all programs that know them have them.
pub(crate) fn write(file: &mut NewFile<'_>, out: &mut Output<'_>, progress: &dyn Progress) -> Result<(), WriteError> {
    file.narrow(&Part::new(progress, 0.0..0.2))?;
    let scale = match colors_of(file) {
        Some(colors) => Some((colors, file.color_scale(colors, &Part::new(progress, 0.2..0.4))?.white)),
        None => None,
    };
    if let Some(comment) = file.comment {
        out.write(format!("# {comment}\n").as_bytes())?;
    }
    file.write_rows(
        |row, out| {
            // Most programs that read OBJ know no NaN.
            if !row.position.is_finite() {
                return;
            }
            out.extend_from_slice(b"v ");
            row.push_coordinates(file.coordinates, b' ', out);
            if let Some((colors, white)) = scale {
                for field in colors {
                    let share = row.cells[field].number() / white;
                    out.push(b' ');
                    push_number(if share.is_finite() { share } else { 0.0 }, true, out);
                }
            }
            if let Some(normal) = row.normal {
                out.extend_from_slice(b"\nvn");
                for component in normal.to_array() {
                    out.push(b' ');
                    ValueType::Text.write(component, out);
                }
            }
            out.push(b'\n');
        },
        out,
        &Part::new(progress, 0.4..1.0),
    )
}
