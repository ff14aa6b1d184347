//! Lines with checksums: each covers its own line and, by starting from the checksum before, all lines above it. So a line that
//! is cut off, changed, lost, or out of its place is noticed.

use std::io;

use normend_core::{EditKind, StateChange};

use super::fields::{EventLine, FormatLine, HeadLine};
use super::{Event, Head, Recipe};
use crate::error::{Broken, Place};

/// What stands before the checksum, which is the last field of each line.
const CHECKSUM_FIELD: &[u8] = b",\"crc\":\"";
/// The checksum in hexadecimal digits, and what closes the line.
const CHECKSUM_DIGITS: usize = 8;
const CLOSING: &[u8] = b"\"}";

/// Makes the lines of one file, in order.
#[derive(Clone, Debug)]
pub struct LineWriter {
    /// Of the line before.
    checksum: u32,
}

impl LineWriter {
    /// A new file with its first line.
    ///
    /// # Errors
    /// None in practice; the encoder promises none. So too below.
    pub fn begin(head: &Head) -> io::Result<(Self, Vec<u8>)> {
        let mut writer = Self { checksum: 0 };
        let line = writer.line(serde_json::to_vec(&HeadLine::from(head))?);
        Ok((writer, line))
    }

    /// The line of a step.
    ///
    /// # Errors
    /// As [`Self::begin`].
    pub fn step(&mut self, kind: EditKind, change: &StateChange, n_turned: u64) -> io::Result<Vec<u8>> {
        let body = serde_json::to_vec(&EventLine::of_step(kind, change, n_turned)?)?;
        Ok(self.line(body))
    }

    /// The line of an event.
    ///
    /// # Errors
    /// As [`Self::begin`].
    pub fn event(&mut self, event: &Event) -> io::Result<Vec<u8>> {
        let name = match event {
            Event::Step(step) => return self.step(step.kind, &step.change, step.n_turned),
            Event::Undo => EventLine::UNDO,
            Event::Redo => EventLine::REDO,
            Event::Exported => EventLine::EXPORTED,
        };
        let body = serde_json::to_vec(&EventLine::named(name))?;
        Ok(self.line(body))
    }

    /// Closes a JSON object with its checksum.
    fn line(&mut self, mut body: Vec<u8>) -> Vec<u8> {
        // The closing brace comes after the checksum.
        body.pop();
        self.checksum = checksum(self.checksum, &body);
        body.extend_from_slice(CHECKSUM_FIELD);
        body.extend_from_slice(format!("{:08x}", self.checksum).as_bytes());
        body.extend_from_slice(CLOSING);
        body.push(b'\n');
        body
    }
}

fn checksum(before: u32, body: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new_with_initial(before);
    hasher.update(body);
    hasher.finalize()
}

/// What was read of a file.
#[derive(Clone, Debug)]
pub struct Reading {
    /// All that is sure.
    pub recipe: Recipe,
    /// Whether that is everything.
    pub end: End,
    /// Bytes that [`Self::recipe`] was read from; what follows is not understood.
    pub n_bytes: u64,
    /// Goes on after them.
    pub writer: LineWriter,
}

/// How a file ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// With its last line.
    Whole,
    /// In the middle of a line, as when the power fails; that line never counted.
    CutOff,
    /// A line is not what was written; it and all after it are left out.
    Damaged(Broken),
}

/// Reads as many lines as are sure. Fails when the first is not.
pub(super) fn parse(bytes: &[u8]) -> Result<Reading, Broken> {
    let first = bytes.split_inclusive(|&byte| byte == b'\n').next().unwrap_or_default();
    let head = parse_head(first)?;
    let mut reading = Reading {
        recipe: Recipe {
            head: head.0,
            events: Vec::new(),
        },
        end: End::Whole,
        n_bytes: first.len() as u64,
        writer: LineWriter { checksum: head.1 },
    };
    let rest = bytes[first.len()..].split_inclusive(|&byte| byte == b'\n');
    for (line, number) in rest.zip(2..) {
        let parsed = parse_event(line, reading.writer.checksum);
        let n_points = reading.recipe.head.scan.n_points;
        match parsed.and_then(|parsed| check_points(&parsed.0, n_points).map(|()| parsed)) {
            Ok((event, checksum)) => {
                reading.recipe.events.push(event);
                reading.writer.checksum = checksum;
                reading.n_bytes += line.len() as u64;
            }
            Err(_) if line.last() != Some(&b'\n') => {
                reading.end = End::CutOff;
                break;
            }
            Err(reason) => {
                reading.end = End::Damaged(Broken::new(Place::Line(number), reason));
                break;
            }
        }
    }
    Ok(reading)
}

fn parse_head(line: &[u8]) -> Result<(Head, u32), Broken> {
    let format = serde_json::from_slice::<FormatLine>(line).ok();
    let is_recipe = format.as_ref().is_some_and(|format| format.format == HeadLine::FORMAT)
        || line.starts_with(HeadLine::START.as_bytes());
    if !is_recipe {
        return Err(Broken::whole(
            "this is no recipe of Normend: choose a file that Save recipe wrote",
        ));
    }
    if let Some(version) = format
        .and_then(|format| format.version)
        .filter(|&version| version > HeadLine::VERSION)
    {
        return Err(Broken::whole(format!(
            "a newer Normend wrote this recipe (format {version}, and this one reads up to {}): install the newer one",
            HeadLine::VERSION
        )));
    }
    let first = |reason: String| Broken::new(Place::Line(1), reason);
    let (body, checksum) = checked(line, 0).map_err(first)?;
    let head: HeadLine = serde_json::from_slice(&body).map_err(|error| first(in_words(&error)))?;
    Ok((Head::try_from(head).map_err(first)?, checksum))
}

fn parse_event(line: &[u8], before: u32) -> Result<(Event, u32), String> {
    let (body, checksum) = checked(line, before)?;
    let line: EventLine = serde_json::from_slice(&body).map_err(|error| in_words(&error))?;
    Ok((Event::try_from(line)?, checksum))
}

/// Refuses points that the scan has not, before anything is made of them: a set of four billion takes few bytes here.
fn check_points(event: &Event, n_points: u64) -> Result<(), String> {
    let Event::Step(step) = event else { return Ok(()) };
    match step.change.largest_point() {
        Some(point) if u64::from(point) >= n_points => Err(format!(
            "the step names point {point}, and the scan has {n_points} points: it is of another scan"
        )),
        _ => Ok(()),
    }
}

/// The JSON object of a line without its checksum, which is that of the content.
fn checked(line: &[u8], before: u32) -> Result<(Vec<u8>, u32), String> {
    const DAMAGED: &str = "the line is damaged, or one before it is missing: it and all after it cannot be used";
    let line = line.strip_suffix(b"\n").unwrap_or(line);
    let n_tail = CHECKSUM_FIELD.len() + CHECKSUM_DIGITS + CLOSING.len();
    let (body, tail) = line
        .len()
        .checked_sub(n_tail)
        .map(|at| line.split_at(at))
        .ok_or(DAMAGED)?;
    let checksum = checksum(before, body);
    let expected = [CHECKSUM_FIELD, format!("{checksum:08x}").as_bytes(), CLOSING].concat();
    if tail != expected {
        return Err(DAMAGED.to_owned());
    }
    let mut body = body.to_vec();
    body.push(b'}');
    Ok((body, checksum))
}

fn in_words(error: &serde_json::Error) -> String {
    format!("it is not understood ({error}): it may be of another program")
}
