//! Reading, rewriting and writing OBJ.

use std::fs;

use glam::{DVec3, Vec3};
use normend_core::Silent;
use proptest::prelude::*;

use crate::{FileFormat, Scan, WriteOptions, read_bytes};

fn scan(content: impl AsRef<[u8]>) -> Scan {
    read_bytes(content.as_ref().to_vec(), "scan.obj", &Silent).unwrap()
}

fn points(scan: &Scan) -> Vec<DVec3> {
    let positions = scan.cloud.positions().iter();
    positions
        .map(|position| scan.cloud.origin() + position.as_dvec3())
        .collect()
}

fn written(scan: &Scan, normals: &[Vec3], name: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let options = WriteOptions {
        rule: "up".to_owned(),
        ..WriteOptions::default()
    };
    scan.write(normals, &path, &options, &Silent).unwrap();
    String::from_utf8(fs::read(path).unwrap()).unwrap()
}

/// Reads `input`, writes `normals`, and expects `expect`, where `{own}` is the comment line.
fn check(input: &str, normals: &[Vec3], expect: &str) {
    let own = format!("# Normend {}: normals oriented, rule: up", env!("CARGO_PKG_VERSION"));
    let out = written(&scan(input), normals, "out.obj");
    assert_eq!(out, expect.replace("{own}", &own));
    let again = scan(&out);
    assert_eq!(again.given_normals.as_ref().unwrap()[..], *normals);
    assert_eq!(points(&again), points(&scan(input)));
    // What was written is written again in place.
    assert_eq!(written(&again, normals, "out.obj"), out);
}

#[test]
fn normals_in_the_order_of_points_are_replaced_in_place() {
    let input = "# head\r\nmtllib a\\b\\\r\no thing\r\nvn 0.0 0.60 -.8 # first\r\nv 1 2 3 0.5 0 1\r\nvn  1 0 0\r\n\tv 4 5 6 0 0 1 # last\r\n\
                 vt 0 0\r\nf 1/1 2/1 -1/1\r\nusemtl paint\r\n";
    let given = scan(input);
    assert_eq!(given.format(), FileFormat::Obj);
    assert_eq!(points(&given), [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)]);
    assert_eq!(
        given.given_normals.as_ref().unwrap()[..],
        [Vec3::new(0.0, 0.6, -0.8), Vec3::X]
    );
    assert_eq!(
        given.scalar_columns(),
        ["x", "y", "z", "red", "green", "blue", "nx", "ny", "nz"]
    );
    assert_eq!(given.scalar("ny", &Silent).unwrap().unwrap()[0] as f32, 0.6);
    assert_eq!(given.colors(&Silent).unwrap().unwrap(), [[128, 0, 255], [0, 0, 255]]);
    check(
        input,
        &[Vec3::new(0.0, -0.6, 0.8), Vec3::Y],
        "{own}\r\n# head\r\nmtllib a\\b\\\r\no thing\r\nvn 0.0 -0.60 .8 # first\r\nv 1 2 3 0.5 0 1\r\nvn  0 1 0\r\n\
         \tv 4 5 6 0 0 1 # last\r\nvt 0 0\r\nf 1/1 2/1 -1/1\r\nusemtl paint\r\n",
    );
}

#[test]
fn normals_that_faces_give_to_points_are_replaced_in_place() {
    // The second normal is the first point's, and lines are joined.
    check(
        "v 0 0 0\nv 1 0 \\\n 0 1\nv 0 1 0\nvn 0 1 0\nvn 0 0 \\\n1\nvn 1 0 0\nf 1//2 2//1 \\\n-1//-1\n# Normend 0: old\n",
        &[Vec3::NEG_Z, Vec3::Y, Vec3::Z],
        "v 0 0 0\nv 1 0 \\\n 0 1\nv 0 1 0\nvn 0 1 0\nvn 0 0 \\\n-1\nvn 0 0 1\nf 1//2 2//1 \\\n-1//-1\n{own}\n",
    );
}

