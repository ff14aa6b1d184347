use glam::{DMat3, DVec3};

use super::*;
use crate::{Silent, metrics, shapes};

/// A flat grid of `side × side` points, and a second one a unit above when `sheets` is 2.
fn sheets(side: usize, sheets: usize) -> PointCloud {
    let positions = (0..side * side * sheets)
        .map(|i| {
            let (sheet, i) = (i / (side * side), i % (side * side));
            // Sheared a little, so that distances are not all equal.
            Vec3::new(
                (i % side) as f32 + 0.3 * (i / side) as f32,
                (i / side) as f32,
                sheet as f32 * 1000.0,
            )
        })
        .collect();
    PointCloud::new(DVec3::ZERO, positions).unwrap()
}

fn propagate(cloud: &PointCloud, given: Option<&[Vec3]>, start: Start) -> Propagation {
    let parameters = Parameters {
        start,
        ..Parameters::default()
    };
    Propagation::new(cloud, given, parameters, &Silent).unwrap()
}

fn of_preset(cloud: &PointCloud, preset: Preset) -> Propagation {
    Propagation::new(cloud, None, preset.parameters(), &Silent).unwrap()
}

#[test]
fn each_component_starts_upward() {
    let cloud = sheets(12, 2);
    let tree: &[Stage] = &[Stage::Neighbors, Stage::Normals, Stage::Graph, Stage::Tree];
    let auto: &[Stage] = &[
        Stage::Neighbors,
        Stage::Normals,
        Stage::Evidence,
        Stage::Agglomeration,
        Stage::Tree,
    ];
    for (preset, expect) in [(Preset::Tree, tree), (Preset::Auto, auto)] {
        let propagation = of_preset(&cloud, preset);
        assert_eq!(propagation.tree.roots().len(), 2);
        assert_eq!(propagation.base_regions.n_base_regions(), 2);
        let n_up = (propagation.initial_normals().iter())
            .filter(|normal| normal.z > 0.999)
            .count();
        assert_eq!(n_up, cloud.n_points(), "{}", preset.name());
        let stages: Vec<Stage> = propagation.seconds.iter().map(|(stage, _)| *stage).collect();
        assert_eq!(stages, expect);
    }
}

#[test]
fn given_normals_are_kept_bit_by_bit() {
    let cloud = sheets(15, 1);
    // Not smooth, not quite unit, of mixed signs.
    let given: Vec<Vec3> = (0..225)
        .map(|i| {
            let normal = Vec3::new((i as f32).sin(), (i as f32 * 1.7).cos(), 1.5).normalize_or_zero();
            normal * if i % 7 < 3 { -1.0002 } else { 1.0001 }
        })
        .collect();
    let propagation = propagate(&cloud, Some(&given), Start::Keep);
    assert_eq!(propagation.initial_normals(), given);
    assert!(propagation.base_regions.n_base_regions() > propagation.tree.roots().len());
}

#[test]
fn other_lengths_are_normalized() {
    let cloud = sheets(5, 1);
    let given = vec![Vec3::new(0.0, 0.0, -1e-30); 25];
    let propagation = propagate(&cloud, Some(&given), Start::Keep);
    assert!(
        propagation
            .initial_normals()
            .iter()
            .all(|&normal| normal == Vec3::NEG_Z)
    );
}

#[test]
fn missing_normals_take_the_sign_that_reaches_them() {
    let cloud = sheets(20, 2);
    // On the first sheet a few downward normals, on the second none.
    let mut given = vec![Vec3::ZERO; 800];
    for point in [3, 250, 399] {
        given[point] = Vec3::NEG_Z;
    }
    given[7] = Vec3::NAN;
    let propagation = propagate(&cloud, Some(&given), Start::Keep);
    let oriented = propagation.initial_normals();
    assert!(oriented[..400].iter().all(|normal| normal.z < -0.999));
    assert!(oriented[400..].iter().all(|normal| normal.z > 0.999));
    assert_eq!(
        propagation.base_regions.n_base_regions(),
        propagation.tree.roots().len()
    );
}

