//! The binary sections of an E57 file: rows packed column by column, and blobs.
//!
//! The values of each record of a row stand one after the other without gaps, a *stream*, cut into packets (ASTM E2807, 9). What
//! is not a normal is copied as these streams, so values come out bit for bit whatever they are.

use std::ops::Range;

use normend_core::Progress;

use super::pages::{PageWriter, logical, physical};
use crate::error::{Broken, Place, Stop, WriteError};

/// Size of the header of a section of rows, in bytes.
const VECTOR_HEADER: usize = 32;
/// Size of the header of a blob, in bytes.
const BLOB_HEADER: usize = 16;
/// Size of the header of a packet of rows, in bytes.
const PACKET_HEADER: usize = 6;
/// The most bytes of a packet: its length less one is stored in 16 bits, and is a multiple of four.
const LARGEST_PACKET: usize = 1 << 16;
/// Zeros after each stream, so that any value of it can be read as 16 bytes.
const PADDING: usize = 16;
/// Packets between two reports of progress.
const REPORT_PACKETS: usize = 256;

/// The values of one record of all rows of a scan, packed.
#[derive(Debug)]
pub(super) struct Stream {
    /// Bits of a value: 0..=64.
    pub bits: usize,
    padded: Vec<u8>,
}

impl Stream {
    /// The value of a row, as the unsigned number that its bits are.
    #[inline]
    pub fn raw(&self, row: usize) -> u64 {
        let bit = row * self.bits;
        let mut window = [0; PADDING];
        window.copy_from_slice(&self.padded[bit / 8..bit / 8 + PADDING]);
        let mask = (1_u128 << self.bits) - 1;
        ((u128::from_le_bytes(window) >> (bit % 8)) & mask) as u64
    }

    /// The bytes of some rows, of which the first is a multiple of eight.
    pub fn bytes_of(&self, rows: Range<usize>) -> &[u8] {
        &self.padded[rows.start * self.bits / 8..(rows.end * self.bits).div_ceil(8)]
    }
}

/// Bytes that values of `bits` bits take; `None` beyond all files.
fn size_of_stream(n_rows: usize, bits: usize) -> Option<usize> {
    Some(n_rows.checked_mul(bits)?.div_ceil(8))
}

fn number<const N: usize>(content: &[u8], at: usize) -> Option<[u8; N]> {
    content.get(at..at.checked_add(N)?)?.try_into().ok()
}

/// What the header of a section of rows says.
struct VectorHeader {
    /// Logical offset of the first packet.
    data: usize,
    /// Logical offset after the section.
    end: usize,
}

fn vector_header(content: &[u8], offset: u64) -> Result<VectorHeader, Broken> {
    let broken = |reason: &str| Broken::new(place(offset), format!("{reason}: the file is damaged, export it again"));
    let start = logical(offset).ok_or_else(|| broken("points cannot begin here"))?;
    let (Some([id, ..]), Some(length), Some(data)) = (
        number::<8>(content, start),
        number(content, start + 8).map(u64::from_le_bytes),
        number(content, start + 16).map(u64::from_le_bytes),
    ) else {
        return Err(broken("points would begin after the end of the file"));
    };
    if id != 1 {
        return Err(broken("points should begin here, but something else does"));
    }
    let data = logical(data).ok_or_else(|| broken("packets begin within a checksum"))?;
    let end = usize::try_from(length)
        .ok()
        .and_then(|length| start.checked_add(length));
    Ok(VectorHeader {
        data,
        end: end.ok_or_else(|| broken("the section is longer than any file"))?,
    })
}

fn place(offset: u64) -> Place {
    Place::Byte(usize::try_from(offset).unwrap_or(usize::MAX))
}

/// The bytes of a file that no section has taken yet: no two hold the same, so a small file cannot unpack to a large one by
/// naming a section many times.
#[derive(Debug)]
pub(super) struct Budget(pub usize);

impl Budget {
    fn take(&mut self, n_bytes: usize, offset: u64) -> Result<(), Broken> {
        self.0 = self.0.checked_sub(n_bytes).ok_or_else(|| {
            Broken::new(
                place(offset),
                "more is said to be here than the file has bytes: sections overlap, export the file again",
            )
        })?;
        Ok(())
    }
}

