//! The rows of a PCD file in text, and the columns of a packed one.

use crate::error::{Broken, Place, quoted};
use crate::table::{N_VALUES, Rows, Span, Spans, is_space, next_token};

/// The line of a byte, counted from 1.
pub(crate) fn line_of(bytes: &[u8], byte: usize) -> Place {
    Place::Line(1 + memchr::memchr_iter(b'\n', &bytes[..byte]).count())
}

/// Lines with a point each. Lines with nothing in them are passed over.
pub(crate) struct TextRows<'a> {
    bytes: &'a [u8],
    /// Which word of the line each value is.
    words: [Option<usize>; N_VALUES],
    n_words: usize,
    at: usize,
}

impl<'a> TextRows<'a> {
    pub fn new(bytes: &'a [u8], words: [Option<usize>; N_VALUES], n_words: usize, start: usize) -> Self {
        Self {
            bytes,
            words,
            n_words,
            at: start,
        }
    }
}

impl Rows for TextRows<'_> {
    fn next_row(&mut self) -> Result<Option<Spans>, Broken> {
        let Some(first) = next_token(self.bytes, self.at) else {
            return Ok(None);
        };
        let length = memchr::memchr(b'\n', &self.bytes[first.start..]);
        let line_end = length.map_or(self.bytes.len(), |length| first.start + length);
        let line = &self.bytes[..line_end];
        self.at = length.map_or(line_end, |_| line_end + 1);
        let mut spans = Spans::default();
        let mut n_words = 0;
        let mut next = Some(first);
        while let Some(word) = next {
            for (span, wanted) in spans.iter_mut().zip(&self.words) {
                if *wanted == Some(n_words) {
                    *span = word;
                }
            }
            n_words += 1;
            next = next_token(line, word.end);
        }
        if n_words != self.n_words {
            let shown = quoted(self.bytes[first.start..line_end].trim_ascii_end());
            let (n_expected, noun) = (self.n_words, if n_words == 1 { "value" } else { "values" });
            return Err(Broken::new(
                line_of(self.bytes, first.start),
                format!(
                    "{shown} has {n_words} {noun}, but FIELDS and COUNT announce {n_expected} for each point: correct the line"
                ),
            ));
        }
        Ok(Some(spans))
    }

    fn position(&self) -> usize {
        self.at
    }
}

/// The first byte from `at` on that is no space.
pub(crate) fn next_word(bytes: &[u8], at: usize) -> Option<usize> {
    Some(at + bytes[at..].iter().position(|byte| !is_space(*byte))?)
}

/// What the columns of a packed file are made of: all rows' first parts, then all rows' second parts, and so on.
pub(crate) struct Transposed {
    /// Size in bytes of each part of a row.
    sizes: Vec<usize>,
    n_rows: usize,
}

impl Transposed {
    pub fn new(sizes: Vec<usize>, n_rows: usize) -> Self {
        Self { sizes, n_rows }
    }

    /// Size in bytes of all of it.
    pub fn n_bytes(&self) -> usize {
        self.sizes.iter().sum::<usize>() * self.n_rows
    }

    /// Where the bytes `range` of the columns stand in the rows: `each` gets where a run of them begins there, and its length,
    /// in order.
    pub fn for_each_run(&self, range: Span, mut each: impl FnMut(usize, usize)) {
        let stride: usize = self.sizes.iter().sum();
        let mut at = range.start;
        let (mut offset, mut column_start) = (0, 0);
        for &size in &self.sizes {
            let column_end = column_start + size * self.n_rows;
            while at < column_end.min(range.end) {
                let (row, skipped) = ((at - column_start) / size, (at - column_start) % size);
                let length = (size - skipped).min(range.end - at);
                each(row * stride + offset + skipped, length);
                at += length;
            }
            offset += size;
            column_start = column_end;
        }
    }
}
