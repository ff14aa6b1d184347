//! The one place that a scan was taken from, where its points tell: how far apart they are, and that none hides another.
//!
//! A scanner sends its rays at equal angles, so points `L` away on a surface that is seen under an angle of cosine `c` are
//! about `L / √c` apart. The place from which that says most of how the spacing varies over the cloud is the scanner's, if
//! from there no surface is in front of another. Things that were sampled all around, or scanned from several places, have
//! no such place: either spacing varies otherwise, or what is farther is behind what is nearer.

use std::num::NonZero;

use glam::{DVec3, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use super::frame::Frame;
use crate::{Cancelled, Neighbors, PointCloud, Progress};

/// A place that all points were seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundStation {
    /// In the file's coordinates.
    pub position: DVec3,
    /// Share of the variance of the logarithm of the spacing that a scanner there, or a little beside, explains, up to 1.
    pub explained: f64,
    /// Share of points next to each other, as seen from the place, that are next to each other in space too, in 0..=1.
    pub seen: f64,
}

/// Points that are looked at: the explained share is exact to about 0.02 then. Clouds of fewer are no scans.
const SAMPLE: usize = 3000;

/// Points of the sample that the grid of places is tried on; the best places are tried on all.
const COARSE_SAMPLE: usize = 750;

/// Points that may hide each other: enough that gaps between them are small against what a room holds.
const CROWD: usize = 10_000;

/// The neighbor whose distance is the spacing: far enough out that single distances do not scatter much, near enough that
/// it is on the same surface.
const SPACING_NEIGHBOR: usize = 16;

/// Places of the grid along the longest half of the cloud. Where a scanner stands the explained share falls off over about
/// half the distance to the nearest surface; finer places are found by steps.
const PLACES_A_HALF: f64 = 3.0;

/// How far around the cloud the grid reaches, in halves of its longest side: cameras stand outside of what they see, about
/// as far away as it is large. From farther away, distances differ too little to tell places apart.
const REACH: f64 = 0.8;

/// How many places of the grid are refined: neighbors on the grid lead to the same place, so a few reach the best.
const N_REFINED: usize = 3;

/// Steps stop at this share of the longest half: sides do not depend on less.
const LAST_STEP: f64 = 0.01;

/// How far the place that explains most may be off, as a share of the longest half: rows of scanners are denser toward their
/// poles, which draws it there.
const DRAWN: f64 = 0.2;

/// Cosine that grazing rays count with at least, as normals are not exact: about 84°.
const LEAST_COSINE: f64 = 0.1;

/// Least share that a scanner must explain. One that explained all would have 1; measured are 0.48 to 0.92 for scans from one
/// place, and at most 0.15 for other clouds of which little is hidden.
const LEAST_EXPLAINED: f64 = 0.25;

/// Least share of neighbors in sight that are neighbors in space. Measured are 0.91 to 0.99 for scans from one place, where
/// only edges of what is in front count against it, and at most 0.73 for others that a place explains.
const LEAST_SEEN: f64 = 0.8;

/// How much less a place that sees the other sides must explain. A height field of even steps looks like a scan from far
/// above just as from far below, and so do two scans from opposite sides; those lead by at most 0.01, scans from one place by 0.13
/// and more.
const LEAST_LEAD: f64 = 0.05;

/// How much less than the best place the origin of the file may explain and still be it: many scanners measure from their
/// own place, and rings of a spinning scanner move the best place by that much.
const ORIGIN_MAY_LACK: f64 = 0.1;

/// Neighbors in sight that are compared: those around a point on a surface.
const SIGHT_NEIGHBORS: usize = 8;

/// How far neighbors in sight may be apart in space, in distances to the eighth neighbor there. Rows of a scanner on a
/// grazed floor are several points apart.
const NEAR: f32 = 4.0;

/// Columns and rows of each side of a cube around the place, in which directions without points are counted: those below a
/// tripod, 25° to each side, cover several cells.
const SKY_CELLS: usize = 8;

/// Share of neighbors in sight that are neighbors in space from which on nothing is in front of anything.
const NO_EDGES: f64 = 0.99;

