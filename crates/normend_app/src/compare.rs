//! Comparing the signs that are shown: with the input's, with those of the automatic method, with a reference file.
//!
//! Other signs are bits by position on the graphics adapter. Against a reference the wrong points are counted too, and kept up with
//! every edit at the cost of what turned.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use fixedbitset::FixedBitSet;
use glam::Vec3;
use normend_core::{
    Change, Document, LiveComparison, Neighbors, Orientation, PointCloud, Preset, Progress, Propagation,
    live_comparison, metrics, progress::Part,
};
use normend_io::ReadError;
use normend_render::Compare;
use rayon::prelude::*;

use crate::app::App;
use crate::job::{Job, JobError};
use crate::settings::Purpose;
use crate::theme;

/// How the two are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Style {
    /// Only the present signs.
    #[default]
    Off,
    /// The others left of a line.
    Split,
    /// Now one, now the other.
    Blink,
}

impl Style {
    /// All ways, in the order of lists.
    pub const ALL: [Self; 3] = [Self::Off, Self::Split, Self::Blink];

    /// The name in lists.
    pub fn label(self) -> &'static str {
        match self {
            Self::Off => "Off",
            Self::Split => "Side by side",
            Self::Blink => "In turn",
        }
    }
}

/// What the present signs are compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Other {
    /// The normals that came with the file.
    #[default]
    Input,
    /// What the automatic method finds, without any click.
    Automatic,
    /// Another file.
    Reference,
}

impl Other {
    /// All of them, in the order of lists.
    pub const ALL: [Self; 3] = [Self::Input, Self::Automatic, Self::Reference];

    /// The name in lists.
    pub fn label(self) -> &'static str {
        match self {
            Self::Input => "The input",
            Self::Automatic => "The automatic result",
            Self::Reference => "The reference",
        }
    }
}

/// Why there is no wrong region to go to.
pub const NONE_WRONG: &str = "no point is wrong against the reference";
/// Seconds that each is shown when they are shown in turn: one change in half a second is no flicker.
pub const BLINK_SECS: f64 = 0.5;
/// A key that is held longer compares for as long as it is held.
const HOLD_SECS: f64 = 0.35;
/// Wrong regions that are listed.
const N_LISTED: usize = 20;
/// Points of a reference may lie so far from the scan's, as a part of the scan's size: formats round.
const TOLERANCE: f64 = 1e-4;

/// Another file's normals.
pub struct Reference {
    /// Its name.
    pub name: String,
    normals: Arc<Vec<Vec3>>,
    neighbors: Arc<Neighbors>,
}

/// A connected patch of wrong points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrongRegion {
    /// How many.
    pub n_points: usize,
    /// One in the middle of them.
    pub point: u32,
}

struct Judging {
    live: LiveComparison,
    points_version: u64,
    /// Of the signs that it counts.
    signs_revision: u64,
}

/// What is compared, and how.
pub struct Comparing {
    /// How the two are shown.
    pub style: Style,
    /// What is compared with.
    pub other: Other,
    /// Where the line between the two is, from the left edge of the view (0) to the right (1).
    pub split: f32,
    /// In turn: the other is shown now.
    shows_other: bool,
    switched_at: f64,
    /// When the key was pressed that changed how they are shown, while it is held.
    held_since: Option<f64>,
    shown: Option<(Other, u64)>,
    bits_job: Option<(Other, u64, Job<Vec<u32>>)>,
    /// What could not be had, so that it is not tried again for the same points.
    failed: Option<(Other, u64)>,
    reference: Option<Reference>,
    reading: Option<(PathBuf, Job<Reference>)>,
    judging: Option<Judging>,
    judging_job: Option<(u64, Orientation, Job<LiveComparison>)>,
    regions: Option<(u64, Vec<WrongRegion>)>,
    regions_job: Option<(u64, Job<Vec<WrongRegion>>)>,
    /// The user asked for the next wrong region before the list was there.
    wants_next: Option<bool>,
    at_region: Option<usize>,
    /// Wrong points are marked on the graphics adapter.
    marks_wrong: bool,
    points_version: u64,
}

