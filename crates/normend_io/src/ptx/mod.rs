//! PTX, the text of laser scanners: grids of points, each with the place and the pose that it was scanned from.
//!
//! A grid is its number of columns and of rows, the scanner's place, its axes (three lines), a matrix that takes its points
//! to the scan's coordinates (four lines, vectors from the left), and a line `x y z intensity [r g b]` for each cell, column
//! by column. A cell whose ray came back from nowhere is `0 0 0 …`: a row that is no point. PTX has no place for normals; they
//! are three more columns at the end, in the grid's own coordinates, and are told by their length.

pub(crate) mod new;
#[cfg(test)]
mod tests;

use glam::{DAffine3, DMat3, DQuat, DVec3};
use normend_core::{PointCloud, Progress};

use crate::columns::{Column, ColumnKind, slots_for};
use crate::error::{Broken, Place, Stop, WriteError, quoted};
use crate::new_file::Loss;
use crate::output::Output;
use crate::rewrite::{NO_NORMAL, rewrite};
use crate::table::{
    COORDINATES, Frame, Layout, N_VALUES, NORMAL, NewContent, Part, Rows, Span, Spans, Starts, Table, VALUE_NAMES,
    find_parts, for_each_part, is_space, next_token,
};
use crate::value::{ValueType, parse};

/// Lines before the points of a grid.
const HEADER_LINES: usize = 10;
/// The least bytes of a line of a cell: `0 0 0` and its end.
const LEAST_LINE: usize = 6;
/// Cells looked at to tell normals from colors.
const SAMPLE_CELLS: usize = 1000;
/// The most grids of a file, each of which takes some hundred bytes.
const MOST_GRIDS: usize = 100_000;
/// The most values of a line: more are no cells of a scanner.
const MOST_VALUES: usize = 1000;

/// A PTX file whose grids are known.
#[derive(Clone, Debug)]
pub(crate) struct PtxLayout {
    line_end: u8,
    grids: Vec<Grid>,
    /// How many rows each of them has; empty when they are nothing but lists.
    heights: Vec<usize>,
    /// The columns of all grids.
    names: Vec<String>,
    /// Which of them each value is, by slot.
    chosen: [Option<usize>; N_VALUES],
    table: Table,
}

/// A grid of cells.
#[derive(Clone, Debug)]
struct Grid {
    /// The byte at which its header may begin: the one after the grid before.
    start: usize,
    /// The byte of its first cell.
    cells: usize,
    n_cells: usize,
    height: usize,
    /// Which column each value of a line is.
    columns: Vec<usize>,
}

/// Whether a file begins as this format does: two whole numbers, then a place, three axes and a matrix of four lines.
pub(crate) fn sniff(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(1 << 12)];
    let lines = head
        .split(|byte| matches!(byte, b'\n' | b'\r'))
        .filter(|line| !line.trim_ascii().is_empty());
    let counts = lines.take(HEADER_LINES).map(|line| {
        let values = line.split(|byte| is_space(*byte)).filter(|word| !word.is_empty());
        values
            .take(5)
            .map(parse)
            .collect::<Option<Vec<f64>>>()
            .map(|values| values.len())
    });
    counts.eq([1, 1, 3, 3, 3, 3, 4, 4, 4, 4].map(Some))
}

