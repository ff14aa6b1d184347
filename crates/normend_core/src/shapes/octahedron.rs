//! An octahedron, and noise of a fixed length as Liu et al. add to it (Fig. 12).

use glam::{DVec2, DVec3, Vec3};

use super::random::Random;
use super::{Shape, r2};

/// A regular octahedron with corners at distance 1 on the axes; its eight faces have the same number of points, give or take one.
pub fn octahedron(n_points: usize) -> Shape {
    let (positions, normals) = (0..n_points)
        .map(|i| {
            let side = |bit: usize| if i >> bit & 1 == 0 { 1.0 } else { -1.0 };
            let signs = DVec3::new(side(0), side(1), side(2));
            let uv = r2(i / 8, DVec2::ZERO);
            // The half of the unit square beyond the diagonal is folded back.
            let uv = if uv.x + uv.y > 1.0 { 1.0 - uv } else { uv };
            let corner_weights = DVec3::new(uv.x, uv.y, 1.0 - uv.x - uv.y);
            ((signs * corner_weights).as_vec3(), (signs / 3.0_f64.sqrt()).as_vec3())
        })
        .unzip();
    Shape { positions, normals }
}

impl Shape {
    /// Moves every point by the same distance, a share of the bounding box's diagonal, in a random direction. Normals stay those of the
    /// exact surface.
    #[must_use]
    pub fn displaced(mut self, share: f32, seed: u64) -> Self {
        let min = self.positions.iter().copied().reduce(Vec3::min).unwrap_or(Vec3::ZERO);
        let max = self.positions.iter().copied().reduce(Vec3::max).unwrap_or(Vec3::ZERO);
        let length = share * (max - min).length();
        let mut random = Random::new(seed);
        for position in &mut self.positions {
            *position += length * random.direction().as_vec3();
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_on_the_faces_and_noise_has_one_length() {
        let shape = octahedron(803);
        for (position, normal) in shape.positions.iter().zip(&shape.normals) {
            assert!((position.abs().element_sum() - 1.0).abs() < 1e-6);
            assert!((position.dot(*normal) - 1.0 / 3.0_f32.sqrt()).abs() < 1e-6);
        }
        let moved = shape.clone().displaced(0.01, 4);
        let min = shape.positions.iter().copied().reduce(Vec3::min).unwrap();
        let max = shape.positions.iter().copied().reduce(Vec3::max).unwrap();
        for (before, after) in shape.positions.iter().zip(&moved.positions) {
            assert!(((*before - *after).length() / (max - min).length() - 0.01).abs() < 1e-5);
        }
        assert_eq!(moved.normals, shape.normals);
    }
}
