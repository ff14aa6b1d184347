//! Which coloring is shown, and keeping the colors of points on the graphics adapter in step with the document.
//!
//! Points are painted in a job: once for a coloring, and after an edit only what has another color now.

use std::ops::Range;
use std::sync::Arc;

use egui::Modifiers;
use normend_core::document::{RegionNames, RegionOutline};
use normend_core::{Change, Document, Edit, Orientation, PointSet, Progress, Propagation, confidence};
use normend_io::{ReadError, Scan};
use normend_render::{CloudUploader, UploadedColors};
use rayon::prelude::*;

use crate::app::App;
use crate::coloring::{self, Coloring};
use crate::job::{Job, JobError};
use crate::scalars::{Histogram, Values, points_between};
use crate::session::Session;
use crate::tools::Combine;

/// Columns that are shown otherwise, so another one is shown first.
const USUAL_COLUMNS: [&str; 12] = ["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "r", "g", "b"];

/// What is painted, all that its colors depend on but the signs.
#[derive(Clone, Debug, PartialEq)]
struct Request {
    coloring: Coloring,
    /// Of [`Coloring::Scalar`].
    column: Option<String>,
    /// The range of the scale that the user set.
    range: Option<[f64; 2]>,
    /// Which points are on the graphics adapter.
    points_version: u64,
}

/// Points that were painted.
struct Painted {
    request: Request,
    /// On the graphics adapter; taken when they are shown.
    colors: Option<UploadedColors>,
    values: Option<Values>,
    histogram: Option<Histogram>,
    /// What the regions were, for [`Coloring::Regions`].
    outline: RegionOutline,
    /// The signs it was painted with.
    signs_revision: u64,
}

/// The coloring, and what is needed for it.
#[derive(Default)]
pub struct Display {
    coloring: Coloring,
    /// Names of the file's columns of numbers.
    columns: Vec<String>,
    column: String,
    has_file_colors: bool,
    /// The scan is of several files.
    has_layers: bool,
    range: Option<[f64; 2]>,
    painted: Option<Painted>,
    job: Option<(Request, u64, Job<Painted>)>,
    /// What could not be painted, so that it is not tried again.
    failed: Option<Request>,
    selecting: Option<(Combine, Job<PointSet>)>,
    points_version: u64,
    /// The signs at the last look.
    seen_revision: u64,
}

impl Display {
    /// The coloring in force.
    pub fn coloring(&self) -> Coloring {
        self.coloring
    }

    /// Names of the file's columns of numbers.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// The column that [`Coloring::Scalar`] shows.
    pub fn column(&self) -> &str {
        &self.column
    }

    /// Shows another column.
    pub fn set_column(&mut self, column: String) {
        if column != self.column {
            self.column = column;
            self.range = None;
        }
    }

    /// Shows `range` on the whole scale, or the usual range.
    pub fn set_range(&mut self, range: Option<[f64; 2]>) {
        self.range = range.filter(|range| range.iter().all(|end| end.is_finite()));
    }

    /// Whether points are being painted.
    pub fn is_busy(&self) -> bool {
        self.job.is_some() || self.selecting.is_some()
    }

    /// The values shown and how they are spread, once they are painted.
    pub fn histogram(&self) -> Option<&Histogram> {
        let painted = self.painted.as_ref()?;
        painted.histogram.as_ref().filter(|_| painted.request == self.request())
    }

    /// Forgets all that is known of another scan.
    pub fn show_scan(&mut self, scan: &Scan) {
        let columns = scan.scalar_columns();
        let is_usual = |column: &String| USUAL_COLUMNS.iter().any(|usual| column.eq_ignore_ascii_case(usual));
        let first = columns.iter().find(|column| !is_usual(column)).or(columns.get(2));
        *self = Self {
            coloring: self.coloring,
            column: first.cloned().unwrap_or_default(),
            columns,
            has_file_colors: scan.has_colors(),
            has_layers: scan.layers().len() > 1,
            points_version: self.points_version + 1,
            ..Self::default()
        };
    }

    /// Other points, or the same in another order, are on the graphics adapter, without colors.
    pub fn points_changed(&mut self) {
        self.points_version += 1;
        self.failed = None;
    }

    fn request(&self) -> Request {
        Request {
            coloring: self.coloring,
            column: (self.coloring == Coloring::Scalar).then(|| self.column.clone()),
            range: self.range.filter(|_| self.coloring == Coloring::Scalar),
            points_version: self.points_version,
        }
    }

    /// Whether `coloring` can be shown now, and if not, why.
    ///
    /// # Errors
    /// The reason, as the end of a sentence.
    pub fn availability(&self, coloring: Coloring, document: &Document) -> Result<(), &'static str> {
        let propagation = document.propagation();
        let is_automatic = propagation.is_some_and(|found| found.patches.is_some() && found.evidence.is_some());
        let check = |holds: bool, reason| if holds { Ok(()) } else { Err(reason) };
        match coloring {
            Coloring::Facing | Coloring::Lit | Coloring::Normals => Ok(()),
            Coloring::Confidence => check(
                is_automatic,
                "only the automatic method knows: choose Estimate and the preset Automatic, then Propagate",
            ),
            Coloring::Conflict | Coloring::Regions => check(propagation.is_some(), "the scan is not oriented yet"),
            Coloring::Layers => check(self.has_layers, "the scan is of one file"),
            Coloring::File => check(self.has_file_colors, "the file has no colors"),
            Coloring::Scalar => check(!self.columns.is_empty(), "the file has no columns of numbers"),
        }
    }
}

