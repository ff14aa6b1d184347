//! Patches that probably point to the wrong side, the most likely and largest first: few, and good.
//!
//! Normals of any origin are compared with what the automatic method finds, whose [`confidence`](crate::confidence) says for
//! each point how likely its present sign is wrong: where both agree, as likely as the automatic sign is; where they differ, as
//! likely as the automatic sign is right. A suspect is a connected region that differs, or a patch of the agglomeration, and its
//! score is the share of its points that is expected to be wrong. A component that mostly differs is one suspect as a whole, and
//! its parts are looked at as if it was turned.
//!
//! Nothing is applied; that is the user's.
//!
//! Invariants: suspects share no points, but for those of a whole component; ids ascend in each; the same for any number of
//! threads.

use fixedbitset::FixedBitSet;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::confidence::{of_points, of_side};
use crate::metrics::{self, wrong_regions};
use crate::progress::Part;
use crate::{Cancelled, Neighbors, Patches, PointCloud, Progress, Propagation};

/// Fewer points are no patch that a user would see and mend.
pub const LEAST_POINTS: usize = 10;

/// The score from which on a patch is a suspect by default. On right results of the automatic method none of 123 clouds has a
/// patch that is expected to be wrong by this share.
pub const THRESHOLD: f32 = 0.4;

/// Suspects by default: more than anybody looks at before running again.
pub const MOST: usize = 10;

/// Which suspects are wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The least score, in 0..=1.
    pub threshold: f32,
    /// The largest number of suspects.
    pub most: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            threshold: THRESHOLD,
            most: MOST,
        }
    }
}

/// Why a patch is suspect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The automatic method has it the other way round.
    Differs,
    /// The automatic method has it like this, but is not sure.
    Doubtful,
    /// Most of a component is the other way round than the automatic method has it.
    Whole,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Differs, Self::Doubtful, Self::Whole];

    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Differs => "differs",
            Self::Doubtful => "doubtful",
            Self::Whole => "whole",
        }
    }
}

/// A patch that probably points to the wrong side, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Suspect {
    /// Its points, ascending.
    pub points: Vec<u32>,
    /// The one of them that is nearest to their middle: a place to look at and to click on.
    pub point: u32,
    /// Share of its points that is expected to be wrong, in 0..=1: the probability that it is wrong.
    pub score: f32,
    /// Why.
    pub kind: Kind,
    /// How well it goes together with its surroundings as it is, in −1..=1: over the pairs of neighbors across its edge the sum of
    /// `r|r|` over that of `r²`, for the reflection sign `r = c − 2ab` of the present normals. 1 without surroundings.
    pub seam: f32,
    /// Votes of the evidence for the present side, in full looks.
    pub votes_for: f32,
    /// Votes against it.
    pub votes_against: f32,
}

/// What the belief in all that is no suspect rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grounds {
    /// Share of the points whose side the evidence knows, in 0..=1.
    pub share_known: f64,
    /// Share that is expected to be right of the most doubtful patch that is no suspect, in 0..=1; 1 without patches.
    pub weakest: f32,
    /// Number of components of at least [`LEAST_POINTS`] points.
    pub n_components: usize,
    /// How many of them have a side that nothing tells.
    pub n_undecided: usize,
}

/// The suspects, and why nothing else is.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings {
    /// The most likely and largest first.
    pub suspects: Vec<Suspect>,
    /// Why nothing else is.
    pub grounds: Grounds,
}

/// Finds the suspects among `normals`; see [`examine`].
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub fn suspects(
    cloud: &PointCloud,
    automatic: &Propagation,
    normals: &[Vec3],
    settings: Settings,
    progress: &dyn Progress,
) -> Result<Option<Vec<Suspect>>, Cancelled> {
    let findings = examine(cloud, automatic, normals, settings, progress)?;
    Ok(findings.map(|findings| findings.suspects))
}

