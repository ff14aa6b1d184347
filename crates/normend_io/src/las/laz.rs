//! Packed points (LASzip): unpacking them to rows, and packing rows.
//!
//! Chunks are handed to the `laz` crate one by one, in parallel, because its own readers believe the table of chunks and the
//! sizes in them; here each is compared with the file's size before.

use std::io::{Cursor, SeekFrom};

use laz::laszip::{ChunkTable, ChunkTableEntry, CompressorType};
use laz::record::{
    LayeredPointRecordCompressor, LayeredPointRecordDecompressor, RecordCompressor, RecordDecompressor,
    SequentialPointRecordCompressor, SequentialPointRecordDecompressor,
};
use laz::{LazItem, LazItemRecordBuilder, LazItemType, LazVlr, LazVlrBuilder};
use normend_core::Progress;
use rayon::prelude::*;

use super::head::{Head, standard_size};
use crate::error::{Broken, Place, Stop, WriteError};
use crate::output::Output;
use crate::table::Span;

/// The record that says how points are packed: of this user, with this number.
pub(crate) const PACKING: (&str, u16) = (LazVlr::USER_ID, LazVlr::RECORD_ID);
/// Points of a chunk where nothing else is known: LASzip's own number.
const USUAL_CHUNK: usize = 50_000;
/// More points are not packed into one chunk, because a chunk is unpacked by one thread.
const MOST_IN_CHUNK: usize = 1 << 20;
/// Rows are unpacked in parallel as long as they need no more memory than this at a time; a larger chunk in steps of its own.
const TOGETHER_BYTES: usize = 16 << 20;
/// Rows of a step.
const STEP_ROWS: usize = 1 << 14;
/// The models of an extra byte take 10 kB for each thread; no program writes so many.
pub(crate) const MOST_EXTRA: usize = 1024;
/// What any file may unpack to, in bytes.
const FREE_BYTES: usize = 16 << 20;
/// How many times the bytes of its points a file may unpack to besides. Surveys are packed to a tenth or so.
const MOST_TIMES: usize = 100;

/// How the points of a file are packed.
#[derive(Clone, Debug)]
pub(crate) struct Packing {
    /// The content of the record that says so.
    pub record: Vec<u8>,
    chunks: ChunkSizes,
}

/// How many points chunks have.
#[derive(Clone, Debug)]
enum ChunkSizes {
    All(usize),
    Each(Vec<usize>),
}

impl ChunkSizes {
    fn get(&self, chunk: usize) -> usize {
        match self {
            Self::All(size) => *size,
            // What is left over goes together.
            Self::Each(sizes) => sizes.get(chunk).copied().unwrap_or(USUAL_CHUNK),
        }
    }
}

/// A chunk of a file.
#[derive(Clone, Copy, Debug)]
struct Chunk {
    bytes: Span,
    n_rows: usize,
}

