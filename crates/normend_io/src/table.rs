//! What all formats have in common: rows of numbers, of which Normend reads six.
//!
//! A format says where the numbers of a row are ([`Rows`]); reading and rewriting work on parts of [`PART_ROWS`] rows, in
//! parallel, the same for all formats.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use glam::{DAffine3, DMat3, DVec3, Vec3};
use normend_core::{Cancelled, PointCloud, PointCloudError, Progress};
use rayon::prelude::*;

use crate::columns::Column;
use crate::error::{Broken, Place, Stop, WriteError, quoted};
use crate::new_file::Loss;
use crate::output::Output;
use crate::rewrite::RowNormals;
use crate::value::ValueType;
use crate::xyz::XyzLayout;

/// Rows of a part: the unit of parallel work.
pub(crate) const PART_ROWS: usize = 1 << 14;

/// What separates values in any text.
pub(crate) fn is_space(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\n' | b'\r' | 0x0b | 0x0c)
}

/// The next run of bytes that are no spaces, from byte `at` on.
#[inline]
pub(crate) fn next_token(bytes: &[u8], at: usize) -> Option<Span> {
    let start = at + bytes[at..].iter().position(|byte| !is_space(*byte))?;
    let length = bytes[start..]
        .iter()
        .position(|byte| is_space(*byte))
        .unwrap_or(bytes.len() - start);
    Some(Span {
        start,
        end: start + length,
    })
}

/// Names of the values of a row that are read or written, in the order of [`Spans`]. The last two are only written: how sure
/// the normal is of its side, and whether that is more than nothing.
pub(crate) const VALUE_NAMES: [&str; N_VALUES] = ["x", "y", "z", "nx", "ny", "nz", "confidence", "oriented"];
/// The number of such values.
pub(crate) const N_VALUES: usize = 8;
/// Which of them are coordinates.
pub(crate) const COORDINATES: Range<usize> = 0..3;
/// Which of them are a normal's.
pub(crate) const NORMAL: Range<usize> = 3..6;
/// Which of them are about the normal's side.
pub(crate) const SIDE: Range<usize> = 6..8;

/// A range of bytes of the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Span {
    pub start: usize,
    pub end: usize,
}

impl Span {
    pub fn of(self, bytes: &[u8]) -> &[u8] {
        &bytes[self.start..self.end]
    }
}

/// Where a row has each value; empty where it does not.
pub(crate) type Spans = [Span; N_VALUES];

/// Goes through the rows of a file.
pub(crate) trait Rows {
    /// The next row; `None` where the format says that there are no more.
    fn next_row(&mut self) -> Result<Option<Spans>, Broken>;

    /// The byte after the last row, where the next may begin.
    fn position(&self) -> usize;
}

/// The rows of a file: how many, of what, and where every [`PART_ROWS`]th begins.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    pub n_rows: usize,
    /// Types of the values, by slot.
    pub types: [ValueType; N_VALUES],
    pub has_normals: bool,
    /// The slots that rows have, in the order in which they stand there.
    pub order: Vec<usize>,
    pub starts: Starts,
    /// The byte after the last row.
    pub end: usize,
    /// The frames that rows are measured in, ascending and without gaps from row 0 on; empty when what is stored is the
    /// scan's coordinates.
    pub frames: Vec<Frame>,
}

/// Some rows that were measured from one place, or are stored in coordinates of their own.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub first_row: usize,
    /// What the file calls it; may be empty.
    pub name: String,
    /// From what is stored to the scan's coordinates.
    pub from_stored: DAffine3,
    /// The same for directions: a rotation.
    pub turn: DMat3,
    /// Where the scanner stood, in the scan's coordinates, if the file says so.
    pub station: Option<DVec3>,
}

impl Frame {
    /// Rows from `first_row` on that are stored as they are.
    pub fn plain(first_row: usize) -> Self {
        Self {
            first_row,
            name: String::new(),
            from_stored: DAffine3::IDENTITY,
            turn: DMat3::IDENTITY,
            station: None,
        }
    }

    fn is_turned(&self) -> bool {
        self.turn != DMat3::IDENTITY
    }

    /// A stored direction in the scan's coordinates.
    pub fn normal_from_stored(&self, normal: Vec3) -> Vec3 {
        if self.is_turned() {
            (self.turn * normal.as_dvec3()).as_vec3()
        } else {
            normal
        }
    }

