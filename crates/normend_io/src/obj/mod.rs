//! Wavefront OBJ, in and out: the points of `v` lines, with `vn` lines for normals.
//!
//! A point has the normal that a face gives it (`f 1//1`), the first one of several; where no face gives it one, and there are as
//! many normals as points, it has that of its number, as CloudCompare and MeshLab write them, unless a face gave that to another.
//! All else (faces, textures, groups, materials, comments, joined lines) is kept as it is.

mod lines;

pub(crate) mod new;

#[cfg(test)]
mod tests;

use normend_core::{PointCloud, PointCloudError, Progress};

use self::lines::{Corner, Kind, Line, Lines, resolved, words};
use crate::columns::{Column, ColumnKind, slots_for};
use crate::error::{Broken, Place, Stop, WriteError, quoted};
use crate::output::Output;
use crate::rewrite::{Change, NO_NORMAL, RowNormals};
use crate::table::{COORDINATES, Layout, N_VALUES, NORMAL, NewContent, PART_ROWS, Rows, Span, Spans, Starts, Table};
use crate::value::{ValueType, parse};

/// What begins the comment that Normend leaves in the files it writes.
const OWN_COMMENT: &[u8] = b"# Normend ";
/// Bytes that are written, and gone over between two reports, at a time.
const PIECE: usize = 1 << 20;
/// The normal of a point that has none.
const NONE: u32 = u32::MAX;

/// An OBJ file whose points and normals are known.
#[derive(Clone, Debug)]
pub(crate) struct ObjLayout {
    line_end: u8,
    /// Values of a point in the first of its lines.
    n_values: usize,
    /// The value of each slot; a normal's come after those of the point.
    columns: [Option<usize>; N_VALUES],
    /// The byte at which the line of each normal begins.
    normals: Vec<usize>,
    /// The normal of each point, [`NONE`] where it has none; empty when they are in the points' order.
    normal_of_point: Vec<u32>,
    /// Whether each normal is that of exactly one point, for all points and wherever faces refer to it.
    is_one_to_one: bool,
    /// How many there are of what is neither point nor normal, and what it is.
    others: [(usize, &'static str); 3],
    table: Table,
}

/// Whether the first lines look like those of an OBJ file.
pub(crate) fn sniff(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(1 << 12)];
    let mut lines = lines(head).filter(|line| !matches!(line.kind, Kind::Nothing | Kind::Other));
    let is_point = |line: Line| {
        let numbers = words(head, line.span).skip(1).take(3);
        line.kind == Kind::Vertex && numbers.filter(|word| parse(word.of(head)).is_some()).count() == 3
    };
    !head.contains(&0) && lines.next().is_some_and(is_point)
}

fn lines(bytes: &[u8]) -> Lines<'_> {
    let line_end = match memchr::memchr(b'\n', bytes) {
        None if memchr::memchr(b'\r', bytes).is_some() => b'\r',
        _ => b'\n',
    };
    Lines {
        bytes,
        line_end,
        // A byte order mark belongs to no line.
        at: if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 },
    }
}

