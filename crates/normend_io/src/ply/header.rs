//! The header of a PLY file, and where each of its lines is.
//!
//! `ply_rs` knows the grammar. It gets a cleaned copy, because comments may be in any encoding and names may hold any
//! character; export copies the file's own bytes.

use std::collections::HashSet;

use ply_rs::parser::Parser;
use ply_rs::ply::{DefaultElement, Encoding, PropertyType, ScalarType};

use crate::error::{Broken, Place, quoted};
use crate::table::{Span, next_token};
use crate::value::{Scalar, ValueType};

/// What begins the comment that Normend leaves in the files it writes.
pub(crate) const OWN_COMMENT: &[u8] = b"comment Normend ";

/// Most elements and properties that a header may declare. Each takes many times the memory of its line, and no scan has
/// nearly as many.
const MOST_ELEMENTS: usize = 1024;
const MOST_PROPERTIES: usize = 4096;

#[derive(Clone, Debug)]
pub(crate) struct Header {
    pub encoding: Encoding,
    /// What ends each line: `\n`, `\r\n` or `\r`.
    pub line_end: &'static [u8],
    pub elements: Vec<Element>,
    /// The byte after the format line.
    pub after_format: usize,
    /// Former comment of Normend, without its line end.
    pub own_comment: Option<Span>,
    /// The byte where the payload begins.
    pub end: usize,
}

#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
    pub line: usize,
}

#[derive(Clone, Debug)]
pub(crate) struct Property {
    pub name: String,
    pub kind: Kind,
    /// Where its type is declared.
    pub type_span: Span,
    /// The byte after its line.
    pub after_line: usize,
    pub line: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Scalar(Scalar),
    List { length: Scalar, item: Scalar },
}

impl Element {
    /// Size of a row in bytes, when all rows have the same.
    pub fn stride(&self) -> Option<usize> {
        let sizes = self.properties.iter().map(|property| match property.kind {
            Kind::Scalar(scalar) => Some(scalar.size()),
            Kind::List { .. } => None,
        });
        sizes.sum()
    }

    /// Fewest bytes that a row takes: lists may be empty.
    pub fn least_stride(&self, encoding: Encoding) -> usize {
        let sizes = self.properties.iter().map(|property| match (encoding, property.kind) {
            // A digit and what separates it from the next.
            (Encoding::Ascii, _) => 2,
            (_, Kind::Scalar(scalar) | Kind::List { length: scalar, .. }) => scalar.size(),
        });
        sizes.sum()
    }
}

impl Header {
    /// How the payload writes a number of type `scalar`.
    pub fn value_type(&self, scalar: Scalar) -> ValueType {
        match self.encoding {
            Encoding::Ascii => ValueType::Text,
            Encoding::BinaryLittleEndian => ValueType::LittleEndian(scalar),
            Encoding::BinaryBigEndian => ValueType::BigEndian(scalar),
        }
    }
}

/// Whether these are the first bytes of a PLY file.
pub(crate) fn sniff(bytes: &[u8]) -> bool {
    bytes
        .strip_prefix(b"ply")
        .is_some_and(|rest| rest.first().is_none_or(u8::is_ascii_whitespace))
}

/// Reads the header; nothing of the payload is looked at.
pub(crate) fn parse(bytes: &[u8]) -> Result<Header, Broken> {
    let mut lines = Lines::new(bytes);
    let magic = lines.next().map_or(Span::default(), |line| line.span);
    if !sniff(bytes) {
        return Err(Broken::new(
            Place::Line(1),
            format!(
                "a PLY file begins with \"ply\", this one with {}: name a PLY file",
                quoted(magic.of(bytes))
            ),
        ));
    }
    let mut declarations = Vec::new();
    let mut own_comment = None;
    let mut has_format = false;
    let (mut n_elements, mut n_properties) = (0, 0);
    loop {
        let Some(line) = lines.next() else {
            return Err(Broken::new(
                Place::Byte(bytes.len()),
                "the file ends before \"end_header\": it is cut off, copy or export it again",
            ));
        };
        let words = words(bytes, line.span);
        match words.first().map_or(&b""[..], |word| word.of(bytes)) {
            b"" | b"obj_info" => {}
            b"comment" => {
                if own_comment.is_none() && line.span.of(bytes).starts_with(OWN_COMMENT) {
                    own_comment = Some(line.span);
                }
            }
            b"end_header" => {
                declarations.push(Declaration { line, words });
                break;
            }
            keyword @ (b"format" | b"element" | b"property") => {
                let declaration = Declaration { line, words };
                if keyword == b"format" && has_format {
                    return declaration.fail("a second format line: remove the wrong one".to_owned());
                }
                if keyword == b"property" && n_elements == 0 {
                    return declaration.fail("a property before the first element: correct the order".to_owned());
                }
                has_format |= keyword == b"format";
                n_elements += usize::from(keyword == b"element");
                n_properties += usize::from(keyword == b"property");
                if n_elements > MOST_ELEMENTS || n_properties > MOST_PROPERTIES {
                    return declaration.fail(format!(
                        "more than {MOST_ELEMENTS} elements or {MOST_PROPERTIES} properties are declared: export the file \
                         with fewer"
                    ));
                }
                declarations.push(declaration);
            }
            _ => return Err(why_not(bytes, &Declaration { line, words })),
        }
    }

    let (encoding, elements) = declared(bytes, &declarations)?;
    let after_format = declarations.iter().find(|declaration| declaration.is(bytes, b"format"));
    Ok(Header {
        encoding,
        line_end: lines.line_end,
        elements,
        after_format: after_format.map_or(magic.end, |format| format.line.after),
        own_comment,
        end: lines.at,
    })
}

