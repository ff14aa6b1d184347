//! `normend bench clicks`: how many clicks of a simulated user it takes until no wrong region is left.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::time::Instant;

use anyhow::{Context, ensure};
use fixedbitset::FixedBitSet;
use glam::Vec3;
use normend_core::metrics::{self, wrong_regions};
use normend_core::{Change, Document, Edit, EditError, Neighbors, Parameters, Progress, Propagation};

use super::super::check::{check_same_points, normals_of};
use super::super::{Outcome, prepare, title_of};
use super::folder::{Case, Found, find, for_each_case, n_threads};
use super::quality::{OPEN, REGION, ROOM, SCAN};
use crate::arguments::bench::ClicksArguments;
use crate::console::{self, Bar, counted};

/// A user who has clicked so often gives up: by then another method is the better advice.
const PATIENCE: usize = 60;

/// Whether the truth of a cloud is its inside or outside by convention only, which a user knows and says once for all: the
/// whole of it may be flipped then before the first click.
pub(super) fn has_convention_only(case: &Case) -> bool {
    case.class == OPEN || (case.class == SCAN && case.name.starts_with(ROOM))
}

/// How the simulated user turns a region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum User {
    /// Clicks mend along the tree.
    Tree,
    /// Takes the patch that is offered first.
    Default,
    /// Turns the wheel to the patch that mends most, of equal ones the nearest.
    Wheel,
}

impl User {
    const ALL: [Self; 3] = [Self::Tree, Self::Default, Self::Wheel];

    fn name(self) -> &'static str {
        match self {
            Self::Tree => "tree",
            Self::Default => "default",
            Self::Wheel => "wheel",
        }
    }
}

/// What one user did to one cloud.
#[derive(Clone, Debug, Default)]
struct Work {
    n_clicks: usize,
    /// Clicks after which more points are wrong than before.
    n_harmful: usize,
    n_steps: usize,
    n_turned: u64,
    n_wrong_before: usize,
    n_wrong_after: usize,
    /// Wrong regions that were left when the user gave up.
    n_left: usize,
    /// Seconds of each preview with its click.
    seconds: Vec<f64>,
}

/// One cloud and what each user did to it, in the order of [`User::ALL`].
#[derive(Debug)]
struct Mended {
    class: String,
    name: String,
    works: Vec<Work>,
}

/// Lets every user mend every cloud of the folder and prints a row for each.
///
/// # Errors
/// A folder without clouds, Ctrl-C. What is wrong with one cloud is said instead, and the outcome is a failure.
pub fn run(arguments: &ClicksArguments) -> anyhow::Result<Outcome> {
    let Found { cases, .. } = find(&arguments.folder, &arguments.only)?;
    prepare(&arguments.common)?;
    let parameters = Parameters::from(arguments.propagation);
    let bar = Bar::new(&title_of(&arguments.folder), arguments.common.quiet);
    bar.stage("Clicking");
    let results = for_each_case(&cases, n_threads(arguments.common.threads), &bar, |case, progress| {
        mend(case, parameters, progress)
    })?;
    let (mut clouds, mut outcome) = (Vec::new(), Outcome::Done);
    for result in results {
        match result {
            Ok(mended) => clouds.push(mended),
            Err(error) if console::is_stopped() => return Err(error),
            Err(error) => {
                bar.say_error(&format!("error: {}", console::in_words(&error)));
                outcome = Outcome::Failed;
            }
        }
    }
    drop(bar);
    let mut out = io::stdout().lock();
    out.write_all(table(&clouds, arguments.clouds).as_bytes())
        .and_then(|()| out.flush())
        .context("cannot write to standard output")?;
    Ok(outcome)
}

/// Orients one cloud and lets each user mend it.
fn mend(case: &Case, parameters: Parameters, progress: &dyn Progress) -> anyhow::Result<Mended> {
    let truth = normend_io::read(&case.truth, progress)?;
    let right = normals_of(&truth, &case.truth)?;
    let scan = normend_io::read(&case.raw, progress)?;
    check_same_points(&truth, &case.truth, &scan, &case.raw)?;
    let given = scan.given_normals.as_ref().map(|normals| normals.as_slice());
    let propagation = Propagation::new(&scan.cloud, given, parameters, progress)?;
    let neighbors = Neighbors::find(&scan.cloud, metrics::K, progress)?;
    let graph = SymmetricGraph::new(&neighbors);
    let works = User::ALL
        .into_iter()
        .map(|user| {
            let mut document = Document::new(scan.cloud.clone(), scan.given_normals.clone());
            document.install(propagation.clone());
            let mut right = right.to_vec();
            if has_convention_only(case) && 2 * wrong(&document, &right)?.count_ones(..) > right.len() {
                right.iter_mut().for_each(|normal| *normal = -*normal);
            }
            let work = simulate(user, &mut document, &right, &neighbors, &graph)?;
            progress.report(0.0)?;
            Ok(work)
        })
        .collect::<anyhow::Result<_>>()?;
    Ok(Mended {
        class: case.class.clone(),
        name: case.name.clone(),
        works,
    })
}

