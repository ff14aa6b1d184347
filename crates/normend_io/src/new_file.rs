//! Files of points that are not a copy of the file that came in: fresh clouds, and scans in another format.
//!
//! A format writes what it can hold of a [`NewFile`], row by row, and names what it cannot ([`Loss`]).

use std::fmt;
use std::ops::Range;

use glam::{DMat3, DVec3, Vec3};
use normend_core::Progress;
use rayon::prelude::*;

use crate::columns::{Column, ColumnKind, color_byte, white};
use crate::error::{Broken, Stop, WriteError, quoted};
use crate::output::Output;
use crate::rewrite::{NO_NORMAL, RowNormals};
use crate::table::{
    COORDINATES, Frame, Layout, MOST_COLUMNS, NORMAL, PART_ROWS, Rows, SIDE, Span, VALUE_NAMES, for_each_part,
};
use crate::value::{Scalar, ValueType, push_number, push_scalar};

/// Something that a file of another format cannot hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Loss {
    /// What is lost ("12 rows of element \"face\"").
    pub what: String,
    /// Why ("PCD holds points only").
    pub why: String,
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.what, self.why)
    }
}

/// A value that the rows of a new file have besides position, normal and confidence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Field {
    /// As the source calls it.
    pub name: String,
    pub kind: ColumnKind,
    /// Which column of the source it is.
    column: usize,
}

/// A value of a row, as the source has it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell<'a> {
    pub bytes: &'a [u8],
    pub value_type: ValueType,
}

impl Cell<'_> {
    /// The number, NaN where the source has none: an empty cell, a word.
    pub fn number(&self) -> f64 {
        self.value_type.read(self.bytes).unwrap_or(f64::NAN)
    }

    /// Appends it as text: a text's as it is, a number as short as it reads back.
    pub fn push_text(&self, out: &mut Vec<u8>) {
        match self.value_type {
            ValueType::Text | ValueType::TextComma if self.bytes.is_empty() => out.extend_from_slice(b"nan"),
            ValueType::TextComma if self.value_type.read(self.bytes).is_some() => {
                out.extend(self.bytes.iter().map(|&byte| if byte == b',' { b'.' } else { byte }));
            }
            ValueType::Text | ValueType::TextComma => {
                // What separates values in this text may stand within one in another.
                let is_separator = |byte: u8| matches!(byte, b',' | b';' | b'|') || byte.is_ascii_control();
                out.extend(
                    self.bytes
                        .iter()
                        .map(|&byte| if is_separator(byte) { b'_' } else { byte }),
                );
            }
            binary => match binary.read_long(self.bytes) {
                Some(long) => out.extend_from_slice(long.to_string().as_bytes()),
                None => push_number(self.number(), binary.scalar() == Some(Scalar::Float), out),
            },
        }
    }

    /// Appends it as a little-endian number of a type that holds it: what does not fit is the nearest that does, what is no
    /// number 0 in a type of whole numbers.
    pub fn push_binary(&self, scalar: Scalar, out: &mut Vec<u8>) {
        match (self.value_type, scalar) {
            // The same bits, also of a NaN, and of whole numbers that `f64` would round.
            (ValueType::LittleEndian(own), _) if own == scalar => out.extend_from_slice(self.bytes),
            (ValueType::BigEndian(own), _) if own == scalar => out.extend(self.bytes.iter().rev()),
            _ => push_scalar(self.number(), scalar, out),
        }
    }
}

/// A row of a new file.
pub(crate) struct NewRow<'a> {
    /// In the scan's coordinates; not finite for a row that is no point.
    pub position: DVec3,
    /// The coordinates as the source has them, when these are the scan's.
    pub coordinates: Option<[Cell<'a>; 3]>,
    /// Unit, or what the source has for a row that is no point; `None` when no normals are written.
    pub normal: Option<Vec3>,
    /// In units of 1/255; `None` when it is not written.
    pub confidence: Option<u8>,
    /// The values of the fields, in their order.
    pub cells: &'a [Cell<'a>],
}

