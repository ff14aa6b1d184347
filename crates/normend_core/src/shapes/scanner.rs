//! A simulated laser scanner: rays from stations, with the errors that real ones have.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DQuat, DVec3, dvec3};
use rayon::prelude::*;

use super::field::normal;
use super::random::Random;
use super::rays::{Body, Sample, trace};
use crate::evidence::Station;

/// Where the stations of a scan are.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stations {
    /// Around the body, at alternating heights; the number of places.
    Around(usize),
    /// Two, in front and behind.
    FrontAndBack,
    /// In a room, turning around themselves.
    Inside(&'static [DVec3]),
}

/// How exact a scanner is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Errors {
    /// Standard deviation of the range, as a share of the diameter.
    pub range: f64,
    /// How far each station's points are off as a whole, as a share of the diameter.
    pub registration: f64,
}

/// Light that meets a surface at more than this angle off the normal does not come back.
const GRAZING: f64 = 80.0;

/// Stations around a body stand this many radii from its center: near enough that they see it from different sides.
const STAND_OFF: f64 = 2.6;

/// A room's scanner sees from here to straight above; below it are its own legs.
const LOWEST: f64 = -65.0;

/// Share of the rays that are cast first to learn how many find something.
const PROBES: f64 = 0.1;

/// The points that the stations see, station by station, displaced by the errors, with the normals of the exact places.
/// About `n_points` of them, equally many from each station.
pub(super) fn scan(
    body: &Body,
    stations: Stations,
    n_points: usize,
    errors: Errors,
    seed: u64,
) -> (Vec<Sample>, Vec<Station>) {
    let places: Vec<DVec3> = match stations {
        Stations::Around(count) => (0..count)
            .map(|i| {
                let (sin, cos) = (TAU * i as f64 / count as f64 + 0.3).sin_cos();
                let up = if i % 2 == 0 { 0.55 } else { -0.45 };
                STAND_OFF * body.radius * dvec3(cos, sin, up).normalize_or(DVec3::X)
            })
            .collect(),
        Stations::FrontAndBack => [1.0, -1.0].map(|y| STAND_OFF * body.radius * y * DVec3::Y).into(),
        Stations::Inside(places) => places.into(),
    };
    let is_inside = matches!(stations, Stations::Inside(_));
    let mut samples = Vec::new();
    let mut list = Vec::new();
    for (index, &position) in places.iter().enumerate() {
        let directions = |rays: f64| {
            if is_inside {
                panorama(rays)
            } else {
                cone(-position, (1.0 / STAND_OFF).asin(), rays)
            }
        };
        // How many rays find something depends on the body; a tenth of them tell how many are needed.
        let wanted = n_points as f64 / places.len() as f64;
        let probes = directions(PROBES * wanted);
        let found = probes
            .par_iter()
            .filter(|&&ray| look(body, position, ray).is_some())
            .count();
        let directions = directions(wanted * probes.len() as f64 / found.max(1) as f64);
        let first = samples.len();
        let mut random = Random::stream(seed, index);
        let diameter = 2.0 * body.radius;
        let shift = errors.registration * diameter * random.direction();
        let turn = DQuat::from_axis_angle(random.direction(), errors.registration);
        let seen: Vec<Option<Sample>> = directions
            .into_par_iter()
            .enumerate()
            .map(|(ray, direction)| {
                let mut random = Random::stream(seed ^ (index as u64 + 1), ray);
                let noise = errors.range * diameter * f64::from(random.gaussian());
                let (along, normal) = look(body, position, direction)?;
                Some((position + (along + noise) * direction, normal))
            })
            .collect();
        samples.extend(
            seen.into_iter()
                .flatten()
                .map(|(point, normal)| (turn * point + shift, normal)),
        );
        list.push(Station {
            points: first as u32..samples.len() as u32,
            position,
        });
    }
    (samples, list)
}

/// The distance and normal of the first surface in a direction, unless the light grazes it.
fn look(body: &Body, from: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
    let mut first = None;
    trace(body, from, direction, (STAND_OFF + 1.0) * body.radius, |along| {
        first = Some(along);
        false
    });
    let along = first?;
    let normal = normal(&body.field, from + along * direction);
    (-normal.dot(direction) > GRAZING.to_radians().cos()).then_some((along, normal))
}

/// Rows of equal angles in a cone around `axis`.
fn cone(axis: DVec3, half_angle: f64, count: f64) -> Vec<DVec3> {
    let axis = axis.normalize_or(DVec3::X);
    let (u, v) = axis.any_orthonormal_pair();
    let side = count.sqrt().ceil() as usize;
    let place = |i: usize| half_angle.tan() * ((2 * i + 1) as f64 / side as f64 - 1.0);
    (0..side * side)
        .map(|i| (axis + place(i / side) * u + place(i % side) * v).normalize_or(axis))
        .collect()
}

/// Rows of equal angles all around z and from [`LOWEST`] up, twice as many columns as rows; the columns come one by one, as
/// a scanner turns.
fn panorama(count: f64) -> Vec<DVec3> {
    let rows = (0.5 * count).sqrt().ceil() as usize;
    let lowest = LOWEST.to_radians();
    (0..2 * rows * rows)
        .map(|i| {
            let azimuth = PI * (i / rows) as f64 / rows as f64;
            let height = lowest + (FRAC_PI_2 - lowest) * ((i % rows) as f64 + 0.5) / rows as f64;
            dvec3(azimuth.cos() * height.cos(), azimuth.sin() * height.cos(), height.sin())
        })
        .collect()
}
