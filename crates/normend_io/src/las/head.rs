//! What stands before and after the points of a LAS file: the header, and the variable length records.
//!
//! Source of all offsets: ASPRS, *LAS Specification 1.4 – R15* (2019).

use normend_core::{PointCloud, PointCloudError};

use crate::error::{Broken, Place};
use crate::table::Span;

/// Bytes of the header by minor version, from LAS 1.0 on.
const HEADER_SIZES: [usize; 5] = [227, 227, 227, 235, 375];
/// Bytes before the content of a variable length record.
pub(crate) const RECORD_HEAD: usize = 54;
/// Bytes before the content of one that stands after the points.
const EXTENDED_RECORD_HEAD: usize = 60;
/// The bit of the point format that says that points are packed (LASzip).
pub(crate) const PACKED_BIT: u8 = 0x80;

/// Where fields of the header stand that change when a file is written again.
pub(crate) mod at {
    pub const POINTS: usize = 96;
    pub const N_RECORDS: usize = 100;
    pub const FORMAT: usize = 104;
    pub const STRIDE: usize = 105;
    pub const WAVEFORMS: usize = 227;
    pub const EXTENDED: usize = 235;
    pub const N_EXTENDED: usize = 243;
}

/// A variable length record.
#[derive(Clone, Debug)]
pub(crate) struct Record {
    pub user_id: String,
    pub record_id: u16,
    /// All of it.
    pub span: Span,
    /// Its content.
    pub data: Span,
    /// Whether it stands after the points.
    pub is_extended: bool,
}

impl Record {
    pub fn is(&self, user_id: &str, record_id: u16) -> bool {
        self.user_id == user_id && self.record_id == record_id
    }
}

/// The parts of a LAS file.
#[derive(Clone, Debug)]
pub(crate) struct Head {
    pub header: las::raw::Header,
    /// 0 to 10.
    pub format: u8,
    pub is_packed: bool,
    /// Bytes of a point.
    pub stride: usize,
    pub n_points: usize,
    /// Variable length records in the file's order.
    pub records: Vec<Record>,
    /// The byte after the last record before the points.
    pub records_end: usize,
    /// Where the points begin, packed or not.
    pub points_at: usize,
    /// Where what stands after the points begins: the byte after the last point, or, of a packed file, the first record there.
    pub rest_at: usize,
}

/// The standard bytes of a point of a format.
pub(crate) fn standard_size(format: u8) -> Option<usize> {
    [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67]
        .get(usize::from(format))
        .copied()
}

/// Whether the file begins as LAS and LAZ do.
pub(crate) fn sniff(bytes: &[u8]) -> bool {
    bytes.starts_with(b"LASF")
}

/// Whether the points of a file that begins so are packed (LAZ).
pub(crate) fn is_packed(bytes: &[u8]) -> bool {
    bytes.get(at::FORMAT).is_some_and(|format| format & PACKED_BIT != 0)
}

/// Finds the parts of a file, and refuses what contradicts its size.
pub(crate) fn parse(bytes: &[u8]) -> Result<Head, Broken> {
    let cut_off = || {
        Broken::new(
            Place::Byte(bytes.len()),
            "the file ends inside its header: copy it again",
        )
    };
    let (Some(&major), Some(&minor)) = (bytes.get(24), bytes.get(25)) else {
        return Err(cut_off());
    };
    let (1, Some(&header_size)) = (major, HEADER_SIZES.get(usize::from(minor))) else {
        return Err(Broken::new(
            Place::Byte(24),
            format!("this is LAS {major}.{minor}, and Normend reads 1.0 to 1.4: save it as 1.4"),
        ));
    };
    let header = las::raw::Header::read_from(bytes).map_err(|error| match error {
        las::Error::Io(_) => cut_off(),
        other => Broken::new(
            Place::Byte(0),
            format!("the header cannot be read ({other}): export the file again"),
        ),
    })?;
    if usize::from(header.header_size) < header_size {
        return Err(Broken::new(
            Place::Byte(94),
            format!(
                "the header says that it has {} bytes, but in LAS {major}.{minor} it has {header_size}: export the file again",
                header.header_size
            ),
        ));
    }
    let points_at = header.offset_to_point_data as usize;
    if points_at < usize::from(header.header_size) || points_at > bytes.len() {
        return Err(Broken::new(
            Place::Byte(at::POINTS),
            format!(
                "the points are said to begin at byte {points_at}, but the header ends at {} and the file at {}: copy or export it again",
                header.header_size,
                bytes.len()
            ),
        ));
    }
    // Bits 6 and 7 belong to LASzip.
    let format = header.point_data_record_format & 0x3f;
    let stride = usize::from(header.point_data_record_length);
    let Some(standard) = standard_size(format) else {
        return Err(Broken::new(
            Place::Byte(at::FORMAT),
            format!("there is no point format {format}: export the file again"),
        ));
    };
    if stride < standard {
        return Err(Broken::new(
            Place::Byte(at::STRIDE),
            format!("points of format {format} have at least {standard} bytes, not {stride}: export the file again"),
        ));
    }
    check_scale(&header)?;

    let mut records = Vec::new();
    let mut records_end = usize::from(header.header_size);
    for number in 1..=header.number_of_variable_length_records {
        let record = record_at(bytes, records_end, points_at, false, number)?;
        records_end = record.span.end;
        records.push(record);
    }
    let is_packed = is_packed(bytes);
    let n_points = count(&header)?;
    let rest_at = if is_packed {
        let rest_at = first_after_points(&header).unwrap_or(bytes.len());
        if rest_at < points_at || rest_at > bytes.len() {
            return Err(outside(rest_at));
        }
        rest_at
    } else {
        let room = (bytes.len() - points_at) / stride;
        if n_points > room {
            return Err(Broken::new(
                Place::Byte(points_at),
                format!(
                    "the header promises {n_points} points of {stride} bytes, but there is room for {room}: the file is cut off, copy it again"
                ),
            ));
        }
        points_at + n_points * stride
    };
    if let Some(evlr) = header.evlr {
        let mut end = evlr.start_of_first_evlr as usize;
        if evlr.number_of_evlrs > 0 && (end < rest_at || end > bytes.len()) {
            return Err(outside(end));
        }
        for number in 1..=evlr.number_of_evlrs {
            let record = record_at(bytes, end, bytes.len(), true, number)?;
            end = record.span.end;
            records.push(record);
        }
    }
    Ok(Head {
        format,
        is_packed,
        stride,
        n_points,
        records,
        records_end,
        points_at,
        rest_at,
        header,
    })
}