/// Finds the suspects among `normals` (`n` by point of `cloud`, with the signs that are in question, zero where there is none).
///
/// `automatic` is what the automatic method makes of the same cloud; its own initial normals may be in question too. Returns
/// `None` when it comes from another method, which leaves nothing to judge by. O(n log n), in parallel, about 60 bytes a point.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub fn examine(
    cloud: &PointCloud,
    automatic: &Propagation,
    normals: &[Vec3],
    settings: Settings,
    progress: &dyn Progress,
) -> Result<Option<Findings>, Cancelled> {
    let (Some(sureness), Some(patches)) = (of_points(automatic), &automatic.patches) else {
        return Ok(None);
    };
    progress.stage("Looking for what seems wrong");
    let neighbors = Neighbors::find(cloud, metrics::K, &Part::new(progress, 0.0..0.6))?;
    let found = automatic.initial_normals();
    let mut differs: FixedBitSet = FixedBitSet::with_capacity(normals.len());
    for (point, (found, present)) in found.iter().zip(normals).enumerate() {
        differs.set(point, found.dot(*present) < 0.0);
    }
    let mut candidates = wholes(automatic, &mut differs);
    let doubts: Vec<u8> = (sureness.iter().enumerate())
        .map(|(point, &sure)| if differs.contains(point) { sure } else { 255 - sure })
        .collect();
    progress.report(0.7)?;
    for points in wrong_regions(&neighbors, &differs) {
        if points.len() < LEAST_POINTS {
            break;
        }
        let score = mean_doubt(&points, &doubts);
        candidates.push(Candidate::new(Place::Points(points), score, Kind::Differs));
    }
    candidates.retain(|candidate| candidate.score >= settings.threshold);
    let by_leaf = by_leaf(patches, &doubts);
    let mut most_doubtful = 0.0_f32;
    for patch in doubtful(patches, &by_leaf, &doubts) {
        if patch.score >= settings.threshold {
            candidates.push(patch);
        } else {
            most_doubtful = most_doubtful.max(patch.score);
        }
    }
    progress.report(0.8)?;
    // Ties by the smallest id, which is a property of the points; regions before patches of the same points.
    candidates.par_sort_by(|a, b| {
        (b.rank().total_cmp(&a.rank()))
            .then(b.n_points.cmp(&a.n_points))
            .then_with(|| a.first(&by_leaf).cmp(&b.first(&by_leaf)))
    });
    let mut taken = FixedBitSet::with_capacity(normals.len());
    let mut chosen = Vec::new();
    for candidate in &candidates {
        if chosen.len() == settings.most {
            break;
        }
        let all = candidate.points(&by_leaf);
        let (mut points, mut score, mut kind) = (all.to_vec(), candidate.score, candidate.kind);
        // A component as a whole and a part of it are two questions.
        if kind != Kind::Whole {
            points.retain(|&point| !taken.contains(point as usize));
            if points.len() < LEAST_POINTS || 2 * points.len() <= all.len() {
                continue;
            }
            if points.len() < all.len() {
                score = mean_doubt(&points, &doubts);
            }
            if score < settings.threshold {
                continue;
            }
            taken.extend(points.iter().map(|&point| point as usize));
            let n_differing = points.iter().filter(|&&point| differs.contains(point as usize)).count();
            kind = if 2 * n_differing > points.len() {
                Kind::Differs
            } else {
                Kind::Doubtful
            };
        }
        points.sort_unstable();
        let parts = (cloud, automatic, &neighbors);
        chosen.push(describe(parts, normals, &found, points, score, kind));
    }
    progress.report(1.0)?;
    Ok(Some(Findings {
        suspects: chosen,
        grounds: grounds(automatic, 1.0 - most_doubtful),
    }))
}

fn grounds(automatic: &Propagation, weakest: f32) -> Grounds {
    let tree = &automatic.tree;
    let sides = tree.roots().iter().zip(&automatic.sides);
    let of_size: Vec<_> = sides
        .filter(|(root, _)| tree.subtree(**root).len() >= LEAST_POINTS)
        .collect();
    Grounds {
        share_known: automatic
            .evidence
            .as_ref()
            .map_or(0.0, |evidence| evidence.share_known()),
        weakest,
        n_components: of_size.len(),
        n_undecided: of_size.iter().filter(|(_, side)| side.rule.is_none()).count(),
    }
}

/// Where the points of a candidate are listed.
enum Place {
    Points(Vec<u32>),
    /// A range of the patches' leaves.
    Leaves(std::ops::Range<u32>),
}

/// A set of points that may be a suspect.
struct Candidate {
    place: Place,
    n_points: usize,
    score: f32,
    kind: Kind,
}

impl Candidate {
    fn new(place: Place, score: f32, kind: Kind) -> Self {
        let n_points = match &place {
            Place::Points(points) => points.len(),
            Place::Leaves(leaves) => leaves.len(),
        };
        Self {
            place,
            n_points,
            score,
            kind,
        }
    }

    /// Surer ones first, and of equally sure ones the larger. By the logarithm: what a user gains by looking grows with the size,
    /// but no size makes up for a guess.
    fn rank(&self) -> f32 {
        self.score * (self.n_points as f32).ln()
    }

    fn points<'a>(&'a self, by_leaf: &'a [u32]) -> &'a [u32] {
        match &self.place {
            Place::Points(points) => points,
            Place::Leaves(leaves) => &by_leaf[leaves.start as usize..leaves.end as usize],
        }
    }