    /// A direction in the scan's coordinates as it is stored.
    pub fn stored_from_normal(&self, normal: Vec3) -> Vec3 {
        if self.is_turned() {
            (self.turn.transpose() * normal.as_dvec3()).as_vec3()
        } else {
            normal
        }
    }
}

/// Where rows begin.
#[derive(Clone, Debug)]
pub(crate) enum Starts {
    /// Rows of `stride` bytes, the first at `first`.
    Stride { first: usize, stride: usize },
    /// The byte at which each part begins.
    Parts(Vec<usize>),
}

/// Some neighboring rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub first_row: usize,
    pub n_rows: usize,
    pub bytes: Span,
}

impl Table {
    /// Whether rows have the value of a slot.
    pub fn has(&self, slot: usize) -> bool {
        self.order.contains(&slot)
    }

    /// The slot after which new values go: the last of the normal, or of the coordinates where there is none.
    pub fn anchor(&self) -> usize {
        let range = if self.has_normals { NORMAL } else { COORDINATES };
        let last = self.order.iter().rev().find(|&&slot| range.contains(&slot));
        last.copied().unwrap_or(2)
    }

    /// The frame of each row from `first_row` on, without end; `None` for rows that are stored as they are.
    pub fn frames_since_row(&self, first_row: usize) -> impl Iterator<Item = Option<&Frame>> {
        let mut next = self.frames.partition_point(|frame| frame.first_row <= first_row);
        (first_row..).map(move |row| {
            // More than one frame may begin at a row: those without rows are passed over.
            while self.frames.get(next).is_some_and(|frame| frame.first_row <= row) {
                next += 1;
            }
            self.frames.get(next.checked_sub(1)?)
        })
    }

    pub fn n_parts(&self) -> usize {
        self.n_rows.div_ceil(PART_ROWS)
    }

    pub fn part(&self, index: usize) -> Part {
        let first_row = index * PART_ROWS;
        let n_rows = PART_ROWS.min(self.n_rows - first_row);
        let end = if index + 1 == self.n_parts() {
            self.end
        } else {
            self.start_of_part(index + 1)
        };
        Part {
            first_row,
            n_rows,
            bytes: Span {
                start: self.start_of_part(index),
                end,
            },
        }
    }

    /// The byte where the first row begins.
    pub fn start(&self) -> usize {
        if self.n_rows == 0 {
            self.end
        } else {
            self.start_of_part(0)
        }
    }

    fn start_of_part(&self, index: usize) -> usize {
        match &self.starts {
            Starts::Stride { first, stride } => first + index * PART_ROWS * stride,
            Starts::Parts(starts) => starts[index],
        }
    }
}

/// A format's knowledge of one file.
pub(crate) trait Layout: Send + Sync {
    fn table(&self) -> &Table;

    /// The rows from byte `start` on, where a part begins.
    fn rows<'a>(&'a self, bytes: &'a [u8], start: usize) -> Box<dyn Rows + 'a>;

    /// The place of a byte for messages.
    fn place(&self, bytes: &[u8], byte: usize) -> Place;

    /// Whether a row is a point, as far as the format says; one that is not counts as one without finite coordinates.
    fn is_point(&self, _bytes: &[u8], _spans: &Spans) -> bool {
        true
    }

    /// How many rows a column of each frame has, when frames are grids that are stored column by column; empty when they are not.
    fn grid_heights(&self) -> &[usize] {
        &[]
    }

    /// Whether this byte separates values in text.
    fn is_separator(&self, byte: u8) -> bool {
        is_space(byte)
    }

    /// All values of a row but lists, in the file's order, coordinates and normals among them.
    fn columns(&self, bytes: &[u8]) -> Vec<Column>;

    /// The column that holds the value of a slot.
    fn column_of(&self, slot: usize) -> Option<usize>;

    /// The same rows with other values: the coordinates, and some columns, at most [`MOST_COLUMNS`]. Returns the slots of these.
    fn with_columns(&self, columns: &[usize]) -> (Box<dyn Layout>, Vec<usize>);

    /// Columns that hold red, green and blue without saying so.
    fn unnamed_colors(&self, _bytes: &[u8]) -> Option<[usize; 3]> {
        None
    }

