//! Which column of a text is what: by the names that stand in it, by those that the user gives, or by the look of the first rows.

use serde::{Deserialize, Serialize};

use super::lines::{Decimal, Lines, Values, is_skipped};
use crate::error::{Broken, Place, quoted};
use crate::records::NORMAL_NAMES;
use crate::table::{COORDINATES, N_VALUES, NORMAL, Span, VALUE_NAMES, is_space};
use crate::value::{ValueType, parse};

/// Rows looked at to tell normals and colors from other numbers.
pub(super) const SAMPLE_ROWS: usize = 1000;

/// Names of coordinates besides x, y and z, in lower case, in the order of [`COORDINATES`]: what surveyors call them. Each row is
/// one manner, and only all three of it count.
const OTHER_COORDINATE_NAMES: [[&str; 3]; 6] = [
    ["easting", "northing", "elevation"],
    ["easting", "northing", "height"],
    ["east", "north", "height"],
    ["e", "n", "h"],
    ["rechtswert", "hochwert", "höhe"],
    ["pos_x", "pos_y", "pos_z"],
];

/// How the columns of a text were told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ColumnsBy {
    /// By a line of names in the text.
    Names,
    /// By the caller.
    Caller,
    /// By their number and the look of the first rows.
    Look,
}

/// What the columns of a text are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextColumns {
    /// The name of each column; empty where there is none. Coordinates are `x y z`, a normal is `nx ny nz`, colors are `red green
    /// blue`, as far as they were told.
    pub names: Vec<String>,
    /// How they were told.
    pub by: ColumnsBy,
    /// Whether nobody needs to be asked: names that say where the coordinates are, or nothing but coordinates, or coordinates and
    /// unit vectors.
    pub is_certain: bool,
    /// What separates the values of the first row, in words ("semicolons").
    pub separator: &'static str,
    /// Whether numbers have commas in place of points.
    pub has_decimal_commas: bool,
    /// The values of the first rows.
    pub sample: Vec<Vec<String>>,
}

/// Where the columns of a text are.
pub(super) struct Found {
    /// The byte where the first row may begin.
    pub start: usize,
    pub decimal: Decimal,
    /// The names of the columns, to the end of their line.
    pub names: Option<Span>,
    /// Whether lines with a single number announce how many points follow, as in PTS files.
    pub has_counts: bool,
    /// The column of each value, by slot.
    pub columns: [Option<usize>; N_VALUES],
    pub by: ColumnsBy,
}