/// The points whose normals point away from the right ones.
fn wrong(document: &Document, right: &[Vec3]) -> Result<FixedBitSet, EditError> {
    let normals = document.oriented_normals().ok_or(EditError::NotReady)?;
    let mut wrong = FixedBitSet::with_capacity(right.len());
    for (point, (normal, right)) in normals.iter().zip(right).enumerate() {
        wrong.set(point, normal.dot(*right) < 0.0);
    }
    Ok(wrong)
}

/// Clicks the middle of the largest wrong region, again and again.
fn simulate(
    user: User,
    document: &mut Document,
    right: &[Vec3],
    neighbors: &Neighbors,
    graph: &SymmetricGraph,
) -> anyhow::Result<Work> {
    let mut wrong = wrong(document, right)?;
    let n_wrong_before = wrong.count_ones(..);
    let mut work = Work {
        n_wrong_before,
        ..Work::default()
    };
    loop {
        let regions = wrong_regions(neighbors, &wrong);
        work.n_left = regions.iter().filter(|region| region.len() >= REGION).count();
        let Some(region) = regions.first().filter(|_| work.n_left > 0 && work.n_clicks < PATIENCE) else {
            break;
        };
        let point = graph.middle(region);
        let (edit, n_steps) = choose(user, document, point, &wrong, right)?;
        let begin = Instant::now();
        let preview = preview(document, &edit)?;
        let change = document.apply(edit)?;
        work.seconds.push(begin.elapsed().as_secs_f64());
        ensure!(
            change == preview,
            "a click on point {point} turned other points than its preview showed"
        );
        work.n_clicks += 1;
        work.n_steps += n_steps;
        work.n_turned += change.n_points();
        let gain = gain(document, &change, &wrong, right);
        work.n_harmful += usize::from(gain < 0);
        wrong = self::wrong(document, right)?;
    }
    work.n_wrong_after = wrong.count_ones(..);
    Ok(work)
}

/// The edit that a user's click makes, and how many steps of the wheel come before it.
fn choose(
    user: User,
    document: &Document,
    point: u32,
    wrong: &FixedBitSet,
    right: &[Vec3],
) -> anyhow::Result<(Edit, usize)> {
    let offer = match user {
        User::Tree => None,
        User::Default | User::Wheel => document.offer(point)?,
    };
    let Some(offer) = offer else {
        return Ok((Edit::Mend(point), 0));
    };
    let edit_at = |level: usize| Edit::TurnPatch {
        point,
        n_points: offer.patches[level].n_points,
    };
    let mut best = (edit_at(offer.default), 0);
    if user == User::Wheel {
        let mut levels: Vec<usize> = (0..offer.patches.len()).collect();
        levels.sort_by_key(|level| level.abs_diff(offer.default));
        let mut most = i64::MIN;
        for level in levels {
            let edit = edit_at(level);
            let gain = gain(document, &preview(document, &edit)?, wrong, right);
            if gain > most {
                most = gain;
                best = (edit, level.abs_diff(offer.default));
            }
        }
    }
    Ok(best)
}

fn preview(document: &Document, edit: &Edit) -> Result<Change, EditError> {
    match *edit {
        Edit::TurnPatch { point, n_points } => document.preview_turn_patch(point, n_points),
        Edit::Mend(point) => document.preview_mend(point),
        _ => Ok(Change::default()),
    }
}

/// How many wrong points a change mends, less the right ones that it spoils, of those that are judged.
fn gain(document: &Document, change: &Change, wrong: &FixedBitSet, right: &[Vec3]) -> i64 {
    let order = document
        .propagation()
        .map_or(&[][..], |propagation| propagation.tree.order());
    let gain_at = |position: u32| {
        let point = order[position as usize] as usize;
        if right[point] == Vec3::ZERO {
            0
        } else if wrong.contains(point) {
            1
        } else {
            -1
        }
    };
    change.ranges().iter().flat_map(Clone::clone).map(gain_at).sum()
}

/// The graph that wrong regions hang together in.
struct SymmetricGraph {
    starts: Vec<u32>,
    ids: Vec<u32>,
}

impl SymmetricGraph {
    /// Each point with its neighbors and those that it is a neighbor of; some twice.
    fn new(neighbors: &Neighbors) -> Self {
        let n_points = neighbors.ids().len() / neighbors.k().max(1);
        let edges = || (0..n_points as u32).flat_map(|a| neighbors.of(a as usize).iter().map(move |&b| (a, b)));
        let mut starts = vec![0_u32; n_points + 1];
        for (a, b) in edges() {
            starts[a as usize + 1] += 1;
            starts[b as usize + 1] += 1;
        }
        for point in 0..n_points {
            starts[point + 1] += starts[point];
        }
        let mut next = starts.clone();
        let mut ids = vec![0; 2 * neighbors.ids().len()];
        for (a, b) in edges() {
            for (from, to) in [(a, b), (b, a)] {
                ids[next[from as usize] as usize] = to;
                next[from as usize] += 1;
            }
        }
        Self { starts, ids }
    }