/// Finds the place that all of `cloud` was scanned from; `None` where there is none, or the points do not tell.
///
/// * `neighbors` – at least 8 of each point
/// * `normals` – `n` unit normals of any sign
///
/// The place is exact to a few percent of the cloud's extent; the file's origin is taken as it is where it explains about as
/// much. The search runs on samples that do not depend on the order of points: O(n) to take them, about 50 ms for the grid, and
/// half a second to go to where most is seen, if a place is found.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub fn find_station(
    cloud: &PointCloud,
    neighbors: &Neighbors,
    normals: &[Vec3],
    progress: &dyn Progress,
) -> Result<Option<FoundStation>, Cancelled> {
    if cloud.n_points() < SAMPLE || cloud.diagonal() <= 0.0 || neighbors.k() < SIGHT_NEIGHBORS {
        return Ok(None);
    }
    let search = Search::new(cloud, neighbors, normals);
    progress.report(0.1)?;
    let Some((place, explained)) = search.best_place() else {
        return Ok(None);
    };
    progress.report(0.4)?;
    let is_origin = place == search.origin();
    let Some((place, seen)) = search.where_most_is_seen(place, is_origin) else {
        return Ok(None);
    };
    progress.report(1.0)?;
    let position = if is_origin {
        DVec3::ZERO
    } else {
        cloud.origin() + search.frame.center + search.frame.frame_from_cloud.transpose() * place
    };
    Ok(Some(FoundStation {
        position,
        explained,
        seen,
    }))
}

/// One point of the sample, in the frame.
#[derive(Clone, Copy)]
struct Sample {
    position: DVec3,
    normal: DVec3,
    log_spacing: f64,
}

/// A cloud and samples of it, in its frame.
struct Search {
    frame: Frame,
    cloud_origin: DVec3,
    /// For spacings.
    sample: Vec<Sample>,
    /// For what is in front of what.
    crowd: Crowd,
    /// Lower and upper corner in the frame, outliers left out.
    corners: [DVec3; 2],
}

impl Search {
    fn new(cloud: &PointCloud, neighbors: &Neighbors, normals: &[Vec3]) -> Self {
        let frame = Frame::of(cloud);
        let positions = cloud.positions();
        let neighbor = SPACING_NEIGHBOR.min(neighbors.k()) - 1;
        let in_frame = |id: usize| frame.frame_from_cloud * (positions[id].as_dvec3() - frame.center);
        let steps = STEPS / f64::from(cloud.diagonal());
        // A few more than needed, so that chance leaves enough.
        let limit = (1.1 * CROWD as f64 / cloud.n_points() as f64 * u64::MAX as f64) as u64;
        let mut chosen: Vec<(u64, u32)> = (0..cloud.n_points())
            .into_par_iter()
            .map(|id| (scatter(in_frame(id) * steps), id as u32))
            .filter(|&(number, _)| number <= limit)
            .collect();
        chosen.par_sort_unstable();
        let sample: Vec<Sample> = (chosen.iter())
            .filter_map(|&(_, id)| {
                let point = id as usize;
                let other = neighbors.of(point)[neighbor] as usize;
                let spacing = f64::from(cloud.offset(point, other).as_vec3().length());
                (spacing > 0.0).then(|| Sample {
                    position: in_frame(point),
                    normal: frame.frame_from_cloud * normals[point].as_dvec3(),
                    log_spacing: spacing.ln(),
                })
            })
            .take(SAMPLE)
            .collect();
        let corner = |share: f64| {
            DVec3::from_array([0, 1, 2].map(|axis| {
                let mut values: Vec<f64> = sample.iter().map(|sample| sample.position[axis]).collect();
                values.sort_unstable_by(f64::total_cmp);
                let rank = (values.len().saturating_sub(1) as f64 * share) as usize;
                values.get(rank).copied().unwrap_or(0.0)
            }))
        };
        let crowd = chosen
            .iter()
            .take(CROWD)
            .map(|&(_, id)| in_frame(id as usize).as_vec3());
        Self {
            cloud_origin: cloud.origin(),
            crowd: Crowd::new(crowd.collect()),
            corners: [corner(OUTLIERS), corner(1.0 - OUTLIERS)],
            sample,
            frame,
        }
    }

    /// The origin of the file, in the frame.
    fn origin(&self) -> DVec3 {
        self.frame.frame_from_cloud * (-self.cloud_origin - self.frame.center)
    }

