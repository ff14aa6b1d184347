use glam::{DMat3, DVec3};
use proptest::prelude::*;

use super::*;
use crate::Silent;

fn estimate_all(positions: &[Vec3], k: usize, estimator: Estimator) -> Vec<Vec3> {
    let cloud = PointCloud::new(DVec3::ZERO, positions.to_vec()).unwrap();
    let neighbors = Neighbors::find(&cloud, k, &Silent).unwrap();
    estimate(&cloud, &neighbors, k, estimator, &Silent).unwrap()
}

fn angle(a: Vec3, b: Vec3) -> f32 {
    a.cross(b).length().atan2(a.dot(b).abs())
}

#[test]
fn a_plane_has_its_normal() {
    let normal = Vec3::new(1.0, 2.0, -2.0) / 3.0;
    let (u, v) = normal.any_orthonormal_pair();
    let positions: Vec<Vec3> = (0..400)
        .map(|i| u * (i % 20) as f32 + v * (i / 20) as f32 + 7.0)
        .collect();
    for estimator in Estimator::ALL {
        for found in estimate_all(&positions, 8, estimator) {
            // A few triples, some of them narrow, do not average the rounding of positions as all neighbors do.
            let tolerance = if estimator == Estimator::Rrht { 1e-4 } else { 1e-5 };
            assert!(
                angle(found, normal) < tolerance,
                "{} {}",
                estimator.name(),
                angle(found, normal)
            );
        }
    }
}

#[test]
fn degenerate_neighborhoods_have_unit_normals() {
    let place = vec![Vec3::ONE; 30];
    let line: Vec<Vec3> = (0..30).map(|i| Vec3::new(1.0, 2.0, 3.0) * (i * i) as f32).collect();
    for estimator in Estimator::ALL {
        for n_points in [1, 2, 3, 30] {
            assert!(
                estimate_all(&place[..n_points], 6, estimator)
                    .iter()
                    .all(|&normal| normal == Vec3::Z)
            );
            for normal in estimate_all(&line[..n_points], 6, estimator) {
                assert!((normal.length() - 1.0).abs() < 1e-6);
                if n_points > 1 {
                    assert!(
                        normal.dot(Vec3::new(1.0, 2.0, 3.0)).abs() < 1e-5,
                        "{}",
                        estimator.name()
                    );
                }
            }
        }
        assert!(estimate_all(&[], 6, estimator).is_empty());
    }
}

#[test]
fn pca_of_four_points_by_hand() {
    // The plane z = 0 fits the square's corners best when they lie 0.1 above and below it in turn.
    let positions = [
        Vec3::new(1.0, 1.0, 0.1),
        Vec3::new(-1.0, 1.0, -0.1),
        Vec3::new(-1.0, -1.0, 0.1),
        Vec3::new(1.0, -1.0, -0.1),
    ];
    for normal in estimate_all(&positions, 3, Estimator::Pca) {
        assert!(angle(normal, Vec3::Z) < 1e-6);
    }
}

/// Equation 3 as the paper has it: the four midpoints, each projected onto the line.
fn literal_distance(p_j: DVec3, p_k: DVec3, n_j: DVec3, n_k: DVec3) -> f64 {
    let direction = (p_k - p_j).normalize();
    let mut largest: f64 = 0.0;
    for r in [-1.0, 1.0] {
        for s in [-1.0, 1.0] {
            let middle = 0.5 * (p_j + r * n_j + p_k + s * n_k);
            let foot = p_j + (middle - p_j).dot(direction) * direction;
            largest = largest.max((middle - foot).length());
        }
    }
    largest
}

/// Equations 2–4 by nalgebra and the literal distance, from initial normals.
fn literal_obne(cloud: &PointCloud, neighbors: &Neighbors, initial: &[Vec3], point: usize) -> Vec3 {
    let position = |id: u32| cloud.positions()[id as usize].as_dvec3();
    let row = neighbors.of(point);
    let mut all: Vec<u32> = row.to_vec();
    all.push(point as u32);
    let mut rho: f64 = 0.0;
    for &j in &all {
        for &k in &all {
            rho = rho.max((position(j) - position(k)).length() / 2.0);
        }
    }
    let mut matrix = nalgebra::Matrix3::zeros();
    for &j in row {
        for &k in row {
            if j != k {
                let edge = position(j) - position(k);
                let (n_j, n_k) = (initial[j as usize].as_dvec3(), initial[k as usize].as_dvec3());
                let w = (-edge.length_squared() / (rho * rho)).exp();
                let d_bar = literal_distance(position(j), position(k), n_j, n_k);
                let d = 1.0 - n_j.dot(n_k).abs() * d_bar / (1.0 + edge.length() / f64::from(cloud.diagonal()));
                let edge = nalgebra::Vector3::from(edge.to_array());
                matrix += (w + d) * edge * edge.transpose();
            }
        }
    }
    let eigen = nalgebra::SymmetricEigen::new(matrix);
    let smallest = eigen.eigenvalues.imin();
    let vector = eigen.eigenvectors.column(smallest);
    DVec3::new(vector[0], vector[1], vector[2]).as_vec3()
}