impl Default for Comparing {
    fn default() -> Self {
        Self {
            style: Style::Off,
            other: Other::Input,
            split: 0.5,
            shows_other: false,
            switched_at: 0.0,
            held_since: None,
            shown: None,
            bits_job: None,
            failed: None,
            reference: None,
            reading: None,
            judging: None,
            judging_job: None,
            regions: None,
            regions_job: None,
            wants_next: None,
            at_region: None,
            marks_wrong: false,
            points_version: 0,
        }
    }
}

impl Comparing {
    /// Another scan is open.
    pub fn show_scan(&mut self) {
        *self = Self {
            points_version: self.points_version + 1,
            ..Self::default()
        };
    }

    /// Other points, or the same in another order, are on the graphics adapter, without any bits.
    pub fn points_changed(&mut self) {
        self.points_version += 1;
    }

    /// Whether `other` can be compared with now, and if not, why.
    ///
    /// # Errors
    /// The reason, as the end of a sentence.
    pub fn availability(&self, other: Other, document: &Document) -> Result<(), &'static str> {
        let check = |holds: bool, reason| if holds { Ok(()) } else { Err(reason) };
        check(document.propagation().is_some(), "the scan is not oriented yet")?;
        match other {
            Other::Input => check(document.given_normals().is_some(), "the file has no normals"),
            Other::Automatic => Ok(()),
            Other::Reference => check(self.reference.is_some(), "no reference is open"),
        }
    }

    /// The reference, once it is read.
    pub fn reference(&self) -> Option<&Reference> {
        self.reference.as_ref()
    }

    /// The counts against the reference, once they are known.
    pub fn judged(&self) -> Option<&LiveComparison> {
        let judging = self.judging.as_ref()?;
        (judging.points_version == self.points_version).then_some(&judging.live)
    }

    /// Closes the reference.
    pub fn close_reference(&mut self) {
        (self.reference, self.judging, self.judging_job) = (None, None, None);
        (self.regions, self.regions_job, self.at_region) = (None, None, None);
        if self.other == Other::Reference {
            (self.other, self.style) = (Other::Input, Style::Off);
        }
    }

    /// The largest wrong regions, with the revision of the signs that they were found for.
    pub fn regions(&self) -> Option<&(u64, Vec<WrongRegion>)> {
        self.regions.as_ref()
    }

    /// The region that the camera flew to last.
    pub fn at_region(&self) -> Option<usize> {
        self.at_region
    }

    /// Whether the other signs are on the screen where they should be.
    pub fn is_ready(&self) -> bool {
        self.shown == Some((self.other, self.points_version))
    }

    /// Whether something is read or computed for a comparison.
    pub fn is_busy(&self) -> bool {
        self.bits_job.is_some() || self.reading.is_some() || self.judging_job.is_some() || self.regions_job.is_some()
    }

    /// What the renderer shows, in a view that is `width` physical pixels wide.
    pub fn compare(&self, width: f32) -> Compare {
        match self.style {
            _ if !self.is_ready() => Compare::Off,
            Style::Off => Compare::Off,
            Style::Split => Compare::Split((self.split * width).round()),
            Style::Blink if self.shows_other => Compare::All,
            Style::Blink => Compare::Off,
        }
    }

    /// Whether the other signs are those that fill the view now.
    pub fn shows_other(&self) -> bool {
        self.style == Style::Blink && self.shows_other
    }

    /// Shows the other one of the two.
    pub fn switch(&mut self, now: f64) {
        self.shows_other = !self.shows_other;
        self.switched_at = now;
    }

    /// Goes on in time; returns the seconds until the next change. With `reduces_motion` nothing changes by itself. While a key is
    /// held (`is_key_down`), the other stays.
    pub fn tick(&mut self, now: f64, reduces_motion: bool, is_key_down: bool) -> Option<f64> {
        if let Some(since) = self.held_since {
            if is_key_down {
                self.switched_at = now;
                return None;
            }
            self.held_since = None;
            if now - since >= HOLD_SECS {
                (self.style, self.shows_other) = (Style::Off, false);
            }
        }
        if self.style != Style::Blink || reduces_motion || !self.is_ready() {
            return None;
        }
        if now - self.switched_at >= BLINK_SECS {
            self.switch(now);
        }
        Some((BLINK_SECS - (now - self.switched_at)).max(0.0))
    }
}

