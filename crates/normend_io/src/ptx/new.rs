//! Points in a new PTX file: a grid for each frame of the source.

use normend_core::Progress;
use normend_core::progress::Part;

use super::normals_remark;
use crate::columns::{COLOR_NAMES, ColumnKind, INTENSITY_NAMES};
use crate::error::{Stop, WriteError};
use crate::new_file::{Loss, NewFile, NewRow, Pose};
use crate::output::Output;
use crate::table::{Frame, PART_ROWS, for_each_part};
use crate::value::{Scalar, ValueType, push_number};

/// A grid may have this many times as many cells as there are points; more are no grid of a scanner.
const MOST_CELLS_A_POINT: usize = 8;

/// Which of the fields PTX has a place for.
#[derive(Clone, Copy, Debug, Default)]
struct Places {
    intensity: Option<usize>,
    colors: Option<[usize; 3]>,
    /// Row and column of a cell.
    cell: Option<[usize; 2]>,
}

impl Places {
    fn of(file: &NewFile<'_>) -> Self {
        let find = |name: &str| {
            let is_number = |kind| kind != ColumnKind::Words;
            let mut fields = file.fields.iter();
            fields.position(|field| is_number(field.kind) && field.name.eq_ignore_ascii_case(name))
        };
        let all = |names: [&str; 3]| {
            let [first, second, third] = names.map(find);
            Some([first?, second?, third?])
        };
        Self {
            intensity: INTENSITY_NAMES.iter().find_map(|name| find(name)),
            colors: COLOR_NAMES.iter().find_map(|&names| all(names)),
            cell: find("rowIndex")
                .zip(find("columnIndex"))
                .map(|(row, column)| [row, column]),
        }
    }

    fn has(&self, field: usize) -> bool {
        let colors = self.colors.into_iter().flatten();
        let cell = self.cell.into_iter().flatten();
        self.intensity
            .into_iter()
            .chain(colors)
            .chain(cell)
            .any(|place| place == field)
    }
}

/// Drops what PTX cannot hold.
pub(crate) fn limit(file: &mut NewFile<'_>) -> Vec<Loss> {
    let places = Places::of(file);
    let kept: Vec<String> = (file.fields.iter().enumerate())
        .filter(|(index, _)| places.has(*index))
        .map(|(_, field)| field.name.clone())
        .collect();
    let mut losses = file.drop_fields(|field| {
        let is_kept = kept.contains(&field.name);
        (!is_kept).then(|| "PTX has intensity and colors and nothing else".to_owned())
    });
    let is_byte = |field: usize| {
        matches!(
            file.fields[field].kind,
            ColumnKind::Number(Scalar::UChar) | ColumnKind::Decimal
        )
    };
    if let Some(colors) = Places::of(file).colors
        && !colors.into_iter().all(is_byte)
    {
        losses.push(Loss {
            what: "finer steps of colors".to_owned(),
            why: "PTX has 256 of each".to_owned(),
        });
    }
    losses.push(normals_remark());
    losses
}

/// How lines are made.
struct Lines<'a> {
    file: &'a NewFile<'a>,
    places: Places,
    frames: Vec<(Frame, Option<Pose>)>,
    /// The largest value of colors.
    white: f64,
}

/// Writes the file.
pub(crate) fn write(file: &mut NewFile<'_>, out: &mut Output<'_>, progress: &dyn Progress) -> Result<(), WriteError> {
    let mut lines = Lines {
        file,
        places: Places::of(file),
        frames: file
            .frames()
            .iter()
            .map(|frame| (frame.clone(), Pose::of(frame)))
            .collect(),
        white: 255.0,
    };
    if lines.frames.is_empty() {
        lines.frames.push((Frame::plain(0), None));
    }
    lines.white = lines.find_white(&Part::new(progress, 0.0..0.2))?;
    let progress = Part::new(progress, 0.2..1.0);
    for index in 0..lines.frames.len() {
        let first = lines.frames[index].0.first_row;
        let end = lines.end_of(index);
        let share = |row: usize| row as f32 / file.n_rows.max(1) as f32;
        let part = Part::new(&progress, share(first)..share(end));
        match lines.grid(index, &Part::new(&part, 0.0..0.3))? {
            Some(grid) => lines.write_grid(index, &grid, out, &Part::new(&part, 0.3..1.0))?,
            None => {
                out.write(lines.header(index, end - first, 1).as_bytes())?;
                lines.write_rows(index, &part, |part| out.write(part))?;
            }
        }
    }
    Ok(())
}