impl App {
    /// How the scan is colored.
    pub fn display_mode(&self) -> Coloring {
        self.display.coloring
    }

    /// Whether the colors, and the values of the histogram, are those of the coloring and the signs in force.
    pub fn is_painted(&self) -> bool {
        let coloring = self.display.coloring;
        let Some(document) = self.document() else { return false };
        !coloring.is_painted()
            || self.display.painted.as_ref().is_some_and(|painted| {
                let is_current = painted.signs_revision == document.signs_revision();
                painted.request == self.display.request() && (is_current || !coloring.depends_on_signs())
            })
    }

    /// Whether points of a range of values are being looked for.
    pub fn is_selecting_values(&self) -> bool {
        self.display.selecting.is_some()
    }

    /// Colors the scan in another way, or says why not.
    pub(crate) fn set_coloring(&mut self, coloring: Coloring) {
        let Some(session) = &self.session else { return };
        match self.display.availability(coloring, &session.document) {
            Ok(()) => self.display.coloring = coloring,
            Err(reason) => self.messages.note(format!("{}: {reason}.", coloring.label())),
        }
    }

    /// Goes on to the next coloring that can be shown, or back.
    pub(crate) fn next_coloring(&mut self, forward: bool) {
        let Some(session) = &self.session else { return };
        let n_all = Coloring::ALL.len();
        let at = Coloring::ALL.iter().position(|&each| each == self.display.coloring);
        let at = at.unwrap_or_default();
        let steps = (1..n_all).map(|step| if forward { step } else { n_all - step });
        let mut next = steps.map(|step| Coloring::ALL[(at + step) % n_all]);
        let next = next.find(|&each| self.display.availability(each, &session.document).is_ok());
        if let Some(next) = next {
            self.display.coloring = next;
        }
    }

    /// Keeps colors, comparisons and marks in step with the document; once a frame.
    pub(crate) fn keep_shown(&mut self) {
        let turned = self.session.as_mut().map(|session| std::mem::take(&mut session.turned));
        let turned = turned.unwrap_or_default();
        self.keep_painted(&turned);
        self.keep_compared(&turned);
        let (now, is_key_down) = self.ctx.input(|input| (input.time, !input.keys_down.is_empty()));
        let reduces_motion = self.settings.settings.reduce_motion;
        if let Some(secs) = self.comparing.tick(now, reduces_motion, is_key_down) {
            self.ctx.request_repaint_after(std::time::Duration::from_secs_f64(secs));
        }
        self.take_selected_values();
    }

