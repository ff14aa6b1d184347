//! The rows of PLY elements: of one size, with lists, and in text.

use normend_core::Progress;
use ply_rs::ply::Encoding;

use super::Slots;
use super::header::{Element, Header, Kind};
use crate::error::{Broken, Place, Stop, quoted};
use crate::table::{Rows, Span, Spans, next_token};
use crate::value::parse;

/// Rows between two reports of progress.
const REPORT_ROWS: usize = 1 << 14;

/// The place of a byte of the payload, for messages: a line in text, else the byte.
pub(crate) fn place(header: &Header, bytes: &[u8], byte: usize) -> Place {
    match (header.encoding, header.line_end.last()) {
        (Encoding::Ascii, Some(line_end)) => {
            Place::Line(1 + memchr::memchr_iter(*line_end, &bytes[..byte.min(bytes.len())]).count())
        }
        _ => Place::Byte(byte),
    }
}

/// Refuses an element whose rows cannot fit into what is left of the file, or that says nothing about its rows.
pub(crate) fn check_room(bytes: &[u8], header: &Header, element: &Element, at: usize) -> Result<(), Broken> {
    let (name, count) = (&element.name, element.count);
    let fail = |reason: String| Err(Broken::new(Place::Line(element.line), reason));
    if count > 0 && element.properties.is_empty() {
        return fail(format!(
            "element \"{name}\" has {count} rows but no properties: remove it or declare them"
        ));
    }
    let n_left = bytes.len() - at;
    // The last value of a text needs nothing after it.
    let n_free = usize::from(header.encoding == Encoding::Ascii);
    match element.least_stride(header.encoding).checked_mul(count) {
        Some(n_needed) if n_needed <= n_left + n_free => Ok(()),
        _ => fail(format!(
            "{count} rows of element \"{name}\" do not fit into the {n_left} bytes after byte {at}: \
             the file is cut off or the count is wrong, export it again"
        )),
    }
}

/// Goes over all rows of an element that is only kept; returns the byte after it.
pub(crate) fn skip_element(
    bytes: &[u8],
    header: &Header,
    element: &Element,
    start: usize,
    progress: &dyn Progress,
) -> Result<usize, Stop> {
    check_room(bytes, header, element, start)?;
    if let (Encoding::BinaryLittleEndian | Encoding::BinaryBigEndian, Some(stride)) =
        (header.encoding, element.stride())
    {
        return Ok(start + element.count * stride);
    }
    let mut at = start;
    for row in 0..element.count {
        if row % REPORT_ROWS == 0 {
            progress.report(at as f32 / bytes.len() as f32)?;
        }
        for property in &element.properties {
            at = property_span(bytes, header, element, property.kind, at, row)?.end;
        }
    }
    Ok(at)
}

fn cut_off(header: &Header, bytes: &[u8], element: &Element, row: usize) -> Broken {
    Broken::new(
        place(header, bytes, bytes.len()),
        format!(
            "the file ends in row {} of the {} rows of element \"{}\": it is cut off, copy or export it again",
            row + 1,
            element.count,
            element.name
        ),
    )
}

/// The bytes of a property of row `row`, searched from byte `at` on.
#[inline]
fn property_span(
    bytes: &[u8],
    header: &Header,
    element: &Element,
    kind: Kind,
    at: usize,
    row: usize,
) -> Result<Span, Broken> {
    match header.encoding {
        Encoding::Ascii => text_span(bytes, header, element, kind, at, row),
        Encoding::BinaryLittleEndian | Encoding::BinaryBigEndian => binary_span(bytes, header, element, kind, at, row),
    }
}