/// Where the points of a frame are in its grid.
struct Grid {
    n_columns: usize,
    n_rows: usize,
    /// The row of the file in each cell, column by column, from the frame's first; `u32::MAX` where there is none.
    rows: Vec<u32>,
}

impl Lines<'_> {
    fn end_of(&self, frame: usize) -> usize {
        self.frames
            .get(frame + 1)
            .map_or(self.file.n_rows, |(next, _)| next.first_row)
    }

    /// Hands the rows of a frame that are in a part of the file to `take`.
    fn rows_in_part(&self, frame: usize, part: usize, mut take: impl FnMut(&NewRow<'_>)) -> Result<(), Stop> {
        let own = self.frames[frame].0.first_row..self.end_of(frame);
        let range = self.file.rows_of_part(part);
        let mut row_index = range.start;
        self.file.for_rows(range.start..range.end.min(own.end), |row| {
            if own.contains(&row_index) {
                take(row);
            }
            row_index += 1;
        })
    }

    /// The parts of the file that have rows of a frame.
    fn parts_of(&self, frame: usize) -> std::ops::Range<usize> {
        let own = self.frames[frame].0.first_row..self.end_of(frame);
        own.start / PART_ROWS..if own.is_empty() {
            own.start / PART_ROWS
        } else {
            own.end.div_ceil(PART_ROWS)
        }
    }

    /// The largest value of colors: 1, that of a byte, or of 16 bits.
    fn find_white(&self, progress: &dyn Progress) -> Result<f64, Stop> {
        let Some(colors) = self.places.colors else {
            return Ok(255.0);
        };
        let are_bytes = |&field: &usize| self.file.fields[field].kind == ColumnKind::Number(Scalar::UChar);
        if colors.iter().all(are_bytes) {
            return Ok(255.0);
        }
        let n_parts = self.file.n_rows.div_ceil(PART_ROWS);
        let mut largest: f64 = 0.0;
        for part in 0..n_parts {
            progress.report(part as f32 / n_parts as f32)?;
            self.file.for_rows(self.file.rows_of_part(part), |row| {
                largest = colors
                    .iter()
                    .map(|&field| row.cells[field].number())
                    .fold(largest, f64::max);
            })?;
        }
        Ok(match largest {
            ..=1.001 => 1.0,
            ..=255.0 => 255.0,
            _ => 65535.0,
        })
    }

    /// The grid of a frame, when its rows say in which cell each is and no cell is taken twice.
    fn grid(&self, frame: usize, progress: &dyn Progress) -> Result<Option<Grid>, Stop> {
        let Some(fields) = self.places.cell else {
            return Ok(None);
        };
        let mut cells: Vec<[f64; 2]> = Vec::new();
        let parts = self.parts_of(frame);
        for part in parts.clone() {
            progress.report((part - parts.start) as f32 / parts.len() as f32)?;
            self.rows_in_part(frame, part, |row| {
                cells.push(fields.map(|field| row.cells[field].number()))
            })?;
        }
        let range = |axis: usize| {
            let values = cells.iter().map(|cell| cell[axis]);
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), value| {
                (value.min(min), value.max(max))
            })
        };
        let ((first_row, last_row), (first_column, last_column)) = (range(0), range(1));
        let (n_rows, n_columns) = (last_row - first_row + 1.0, last_column - first_column + 1.0);
        let is_whole = |cell: &[f64; 2]| cell.iter().all(|value| value.fract() == 0.0);
        let most = cells.len() * MOST_CELLS_A_POINT + PART_ROWS;
        if !(n_rows * n_columns <= most as f64 && cells.iter().all(is_whole)) {
            return Ok(None);
        }
        let (n_rows, n_columns) = (n_rows as usize, n_columns as usize);
        let mut rows = vec![u32::MAX; n_rows * n_columns];
        for (index, [row, column]) in cells.iter().enumerate() {
            let cell = (column - first_column) as usize * n_rows + (row - first_row) as usize;
            if rows[cell] != u32::MAX {
                return Ok(None);
            }
            rows[cell] = index as u32;
        }
        Ok(Some(Grid {
            n_columns,
            n_rows,
            rows,
        }))
    }

    /// What stands before the points of a frame.
    fn header(&self, frame: usize, n_columns: usize, n_rows: usize) -> String {
        let pose = self.frames[frame].1;
        let place = pose.map_or(glam::DVec3::ZERO, |pose| pose.place);
        let turn = pose.map_or(glam::DMat3::IDENTITY, |pose| pose.turn);
        let line = |vector: glam::DVec3| format!("{} {} {}", vector.x + 0.0, vector.y + 0.0, vector.z + 0.0);
        let axes = [turn.x_axis, turn.y_axis, turn.z_axis].map(line);
        let [x, y, z] = &axes;
        let place = line(place);
        format!("{n_columns}\n{n_rows}\n{place}\n{x}\n{y}\n{z}\n{x} 0\n{y} 0\n{z} 0\n{place} 1\n")
    }

    /// Writes the points of a frame in the order of the file.
    fn write_rows(
        &self,
        frame: usize,
        progress: &dyn Progress,
        sink: impl FnMut(&[u8]) -> Result<(), WriteError>,
    ) -> Result<(), WriteError> {
        let parts = self.parts_of(frame);
        for_each_part(
            parts.len(),
            progress,
            |index, out| -> Result<(), WriteError> {
                Ok(self.rows_in_part(frame, parts.start + index, |row| self.push_row(frame, row, out))?)
            },
            sink,
        )
    }

    /// Writes the cells of a frame, column by column.
    fn write_grid(
        &self,
        frame: usize,
        grid: &Grid,
        out: &mut Output<'_>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        let mut text = Vec::new();
        self.write_rows(frame, &Part::new(progress, 0.0..0.7), |part| {
            text.extend_from_slice(part);
            Ok(())
        })?;
        let ends: Vec<usize> = memchr::memchr_iter(b'\n', &text).map(|end| end + 1).collect();
        let mut none = b"0 0 0 0".to_vec();
        if self.places.colors.is_some() {
            none.extend_from_slice(b" 0 0 0");
        }
        if self.file.normals.is_some() {
            none.extend_from_slice(b" 0 0 1");
        }
        none.push(b'\n');
        out.write(self.header(frame, grid.n_columns, grid.n_rows).as_bytes())?;
        let mut lines = Vec::new();
        for (index, cells) in grid.rows.chunks(PART_ROWS).enumerate() {
            progress.report(0.7 + 0.3 * (index * PART_ROWS) as f32 / grid.rows.len() as f32)?;
            lines.clear();
            for &row in cells {
                let line = match (row as usize).checked_sub(1) {
                    _ if row == u32::MAX => &none[..],
                    None => &text[..ends[0]],
                    Some(before) => &text[ends[before]..ends[row as usize]],
                };
                lines.extend_from_slice(line);
            }
            out.write(&lines)?;
        }
        Ok(())
    }

    /// Appends the line of a row.
    fn push_row(&self, frame: usize, row: &NewRow<'_>, out: &mut Vec<u8>) {
        let (frame, pose) = &self.frames[frame];
        let is_point = row.position.is_finite();
        match (is_point, pose) {
            (true, None) => row.push_coordinates(self.file.coordinates, b' ', out),
            (true, Some(pose)) => {
                for (axis, value) in pose.own(row.position).to_array().into_iter().enumerate() {
                    if axis > 0 {
                        out.push(b' ');
                    }
                    push_number(value + 0.0, false, out);
                }
            }
            (false, _) => out.extend_from_slice(b"0 0 0"),
        }
        // The format has an intensity always: nothing where the source has none.
        let intensity = self.places.intensity.map_or(0.0, |field| row.cells[field].number());
        out.push(b' ');
        push_number(
            if intensity.is_finite() { intensity } else { 0.0 },
            self.is_single(),
            out,
        );
        for field in self.places.colors.into_iter().flatten() {
            let byte = (row.cells[field].number() / self.white * 255.0)
                .round()
                .clamp(0.0, 255.0) as u8;
            out.push(b' ');
            push_number(f64::from(byte), true, out);
        }
        if let Some(normal) = row.normal {
            let normal = match pose {
                Some(_) if is_point => frame.stored_from_normal(normal),
                _ => normal,
            };
            for component in normal.to_array() {
                out.push(b' ');
                ValueType::Text.write(component, out);
            }
        }
        out.push(b'\n');
    }

    /// Whether the intensity is `float`, whose shortest decimals are shorter.
    fn is_single(&self) -> bool {
        let field = self.places.intensity.map(|field| &self.file.fields[field]);
        field.is_some_and(|field| field.kind == ColumnKind::Number(Scalar::Float))
    }
}
