//! Sources by votes: viewpoints around the cloud say which points they see and from which side (Liu et al. §3.4).

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{HiddenPoints, SortedVotes};
use crate::progress::{Part, Steps};
use crate::propagation::{SourceRule, VIEWS};
use crate::sources::Origin;
use crate::{Cancelled, Neighbors, PointCloud, Progress, Source};

/// The angle at which a vote has fallen to 1/e: the paper's σ.
const SIGMA: f32 = std::f32::consts::FRAC_PI_6;

/// How far mended viewpoints are from the center, in diagonals of the bounding box: so far that none is on or in the cloud, and that
/// all look nearly along parallel rays, which see less of the inside through an opening.
const DISTANCE: f64 = 2.0;

/// What the viewpoints say about one point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vote {
    /// `C_i = Σ_j c_ij`: negative where the stored normal points to those who see it.
    pub sum: f32,
    /// `Σ_j |c_ij|`: how much was said at all. 0 where nobody sees the point.
    pub weight: f32,
}

/// Asks `viewpoints` (the cloud's own space) about the stored normals of all points.
///
/// * `neighbors` – the first `k` of each row tell how far points are off the surface, the noise that visibility allows for
/// * `normals` – `n` unit normals of any sign
/// * `rule` – [`SourceRule::HiddenPoints`]: `m_j` is the direction from a viewpoint to the centroid; otherwise `m_ij` is the
///   direction from the viewpoint to the point
///
/// Returns `n` votes by point, `c_ij = sign(n_i · m_j) exp(−arccos(|n_i · m_j|)² / σ²)` summed over the viewpoints that see the
/// point. The bounding box follows the axes, so votes turn with the cloud only nearly. O(views · n log n), views in parallel, the
/// same result for any number of threads.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub fn votes(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    k: usize,
    normals: &[Vec3],
    rule: SourceRule,
    viewpoints: &[DVec3],
    progress: &dyn Progress,
) -> Result<Vec<Vote>, Cancelled> {
    progress.report(0.0)?;
    let hidden_points = HiddenPoints::new(cloud, noise(cloud, neighbors, k, normals));
    let part = Part::new(progress, 0.05..0.95);
    let steps = Steps::new(&part, viewpoints.len());
    let seen = viewpoints
        .par_iter()
        .map(|&viewpoint| {
            let seen = hidden_points.seen_from(viewpoint);
            steps.advance(1)?;
            Ok(seen)
        })
        .collect::<Result<Vec<_>, Cancelled>>()?;
    drop(hidden_points);
    let centroid = centroid(cloud);
    let is_mended = rule == SourceRule::HiddenPointsMended;
    let directions: Vec<Vec3> = viewpoints
        .iter()
        .map(|&viewpoint| direction(viewpoint, centroid))
        .collect();
    let vote = |(point, &normal): (usize, &Vec3)| {
        let mut vote = Vote::default();
        for ((seen, &viewpoint), &central) in seen.iter().zip(viewpoints).zip(&directions) {
            if seen.contains(point) {
                let towards = if is_mended {
                    direction(viewpoint, cloud.positions()[point].as_dvec3())
                } else {
                    central
                };
                let cosine = normal.dot(towards);
                let angle = cosine.abs().min(1.0).acos();
                let certainty = (-(angle / SIGMA).powi(2)).exp();
                vote.sum += certainty.copysign(cosine);
                vote.weight += certainty;
            }
        }
        vote
    };
    let votes = normals.par_iter().enumerate().map(vote).collect();
    progress.report(1.0)?;
    Ok(votes)
}

/// The sources that `votes` make of `normals`, ascending by point, each with the direction that points to those who see it.
///
/// `sorted` are the same votes and says by which rule. With [`SourceRule::HiddenPoints`] sources are those with `C_i` in
/// `[min, min + η]` or `[max − η, max]`, where seen at all (§3.4). With [`SourceRule::HiddenPointsMended`] the share `eta` of the
/// points that are seen whose votes are surest. O(n).
pub fn sources(votes: &[Vote], normals: &[Vec3], sorted: &SortedVotes, eta: f32) -> Vec<Source> {
    let thresholds = sorted.thresholds(eta);
    let as_source = |(point, vote): (u32, &Vote)| Source {
        point,
        normal: normals[point as usize] * -vote.sum.signum(),
        origin: Origin::Voted,
        patch: None,
    };
    (0..)
        .zip(votes)
        .filter(|(_, vote)| sorted.is_source(vote, thresholds))
        .map(as_source)
        .collect()
}

