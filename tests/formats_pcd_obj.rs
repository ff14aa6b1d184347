//! PCD and OBJ through the real program: converted, oriented, and compared with the same points in PLY.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use normend_core::Silent;
use normend_io::{Scan, read};

fn run(folder: &Path, typed: &str) {
    let output = Command::new(env!("CARGO_BIN_EXE_normend"))
        .current_dir(folder)
        .env("NORMEND_CONFIG_DIR", folder.join("config"))
        .env_remove("RUST_LOG")
        .args(typed.split_whitespace())
        .stdin(Stdio::null())
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{typed}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
}

fn scan(folder: &Path, name: &str) -> Scan {
    read(&folder.join(name), &Silent).unwrap()
}

#[test]
fn the_same_points_get_the_same_normals_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    run(folder, "generate torus --points 3000 -o a.ply");
    run(folder, "orient a.ply -o expect.ply");
    let expect = scan(folder, "expect.ply");
    for name in ["a.pcd", "a.obj"] {
        run(folder, &format!("convert a.ply -o {name}"));
        run(folder, &format!("orient {name} -o out_{name}"));
        let found = scan(folder, &format!("out_{name}"));
        assert_eq!(found.cloud.positions(), expect.cloud.positions(), "{name}");
        assert_eq!(found.given_normals, expect.given_normals, "{name}");
    }
}

#[test]
fn a_mesh_stays_a_mesh_and_a_grid_a_grid() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // A cube's corners, with faces and what belongs to them.
    let mut mesh = "# cube\nmtllib cube.mtl\no cube\n".to_owned();
    let mut grid =
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z label\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 8\nHEIGHT 8\n\
                    VIEWPOINT 3 3 10 1 0 0 0\nPOINTS 64\nDATA ascii\n"
            .to_owned();
    for row in 0..8 {
        for column in 0..8 {
            mesh += &format!("v {column} {row} 0\n");
            grid += &match (row, column) {
                (4, 4) => "nan nan nan 9\n".to_owned(),
                _ => format!("{column} {row} 0 {column}\n"),
            };
        }
    }
    mesh += "usemtl red\n";
    for corner in 1..56 {
        mesh += &format!("f {corner} {} {}\n", corner + 1, corner + 8);
    }
    fs::write(folder.join("a.obj"), mesh).unwrap();
    fs::write(folder.join("a.pcd"), grid).unwrap();
    run(folder, "orient a.obj --rule up -o b.obj");
    run(folder, "orient a.pcd --rule up -o b.pcd");

    let out = fs::read_to_string(folder.join("b.obj")).unwrap();
    let count = |start: &str| out.lines().filter(|line| line.starts_with(start)).count();
    assert_eq!((count("v "), count("vn "), count("f ")), (64, 64, 55));
    assert!(out.contains("\nf 1//1 2//2 9//9\n") && out.contains("\nmtllib cube.mtl\no cube\n"));
    let out = fs::read_to_string(folder.join("b.pcd")).unwrap();
    assert!(out.contains("\nFIELDS x y z normal_x normal_y normal_z label\n"));
    assert!(out.contains("\nWIDTH 8\nHEIGHT 8\nVIEWPOINT 3 3 10 1 0 0 0\n"));
    assert!(out.contains("\nnan nan nan 0 0 1 9\n"));
    for (name, n_points) in [("b.obj", 64), ("b.pcd", 63)] {
        let scan = scan(folder, name);
        assert_eq!(scan.cloud.n_points(), n_points);
        let normals = scan.given_normals.unwrap();
        assert!(normals.iter().all(|normal| normal.z > 0.99), "{name}");
    }
}