/// Unpacks the points of a file: returns its bytes with rows in their place, followed by what stands after the points.
pub(crate) fn unpack(bytes: &[u8], head: &Head, progress: &dyn Progress) -> Result<(Vec<u8>, Packing), Stop> {
    let record = packing_record(bytes, head)?;
    let vlr = LazVlr::from_buffer(record).map_err(|error| {
        Broken::whole(format!(
            "the record on packing cannot be read ({error}): export the file again"
        ))
    })?;
    check_items(vlr.items(), head)?;
    // The number of a compressor without chunks, for which the crate has no name that is public.
    let has_chunks = record.first() != Some(&(CompressorType::PointWise as u8));
    let n_total = head.n_points.saturating_mul(head.stride);
    let n_packed = head.rest_at - head.points_at;
    if n_total > FREE_BYTES.saturating_add(n_packed.saturating_mul(MOST_TIMES)) {
        return Err(Broken::new(
            Place::Byte(head.points_at),
            format!(
                "{} points of {} bytes are said to be packed into {n_packed} bytes, more than {MOST_TIMES} times as many as these: \
                 the header is wrong, export the file again",
                head.n_points, head.stride
            ),
        )
        .into());
    }
    let chunks = if has_chunks {
        find_chunks(bytes, head, &vlr)?
    } else {
        None
    };
    let mut image = Vec::new();
    // Most files need no more, so that nothing moves; the others grow as they prove to hold more.
    let n_likely = n_total.min(8 * n_packed + (1 << 20));
    reserve(&mut image, head.points_at + n_likely + (bytes.len() - head.rest_at))?;
    image.extend_from_slice(&bytes[..head.points_at]);
    let sizes = match chunks {
        Some(chunks) => {
            unpack_chunks(bytes, head, vlr.items(), &chunks, &mut image, progress)?;
            match vlr.uses_variable_size_chunks() {
                true => ChunkSizes::Each(chunks.iter().map(|chunk| chunk.n_rows).collect()),
                false => ChunkSizes::All(vlr.chunk_size() as usize),
            }
        }
        None if is_layered(vlr.items()) || vlr.uses_variable_size_chunks() && has_chunks => {
            return Err(Broken::new(
                Place::Byte(head.points_at),
                "the table of the chunks is missing: the program that wrote the file did not finish, export it again",
            )
            .into());
        }
        None => {
            // The first eight bytes are where the table should be, in files that have chunks.
            let start = head.points_at + if has_chunks { 8 } else { 0 };
            let chunk = Chunk {
                bytes: Span {
                    start: start.min(head.rest_at),
                    end: head.rest_at,
                },
                n_rows: head.n_points,
            };
            let chunk_rows = if has_chunks {
                vlr.chunk_size() as usize
            } else {
                head.n_points
            };
            unpack_in_steps(bytes, chunk, chunk_rows, vlr.items(), head.stride, &mut image, progress)?;
            ChunkSizes::All(USUAL_CHUNK)
        }
    };
    image.extend_from_slice(&bytes[head.rest_at..]);
    image.shrink_to_fit();
    let packing = Packing {
        record: record.to_vec(),
        chunks: sizes,
    };
    Ok((image, packing))
}

fn packing_record<'a>(bytes: &'a [u8], head: &Head) -> Result<&'a [u8], Broken> {
    let record = head.records.iter().find(|record| record.is(PACKING.0, PACKING.1));
    record.map(|record| record.data.of(bytes)).ok_or_else(|| {
        Broken::new(
            Place::Byte(super::head::at::FORMAT),
            "the points are packed, but nothing says how: export the file again",
        )
    })
}

fn is_layered(items: &[LazItem]) -> bool {
    items.first().is_some_and(|item| item.version() >= 3)
}

/// Refuses items that are not those of the point format: the decoders rely on it.
fn check_items(items: &[LazItem], head: &Head) -> Result<(), Broken> {
    let wrong = || {
        Broken::whole(format!(
            "the record on packing does not fit point format {} with {} bytes: export the file again",
            head.format, head.stride
        ))
    };
    let n_extra = head.stride - standard_size(head.format).ok_or_else(wrong)?;
    if n_extra > MOST_EXTRA {
        return Err(Broken::whole(format!(
            "the points have {n_extra} extra bytes, and Normend unpacks up to {MOST_EXTRA}: save the file as LAS"
        )));
    }
    let expected =
        LazItemRecordBuilder::default_for_point_format_id(head.format, n_extra as u16).map_err(|_| wrong())?;
    let is_expected = |(item, expected): (&LazItem, &LazItem)| {
        item.item_type() == expected.item_type() && item.size() == expected.size()
    };
    let versions = if head.format >= 6 { 3..=4 } else { 1..=2 };
    let fits = items.len() == expected.len()
        && items.iter().zip(&expected).all(is_expected)
        && items.iter().all(|item| versions.contains(&item.version()));
    if fits { Ok(()) } else { Err(wrong()) }
}