/// A packet: its kind, and its logical extent.
fn packet(content: &[u8], at: usize, budget: &mut Budget) -> Result<(u8, Range<usize>), Broken> {
    let broken = |reason: String| Broken::new(Place::Byte(physical(at)), reason);
    let Some([id, _, low, high]) = number(content, at) else {
        return Err(broken(
            "the file ends before all points have come: it is cut off, copy it again".to_owned(),
        ));
    };
    let length = usize::from(u16::from_le_bytes([low, high])) + 1;
    if id > 2 || length % 4 != 0 || at + length > content.len() {
        return Err(broken(format!(
            "a packet of kind {id} and {length} bytes, which is none: the file is damaged, export it again"
        )));
    }
    budget.take(length, physical(at) as u64)?;
    Ok((id, at..at + length))
}

/// Reads the streams of a section, whose records have `bits` bits each; `content` is the file without checksums, `offset`
/// physical.
pub(super) fn read_streams(
    content: &[u8],
    offset: u64,
    n_rows: usize,
    bits: &[usize],
    budget: &mut Budget,
    progress: &dyn Progress,
) -> Result<Vec<Stream>, Stop> {
    let header = vector_header(content, offset)?;
    let sizes: Option<Vec<usize>> = bits.iter().map(|&bits| size_of_stream(n_rows, bits)).collect();
    let total = |sizes: &Vec<usize>| sizes.iter().try_fold(0_usize, |sum, &size| sum.checked_add(size));
    // Nothing is allocated before this.
    let Some(sizes) = sizes.filter(|sizes| total(sizes).is_some_and(|total| total <= budget.0)) else {
        return Err(Broken::new(
            place(offset),
            format!(
                "{n_rows} points of {} bits each do not fit into the {} bytes that are left of the file: it is cut off or damaged, export it again",
                bits.iter().sum::<usize>(),
                budget.0
            ),
        )
        .into());
    };
    let mut streams: Vec<Stream> = (bits.iter().zip(&sizes))
        .map(|(&bits, size)| Stream {
            bits,
            padded: Vec::with_capacity(size + PADDING),
        })
        .collect();
    let mut n_open = sizes.iter().filter(|&&size| size > 0).count();
    let mut at = header.data;
    let mut n_packets = 0;
    while n_open > 0 {
        if n_packets % REPORT_PACKETS == 0 {
            progress.report(at as f32 / content.len() as f32)?;
        }
        n_packets += 1;
        let (id, extent) = packet(content, at, budget)?;
        at = extent.end;
        if id != 1 {
            // An index, or nothing at all.
            continue;
        }
        let damaged = || {
            Broken::new(
                Place::Byte(physical(extent.start)),
                format!(
                    "a packet that does not hold the {} values of a point: the file is damaged, export it again",
                    bits.len()
                ),
            )
        };
        let n_streams = number(content, extent.start + 4).map_or(0, u16::from_le_bytes);
        if usize::from(n_streams) != bits.len() {
            return Err(damaged().into());
        }
        let mut lengths = extent.start + PACKET_HEADER;
        let mut from = lengths + 2 * bits.len();
        for (stream, &size) in streams.iter_mut().zip(&sizes) {
            let length = number(content, lengths).map_or(0, |length| usize::from(u16::from_le_bytes(length)));
            lengths += 2;
            if from + length > extent.end {
                return Err(damaged().into());
            }
            // Some writers fill up the last word of a stream.
            let n_missing = size - stream.padded.len();
            stream
                .padded
                .extend_from_slice(&content[from..from + length.min(n_missing)]);
            if n_missing > 0 && n_missing <= length {
                n_open -= 1;
            }
            from += length;
        }
    }
    for stream in &mut streams {
        stream.padded.resize(stream.padded.len() + PADDING, 0);
    }
    Ok(streams)
}

/// A section that is only copied.
#[derive(Debug)]
pub(super) enum Copied {
    /// A blob with its header.
    Blob(Vec<u8>),
    /// The packets of rows.
    Packets(Vec<u8>),
}

impl Copied {
    /// Takes a blob of `length` bytes out of the file.
    pub fn read_blob(content: &[u8], offset: u64, length: u64, budget: &mut Budget) -> Result<Self, Broken> {
        let start = logical(offset);
        let end = start.and_then(|start| usize::try_from(length).ok()?.checked_add(start + BLOB_HEADER));
        match (start, end) {
            (Some(start), Some(end)) if end <= content.len() && content[start] == 0 => {
                budget.take(end - start, offset)?;
                Ok(Self::Blob(content[start..end].to_vec()))
            }
            _ => Err(Broken::new(
                place(offset),
                format!(
                    "no {length} bytes of an image or the like are here: the file is cut off or damaged, copy it again"
                ),
            )),
        }
    }

