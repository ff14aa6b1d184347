//! The suspects of the open scan: looked for in a job, gone through one by one, flipped or accepted.
//!
//! The list is of the signs at the time of looking. What happened to a suspect since is read from the document, so undo brings it
//! back: it is *turned* when most of it shows the other side now, *accepted* when the document accepts most of its points.
//!
//! Invariant: nothing here changes the document; the editor does, by [`Edit::FlipPoints`] and [`Edit::Accept`].

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::Vec3;
use normend_core::document::FlipReason;
use normend_core::evidence::Known;
use normend_core::progress::Part;
use normend_core::suspects::{Findings, Grounds, Settings, Suspect, examine};
use normend_core::{
    Change, Document, Edit, Method, Parameters, PointCloud, PointSet, Propagation, SideRule, SpanningTree,
};

use crate::command::Action;
use crate::job::{Job, JobError, JobStatus};

/// Most suspects in the list: so many that those accepted hide none.
const MOST: usize = 100;
/// Points of a suspect that are asked whether it was turned since.
const MAX_SAMPLES: usize = 63;
/// How far around a suspect the view shows, in its own radius: enough to see what it differs from.
const SURROUNDINGS: f32 = 2.5;
/// The same for small pictures, where the suspect itself must be seen.
const CLOSE_SURROUNDINGS: f32 = 1.2;
/// The least radius that is shown, as a part of the scan's diagonal.
const LEAST_RADIUS: f32 = 0.01;
/// A mean of unit normals shorter than this points nowhere: the suspect bends round.
const LEAST_MEAN: f32 = 0.2;

/// What a user asks for about suspects; rows are named by their index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SuspectAction {
    /// Look for suspects with the signs as they are.
    Look,
    /// Stop looking.
    Stop,
    /// Fly to the next one.
    Next,
    /// Fly to the one before.
    Previous,
    /// Fly to this one.
    Focus(usize),
    /// Turn this one, and go on.
    Flip(usize),
    /// This one is right; go on.
    Accept(usize),
    /// This one is accepted no longer.
    TakeBack(usize),
    /// Show none any more.
    Leave,
}

impl From<SuspectAction> for Action {
    fn from(action: SuspectAction) -> Self {
        Self::Suspects(action)
    }
}

/// A suspect with what is needed to show it.
#[derive(Clone, Debug)]
pub struct Row {
    /// What was found.
    pub suspect: Suspect,
    /// Its points.
    pub points: PointSet,
    /// Its positions in the tree, as ranges.
    outline: Change,
    /// The side that is believed to be right, unit length; `None` where it bends round.
    right_side: Option<Vec3>,
    /// Middle of its bounding box, in world space.
    middle: Vec3,
    /// Half the diagonal of its bounding box, in world length.
    radius: f32,
    /// Some of its points with the normal that they showed.
    samples: Vec<(u32, Vec3)>,
}

/// What became of a suspect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// It is as it was found.
    Open,
    /// It shows the other side now.
    Turned,
    /// The user accepts it as it is.
    Accepted,
}

/// What a job found.
struct Found {
    rows: Vec<Row>,
    grounds: Grounds,
    /// The automatic propagation, where it had to be computed.
    automatic: Option<Arc<Propagation>>,
}

/// What the list is of.
#[derive(Clone, Debug)]
struct Basis {
    tree: Arc<SpanningTree>,
    signs_revision: u64,
}

impl Basis {
    fn of(document: &Document) -> Option<Self> {
        Some(Self {
            tree: Arc::clone(&document.propagation()?.tree),
            signs_revision: document.signs_revision(),
        })
    }

    fn is_of(&self, document: &Document) -> bool {
        document
            .propagation()
            .is_some_and(|propagation| Arc::ptr_eq(&propagation.tree, &self.tree))
    }
}

