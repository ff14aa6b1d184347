//! Wrong normals against a reference.

use fixedbitset::FixedBitSet;
use glam::Vec3;
use rayon::prelude::*;

use crate::progress::Part;
use crate::{Cancelled, EdgeRule, Neighbors, PointCloud, Progress, RiemannianGraph, SpanningTree};

/// How many normals point to the wrong side. A point whose reference normal is zero is not judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Points whose reference normal is not zero.
    pub n_judged: usize,
    /// `dot < 0`, or no normal (zero or not finite).
    pub n_wrong: usize,
    /// The same when the whole cloud may be flipped, whichever is better.
    pub n_wrong_global_flip: usize,
    /// The same when each connected component of the symmetric k = 10 graph may be flipped.
    pub n_wrong_component_flip: usize,
    /// Number of those components.
    pub n_components: usize,
    /// Points of the result without a normal.
    pub n_undefined: usize,
    /// Mean angle between the normals' lines, in radians, over judged points with a normal; NaN when there are none.
    pub mean_unsigned_angle: f64,
    /// By point: judged wrong as is.
    pub wrong: FixedBitSet,
}

/// Neighbors of each point in the graph whose components may be flipped, and in which wrong regions are connected.
pub const K: usize = 10;

/// Vectors shorter than this are no reference.
const SHORTEST_REFERENCE: f64 = 1e-6;

/// Vectors shorter than this are no normal.
const SHORTEST_NORMAL: f64 = 1e-12;

/// Compares `result` with `reference` (both `n`, by point of `cloud`, of any length).
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub fn compare(
    cloud: &PointCloud,
    reference: &[Vec3],
    result: &[Vec3],
    progress: &dyn Progress,
) -> Result<Comparison, Cancelled> {
    let verdicts: Vec<Verdict> = (reference, result)
        .into_par_iter()
        .map(|(a, b)| Verdict::of(*a, *b))
        .collect();
    let neighbors = Neighbors::find(cloud, K, &Part::new(progress, 0.0..0.8))?;
    let components = components(cloud, &neighbors, &Part::new(progress, 0.8..1.0))?;

    let mut comparison = Comparison {
        n_judged: 0,
        n_wrong: 0,
        n_wrong_global_flip: 0,
        n_wrong_component_flip: 0,
        n_components: components.roots().len(),
        n_undefined: 0,
        mean_unsigned_angle: f64::NAN,
        wrong: FixedBitSet::with_capacity(verdicts.len()),
    };
    let mut wrong_when_flipped = 0;
    let mut angles = 0.0;
    let mut n_angles = 0_usize;
    for (point, verdict) in verdicts.iter().enumerate() {
        comparison.n_judged += usize::from(verdict.judged);
        comparison.n_undefined += usize::from(verdict.undefined);
        comparison.n_wrong += usize::from(verdict.wrong());
        comparison.wrong.set(point, verdict.wrong());
        wrong_when_flipped += usize::from(verdict.wrong_when_flipped());
        if verdict.judged && !verdict.undefined {
            angles += verdict.unsigned_angle;
            n_angles += 1;
        }
    }
    comparison.n_wrong_global_flip = comparison.n_wrong.min(wrong_when_flipped);
    for &root in components.roots() {
        let range = components.subtree(root);
        let points = || {
            range
                .clone()
                .map(|position| &verdicts[components.order()[position as usize] as usize])
        };
        let wrong = points().filter(|verdict| verdict.wrong()).count();
        comparison.n_wrong_component_flip += wrong.min(points().filter(|verdict| verdict.wrong_when_flipped()).count());
    }
    if n_angles > 0 {
        comparison.mean_unsigned_angle = angles / n_angles as f64;
    }
    Ok(comparison)
}

/// The connected components of `wrong` points in the symmetric graph of the first [`K`] of `neighbors`: the patches that a
/// user would see and mend.
///
/// Largest first, of equal ones that with the smallest id; ids ascend in each. O(n + K w) for w wrong points.
pub fn wrong_regions(neighbors: &Neighbors, wrong: &FixedBitSet) -> Vec<Vec<u32>> {
    // A forest over the wrong points; each root is the smallest id of its tree.
    let mut parents: Vec<u32> = (0..wrong.len() as u32).collect();
    for point in wrong.ones() {
        let row = neighbors.of(point);
        for &neighbor in &row[..K.min(row.len())] {
            if wrong.contains(neighbor as usize) {
                let (a, b) = (root_of(&mut parents, point as u32), root_of(&mut parents, neighbor));
                parents[a.max(b) as usize] = a.min(b);
            }
        }
    }
    let mut region_of_root = vec![usize::MAX; wrong.len()];
    let mut regions: Vec<Vec<u32>> = Vec::new();
    for point in wrong.ones() {
        let root = root_of(&mut parents, point as u32) as usize;
        if root == point {
            region_of_root[root] = regions.len();
            regions.push(Vec::new());
        }
        regions[region_of_root[root]].push(point as u32);
    }
    // Regions were made in the order of their smallest ids, and the sort keeps that of equal ones.
    regions.sort_by_key(|region| std::cmp::Reverse(region.len()));
    regions
}

/// The root of a point's tree; halves the way there for the next time.
fn root_of(parents: &mut [u32], mut point: u32) -> u32 {
    while parents[point as usize] != point {
        let above = parents[parents[point as usize] as usize];
        parents[point as usize] = above;
        point = above;
    }
    point
}

/// How the normal of one point compares with its reference.
pub(crate) struct Verdict {
    judged: bool,
    undefined: bool,
    dot: f64,
    /// Radians, 0 when undefined.
    unsigned_angle: f64,
}