    /// The smallest id.
    fn first(&self, by_leaf: &[u32]) -> u32 {
        self.points(by_leaf).iter().copied().min().unwrap_or_default()
    }
}

/// A sum of bytes over so many points, as a share.
fn mean(sum: u64, n_points: usize) -> f32 {
    (sum as f64 / (255.0 * n_points as f64)) as f32
}

/// The share of some points that is expected to be wrong.
fn mean_doubt(points: &[u32], doubts: &[u8]) -> f32 {
    let sum = points.iter().map(|&point| u64::from(doubts[point as usize])).sum();
    mean(sum, points.len())
}

/// The components that mostly differ; what differs in them is turned round.
fn wholes(automatic: &Propagation, differs: &mut FixedBitSet) -> Vec<Candidate> {
    let tree = &automatic.tree;
    let mut wholes = Vec::new();
    for (&root, side) in tree.roots().iter().zip(&automatic.sides) {
        let component = tree.subtree(root);
        let points = &tree.order()[component.start as usize..component.end as usize];
        let n_differing = points.iter().filter(|&&point| differs.contains(point as usize)).count();
        if 2 * n_differing <= points.len() {
            continue;
        }
        for &point in points {
            differs.toggle(point as usize);
        }
        // A side that nothing tells is no reason to suspect another.
        if points.len() >= LEAST_POINTS && side.rule.is_some() {
            wholes.push(Candidate::new(
                Place::Points(points.to_vec()),
                of_side(side),
                Kind::Whole,
            ));
        }
    }
    wholes
}

/// The points in the order of the patches' leaves.
fn by_leaf(patches: &Patches, doubts: &[u8]) -> Vec<u32> {
    let mut by_leaf = vec![0; doubts.len()];
    for point in 0..doubts.len() as u32 {
        by_leaf[patches.leaf(point) as usize] = point;
    }
    by_leaf
}

/// The patches of at most half their component, with the doubt that their points are in.
fn doubtful<'a>(patches: &'a Patches, by_leaf: &[u32], doubts: &[u8]) -> impl Iterator<Item = Candidate> + 'a {
    let mut sums = Vec::with_capacity(by_leaf.len() + 1);
    let mut sum = 0_u64;
    sums.push(sum);
    for &point in by_leaf {
        sum += u64::from(doubts[point as usize]);
        sums.push(sum);
    }
    let all: Vec<_> = patches.all().collect();
    let mut n_component = vec![0_u32; all.len()];
    for (node, &(patch, parent)) in all.iter().enumerate().rev() {
        n_component[node] = match parent as usize == node {
            true => patch.n_points,
            false => n_component[parent as usize],
        };
    }
    all.into_iter()
        .zip(n_component)
        .filter_map(move |((patch, _), n_component)| {
            let n_points = patch.n_points as usize;
            if n_points < LEAST_POINTS || patch.n_points > n_component / 2 {
                return None;
            }
            let leaves = patch.leaves();
            let score = mean(sums[leaves.end as usize] - sums[leaves.start as usize], n_points);
            Some(Candidate::new(Place::Leaves(leaves), score, Kind::Doubtful))
        })
}