/// The list, and the job that makes it.
#[derive(Default)]
pub struct SuspectsList {
    job: Option<(Job<Found>, Basis)>,
    /// What the present rows are of; `None` before the first.
    basis: Option<Basis>,
    rows: Vec<Row>,
    /// Revisions of the signs to which only flips of rows have led since.
    reviewed: BTreeSet<u64>,
    grounds: Option<Grounds>,
    /// The automatic propagation of this cloud, where the one in force is another.
    automatic: Option<Arc<Propagation>>,
    /// The job for this basis was stopped or failed: it does not start by itself again.
    stopped: Option<(Basis, Option<String>)>,
    focus: Option<usize>,
    standings: Vec<Standing>,
    /// The revision that the standings are of.
    standings_of: Option<u64>,
    /// Counts lists, so that pictures of an old one are not taken for those of a new one.
    generation: u64,
    /// Also show those that are accepted.
    pub shows_accepted: bool,
}

impl SuspectsList {
    /// Whether the propagation in force is the automatic one, so that looking is quick.
    pub fn is_quick(document: &Document) -> bool {
        document.propagation().is_some_and(judges)
    }

    /// Starts to look, unless that is under way. `None` propagation: nothing happens.
    pub fn look(&mut self, ctx: &egui::Context, document: &Document) {
        let (Some(basis), Some(in_force), Some(signs)) = (
            Basis::of(document),
            document.shared_propagation(),
            document.orientation().cloned(),
        ) else {
            return;
        };
        let cloud = Arc::clone(document.cloud());
        let given = document.given_normals().cloned();
        let known_automatic = self.automatic.clone();
        self.stopped = None;
        let job = Job::start(ctx, "suspects", "Looking for what seems wrong", move |progress| {
            let (automatic, is_new, part) = if judges(&in_force) {
                (Arc::clone(&in_force), false, 0.0..1.0)
            } else if let Some(known) = known_automatic {
                (known, false, 0.0..1.0)
            } else {
                // The file's normals are what is in question, so they are no evidence.
                let known = Known {
                    given: given.as_ref().map(|normals| normals.as_slice()),
                    stations: &in_force.stations,
                    ..Known::default()
                };
                let part = Part::new(progress, 0.0..0.85);
                let automatic = Propagation::new(&cloud, known, Parameters::default(), &part)?;
                (Arc::new(automatic), true, 0.85..1.0)
            };
            let mut normals = vec![Vec3::ZERO; cloud.n_points()];
            for (position, &point) in (0_u32..).zip(in_force.tree.order()) {
                let stored = in_force.normals[point as usize];
                normals[point as usize] = if signs.is_turned(position) { -stored } else { stored };
            }
            let settings = Settings {
                most: MOST,
                ..Settings::default()
            };
            let part = Part::new(progress, part);
            let found = examine(&cloud, &automatic, &normals, settings, &part)?;
            let Findings { suspects, grounds } =
                found.ok_or_else(|| JobError::Failed("The automatic method leaves nothing to judge by.".to_owned()))?;
            progress.stage("Preparing the list");
            let rows = suspects
                .into_iter()
                .map(|suspect| Row::new(suspect, &cloud, &in_force.tree, &normals))
                .collect();
            Ok(Found {
                rows,
                grounds,
                automatic: is_new.then_some(automatic),
            })
        });
        self.job = Some((job, basis));
    }

    /// Takes the result if it is there, and forgets what is of another propagation. Starts to look where that is quick, or `wanted`.
    pub fn keep(&mut self, ctx: &egui::Context, document: &Document, wanted: bool) {
        if self.basis.as_ref().is_some_and(|basis| !basis.is_of(document)) {
            self.forget_rows();
        }
        if self.job.as_ref().is_some_and(|(_, basis)| !basis.is_of(document)) {
            // Dropping it cancels it.
            self.job = None;
        }
        if let Some((job, basis)) = self.job.take() {
            match job.poll() {
                None => self.job = Some((job, basis)),
                Some(Ok(found)) => {
                    self.forget_rows();
                    self.automatic = found.automatic.or(self.automatic.take());
                    (self.rows, self.grounds, self.basis) = (found.rows, Some(found.grounds), Some(basis));
                }
                Some(Err(JobError::Cancelled)) => self.stopped = Some((basis, None)),
                Some(Err(JobError::Failed(reason))) => self.stopped = Some((basis, Some(reason))),
            }
        }
        let was_stopped = self.stopped.as_ref().is_some_and(|(basis, _)| basis.is_of(document));
        let is_due = self.basis.is_none() && self.job.is_none() && !was_stopped;
        if is_due && (wanted || Self::is_quick(document)) {
            self.look(ctx, document);
        }
        self.follow(document);
    }

