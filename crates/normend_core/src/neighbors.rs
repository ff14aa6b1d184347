//! The k nearest points of each point, in one flat array.
//!
//! Points in one place are one neighbor: a row names the first point of each of the nearest places, so that copies neither fill rows
//! nor tear a surface apart, and a copy's row begins with the first point of its own place. More of a place are named only where
//! there are too few places.
//!
//! Invariants: rows are exact and complete in the order (distance, id), with distances as `f64` sees the
//! positions; so equal distances, points in one place, lines and planes have one right answer. Rows do not depend on
//! the number of threads.

use std::cmp::Ordering::Equal;
use std::num::NonZero;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use glam::DVec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use crate::progress::{Part, Steps};
use crate::{Cancelled, PointCloud, Progress};

/// The k-neighborhood of every point: `n × k` ids, each row ascending by distance, ties by id, never the point itself, of points in
/// one place only the first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Neighbors {
    k: usize,
    ids: Vec<u32>,
}

impl Neighbors {
    /// Finds the `k` nearest of each point exactly (fewer, `n - 1`, in a smaller cloud).
    ///
    /// O(n k log n) time, in parallel; `4 k` bytes a point for the result and about 50 more while it works.
    ///
    /// # Errors
    /// [`Cancelled`] when `progress` asks to stop; nothing else.
    pub fn find(cloud: &PointCloud, k: usize, progress: &dyn Progress) -> Result<Self, Cancelled> {
        let n_points = cloud.n_points();
        let k = k.min(n_points.saturating_sub(1));
        if k == 0 {
            return Ok(Self { k, ids: Vec::new() });
        }
        progress.report(0.0)?;
        let places = Places::new(cloud);
        progress.report(0.08)?;
        let tree = Tree::new(&places.positions);

        // Tasks follow the places, which is kind to caches; rows are in file order, so tasks write all over them.
        let rows: Vec<AtomicU32> = (0..n_points * k).map(|_| AtomicU32::new(0)).collect();
        let part = Part::new(progress, 0.15..1.0);
        let steps = Steps::new(&part, places.n());
        (0..places.n().div_ceil(PLACES)).into_par_iter().try_for_each_init(
            || Search::new(&tree, &places, k),
            |search, task| {
                let end = ((task + 1) * PLACES).min(places.n());
                for place in task * PLACES..end {
                    search.find(place);
                    for &point in places.members(place) {
                        let row = &rows[point as usize * k..(point as usize + 1) * k];
                        let others = search.found.iter().filter(|other| other.id != point);
                        for (id, other) in row.iter().zip(others) {
                            id.store(other.id, Relaxed);
                        }
                    }
                }
                steps.advance(end - task * PLACES)
            },
        )?;
        let ids = rows.into_iter().map(AtomicU32::into_inner).collect();
        Ok(Self { k, ids })
    }

    /// Length of each row.
    pub fn k(&self) -> usize {
        self.k
    }

    /// The neighbors of `point`, nearest first.
    #[inline]
    pub fn of(&self, point: usize) -> &[u32] {
        &self.ids[point * self.k..(point + 1) * self.k]
    }

    /// All rows, one after the other.
    pub fn ids(&self) -> &[u32] {
        &self.ids
    }
}

/// Point ids along a Morton curve, so that neighbors in space are near in memory; equal positions follow each other, ids
/// ascending. O(n log n), in parallel.
pub(crate) fn morton_order(cloud: &PointCloud) -> Vec<u32> {
    let (min, max) = cloud.bounding_box();
    let size = max - min;
    let cells = 2_097_151.0 / f64::from(size.max_element()).max(f64::MIN_POSITIVE);
    let positions = cloud.positions();
    let mut sorted: Vec<(u64, u32)> = positions
        .par_iter()
        .enumerate()
        .map(|(id, &position)| {
            let cell = (position - min).as_dvec3() * cells;
            (morton(cell.x as u64, cell.y as u64, cell.z as u64), id as u32)
        })
        .collect();
    // Within a cell by coordinates, so that equal positions follow each other.
    let coordinates = |id: u32| cloud.relative(id as usize);
    sorted.par_sort_unstable_by(|a, b| {
        a.0.cmp(&b.0)
            .then_with(|| compare(coordinates(a.1), coordinates(b.1)))
            .then(a.1.cmp(&b.1))
    });
    sorted.into_iter().map(|(_, id)| id).collect()
}

/// Places that one task handles at a time.
const PLACES: usize = 1024;

/// The distinct positions, along a Morton curve, and the points at each.
struct Places {
    positions: Positions,
    /// Point ids, place by place, ascending in each.
    ids: Vec<u32>,
    /// An offset into `ids` for each place, and one more.
    starts: Vec<u32>,
}

