use glam::{DVec3, Quat};
use proptest::prelude::*;

use super::super::UNIT;
use super::*;
use crate::shapes::{self, Shape, ShapeKind};
use crate::{Estimator, Silent, normals};

/// Votes on the normals of a shape from 32 axes.
fn votes(shape: &Shape) -> Vec<Vote> {
    let cloud = PointCloud::new(DVec3::ZERO, shape.positions.clone()).unwrap();
    let neighbors = Neighbors::find(&cloud, 16, &Silent).unwrap();
    let reach = |point: usize| {
        let sixth = neighbors.of(point).iter().take(6).next_back().copied().unwrap_or(0);
        shape.positions[point].distance(shape.positions[sixth as usize])
    };
    let radii: Vec<f32> = (0..cloud.n_points()).map(reach).collect();
    let evidence = crossings(&cloud, &neighbors, &radii, &shape.normals, MOST_AXES, &Silent).unwrap();
    assert_eq!(evidence.origins(), [Origin::Crossings]);
    assert!(evidence.votes().iter().all(|vote| vote.signed.abs() <= vote.weight));
    evidence.votes().to_vec()
}

/// Among votes of some weight for `normals`: how many there are, and how many of them are against `truth`.
fn verdict(votes: &[Vote], normals: &[Vec3], truth: &[Vec3]) -> (usize, usize) {
    let mut counts = (0, 0);
    for ((vote, normal), truth) in votes.iter().zip(normals).zip(truth) {
        if vote.weight > UNIT * 3 / 10 {
            counts.0 += 1;
            counts.1 += usize::from((vote.signed > 0) != (normal.dot(*truth) > 0.0));
        }
    }
    counts
}

/// Every second normal turned over: estimated ones are of any sign.
fn some_turned(truth: &[Vec3]) -> Vec<Vec3> {
    let turn = |(point, &normal): (usize, &Vec3)| if point % 2 == 0 { normal } else { -normal };
    truth.iter().enumerate().map(turn).collect()
}

/// Asserts that at least the share `voted` of the points have votes, and at most the share `wrong` of these are wrong.
fn check(name: &str, shape: &Shape, voted: f64, wrong: f64) {
    let normals = some_turned(&shape.normals);
    let votes = votes(&Shape {
        positions: shape.positions.clone(),
        normals: normals.clone(),
    });
    let (n_voted, n_wrong) = verdict(&votes, &normals, &shape.normals);
    assert!(
        n_voted as f64 >= voted * votes.len() as f64 && n_wrong as f64 <= wrong * n_voted as f64,
        "{name}: {n_voted} of {} voted, {n_wrong} wrong",
        votes.len()
    );
}

fn sphere(n_points: usize, radius: f32, outward: f32) -> Shape {
    let mut shape = shapes::sphere(n_points);
    shape.positions.iter_mut().for_each(|position| *position *= radius);
    shape.normals.iter_mut().for_each(|normal| *normal *= outward);
    shape
}

fn join(shapes: impl IntoIterator<Item = Shape>) -> Shape {
    shapes.into_iter().fold(Shape::default(), |mut all, shape| {
        all.positions.extend(shape.positions);
        all.normals.extend(shape.normals);
        all
    })
}

/// A shape with three unequal axes whose points are at no regular places.
fn odd_shape() -> Shape {
    let mut shape = shapes::torus(6000).with_noise(0.0005, 3);
    for position in &mut shape.positions {
        *position += Vec3::new(0.3 * position.x.abs(), 0.25 * position.x, 0.0);
    }
    shape
}

#[test]
fn closed_shapes_are_right() {
    for kind in ShapeKind::ALL {
        check(kind.name(), &kind.generate(20_000), 0.9, 0.002);
    }
}

#[test]
fn hidden_sheets_are_right() {
    // A ball in the cavity of a shell: no view from outside sees the cavity or the ball.
    let nested = join([
        sphere(20_000, 1.0, 1.0),
        sphere(10_000, 0.7, -1.0),
        sphere(4000, 0.4, 1.0),
    ]);
    check("nested", &nested, 0.99, 0.0);
}