#[test]
fn given_signs_that_meet_across_missing_ones_are_cut_apart() {
    let cloud = sheets(20, 1);
    let mut given = vec![Vec3::ZERO; 400];
    let up = [0, 5, 200, 211];
    let down = [19, 30, 222, 399];
    for point in up {
        given[point] = Vec3::Z;
    }
    for point in down {
        given[point] = Vec3::NEG_Z;
    }
    let propagation = propagate(&cloud, Some(&given), Start::Keep);
    let oriented = propagation.initial_normals();
    assert!(up.iter().all(|&point| oriented[point] == Vec3::Z));
    assert!(down.iter().all(|&point| oriented[point] == Vec3::NEG_Z));
    assert!(oriented.iter().all(|normal| normal.z.abs() > 0.999));
    let n_cuts = propagation.base_regions.n_base_regions() - propagation.tree.roots().len();
    assert!((1..8).contains(&n_cuts), "{n_cuts}");
}

#[test]
fn keep_without_given_normals_estimates() {
    let cloud = sheets(10, 1);
    let kept = propagate(&cloud, None, Start::Keep);
    let estimated = propagate(&cloud, None, Start::Estimate);
    assert_eq!(kept.normals, estimated.normals);
    assert_eq!(kept.base_regions.orientation(), estimated.base_regions.orientation());
    // Neither do given normals of which none can be used change anything.
    let useless = vec![Vec3::ZERO; 100];
    let kept = propagate(&cloud, Some(&useless), Start::Keep);
    assert_eq!(kept.default_sources, estimated.default_sources);
    assert_eq!(kept.base_regions.orientation(), estimated.base_regions.orientation());
    // With the other start, given normals don't count.
    let given = vec![Vec3::X; 100];
    let ignored = propagate(&cloud, Some(&given), Start::Estimate);
    assert_eq!(ignored.normals, estimated.normals);
}

#[test]
fn the_largest_given_region_has_the_default_source() {
    let shape = shapes::sphere(2000);
    let cloud = PointCloud::new(DVec3::ZERO, shape.positions).unwrap();
    let is_wrong = |normal: Vec3| normal.z > 0.6;
    let given: Vec<Vec3> = (shape.normals.iter())
        .map(|&normal| if is_wrong(normal) { -normal } else { normal })
        .collect();
    let propagation = propagate(&cloud, Some(&given), Start::Keep);
    let [default] = propagation.default_sources[..] else {
        panic!("one component has one default source")
    };
    assert!(!is_wrong(shape.normals[default as usize]));

    // A click on the wrong cap turns a region of it whole, one elsewhere no more than a part of the right region.
    let mut document = crate::Document::new(Arc::new(cloud), Some(Arc::new(given)));
    document.install(propagation);
    let base_regions = &document.propagation().unwrap().base_regions;
    for point in (0..2000).filter(|&point| point != default) {
        let n_turned = document.preview_mend(point).unwrap().n_points();
        let n_region = base_regions.region_of(point).n_points();
        if base_regions.in_one_region(point, default) {
            assert!(n_turned < n_region, "{point}: {n_turned}");
        } else {
            assert_eq!(n_turned, n_region);
        }
    }
}

#[test]
fn very_small_clouds() {
    for n_points in 0..6 {
        for spread in [0.0, 1.0] {
            let positions: Vec<Vec3> = (0..n_points)
                .map(|i| Vec3::new(i as f32, (i * i) as f32, 0.0) * spread)
                .collect();
            let cloud = PointCloud::new(DVec3::ZERO, positions).unwrap();
            for preset in [Preset::Auto, Preset::Tree] {
                let propagation = of_preset(&cloud, preset);
                assert_eq!(propagation.normals.len(), n_points);
                assert!(propagation.normals.iter().all(|normal| normal.is_normalized()));
                assert!(
                    propagation
                        .splat_radii
                        .iter()
                        .all(|&radius| radius > 0.0 && radius.is_finite())
                );
                assert_eq!(propagation.tree.roots().len(), n_points.min(1), "{}", preset.name());
            }
        }
    }
}

