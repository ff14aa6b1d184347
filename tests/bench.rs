//! `normend bench` through the real program, on a few generated clouds.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use glam::Vec3;
use normend_core::Silent;
use normend_io::Positions;
use serde_json::Value;
use tempfile::TempDir;

/// Runs the program in `folder` with `typed` split at spaces: standard output and standard error, after `code`.
fn run(folder: &TempDir, typed: &str, code: i32) -> (String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_normend"))
        .current_dir(folder.path())
        .env("NORMEND_CONFIG_DIR", folder.path().join("config"))
        .env_remove("RUST_LOG")
        .args(typed.split_whitespace())
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let (out, err) = (
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    );
    assert_eq!(output.status.code(), Some(code), "{typed}: {err}");
    assert!(!err.contains("panicked"), "{err}");
    (out, err)
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text:?}"))
}

/// The row of the cloud or class with this name.
fn row<'a>(rows: &'a Value, key: &str, name: &str) -> &'a Value {
    let found = rows.as_array().unwrap().iter().find(|row| row[key] == name);
    found.unwrap_or_else(|| panic!("no {name} in {rows}"))
}

/// Positions and, where the file has them, normals.
fn read(path: &Path) -> (Vec<Vec3>, Option<Vec<Vec3>>) {
    let scan = normend_io::read(path, &Silent).unwrap();
    assert_eq!(scan.cloud.origin(), glam::DVec3::ZERO);
    (
        scan.cloud.positions().to_vec(),
        scan.given_normals.map(|normals| normals.to_vec()),
    )
}

#[test]
fn clouds_and_their_truth_are_written_the_same_every_time() {
    let folder = tempfile::tempdir().unwrap();
    let chosen = "--only octahedron_lattice --only figure_front_back";
    run(&folder, &format!("bench clouds a {chosen}"), 0);
    run(&folder, &format!("bench clouds b {chosen} --threads 1 --quiet"), 0);
    let mut files = Vec::new();
    for class in ["sharp", "scan"] {
        for entry in fs::read_dir(folder.path().join("a").join(class)).unwrap() {
            let file = Path::new(class).join(entry.unwrap().file_name());
            let [a, b] = ["a", "b"].map(|run| fs::read(folder.path().join(run).join(&file)).unwrap());
            assert!(a == b, "{} differs", file.display());
            files.push(file.display().to_string());
        }
    }
    files.sort();
    assert_eq!(
        files,
        [
            "scan/figure_front_back.ply",
            "scan/figure_front_back.raw.ply",
            "scan/figure_front_back.sensors.tsv",
            "sharp/octahedron_lattice.ply",
            "sharp/octahedron_lattice.raw.ply",
        ]
    );

    let a = folder.path().join("a");
    let (raw, none) = read(&a.join("sharp/octahedron_lattice.raw.ply"));
    let (positions, normals) = read(&a.join("sharp/octahedron_lattice.ply"));
    assert!(none.is_none() && raw == positions);
    // A convex shape around the origin.
    let outward = |(position, normal): (&Vec3, &Vec3)| position.dot(*normal) > 0.0;
    assert!(positions.iter().zip(&normals.unwrap()).all(outward));

    // Every point was seen: its normal points to the station that the table names.
    let (positions, normals) = read(&a.join("scan/figure_front_back.ply"));
    let normals = normals.unwrap();
    let table = fs::read_to_string(a.join("scan/figure_front_back.sensors.tsv")).unwrap();
    let mut next = 0;
    for line in table.lines().skip(1) {
        let numbers: Vec<f32> = line.split('\t').map(|number| number.parse().unwrap()).collect();
        let (first, count) = (numbers[0] as usize, numbers[1] as usize);
        let station = Vec3::from_slice(&numbers[2..]);
        assert_eq!(first, next);
        next = first + count;
        for point in first..next {
            let to_station = (station - positions[point]).normalize_or_zero();
            // 80 degrees is where the scanner ends, and the errors of the points turn little.
            assert!(normals[point].dot(to_station) > 0.15, "point {point}");
        }
    }
    assert_eq!(next, positions.len());

    let (_, err) = run(&folder, &format!("bench clouds a {chosen}"), 1);
    assert!(err.contains("exists already") && err.contains("--overwrite"), "{err}");
    let (_, err) = run(&folder, "bench clouds c --only teapot", 2);
    assert!(err.contains("teapot") && err.contains("octahedron_lattice"), "{err}");
    assert!(!folder.path().join("c").exists());
}

