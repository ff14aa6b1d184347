//! Places of the scanner through the real program: from files, tables and trajectories beside a scan, and named ones.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use glam::{DVec3, Vec3};
use normend_core::evidence::Station;
use normend_core::shapes::benchmark_clouds;
use normend_core::{Silent, shapes};
use normend_io::Positions;
use serde_json::Value;

fn run(folder: &Path, arguments: &str) -> Output {
    let program = Command::new(env!("CARGO_BIN_EXE_normend"))
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .output();
    program.unwrap()
}

/// What was reported of an orientation that succeeded, and what was said.
fn orient(folder: &Path, arguments: &str) -> (Value, String) {
    let output = run(folder, &format!("orient {arguments} --overwrite --json -"));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{arguments}: {said}");
    (serde_json::from_slice(&output.stdout).unwrap(), said)
}

/// How many normals of a file point away from `truth`.
fn n_wrong(path: &Path, truth: &[Vec3]) -> usize {
    let scan = normend_io::read(path, &Silent).unwrap();
    let normals = scan.given_normals.unwrap();
    assert_eq!(normals.len(), truth.len());
    normals
        .iter()
        .zip(truth)
        .filter(|(normal, truth)| normal.dot(**truth) <= 0.0)
        .count()
}

fn table(stations: &[Station]) -> String {
    let mut text = "first\tcount\tx\ty\tz\n".to_owned();
    for Station { points, position } in stations {
        let DVec3 { x, y, z } = *position;
        writeln!(text, "{}\t{}\t{x}\t{y}\t{z}", points.start, points.len()).unwrap();
    }
    text
}

#[test]
fn a_hall_from_two_places_faces_them_once_they_are_known() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let clouds = benchmark_clouds();
    let hall = clouds
        .iter()
        .find(|cloud| cloud.name == "room_hall_2_stations")
        .unwrap();
    let hall = hall.generate(&Silent).unwrap();
    let (positions, truth) = (&hall.shape.positions, &hall.shape.normals);
    normend_io::write_points(&folder.join("hall.ply"), Positions::Float(positions), None, &Silent).unwrap();
    let wrong = |name: &str| n_wrong(&folder.join(name), truth) as f64 / truth.len() as f64;

    let (report, _) = orient(folder, "hall.ply -o without.ply");
    assert!(report["scanner"].is_null());
    assert!(
        wrong("without.ply") > 0.5,
        "nothing in the points tells a hall from an object"
    );

    fs::write(folder.join("hall.sensors.tsv"), table(&hall.stations)).unwrap();
    let (report, said) = orient(folder, "hall.ply -o with.ply");
    assert_eq!(report["scanner"], "2 scanner positions from hall.sensors.tsv");
    assert!(said.contains("2 scanner positions from hall.sensors.tsv"), "{said}");
    assert_eq!(report["rule"], "Toward the scanner");
    // Measured: 0.031; 1 would be all.
    assert!(wrong("with.ply") < 0.05, "{}", wrong("with.ply"));

    // Of one file with the frames of its scans as well.
    let mut ptx = String::new();
    for Station { points, position } in &hall.stations {
        let DVec3 { x, y, z } = *position;
        writeln!(
            ptx,
            "{}\n1\n{x} {y} {z}\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n{x} {y} {z} 1",
            points.len()
        )
        .unwrap();
        for point in points.clone() {
            let place = positions[point as usize].as_dvec3() - *position;
            writeln!(ptx, "{} {} {} 0.5", place.x, place.y, place.z).unwrap();
        }
    }
    fs::write(folder.join("scans.ptx"), ptx).unwrap();
    let (report, _) = orient(folder, "scans.ptx -o scans.ply");
    assert_eq!(report["scanner"], "2 scanner positions from scans.ptx");
    assert!(wrong("scans.ply") < 0.05, "{}", wrong("scans.ply"));

    let (report, _) = orient(folder, "hall.ply -o out.ply --no-stations");
    assert!(report["scanner"].is_null());
    assert!(wrong("out.ply") > 0.5);
}