/// Positions scaled by a power of two so that squared distances stay within `f32`.
enum Positions {
    Single(Vec<[f32; 3]>),
    /// With the remainders of the cloud.
    Double(Vec<[f64; 3]>),
}

/// A kd-tree over [`Positions`].
enum Tree {
    Single(ImmutableKdTree<f32, 3>),
    Double(ImmutableKdTree<f64, 3>),
}

impl Tree {
    fn new(positions: &Positions) -> Self {
        const ANY: &str =
            "ids fit into u32, as PointCloud checks, and arena leaves hold any number of equal coordinates";
        match positions {
            Positions::Single(positions) => {
                Self::Single(ImmutableKdTree::new_from_slice_parallel(positions).expect(ANY))
            }
            Positions::Double(positions) => {
                Self::Double(ImmutableKdTree::new_from_slice_parallel(positions).expect(ANY))
            }
        }
    }

    /// Calls `visit` with each of the `count` places nearest to `place` and its squared distance.
    fn nearest(&self, positions: &Positions, place: usize, count: NonZero<usize>, mut visit: impl FnMut(u32, f64)) {
        match (self, positions) {
            (Self::Single(tree), Positions::Single(positions)) => {
                let query = tree.query(&positions[place]);
                let found = query.nearest_n::<SquaredEuclidean<f32>>(count).execute();
                found.iter().for_each(|found| visit(found.item, found.distance.into()));
            }
            (Self::Double(tree), Positions::Double(positions)) => {
                let query = tree.query(&positions[place]);
                let found = query.nearest_n::<SquaredEuclidean<f64>>(count).execute();
                found.iter().for_each(|found| visit(found.item, found.distance));
            }
            _ => unreachable!("the tree is made of these positions"),
        }
    }

    /// Calls `visit` with each place within a squared distance of `place`.
    fn within(&self, positions: &Positions, place: usize, squared_distance: f64, mut visit: impl FnMut(u32)) {
        match (self, positions) {
            (Self::Single(tree), Positions::Single(positions)) => {
                let query = tree
                    .query(&positions[place])
                    .within::<SquaredEuclidean<f32>>(squared_distance as f32);
                query.unsorted().execute().iter().for_each(|found| visit(found.item));
            }
            (Self::Double(tree), Positions::Double(positions)) => {
                let query = tree
                    .query(&positions[place])
                    .within::<SquaredEuclidean<f64>>(squared_distance);
                query.unsorted().execute().iter().for_each(|found| visit(found.item));
            }
            _ => unreachable!("the tree is made of these positions"),
        }
    }
}

impl Places {
    fn new(cloud: &PointCloud) -> Self {
        let ids = morton_order(cloud);
        let scale = power_of_two_near(cloud.diagonal()).recip();
        let mut starts = Vec::with_capacity(ids.len() + 1);
        let mut previous = DVec3::NAN;
        for (start, &id) in ids.iter().enumerate() {
            let position = cloud.relative(id as usize);
            if position != previous {
                starts.push(start as u32);
                previous = position;
            }
        }
        let firsts = starts.par_iter().map(|&start| ids[start as usize] as usize);
        let positions = if cloud.has_remainders() {
            let scale = f64::from(scale);
            Positions::Double(firsts.map(|id| (cloud.relative(id) * scale).to_array()).collect())
        } else {
            Positions::Single(firsts.map(|id| (cloud.positions()[id] * scale).to_array()).collect())
        };
        starts.push(ids.len() as u32);
        Self { positions, ids, starts }
    }

    fn n(&self) -> usize {
        self.starts.len() - 1
    }

    /// The scaled position of a place.
    fn position(&self, place: usize) -> DVec3 {
        match &self.positions {
            Positions::Single(positions) => DVec3::from_array(positions[place].map(f64::from)),
            Positions::Double(positions) => DVec3::from_array(positions[place]),
        }
    }

    /// The points at `place`, ascending.
    fn members(&self, place: usize) -> &[u32] {
        &self.ids[self.starts[place] as usize..self.starts[place + 1] as usize]
    }

    fn squared_distance(&self, a: usize, b: usize) -> f64 {
        self.position(a).distance_squared(self.position(b))
    }
}

/// A point as seen from the place searched around.
#[derive(Clone, Copy)]
struct Found {
    squared_distance: f64,
    id: u32,
}

/// Room for one thread's searches.
struct Search<'a> {
    tree: &'a Tree,
    places: &'a Places,
    k: usize,
    /// Squared distance and index of the places near the one searched around.
    near: Vec<(f64, u32)>,
    /// The first points of the nearest places, ascending by (distance, id), those searched around among them: `k + 1` or more. Others
    /// follow where there are not so many places.
    found: Vec<Found>,
}