impl NewRow<'_> {
    /// Appends the coordinates as little-endian numbers of a type that holds them.
    pub fn push_binary_coordinates(&self, scalar: Scalar, out: &mut Vec<u8>) {
        match &self.coordinates {
            Some(cells) => cells.iter().for_each(|cell| cell.push_binary(scalar, out)),
            None => {
                let values = self.position.to_array();
                values.iter().for_each(|&value| push_scalar(value, scalar, out));
            }
        }
    }

    /// Appends the coordinates as text, as they are or as short as they read back, with `separator` between them.
    pub fn push_coordinates(&self, coordinates: Scalar, separator: u8, out: &mut Vec<u8>) {
        for axis in 0..3 {
            if axis > 0 {
                out.push(separator);
            }
            match &self.coordinates {
                Some(cells) => cells[axis].push_text(out),
                None => push_number(self.position[axis], coordinates == Scalar::Float, out),
            }
        }
    }
}

/// Where the positions of a new file come from.
pub(crate) enum Origin<'a> {
    /// A fresh cloud.
    Positions(&'a (dyn Fn(usize) -> DVec3 + Sync)),
    /// Another file.
    File { layout: &'a dyn Layout, bytes: &'a [u8] },
}

/// Points to be written, in order.
pub(crate) struct NewFile<'a> {
    pub n_rows: usize,
    pub origin: Origin<'a>,
    /// [`Scalar::Float`] when the coordinates lose nothing by it, else [`Scalar::Double`].
    pub coordinates: Scalar,
    pub normals: Option<RowNormals<'a>>,
    /// What else there is; a format drops what it cannot hold before it writes ([`Self::drop_fields`]).
    pub fields: Vec<Field>,
    /// One line that names program, version and rule.
    pub comment: Option<&'a str>,
}

impl<'a> NewFile<'a> {
    /// All that another file holds.
    pub fn of_file(layout: &'a dyn Layout, bytes: &'a [u8], normals: Option<RowNormals<'a>>) -> Self {
        let table = layout.table();
        let has_confidence = normals.is_some_and(RowNormals::has_confidence);
        // The columns that are written as position, normal and confidence are found by asking for the values of a row.
        let own = layout.columns(bytes).into_iter().filter(|column| {
            let written = if has_confidence {
                COORDINATES.start..SIDE.end
            } else {
                COORDINATES.start..NORMAL.end
            };
            !written
                .into_iter()
                .any(|slot| layout.column_of(slot) == Some(column.index))
        });
        Self {
            n_rows: table.n_rows,
            origin: Origin::File { layout, bytes },
            coordinates: match table.types[0].scalar() {
                Some(scalar) if table.frames.is_empty() && scalar != Scalar::Double => scalar,
                _ => Scalar::Double,
            },
            normals,
            fields: own
                .map(|Column { name, index, kind }| Field {
                    name,
                    kind,
                    column: index,
                })
                .collect(),
            comment: None,
        }
    }

    /// The frames of the source's rows; empty when its coordinates are stored as they are.
    pub fn frames(&self) -> &[Frame] {
        match self.origin {
            Origin::Positions(_) => &[],
            Origin::File { layout, .. } => &layout.table().frames,
        }
    }

    /// How many rows a column of each frame has, when frames are grids that are stored column by column; else empty.
    pub fn grid_heights(&self) -> &[usize] {
        match self.origin {
            Origin::Positions(_) => &[],
            Origin::File { layout, .. } => layout.grid_heights(),
        }
    }

    /// Whether confidence is written.
    pub fn has_confidence(&self) -> bool {
        self.normals.is_some_and(RowNormals::has_confidence)
    }

    /// Drops the fields that `why_not` gives a reason for, and returns them as losses.
    pub fn drop_fields(&mut self, why_not: impl Fn(&Field) -> Option<String>) -> Vec<Loss> {
        let mut losses = Vec::new();
        self.fields.retain(|field| match why_not(field) {
            None => true,
            Some(why) => {
                losses.push(Loss {
                    what: format!("\"{}\"", field.name),
                    why,
                });
                false
            }
        });
        losses
    }

