//! Points in text, one a line, in and out: `.xyz`, `.txt`, `.asc`, `.pts`, `.csv`.
//!
//! Values are separated by spaces, tabs, commas or semicolons. Comments (`#`, `//`), empty lines, one line of column
//! names and the counts of PTS files are kept as they are. Without column names, columns 4 to 6 are normals only when
//! there are exactly six and they have unit length.

use normend_core::{PointCloud, Progress};

use crate::columns::{Column, ColumnKind, slots_for};
use crate::error::{Broken, Place, Stop, WriteError, quoted};
use crate::output::Output;
use crate::rewrite::{rewrite, separator_before};
use crate::table::{
    COORDINATES, Layout, N_VALUES, NORMAL, NewContent, Rows, SIDE, Span, Spans, Starts, Table, VALUE_NAMES, find_parts,
    is_space,
};
use crate::value::{ValueType, parse};

/// Rows looked at to tell normals from colors.
const SAMPLE_ROWS: usize = 1000;

/// A text whose columns are known.
#[derive(Clone, Debug)]
pub(crate) struct XyzLayout {
    /// What ends a line: `\n`, or `\r` when there is no `\n`.
    line_end: u8,
    /// The names of the columns, to the end of their line.
    names: Option<Span>,
    /// Whether lines with a single number announce how many points follow, as in PTS files.
    has_counts: bool,
    /// The column of each value, by slot.
    columns: [Option<usize>; N_VALUES],
    /// Values that a line has at least to be a row.
    n_required: usize,
    table: Table,
}

/// Finds out what the columns of a text are and where its lines are.
pub(crate) fn read(bytes: &[u8], progress: &dyn Progress) -> Result<XyzLayout, Stop> {
    let line_end = match memchr::memchr(b'\n', bytes) {
        None if memchr::memchr(b'\r', bytes).is_some() => b'\r',
        _ => b'\n',
    };
    let mut layout = XyzLayout {
        line_end,
        names: None,
        has_counts: false,
        columns: UNNAMED,
        n_required: 0,
        table: Table {
            n_rows: 0,
            types: [ValueType::Text; N_VALUES],
            has_normals: false,
            order: Vec::new(),
            starts: Starts::Parts(Vec::new()),
            end: 0,
            frames: Vec::new(),
        },
    };
    let start = layout.find_columns(bytes)?;
    layout.table.has_normals = layout.columns[NORMAL].iter().all(Option::is_some);
    layout.n_required = layout.columns.iter().flatten().max().map_or(0, |&last| last + 1);
    let mut order: Vec<usize> = (0..N_VALUES).filter(|&slot| layout.columns[slot].is_some()).collect();
    order.sort_unstable_by_key(|&slot| layout.columns[slot]);
    layout.table.order = order;
    let mut rows = XyzRows::new(&layout, bytes, start);
    let (starts, n_rows, end) = find_parts(&mut rows, PointCloud::MAX_POINTS + 1, bytes.len(), progress)?;
    if let Some((announced, line)) = rows.missing() {
        return Err(Broken::new(
            line,
            format!("{announced} points are announced, but fewer follow: the file is cut off or the count is wrong"),
        )
        .into());
    }
    if n_rows == 0 {
        return Err(Broken::whole("the file has no points: open one that has").into());
    }
    if n_rows > PointCloud::MAX_POINTS {
        return Err(Broken::whole(format!(
            "more than the {} points that Normend can number: split the scan",
            PointCloud::MAX_POINTS
        ))
        .into());
    }
    layout.table.n_rows = n_rows;
    layout.table.starts = Starts::Parts(starts);
    layout.table.end = end;
    Ok(layout)
}

/// Whether the first lines look like points in text.
pub(crate) fn sniff(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(1 << 12)];
    let mut lines = head
        .split(|byte| matches!(byte, b'\n' | b'\r'))
        .filter(|line| !is_skipped(line))
        .take(3);
    !head.contains(&0)
        && lines.any(|line| {
            Values::new(line)
                .take(3)
                .filter(|span| parse(span.of(line)).is_some())
                .count()
                == 3
        })
}