impl<'a> Search<'a> {
    fn new(tree: &'a Tree, places: &'a Places, k: usize) -> Self {
        Self {
            tree,
            places,
            k,
            near: Vec::new(),
            found: Vec::new(),
        }
    }

    /// Fills `found` for the points at `place`.
    fn find(&mut self, place: usize) {
        let Self { tree, places, near, .. } = self;
        // One place more than k and the place itself: when that one is clearly farther, no tie was cut.
        let asked = (self.k + 2).min(places.n());
        let mut farthest = 0.0_f64;
        near.clear();
        tree.nearest(
            &places.positions,
            place,
            at_least_one(asked),
            |other, squared_distance| {
                farthest = farthest.max(squared_distance);
                near.push((places.squared_distance(place, other as usize), other));
            },
        );
        self.sort_near();
        let needed = self.needed_distance();
        let complete = asked == self.places.n() || farthest * (1.0 - ROUNDING) - UNDERFLOW > needed;
        if !complete {
            let reach = needed * (1.0 + ROUNDING) + UNDERFLOW;
            let Self { tree, places, near, .. } = self;
            near.clear();
            tree.within(&places.positions, place, reach, |other| {
                near.push((places.squared_distance(place, other as usize), other));
            });
            self.sort_near();
        }
        self.take_points(needed);
    }