#[test]
fn a_body_thinner_than_its_spacing_is_right() {
    // 10 000 points on both sides have a spacing of 0.02.
    check("blade", &shapes::thin_plate(10_000, 0.015), 0.85, 0.01);
}

#[test]
fn a_noisy_body_is_right() {
    // Noise of a spacing is in the way of the tight tolerances.
    let exact = shapes::sphere(20_000);
    let noisy = exact.clone().with_noise(0.007, 5);
    let cloud = PointCloud::new(DVec3::ZERO, noisy.positions.clone()).unwrap();
    let neighbors = Neighbors::find(&cloud, 24, &Silent).unwrap();
    let normals = normals::estimate(&cloud, &neighbors, 24, Estimator::Pca, &Silent).unwrap();
    let votes = votes(&Shape {
        positions: noisy.positions,
        normals: normals.clone(),
    });
    let (n_voted, n_wrong) = verdict(&votes, &normals, &exact.normals);
    assert!(
        n_voted > 16_000 && n_wrong < n_voted / 50,
        "{n_voted} voted, {n_wrong} wrong"
    );
}

#[test]
fn an_open_sheet_does_not_vote() {
    let positions: Vec<Vec3> = (0..10_000)
        .map(|i| Vec3::new((i % 125) as f32, (i / 125) as f32, 0.0))
        .collect();
    let normals = vec![Vec3::Z; positions.len()];
    let votes = votes(&Shape { positions, normals });
    assert!(votes.iter().all(|&vote| vote == Vote::default()));
}

#[test]
fn a_point_far_away_does_not_blind() {
    let mut shape = shapes::sphere(5000);
    shape.positions.push(Vec3::new(2e4, -1e4, 5e3));
    shape.normals.push(Vec3::Z);
    // All but that point vote; pixels are not larger for it.
    check("far", &shape, 0.99, 0.0);
}

#[test]
fn few_points_and_no_extent() {
    for n_points in 0..6 {
        assert_eq!(votes(&shapes::sphere(n_points)).len(), n_points);
    }
    let cloud = PointCloud::new(DVec3::ZERO, vec![Vec3::ONE; 40]).unwrap();
    let neighbors = Neighbors::find(&cloud, 6, &Silent).unwrap();
    let evidence = crossings(&cloud, &neighbors, &[1.0; 40], &[Vec3::Z; 40], 32, &Silent).unwrap();
    assert!(evidence.votes().iter().all(|&vote| vote == Vote::default()));
}

#[test]
fn the_order_of_points_and_the_number_of_threads_change_nothing() {
    // Enough points for several bands.
    let shape = join([odd_shape(), sphere(40_000, 5.0, 1.0)]).with_noise(0.0001, 1);
    let n_points = shape.positions.len();
    let expect = votes(&shape);
    let order: Vec<usize> = (0..n_points).map(|i| i * 2957 % n_points).collect();
    let shuffled = votes(&Shape {
        positions: order.iter().map(|&point| shape.positions[point]).collect(),
        normals: order.iter().map(|&point| shape.normals[point]).collect(),
    });
    for (&point, vote) in order.iter().zip(&shuffled) {
        assert_eq!(*vote, expect[point]);
    }
    let single = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(single.install(|| votes(&shape)), expect);
}

#[test]
fn cancelled_when_asked() {
    struct Stop;
    impl Progress for Stop {
        fn report(&self, fraction: f32) -> Result<(), Cancelled> {
            if fraction > 0.5 { Err(Cancelled) } else { Ok(()) }
        }
    }
    let shape = shapes::sphere(2000);
    let cloud = PointCloud::new(DVec3::ZERO, shape.positions).unwrap();
    let neighbors = Neighbors::find(&cloud, 6, &Silent).unwrap();
    let result = crossings(&cloud, &neighbors, &[0.1; 2000], &shape.normals, 32, &Stop);
    assert_eq!(result, Err(Cancelled));
}