#[test]
fn new_normals_follow_points_and_faces_refer_to_them() {
    check(
        "v 1 2 3\nv 4 5 6\n\nv 7 8 9\nf 1 2/7 -1\nl 1 2\np 1\nv 1 1 1",
        &[Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X],
        "{own}\nv 1 2 3\nv 4 5 6\nvn 1 0 0\nvn 0 1 0\n\nv 7 8 9\nvn 0 0 1\nf 1//1 2/7/2 -1//3\nl 1 2\np 1\nv 1 1 1\nvn -1 0 0\n",
    );
    check(
        "v 1 2 3\nv 4 5 6",
        &[Vec3::X, Vec3::Y],
        "{own}\nv 1 2 3\nv 4 5 6\nvn 1 0 0\nvn 0 1 0\n",
    );
}

#[test]
fn normals_of_corners_become_those_of_points() {
    // A wedge: the first point has two normals, the last none, and one normal belongs to nothing.
    let input =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 nan\nv 8 8 8\nvn 0 0 1\nvn 0 1 0\nvn 5 5 5\nf 1/3/1 2//1 3//1\nf 1//2 2 7\n";
    let given = scan(input);
    assert_eq!(
        given.given_normals.as_ref().unwrap()[..],
        [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::ZERO]
    );
    check(
        input,
        &[Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y],
        "{own}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 nan\nv 8 8 8\nvn 1 0 0\nvn -1 0 0\nvn 0 1 0\nvn 0 0 1\nvn 0 -1 0\n\
         f 1/3/1 2//2 3//3\nf 1//1 2//2 7\n",
    );
    // Without faces and with another number, nobody knows whose they are.
    assert!(scan("v 1 2 3\nv 4 5 6\nvn 0 0 1\n").given_normals.is_none());
    check(
        "v 1 2 3\nvn 0 0 1\nv 4 5 6\n",
        &[Vec3::X, Vec3::Y],
        "{own}\nv 1 2 3\nv 4 5 6\nvn 1 0 0\nvn 0 1 0\n",
    );
}

#[test]
fn lines_that_end_with_a_carriage_return_and_marks() {
    check(
        "\u{feff}v 1 2 3\rv 4 5 6\r",
        &[Vec3::X, Vec3::Y],
        "\u{feff}{own}\rv 1 2 3\rv 4 5 6\rvn 1 0 0\rvn 0 1 0\r",
    );
    // Without an extension, the content tells.
    let unnamed = read_bytes(
        b"# made by hand\nmtllib a\nv 1 2 3\nv 4 5 6\n".to_vec(),
        "scan",
        &Silent,
    )
    .unwrap();
    assert_eq!(unnamed.format(), FileFormat::Obj);
}

#[test]
fn broken_files_are_refused_in_words() {
    let check = |content: &str, expect: &str| {
        let error = read_bytes(content.into(), "scan.obj", &Silent).unwrap_err();
        assert_eq!(error.to_string(), format!("scan.obj{expect}"));
    };
    check(
        "L\u{1}\0\0",
        ": the file has no points (lines that begin with \"v\"): open one that has",
    );
    check(
        "v 1 2 3\nv 1 2 # 3\n",
        ", line 2: \"v 1 2 # 3\" has not three values: correct the line",
    );
    check(
        "v 1 2 3\nv 1 2 x\n",
        ", line 2: z is \"x\", which is not a number: correct it",
    );
    check(
        "v 1 2 3\nvn 1 2\n",
        ", line 2: \"vn 1 2\" has not three values: correct the line",
    );
    check(
        "v 1 2 3\nvn 1 a 2\n",
        ", line 2: ny is \"a\", which is not a number: correct it",
    );
    let missing = "that is not there (1 points, 1 normals): correct it, or remove the part after the last slash";
    for corner in [
        "1//2",
        "2//1",
        "1//0",
        "1//-2",
        "-2//1",
        "x//1",
        "1//9223372036854775808",
        "1//-9223372036854775808",
    ] {
        check(
            &format!("v 1 2 3\nvn 0 0 1\nf {corner}\n"),
            &format!(", line 3: \"{corner}\" refers to a point or normal {missing}"),
        );
    }
}

