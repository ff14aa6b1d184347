//! The pages of an E57 file: 1024 bytes, of which the last four are a checksum of the others.
//!
//! Offsets in the file are *physical*, checksums counted; the content without them is *logical* (ASTM E2807, 5).

use std::io::{BufWriter, SeekFrom, Write as _};

use rayon::prelude::*;

use crate::error::{Broken, Place, WriteError};
use crate::output::{Output, Target};

/// Size of a page in bytes: E57 knows no other.
pub(super) const PAGE: usize = 1024;
/// Bytes of a page without its checksum.
pub(super) const PAYLOAD: usize = PAGE - 4;
/// Size of the header at the start of the first page, in bytes.
const HEADER: usize = 48;
/// Pages that are checked at a time: enough that starting the work costs nothing beside it.
const PAGES_TOGETHER: usize = 256;

/// Reads the header, and refuses what the file's size does not justify.
pub(super) fn check_header(bytes: &[u8]) -> Result<(), Broken> {
    let number = |at: usize| {
        let bytes = bytes.get(at..at + 8).and_then(|bytes| bytes.try_into().ok());
        bytes.map(u64::from_le_bytes)
    };
    let (Some(version), Some(n_bytes), Some(xml_offset), Some(xml_length), Some(page)) =
        (number(8), number(16), number(24), number(32), number(40))
    else {
        return Err(Broken::whole(format!(
            "the file ends within the header of {HEADER} bytes: it is cut off, copy it again"
        )));
    };
    if version & 0xffff_ffff != 1 {
        return Err(Broken::new(
            Place::Byte(8),
            format!("E57 of version {}: Normend reads version 1", version & 0xffff_ffff),
        ));
    }
    if page != PAGE as u64 {
        return Err(Broken::new(
            Place::Byte(40),
            format!("pages of {page} bytes where E57 has {PAGE}: export the file again"),
        ));
    }
    if n_bytes > bytes.len() as u64 || !bytes.len().is_multiple_of(PAGE) {
        return Err(Broken::whole(format!(
            "the header announces {n_bytes} bytes in pages of {PAGE}, but the file has {}: it is cut off, copy it again",
            bytes.len()
        )));
    }
    match logical(xml_offset) {
        Some(start) if (start as u64).saturating_add(xml_length) <= logical_size(bytes.len()) as u64 => Ok(()),
        _ => Err(Broken::new(
            Place::Byte(24),
            format!("the XML section ({xml_length} bytes from byte {xml_offset}) lies outside the file: copy it again"),
        )),
    }
}

/// The logical offset of a physical one; `None` within a checksum, or beyond all files.
pub(super) fn logical(physical: u64) -> Option<usize> {
    let physical = usize::try_from(physical)
        .ok()
        .filter(|&offset| offset < usize::MAX / 2)?;
    (physical % PAGE < PAYLOAD).then(|| physical / PAGE * PAYLOAD + physical % PAGE)
}

/// The physical offset of a logical one.
pub(super) fn physical(logical: usize) -> usize {
    logical / PAYLOAD * PAGE + logical % PAYLOAD
}

fn logical_size(physical: usize) -> usize {
    physical / PAGE * PAYLOAD
}

/// Compares all pages with their checksums, in parallel. The size is a multiple of a page's.
pub(super) fn check_pages(bytes: &[u8]) -> Result<(), Broken> {
    let is_damaged = |page: &[u8]| crc32c::crc32c(&page[..PAYLOAD]).to_be_bytes() != page[PAYLOAD..];
    let blocks = bytes.par_chunks(PAGE * PAGES_TOGETHER).enumerate();
    let damaged = blocks.filter_map(|(block, pages)| {
        let page = pages.chunks_exact(PAGE).position(is_damaged)?;
        Some(block * PAGES_TOGETHER + page)
    });
    if let Some(page) = damaged.min() {
        return Err(Broken::new(
            Place::Byte(page * PAGE),
            format!(
                "the checksum of page {} is wrong: the file is damaged, copy it again",
                page + 1
            ),
        ));
    }
    Ok(())
}

