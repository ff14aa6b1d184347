//! The lines of an OBJ file, their words, and what faces refer to.

use crate::table::{Span, is_space};

/// What a line is, as far as it matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// `v`: a point.
    Vertex,
    /// `vn`: a normal.
    Normal,
    /// `vt`: a place in a texture.
    Texture,
    /// Something whose words from this one on refer to points, textures and normals (`f`, `surf`).
    Corners(usize),
    /// A comment, or nothing.
    Nothing,
    /// Anything else, which is kept.
    Other,
}

/// A line, with what a backslash at its end joins to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub kind: Kind,
    /// Its bytes without its end.
    pub span: Span,
    /// The byte after its end.
    pub after: usize,
}

/// Goes through the lines from a byte on.
#[derive(Clone)]
pub(crate) struct Lines<'a> {
    pub bytes: &'a [u8],
    /// What ends a line: `\n`, or `\r` when there is no `\n`.
    pub line_end: u8,
    pub at: usize,
}

impl Iterator for Lines<'_> {
    type Item = Line;

    fn next(&mut self) -> Option<Line> {
        let bytes = self.bytes;
        let start = self.at;
        if start == bytes.len() {
            return None;
        }
        let mut end = self.end_of_line(start);
        let kind = kind(bytes, Span { start, end });
        // Names and comments may end with a backslash as paths do.
        if !matches!(kind, Kind::Nothing | Kind::Other) {
            while end < bytes.len() && bytes[..end].trim_ascii_end_of_line().ends_with(b"\\") {
                end = self.end_of_line(end + 1);
            }
        }
        self.at = (end + 1).min(bytes.len());
        Some(Line {
            kind,
            span: Span {
                start,
                end: start + bytes[start..end].trim_ascii_end_of_line().len(),
            },
            after: self.at,
        })
    }
}

impl Lines<'_> {
    fn end_of_line(&self, at: usize) -> usize {
        memchr::memchr(self.line_end, &self.bytes[at..]).map_or(self.bytes.len(), |length| at + length)
    }
}

/// Bytes without the carriage return that ends them.
trait EndOfLine {
    fn trim_ascii_end_of_line(&self) -> &Self;
}

impl EndOfLine for [u8] {
    fn trim_ascii_end_of_line(&self) -> &[u8] {
        self.strip_suffix(b"\r").unwrap_or(self)
    }
}

fn kind(bytes: &[u8], line: Span) -> Kind {
    let Some(word) = words(bytes, line).next() else {
        return Kind::Nothing;
    };
    match word.of(bytes) {
        b"v" => Kind::Vertex,
        b"vn" => Kind::Normal,
        b"vt" => Kind::Texture,
        b"f" | b"fo" => Kind::Corners(1),
        // After its name come the range of its parameters.
        b"surf" => Kind::Corners(5),
        _ => Kind::Other,
    }
}

/// The words of a line up to a comment.
pub(crate) fn words(bytes: &[u8], line: Span) -> impl Iterator<Item = Span> {
    let bytes = &bytes[..line.end];
    let mut at = line.start;
    let is_gap = |at: usize| {
        let joins = |next: Option<&u8>| matches!(next, Some(b'\r' | b'\n'));
        is_space(bytes[at]) || (bytes[at] == b'\\' && joins(bytes.get(at + 1)))
    };
    std::iter::from_fn(move || {
        while at < bytes.len() && is_gap(at) {
            at += 1;
        }
        let start = at;
        while at < bytes.len() && !is_gap(at) {
            at += 1;
        }
        if start == at || bytes[start] == b'#' {
            at = bytes.len();
            return None;
        }
        Some(Span { start, end: at })
    })
}

/// A corner of a face: the parts of `point/texture/normal`, empty where they are left out.
pub(crate) struct Corner<'a> {
    pub point: &'a [u8],
    pub texture: &'a [u8],
    pub normal: &'a [u8],
}

impl<'a> Corner<'a> {
    pub fn of(word: &'a [u8]) -> Self {
        let mut parts = word.splitn(3, |&byte| byte == b'/');
        let mut next = || parts.next().unwrap_or_default();
        Self {
            point: next(),
            texture: next(),
            normal: next(),
        }
    }
}

/// Which of things numbered from 1 is meant, counted from 0, where `n_before` of them stand before and `n_all` are there at all.
/// Negative numbers count back from the last one before.
pub(crate) fn resolved(reference: &[u8], n_before: usize, n_all: usize) -> Option<usize> {
    let number: i64 = str::from_utf8(reference).ok()?.parse().ok()?;
    let index = match number {
        1.. => usize::try_from(number).ok()? - 1,
        0 => return None,
        _ => n_before.checked_sub(usize::try_from(number.unsigned_abs()).ok()?)?,
    };
    (index < n_all).then_some(index)
}