    fn forget_rows(&mut self) {
        self.rows.clear();
        self.reviewed.clear();
        self.standings.clear();
        (self.basis, self.grounds, self.focus, self.standings_of) = (None, None, None, None);
        self.generation += 1;
    }

    /// Brings the standings in line with the document.
    pub fn follow(&mut self, document: &Document) {
        let revision = Some(document.revision());
        if self.standings_of != revision || self.standings.len() != self.rows.len() {
            self.standings = self.rows.iter().map(|row| row.standing(document)).collect();
            self.standings_of = revision;
        }
    }

    /// How far the job is; `None` when none runs.
    pub fn status(&self) -> Option<JobStatus> {
        self.job.as_ref().map(|(job, _)| job.status())
    }

    /// Why there is no list: the user stopped the job (`None`), or it failed with a reason.
    pub fn stopped(&self) -> Option<Option<&str>> {
        self.stopped.as_ref().map(|(_, reason)| reason.as_deref())
    }

    /// Asks the job to stop.
    pub fn stop(&self) {
        if let Some((job, _)) = &self.job {
            job.cancel();
        }
    }

    /// Whether there is a list.
    pub fn is_known(&self) -> bool {
        self.basis.is_some()
    }

    /// Whether signs changed since the list was made.
    pub fn is_old(&self, document: &Document) -> bool {
        let revision = document.signs_revision();
        self.basis
            .as_ref()
            .is_some_and(|basis| basis.signs_revision != revision)
    }

    /// Whether signs changed since the list was made by anything but flips of its rows, so that it is a list of another state.
    pub fn is_stale(&self, document: &Document) -> bool {
        self.is_old(document) && !self.reviewed.contains(&document.signs_revision())
    }

    /// Remembers that a row was flipped in a document whose signs had the revision `before`.
    pub fn follow_flip(&mut self, before: u64, document: &Document) {
        let was_of_list = self.basis.as_ref().is_some_and(|basis| basis.signs_revision == before);
        if was_of_list || self.reviewed.contains(&before) {
            self.reviewed.insert(document.signs_revision());
        }
    }

    /// All that was found, the most likely and largest first, with what became of each.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = (&Row, Standing)> {
        self.rows.iter().zip(self.standings.iter().copied())
    }

    /// One of the rows.
    pub fn row(&self, index: usize) -> Option<&Row> {
        self.rows.get(index)
    }

    /// How many of the rows stand like this.
    pub fn count(&self, standing: Standing) -> usize {
        self.standings.iter().filter(|&&each| each == standing).count()
    }

    /// What the belief in the rest rests on.
    pub fn grounds(&self) -> Option<&Grounds> {
        self.grounds.as_ref()
    }

    /// A number that changes when the rows do.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The row that the view shows, while it is open.
    pub fn focus(&self) -> Option<usize> {
        self.focus
            .filter(|&index| self.standings.get(index) == Some(&Standing::Open))
    }

    /// Makes a row the one that the view shows, or none.
    pub fn set_focus(&mut self, index: Option<usize>) {
        self.focus = index.filter(|&index| index < self.rows.len());
    }

    /// The open row after the one in focus, or before it, going round; `None` when none is open.
    pub fn neighbor(&self, forward: bool) -> Option<usize> {
        let n = self.rows.len();
        let is_open = |&index: &usize| self.standings[index] == Standing::Open;
        match self.focus {
            // From where the focus was, also when that row is settled.
            Some(at) if forward => (1..=n).map(|step| (at + step) % n).find(is_open),
            Some(at) => (1..=n).map(|step| (at + n - step) % n).find(is_open),
            None if forward => (0..n).find(is_open),
            None => (0..n).rev().find(is_open),
        }
    }

    /// The edit that flips a row.
    pub fn flip(&self, index: usize) -> Option<Edit> {
        self.rows.get(index).map(|row| Edit::FlipPoints {
            points: row.points.clone(),
            reason: FlipReason::Suspect,
        })
    }

    /// The edit that accepts a row, or takes that back.
    pub fn accept(&self, document: &Document, index: usize, accepts: bool) -> Option<Edit> {
        let row = self.rows.get(index)?;
        let accepted = &document.state().accepted;
        Some(Edit::Accept(if accepts {
            accepted | &row.points
        } else {
            accepted - &row.points
        }))
    }
}

