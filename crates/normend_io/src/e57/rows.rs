//! The rows of all scans, unpacked: one after the other, with the columns of all of them.

use e57::RecordDataType;
use normend_core::{PointCloud, Progress};
use rayon::prelude::*;

use super::metadata::ScanInfo;
use super::sections::{MOST_RECORDS, Stream};
use crate::error::{Broken, Stop};
use crate::records::RecordField;
use crate::table::{COORDINATES, PART_ROWS, VALUE_NAMES};
use crate::value::{Scalar, ValueType};

/// Unpacked rows may take this many times the size of the file: seven times is what scans with whole numbers of few bits come to.
const MOST_TIMES: usize = 16;
/// And this many bytes more, so that small files of rows that are all alike can be read.
const MOST_BESIDES: usize = 8 << 20;

/// E57's names of a point's place by range and angles.
const SPHERICAL: [&str; 3] = ["sphericalRange", "sphericalAzimuth", "sphericalElevation"];

/// A scan and its values.
pub(super) struct PackedScan {
    pub info: ScanInfo,
    pub streams: Vec<Stream>,
}

impl ScanInfo {
    /// Whether the places of points are stored as range and angles.
    pub fn is_spherical(&self) -> bool {
        COORDINATES
            .into_iter()
            .any(|axis| self.record(VALUE_NAMES[axis]).is_none())
    }

    /// Whether its points come from the cells of a grid.
    pub fn is_grid(&self) -> bool {
        self.record("rowIndex").is_some() && self.record("columnIndex").is_some()
    }

    /// The records of the coordinates, or of range, azimuth and elevation; and the one that says which are none.
    fn places(&self) -> Option<([usize; 3], Option<usize>)> {
        let find = |names: [&str; 3]| {
            let [first, second, third] = names.map(|name| self.record(name));
            Some([first?, second?, third?])
        };
        if self.is_spherical() {
            Some((find(SPHERICAL)?, self.record("sphericalInvalidState")))
        } else {
            Some((find(["x", "y", "z"])?, self.record("cartesianInvalidState")))
        }
    }
}

/// What the values of a column are, joined over all scans.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Whole { min: i128, max: i128 },
    Single,
    Double,
}

impl Kind {
    fn of(record: &RecordDataType, bits: usize) -> Self {
        match record {
            // The bits can hold more than the range that is announced.
            RecordDataType::Integer { min, .. } => Self::Whole {
                min: i128::from(*min),
                max: i128::from(*min) + (1_i128 << bits) - 1,
            },
            RecordDataType::Single { .. } => Self::Single,
            RecordDataType::Double { .. } | RecordDataType::ScaledInteger { .. } => Self::Double,
        }
    }

    fn join(self, other: Self) -> Self {
        match (self, other) {
            (Self::Whole { min, max }, Self::Whole { min: low, max: high }) => Self::Whole {
                min: min.min(low),
                max: max.max(high),
            },
            _ if self == other => self,
            _ => Self::Double,
        }
    }

    fn scalar(self) -> Scalar {
        let Self::Whole { min, max } = self else {
            return if self == Self::Single {
                Scalar::Float
            } else {
                Scalar::Double
            };
        };
        let fits = |low: i128, high: i128| low <= min && max <= high;
        if fits(0, u8::MAX.into()) {
            Scalar::UChar
        } else if fits(i8::MIN.into(), i8::MAX.into()) {
            Scalar::Char
        } else if fits(0, u16::MAX.into()) {
            Scalar::UShort
        } else if fits(i16::MIN.into(), i16::MAX.into()) {
            Scalar::Short
        } else if fits(i32::MIN.into(), i32::MAX.into()) {
            Scalar::Int
        } else if fits(0, u32::MAX.into()) {
            Scalar::UInt
        } else {
            Scalar::Long
        }
    }
}

/// The columns of the rows, coordinates and normals first. Refuses scans without places.
pub(super) fn columns(scans: &[PackedScan], n_bytes: usize) -> Result<(Vec<RecordField>, usize), Broken> {
    let mut columns: Vec<(&str, Kind)> = Vec::new();
    let mut add = |name, kind: Kind| {
        match columns.iter_mut().find(|(other, _)| *other == name) {
            Some((_, joined)) => *joined = joined.join(kind),
            None => columns.push((name, kind)),
        }
        columns.len()
    };
    for (index, PackedScan { info, .. }) in scans.iter().enumerate() {
        if info.places().is_none() {
            return Err(Broken::whole(format!(
                "scan {} has no coordinates, neither x, y and z nor range, azimuth and elevation: export it with them",
                index + 1
            )));
        }
        let is_single = |axis: usize| {
            let record = info.record(VALUE_NAMES[axis]).map(|record| &info.records[record].kind);
            matches!(record, Some(RecordDataType::Single { .. }))
        };
        // What was counted in steps, or as angles, needs `double`.
        let kind = if COORDINATES.into_iter().all(is_single) {
            Kind::Single
        } else {
            Kind::Double
        };
        for axis in COORDINATES {
            add(VALUE_NAMES[axis], kind);
        }
    }
    for PackedScan { info, .. } in scans {
        for record in &info.records {
            let is_coordinate = VALUE_NAMES[COORDINATES].contains(&&record.name[..]);
            if !is_coordinate {
                if add(&record.name, Kind::of(&record.kind, record.bits)) > MOST_RECORDS {
                    return Err(Broken::whole(format!(
                        "the scans have more than {MOST_RECORDS} different values together: split the file"
                    )));
                }
            } else if info.is_spherical() {
                return Err(Broken::whole(format!(
                    "a scan has the coordinate {} alone: export it with x, y and z",
                    record.name
                )));
            }
        }
    }
    let mut fields = Vec::new();
    let mut offset = 0;
    for (name, kind) in columns {
        let scalar = kind.scalar();
        fields.push(RecordField {
            name: name.to_owned(),
            offset,
            value_type: ValueType::LittleEndian(scalar),
        });
        offset += scalar.size();
    }
    let n_rows: usize = scans.iter().map(|scan| scan.info.n_rows).sum();
    if n_rows == 0 {
        return Err(Broken::whole("the file has no points: open one that has"));
    }
    if n_rows > PointCloud::MAX_POINTS {
        return Err(Broken::whole(format!(
            "the scans have {n_rows} points together, more than the {} that Normend can number: split the file",
            PointCloud::MAX_POINTS
        )));
    }
    let most = n_bytes.saturating_mul(MOST_TIMES).saturating_add(MOST_BESIDES);
    if n_rows.saturating_mul(offset) > most {
        return Err(Broken::whole(format!(
            "{n_rows} points of {offset} bytes would come out of {n_bytes} bytes, more than {MOST_TIMES} times as many: \
             no scan is packed so tightly; export the file again"
        )));
    }
    Ok((fields, offset))
}