/// A line of the header that says something about the payload.
struct Declaration {
    line: HeaderLine,
    words: Vec<Span>,
}

impl Declaration {
    fn is(&self, bytes: &[u8], keyword: &[u8]) -> bool {
        self.words.first().is_some_and(|word| word.of(bytes) == keyword)
    }

    fn fail<T>(&self, reason: String) -> Result<T, Broken> {
        Err(Broken::new(Place::Line(self.line.number), reason))
    }
}

/// What the declarations say, by `ply_rs`.
fn declared(bytes: &[u8], declarations: &[Declaration]) -> Result<(Encoding, Vec<Element>), Broken> {
    let text = cleaned(bytes, declarations);
    let parsed = match Parser::<DefaultElement>::new().read_ply_header(&mut text.as_bytes()) {
        Ok(parsed) => parsed,
        Err(error) => {
            // Line 1 of the cleaned text is the magic number.
            let culprit = error.line().and_then(|line| declarations.get(line.checked_sub(2)?));
            return Err(culprit.map_or_else(
                || Broken::whole("the header has no valid format line: add \"format ascii 1.0\" or the like"),
                |declaration| why_not(bytes, declaration),
            ));
        }
    };

    let mut of_names = parsed.elements.into_iter();
    let mut elements: Vec<Element> = Vec::new();
    let mut properties = Default::default();
    let mut element_names = HashSet::new();
    let mut property_names = HashSet::new();
    for declaration in declarations {
        let line = declaration.line.number;
        let name_at = |index: usize| declaration.words.get(index).map_or(&b""[..], |word| word.of(bytes));
        if declaration.is(bytes, b"element") {
            let Some((_, element)) = of_names.next() else {
                return Err(why_not(bytes, declaration));
            };
            let name = String::from_utf8_lossy(name_at(1)).into_owned();
            if !element_names.insert(name_at(1)) {
                return declaration.fail(format!("a second element \"{name}\": rename or remove it"));
            }
            property_names.clear();
            properties = element.properties.into_iter();
            elements.push(Element {
                name,
                count: element.count,
                properties: Vec::new(),
                line,
            });
        } else if declaration.is(bytes, b"property") {
            let n_words = declaration.words.len();
            let (Some((_, property)), Some(element), 3..) = (properties.next(), elements.last_mut(), n_words) else {
                return Err(why_not(bytes, declaration));
            };
            let name = String::from_utf8_lossy(name_at(n_words - 1)).into_owned();
            if !property_names.insert(name_at(n_words - 1)) {
                return declaration.fail(format!(
                    "a second property \"{name}\" in element \"{}\": rename or remove it",
                    element.name
                ));
            }
            let kind = match property.data_type {
                PropertyType::Scalar(scalar) => Kind::Scalar(scalar_of(&scalar)),
                PropertyType::List(length, item) => Kind::List {
                    length: scalar_of(&length),
                    item: scalar_of(&item),
                },
            };
            if matches!(kind, Kind::List { length, .. } if length.is_float()) {
                return declaration.fail(format!(
                    "the length of list \"{name}\" is declared as a fraction: declare an integer type such as uchar"
                ));
            }
            element.properties.push(Property {
                name,
                kind,
                type_span: Span {
                    start: declaration.words[1].start,
                    end: declaration.words[n_words - 2].end,
                },
                after_line: declaration.line.after,
                line,
            });
        }
    }
    Ok((parsed.encoding, elements))
}