    /// Finds the narrowest binary types for what has none: coordinates of texts and of frames, fields of decimals. Goes over
    /// all rows once.
    pub fn narrow(&mut self, progress: &dyn Progress) -> Result<(), Stop> {
        let is_needed = self.coordinates == Scalar::Double && matches!(self.origin, Origin::File { .. });
        if !is_needed && self.fields.iter().all(|field| field.kind != ColumnKind::Decimal) {
            return Ok(());
        }
        let n_parts = self.n_rows.div_ceil(PART_ROWS);
        let ranges: Vec<Result<Vec<Kinds>, Stop>> = (0..n_parts)
            .into_par_iter()
            .map(|index| {
                progress.report(index as f32 / n_parts as f32)?;
                let mut kinds = vec![Kinds::NONE; 1 + self.fields.len()];
                self.for_rows(self.rows_of_part(index), |row| {
                    row.position
                        .to_array()
                        .into_iter()
                        .for_each(|value| kinds[0].add(value));
                    for (kind, cell) in kinds[1..].iter_mut().zip(row.cells) {
                        if matches!(cell.value_type, ValueType::Text | ValueType::TextComma) {
                            kind.add(cell.number());
                        }
                    }
                })?;
                Ok(kinds)
            })
            .collect();
        let mut kinds = vec![Kinds::NONE; 1 + self.fields.len()];
        for part in ranges {
            for (kind, other) in kinds.iter_mut().zip(part?) {
                kind.join(other);
            }
        }
        if is_needed && kinds[0].survives_float {
            self.coordinates = Scalar::Float;
        }
        for (field, kind) in self.fields.iter_mut().zip(&kinds[1..]) {
            if field.kind == ColumnKind::Decimal {
                field.kind = ColumnKind::Number(kind.narrowest());
            }
        }
        Ok(())
    }

    /// What white is in three fields of colors, and whether 8 bits a channel hold them. Goes over all rows once where their type
    /// does not tell.
    pub fn color_scale(&self, colors: [usize; 3], progress: &dyn Progress) -> Result<ColorScale, Stop> {
        if colors
            .iter()
            .all(|&field| self.fields[field].kind == ColumnKind::Number(Scalar::UChar))
        {
            return Ok(ColorScale {
                white: 255.0,
                is_exact: true,
            });
        }
        // Of the channels: the largest, and whether bytes hold them if white is 1, 255 or 65535.
        type Seen = (f64, [bool; 3]);
        const WHITES: [f64; 3] = [1.0, 255.0, 65535.0];
        let is_byte = |value: f64, white: f64| {
            let byte = f64::from(color_byte(value, white));
            // Programs that write shares of 1 write at least five digits of them.
            (value / white * 255.0 - byte).abs() < 3e-3
        };
        let n_parts = self.n_rows.div_ceil(PART_ROWS);
        let seen: Vec<Result<Seen, Stop>> = (0..n_parts)
            .into_par_iter()
            .map(|index| {
                progress.report(index as f32 / n_parts as f32)?;
                let mut seen: Seen = (0.0, [true; 3]);
                self.for_rows(self.rows_of_part(index), |row| {
                    for field in colors {
                        let value = row.cells[field].number();
                        if value.is_finite() {
                            seen.0 = seen.0.max(value);
                        }
                        for (are_bytes, white) in seen.1.iter_mut().zip(WHITES) {
                            *are_bytes = *are_bytes && is_byte(value, white);
                        }
                    }
                })?;
                Ok(seen)
            })
            .collect();
        let mut all: Seen = (0.0, [true; 3]);
        for part in seen {
            let (largest, are_bytes) = part?;
            all.0 = all.0.max(largest);
            for (all, are_bytes) in all.1.iter_mut().zip(are_bytes) {
                *all &= are_bytes;
            }
        }
        let white = white(false, all.0);
        let is_exact = WHITES
            .iter()
            .zip(all.1)
            .any(|(&other, are_bytes)| other == white && are_bytes);
        Ok(ColorScale { white, is_exact })
    }

    /// The rows of a part, the unit of parallel work.
    pub fn rows_of_part(&self, index: usize) -> Range<usize> {
        index * PART_ROWS..((index + 1) * PART_ROWS).min(self.n_rows)
    }