fn scattered() -> impl Strategy<Value = Vec<Vec3>> {
    // A rough sheet, so that the smallest eigenvalue stands apart.
    prop::collection::vec(
        (-1.0_f32..1.0, -1.0_f32..1.0, -0.1_f32..0.1).prop_map(Vec3::from),
        10..40,
    )
}

proptest! {
    #[test]
    fn obne_is_the_papers(positions in scattered()) {
        let cloud = PointCloud::new(DVec3::ZERO, positions).unwrap();
        let neighbors = Neighbors::find(&cloud, 8, &Silent).unwrap();
        let initial = wpca(&cloud, &neighbors, 8, &Silent).unwrap();
        let found = obne(&cloud, &neighbors, 8, &initial, &Silent).unwrap();
        for (point, &normal) in found.iter().enumerate() {
            prop_assert!(angle(normal, literal_obne(&cloud, &neighbors, &initial, point)) < 1e-3);
        }
    }

    #[test]
    fn normals_turn_with_the_cloud(
        positions in scattered(),
        axis in (-1.0_f64..1.0, -1.0_f64..1.0, 0.1_f64..1.0),
        angle_turned in 0.0_f64..6.0,
        scale in 0.01_f64..100.0,
    ) {
        let rotation = DMat3::from_axis_angle(DVec3::from(axis).normalize(), angle_turned);
        let moved: Vec<Vec3> =
            positions.iter().map(|position| (rotation * position.as_dvec3() * scale).as_vec3()).collect();
        // The diagonal of the bounding box turns with nothing, so OBNE only keeps its normals nearly.
        for (estimator, tolerance) in [(Estimator::Pca, 1e-3), (Estimator::Wpca, 1e-3), (Estimator::Obne, 0.2)] {
            let before = estimate_all(&positions, 8, estimator);
            let after = estimate_all(&moved, 8, estimator);
            for (a, b) in before.iter().zip(after) {
                let expect = (rotation * a.as_dvec3()).as_vec3();
                prop_assert!(angle(expect, b) < tolerance, "{} {}", estimator.name(), angle(expect, b));
            }
        }
    }
}

#[test]
fn does_not_depend_on_threads() {
    let positions: Vec<Vec3> = (0..5000_u64)
        .map(|i| {
            Vec3::new(
                (i * 7919 % 1009) as f32,
                (i * 104_729 % 1013) as f32,
                (i * 1_299_709 % 7) as f32,
            )
        })
        .collect();
    for estimator in Estimator::ALL {
        let with_threads = |n_threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
            pool.install(|| estimate_all(&positions, 8, estimator))
        };
        assert_eq!(with_threads(1), with_threads(4));
    }
}

#[test]
fn rrht_keeps_an_edge_that_pca_rounds() {
    // Two faces of a roof at 90°, far from their ends.
    let face = |u: f32, v: f32, side: f32| Vec3::new(v, u * side, -u);
    let positions: Vec<Vec3> = (0..1600)
        .flat_map(|i| {
            let (u, v) = ((i % 20) as f32 + 0.5, (i / 20) as f32 + 0.01 * (i % 7) as f32);
            [face(u, v, 1.0), face(u, v, -1.0)]
        })
        .collect();
    let worst = |estimator: Estimator, k| {
        let normals = estimate_all(&positions, k, estimator);
        let near_edge =
            (0..positions.len()).filter(|&i| positions[i].z > -3.0 && (10.0..60.0).contains(&positions[i].x));
        near_edge
            .map(|i| {
                angle(
                    normals[i],
                    Vec3::new(0.0, if positions[i].y > 0.0 { 1.0 } else { -1.0 }, 1.0),
                )
            })
            .fold(0.0, f32::max)
    };
    assert!(worst(Estimator::Pca, 24) > 0.3, "{}", worst(Estimator::Pca, 24));
    assert!(worst(Estimator::Rrht, 24) < 0.1, "{}", worst(Estimator::Rrht, 24));
}