#[test]
fn radii_close_the_surface_but_no_outlier_covers_it() {
    let mut positions: Vec<Vec3> = sheets(20, 1).positions().to_vec();
    positions.push(Vec3::new(0.0, 0.0, 500.0));
    // Seven more copies of one point.
    positions.extend([positions[210]; 7]);
    let cloud = PointCloud::new(DVec3::ZERO, positions).unwrap();
    let radii = propagate(&cloud, None, Start::Estimate).splat_radii;
    for (point, &radius) in radii.iter().enumerate() {
        assert!((0.7..10.0).contains(&radius), "{point}: {radius}");
    }
}

#[test]
fn ks_outside_their_range_count_as_the_nearest() {
    let cloud = sheets(10, 1);
    let parameters = Parameters {
        k_normals: 0,
        k_graph: 0,
        ..Preset::Tree.parameters()
    };
    let low = Propagation::new(&cloud, None, parameters, &Silent).unwrap();
    assert_eq!(low.parameters, parameters);
    let parameters = Parameters {
        k_normals: 3,
        k_graph: 1,
        ..Preset::Tree.parameters()
    };
    let nearest = Propagation::new(&cloud, None, parameters, &Silent).unwrap();
    assert_eq!(low.normals, nearest.normals);
    assert_eq!(low.tree.order(), nearest.tree.order());
}

#[test]
fn cancels_in_every_stage() {
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Cancels at the n-th report.
    struct StopAt(usize, AtomicUsize);
    impl Progress for StopAt {
        fn report(&self, fraction: f32) -> Result<(), Cancelled> {
            assert!((0.0..=1.0).contains(&fraction));
            let count = self.1.fetch_add(1, Ordering::Relaxed);
            if count >= self.0 { Err(Cancelled) } else { Ok(()) }
        }
    }
    let cloud = sheets(40, 1);
    for preset in [Preset::Auto, Preset::Tree] {
        let run = |stop| {
            let progress = StopAt(stop, AtomicUsize::new(0));
            let result = Propagation::new(&cloud, None, preset.parameters(), &progress);
            (result.map(drop), progress.1.into_inner())
        };
        let (result, n_reports) = run(usize::MAX);
        result.unwrap();
        for stop in 0..n_reports {
            assert_eq!(run(stop).0, Err(Cancelled), "{}: report {stop}", preset.name());
        }
    }
}

/// A cloud without ties on which the start is wrong in about half of the points, so that a different tree would show.
fn hard_cloud() -> Vec<Vec3> {
    shapes::thin_plate(6000, 0.04).with_noise(0.003, 5).positions
}

fn start(positions: &[Vec3], estimator: Estimator) -> Vec<Vec3> {
    let cloud = PointCloud::new(DVec3::ZERO, positions.to_vec()).unwrap();
    let parameters = Parameters {
        estimator,
        ..Preset::Tree.parameters()
    };
    Propagation::new(&cloud, None, parameters, &Silent)
        .unwrap()
        .initial_normals()
}

#[test]
fn does_not_depend_on_the_order_of_points() {
    let positions = hard_cloud();
    // 6007 is prime, so multiples of 1009 visit every id.
    let ids: Vec<usize> = (1..6007)
        .map(|i| i * 1009 % 6007)
        .filter(|&id| id > 0 && id <= 6000)
        .map(|id| id - 1)
        .collect();
    let shuffled: Vec<Vec3> = ids.iter().map(|&id| positions[id]).collect();
    assert_eq!(shuffled.len(), 6000);
    for estimator in Estimator::ALL {
        let (before, after) = (start(&positions, estimator), start(&shuffled, estimator));
        for (&id, normal) in ids.iter().zip(after) {
            assert_eq!(normal, before[id], "{} {id}", estimator.name());
        }
    }
}