/// The bytes of a binary property of row `row` that begins at byte `at`.
fn binary_span(
    bytes: &[u8],
    header: &Header,
    element: &Element,
    kind: Kind,
    at: usize,
    row: usize,
) -> Result<Span, Broken> {
    let take = |start: usize, size: usize| match start.checked_add(size) {
        Some(end) if end <= bytes.len() => Ok(Span { start, end }),
        _ => Err(cut_off(header, bytes, element, row)),
    };
    match kind {
        Kind::Scalar(scalar) => take(at, scalar.size()),
        Kind::List { length, item } => {
            let length_span = take(at, length.size())?;
            let n_items = header.value_type(length).read(length_span.of(bytes)).unwrap_or(-1.0);
            let n_bytes = n_items * item.size() as f64;
            if n_items < 0.0 || n_bytes > (bytes.len() - length_span.end) as f64 {
                return Err(Broken::new(
                    Place::Byte(at),
                    format!(
                        "a list in row {} of element \"{}\" has the length {n_items}, but {} bytes are left: \
                         the file is damaged or cut off, export it again",
                        row + 1,
                        element.name,
                        bytes.len() - length_span.end
                    ),
                ));
            }
            let items = take(length_span.end, n_bytes as usize)?;
            Ok(Span {
                start: at,
                end: items.end,
            })
        }
    }
}

/// The bytes of a property in text: of a number itself, of a list from its length to its last item.
fn text_span(
    bytes: &[u8],
    header: &Header,
    element: &Element,
    kind: Kind,
    at: usize,
    row: usize,
) -> Result<Span, Broken> {
    let token = next_token(bytes, at).ok_or_else(|| cut_off(header, bytes, element, row))?;
    if let Kind::Scalar(_) = kind {
        return Ok(token);
    }
    let length = parse(token.of(bytes)).filter(|length| *length >= 0.0 && length.fract() == 0.0);
    let n_left = bytes.len() - token.end;
    match length {
        Some(n_items) if 2.0 * n_items <= n_left as f64 => {
            let mut end = token.end;
            for _ in 0..n_items as usize {
                end = next_token(bytes, end)
                    .ok_or_else(|| cut_off(header, bytes, element, row))?
                    .end;
            }
            Ok(Span {
                start: token.start,
                end,
            })
        }
        _ => Err(Broken::new(
            place(header, bytes, token.start),
            format!(
                "a list in row {} of element \"{}\" has the length {}, but {n_left} bytes are left: correct the line",
                row + 1,
                element.name,
                quoted(token.of(bytes))
            ),
        )),
    }
}

/// Which of the values each property is, if any.
fn slots_of_properties(element: &Element, slots: &Slots) -> Vec<Option<usize>> {
    let slot_of = |property| slots.properties.iter().position(|wanted| *wanted == Some(property));
    (0..element.properties.len()).map(slot_of).collect()
}

/// Where the values are in binary rows that all have the same size.
pub(crate) fn offsets(element: &Element, slots: &Slots) -> Spans {
    let mut offsets = Spans::default();
    let mut offset = 0;
    for (property, slot) in element.properties.iter().zip(slots_of_properties(element, slots)) {
        let size = match property.kind {
            Kind::Scalar(scalar) => scalar.size(),
            Kind::List { .. } => 0,
        };
        if let Some(slot) = slot {
            offsets[slot] = Span {
                start: offset,
                end: offset + size,
            };
        }
        offset += size;
    }
    offsets
}

/// Rows that are walked through value by value, because lists give each its own size.
pub(crate) struct WalkedRows<'a> {
    bytes: &'a [u8],
    header: &'a Header,
    element: &'a Element,
    slots: Vec<Option<usize>>,
    at: usize,
    row: usize,
}

impl<'a> WalkedRows<'a> {
    pub fn new(bytes: &'a [u8], header: &'a Header, element: &'a Element, slots: &Slots, start: usize) -> Self {
        Self {
            bytes,
            header,
            element,
            slots: slots_of_properties(element, slots),
            at: start,
            row: 0,
        }
    }
}

impl Rows for WalkedRows<'_> {
    fn next_row(&mut self) -> Result<Option<Spans>, Broken> {
        let mut spans = Spans::default();
        for (property, slot) in self.element.properties.iter().zip(&self.slots) {
            let span = property_span(self.bytes, self.header, self.element, property.kind, self.at, self.row)?;
            self.at = span.end;
            if let Some(slot) = slot {
                spans[*slot] = span;
            }
        }
        self.row += 1;
        Ok(Some(spans))
    }

    fn position(&self) -> usize {
        self.at
    }
}
