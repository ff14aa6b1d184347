//! Clouds that are no surface, or hardly one: each gives a right result or a sentence, from every method and in bounded time and memory.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::fmt::Write as _;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use glam::{DVec3, Vec3};
use normend_core::{Estimator, Parameters, PointCloud, Preset, Propagation, Silent, Start, shapes};
use normend_render::HeadlessDevice;
use serde_json::Value;
use tempfile::TempDir;

/// Far longer than any of these runs takes; what is not done then never would be.
const FOREVER: Duration = Duration::from_secs(300);

/// Far more than the program needs for a small cloud.
const PLENTY_OF_MEMORY: u64 = 1 << 30;

/// A finished run of the program.
struct Run {
    code: Option<i32>,
    out: String,
    err: String,
}

/// Runs the program in `folder` with `typed` split at spaces.
fn run(folder: &TempDir, typed: &str) -> Run {
    let mut child = Command::new(env!("CARGO_BIN_EXE_normend"))
        .args(typed.split_whitespace())
        .current_dir(folder.path())
        .env("NORMEND_CONFIG_DIR", folder.path().join("config"))
        .env_remove("RUST_LOG")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Both are a few lines, which a pipe holds.
    let start = Instant::now();
    let code = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status.code();
        }
        if start.elapsed() > FOREVER {
            child.kill().unwrap();
            panic!("normend {typed} does not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let (mut out, mut err) = (String::new(), String::new());
    child.stdout.unwrap().read_to_string(&mut out).unwrap();
    child.stderr.unwrap().read_to_string(&mut err).unwrap();
    assert!(!err.contains("panicked"), "normend {typed}: {err}");
    assert!(!err.contains("os error"), "normend {typed}: {err}");
    Run { code, out, err }
}

/// A cloud, and what becomes of it.
struct Case {
    name: &'static str,
    points: Vec<DVec3>,
    /// A word of the sentence that refuses it; `None` when it gets normals.
    refused: Option<&'static str>,
}

fn ball(n: usize) -> impl Iterator<Item = DVec3> {
    shapes::sphere(n).positions.into_iter().map(|place| place.as_dvec3())
}

/// Two square planes above each other, `side × side` places each, every one so many times.
fn planes(side: u32, copies: usize) -> Vec<DVec3> {
    let place = |i: u32| {
        DVec3::new(
            (i % side).into(),
            (i / side % side).into(),
            (4 * (i / side / side)).into(),
        )
    };
    (0..2 * side * side).flat_map(|i| vec![place(i); copies]).collect()
}

fn cases() -> Vec<Case> {
    let works = |name, points| Case {
        name,
        points,
        refused: None,
    };
    let refused = |name, points, word| Case {
        name,
        points,
        refused: Some(word),
    };
    let not_finite = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    let with_holes = ball(300).enumerate().map(|(i, place)| match i % 10 {
        axis @ 0..3 => {
            let mut place = place;
            place[axis] = not_finite[i / 10 % 3];
            place
        }
        _ => place,
    });
    vec![
        refused("nothing", Vec::new(), "no point"),
        refused(
            "nothing_finite",
            vec![DVec3::NAN; 20],
            "no point has finite coordinates",
        ),
        works("one", vec![DVec3::new(500_000.123, 4_500_000.456, 78.9)]),
        works("two", vec![DVec3::ZERO, DVec3::X]),
        works("five", vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE]),
        works("all_equal", vec![DVec3::new(1.0, -2.0, 3.0); 1000]),
        works(
            "line",
            (0..1000).map(|i| DVec3::new(1.0, 2.0, -0.5) * f64::from(i)).collect(),
        ),
        works(
            "line_with_copies",
            (0..1000).map(|i| DVec3::X * f64::from(i % 100)).collect(),
        ),
        works("plane_of_copies", planes(15, 12)),
        works("holes", with_holes.collect()),
        works("small", ball(300).map(|place| place * 1e-14).collect()),
        works("large", ball(300).map(|place| place * 1e14).collect()),
        works(
            "far",
            ball(300).map(|place| place + DVec3::new(5e5, 4.5e6, 1e7)).collect(),
        ),
        works("outlier", ball(300).chain([DVec3::X * 1e5]).collect()),
        refused(
            "too_small",
            ball(300).map(|place| place * 1e-30).collect(),
            "change the unit",
        ),
        refused(
            "too_large",
            ball(300).map(|place| place * 1e30).collect(),
            "change the unit",
        ),
        refused(
            "far_outlier",
            ball(300).chain([DVec3::Y * 1e30]).collect(),
            "far from all others",
        ),
    ]
}

