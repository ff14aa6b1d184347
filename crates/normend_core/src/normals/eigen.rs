//! Eigenvectors of symmetric 3×3 matrices, by Jacobi rotations.
//!
//! Jacobi is slower than the closed form but accurate on every matrix: rank 1 and 0, equal eigenvalues, any scale.

use glam::DVec3;

/// A symmetric 3×3 matrix by its upper triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Symmetric3 {
    pub xx: f64,
    pub xy: f64,
    pub xz: f64,
    pub yy: f64,
    pub yz: f64,
    pub zz: f64,
}

/// Eigenvalues in ascending order with their eigenvectors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eigen {
    pub values: [f64; 3],
    /// Orthonormal and right- or left-handed.
    pub vectors: [DVec3; 3],
}

impl Symmetric3 {
    /// Adds `weight · v vᵀ`.
    #[inline]
    pub fn add_outer(&mut self, weight: f64, v: DVec3) {
        let w = weight * v;
        self.xx += w.x * v.x;
        self.xy += w.x * v.y;
        self.xz += w.x * v.z;
        self.yy += w.y * v.y;
        self.yz += w.y * v.z;
        self.zz += w.z * v.z;
    }

    /// Eigenvalues and eigenvectors of a matrix of finite numbers.
    pub fn eigen(&self) -> Eigen {
        // Scaled by a power of two to entries near 1, so that no square under- or overflows.
        let largest = [self.xx, self.xy, self.xz, self.yy, self.yz, self.zz]
            .into_iter()
            .fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
        if largest < f64::MIN_POSITIVE {
            return Eigen {
                values: [0.0; 3],
                vectors: [DVec3::Z, DVec3::X, DVec3::Y],
            };
        }
        let scale = f64::from_bits(largest.to_bits() & 0x7ff0_0000_0000_0000);
        let mut matrix = [
            [self.xx / scale, self.xy / scale, self.xz / scale],
            [self.xy / scale, self.yy / scale, self.yz / scale],
            [self.xz / scale, self.yz / scale, self.zz / scale],
        ];
        let mut vectors = [DVec3::X, DVec3::Y, DVec3::Z];
        for _ in 0..SWEEPS {
            // Entries near 1: this is below what rounding does to the eigenvalues.
            if matrix[0][1].abs() + matrix[0][2].abs() + matrix[1][2].abs() < 1e-18 {
                break;
            }
            rotate(&mut matrix, &mut vectors, 0, 1, 2);
            rotate(&mut matrix, &mut vectors, 0, 2, 1);
            rotate(&mut matrix, &mut vectors, 1, 2, 0);
        }
        let mut order = [0, 1, 2];
        order.sort_unstable_by(|&a, &b| matrix[a][a].total_cmp(&matrix[b][b]));
        Eigen {
            values: order.map(|i| matrix[i][i] * scale),
            vectors: order.map(|i| vectors[i]),
        }
    }
}

/// Convergence is quadratic; five sweeps are usual.
const SWEEPS: usize = 16;

