//! Points in a new E57 file: a scan for each frame of the source, each value by E57's name or in a namespace of its own.

use std::collections::VecDeque;
use std::io;

use e57::{E57Writer, Extension, Quaternion, RawValues, Record, RecordDataType, RecordName, RecordValue};
use e57::{Transform, Translation};
use glam::{DQuat, DVec3, Vec3};
use normend_core::confidence::UNDECIDED;
use normend_core::progress::Part;
use normend_core::{PointCloud, Progress};
use rayon::prelude::*;

use super::metadata::{NORMALS_URI, OWN_URI};
use crate::columns::{COLOR_NAMES, ColumnKind, INTENSITY_NAMES};
use crate::error::{Stop, WriteError};
use crate::new_file::{Cell, Loss, NewFile, NewRow, Pose, plain_names};
use crate::output::Output;
use crate::rewrite::share_of;
use crate::table::{Frame, PART_ROWS, SIDE, VALUE_NAMES};
use crate::value::Scalar;

/// The most values besides place and normal: rows of more do not fit into packets.
const MOST_FIELDS: usize = 800;

/// Whole numbers go from the opposite of this on, up to it: the crate subtracts them without room for more.
const WIDEST: i64 = 1 << 62;

/// Drops what E57 cannot hold.
pub(crate) fn limit(file: &mut NewFile<'_>) -> Vec<Loss> {
    let mut losses =
        file.drop_fields(|field| (field.kind == ColumnKind::Words).then(|| "E57 holds numbers, not words".into()));
    let names: Vec<String> = file
        .fields
        .iter()
        .skip(MOST_FIELDS)
        .map(|field| field.name.clone())
        .collect();
    losses.extend(file.drop_fields(|field| {
        names
            .contains(&field.name)
            .then(|| format!("E57 holds at most {MOST_FIELDS} values of a point here"))
    }));
    losses
}

/// What of the values decides how they are declared.
#[derive(Clone)]
struct Ranges {
    has_gaps: bool,
    /// The least and largest finite value of each field.
    of_fields: Vec<(f64, f64)>,
}

impl Ranges {
    fn join(mut self, other: &Self) -> Self {
        self.has_gaps |= other.has_gaps;
        for (range, other) in self.of_fields.iter_mut().zip(&other.of_fields) {
            *range = (range.0.min(other.0), range.1.max(other.1));
        }
        self
    }
}

fn ranges(file: &NewFile<'_>, progress: &dyn Progress) -> Result<Ranges, Stop> {
    let n_parts = file.n_rows.div_ceil(PART_ROWS);
    let none = Ranges {
        has_gaps: false,
        of_fields: vec![(f64::INFINITY, f64::NEG_INFINITY); file.fields.len()],
    };
    let parts: Vec<Result<Ranges, Stop>> = (0..n_parts)
        .into_par_iter()
        .map(|index| {
            progress.report(index as f32 / n_parts as f32)?;
            let mut ranges = none.clone();
            file.for_rows(file.rows_of_part(index), |row| {
                ranges.has_gaps |= !row.position.is_finite();
                for ((min, max), cell) in ranges.of_fields.iter_mut().zip(row.cells) {
                    let value = cell.number();
                    if value.is_finite() {
                        *min = min.min(value);
                        *max = max.max(value);
                    }
                }
            })?;
            Ok(ranges)
        })
        .collect();
    let mut joined = none;
    for part in parts {
        joined = joined.join(&part?);
    }
    Ok(joined)
}

/// A pose as E57 has it.
fn transform(pose: &Pose) -> Transform {
    let mut turn = DQuat::from_mat3(&pose.turn);
    // The standard asks for a scalar part that is not negative.
    if turn.w < 0.0 {
        turn = -turn;
    }
    Transform {
        rotation: Quaternion {
            w: turn.w,
            x: turn.x,
            y: turn.y,
            z: turn.z,
        },
        translation: Translation {
            x: pose.place.x,
            y: pose.place.y,
            z: pose.place.z,
        },
    }
}

/// How the rows are declared and made.
struct Rows<'a> {
    file: &'a NewFile<'a>,
    frames: Vec<(Frame, Option<Pose>)>,
    prototype: Vec<Record>,
    has_gaps: bool,
    is_single: bool,
}

fn whole(min: i64, max: i64) -> RecordDataType {
    RecordDataType::Integer { min, max }
}

fn own(name: impl Into<String>) -> RecordName {
    RecordName::Unknown {
        namespace: "normend".to_owned(),
        name: name.into(),
    }
}