/// A binary PLY with double coordinates and a column that is not finite anywhere.
fn ply(points: &[DVec3]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         property float odd\nend_header\n",
        points.len()
    )
    .into_bytes();
    for (row, point) in points.iter().enumerate() {
        bytes.extend(point.to_array().into_iter().flat_map(f64::to_le_bytes));
        bytes.extend([f32::NAN, f32::INFINITY][row % 2].to_le_bytes());
    }
    bytes
}

fn xyz(points: &[DVec3]) -> Vec<u8> {
    let mut text = String::new();
    for point in points {
        writeln!(text, "{} {} {}", point.x, point.y, point.z).unwrap();
    }
    text.into_bytes()
}

/// Unit normals by point of what was written, which must have as many rows as before.
fn normals_of(path: &Path, case: &Case, method: &str) {
    let scan = normend_io::read(path, &Silent).unwrap();
    let n_finite = case.points.iter().filter(|point| point.is_finite()).count();
    assert_eq!(scan.cloud.n_points(), n_finite, "{} by {method}", case.name);
    assert_eq!(
        scan.cloud.n_points() + scan.n_left_out,
        case.points.len(),
        "{} by {method}",
        case.name
    );
    let normals = scan.given_normals.unwrap();
    assert!(
        normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-5),
        "{} by {method}",
        case.name
    );
    // Points in one place have one normal.
    for (point, normal) in normals.iter().enumerate().take(40) {
        let place = scan.cloud.relative(point);
        for (other, its_normal) in normals.iter().enumerate() {
            if scan.cloud.relative(other) == place {
                assert_eq!(normal, its_normal, "{} by {method}: {point} and {other}", case.name);
            }
        }
    }
}

/// The ways of `normend orient`.
fn methods() -> Vec<String> {
    let presets = Preset::ALL
        .into_iter()
        .map(|preset| format!("--preset {}", preset.name()));
    let estimators = Estimator::ALL
        .into_iter()
        .map(|estimator| format!("--estimator {} --preset tree", estimator.name()));
    let others = [
        "--rule into-room",
        "--rule up --preset tree",
        "--preset tree --k-normals 900 --k-graph 900",
        "--start keep",
    ];
    presets.chain(estimators).chain(others.map(str::to_owned)).collect()
}

/// Orients a case by every method, from both formats.
fn orient(folder: &TempDir, case: &Case) {
    for (extension, bytes) in [("ply", ply(&case.points)), ("xyz", xyz(&case.points))] {
        let scan = format!("{}.{extension}", case.name);
        fs::write(folder.path().join(&scan), &bytes).unwrap();
        for method in methods() {
            let result = run(
                folder,
                &format!("orient {scan} -o out.{extension} --overwrite --json - {method}"),
            );
            let about = format!("{scan} by {method}: {}", result.err);
            let Some(word) = case.refused else {
                assert_eq!(result.code, Some(0), "{about}");
                let report: Value = serde_json::from_str(&result.out).unwrap();
                assert!(
                    report["peak_rss_bytes"]
                        .as_u64()
                        .is_none_or(|peak| peak < PLENTY_OF_MEMORY),
                    "{about}"
                );
                normals_of(&folder.path().join(format!("out.{extension}")), case, &method);
                continue;
            };
            assert_eq!(result.code, Some(1), "{about}");
            let error = result.err.trim_end();
            // An empty text file has its own sentence.
            let expected = error.contains(word) || (bytes.is_empty() && error.contains("the file is empty"));
            assert!(expected && error.lines().count() == 1, "{about}");
        }
    }
}

#[test]
fn every_method_orients_each_case_or_says_why_not() {
    let folder = tempfile::tempdir().unwrap();
    cases().iter().for_each(|case| orient(&folder, case));
}

