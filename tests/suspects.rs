//! Suspects and confidence through the real program, on generated scans.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::path::Path;
use std::process::Command;

use glam::Vec3;
use normend_core::{Silent, shapes::ShapeKind};
use normend_io::{Positions, read, write_points};
use serde_json::Value;
use tempfile::TempDir;

/// Runs the program in `folder`; gives the exit code, standard output and standard error.
fn run(folder: &TempDir, typed: &str) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_normend"));
    command
        .current_dir(folder.path())
        .env("NORMEND_CONFIG_DIR", folder.path().join("config"))
        .env_remove("RUST_LOG")
        .args(typed.split(' '));
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(!err.contains("panicked"), "{err}");
    (output.status.code().unwrap(), out, err)
}

/// A torus beside the origin; the normals of the points within `radius` of the first are turned, and their number is returned.
fn write_torus(path: &Path, radius: f32) -> usize {
    let shape = ShapeKind::Torus.generate(4000);
    let positions: Vec<Vec3> = shape.positions.iter().map(|&position| position + 100.0).collect();
    let center = positions[0];
    let mut n_turned = 0;
    let mut normals = shape.normals;
    for (normal, position) in normals.iter_mut().zip(&positions) {
        if position.distance(center) < radius {
            *normal = -*normal;
            n_turned += 1;
        }
    }
    write_points(path, Positions::Float(&positions), Some(&normals), &Silent).unwrap();
    n_turned
}

#[test]
fn a_turned_patch_is_the_first_suspect() {
    let folder = TempDir::new().unwrap();
    let n_turned = write_torus(&folder.path().join("scan.ply"), 0.3);
    assert!(n_turned > 30);
    let (code, out, _) = run(&folder, "suspects scan.ply --quiet --json -");
    assert_eq!(code, 0);
    let report: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&report["normals"], &report["points"]), (&"given".into(), &4000.into()));
    let first = &report["suspects"][0];
    assert_eq!(
        (&first["points"], &first["kind"]),
        (&n_turned.into(), &"differs".into())
    );
    assert!(first["score"].as_f64().unwrap() > 0.9);
    assert!(first["votes_against"].as_f64() > first["votes_for"].as_f64());
    let scan = read(&folder.path().join("scan.ply"), &Silent).unwrap();
    let row = first["row"].as_u64().unwrap() as usize;
    let expect = (scan.cloud.origin() + scan.cloud.positions()[row].as_dvec3()).to_array();
    for (axis, expect) in expect.into_iter().enumerate() {
        assert!((first["center"][axis].as_f64().unwrap() - expect).abs() < 1e-9);
    }
    let (code, out, _) = run(&folder, "suspects scan.ply --quiet --top 1");
    assert_eq!((code, out.lines().count()), (0, 2), "{out}");
    assert!(
        out.contains(&n_turned.to_string()) && out.contains("the other way round"),
        "{out}"
    );
}

#[test]
fn a_right_cloud_has_no_suspect_and_a_sentence_says_so() {
    let folder = TempDir::new().unwrap();
    write_torus(&folder.path().join("scan.ply"), 0.0);
    let (code, out, _) = run(&folder, "suspects scan.ply --quiet");
    assert_eq!(code, 0);
    assert!(out.starts_with("no suspects: ") && out.lines().count() == 1, "{out}");
    let (_, out, _) = run(&folder, "suspects scan.ply --quiet --json -");
    let report: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(
        (&report["suspects"], &report["undecided"]),
        (&serde_json::json!([]), &0.into())
    );
}

#[test]
fn a_scan_without_normals_is_oriented_first() {
    let folder = TempDir::new().unwrap();
    let positions = ShapeKind::Torus.generate(2000).positions;
    let path = folder.path().join("scan.ply");
    write_points(&path, Positions::Float(&positions), None, &Silent).unwrap();
    let (code, out, _) = run(&folder, "suspects scan.ply --quiet --json -");
    assert_eq!(code, 0);
    let report: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(
        (&report["normals"], &report["suspects"]),
        (&"automatic".into(), &serde_json::json!([]))
    );
}

#[test]
fn orient_writes_confidence_when_asked() {
    let folder = TempDir::new().unwrap();
    write_torus(&folder.path().join("scan.ply"), 0.0);
    let (code, out, err) = run(&folder, "orient scan.ply -o out.ply --quiet --confidence --json -");
    assert_eq!(code, 0, "{err}");
    let report: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(report["undecided"], 0);
    let bytes = std::fs::read(folder.path().join("out.ply")).unwrap();
    let header = "property float nz\nproperty float confidence\nproperty uchar oriented\nend_header\n";
    let at = bytes
        .windows(header.len())
        .position(|window| window == header.as_bytes());
    let rows: Vec<&[u8]> = bytes[at.unwrap() + header.len()..].chunks(29).collect();
    assert_eq!(rows.len(), 4000);
    for row in rows {
        let confidence = f32::from_le_bytes(row[24..28].try_into().unwrap());
        assert!((0.5..=1.0).contains(&confidence) && row[28] == 1);
    }
    // Without the flag the file is the same but for that.
    let (code, ..) = run(&folder, "orient scan.ply -o plain.ply --quiet");
    assert_eq!(code, 0);
    let normals = |name: &str| read(&folder.path().join(name), &Silent).unwrap().given_normals.unwrap();
    assert_eq!(normals("out.ply"), normals("plain.ply"));
}

#[test]
fn wrong_use_is_refused() {
    let folder = TempDir::new().unwrap();
    write_torus(&folder.path().join("scan.ply"), 0.0);
    let check = |typed: &str, words: &str| {
        let (code, out, err) = run(&folder, typed);
        assert_eq!((code, out.as_str()), (2, ""), "{typed}: {err}");
        assert!(err.contains(words), "{typed}: {err}");
        assert!(!folder.path().join("out.ply").exists());
    };
    check(
        "orient scan.ply -o out.ply --confidence --preset tree",
        "automatic method",
    );
    check(
        "orient scan.ply -o out.ply --confidence --k-graph 5",
        "automatic method",
    );
    check("orient scan.ply -o out.ply --confidence --start keep", "--start keep");
    check("suspects scan.ply --threshold 2", "from 0 to 1");
    check("suspects scan.ply --json scan.ply", "another name");
    check("suspects scan.ply --rule toward-scanner --no-stations", "--no-stations");
}
