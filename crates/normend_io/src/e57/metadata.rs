//! The XML section of an E57 file: which scans there are, what their rows hold, and where it all lies.
//!
//! The crate `e57` says what it means. What becomes of it in a copy is said by the places of its bytes ([`Edits`]), so that
//! whatever else stands there stays.

use std::collections::{BTreeMap, HashSet};
use std::io::Cursor;
use std::iter;
use std::ops::Range;

use e57::{E57Reader, RecordDataType};
use glam::{DMat3, DQuat, DVec3};
use normend_core::PointCloud;
use roxmltree::{Document, Node, NodeId};

use super::sections::MOST_RECORDS;
use crate::error::{Broken, quoted};

/// The namespace of normals, an extension of the E57 committee: the one that CloudCompare and PDAL write.
pub(super) const NORMALS_URI: &str = "http://www.libe57.org/E57_NOR_surface_normals.txt";
/// The same, as MeshLab and the simple interface of libE57Format write it: that of the page that describes it.
pub(super) const NORMALS_PAGE_URI: &str = "http://www.libe57.org/E57_EXT_surface_normals.txt";
/// The namespace of what E57 has no name for.
pub(super) const OWN_URI: &str = "urn:normend:e57:1";

/// The most tags and attributes of an XML section in a small file, each of which takes some hundred bytes while it is read.
const MOST_XML_PARTS: usize = 150_000;
/// And one more for so many bytes of the file: scans of thousands of points need no more.
const BYTES_A_PART: usize = 64;
/// The most attributes of a tag, which are compared each with each.
const MOST_ATTRIBUTES: usize = 256;
/// The most declarations of namespaces, which each tag within inherits.
const MOST_NAMESPACES: usize = 1000;

/// A scan of a file.
#[derive(Clone, Debug)]
pub(super) struct ScanInfo {
    pub name: String,
    pub n_rows: usize,
    /// Physical offset of its rows.
    pub offset: u64,
    pub records: Vec<RecordInfo>,
    /// From its own coordinates to the file's: a rotation and a translation.
    pub pose: Option<(DMat3, DVec3)>,
    /// Whether it names a scanner.
    pub has_sensor: bool,
}

/// A value of the rows of a scan.
#[derive(Clone, Debug)]
pub(super) struct RecordInfo {
    /// What it is called as a column.
    pub name: String,
    pub kind: RecordDataType,
    /// How many bits it takes.
    pub bits: usize,
}

impl ScanInfo {
    /// The record of that name.
    pub fn record(&self, name: &str) -> Option<usize> {
        self.records.iter().position(|record| record.name == name)
    }
}

/// What a file consists of.
#[derive(Debug)]
pub(super) struct Metadata {
    pub xml: String,
    pub scans: Vec<ScanInfo>,
    /// Other binary sections by physical offset: `Some` length of a blob, `None` of rows.
    pub others: BTreeMap<u64, Option<u64>>,
    pub n_images: usize,
    pub has_coordinate_system: bool,
}

/// Refuses XML that would take more memory or time than its size says.
fn check_size(xml: &[u8], n_bytes: usize) -> Result<(), Broken> {
    let n_parts = memchr::memchr2_iter(b'<', b'=', xml).count();
    let n_namespaces = memchr::memmem::find_iter(xml, b"xmlns").count();
    let most_attributes = xml
        .split(|byte| *byte == b'<')
        .filter(|tag| !tag.starts_with(b"!"))
        .map(|tag| memchr::memchr_iter(b'=', tag).count())
        .max();
    let most_parts = MOST_XML_PARTS + n_bytes / BYTES_A_PART;
    if n_parts > most_parts || n_namespaces > MOST_NAMESPACES || most_attributes > Some(MOST_ATTRIBUTES) {
        return Err(Broken::whole(format!(
            "the XML section is larger than Normend reads ({n_parts} tags and attributes, {n_namespaces} namespaces): split the file"
        )));
    }
    Ok(())
}

fn words_of(error: &e57::Error) -> String {
    let mut words = error.to_string();
    let mut source = std::error::Error::source(error);
    while let Some(inner) = source {
        words = format!("{words}: {inner}");
        source = inner.source();
    }
    words
}