    /// The layout as that of a text with columns.
    fn as_text(&self) -> Option<&XyzLayout> {
        None
    }

    /// What the file holds that is no value of a row, in words ("12 rows of element \"face\"").
    fn besides_rows(&self, _bytes: &[u8]) -> Vec<String> {
        Vec::new()
    }

    /// What is to be known of a file that is written again, though it keeps everything.
    fn remarks(&self) -> Vec<Loss> {
        Vec::new()
    }

    /// Whether confidence can be written.
    fn can_hold_side(&self) -> bool;

    /// Writes the file again as it is, packed or not as the target's name says; `None` for formats of one kind.
    fn copy(&self, _bytes: &[u8], _out: &mut Output<'_>, _progress: &dyn Progress) -> Option<Result<(), WriteError>> {
        None
    }

    /// Writes the file again with other normals and nothing else changed.
    fn rewrite(
        &self,
        bytes: &[u8],
        content: &NewContent<'_>,
        out: &mut Output<'_>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError>;
}

/// What is new in a file that is written again.
#[derive(Clone, Copy)]
pub(crate) struct NewContent<'a> {
    pub normals: RowNormals<'a>,
    /// One line that names program, version and rule.
    pub comment: &'a str,
}

/// The most columns besides the coordinates that rows can give at a time.
pub(crate) const MOST_COLUMNS: usize = N_VALUES - COORDINATES.end;

/// Rows that all have the same size and their values at the same places.
pub(crate) struct FixedRows {
    at: usize,
    stride: usize,
    offsets: Spans,
}

impl FixedRows {
    /// Rows of `stride` bytes from byte `start` on; `offsets` are the values' bytes within a row.
    pub fn new(start: usize, stride: usize, offsets: Spans) -> Self {
        Self {
            at: start,
            stride,
            offsets,
        }
    }
}

impl Rows for FixedRows {
    #[inline]
    fn next_row(&mut self) -> Result<Option<Spans>, Broken> {
        let at = self.at;
        self.at += self.stride;
        Ok(Some(self.offsets.map(|span| Span {
            start: at + span.start,
            end: at + span.end,
        })))
    }

    fn position(&self) -> usize {
        self.at
    }
}

/// Goes once through up to `most` rows to find where the parts begin. Returns these, the number of rows and the end.
pub(crate) fn find_parts(
    rows: &mut dyn Rows,
    most: usize,
    n_bytes: usize,
    progress: &dyn Progress,
) -> Result<(Vec<usize>, usize, usize), Stop> {
    let mut starts = Vec::new();
    let mut n_rows = 0;
    while n_rows < most {
        let start = rows.position();
        if rows.next_row()?.is_none() {
            break;
        }
        if n_rows % PART_ROWS == 0 {
            starts.push(start);
            progress.report(start as f32 / n_bytes as f32)?;
        }
        n_rows += 1;
    }
    Ok((starts, n_rows, rows.position()))
}

/// The points of a file.
pub(crate) struct Points {
    pub cloud: PointCloud,
    /// By point, zero where a component is not finite; `None` where there is none but zeros.
    pub normals: Option<Vec<Vec3>>,
    /// The row of each point, ascending; `None` when every row is a point.
    pub rows: Option<Vec<u32>>,
}

/// What is known of a part's rows before they are stored.
#[derive(Clone, Copy)]
struct Summary {
    n_finite: usize,
    min: DVec3,
    max: DVec3,
}