/// Finds the points and normals of an OBJ file. Takes 8 bytes a normal, and 4 a point where faces refer to normals.
pub(crate) fn read(bytes: &[u8], progress: &dyn Progress) -> Result<ObjLayout, Stop> {
    let mut layout = ObjLayout {
        line_end: lines(bytes).line_end,
        n_values: 3,
        columns: [Some(0), Some(1), Some(2), None, None, None, None, None],
        normals: Vec::new(),
        normal_of_point: Vec::new(),
        is_one_to_one: false,
        others: [
            (0, "face"),
            (0, "place in a texture"),
            (0, "line of groups, materials and the like"),
        ],
        table: Table {
            n_rows: 0,
            types: [ValueType::Text; N_VALUES],
            has_normals: false,
            order: COORDINATES.collect(),
            starts: Starts::Parts(Vec::new()),
            end: 0,
            frames: Vec::new(),
        },
    };
    let mut starts = Vec::new();
    let mut n_points = 0;
    let mut next_report = 0;
    for line in lines(bytes) {
        if line.span.start >= next_report {
            progress.report(line.span.start as f32 / (2 * bytes.len()) as f32)?;
            next_report = line.span.start + PIECE;
        }
        match line.kind {
            Kind::Vertex => {
                if n_points == 0 {
                    layout.n_values = words(bytes, line.span).count() - 1;
                }
                if n_points % PART_ROWS == 0 {
                    starts.push(line.span.start);
                }
                n_points += 1;
                layout.table.end = line.after;
            }
            Kind::Normal => {
                // So that no line is remembered that is shorter than its place in memory.
                if words(bytes, line.span).count() < 4 {
                    return Err(layout.too_few(bytes, line.span).into());
                }
                layout.normals.push(line.span.start);
            }
            Kind::Corners(_) => layout.others[0].0 += 1,
            Kind::Texture => layout.others[1].0 += 1,
            Kind::Other => layout.others[2].0 += 1,
            Kind::Nothing => {}
        }
    }
    if n_points == 0 {
        return Err(Broken::whole("the file has no points (lines that begin with \"v\"): open one that has").into());
    }
    if n_points > PointCloud::MAX_POINTS || layout.normals.len() > PointCloud::MAX_POINTS {
        let n_points = n_points.max(layout.normals.len());
        return Err(Broken::whole(PointCloudError::TooMany { n_points }.to_string()).into());
    }
    layout.table.n_rows = n_points;
    layout.table.starts = Starts::Parts(starts);
    layout.find_normals(bytes, progress)?;
    Ok(layout)
}

impl ObjLayout {
    /// Finds which normal belongs to which point.
    fn find_normals(&mut self, bytes: &[u8], progress: &dyn Progress) -> Result<(), Stop> {
        let (n_points, n_normals) = (self.table.n_rows, self.normals.len());
        let mut normal_of_point = Vec::new();
        let mut is_one_to_one = n_points == n_normals;
        // Also without normals: those that are written later must not be what a face happens to name.
        if self.others[0].0 > 0 {
            let mut next_report = 0;
            let (mut n_points_before, mut n_normals_before) = (0, 0);
            for line in lines(bytes) {
                if line.span.start >= next_report {
                    progress.report(0.5 + line.span.start as f32 / (2 * bytes.len()) as f32)?;
                    next_report = line.span.start + PIECE;
                }
                let first = match line.kind {
                    Kind::Vertex => {
                        n_points_before += 1;
                        continue;
                    }
                    Kind::Normal => {
                        n_normals_before += 1;
                        continue;
                    }
                    Kind::Corners(first) => first,
                    _ => continue,
                };
                for word in words(bytes, line.span).skip(first) {
                    let corner = Corner::of(word.of(bytes));
                    if corner.normal.is_empty() {
                        continue;
                    }
                    let point = resolved(corner.point, n_points_before, n_points);
                    let normal = resolved(corner.normal, n_normals_before, n_normals);
                    let (Some(point), Some(normal)) = (point, normal) else {
                        return Err(Broken::new(
                            self.place(bytes, word.start),
                            format!(
                                "{} refers to a point or normal that is not there ({n_points} points, {n_normals} normals): \
                                 correct it, or remove the part after the last slash",
                                quoted(word.of(bytes))
                            ),
                        )
                        .into());
                    };
                    if normal_of_point.is_empty() {
                        normal_of_point = vec![NONE; n_points];
                    }
                    // Counts fit, because points and normals have ids.
                    match &mut normal_of_point[point] {
                        unknown if *unknown == NONE => *unknown = normal as u32,
                        known => is_one_to_one &= *known == normal as u32,
                    }
                }
            }
        }
        if !normal_of_point.is_empty() {
            let mut is_taken = vec![false; n_normals];
            for &normal in &normal_of_point {
                if let Some(taken) = is_taken.get_mut(normal as usize) {
                    is_one_to_one &= !std::mem::replace(taken, true);
                }
            }
            for (point, normal) in (0..).zip(&mut normal_of_point) {
                if *normal == NONE && n_points == n_normals && !is_taken[point as usize] {
                    *normal = point;
                }
                is_one_to_one &= *normal != NONE;
            }
        }
        self.table.has_normals = !normal_of_point.is_empty() || n_points == n_normals;
        if (0..)
            .zip(&normal_of_point)
            .all(|(point, &normal): (u32, _)| point == normal)
        {
            normal_of_point = Vec::new();
        }
        self.normal_of_point = normal_of_point;
        self.is_one_to_one = is_one_to_one;
        if self.table.has_normals {
            for slot in NORMAL {
                self.columns[slot] = Some(self.n_values + slot - NORMAL.start);
            }
            self.table.order = (0..NORMAL.end).collect();
        }
        Ok(())
    }