/// Finds the chunks by the table that stands after them; `None` when there is none.
fn find_chunks(bytes: &[u8], head: &Head, vlr: &LazVlr) -> Result<Option<Vec<Chunk>>, Broken> {
    let (start, end) = (head.points_at + 8, head.rest_at);
    let broken = |reason: String| Broken::new(Place::Byte(head.points_at), reason + ": copy or export the file again");
    let long = |at: usize| -> Option<u64> { Some(u64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?)) };
    let after_start = |at: &u64| *at as i64 >= start as i64;
    let Some(first) = long(head.points_at).filter(|_| start <= end) else {
        return Err(broken("the file ends where its points begin".into()));
    };
    // A program that could not go back wrote the place of the table last.
    let last = || long(bytes.len() - 8).filter(|at| *at as usize <= bytes.len() - 8);
    let Some(table_at) = Some(first).filter(after_start).or_else(|| last().filter(after_start)) else {
        return Ok(None);
    };
    let table = usize::try_from(table_at).ok().filter(|&at| at <= bytes.len() - 8);
    let Some(table_at) = table else {
        return Err(broken(format!(
            "the table of chunks is said to be at byte {table_at}, beyond the file"
        )));
    };
    let n_chunks = u32::from_le_bytes(bytes[table_at + 4..table_at + 8].try_into().unwrap_or_default()) as usize;
    // Each chunk begins with a point that is not packed.
    if n_chunks > (table_at - start) / head.stride + 1 {
        return Err(broken(format!(
            "the table speaks of {n_chunks} chunks, more than there is room for"
        )));
    }
    let table =
        ChunkTable::read(&mut Cursor::new(&bytes[table_at..]), vlr.uses_variable_size_chunks()).map_err(|_| {
            Broken::new(
                Place::Byte(table_at),
                "the table of chunks is cut off: copy or export the file again",
            )
        })?;
    let mut chunks = Vec::new();
    let mut at = start;
    let mut n_left = head.n_points;
    for entry in table.as_ref() {
        let n_rows = match vlr.uses_variable_size_chunks() {
            true => usize::try_from(entry.point_count).unwrap_or(usize::MAX),
            false => n_left.min(vlr.chunk_size() as usize),
        };
        let n_bytes = usize::try_from(entry.byte_count).unwrap_or(usize::MAX);
        let end = at.checked_add(n_bytes).filter(|&end| end <= table_at);
        let (Some(end), true) = (end, n_rows <= n_left) else {
            return Err(broken(format!("chunk {} is larger than the file", chunks.len() + 1)));
        };
        if n_rows > 0 {
            let bytes = Span { start: at, end };
            chunks.push(Chunk { bytes, n_rows });
        }
        at = end;
        n_left -= n_rows;
    }
    if n_left > 0 {
        return Err(broken(format!(
            "the header promises {} points, but the chunks hold {n_left} less",
            head.n_points
        )));
    }
    Ok(Some(chunks))
}

fn unpack_chunks(
    bytes: &[u8],
    head: &Head,
    items: &Vec<LazItem>,
    chunks: &[Chunk],
    image: &mut Vec<u8>,
    progress: &dyn Progress,
) -> Result<(), Stop> {
    let stride = head.stride;
    let mut first = 0;
    let mut n_done = 0;
    while first < chunks.len() {
        let mut n_rows = chunks[first].n_rows;
        let mut end = first + 1;
        while end < chunks.len() && (n_rows + chunks[end].n_rows).saturating_mul(stride) <= TOGETHER_BYTES {
            n_rows += chunks[end].n_rows;
            end += 1;
        }
        let share = |n_done: usize| n_done as f32 / head.n_points as f32;
        if n_rows.saturating_mul(stride) > TOGETHER_BYTES {
            let chunk = chunks[first];
            let part = normend_core::progress::Part::new(progress, share(n_done)..share(n_done + n_rows));
            unpack_in_steps(bytes, chunk, chunk.n_rows, items, stride, image, &part)?;
        } else {
            let start = image.len();
            grow(image, n_rows * stride)?;
            let mut rows_left = &mut image[start..];
            let mut parts = Vec::with_capacity(end - first);
            for chunk in &chunks[first..end] {
                let (rows, rest) = rows_left.split_at_mut(chunk.n_rows * stride);
                rows_left = rest;
                parts.push((*chunk, rows));
            }
            let results: Vec<Result<(), Broken>> = parts
                .into_par_iter()
                .map(|(chunk, rows)| {
                    let mut unpacker = Unpacker::new(bytes, chunk, items, stride)?;
                    unpacker.unpack(rows)
                })
                .collect();
            // The first error in the file's order, whichever thread met one first.
            results.into_iter().collect::<Result<(), Broken>>()?;
        }
        n_done += n_rows;
        progress.report(share(n_done))?;
        first = end;
    }
    Ok(())
}