/// Reads the rows whose coordinates are finite, in parallel. Goes over the rows twice, first to find the origin and what is
/// finite, so that nothing is kept but what is returned.
pub(crate) fn read_points(layout: &dyn Layout, bytes: &[u8], progress: &dyn Progress) -> Result<Points, Stop> {
    let table = layout.table();
    let n_done = AtomicUsize::new(0);
    // Before the work, because every part is begun, also when another one stopped.
    let report = || progress.report(n_done.fetch_add(1, Ordering::Relaxed) as f32 / (2 * table.n_parts()) as f32);
    let summaries: Vec<Result<Summary, Stop>> = (0..table.n_parts())
        .into_par_iter()
        .map(|index| {
            report()?;
            let mut summary = Summary {
                n_finite: 0,
                min: DVec3::INFINITY,
                max: DVec3::NEG_INFINITY,
            };
            read_part(layout, bytes, table.part(index), |_, position, _| {
                if position.is_finite() {
                    summary.n_finite += 1;
                    summary.min = summary.min.min(position);
                    summary.max = summary.max.max(position);
                }
            })?;
            Ok(summary)
        })
        .collect();
    // The first error in the file's order, whichever thread met one first.
    let summaries = summaries.into_iter().collect::<Result<Vec<Summary>, Stop>>()?;
    let n_points = summaries.iter().map(|summary| summary.n_finite).sum();
    if n_points == 0 {
        return Err(Broken::whole("no point has finite coordinates: export the file again").into());
    }
    let unfit = |error: PointCloudError| Stop::from(Broken::whole(error.to_string()));
    let min = summaries.iter().fold(DVec3::INFINITY, |min, part| min.min(part.min));
    let max = summaries
        .iter()
        .fold(DVec3::NEG_INFINITY, |max, part| max.max(part.max));
    let origin = PointCloud::origin_for(min, max).map_err(unfit)?;

    let has_rows = n_points < table.n_rows;
    let mut positions = vec![Vec3::ZERO; n_points];
    let mut normals = vec![Vec3::ZERO; if table.has_normals { n_points } else { 0 }];
    let mut rows = vec![0_u32; if has_rows { n_points } else { 0 }];
    let mut parts = Vec::with_capacity(summaries.len());
    let (mut positions_left, mut normals_left, mut rows_left) = (&mut positions[..], &mut normals[..], &mut rows[..]);
    for (index, summary) in summaries.iter().enumerate() {
        let n_finite = summary.n_finite;
        let (part_positions, rest) = positions_left.split_at_mut(n_finite);
        positions_left = rest;
        let (part_normals, rest) = normals_left.split_at_mut(if table.has_normals { n_finite } else { 0 });
        normals_left = rest;
        let (part_rows, rest) = rows_left.split_at_mut(if has_rows { n_finite } else { 0 });
        rows_left = rest;
        parts.push((index, part_positions, part_normals, part_rows));
    }
    let is_rounded = AtomicBool::new(false);
    let results: Vec<Result<(), Stop>> = parts
        .into_par_iter()
        .map(|(index, positions, normals, rows)| {
            report()?;
            let mut point = 0;
            let mut lacks = false;
            read_part(layout, bytes, table.part(index), |row, position, normal| {
                if !position.is_finite() {
                    return;
                }
                positions[point] = (position - origin).as_vec3();
                lacks |= positions[point].as_dvec3() != position - origin;
                if let Some(slot) = normals.get_mut(point) {
                    *slot = if normal.is_finite() { normal } else { Vec3::ZERO };
                }
                if let Some(slot) = rows.get_mut(point) {
                    // Row numbers fit, because no layout has more rows than ids.
                    *slot = row as u32;
                }
                point += 1;
            })?;
            if lacks {
                is_rounded.store(true, Ordering::Relaxed);
            }
            Ok(())
        })
        .collect();
    results.into_iter().collect::<Result<(), Stop>>()?;
    let mut cloud = PointCloud::new(origin, positions).map_err(unfit)?;
    if is_rounded.into_inner() && cloud.is_coarse() {
        let n_finite = summaries.iter().map(|summary| summary.n_finite);
        let remainders = read_remainders(layout, bytes, &cloud, n_finite, progress)?;
        cloud = cloud.with_remainders(remainders);
    }
    Ok(Points {
        cloud,
        // Programs that know no normals write zeros where the format has a place for them, as in Gaussian splats.
        normals: Some(normals).filter(|normals| normals.par_iter().any(|normal| *normal != Vec3::ZERO)),
        rows: has_rows.then_some(rows),
    })
}

/// The coordinates of one row, in the scan's; `None` where they cannot be read. O([`PART_ROWS`]) at most.
pub(crate) fn read_place(layout: &dyn Layout, bytes: &[u8], row: usize) -> Option<DVec3> {
    let table = layout.table();
    if row >= table.n_rows {
        return None;
    }
    let mut part = table.part(row / PART_ROWS);
    part.n_rows = row - part.first_row + 1;
    let mut place = None;
    let read = read_part(layout, bytes, part, |_, position, _| place = Some(position));
    read.ok().and(place)
}