    fn too_few(&self, bytes: &[u8], line: Span) -> Broken {
        Broken::new(
            self.place(bytes, line.start),
            format!(
                "{} has not three values: correct the line",
                quoted(line.of(bytes).trim_ascii())
            ),
        )
    }

    /// The line of the normal of a point.
    fn normal_line(&self, bytes: &[u8], point: usize) -> Option<Line> {
        let normal = match self.normal_of_point.get(point) {
            Some(&normal) => normal as usize,
            None => point,
        };
        let mut lines = lines(bytes);
        lines.at = *self.normals.get(normal)?;
        lines.line_end = self.line_end;
        lines.next()
    }

    /// The values of a normal's line.
    fn components(bytes: &[u8], line: Line) -> Option<[Span; 3]> {
        let mut words = words(bytes, line.span).skip(1);
        Some([words.next()?, words.next()?, words.next()?])
    }

    /// The row of the first point at or after a byte where a part begins.
    fn row_at(&self, byte: usize) -> usize {
        match &self.table.starts {
            Starts::Parts(starts) => starts.partition_point(|&start| start < byte) * PART_ROWS,
            Starts::Stride { .. } => 0,
        }
    }
}

/// The lines with a point each.
struct ObjRows<'a> {
    layout: &'a ObjLayout,
    lines: Lines<'a>,
    row: usize,
}

impl Rows for ObjRows<'_> {
    fn next_row(&mut self) -> Result<Option<Spans>, Broken> {
        let Some(line) = self.lines.find(|line| line.kind == Kind::Vertex) else {
            return Ok(None);
        };
        let bytes = self.lines.bytes;
        let mut spans = Spans::default();
        let mut n_values = 0;
        for word in words(bytes, line.span).skip(1) {
            for (span, column) in spans.iter_mut().zip(&self.layout.columns) {
                if *column == Some(n_values) && n_values < self.layout.n_values {
                    *span = word;
                }
            }
            n_values += 1;
        }
        if n_values < COORDINATES.end {
            return Err(self.layout.too_few(bytes, line.span));
        }
        let wants_normal = |column: &Option<usize>| column.is_some_and(|column| column >= self.layout.n_values);
        if self.layout.columns.iter().any(wants_normal)
            && let Some(normal) = self.layout.normal_line(bytes, self.row)
            && let Some(components) = ObjLayout::components(bytes, normal)
        {
            for (span, column) in spans.iter_mut().zip(&self.layout.columns) {
                let component = column.and_then(|column| column.checked_sub(self.layout.n_values));
                if let Some(component) = component {
                    *span = components[component];
                }
            }
        }
        self.row += 1;
        Ok(Some(spans))
    }

    fn position(&self) -> usize {
        self.lines.at
    }
}

impl Layout for ObjLayout {
    fn table(&self) -> &Table {
        &self.table
    }

    fn rows<'a>(&'a self, bytes: &'a [u8], start: usize) -> Box<dyn Rows + 'a> {
        Box::new(ObjRows {
            layout: self,
            lines: Lines {
                bytes,
                line_end: self.line_end,
                at: start,
            },
            row: self.row_at(start),
        })
    }

    fn place(&self, bytes: &[u8], byte: usize) -> Place {
        Place::Line(1 + memchr::memchr_iter(self.line_end, &bytes[..byte]).count())
    }

