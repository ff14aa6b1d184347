//! The benchmark set: clouds of every kind that is hard to orient, made from functions, so that no method is tuned to files.

use glam::{DVec3, Vec3, dvec3};

use super::Shape;
use super::bodies::*;
use super::random::Random;
use super::rays::{Body, Density, Sample, Spread};
use super::scanner::{self, Errors, Stations};
use crate::evidence::Station;
use crate::{Cancelled, Neighbors, PointCloud, Progress};

/// A cloud of the benchmark set: a recipe, and the same points every time.
#[derive(Clone)]
pub struct BenchmarkCloud {
    /// The kind of difficulty: `sharp`, `close_sheets`, `high_genus`, `noise`, `nonuniform`, `open` or `scan`.
    pub class: &'static str,
    /// Unlike that of every other cloud of the class.
    pub name: &'static str,
    body: fn() -> Body,
    n_points: usize,
    spread: Spread,
    wear: Wear,
}

/// What is done to the points of a cloud.
#[derive(Clone, Copy)]
enum Wear {
    /// Nothing.
    None,
    /// Gaussian noise with this standard deviation on each axis, in mean distances to the 6 nearest neighbors.
    Gaussian(f64),
    /// Each point goes this share of the bounding box's diagonal in a random direction (Liu et al., Fig. 12).
    Displaced(f64),
    /// Other densities in other places.
    Density(Density),
    /// Seen by a scanner.
    Scanned(Stations, Errors),
}

/// A made cloud.
#[derive(Clone, Debug, PartialEq)]
pub struct BenchmarkPoints {
    /// Positions, with the exact outward normals of the places where the points were before noise.
    pub shape: Shape,
    /// Who saw which points; empty where there was no scanner.
    pub stations: Vec<Station>,
}

/// Neighbors in the spacing that noise is measured in (Metzer et al. and others take the nearest few).
const NOISE_NEIGHBORS: usize = 6;

impl BenchmarkCloud {
    /// Makes the cloud; two runs give the same points, with any number of threads. About 0.1 ms a point.
    ///
    /// # Errors
    /// [`Cancelled`] when `progress` asks to stop; nothing else.
    pub fn generate(&self, progress: &dyn Progress) -> Result<BenchmarkPoints, Cancelled> {
        progress.report(0.0)?;
        let (body, seed) = ((self.body)(), self.seed());
        let (samples, stations) = match self.wear {
            Wear::Scanned(stations, errors) => scanner::scan(&body, stations, self.n_points, errors, seed),
            _ => (self.sample(&body, self.n_points), Vec::new()),
        };
        let shape = match self.wear {
            Wear::Gaussian(share) => {
                let shape = to_shape(&samples);
                let length = share as f32 * mean_spacing(&shape.positions, progress)?;
                moved(shape, seed, |random| {
                    length * Vec3::new(random.gaussian(), random.gaussian(), random.gaussian())
                })
            }
            Wear::Displaced(share) => {
                let shape = to_shape(&samples);
                let length = share as f32 * diagonal(&shape.positions);
                moved(shape, seed, |random| length * random.direction().as_vec3())
            }
            Wear::None | Wear::Density(_) | Wear::Scanned(..) => to_shape(&samples),
        };
        progress.report(1.0)?;
        Ok(BenchmarkPoints { shape, stations })
    }

    fn sample(&self, body: &Body, n_points: usize) -> Vec<Sample> {
        let density = match self.wear {
            Wear::Density(density) => Some(density),
            _ => None,
        };
        body.sample(n_points, self.spread, density, self.seed())
    }

    /// From the name, so that a new cloud in the table changes no other (FNV-1a).
    fn seed(&self) -> u64 {
        let bytes = self.class.bytes().chain(self.name.bytes());
        bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
        })
    }
}

fn to_shape(samples: &[Sample]) -> Shape {
    let (positions, normals) = samples
        .iter()
        .map(|(position, normal)| (position.as_vec3(), normal.as_vec3()))
        .unzip();
    Shape { positions, normals }
}

fn moved(mut shape: Shape, seed: u64, mut step: impl FnMut(&mut Random) -> Vec3) -> Shape {
    // Not the numbers that the points were made with.
    let mut random = Random::new(!seed);
    for position in &mut shape.positions {
        *position += step(&mut random);
    }
    shape
}

fn diagonal(positions: &[Vec3]) -> f32 {
    let low = positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    if positions.is_empty() { 0.0 } else { low.distance(high) }
}

