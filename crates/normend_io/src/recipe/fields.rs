//! The fields of lines: what is written of each thing, by names that do not change with the program.

use std::borrow::Cow;
use std::io;
use std::sync::Arc;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD_NO_PAD as BASE64;
use glam::{DVec3, Vec3};
use normend_core::document::ScannerChoice;
use normend_core::evidence::Station;
use normend_core::sources::{Origin, SourcePatch};
use normend_core::{
    EdgeRule, EditKind, Estimator, Mark, Method, Parameters, PointSet, SideRule, Source, SourceRule, Start, StateChange,
};
use serde::{Deserialize, Serialize};

use super::{Event, Head, RecordedStep, ScanIdentity};

type Text = Cow<'static, str>;

/// What tells a recipe from other files, and its version, whatever else stands there.
#[derive(Deserialize)]
pub(super) struct FormatLine {
    pub format: String,
    pub version: Option<u64>,
}

/// The first line.
#[derive(Serialize, Deserialize)]
pub(super) struct HeadLine {
    format: Text,
    version: u64,
    program: String,
    scan: ScanLine,
    parameters: NamedParameters,
}

#[derive(Serialize, Deserialize)]
struct ScanLine {
    name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    path: Option<String>,
    bytes: u64,
    blake3: String,
    points: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    columns: Option<Vec<String>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    files: Vec<ScanLine>,
}

impl From<&ScanIdentity> for ScanLine {
    fn from(scan: &ScanIdentity) -> Self {
        Self {
            name: scan.name.clone(),
            path: scan.path.clone(),
            bytes: scan.n_bytes,
            blake3: blake3::Hash::from_bytes(scan.hash).to_hex().to_string(),
            points: scan.n_points,
            columns: scan.columns.clone(),
            files: scan.files.iter().map(Self::from).collect(),
        }
    }
}

impl TryFrom<ScanLine> for ScanIdentity {
    type Error = String;

    fn try_from(line: ScanLine) -> Result<Self, String> {
        let hash = blake3::Hash::from_hex(&line.blake3);
        let hash = hash.map_err(|error| format!("the scan's hash is none: {error}"))?;
        Ok(Self {
            name: line.name,
            path: line.path,
            n_bytes: line.bytes,
            hash: *hash.as_bytes(),
            n_points: line.points,
            columns: line.columns,
            files: line.files.into_iter().map(Self::try_from).collect::<Result<_, _>>()?,
        })
    }
}

impl HeadLine {
    /// The name of the format.
    pub const FORMAT: &str = "normend-recipe";
    /// How every file begins.
    pub const START: &str = "{\"format\":\"normend-recipe\"";
    /// The newest version that is read, and the one that is written.
    pub const VERSION: u64 = 1;
}

impl From<&Head> for HeadLine {
    fn from(head: &Head) -> Self {
        Self {
            format: Self::FORMAT.into(),
            version: Self::VERSION,
            program: head.program.clone(),
            scan: ScanLine::from(&head.scan),
            parameters: head.parameters.into(),
        }
    }
}

impl TryFrom<HeadLine> for Head {
    type Error = String;

    fn try_from(line: HeadLine) -> Result<Self, String> {
        Ok(Self {
            program: line.program,
            scan: line.scan.try_into()?,
            parameters: line.parameters.try_into()?,
        })
    }
}

/// Parameters in files, under the names of their flags. What an older program did not write has its default.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct NamedParameters {
    method: Option<Text>,
    estimator: Option<Text>,
    k_normals: Option<usize>,
    k_graph: Option<usize>,
    edge_rule: Option<Text>,
    start: Option<Text>,
    sources: Option<Text>,
    views: Option<usize>,
    eta: Option<f32>,
    rule: Option<Text>,
}

impl From<Parameters> for NamedParameters {
    fn from(parameters: Parameters) -> Self {
        Self {
            method: Some(parameters.method.name().into()),
            estimator: Some(parameters.estimator.name().into()),
            k_normals: Some(parameters.k_normals),
            k_graph: Some(parameters.k_graph),
            edge_rule: Some(parameters.edge_rule.name().into()),
            start: Some(parameters.start.name().into()),
            sources: Some(parameters.sources.name().into()),
            views: Some(parameters.views),
            eta: Some(parameters.eta),
            rule: Some(parameters.rule.name().into()),
        }
    }
}

