//! Polygon File Format, in and out: ascii and both binary byte orders.
//!
//! The file's bytes are the truth: reading finds out where things are, and export copies everything but the normals.
//! The elements besides `vertex` are walked through once, so that a cut-off file is noticed.

mod header;
mod rows;

pub(crate) mod new;

use std::ops::Range;

use normend_core::{PointCloud, PointCloudError, Progress};
use ply_rs::ply::Encoding;

pub(crate) use self::header::sniff;
use self::header::{Element, Header, Kind, Property};
use self::rows::{WalkedRows, offsets, skip_element};
use crate::columns::{Column, ColumnKind, slots_for};
use crate::error::{Broken, Place, Stop, WriteError, quoted};
use crate::output::Output;
use crate::rewrite::rewrite;
use crate::table::{
    COORDINATES, FixedRows, Layout, N_VALUES, NORMAL, NewContent, Rows, SIDE, Span, Starts, Table, VALUE_NAMES,
    find_parts, is_space,
};
use crate::value::Scalar;

/// A PLY file whose parts are known.
#[derive(Clone, Debug)]
pub(crate) struct PlyLayout {
    header: Header,
    /// Index of the element `vertex`.
    vertex: usize,
    /// Which properties of `vertex` are the values of a row.
    slots: Slots,
    table: Table,
}

/// Which properties of the element `vertex` are the values of a row.
#[derive(Clone, Copy, Debug)]
struct Slots {
    /// Indices of properties, by slot.
    properties: [Option<usize>; N_VALUES],
}

impl Slots {
    /// Whether all values of a range of slots are there.
    fn has(&self, range: Range<usize>) -> bool {
        self.properties[range].iter().all(Option::is_some)
    }
}

/// Finds out where everything is in a PLY file, and refuses broken ones.
pub(crate) fn read(bytes: &[u8], progress: &dyn Progress) -> Result<PlyLayout, Stop> {
    let header = header::parse(bytes)?;
    let vertex = find_vertex(&header)?;
    let slots = find_slots(&header.elements[vertex])?;

    let mut at = header.end;
    for element in &header.elements[..vertex] {
        at = skip_element(bytes, &header, element, at, progress)?;
    }
    let element = &header.elements[vertex];
    // What is not there is written as the types that the header declares for it then.
    let scalar = |slot: usize| match slots.properties[slot].map(|property| element.properties[property].kind) {
        Some(Kind::Scalar(scalar)) => scalar,
        Some(Kind::List { item, .. }) => item,
        None if slot == SIDE.end - 1 => Scalar::UChar,
        None => Scalar::Float,
    };
    let mut order: Vec<usize> = (0..N_VALUES).filter(|&slot| slots.properties[slot].is_some()).collect();
    order.sort_unstable_by_key(|&slot| slots.properties[slot]);
    let mut layout = PlyLayout {
        vertex,
        slots,
        table: Table {
            n_rows: element.count,
            types: std::array::from_fn(|slot| header.value_type(scalar(slot))),
            has_normals: slots.has(NORMAL),
            order,
            starts: Starts::Parts(Vec::new()),
            end: at,
            frames: Vec::new(),
        },
        header,
    };
    let element = &layout.header.elements[vertex];
    let room = rows::check_room(bytes, &layout.header, element, at);
    room.map_err(|broken| layout.clearer(bytes, at, broken.into()))?;
    let (starts, end) = match (layout.header.encoding, element.stride()) {
        (Encoding::BinaryLittleEndian | Encoding::BinaryBigEndian, Some(stride)) => {
            (Starts::Stride { first: at, stride }, at + element.count * stride)
        }
        _ => {
            let mut rows = layout.rows(bytes, at);
            let found = find_parts(rows.as_mut(), element.count, bytes.len(), progress);
            let (starts, _, end) = found.map_err(|stop| layout.clearer(bytes, at, stop))?;
            (Starts::Parts(starts), end)
        }
    };
    layout.table.starts = starts;
    layout.table.end = end;

    let mut after = end;
    for element in &layout.header.elements[vertex + 1..] {
        let skipped = skip_element(bytes, &layout.header, element, after, progress);
        after = skipped.map_err(|stop| layout.clearer(bytes, at, stop))?;
    }
    if layout.header.encoding == Encoding::Ascii
        && bytes[after..].iter().any(|byte| !is_space(*byte))
        && let Some(uneven) = layout.first_uneven_line(bytes, at, end)
    {
        // Something is left over, so rows are longer than declared: other columns would be taken for coordinates.
        return Err(uneven.into());
    }
    Ok(layout)
}