/// The Jacobi rotation that makes entry (p, q) zero; r is the third index.
#[inline]
fn rotate(matrix: &mut [[f64; 3]; 3], vectors: &mut [DVec3; 3], p: usize, q: usize, r: usize) {
    let entry = matrix[p][q];
    if entry == 0.0 {
        return;
    }
    let theta = (matrix[q][q] - matrix[p][p]) / (2.0 * entry);
    // For a huge theta the square is infinite and the tangent 0, which is right: nothing is left to rotate.
    let tangent = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let cosine = (tangent * tangent + 1.0).sqrt().recip();
    let sine = tangent * cosine;
    matrix[p][p] -= tangent * entry;
    matrix[q][q] += tangent * entry;
    matrix[p][q] = 0.0;
    matrix[q][p] = 0.0;
    let (rp, rq) = (matrix[r][p], matrix[r][q]);
    matrix[r][p] = cosine * rp - sine * rq;
    matrix[p][r] = matrix[r][p];
    matrix[r][q] = sine * rp + cosine * rq;
    matrix[q][r] = matrix[r][q];
    let (vp, vq) = (vectors[p], vectors[q]);
    vectors[p] = cosine * vp - sine * vq;
    vectors[q] = sine * vp + cosine * vq;
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, SymmetricEigen};
    use proptest::prelude::*;

    use super::*;

    fn reference(m: &Symmetric3) -> ([f64; 3], Matrix3<f64>) {
        let matrix = Matrix3::new(m.xx, m.xy, m.xz, m.xy, m.yy, m.yz, m.xz, m.yz, m.zz);
        let mut values: [f64; 3] = SymmetricEigen::new(matrix).eigenvalues.into();
        values.sort_by(f64::total_cmp);
        (values, matrix)
    }

    /// Same eigenvalues as nalgebra's, and eigenvectors that are orthonormal and satisfy `M v = λ v`.
    fn check(m: Symmetric3) {
        let eigen = m.eigen();
        let (values, matrix) = reference(&m);
        let scale = matrix.amax();
        for i in 0..3 {
            assert!(
                (eigen.values[i] - values[i]).abs() <= 1e-13 * scale,
                "{eigen:?} {values:?}"
            );
            let v = nalgebra::Vector3::from(eigen.vectors[i].to_array());
            let residual = (matrix * v - v * eigen.values[i]).norm();
            assert!(residual <= 1e-13 * scale, "{residual:e} of {scale:e}");
            for j in 0..3 {
                let expect = if i == j { 1.0 } else { 0.0 };
                assert!((eigen.vectors[i].dot(eigen.vectors[j]) - expect).abs() < 1e-13);
            }
        }
    }

    fn any_vector() -> impl Strategy<Value = DVec3> {
        (-1.0..1.0, -1.0..1.0, -1.0..1.0).prop_map(DVec3::from)
    }

    fn sum_of(terms: &[(f64, DVec3)]) -> Symmetric3 {
        let mut m = Symmetric3::default();
        for &(weight, v) in terms {
            m.add_outer(weight, v);
        }
        m
    }

    proptest! {
        #[test]
        fn scatter_matrices(vectors in prop::collection::vec(any_vector(), 0..12), exponent in -60_i32..60) {
            let weight = 10.0_f64.powi(exponent);
            check(sum_of(&vectors.iter().map(|&v| (weight, v)).collect::<Vec<_>>()));
        }

        #[test]
        fn indefinite(terms in prop::collection::vec((-1.0..1.0_f64, any_vector()), 1..6)) {
            check(sum_of(&terms));
        }

        #[test]
        fn nearly_flat(a in any_vector(), b in any_vector(), c in any_vector(), thickness in 0.0..1e-12_f64) {
            check(sum_of(&[(1.0, a), (1.0, b), (thickness, c)]));
        }

        #[test]
        fn the_normal_of_a_plane_is_found(a in any_vector(), b in any_vector()) {
            let normal = a.cross(b);
            prop_assume!(normal.length() > 1e-3);
            let found = sum_of(&[(1.0, a), (1.0, b), (0.5, a - b)]).eigen().vectors[0];
            prop_assert!(found.dot(a).abs() < 1e-9 && found.dot(b).abs() < 1e-9);
        }
    }

    #[test]
    fn degenerate_matrices() {
        check(Symmetric3::default());
        check(sum_of(&[(1.0, DVec3::X)]));
        check(sum_of(&[(3.0, DVec3::new(1.0, 2.0, -1.0))]));
        check(sum_of(&[(1.0, DVec3::X), (1.0, DVec3::Y), (1.0, DVec3::Z)]));
        check(sum_of(&[
            (1.0, DVec3::X),
            (1.0 + 1e-15, DVec3::Y),
            (1.0 - 1e-15, DVec3::Z),
        ]));
        check(Symmetric3 {
            xy: 1e-300,
            ..Symmetric3::default()
        });
    }

    #[test]
    fn nothing_gives_up() {
        assert_eq!(Symmetric3::default().eigen().vectors[0], DVec3::Z);
    }
}