impl Verdict {
    pub(crate) fn of(reference: Vec3, normal: Vec3) -> Self {
        let (reference, normal) = (reference.as_dvec3(), normal.as_dvec3());
        let judged = reference.is_finite() && reference.length() > SHORTEST_REFERENCE;
        let undefined = !normal.is_finite() || normal.length() < SHORTEST_NORMAL;
        if undefined || !judged {
            return Self {
                judged,
                undefined,
                dot: 0.0,
                unsigned_angle: 0.0,
            };
        }
        let dot = reference.dot(normal);
        Self {
            judged,
            undefined,
            dot,
            unsigned_angle: reference.cross(normal).length().atan2(dot.abs()),
        }
    }

    /// Whether the reference says anything.
    pub(crate) fn judged(&self) -> bool {
        self.judged
    }

    pub(crate) fn wrong(&self) -> bool {
        self.judged && (self.undefined || self.dot < 0.0)
    }

    pub(crate) fn wrong_when_flipped(&self) -> bool {
        self.judged && (self.undefined || self.dot > 0.0)
    }
}

/// The components of the symmetric graph, as the trees of a spanning forest.
pub(crate) fn components(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    progress: &dyn Progress,
) -> Result<SpanningTree, Cancelled> {
    // Only connection counts: with equal normals all weights are 0.
    let normals = vec![Vec3::Z; cloud.n_points()];
    let graph = RiemannianGraph::new(
        cloud,
        neighbors,
        K,
        &normals,
        EdgeRule::Dot,
        &Part::new(progress, 0.0..0.3),
    )?;
    SpanningTree::new(&graph, &Part::new(progress, 0.3..1.0))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::Silent;

    /// Two separate lines of 30 points each, all references +z.
    fn two_lines() -> (PointCloud, Vec<Vec3>) {
        let positions = (0..60)
            .map(|i| Vec3::new((i % 30) as f32, (i / 30) as f32 * 1000.0, 0.0))
            .collect();
        (PointCloud::new(DVec3::ZERO, positions).unwrap(), vec![Vec3::Z; 60])
    }

    #[test]
    fn counts_wrong_undefined_and_unjudged() {
        let (cloud, mut reference) = two_lines();
        let mut result = reference.clone();
        // The whole first line and two points of the second; one of its points has no normal; one is not judged.
        for normal in &mut result[..32] {
            *normal = Vec3::NEG_Z * 3.0;
        }
        result[40] = Vec3::new(f32::NAN, 0.0, 0.0);
        result[41] = Vec3::X;
        result[42] = Vec3::new(0.0, 1.0, 1.0);
        reference[50] = Vec3::ZERO;
        let comparison = compare(&cloud, &reference, &result, &Silent).unwrap();
        assert_eq!(comparison.n_judged, 59);
        assert_eq!(comparison.n_components, 2);
        assert_eq!(comparison.n_undefined, 1);
        assert_eq!(comparison.n_wrong, 33);
        // Flipped, the points at right angles are right and the undefined one stays wrong.
        assert_eq!(comparison.n_wrong_global_flip, 59 - 32 - 1);
        assert_eq!(comparison.n_wrong_component_flip, 3);
        assert_eq!(comparison.wrong.ones().collect::<Vec<_>>()[30..], [30, 31, 40]);
        let expect = (std::f64::consts::FRAC_PI_2 + std::f64::consts::FRAC_PI_4) / 58.0;
        assert!((comparison.mean_unsigned_angle - expect).abs() < 1e-6);
    }

    #[test]
    fn nothing_to_judge() {
        let (cloud, reference) = two_lines();
        let none = vec![Vec3::ZERO; 60];
        let comparison = compare(&cloud, &none, &reference, &Silent).unwrap();
        assert_eq!((comparison.n_judged, comparison.n_wrong), (0, 0));
        assert!(comparison.mean_unsigned_angle.is_nan());
        let comparison = compare(&cloud, &reference, &none, &Silent).unwrap();
        assert_eq!(
            (
                comparison.n_wrong,
                comparison.n_wrong_component_flip,
                comparison.n_undefined
            ),
            (60, 60, 60)
        );
    }

    #[test]
    fn wrong_regions_are_connected_through_wrong_points_only() {
        let (cloud, _) = two_lines();
        let neighbors = Neighbors::find(&cloud, K, &Silent).unwrap();
        let check = |wrong: &[u32], expect: &[&[u32]]| {
            let wrong: FixedBitSet = wrong.iter().map(|&point| point as usize).collect();
            let mut all = FixedBitSet::with_capacity(60);
            all.union_with(&wrong);
            assert_eq!(wrong_regions(&neighbors, &all), expect);
        };
        check(&[], &[]);
        // Points in the middle of a line are neighbors up to 5 apart; the lines are not connected.
        check(&[8, 12, 20, 45], &[&[8, 12], &[20], &[45]]);
        check(&[8, 14, 40, 41, 42], &[&[40, 41, 42], &[8], &[14]]);
        // The end of a line has the next 10 as neighbors; the other direction counts as well.
        check(&[0, 10, 3, 33], &[&[0, 3, 10], &[33]]);
    }

    #[test]
    fn no_points() {
        let cloud = PointCloud::new(DVec3::ZERO, Vec::new()).unwrap();
        let comparison = compare(&cloud, &[], &[], &Silent).unwrap();
        assert_eq!((comparison.n_judged, comparison.n_components), (0, 0));
    }
}