fn outside(byte: usize) -> Broken {
    Broken::new(
        Place::Byte(at::WAVEFORMS),
        format!(
            "what follows the points is said to begin at byte {byte}, which is not after them: copy or export the file again"
        ),
    )
}

/// The number of points: that of LAS 1.4 where it is there, else the one of 32 bits.
fn count(header: &las::raw::Header) -> Result<usize, Broken> {
    let large = header.large_file.map_or(0, |large| large.number_of_point_records);
    let n_points = if large > 0 {
        large
    } else {
        header.number_of_point_records.into()
    };
    let place = Place::Byte(if large > 0 { 247 } else { 107 });
    if n_points == 0 {
        return Err(Broken::new(place, "the file has no points: open one that has"));
    }
    match usize::try_from(n_points) {
        Ok(n_points) if n_points <= PointCloud::MAX_POINTS => Ok(n_points),
        _ => {
            let n_points = usize::try_from(n_points).unwrap_or(usize::MAX);
            Err(Broken::new(place, PointCloudError::TooMany { n_points }.to_string()))
        }
    }
}

fn check_scale(header: &las::raw::Header) -> Result<(), Broken> {
    let axes = [
        ("x", header.x_scale_factor, header.x_offset),
        ("y", header.y_scale_factor, header.y_offset),
        ("z", header.z_scale_factor, header.z_offset),
    ];
    for (index, (name, scale, offset)) in axes.into_iter().enumerate() {
        if scale == 0.0 || !scale.is_finite() || !offset.is_finite() {
            return Err(Broken::new(
                Place::Byte(131 + 8 * index),
                format!(
                    "the scale of {name} is {scale} and its offset {offset}, so it has no values: export the file again"
                ),
            ));
        }
    }
    Ok(())
}

/// Where the first thing after the points of a packed file begins, as the header says.
fn first_after_points(header: &las::raw::Header) -> Option<usize> {
    let extended = header.evlr.filter(|evlr| evlr.number_of_evlrs > 0);
    let starts = [
        extended.map(|evlr| evlr.start_of_first_evlr),
        header.start_of_waveform_data_packet_record,
    ];
    starts.into_iter().flatten().min().map(|start| start as usize)
}

/// The record at a byte, which ends before `limit`; `number` counts from 1, for messages.
fn record_at(bytes: &[u8], start: usize, limit: usize, is_extended: bool, number: u32) -> Result<Record, Broken> {
    let (kind, head) = if is_extended {
        ("extended variable length record", EXTENDED_RECORD_HEAD)
    } else {
        ("variable length record", RECORD_HEAD)
    };
    let too_long = || {
        let before = if is_extended {
            "the file ends"
        } else {
            "the points begin"
        };
        Broken::new(
            Place::Byte(start),
            format!("{kind} {number} goes on where {before}: copy or export the file again"),
        )
    };
    let fields = start
        .checked_add(head)
        .filter(|&end| end <= limit)
        .ok_or_else(too_long)?;
    let head = &bytes[start..fields];
    let length = if is_extended {
        u64::from_le_bytes(head[20..28].try_into().map_err(|_| too_long())?)
    } else {
        u64::from(u16::from_le_bytes([head[20], head[21]]))
    };
    let end = usize::try_from(length)
        .ok()
        .and_then(|length| fields.checked_add(length));
    let end = end.filter(|&end| end <= limit).ok_or_else(too_long)?;
    let user_id = &head[2..18];
    let user_id = user_id.split(|&byte| byte == 0).next().unwrap_or(user_id);
    Ok(Record {
        user_id: String::from_utf8_lossy(user_id).into_owned(),
        record_id: u16::from_le_bytes([head[18], head[19]]),
        span: Span { start, end },
        data: Span { start: fields, end },
        is_extended,
    })
}

/// The bytes of a record that stands before the points; its content has at most 65535 bytes.
pub(crate) fn new_record(user_id: &str, record_id: u16, description: &str, data: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; RECORD_HEAD];
    bytes[2..][..user_id.len()].copy_from_slice(user_id.as_bytes());
    bytes[18..20].copy_from_slice(&record_id.to_le_bytes());
    bytes[20..22].copy_from_slice(&(data.len() as u16).to_le_bytes());
    bytes[22..][..description.len()].copy_from_slice(description.as_bytes());
    bytes.extend_from_slice(data);
    bytes
}
