//! The real program without a window, on generated scans.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::f32::consts::PI;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use glam::Vec3;
use normend_core::Silent;
use serde_json::Value;
use tempfile::TempDir;

/// A finished run of the program.
struct Run {
    code: Option<i32>,
    out: String,
    err: String,
}

impl Run {
    /// The run, when it ended with `code` and said nothing of a panic.
    fn expect(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "standard error: {}", self.err);
        assert!(!self.err.contains("panicked"), "{}", self.err);
        self
    }

    /// Standard output as one JSON value.
    fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error}: {:?}", self.out))
    }

    /// Standard error, which must be one line that holds each of `words`.
    fn expect_sentence(&self, words: &[&str]) {
        assert_eq!(
            self.err.trim_end().lines().count(),
            1,
            "more than one sentence: {}",
            self.err
        );
        for word in words {
            assert!(self.err.contains(word), "no {word:?} in {}", self.err);
        }
    }
}

/// The program in `folder`, with a settings folder of its own and no display.
fn normend(folder: &TempDir) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_normend"));
    command
        .current_dir(folder.path())
        .env("NORMEND_CONFIG_DIR", folder.path().join("config"));
    for variable in ["RUST_LOG", "DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(variable);
    }
    command
}

/// Runs the program in `folder` with `typed` split at spaces.
fn run(folder: &TempDir, typed: &str) -> Run {
    finish(normend(folder).args(typed.split_whitespace()))
}