/// Finds the columns.
///
/// # Errors
/// A line that is no row, names that do not fit the first row.
pub(super) fn find(bytes: &[u8], line_end: u8, given: Option<&[String]>) -> Result<Found, Broken> {
    let place = |byte: usize| Place::Line(1 + memchr::memchr_iter(line_end, &bytes[..byte]).count());
    // A byte order mark is no value.
    let start = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    let mut lines = Lines {
        bytes,
        line_end,
        at: start,
    };
    let mut found = Found {
        start,
        decimal: Decimal::Point,
        names: None,
        has_counts: false,
        columns: UNNAMED,
        by: ColumnsBy::Look,
    };
    let mut title = None;
    let mut names = Vec::new();
    let first_row = loop {
        let at = lines.at;
        let Some(line) = lines.next() else {
            return Ok(found);
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
        let mut values = Values::new(content, Decimal::Point);
        if values.next().is_none_or(|value| parse(value.of(content)).is_none()) {
            if title.is_some() {
                return Err(Broken::new(
                    place(line.start),
                    format!(
                        "{} does not begin with a number: correct or remove the line",
                        quoted(content.trim_ascii())
                    ),
                ));
            }
            title = Some(line);
            names.push(line);
            found.start = lines.at;
        } else if values.next().is_some() {
            lines.at = at;
            break line;
        } else {
            found.has_counts = true;
        }
    };
    found.decimal = decimal_of(bytes, lines).ok_or_else(|| {
        Broken::new(
            place(first_row.start),
            format!(
                "{} has commas besides other separators, which are no decimal commas either: write numbers with a point",
                quoted(first_row.of(bytes).trim_ascii())
            ),
        )
    })?;
    let decimal = found.decimal;
    let n_columns = Values::new(first_row.of(bytes), decimal).count();
    let count = |line: &Span| Values::new(line.of(bytes), decimal).count();
    let (names, others): (Vec<Span>, Vec<Span>) = (names.into_iter()).partition(|names| count(names) == n_columns);
    let named = names.iter().find_map(|names| {
        let words = words_of(names.of(bytes), decimal);
        Some((*names, columns_by_name(&words)?))
    });
    if let Some((names, columns)) = named {
        found.names = Some(names);
        found.columns = columns;
        found.by = ColumnsBy::Names;
        // Names in a comment: the rows begin after it, because export may add names.
        found.start = found.start.max(names.end);
    } else {
        found.names = title.filter(|title| names.contains(title));
        let looks = look(bytes, lines, decimal, n_columns);
        if let Some(normal) = looks.normal {
            found.columns[NORMAL].copy_from_slice(&normal.map(Some));
        }
    }
    if let Some(given) = given {
        found.columns =
            columns_given(given, n_columns).map_err(|reason| Broken::new(place(first_row.start), reason))?;
        found.by = ColumnsBy::Caller;
    } else {
        refuse_names_to_come(bytes, &found, &others, n_columns, place)?;
    }
    Ok(found)
}

/// The columns that the caller names.
fn columns_given(given: &[String], n_columns: usize) -> Result<[Option<usize>; N_VALUES], String> {
    if given.len() > n_columns {
        return Err(format!(
            "{} columns are named, and the first row has {n_columns} values: name fewer",
            given.len()
        ));
    }
    let words: Vec<String> = given.iter().map(|name| name.to_lowercase()).collect();
    for name in &VALUE_NAMES[..NORMAL.end] {
        if words.iter().filter(|word| word == name).count() > 1 {
            return Err(format!("two columns are named {name}: name one"));
        }
    }
    let columns = columns_by_name(&words).ok_or("the names of the columns have no x, y and z: name these three")?;
    let n_of_normal = VALUE_NAMES[NORMAL]
        .iter()
        .filter(|&&name| words.iter().any(|word| word == name))
        .count();
    if n_of_normal != 0 && n_of_normal != 3 {
        return Err("a normal needs nx, ny and nz: name all three or none".into());
    }
    Ok(columns)
}

/// Each time that normals are written, rows have three more values, and a line that is not their names now must not become
/// them and say that the coordinates are elsewhere.
fn refuse_names_to_come(
    bytes: &[u8],
    found: &Found,
    lines: &[Span],
    n_columns: usize,
    place: impl Fn(usize) -> Place,
) -> Result<(), Broken> {
    if found.columns[NORMAL].iter().any(Option::is_some) {
        return Ok(());
    }
    let after = found.columns[COORDINATES]
        .iter()
        .flatten()
        .max()
        .map_or(0, |&last| last + 1);
    let added = [Some(after), Some(after + 1), Some(after + 2)];
    for line in lines {
        let content = line.of(bytes);
        let words = words_of(content, found.decimal);
        let n_names = words.len();
        let may_fit = n_names > n_columns && (n_names - n_columns).is_multiple_of(NORMAL.len());
        let Some(named) = columns_by_name(&words).filter(|_| may_fit) else {
            continue;
        };
        let is_same = named[COORDINATES] == found.columns[COORDINATES]
            && (named[NORMAL] == added || named[NORMAL] == [None; NORMAL.end - NORMAL.start]);
        if !is_same {
            return Err(Broken::new(
                place(line.start),
                format!(
                    "{} names {n_names} columns, and the first row has {n_columns} values: correct or remove the line",
                    quoted(content.trim_ascii())
                ),
            ));
        }
    }
    Ok(())
}

/// Whether numbers have points or commas, by the first rows: commas besides other separators are decimal commas when every
/// value is a number then. `None` when it is neither.
fn decimal_of(bytes: &[u8], lines: Lines<'_>) -> Option<Decimal> {
    let rows = || {
        lines
            .map(|line| line.of(bytes))
            .filter(|line| !is_skipped(line))
            .take(SAMPLE_ROWS)
    };
    let first = rows().next()?.trim_ascii();
    let has_marks = first.iter().any(|byte| matches!(byte, b';' | b'|'));
    let mut spans = Values::new(first, Decimal::Point).zip(Values::new(first, Decimal::Point).skip(1));
    let has_plain_spaces = spans.any(|(value, next)| first[value.end..next.start].iter().all(|byte| is_space(*byte)));
    if !first.contains(&b',') || !(has_marks || has_plain_spaces) {
        return Some(Decimal::Point);
    }
    let is_number = |row: &[u8], value: Span| ValueType::TextComma.read(value.of(row)).is_some();
    let is_row = |row: &[u8]| {
        let mut values = Values::new(row, Decimal::Comma).take(3);
        values.by_ref().filter(|&value| is_number(row, value)).count() == 3
    };
    // The lines with counts of PTS files are no rows.
    let is_count = |row: &[u8]| Values::new(row, Decimal::Comma).nth(1).is_none();
    (is_row(first) && rows().all(|row| is_row(row) || is_count(row))).then_some(Decimal::Comma)
}

/// What columns without names look like.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Look {
    pub normal: Option<[usize; 3]>,
    pub colors: Option<[usize; 3]>,
    pub intensity: Option<usize>,
}