impl XyzLayout {
    /// Finds the columns, by their names or by looking at the first rows; returns the byte where the first row may begin.
    fn find_columns(&mut self, bytes: &[u8]) -> Result<usize, Broken> {
        // A byte order mark is no value.
        let start = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        let mut lines = Lines {
            bytes,
            line_end: self.line_end,
            at: start,
        };
        let mut row_start = start;
        let mut title = None;
        let mut names = Vec::new();
        let first_row = loop {
            let at = lines.at;
            let Some(line) = lines.next() else {
                return Ok(row_start);
            };
            let content = line.of(bytes);
            if is_skipped(content) {
                let hidden = content
                    .iter()
                    .take_while(|byte| is_space(**byte) || matches!(byte, b'#' | b'/'))
                    .count();
                // CloudCompare writes the names into a comment.
                if are_names(&content[hidden..]) {
                    names.push(Span {
                        start: line.start + hidden,
                        end: line.end,
                    });
                }
                continue;
            }
            let mut values = Values::new(content);
            if values.next().is_none_or(|value| parse(value.of(content)).is_none()) {
                if title.is_some() {
                    return Err(self.not_a_row(bytes, line));
                }
                title = Some(line);
                names.push(line);
                row_start = lines.at;
            } else if values.next().is_some() {
                lines.at = at;
                break line;
            } else {
                self.has_counts = true;
            }
        };
        self.refuse_decimal_commas(bytes, first_row)?;
        let n_columns = Values::new(first_row.of(bytes)).count();
        let (names, others): (Vec<Span>, Vec<Span>) =
            (names.into_iter()).partition(|names| Values::new(names.of(bytes)).count() == n_columns);
        let named = names
            .iter()
            .find_map(|names| Some((*names, columns_by_name(names.of(bytes))?)));
        if let Some((names, columns)) = named {
            self.names = Some(names);
            self.columns = columns;
            // Names in a comment: the rows begin after it, because export may add names.
            row_start = row_start.max(names.end);
        } else {
            self.names = title.filter(|title| names.contains(title));
            if self.sample_is_normals(bytes, lines) {
                self.columns[NORMAL].copy_from_slice(&[Some(3), Some(4), Some(5)]);
            }
        }
        self.refuse_names_to_come(bytes, &others, n_columns)?;
        Ok(row_start)
    }

    /// Each time that normals are written, rows have three more values, and a line that is not their names now must not become
    /// them and say that the coordinates are elsewhere.
    fn refuse_names_to_come(&self, bytes: &[u8], lines: &[Span], n_columns: usize) -> Result<(), Broken> {
        if self.columns[NORMAL].iter().any(Option::is_some) {
            return Ok(());
        }
        let after = self.columns[COORDINATES]
            .iter()
            .flatten()
            .max()
            .map_or(0, |&last| last + 1);
        let added = [Some(after), Some(after + 1), Some(after + 2)];
        for line in lines {
            let content = line.of(bytes);
            let n_names = Values::new(content).count();
            let may_fit = n_names > n_columns && (n_names - n_columns).is_multiple_of(NORMAL.len());
            let Some(named) = columns_by_name(content).filter(|_| may_fit) else {
                continue;
            };
            let is_same = named[COORDINATES] == self.columns[COORDINATES]
                && (named[NORMAL] == added || named[NORMAL] == [None; NORMAL.end - NORMAL.start]);
            if !is_same {
                return Err(Broken::new(
                    self.place(bytes, line.start),
                    format!(
                        "{} names {n_names} columns, and the first row has {n_columns} values: correct or remove the line",
                        quoted(content.trim_ascii())
                    ),
                ));
            }
        }
        Ok(())
    }

    fn not_a_row(&self, bytes: &[u8], line: Span) -> Broken {
        Broken::new(
            self.place(bytes, line.start),
            format!(
                "{} does not begin with a number: correct or remove the line",
                quoted(line.of(bytes).trim_ascii())
            ),
        )
    }

    /// Commas in numbers and commas between numbers cannot be told apart, so the doubtful are refused.
    fn refuse_decimal_commas(&self, bytes: &[u8], line: Span) -> Result<(), Broken> {
        let content = line.of(bytes).trim_ascii();
        let has_semicolons = content.contains(&b';');
        let has_plain_spaces = Values::new(content)
            .zip(Values::new(content).skip(1))
            .any(|(value, next)| {
                let between = &content[value.end..next.start];
                !between.contains(&b',') && !between.contains(&b';')
            });
        if content.contains(&b',') && (has_semicolons || has_plain_spaces) {
            return Err(Broken::new(
                self.place(bytes, line.start),
                format!(
                    "{} has commas besides other separators, as in decimal commas: write numbers with a point",
                    quoted(content)
                ),
            ));
        }
        Ok(())
    }

