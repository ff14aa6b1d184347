//! The header of a PCD file, and where each of its words is.
//!
//! `pcd_rs` knows the grammar. It gets a cleaned copy, because real headers leave entries out, and names and comments may be in
//! any encoding; export copies the file's own bytes.

use glam::DVec3;
use pcd_rs::{DataKind, PcdMeta, ValueKind};

use super::Edit;
use crate::error::{Broken, Place, quoted};
use crate::table::{Span, next_token};
use crate::value::Scalar;

/// What begins the comment that Normend leaves in the files it writes.
const OWN_COMMENT: &[u8] = b"# Normend ";

/// Most numbers that a point may have. Each has a name in memory, and no scan has nearly as many; the longest of the usual
/// descriptors has 1344 (SHOT with colors).
const MOST_VALUES: usize = 4096;

/// The entries of a header, the last of which ends it. `COLUMNS` is what PCL also reads as `FIELDS`.
const KEYWORDS: [&str; 11] = [
    "VERSION",
    "FIELDS",
    "COLUMNS",
    "SIZE",
    "TYPE",
    "COUNT",
    "WIDTH",
    "HEIGHT",
    "VIEWPOINT",
    "POINTS",
    "DATA",
];

/// What a PCD file says of its points.
#[derive(Clone, Debug)]
pub(crate) struct Header {
    pub data: DataKind,
    pub fields: Vec<Field>,
    pub n_points: usize,
    /// Columns and rows of the grid in which the points were measured; one row when there is no grid.
    pub width: u64,
    pub height: u64,
    /// Where the scanner stood; `None` where it says what is written when nothing is known.
    pub station: Option<DVec3>,
    entries: Vec<Entry>,
    /// The byte after the first line, and what ends it.
    after_first_line: usize,
    line_end: &'static str,
    /// Former comment of Normend, without its line end.
    own_comment: Option<Span>,
    /// The byte where the payload begins.
    pub end: usize,
}

/// Some numbers of one type that a point has.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    pub name: String,
    pub scalar: Scalar,
    pub count: usize,
}

impl Field {
    /// Size in bytes of its numbers together.
    pub fn size(&self) -> usize {
        self.scalar.size() * self.count
    }

    /// Whether it only fills space (`_`, as PCL writes it).
    pub fn is_padding(&self) -> bool {
        self.name == "_"
    }
}

/// A line of the header that is no comment.
#[derive(Clone, Debug)]
struct Entry {
    /// Which of the [`KEYWORDS`] it begins with.
    keyword: &'static str,
    /// Counted from 1.
    line: usize,
    /// What follows the keyword.
    words: Vec<Span>,
}

/// Whether these are the first bytes of a PCD file, as nearly all programs write it.
pub(crate) fn sniff(bytes: &[u8]) -> bool {
    bytes.starts_with(b"# .PCD")
}

/// Reads the header; nothing of the payload is looked at.
pub(crate) fn parse(bytes: &[u8]) -> Result<Header, Broken> {
    let mut entries: Vec<Entry> = Vec::new();
    let mut own_comment = None;
    let mut after_first_line = 0;
    let mut line_end = "\n";
    let mut at = 0;
    for line in 1.. {
        if at == bytes.len() {
            return Err(Broken::whole(
                "there is no line that begins with DATA, which ends the header of a PCD file: copy or export the file again",
            ));
        }
        let length = memchr::memchr(b'\n', &bytes[at..]);
        let end = length.map_or(bytes.len(), |length| at + length);
        let content = Span {
            start: at,
            end: at + bytes[at..end].strip_suffix(b"\r").unwrap_or(&bytes[at..end]).len(),
        };
        at = length.map_or(bytes.len(), |_| end + 1);
        if line == 1 {
            after_first_line = at;
            line_end = if content.end < end { "\r\n" } else { "\n" };
        }
        if content.of(bytes).starts_with(OWN_COMMENT) {
            own_comment.get_or_insert(content);
        }
        let Some(entry) = entry(bytes, content, line) else {
            continue;
        };
        if entries.iter().any(|other| other.keyword == entry.keyword) {
            return entry.fail(format!("a second line {}: remove the wrong one", entry.keyword));
        }
        let is_last = entry.keyword == "DATA";
        entries.push(entry);
        if is_last {
            break;
        }
    }
    let meta = match PcdMeta::from_reader(cleaned(bytes, &entries).as_bytes()) {
        Ok(meta) => meta,
        Err(error) => return Err(why_not(bytes, &entries, &error)),
    };
    let names = entries
        .iter()
        .find(|entry| matches!(entry.keyword, "FIELDS" | "COLUMNS"));
    let names = names.map_or(&[][..], |entry| &entry.words);
    let n_values = meta
        .field_defs
        .iter()
        .try_fold(0_u64, |sum, field| sum.checked_add(field.count));
    if n_values.is_none_or(|n_values| n_values > MOST_VALUES as u64) {
        return Err(Broken::whole(format!(
            "a point has more than {MOST_VALUES} numbers: export the file with fewer"
        )));
    }
    let fields = meta.field_defs.iter().zip(names).map(|(field, name)| Field {
        name: String::from_utf8_lossy(name.of(bytes)).into_owned(),
        scalar: scalar_of(field.kind),
        count: field.count as usize,
    });
    let viewpoint = &meta.viewpoint;
    let place = DVec3::new(viewpoint.tx, viewpoint.ty, viewpoint.tz);
    // What is written when nothing is known of the scanner: no shift, no rotation.
    let is_unknown = place == DVec3::ZERO
        && [viewpoint.qx, viewpoint.qy, viewpoint.qz]
            .iter()
            .all(|component| *component == 0.0);
    Ok(Header {
        data: meta.data,
        fields: fields.collect(),
        n_points: usize::try_from(meta.num_points).unwrap_or(usize::MAX),
        width: meta.width,
        height: meta.height,
        station: (place.is_finite() && !is_unknown).then_some(place),
        entries,
        after_first_line,
        line_end,
        own_comment,
        end: at,
    })
}