/// Whether it is the automatic method's own result, with evidence that does not believe what is in question.
fn judges(propagation: &Propagation) -> bool {
    propagation.patches.is_some()
        && propagation.evidence.is_some()
        && propagation.parameters.method == Method::Agglomeration
        && propagation.parameters.rule != SideRule::Given
}

impl Row {
    fn new(suspect: Suspect, cloud: &PointCloud, tree: &SpanningTree, normals: &[Vec3]) -> Self {
        let place = |point: u32| cloud.positions()[point as usize];
        let mut positions: Vec<u32> = suspect.points.iter().map(|&point| tree.position(point)).collect();
        positions.sort_unstable();
        let ranges: Vec<_> = (positions.chunk_by(|a, b| a + 1 == *b))
            .map(|run| run[0]..run[run.len() - 1] + 1)
            .collect();
        let mut sum = glam::DVec3::ZERO;
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &point in &suspect.points {
            sum += normals[point as usize].as_dvec3();
            (min, max) = (min.min(place(point)), max.max(place(point)));
        }
        let mean = (sum / suspect.points.len().max(1) as f64).as_vec3();
        let every = suspect.points.len().div_ceil(MAX_SAMPLES).max(1);
        let sampled = suspect.points.iter().step_by(every);
        let least_radius = LEAST_RADIUS * cloud.diagonal();
        Self {
            points: suspect.points.iter().copied().collect(),
            outline: Change::from_flips(&ranges),
            right_side: (mean.length() >= LEAST_MEAN).then(|| -mean.normalize_or_zero()),
            middle: 0.5 * (min + max),
            radius: (0.5 * (max - min).length()).max(least_radius),
            samples: sampled.map(|&point| (point, normals[point as usize])).collect(),
            suspect,
        }
    }

    fn standing(&self, document: &Document) -> Standing {
        let is_turned = |&&(point, normal): &&(u32, Vec3)| {
            let now = document.oriented_normal(point);
            now.is_some_and(|now| now.dot(normal) < 0.0)
        };
        let n_turned = self.samples.iter().filter(is_turned).count();
        if 2 * n_turned > self.samples.len() {
            return Standing::Turned;
        }
        let n_accepted = document.state().accepted.intersection_len(&self.points);
        if 2 * n_accepted > self.points.len() {
            Standing::Accepted
        } else {
            Standing::Open
        }
    }

    /// Its positions in the tree.
    pub fn outline(&self) -> &Change {
        &self.outline
    }

    /// The side that is believed to be right, from which the suspect shows its back.
    pub fn right_side(&self) -> Option<Vec3> {
        self.right_side
    }

    /// The middle of the suspect, in world space.
    pub fn middle(&self) -> Vec3 {
        self.middle
    }

    /// World positions around the suspect and some of what is around it: what a view of it shows.
    pub fn frame(&self) -> [Vec3; 6] {
        self.around(SURROUNDINGS)
    }