impl TryFrom<NamedParameters> for Parameters {
    type Error = String;

    fn try_from(named: NamedParameters) -> Result<Self, String> {
        let usual = Self::default();
        Ok(Self {
            method: named_or(&Method::ALL, Method::name, named.method, "method")?.unwrap_or(usual.method),
            estimator: named_or(&Estimator::ALL, Estimator::name, named.estimator, "estimator")?
                .unwrap_or(usual.estimator),
            k_normals: named.k_normals.unwrap_or(usual.k_normals),
            k_graph: named.k_graph.unwrap_or(usual.k_graph),
            edge_rule: named_or(&EdgeRule::ALL, EdgeRule::name, named.edge_rule, "edge rule")?
                .unwrap_or(usual.edge_rule),
            start: named_or(&Start::ALL, Start::name, named.start, "start")?.unwrap_or(usual.start),
            sources: named_or(&SourceRule::ALL, SourceRule::name, named.sources, "source rule")?
                .unwrap_or(usual.sources),
            views: named.views.unwrap_or(usual.views),
            eta: named.eta.unwrap_or(usual.eta),
            rule: named_or(&SideRule::ALL, SideRule::name, named.rule, "rule")?.unwrap_or(usual.rule),
        })
    }
}

/// The one of `all` with this name, where there is a name.
fn named_or<T: Copy>(
    all: &[T],
    name_of: fn(T) -> &'static str,
    name: Option<Text>,
    what: &str,
) -> Result<Option<T>, String> {
    name.map(|name| named(all, name_of, &name, what)).transpose()
}

fn named<T: Copy>(all: &[T], name_of: fn(T) -> &'static str, name: &str, what: &str) -> Result<T, String> {
    let found = all.iter().copied().find(|&value| name_of(value) == name);
    found.ok_or_else(|| format!("the {what} \"{}\" is not known to this Normend", name.escape_debug()))
}

/// Any line but the first.
#[derive(Serialize, Deserialize)]
pub(super) struct EventLine {
    #[serde(rename = "do")]
    event: Text,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    kind: Option<Text>,
    #[serde(default, skip_serializing_if = "is_zero")]
    turned: u64,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    sources: Vec<SourceLine>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    marks: Option<MarksLine>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    selected: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    hidden: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    accepted: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    parameters: Option<NamedParameters>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    viewpoints: Option<Vec<[f32; 3]>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    scanner: Option<ScannerLine>,
}

/// What counts of the scanner's places.
#[derive(Serialize, Deserialize)]
struct ScannerLine {
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    without_file: bool,
    /// First point, point after the last, and the place in the file's coordinates.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    own: Vec<(u32, u32, [f64; 3])>,
}

impl From<&ScannerChoice> for ScannerLine {
    fn from(choice: &ScannerChoice) -> Self {
        let own = choice.own.iter().map(|station| {
            let points = &station.points;
            (points.start, points.end, station.position.to_array())
        });
        Self {
            without_file: choice.without_file,
            own: own.collect(),
        }
    }
}

impl From<ScannerLine> for ScannerChoice {
    fn from(line: ScannerLine) -> Self {
        let own = line.own.into_iter().map(|(start, end, position)| Station {
            points: start..end,
            position: DVec3::from(position),
        });
        Self {
            without_file: line.without_file,
            own: own.collect(),
        }
    }
}

fn is_zero(number: &u64) -> bool {
    *number == 0
}

/// A point with the source that it has afterwards; none without a normal.
#[derive(Serialize, Deserialize)]
struct SourceLine {
    point: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    normal: Option<[f32; 3]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    origin: Option<Text>,
    /// Number of points, and whether mends had turned what is around.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    patch: Option<(u32, bool)>,
}

/// Points with the marks that they have afterwards, in columns: there may be millions.
#[derive(Serialize, Deserialize)]
struct MarksLine {
    /// Base64 of the difference of each id to the one before, the sign in the lowest bit, seven bits a byte, lowest first.
    points: String,
    /// Runs of points that become the same.
    states: Vec<(Text, u64)>,
    /// Base64 of three little-endian floats for each point with a mark.
    normals: String,
}