/// The mean distance of a point to its six nearest.
fn mean_spacing(positions: &[Vec3], progress: &dyn Progress) -> Result<f32, Cancelled> {
    // Made clouds are small and finite, which is all that a cloud asks for.
    let Ok(cloud) = PointCloud::new(DVec3::ZERO, positions.to_vec()) else {
        return Ok(0.0);
    };
    let neighbors = Neighbors::find(&cloud, NOISE_NEIGHBORS, progress)?;
    let (mut sum, mut count) = (0.0, 0_usize);
    for (point, position) in positions.iter().enumerate() {
        for &neighbor in neighbors.of(point) {
            sum += f64::from(position.distance(positions[neighbor as usize]));
            count += 1;
        }
    }
    Ok((sum / count.max(1) as f64) as f32)
}

/// 1 in the middle of a few round places, and 1/30 between them.
fn clusters(p: DVec3) -> f64 {
    let centers = [dvec3(0.6, 0.2, 0.3), dvec3(-0.5, 0.1, -0.4), dvec3(0.0, -0.1, 0.8)];
    let nearest = centers.iter().map(|c| c.distance(p)).fold(f64::INFINITY, f64::min);
    1.0 / 30.0 + (1.0 - 1.0 / 30.0) * (-(nearest / 0.25).powi(2)).exp()
}

/// From 1 to 1/40 along a slanted axis.
fn gradient(p: DVec3) -> f64 {
    let along = (0.5 + 0.45 * p.dot(dvec3(0.6, 0.3, 0.74))).clamp(0.0, 1.0);
    40.0_f64.powf(-along)
}

/// Strips of 1 and 1/17, as a scanner of lines leaves them.
fn stripes(p: DVec3) -> f64 {
    if (9.0 * (p.z + 0.3 * p.x)).rem_euclid(2.0) < 1.0 {
        1.0
    } else {
        1.0 / 17.0
    }
}

/// With the square of the distance from a place beside, as of a scanner.
fn falloff(p: DVec3) -> f64 {
    let distance = p.distance(dvec3(1.2, 0.6, 0.7));
    (0.3 / distance).powi(2).min(1.0)
}

/// As exact as a good scanner of things.
const FINE: Errors = Errors {
    range: 0.0005,
    registration: 0.001,
};
/// As exact as a cheap one.
const COARSE: Errors = Errors {
    range: 0.001,
    registration: 0.002,
};

/// Head-high places in the free space of the rooms.
const OFFICE_STATIONS: [DVec3; 1] = [dvec3(-0.35, -0.3, -0.05)];
const HALL_STATIONS: [DVec3; 2] = [dvec3(-0.4, 0.2, 0.0), dvec3(0.4, -0.4, 0.0)];