/// Reads the XML section of a file, whose header has been checked.
pub(super) fn read(bytes: &[u8]) -> Result<Metadata, Broken> {
    let unreadable = |error: e57::Error| Broken::whole(format!("{}: export the file again", words_of(&error)));
    check_size(
        &E57Reader::raw_xml(Cursor::new(bytes)).map_err(unreadable)?,
        bytes.len(),
    )?;
    let reader = E57Reader::new(Cursor::new(bytes)).map_err(unreadable)?;
    let xml = reader.xml().to_owned();
    let document = parse(&xml)?;
    let nodes = points_of_scans(&document);
    let clouds = reader.pointclouds();
    let scans = (clouds.iter().zip(&nodes).enumerate())
        .map(|(index, (cloud, node))| scan_info(index, cloud, *node))
        .collect::<Result<Vec<ScanInfo>, Broken>>()?;
    if scans.is_empty() {
        return Err(Broken::whole("the file has no scans: open one that has"));
    }
    let mut others = BTreeMap::new();
    let of_scans = ids(&nodes);
    for node in document.descendants() {
        let Some((offset, is_blob)) = section_of(node)? else {
            continue;
        };
        if !of_scans.contains(&node.id()) {
            let length = is_blob.then(|| attribute(node, "length")).transpose()?;
            let former = others.insert(offset, length);
            if former.is_some_and(|former| former != length) {
                return Err(Broken::whole(format!(
                    "two sizes are given for what begins at byte {offset}: export the file again"
                )));
            }
        }
    }
    Ok(Metadata {
        scans,
        others,
        n_images: reader.images().len(),
        has_coordinate_system: reader
            .coordinate_metadata()
            .is_some_and(|system| !system.trim().is_empty()),
        xml,
    })
}

fn parse(xml: &str) -> Result<Document<'_>, Broken> {
    Document::parse(xml)
        .map_err(|error| Broken::whole(format!("the XML section is broken: {error}; export the file again")))
}

/// The nodes that say where the rows of scans are, in the file's order.
fn points_of_scans<'a, 'input>(document: &'a Document<'input>) -> Vec<Node<'a, 'input>> {
    let scans = document.descendants().find(|node| node.has_tag_name("data3D"));
    let scans = scans.into_iter().flat_map(|node| node.children());
    scans
        .filter(|node| node.has_tag_name("vectorChild") && node.attribute("type") == Some("Structure"))
        .filter_map(|scan| {
            scan.children()
                .find(|node| is_rows(*node) && node.has_tag_name("points"))
        })
        .collect()
}

fn ids(nodes: &[Node<'_, '_>]) -> HashSet<NodeId> {
    nodes.iter().map(Node::id).collect()
}

fn is_rows(node: Node<'_, '_>) -> bool {
    node.attribute("type") == Some("CompressedVector")
}

/// The offset of the binary section that a node stands for, and whether it is a blob.
fn section_of(node: Node<'_, '_>) -> Result<Option<(u64, bool)>, Broken> {
    let is_blob = node.attribute("type") == Some("Blob");
    if (is_blob || is_rows(node)) && node.has_attribute("fileOffset") {
        return Ok(Some((attribute(node, "fileOffset")?, is_blob)));
    }
    Ok(None)
}

fn attribute(node: Node<'_, '_>, name: &str) -> Result<u64, Broken> {
    let text = node.attribute(name).unwrap_or_default();
    text.parse().map_err(|_| {
        Broken::whole(format!(
            "{name} of <{}> is {}, not a number: export the file again",
            node.tag_name().name(),
            quoted(text.as_bytes())
        ))
    })
}

/// The nodes of the values of a row.
fn records_of<'a, 'input>(points: Node<'a, 'input>) -> impl Iterator<Item = Node<'a, 'input>> {
    let prototype = prototype_of(points);
    let children = prototype.into_iter().flat_map(|node| node.children());
    children.filter(Node::is_element)
}

fn prototype_of<'a, 'input>(points: Node<'a, 'input>) -> Option<Node<'a, 'input>> {
    let is_prototype =
        |node: &Node<'_, '_>| node.has_tag_name("prototype") && node.attribute("type") == Some("Structure");
    points.children().find(is_prototype)
}