    /// Keeps the colors of points in step with the document: takes what was painted, paints what changed, starts to paint what is
    /// missing. `turned` are the positions that turned since the last call.
    fn keep_painted(&mut self, turned: &[Change]) {
        let Some(session) = &self.session else { return };
        let Some(scene) = &mut self.scene else { return };
        let display = &mut self.display;
        let coloring = display.coloring;
        if display.availability(coloring, &session.document).is_err() {
            if session.document.propagation().is_some() {
                // Other parameters, or another scan, took away what it shows.
                display.coloring = Coloring::default();
            }
            return;
        }
        let request = display.request();
        let revision = session.document.signs_revision();
        if let Some((_, asked_revision, job)) = &display.job
            && let Some(outcome) = job.poll()
        {
            let asked_revision = *asked_revision;
            let asked = display.job.take().map(|(asked, ..)| asked);
            match outcome {
                Ok(mut painted) if asked.as_ref() == Some(&request) => {
                    painted.signs_revision = asked_revision;
                    match scene.show_colors(painted.colors.take()) {
                        Ok(()) => display.painted = Some(painted),
                        Err(error) => {
                            self.messages.error(format!("The colors cannot be shown: {error}."));
                            display.failed = Some(request.clone());
                        }
                    }
                }
                Ok(_) | Err(JobError::Cancelled) => {}
                Err(JobError::Failed(reason)) => {
                    self.messages.error(format!("The colors were not made: {reason}"));
                    display.failed = asked;
                }
            }
        }
        if !coloring.is_painted() {
            display.job = None;
            return;
        }
        let mut is_current = false;
        if let Some(painted) = &mut display.painted
            && painted.request == request
        {
            is_current = !coloring.depends_on_signs() || painted.signs_revision == revision;
            // What turned while points were being painted is not told apart any more; then all are painted again.
            let was_current = painted.signs_revision == display.seen_revision;
            if !is_current && was_current && !turned.is_empty() {
                let changed = match coloring {
                    Coloring::Regions => session.document.renamed_since(&painted.outline),
                    _ => with_children(&session.document, turned),
                };
                for range in changed.ranges() {
                    scene.update_colors(range.start, &colors_now(&session.document, coloring, range.clone()));
                }
                painted.outline = session.document.region_outline();
                painted.signs_revision = revision;
                is_current = true;
            }
        }
        display.seen_revision = revision;
        let is_asked = display.job.as_ref().is_some_and(|(asked, asked_revision, _)| {
            *asked == request && (*asked_revision == revision || !coloring.depends_on_signs())
        });
        if !is_current && !is_asked && display.failed.as_ref() != Some(&request) {
            let known = display.painted.as_ref().filter(|painted| {
                let is_same = painted.request.coloring == coloring && painted.request.column == request.column;
                // What the file says holds under any parameters.
                is_same && (coloring == Coloring::Scalar || painted.request.points_version == request.points_version)
            });
            let values = known.and_then(|painted| painted.values.clone());
            let job = start(&self.ctx, session, &request, values, scene.uploader());
            display.job = Some((request, revision, job));
        }
    }

    /// Selects the points whose value is in `range`; `modifiers` say how they join the selection. In a job: all points are looked at.
    pub(crate) fn select_values(&mut self, range: [f64; 2], modifiers: Modifiers) {
        let painted = self.display.painted.as_ref();
        if let Some(values) = painted.and_then(|painted| painted.values.as_ref()) {
            let by_point = Arc::clone(&values.by_point);
            let job = Job::start(&self.ctx, "select", "Selecting", move |_| {
                Ok(points_between(&by_point, range))
            });
            self.display.selecting = Some((Combine::of(modifiers), job));
        }
    }

    /// Takes the points that a range of values has.
    fn take_selected_values(&mut self) {
        let Some((combine, job)) = &self.display.selecting else {
            return;
        };
        let Some(outcome) = job.poll() else { return };
        let combine = *combine;
        self.display.selecting = None;
        if let (Ok(points), Some(session)) = (outcome, &self.session) {
            // What is not shown is not meant.
            let points = points - session.document.hidden();
            let selected = combine.apply(session.document.selected(), points);
            self.apply_edit(Edit::Select(selected));
        }
    }
}

/// The positions that turned, and those whose parent did.
fn with_children(document: &Document, turned: &[Change]) -> Change {
    let ranges: Vec<Range<u32>> = turned.iter().flat_map(|change| change.ranges().to_vec()).collect();
    let turned = Change::from_flips(&ranges);
    let Some(propagation) = document.propagation() else {
        return turned;
    };
    let tree = &propagation.tree;
    let mut all = turned.ranges().to_vec();
    for range in turned.ranges() {
        for position in range.clone() {
            // Within a subtree, all children of a range but those past its end are in it.
            if tree.subtree(position).end > range.end {
                let outside = tree.children(position).filter(|&child| !turned.contains(child));
                all.extend(outside.map(|child| child..child + 1));
            }
        }
    }
    Change::from_flips(&all)
}

/// The colors of the positions of `range` in a coloring that depends on signs.
fn colors_now(document: &Document, coloring: Coloring, range: Range<u32>) -> Vec<u32> {
    match (coloring, document.propagation(), document.orientation()) {
        (Coloring::Regions, ..) => region_colors(&document.region_names(range)),
        (_, Some(propagation), Some(orientation)) => coloring::conflict_colors(propagation, orientation, range),
        _ => Vec::new(),
    }
}

fn region_colors(names: &[u32]) -> Vec<u32> {
    names.par_iter().map(|&name| coloring::of_region(name)).collect()
}

/// Colors by position, with the values that they show and how those are spread, where there are any.
type Coat = (Vec<u32>, Option<Values>, Option<Histogram>);

/// All that colors are made from.
struct Subject {
    scan: Arc<Scan>,
    propagation: Option<Arc<Propagation>>,
    orientation: Option<Orientation>,
    regions: Option<RegionNames>,
    values: Option<Values>,
}