/// All clouds of the set, class by class.
pub fn benchmark_clouds() -> Vec<BenchmarkCloud> {
    use Spread::{Lattice, Poisson, Random};
    let cloud = |class, name, body, n_points, spread, wear| BenchmarkCloud {
        class,
        name,
        body,
        n_points,
        spread,
        wear,
    };
    let exact = |class, name, body, n_points, spread| cloud(class, name, body, n_points, spread, Wear::None);
    let sharp = |name, body, n_points, spread| exact("sharp", name, body, n_points, spread);
    let sheets = |name, body, n_points, spread| exact("close_sheets", name, body, n_points, spread);
    let genus = |name, body, n_points, spread| exact("high_genus", name, body, n_points, spread);
    let noise = |name, body, n_points, wear| cloud("noise", name, body, n_points, Poisson, wear);
    let density = |name, body, n_points, spread, density| {
        cloud("nonuniform", name, body, n_points, spread, Wear::Density(density))
    };
    let open = |name, body, n_points, spread| exact("open", name, body, n_points, spread);
    let scan = |name, body, n_points, stations, errors| {
        cloud("scan", name, body, n_points, Random, Wear::Scanned(stations, errors))
    };
    let gaussian = Wear::Gaussian;
    vec![
        sharp("gear_wheel_17", || gear_wheel(17, 5), 16_000, Poisson),
        sharp("gear_wheel_30", || gear_wheel(30, 7), 24_000, Random),
        sharp("angle_bracket", angle_bracket, 14_000, Poisson),
        sharp("hexagon_prism", || polygon_prism(6, 0.9), 7_000, Lattice),
        sharp("triangle_prism", || polygon_prism(3, 0.35), 5_000, Random),
        sharp("star_5", || star_prism(5, 0.36, 0.5), 9_000, Poisson),
        sharp("star_11", || star_prism(11, 0.6, 0.4), 14_000, Lattice),
        sharp("wedge_5", || wedge(5.0), 12_000, Poisson),
        sharp("wedge_15", || wedge(15.0), 8_000, Random),
        sharp("drilled_block", drilled_block, 18_000, Poisson),
        sharp("octahedron_lattice", octahedron, 6_000, Lattice),
        sharp("double_cone", double_cone, 8_000, Poisson),
        sharp("stepped_shaft", stepped_shaft, 15_000, Random),
        sharp("chamfered_part", chamfered_part, 13_000, Lattice),
        sheets("book_9", || book(9, 2.6, 0.22, 0.034), 30_000, Poisson),
        sheets("book_16_tight", || book(16, 4.2, 0.18, 0.026), 40_000, Poisson),
        sheets("impeller_7", || impeller(7, 0.02, 1.1, 0.9, false), 30_000, Poisson),
        sheets("turbine_12", || impeller(12, 0.025, 1.4, 0.0, true), 36_000, Random),
        sheets("heat_sink_9", || heat_sink(4, 0.16, 0.045), 30_000, Poisson),
        sheets("heat_sink_13", || heat_sink(6, 0.12, 0.032), 36_000, Lattice),
        sheets(
            "plate_stack",
            || plate_stack([0.03, 0.04, 0.05, 0.06, 0.08], 0.05),
            24_000,
            Poisson,
        ),
        sheets(
            "nested_tubes",
            || nested_tubes([0.3, 0.44, 0.56, 0.66], 0.055),
            32_000,
            Poisson,
        ),
        sheets(
            "nested_shells",
            || nested_shells([0.95, 0.82, 0.55], 0.06),
            34_000,
            Random,
        ),
        sheets("rolled_sheet", || rolled_sheet(0.11, 4.5, 0.05), 30_000, Poisson),
        sheets("crossing_plates_4", || crossing_plates(4, 0.035), 26_000, Random),
        sheets("mug", || mug(0.05), 14_000, Poisson),
        sheets("plant", || plant(6, 0.025), 14_000, Poisson),
        sheets("gear_pair", || gear_pair(13), 18_000, Poisson),
        genus("frame_2", || frame(2, 0.09), 16_000, Poisson),
        genus("frame_5", || frame(5, 0.06), 40_000, Random),
        genus("ball_lattice", ball_lattice, 26_000, Poisson),
        genus(
            "perforated_plate",
            || perforated_plate([3.0, 2.0], 0.26, 0.09, 0.08),
            20_000,
            Lattice,
        ),
        genus("perforated_shell", || perforated_shell(50, 0.14, 0.06), 26_000, Poisson),
        genus("gyroid_slab", gyroid_slab, 30_000, Poisson),
        genus("schwarz_ball", schwarz_ball, 20_000, Lattice),
        genus("knot_2_5", || torus_knot(2, 5, 0.1), 14_000, Poisson),
        genus("knot_3_7", || torus_knot(3, 7, 0.085), 18_000, Random),
        genus("chain_7", || chain(7), 15_000, Poisson),
        genus("linked_rings", linked_rings, 9_000, Random),
        genus("storeys", storeys, 24_000, Poisson),
        noise("figure_g30", figure, 12_000, gaussian(0.3)),
        noise("figure_g40", figure, 12_000, gaussian(0.4)),
        noise("figure_g50", figure, 12_000, gaussian(0.5)),
        noise("animal_g30", animal, 9_000, gaussian(0.3)),
        noise("animal_g50", animal, 16_000, gaussian(0.5)),
        noise("shaft_g30", stepped_shaft, 12_000, gaussian(0.3)),
        noise("bracket_g40", angle_bracket, 20_000, gaussian(0.4)),
        noise("star_g40", || star_prism(5, 0.4, 0.6), 8_000, gaussian(0.4)),
        noise("block_g50", drilled_block, 20_000, gaussian(0.5)),
        noise("torus_g50", ring_torus, 7_000, gaussian(0.5)),
        noise("frame_g30", || frame(2, 0.16), 18_000, gaussian(0.3)),
        noise("animal_d05", animal, 10_000, Wear::Displaced(0.005)),
        noise("gear_d05", || gear_wheel(11, 3), 16_000, Wear::Displaced(0.005)),
        noise("block_d10", drilled_block, 12_000, Wear::Displaced(0.01)),
        density("figure_clusters", figure, 12_000, Random, clusters),
        density("figure_gradient", figure, 8_000, Poisson, gradient),
        density("animal_stripes", animal, 16_000, Random, stripes),
        density("animal_falloff", animal, 14_000, Poisson, falloff),
        density("bracket_clusters", angle_bracket, 16_000, Random, clusters),
        density("knot_gradient", || torus_knot(2, 3, 0.12), 12_000, Random, gradient),
        density("shaft_stripes", stepped_shaft, 14_000, Poisson, stripes),
        density("torus_falloff", ring_torus, 6_000, Random, falloff),
        open("figure_holes", || with_holes(figure(), 9, 0.1), 12_000, Poisson),
        open("animal_holes", || with_holes(animal(), 7, 0.13), 11_000, Random),
        open("half_sphere", half_sphere, 6_000, Lattice),
        open("bowl", bowl, 8_000, Poisson),
        open("mask", mask, 14_000, Poisson),
        open("hills", hills, 15_000, Lattice),
        open("open_pipe", open_pipe, 8_000, Random),
        open("saddle", saddle, 7_000, Poisson),
        open("bottomless_block", bottomless, 12_000, Poisson),
        scan("bracket_6_stations", angle_bracket, 30_000, Stations::Around(6), FINE),
        scan("animal_5_stations", animal, 26_000, Stations::Around(5), COARSE),
        scan(
            "gear_8_stations",
            || gear_wheel(17, 5),
            34_000,
            Stations::Around(8),
            FINE,
        ),
        scan("mug_7_stations", || mug(0.06), 30_000, Stations::Around(7), COARSE),
        scan("figure_front_back", figure, 12_000, Stations::FrontAndBack, COARSE),
        scan(
            "room_office_1_station",
            office,
            24_000,
            Stations::Inside(&OFFICE_STATIONS),
            FINE,
        ),
        scan(
            "room_hall_2_stations",
            hall,
            36_000,
            Stations::Inside(&HALL_STATIONS),
            COARSE,
        ),
    ]
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::Silent;

    /// How far the test steps off the surface: below every wall and gap, above the rounding of positions to `f32`.
    const STEP: f64 = 1e-5;

    #[test]
    fn normals_lead_from_inside_to_outside() {
        for cloud in benchmark_clouds() {
            let body = (cloud.body)();
            let samples = cloud.sample(&body, 400);
            assert!(samples.len() > 300, "{} has {}", cloud.name, samples.len());
            for (point, normal) in samples {
                let value = |side: f64| (body.field)(point + side * STEP * normal);
                assert!((normal.length() - 1.0).abs() < 1e-9);
                let at_edge = value(1.0) <= 0.0 || value(-1.0) >= 0.0;
                assert!(!at_edge, "{} at {point}: {} {}", cloud.name, value(-1.0), value(1.0));
            }
        }
    }

    #[test]
    fn bodies_are_closed_inside_their_ball() {
        let mut random = Random::new(5);
        let mut open = Vec::new();
        for cloud in benchmark_clouds() {
            let body = (cloud.body)();
            if body.window.is_some() || cloud.name.starts_with("room") {
                continue;
            }
            for _ in 0..1000 {
                let place = body.radius * random.direction();
                if (body.field)(place) <= 0.0 {
                    open.push(cloud.name);
                    break;
                }
            }
        }
        assert!(open.is_empty(), "reach out of their balls: {open:?}");
    }

    /// The rays step by the function's value, so it must not be larger than the distance to the surface.
    #[test]
    fn values_are_not_larger_than_the_distance_to_the_surface() {
        let mut random = Random::new(6);
        let mut too_large = Vec::new();
        for cloud in benchmark_clouds() {
            let body = (cloud.body)();
            let mut worst: f64 = 0.0;
            for (point, _) in cloud.sample(&body, 400) {
                for _ in 0..10 {
                    let step = body.radius * (1e-4 + random.unit().powi(3));
                    let value = (body.field)(point + step * random.direction());
                    worst = worst.max(value.abs() / step);
                }
            }
            // A little for rounding.
            if worst > 1.0 + 1e-6 {
                too_large.push((cloud.name, worst));
            }
        }
        assert!(too_large.is_empty(), "value / distance: {too_large:?}");
    }

    #[test]
    fn names_are_unique() {
        let clouds = benchmark_clouds();
        let names: HashSet<_> = clouds.iter().map(|cloud| (cloud.class, cloud.name)).collect();
        assert_eq!(names.len(), clouds.len());
    }

    #[test]
    fn a_cloud_is_the_same_with_any_number_of_threads() {
        let clouds = benchmark_clouds();
        let cloud = clouds.iter().find(|cloud| cloud.name == "wedge_15").unwrap();
        let with = |n_threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
            pool.install(|| cloud.generate(&Silent).unwrap())
        };
        assert_eq!(with(1), with(3));
    }
}