/// The type of a field; of floats, with the range of their values.
fn field_type(kind: ColumnKind, (min, max): (f64, f64)) -> RecordDataType {
    let is_known = min <= max;
    match kind {
        ColumnKind::Number(Scalar::Char) => whole(i8::MIN.into(), i8::MAX.into()),
        ColumnKind::Number(Scalar::UChar) => whole(0, u8::MAX.into()),
        ColumnKind::Number(Scalar::Short) => whole(i16::MIN.into(), i16::MAX.into()),
        ColumnKind::Number(Scalar::UShort) => whole(0, u16::MAX.into()),
        ColumnKind::Number(Scalar::Int) => whole(i32::MIN.into(), i32::MAX.into()),
        ColumnKind::Number(Scalar::UInt) => whole(0, u32::MAX.into()),
        ColumnKind::Number(Scalar::Long | Scalar::ULong) => whole(-WIDEST, WIDEST - 1),
        ColumnKind::Number(Scalar::Float) => RecordDataType::Single {
            min: is_known.then_some(min as f32),
            max: is_known.then_some(max as f32),
        },
        ColumnKind::Number(Scalar::Double) | ColumnKind::Decimal | ColumnKind::Words => RecordDataType::Double {
            min: is_known.then_some(min),
            max: is_known.then_some(max),
        },
    }
}

impl<'a> Rows<'a> {
    fn new(file: &'a NewFile<'a>, ranges: &Ranges) -> Self {
        let mut frames: Vec<(Frame, Option<Pose>)> = file
            .frames()
            .iter()
            .map(|frame| (frame.clone(), Pose::of(frame)))
            .collect();
        if frames.is_empty() {
            frames.push((Frame::plain(0), None));
        }
        let is_single = file.coordinates == Scalar::Float && frames.iter().all(|(_, pose)| pose.is_none());
        let place = |name: RecordName| Record {
            name,
            data_type: match is_single {
                true => RecordDataType::Single { min: None, max: None },
                false => RecordDataType::Double { min: None, max: None },
            },
        };
        let mut prototype: Vec<Record> = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ]
            .map(place)
            .into();
        let mut add = |name, data_type| prototype.push(Record { name, data_type });
        if ranges.has_gaps {
            add(RecordName::CartesianInvalidState, whole(0, 2));
        }
        // Cells of grids are counted as E57 counts them.
        if !file.grid_heights().is_empty() {
            let last = PointCloud::MAX_POINTS as i64;
            add(RecordName::RowIndex, whole(0, last));
            add(RecordName::ColumnIndex, whole(0, last));
        }
        let share = |min| RecordDataType::Single {
            min: Some(min),
            max: Some(1.0),
        };
        if file.normals.is_some() {
            for name in ["normalX", "normalY", "normalZ"] {
                let name = RecordName::Unknown {
                    namespace: "nor".to_owned(),
                    name: name.to_owned(),
                };
                add(name, share(-1.0));
            }
        }
        if file.has_confidence() {
            add(own("confidence"), share(0.0));
            add(own("oriented"), whole(0, 1));
        }
        let names = field_names(file);
        for ((field, name), &range) in file.fields.iter().zip(names).zip(&ranges.of_fields) {
            let range = match name {
                // The range of colors is that of the display, not of what is in the scan.
                RecordName::ColorRed | RecordName::ColorGreen | RecordName::ColorBlue => (0.0, white(file, ranges)),
                _ => range,
            };
            add(name, field_type(field.kind, range));
        }
        Self {
            file,
            frames,
            prototype,
            has_gaps: ranges.has_gaps,
            is_single,
        }
    }

    /// The row range of a frame's successor begins where its own ends.
    fn n_rows_of(&self, frame: usize) -> usize {
        let end = self
            .frames
            .get(frame + 1)
            .map_or(self.file.n_rows, |(next, _)| next.first_row);
        end - self.frames[frame].0.first_row
    }

    fn frame_of(&self, row: usize) -> usize {
        let next = self.frames.partition_point(|(frame, _)| frame.first_row <= row);
        next.saturating_sub(1)
    }

    /// The values of the rows of a part, in the order of the prototype.
    fn part(&self, index: usize) -> Result<Vec<RawValues>, Stop> {
        let range = self.file.rows_of_part(index);
        let mut rows = Vec::with_capacity(range.len());
        let mut row_index = range.start;
        self.file.for_rows(range, |row| {
            rows.push(self.values(row, row_index));
            row_index += 1;
        })?;
        Ok(rows)
    }

    fn values(&self, row: &NewRow<'_>, row_index: usize) -> RawValues {
        let frame_index = self.frame_of(row_index);
        let (frame, pose) = &self.frames[frame_index];
        let mut values = RawValues::with_capacity(self.prototype.len());
        let is_point = row.position.is_finite();
        let own = match (is_point, pose) {
            (true, Some(pose)) => pose.own(row.position),
            (true, None) => row.position,
            (false, _) => DVec3::ZERO,
        };
        values.extend(own.to_array().map(|value| match self.is_single {
            true => RecordValue::Single(value as f32),
            false => RecordValue::Double(value),
        }));
        if self.has_gaps {
            values.push(RecordValue::Integer(if is_point { 0 } else { 2 }));
        }
        if let Some(&height) = self.file.grid_heights().get(frame_index) {
            let cell = row_index - frame.first_row;
            let height = height.max(1);
            values.push(RecordValue::Integer((cell % height) as i64));
            values.push(RecordValue::Integer((cell / height) as i64));
        }
        if let Some(normal) = row.normal {
            let normal = match pose {
                Some(_) if is_point => frame.stored_from_normal(normal),
                _ => normal,
            };
            values.extend((normal + Vec3::ZERO).to_array().map(RecordValue::Single));
        }
        if let Some(confidence) = row.confidence {
            values.push(RecordValue::Single(share_of(confidence)));
            values.push(RecordValue::Integer((confidence > UNDECIDED).into()));
        }
        let first = values.len();
        for (cell, record) in row.cells.iter().zip(&self.prototype[first..]) {
            values.push(value(cell, &record.data_type));
        }
        values
    }
}