#[test]
fn a_trajectory_tells_the_place_of_each_point_by_its_time() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // Driven along the inside of a tube: from outside it would look like an object.
    let n = 6000;
    let point = |i: usize| {
        let along = 40.0 * i as f32 / n as f32;
        let angle = 2.4 * i as f32;
        Vec3::new(along, 2.0 * angle.cos(), 2.0 * angle.sin())
    };
    let points: Vec<Vec3> = (0..n).map(point).collect();
    let truth: Vec<Vec3> = points
        .iter()
        .map(|point| -Vec3::new(0.0, point.y, point.z).normalize_or_zero())
        .collect();
    let mut text = "x,y,z,gps_time\n".to_owned();
    for point in &points {
        // Adjusted standard time; the trajectory counts GPS seconds.
        writeln!(text, "{},{},{},{}", point.x, point.y, point.z, 3e8 + f64::from(point.x)).unwrap();
    }
    fs::write(folder.join("tube.csv"), &text).unwrap();
    let drive: String = (0..=40)
        .map(|s| format!("{} {s} 0 0\n", 1.3e9 + f64::from(s)))
        .collect();
    let (report, _) = orient(folder, "tube.csv -o without.ply");
    assert!(report["scanner"].is_null());
    assert!(n_wrong(&folder.join("without.ply"), &truth) > n / 2);

    fs::write(folder.join("drive.txt"), format!("time x y z\n{drive}")).unwrap();
    let (report, said) = orient(folder, "tube.csv -o with.ply --trajectory drive.txt");
    assert_eq!(report["scanner"], "a trajectory from drive.txt");
    assert!(said.contains("1000000000 s are added"), "{said}");
    assert_eq!(n_wrong(&folder.join("with.ply"), &truth), 0);

    // Beside the scan it is found.
    fs::rename(folder.join("drive.txt"), folder.join("tube.trajectory.txt")).unwrap();
    let (report, _) = orient(folder, "tube.csv -o found.ply");
    assert_eq!(report["scanner"], "a trajectory from tube.trajectory.txt");
    assert_eq!(n_wrong(&folder.join("found.ply"), &truth), 0);

    // One that is named must be of this scan.
    fs::write(folder.join("other.txt"), "5 0 0 0\n6 0 0 0\n").unwrap();
    let output = run(folder, "orient tube.csv -o no.ply --trajectory other.txt");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1));
    assert!(
        said.contains("other.txt: its times, 5 to 6 s, do not overlap"),
        "{said}"
    );
    assert!(!folder.join("no.ply").exists());
}

#[test]
fn the_rule_toward_the_scanner_needs_a_place_from_anywhere() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let ball = shapes::sphere(1500);
    let (positions, outward) = (&ball.positions, &ball.normals);
    normend_io::write_points(&folder.join("ball.ply"), Positions::Float(positions), None, &Silent).unwrap();
    let output = run(folder, "orient ball.ply -o out.ply --rule toward-scanner");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1));
    assert!(
        ["--scanner", "--sensors", "--trajectory"]
            .iter()
            .all(|flag| said.contains(flag)),
        "{said}"
    );
    let output = run(folder, "orient ball.ply -o out.ply --rule toward-scanner --no-stations");
    assert_eq!(output.status.code(), Some(2));

    fs::write(folder.join("ball.sensors.tsv"), "0 1500 0 0 0\n").unwrap();
    let (report, _) = orient(folder, "ball.ply -o out.ply --rule toward-scanner");
    assert_eq!(report["scanner"], "1 scanner position from ball.sensors.tsv");
    assert_eq!(n_wrong(&folder.join("out.ply"), outward), 1500);

    // One beside the scan that is wrong is said, and not used.
    fs::write(folder.join("ball.sensors.tsv"), "0 1501 0 0 0\n").unwrap();
    let (report, said) = orient(folder, "ball.ply -o out.ply");
    assert!(report["scanner"].is_null());
    assert!(said.contains("is not used: ball.sensors.tsv, line 1"), "{said}");
    assert_eq!(n_wrong(&folder.join("out.ply"), outward), 0);
}