/// Finds the grids of a file.
pub(crate) fn read(bytes: &[u8], progress: &dyn Progress) -> Result<PtxLayout, Stop> {
    let line_end = match memchr::memchr(b'\n', bytes) {
        None if memchr::memchr(b'\r', bytes).is_some() => b'\r',
        _ => b'\n',
    };
    let mut layout = PtxLayout {
        line_end,
        grids: Vec::new(),
        heights: Vec::new(),
        names: VALUE_NAMES[COORDINATES].iter().map(|&name| name.to_owned()).collect(),
        chosen: [None; N_VALUES],
        table: Table {
            n_rows: 0,
            types: [ValueType::Text; N_VALUES],
            has_normals: false,
            order: Vec::new(),
            starts: Starts::Parts(Vec::new()),
            end: 0,
            frames: Vec::new(),
        },
    };
    // The grids first, as they say where lines are cells; then the parts.
    let mut at = 0;
    let mut n_values = Vec::new();
    while let Some((grid, frame, n_columns, end)) = layout.next_grid(bytes, at, progress)? {
        if layout.grids.len() == MOST_GRIDS {
            return Err(Broken::whole(format!("more than {MOST_GRIDS} grids: split the file")).into());
        }
        layout.table.n_rows += grid.n_cells;
        layout.table.frames.push(frame);
        layout.grids.push(grid);
        n_values.push(n_columns);
        at = end;
    }
    if layout.table.n_rows == 0 {
        return Err(Broken::whole("the file has no points: open one that has").into());
    }
    layout.name_columns(bytes, &n_values);
    if layout
        .grids
        .iter()
        .any(|grid| grid.height > 1 && grid.n_cells > grid.height)
    {
        layout.heights = layout.grids.iter().map(|grid| grid.height).collect();
    }
    let mut rows = PtxRows::new(&layout, bytes, 0);
    let (starts, _, end) = find_parts(&mut rows, layout.table.n_rows, bytes.len(), progress)?;
    layout.table.starts = Starts::Parts(starts);
    layout.table.end = end;
    Ok(layout)
}

/// The extent of the line at byte `at`, without its end; `None` at the end of the file.
fn line_at(bytes: &[u8], at: usize, line_end: u8) -> Option<Span> {
    if at >= bytes.len() {
        return None;
    }
    let length = memchr::memchr(line_end, &bytes[at..]).unwrap_or(bytes.len() - at);
    Some(Span {
        start: at,
        end: at + length,
    })
}

fn n_tokens(line: &[u8]) -> usize {
    line.split(|byte| is_space(*byte))
        .filter(|word| !word.is_empty())
        .count()
}

impl PtxLayout {
    /// The next line that is not empty, from byte `at` on.
    fn line(&self, bytes: &[u8], mut at: usize) -> Option<Span> {
        loop {
            let line = line_at(bytes, at, self.line_end)?;
            if !line.of(bytes).trim_ascii().is_empty() {
                return Some(line);
            }
            at = line.end + 1;
        }
    }

    fn broken(&self, bytes: &[u8], at: usize, reason: String) -> Broken {
        Broken::new(self.place(bytes, at), reason)
    }

