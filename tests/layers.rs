//! Several files oriented as one cloud by the real program, each written to its own file; recipes of them.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use glam::{DVec3, Vec3};
use normend_core::shapes::sphere;
use normend_core::{Document, Silent};
use normend_io::recipe::Recipe;
use normend_io::{Scan, read};
use tempfile::TempDir;

/// Where the sphere stands: coordinates as surveyors have them.
const CENTER: DVec3 = DVec3::new(512_000.25, 5_410_000.5, 230.0);

/// A sphere cut into two files of different formats, one with a row without a place.
fn halves() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let shape = sphere(1200);
    let (mut upper, mut lower) = (Vec::new(), String::from("x,y,z,intensity\n"));
    for (index, position) in shape.positions.iter().enumerate() {
        let [x, y, z] = (CENTER + position.as_dvec3()).to_array();
        if position.z > 0.1 {
            upper.push(format!("{x:.6} {y:.6} {z:.6}\n"));
        } else {
            writeln!(lower, "{x:.6},{y:.6},{z:.6},{index}").unwrap();
        }
    }
    lower.push_str("nan,0,0,7\n");
    let header = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\nend_header\n",
        upper.len()
    );
    fs::write(folder.path().join("upper.ply"), header + &upper.concat()).unwrap();
    fs::write(folder.path().join("lower.csv"), lower).unwrap();
    folder
}

fn run(folder: &Path, typed: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_normend"));
    command
        .current_dir(folder)
        .env("NORMEND_CONFIG_DIR", folder.join("config"));
    command.args(typed.split_whitespace()).output().unwrap()
}

fn check(folder: &Path, typed: &str, code: i32) -> (String, String) {
    let output = run(folder, typed);
    let words = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    let (out, err) = (words(output.stdout), words(output.stderr));
    assert_eq!(output.status.code(), Some(code), "{typed}: {err}");
    assert!(!err.contains("panicked"), "{err}");
    (out, err)
}

/// Normals of a file that point away from the middle, and all of them.
fn outward(path: &Path) -> (usize, usize) {
    let scan = read(path, &Silent).unwrap();
    let normals = scan.given_normals.as_ref().unwrap();
    let is_outward = |(point, normal): (usize, &Vec3)| {
        let from_middle = scan.coordinates(point as u32).unwrap() - CENTER;
        from_middle.dot(normal.as_dvec3()) > 0.0
    };
    let n_outward = normals.iter().enumerate().filter(|&each| is_outward(each)).count();
    (n_outward, normals.len())
}

#[test]
fn files_are_oriented_together_and_written_apart() {
    let folder = halves();
    let folder = folder.path();
    let (out, _) = check(folder, "orient upper.ply lower.csv --together -o out/ --json -", 0);
    let lines: Vec<serde_json::Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 2);
    assert_eq!(
        (&lines[0]["input"], &lines[1]["input"]),
        (&"upper.ply".into(), &"lower.csv".into())
    );
    // One cloud: the halves hang together.
    assert!(lines.iter().all(|line| line["components"] == 1), "{lines:?}");
    let n_points: u64 = lines.iter().map(|line| line["points"].as_u64().unwrap()).sum();
    assert_eq!(
        (n_points, &lines[1]["left_out"], &lines[0]["left_out"]),
        (1200, &1.into(), &0.into())
    );
    for (name, line) in ["upper.ply", "lower.csv"].iter().zip(&lines) {
        let (n_outward, n) = outward(&folder.join("out").join(name));
        assert_eq!((n_outward, n as u64), (n, line["points"].as_u64().unwrap()), "{name}");
    }
    // What else a file holds is kept, and a row without a place too.
    let lower = fs::read_to_string(folder.join("out/lower.csv")).unwrap();
    assert!(lower.lines().next().unwrap().contains("intensity") && lower.contains("nan,0,0"));
}

#[test]
fn a_file_that_cannot_be_read_or_written_is_named() {
    let folder = halves();
    let folder = folder.path();
    fs::write(folder.join("broken.ply"), "ply\nnonsense\n").unwrap();
    let (out, err) = check(folder, "orient upper.ply broken.ply --together -o out/ --json -", 1);
    assert!(err.contains("broken.ply"), "{err}");
    assert_eq!(out.lines().filter(|line| line.contains("error")).count(), 2, "{out}");
    assert!(!folder.join("out/upper.ply").exists(), "half a cloud is another cloud");
    // One by one, the good one is done.
    check(folder, "orient upper.ply broken.ply -o out/ --quiet", 1);
    assert!(folder.join("out/upper.ply").exists());
    check(folder, "orient upper.ply lower.csv --together -o one.ply", 2);
}

#[test]
fn a_recipe_of_several_files_takes_them_in_its_order() {
    let folder = halves();
    let folder = folder.path();
    let scans = ["upper.ply", "lower.csv"].map(|name| read(&folder.join(name), &Silent).unwrap());
    let scan = Scan::together(scans.into(), &Silent).unwrap();
    let document = Document::new(scan.cloud.clone(), scan.given_normals.clone());
    let recipe = Recipe::of_document(scan.identity(&scan.name()), &document);
    assert_eq!(recipe.head.scan.files.len(), 2);
    recipe.write(&folder.join("r.normend")).unwrap();

    check(folder, "orient upper.ply lower.csv --together -o oriented/ --quiet", 0);
    let (out, _) = check(folder, "replay r.normend upper.ply lower.csv -o replayed/ --json -", 0);
    assert_eq!(
        out.lines()
            .filter(|line| line.contains("\"same_content\":true"))
            .count(),
        2,
        "{out}"
    );
    for name in ["upper.ply", "lower.csv"] {
        let bytes = |part: &str| fs::read(folder.join(part).join(name)).unwrap();
        assert!(bytes("oriented") == bytes("replayed"), "{name}");
    }
    let (_, err) = check(folder, "replay r.normend lower.csv upper.ply -o other/", 1);
    assert!(err.contains("is not the content"), "{err}");
    let (_, err) = check(folder, "replay r.normend upper.ply -o one.ply", 1);
    assert!(err.contains("1200 points"), "{err}");
}