fn find_vertex(header: &Header) -> Result<usize, Broken> {
    let Some(vertex) = header.elements.iter().position(|element| element.name == "vertex") else {
        let names: Vec<&str> = header.elements.iter().map(|element| element.name.as_str()).collect();
        if names.is_empty() {
            return Err(Broken::whole(
                "the header declares no element \"vertex\": export the file again",
            ));
        }
        return Err(Broken::whole(format!(
            "there is no element \"vertex\" (only {}): rename the one that holds the points",
            quoted(names.join(", ").as_bytes())
        )));
    };
    let element = &header.elements[vertex];
    if element.count == 0 {
        return Err(Broken::new(
            Place::Line(element.line),
            "the file has no points: open one that has",
        ));
    }
    if element.count > PointCloud::MAX_POINTS {
        let too_many = PointCloudError::TooMany {
            n_points: element.count,
        };
        return Err(Broken::new(Place::Line(element.line), too_many.to_string()));
    }
    Ok(vertex)
}

fn find_slots(element: &Element) -> Result<Slots, Broken> {
    let find = |name: &str| element.properties.iter().position(|property| property.name == name);
    let scalar = |name: &str| -> Result<Option<usize>, Broken> {
        match find(name) {
            Some(index) if matches!(element.properties[index].kind, Kind::List { .. }) => Err(Broken::new(
                Place::Line(element.properties[index].line),
                format!("\"{name}\" is declared as a list: declare a number such as float"),
            )),
            found => Ok(found),
        }
    };
    let mut properties = [None; N_VALUES];
    for slot in COORDINATES {
        let name = VALUE_NAMES[slot];
        let found = scalar(name)?.ok_or_else(|| {
            Broken::new(
                Place::Line(element.line),
                format!("the element \"vertex\" has no property \"{name}\": export the file with x, y and z"),
            )
        })?;
        properties[slot] = Some(found);
    }
    for slot in SIDE {
        let is_scalar = |&index: &usize| matches!(element.properties[index].kind, Kind::Scalar(_));
        properties[slot] = find(VALUE_NAMES[slot]).filter(is_scalar);
    }
    for names in [["nx", "ny", "nz"], ["normal_x", "normal_y", "normal_z"]] {
        let found = [scalar(names[0])?, scalar(names[1])?, scalar(names[2])?];
        if found.iter().all(Option::is_some) {
            properties[NORMAL].copy_from_slice(&found);
            return Ok(Slots { properties });
        }
        if let Some(index) = found.into_iter().flatten().next() {
            return Err(Broken::new(
                Place::Line(element.properties[index].line),
                format!(
                    "there is a part of a normal, but not all of {}: add or remove them",
                    names.join(", ")
                ),
            ));
        }
    }
    Ok(Slots { properties })
}

impl Layout for PlyLayout {
    fn table(&self) -> &Table {
        &self.table
    }

    fn rows<'a>(&'a self, bytes: &'a [u8], start: usize) -> Box<dyn Rows + 'a> {
        let element = &self.header.elements[self.vertex];
        match (self.header.encoding, element.stride()) {
            (Encoding::BinaryLittleEndian | Encoding::BinaryBigEndian, Some(stride)) => {
                Box::new(FixedRows::new(start, stride, offsets(element, &self.slots)))
            }
            _ => Box::new(WalkedRows::new(bytes, &self.header, element, &self.slots, start)),
        }
    }

    fn place(&self, bytes: &[u8], byte: usize) -> Place {
        rows::place(&self.header, bytes, byte)
    }

    fn columns(&self, _bytes: &[u8]) -> Vec<Column> {
        let properties = self.header.elements[self.vertex].properties.iter().enumerate();
        let column = |(index, property): (usize, &Property)| match property.kind {
            Kind::Scalar(scalar) => Some(Column {
                name: property.name.clone(),
                index,
                kind: ColumnKind::Number(scalar),
            }),
            Kind::List { .. } => None,
        };
        properties.filter_map(column).collect()
    }

    fn column_of(&self, slot: usize) -> Option<usize> {
        self.slots.properties[slot]
    }

    fn with_columns(&self, columns: &[usize]) -> (Box<dyn Layout>, Vec<usize>) {
        let (properties, slots) = slots_for(&self.slots.properties[COORDINATES], columns);
        let mut layout = Self {
            slots: Slots { properties },
            ..self.clone()
        };
        let element = &self.header.elements[self.vertex];
        for (slot, property) in properties.iter().enumerate() {
            if let Some(property) = property
                && let Kind::Scalar(scalar) = element.properties[*property].kind
            {
                layout.table.types[slot] = self.header.value_type(scalar);
            }
        }
        (Box::new(layout), slots)
    }

