//! The other numbers of a scan's rows: any column by its name, and colors. Nothing is read until it is asked for.
//!
//! A layout that finds coordinates finds any other column as well, so a column is read by the same rows as the points.

use std::sync::atomic::{AtomicUsize, Ordering};

use normend_core::Progress;
use rayon::prelude::*;

use crate::error::{Broken, ReadError, Stop, quoted};
use crate::scan::Layer;
use crate::table::{COORDINATES, Layout, N_VALUES, PART_ROWS};
use crate::value::Scalar;

/// Names of columns that hold red, green and blue, in lower case.
pub(crate) const COLOR_NAMES: [[&str; 3]; 4] = [
    ["red", "green", "blue"],
    ["r", "g", "b"],
    ["diffuse_red", "diffuse_green", "diffuse_blue"],
    ["scalar_red", "scalar_green", "scalar_blue"],
];

/// Names of columns that hold how strongly a point reflects, in lower case.
pub(crate) const INTENSITY_NAMES: [&str; 3] = ["intensity", "scalar_intensity", "reflectance"];

/// A value that every row has: its name, and which value of the row it is, from 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Column {
    pub name: String,
    pub index: usize,
    pub kind: ColumnKind,
}

/// What the values of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ColumnKind {
    /// Binary numbers.
    Number(Scalar),
    /// Numbers in text, as far as the first row tells.
    Decimal,
    /// Text that is no number.
    Words,
}

/// The values of a row for columns that were asked for: the coordinates stay, so that rows are told from what is none, and
/// the others take the places after them. Returns the column of each slot and the slots of `columns`, which are at most
/// [`crate::table::MOST_COLUMNS`].
pub(crate) fn slots_for(coordinates: &[Option<usize>], columns: &[usize]) -> ([Option<usize>; N_VALUES], Vec<usize>) {
    let mut slots = [None; N_VALUES];
    slots[COORDINATES].copy_from_slice(coordinates);
    let mut next = COORDINATES.end;
    let found = columns
        .iter()
        .map(|&column| match slots.iter().position(|&slot| slot == Some(column)) {
            Some(slot) => slot,
            None => {
                slots[next] = Some(column);
                next += 1;
                next - 1
            }
        })
        .collect();
    (slots, found)
}

/// Which of some names are those of red, green and blue, in any case of letters.
pub(crate) fn colors_among<'a>(names: impl Iterator<Item = &'a str> + Clone) -> Option<[usize; 3]> {
    let find = |wanted: &str| names.clone().position(|name| name.eq_ignore_ascii_case(wanted));
    COLOR_NAMES.iter().find_map(|wanted| {
        let [red, green, blue] = wanted.map(find);
        Some([red?, green?, blue?])
    })
}

/// What a channel of a color has at most, from whether it `is_byte` and from the largest value that there is.
pub(crate) fn white(is_byte: bool, largest: f64) -> f64 {
    match largest {
        _ if is_byte => 255.0,
        // Some programs go a little beyond 1.
        ..=1.001 => 1.0,
        ..=255.0 => 255.0,
        _ => 65535.0,
    }
}

/// A channel of a color in 8 bits. What is not finite is black.
pub(crate) fn color_byte(value: f64, white: f64) -> u8 {
    // A cast of NaN is 0.
    (value / white * 255.0).round().clamp(0.0, 255.0) as u8
}

impl Layer {
    /// Names of all columns of numbers, coordinates and normals among them, in the file's order: the scalar properties of a
    /// PLY's vertices, or the columns of a text, which without names are called "Column 4". Nothing but the header, or the
    /// first row, is looked at.
    pub fn scalar_columns(&self) -> Vec<String> {
        self.columns().into_iter().map(|column| column.name).collect()
    }

    /// The values of the column called `name` by point, not finite where the file's are not, or nothing stands there; `None`
    /// without such a column. O(n), parallel; 8 bytes a point.
    ///
    /// # Errors
    /// [`ReadError::Broken`] when a value is no number, [`ReadError::Cancelled`].
    pub fn scalar(&self, name: &str, progress: &dyn Progress) -> Result<Option<Vec<f64>>, ReadError> {
        let columns = self.columns();
        let Some(column) = columns.iter().find(|column| column.name == name) else {
            return Ok(None);
        };
        let [values] = self.read_columns([column.index], progress)?;
        Ok(Some(values))
    }

    /// Whether the file has a color for each point.
    pub fn has_colors(&self) -> bool {
        self.color_columns().is_some() || self.is_splats()
    }