    /// Whether the first rows have six columns of which the last three are unit vectors (or zero, but not all).
    fn sample_is_normals(&self, bytes: &[u8], lines: Lines<'_>) -> bool {
        let mut n_units = 0;
        for line in lines.filter(|line| !is_skipped(line.of(bytes))).take(SAMPLE_ROWS) {
            let content = line.of(bytes);
            let values: Vec<f64> = Values::new(content)
                .take(7)
                .map_while(|value| parse(value.of(content)))
                .collect();
            match values[..] {
                [_, _, _, nx, ny, nz] => {
                    let squared_length = nx * nx + ny * ny + nz * nz;
                    if (squared_length - 1.0).abs() < 0.02 {
                        n_units += 1;
                    } else if squared_length != 0.0 {
                        return false;
                    }
                }
                // The count of a PTS file.
                [_] => {}
                _ => return false,
            }
        }
        n_units > 0
    }

    /// The first rows.
    fn sample<'a>(&self, bytes: &'a [u8]) -> impl Iterator<Item = &'a [u8]> {
        let lines = Lines {
            bytes,
            line_end: self.line_end,
            at: self.table.start(),
        };
        let n_required = self.n_required;
        let is_row = move |line: &&[u8]| !is_skipped(line) && Values::new(line).count() >= n_required;
        lines.map(|line| line.of(bytes)).filter(is_row).take(SAMPLE_ROWS)
    }

    /// The last three of six or seven columns without names, as programs write points with colors, or with intensity and colors:
    /// whole numbers up to 255 in all of the first rows, and not only 0 and 1.
    fn sample_of_colors(&self, bytes: &[u8]) -> Option<[usize; 3]> {
        if self.names.is_some() || self.table.has_normals {
            return None;
        }
        let mut largest = 0.0_f64;
        let mut n_columns = None;
        for row in self.sample(bytes) {
            let values: Vec<f64> = Values::new(row).map_while(|value| parse(value.of(row))).collect();
            let expected = *n_columns.get_or_insert(values.len());
            let is_channel = |value: &f64| (0.0..=255.0).contains(value) && value.fract() == 0.0;
            if !matches!(values.len(), 6 | 7)
                || values.len() != expected
                || !values[expected - 3..].iter().all(is_channel)
            {
                return None;
            }
            largest = values[expected - 3..]
                .iter()
                .fold(largest, |largest, &value| largest.max(value));
        }
        let last = n_columns.filter(|_| largest > 1.0)?;
        Some([last - 3, last - 2, last - 1])
    }

    /// What changes before the first row when normals, and `with_side` confidence, are written: the names of their columns, if
    /// columns have names.
    fn header_edits(&self, bytes: &[u8], with_side: bool) -> Vec<(Span, Vec<u8>)> {
        let written = if with_side { NORMAL.start..SIDE.end } else { NORMAL };
        let new_names: Vec<&str> = written
            .filter(|&slot| self.columns[slot].is_none())
            .map(|slot| VALUE_NAMES[slot])
            .collect();
        let (Some(names), false) = (self.names, new_names.is_empty()) else {
            return Vec::new();
        };
        let content = names.of(bytes);
        let last = self.columns[self.table.anchor()].unwrap_or(2);
        let Some(name) = Values::new(content).nth(last) else {
            return Vec::new();
        };
        let at = names.start + name.end;
        let name = name.of(content);
        let separator = separator_before(self, bytes, at - name.len());
        let mut insertion = Vec::new();
        for new_name in new_names {
            insertion.extend_from_slice(separator);
            let is_capital = name.first().is_some_and(u8::is_ascii_uppercase);
            let first = insertion.len();
            insertion.extend_from_slice(new_name.as_bytes());
            if is_capital {
                insertion[first].make_ascii_uppercase();
            }
        }
        vec![(Span { start: at, end: at }, insertion)]
    }
}

impl Layout for XyzLayout {
    fn table(&self) -> &Table {
        &self.table
    }

    fn rows<'a>(&'a self, bytes: &'a [u8], start: usize) -> Box<dyn Rows + 'a> {
        Box::new(XyzRows::new(self, bytes, start))
    }