#[test]
fn quality_counts_what_check_counts() {
    let folder = tempfile::tempdir().unwrap();
    let names = [
        ("sharp", "wedge_5"),
        ("sharp", "octahedron_lattice"),
        ("open", "half_sphere"),
    ];
    let chosen: String = names.iter().map(|(_, name)| format!("--only {name} ")).collect();
    run(&folder, &format!("bench clouds set {chosen}"), 0);
    // The default may change; what is compared is that both commands do the same.
    let flags = "--estimator pca --k-normals 20 --k-graph 20";
    let (out, _) = run(&folder, &format!("bench quality set --json - {flags}"), 0);
    let report = json(&out);
    assert_eq!(report["parameters"]["estimator"], "pca");
    let mut n_wrong = 0;
    for (class, name) in names {
        let cloud = format!("set/{class}/{name}");
        run(&folder, &format!("orient {cloud}.raw.ply -o {name}.ply {flags}"), 0);
        let (checked, _) = run(&folder, &format!("check {name}.ply --reference {cloud}.ply --json"), 0);
        let checked = json(&checked);
        let measured = row(&report["clouds"], "name", name);
        let wrong = if class == "open" { "wrong_global_flip" } else { "wrong" };
        assert_eq!(measured["wrong"], checked[wrong], "{name}");
        for key in ["points", "judged"] {
            assert_eq!(measured[key], checked[key], "{name} {key}");
        }
        let [mine, theirs] = [measured, &checked].map(|value| value["mean_unsigned_angle_degrees"].as_f64().unwrap());
        // The normals went through a file of f32 in between.
        assert!((mine - theirs).abs() < 1e-3, "{name} {mine} {theirs}");
        n_wrong += measured["wrong"].as_u64().unwrap();
    }
    assert!(n_wrong > 0, "nothing is wrong, so the comparison says little");
    assert_eq!(row(&report["classes"], "class", "sharp")["clouds"], 2);
    assert_eq!(report["all"]["clouds"], 3);

    // The same numbers with another number of threads, seconds aside.
    let without_seconds = |mut report: Value| {
        for list in ["clouds", "classes"] {
            for row in report[list].as_array_mut().unwrap() {
                row.as_object_mut().unwrap().remove("seconds");
            }
        }
        report["all"].as_object_mut().unwrap().remove("seconds");
        report
    };
    let (alone, _) = run(&folder, &format!("bench quality set --json - --threads 1 {flags}"), 0);
    assert_eq!(without_seconds(json(&alone)), without_seconds(report));

    let (out, _) = run(
        &folder,
        &format!("bench quality set --clouds --json all.json {flags}"),
        0,
    );
    for word in ["class", "sharp", "open", "all", "wedge_5", "half_sphere"] {
        assert!(out.contains(word), "no {word} in {out}");
    }
    assert!(json(&fs::read_to_string(folder.path().join("all.json")).unwrap())["clouds"].is_array());
    let (_, err) = run(&folder, "bench quality set --json all.json", 1);
    assert!(err.contains("all.json exists already"), "{err}");
}

/// A sphere on a spiral, whose truth may point inward, as the files `set/<class>/<name>.*`.
fn write_sphere(folder: &TempDir, class: &str, name: &str, inward: bool) {
    let golden_angle = std::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    let point = |i: usize| {
        let z = 1.0 - (2.0 * i as f32 + 1.0) / 2000.0;
        let (sin, cos) = (golden_angle * i as f32).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        Vec3::new(radius * cos, radius * sin, z)
    };
    let points: Vec<Vec3> = (0..2000).map(point).collect();
    let normals: Vec<Vec3> = points.iter().map(|&p| if inward { -p } else { p }).collect();
    let folder = folder.path().join("set").join(class);
    fs::create_dir_all(&folder).unwrap();
    let positions = Positions::Float(&points);
    normend_io::write_points(&folder.join(format!("{name}.raw.ply")), positions, None, &Silent).unwrap();
    normend_io::write_points(&folder.join(format!("{name}.ply")), positions, Some(&normals), &Silent).unwrap();
}

#[test]
fn only_open_surfaces_may_be_flipped_and_only_as_a_whole() {
    let folder = tempfile::tempdir().unwrap();
    write_sphere(&folder, "open", "inward", true);
    write_sphere(&folder, "sharp", "inward", true);
    write_sphere(&folder, "sharp", "outward", false);
    write_sphere(&folder, "scan", "room_inward", true);
    let (out, _) = run(&folder, "bench quality set --json -", 0);
    let report = json(&out);
    for (class, mean, without_region) in [("open", 0.0, 1), ("sharp", 0.5, 1), ("scan rooms", 1.0, 0)] {
        let class = row(&report["classes"], "class", class);
        assert_eq!(class["mean_wrong_share"], mean, "{class}");
        assert_eq!(class["clouds_without_wrong_region"], without_region, "{class}");
    }
    let wrong = report["clouds"]
        .as_array()
        .unwrap()
        .iter()
        .find(|row| row["wrong"] == 2000);
    let wrong = wrong.unwrap();
    assert_eq!(
        (&wrong["wrong_regions"], &wrong["largest_wrong_region"]),
        (&1.into(), &2000.into())
    );
}