    fn sort_near(&mut self) {
        self.near
            .sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    /// The squared distance within which `k + 1` places are, the one searched around among them.
    fn needed_distance(&self) -> f64 {
        let needed = self.near.get(self.k).or(self.near.last());
        needed.map_or(0.0, |needed| needed.0)
    }

    /// Fills `found` with the first points of the places of `near` up to `needed`, and with others where that is not enough: of each
    /// place the first `k + 1` are enough then.
    fn take_points(&mut self, needed: f64) {
        let by_distance =
            |a: &Found, b: &Found| a.squared_distance.total_cmp(&b.squared_distance).then(a.id.cmp(&b.id));
        let Self {
            places, near, found, k, ..
        } = self;
        let near = || near.iter().take_while(|near| near.0 <= needed);
        let member = |squared_distance| move |&id: &u32| Found { squared_distance, id };
        found.clear();
        for &(squared_distance, place) in near() {
            found.extend(places.members(place as usize).first().map(member(squared_distance)));
        }
        found.sort_unstable_by(by_distance);
        let n_places = found.len();
        if n_places <= *k {
            for &(squared_distance, place) in near() {
                let members = places.members(place as usize).iter();
                found.extend(members.skip(1).take(*k).map(member(squared_distance)));
            }
            found[n_places..].sort_unstable_by(by_distance);
        }
    }
}

/// More than the relative error of squared distances and bounds in the kd-tree's `f32` arithmetic.
const ROUNDING: f64 = 4e-6;

/// More than what squared distances lose to underflow in `f32`; positions are scaled to an extent near 1.
const UNDERFLOW: f64 = 1e-37;

fn at_least_one(count: usize) -> NonZero<usize> {
    NonZero::new(count).unwrap_or(NonZero::<usize>::MIN)
}

/// By x, then y, then z; positions are finite, and 0 equals -0.
fn compare(a: DVec3, b: DVec3) -> std::cmp::Ordering {
    let axis = |a: f64, b: f64| a.partial_cmp(&b).unwrap_or(Equal);
    axis(a.x, b.x).then(axis(a.y, b.y)).then(axis(a.z, b.z))
}

/// The largest power of two up to `length`; 1 for zero.
fn power_of_two_near(length: f32) -> f32 {
    if length > 0.0 {
        // The exponent without the mantissa.
        f32::from_bits(length.to_bits() & 0x7f80_0000)
    } else {
        1.0
    }
}

/// Interleaves the lower 21 bits of each coordinate.
fn morton(x: u64, y: u64, z: u64) -> u64 {
    let spread = |mut bits: u64| {
        bits &= 0x1f_ffff;
        bits = (bits | bits << 32) & 0x1f_0000_0000_ffff;
        bits = (bits | bits << 16) & 0x1f_0000_ff00_00ff;
        bits = (bits | bits << 8) & 0x100f_00f0_0f00_f00f;
        bits = (bits | bits << 4) & 0x10c3_0c30_c30c_30c3;
        (bits | bits << 2) & 0x1249_2492_4924_9249
    };
    spread(x) | spread(y) << 1 | spread(z) << 2
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;
    use crate::Silent;

    fn cloud(positions: Vec<Vec3>) -> PointCloud {
        PointCloud::new(DVec3::ZERO, positions).unwrap()
    }

    fn check(positions: Vec<Vec3>, k: usize) {
        let expect = brute_force(&positions, k);
        let found = Neighbors::find(&cloud(positions), k, &Silent).unwrap();
        assert_eq!(found, expect);
    }

    fn brute_force(positions: &[Vec3], k: usize) -> Neighbors {
        let k = k.min(positions.len().saturating_sub(1));
        let mut ids = Vec::new();
        for (point, position) in positions.iter().enumerate() {
            let mut others: Vec<usize> = (0..positions.len()).filter(|&other| other != point).collect();
            let distance = |other: usize| (positions[other].as_dvec3() - position.as_dvec3()).length_squared();
            // Of each place the first point, before any other.
            let is_copy = |other: usize| positions[..other].contains(&positions[other]);
            let order = |other: usize| (is_copy(other), distance(other));
            others.sort_by(|&a, &b| {
                order(a)
                    .0
                    .cmp(&order(b).0)
                    .then(order(a).1.total_cmp(&order(b).1))
                    .then(a.cmp(&b))
            });
            ids.extend(others[..k].iter().map(|&other| other as u32));
        }
        Neighbors { k, ids }
    }

    fn lattice_point() -> impl Strategy<Value = Vec3> {
        (-3_i8..3, -3_i8..3, -3_i8..3).prop_map(|(x, y, z)| Vec3::new(f32::from(x), f32::from(y), f32::from(z)))
    }

    fn any_point() -> impl Strategy<Value = Vec3> {
        (-1.0_f32..1.0, -1.0_f32..1.0, -1.0_f32..1.0).prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn scattered_points(positions in prop::collection::vec(any_point(), 0..200), k in 0_usize..20) {
            check(positions, k);
        }

        #[test]
        fn lattices_with_duplicates(positions in prop::collection::vec(lattice_point(), 0..200), k in 0_usize..20) {
            check(positions, k);
        }

        #[test]
        fn flat_and_far_away(positions in prop::collection::vec(any_point(), 0..200), k in 1_usize..12) {
            // All in one plane far from the origin, where f32 leaves few distinct coordinates.
            let positions = positions.into_iter().map(|point| Vec3::new(point.x, point.y, 0.0) + 50_000.0).collect();
            check(positions, k);
        }

        #[test]
        fn tiny_and_huge(positions in prop::collection::vec(any_point(), 2..60), exponent in -14_i32..14) {
            let scale = 10.0_f32.powi(exponent);
            check(positions.into_iter().map(|point| point * scale).collect(), 7);
        }

        #[test]
        fn clusters_below_the_resolution(positions in prop::collection::vec(any_point(), 2..80)) {
            // Squared distances within a cluster underflow in f32.
            let positions = positions
                .into_iter()
                .enumerate()
                .map(|(i, point)| if i % 2 == 0 { point * 1e-25 } else { Vec3::ONE + point })
                .collect();
            check(positions, 5);
        }
    }

    #[test]
    fn very_few_points() {
        for n_points in 0..3 {
            check(vec![Vec3::ZERO; n_points], 4);
            check((0..n_points).map(|i| Vec3::splat(i as f32)).collect(), 4);
        }
    }

    #[test]
    fn many_points_in_one_place() {
        let found = Neighbors::find(&cloud(vec![Vec3::ONE; 100_000]), 3, &Silent).unwrap();
        assert_eq!(found.of(0), [1, 2, 3]);
        assert_eq!(found.of(2), [0, 1, 3]);
        assert_eq!(found.of(99_999), [0, 1, 2]);
    }

    #[test]
    fn a_long_line() {
        let found = Neighbors::find(&cloud((0..100_000).map(|i| Vec3::X * i as f32).collect()), 4, &Silent).unwrap();
        assert_eq!(found.of(0), [1, 2, 3, 4]);
        assert_eq!(found.of(500), [499, 501, 498, 502]);
    }

    #[test]
    fn a_large_grid() {
        let side = 300_u32;
        let positions = (0..side * side)
            .map(|i| Vec3::new((i % side) as f32, (i / side) as f32, 0.0))
            .collect();
        let found = Neighbors::find(&cloud(positions), 8, &Silent).unwrap();
        let point = 100 * side + 100;
        let expect = [
            point - side,
            point - 1,
            point + 1,
            point + side,
            point - side - 1,
            point - side + 1,
            point + side - 1,
            point + side + 1,
        ];
        assert_eq!(found.of(point as usize), expect);
    }

    #[test]
    fn does_not_depend_on_threads() {
        let positions: Vec<Vec3> = (0..20_000_u64)
            .map(|i| {
                Vec3::new(
                    (i * 7919 % 101) as f32,
                    (i * 104_729 % 103) as f32,
                    (i * 1_299_709 % 7) as f32,
                )
            })
            .collect();
        let cloud = cloud(positions);
        let with_threads = |n_threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
            pool.install(|| Neighbors::find(&cloud, 9, &Silent).unwrap())
        };
        assert_eq!(with_threads(1), with_threads(4));
    }
}