impl App {
    /// What is compared.
    pub fn comparing(&self) -> &Comparing {
        &self.comparing
    }

    /// Turns the comparison on in this way, or off when it is on in this way.
    pub(crate) fn toggle_compare(&mut self, style: Style) {
        let now = self.ctx.input(|input| input.time);
        let reduces_motion = self.settings.settings.reduce_motion;
        let comparing = &mut self.comparing;
        if comparing.held_since.is_some() {
            // The key repeats.
            return;
        }
        comparing.held_since = Some(now);
        if comparing.style == style {
            // Without motion each press shows the other; the third is the present again, and the end.
            if style == Style::Blink && reduces_motion && !comparing.shows_other {
                comparing.switch(now);
                return;
            }
            (comparing.style, comparing.shows_other) = (Style::Off, false);
            return;
        }
        let Some(session) = &self.session else { return };
        if comparing.availability(comparing.other, &session.document).is_err()
            && let Some(other) =
                (Other::ALL.into_iter()).find(|&other| comparing.availability(other, &session.document).is_ok())
        {
            comparing.other = other;
        }
        comparing.style = style;
        comparing.shows_other = style == Style::Blink;
        comparing.switched_at = now;
    }

    /// Reads a file to compare with.
    pub(crate) fn open_reference(&mut self, path: &Path) {
        let Some(session) = &self.session else { return };
        self.settings.settings.remember_folder(Purpose::Reference, path);
        let cloud = Arc::clone(session.document.cloud());
        let file = path.to_path_buf();
        let job = Job::start(&self.ctx, "reference", "Reading the reference", move |progress| {
            read_reference(&file, &cloud, progress)
        });
        self.comparing.close_reference();
        self.comparing.reading = Some((path.to_path_buf(), job));
    }