/// An entry, if the line is one. What is no entry is kept and not looked at, as comments are.
fn entry(bytes: &[u8], line: Span, number: usize) -> Option<Entry> {
    let first = next_token(&bytes[..line.end], line.start)?;
    let keyword = KEYWORDS
        .into_iter()
        .find(|keyword| first.of(bytes).eq_ignore_ascii_case(keyword.as_bytes()))?;
    let mut words = Vec::new();
    let mut at = first.end;
    // One more than there may be is enough to see that there are too many.
    while words.len() <= MOST_VALUES
        && let Some(word) = next_token(&bytes[..line.end], at)
        && !word.of(bytes).starts_with(b"#")
    {
        at = word.end;
        words.push(word);
    }
    Some(Entry {
        keyword,
        line: number,
        words,
    })
}

impl Entry {
    fn fail<T>(&self, reason: String) -> Result<T, Broken> {
        Err(Broken::new(Place::Line(self.line), reason))
    }
}

/// The entries as `pcd_rs` understands them: all of them, with names of its own. Where one is left out stands what PCL takes
/// for it then: version 0.7, all points in one row.
fn cleaned(bytes: &[u8], entries: &[Entry]) -> String {
    let find = |keyword: &str| entries.iter().find(|entry| entry.keyword == keyword);
    let number = |keyword: &str| {
        let word = find(keyword)?.words.first()?;
        str::from_utf8(word.of(bytes)).ok()?.parse::<u64>().ok()
    };
    let mut text = String::new();
    for entry in entries.iter().filter(|entry| entry.keyword != "DATA") {
        text.push_str(entry.keyword);
        for (index, word) in entry.words.iter().enumerate() {
            let word = String::from_utf8_lossy(word.of(bytes));
            let word = match entry.keyword {
                "FIELDS" | "COLUMNS" if word != "_" => format!("name{index}"),
                "TYPE" => word.to_ascii_uppercase(),
                _ => word.into_owned(),
            };
            text.push(' ');
            text.push_str(&word);
        }
        text.push('\n');
    }
    if find("VERSION").is_none() {
        text.push_str("VERSION 0.7\n");
    }
    let n_points = number("POINTS").or_else(|| number("WIDTH")?.checked_mul(number("HEIGHT").unwrap_or(1)));
    if let Some(n_points) = n_points {
        for (keyword, value) in [("POINTS", n_points), ("WIDTH", n_points), ("HEIGHT", 1)] {
            if find(keyword).is_none() {
                text.push_str(&format!("{keyword} {value}\n"));
            }
        }
    }
    if let Some(data) = find("DATA") {
        let words: Vec<String> = data
            .words
            .iter()
            .map(|word| String::from_utf8_lossy(word.of(bytes)).to_ascii_lowercase())
            .collect();
        text.push_str(&format!("DATA {}\n", words.join(" ")));
    }
    text
}