/// Unpacks all rows, in parallel. The size has been checked.
pub(super) fn unpack(
    scans: &[PackedScan],
    fields: &[RecordField],
    stride: usize,
    progress: &dyn Progress,
) -> Result<Vec<u8>, Stop> {
    let n_rows: usize = scans.iter().map(|scan| scan.info.n_rows).sum();
    let mut rows = Vec::new();
    rows.try_reserve_exact(n_rows * stride)
        .map_err(|_| Broken::whole("the points do not fit into memory: split the file"))?;
    rows.resize(n_rows * stride, 0);
    let mut left = &mut rows[..];
    let mut n_done = 0;
    for scan in scans {
        let (own, rest) = left.split_at_mut(scan.info.n_rows * stride);
        left = rest;
        let sources: Vec<Option<usize>> = fields.iter().map(|field| scan.info.record(&field.name)).collect();
        // Some parts at a time, so that progress goes on and the work can be stopped.
        let together = PART_ROWS * 4 * rayon::current_num_threads();
        for (block, rows) in own.chunks_mut(together * stride).enumerate() {
            progress.report(n_done as f32 / n_rows as f32)?;
            n_done += rows.len() / stride;
            rows.par_chunks_mut(PART_ROWS * stride)
                .enumerate()
                .for_each(|(part, rows)| {
                    unpack_part(
                        scan,
                        fields,
                        &sources,
                        stride,
                        block * together + part * PART_ROWS,
                        rows,
                    );
                });
        }
    }
    Ok(rows)
}

fn unpack_part(
    scan: &PackedScan,
    fields: &[RecordField],
    sources: &[Option<usize>],
    stride: usize,
    first_row: usize,
    rows: &mut [u8],
) {
    for (field, source) in fields.iter().zip(sources).skip(COORDINATES.end) {
        let Some(scalar) = field.value_type.scalar() else {
            continue;
        };
        for (index, row) in rows.chunks_exact_mut(stride).enumerate() {
            let out = &mut row[field.offset..field.offset + scalar.size()];
            match *source {
                Some(record) if !scalar.is_float() => {
                    let value = scan.whole(record, first_row + index);
                    out.copy_from_slice(&value.to_le_bytes()[..out.len()]);
                }
                Some(record) => push_float(scan.value(record, first_row + index), out),
                // Another scan has this column: no number, or nothing.
                None if scalar.is_float() => push_float(f64::NAN, out),
                None => {}
            }
        }
    }
    let Some((places, state)) = scan.info.places() else {
        return;
    };
    let is_spherical = scan.info.is_spherical();
    for (index, row) in rows.chunks_exact_mut(stride).enumerate() {
        let row_of_scan = first_row + index;
        let mut place = places.map(|record| scan.value(record, row_of_scan));
        if is_spherical {
            let [range, azimuth, elevation] = place;
            let (sine, cosine) = elevation.sin_cos();
            place = [
                range * cosine * azimuth.cos(),
                range * cosine * azimuth.sin(),
                range * sine,
            ];
        }
        if state.is_some_and(|state| scan.value(state, row_of_scan) != 0.0) {
            // A direction, or nothing: no point.
            place = [f64::NAN; 3];
        }
        for (field, value) in fields[COORDINATES].iter().zip(place) {
            push_float(value, &mut row[field.offset..field.offset + field.value_type.size()]);
        }
    }
}

/// Writes a number as a float of as many bytes as there are.
fn push_float(value: f64, out: &mut [u8]) {
    if out.len() == 4 {
        out.copy_from_slice(&(value as f32).to_le_bytes());
    } else {
        out.copy_from_slice(&value.to_le_bytes());
    }
}

impl PackedScan {
    /// The whole number of a record, before it is scaled.
    #[inline]
    fn whole(&self, record: usize, row: usize) -> i64 {
        let raw = self.streams[record].raw(row) as i64;
        match self.info.records[record].kind {
            RecordDataType::Integer { min, .. } | RecordDataType::ScaledInteger { min, .. } => min.wrapping_add(raw),
            RecordDataType::Single { .. } | RecordDataType::Double { .. } => raw,
        }
    }

    /// The number of a record.
    #[inline]
    pub fn value(&self, record: usize, row: usize) -> f64 {
        match self.info.records[record].kind {
            RecordDataType::Single { .. } => f64::from(f32::from_bits(self.streams[record].raw(row) as u32)),
            RecordDataType::Double { .. } => f64::from_bits(self.streams[record].raw(row)),
            RecordDataType::Integer { .. } => self.whole(record, row) as f64,
            RecordDataType::ScaledInteger { scale, offset, .. } => self.whole(record, row) as f64 * scale + offset,
        }
    }
}
