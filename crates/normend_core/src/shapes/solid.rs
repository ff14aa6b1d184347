//! Points on the surface of a union of blocks, cylinders and balls with holes of these shapes in it.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::{Shape, r2};

/// Lengths below this are rounding: points this near a surface are on it. Solids are about 1 to 100 in size.
const ROUNDING: f64 = 1e-9;

/// A convex body.
#[derive(Clone, Copy, Debug)]
pub(super) enum Primitive {
    /// An axis-parallel block.
    Block { min: DVec3, max: DVec3 },
    /// A cylinder with its caps.
    Cylinder {
        center: DVec3,
        /// Unit length.
        axis: DVec3,
        radius: f64,
        half_length: f64,
    },
    /// A ball.
    Ball { center: DVec3, radius: f64 },
}

/// A hole in a solid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cavity {
    pub primitive: Primitive,
    /// Width of the strip inside the hole, along the faces it breaks through, that has no points.
    pub unseen_rim: f64,
}

impl Cavity {
    /// A hole with points up to its rims.
    pub fn whole(primitive: Primitive) -> Self {
        Self {
            primitive,
            unseen_rim: 0.0,
        }
    }
}

/// The union of parts without the cavities.
#[derive(Clone, Debug)]
pub(super) struct Solid {
    pub parts: Vec<Primitive>,
    pub cavities: Vec<Cavity>,
}

/// A point on the surface with its outward normal.
type Sample = (DVec3, DVec3);

impl Solid {
    pub fn new(parts: Vec<Primitive>) -> Self {
        Self {
            parts,
            cavities: Vec::new(),
        }
    }

    /// `n_points` evenly spread points of the surface. O(n).
    pub fn sample(&self, n_points: usize) -> Shape {
        if n_points == 0 {
            return Shape::default();
        }
        // Faces hide each other, so the density that gives enough points is found by trying.
        let area: f64 = self.parts.iter().map(Primitive::area).sum();
        let mut density = n_points as f64 / area;
        let mut samples = self.sample_by_density(density);
        while samples.len() < n_points {
            density *= 1.02 * (n_points as f64 / samples.len().max(1) as f64).clamp(1.0, 4.0);
            samples = self.sample_by_density(density);
        }
        // Those too many leave evenly from everywhere.
        let kept = (0..n_points).map(|i| samples[i * samples.len() / n_points]);
        let (positions, normals) = kept
            .map(|(position, normal)| (position.as_vec3(), normal.as_vec3()))
            .unzip();
        Shape { positions, normals }
    }

    fn sample_by_density(&self, density: f64) -> Vec<Sample> {
        let mut samples = Vec::new();
        for (i, part) in self.parts.iter().enumerate() {
            // Where faces of two parts coincide, the first part has the points.
            let is_outside_others = |point: DVec3| {
                self.parts[..i].iter().all(|other| !other.contains(point, -ROUNDING))
                    && self.parts[i + 1..].iter().all(|other| !other.contains(point, ROUNDING))
                    && self
                        .cavities
                        .iter()
                        .all(|cavity| !cavity.primitive.contains(point, ROUNDING))
            };
            let visible = part.sample(density).into_iter();
            samples.extend(visible.filter(|sample| is_outside_others(sample.0)));
        }
        for (i, cavity) in self.cavities.iter().enumerate() {
            let is_in_material = |point: DVec3| {
                let mut others = self.cavities[..i].iter().chain(&self.cavities[i + 1..]);
                self.parts
                    .iter()
                    .any(|part| part.contains(point, ROUNDING + cavity.unseen_rim))
                    && others.all(|other| !other.primitive.contains(point, ROUNDING))
            };
            let walls = cavity.primitive.sample(density).into_iter();
            samples.extend(
                walls
                    .filter(|wall| is_in_material(wall.0))
                    .map(|(point, normal)| (point, -normal)),
            );
        }
        samples
    }
}

impl Primitive {
    pub fn block(min: DVec3, max: DVec3) -> Self {
        Self::Block { min, max }
    }

    /// `axis` has unit length.
    pub fn cylinder(center: DVec3, axis: DVec3, radius: f64, half_length: f64) -> Self {
        Self::Cylinder {
            center,
            axis,
            radius,
            half_length,
        }
    }

