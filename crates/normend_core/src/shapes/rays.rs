//! Rays through a [`Field`], and points on its surface where they hit.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3, IVec3};
use rayon::prelude::*;

use super::field::{Field, normal};
use super::random::Random;

/// A point on the surface with its outward unit normal.
pub(super) type Sample = (DVec3, DVec3);

/// The part of a solid's surface that is sampled.
#[derive(Clone)]
pub(super) struct Body {
    /// Outward is where it grows.
    pub field: Field,
    /// Only points inside of this.
    pub window: Option<Field>,
    /// A ball around the origin that holds them all.
    pub radius: f64,
}

/// How points are spread over a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spread {
    /// Each point anywhere, with equal chance by area.
    Random,
    /// Dart throwing: no two points of one sheet nearer than a radius (blue noise).
    Poisson,
    /// The vertices of a marching-cubes mesh, where the edges of a cubic grid pass through the surface.
    Lattice,
}

/// Relative density at a point, in (0, 1].
pub(super) type Density = fn(DVec3) -> f64;

/// The shortest step of a ray, as a share of the ball's radius: below every wall, above rounding.
const SHORTEST_STEP: f64 = 1e-4;

/// Lines that are cast in one go, so that many threads have work and the result does not depend on their number.
const BATCH: usize = 8192;

/// Darts for each point that is to stay. More would pack points a little closer, for as much more work.
const DARTS: usize = 5;

/// Calls `hit` with the distance of every pass of the ray through the surface, up to `length`, until it says false.
pub(super) fn trace(body: &Body, from: DVec3, direction: DVec3, length: f64, mut hit: impl FnMut(f64) -> bool) {
    let shortest = SHORTEST_STEP * body.radius;
    let value = |along: f64| (body.field)(from + along * direction);
    let (mut along, mut here) = (0.0, value(0.0));
    while along < length {
        let next = along + here.abs().max(shortest);
        let there = value(next);
        if (here < 0.0) != (there < 0.0) {
            // Halving a step of at most the diameter 50 times reaches the rounding of f64.
            let (mut low, mut high) = (along, next);
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if (value(middle) < 0.0) == (here < 0.0) {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            if !hit(high) {
                return;
            }
        }
        (along, here) = (next, there);
    }
}

impl Body {
    /// A closed solid inside the ball of `radius`.
    pub fn closed(field: Field, radius: f64) -> Self {
        Self {
            field,
            window: None,
            radius,
        }
    }

    /// The part of the surface of `field` inside `window`.
    pub fn open(field: Field, window: Field, radius: f64) -> Self {
        Self {
            field,
            window: Some(window),
            radius,
        }
    }

    /// About `n_points` (to a few percent) points of the surface.
    pub fn sample(&self, n_points: usize, spread: Spread, density: Option<Density>, seed: u64) -> Vec<Sample> {
        let mut random = Random::new(seed);
        match spread {
            Spread::Random => self.darts(n_points, density, seed),
            Spread::Poisson => {
                let darts = self.darts(DARTS * n_points, density, seed);
                let kept = poisson(&darts, n_points, density.unwrap_or(|_| 1.0));
                kept.into_iter().map(|dart| darts[dart]).collect()
            }
            Spread::Lattice => {
                // A cell of the grid passes through an area of about its square, on 1.5 of its edges on average.
                let area = self.area(seed);
                let offset = DVec3::new(random.unit(), random.unit(), random.unit());
                let mut step = (1.5 * area / n_points as f64).sqrt();
                let mut samples = self.grid(step, offset);
                for _ in 0..2 {
                    step *= (samples.len() as f64 / n_points as f64).sqrt();
                    samples = self.grid(step, offset);
                }
                samples
            }
        }
    }

    /// The area, estimated from as many lines as one batch has (Crofton: a line meets the surface area / (2π r²) times).
    pub fn area(&self, seed: u64) -> f64 {
        let hits: usize = (0..BATCH)
            .into_par_iter()
            .map(|line| self.line(seed, line).1.len())
            .sum();
        hits as f64 / BATCH as f64 * TAU * self.radius * self.radius
    }

    /// Random points where random lines meet the surface: for lines that are even in direction and place, these are even by
    /// area (Crofton).
    fn darts(&self, n_points: usize, density: Option<Density>, seed: u64) -> Vec<Sample> {
        let mut samples = Vec::with_capacity(n_points);
        let mut first = 0;
        // A body with no surface in its ball would never give a point.
        while samples.len() < n_points && (first < 4 * BATCH || !samples.is_empty()) {
            let batch: Vec<Vec<Sample>> = (first..first + BATCH)
                .into_par_iter()
                .map(|line| {
                    let (mut random, mut hits) = self.line(seed, line);
                    hits.retain(|sample| density.is_none_or(|density| random.unit() <= density(sample.0)));
                    hits
                })
                .collect();
            samples.extend(batch.into_iter().flatten());
            first += BATCH;
        }
        samples.truncate(n_points);
        samples
    }

    /// The points on a random line, and the random numbers that follow.
    fn line(&self, seed: u64, index: usize) -> (Random, Vec<Sample>) {
        let mut random = Random::stream(seed, index);
        let direction = random.direction();
        let (u, v) = direction.any_orthonormal_pair();
        let off = random.unit().sqrt() * DVec2::from_angle(TAU * random.unit());
        let middle = self.radius * (off.x * u + off.y * v);
        let hits = self.hits(middle - self.radius * direction, direction);
        (random, hits)
    }

    fn hits(&self, from: DVec3, direction: DVec3) -> Vec<Sample> {
        let mut hits = Vec::new();
        trace(self, from, direction, 2.0 * self.radius, |along| {
            let point = from + along * direction;
            if self.window.as_ref().is_none_or(|window| window(point) < 0.0) {
                hits.push((point, normal(&self.field, point)));
            }
            true
        });
        hits
    }

    /// Where the edges of a cubic grid pass through the surface.
    fn grid(&self, step: f64, offset: DVec3) -> Vec<Sample> {
        let half = (self.radius / step).ceil() as i64;
        let width = (2 * half + 1) as usize;
        let line = |index: usize| {
            let (axis, row) = (index / (width * width), index % (width * width));
            let place = |i: usize, offset: f64| (i as i64 - half) as f64 * step + offset * step;
            let direction = DVec3::AXES[axis];
            let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3]);
            let from = place(row / width, offset.dot(u)) * u + place(row % width, offset.dot(v)) * v;
            self.hits(from - self.radius * direction, direction)
        };
        let lines: Vec<Vec<Sample>> = (0..3 * width * width).into_par_iter().map(line).collect();
        lines.into_iter().flatten().collect()
    }
}