/// What a point becomes, in [`MarksLine::states`].
const UNMARKED: &str = "unmarked";
const MARKED: &str = "marked";
const PINNED: &str = "pinned";

impl EventLine {
    pub const STEP: &str = "step";
    pub const UNDO: &str = "undo";
    pub const REDO: &str = "redo";
    pub const EXPORTED: &str = "exported";

    /// An event without data.
    pub fn named(event: &'static str) -> Self {
        Self {
            event: event.into(),
            kind: None,
            turned: 0,
            sources: Vec::new(),
            marks: None,
            selected: None,
            hidden: None,
            accepted: None,
            parameters: None,
            viewpoints: None,
            scanner: None,
        }
    }

    /// A step.
    pub fn of_step(kind: EditKind, change: &StateChange, n_turned: u64) -> io::Result<Self> {
        Ok(Self {
            kind: Some(kind.name().into()),
            turned: n_turned,
            sources: change.sources.iter().map(SourceLine::from).collect(),
            marks: (!change.marks.is_empty()).then(|| MarksLine::from(&*change.marks)),
            selected: set_text(&change.selected)?,
            hidden: set_text(&change.hidden)?,
            accepted: set_text(&change.accepted)?,
            parameters: change.parameters.map(NamedParameters::from),
            viewpoints: (change.viewpoints.as_ref()).map(|places| places.iter().map(Vec3::to_array).collect()),
            scanner: change.scanner.as_ref().map(ScannerLine::from),
            ..Self::named(Self::STEP)
        })
    }
}

impl TryFrom<EventLine> for Event {
    type Error = String;

    fn try_from(line: EventLine) -> Result<Self, String> {
        match &*line.event {
            EventLine::UNDO => return Ok(Self::Undo),
            EventLine::REDO => return Ok(Self::Redo),
            EventLine::EXPORTED => return Ok(Self::Exported),
            EventLine::STEP => {}
            other => {
                let other = other.escape_debug();
                return Err(format!("the event \"{other}\" is not known to this Normend"));
            }
        }
        let kind = line.kind.ok_or("the step has no kind")?;
        let sources = line.sources.into_iter().map(SourceLine::into_source);
        let viewpoints = line.viewpoints.map(|places| places.into_iter().map(Vec3::from));
        Ok(Self::Step(RecordedStep {
            kind: named(&EditKind::ALL, EditKind::name, &kind, "step")?,
            n_turned: line.turned,
            change: StateChange {
                sources: sources.collect::<Result<_, String>>()?,
                marks: line.marks.map_or(Ok(Vec::new()), MarksLine::into_marks)?,
                selected: set_of_text(line.selected)?,
                hidden: set_of_text(line.hidden)?,
                accepted: set_of_text(line.accepted)?,
                parameters: line.parameters.map(Parameters::try_from).transpose()?,
                viewpoints: viewpoints.map(Iterator::collect::<Arc<[Vec3]>>),
                scanner: line.scanner.map(ScannerChoice::from),
            },
        }))
    }
}

impl From<&(u32, Option<Source>)> for SourceLine {
    fn from(&(point, source): &(u32, Option<Source>)) -> Self {
        Self {
            point,
            normal: source.map(|source| source.normal.to_array()),
            origin: source.map(|source| source.origin.name().into()),
            patch: source
                .and_then(|source| source.patch)
                .map(|patch| (patch.n_points, patch.amid_mended)),
        }
    }
}

impl SourceLine {
    fn into_source(self) -> Result<(u32, Option<Source>), String> {
        let Some(normal) = self.normal else {
            return Ok((self.point, None));
        };
        let origin = self.origin.ok_or("a source has no origin")?;
        let patch = self
            .patch
            .map(|(n_points, amid_mended)| SourcePatch { n_points, amid_mended });
        let source = Source {
            point: self.point,
            normal: Vec3::from(normal),
            origin: named(&Origin::ALL, Origin::name, &origin, "origin")?,
            patch,
        };
        Ok((self.point, Some(source)))
    }
}