#[test]
fn each_case_is_checked_searched_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let has_gpu = match HeadlessDevice::new() {
        Ok(_) => true,
        Err(error) => {
            let required = std::env::var_os("NORMEND_REQUIRE_GPU").is_some_and(|value| value == "1");
            assert!(!required, "NORMEND_REQUIRE_GPU=1, but {error}");
            println!("pictures are skipped: {error}");
            false
        }
    };
    for case in cases() {
        let scan = format!("{}.ply", case.name);
        fs::write(folder.path().join(&scan), ply(&case.points)).unwrap();
        let result = run(&folder, &format!("orient {scan} -o oriented.ply --overwrite"));
        if let Some(refused) = case.refused {
            for command in ["check", "suspects", "render"] {
                let more = match command {
                    "check" => format!("--reference {scan}"),
                    "render" => "-o picture.png --overwrite".to_owned(),
                    _ => String::new(),
                };
                if command != "render" || has_gpu {
                    let result = run(&folder, &format!("{command} {scan} {more}"));
                    assert_eq!(result.code, Some(1), "{command} {scan}: {}", result.err);
                    assert!(result.err.contains(refused), "{command} {scan}: {}", result.err);
                }
            }
            continue;
        }
        assert_eq!(result.code, Some(0), "{scan}: {}", result.err);
        let result = run(&folder, "check oriented.ply --reference oriented.ply --json");
        let report: Value = serde_json::from_str(&result.out).unwrap();
        assert_eq!(report["wrong"], 0, "{scan}");
        let result = run(&folder, "suspects oriented.ply");
        assert_eq!(result.code, Some(0), "{scan}: {}", result.err);
        if has_gpu {
            for (view, input) in [("corner", "oriented.ply"), ("top", scan.as_str())] {
                let result = run(
                    &folder,
                    &format!("render {input} -o picture.png --overwrite --view {view} --size 160x120 --transparent"),
                );
                assert_eq!(result.code, Some(0), "{scan}: {}", result.err);
                let picture = image::open(folder.path().join("picture.png")).unwrap().to_rgba8();
                let n_drawn = picture.pixels().filter(|pixel| pixel.0[3] > 0).count();
                assert!(n_drawn > 0, "nothing is seen of {input} of {scan} from {view}");
                // The discs of a few points are as large as the cloud.
                let are_few = (2..20).contains(&case.points.len());
                assert!(
                    are_few || n_drawn < 160 * 120,
                    "{input} of {scan} fills the picture from {view}"
                );
            }
        }
    }
}

#[test]
fn copies_change_no_sign_of_two_planes() {
    let folder = tempfile::tempdir().unwrap();
    let oriented = |name: &str, copies: usize, method: &str| {
        fs::write(folder.path().join(name), ply(&planes(20, copies))).unwrap();
        let result = run(
            &folder,
            &format!("orient {name} -o out.ply --overwrite --json - {method}"),
        );
        assert_eq!(result.code, Some(0), "{}", result.err);
        let report: Value = serde_json::from_str(&result.out).unwrap();
        assert_eq!(report["components"], 2, "{method}");
        let scan = normend_io::read(&folder.path().join("out.ply"), &Silent).unwrap();
        scan.given_normals.unwrap().to_vec()
    };
    // So many neighbors join the planes.
    for method in methods().into_iter().filter(|method| !method.contains("900")) {
        let (once, often) = (oriented("once.ply", 1, &method), oriented("often.ply", 30, &method));
        for (place, normal) in once.iter().enumerate() {
            assert!(normal.z.abs() > 0.999, "{method}");
            assert!(
                often[30 * place..30 * (place + 1)].iter().all(|copy| copy == normal),
                "{method} {place}"
            );
        }
    }
}

#[test]
fn given_normals_that_are_none_are_estimated() {
    let folder = tempfile::tempdir().unwrap();
    let shape = shapes::sphere(400);
    let mut text = "x y z nx ny nz intensity\n".to_owned();
    for (point, (place, normal)) in shape.positions.iter().zip(&shape.normals).enumerate() {
        let normal = match point % 5 {
            0 => ["nan", "0", "1"].map(str::to_owned),
            1 => ["0", "inf", "-inf"].map(str::to_owned),
            2 => ["0", "0", "0"].map(str::to_owned),
            _ => normal.to_array().map(|value| value.to_string()),
        };
        let intensity = ["nan", "inf", "7"][point % 3];
        writeln!(
            text,
            "{} {} {} {} {intensity}",
            place.x,
            place.y,
            place.z,
            normal.join(" ")
        )
        .unwrap();
    }
    fs::write(folder.path().join("given.xyz"), text).unwrap();
    for method in methods() {
        let result = run(&folder, &format!("orient given.xyz -o out.xyz --overwrite {method}"));
        assert_eq!(result.code, Some(0), "{method}: {}", result.err);
        let scan = normend_io::read(&folder.path().join("out.xyz"), &Silent).unwrap();
        let normals = scan.given_normals.unwrap();
        assert_eq!(normals.len(), 400);
        // Others than those by default may be wrong inside of a ball, or wherever they are asked to be.
        if method == "--preset auto" || method == "--start keep" {
            assert!(
                normals.iter().zip(&shape.normals).all(|(a, b)| a.dot(*b) > 0.5),
                "{method}"
            );
        }
        let written = fs::read_to_string(folder.path().join("out.xyz")).unwrap();
        assert!(
            written
                .lines()
                .skip(1)
                .all(|line| ["nan", "inf", "7"].iter().any(|end| line.ends_with(end))),
            "{method}"
        );
    }
}

