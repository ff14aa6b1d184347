//! LAS and LAZ through the real program: converted, packed, oriented, and compared with the same points in PLY.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use normend_core::Silent;
use normend_io::{Scan, read};

fn try_run(folder: &Path, typed: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_normend"))
        .current_dir(folder)
        .env("NORMEND_CONFIG_DIR", folder.join("config"))
        .env_remove("RUST_LOG")
        .args(typed.split_whitespace())
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

fn run(folder: &Path, typed: &str) -> String {
    let output = try_run(folder, typed);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{typed}: {words}");
    words
}

fn scan(folder: &Path, name: &str) -> Scan {
    read(&folder.join(name), &Silent).unwrap()
}

#[test]
fn packed_and_plain_points_get_the_same_normals() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    run(folder, "generate torus --points 3000 -o a.ply");
    run(folder, "convert a.ply -o a.las");
    run(folder, "convert a.las -o a.laz");
    run(folder, "convert a.laz -o again.las");
    assert_eq!(
        fs::read(folder.join("again.las")).unwrap(),
        fs::read(folder.join("a.las")).unwrap()
    );
    let sizes = ["a.laz", "a.las"].map(|name| fs::metadata(folder.join(name)).unwrap().len());
    assert!(sizes[0] < sizes[1], "{sizes:?}");
    run(folder, "orient a.las -o from_plain.las");
    run(folder, "orient a.laz -o from_packed.laz");
    run(folder, "orient a.laz -o from_packed.las");
    let [plain, packed] = ["from_plain.las", "from_packed.las"].map(|name| fs::read(folder.join(name)).unwrap());
    assert_eq!(plain, packed);
    let (plain, packed) = (scan(folder, "from_plain.las"), scan(folder, "from_packed.laz"));
    assert_eq!(plain.given_normals, packed.given_normals);
    assert_eq!(plain.cloud.positions(), packed.cloud.positions());
    let expect = scan(folder, "a.ply");
    for (own, theirs) in plain.cloud.positions().iter().zip(expect.cloud.positions()) {
        let away = (plain.cloud.origin() + own.as_dvec3()) - (expect.cloud.origin() + theirs.as_dvec3());
        assert!(away.length() < 1e-6, "{away}");
    }
    // Over the input, which was packed and stays so.
    run(folder, "orient a.laz -o a.laz --overwrite");
    assert!(scan(folder, "a.laz").given_normals.is_some());
}

#[test]
fn what_a_las_file_cannot_hold_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(
        folder.join("a.csv"),
        "x,y,z,name\n0,0,0,wall\n1,0,0,door\n0,1,0,wall\nnan,1,1,wall\n",
    )
    .unwrap();
    let words = run(folder, "convert a.csv -o a.las");
    assert!(words.contains("\"name\": LAS holds numbers, not words"), "{words}");
    assert!(words.contains("1 row without a place"), "{words}");
    assert_eq!(scan(folder, "a.las").cloud.n_points(), 3);
    fs::write(folder.join("b.las"), b"LASF").unwrap();
    let refused = try_run(folder, "orient b.las -o c.las");
    assert_eq!(refused.status.code(), Some(1));
    let words = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        words.contains("the file ends inside its header: copy it again"),
        "{words}"
    );
}