/// The usual viewpoints, in the cloud's own space: the first `views` (within [`VIEWS`]) of the corners, face centers and edge
/// centers of the bounding box, in this order, opposite ones one after the other. With [`SourceRule::HiddenPointsMended`] they
/// are pushed out in the same directions.
pub fn viewpoints(cloud: &PointCloud, rule: SourceRule, views: usize) -> Vec<DVec3> {
    const HALF: [[f64; 3]; 13] = [
        [1.0, 1.0, 1.0],
        [1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 1.0, 0.0],
        [1.0, -1.0, 0.0],
        [0.0, 1.0, 1.0],
        [0.0, 1.0, -1.0],
        [1.0, 0.0, 1.0],
        [-1.0, 0.0, 1.0],
    ];
    let (min, max) = cloud.bounding_box();
    let (min, max) = (min.as_dvec3(), max.as_dvec3());
    let (center, half) = (0.5 * (min + max), 0.5 * (max - min));
    let place = |direction: DVec3| match rule {
        SourceRule::HiddenPointsMended => center + direction.normalize_or_zero() * DISTANCE * 2.0 * half.length(),
        _ => center + direction * half,
    };
    HALF.iter()
        .map(|&direction| DVec3::from(direction))
        .flat_map(|direction| [direction, -direction])
        .take(views.clamp(*VIEWS.start(), *VIEWS.end()))
        .map(place)
        .collect()
}

fn direction(from: DVec3, to: DVec3) -> Vec3 {
    (to - from).normalize_or_zero().as_vec3()
}

/// The mean of all points, summed in whole steps of a fine lattice, so that it does not depend on their order.
fn centroid(cloud: &PointCloud) -> DVec3 {
    let (min, max) = cloud.bounding_box();
    let (min, size) = (min.as_dvec3(), f64::from((max - min).max_element()));
    // 2³¹ steps along the longest side: finer than f32, and 2³² points stay within i64.
    let step = size.max(f64::MIN_POSITIVE) / 2.0_f64.powi(31);
    let sum = cloud
        .positions()
        .par_iter()
        .map(|position| ((position.as_dvec3() - min) / step).as_i64vec3())
        .reduce(|| glam::I64Vec3::ZERO, |a, b| a + b);
    min + sum.as_dvec3() * step / cloud.n_points().max(1) as f64
}