/// Unpacks a chunk by one thread, a few rows at a time, so that no more memory is taken than the chunk proves to need. The
/// state of the decoder begins anew after each `chunk_rows` rows.
fn unpack_in_steps(
    bytes: &[u8],
    chunk: Chunk,
    chunk_rows: usize,
    items: &Vec<LazItem>,
    stride: usize,
    image: &mut Vec<u8>,
    progress: &dyn Progress,
) -> Result<(), Stop> {
    let mut unpacker = Unpacker::new(bytes, chunk, items, stride)?;
    let (mut n_done, mut n_in_chunk) = (0, 0);
    while n_done < chunk.n_rows {
        progress.report(n_done as f32 / chunk.n_rows as f32)?;
        if n_in_chunk == chunk_rows {
            unpacker.begin_chunk(items)?;
            n_in_chunk = 0;
        }
        let n_rows = STEP_ROWS.min(chunk.n_rows - n_done).min(chunk_rows - n_in_chunk);
        let start = image.len();
        grow(image, n_rows * stride)?;
        unpacker.unpack(&mut image[start..])?;
        n_done += n_rows;
        n_in_chunk += n_rows;
    }
    Ok(())
}

/// Unpacks one chunk after the other.
struct Unpacker<'a> {
    decoder: Box<dyn RecordDecompressor<Cursor<&'a [u8]>> + 'a>,
    at: usize,
}

impl<'a> Unpacker<'a> {
    fn new(bytes: &'a [u8], chunk: Chunk, items: &Vec<LazItem>, stride: usize) -> Result<Self, Broken> {
        let packed = chunk.bytes.of(bytes);
        let decoder: Box<dyn RecordDecompressor<Cursor<&'a [u8]>> + 'a> = if is_layered(items) {
            check_layers(packed, chunk, items, stride)?;
            Box::new(LayeredPointRecordDecompressor::new(Cursor::new(packed)))
        } else {
            Box::new(SequentialPointRecordDecompressor::new(Cursor::new(packed)))
        };
        let mut unpacker = Self {
            decoder,
            at: chunk.bytes.start,
        };
        unpacker.set_items(items)?;
        Ok(unpacker)
    }

    fn set_items(&mut self, items: &Vec<LazItem>) -> Result<(), Broken> {
        let set = self.decoder.set_fields_from(items);
        set.map_err(|error| {
            Broken::whole(format!(
                "the points are packed in a way that is unknown ({error}): save the file again"
            ))
        })
    }

    /// The next row is the first of a chunk.
    fn begin_chunk(&mut self, items: &Vec<LazItem>) -> Result<(), Broken> {
        self.decoder.reset();
        self.set_items(items)
    }

    fn unpack(&mut self, rows: &mut [u8]) -> Result<(), Broken> {
        self.decoder.decompress_many(rows).map_err(|_| {
            Broken::new(
                Place::Byte(self.at),
                "the chunk of packed points that begins here is damaged: copy or export the file again",
            )
        })
    }
}

/// Compares the sizes in the head of a layered chunk with the chunk's. Source: the decoders of `laz`, which read a point, the
/// number of points, the size of each layer, and the layers.
fn check_layers(packed: &[u8], chunk: Chunk, items: &[LazItem], stride: usize) -> Result<(), Broken> {
    let layers = |item: &LazItem| match item.item_type() {
        LazItemType::Point14 => 9,
        LazItemType::RGBNIR14 => 2,
        LazItemType::Byte14(count) => usize::from(count),
        _ => 1,
    };
    let n_layers: usize = items.iter().map(layers).sum();
    let damaged = || {
        Broken::new(
            Place::Byte(chunk.bytes.start),
            "the chunk of packed points that begins here contradicts itself: copy or export the file again",
        )
    };
    let head = packed.get(stride..stride + 4 + 4 * n_layers).ok_or_else(damaged)?;
    let mut numbers = head
        .chunks_exact(4)
        .map(|bytes| u32::from_le_bytes(bytes.try_into().unwrap_or_default()) as usize);
    if numbers.next() != Some(chunk.n_rows) || numbers.sum::<usize>() > packed.len() - stride - head.len() {
        return Err(damaged());
    }
    Ok(())
}