    /// The place that explains most and how much, if that is enough and places on the other side do not.
    fn best_place(&self) -> Option<(DVec3, f64)> {
        let [low, high] = self.corners;
        let half = 0.5 * (high - low).max_element();
        if half <= 0.0 || self.sample.len() < SAMPLE / 2 {
            return None;
        }
        let coarse = &self.sample[..COARSE_SAMPLE];
        let step = half / PLACES_A_HALF;
        let mut grid: Vec<(DVec3, f64)> = grid(low - REACH * half, high + REACH * half, step)
            .into_par_iter()
            .map(|place| (place, explained(coarse, place)))
            .collect();
        // The sort is stable, so equal places keep their order.
        grid.sort_by(|a, b| b.1.total_cmp(&a.1));
        let starts: Vec<DVec3> = (grid.iter().take(N_REFINED))
            .map(|&(place, _)| place)
            .chain([self.origin()])
            .collect();
        let refined: Vec<(DVec3, f64)> = (starts.into_par_iter())
            .map(|start| climb(start, step, LAST_STEP * half, |place| explained(&self.sample, place)))
            .collect();
        let mut best = (refined.into_iter()).reduce(|a, b| if b.1 > a.1 { b } else { a })?;
        let at_origin = explained(&self.sample, self.origin());
        if at_origin >= best.1 - ORIGIN_MAY_LACK {
            best = (self.origin(), at_origin);
        }
        let (place, share) = best;
        if share < LEAST_EXPLAINED {
            return None;
        }
        let center = 0.5 * (low + high);
        let across = [2.0 * center - place, 3.0 * center - 2.0 * place].map(|place| (place, explained(coarse, place)));
        let rival = (grid.iter().chain(&across))
            .filter(|(other, _)| self.sees_other_sides(place, *other))
            .map(|&(_, share)| share)
            .fold(f64::NEG_INFINITY, f64::max);
        (share - rival >= LEAST_LEAD).then_some(best)
    }

    /// The place near `place`, or exactly that, from which most is seen, and how much; `None` where that is too little, or what
    /// is seen is a body: closed, and made by rays from within, it is no scan of a room.
    fn where_most_is_seen(&self, place: DVec3, exactly: bool) -> Option<(DVec3, f64)> {
        let [low, high] = self.corners;
        let half = 0.5 * (high - low).max_element();
        let seen = |place: DVec3| self.crowd.seen(place.as_vec3());
        if seen(place) < LEAST_SEEN {
            return None;
        }
        let (place, seen) = if exactly {
            (place, seen(place))
        } else {
            climb(place, DRAWN * half, LAST_STEP * half, seen)
        };
        let is_body = seen > NO_EDGES && self.crowd.is_all_around(place.as_vec3());
        (!is_body).then_some((place, seen))
    }

    /// Whether most points show different sides to two places.
    fn sees_other_sides(&self, a: DVec3, b: DVec3) -> bool {
        let n_other = (self.sample.iter())
            .filter(|sample| {
                let side = |place: DVec3| sample.normal.dot(place - sample.position) > 0.0;
                side(a) != side(b)
            })
            .count();
        2 * n_other > self.sample.len()
    }
}

/// Share of the points left out at each end of an axis: what is seen through a window does not set the grid.
const OUTLIERS: f64 = 0.01;

/// Most rounds of steps to a place.
const MAX_ROUNDS: usize = 40;

/// Cells along the diagonal that choose the sample: fine enough that few points share one, coarse enough that turning a
/// cloud in `f32` leaves most points in theirs.
const STEPS: f64 = (1 << 14) as f64;

/// A number that is as good as random but belongs to the cell of a position.
fn scatter(position: DVec3) -> u64 {
    let cell = position.floor().as_i64vec3().to_array();
    cell.iter().fold(0x9e37_79b9_7f4a_7c15, |number: u64, &axis| {
        let mixed = (number ^ axis as u64).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed ^ mixed >> 29)
            .wrapping_mul(0x94d0_49bb_1331_11eb)
            .rotate_left(31)
    })
}

/// Goes from `start` to a place whose neighboring places have no larger `value`, by steps that become smaller.
fn climb(start: DVec3, first_step: f64, last_step: f64, value: impl Fn(DVec3) -> f64 + Sync) -> (DVec3, f64) {
    let mut best = (start, value(start));
    let mut step = first_step;
    // Each round comes nearer or halves the step; the count ends walks to infinity.
    for _ in 0..MAX_ROUNDS {
        let values: Vec<(DVec3, f64)> = (around(best.0, step).into_par_iter())
            .map(|place| (place, value(place)))
            .collect();
        let next = values.into_iter().fold(best, |a, b| if b.1 > a.1 { b } else { a });
        if next.1 > best.1 {
            best = next;
        } else if step <= last_step {
            break;
        } else {
            step *= 0.5;
        }
    }
    best
}