/// Takes the checksums out, in place.
pub(super) fn strip(bytes: &mut Vec<u8>) {
    let n_pages = bytes.len() / PAGE;
    for page in 1..n_pages {
        bytes.copy_within(page * PAGE..page * PAGE + PAYLOAD, page * PAYLOAD);
    }
    bytes.truncate(n_pages * PAYLOAD);
}

/// Writes a file page by page; the header last.
pub(super) struct PageWriter<'a> {
    path: &'a std::path::Path,
    file: BufWriter<&'a mut dyn Target>,
    /// Logical bytes that are no full page yet.
    page: Vec<u8>,
    /// The first page, whose header is known last.
    first: Vec<u8>,
    n_pages: usize,
}

impl<'a> PageWriter<'a> {
    pub fn new(out: &'a mut Output<'_>) -> Result<Self, WriteError> {
        let mut writer = Self {
            path: out.path,
            file: BufWriter::with_capacity(1 << 20, &mut *out.file),
            page: Vec::with_capacity(PAGE),
            first: Vec::new(),
            n_pages: 0,
        };
        writer.write(&[0; HEADER])?;
        Ok(writer)
    }

    /// The physical offset of what is written next.
    pub fn position(&self) -> u64 {
        (self.n_pages * PAGE + self.page.len()) as u64
    }

    /// The physical offset of what is written `n_bytes` logical bytes later.
    pub fn position_after(&self, n_bytes: usize) -> u64 {
        physical(self.n_pages * PAYLOAD + self.page.len() + n_bytes) as u64
    }

    /// Appends logical bytes.
    pub fn write(&mut self, mut bytes: &[u8]) -> Result<(), WriteError> {
        while !bytes.is_empty() {
            let n_now = bytes.len().min(PAYLOAD - self.page.len());
            self.page.extend_from_slice(&bytes[..n_now]);
            bytes = &bytes[n_now..];
            if self.page.len() == PAYLOAD {
                self.end_page()?;
            }
        }
        Ok(())
    }

    /// Appends zeros until a multiple of four bytes, where sections begin.
    pub fn align(&mut self) -> Result<(), WriteError> {
        self.write(&[0; 3][..self.page.len().wrapping_neg() % 4])
    }

    /// Appends the XML section and writes the header.
    pub fn finish(mut self, xml: &[u8]) -> Result<(), WriteError> {
        self.align()?;
        let xml_offset = self.position();
        self.write(xml)?;
        if !self.page.is_empty() {
            self.page.resize(PAYLOAD, 0);
            self.end_page()?;
        }
        let numbers = [(self.n_pages * PAGE) as u64, xml_offset, xml.len() as u64, PAGE as u64];
        let header = [&b"ASTM-E57"[..], &1_u32.to_le_bytes(), &0_u32.to_le_bytes()].concat();
        self.first[..16].copy_from_slice(&header);
        for (slot, number) in self.first[16..HEADER].chunks_exact_mut(8).zip(numbers) {
            slot.copy_from_slice(&number.to_le_bytes());
        }
        let checksum = crc32c::crc32c(&self.first).to_be_bytes();
        self.first.extend_from_slice(&checksum);
        let fail = WriteError::io(self.path);
        self.file.flush().map_err(&fail)?;
        let file = self.file.get_mut();
        file.seek(SeekFrom::Start(0)).map_err(&fail)?;
        file.write_all(&self.first).map_err(&fail)
    }

    fn end_page(&mut self) -> Result<(), WriteError> {
        let fail = WriteError::io(self.path);
        self.file.write_all(&self.page).map_err(&fail)?;
        let checksum = crc32c::crc32c(&self.page).to_be_bytes();
        self.file.write_all(&checksum).map_err(&fail)?;
        if self.n_pages == 0 {
            self.first.clone_from(&self.page);
        }
        self.n_pages += 1;
        self.page.clear();
        Ok(())
    }
}