/// Fills in what is said of a suspect.
fn describe(
    (cloud, automatic, neighbors): (&PointCloud, &Propagation, &Neighbors),
    normals: &[Vec3],
    found: &[Vec3],
    points: Vec<u32>,
    score: f32,
    kind: Kind,
) -> Suspect {
    let positions = cloud.positions();
    let sum: DVec3 = points.iter().map(|&point| positions[point as usize].as_dvec3()).sum();
    let middle = (sum / points.len() as f64).as_vec3();
    let from_middle = |point: u32| positions[point as usize].distance_squared(middle);
    let nearest = |a: u32, b: u32| if from_middle(b) < from_middle(a) { b } else { a };
    let point = points.iter().copied().reduce(nearest).unwrap_or_default();

    let (mut votes_for, mut votes_against) = (0.0, 0.0);
    if let Some(evidence) = &automatic.evidence {
        let (mut with, mut against) = (0_i64, 0_i64);
        for &point in &points {
            let vote = evidence.votes()[point as usize];
            let stored = automatic.normals[point as usize];
            let signed = match stored.dot(normals[point as usize]) < 0.0 {
                true => -vote.signed,
                false => vote.signed,
            };
            with += i64::from(vote.weight + signed);
            against += i64::from(vote.weight - signed);
        }
        // Each look is in the weight once: the sums hold it twice or not at all.
        let looks = |sum: i64| (sum as f64 / f64::from(2 * crate::evidence::UNIT)) as f32;
        (votes_for, votes_against) = (looks(with), looks(against));
    }

    // The reflection sign of the automatic normals' lines with the present signs: present normals may be zero or not unit.
    let unit = |point: u32| {
        let (found, present) = (found[point as usize], normals[point as usize]);
        if found.dot(present) < 0.0 { -found } else { found }
    };
    let (mut fits, mut all) = (0.0_f64, 0.0_f64);
    for &point in &points {
        for &other in neighbors.of(point as usize) {
            if points.binary_search(&other).is_ok() {
                continue;
            }
            let Some(direction) = (positions[other as usize] - positions[point as usize]).try_normalize() else {
                continue;
            };
            let (a, b) = (unit(point), unit(other));
            let r = f64::from(a.dot(b) - 2.0 * a.dot(direction) * b.dot(direction));
            fits += r * r.abs();
            all += r * r;
        }
    }
    Suspect {
        points,
        point,
        score,
        kind,
        seam: if all > 0.0 { (fits / all) as f32 } else { 1.0 },
        votes_for,
        votes_against,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::ShapeKind;
    use crate::{Preset, Silent};

    fn torus() -> (PointCloud, Propagation) {
        let cloud = PointCloud::new(DVec3::ZERO, ShapeKind::Torus.generate(4000).positions).unwrap();
        let propagation = Propagation::new(&cloud, None, Preset::Auto.parameters(), &Silent).unwrap();
        (cloud, propagation)
    }

    fn of(cloud: &PointCloud, propagation: &Propagation, normals: &[Vec3]) -> Vec<Suspect> {
        suspects(cloud, propagation, normals, Settings::default(), &Silent)
            .unwrap()
            .unwrap()
    }

    #[test]
    fn a_right_cloud_has_none() {
        let (cloud, propagation) = torus();
        assert_eq!(of(&cloud, &propagation, &propagation.initial_normals()), []);
    }

    #[test]
    fn turned_patches_are_the_suspects_and_the_larger_is_first() {
        let (cloud, propagation) = torus();
        let mut normals = propagation.initial_normals();
        let mut turned = FixedBitSet::with_capacity(normals.len());
        let mut turn_around = |place: u32, radius: f32| {
            let center = cloud.positions()[place as usize];
            let mut n_turned = 0;
            for (point, position) in cloud.positions().iter().enumerate() {
                if position.distance(center) < radius && !turned.contains(point) {
                    turned.insert(point);
                    n_turned += 1;
                }
            }
            n_turned
        };
        let diagonal = cloud.diagonal();
        let sizes = [turn_around(10, 0.08 * diagonal), turn_around(3990, 0.12 * diagonal)];
        for point in turned.ones() {
            normals[point] = -normals[point];
        }
        let suspects = of(&cloud, &propagation, &normals);
        let found: Vec<(usize, Kind)> = suspects
            .iter()
            .map(|suspect| (suspect.points.len(), suspect.kind))
            .collect();
        assert_eq!(found, [(sizes[1], Kind::Differs), (sizes[0], Kind::Differs)]);
        for suspect in &suspects {
            assert!(suspect.points.iter().all(|&point| turned.contains(point as usize)));
            assert!(suspect.points.contains(&suspect.point));
            assert!(suspect.score > 0.9 && suspect.seam < 0.0, "{suspect:?}");
            assert!(suspect.votes_against > suspect.votes_for, "{suspect:?}");
        }
    }

    #[test]
    fn a_cloud_inside_out_is_one_suspect_and_its_right_patch_another() {
        let (cloud, propagation) = torus();
        let mut normals: Vec<Vec3> = propagation.initial_normals().iter().map(|&normal| -normal).collect();
        for normal in &mut normals[100..140] {
            *normal = -*normal;
        }
        let suspects = of(&cloud, &propagation, &normals);
        assert_eq!((suspects[0].kind, suspects[0].points.len()), (Kind::Whole, 4000));
        assert_eq!((suspects[0].seam, suspects[0].score), (1.0, 1.0));
        for suspect in &suspects[1..] {
            assert!(suspect.points.iter().all(|&point| (100..140).contains(&point)));
        }
    }

    #[test]
    fn points_without_a_normal_are_none() {
        let (cloud, propagation) = torus();
        assert_eq!(of(&cloud, &propagation, &vec![Vec3::ZERO; 4000]), []);
    }

    #[test]
    fn another_method_leaves_nothing_to_judge_by() {
        let cloud = PointCloud::new(DVec3::ZERO, ShapeKind::Torus.generate(500).positions).unwrap();
        let propagation = Propagation::new(&cloud, None, Preset::Tree.parameters(), &Silent).unwrap();
        let normals = propagation.initial_normals();
        assert_eq!(
            suspects(&cloud, &propagation, &normals, Settings::default(), &Silent),
            Ok(None)
        );
    }
}