/// Why the header is not understood.
fn why_not(bytes: &[u8], entries: &[Entry], error: &pcd_rs::Error) -> Broken {
    let find = |keyword: &str| entries.iter().find(|entry| entry.keyword == keyword);
    let Some(names) = find("FIELDS").or_else(|| find("COLUMNS")) else {
        return Broken::whole("the header has no line FIELDS, which names what a point has: export the file again");
    };
    for keyword in ["SIZE", "TYPE"] {
        if find(keyword).is_none() {
            return Broken::whole(format!("the header has no line {keyword}: export the file again"));
        }
    }
    if find("POINTS").is_none() && find("WIDTH").is_none() {
        return Broken::whole(
            "the header has no line POINTS, which says how many points there are: export the file again",
        );
    }
    for entry in entries {
        let words = entry.words.iter().map(|word| word.of(bytes));
        let shown = || quoted(&words.clone().collect::<Vec<&[u8]>>().join(&b' '));
        let is_count = |word: &[u8]| str::from_utf8(word).is_ok_and(|word| word.parse::<u64>().is_ok());
        let n_expected = match entry.keyword {
            "SIZE" | "TYPE" | "COUNT" => names.words.len(),
            "VIEWPOINT" => 7,
            "FIELDS" | "COLUMNS" => entry.words.len().max(1),
            _ => 1,
        };
        let reason = match entry.keyword {
            _ if entry.words.len() != n_expected => {
                let values = if n_expected == 1 { "value" } else { "values" };
                format!(
                    "{} has {}, but should have {n_expected} {values}: correct the line",
                    entry.keyword,
                    entry.words.len()
                )
            }
            "SIZE" if !words.clone().all(|word| matches!(word, b"1" | b"2" | b"4" | b"8")) => {
                format!(
                    "SIZE is {}, but numbers of PCD take 1, 2, 4 or 8 bytes: correct it",
                    shown()
                )
            }
            "TYPE"
                if !words
                    .clone()
                    .all(|word| matches!(word, b"I" | b"U" | b"F" | b"i" | b"u" | b"f")) =>
            {
                format!(
                    "TYPE is {}, but numbers of PCD are of type I, U or F: correct it",
                    shown()
                )
            }
            "COUNT" | "WIDTH" | "HEIGHT" | "POINTS" if !words.clone().all(is_count) => {
                format!("{} is {}, not whole numbers: correct it", entry.keyword, shown())
            }
            "VIEWPOINT" if !words.clone().all(|word| crate::value::parse(word).is_some()) => {
                format!("VIEWPOINT is {}, not seven numbers: correct it", shown())
            }
            "VERSION"
                if !words
                    .clone()
                    .all(|word| matches!(word, b".7" | b"0.7" | b".6" | b"0.6" | b".5" | b"0.5")) =>
            {
                format!(
                    "VERSION is {}, but Normend reads .5, .6 and .7: export the file as .7",
                    shown()
                )
            }
            "DATA" => format!(
                "DATA is {}, but should be ascii, binary or binary_compressed: correct it",
                shown()
            ),
            _ => continue,
        };
        // A header of the right shape whose DATA is right too has a fault that only `pcd_rs` knows.
        let is_known = |word: &[u8]| {
            [&b"ascii"[..], b"binary", b"binary_compressed"]
                .iter()
                .any(|known| word.eq_ignore_ascii_case(known))
        };
        if entry.keyword == "DATA" && words.clone().count() == 1 && words.clone().all(is_known) {
            break;
        }
        return Broken::new(Place::Line(entry.line), reason);
    }
    Broken::whole(format!("the header is not understood ({error}): export the file again"))
}

fn scalar_of(kind: ValueKind) -> Scalar {
    match kind {
        ValueKind::U8 => Scalar::UChar,
        ValueKind::U16 => Scalar::UShort,
        ValueKind::U32 => Scalar::UInt,
        ValueKind::U64 => Scalar::ULong,
        ValueKind::I8 => Scalar::Char,
        ValueKind::I16 => Scalar::Short,
        ValueKind::I32 => Scalar::Int,
        ValueKind::I64 => Scalar::Long,
        ValueKind::F32 => Scalar::Float,
        ValueKind::F64 => Scalar::Double,
    }
}

/// TYPE and SIZE of a number.
pub(crate) fn type_and_size(scalar: Scalar) -> (char, usize) {
    let letter = match scalar {
        Scalar::Float | Scalar::Double => 'F',
        Scalar::Char | Scalar::Short | Scalar::Int | Scalar::Long => 'I',
        Scalar::UChar | Scalar::UShort | Scalar::UInt | Scalar::ULong => 'U',
    };
    (letter, scalar.size())
}

impl Header {
    /// What changes in the header when `comment` is written and `fields` change: ranges of bytes and what takes their place, in
    /// order.
    pub fn edits(&self, comment: &str, fields: &[(usize, Edit)]) -> Vec<(Span, Vec<u8>)> {
        let mut edits = Vec::new();
        let at = |at: usize| Span { start: at, end: at };
        match self.own_comment {
            Some(span) => edits.push((span, format!("# {comment}").into_bytes())),
            None => edits.push((
                at(self.after_first_line),
                format!("# {comment}{}", self.line_end).into_bytes(),
            )),
        }
        for entry in &self.entries {
            // How the value of a field is written in this line.
            let word_of = |name: &str, scalar: Scalar| match entry.keyword {
                "FIELDS" | "COLUMNS" => Some(name.to_owned()),
                "SIZE" => Some(type_and_size(scalar).1.to_string()),
                "TYPE" => Some(type_and_size(scalar).0.to_string()),
                "COUNT" => Some("1".to_owned()),
                _ => None,
            };
            for (field, edit) in fields {
                let Some(&word) = entry.words.get(*field) else {
                    continue;
                };
                match edit {
                    Edit::Retyped if matches!(entry.keyword, "SIZE" | "TYPE") => {
                        edits.extend(word_of("", Scalar::Float).map(|new| (word, new.into_bytes())));
                    }
                    Edit::Retyped => {}
                    Edit::Added(name, scalar) => {
                        let new = word_of(name, *scalar);
                        edits.extend(new.map(|new| (at(word.end), format!(" {new}").into_bytes())));
                    }
                }
            }
        }
        edits.sort_by_key(|(span, _)| span.start);
        edits
    }
}