#[test]
fn a_million_components_have_a_side_each() {
    // Pairs of points that know nobody else.
    let n_pairs = 1_000_000;
    let positions: Vec<Vec3> = (0..n_pairs)
        .flat_map(|i| {
            let place = Vec3::new(8.0 * (i % 1000) as f32, 6.0 * (i / 1000) as f32, 0.0);
            [place, place + Vec3::X]
        })
        .collect();
    let cloud = PointCloud::new(DVec3::ZERO, positions).unwrap();
    let parameters = Parameters {
        estimator: Estimator::Pca,
        k_normals: 3,
        k_graph: 1,
        ..Preset::Tree.parameters()
    };
    let found = Propagation::new(&cloud, None, parameters, &Silent).unwrap();
    assert_eq!(found.tree.roots().len(), n_pairs);
    assert_eq!(found.default_sources.len(), n_pairs);
    let normals = found.initial_normals();
    assert!(normals.iter().all(|normal| normal.z > 0.999));
    // As many given signs, each of which stays.
    let given: Vec<Vec3> = (0..2 * n_pairs)
        .map(|i| if i % 2 == 0 { Vec3::Z } else { Vec3::NEG_Z })
        .collect();
    let parameters = Parameters {
        start: Start::Keep,
        ..parameters
    };
    let kept = Propagation::new(&cloud, Some(given.as_slice()), parameters, &Silent).unwrap();
    assert_eq!(kept.base_regions.n_base_regions(), 2 * n_pairs);
    assert_eq!(kept.initial_normals(), given);
}

#[test]
fn thousands_of_small_bodies_are_oriented_by_every_preset() {
    // Each of as many points as the automatic method takes for neighbors, and some more.
    let body = shapes::sphere(30).positions;
    let n_bodies = 1500;
    let positions: Vec<Vec3> = (0..n_bodies)
        .flat_map(|i| {
            let place = Vec3::new((i % 40) as f32, (i / 40) as f32, 0.0) * 20.0;
            body.iter().map(move |&point| place + point)
        })
        .collect();
    let cloud = PointCloud::new(DVec3::ZERO, positions).unwrap();
    for preset in Preset::ALL {
        let found = Propagation::new(&cloud, None, preset.parameters(), &Silent).unwrap();
        assert_eq!(found.tree.roots().len(), n_bodies, "{}", preset.name());
        assert!(found.normals.iter().all(|normal| normal.is_normalized()));
    }
}

#[test]
fn the_automatic_method_does_not_become_another_in_silence() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("ball.ply"), ply(&ball(100).collect::<Vec<_>>())).unwrap();
    let result = run(&folder, "orient ball.ply -o out.ply --preset auto --k-graph 8");
    assert_eq!(result.code, Some(2));
    assert!(
        result.err.contains("leave out --k-graph") && result.err.contains("--preset tree"),
        "{}",
        result.err
    );
    assert!(!folder.path().join("out.ply").exists());
    let result = run(&folder, "orient ball.ply -o out.ply --k-graph 8");
    assert_eq!(result.code, Some(0));
    assert!(result.err.contains("the preset is tree"), "{}", result.err);
}

#[test]
fn what_the_system_refuses_is_said_in_words() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("ball.ply"), ply(&ball(100).collect::<Vec<_>>())).unwrap();
    for typed in [
        "orient no.ply -o out.ply",
        "orient ball.ply -o no/such/out.ply",
        "orient ball.ply -o ball.ply/out.ply",
        "orient ball.ply ball.ply -o ball.ply/folder",
        "orient ball.ply -o out.ply --json no/such.json",
        "orient ball.ply -o out.ply --sensors no.tsv",
        "check ball.ply --reference no.ply",
        "check no.ply --reference ball.ply",
        "suspects no.ply",
        "suspects ball.ply --json no/such.json",
        "render no.ply -o picture.png",
        "replay no.recipe ball.ply -o out.ply",
        "generate sphere -o no/such/ball.ply",
        "bench quality no",
        "bench clouds ball.ply",
    ] {
        // The run itself looks for numbers of errors.
        let result = run(&folder, typed);
        assert!(
            matches!(result.code, Some(1 | 2)),
            "normend {typed}: {:?} {}",
            result.code,
            result.err
        );
        assert!(!result.err.trim().is_empty(), "normend {typed}");
    }
}
