//! Small clouds with known outward normals, for documentation, tests and benchmarks.
//!
//! All are deterministic. Points are spread evenly (Fibonacci lattices and the R2 sequence of Martin Roberts), as a
//! scanner's are and unlike random ones, which leave holes; noise is added on top with [`Shape::with_noise`].

mod benchmark;
mod bodies;
mod field;
mod octahedron;
pub(crate) mod random;
mod rays;
mod scanner;
mod solid;

use std::f32::consts::TAU;
use std::f64;

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

pub use self::benchmark::{BenchmarkCloud, BenchmarkPoints, benchmark_clouds};
pub use self::octahedron::octahedron;
use self::random::Random;
use self::solid::{Cavity, Primitive, Solid};

/// A generated cloud: `n` positions and their exact outward unit normals.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shape {
    /// Positions.
    pub positions: Vec<Vec3>,
    /// Exact outward unit normals.
    pub normals: Vec<Vec3>,
}

impl Shape {
    /// Moves every point by Gaussian noise of this standard deviation on each axis, in units of the bounding box's diagonal.
    /// Normals stay those of the exact surface.
    #[must_use]
    pub fn with_noise(mut self, deviation: f32, seed: u64) -> Self {
        let min = self.positions.iter().copied().reduce(Vec3::min).unwrap_or(Vec3::ZERO);
        let max = self.positions.iter().copied().reduce(Vec3::max).unwrap_or(Vec3::ZERO);
        let length = deviation * (max - min).length();
        if length > 0.0 {
            let mut random = Random::new(seed);
            for position in &mut self.positions {
                *position += length * Vec3::new(random.gaussian(), random.gaussian(), random.gaussian());
            }
        }
        self
    }
}

/// The shapes by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShapeKind {
    /// [`sphere`].
    Sphere,
    /// [`torus`].
    Torus,
    /// [`thin_plate`], a twentieth as thick as wide.
    Plate,
    /// [`fandisk_like`].
    Fandisk,
    /// [`mechanical_part`].
    Part,
}

impl ShapeKind {
    /// All shapes.
    pub const ALL: [Self; 5] = [Self::Sphere, Self::Torus, Self::Plate, Self::Fandisk, Self::Part];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Torus => "torus",
            Self::Plate => "plate",
            Self::Fandisk => "fandisk",
            Self::Part => "part",
        }
    }

    /// The shape with `n_points` points. O(n).
    pub fn generate(self, n_points: usize) -> Shape {
        match self {
            Self::Sphere => sphere(n_points),
            Self::Torus => torus(n_points),
            Self::Plate => thin_plate(n_points, 0.05),
            Self::Fandisk => fandisk_like(n_points),
            Self::Part => mechanical_part(n_points),
        }
    }
}

/// A sphere of radius 1.
pub fn sphere(n_points: usize) -> Shape {
    let golden_angle = f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let normals: Vec<Vec3> = (0..n_points)
        .into_par_iter()
        .map(|i| {
            let z = 1.0 - (2 * i + 1) as f64 / n_points as f64;
            let radius = (1.0 - z * z).max(0.0).sqrt();
            let (sin, cos) = (golden_angle * i as f64).sin_cos();
            DVec3::new(radius * cos, radius * sin, z).as_vec3()
        })
        .collect();
    Shape {
        positions: normals.clone(),
        normals,
    }
}

/// A torus around z; the tube's radius is 0.4, that of its center line 1.
pub fn torus(n_points: usize) -> Shape {
    const TUBE: f32 = 0.4;
    let (positions, normals) = (0..n_points)
        .into_par_iter()
        .map(|i| {
            let uv = r2(i, DVec2::ZERO).as_vec2();
            let (sin_u, cos_u) = (TAU * uv.x).sin_cos();
            // The outside of the ring has more area: v' + TUBE sin v' = v makes the points even. The map contracts.
            let target = TAU * uv.y;
            let mut v = target;
            for _ in 0..30 {
                v = target - TUBE * v.sin();
            }
            let (sin_v, cos_v) = v.sin_cos();
            let outward = Vec3::new(cos_u, sin_u, 0.0);
            let normal = cos_v * outward + sin_v * Vec3::Z;
            (outward + TUBE * normal, normal)
        })
        .unzip();
    Shape { positions, normals }
}