    /// Makes the bytes of all rows in parallel and writes them in order.
    pub fn write_rows(
        &self,
        push_row: impl Fn(&NewRow<'_>, &mut Vec<u8>) + Sync,
        out: &mut Output<'_>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        for_each_part(
            self.n_rows.div_ceil(PART_ROWS),
            progress,
            |index, out| -> Result<(), WriteError> {
                Ok(self.for_rows(self.rows_of_part(index), |row| push_row(row, out))?)
            },
            |part| out.write(part),
        )
    }

    /// Hands some rows to `take`, in order; the first of them begins a part ([`PART_ROWS`]).
    pub fn for_rows(&self, range: Range<usize>, mut take: impl FnMut(&NewRow<'_>)) -> Result<(), Stop> {
        let points = self.normals.map(|normals| normals.points_since_row(range.start));
        let mut points = points.into_iter().flatten();
        let mut normal_of_row = || {
            let normals = self.normals?;
            let point = points.next().flatten();
            let confidence = match point {
                Some(point) => normals.confidence_of(point),
                // A row that is no point is not sure of anything.
                None => normals.has_confidence().then_some(0),
            };
            Some((point.map(|point| normals.normal_of(point)), confidence))
        };
        match self.origin {
            Origin::Positions(position) => {
                for row in range {
                    let (normal, confidence) = normal_of_row().unzip();
                    take(&NewRow {
                        position: position(row),
                        coordinates: None,
                        normal: normal.map(|normal| normal.unwrap_or(NO_NORMAL)),
                        confidence: confidence.flatten(),
                        cells: &[],
                    });
                }
                Ok(())
            }
            Origin::File { layout, bytes } => {
                let table = layout.table();
                let start = table.part(range.start / PART_ROWS).bytes.start;
                // Rows give a few values at a time, so as many iterators go in step as all fields need.
                let columns: Vec<usize> = self.fields.iter().map(|field| field.column).collect();
                let groups: Vec<(Box<dyn Layout>, Vec<usize>)> = columns
                    .chunks(MOST_COLUMNS)
                    .map(|group| layout.with_columns(group))
                    .collect();
                let mut own = layout.rows(bytes, start);
                let mut others: Vec<Box<dyn Rows + '_>> =
                    groups.iter().map(|(layout, _)| layout.rows(bytes, start)).collect();
                let mut frames = table.frames_since_row(range.start);
                let mut cells = Vec::with_capacity(columns.len());
                for _ in range {
                    let Some(spans) = own.next_row()? else {
                        break;
                    };
                    let cell = |span: Span, value_type: ValueType| Cell {
                        bytes: span.of(bytes),
                        value_type,
                    };
                    let coordinates: [Cell<'_>; 3] = std::array::from_fn(|axis| cell(spans[axis], table.types[axis]));
                    let mut stored = DVec3::ZERO;
                    for axis in COORDINATES {
                        stored[axis] = table.types[axis].read(coordinates[axis].bytes).ok_or_else(|| {
                            Broken::new(
                                layout.place(bytes, spans[axis].start),
                                format!(
                                    "{} is {}, which is not a number",
                                    VALUE_NAMES[axis],
                                    quoted(coordinates[axis].bytes)
                                ),
                            )
                        })?;
                    }
                    cells.clear();
                    for ((layout, slots), rows) in groups.iter().zip(&mut others) {
                        let Some(spans) = rows.next_row()? else {
                            break;
                        };
                        cells.extend(slots.iter().map(|&slot| cell(spans[slot], layout.table().types[slot])));
                    }
                    let frame = frames.next().flatten();
                    let (normal, confidence) = normal_of_row().unzip();
                    // What a row that is no point has.
                    let given = || {
                        let part = |slot: usize| table.types[slot].read(spans[slot].of(bytes));
                        let [x, y, z] = [part(NORMAL.start)?, part(NORMAL.start + 1)?, part(NORMAL.start + 2)?];
                        let given = DVec3::new(x, y, z).as_vec3();
                        let in_scan = frame.map_or(given, |frame| frame.normal_from_stored(given));
                        (table.has_normals && in_scan.is_finite()).then_some(in_scan)
                    };
                    take(&NewRow {
                        position: match layout.is_point(bytes, &spans) {
                            true => frame.map_or(stored, |frame| frame.from_stored.transform_point3(stored)),
                            false => DVec3::NAN,
                        },
                        coordinates: frame.is_none().then_some(coordinates),
                        normal: normal.map(|normal| normal.or_else(given).unwrap_or(NO_NORMAL)),
                        confidence: confidence.flatten(),
                        cells: &cells,
                    });
                }
                Ok(())
            }
        }
    }
}

/// How colors are measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ColorScale {
    pub white: f64,
    /// Whether they are multiples of a 255th of it.
    pub is_exact: bool,
}

/// Where the rows of a scan are measured from, for formats that say so: a rotation and a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pose {
    pub turn: DMat3,
    pub place: DVec3,
}