    /// Keeps what is compared in step with the document: takes the results of jobs, starts what is missing. `turned` are the positions
    /// that turned since the last call.
    pub(crate) fn keep_compared(&mut self, turned: &[Change]) {
        let Some(session) = &self.session else { return };
        let document = &session.document;
        let comparing = &mut self.comparing;
        if let Some((path, job)) = &comparing.reading
            && let Some(outcome) = job.poll()
        {
            let path = path.display().to_string();
            comparing.reading = None;
            match outcome {
                Ok(reference) => {
                    self.messages.info(format!("Comparing with {path}."));
                    comparing.reference = Some(reference);
                    comparing.other = Other::Reference;
                }
                Err(JobError::Cancelled) => {}
                Err(JobError::Failed(reason)) => {
                    self.messages
                        .error(format!("There is nothing to compare with: {reason}"));
                }
            }
        }
        let version = comparing.points_version;
        let revision = document.signs_revision();
        let (Some(propagation), Some(orientation)) = (document.shared_propagation(), document.orientation()) else {
            return;
        };

        // The other signs.
        if let Some((other, asked_version, job)) = &comparing.bits_job
            && let Some(outcome) = job.poll()
        {
            let asked = (*other, *asked_version);
            comparing.bits_job = None;
            match outcome {
                Ok(words) if asked.1 == version => {
                    if let Some(scene) = &mut self.scene {
                        scene.set_compared(&words);
                        comparing.shown = Some(asked);
                    }
                }
                Ok(_) | Err(JobError::Cancelled) => {}
                Err(JobError::Failed(reason)) => {
                    comparing.failed = Some(asked);
                    self.messages
                        .error(format!("{} cannot be shown: {reason}", asked.0.label()));
                }
            }
        }
        let wanted = (comparing.other, version);
        let is_asked = comparing.bits_job.as_ref().is_some_and(|job| (job.0, job.1) == wanted);
        if comparing.style != Style::Off
            && comparing.shown != Some(wanted)
            && comparing.failed != Some(wanted)
            && !is_asked
            && comparing.availability(comparing.other, document).is_ok()
        {
            let normals = match comparing.other {
                Other::Input => document.given_normals().cloned(),
                Other::Automatic => None,
                Other::Reference => comparing
                    .reference
                    .as_ref()
                    .map(|reference| Arc::clone(&reference.normals)),
            };
            let job = start_bits(&self.ctx, document, propagation.clone(), normals);
            comparing.bits_job = Some((wanted.0, wanted.1, job));
        }

        // The counts against the reference.
        let mut became_new = false;
        if let Some((asked_version, before, job)) = &comparing.judging_job
            && let Some(outcome) = job.poll()
        {
            let is_current = *asked_version == version;
            if let (Ok(mut live), true) = (outcome, is_current) {
                // What turned while points were counted.
                live.turn(&difference(before, orientation));
                comparing.judging = Some(Judging {
                    live,
                    points_version: version,
                    signs_revision: revision,
                });
                became_new = true;
            }
            comparing.judging_job = None;
        }
        match (&mut comparing.judging, &comparing.reference) {
            (Some(judging), Some(_))
                if judging.points_version == version && (judging.signs_revision == revision || !turned.is_empty()) =>
            {
                judging.signs_revision = revision;
                if became_new {
                    comparing.marks_wrong = true;
                    if let Some(scene) = &mut self.scene {
                        scene.set_wrong(judging.live.wrong());
                    }
                } else {
                    for change in turned {
                        let toggled = judging.live.turn(change);
                        if let Some(scene) = &mut self.scene {
                            scene.mark_wrong(&toggled);
                        }
                    }
                }
            }
            (_, Some(reference)) if comparing.judging_job.is_none() => {
                comparing.judging = None;
                let job = start_judging(&self.ctx, document, &propagation, reference, orientation);
                comparing.judging_job = Some((version, orientation.clone(), job));
            }
            (_, None) if comparing.marks_wrong => {
                comparing.marks_wrong = false;
                if let Some(scene) = &mut self.scene {
                    scene.set_wrong(&FixedBitSet::new());
                }
            }
            _ => {}
        }
        self.keep_wrong_regions();
    }

    fn keep_wrong_regions(&mut self) {
        let Some(session) = &self.session else { return };
        let comparing = &mut self.comparing;
        let revision = session.document.signs_revision();
        if let Some((asked_revision, job)) = &comparing.regions_job
            && let Some(outcome) = job.poll()
        {
            let asked_revision = *asked_revision;
            comparing.regions_job = None;
            if let Ok(regions) = outcome {
                comparing.regions = Some((asked_revision, regions));
            }
        }
        let (Some(live), Some(reference)) = (comparing.judged(), &comparing.reference) else {
            return;
        };
        let is_known = comparing.regions.as_ref().is_some_and(|(found, _)| *found == revision);
        if !is_known && comparing.regions_job.is_none() {
            let cloud = Arc::clone(session.document.cloud());
            let neighbors = Arc::clone(&reference.neighbors);
            let wrong = live.wrong().clone();
            let Some(propagation) = session.document.shared_propagation() else {
                return;
            };
            let job = Job::start(&self.ctx, "wrong regions", "Looking for wrong regions", move |_| {
                Ok(wrong_regions(&cloud, &neighbors, &propagation, &wrong))
            });
            comparing.regions_job = Some((revision, job));
        }
        if is_known && let Some(forward) = comparing.wants_next.take() {
            self.next_wrong(forward);
        }
    }

