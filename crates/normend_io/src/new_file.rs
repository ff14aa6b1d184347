//! Files of points that are not a copy of the file that came in.

use std::path::Path;

use glam::{DVec3, Vec3};
use normend_core::Progress;
use rayon::prelude::*;

use crate::error::WriteError;
use crate::ply;
use crate::rewrite::{NO_NORMAL, RowNormals, push_normal};
use crate::table::{PART_ROWS, VALUE_NAMES, for_each_part};
use crate::value::{Scalar, ValueType, push_number};

/// How a text is laid out that is no copy of a text, by what programs expect of its extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TextStyle {
    /// `.xyz` and the like: values with spaces between them, nothing else.
    Plain,
    /// `.pts`: the number of points first.
    Pts,
    /// `.csv`: the names of the columns first, and commas.
    Csv,
}

impl TextStyle {
    pub fn of_path(path: &Path) -> Self {
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

    pub fn separator(self) -> u8 {
        if self == Self::Csv { b',' } else { b' ' }
    }

    /// What stands before the rows.
    pub fn head(self, n_rows: usize, has_normals: bool) -> String {
        match self {
            Self::Plain => String::new(),
            Self::Pts => format!("{n_rows}\n"),
            Self::Csv => VALUE_NAMES[..if has_normals { 6 } else { 3 }].join(",") + "\n",
        }
    }
}

/// Points to be written, in order.
pub(crate) struct NewFile<'a> {
    pub n_points: usize,
    pub position: &'a (dyn Fn(usize) -> DVec3 + Sync),
    /// [`Scalar::Float`] or [`Scalar::Double`].
    pub coordinates: Scalar,
    pub normals: Option<RowNormals<'a>>,
    pub comment: Option<&'a str>,
}

impl NewFile<'_> {
    /// Writes binary little-endian PLY.
    pub fn write_ply(
        &self,
        write: &mut dyn FnMut(&[u8]) -> Result<(), WriteError>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        let has_normals = self.normals.is_some();
        write(ply::new_header(self.n_points, self.coordinates, has_normals, self.comment).as_bytes())?;
        self.write_rows(
            |position, normal, out| {
                for coordinate in position.to_array() {
                    match self.coordinates {
                        Scalar::Double => out.extend_from_slice(&coordinate.to_le_bytes()),
                        _ => out.extend_from_slice(&(coordinate as f32).to_le_bytes()),
                    }
                }
                for component in normal.iter().flat_map(Vec3::to_array) {
                    ValueType::LittleEndian(Scalar::Float).write(component, out);
                }
            },
            write,
            progress,
        )
    }

    /// Writes text, a point a line: `x y z [nx ny nz]`.
    pub fn write_text(
        &self,
        style: TextStyle,
        write: &mut dyn FnMut(&[u8]) -> Result<(), WriteError>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        let separator = style.separator();
        write(style.head(self.n_points, self.normals.is_some()).as_bytes())?;
        self.write_rows(
            |position, normal, out| {
                for (axis, coordinate) in position.to_array().into_iter().enumerate() {
                    if axis > 0 {
                        out.push(separator);
                    }
                    push_number(coordinate, self.coordinates == Scalar::Float, out);
                }
                if let Some(normal) = normal {
                    push_normal(normal, separator, out);
                }
                out.push(b'\n');
            },
            write,
            progress,
        )
    }

    fn write_rows(
        &self,
        push_row: impl Fn(DVec3, Option<Vec3>, &mut Vec<u8>) + Sync,
        write: &mut dyn FnMut(&[u8]) -> Result<(), WriteError>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        let make = |index: usize, out: &mut Vec<u8>| -> Result<(), WriteError> {
            let rows = index * PART_ROWS..((index + 1) * PART_ROWS).min(self.n_points);
            let mut normals = self.normals.map(|normals| normals.since_row(rows.start));
            for row in rows {
                let normal = normals
                    .as_mut()
                    .map(|normals| normals.next().flatten().unwrap_or(NO_NORMAL));
                push_row((self.position)(row), normal, out);
            }
            Ok(())
        };
        for_each_part(self.n_points.div_ceil(PART_ROWS), progress, make, write)
    }
}

/// `float` when the coordinates lose nothing by it: their shortest decimals are the same in `f32` and in `f64`. Else
/// `double`.
pub(crate) fn narrowest(positions: &[DVec3]) -> Scalar {
    let survives = |coordinate: f64| {
        let narrow = coordinate as f32;
        // Most coordinates of texts have few decimals; only those that `f32` rounds need a look at the decimals.
        f64::from(narrow) == coordinate || !coordinate.is_finite() || {
            let mut decimal = Vec::new();
            push_number(f64::from(narrow), true, &mut decimal);
            crate::value::parse(&decimal) == Some(coordinate)
        }
    };
    if positions
        .par_iter()
        .all(|position| position.to_array().into_iter().all(survives))
    {
        Scalar::Float
    } else {
        Scalar::Double
    }
}