    fn columns(&self, _bytes: &[u8]) -> Vec<Column> {
        let own: &[&str] = match self.n_values {
            4 => &["x", "y", "z", "w"],
            6 => &["x", "y", "z", "red", "green", "blue"],
            7 => &["x", "y", "z", "red", "green", "blue", "alpha"],
            _ => &["x", "y", "z"],
        };
        let own = own.iter().map(|&name| name.to_owned());
        let unnamed = (own.len()..self.n_values).map(|index| format!("Column {}", index + 1));
        let normal = if self.table.has_normals {
            &["nx", "ny", "nz"][..]
        } else {
            &[]
        };
        let names = own.chain(unnamed).chain(normal.iter().map(|&name| name.to_owned()));
        let column = |(index, name)| Column {
            name,
            index,
            kind: ColumnKind::Decimal,
        };
        names.enumerate().map(column).collect()
    }

    fn column_of(&self, slot: usize) -> Option<usize> {
        self.columns[slot]
    }

    fn with_columns(&self, columns: &[usize]) -> (Box<dyn Layout>, Vec<usize>) {
        let (columns, slots) = slots_for(&self.columns[COORDINATES], columns);
        let layout = Self {
            columns,
            ..self.clone()
        };
        (Box::new(layout), slots)
    }

    fn besides_rows(&self, _bytes: &[u8]) -> Vec<String> {
        let counted = |&(count, what): &(usize, &str)| match (count, what) {
            (0, _) => None,
            (1, what) => Some(format!("1 {what}")),
            (_, "place in a texture") => Some(format!("{count} places in a texture")),
            (_, "face") => Some(format!("{count} faces")),
            _ => Some(format!("{count} lines of groups, materials and the like")),
        };
        self.others.iter().filter_map(counted).collect()
    }

    fn can_hold_side(&self) -> bool {
        false
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        content: &NewContent<'_>,
        out: &mut Output<'_>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        let writer = Writer::new(self, bytes, content.normals);
        let mut lines = lines(bytes);
        let comment = [b"# ", content.comment.as_bytes()].concat();
        let has_own = lines.clone().any(|line| line.span.of(bytes).starts_with(OWN_COMMENT));
        let mut buffer = bytes[..lines.at].to_vec();
        if !has_own {
            buffer.extend_from_slice(&comment);
            buffer.extend_from_slice(writer.line_end);
        }
        let mut state = State::default();
        let mut is_commented = !has_own;
        for line in &mut lines {
            if buffer.len() >= PIECE {
                progress.report(line.span.start as f32 / bytes.len() as f32)?;
                out.write(&buffer)?;
                buffer.clear();
            }
            if !is_commented && line.span.of(bytes).starts_with(OWN_COMMENT) {
                buffer.extend_from_slice(&comment);
                buffer.extend_from_slice(&bytes[line.span.end..line.after]);
                is_commented = true;
                continue;
            }
            writer.push_line(line, &mut state, &mut buffer);
        }
        writer.push_new_normals(&mut state, &mut buffer);
        out.write(&buffer)
    }
}

/// Writes lines again with other normals.
struct Writer<'a> {
    layout: &'a ObjLayout,
    bytes: &'a [u8],
    normals: RowNormals<'a>,
    /// The point of each normal, when they are written in place; empty when they are in the points' order.
    point_of_normal: Vec<u32>,
    line_end: &'static [u8],
}

/// How many points and normals were met, and how many of the points wait for their new normals.
#[derive(Default)]
struct State {
    n_points: usize,
    n_normals: usize,
    n_waiting: usize,
}

impl<'a> Writer<'a> {
    fn new(layout: &'a ObjLayout, bytes: &'a [u8], normals: RowNormals<'a>) -> Self {
        let mut point_of_normal = Vec::new();
        if layout.is_one_to_one {
            point_of_normal = vec![0; layout.normal_of_point.len()];
            for (point, &normal) in (0..).zip(&layout.normal_of_point) {
                point_of_normal[normal as usize] = point;
            }
        }
        let first_end = memchr::memchr(layout.line_end, bytes).unwrap_or(0);
        Self {
            layout,
            bytes,
            normals,
            point_of_normal,
            line_end: match layout.line_end {
                b'\r' => b"\r",
                _ if bytes[..first_end].ends_with(b"\r") => b"\r\n",
                _ => b"\n",
            },
        }
    }