#[test]
fn new_files_have_points_colors_and_normals() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\n\
               property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float quality\nend_header\n\
               500000.001 2 3 0 128 255 0.5\n4 5 6 1 1 1 0.5\n";
    let ply = read_bytes(ply.into(), "scan.ply", &Silent).unwrap();
    let losses: Vec<String> = ply
        .losses("out.obj".as_ref())
        .unwrap()
        .iter()
        .map(ToString::to_string)
        .collect();
    assert_eq!(losses, ["\"quality\": OBJ holds points, normals and colors only"]);
    let out = written(&ply, &[Vec3::X, Vec3::new(0.0, 0.6, -0.8)], "out.obj");
    let body = "v 500000.001 2 3 0 0.5019608 1\nvn 1 0 0\nv 4 5 6 0.003921569 0.003921569 0.003921569\nvn 0 0.6 -0.8\n";
    assert!(
        out.starts_with("# Normend ") && out.ends_with(&format!("\n{body}")),
        "{out}"
    );
    let again = scan(&out);
    assert_eq!(again.colors(&Silent).unwrap(), ply.colors(&Silent).unwrap());
    assert_eq!(
        again.given_normals.as_ref().unwrap()[..],
        [Vec3::X, Vec3::new(0.0, 0.6, -0.8)]
    );
    assert_eq!(again.scalar("x", &Silent).unwrap().unwrap()[0], 500_000.001);
    // Rows without a place are left out, and named.
    let holes = read_bytes(b"1 2 3\nnan 5 6\n7 8 9\n".to_vec(), "a.xyz", &Silent).unwrap();
    let losses: Vec<String> = holes
        .losses("out.obj".as_ref())
        .unwrap()
        .iter()
        .map(ToString::to_string)
        .collect();
    assert_eq!(losses, ["1 row without a place: OBJ holds points alone"]);
    let out = written(&holes, &[Vec3::X, Vec3::Y], "out.obj");
    assert!(out.ends_with("\nv 1 2 3\nvn 1 0 0\nv 7 8 9\nvn 0 1 0\n"), "{out}");
    // A mesh that becomes another format says what it was.
    let mesh = scan("v 1 2 3\nv 4 5 6\nvt 0 0\nf 1 2 1\nf 1 2 2\nusemtl a\n");
    let losses: Vec<String> = mesh
        .losses("out.ply".as_ref())
        .unwrap()
        .into_iter()
        .map(|loss| loss.what)
        .collect();
    assert_eq!(
        losses,
        [
            "2 faces",
            "1 place in a texture",
            "1 line of groups, materials and the like"
        ]
    );
}

proptest! {
    #[test]
    fn any_mesh_keeps_all_but_normals(
        lines in proptest::collection::vec((0..6, 1_usize..30, 1_usize..30), 1..60),
        at in 0_usize..2000,
        byte in any::<u8>(),
    ) {
        let mut content = "v 0.5 0 0\nvn 0 0 1\n".to_owned();
        for (kind, a, b) in lines {
            content += &match kind {
                0 | 1 => format!("v {a} {b} 1\n"),
                2 => format!("vn 0 {a} {b}\n"),
                3 => format!("f {a}//1 {b}//1 1//1\n"),
                4 => format!("f {a} {b}/2 -1\n"),
                _ => format!("# {a} {b}\n"),
            };
        }
        let mut damaged = content.clone().into_bytes();
        let n_bytes = damaged.len();
        damaged[at % n_bytes] = byte;
        for bytes in [content.into_bytes(), damaged] {
            let Ok(scan) = read_bytes(bytes, "scan.obj", &Silent) else {
                continue;
            };
            let normals: Vec<Vec3> = (0..scan.cloud.n_points()).map(|point| [Vec3::X, Vec3::NEG_Y][point % 2]).collect();
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("out.obj");
            scan.write(&normals, &path, &WriteOptions::default(), &Silent).unwrap();
            let again = crate::read(&path, &Silent).unwrap();
            prop_assert_eq!(again.given_normals.unwrap().to_vec(), normals);
            prop_assert_eq!(again.cloud.positions(), scan.cloud.positions());
        }
    }
}