impl Pose {
    /// The pose that a frame stands for; `None` when its coordinates are only scaled and moved, and nobody stood anywhere.
    pub fn of(frame: &Frame) -> Option<Self> {
        let is_rigid = frame.from_stored.matrix3 == frame.turn;
        let is_pose = |place: &DVec3| *place != DVec3::ZERO || frame.turn != DMat3::IDENTITY;
        let moved = is_rigid.then_some(frame.from_stored.translation).filter(is_pose);
        let place = frame.station.or(moved)?;
        Some(Self {
            turn: frame.turn,
            place,
        })
    }

    /// A position of the scan in the scanner's own coordinates.
    pub fn own(&self, position: DVec3) -> DVec3 {
        self.turn.transpose() * (position - self.place)
    }
}

/// What some decimals have in common.
#[derive(Clone, Copy)]
struct Kinds {
    are_whole: bool,
    /// Whether their shortest decimals are the same in `f32` and in `f64`.
    survives_float: bool,
    min: f64,
    max: f64,
}

impl Kinds {
    const NONE: Self = Self {
        are_whole: true,
        survives_float: true,
        min: f64::INFINITY,
        max: f64::NEG_INFINITY,
    };

    fn add(&mut self, value: f64) {
        self.are_whole &= value.fract() == 0.0 && !(value == 0.0 && value.is_sign_negative());
        self.survives_float = self.survives_float && survives_float(value);
        self.min = self.min.min(value);
        self.max = self.max.max(value);
    }

    fn join(&mut self, other: Self) {
        self.are_whole &= other.are_whole;
        self.survives_float &= other.survives_float;
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }

    fn narrowest(&self) -> Scalar {
        let fits = |min: f64, max: f64| self.are_whole && min <= self.min && self.max <= max;
        if fits(0.0, f64::from(u8::MAX)) {
            Scalar::UChar
        } else if fits(0.0, f64::from(u16::MAX)) {
            Scalar::UShort
        } else if fits(f64::from(i32::MIN), f64::from(i32::MAX)) {
            Scalar::Int
        } else if fits(0.0, f64::from(u32::MAX)) {
            Scalar::UInt
        } else if self.survives_float {
            Scalar::Float
        } else {
            Scalar::Double
        }
    }
}

/// Whether a number's shortest decimal is the same in `f32` and in `f64`.
fn survives_float(value: f64) -> bool {
    let narrow = value as f32;
    // Most numbers of texts have few decimals; only those that `f32` rounds need a look at the decimals.
    f64::from(narrow) == value || !value.is_finite() || {
        let mut decimal = Vec::new();
        push_number(f64::from(narrow), true, &mut decimal);
        crate::value::parse(&decimal) == Some(value)
    }
}

/// Names for fields in a format that allows letters, digits and `_` only: others become `_`, and a name that is there already
/// gets a number. `taken` are names that the format uses itself.
pub(crate) fn plain_names(fields: &[Field], taken: &[&str]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for field in fields {
        let plain = |letter: char| if letter.is_ascii_alphanumeric() { letter } else { '_' };
        let base: String = field.name.chars().map(plain).collect();
        let mut name = base.clone();
        let mut number = 2;
        while name.is_empty() || taken.contains(&name.as_str()) || names.contains(&name) {
            name = format!("{base}_{number}");
            number += 1;
        }
        names.push(name);
    }
    names
}