    /// The grid whose header begins at byte `start`, the number of values of its lines, and the byte after its last cell;
    /// `None` at the end of the file.
    fn next_grid(
        &self,
        bytes: &[u8],
        start: usize,
        progress: &dyn Progress,
    ) -> Result<Option<(Grid, Frame, usize, usize)>, Stop> {
        let Some(first) = self.line(bytes, start) else {
            return Ok(None);
        };
        let mut at = first.start;
        let mut header = [[0.0; 4]; HEADER_LINES];
        let mut lines = [Span::default(); HEADER_LINES];
        for (index, numbers) in header.iter_mut().enumerate() {
            let (n_wanted, what) = match index {
                0 => (1, "the number of columns"),
                1 => (1, "the number of rows"),
                2 => (3, "the scanner's place"),
                3..=5 => (3, "the scanner's axes"),
                _ => (4, "the matrix"),
            };
            let Some(line) = self.line(bytes, at) else {
                return Err(self
                    .broken(
                        bytes,
                        bytes.len(),
                        format!("the file ends before {what}: it is cut off, copy it again"),
                    )
                    .into());
            };
            let values: Option<Vec<f64>> = (line.of(bytes).split(|byte| is_space(*byte)))
                .filter(|word| !word.is_empty())
                .take(5)
                .map(parse)
                .collect();
            match values.filter(|values| values.len() == n_wanted && values.iter().all(|value| value.is_finite())) {
                Some(values) => numbers[..n_wanted].copy_from_slice(&values),
                None => {
                    return Err(self
                        .broken(
                            bytes,
                            line.start,
                            format!(
                                "{} where {what} belongs, {n_wanted} {}: correct the line, or the size of the grid before it",
                                quoted(line.of(bytes).trim_ascii()),
                                if n_wanted == 1 { "number" } else { "numbers" }
                            ),
                        )
                        .into());
                }
            }
            lines[index] = line;
            at = line.end + 1;
        }
        let [columns, rows] = [header[0][0], header[1][0]];
        let n_left = bytes.len() - at.min(bytes.len());
        // The end of the last line may be missing.
        let most = (n_left + 1) / LEAST_LINE;
        let is_count = |count: f64| count >= 0.0 && count.fract() == 0.0;
        if !(is_count(columns) && is_count(rows) && columns * rows <= most as f64) {
            return Err(self
                .broken(
                    bytes,
                    first.start,
                    format!(
                        "a grid of {columns} columns and {rows} rows does not fit into the {n_left} bytes after its header: \
                         the file is cut off or the size is wrong, export it again"
                    ),
                )
                .into());
        }
        let n_cells = (columns * rows) as usize;
        if self.table.n_rows + n_cells > PointCloud::MAX_POINTS {
            return Err(self
                .broken(
                    bytes,
                    first.start,
                    format!(
                        "more than the {} points that Normend can number: split the file",
                        PointCloud::MAX_POINTS
                    ),
                )
                .into());
        }
        let frame = self
            .frame(&header, (columns, rows))
            .map_err(|reason| self.broken(bytes, lines[6].start, reason))?;
        let cells = at;
        let mut n_columns = 0;
        for cell in 0..n_cells {
            if cell % (1 << 14) == 0 {
                progress.report(at as f32 / bytes.len() as f32)?;
            }
            let Some(line) = line_at(bytes, at, self.line_end) else {
                return Err(self
                    .broken(
                        bytes,
                        bytes.len(),
                        format!(
                            "the file ends after {cell} of {n_cells} cells of a grid: it is cut off, copy it again"
                        ),
                    )
                    .into());
            };
            let n_values = n_tokens(line.of(bytes));
            if cell == 0 && (COORDINATES.end..=MOST_VALUES).contains(&n_values) {
                n_columns = n_values;
            }
            if n_values == 0 || n_values != n_columns {
                return Err(self
                    .broken(
                        bytes,
                        line.start,
                        format!(
                            "{n_values} values where {} belong: correct the line, or the size of the grid",
                            if n_columns == 0 {
                                "x, y, z and intensity".to_owned()
                            } else {
                                n_columns.to_string()
                            }
                        ),
                    )
                    .into());
            }
            at = line.end + 1;
        }
        let grid = Grid {
            start,
            cells,
            n_cells,
            height: rows as usize,
            columns: Vec::new(),
        };
        Ok(Some((grid, frame, n_columns, at.min(bytes.len()))))
    }

    /// What a header says of a grid.
    fn frame(&self, header: &[[f64; 4]; HEADER_LINES], (columns, rows): (f64, f64)) -> Result<Frame, String> {
        // Vectors stand to the left of the matrix, so its lines are what glam calls columns.
        let line = |index: usize| DVec3::from_slice(&header[6 + index]);
        let matrix = DMat3::from_cols(line(0), line(1), line(2));
        let translation = line(3);
        let turn = if matrix == DMat3::IDENTITY {
            matrix
        } else {
            let unit = DMat3::from_cols(
                matrix.x_axis.normalize_or_zero(),
                matrix.y_axis.normalize_or_zero(),
                matrix.z_axis.normalize_or_zero(),
            );
            let turn = DMat3::from_quat(DQuat::from_mat3(&unit).normalize());
            // Digits are few in some files, so the axes are right only to some thousandths.
            if !turn.is_finite() || !unit.abs_diff_eq(turn, 1e-2) {
                return Err("the matrix does not turn and move, as that of a scanner does: correct it".to_owned());
            }
            turn
        };
        let named = DVec3::from_slice(&header[2]);
        let is_moved = matrix != DMat3::IDENTITY || translation != DVec3::ZERO;
        let station = if is_moved {
            Some(translation)
        } else if named != DVec3::ZERO || columns > 1.0 && rows > 1.0 {
            // Without a pose the points may be moved already, while the place tells where from. A list of points that only looks
            // like a grid was not scanned from anywhere.
            Some(named)
        } else {
            None
        };
        Ok(Frame {
            first_row: self.table.n_rows,
            name: String::new(),
            from_stored: DAffine3::from_mat3_translation(matrix, translation),
            turn,
            station,
        })
    }

