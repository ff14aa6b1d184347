//! What all formats have in common: rows of numbers, of which Normend reads six.
//!
//! A format says where the numbers of a row are ([`Rows`]); reading and rewriting work on parts of [`PART_ROWS`] rows, in
//! parallel, the same for all formats.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DVec3, Vec3};
use normend_core::{Cancelled, Progress};
use rayon::prelude::*;

use crate::error::{Broken, Place, Stop, quoted};
use crate::value::ValueType;

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
pub(crate) trait Layout: Sync {
    fn table(&self) -> &Table;

    /// The rows from byte `start` on, where a part begins.
    fn rows<'a>(&'a self, bytes: &'a [u8], start: usize) -> Box<dyn Rows + 'a>;

    /// The place of a byte for messages.
    fn place(&self, bytes: &[u8], byte: usize) -> Place;

    /// Whether this byte separates values in text.
    fn is_separator(&self, byte: u8) -> bool {
        is_space(byte)
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

/// The values of all rows, finite or not.
pub(crate) struct Values {
    pub positions: Vec<DVec3>,
    /// Zero where a component is not finite; `None` without normals.
    pub normals: Option<Vec<Vec3>>,
}

/// Reads the values of all rows, in parallel.
pub(crate) fn read_values(layout: &dyn Layout, bytes: &[u8], progress: &dyn Progress) -> Result<Values, Stop> {
    let table = layout.table();
    let mut positions = vec![DVec3::ZERO; table.n_rows];
    let mut normals = vec![Vec3::ZERO; if table.has_normals { table.n_rows } else { 0 }];
    let n_done = AtomicUsize::new(0);
    let read = |index: usize, positions: &mut [DVec3], normals: &mut [Vec3]| -> Result<(), Stop> {
        // Before the work, because every part is begun, also when another one stopped.
        progress.report(n_done.load(Ordering::Relaxed) as f32 / table.n_parts() as f32)?;
        let part = table.part(index);
        let mut rows = layout.rows(bytes, part.bytes.start);
        for row in 0..part.n_rows {
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
            positions[row] = DVec3::new(value(0)?, value(1)?, value(2)?);
            if table.has_normals {
                let normal = Vec3::new(value(3)? as f32, value(4)? as f32, value(5)? as f32);
                normals[row] = if normal.is_finite() { normal } else { Vec3::ZERO };
            }
        }
        n_done.fetch_add(1, Ordering::Relaxed);
        Ok(())
    };
    let results: Vec<Result<(), Stop>> = if table.has_normals {
        positions
            .par_chunks_mut(PART_ROWS)
            .zip(normals.par_chunks_mut(PART_ROWS))
            .enumerate()
            .map(|(index, (positions, normals))| read(index, positions, normals))
            .collect()
    } else {
        let chunks = positions.par_chunks_mut(PART_ROWS).enumerate();
        chunks
            .map(|(index, positions)| read(index, positions, &mut []))
            .collect()
    };
    // The first error in the file's order, whichever thread met one first.
    results.into_iter().collect::<Result<(), Stop>>()?;
    Ok(Values {
        positions,
        normals: table.has_normals.then_some(normals),
    })
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