/// A rectangular plate with sharp edges, 2 × 1 × `thickness`.
pub fn thin_plate(n_points: usize, thickness: f32) -> Shape {
    let half = DVec3::new(1.0, 0.5, 0.5 * f64::from(thickness));
    Solid::new(vec![Primitive::block(-half, half)]).sample(n_points)
}

/// A solid like the Fandisk model: sharp edges between planes, a convex and a concave cylinder.
pub fn fandisk_like(n_points: usize) -> Shape {
    let solid = Solid {
        parts: vec![
            Primitive::block(DVec3::new(0.0, 0.0, 0.0), DVec3::new(2.0, 1.0, 0.8)),
            Primitive::block(DVec3::new(0.0, 0.0, 0.0), DVec3::new(0.7, 1.0, 1.3)),
            Primitive::cylinder(DVec3::new(2.0, 0.5, 0.4), DVec3::Z, 0.5, 0.4),
        ],
        cavities: vec![
            Cavity::whole(Primitive::cylinder(DVec3::new(1.22, 0.5, 1.0), DVec3::Y, 0.45, 1.0)),
            Cavity::whole(Primitive::cylinder(DVec3::new(2.0, 0.5, 0.4), DVec3::Z, 0.25, 1.0)),
        ],
    };
    solid.sample(n_points)
}

/// A bearing bracket, 110 × 50 × 74: base plate with four bolt holes, thin ribs, an eye with a spherical seat.
///
/// The seat is undercut: at its rims the outward normals of seat and face are 146° apart, which the dot product takes for
/// two that point to opposite sides. So the default orientation has the seat inside out. The narrow chamfers between seat
/// and faces are missing, as a scanner leaves out what shines, so no normals lie in between: the edges across are the
/// heaviest around, and a mend of the seat cuts there.
pub fn mechanical_part(n_points: usize) -> Shape {
    let bolt_hole = |x: f64, y: f64| Cavity::whole(Primitive::cylinder(DVec3::new(x, y, 4.0), DVec3::Z, 4.0, 10.0));
    let rib = |from: f64, to: f64| Primitive::block(DVec3::new(from, -1.25, 4.0), DVec3::new(to, 1.25, 30.0));
    let center = DVec3::new(0.0, 0.0, 48.0);
    let solid = Solid {
        parts: vec![
            Primitive::block(DVec3::new(-55.0, -25.0, 0.0), DVec3::new(55.0, 25.0, 8.0)),
            Primitive::block(DVec3::new(-26.0, -15.0, 4.0), DVec3::new(26.0, 15.0, 48.0)),
            Primitive::cylinder(center, DVec3::Y, 26.0, 15.0),
            rib(-44.0, -20.0),
            rib(20.0, 44.0),
        ],
        cavities: vec![
            bolt_hole(-47.0, -17.0),
            bolt_hole(-47.0, 17.0),
            bolt_hole(47.0, -17.0),
            bolt_hole(47.0, 17.0),
            Cavity {
                primitive: Primitive::ball(center, 18.0),
                unseen_rim: 1.05,
            },
        ],
    };
    solid.sample(n_points)
}

/// The bundled sample: [`mechanical_part`] with 60 000 points and a little noise.
pub fn sample_part() -> Shape {
    mechanical_part(60_000).with_noise(0.0006, 1)
}

/// The `index`-th point of the R2 sequence in the unit square, shifted by `offset`: even, and never on a lattice.
///
/// Source: M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018.
fn r2(index: usize, offset: DVec2) -> DVec2 {
    // Powers of the plastic number's inverse.
    const STEP: DVec2 = DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_3);
    (offset + 0.5 + STEP * (index + 1) as f64).fract()
}

#[cfg(test)]
mod tests;