    /// Finds out what the columns of each grid are, by their number and by the length of the last three.
    fn name_columns(&mut self, bytes: &[u8], n_values: &[usize]) {
        let filled = || self.grids.iter().zip(n_values).filter(|(grid, _)| grid.n_cells > 0);
        let has_normals = filled().all(|(grid, &n_values)| self.ends_with_normals(bytes, grid, n_values));
        let n_after = if has_normals { 3 } else { 0 };
        for (grid, &n_values) in self.grids.iter_mut().zip(n_values) {
            let n_own = n_values.saturating_sub(n_after);
            let n_rest = n_own.saturating_sub(COORDINATES.end);
            let mut names: Vec<String> = VALUE_NAMES[COORDINATES].iter().map(|&name| name.to_owned()).collect();
            if n_rest != 3 && n_rest > 0 {
                names.push("intensity".to_owned());
            }
            if n_rest >= 3 {
                names.extend(["red", "green", "blue"].map(str::to_owned));
            }
            let unknown = names.len()..n_own;
            names.extend(unknown.map(|column| format!("Column {}", column + 1)));
            if has_normals {
                names.extend(VALUE_NAMES[NORMAL].iter().map(|&name| name.to_owned()));
            }
            let columns = names
                .into_iter()
                .map(|name| match self.names.iter().position(|other| *other == name) {
                    Some(column) => column,
                    None => {
                        self.names.push(name);
                        self.names.len() - 1
                    }
                });
            grid.columns = columns.collect();
        }
        let n_slots = if has_normals { NORMAL.end } else { COORDINATES.end };
        for (slot, name) in VALUE_NAMES[..n_slots].iter().enumerate() {
            self.chosen[slot] = self.names.iter().position(|other| other == name);
        }
        self.table.has_normals = has_normals;
        self.table.order = (0..n_slots).collect();
    }

    /// Whether the last three values of the first cells are unit vectors.
    fn ends_with_normals(&self, bytes: &[u8], grid: &Grid, n_values: usize) -> bool {
        if n_values < COORDINATES.end + 3 {
            return false;
        }
        let mut at = grid.cells;
        for _ in 0..grid.n_cells.min(SAMPLE_CELLS) {
            let Some(line) = line_at(bytes, at, self.line_end) else {
                break;
            };
            at = line.end + 1;
            let words = line
                .of(bytes)
                .split(|byte| is_space(*byte))
                .filter(|word| !word.is_empty());
            let length: f64 = words
                .skip(n_values - 3)
                .map(|word| parse(word).unwrap_or(f64::NAN).powi(2))
                .sum();
            let is_unit = (length - 1.0).abs() < 0.01;
            if !is_unit {
                return false;
            }
        }
        true
    }

    /// Writes the lines of a part with three more values at the end of each cell.
    fn append_normals(
        &self,
        bytes: &[u8],
        part: Part,
        content: &NewContent<'_>,
        out: &mut Vec<u8>,
    ) -> Result<(), Stop> {
        let mut rows = self.rows(bytes, part.bytes.start);
        let mut done = part.bytes.start;
        let frames = self.table.frames_since_row(part.first_row);
        let points = content.normals.points_since_row(part.first_row);
        for (point, frame) in points.zip(frames).take(part.n_rows) {
            let Some(spans) = rows.next_row()? else {
                break;
            };
            let start = spans[0].start;
            let line = line_at(bytes, start, self.line_end).unwrap_or_default();
            let end = start + line.of(bytes).trim_ascii_end().len();
            out.extend_from_slice(&bytes[done..end]);
            done = end;
            let normal = point.map(|point| content.normals.normal_of(point));
            let normal = normal.map(|normal| frame.map_or(normal, |frame| frame.stored_from_normal(normal)));
            for component in normal.unwrap_or(NO_NORMAL).to_array() {
                out.push(b' ');
                ValueType::Text.write(component, out);
            }
        }
        out.extend_from_slice(&bytes[done..part.bytes.end]);
        Ok(())
    }
}

impl Layout for PtxLayout {
    fn table(&self) -> &Table {
        &self.table
    }

    fn rows<'a>(&'a self, bytes: &'a [u8], start: usize) -> Box<dyn Rows + 'a> {
        Box::new(PtxRows::new(self, bytes, start))
    }

    fn place(&self, bytes: &[u8], byte: usize) -> Place {
        Place::Line(1 + memchr::memchr_iter(self.line_end, &bytes[..byte.min(bytes.len())]).count())
    }