fn start(
    ctx: &egui::Context,
    session: &Session,
    request: &Request,
    values: Option<Values>,
    uploader: CloudUploader,
) -> Job<Painted> {
    let document = &session.document;
    let outline = document.region_outline();
    let signs_revision = document.signs_revision();
    let coloring = request.coloring;
    let subject = Subject {
        scan: Arc::clone(&session.scan),
        propagation: document.shared_propagation(),
        orientation: document
            .orientation()
            .filter(|_| coloring == Coloring::Conflict)
            .cloned(),
        regions: (coloring == Coloring::Regions)
            .then(|| document.snapshot_of_regions())
            .flatten(),
        values,
    };
    let request = request.clone();
    Job::start(ctx, "paint", "Coloring", move |progress| {
        let (colors, values, histogram) = subject.paint(&request, progress)?;
        let uploaded = uploader.upload_colors(&colors);
        let uploaded = uploaded.map_err(|error| JobError::Failed(format!("{error}.")))?;
        Ok(Painted {
            request,
            colors: Some(uploaded),
            values,
            histogram,
            outline,
            signs_revision,
        })
    })
}

impl Subject {
    fn paint(mut self, request: &Request, progress: &dyn Progress) -> Result<Coat, JobError> {
        let in_words = |error: ReadError| match error {
            ReadError::Cancelled(_) => JobError::Cancelled,
            error => JobError::Failed(format!("{error}.")),
        };
        let missing = |what: &str| JobError::Failed(format!("{what} is not known any more."));
        Ok(match request.coloring {
            Coloring::Facing | Coloring::Lit | Coloring::Normals => (Vec::new(), None, None),
            Coloring::Confidence => {
                let values = match (self.values.take(), &self.propagation) {
                    (Some(values), _) => values,
                    (None, Some(propagation)) => {
                        let bytes = confidence::confidence(propagation).ok_or_else(|| missing("Confidence"))?;
                        let percent = bytes.par_iter().map(|&byte| f64::from(byte) / 2.55).collect();
                        Values::with_range(percent, [0.0, 100.0])
                    }
                    (None, None) => return Err(missing("Confidence")),
                };
                let color = |point: usize| coloring::of_confidence((values.by_point[point] * 2.55).round() as u8);
                let colors = self.by_position(color);
                let histogram = Histogram::new(&values.by_point, values.usual);
                (colors, Some(values), Some(histogram))
            }
            Coloring::Conflict => {
                let (Some(propagation), Some(orientation)) = (&self.propagation, &self.orientation) else {
                    return Err(missing("The orientation"));
                };
                let all = 0..orientation.n_points() as u32;
                (coloring::conflict_colors(propagation, orientation, all), None, None)
            }
            Coloring::Regions => {
                let regions = self.regions.as_ref().ok_or_else(|| missing("The orientation"))?;
                let names = regions.of(0..regions.tree().n_points() as u32);
                (region_colors(&names), None, None)
            }
            Coloring::Layers => {
                let scan = Arc::clone(&self.scan);
                let color = move |point: usize| coloring::of_layer(scan.layer_of(point as u32).unwrap_or_default());
                (self.by_position(color), None, None)
            }
            Coloring::File => {
                let colors = self.scan.colors(progress).map_err(in_words)?;
                let colors = colors.ok_or_else(|| missing("The file's color"))?;
                let color = |point: usize| {
                    let [red, green, blue] = colors[point];
                    u32::from_le_bytes([red, green, blue, 255])
                };
                (self.by_position(color), None, None)
            }
            Coloring::Scalar => {
                let values = match (self.values.take(), &request.column) {
                    (Some(values), _) => values,
                    (None, column) => {
                        let column = column.as_deref().unwrap_or_default();
                        let values = self.scan.scalar(column, progress).map_err(in_words)?;
                        Values::new(values.ok_or_else(|| missing("The column"))?)
                    }
                };
                let range = request.range.unwrap_or(values.usual);
                let colors = self.by_position(|point| coloring::of_value(values.by_point[point], range));
                let histogram = Histogram::new(&values.by_point, range);
                (colors, Some(values), Some(histogram))
            }
        })
    }

    /// The color of each instance on the graphics adapter, from those of points.
    fn by_position(&self, color: impl Fn(usize) -> u32 + Send + Sync) -> Vec<u32> {
        match &self.propagation {
            Some(propagation) => {
                let order = propagation.tree.order().par_iter();
                order.map(|&point| color(point as usize)).collect()
            }
            None => (0..self.scan.cloud.n_points()).into_par_iter().map(color).collect(),
        }
    }
}