fn scan_info(index: usize, cloud: &e57::PointCloud, points: Node<'_, '_>) -> Result<ScanInfo, Broken> {
    let name = cloud.name.clone().unwrap_or_default();
    let scan = || match name.is_empty() {
        true => format!("scan {}", index + 1),
        false => format!("scan {} {}", index + 1, quoted(name.as_bytes())),
    };
    let records: Vec<RecordInfo> = records_of(points)
        .zip(&cloud.prototype)
        .map(|(node, record)| RecordInfo {
            name: column_name(node),
            bits: bits_of(&record.data_type),
            kind: record.data_type.clone(),
        })
        .collect();
    if records.len() > MOST_RECORDS {
        return Err(Broken::whole(format!(
            "{} has {} values for each point, more than the {MOST_RECORDS} that Normend reads: export fewer",
            scan(),
            records.len()
        )));
    }
    for (index, record) in records.iter().enumerate() {
        if records[..index].iter().any(|other| other.name == record.name) {
            return Err(Broken::whole(format!(
                "{} has the value {} twice: export the file again",
                scan(),
                quoted(record.name.as_bytes())
            )));
        }
    }
    let n_rows = usize::try_from(cloud.records)
        .ok()
        .filter(|&n_rows| n_rows <= PointCloud::MAX_POINTS)
        .ok_or_else(|| {
            Broken::whole(format!(
                "{} is said to have {} points, more than the {} that Normend can number: split it",
                scan(),
                cloud.records,
                PointCloud::MAX_POINTS
            ))
        })?;
    if n_rows > 0 && records.iter().all(|record| record.bits == 0) {
        return Err(Broken::whole(format!(
            "{} is said to have {n_rows} points, but nothing is stored of them: export the file again",
            scan()
        )));
    }
    let pose = cloud.transform.as_ref().map(|pose| {
        let (turn, place) = (&pose.rotation, &pose.translation);
        let turn = DQuat::from_xyzw(turn.x, turn.y, turn.z, turn.w);
        let place = DVec3::new(place.x, place.y, place.z);
        let length = turn.length();
        // One whose parts were rounded is a rotation still.
        if !((0.5..2.0).contains(&length) && place.is_finite()) {
            return Err(Broken::whole(format!(
                "the pose of {} is none: rotation ({} {} {} {}), translation {place}; export the file again",
                scan(),
                turn.w,
                turn.x,
                turn.y,
                turn.z
            )));
        }
        Ok((DMat3::from_quat(turn.normalize()), place))
    });
    Ok(ScanInfo {
        n_rows,
        offset: cloud.file_offset,
        records,
        pose: pose.transpose()?,
        has_sensor: cloud.sensor_vendor.is_some() || cloud.sensor_model.is_some() || cloud.sensor_serial.is_some(),
        name,
    })
}

/// What a value is called as a column: by the names that other formats have for it, else by E57's.
fn column_name(node: Node<'_, '_>) -> String {
    let tag = node.tag_name();
    let uri = tag.namespace().unwrap_or_default();
    let prefix = node.lookup_prefix(uri).unwrap_or_default();
    let is_normals = [NORMALS_URI, NORMALS_PAGE_URI].contains(&uri);
    let name = match tag.name() {
        "cartesianX" => "x",
        "cartesianY" => "y",
        "cartesianZ" => "z",
        "colorRed" => "red",
        "colorGreen" => "green",
        "colorBlue" => "blue",
        "normalX" if is_normals => "nx",
        "normalY" if is_normals => "ny",
        "normalZ" if is_normals => "nz",
        other if prefix.is_empty() || uri == OWN_URI => other,
        other => return format!("{prefix}:{other}"),
    };
    name.to_owned()
}

fn bits_of(kind: &RecordDataType) -> usize {
    match kind {
        RecordDataType::Single { .. } => 32,
        RecordDataType::Double { .. } => 64,
        RecordDataType::Integer { min, max } | RecordDataType::ScaledInteger { min, max, .. } => {
            // As many as the largest difference has (ASTM E2807, 9.7).
            (i128::from(*max) - i128::from(*min))
                .checked_ilog2()
                .map_or(0, |last| last as usize + 1)
        }
    }
}

/// What changes in the XML section of a copy: ranges of bytes and what takes their place.
#[derive(Debug)]
pub(super) struct Edits {
    edits: Vec<(Range<usize>, String)>,
}

/// A value that the rows of a scan get, or have as something else.
#[derive(Debug)]
pub(super) struct NewRecord {
    /// Which value of a row it replaces; `None` for one that is added.
    pub replaces: Option<usize>,
    /// The namespace that it is from.
    pub uri: &'static str,
    pub tag: &'static str,
    /// The attributes of its type.
    pub kind: String,
}