    fn place(&self, bytes: &[u8], byte: usize) -> Place {
        Place::Line(1 + memchr::memchr_iter(self.line_end, &bytes[..byte]).count())
    }

    fn is_separator(&self, byte: u8) -> bool {
        is_space(byte) || matches!(byte, b',' | b';')
    }

    fn columns(&self, bytes: &[u8]) -> Vec<Column> {
        let row = self.sample(bytes).next().unwrap_or_default();
        let names = self.names.map_or(&b""[..], |names| names.of(bytes));
        let mut names = Values::new(names).map(|name| {
            let name = String::from_utf8_lossy(name.of(names)).into_owned();
            name.trim_matches(['"', '\'']).to_owned()
        });
        let mut columns: Vec<Column> = Vec::new();
        for (index, value) in Values::new(row).enumerate() {
            let name = names.next().filter(|name| !name.is_empty());
            let value = value.of(row);
            let mut name = name.unwrap_or_else(|| format!("Column {}", index + 1));
            // Two columns of one name are told apart by where they stand.
            if columns.iter().any(|column| column.name == name) {
                name = format!("{name} (column {})", index + 1);
            }
            let is_number = value.is_empty() || parse(value).is_some();
            let kind = if is_number {
                ColumnKind::Decimal
            } else {
                ColumnKind::Words
            };
            columns.push(Column { name, index, kind });
        }
        columns
    }

    fn column_of(&self, slot: usize) -> Option<usize> {
        self.columns[slot]
    }

    fn with_columns(&self, columns: &[usize]) -> (Box<dyn Layout>, Vec<usize>) {
        let (columns, slots) = slots_for(&self.columns[COORDINATES], columns);
        let layout = Self {
            columns,
            ..self.clone()
        };
        (Box::new(layout), slots)
    }

    fn unnamed_colors(&self, bytes: &[u8]) -> Option<[usize; 3]> {
        self.sample_of_colors(bytes)
    }

    // Without names nobody would know what the columns are, nor which are a normal's.
    fn can_hold_side(&self) -> bool {
        self.names.is_some()
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        content: &NewContent<'_>,
        out: &mut Output<'_>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        let edits = self.header_edits(bytes, content.normals.has_confidence());
        rewrite(self, bytes, &edits, content.normals, out, progress)
    }
}

/// Whether the words of a comment are the names of columns, rather than prose in which x, y and z occur: these stand side
/// by side, only usual names stand before them, and every word could be a name.
fn are_names(comment: &[u8]) -> bool {
    const BEFORE: &str =
        "id idx index no nr n pointid point_id t time red green blue r g b intensity class label nx ny nz";
    const PROSE: &str = "a an and are as at by each for from in is of on per the to with";
    let words: Vec<String> = Values::new(comment).map(|word| plain_name(word.of(comment))).collect();
    let is_one_of = |word: &String, list: &str| list.split(' ').any(|listed| listed == word);
    let is_name = |word: &String| {
        let may_hold = |byte: u8| byte.is_ascii_alphanumeric() || b"_-.()[]/%#".contains(&byte) || !byte.is_ascii();
        word.bytes().all(may_hold) && !word.ends_with('.') && !is_one_of(word, PROSE)
    };
    let are_coordinates = |three: &[String]| ["x", "y", "z"].iter().all(|axis| three.iter().any(|word| word == axis));
    words
        .windows(3)
        .position(are_coordinates)
        .is_some_and(|first| words[..first].iter().all(|word| is_one_of(word, BEFORE)) && words.iter().all(is_name))
}

/// A name without quotes, in lower case.
fn plain_name(name: &[u8]) -> String {
    name.iter()
        .filter(|byte| !matches!(byte, b'"' | b'\''))
        .map(|byte| byte.to_ascii_lowercase() as char)
        .collect()
}

/// The columns of a text without names and normals.
const UNNAMED: [Option<usize>; N_VALUES] = [Some(0), Some(1), Some(2), None, None, None, None, None];