/// How far points typically are off the surface: the median over all points of the deviation of their neighbors along the
/// normal. On sharp edges it is large, but those are few.
fn noise(cloud: &PointCloud, neighbors: &Neighbors, k: usize, normals: &[Vec3]) -> f64 {
    let positions = cloud.positions();
    let k = k.min(neighbors.k());
    let mut deviations: Vec<f32> = (0..positions.len())
        .into_par_iter()
        .map(|point| {
            let heights = neighbors.of(point)[..k]
                .iter()
                .map(|&neighbor| (positions[neighbor as usize] - positions[point]).dot(normals[point]));
            // The point itself has height 0.
            let (sum, squares) = heights.fold((0.0, 0.0), |(sum, squares), height| {
                (sum + height, squares + height * height)
            });
            let n = (k + 1) as f32;
            ((squares - sum * sum / n).max(0.0) / n).sqrt()
        })
        .collect();
    if deviations.is_empty() {
        return 0.0;
    }
    let middle = deviations.len() / 2;
    f64::from(*deviations.select_nth_unstable_by(middle, f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Silent, shapes};

    fn vote_on(shape: &shapes::Shape, rule: SourceRule) -> (PointCloud, Vec<Vote>) {
        let cloud = PointCloud::new(DVec3::ZERO, shape.positions.clone()).unwrap();
        let neighbors = Neighbors::find(&cloud, 12, &Silent).unwrap();
        let viewpoints = viewpoints(&cloud, rule, 8);
        let votes = votes(&cloud, &neighbors, 12, &shape.normals, rule, &viewpoints, &Silent).unwrap();
        (cloud, votes)
    }

    /// The shape with every third normal turned.
    fn mixed(mut shape: shapes::Shape) -> shapes::Shape {
        for normal in shape.normals.iter_mut().step_by(3) {
            *normal = -*normal;
        }
        shape
    }

    #[test]
    fn votes_are_the_papers_sum() {
        let shape = mixed(shapes::sphere(6000));
        let (cloud, votes) = vote_on(&shape, SourceRule::HiddenPoints);
        let (min, max) = cloud.bounding_box();
        let center = 0.5 * (min + max);
        let corners = (0..8).map(|corner| {
            let side = |bit: i32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let viewpoint = center + Vec3::new(side(0), side(1), side(2)) * 0.5 * (max - min);
            (
                viewpoint,
                super::super::visible_points(&cloud, viewpoint.as_dvec3(), 0.0),
            )
        });
        let corners: Vec<_> = corners.collect();
        for (point, vote) in votes.iter().enumerate() {
            let mut expect = 0.0_f64;
            for (viewpoint, seen) in &corners {
                if seen.contains(point) {
                    // The centroid of an even sphere is 0 but for rounding.
                    let toward = -viewpoint.normalize_or_zero();
                    let angle = f64::from(shape.normals[point].dot(toward).abs().min(1.0)).acos();
                    let c = (-(angle * angle) / (std::f64::consts::PI / 6.0).powi(2)).exp();
                    expect += c * f64::from(shape.normals[point].dot(toward).signum());
                }
            }
            // The little noise that is allowed for lets a few more see the point from the side, which weighs next to nothing.
            assert!(
                (f64::from(vote.sum) - expect).abs() < 0.05,
                "{point}: {} {expect}",
                vote.sum
            );
            assert!(vote.weight >= vote.sum.abs());
        }
    }

    #[test]
    fn sources_of_closed_shapes_point_outward() {
        for shape in [shapes::sphere(3000), shapes::torus(6000), shapes::fandisk_like(8000)] {
            let shape = mixed(shape);
            let (_, votes) = vote_on(&shape, SourceRule::HiddenPointsMended);
            let sorted = SortedVotes::new(&votes, SourceRule::HiddenPointsMended);
            let found = sources(&votes, &shape.normals, &sorted, 0.07);
            assert!(found.len() > 100, "{}", found.len());
            let outward = |source: &&Source| {
                let point = source.point as usize;
                (source.normal.dot(shape.normals[point]) > 0.0) != point.is_multiple_of(3)
            };
            assert_eq!(found.iter().filter(outward).count(), found.len());
        }
    }

    #[test]
    fn the_papers_sources_are_the_two_ends() {
        let vote = |sum: f32| Vote { sum, weight: sum.abs() };
        let votes: Vec<Vote> = [-1.0, -0.95, -0.8, -0.0, 0.0, 0.4, 0.45, 0.5].map(vote).to_vec();
        let normals = vec![Vec3::Z; votes.len()];
        let sorted = SortedVotes::new(&votes, SourceRule::HiddenPoints);
        let of = |eta| -> Vec<(u32, f32)> {
            let found = sources(&votes, &normals, &sorted, eta);
            found.iter().map(|source| (source.point, source.normal.z)).collect()
        };
        assert_eq!(of(0.0), [(0, 1.0), (7, -1.0)]);
        assert_eq!(of(0.07), [(0, 1.0), (1, 1.0), (6, -1.0), (7, -1.0)]);
        // Nobody sees the points without a vote, however wide the ends are.
        assert_eq!(
            of(1.0).iter().map(|source| source.0).collect::<Vec<_>>(),
            [0, 1, 2, 5, 6, 7]
        );
    }

    #[test]
    fn mended_sources_are_a_share_of_what_is_seen() {
        let vote = |i: u16| Vote {
            sum: f32::from(i) / 100.0,
            weight: f32::from(i) / if i == 99 { 50.0 } else { 100.0 },
        };
        let votes: Vec<Vote> = (0..101).map(vote).collect();
        let normals = vec![Vec3::Z; votes.len()];
        let sorted = SortedVotes::new(&votes, SourceRule::HiddenPointsMended);
        let of = |eta| sources(&votes, &normals, &sorted, eta);
        // 100 are seen; 99 is not unanimous.
        let points: Vec<u32> = of(0.03).iter().map(|source| source.point).collect();
        assert_eq!(points, [97, 98, 100]);
        assert_eq!(of(0.0).len(), 1);
        assert_eq!(of(1.0).len(), 98);
        let silent = SortedVotes::new(&votes[..1], SourceRule::HiddenPointsMended);
        assert!(sources(&votes[..1], &normals, &silent, 0.5).is_empty());
    }

    #[test]
    fn does_not_depend_on_order_or_threads() {
        let shape = shapes::torus(3000).with_noise(0.002, 1);
        let backwards = shapes::Shape {
            positions: shape.positions.iter().rev().copied().collect(),
            normals: shape.normals.iter().rev().copied().collect(),
        };
        for rule in [SourceRule::HiddenPoints, SourceRule::HiddenPointsMended] {
            let (_, votes) = vote_on(&shape, rule);
            let (_, mut reversed) = vote_on(&backwards, rule);
            reversed.reverse();
            assert_eq!(votes, reversed);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            assert_eq!(pool.install(|| vote_on(&shape, rule)).1, votes);
        }
    }

    #[test]
    fn every_number_of_views_is_possible() {
        let cloud = PointCloud::new(DVec3::ZERO, shapes::sphere(50).positions).unwrap();
        for views in VIEWS {
            for rule in [SourceRule::HiddenPoints, SourceRule::HiddenPointsMended] {
                let viewpoints = viewpoints(&cloud, rule, views);
                assert_eq!(viewpoints.len(), views);
                let n_distinct = viewpoints
                    .iter()
                    .enumerate()
                    .filter(|(i, v)| !viewpoints[..*i].contains(v))
                    .count();
                assert_eq!(n_distinct, views);
            }
        }
    }
}