impl Edits {
    /// Says where binary sections are in the copy: `scans` gives the offset and new values of each scan, `others` the new offset
    /// by the former one. `comment` names the program.
    pub fn new(
        xml: &str,
        scans: &[(u64, Vec<NewRecord>)],
        others: &BTreeMap<u64, u64>,
        comment: &str,
    ) -> Result<Self, Broken> {
        let document = parse(xml)?;
        let root = document.root_element();
        let mut edits = Vec::new();
        // A comment cannot hold two hyphens.
        let comment = format!("<!-- {} -->", comment.replace("--", "- -"));
        let own = (document.root().children())
            .find(|node| node.is_comment() && node.text().is_some_and(|text| text.starts_with(" Normend ")));
        match own {
            Some(node) => edits.push((node.range(), comment)),
            None => edits.push((root.range().start..root.range().start, comment + "\n")),
        }

        let mut declarations = String::new();
        let mut prefix_of = BTreeMap::new();
        for record in scans.iter().flat_map(|(_, records)| records) {
            prefix_of.entry(record.uri).or_insert_with(|| {
                let page = (record.uri == NORMALS_URI).then_some(NORMALS_PAGE_URI);
                let declared = iter::once(record.uri)
                    .chain(page)
                    .find_map(|uri| root.lookup_prefix(uri).filter(|prefix| !prefix.is_empty()));
                declared.map_or_else(
                    || {
                        let base = if record.uri == NORMALS_URI { "nor" } else { "normend" };
                        let free = (1..).map(|number| {
                            if number == 1 {
                                base.to_owned()
                            } else {
                                format!("{base}{number}")
                            }
                        });
                        // Declarations are few, so one of the first numbers is free.
                        let prefix = free
                            .into_iter()
                            .find(|name| root.lookup_namespace_uri(Some(name)).is_none());
                        let prefix = prefix.unwrap_or_default();
                        declarations += &format!(" xmlns:{prefix}=\"{}\"", record.uri);
                        prefix
                    },
                    str::to_owned,
                )
            });
        }
        if !declarations.is_empty() {
            let tag = &xml[root.range()];
            let name_end = tag.find(|letter: char| letter.is_whitespace() || matches!(letter, '>' | '/'));
            let at = root.range().start + name_end.unwrap_or(tag.len());
            edits.push((at..at, declarations));
        }

        let nodes = points_of_scans(&document);
        for (node, (offset, records)) in nodes.iter().zip(scans) {
            edits.extend(offset_edit(*node, *offset));
            let element = |record: &NewRecord| {
                let prefix = &prefix_of[record.uri];
                format!("<{prefix}:{} {}/>", record.tag, record.kind)
            };
            let former: Vec<Node<'_, '_>> = records_of(*node).collect();
            let mut added = String::new();
            for record in records {
                match record.replaces.and_then(|index| former.get(index)) {
                    Some(node) => edits.push((node.range(), element(record))),
                    None => added += &(element(record) + "\n"),
                }
            }
            if let Some(prototype) = prototype_of(*node)
                && let Some(end) = xml[prototype.range()].rfind("</")
            {
                let at = prototype.range().start + end;
                edits.push((at..at, added));
            }
        }
        let of_scans = ids(&nodes);
        for node in document.descendants().filter(|node| !of_scans.contains(&node.id())) {
            if let Some((offset, _)) = section_of(node)?
                && let Some(&offset) = others.get(&offset)
            {
                edits.extend(offset_edit(node, offset));
            }
        }
        edits.sort_by_key(|(range, _)| (range.start, range.end));
        Ok(Self { edits })
    }

    /// The XML section of the copy.
    pub fn apply(&self, xml: &str) -> String {
        let mut new = String::with_capacity(xml.len() + 1024);
        let mut done = 0;
        for (range, replacement) in &self.edits {
            // What lies within something that is replaced goes with it.
            if range.start < done {
                continue;
            }
            new += &xml[done..range.start];
            new += replacement;
            done = range.end;
        }
        new + &xml[done..]
    }
}

fn offset_edit(node: Node<'_, '_>, offset: u64) -> Option<(Range<usize>, String)> {
    let attribute = node.attribute_node("fileOffset")?;
    Some((attribute.range_value(), offset.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_are_known_by_both_addresses_of_their_extension() {
        let name_in = |uri: &str| {
            let xml = format!("<a xmlns:nor=\"{uri}\"><nor:normalY/></a>");
            let document = Document::parse(&xml).unwrap();
            column_name(document.root_element().first_element_child().unwrap())
        };
        assert_eq!(name_in(NORMALS_URI), "ny");
        assert_eq!(name_in(NORMALS_PAGE_URI), "ny");
        assert_eq!(name_in("urn:other"), "nor:normalY");
    }
}