    /// Flies to the next wrong region, or the one before; as soon as they are known.
    pub(crate) fn next_wrong(&mut self, forward: bool) {
        let Some(session) = &self.session else { return };
        let comparing = &mut self.comparing;
        let revision = session.document.signs_revision();
        let regions = match &comparing.regions {
            Some((found, regions)) if *found == revision => regions,
            _ => {
                comparing.wants_next = Some(forward);
                return;
            }
        };
        if regions.is_empty() {
            self.messages.note("No point is wrong against the reference.");
            return;
        }
        let n_regions = regions.len();
        let next = match (comparing.at_region, forward) {
            (None, true) => 0,
            (None, false) => n_regions - 1,
            (Some(at), true) => (at + 1) % n_regions,
            (Some(at), false) => (at + n_regions - 1) % n_regions,
        };
        self.show_wrong(next);
    }

    /// Flies to a wrong region of the list, seen from the side that it should show.
    pub(crate) fn show_wrong(&mut self, index: usize) {
        let Some(session) = &self.session else { return };
        let comparing = &mut self.comparing;
        let region = comparing.regions.as_ref().and_then(|(_, regions)| regions.get(index));
        let (Some(region), Some(reference)) = (region.copied(), &comparing.reference) else {
            return;
        };
        let cloud = session.document.cloud();
        let direction = reference.normals[region.point as usize];
        let direction = Some(direction).filter(|direction| *direction != Vec3::ZERO);
        // As large as a disc of so many points would be, with what is around it.
        let radius = session
            .document
            .propagation()
            .map_or(0.0, |found| found.splat_radii[region.point as usize]);
        let distance = (radius * (region.n_points as f32).sqrt() * 8.0).max(cloud.diagonal() * 0.05);
        comparing.at_region = Some(index);
        let center = cloud.positions()[region.point as usize];
        self.viewport.fly_to(center, distance, direction);
        let n_points = theme::counted(region.n_points as u64, "wrong point", "wrong points");
        let n_regions = self.comparing.regions.as_ref().map_or(0, |(_, regions)| regions.len());
        self.messages
            .note(format!("{n_points} here ({} of {n_regions} listed).", index + 1));
    }
}

fn read_reference(path: &Path, cloud: &PointCloud, progress: &dyn Progress) -> Result<Reference, JobError> {
    let fail = |reason: &str| Err(JobError::Failed(format!("{}: {reason}", path.display())));
    let scan = normend_io::read(path, &Part::new(progress, 0.0..0.5)).map_err(|error| match error {
        ReadError::Cancelled(_) => JobError::Cancelled,
        error => JobError::Failed(format!("{error}.")),
    })?;
    let Some(normals) = scan.given_normals else {
        return fail("it has no normals. Choose a file with nx ny nz.");
    };
    let (found, expected) = (scan.cloud.n_points(), cloud.n_points());
    if found != expected {
        return fail(&format!(
            "it has {}, the scan has {}. Choose the same scan with other normals.",
            theme::counted(found as u64, "point", "points"),
            theme::thousands(expected as u64)
        ));
    }
    let offset = scan.cloud.origin() - cloud.origin();
    let farthest = TOLERANCE * f64::from(cloud.diagonal());
    let is_other = |(a, b): (&Vec3, &Vec3)| (a.as_dvec3() + offset).distance(b.as_dvec3()) > farthest;
    let pairs = scan.cloud.positions().par_iter().zip(cloud.positions());
    if pairs.filter(|&pair| is_other(pair)).count() > 0 {
        return fail("its points lie elsewhere or are in another order. Choose the same scan with other normals.");
    }
    progress.stage("Finding neighbors");
    let neighbors = Neighbors::find(cloud, live_comparison::NEIGHBORS, &Part::new(progress, 0.5..1.0))?;
    Ok(Reference {
        name: path
            .file_name()
            .unwrap_or(path.as_os_str())
            .to_string_lossy()
            .into_owned(),
        normals,
        neighbors: Arc::new(neighbors),
    })
}