#[test]
fn what_cannot_be_measured_is_said_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let (_, err) = run(&folder, "bench quality nowhere", 1);
    assert!(err.contains("nowhere"), "{err}");
    fs::create_dir(folder.path().join("set")).unwrap();
    let (_, err) = run(&folder, "bench quality set", 1);
    assert!(err.contains("holds no clouds"), "{err}");

    write_sphere(&folder, "real", "unknown", false);
    fs::remove_file(folder.path().join("set/real/unknown.ply")).unwrap();
    let (_, err) = run(&folder, "bench quality set", 1);
    assert!(err.contains("truth"), "{err}");

    write_sphere(&folder, "sharp", "fine", false);
    let (out, err) = run(&folder, "bench quality set --json -", 0);
    assert!(err.contains("1 cloud without a truth"), "{err}");
    assert_eq!(json(&out)["without_truth"], 1);
    assert_eq!(json(&out)["all"]["clouds"], 1);

    // A truth of other points is no truth, and does not stop the rest.
    write_sphere(&folder, "sharp", "broken", false);
    fs::copy(
        folder.path().join("set/sharp/broken.raw.ply"),
        folder.path().join("set/sharp/broken.ply"),
    )
    .unwrap();
    let (out, err) = run(&folder, "bench quality set --json -", 1);
    assert!(err.contains("broken.ply has no normals"), "{err}");
    let report = json(&out);
    assert_eq!(report["failed"].as_array().unwrap().len(), 1);
    assert_eq!(report["clouds"].as_array().unwrap().len(), 1);

    let (_, err) = run(&folder, "bench quality set --only teapot", 2);
    assert!(err.contains("teapot"), "{err}");
}

#[test]
fn the_papers_figures_need_clouds_and_replace_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (_, err) = run(&folder, "bench paper nowhere", 1);
    assert!(err.contains("nowhere"), "{err}");
    fs::write(folder.path().join("paper.md"), "mine").unwrap();
    write_sphere(&folder, "sharp", "ball", false);
    let (_, err) = run(&folder, "bench paper set -o paper.md", 1);
    assert!(err.contains("paper.md exists already"), "{err}");
    assert_eq!(fs::read_to_string(folder.path().join("paper.md")).unwrap(), "mine");
}

/// The rows of `bench clicks --clouds` for one cloud: user, clicks, steps, harmful, wrong before and after, regions left.
fn clicks_of(table: &str, cloud: &str) -> Vec<(String, [usize; 6])> {
    let rows = table.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
    rows.filter(|words| words.get(1) == Some(&cloud))
        .map(|words| {
            let counts = words[3..].iter().map(|word| word.parse().unwrap()).collect::<Vec<_>>();
            (words[2].to_owned(), counts.try_into().unwrap())
        })
        .collect()
}

#[test]
fn a_simulated_user_mends_what_quality_counts() {
    let folder = tempfile::tempdir().unwrap();
    run(&folder, "bench clouds d --only wedge_5", 0);
    for preset in ["tree", "auto"] {
        let (quality, _) = run(&folder, &format!("bench quality d --preset {preset} --json - -q"), 0);
        let cloud = row(&json(&quality)["clouds"], "name", "wedge_5").clone();
        assert!(
            cloud["wrong_regions"].as_u64() > Some(0),
            "nothing to click on: {cloud}"
        );
        let (table, _) = run(&folder, &format!("bench clicks d --preset {preset} --clouds -q"), 0);
        assert!(table.contains("1 of 1 cloud with a wrong region"), "{table}");
        let users = clicks_of(&table, "wedge_5");
        let names: Vec<&str> = users.iter().map(|(user, _)| user.as_str()).collect();
        assert_eq!(names, ["tree", "default", "wheel"]);
        for (user, [clicks, steps, harmful, before, after, left]) in &users {
            assert_eq!(Some(*before as u64), cloud["wrong"].as_u64());
            assert!((1..=60).contains(clicks) && harmful <= clicks, "{user}: {table}");
            assert!(*clicks == 60 || *left == 0, "{user} stopped early: {table}");
            assert!(user == "wheel" || *steps == 0);
            // Who sees what a click turns and can choose turns nothing for the worse.
            assert!(
                user != "wheel" || preset == "tree" || (*harmful == 0 && after < before),
                "{table}"
            );
        }
        // Without patches all mend along the tree.
        assert!(preset == "auto" || users.iter().all(|(_, counts)| *counts == users[0].1));
        assert!(
            preset == "tree" || users[1].1 != users[0].1,
            "no patch was offered: {table}"
        );
        let (again, _) = run(
            &folder,
            &format!("bench clicks d --preset {preset} --clouds -q --threads 1"),
            0,
        );
        assert_eq!(clicks_of(&again, "wedge_5"), users);
    }
}