/// The value of a cell; a number that the type cannot hold is the nearest that it can.
fn value(cell: &Cell<'_>, data_type: &RecordDataType) -> RecordValue {
    match data_type {
        RecordDataType::Single { .. } => RecordValue::Single(cell.number() as f32),
        RecordDataType::Double { .. } => RecordValue::Double(cell.number()),
        RecordDataType::Integer { min, max } | RecordDataType::ScaledInteger { min, max, .. } => {
            let whole = match cell.value_type.read_long(cell.bytes) {
                Some(long) => i64::try_from(long).unwrap_or(i64::MAX),
                None => cell.number().round() as i64,
            };
            RecordValue::Integer(whole.clamp(*min, *max))
        }
    }
}

/// The largest value of colors: 1, or that of a byte or of 16 bits.
fn white(file: &NewFile<'_>, ranges: &Ranges) -> f64 {
    let fields = file.fields.iter().zip(field_names(file)).zip(&ranges.of_fields);
    let largest = fields
        .filter(|((_, name), _)| {
            matches!(
                name,
                RecordName::ColorRed | RecordName::ColorGreen | RecordName::ColorBlue
            )
        })
        .map(|(_, &(_, max))| max)
        .fold(0.0, f64::max);
    match largest {
        ..=1.001 => 1.0,
        ..=255.0 => 255.0,
        _ => 65535.0,
    }
}

/// What each field is called in E57.
fn field_names(file: &NewFile<'_>) -> Vec<RecordName> {
    let find = |name: &str| {
        file.fields
            .iter()
            .position(|field| field.name.eq_ignore_ascii_case(name))
    };
    let colors = COLOR_NAMES.iter().find_map(|names| {
        let [red, green, blue] = names.map(find);
        Some([red?, green?, blue?])
    });
    let intensity = INTENSITY_NAMES.iter().find_map(|name| find(name));
    let is_whole = |index: usize| matches!(file.fields[index].kind, ColumnKind::Number(scalar) if !scalar.is_float());
    // Only E57 itself counts cells and returns from zero and times from the start of a scan, so only its own names are these.
    let both = |names: [&str; 2]| {
        let [first, second] = names.map(|name| file.fields.iter().position(|field| field.name == name));
        Some([first?, second?]).filter(|pair| pair.iter().all(|&index| is_whole(index)))
    };
    let cells = both(["rowIndex", "columnIndex"]);
    let returns = both(["returnIndex", "returnCount"]);
    let time = file.fields.iter().position(|field| field.name == "timeStamp");
    // A name in XML begins with a letter.
    let taken = if file.has_confidence() { SIDE.end } else { SIDE.start };
    let plain = plain_names(&file.fields, &VALUE_NAMES[..taken]);
    plain
        .into_iter()
        .enumerate()
        .map(|(index, name)| match Some(index) {
            found if found == intensity => RecordName::Intensity,
            found if found == colors.map(|colors| colors[0]) => RecordName::ColorRed,
            found if found == colors.map(|colors| colors[1]) => RecordName::ColorGreen,
            found if found == colors.map(|colors| colors[2]) => RecordName::ColorBlue,
            found if found == cells.map(|cells| cells[0]) => RecordName::RowIndex,
            found if found == cells.map(|cells| cells[1]) => RecordName::ColumnIndex,
            found if found == returns.map(|returns| returns[0]) => RecordName::ReturnIndex,
            found if found == returns.map(|returns| returns[1]) => RecordName::ReturnCount,
            found if found == time => RecordName::TimeStamp,
            _ if name.starts_with(|first: char| first.is_ascii_alphabetic())
                && !name.to_lowercase().starts_with("xml") =>
            {
                own(name)
            }
            _ => own(format!("field_{name}")),
        })
        .collect()
}