    fn of(&self, point: u32) -> &[u32] {
        &self.ids[self.starts[point as usize] as usize..self.starts[point as usize + 1] as usize]
    }

    /// The point of a region farthest from its border, in edges; of equal ones, and without a border, the smallest id.
    /// `region` is ascending and not empty.
    fn middle(&self, region: &[u32]) -> u32 {
        const FAR: u32 = u32::MAX;
        let index_of = |point: u32| region.binary_search(&point).ok();
        let mut distances = vec![FAR; region.len()];
        let mut queue = VecDeque::new();
        for (index, &point) in region.iter().enumerate() {
            if self.of(point).iter().any(|&next| index_of(next).is_none()) {
                distances[index] = 0;
                queue.push_back(index);
            }
        }
        while let Some(index) = queue.pop_front() {
            for next in self.of(region[index]).iter().filter_map(|&next| index_of(next)) {
                if distances[next] == FAR {
                    distances[next] = distances[index] + 1;
                    queue.push_back(next);
                }
            }
        }
        let mut middle = 0;
        for (index, &distance) in distances.iter().enumerate() {
            if distance > distances[middle] {
                middle = index;
            }
        }
        region[middle]
    }
}

/// A row for each user, over the clouds that had a wrong region; above them, on request, the clouds.
fn table(clouds: &[Mended], with_clouds: bool) -> String {
    let mut text = String::new();
    let to_mend: Vec<&Mended> = clouds
        .iter()
        .filter(|cloud| cloud.works.iter().any(|work| work.n_clicks > 0))
        .collect();
    // Writing to a string does not fail.
    if with_clouds {
        let _ = writeln!(
            text,
            "{:<14} {:<28} {:<8} {:>6} {:>7} {:>8} {:>8} {:>8} {:>6}",
            "class", "cloud", "user", "clicks", "steps", "harmful", "wrong", "after", "left"
        );
        for cloud in &to_mend {
            for (user, work) in User::ALL.into_iter().zip(&cloud.works) {
                let _ = writeln!(
                    text,
                    "{:<14} {:<28} {:<8} {:>6} {:>7} {:>8} {:>8} {:>8} {:>6}",
                    cloud.class,
                    cloud.name,
                    user.name(),
                    work.n_clicks,
                    work.n_steps,
                    work.n_harmful,
                    work.n_wrong_before,
                    work.n_wrong_after,
                    work.n_left
                );
            }
        }
        text.push('\n');
    }
    let _ = writeln!(
        text,
        "{} of {} with a wrong region",
        to_mend.len(),
        counted(clouds.len(), "cloud")
    );
    let _ = writeln!(
        text,
        "{:<8} {:>7} {:>7} {:>7} {:>9} {:>13} {:>7} {:>9} {:>9} {:>9}",
        "user", "clicks", "median", "steps", "harmful", "points/click", "gave up", "p50 us", "p95 us", "max us"
    );
    for (index, user) in User::ALL.into_iter().enumerate() {
        let works: Vec<&Work> = to_mend.iter().map(|cloud| &cloud.works[index]).collect();
        let n_clouds = works.len().max(1) as f64;
        let sum = |of: fn(&Work) -> u64| works.iter().map(|work| of(work)).sum::<u64>() as f64;
        let n_clicks = sum(|work| work.n_clicks as u64);
        let mut clicks: Vec<f64> = works.iter().map(|work| work.n_clicks as f64).collect();
        let mut micros: Vec<f64> = works
            .iter()
            .flat_map(|work| &work.seconds)
            .map(|secs| secs * 1e6)
            .collect();
        let _ = writeln!(
            text,
            "{:<8} {:>7.1} {:>7.1} {:>7.1} {:>7.1} % {:>13.0} {:>7} {:>9.0} {:>9.0} {:>9.0}",
            user.name(),
            n_clicks / n_clouds,
            quantile(&mut clicks, 0.5),
            sum(|work| work.n_steps as u64) / n_clouds,
            100.0 * sum(|work| work.n_harmful as u64) / n_clicks.max(1.0),
            sum(|work| work.n_turned) / n_clicks.max(1.0),
            works.iter().filter(|work| work.n_left > 0).count(),
            quantile(&mut micros, 0.5),
            quantile(&mut micros, 0.95),
            quantile(&mut micros, 1.0)
        );
    }
    text
}

/// The value that a share of `values` is at most; 0 of none.
fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1) as f64;
    values.get((share * last).round() as usize).copied().unwrap_or(0.0)
}