/// Places between two corners, `step` apart.
fn grid(low: DVec3, high: DVec3, step: f64) -> Vec<DVec3> {
    let count = ((high - low) / step).as_usizevec3() + 1;
    let start = 0.5 * (low + high - step * (count - 1).as_dvec3());
    (0..count.x * count.y * count.z)
        .map(|i| {
            let cell = DVec3::new(
                (i % count.x) as f64,
                (i / count.x % count.y) as f64,
                (i / count.x / count.y) as f64,
            );
            start + step * cell
        })
        .collect()
}

/// The places a step away along the axes and the diagonals.
fn around(place: DVec3, step: f64) -> Vec<DVec3> {
    (0..27)
        .map(|i| DVec3::new((i % 3) as f64, (i / 3 % 3) as f64, (i / 9) as f64) - 1.0)
        .filter(|offset| offset.abs().element_sum() % 2.0 == 1.0)
        .map(|offset| place + step * offset)
        .collect()
}

/// The share of the variance of the logarithm of the spacing that a scanner at `place` explains: 1 less that of what is left,
/// the logarithm of the angle between rays.
fn explained(sample: &[Sample], place: DVec3) -> f64 {
    let mut left = Variance::default();
    let mut whole = Variance::default();
    for sample in sample {
        let ray = sample.position - place;
        let squared = ray.length_squared().max(f64::MIN_POSITIVE);
        let length = squared.sqrt();
        let cosine = (ray.dot(sample.normal).abs() / length).max(LEAST_COSINE);
        // ln(L / √c), with a single logarithm.
        left.add(sample.log_spacing - 0.5 * (squared / cosine).ln());
        whole.add(sample.log_spacing);
    }
    1.0 - left.value() / whole.value().max(f64::MIN_POSITIVE)
}

#[derive(Default)]
struct Variance {
    n: f64,
    sum: f64,
    squares: f64,
}

impl Variance {
    fn add(&mut self, value: f64) {
        self.n += 1.0;
        self.sum += value;
        self.squares += value * value;
    }

    fn value(&self) -> f64 {
        let mean = self.sum / self.n.max(1.0);
        self.squares / self.n.max(1.0) - mean * mean
    }
}

/// Points that may hide each other.
struct Crowd {
    positions: Vec<Vec3>,
    /// How far from each of the first points others are next to it.
    reaches: Vec<f32>,
}

type Tree = ImmutableKdTree<f32, 3>;

impl Crowd {
    fn new(positions: Vec<Vec3>) -> Self {
        let places: Vec<[f32; 3]> = positions.iter().map(Vec3::to_array).collect();
        let tree = tree_of(&places);
        let reach = |place: &[f32; 3]| {
            let farthest = nearest(&tree, place).map(|(_, squared)| squared).fold(0.0, f32::max);
            NEAR * farthest.sqrt()
        };
        let reaches = places[..places.len().min(SAMPLE)].par_iter().map(reach).collect();
        Self { positions, reaches }
    }

    /// Share of neighbors in sight from `place` that are neighbors in space.
    fn seen(&self, place: Vec3) -> f64 {
        let directions: Vec<[f32; 3]> = (self.positions.iter())
            .map(|&position| (position - place).normalize_or_zero().to_array())
            .collect();
        let tree = tree_of(&directions);
        let n_near: usize = (self.reaches.iter().enumerate())
            .map(|(point, &reach)| {
                nearest(&tree, &directions[point])
                    .filter(|&(other, _)| {
                        other != point && self.positions[other].distance(self.positions[point]) <= reach
                    })
                    .count()
                    .min(SIGHT_NEIGHBORS)
            })
            .sum();
        n_near as f64 / (SIGHT_NEIGHBORS * self.reaches.len()).max(1) as f64
    }

    /// Whether there are points in all directions from `place`.
    fn is_all_around(&self, place: Vec3) -> bool {
        let mut found = [false; 6 * SKY_CELLS * SKY_CELLS];
        for &position in &self.positions {
            let direction = position - place;
            let side = direction.abs().max_position();
            let [u, v] = [1, 2].map(|next| {
                let across = direction[(side + next) % 3] / direction[side].abs().max(f32::MIN_POSITIVE);
                ((0.5 * (across + 1.0) * SKY_CELLS as f32) as usize).min(SKY_CELLS - 1)
            });
            let side = 2 * side + usize::from(direction[side] > 0.0);
            found[(side * SKY_CELLS + u) * SKY_CELLS + v] = true;
        }
        found.iter().all(|&found| found)
    }
}