/// Writes the file.
pub(crate) fn write(file: &mut NewFile<'_>, out: &mut Output<'_>, progress: &dyn Progress) -> Result<(), WriteError> {
    file.narrow(&Part::new(progress, 0.0..0.15))?;
    let file = &*file;
    let ranges = ranges(file, &Part::new(progress, 0.15..0.3))?;
    let rows = Rows::new(file, &ranges);
    let path = out.path;
    let fail = |error: e57::Error| WriteError::io(path)(io_error(&error));
    let mut guids = Guids::new(file, &rows)?;
    let mut writer = E57Writer::new(&mut *out.file, &guids.next()).map_err(fail)?;
    for (prefix, uri) in [("nor", NORMALS_URI), ("normend", OWN_URI)] {
        let is_used =
            |record: &Record| matches!(&record.name, RecordName::Unknown { namespace, .. } if namespace == prefix);
        if rows.prototype.iter().any(is_used) {
            writer.register_extension(Extension::new(prefix, uri)).map_err(fail)?;
        }
    }
    // Parts are made in parallel, some at a time; scans take what they need of them.
    let n_parts = file.n_rows.div_ceil(PART_ROWS);
    let together = rayon::current_num_threads();
    let mut next_part = 0;
    let mut ready: VecDeque<RawValues> = VecDeque::new();
    for index in 0..rows.frames.len() {
        let (frame, pose) = &rows.frames[index];
        let mut scan = writer
            .add_pointcloud(&guids.next(), rows.prototype.clone())
            .map_err(fail)?;
        for _ in 0..rows.n_rows_of(index) {
            if ready.is_empty() {
                progress.report(0.3 + 0.7 * next_part as f32 / n_parts as f32)?;
                let end = (next_part + together).min(n_parts);
                let parts: Vec<_> = (next_part..end).into_par_iter().map(|part| rows.part(part)).collect();
                for part in parts {
                    ready.extend(part?);
                }
                next_part = end;
            }
            let Some(values) = ready.pop_front() else {
                break;
            };
            scan.add_point(values).map_err(fail)?;
        }
        scan.set_name(Some(frame.name.trim()).filter(|name| !name.is_empty()).map(printable));
        scan.set_description(file.comment.map(printable));
        scan.set_transform(pose.as_ref().map(transform));
        scan.finalize().map_err(fail)?;
    }
    writer.finalize().map_err(fail)
}

/// Text that XML can hold.
fn printable(text: &str) -> String {
    text.replace(char::is_control, " ").replace("]]>", "]] >")
}

/// What the system said, with the words of the crate that met it.
fn io_error(error: &e57::Error) -> io::Error {
    let mut source = std::error::Error::source(error);
    while let Some(inner) = source {
        if let Some(inner) = inner.downcast_ref::<io::Error>() {
            return match inner.raw_os_error() {
                Some(code) => io::Error::from_raw_os_error(code),
                None => io::Error::new(inner.kind(), error.to_string()),
            };
        }
        source = inner.source();
    }
    io::Error::other(error.to_string())
}

/// Names for the file and its scans that no other file has: from a hash of the first points, so that the same input gives the
/// same file.
struct Guids {
    seed: blake3::Hasher,
    n_given: u64,
}

impl Guids {
    fn new(file: &NewFile<'_>, rows: &Rows<'_>) -> Result<Self, Stop> {
        let mut seed = blake3::Hasher::new();
        seed.update(&(file.n_rows as u64).to_le_bytes());
        for (frame, _) in &rows.frames {
            seed.update(frame.name.as_bytes());
        }
        if file.n_rows > 0 {
            file.for_rows(file.rows_of_part(0), |row| {
                for value in row.position.to_array() {
                    seed.update(&value.to_le_bytes());
                }
                for value in row.normal.iter().flat_map(Vec3::to_array) {
                    seed.update(&value.to_le_bytes());
                }
            })?;
        }
        Ok(Self { seed, n_given: 0 })
    }

    fn next(&mut self) -> String {
        let hash = self.seed.clone().update(&self.n_given.to_le_bytes()).finalize();
        self.n_given += 1;
        let hex = hash.to_hex();
        let part = |range: std::ops::Range<usize>| hex.as_str()[range].to_owned();
        format!(
            "{{{}-{}-8{}-a{}-{}}}",
            part(0..8),
            part(8..12),
            part(13..16),
            part(17..20),
            part(20..32)
        )
    }
}