/// Looks at the first rows of a text whose coordinates are its first three columns: normals are three columns of unit vectors (or
/// zero, but not all), colors three of whole numbers up to 255 that are not all 0 or 1, the last ones if there are several, and
/// intensity is what stands alone before these.
pub(super) fn look(bytes: &[u8], lines: Lines<'_>, decimal: Decimal, n_columns: usize) -> Look {
    let mut look = Look::default();
    let n_others = n_columns.saturating_sub(3);
    if n_others < 3 {
        return look;
    }
    let number = match decimal {
        Decimal::Point => ValueType::Text,
        Decimal::Comma => ValueType::TextComma,
    };
    /// What all rows have in common in three columns.
    #[derive(Clone, Copy)]
    struct Three {
        are_units: bool,
        n_units: usize,
        /// Whether a component is no 0 or 1, as in the names of colors.
        is_tilted: bool,
        are_channels: bool,
        largest: f64,
    }
    let mut threes = vec![
        Three {
            are_units: true,
            n_units: 0,
            is_tilted: false,
            are_channels: true,
            largest: 0.0,
        };
        n_others - 2
    ];
    for line in lines.filter(|line| !is_skipped(line.of(bytes))).take(SAMPLE_ROWS) {
        let content = line.of(bytes);
        // A word among them is no number, but does not hide what stands after it.
        let values: Vec<f64> = Values::new(content, decimal)
            .map(|value| number.read(value.of(content)).unwrap_or(f64::NAN))
            .collect();
        match values.len() {
            // The count of a PTS file.
            1 => continue,
            n if n != n_columns => return look,
            _ => {}
        }
        // A row that is no point may have anything where others have a normal.
        if !values[..3].iter().all(|value| value.is_finite()) {
            continue;
        }
        for (three, values) in threes.iter_mut().zip(values[3..].windows(3)) {
            let squared_length: f64 = values.iter().map(|value| value * value).sum();
            let is_unit = (squared_length - 1.0).abs() < 0.02;
            three.n_units += usize::from(is_unit);
            three.are_units &= is_unit || squared_length == 0.0;
            three.is_tilted |= is_unit && values.iter().any(|&value| value != 0.0 && value != 1.0);
            let is_channel = |value: &f64| (0.0..=255.0).contains(value) && value.fract() == 0.0;
            three.are_channels &= values.iter().all(is_channel);
            three.largest = values.iter().fold(three.largest, |largest, &value| largest.max(value));
        }
    }
    let triple = |first: usize| [3 + first, 4 + first, 5 + first];
    // Colors in 0..=1 can be unit vectors too: among more columns than a normal's they have to look like no color.
    let is_normal = |three: &Three| three.are_units && three.n_units > 0 && (n_others == 3 || three.is_tilted);
    let normal = threes.iter().position(is_normal);
    let is_free = |first: usize| normal.is_none_or(|normal| first.abs_diff(normal) >= 3);
    let is_color = |(first, three): &(usize, &Three)| three.are_channels && three.largest > 1.0 && is_free(*first);
    let colors = threes.iter().enumerate().rfind(is_color).map(|(first, _)| first);
    look.normal = normal.map(triple);
    look.colors = colors.map(triple);
    let is_taken = |column: usize| {
        [normal, colors]
            .into_iter()
            .flatten()
            .any(|first| triple(first).contains(&column))
    };
    look.intensity = (colors.is_some() && !is_taken(3) && is_taken(4)).then_some(3);
    look
}