fn tree_of(places: &[[f32; 3]]) -> Tree {
    Tree::new_from_slice(places)
        .expect("a crowd is counted in u32, and arena leaves hold any number of equal coordinates")
}

/// Index and squared distance of the places nearest to `place`, itself and [`SIGHT_NEIGHBORS`].
fn nearest(tree: &Tree, place: &[f32; 3]) -> impl Iterator<Item = (usize, f32)> {
    const COUNT: NonZero<usize> = NonZero::new(SIGHT_NEIGHBORS + 1).expect("one more than some");
    tree.query(place)
        .nearest_n::<SquaredEuclidean<f32>>(COUNT)
        .execute()
        .into_iter()
        .map(|result| (result.item as usize, result.distance))
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, dvec3};

    use super::*;
    use crate::shapes::{self, Shape, benchmark_clouds};
    use crate::{Estimator, Silent, normals};

    fn find(positions: Vec<Vec3>) -> Option<FoundStation> {
        let cloud = PointCloud::new(DVec3::ZERO, positions).unwrap();
        let neighbors = Neighbors::find(&cloud, SPACING_NEIGHBOR, &Silent).unwrap();
        let normals = normals::estimate(&cloud, &neighbors, 12, Estimator::Pca, &Silent).unwrap();
        find_station(&cloud, &neighbors, &normals, &Silent).unwrap()
    }

    fn benchmark(name: &str) -> Shape {
        let clouds = benchmark_clouds();
        let cloud = clouds.iter().find(|cloud| cloud.name == name).unwrap();
        cloud.generate(&Silent).unwrap().shape
    }

    /// Where the benchmark's scanner stands.
    const OFFICE_STATION: DVec3 = dvec3(-0.35, -0.3, -0.05);

    #[test]
    fn the_place_in_a_room_is_found_however_it_lies() {
        let office = benchmark("room_office_1_station").positions;
        for (turn, scale) in [(0.0, 1.0), (0.0, 1024.0), (1.0, 0.3), (4.0, 7.0)] {
            let rotation = DMat3::from_rotation_z(turn) * DMat3::from_rotation_x(0.5 * turn);
            let place = |position: DVec3| scale * (rotation * position);
            let found = find(office.iter().map(|p| place(p.as_dvec3()).as_vec3()).collect()).unwrap();
            let off = found.position.distance(place(OFFICE_STATION)) / scale;
            assert!(off < 0.15, "turned by {turn}, scaled by {scale}: off by {off}");
        }
    }

    #[test]
    fn the_order_of_points_and_the_number_of_threads_do_not_matter() {
        let mut positions = benchmark("room_office_1_station").positions;
        let found = find(positions.clone());
        positions.reverse();
        assert_eq!(find(positions.clone()), found);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(pool.install(|| find(positions)), found);
    }

    #[test]
    fn things_were_not_scanned_from_one_place() {
        let mut shapes: Vec<(&str, Shape)> = vec![
            ("sphere", shapes::sphere(8000)),
            ("torus", shapes::torus(8000)),
            ("fandisk", shapes::fandisk_like(8000)),
            ("few points", shapes::sphere(SAMPLE - 1)),
        ];
        let names = [
            "bracket_clusters",
            "animal_falloff",
            "figure_gradient",
            "torus_falloff",
            "figure_front_back",
            "bowl",
            "hills",
            "half_sphere",
        ];
        shapes.extend(names.map(|name| (name, benchmark(name))));
        for (name, shape) in shapes {
            assert_eq!(find(shape.positions), None, "{name}");
        }
    }

    /// Points where even rays from the origin meet the body of a bumpy ball; `hole` leaves out those below.
    fn bumpy_ball(hole: bool) -> Vec<Vec3> {
        let directions = shapes::sphere(20_000).positions;
        let radius = |d: Vec3| 1.0 + 0.35 * (5.0 * d.x).sin() * (4.0 * d.y + 1.0).cos();
        let kept = directions.into_iter().filter(|d| !hole || d.z > -0.8);
        kept.map(|d| radius(d) * d).collect()
    }

    #[test]
    fn a_body_made_by_rays_from_within_is_no_room() {
        assert!(find(bumpy_ball(true)).is_some());
        assert_eq!(find(bumpy_ball(false)), None);
    }

    #[test]
    fn clouds_without_extent_have_no_place() {
        for positions in [vec![Vec3::ONE; 5000], Vec::new()] {
            assert_eq!(find(positions), None);
        }
        let line = (0..5000).map(|i| Vec3::X * i as f32).collect();
        assert_eq!(find(line), None);
    }
}