impl From<&[(u32, Option<Mark>)]> for MarksLine {
    fn from(marks: &[(u32, Option<Mark>)]) -> Self {
        let mut points = Vec::with_capacity(2 * marks.len());
        let mut normals = Vec::with_capacity(size_of::<Vec3>() * marks.len());
        let mut states: Vec<(Text, u64)> = Vec::new();
        let mut before = 0;
        for &(point, mark) in marks {
            push_difference(i64::from(point) - before, &mut points);
            before = i64::from(point);
            let state = match mark {
                None => UNMARKED,
                Some(mark) if mark.pinned => PINNED,
                Some(_) => MARKED,
            };
            match states.last_mut() {
                Some((last, n)) if *last == state => *n += 1,
                _ => states.push((state.into(), 1)),
            }
            for component in mark.iter().flat_map(|mark| mark.normal.to_array()) {
                normals.extend_from_slice(&component.to_le_bytes());
            }
        }
        Self {
            points: BASE64.encode(points),
            states,
            normals: BASE64.encode(normals),
        }
    }
}

impl MarksLine {
    fn into_marks(self) -> Result<Vec<(u32, Option<Mark>)>, String> {
        let (points, normals) = (bytes_of_text(&self.points)?, bytes_of_text(&self.normals)?);
        let mut points = &points[..];
        let mut normals = normals.chunks_exact(size_of::<Vec3>());
        let mut marks = Vec::new();
        let mut before = 0_i64;
        for (state, n_points) in &self.states {
            let pinned = match &**state {
                UNMARKED => None,
                MARKED => Some(false),
                PINNED => Some(true),
                other => return Err(format!("a point cannot become \"{}\"", other.escape_debug())),
            };
            for _ in 0..*n_points {
                // Every turn takes bytes, so a wrong number ends here soon.
                before = take_difference(&mut points)
                    .and_then(|difference| before.checked_add(difference))
                    .ok_or("the list of marked points is too short")?;
                let point = u32::try_from(before).map_err(|_| "a marked point is none")?;
                let mark = match pinned {
                    None => None,
                    Some(pinned) => Some(Mark {
                        normal: normals
                            .next()
                            .map(vec3)
                            .ok_or("the list of normals of marked points is too short")?,
                        pinned,
                    }),
                };
                marks.push((point, mark));
            }
        }
        if points.is_empty() && normals.next().is_none() && normals.remainder().is_empty() {
            Ok(marks)
        } else {
            Err("the lists of marked points are too long".to_owned())
        }
    }
}

fn vec3(bytes: &[u8]) -> Vec3 {
    let component = |axis: usize| {
        let bytes = bytes[4 * axis..].first_chunk().copied().unwrap_or_default();
        f32::from_le_bytes(bytes)
    };
    Vec3::new(component(0), component(1), component(2))
}

/// Appends a number with its sign in the lowest bit, seven bits a byte, the lowest first; all but its last byte have the highest
/// bit.
fn push_difference(difference: i64, bytes: &mut Vec<u8>) {
    let mut rest = ((difference << 1) ^ (difference >> 63)) as u64;
    while rest >= 0x80 {
        bytes.push(rest as u8 | 0x80);
        rest >>= 7;
    }
    bytes.push(rest as u8);
}

/// Takes one number of [`push_difference`] off the front.
fn take_difference(bytes: &mut &[u8]) -> Option<i64> {
    let mut number = 0_u64;
    for place in 0..10 {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        number |= u64::from(byte & 0x7f).checked_shl(7 * place)?;
        if byte < 0x80 {
            return Some((number >> 1) as i64 ^ -((number & 1) as i64));
        }
    }
    None
}

/// Base64 of the portable form of Roaring bitmaps; nothing for the empty set.
fn set_text(points: &PointSet) -> io::Result<Option<String>> {
    if points.is_empty() {
        return Ok(None);
    }
    let mut points = points.clone();
    points.optimize();
    let mut bytes = Vec::with_capacity(points.serialized_size());
    points.serialize_into(&mut bytes)?;
    Ok(Some(BASE64.encode(bytes)))
}

fn set_of_text(text: Option<String>) -> Result<PointSet, String> {
    let Some(text) = text else {
        return Ok(PointSet::new());
    };
    let bytes = bytes_of_text(&text)?;
    PointSet::deserialize_from(&*bytes).map_err(|error| format!("a set of points is not understood ({error})"))
}

fn bytes_of_text(text: &str) -> Result<Vec<u8>, String> {
    BASE64
        .decode(text)
        .map_err(|error| format!("a field is not base64 ({error})"))
}
