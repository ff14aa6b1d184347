//! Points in a new text, as programs expect it of the extension.

use std::path::Path;

use normend_core::Progress;
use normend_core::progress::Part;

use crate::columns::{INTENSITY_NAMES, color_byte, colors_among};
use crate::error::WriteError;
use crate::new_file::{Loss, NewFile, plain_names};
use crate::output::Output;
use crate::rewrite::share_of;
use crate::table::{SIDE, VALUE_NAMES};
use crate::value::ValueType;

/// How a text is laid out that is no copy of a text, by what programs expect of its extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TextStyle {
    /// `.xyz` and the like: values with spaces between them; the names of the columns in a comment when there are more than
    /// coordinates and a normal.
    Plain,
    /// `.pts`: the number of points first.
    Pts,
    /// `.csv`: the names of the columns first, and commas.
    Csv,
}

impl TextStyle {
    fn of_path(path: &Path) -> Self {
        let has = |name: &str| {
            path.extension()
                .is_some_and(|extension| extension.eq_ignore_ascii_case(name))
        };
        if has("csv") {
            Self::Csv
        } else if has("pts") {
            Self::Pts
        } else {
            Self::Plain
        }
    }
}

/// Drops what the text cannot hold.
pub(crate) fn limit(file: &mut NewFile<'_>, path: &Path) -> Vec<Loss> {
    match TextStyle::of_path(path) {
        TextStyle::Pts => {
            let kept: Vec<String> = (places(file).into_iter())
                .map(|field| file.fields[field].name.clone())
                .collect();
            file.drop_fields(|field| {
                let is_kept = kept.contains(&field.name);
                (!is_kept).then(|| "the columns of PTS have no names; write .csv or .xyz".into())
            })
        }
        TextStyle::Plain | TextStyle::Csv => Vec::new(),
    }
}

/// The fields that have their places in a PTS: intensity, then colors.
fn places(file: &NewFile<'_>) -> Vec<usize> {
    let names = || file.fields.iter().map(|field| field.name.as_str());
    let is_intensity = |name: &str| INTENSITY_NAMES.iter().any(|wanted| name.eq_ignore_ascii_case(wanted));
    let intensity = names().position(is_intensity);
    let colors = colors_among(names());
    intensity.into_iter().chain(colors.into_iter().flatten()).collect()
}

/// Whether the text can hold confidence.
pub(crate) fn can_hold_side(path: &Path) -> bool {
    TextStyle::of_path(path) != TextStyle::Pts
}

/// Writes the file.
pub(crate) fn write(file: &mut NewFile<'_>, out: &mut Output<'_>, progress: &dyn Progress) -> Result<(), WriteError> {
    let style = TextStyle::of_path(out.path);
    let separator = if style == TextStyle::Csv { b',' } else { b' ' };
    out.write(head(file, style).as_bytes())?;
    if style == TextStyle::Pts {
        return write_pts(file, out, progress);
    }
    file.write_rows(
        |row, out| {
            row.push_coordinates(file.coordinates, separator, out);
            for value in row.normal.iter().flat_map(glam::Vec3::to_array) {
                out.push(separator);
                ValueType::Text.write(value, out);
            }
            if let Some(confidence) = row.confidence {
                out.push(separator);
                ValueType::Text.write(share_of(confidence), out);
                out.push(separator);
                ValueType::Text.write_flag(confidence > normend_core::confidence::UNDECIDED, out);
            }
            for cell in row.cells {
                out.push(separator);
                cell.push_text(out);
            }
            out.push(b'\n');
        },
        out,
        progress,
    )
}

/// Writes the rows of a PTS: `x y z [intensity] [r g b] [nx ny nz]`, colors in 8 bits.
fn write_pts(file: &NewFile<'_>, out: &mut Output<'_>, progress: &dyn Progress) -> Result<(), WriteError> {
    let places = places(file);
    let colors = colors_among(file.fields.iter().map(|field| field.name.as_str()));
    let white = match colors {
        Some(colors) => file.color_scale(colors, &Part::new(progress, 0.0..0.3))?.white,
        None => 255.0,
    };
    file.write_rows(
        |row, out| {
            row.push_coordinates(file.coordinates, b' ', out);
            for &field in &places {
                out.push(b' ');
                if colors.is_some_and(|colors| colors.contains(&field)) {
                    let byte = color_byte(row.cells[field].number(), white);
                    out.extend_from_slice(byte.to_string().as_bytes());
                } else {
                    row.cells[field].push_text(out);
                }
            }
            for value in row.normal.iter().flat_map(glam::Vec3::to_array) {
                out.push(b' ');
                ValueType::Text.write(value, out);
            }
            out.push(b'\n');
        },
        out,
        &Part::new(progress, 0.3..1.0),
    )
}

/// What stands before the rows.
fn head(file: &NewFile<'_>, style: TextStyle) -> String {
    let n_values = if file.has_confidence() {
        SIDE.end
    } else if file.normals.is_some() {
        SIDE.start
    } else {
        3
    };
    let mut names: Vec<String> = VALUE_NAMES[..n_values].iter().map(|&name| name.to_owned()).collect();
    names.extend(plain_names(&file.fields, &VALUE_NAMES));
    match style {
        TextStyle::Plain if names.len() <= SIDE.start => String::new(),
        TextStyle::Plain => format!("# {}\n", names.join(" ")),
        TextStyle::Pts => format!("{}\n", file.n_rows),
        TextStyle::Csv => names.join(",") + "\n",
    }
}