fn finish(command: &mut Command) -> Run {
    let output = command.stdin(Stdio::null()).output().unwrap();
    Run {
        code: output.status.code(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

/// An ascii PLY of `points` with normals.
fn ply_of(points: &[(Vec3, Vec3)]) -> String {
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", points.len());
    for name in ["x", "y", "z", "nx", "ny", "nz"] {
        writeln!(text, "property float {name}").unwrap();
    }
    text.push_str("end_header\n");
    for (p, n) in points {
        writeln!(text, "{} {} {} {} {} {}", p.x, p.y, p.z, n.x, n.y, n.z).unwrap();
    }
    text
}

/// `n` points of a unit sphere on a spiral, with outward normals.
fn sphere(n: usize) -> Vec<(Vec3, Vec3)> {
    let golden_angle = PI * (3.0 - 5.0_f32.sqrt());
    (0..n)
        .map(|i| {
            let z = 1.0 - (2.0 * i as f32 + 1.0) / n as f32;
            let (sin, cos) = (golden_angle * i as f32).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            let normal = Vec3::new(radius * cos, radius * sin, z);
            (normal, normal)
        })
        .collect()
}

/// Writes a sphere whose normals are right (`truth.ply`) and the same with every third turned (`mixed.ply`).
fn write_sphere_and_mixed(folder: &TempDir, n: usize) -> usize {
    let truth = sphere(n);
    fs::write(folder.path().join("truth.ply"), ply_of(&truth)).unwrap();
    let turned = |(index, &(p, n)): (usize, &(Vec3, Vec3))| (p, if index.is_multiple_of(3) { -n } else { n });
    let mixed: Vec<_> = truth.iter().enumerate().map(turned).collect();
    fs::write(folder.path().join("mixed.ply"), ply_of(&mixed)).unwrap();
    n.div_ceil(3)
}

/// Wrong normals of `result` against `truth`, as `normend check` counts them.
fn n_wrong(folder: &TempDir, result: &str, truth: &str) -> u64 {
    let checked = run(folder, &format!("check {result} --reference {truth} --json")).expect(0);
    checked.json()["wrong"].as_u64().unwrap()
}

fn normals_of(path: PathBuf) -> Vec<Vec3> {
    normend_io::read(&path, &Silent)
        .unwrap()
        .given_normals
        .unwrap()
        .to_vec()
}

/// Names of the files in `folder`, sorted.
fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn orient_makes_every_normal_right_on_closed_shapes() {
    for shape in ["sphere", "torus"] {
        let folder = folder();
        run(
            &folder,
            &format!("generate {shape} -o scan.ply --truth truth.ply --points 8000"),
        )
        .expect(0);
        assert!(
            normend_io::read(&folder.path().join("scan.ply"), &Silent)
                .unwrap()
                .given_normals
                .is_none()
        );
        for estimator in ["pca", "wpca", "obne"] {
            run(
                &folder,
                &format!("orient scan.ply -o {estimator}.ply --estimator {estimator}"),
            )
            .expect(0);
            assert_eq!(
                n_wrong(&folder, &format!("{estimator}.ply"), "truth.ply"),
                0,
                "{shape} by {estimator}"
            );
        }
    }
}

#[test]
fn orient_improves_on_wrong_normals() {
    let folder = folder();
    let n_turned = write_sphere_and_mixed(&folder, 3000);
    assert_eq!(n_wrong(&folder, "mixed.ply", "truth.ply"), n_turned as u64);
    run(&folder, "orient mixed.ply -o out.ply").expect(0);
    assert_eq!(n_wrong(&folder, "out.ply", "truth.ply"), 0);
}

#[test]
fn the_paper_is_a_preset_that_flags_change() {
    let folder = folder();
    fs::write(folder.path().join("scan.ply"), ply_of(&sphere(2000))).unwrap();
    let check = |typed: &str, sources: &str, eta: f64, is_voted: bool| {
        let oriented = run(
            &folder,
            &format!("orient scan.ply -o out.ply --overwrite --json - {typed}"),
        )
        .expect(0);
        let report = oriented.json();
        assert_eq!(report["parameters"]["sources"], sources, "{typed}");
        assert_eq!(report["parameters"]["eta"], eta, "{typed}");
        assert_eq!(report["voted_sources"].as_u64().unwrap() > 1, is_voted, "{typed}");
        assert_eq!(report["seconds"]["sources"].is_number(), is_voted, "{typed}");
        if is_voted {
            assert_eq!(report["sources"], report["voted_sources"], "{typed}");
        }
    };
    check("--preset tree", "highest", 0.07, false);
    check("--preset paper", "hidden-points", 0.07, true);
    check(
        "--preset paper --sources hidden-points-mended --eta 0.2",
        "hidden-points-mended",
        0.2,
        true,
    );
    check(
        "--preset tree --sources hidden-points --views 14 --estimator rrht",
        "hidden-points",
        0.07,
        true,
    );
    check("--preset paper --sources highest", "highest", 0.07, false);
}

#[test]
fn the_report_has_every_field() {
    let folder = folder();
    fs::write(folder.path().join("scan.ply"), ply_of(&sphere(2000))).unwrap();
    let oriented = run(
        &folder,
        "orient scan.ply -o out.ply --json - --estimator wpca --k-normals 9 --k-graph 7",
    )
    .expect(0);
    let report = oriented.json();
    assert_eq!(report["input"], "scan.ply");
    assert_eq!(report["output"], "out.ply");
    assert_eq!(report["points"], 2000);
    assert_eq!(report["left_out"], 0);
    assert_eq!(report["components"], 1);
    assert_eq!(report["sources"], 1);
    assert_eq!(
        report["parameters"],
        serde_json::json!({
            "method": "spanning-tree", "estimator": "wpca", "k_normals": 9, "k_graph": 7, "edge_rule": "dot", "start": "estimate",
            "sources": "highest", "views": 8, "eta": 0.07, "rule": normend_core::SideRule::default().name()
        })
    );
    let seconds = report["seconds"].as_object().unwrap();
    let mut stages: Vec<&str> = seconds.keys().map(String::as_str).collect();
    stages.sort_unstable();
    assert_eq!(
        stages,
        [
            "graph",
            "neighbors",
            "normals",
            "read",
            "signs",
            "total",
            "tree",
            "write"
        ]
    );
    let sum: f64 = seconds
        .iter()
        .filter(|(name, _)| *name != "total")
        .map(|(_, secs)| secs.as_f64().unwrap())
        .sum();
    assert!(seconds.values().all(|secs| secs.as_f64().unwrap() >= 0.0));
    assert!(
        sum <= seconds["total"].as_f64().unwrap(),
        "stages are parts of the total"
    );
    let peak = &report["peak_rss_bytes"];
    assert!(
        if cfg!(target_os = "linux") {
            peak.as_u64().unwrap() > 1_000_000
        } else {
            peak.is_null()
        },
        "{peak}"
    );
}

#[test]
fn a_broken_input_does_not_stop_the_others() {
    let folder = folder();
    fs::write(folder.path().join("a.ply"), ply_of(&sphere(500))).unwrap();
    fs::write(
        folder.path().join("broken.ply"),
        "ply\nformat ascii 1.0\nelement vertex 7\n",
    )
    .unwrap();
    fs::write(folder.path().join("c.ply"), ply_of(&sphere(700))).unwrap();
    let oriented = run(
        &folder,
        "orient a.ply broken.ply c.ply missing.ply -o out --json report.jsonl --quiet",
    )
    .expect(1);
    assert_eq!(names_in(&folder.path().join("out")), ["a.ply", "c.ply"]);
    let sentences: Vec<&str> = oriented.err.lines().collect();
    assert_eq!(sentences.len(), 2, "{}", oriented.err);
    assert!(
        sentences[0].contains("broken.ply") && sentences[1].contains("missing.ply"),
        "{}",
        oriented.err
    );
    let report = fs::read_to_string(folder.path().join("report.jsonl")).unwrap();
    let lines: Vec<Value> = report.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let inputs: Vec<&str> = lines.iter().map(|line| line["input"].as_str().unwrap()).collect();
    assert_eq!(inputs, ["a.ply", "broken.ply", "c.ply", "missing.ply"]);
    assert_eq!(
        (&lines[0]["points"], &lines[2]["points"]),
        (&Value::from(500), &Value::from(700))
    );
    assert!(lines[1]["error"].as_str().unwrap().contains("broken.ply"));
    assert!(lines[1].get("points").is_none());
}

#[test]
fn orient_turns_a_ball_to_the_side_that_is_asked_for() {
    let folder = folder();
    let ball = sphere(3000);
    fs::write(folder.path().join("ball.ply"), ply_of(&ball)).unwrap();
    let inward: Vec<(Vec3, Vec3)> = ball.iter().map(|&(p, n)| (p, -n)).collect();
    fs::write(folder.path().join("inward.ply"), ply_of(&inward)).unwrap();
    // The table speaks of the first half only: the rest of the component follows it.
    fs::write(
        folder.path().join("places.tsv"),
        "first\tcount\tx\ty\tz\n0\t1500\t0\t0\t0.1\n",
    )
    .unwrap();
    let both_sides = "0 1500 0 0 9\n1500 1500 0 0 -9\n";
    fs::write(folder.path().join("both_sides.tsv"), both_sides).unwrap();
    let check = |input: &str, flags: &str, expect: u64| {
        let oriented = run(
            &folder,
            &format!("orient {input} -o out.ply --overwrite -q --json - {flags}"),
        )
        .expect(0);
        assert_eq!(oriented.json()["without_evidence"], 0, "{flags}");
        assert_eq!(n_wrong(&folder, "out.ply", "ball.ply"), expect, "{flags}");
    };
    check("ball.ply", "", 0);
    check("ball.ply", "--rule into-room", 3000);
    check("ball.ply", "--scanner 0.1,0,-0.2", 3000);
    check("ball.ply", "--sensors both_sides.tsv", 0);
    check("ball.ply", "--sensors places.tsv", 3000);
    check("ball.ply", "--sensors places.tsv --rule outward", 0);
    check("inward.ply", "--rule given", 3000);
    check("ball.ply", "--rule given", 0);
}

#[test]
fn orient_finds_where_a_room_was_scanned_from() {
    let folder = folder();
    let clouds = normend_core::shapes::benchmark_clouds();
    let room = clouds
        .iter()
        .find(|cloud| cloud.name == "room_office_1_station")
        .unwrap();
    let room = room.generate(&Silent).unwrap();
    let points: Vec<(Vec3, Vec3)> = room.shape.positions.into_iter().zip(room.shape.normals).collect();
    fs::write(folder.path().join("room.ply"), ply_of(&points)).unwrap();
    let orient = |flags: &str| {
        let oriented = run(
            &folder,
            &format!("orient room.ply -o out.ply --overwrite -q --json - {flags}"),
        );
        (oriented.expect(0).json(), n_wrong(&folder, "out.ply", "room.ply"))
    };
    let (report, wrong) = orient("");
    assert_eq!(report["rule"], "Toward the scanner");
    let found: Vec<f64> = serde_json::from_value(report["found_station"].clone()).unwrap();
    let truth = room.stations[0].position;
    let off = truth.distance(glam::DVec3::from_slice(&found));
    assert!(off < 0.15, "{off}");
    assert!(wrong < points.len() as u64 / 20, "{wrong}");
    let (report, wrong) = orient("--rule outward");
    assert_eq!(
        (&report["rule"], &report["found_station"]),
        (&Value::from("Outward"), &Value::Null)
    );
    assert!(wrong > points.len() as u64 / 2, "{wrong}");
}

#[test]
fn a_table_of_places_that_is_wrong_names_its_line() {
    let folder = folder();
    fs::write(folder.path().join("ball.ply"), ply_of(&sphere(300))).unwrap();
    let orient = "orient ball.ply -o out.ply -q --sensors places.tsv";
    run(&folder, orient)
        .expect(1)
        .expect_sentence(&["places.tsv", "no such file"]);
    fs::write(
        folder.path().join("places.tsv"),
        "first count x y z\n0 200 0 0 0\n200 101 0 0 0\n",
    )
    .unwrap();
    run(&folder, orient)
        .expect(1)
        .expect_sentence(&["places.tsv, line 3", "300", "another scan"]);
    assert!(!folder.path().join("out.ply").exists());
}

#[test]
fn wrong_use_is_refused_before_anything_is_written() {
    let folder = folder();
    let scan = ply_of(&sphere(300));
    fs::write(folder.path().join("a.ply"), &scan).unwrap();
    fs::create_dir(folder.path().join("sub")).unwrap();
    fs::write(folder.path().join("sub/a.ply"), &scan).unwrap();
    fs::write(folder.path().join("sub/b.ply"), &scan).unwrap();
    let check = |typed: &str, words: &[&str]| {
        let refused = run(&folder, typed).expect(2);
        assert!(refused.out.is_empty(), "{typed}");
        for word in words {
            assert!(refused.err.contains(word), "{typed}: no {word:?} in {}", refused.err);
        }
        assert_eq!(names_in(folder.path()), ["a.ply", "sub"], "{typed}");
        assert_eq!(names_in(&folder.path().join("sub")), ["a.ply", "b.ply"], "{typed}");
        assert_eq!(
            fs::read_to_string(folder.path().join("a.ply")).unwrap(),
            scan,
            "{typed}"
        );
    };
    check("orient a.ply", &["--output"]);
    check("orient -o out.ply", &["<IN>"]);
    check("orient a.ply -o a.ply", &["is an input", "--overwrite"]);
    check("orient a.ply -o sub/../a.ply", &["is an input", "--overwrite"]);
    check("orient a.ply -o .", &["is an input", "--overwrite"]);
    check("orient sub/a.ply sub/b.ply -o sub", &["is an input", "--overwrite"]);
    check("orient a.ply sub/b.ply -o a.ply", &["is a file", "folder"]);
    check("orient a.ply sub/a.ply -o out", &["two inputs", "one by one"]);
    check("orient a.ply -o out.ply --json a.ply", &["--json"]);
    check("orient a.ply -o out.ply --json out.ply", &["--json"]);
    for name in ["out.stl", "out.dxf", "out.png"] {
        check(&format!("orient a.ply -o {name}"), &[name, ".ply", ".xyz"]);
        check(&format!("generate sphere -o {name}"), &[name, ".ply", ".xyz"]);
    }
    check("generate sphere -o out.ply --truth truth.stl", &["truth.stl", ".ply"]);
    check("orient a.ply -o -", &["standard output", "name of a file"]);
    check("orient a.ply sub/b.ply -o -", &["standard output", "name of a file"]);
    check("generate sphere -o -", &["standard output", "name of a file"]);
    check("render a.ply -o -", &["standard output", "name of a file"]);
    check("orient a.ply sub/b.ply -o single.ply", &["single.ply", "folder"]);
    check("orient a.ply -o out.ply --estimator best", &["pca", "wpca", "obne"]);
    check("orient a.ply -o out.ply --k-normals 2", &["3"]);
    check("orient a.ply -o out.ply --threads 0", &["1"]);
    check("orient a.ply -o out.ply --rule inward", &["outward", "into-room"]);
    check(
        "orient a.ply -o out.ply --rule toward-scanner --no-stations",
        &["--no-stations"],
    );
    check("orient a.ply -o out.ply --scanner 1,2", &["three numbers"]);
    check(
        "orient a.ply sub/b.ply -o out --sensors places.tsv",
        &["--sensors", "one by one"],
    );
    check(
        "orient a.ply -o out.ply --scanner 1,2,3 --sensors places.tsv",
        &["cannot be used with"],
    );
    check("render a.ply -o out.png --size 12", &["1280x800"]);
    check("render a.ply -o out.jpg", &[".png"]);
    check("render a.ply -o a.ply", &["take the place"]);
    check("check a.ply", &["--reference"]);
    check("generate cube_of_cheese -o out.ply", &["sphere", "torus"]);
    check("generate sphere -o out.ply --truth out.ply", &["same file"]);
    check("generate sphere -o out.ply --noise=-1", &["from 0 to 1"]);
    check("generate sphere -o out.ply --noise NaN", &["from 0 to 1"]);
}

#[test]
fn wrong_use_is_told_with_the_usage_of_its_command() {
    let folder = folder();
    fs::write(folder.path().join("a.ply"), ply_of(&sphere(300))).unwrap();
    let check = |typed: &str, words: &[&str]| {
        let refused = run(&folder, typed).expect(2);
        for word in words {
            assert!(refused.err.contains(word), "{typed}: no {word:?} in {}", refused.err);
        }
    };
    check(
        "orient a.ply -o a.ply",
        &["Usage: normend orient [OPTIONS] --output <OUT> <IN>"],
    );
    check("render a.ply -o a.jpg", &["Usage: normend render"]);
    check("generate torus -o a.stl", &["Usage: normend generate"]);
    check("frob", &["no file and no command", "'frob'", "Usage: normend ["]);
}

#[test]
fn an_output_without_an_extension_has_the_format_of_the_input() {
    let folder = folder();
    fs::write(folder.path().join("scan.dat"), ply_of(&sphere(300))).unwrap();
    for output in ["out", "out.dat"] {
        run(&folder, &format!("orient scan.dat -o {output}")).expect(0);
        assert!(fs::read(folder.path().join(output)).unwrap().starts_with(b"ply\n"));
    }
    // A folder may be called as anything, when that is plain.
    run(&folder, "orient scan.dat -o all.ply/").expect(0);
    assert_eq!(names_in(&folder.path().join("all.ply")), ["scan.dat"]);
}

#[test]
fn a_file_that_exists_is_replaced_only_when_asked() {
    let folder = folder();
    for name in ["a.ply", "b.ply"] {
        fs::write(folder.path().join(name), ply_of(&sphere(300))).unwrap();
    }
    fs::create_dir(folder.path().join("out")).unwrap();
    let old = ["out.ply", "out.jsonl", "out.png", "truth.ply", "out/a.ply"];
    let check = |typed: &str, name: &str| {
        for name in old {
            fs::write(folder.path().join(name), "old").unwrap();
        }
        let refused = run(&folder, typed).expect(1);
        refused.expect_sentence(&[name, "exists already", "--overwrite"]);
        for name in old {
            let content = fs::read_to_string(folder.path().join(name)).unwrap();
            assert_eq!(content, "old", "{typed}: {name}");
        }
    };
    check("orient a.ply -o out.ply", "out.ply");
    check("orient a.ply -o new.ply --json out.jsonl", "out.jsonl");
    check("generate sphere -o out.ply --points 300", "out.ply");
    check("generate sphere -o new.ply --truth truth.ply --points 300", "truth.ply");
    check("render a.ply -o out.png", "out.png");
    check("orient a.ply b.ply -o out --quiet", "a.ply");
    let exists = |name: &str| folder.path().join(name).exists();
    assert!(
        !exists("new.ply"),
        "nothing is written before all names are known to be free"
    );
    assert!(exists("out/b.ply"), "the others are oriented all the same");

    for typed in [
        "orient a.ply -o out.ply --json out.jsonl --overwrite",
        "orient a.ply b.ply -o out --overwrite",
        "generate sphere -o out.ply --truth truth.ply --points 300 --overwrite",
    ] {
        run(&folder, typed).expect(0);
    }
    for name in old.into_iter().filter(|name| *name != "out.png") {
        assert_ne!(fs::read(folder.path().join(name)).unwrap(), b"old", "{name}");
    }
}

#[test]
fn an_input_is_replaced_only_when_asked() {
    let folder = folder();
    write_sphere_and_mixed(&folder, 900);
    run(&folder, "orient mixed.ply -o mixed.ply --overwrite").expect(0);
    assert_eq!(n_wrong(&folder, "mixed.ply", "truth.ply"), 0);
    assert_eq!(
        names_in(folder.path()),
        ["mixed.ply", "truth.ply"],
        "no temporary file is left"
    );
}

#[test]
fn keep_keeps_every_given_normal() {
    let folder = folder();
    write_sphere_and_mixed(&folder, 1500);
    let kept = run(&folder, "orient mixed.ply -o out.ply --start keep --json -")
        .expect(0)
        .json();
    assert!(kept["sources"].as_u64().unwrap() > 1, "{kept}");
    let bits = |path: &str| -> Vec<[u32; 3]> {
        normals_of(folder.path().join(path))
            .iter()
            .map(|n| n.to_array().map(f32::to_bits))
            .collect()
    };
    assert_eq!(bits("out.ply"), bits("mixed.ply"));
}

#[test]
fn keep_without_normals_says_that_they_are_estimated() {
    let folder = folder();
    let xyz: String = sphere(400)
        .iter()
        .map(|(p, _)| format!("{} {} {}\n", p.x, p.y, p.z))
        .collect();
    fs::write(folder.path().join("scan.xyz"), xyz).unwrap();
    let oriented = run(&folder, "orient scan.xyz -o out.xyz --start keep").expect(0);
    assert!(oriented.err.contains("no normals to keep"), "{}", oriented.err);
    let text = fs::read_to_string(folder.path().join("out.xyz")).unwrap();
    assert_eq!(text.lines().count(), 400);
    assert!(text.lines().all(|line| line.split_whitespace().count() == 6));
}

#[test]
fn points_without_coordinates_are_left_out_aloud() {
    let folder = folder();
    let mut points = sphere(600);
    points.insert(17, (Vec3::new(f32::NAN, 0.0, 0.0), Vec3::Z));
    fs::write(folder.path().join("scan.ply"), ply_of(&points)).unwrap();
    let oriented = run(&folder, "orient scan.ply -o out.ply --json report.jsonl").expect(0);
    oriented.expect_sentence(&["600 points", "1 row"]);
    let report: Value = serde_json::from_slice(&fs::read(folder.path().join("report.jsonl")).unwrap()).unwrap();
    assert_eq!(
        (&report["points"], &report["left_out"]),
        (&Value::from(600), &Value::from(1))
    );
}

#[test]
fn quiet_says_nothing_and_words_go_to_standard_error() {
    let folder = folder();
    fs::write(folder.path().join("scan.ply"), ply_of(&sphere(1200))).unwrap();
    let told = run(&folder, "orient scan.ply -o out.ply").expect(0);
    assert!(told.out.is_empty());
    told.expect_sentence(&["scan.ply", "1,200 points", "1 component", "out.ply"]);
    let quiet = run(&folder, "orient scan.ply -o out.ply --quiet --overwrite").expect(0);
    assert!(quiet.out.is_empty() && quiet.err.is_empty(), "{}", quiet.err);
}

#[test]
fn any_number_of_threads_gives_the_same_file() {
    let folder = folder();
    run(&folder, "generate fandisk -o scan.ply --points 6000 --noise 0.002").expect(0);
    run(&folder, "orient scan.ply -o one.ply --threads 1").expect(0);
    run(&folder, "orient scan.ply -o four.ply --threads 4").expect(0);
    let bytes = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(bytes("one.ply") == bytes("four.ply"));
}

#[test]
fn generate_follows_from_the_seed() {
    let folder = folder();
    for (name, seed) in [("a.ply", 5), ("b.ply", 5), ("c.ply", 6)] {
        run(
            &folder,
            &format!("generate sphere -o {name} --points 500 --noise 0.01 --seed {seed}"),
        )
        .expect(0);
    }
    let bytes = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(bytes("a.ply") == bytes("b.ply"));
    assert!(bytes("a.ply") != bytes("c.ply"));
}

#[test]
fn check_counts_as_documented() {
    let folder = folder();
    let positions: Vec<Vec3> = sphere(60).into_iter().map(|(p, _)| p).collect();
    let with = |normal_of: &dyn Fn(usize) -> Vec3| -> String {
        ply_of(
            &positions
                .iter()
                .enumerate()
                .map(|(index, &p)| (p, normal_of(index)))
                .collect::<Vec<_>>(),
        )
    };
    // Points 0 and 1 are not judged; of the rest 2 has no normal, 3 is NaN, all up to 50 are turned.
    let truth = with(&|index| if index < 2 { Vec3::ZERO } else { positions[index] });
    let result = with(&|index| match index {
        2 => Vec3::ZERO,
        3 => Vec3::NAN,
        4..50 => -positions[index],
        _ => positions[index],
    });
    fs::write(folder.path().join("truth.ply"), truth).unwrap();
    fs::write(folder.path().join("result.ply"), result).unwrap();
    let report = run(&folder, "check result.ply --reference truth.ply --json")
        .expect(0)
        .json();
    assert_eq!(report["points"], 60);
    assert_eq!(report["judged"], 58);
    assert_eq!(report["wrong"], 48);
    assert_eq!(report["wrong_global_flip"], 12);
    assert_eq!(report["wrong_component_flip"], 12);
    assert_eq!(report["components"], 1);
    assert_eq!(report["undefined"], 2);
    assert!(report["mean_unsigned_angle_degrees"].as_f64().unwrap() < 0.1);
    let words = run(&folder, "check result.ply --reference truth.ply").expect(0);
    for (label, count) in [
        ("points", "60"),
        ("judged", "58"),
        ("wrong", "48"),
        ("without a normal", "2"),
    ] {
        let row = words.out.lines().find(|line| line.starts_with(&format!("{label} ")));
        let row = row.unwrap_or_else(|| panic!("no row {label:?} in {}", words.out));
        assert!(row[label.len()..].trim_start().starts_with(count), "{row}");
    }
}

#[test]
fn check_refuses_files_of_other_points() {
    let folder = folder();
    let truth = sphere(200);
    let mut reordered = truth.clone();
    reordered.swap(10, 150);
    let bare: String = truth
        .iter()
        .map(|(p, _)| format!("{} {} {}\n", p.x, p.y, p.z))
        .collect();
    for (name, text) in [
        ("truth.ply", ply_of(&truth)),
        ("fewer.ply", ply_of(&truth[..199])),
        ("reordered.ply", ply_of(&reordered)),
        ("bare.xyz", bare),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let check = |result: &str, words: &[&str]| {
        let failed = run(&folder, &format!("check {result} --reference truth.ply")).expect(1);
        assert!(failed.out.is_empty());
        failed.expect_sentence(words);
    };
    check("fewer.ply", &["199", "200", "fewer.ply", "same points"]);
    check("reordered.ply", &["point 10", "reordered.ply", "same order"]);
    check("bare.xyz", &["bare.xyz", "no normals"]);
    check(
        "missing.ply",
        &["error: missing.ply: there is no such file or folder: check the path\n"],
    );
    check(".", &["."]);
}

#[test]
fn help_has_examples_and_goes_to_standard_output() {
    let folder = folder();
    for command in ["", "orient", "check", "render", "generate"] {
        let help = run(&folder, &format!("{command} --help")).expect(0);
        assert!(help.out.contains("Examples:\n  normend "), "{}", help.out);
        assert!(help.err.is_empty());
    }
    let version = run(&folder, "--version").expect(0);
    assert_eq!(version.out.trim(), concat!("normend ", env!("CARGO_PKG_VERSION")));
}

#[test]
fn a_closed_standard_output_is_no_error() {
    let folder = folder();
    write_sphere_and_mixed(&folder, 2000);
    for typed in [
        "check mixed.ply --reference truth.ply",
        "orient mixed.ply -o out.ply --json - --quiet",
    ] {
        let mut command = normend(&folder);
        command
            .args(typed.split_whitespace())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let err = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), err.as_str()), (Some(0), ""), "{typed}");
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_stops_the_work_and_leaves_nothing_behind() {
    let folder = folder();
    run(&folder, "generate torus -o scan.ply --points 400000").expect(0);
    let mut command = normend(&folder);
    // The report's file appears once Ctrl-C is listened to, before the scan is read.
    command.args("orient scan.ply -o out.ply --json report.jsonl --threads 1".split_whitespace());
    let child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while !folder.path().join("report.jsonl").exists() {
        std::thread::yield_now();
    }
    // The shell's own kill: the program of that name is not everywhere.
    let interrupt = format!("kill -INT {}", child.id());
    assert!(Command::new("sh").args(["-c", &interrupt]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{err}");
    assert!(err.contains("stopped") && !err.contains("panicked"), "{err}");
    assert_eq!(names_in(folder.path()), ["report.jsonl", "scan.ply"]);
}

#[test]
fn render_draws_right_normals_blue_and_turned_ones_orange() {
    let folder = folder();
    let truth = sphere(20_000);
    let turned: Vec<_> = truth.iter().map(|&(p, n)| (p, -n)).collect();
    fs::write(folder.path().join("right.ply"), ply_of(&truth)).unwrap();
    fs::write(folder.path().join("turned.ply"), ply_of(&turned)).unwrap();
    /// Pixels where blue outweighs red by far, where red outweighs blue by far, and all.
    fn count(path: &Path) -> (usize, usize, usize) {
        let picture = image::open(path).unwrap().to_rgb8();
        assert_eq!(picture.dimensions(), (400, 300));
        let is_blue = |p: &&image::Rgb<u8>| i32::from(p[2]) > i32::from(p[0]) + 40;
        let is_orange = |p: &&image::Rgb<u8>| i32::from(p[0]) > i32::from(p[2]) + 40;
        (
            picture.pixels().filter(is_blue).count(),
            picture.pixels().filter(is_orange).count(),
            400 * 300,
        )
    }
    let rendered = run(&folder, "render right.ply -o right.png --size 400x300 --view front");
    if rendered.code == Some(1) && rendered.err.contains("mesa-vulkan-drivers") {
        let is_required = std::env::var_os("NORMEND_REQUIRE_GPU").is_some_and(|value| value == "1");
        assert!(!is_required, "{}", rendered.err);
        println!("skipped: no graphics adapter");
        return;
    }
    rendered.expect(0);
    run(&folder, "render turned.ply -o turned.png --size 400x300 --view front").expect(0);
    let (blue, orange, all) = count(&folder.path().join("right.png"));
    // At the silhouette discs show a sliver of their other side.
    assert!(
        blue > all / 6 && orange < blue / 10,
        "{blue} blue, {orange} orange of {all}"
    );
    let (blue_turned, orange_turned, _) = count(&folder.path().join("turned.png"));
    assert!(
        orange_turned > all / 6 && blue_turned < orange_turned / 10,
        "{blue_turned} blue, {orange_turned} orange"
    );
    // Without its background the picture is clear around the sphere and the same on it.
    run(
        &folder,
        "render right.ply -o clear.png --size 400x300 --view front --transparent",
    )
    .expect(0);
    let with = image::open(folder.path().join("right.png")).unwrap().to_rgba8();
    let without = image::open(folder.path().join("clear.png")).unwrap().to_rgba8();
    let n_clear = without.pixels().filter(|pixel| pixel[3] == 0).count();
    assert!(n_clear > all / 6 && n_clear < all * 5 / 6, "{n_clear}");
    let pairs = with.pixels().zip(without.pixels());
    assert!(pairs.filter(|(_, pixel)| pixel[3] != 0).all(|(a, b)| a == b));
    // With y down, the top is what the front is with z up.
    let n_other = |typed: &str| {
        run(
            &folder,
            &format!("render right.ply -o top.png --overwrite --size 400x300 {typed}"),
        )
        .expect(0);
        let top = image::open(folder.path().join("top.png")).unwrap().to_rgba8();
        with.pixels().zip(top.pixels()).filter(|(a, b)| a != b).count()
    };
    let (same, other) = (n_other("--view top --up -y"), n_other("--view top"));
    assert!(
        same < all / 100 && other > all / 20,
        "{same} and {other} of {all} pixels"
    );
}

#[test]
fn render_turns_a_scan_once_around() {
    let folder = folder();
    // What lies behind points inward.
    let points: Vec<_> = (sphere(20_000).into_iter())
        .map(|(p, n)| if p.y > 0.0 { (p, -n) } else { (p, n) })
        .collect();
    fs::write(folder.path().join("half.ply"), ply_of(&points)).unwrap();
    let line = "render half.ply -o film.png --size 200x200 --view front --turntable 4";
    let rendered = run(&folder, line);
    if rendered.code == Some(1) && rendered.err.contains("mesa-vulkan-drivers") {
        let is_required = std::env::var_os("NORMEND_REQUIRE_GPU").is_some_and(|value| value == "1");
        assert!(!is_required, "{}", rendered.err);
        println!("skipped: no graphics adapter");
        return;
    }
    rendered.expect(0);
    let n_orange = |frame: usize| {
        let picture = image::open(folder.path().join(format!("film_{frame:03}.png")))
            .unwrap()
            .to_rgb8();
        let is_orange = |p: &&image::Rgb<u8>| i32::from(p[0]) > i32::from(p[2]) + 40;
        picture.pixels().filter(is_orange).count()
    };
    let counts: Vec<usize> = (0..4).map(n_orange).collect();
    assert!(counts[0] < counts[2] / 10 && counts[2] > 200 * 200 / 6, "{counts:?}");
    assert!(counts[1] > counts[2] / 4 && counts[1] < counts[2] * 3 / 4, "{counts:?}");
    assert!(!folder.path().join("film.png").exists() && !folder.path().join("film_004.png").exists());
    let again = run(&folder, line);
    assert!(
        again.code == Some(1) && again.err.contains("film_000.png exists already"),
        "{}",
        again.err
    );
    run(&folder, "render half.ply -o film.png --turntable 1").expect(2);
}

#[test]
fn render_shows_the_colors_of_the_file_or_says_that_there_are_none() {
    let folder = folder();
    let truth = sphere(2_000);
    fs::write(folder.path().join("plain.ply"), ply_of(&truth)).unwrap();
    let mut colored = ply_of(&truth).replace("end_header\n", "");
    colored = colored.replace("property float nz\n", "property float nz\nCOLORS");
    let (header, rows) = colored.split_once("COLORS").unwrap();
    let mut text = header.to_owned();
    for name in ["red", "green", "blue"] {
        writeln!(text, "property uchar {name}").unwrap();
    }
    text.push_str("end_header\n");
    for row in rows.lines() {
        writeln!(text, "{row} 255 0 0").unwrap();
    }
    fs::write(folder.path().join("red.ply"), text).unwrap();
    let rendered = run(
        &folder,
        "render red.ply -o red.png --size 100x80 --mode colors --transparent",
    );
    if rendered.code == Some(1) && rendered.err.contains("mesa-vulkan-drivers") {
        let is_required = std::env::var_os("NORMEND_REQUIRE_GPU").is_some_and(|value| value == "1");
        assert!(!is_required, "{}", rendered.err);
        println!("skipped: no graphics adapter");
        return;
    }
    rendered.expect(0);
    let picture = image::open(folder.path().join("red.png")).unwrap().to_rgba8();
    let drawn: Vec<_> = picture.pixels().filter(|pixel| pixel[3] != 0).collect();
    assert!(drawn.len() > 1_000, "{} pixels", drawn.len());
    assert!(
        drawn
            .iter()
            .all(|pixel| pixel[0] > 30 && pixel[1] == 0 && pixel[2] == 0)
    );
    let refused = run(&folder, "render plain.ply -o plain.png --mode colors").expect(1);
    for word in ["plain.ply", "no colors", "--mode"] {
        assert!(refused.err.contains(word), "no {word:?} in {}", refused.err);
    }
}

#[test]
fn without_a_graphics_driver_the_missing_package_is_named() {
    let folder = folder();
    fs::write(folder.path().join("scan.ply"), ply_of(&sphere(300))).unwrap();
    let mut command = normend(&folder);
    command.args(["render", "scan.ply", "-o", "out.png"]);
    command
        .env("WGPU_BACKEND", "vulkan")
        .env("VK_ICD_FILENAMES", "/nonexistent")
        .env("VK_DRIVER_FILES", "/nonexistent");
    let failed = finish(&mut command).expect(1);
    assert!(failed.err.contains("mesa-vulkan-drivers"), "{}", failed.err);
    assert!(!folder.path().join("out.png").exists());
}

#[cfg(target_os = "linux")]
#[test]
fn without_a_display_the_editor_says_so() {
    let folder = folder();
    fs::write(folder.path().join("scan.ply"), ply_of(&sphere(300))).unwrap();
    for typed in ["", "scan.ply"] {
        let failed = run(&folder, typed).expect(1);
        assert!(failed.err.contains("display"), "{}", failed.err);
        assert!(failed.out.is_empty());
    }
}