fn reserve(image: &mut Vec<u8>, n_bytes: usize) -> Result<(), Broken> {
    let reserved = image.try_reserve(n_bytes);
    reserved.map_err(|_| Broken::whole("the unpacked points do not fit into memory: split the scan"))
}

fn grow(image: &mut Vec<u8>, n_bytes: usize) -> Result<(), Broken> {
    reserve(image, n_bytes)?;
    image.resize(image.len() + n_bytes, 0);
    Ok(())
}

impl Packing {
    /// How points of a format with `n_extra` extra bytes are packed that were not before.
    pub fn fresh(format: u8, n_extra: u16) -> Result<Self, Broken> {
        let unknown =
            |error: laz::LasZipError| Broken::whole(format!("these points cannot be packed ({error}): write .las"));
        let vlr = LazVlrBuilder::default()
            .with_point_format(format, n_extra)
            .map_err(unknown)?
            .build();
        let mut record = Vec::new();
        vlr.write_to(&mut record).map_err(|error| unknown(error.into()))?;
        settle_waveforms(&mut record);
        Ok(Self {
            record,
            chunks: ChunkSizes::All(USUAL_CHUNK),
        })
    }

    /// The same for points with `n_added` more extra bytes.
    pub fn with_extra(&self, n_added: u16) -> Self {
        let mut packing = self.clone();
        let record = &mut packing.record;
        let n_items = (record.len() - ITEMS) / ITEM;
        let item = |index: usize| ITEMS + index * ITEM;
        // No records of LASzip's own are written after the points: -1 says so.
        record[16..32].fill(0xff);
        if record[0] == CompressorType::PointWise as u8 {
            record[0] = CompressorType::PointWiseChunked as u8;
        }
        if let ChunkSizes::All(size) = &mut packing.chunks {
            if *size > MOST_IN_CHUNK {
                *size = USUAL_CHUNK;
            }
            record[12..16].copy_from_slice(&(*size as u32).to_le_bytes());
        }
        settle_waveforms(record);
        if n_added == 0 {
            return packing;
        }
        let extra = (0..n_items).map(item).find(|&at| matches!(record[at], 0 | 14));
        match extra {
            Some(at) => {
                let size = u16::from_le_bytes([record[at + 2], record[at + 3]]).saturating_add(n_added);
                record[at + 2..at + 4].copy_from_slice(&size.to_le_bytes());
            }
            None => {
                let version = record[item(0) + 4];
                let kind: u8 = if version >= 3 { 14 } else { 0 };
                record.extend([kind, 0]);
                record.extend(n_added.to_le_bytes());
                record.extend([version, 0]);
                record[ITEMS - 2..ITEMS].copy_from_slice(&(n_items as u16 + 1).to_le_bytes());
            }
        }
        packing
    }
}

/// LASzip knows version 1 of packed waveforms alone, also where the other items have version 2, and `laz` packs them in one way.
fn settle_waveforms(record: &mut [u8]) {
    const WAVEFORMS: u8 = 9;
    for item in record[ITEMS..].chunks_exact_mut(ITEM) {
        if item[0] == WAVEFORMS {
            item[4] = 1;
        }
    }
}

/// Where the items begin in the record on packing, after their number.
const ITEMS: usize = 34;
/// Bytes of an item there: type, size, version.
const ITEM: usize = 6;

/// Packs rows and writes them, chunk by chunk.
pub(crate) struct Packer<'a, 'b> {
    out: &'a mut Output<'b>,
    vlr: LazVlr,
    chunks: ChunkSizes,
    stride: usize,
    /// Where the place of the table of chunks is written down.
    start: u64,
    /// Rows that are not packed yet.
    pending: Vec<u8>,
    table: ChunkTable,
}