/// The signs that make the document's normals those of `normals`, or of the automatic method without any.
fn start_bits(
    ctx: &egui::Context,
    document: &Document,
    propagation: Arc<Propagation>,
    normals: Option<Arc<Vec<Vec3>>>,
) -> Job<Vec<u32>> {
    let cloud = Arc::clone(document.cloud());
    let orientation = document.orientation().cloned();
    Job::start(ctx, "compare", "Preparing the comparison", move |progress| {
        let normals = match normals {
            Some(normals) => normals,
            // Without a click it is what the automatic method says.
            None if propagation.patches.is_some() => return Ok(propagation.base_regions.orientation().to_words()),
            None => {
                let parameters = Preset::Auto.parameters();
                Arc::new(Propagation::new(&cloud, None, parameters, progress)?.initial_normals())
            }
        };
        let order = propagation.tree.order();
        let turned = |position: usize| {
            let point = order[position] as usize;
            let dot = normals[point].dot(propagation.normals[point]);
            // A point without a normal in the file is shown as it is.
            let shown = || {
                orientation
                    .as_ref()
                    .is_some_and(|shown| shown.is_turned(position as u32))
            };
            dot < 0.0 || (dot == 0.0 && shown())
        };
        let word = |word: usize| {
            let bits = (32 * word..(32 * word + 32).min(order.len())).filter(|&position| turned(position));
            bits.fold(0_u32, |word, position| word | 1 << (position % 32))
        };
        Ok((0..order.len().div_ceil(32)).into_par_iter().map(word).collect())
    })
}

fn start_judging(
    ctx: &egui::Context,
    document: &Document,
    propagation: &Arc<Propagation>,
    reference: &Reference,
    orientation: &Orientation,
) -> Job<LiveComparison> {
    let cloud = Arc::clone(document.cloud());
    let propagation = Arc::clone(propagation);
    let (normals, neighbors) = (Arc::clone(&reference.normals), Arc::clone(&reference.neighbors));
    let orientation = orientation.clone();
    Job::start(ctx, "judge", "Counting wrong points", move |progress| {
        let found = LiveComparison::new(
            &cloud,
            &neighbors,
            &normals,
            &propagation.normals,
            &propagation.tree,
            &orientation,
            progress,
        );
        Ok(found?)
    })
}

fn wrong_regions(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    propagation: &Propagation,
    wrong: &FixedBitSet,
) -> Vec<WrongRegion> {
    let mut by_point = FixedBitSet::with_capacity(wrong.len());
    let order = propagation.tree.order();
    wrong
        .ones()
        .for_each(|position| by_point.insert(order[position] as usize));
    let mut regions = metrics::wrong_regions(neighbors, &by_point);
    regions.truncate(N_LISTED);
    let positions = cloud.positions();
    let middle_of = |points: &Vec<u32>| {
        let sum: glam::DVec3 = points.iter().map(|&point| positions[point as usize].as_dvec3()).sum();
        let middle = (sum / points.len() as f64).as_vec3();
        let distance = |point: u32| positions[point as usize].distance_squared(middle);
        points
            .iter()
            .copied()
            .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
    };
    let region = |points: &Vec<u32>| {
        Some(WrongRegion {
            n_points: points.len(),
            point: middle_of(points)?,
        })
    };
    regions.iter().filter_map(region).collect()
}

/// The positions that one orientation turns and the other does not. O(n / 64).
fn difference(a: &Orientation, b: &Orientation) -> Change {
    let differ = a.bits() ^ b.bits();
    let ranges: Vec<_> = differ
        .ones()
        .map(|position| position as u32..position as u32 + 1)
        .collect();
    Change::from_flips(&ranges)
}
