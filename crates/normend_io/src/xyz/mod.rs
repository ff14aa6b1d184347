//! Points in text, one a line, in and out: `.xyz`, `.txt`, `.asc`, `.pts`, `.csv`.
//!
//! Values are separated by spaces, tabs, commas, semicolons or bars. Comments (`#`, `//`), empty lines, one line of column
//! names and the counts of PTS files are kept as they are. Without column names the first three columns are the coordinates, and
//! the first rows tell normals and colors ([`columns`]).

mod columns;
mod lines;

#[cfg(test)]
mod tests;

use normend_core::{PointCloud, Progress};

pub use self::columns::{ColumnsBy, TextColumns};
use self::columns::{SAMPLE_ROWS, find, look};
use self::lines::{Decimal, Lines, Values, is_skipped};
use crate::columns::{Column, ColumnKind, slots_for};
use crate::error::{Broken, Place, Stop, WriteError, quoted};
use crate::output::Output;
use crate::rewrite::{rewrite, separator_before};
use crate::table::{
    COORDINATES, Layout, N_VALUES, NORMAL, NewContent, Rows, SIDE, Span, Spans, Starts, Table, VALUE_NAMES, find_parts,
};
use crate::value::ValueType;

/// Rows that are shown of a text.
const SHOWN_ROWS: usize = 8;
/// Most columns without names that are told apart; more are not shown either.
const MOST_SHOWN: usize = 64;

/// A text whose columns are known.
#[derive(Clone, Debug)]
pub(crate) struct XyzLayout {
    /// What ends a line: `\n`, or `\r` when there is no `\n`.
    line_end: u8,
    decimal: Decimal,
    /// The names of the columns, to the end of their line.
    names: Option<Span>,
    /// The names that the caller gave the columns, if any.
    given: Option<Vec<String>>,
    by: ColumnsBy,
    /// Whether lines with a single number announce how many points follow, as in PTS files.
    has_counts: bool,
    /// The column of each value, by slot.
    columns: [Option<usize>; N_VALUES],
    /// Values that a line has at least to be a row.
    n_required: usize,
    table: Table,
}

/// Finds out what the columns of a text are and where its lines are; `given` are names of its columns in place of what stands
/// there.
pub(crate) fn read(bytes: &[u8], given: Option<&[String]>, progress: &dyn Progress) -> Result<XyzLayout, Stop> {
    let line_end = match memchr::memchr(b'\n', bytes) {
        None if memchr::memchr(b'\r', bytes).is_some() => b'\r',
        _ => b'\n',
    };
    let found = find(bytes, line_end, given)?;
    let start = found.start;
    let value_type = match found.decimal {
        Decimal::Point => ValueType::Text,
        Decimal::Comma => ValueType::TextComma,
    };
    let mut layout = XyzLayout {
        line_end,
        decimal: found.decimal,
        names: found.names,
        given: given.map(<[String]>::to_vec),
        by: found.by,
        has_counts: found.has_counts,
        columns: found.columns,
        n_required: 0,
        table: Table {
            n_rows: 0,
            types: [value_type; N_VALUES],
            has_normals: found.columns[NORMAL].iter().all(Option::is_some),
            order: Vec::new(),
            starts: Starts::Parts(Vec::new()),
            end: 0,
            frames: Vec::new(),
        },
    };
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
            [
                (Decimal::Point, ValueType::Text),
                (Decimal::Comma, ValueType::TextComma),
            ]
            .iter()
            .any(|&(decimal, number)| {
                let values = Values::new(line, decimal).take(3);
                values.filter(|span| number.read(span.of(line)).is_some()).count() == 3
            })
        })
}