/// About `n_points` of `darts` (at most a percent more) so that none is within a radius of another on the same sheet. The
/// radius grows as the root of 1 / density.
fn poisson(darts: &[Sample], n_points: usize, density: Density) -> Vec<usize> {
    let reach: Vec<f64> = darts.iter().map(|dart| density(dart.0).sqrt().recip()).collect();
    // Any begin will do that keeps fewer points than there are darts; the count falls with the square of the radius.
    let bounds = |darts: &[Sample]| {
        darts
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), dart| {
                (low.min(dart.0), high.max(dart.0))
            })
    };
    let (low, high) = bounds(darts);
    let mut radius = 0.5 * (high - low).length() / (n_points as f64).sqrt();
    let mut kept = throw(darts, &reach, radius, low);
    for _ in 0..12 {
        let ratio = kept.len() as f64 / n_points as f64;
        if (1.0..1.01).contains(&ratio) {
            break;
        }
        radius *= (ratio / 1.005).sqrt();
        kept = throw(darts, &reach, radius, low);
    }
    kept
}

/// The darts that no earlier one that stayed is too near to.
fn throw(darts: &[Sample], reach: &[f64], radius: f64, low: DVec3) -> Vec<usize> {
    let widest = radius * reach.iter().copied().fold(1.0, f64::max);
    let cell = |point: DVec3| ((point - low) / widest).floor().as_ivec3();
    let mut cells: std::collections::HashMap<IVec3, Vec<usize>> = std::collections::HashMap::new();
    let mut kept = Vec::new();
    for (index, dart) in darts.iter().enumerate() {
        let home = cell(dart.0);
        let is_near = |&other: &usize| {
            let near = radius * 0.5 * (reach[index] + reach[other]);
            dart.0.distance_squared(darts[other].0) < near * near && is_same_sheet(dart, &darts[other], near)
        };
        let neighborhood = (0..27).map(|i| home + IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
        let taken = neighborhood
            .filter_map(|place| cells.get(&place))
            .any(|others| others.iter().any(is_near));
        if !taken {
            cells.entry(home).or_default().push(index);
            kept.push(index);
        }
    }
    kept
}

/// Whether two points less than `near` apart belong to one sheet: they don't face away from each other as the sides of a
/// wall do, nor lie one above the other as stacked sheets do. Sheets are sampled each by itself, as by a scanner.
fn is_same_sheet(a: &Sample, b: &Sample, near: f64) -> bool {
    let facing = a.1.dot(b.1);
    let is_above = facing > 0.5 && (a.0 - b.0).dot(a.1).abs() > 0.5 * near;
    facing > -0.1 && !is_above
}