    /// World positions close around the suspect, for small pictures.
    pub fn close_frame(&self) -> [Vec3; 6] {
        self.around(CLOSE_SURROUNDINGS)
    }

    fn around(&self, radii: f32) -> [Vec3; 6] {
        let reach = radii * self.radius;
        let [x, y, z] = Vec3::AXES.map(|axis| axis * reach);
        [x, -x, y, -y, z, -z].map(|offset| self.middle + offset)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use normend_core::{Silent, Start, shapes};

    use super::*;

    /// A sphere with given normals, of which a cap is wrong.
    fn document() -> Document {
        let shape = shapes::sphere(3000);
        let wrong = |normal: Vec3| normal.dot(Vec3::X) > 0.9;
        let given: Vec<Vec3> = (shape.normals.iter())
            .map(|&normal| if wrong(normal) { -normal } else { normal })
            .collect();
        let cloud = Arc::new(PointCloud::new(DVec3::ZERO, shape.positions).unwrap());
        let parameters = Parameters {
            start: Start::Keep,
            ..Parameters::default()
        };
        let propagation = Propagation::new(&cloud, Some(given.as_slice()), parameters, &Silent).unwrap();
        let mut document = Document::new(cloud, Some(Arc::new(given))).with_parameters(parameters);
        document.install(propagation);
        document
    }

    fn looked(document: &Document) -> SuspectsList {
        let ctx = egui::Context::default();
        let mut list = SuspectsList::default();
        list.keep(&ctx, document, false);
        assert!(
            list.status().is_none(),
            "it takes an automatic propagation, so it waits until it is wanted"
        );
        list.keep(&ctx, document, true);
        while !list.is_known() {
            std::thread::yield_now();
            list.keep(&ctx, document, true);
        }
        list
    }

    #[test]
    fn a_wrong_cap_is_found_flipped_and_comes_back_with_undo() {
        let mut document = document();
        let mut list = looked(&document);
        assert_eq!(list.rows().len(), 1, "{:?}", list.rows);
        let row = list.row(0).unwrap();
        assert!(row.right_side().unwrap().dot(Vec3::X) > 0.99);
        assert_eq!(row.outline().n_points(), row.points.len());
        assert_eq!(list.neighbor(true), Some(0));
        list.set_focus(Some(0));
        assert!(!list.is_old(&document));

        let before = document.signs_revision();
        document.apply(list.flip(0).unwrap()).unwrap();
        list.follow(&document);
        assert!(list.is_stale(&document), "nobody said that it was a flip of the list");
        list.follow_flip(before, &document);
        assert!(list.is_old(&document) && !list.is_stale(&document));
        assert_eq!(
            (list.focus(), list.neighbor(true), list.count(Standing::Turned)),
            (None, None, 1)
        );
        assert!(list.is_old(&document));
        document.undo().unwrap();
        list.follow(&document);
        assert_eq!((list.neighbor(true), list.count(Standing::Open)), (Some(0), 1));
        assert!(!list.is_old(&document));
        // Something else is done instead.
        document.apply(Edit::TurnWhole(0)).unwrap();
        list.follow_flip(before + 1_000_000, &document);
        assert!(list.is_stale(&document));
    }

    #[test]
    fn accepted_stays_accepted_when_looked_again() {
        let mut document = document();
        let mut list = looked(&document);
        document.apply(list.accept(&document, 0, true).unwrap()).unwrap();
        list.follow(&document);
        assert_eq!((list.count(Standing::Accepted), list.neighbor(false)), (1, None));
        let mut again = looked(&document);
        assert_eq!((again.count(Standing::Accepted), again.count(Standing::Open)), (1, 0));
        document.apply(again.accept(&document, 0, false).unwrap()).unwrap();
        again.follow(&document);
        assert_eq!(again.count(Standing::Open), 1);
        assert!(document.state().accepted.is_empty());
    }
}