impl<'a, 'b> Packer<'a, 'b> {
    /// Rows of `stride` bytes that go where `out` is at.
    pub fn new(packing: &Packing, stride: usize, out: &'a mut Output<'b>) -> Result<Self, WriteError> {
        let vlr = LazVlr::from_buffer(&packing.record[..]);
        let vlr = vlr.map_err(|error| {
            WriteError::Source(Broken::whole(format!(
                "the points cannot be packed ({error}): write .las"
            )))
        })?;
        let start = out.file.stream_position().map_err(WriteError::io(out.path))?;
        out.write(&(-1_i64).to_le_bytes())?;
        Ok(Self {
            out,
            vlr,
            chunks: packing.chunks.clone(),
            stride,
            start,
            pending: Vec::new(),
            table: ChunkTable::default(),
        })
    }

    /// Takes whole rows.
    pub fn push(&mut self, rows: &[u8]) -> Result<(), WriteError> {
        self.pending.extend_from_slice(rows);
        self.pack(2 * rayon::current_num_threads())
    }

    /// Packs the chunks that are complete when there are at least so many; with 0 also the last one.
    fn pack(&mut self, at_least: usize) -> Result<(), WriteError> {
        let mut ends = Vec::new();
        let mut at = 0;
        loop {
            let size = self.chunks.get(self.table.len() + ends.len()).max(1) * self.stride;
            if at + size > self.pending.len() {
                break;
            }
            at += size;
            ends.push(at);
        }
        if at_least == 0 && at < self.pending.len() {
            at = self.pending.len();
            ends.push(at);
        }
        if ends.is_empty() || ends.len() < at_least {
            return Ok(());
        }
        let items = self.vlr.items();
        let starts = std::iter::once(0).chain(ends.iter().copied());
        let rows: Vec<&[u8]> = starts
            .zip(&ends)
            .map(|(start, &end)| &self.pending[start..end])
            .collect();
        let packed: Vec<laz::Result<Vec<u8>>> = rows.par_iter().map(|rows| pack_chunk(items, rows)).collect();
        for (rows, packed) in rows.iter().zip(packed) {
            let failed = |error| {
                WriteError::Source(Broken::whole(format!(
                    "the points cannot be packed ({error}): write .las"
                )))
            };
            let packed = packed.map_err(failed)?;
            self.table.push(ChunkTableEntry {
                point_count: (rows.len() / self.stride) as u64,
                byte_count: packed.len() as u64,
            });
            self.out.write(&packed)?;
        }
        self.pending.drain(..at);
        Ok(())
    }

    /// Writes the last chunk and the table of chunks; returns the byte after it.
    pub fn finish(mut self) -> Result<u64, WriteError> {
        self.pack(0)?;
        let path = self.out.path;
        let failed = WriteError::io(path);
        let table_at = self.out.file.stream_position().map_err(&failed)?;
        let mut table = Vec::new();
        self.table.write_to(&mut table, &self.vlr).map_err(&failed)?;
        self.out.write(&table)?;
        let end = self.out.file.stream_position().map_err(&failed)?;
        self.out.file.seek(SeekFrom::Start(self.start)).map_err(&failed)?;
        self.out.write(&table_at.to_le_bytes())?;
        self.out.file.seek(SeekFrom::Start(end)).map_err(&failed)?;
        Ok(end)
    }
}

fn pack_chunk(items: &Vec<LazItem>, rows: &[u8]) -> laz::Result<Vec<u8>> {
    fn with<C: RecordCompressor<Vec<u8>>>(mut coder: C, items: &Vec<LazItem>, rows: &[u8]) -> laz::Result<Vec<u8>> {
        coder.set_fields_from(items)?;
        coder.compress_many(rows)?;
        coder.done()?;
        Ok(coder.into_inner())
    }
    match is_layered(items) {
        true => with(LayeredPointRecordCompressor::new(Vec::new()), items, rows),
        false => with(SequentialPointRecordCompressor::new(Vec::new()), items, rows),
    }
}