    /// The file's colors by point as red, green, blue, gamma-encoded; `None` when it has none. Columns of bytes, of 16 bits,
    /// and of shares of 1 are told apart by their type and their largest value; Gaussian splats have their mean color. O(n),
    /// parallel; 24 bytes a point for a while.
    ///
    /// # Errors
    /// As [`Self::scalar`].
    pub fn colors(&self, progress: &dyn Progress) -> Result<Option<Vec<[u8; 3]>>, ReadError> {
        let Some(columns) = self.color_columns() else {
            return self.splat_colors(progress);
        };
        let channels = self.read_columns(columns, progress)?;
        let largest = |values: &Vec<f64>| {
            let finite = values.par_iter().copied().filter(|value| value.is_finite());
            finite.reduce(|| 0.0, f64::max)
        };
        let largest = channels.iter().map(largest).fold(0.0, f64::max);
        let is_byte = |column: &Column| column.kind == ColumnKind::Number(Scalar::UChar);
        let are_bytes = (self.columns().iter())
            .filter(|column| columns.contains(&column.index))
            .all(is_byte);
        let white = white(are_bytes, largest);
        let [red, green, blue] = &channels;
        let colors = (red, green, blue)
            .into_par_iter()
            .map(|(&red, &green, &blue)| [red, green, blue].map(|value| color_byte(value, white)))
            .collect();
        Ok(Some(colors))
    }

    /// The columns of numbers.
    pub(crate) fn columns(&self) -> Vec<Column> {
        let mut columns = self.file.layout.columns(&self.file.bytes);
        columns.retain(|column| column.kind != ColumnKind::Words);
        columns
    }

    fn color_columns(&self) -> Option<[usize; 3]> {
        let columns = self.columns();
        let by_name = colors_among(columns.iter().map(|column| column.name.as_str()));
        let by_name = by_name.map(|found| found.map(|index| columns[index].index));
        by_name.or_else(|| self.file.layout.unnamed_colors(&self.file.bytes))
    }

    /// The values of some columns, by point.
    pub(crate) fn read_columns<const N: usize>(
        &self,
        columns: [usize; N],
        progress: &dyn Progress,
    ) -> Result<[Vec<f64>; N], ReadError> {
        progress.stage("Reading values");
        let (layout, slots) = self.file.layout.with_columns(&columns);
        let read = read_slots(layout.as_ref(), &self.file.bytes, &slots, progress);
        let name = self.path().map_or("the scan".into(), |path| path.display().to_string());
        let values = read.map_err(|stop| stop.in_file(&name))?;
        Ok(std::array::from_fn(|column| {
            let value = |row: usize| values[row * N + column];
            match &self.rows {
                Some(rows) => rows.par_iter().map(|&row| value(row as usize)).collect(),
                None => (0..values.len() / N).into_par_iter().map(value).collect(),
            }
        }))
    }
}

/// The values of some slots of all rows, row by row.
fn read_slots(layout: &dyn Layout, bytes: &[u8], slots: &[usize], progress: &dyn Progress) -> Result<Vec<f64>, Stop> {
    let table = layout.table();
    let mut values = vec![f64::NAN; table.n_rows * slots.len()];
    let n_done = AtomicUsize::new(0);
    let read = |index: usize, values: &mut [f64]| -> Result<(), Stop> {
        progress.report(n_done.load(Ordering::Relaxed) as f32 / table.n_parts() as f32)?;
        let part = table.part(index);
        let mut rows = layout.rows(bytes, part.bytes.start);
        for row in values.chunks_exact_mut(slots.len()) {
            let Some(spans) = rows.next_row()? else {
                break;
            };
            for (value, &slot) in row.iter_mut().zip(slots) {
                let token = spans[slot].of(bytes);
                // An empty cell between two commas is no value rather than a mistake.
                if token.is_empty() {
                    continue;
                }
                *value = table.types[slot].read(token).ok_or_else(|| {
                    Broken::new(
                        layout.place(bytes, spans[slot].start),
                        format!("{} is not a number: correct it", quoted(token)),
                    )
                })?;
            }
        }
        n_done.fetch_add(1, Ordering::Relaxed);
        Ok(())
    };
    let results: Vec<Result<(), Stop>> = values
        .par_chunks_mut(PART_ROWS * slots.len())
        .enumerate()
        .map(|(index, values)| read(index, values))
        .collect();
    // The first error in the file's order, whichever thread met one first.
    results.into_iter().collect::<Result<(), Stop>>()?;
    Ok(values)
}

#[cfg(test)]
mod tests {
    use normend_core::Silent;
    use proptest::prelude::*;

    use crate::{Scan, read_bytes};

    fn scan(content: &[u8], name: &str) -> Scan {
        read_bytes(content.to_vec(), name, &Silent).unwrap()
    }