impl XyzLayout {
    /// The first rows.
    fn sample<'a>(&self, bytes: &'a [u8]) -> impl Iterator<Item = &'a [u8]> {
        let lines = Lines {
            bytes,
            line_end: self.line_end,
            at: self.table.start(),
        };
        let n_required = self.n_required;
        let decimal = self.decimal;
        let is_row = move |line: &&[u8]| !is_skipped(line) && Values::new(line, decimal).count() >= n_required;
        lines.map(|line| line.of(bytes)).filter(is_row).take(SAMPLE_ROWS)
    }

    /// Names of the columns, as far as there are any; empty where there is none.
    fn column_names(&self, bytes: &[u8]) -> Vec<String> {
        let n_columns = self
            .sample(bytes)
            .next()
            .map_or(0, |row| Values::new(row, self.decimal).count());
        let mut names = match &self.given {
            // A column that is not to be read has no name.
            Some(given) => given.iter().map(|name| name.replace('-', "")).collect(),
            None => {
                let names = self.names.map_or(&b""[..], |names| names.of(bytes));
                let name = |name: Span| {
                    let name = String::from_utf8_lossy(name.of(names)).into_owned();
                    name.trim_matches(['"', '\'']).to_owned()
                };
                Values::new(names, self.decimal).map(name).collect::<Vec<String>>()
            }
        };
        names.resize(n_columns, String::new());
        names
    }

    /// The names that the caller gave the columns.
    pub(crate) fn given(&self) -> Option<&[String]> {
        self.given.as_deref()
    }

    /// What the columns are, for a person to confirm.
    pub(crate) fn text_columns(&self, bytes: &[u8]) -> TextColumns {
        let mut names = self.column_names(bytes);
        names.truncate(MOST_SHOWN);
        let n_columns = names.len();
        if self.by == ColumnsBy::Look {
            let mut name = |column: Option<usize>, name: &str| {
                if let Some(shown) = column
                    .and_then(|column| names.get_mut(column))
                    .filter(|shown| shown.is_empty())
                {
                    *shown = name.to_owned();
                }
            };
            for (&column, value) in self.columns.iter().zip(VALUE_NAMES).take(NORMAL.end) {
                name(column, value);
            }
            self.name_by_look(bytes, &mut names);
        }
        let first = self.sample(bytes).next().unwrap_or_default().trim_ascii();
        let has = |mark: u8| first.contains(&mark);
        TextColumns {
            is_certain: match self.by {
                ColumnsBy::Names | ColumnsBy::Caller => true,
                ColumnsBy::Look => n_columns <= 3 || (n_columns == 6 && self.table.has_normals),
            },
            by: self.by,
            separator: match self.decimal {
                _ if has(b';') => "semicolons",
                _ if has(b'|') => "bars",
                Decimal::Point if has(b',') => "commas",
                _ if has(b'\t') => "tabs",
                _ => "spaces",
            },
            has_decimal_commas: self.decimal == Decimal::Comma,
            sample: (self.sample(bytes).take(SHOWN_ROWS))
                .map(|row| {
                    let values = Values::new(row, self.decimal).take(n_columns);
                    values
                        .map(|value| String::from_utf8_lossy(value.of(row)).into_owned())
                        .collect()
                })
                .collect(),
            names,
        }
    }

    /// Names intensity and colors that have no names by their look.
    fn name_by_look(&self, bytes: &[u8], names: &mut [String]) {
        let look = self.look(bytes);
        let colors = look.colors.into_iter().flatten().zip(["red", "green", "blue"]);
        for (column, name) in colors.chain(look.intensity.map(|column| (column, "intensity"))) {
            if let Some(empty) = names.get_mut(column).filter(|name| name.is_empty()) {
                *empty = name.to_owned();
            }
        }
    }

    /// What the columns look like that have no names.
    fn look(&self, bytes: &[u8]) -> columns::Look {
        let lines = Lines {
            bytes,
            line_end: self.line_end,
            at: self.table.start(),
        };
        let n_columns = self
            .sample(bytes)
            .next()
            .map_or(0, |row| Values::new(row, self.decimal).count());
        look(bytes, lines, self.decimal, n_columns)
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
        let Some(name) = Values::new(content, self.decimal).nth(last) else {
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
        self.decimal.is_separator(byte)
    }

    fn columns(&self, bytes: &[u8]) -> Vec<Column> {
        let row = self.sample(bytes).next().unwrap_or_default();
        let mut names = self.column_names(bytes);
        if self.by == ColumnsBy::Look {
            self.name_by_look(bytes, &mut names);
        }
        let mut columns: Vec<Column> = Vec::new();
        for (index, (value, name)) in Values::new(row, self.decimal).zip(names).enumerate() {
            let value = value.of(row);
            let mut name = if name.is_empty() {
                format!("Column {}", index + 1)
            } else {
                name
            };
            // Two columns of one name are told apart by where they stand.
            if columns.iter().any(|column| column.name == name) {
                name = format!("{name} (column {})", index + 1);
            }
            let is_number = value.is_empty() || self.table.types[0].read(value).is_some();
            let kind = if is_number {
                ColumnKind::Decimal
            } else {
                ColumnKind::Words
            };
            columns.push(Column { name, index, kind });
        }
        columns
    }

    fn as_text(&self) -> Option<&XyzLayout> {
        Some(self)
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
        // Names that say nothing of colors mean that there are none.
        if self.by != ColumnsBy::Look || self.names.is_some() {
            return None;
        }
        self.look(bytes).colors
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
        // All that a row needs is counted, also where fewer values are asked for.
        let n_asked = columns.iter().flatten().max().map_or(0, |last| last + 1);
        let n_columns = n_asked.max(layout.n_required);
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
            for (value, slot) in Values::new(content, self.layout.decimal).zip(&self.slots) {
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