    pub fn ball(center: DVec3, radius: f64) -> Self {
        Self::Ball { center, radius }
    }

    /// Whether `point` is inside and at least `margin` from the surface; a negative one lets points outside in.
    fn contains(&self, point: DVec3, margin: f64) -> bool {
        match *self {
            Self::Block { min, max } => point.cmpgt(min + margin).all() && point.cmplt(max - margin).all(),
            Self::Cylinder {
                center,
                axis,
                radius,
                half_length,
            } => {
                let along = (point - center).dot(axis);
                let across = (point - center - along * axis).length();
                along.abs() < half_length - margin && across < radius - margin
            }
            Self::Ball { center, radius } => point.distance(center) < radius - margin,
        }
    }

    fn area(&self) -> f64 {
        match *self {
            Self::Block { min, max } => {
                let size = max - min;
                2.0 * (size.x * size.y + size.y * size.z + size.z * size.x)
            }
            Self::Cylinder {
                radius, half_length, ..
            } => TAU * radius * (2.0 * half_length + radius),
            Self::Ball { radius, .. } => 2.0 * TAU * radius * radius,
        }
    }

    /// Points of the whole surface, `density` per area.
    fn sample(&self, density: f64) -> Vec<Sample> {
        match *self {
            Self::Block { min, max } => sample_block(min, max, density),
            Self::Cylinder {
                center,
                axis,
                radius,
                half_length,
            } => sample_cylinder(center, axis, radius, half_length, density),
            Self::Ball { center, radius } => sample_ball(center, radius, density),
        }
    }
}

fn sample_block(min: DVec3, max: DVec3, density: f64) -> Vec<Sample> {
    let (center, half) = (0.5 * (min + max), 0.5 * (max - min));
    let mut samples = Vec::new();
    for (face, normal) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
        // The axes turn: u and v span the face.
        let (u, v) = (
            DVec3::new(normal.z, normal.x, normal.y),
            DVec3::new(normal.y, normal.z, normal.x),
        );
        let (half_u, half_v, half_n) = (half.dot(u), half.dot(v), half.dot(normal));
        for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
            for point in even_points(4.0 * half_u * half_v * density, 2 * face + side) {
                let point = 2.0 * point - 1.0;
                let position = center + point.x * half_u * u + point.y * half_v * v + sign * half_n * normal;
                samples.push((position, sign * normal));
            }
        }
    }
    samples
}

fn sample_cylinder(center: DVec3, axis: DVec3, radius: f64, half_length: f64, density: f64) -> Vec<Sample> {
    let (u, v) = axis.any_orthonormal_pair();
    let mut samples = Vec::new();
    for point in even_points(TAU * radius * 2.0 * half_length * density, 0) {
        let (sin, cos) = (TAU * point.x).sin_cos();
        let normal = cos * u + sin * v;
        samples.push((
            center + radius * normal + (2.0 * point.y - 1.0) * half_length * axis,
            normal,
        ));
    }
    for (cap, sign) in [-1.0, 1.0].into_iter().enumerate() {
        for point in even_points(4.0 * radius * radius * density, 1 + cap) {
            let point = 2.0 * point - 1.0;
            if point.length() < 1.0 {
                let position = center + radius * (point.x * u + point.y * v) + sign * half_length * axis;
                samples.push((position, sign * axis));
            }
        }
    }
    samples
}

fn sample_ball(center: DVec3, radius: f64, density: f64) -> Vec<Sample> {
    let sample = |point: DVec2| {
        let (sin, cos) = (TAU * point.x).sin_cos();
        let z = 2.0 * point.y - 1.0;
        let across = (1.0 - z * z).max(0.0).sqrt();
        let normal = DVec3::new(across * cos, across * sin, z);
        (center + radius * normal, normal)
    };
    even_points(2.0 * TAU * radius * radius * density, 0)
        .map(sample)
        .collect()
}

/// About `count` even points of the unit square; other ones for each `face`, so that opposite faces don't match.
fn even_points(count: f64, face: usize) -> impl Iterator<Item = DVec2> {
    let offset = DVec2::new(0.618_034, 0.381_966) * face as f64;
    (0..count.round() as usize).map(move |i| r2(i, offset))
}