    /// One point less than rows: the second has no place.
    fn binary(big_endian: bool) -> Vec<u8> {
        let order = if big_endian { "big" } else { "little" };
        let mut bytes = format!(
            "ply\nformat binary_{order}_endian 1.0\nelement vertex 3\nproperty float x\nproperty ushort intensity\n\
             property float y\nproperty list uchar int of\nproperty float z\nproperty double time\nproperty uchar red\n\
             property uchar green\nproperty uchar blue\nend_header\n"
        )
        .into_bytes();
        for row in 0..3_u8 {
            let mut push = |little: &[u8]| {
                let mut little = little.to_vec();
                if big_endian {
                    little.reverse();
                }
                bytes.extend(little);
            };
            let x = if row == 1 { f32::NAN } else { f32::from(row) };
            push(&x.to_le_bytes());
            push(&(1000 * u16::from(row)).to_le_bytes());
            push(&2.5_f32.to_le_bytes());
            push(&[row]);
            (0..row).for_each(|item| push(&i32::from(item).to_le_bytes()));
            push(&3.5_f32.to_le_bytes());
            push(&(1.0e9 + 0.001 * f64::from(row)).to_le_bytes());
            (0..3).for_each(|channel| push(&[100 * row + channel]));
        }
        bytes
    }

    #[test]
    fn columns_of_ply_of_any_type_are_read_by_point() {
        for big_endian in [false, true] {
            let scan = scan(&binary(big_endian), "a.ply");
            let names = ["x", "intensity", "y", "z", "time", "red", "green", "blue"];
            assert_eq!(scan.scalar_columns(), names);
            let values = |name| scan.scalar(name, &Silent).unwrap();
            assert_eq!(values("intensity"), Some(vec![0.0, 2000.0]));
            assert_eq!(values("time"), Some(vec![1.0e9, 1.0e9 + 0.002]));
            assert_eq!(values("x"), Some(vec![0.0, 2.0]));
            assert_eq!(values("of"), None);
            let colors = scan.colors(&Silent).unwrap();
            assert_eq!(colors, Some(vec![[0, 1, 2], [200, 201, 202]]));
        }
    }

    #[test]
    fn columns_of_text_have_names_or_numbers() {
        let check = |content: &str, name: &str, columns: &[&str], wanted: &str, expect: &[f64]| {
            let scan = scan(content.as_bytes(), name);
            assert_eq!(scan.scalar_columns(), columns, "{content}");
            let values = scan.scalar(wanted, &Silent).unwrap().unwrap();
            let same = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
            assert!(
                values.len() == expect.len() && values.iter().zip(expect).all(same),
                "{values:?}"
            );
        };
        check(
            "x,y,z,Intensity\n1,2,3,0.5\n4,5,6,\n",
            "a.csv",
            &["x", "y", "z", "Intensity"],
            "Intensity",
            &[0.5, f64::NAN],
        );
        check(
            "# class x y z\n7 1 2 3\n8 4 5 6\n",
            "a.xyz",
            &["class", "x", "y", "z"],
            "class",
            &[7.0, 8.0],
        );
        let columns = ["Column 1", "Column 2", "Column 3", "Column 4"];
        check("2\n1 2 3 9\n4 5 6 8\n", "a.pts", &columns, "Column 4", &[9.0, 8.0]);
        check("2\n1 2 3 9\n4 5 6 8\n", "a.pts", &columns, "Column 1", &[1.0, 4.0]);
    }

    #[test]
    fn words_are_no_numbers_and_are_named_with_their_line() {
        let words = scan(b"x y z class\n1 2 3 wall\n", "a.xyz");
        assert_eq!(words.scalar_columns(), ["x", "y", "z"], "words are no numbers");
        let mixed = scan(b"x y z class\n1 2 3 4\n1 2 3 wall\n", "a.xyz");
        let error = mixed.scalar("class", &Silent).unwrap_err().to_string();
        assert!(error.contains("line 3") && error.contains("\"wall\""), "{error}");
    }

    #[test]
    fn colors_are_recognized_in_every_range() {
        let check = |content: &str, expect: Option<[u8; 3]>| {
            let scan = scan(content.as_bytes(), "a.xyz");
            let colors = scan.colors(&Silent).unwrap();
            assert_eq!(scan.has_colors(), expect.is_some(), "{content}");
            assert_eq!(colors.map(|colors| colors[0]), expect, "{content}");
        };
        check("x y z red green blue\n1 2 3 10 20 255\n", Some([10, 20, 255]));
        check("x y z R G B\n1 2 3 0.5 0 1\n", Some([128, 0, 255]));
        check("x y z r g b\n1 2 3 65535 0 32768\n", Some([255, 0, 128]));
        check("1 2 3 10 20 255\n", Some([10, 20, 255]));
        check("1\n1 2 3 -514 10 20 255\n", Some([10, 20, 255]));
        check("1 2 3 0 0 1\n", None);
        check("1 2 3 0.5 20 255\n", None);
        check("1 2 3 4\n", None);
    }

    proptest! {
        #[test]
        fn any_column_comes_back(values in proptest::collection::vec(-1.0e12_f64..1.0e12, 1..40)) {
            let mut text = "x y z value\n".to_owned();
            for (row, value) in values.iter().enumerate() {
                text += &format!("{row} 0 1 {value}\n");
            }
            let scan = scan(text.as_bytes(), "a.xyz");
            prop_assert_eq!(scan.scalar("value", &Silent).unwrap().unwrap(), values);
        }
    }
}