#[test]
fn does_not_depend_on_the_unit() {
    let positions = hard_cloud();
    for estimator in Estimator::ALL {
        for factor in [2.0_f32.powi(-30), 2.0_f32.powi(20)] {
            let scaled: Vec<Vec3> = positions.iter().map(|&position| position * factor).collect();
            assert_eq!(
                start(&positions, estimator),
                start(&scaled, estimator),
                "{}",
                estimator.name()
            );
        }
    }
}

#[test]
fn does_not_depend_on_the_number_of_threads() {
    let positions = hard_cloud();
    for estimator in Estimator::ALL {
        let with_threads = |n_threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
            pool.install(|| start(&positions, estimator))
        };
        assert_eq!(with_threads(1), with_threads(4), "{}", estimator.name());
    }
}

#[test]
fn does_not_depend_on_rotation() {
    let shape = shapes::fandisk_like(6000).with_noise(0.001, 5);
    for (axis, angle) in [
        (DVec3::new(1.0, 2.0, 3.0), 1.0),
        (DVec3::X, 2.5),
        (DVec3::new(-1.0, 1.0, 0.1), 4.0),
    ] {
        let rotation = DMat3::from_axis_angle(axis.normalize(), angle);
        let rotate = |vectors: &[Vec3], scale: f64| -> Vec<Vec3> {
            vectors
                .iter()
                .map(|vector| (rotation * vector.as_dvec3() * scale).as_vec3())
                .collect()
        };
        let cloud = PointCloud::new(DVec3::ZERO, rotate(&shape.positions, 3.7)).unwrap();
        let reference = rotate(&shape.normals, 1.0);
        for estimator in [Estimator::Pca, Estimator::Obne] {
            let normals = start(cloud.positions(), estimator);
            let comparison = metrics::compare(&cloud, &reference, &normals, &Silent).unwrap();
            assert!(comparison.n_wrong <= 6, "{} {}", estimator.name(), comparison.n_wrong);
        }
    }
}

#[test]
fn voted_sources_decide_the_sides() {
    let shape = shapes::torus(4000);
    let cloud = PointCloud::new(DVec3::ZERO, shape.positions).unwrap();
    for preset in [Preset::Tree, Preset::Paper] {
        let propagation = Propagation::new(&cloud, None, preset.parameters(), &Silent).unwrap();
        let is_voted = preset == Preset::Paper;
        assert_eq!(propagation.voted_sources.is_empty(), !is_voted);
        assert_eq!(
            propagation.base_regions.n_regions(),
            propagation.voted_sources.len().max(1)
        );
        assert_eq!(
            propagation.seconds.iter().any(|(stage, _)| *stage == Stage::Sources),
            is_voted
        );
        let oriented = propagation.initial_normals();
        for source in propagation.voted_sources.iter() {
            assert_eq!(oriented[source.point as usize], source.normal);
            assert_eq!(propagation.voted_source(source.point), Some(*source));
        }
        let comparison = metrics::compare(&cloud, &shape.normals, &oriented, &Silent).unwrap();
        // Corners of the bounding box see a little of the tube's inside through the hole.
        let n_allowed = if is_voted { 100 } else { 0 };
        assert!(
            comparison.n_wrong <= n_allowed,
            "{}: {}",
            preset.name(),
            comparison.n_wrong
        );
    }
}

#[test]
fn given_signs_need_no_votes() {
    let shape = shapes::sphere(500);
    let cloud = PointCloud::new(DVec3::ZERO, shape.positions).unwrap();
    let parameters = Parameters {
        start: Start::Keep,
        ..Preset::Paper.parameters()
    };
    let inward: Vec<Vec3> = shape.normals.iter().map(|&normal| -normal).collect();
    let propagation = Propagation::new(&cloud, Some(inward.as_slice()), parameters, &Silent).unwrap();
    assert!(propagation.voted_sources.is_empty());
    assert_eq!(propagation.initial_normals(), inward);
}