    /// Takes rows that are no points out of the file.
    pub fn read_packets(content: &[u8], offset: u64, budget: &mut Budget) -> Result<Self, Broken> {
        let header = vector_header(content, offset)?;
        let mut packets = Vec::new();
        let mut at = header.data;
        while at < header.end {
            let (id, extent) = packet(content, at, budget)?;
            at = extent.end;
            if id == 1 {
                packets.extend_from_slice(&content[extent]);
            }
        }
        Ok(Self::Packets(packets))
    }

    /// Writes it; returns its physical offset.
    pub fn write(&self, out: &mut PageWriter<'_>) -> Result<u64, WriteError> {
        out.align()?;
        let offset = out.position();
        match self {
            Self::Blob(bytes) => out.write(bytes)?,
            Self::Packets(packets) => {
                write_vector_header(out, packets.len())?;
                out.write(packets)?;
            }
        }
        out.align()?;
        Ok(offset)
    }
}

fn write_vector_header(out: &mut PageWriter<'_>, n_bytes: usize) -> Result<(), WriteError> {
    let mut header = [0; VECTOR_HEADER];
    header[0] = 1;
    header[8..16].copy_from_slice(&((VECTOR_HEADER + n_bytes) as u64).to_le_bytes());
    header[16..24].copy_from_slice(&out.position_after(VECTOR_HEADER).to_le_bytes());
    // The rest is where the index begins: there is none, as programs that read from first to last need none.
    out.write(&header)
}

/// The most values that a row can have so that the rows of a packet fit into it: eight rows of 64 bits each, and room for what
/// is added.
pub(super) const MOST_RECORDS: usize = 900;

/// Writes a section of rows whose values have `bits` bits each; returns its physical offset. `push` appends the bytes of some
/// rows of a stream, the first of them a multiple of eight.
pub(super) fn write_streams(
    out: &mut PageWriter<'_>,
    n_rows: usize,
    bits: &[usize],
    push: impl Fn(usize, Range<usize>, &mut Vec<u8>),
    progress: &dyn Progress,
) -> Result<u64, WriteError> {
    let head = PACKET_HEADER + 2 * bits.len();
    let n_bits: usize = bits.iter().sum();
    // Whole bytes of each stream, so that packets can be read each by itself; a row more than there are needs none.
    let rows_of_packet =
        ((LARGEST_PACKET - head - 4) * 8 / n_bits.max(1) / 8 * 8).clamp(8, n_rows.next_multiple_of(8).max(8));
    let size = |n_rows: usize| {
        let streams: usize = bits.iter().map(|bits| (n_rows * bits).div_ceil(8)).sum();
        (head + streams).next_multiple_of(4)
    };
    let n_full = n_rows / rows_of_packet;
    let n_rest = n_rows % rows_of_packet;
    let n_bytes = n_full * size(rows_of_packet) + if n_rest > 0 { size(n_rest) } else { 0 };
    out.align()?;
    let offset = out.position();
    write_vector_header(out, n_bytes)?;
    let mut packet = Vec::with_capacity(LARGEST_PACKET);
    for (index, first) in (0..n_rows).step_by(rows_of_packet).enumerate() {
        if index % REPORT_PACKETS == 0 {
            progress.report(first as f32 / n_rows as f32)?;
        }
        let rows = first..(first + rows_of_packet).min(n_rows);
        packet.clear();
        packet.resize(head, 0);
        for stream in 0..bits.len() {
            let start = packet.len();
            push(stream, rows.clone(), &mut packet);
            let length = (packet.len() - start) as u16;
            packet[PACKET_HEADER + 2 * stream..][..2].copy_from_slice(&length.to_le_bytes());
        }
        packet.resize(packet.len().next_multiple_of(4), 0);
        packet[0] = 1;
        let length = (packet.len() - 1) as u16;
        packet[2..4].copy_from_slice(&length.to_le_bytes());
        packet[4..6].copy_from_slice(&(bits.len() as u16).to_le_bytes());
        out.write(&packet)?;
    }
    Ok(offset)
}