    fn besides_rows(&self, _bytes: &[u8]) -> Vec<String> {
        let elements = self.header.elements.iter().enumerate();
        let others = elements.filter(|(index, element)| *index != self.vertex && element.count > 0);
        let mut besides: Vec<String> = others
            .map(|(_, element)| {
                let rows = if element.count == 1 { "row" } else { "rows" };
                format!("{} {rows} of element \"{}\"", element.count, element.name)
            })
            .collect();
        let properties = &self.header.elements[self.vertex].properties;
        let lists = properties
            .iter()
            .filter(|property| matches!(property.kind, Kind::List { .. }));
        besides.extend(lists.map(|property| format!("the list \"{}\" of each point", property.name)));
        besides
    }

    fn can_hold_side(&self) -> bool {
        // Not where a list has its name.
        let element = &self.header.elements[self.vertex];
        SIDE.into_iter().all(|slot| {
            let has_name = element
                .properties
                .iter()
                .any(|property| property.name == VALUE_NAMES[slot]);
            self.table.has(slot) || !has_name
        })
    }

    fn rewrite(
        &self,
        bytes: &[u8],
        content: &NewContent<'_>,
        out: &mut Output<'_>,
        progress: &dyn Progress,
    ) -> Result<(), WriteError> {
        let edits = self.header_edits(content.comment, content.normals.has_confidence());
        rewrite(self, bytes, &edits, content.normals, out, progress)
    }
}

impl PlyLayout {
    /// In text, a row that is short or long shifts all that follow, and the end of the file is where that shows. So a
    /// line that holds another number of values than a row, below lines that hold the right one, is named instead.
    fn clearer(&self, bytes: &[u8], start: usize, stop: Stop) -> Stop {
        match stop {
            Stop::Broken(broken) if self.header.encoding == Encoding::Ascii => {
                let end = bytes.len();
                let uneven = self.first_uneven_line(bytes, start, end);
                let first_line = self.place(bytes, start);
                let is_last_line =
                    |place: Place| match (place, rows::place(&self.header, bytes, bytes.trim_ascii_end().len())) {
                        (Place::Line(line), Place::Line(last)) => line >= last,
                        _ => true,
                    };
                match uneven {
                    Some(uneven) if uneven.place != first_line && !is_last_line(uneven.place) => uneven.into(),
                    _ => broken.into(),
                }
            }
            stop => stop,
        }
    }

    /// The first line between two bytes that holds another number of values than a row; `None` when rows have no fixed
    /// number of values.
    fn first_uneven_line(&self, bytes: &[u8], start: usize, end: usize) -> Option<Broken> {
        let element = &self.header.elements[self.vertex];
        element.stride()?;
        let n_expected = element.properties.len();
        let line_end = *self.header.line_end.last()?;
        let lines = bytes[start..end].split(|byte| *byte == line_end).take(element.count);
        let counts = lines.map(|line| {
            line.split(|byte| is_space(*byte))
                .filter(|word| !word.is_empty())
                .count()
        });
        let Place::Line(first) = self.place(bytes, start) else {
            return None;
        };
        for (index, n_values) in counts.enumerate() {
            if n_values != 0 && n_values != n_expected {
                return Some(Broken::new(
                    Place::Line(first + index),
                    format!(
                        "{n_values} values where a row of element \"vertex\" has {n_expected}: correct the line, or the header"
                    ),
                ));
            }
        }
        None
    }

    /// What changes before the first row when normals and `comment` are written: ranges of bytes and what takes their
    /// place, in order.
    /// `with_side` when confidence is written too.
    fn header_edits(&self, comment: &str, with_side: bool) -> Vec<(Span, Vec<u8>)> {
        let header = &self.header;
        let line_end = header.line_end;
        let comment = [b"comment ", comment.as_bytes()].concat();
        let mut edits = Vec::new();
        match header.own_comment {
            Some(span) => edits.push((span, comment)),
            None => {
                let at = header.after_format;
                edits.push((Span { start: at, end: at }, [&comment, line_end].concat()));
            }
        }
        let properties = &header.elements[self.vertex].properties;
        let mut lines = Vec::new();
        let written = if with_side { NORMAL.start..SIDE.end } else { NORMAL };
        for slot in written {
            let is_flag = slot == SIDE.end - 1;
            match self.slots.properties[slot].map(|index| &properties[index]) {
                Some(property) if !is_flag => {
                    if matches!(property.kind, Kind::Scalar(scalar) if !scalar.is_float()) {
                        edits.push((property.type_span, b"float".to_vec()));
                    }
                }
                Some(_) => {}
                None => {
                    let type_name = if is_flag { "uchar" } else { "float" };
                    lines.extend_from_slice(format!("property {type_name} {}", VALUE_NAMES[slot]).as_bytes());
                    lines.extend_from_slice(line_end);
                }
            }
        }
        if !lines.is_empty() {
            let anchor = self.slots.properties[self.table.anchor()];
            let at = anchor.map_or(header.after_format, |anchor| properties[anchor].after_line);
            edits.push((Span { start: at, end: at }, lines));
        }
        edits.sort_by_key(|(span, _)| span.start);
        edits
    }
}