    fn is_point(&self, bytes: &[u8], spans: &Spans) -> bool {
        // Zero in any way of writing it has no other digit before its exponent.
        let is_zero = |span: &Span| {
            let digits = span.of(bytes).iter().take_while(|byte| !matches!(byte, b'e' | b'E'));
            !digits.into_iter().any(|byte| matches!(byte, b'1'..=b'9'))
        };
        !spans[COORDINATES].iter().all(is_zero)
    }

    fn grid_heights(&self) -> &[usize] {
        &self.heights
    }

    fn columns(&self, _bytes: &[u8]) -> Vec<Column> {
        let column = |(index, name): (usize, &String)| Column {
            name: name.clone(),
            index,
            kind: ColumnKind::Decimal,
        };
        self.names.iter().enumerate().map(column).collect()
    }

    fn column_of(&self, slot: usize) -> Option<usize> {
        self.chosen[slot]
    }

    fn with_columns(&self, columns: &[usize]) -> (Box<dyn Layout>, Vec<usize>) {
        let (chosen, slots) = slots_for(&self.chosen[COORDINATES], columns);
        let layout = Self { chosen, ..self.clone() };
        (Box::new(layout), slots)
    }

    fn can_hold_side(&self) -> bool {
        false
    }

    fn remarks(&self) -> Vec<Loss> {
        if self.table.has_normals {
            Vec::new()
        } else {
            vec![normals_remark()]
        }
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        content: &NewContent<'_>,
        out: &mut Output<'_>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        if self.table.has_normals {
            return rewrite(self, bytes, &[], content.normals, out, progress);
        }
        out.write(&bytes[..self.table.start()])?;
        for_each_part(
            self.table.n_parts(),
            progress,
            |index, out| Ok(self.append_normals(bytes, self.table.part(index), content, out)?),
            |part| out.write(part),
        )?;
        out.write(&bytes[self.table.end..])
    }
}

/// What becomes of normals in PTX.
fn normals_remark() -> Loss {
    Loss {
        what: "normals, for most other programs".to_owned(),
        why: "PTX has no place for them, so they are three more columns that few programs read; write E57 or PLY for others"
            .to_owned(),
    }
}

/// Goes through the cells of all grids.
struct PtxRows<'a> {
    layout: &'a PtxLayout,
    bytes: &'a [u8],
    at: usize,
    /// The grid that byte `at` is in, or is the end of.
    grid: usize,
    /// The slots of the values of a line of that grid.
    slots: Vec<Option<usize>>,
}

impl<'a> PtxRows<'a> {
    fn new(layout: &'a PtxLayout, bytes: &'a [u8], start: usize) -> Self {
        let next = layout.grids.partition_point(|grid| grid.start <= start);
        let mut rows = Self {
            layout,
            bytes,
            at: start,
            grid: next.saturating_sub(1),
            slots: Vec::new(),
        };
        rows.enter_grid();
        rows
    }

    fn enter_grid(&mut self) {
        let Some(grid) = self.layout.grids.get(self.grid) else {
            return;
        };
        self.at = self.at.max(grid.cells);
        let slot = |column: &usize| self.layout.chosen.iter().position(|wanted| *wanted == Some(*column));
        self.slots = grid.columns.iter().map(slot).collect();
    }
}

impl Rows for PtxRows<'_> {
    fn next_row(&mut self) -> Result<Option<Spans>, Broken> {
        while self
            .layout
            .grids
            .get(self.grid + 1)
            .is_some_and(|next| next.start <= self.at)
        {
            self.grid += 1;
            self.enter_grid();
        }
        let Some(line) = line_at(self.bytes, self.at, self.layout.line_end) else {
            return Ok(None);
        };
        self.at = (line.end + 1).min(self.bytes.len());
        let mut spans = Spans::default();
        let mut from = line.start;
        for slot in &self.slots {
            let Some(token) = next_token(self.bytes, from).filter(|token| token.end <= line.end) else {
                break;
            };
            from = token.end;
            if let Some(slot) = slot {
                spans[*slot] = token;
            }
        }
        Ok(Some(spans))
    }

    fn position(&self) -> usize {
        self.at
    }
}
