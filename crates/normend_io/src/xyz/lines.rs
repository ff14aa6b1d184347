//! Lines of a text and the values in them.

use crate::table::{Span, is_space};

/// What may stand between values, and in them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Decimal {
    /// Numbers have points; commas separate values.
    Point,
    /// Numbers have commas; spaces, tabs and semicolons separate values.
    Comma,
}

impl Decimal {
    /// Whether a byte separates values.
    pub fn is_separator(self, byte: u8) -> bool {
        is_space(byte) || self.is_mark(byte)
    }

    /// Whether a byte, once between two values, separates them.
    fn is_mark(self, byte: u8) -> bool {
        matches!(byte, b';' | b'|') || (byte == b',' && self == Self::Point)
    }
}

/// Whether a line holds no point: a comment or nothing.
pub(super) fn is_skipped(line: &[u8]) -> bool {
    let content = line.trim_ascii_start();
    content.is_empty() || content.starts_with(b"#") || content.starts_with(b"//")
}

/// The lines of a text, without their ends.
#[derive(Clone, Copy)]
pub(super) struct Lines<'a> {
    pub bytes: &'a [u8],
    pub line_end: u8,
    pub at: usize,
}

impl Iterator for Lines<'_> {
    type Item = Span;

    fn next(&mut self) -> Option<Span> {
        if self.at == self.bytes.len() {
            return None;
        }
        let start = self.at;
        let rest = &self.bytes[start..];
        let length = memchr::memchr(self.line_end, rest);
        self.at = length.map_or(self.bytes.len(), |length| start + length + 1);
        let line = &rest[..length.unwrap_or(rest.len())];
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        Some(Span {
            start,
            end: start + line.len(),
        })
    }
}

/// The values of a line: separated by spaces, or by one comma, semicolon or bar with spaces around it.
pub(super) struct Values<'a> {
    line: &'a [u8],
    decimal: Decimal,
    at: usize,
}

impl<'a> Values<'a> {
    pub fn new(line: &'a [u8], decimal: Decimal) -> Self {
        Self { line, decimal, at: 0 }
    }

    fn skip_spaces(&mut self) {
        while self.at < self.line.len() && is_space(self.line[self.at]) {
            self.at += 1;
        }
    }
}

impl Iterator for Values<'_> {
    type Item = Span;

    #[inline]
    fn next(&mut self) -> Option<Span> {
        self.skip_spaces();
        if self.at == self.line.len() {
            return None;
        }
        let start = self.at;
        let is_end = |byte: &u8| self.decimal.is_separator(*byte);
        let end = start
            + self.line[start..]
                .iter()
                .position(is_end)
                .unwrap_or(self.line.len() - start);
        self.at = end;
        self.skip_spaces();
        if self.line.get(self.at).is_some_and(|&byte| self.decimal.is_mark(byte)) {
            self.at += 1;
        }
        Some(Span { start, end })
    }
}
