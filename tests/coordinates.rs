//! Coordinates of any origin, extent and unit: what is found does not depend on them, and files keep every digit.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::fmt::Write as _;
use std::fs;
use std::process::{Command, Stdio};

use glam::{DVec3, Vec3};
use normend_core::{Estimator, Neighbors, PointCloud, Preset, Propagation, Silent, normals, shapes};
use normend_render::HeadlessDevice;
use tempfile::TempDir;

/// A corner of the world in UTM: easting, northing, height, with millimeters.
const CORNER: DVec3 = DVec3::new(500_000.123, 4_500_000.456, 78.901);

/// A bumpy square of `side × side` points, `spacing` apart, shaken by a fifth of that, from whole steps of a pseudo random number.
fn bumpy(side: u32, spacing: f64) -> Vec<DVec3> {
    let shake = |i: u32, salt: u32| {
        let mixed = (i.wrapping_mul(0x9E37_79B1) ^ salt).wrapping_mul(0x85EB_CA77);
        f64::from((mixed ^ mixed >> 15).wrapping_mul(0xC2B2_AE3D) >> 8) / f64::from(1 << 24) - 0.5
    };
    (0..side * side)
        .map(|i| {
            let (x, y) = (
                f64::from(i % side) + 0.4 * shake(i, 1),
                f64::from(i / side) + 0.4 * shake(i, 2),
            );
            let height = 6.0 * (0.15 * x).sin() * (0.11 * y).cos() + 0.1 * shake(i, 3);
            DVec3::new(x, y, height) * spacing
        })
        .collect()
}

/// Mean and largest angle between two lists of lines, in degrees.
fn angles(a: &[Vec3], b: &[Vec3]) -> (f64, f64) {
    let angles = a
        .iter()
        .zip(b)
        .map(|(a, b)| a.as_dvec3().cross(b.as_dvec3()).length().min(1.0).asin().to_degrees());
    let (sum, largest) = angles.fold((0.0, 0.0_f64), |(sum, largest), angle| {
        (sum + angle, largest.max(angle))
    });
    (sum / a.len() as f64, largest)
}

#[test]
fn neighbors_and_normals_are_those_of_f64_whatever_the_extent() {
    println!("extent m, spacing mm: share of equal neighbors, mean and largest angle in degrees; of f32 alone");
    for (extent, spacing) in [
        (1e3, 1e-3),
        (1e3, 1e-2),
        (1e4, 1e-3),
        (1e4, 1e-2),
        (1e5, 1e-3),
        (1e5, 1e-2),
    ] {
        let local = bumpy(60, spacing);
        let n_points = local.len();
        // Some far points span the extent.
        let far = [DVec3::X, DVec3::NEG_X, DVec3::Y].map(|axis| CORNER + 0.5 * extent * axis);
        let points: Vec<DVec3> = local.iter().map(|&place| CORNER + place).chain(far).collect();
        let wide = PointCloud::from_f64(&points).unwrap();
        let single = PointCloud::new(wide.origin(), wide.positions().to_vec()).unwrap();
        let near = PointCloud::from_f64(&local).unwrap();
        let rows = |cloud: &PointCloud| Neighbors::find(cloud, 12, &Silent).unwrap();
        let (expect, found, of_single) = (rows(&near), rows(&wide), rows(&single));
        let share_equal = |found: &Neighbors| {
            let equal = (0..n_points).filter(|&point| {
                let row = |neighbors: &Neighbors| {
                    let mut row = neighbors.of(point).to_vec();
                    row.sort_unstable();
                    row
                };
                row(&expect) == row(found)
            });
            equal.count() as f64 / n_points as f64
        };
        for estimator in Estimator::ALL {
            let of = |cloud: &PointCloud, neighbors: &Neighbors| {
                let mut normals = normals::estimate(cloud, neighbors, 12, estimator, &Silent).unwrap();
                normals.truncate(n_points);
                normals
            };
            let right = of(&near, &expect);
            let (mean, largest) = angles(&right, &of(&wide, &found));
            let (mean_single, largest_single) = angles(&right, &of(&single, &of_single));
            println!(
                "{extent:e}, {}, {}: {:.4}, {mean:.5}, {largest:.4}; {:.4}, {mean_single:.4}, {largest_single:.3}",
                spacing * 1e3,
                estimator.name(),
                share_equal(&found),
                share_equal(&of_single)
            );
            // The transform votes in bins, so a few of its normals jump.
            let most = if estimator == Estimator::Rrht { 2.0 } else { 0.35 };
            assert!(mean < most, "{} {extent} {spacing}: {mean}", estimator.name());
        }
        assert!(share_equal(&found) > 0.8, "{extent} {spacing}");
    }
}

#[test]
fn georeferenced_millimeters_give_the_normals_of_the_local_cloud() {
    // Where f32 alone holds enough: 60 m at 4,500,000 m, with points that are a millimeter off a plane.
    let local: Vec<DVec3> = bumpy(200, 0.3)
        .into_iter()
        .map(|place| (place * 1000.0).round() / 1000.0)
        .collect();
    let near = PointCloud::from_f64(&local).unwrap();
    let points: Vec<DVec3> = local.iter().map(|&place| CORNER + place).collect();
    let far = PointCloud::from_f64(&points).unwrap();
    assert!(!far.has_remainders());
    for preset in Preset::ALL {
        let of = |cloud: &PointCloud| {
            Propagation::new(cloud, None, preset.parameters(), &Silent)
                .unwrap()
                .initial_normals()
        };
        let (a, b) = (of(&near), of(&far));
        let n_opposite = a.iter().zip(&b).filter(|(a, b)| a.dot(**b) < 0.0).count();
        let (mean, _) = angles(&a, &b);
        assert!(
            n_opposite == 0 && mean < 0.02,
            "{}: {n_opposite} opposite, {mean}°",
            preset.name()
        );
    }
}