/// Whether the words of a comment are the names of columns, rather than prose in which x, y and z occur: these stand side
/// by side, only usual names stand before them, and every word could be a name.
fn are_names(comment: &[u8]) -> bool {
    const BEFORE: &str =
        "id idx index no nr n pointid point_id t time red green blue r g b intensity class label nx ny nz";
    const PROSE: &str = "a an and are as at by each for from in is of on per the to with";
    let words = words_of(comment, Decimal::Point);
    let is_one_of = |word: &String, list: &str| list.split(' ').any(|listed| listed == word);
    let is_name = |word: &String| {
        let may_hold = |letter: char| letter.is_alphanumeric() || "_-.()[]/%#".contains(letter) || !letter.is_ascii();
        word.chars().all(may_hold) && !word.ends_with('.') && !is_one_of(word, PROSE)
    };
    let are_coordinates = |three: &[String]| ["x", "y", "z"].iter().all(|axis| three.iter().any(|word| word == axis));
    words
        .windows(3)
        .position(are_coordinates)
        .is_some_and(|first| words[..first].iter().all(|word| is_one_of(word, BEFORE)) && words.iter().all(is_name))
}

/// The words of a line without quotes, in lower case.
fn words_of(line: &[u8], decimal: Decimal) -> Vec<String> {
    let plain = |word: Span| {
        let word = String::from_utf8_lossy(word.of(line)).to_lowercase();
        word.replace(['"', '\''], "")
    };
    Values::new(line, decimal).map(plain).collect()
}

/// The columns of a text without names and normals.
pub(super) const UNNAMED: [Option<usize>; N_VALUES] = [Some(0), Some(1), Some(2), None, None, None, None, None];

/// The columns of values by their names, in lower case; `None` without coordinates.
fn columns_by_name(names: &[String]) -> Option<[Option<usize>; N_VALUES]> {
    let find = |wanted: &[&str]| names.iter().position(|name| wanted.contains(&name.as_str()));
    let all = |wanted: [&str; 3]| {
        let [x, y, z] = wanted.map(|name| find(&[name]));
        Some([x?, y?, z?])
    };
    let [x, y, z] = all(["x", "y", "z"]).or_else(|| OTHER_COORDINATE_NAMES.into_iter().find_map(all))?;
    let normal = NORMAL_NAMES.map(find);
    let [nx, ny, nz] = if normal.iter().all(Option::is_some) {
        normal
    } else {
        [None; 3]
    };
    let [confidence, oriented] = [find(&["confidence"]), find(&["oriented"])];
    Some([Some(x), Some(y), Some(z), nx, ny, nz, confidence, oriented])
}