/// Reads the coordinates once more for what `f32` rounds away of them; `n_finite` are the points of each part.
fn read_remainders(
    layout: &dyn Layout,
    bytes: &[u8],
    cloud: &PointCloud,
    n_finite: impl Iterator<Item = usize>,
    progress: &dyn Progress,
) -> Result<Vec<[i8; 3]>, Stop> {
    let mut remainders = vec![[0; 3]; cloud.n_points()];
    let mut parts = Vec::new();
    let (mut left, mut first) = (&mut remainders[..], 0);
    for (index, n_finite) in n_finite.enumerate() {
        let (part, rest) = left.split_at_mut(n_finite);
        parts.push((index, first, part));
        left = rest;
        first += n_finite;
    }
    let results: Vec<Result<(), Stop>> = parts
        .into_par_iter()
        .map(|(index, first, remainders)| {
            progress.report(1.0)?;
            let mut points = remainders.iter_mut().zip(first..);
            read_part(layout, bytes, layout.table().part(index), |_, position, _| {
                if position.is_finite()
                    && let Some((remainder, point)) = points.next()
                {
                    *remainder = cloud.remainder(point, position);
                }
            })
        })
        .collect();
    results.into_iter().collect::<Result<(), Stop>>()?;
    Ok(remainders)
}

/// Hands row, position and normal (zero where there is none) of each row of a part to `take`, in the scan's coordinates.
fn read_part(
    layout: &dyn Layout,
    bytes: &[u8],
    part: Part,
    mut take: impl FnMut(usize, DVec3, Vec3),
) -> Result<(), Stop> {
    let table = layout.table();
    let mut rows = layout.rows(bytes, part.bytes.start);
    let mut frames = table.frames_since_row(part.first_row);
    for row in part.first_row..part.first_row + part.n_rows {
        let Some(spans) = rows.next_row()? else {
            break;
        };
        let value = |slot: usize| -> Result<f64, Broken> {
            let token = spans[slot].of(bytes);
            table.types[slot].read(token).ok_or_else(|| {
                Broken::new(
                    layout.place(bytes, spans[slot].start),
                    format!(
                        "{} is {}, which is not a number: correct it",
                        VALUE_NAMES[slot],
                        quoted(token)
                    ),
                )
            })
        };
        let mut position = DVec3::new(value(0)?, value(1)?, value(2)?);
        let mut normal = Vec3::ZERO;
        if table.has_normals {
            // Nothing in the place of a normal is none.
            let component = |slot: usize| match spans[slot].start == spans[slot].end {
                true => Ok(0.0),
                false => value(slot).map(|value| value as f32),
            };
            normal = Vec3::new(component(3)?, component(4)?, component(5)?);
        }
        if let Some(frame) = frames.next().flatten() {
            position = frame.from_stored.transform_point3(position);
            normal = frame.normal_from_stored(normal);
        }
        if !layout.is_point(bytes, &spans) {
            position = DVec3::NAN;
        }
        take(row, position, normal);
    }
    Ok(())
}

/// Makes the bytes of each part in parallel and hands them to `sink` in order.
pub(crate) fn for_each_part<E: From<Cancelled> + Send>(
    n_parts: usize,
    progress: &dyn Progress,
    make: impl Fn(usize, &mut Vec<u8>) -> Result<(), E> + Sync,
    mut sink: impl FnMut(&[u8]) -> Result<(), E>,
) -> Result<(), E> {
    // Enough parts at a time to keep all threads busy, few enough that they take little memory.
    let n_together = 4 * rayon::current_num_threads();
    let mut buffers = vec![Vec::new(); n_together.min(n_parts)];
    for first in (0..n_parts).step_by(n_together) {
        let n_now = n_together.min(n_parts - first);
        let results: Vec<Result<(), E>> = buffers[..n_now]
            .par_iter_mut()
            .enumerate()
            .map(|(index, buffer)| {
                buffer.clear();
                make(first + index, buffer)
            })
            .collect();
        for (result, buffer) in results.into_iter().zip(&buffers) {
            result?;
            sink(buffer)?;
        }
        progress.report((first + n_now) as f32 / n_parts as f32)?;
    }
    Ok(())
}