#[test]
fn the_unit_changes_no_sign() {
    for shape in [
        shapes::torus(4000),
        shapes::fandisk_like(5000),
        shapes::sphere(3000).with_noise(0.01, 7),
        shapes::thin_plate(4000, 0.04),
    ] {
        // The tree alone does not decide between the sides of a thin plate.
        let is_thin = shape.positions.len() == 4000 && shape.positions.iter().all(|place| place.z.abs() < 0.1);
        for preset in Preset::ALL
            .into_iter()
            .filter(|&preset| !is_thin || preset == Preset::Auto)
        {
            let of = |factor: f64| {
                let points: Vec<DVec3> = shape.positions.iter().map(|place| place.as_dvec3() * factor).collect();
                let cloud = PointCloud::from_f64(&points).unwrap();
                Propagation::new(&cloud, None, preset.parameters(), &Silent)
                    .unwrap()
                    .initial_normals()
            };
            let plain = of(1.0);
            for factor in [1e-6, 1e6, 1e-12, 1e12] {
                let scaled = of(factor);
                let n_opposite = plain.iter().zip(&scaled).filter(|(a, b)| a.dot(**b) < 0.0).count();
                // Scaling rounds, so that what is undecided may fall the other way.
                assert!(
                    n_opposite <= plain.len() / 1000,
                    "{} times {factor}: {n_opposite} of {}",
                    preset.name(),
                    plain.len()
                );
            }
        }
    }
}

/// Runs the program in `folder`; it must succeed.
fn run(folder: &TempDir, typed: &str) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_normend"))
        .args(typed.split_whitespace())
        .current_dir(folder.path())
        .env("NORMEND_CONFIG_DIR", folder.path().join("config"))
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "normend {typed}: {err}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn every_digit_of_a_file_comes_out_again() {
    let folder = tempfile::tempdir().unwrap();
    let rows: Vec<String> = bumpy(30, 0.001)
        .into_iter()
        .map(|place| {
            let point = CORNER + place;
            format!("{:.4} {:.4} {:.4}", point.x, point.y, point.z)
        })
        // The same far away, so that f32 would merge points.
        .chain(["600000.0001 4500000.0001 0.0001".to_owned()])
        .collect();
    fs::write(folder.path().join("utm.xyz"), rows.join("\n") + "\n").unwrap();
    run(&folder, "orient utm.xyz -o out.xyz");
    let written = fs::read_to_string(folder.path().join("out.xyz")).unwrap();
    assert_eq!(written.lines().count(), rows.len());
    for (line, row) in written.lines().zip(&rows) {
        assert!(line.starts_with(&format!("{row} ")), "{line}");
    }
    let scan = normend_io::read(&folder.path().join("utm.xyz"), &Silent).unwrap();
    assert!(scan.cloud.has_remainders());
    for (point, row) in (0..).zip(&rows) {
        let coordinates: Vec<f64> = row.split(' ').map(|value| value.parse().unwrap()).collect();
        assert_eq!(scan.coordinates(point), Some(DVec3::from_slice(&coordinates)));
        let error =
            (scan.cloud.origin() + scan.cloud.relative(point as usize) - DVec3::from_slice(&coordinates)).length();
        assert!(error < 1e-4, "{error}");
    }
    assert_eq!(scan.coordinates(rows.len() as u32), None);
}

#[test]
fn a_picture_is_the_same_wherever_the_scan_is() {
    if let Err(error) = HeadlessDevice::new() {
        let required = std::env::var_os("NORMEND_REQUIRE_GPU").is_some_and(|value| value == "1");
        assert!(!required, "NORMEND_REQUIRE_GPU=1, but {error}");
        println!("skipped: {error}");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let shape = shapes::fandisk_like(20_000);
    let picture = |name: &str, corner: DVec3, unit: f64| {
        let mut text = "x y z nx ny nz\n".to_owned();
        for (place, normal) in shape.positions.iter().zip(&shape.normals) {
            let point = corner + place.as_dvec3() * unit;
            writeln!(
                text,
                "{} {} {} {} {} {}",
                point.x, point.y, point.z, normal.x, normal.y, normal.z
            )
            .unwrap();
        }
        fs::write(folder.path().join(format!("{name}.xyz")), text).unwrap();
        run(&folder, &format!("render {name}.xyz -o {name}.png --size 480x360"));
        image::open(folder.path().join(format!("{name}.png")))
            .unwrap()
            .to_rgb8()
    };
    let local = picture("local", DVec3::ZERO, 1.0);
    for (name, corner, unit) in [
        ("utm", CORNER, 1.0),
        ("utm_wide", CORNER, 1000.0),
        ("ten_million", DVec3::splat(1e7) + CORNER, 1.0),
        ("micro", DVec3::ZERO, 1e-6),
        ("mega", CORNER, 1e6),
    ] {
        let moved = picture(name, corner, unit);
        let differs = |(a, b): &(&image::Rgb<u8>, &image::Rgb<u8>)| (0..3).any(|i| a.0[i].abs_diff(b.0[i]) > 8);
        let n_different = local.pixels().zip(moved.pixels()).filter(differs).count();
        println!("{name}: {n_different} of {} pixels differ", 480 * 360);
        // Edges of discs that end exactly between two pixels.
        assert!(n_different < 480 * 360 / 500, "{name}: {n_different}");
    }
}