    /// Each normal in the place of the point's former one, where there is one for each point. Otherwise all former ones go, new
    /// ones stand after each run of points, in their order, and faces refer to them.
    fn push_line(&self, line: Line, state: &mut State, out: &mut Vec<u8>) {
        let whole = &self.bytes[line.span.start..line.after];
        match line.kind {
            Kind::Normal if self.layout.is_one_to_one => {
                let point = match self.point_of_normal.get(state.n_normals) {
                    Some(&point) => point as usize,
                    None => state.n_normals,
                };
                state.n_normals += 1;
                self.push_replaced(line, self.normal_of(point), out);
            }
            Kind::Normal => state.n_normals += 1,
            Kind::Vertex if !self.layout.is_one_to_one => {
                out.extend_from_slice(whole);
                if line.span.end == line.after {
                    out.extend_from_slice(self.line_end);
                }
                state.n_points += 1;
                state.n_waiting += 1;
            }
            Kind::Corners(first) if !self.layout.is_one_to_one => {
                self.push_new_normals(state, out);
                let mut done = line.span.start;
                for word in words(self.bytes, line.span).skip(first) {
                    let corner = Corner::of(word.of(self.bytes));
                    // What refers to no point stays as it is.
                    let Some(point) = resolved(corner.point, state.n_points, self.layout.table.n_rows) else {
                        continue;
                    };
                    out.extend_from_slice(&self.bytes[done..word.start]);
                    let parts: [&[u8]; 4] = [corner.point, b"/", corner.texture, b"/"];
                    parts.iter().for_each(|part| out.extend_from_slice(part));
                    out.extend_from_slice((point + 1).to_string().as_bytes());
                    done = word.end;
                }
                out.extend_from_slice(&self.bytes[done..line.after]);
            }
            _ => {
                self.push_new_normals(state, out);
                out.extend_from_slice(whole);
            }
        }
    }

    /// Appends the normals of the points that wait for them.
    fn push_new_normals(&self, state: &mut State, out: &mut Vec<u8>) {
        for point in state.n_points - state.n_waiting..state.n_points {
            let kept = || {
                let line = self.layout.normal_line(self.bytes, point)?;
                ObjLayout::components(self.bytes, line).filter(|_| self.layout.table.has_normals)
            };
            out.extend_from_slice(b"vn");
            match (self.normal_of(point), kept()) {
                (None, Some(components)) => {
                    for component in components {
                        out.push(b' ');
                        out.extend_from_slice(component.of(self.bytes));
                    }
                }
                (normal, _) => {
                    for component in normal.unwrap_or(NO_NORMAL).to_array() {
                        out.push(b' ');
                        ValueType::Text.write(component, out);
                    }
                }
            }
            out.extend_from_slice(self.line_end);
        }
        state.n_waiting = 0;
    }

    fn push_replaced(&self, line: Line, normal: Option<glam::Vec3>, out: &mut Vec<u8>) {
        let mut done = line.span.start;
        if let Some(components) = ObjLayout::components(self.bytes, line) {
            let mut spans = Spans::default();
            spans[NORMAL].copy_from_slice(&components);
            let change = Change::between(&self.layout.table.types, self.bytes, &spans, normal);
            for (component, span) in components.into_iter().enumerate() {
                out.extend_from_slice(&self.bytes[done..span.start]);
                change.write(ValueType::Text, component, span.of(self.bytes), out);
                done = span.end;
            }
        }
        out.extend_from_slice(&self.bytes[done..line.after]);
    }

    /// The new normal of a row; `None` when it is no point.
    fn normal_of(&self, row: usize) -> Option<glam::Vec3> {
        let point = self.normals.points_since_row(row).next().flatten()?;
        Some(self.normals.normal_of(point))
    }
}