#[test]
fn the_tightest_unanimous_tolerance_is_taken() {
    let cloud = PointCloud::new(DVec3::ZERO, (0..4).map(|x| Vec3::X * x as f32).collect()).unwrap();
    let neighbors = Neighbors::find(&cloud, 3, &Silent).unwrap();
    let check = |votes: [(i32, i32); TOLERANCES.len()], expect: (i32, i32)| {
        let votes = votes.map(|(signed, weight)| Vote { signed, weight });
        let mixed = mix(&[votes; 4], &[2, 0, 3, 1], &neighbors);
        assert_eq!(mixed.len(), 4);
        for vote in mixed {
            assert_eq!((vote.signed, vote.weight), expect);
        }
    };
    check([(-90, 100), (70, 70), (60, 60)], (-90, 100));
    check([(-50, 100), (70, 70), (60, 60)], (70, 70));
    check([(50, 100), (0, 70), (60, 60)], (60, 60));
    check([(50, 100), (0, 0), (-20, 60)], (0, 0));
    // Halfway between no trust and trust.
    check([(65, 100), (-100, 100), (0, 0)], (-18, 100));
}

#[test]
fn tallies_hold_both_sums() {
    let tally = Tally::default();
    for (signed, weight) in [(-5, 5), (3, 3), (-UNIT, UNIT)] {
        tally.add(Tally::packed(signed, weight));
    }
    assert_eq!(
        tally.into_vote(),
        Vote {
            signed: -UNIT - 2,
            weight: UNIT + 8
        }
    );
}

#[test]
fn few_axes_for_many_points() {
    let check = |n_points: usize, expect: usize| assert_eq!(crossing_axes(n_points), expect);
    check(0, 32);
    check(200_000, 32);
    check(400_000, 16);
    check(10_000_000, 8);
}

#[test]
fn bands_hold_every_disc_that_touches_them() {
    let shape = odd_shape();
    let shape = join(vec![shape; 8]);
    let cloud = PointCloud::new(DVec3::ZERO, shape.positions).unwrap();
    let scene = Scene::new(&cloud, &shape.normals, &vec![0.05; cloud.n_points()]);
    let view = View::along(&scene, Vec3::Z, PIXEL);
    let mut bands = Bands::default();
    bands.sort(&scene, &view);
    assert!(bands.n_bands() > 1);
    assert_eq!(bands.rows(0).start, 0);
    assert_eq!(bands.rows(bands.n_bands() - 1).end, view.height);
    for band in 0..bands.n_bands() {
        let rows = bands.rows(band);
        let found: Vec<usize> = (bands.of(band).iter())
            .map(|splat| splat.load(Relaxed) as usize)
            .collect();
        assert!(found.is_sorted_by(|a, b| a < b));
        let touches = |splat: &usize| {
            let (disc, _) = view.disc(&scene.splats[*splat]);
            let middle = rows.contains(&(disc.y as usize));
            middle
                || disc
                    .covered(view.width, view.height)
                    .any(|(row, _)| rows.contains(&row))
        };
        for splat in (0..scene.splats.len()).filter(touches) {
            assert!(found.binary_search(&splat).is_ok(), "{splat} in {rows:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]
    #[test]
    fn votes_turn_and_grow_with_the_cloud(
        axis in (-1.0_f32..1.0, -1.0_f32..1.0, 0.1_f32..1.0),
        angle in 0.0_f32..6.0,
        exponent in -20_i32..20,
        stretch in 1.0_f32..2.0,
    ) {
        let shape = odd_shape();
        let expect = votes(&shape);
        let rotation = Quat::from_axis_angle(Vec3::from(axis).try_normalize().unwrap(), angle);
        let scale = stretch * 2.0_f32.powi(exponent);
        let moved = votes(&Shape {
            positions: shape.positions.iter().map(|&position| rotation * position * scale).collect(),
            normals: shape.normals.iter().map(|&normal| rotation * normal).collect(),
        });
        // Rounding moves a few discs across the middle of a pixel.
        let differs = |(a, b): (&Vote, &Vote)| (a.pull() - b.pull()).abs() > 0.1;
        let n_different = expect.iter().zip(&moved).filter(|&pair| differs(pair)).count();
        prop_assert!(n_different < 60, "{n_different}");
    }
}