/// The declarations as `ply_rs` understands them: single spaces, and in place of each name one of its own, because
/// it takes plain names only and merges equal ones.
fn cleaned(bytes: &[u8], declarations: &[Declaration]) -> String {
    let mut text = "ply\n".to_owned();
    for declaration in declarations {
        let n_words = declaration.words.len();
        let name = match declaration.words[0].of(bytes) {
            b"element" if n_words == 3 => 1,
            b"property" if n_words > 2 => n_words - 1,
            _ => usize::MAX,
        };
        for (index, word) in declaration.words.iter().enumerate() {
            if index > 0 {
                text.push(' ');
            }
            if index == name {
                text.push_str(&format!("name{}", declaration.line.number));
            } else {
                text.push_str(&String::from_utf8_lossy(word.of(bytes)));
            }
        }
        text.push('\n');
    }
    text
}

fn scalar_of(scalar: &ScalarType) -> Scalar {
    match scalar {
        ScalarType::Char => Scalar::Char,
        ScalarType::UChar => Scalar::UChar,
        ScalarType::Short => Scalar::Short,
        ScalarType::UShort => Scalar::UShort,
        ScalarType::Int => Scalar::Int,
        ScalarType::UInt => Scalar::UInt,
        ScalarType::Float => Scalar::Float,
        ScalarType::Double => Scalar::Double,
    }
}

/// Why a line of the header is not understood.
fn why_not(bytes: &[u8], declaration: &Declaration) -> Broken {
    const TYPES: &str = "char, uchar, short, ushort, int, uint, float or double";
    let words = &declaration.words;
    let content = declaration.line.span.of(bytes).trim_ascii();
    let word = |index: usize| {
        words
            .get(index)
            .map_or_else(String::new, |word: &Span| quoted(word.of(bytes)))
    };
    let is_number = |index: usize| {
        words
            .get(index)
            .is_some_and(|word| word.of(bytes).iter().all(u8::is_ascii_digit))
    };
    let reason = match words.first().map_or(&b""[..], |word| word.of(bytes)) {
        b"format" => format!(
            "{} is not \"format\" with ascii, binary_little_endian or binary_big_endian and 1.0: correct it",
            quoted(content)
        ),
        b"element" if words.len() == 3 && is_number(2) => {
            format!(
                "element {} announces {} rows, more than any file holds: correct the count",
                word(1),
                word(2)
            )
        }
        b"element" if words.len() == 3 => {
            format!(
                "the count of element {} is {}, not a whole number: correct it",
                word(1),
                word(2)
            )
        }
        b"property" if words.len() == 3 => {
            format!(
                "property {} has the type {}, which is not {TYPES}: correct it",
                word(2),
                word(1)
            )
        }
        b"property" if words.len() == 5 && word(1) == "\"list\"" => format!(
            "list {} has the types {} and {}, which are not both {TYPES}: correct them",
            word(4),
            word(2),
            word(3)
        ),
        _ => format!(
            "{} is not a line of a PLY header: correct or remove it",
            quoted(content)
        ),
    };
    Broken::new(Place::Line(declaration.line.number), reason)
}

/// One more word than the longest declaration has (`property list uchar int name`).
const MOST_WORDS: usize = 6;

/// The first [`MOST_WORDS`] words of a line, so that a long line takes no more memory than a short one.
fn words(bytes: &[u8], line: Span) -> Vec<Span> {
    let mut words: Vec<Span> = Vec::new();
    while words.len() < MOST_WORDS
        && let Some(word) = next_token(&bytes[..line.end], words.last().map_or(line.start, |last| last.end))
    {
        words.push(word);
    }
    words
}

struct HeaderLine {
    /// Counted from 1.
    number: usize,
    /// Without the line end.
    span: Span,
    /// The byte after the line end.
    after: usize,
}

/// The lines of the header; the first one tells what ends a line.
struct Lines<'a> {
    bytes: &'a [u8],
    line_end: &'static [u8],
    at: usize,
    number: usize,
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        let line_end: &[u8] = match memchr::memchr2(b'\n', b'\r', bytes) {
            Some(at) if bytes[at..].starts_with(b"\r\n") => b"\r\n",
            Some(at) if bytes[at] == b'\r' => b"\r",
            _ => b"\n",
        };
        Self {
            bytes,
            line_end,
            at: 0,
            number: 0,
        }
    }

    fn next(&mut self) -> Option<HeaderLine> {
        if self.at == self.bytes.len() {
            return None;
        }
        let start = self.at;
        let last = self.line_end[self.line_end.len() - 1];
        let (mut end, after) = match memchr::memchr(last, &self.bytes[start..]) {
            Some(length) => (start + length, start + length + 1),
            None => (self.bytes.len(), self.bytes.len()),
        };
        if end > start && self.bytes[end - 1] == b'\r' {
            end -= 1;
        }
        self.at = after;
        self.number += 1;
        Some(HeaderLine {
            number: self.number,
            span: Span { start, end },
            after,
        })
    }
}