/// The columns of values by their names; `None` without x, y and z.
fn columns_by_name(line: &[u8]) -> Option<[Option<usize>; N_VALUES]> {
    let names: Vec<String> = Values::new(line).map(|name| plain_name(name.of(line))).collect();
    let find = |wanted: &[&str]| names.iter().position(|name| wanted.contains(&name.as_str()));
    let [x, y, z] = [find(&["x"])?, find(&["y"])?, find(&["z"])?];
    let normal = (|| {
        Some([
            find(&["nx", "normal_x", "normalx"])?,
            find(&["ny", "normal_y", "normaly"])?,
            find(&["nz", "normal_z", "normalz"])?,
        ])
    })();
    let [nx, ny, nz] = normal.map_or([None; 3], |columns| columns.map(Some));
    let [confidence, oriented] = [find(&["confidence"]), find(&["oriented"])];
    Some([Some(x), Some(y), Some(z), nx, ny, nz, confidence, oriented])
}

/// Whether a line holds no point: a comment or nothing.
fn is_skipped(line: &[u8]) -> bool {
    let content = line.trim_ascii_start();
    content.is_empty() || content.starts_with(b"#") || content.starts_with(b"//")
}

/// The lines of a text, without their ends.
#[derive(Clone, Copy)]
struct Lines<'a> {
    bytes: &'a [u8],
    line_end: u8,
    at: usize,
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

/// The values of a line: separated by spaces, or by one comma or semicolon with spaces around it.
struct Values<'a> {
    line: &'a [u8],
    at: usize,
}

impl<'a> Values<'a> {
    fn new(line: &'a [u8]) -> Self {
        Self { line, at: 0 }
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
        let is_end = |byte: &u8| is_space(*byte) || matches!(byte, b',' | b';');
        let end = start
            + self.line[start..]
                .iter()
                .position(is_end)
                .unwrap_or(self.line.len() - start);
        self.at = end;
        self.skip_spaces();
        if matches!(self.line.get(self.at), Some(b',' | b';')) {
            self.at += 1;
        }
        Some(Span { start, end })
    }
}

struct XyzRows<'a> {
    layout: &'a XyzLayout,
    bytes: &'a [u8],
    lines: Lines<'a>,
    /// Which value each column is, for the columns that matter.
    slots: Vec<Option<usize>>,
    /// Points that the last count announced and that did not come yet, the count, and where it stands.
    announced: Option<(usize, usize, usize)>,
}

impl<'a> XyzRows<'a> {
    fn new(layout: &'a XyzLayout, bytes: &'a [u8], start: usize) -> Self {
        let columns = &layout.columns;
        let n_columns = columns.iter().flatten().max().map_or(0, |last| last + 1);
        Self {
            layout,
            bytes,
            lines: Lines {
                bytes,
                line_end: layout.line_end,
                at: start,
            },
            slots: (0..n_columns)
                .map(|column| columns.iter().position(|wanted| *wanted == Some(column)))
                .collect(),
            announced: None,
        }
    }

    /// The count of points that was not reached, and its place.
    fn missing(&self) -> Option<(usize, Place)> {
        let (n_missing, announced, at) = self.announced?;
        (n_missing > 0).then(|| (announced, self.layout.place(self.bytes, at)))
    }
}

impl Rows for XyzRows<'_> {
    fn next_row(&mut self) -> Result<Option<Spans>, Broken> {
        loop {
            let Some(line) = self.lines.next() else {
                return Ok(None);
            };
            let content = line.of(self.bytes);
            if is_skipped(content) {
                continue;
            }
            let mut spans = Spans::default();
            let mut n_columns = 0;
            for (value, slot) in Values::new(content).zip(&self.slots) {
                n_columns += 1;
                if let Some(slot) = slot {
                    spans[*slot] = Span {
                        start: line.start + value.start,
                        end: line.start + value.end,
                    };
                }
            }
            if n_columns >= self.layout.n_required {
                if let Some((n_missing, ..)) = &mut self.announced {
                    *n_missing = n_missing.saturating_sub(1);
                }
                return Ok(Some(spans));
            }
            let count = std::str::from_utf8(content.trim_ascii())
                .ok()
                .and_then(|text| text.parse::<usize>().ok());
            let is_count_due = self.layout.has_counts && self.announced.is_none_or(|(n_missing, ..)| n_missing == 0);
            match count {
                Some(count) if n_columns == 1 && is_count_due => self.announced = Some((count, count, line.start)),
                _ => {
                    return Err(Broken::new(
                        self.layout.place(self.bytes, line.start),
                        format!(
                            "{n_columns} values where at least {} belong: correct or remove the line {}",
                            self.layout.n_required,
                            quoted(content)
                        ),
                    ));
                }
            }
        }
    }

    fn position(&self) -> usize {
        self.lines.at
    }
}
