//! Files as users have them: what is read from them, and every byte that comes out.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic, as tests do")]

use std::fs;
use std::path::Path;

use glam::{DVec3, Vec3};
use normend_core::{Cancelled, Progress, Silent};
use normend_io::{FileFormat, Positions, Scan, WriteError, WriteOptions, read, read_bytes, write_points};
use proptest::prelude::*;

fn scan(name: &str, content: impl AsRef<[u8]>) -> Scan {
    read_bytes(content.as_ref().to_vec(), name, &Silent).unwrap()
}

fn options() -> WriteOptions {
    WriteOptions {
        rule: "up".to_owned(),
        ..WriteOptions::default()
    }
}

/// What `scan` becomes with these normals in a file of this name.
fn written(scan: &Scan, normals: &[Vec3], name: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    scan.write(normals, &path, &options(), &Silent).unwrap();
    fs::read(path).unwrap()
}

/// Reads `input` from a file called `name`, writes `normals`, and expects `expect`, where `{own}` is the comment line.
fn check(name: &str, input: &str, normals: &[Vec3], expect: &str) {
    let own = format!(
        "comment Normend {}: normals oriented, rule: up",
        env!("CARGO_PKG_VERSION")
    );
    let out = written(&scan(name, input), normals, name);
    assert_eq!(String::from_utf8(out).unwrap(), expect.replace("{own}", &own));
}

fn points(scan: &Scan) -> Vec<DVec3> {
    let positions = scan.cloud.positions().iter();
    positions
        .map(|position| scan.cloud.origin() + position.as_dvec3())
        .collect()
}

#[test]
fn carriage_returns_types_by_their_long_names_and_loose_rows() {
    check(
        "scan.ply",
        "ply\r\nformat ascii 1.0\r\nobj_info from a scanner\r\nelement vertex 3\r\nproperty float32 x\r\nproperty float64 y\r\n\
         property int16 z\r\nproperty uchar red\r\nend_header\r\n0 1.50 -2 255.0\r\n\r\n1 1 1 7   2 2 2 8.\r\n",
        &[Vec3::X, Vec3::Y, Vec3::new(0.6, 0.0, -0.8)],
        "ply\r\nformat ascii 1.0\r\n{own}\r\nobj_info from a scanner\r\nelement vertex 3\r\nproperty float32 x\r\nproperty float64 y\r\n\
         property int16 z\r\nproperty float nx\r\nproperty float ny\r\nproperty float nz\r\nproperty uchar red\r\nend_header\r\n\
         0 1.50 -2 1 0 0 255.0\r\n\r\n1 1 1 0 1 0 7   2 2 2 0.6 0 -0.8 8.\r\n",
    );
}

#[test]
fn a_row_over_several_lines_and_coordinates_apart() {
    check(
        "scan.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float z\nproperty float i\nproperty float y\nproperty float x\n\
         property float t\nend_header\n 3\n9\n2\n\t1\n5",
        &[Vec3::NEG_Z],
        "ply\nformat ascii 1.0\n{own}\nelement vertex 1\nproperty float z\nproperty float i\nproperty float y\nproperty float x\n\
         property float nx\nproperty float ny\nproperty float nz\nproperty float t\nend_header\n 3\n9\n2\n\t1\n\t0\n\t0\n\t-1\n5",
    );
    let scan = scan(
        "scan.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float z\nproperty float y\nproperty float x\nend_header\n3 2 1",
    );
    assert_eq!(points(&scan), [DVec3::new(1.0, 2.0, 3.0)]);
}

#[test]
fn lines_that_end_with_a_carriage_return_alone() {
    check(
        "scan.ply",
        "ply\rformat ascii 1.0\relement vertex 1\rproperty float x\rproperty float y\rproperty float z\rend_header\r1 2 3\r",
        &[Vec3::X],
        "ply\rformat ascii 1.0\r{own}\relement vertex 1\rproperty float x\rproperty float y\rproperty float z\r\
         property float nx\rproperty float ny\rproperty float nz\rend_header\r1 2 3 1 0 0\r",
    );
}

#[test]
fn comments_in_latin_1_and_names_of_any_kind() {
    let head = b"ply\nformat binary_big_endian 1.0\ncomment Fa\xe7ade d'\xe9glise\nelement vertex 1\nproperty float x\nproperty float y\n\
                 property float z\n";
    let rest =
        b"property float scalar_C2C_distances[<0.5]\nelement 3d-m\xe9sh 1\nproperty list uchar int verts\nend_header\n";
    let row = [1.0_f32, 2.0, 3.0].map(f32::to_be_bytes).concat();
    let after = [&4.0_f32.to_be_bytes()[..], &[2, 0, 0, 0, 0, 0, 0, 0, 1], b"left over"].concat();
    let input = [&head[..], rest, &row, &after].concat();
    let scan = scan("scan.ply", input);
    assert_eq!(points(&scan), [DVec3::new(1.0, 2.0, 3.0)]);

    let own = format!(
        "comment Normend {}: normals oriented, rule: up\n",
        env!("CARGO_PKG_VERSION")
    );
    let at = b"ply\nformat binary_big_endian 1.0\n".len();
    let declarations = b"property float nx\nproperty float ny\nproperty float nz\n";
    let normal = [0.0_f32, -1.0, 0.0].map(f32::to_be_bytes).concat();
    let expect = [
        &head[..at],
        own.as_bytes(),
        &head[at..],
        declarations,
        rest,
        &row,
        &normal,
        &after,
    ]
    .concat();
    assert_eq!(written(&scan, &[Vec3::NEG_Y], "out.ply"), expect);
}

#[test]
fn the_former_comment_gives_way() {
    check(
        "scan.ply",
        "ply\nformat ascii 1.0\ncomment first\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\ncomment Normend 0.0.1: normals oriented, rule: old\nend_header\n\
         1 2 3 0 0 1\n",
        &[Vec3::NEG_Z],
        "ply\nformat ascii 1.0\ncomment first\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\n{own}\nend_header\n\
         1 2 3 0 0 -1\n",
    );
    let options = WriteOptions {
        rule: "as\ngiven".to_owned(),
        ..options()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.ply");
    let scan = scan("a.xyz", "1 2 3\n4 5 6\n");
    scan.write(&[Vec3::X; 2], &path, &options, &Silent).unwrap();
    let out = fs::read(path).unwrap();
    assert!(String::from_utf8_lossy(&out).contains("rule: as given\n"));
}

#[test]
fn digits_of_normals_that_stay_or_turn_are_kept() {
    check(
        "scan.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty double normal_z\n\
         property double normal_x\nproperty double normal_y\nend_header\n0 0 0 0.8000 +0.60 0.0\n1 0 0 -8e-1 0.60 0.0\n2 0 0 0.8 0.6 0\n",
        &[
            Vec3::new(0.6, 0.0, 0.8),
            Vec3::new(-0.6, 0.0, 0.8),
            Vec3::new(0.8, 0.0, 0.6),
        ],
        "ply\nformat ascii 1.0\n{own}\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty double normal_z\n\
         property double normal_x\nproperty double normal_y\nend_header\n0 0 0 0.8000 +0.60 0.0\n1 0 0 8e-1 -0.60 0.0\n2 0 0 0.6 0.8 0\n",
    );
}

#[test]
fn normals_in_integers_become_floats() {
    let head = "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty char nx\nproperty short x\nproperty short y\n\
                property  char  ny\nproperty short z\nproperty list uchar uchar l\nproperty float nz\nend_header\n";
    let rows = [
        [1, 7, 0, 8, 0, 0, 9, 0, 1, 5, 0, 0, 0, 0],
        [0, 1, 0, 1, 0, 1, 1, 0, 1, 6, 0, 0, 0, 0],
    ]
    .concat();
    let scan = scan("scan.ply", [head.as_bytes(), &rows].concat());
    assert_eq!(points(&scan), [DVec3::new(7.0, 8.0, 9.0), DVec3::ONE]);
    assert_eq!(scan.given_normals.as_ref().unwrap()[..], [Vec3::X, Vec3::Y]);

    let own = format!(
        "1.0\ncomment Normend {}: normals oriented, rule: up\n",
        env!("CARGO_PKG_VERSION")
    );
    let head = head
        .replace("1.0\n", &own)
        .replace("property char nx", "property float nx");
    let head = head.replace("property  char  ny", "property  float  ny");
    let row = |normal: [f32; 3], a: &[u8], b: &[u8], c: &[u8]| {
        let [x, y, z] = normal.map(f32::to_le_bytes);
        [&x[..], a, &y, b, &z[..], c].concat()
    };
    let expect = [
        head.into_bytes(),
        row([0.6, -0.8, 0.0], &[7, 0, 8, 0], &[9, 0, 1, 5], &[]),
        row([0.0, -1.0, 0.0], &[1, 0, 1, 0], &[1, 0, 1, 6], &[]),
    ]
    .concat();
    let out = written(&scan, &[Vec3::new(0.6, -0.8, 0.0), Vec3::NEG_Y], "out.ply");
    assert_eq!(out, expect);
}

#[test]
fn points_that_are_not_finite_stay_in_the_file() {
    let input = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nend_header\n\
                 nan nan nan\n1 2 3\n1 -inf 3\n4 5 6\n";
    let scan = scan("scan.ply", input);
    assert_eq!(points(&scan), [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)]);
    assert_eq!(scan.rows().unwrap()[..], [1, 3]);
    assert_eq!(scan.n_left_out, 2);
    let out = written(&scan, &[Vec3::X, Vec3::Y], "out.ply");
    let out = String::from_utf8(out).unwrap();
    assert!(
        out.ends_with("end_header\nnan nan nan 0 0 1\n1 2 3 1 0 0\n1 -inf 3 0 0 1\n4 5 6 0 1 0\n"),
        "{out}"
    );
    let out = written(&scan, &[Vec3::X, Vec3::Y], "out.xyz");
    assert_eq!(out, b"nan nan nan 0 0 1\n1 2 3 1 0 0\n1 -inf 3 0 0 1\n4 5 6 0 1 0\n");

    // Where the file has normals, such a row keeps its own, whatever it is.
    check(
        "scan.xyz",
        "x y z nx ny nz\nnan 0 0 9 nan 0\n1 2 3 0 0 1\n",
        &[Vec3::Y],
        "x y z nx ny nz\nnan 0 0 9 nan 0\n1 2 3 0 1 0\n",
    );
    // In another format too, where it is a number.
    let input = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n\
                 property float ny\nproperty float nz\nend_header\nnan 0 0 0 0.6 -0.8\n1 2 3 0 0 1\ninf 0 0 0 nan 0\n";
    let out = written(
        &read_bytes(input.into(), "scan.ply", &Silent).unwrap(),
        &[Vec3::Y],
        "out.csv",
    );
    let expect = "x,y,z,nx,ny,nz\nnan,0,0,0,0.6,-0.8\n1,2,3,0,1,0\ninf,0,0,0,0,1\n";
    assert_eq!(String::from_utf8(out).unwrap(), expect);
}

#[test]
fn coordinates_far_from_zero_keep_their_millimeters() {
    let head = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\nend_header\n";
    let coordinates = [
        [4_500_000.001_f64, 1.0, 0.0],
        [4_500_000.002, 1.0, 0.0],
        [4_500_002.0, 1.0, 0.0],
    ];
    let rows = coordinates
        .concat()
        .into_iter()
        .flat_map(f64::to_le_bytes)
        .collect::<Vec<u8>>();
    let scan = scan("scan.ply", [head.as_bytes(), &rows].concat());
    for (point, expect) in points(&scan).into_iter().zip(coordinates) {
        assert!(point.distance(DVec3::from(expect)) < 1e-6, "{point}");
    }
    let out = written(&scan, &[Vec3::Z; 3], "out.xyz");
    assert_eq!(
        out,
        b"4500000.001 1 0 0 0 1\n4500000.002 1 0 0 0 1\n4500002 1 0 0 0 1\n"
    );
}

#[test]
fn text_keeps_its_separators_comments_and_columns() {
    let normals = [Vec3::X, Vec3::NEG_Z];
    check("a.xyz", "1 2 3\n4 5 6", &normals, "1 2 3 1 0 0\n4 5 6 0 0 -1");
    check(
        "a.txt",
        "# scan 7\n\n1.0\t2\t3\t255\t0\t0\r\n// half\r\n  4\t5\t6\t0\t0\t1  \r\n",
        &normals,
        "# scan 7\n\n1.0\t2\t3\t1\t0\t0\t255\t0\t0\r\n// half\r\n  4\t5\t6\t0\t0\t-1\t0\t0\t1  \r\n",
    );
    check(
        "a.csv",
        "\u{feff}id,X,Y,Z,label\n1, 1.5, 2, 3,wall\n2, 4, 5, 6,\n",
        &normals,
        "\u{feff}id,X,Y,Z,Nx,Ny,Nz,label\n1, 1.5, 2, 3, 1, 0, 0,wall\n2, 4, 5, 6, 0, 0, -1,\n",
    );
    check(
        "a.asc",
        "//X;Y;Z;Nx;Ny;Nz;R\n1;2;3;0;0.6;0.8;9\n4;5;6;0;0;1;9\n",
        &normals,
        "//X;Y;Z;Nx;Ny;Nz;R\n1;2;3;1;0;0;9\n4;5;6;0;0;-1;9\n",
    );
    check(
        "a.asc",
        "\u{feff}# seen by hand\r\n//X Y Z R\r\n1 2 3 9\r\n4 5 6 9\r\n",
        &normals,
        "\u{feff}# seen by hand\r\n//X Y Z Nx Ny Nz R\r\n1 2 3 1 0 0 9\r\n4 5 6 0 0 -1 9\r\n",
    );
    check(
        "a.pts",
        "1\n1 2 3 -12 0 0 0\n1\n4 5 6 -12 0 0 0\n",
        &normals,
        "1\n1 2 3 1 0 0 -12 0 0 0\n1\n4 5 6 0 0 -1 -12 0 0 0\n",
    );
    check("a.xyz", "1 2 3\r4 5 6\r", &normals, "1 2 3 1 0 0\r4 5 6 0 0 -1\r");
    check(
        "a.xyz",
        "east north up\n1 2 3\n4 5 6\n",
        &normals,
        "east north up nx ny nz\n1 2 3 1 0 0\n4 5 6 0 0 -1\n",
    );
    check(
        "a.xyz",
        "Church, north side\n1 2 3\n4 5 6\n",
        &normals,
        "Church, north side nx ny nz\n1 2 3 1 0 0\n4 5 6 0 0 -1\n",
    );
}

/// A line of values; `inserted` come after the column `last`.
fn line(values: &[String], separator: &str, last: usize, inserted: &[&str]) -> String {
    let mut all: Vec<&str> = values.iter().map(String::as_str).collect();
    all.splice(last + 1..last + 1, inserted.iter().copied());
    all.join(separator)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn texts_of_any_shape_keep_it(
        separator in prop::sample::select(vec![" ", "\t", ",", ";", " , ", "  "]),
        line_end in prop::sample::select(vec!["\n", "\r\n", "\r"]),
        columns in prop::sample::subsequence(vec!["red", "Label"], 0..=2)
            .prop_map(|others| [&["x", "Y", "z"], &others[..]].concat())
            .prop_shuffle(),
        names_after in prop::option::of(prop::sample::select(vec!["", "//", "# "])),
        has_count in any::<bool>(),
        between in prop::collection::vec(prop::sample::select(vec!["", "# by hand", "// half", "NO LINE"]), 12),
        points in prop::collection::vec((0_u8..99, 0_u8..99, 0_u8..99), 1..8),
        ends_open in any::<bool>(),
    ) {
        // Without names the coordinates come first.
        let columns = if names_after.is_some() { columns } else { vec!["x", "Y", "z", "red"] };
        let is_coordinate = |name: &&str| ["x", "Y", "z"].contains(name);
        // In a comment only neighbors are known as the names of coordinates.
        let are_neighbors = columns.windows(3).any(|three| three.iter().all(is_coordinate));
        let names_after = names_after.map(|mark| if are_neighbors { mark } else { "" });
        let last = columns.iter().rposition(is_coordinate).unwrap();
        let names: Vec<String> = columns.iter().map(|name| (*name).to_owned()).collect();
        let new_names = if columns[last] == "Y" { ["Nx", "Ny", "Nz"] } else { ["nx", "ny", "nz"] };
        let mut lines = Vec::new();
        if has_count {
            lines.push([points.len().to_string(), points.len().to_string()]);
        }
        if let Some(mark) = names_after {
            let [without, with] = [&[][..], &new_names].map(|new| line(&names, separator, last, new));
            lines.push([format!("{mark}{without}"), format!("{mark}{with}")]);
        }
        for &(x, y, z) in &points {
            let value = |name: &&str| match *name {
                "x" => format!("{x}.50"),
                "Y" => y.to_string(),
                "z" => format!("-{z}"),
                _ => "7".to_owned(),
            };
            let values: Vec<String> = columns.iter().map(value).collect();
            lines.push([&[][..], &["0", "-1", "0"]].map(|new| line(&values, separator, last, new)));
        }
        let [mut input, mut expect] = [String::new(), String::new()];
        for (index, [before, after]) in lines.iter().enumerate() {
            for (text, own) in [(&mut input, before), (&mut expect, after)] {
                if between[index] != "NO LINE" {
                    text.push_str(between[index]);
                    text.push_str(line_end);
                }
                text.push_str(own);
                if !(ends_open && index + 1 == lines.len()) {
                    text.push_str(line_end);
                }
            }
        }
        let scan = scan("scan.txt", &input);
        let expect_points = points.iter().map(|&(x, y, z)| DVec3::new(f64::from(x) + 0.5, y.into(), -f64::from(z)));
        prop_assert_eq!(self::points(&scan), expect_points.collect::<Vec<_>>());
        let out = written(&scan, &vec![Vec3::NEG_Y; points.len()], "out.txt");
        prop_assert_eq!(String::from_utf8(out).unwrap(), expect);
    }
}

/// Rows are read and written in parts, by as many threads as there are.
#[test]
fn many_rows_come_out_the_same_for_any_number_of_threads() {
    use std::fmt::Write;
    let (mut input, mut expect) = ("60000\n".to_owned(), "60000\n".to_owned());
    let mut normals = Vec::new();
    for row in 0..60_000 {
        let comment = if row % 1000 == 7 { "# in between\n" } else { "" };
        let normal = if row % 3 == 0 { Vec3::NEG_X } else { Vec3::Y };
        writeln!(input, "{comment}{row} {}.5 0 {}", row % 77, row % 256).unwrap();
        let Vec3 { x, y, z } = normal;
        writeln!(expect, "{comment}{row} {}.5 0 {x} {y} {z} {}", row % 77, row % 256).unwrap();
        normals.push(normal);
    }
    for n_threads in [1, 4] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| {
            let scan = scan("many.pts", &input);
            assert_eq!(scan.cloud.n_points(), 60_000);
            assert_eq!(points(&scan)[59_999], DVec3::new(59_999.0, 16.5, 0.0));
            assert!(written(&scan, &normals, "out.pts") == expect.as_bytes());
        });
    }
    // The first wrong line is named, whichever thread met one first.
    let broken = input.replace("\n20000 ", "\n2OOOO ").replace("\n50000 ", "\n5OOOO ");
    let error = read_bytes(broken.into_bytes(), "many.pts", &Silent).unwrap_err();
    assert_eq!(
        error.to_string(),
        "many.pts, line 20022: x is \"2OOOO\", which is not a number: correct it"
    );
}

#[test]
fn columns_four_to_six_are_normals_only_when_they_look_like_it() {
    let check = |text: &str, expect: bool| {
        assert_eq!(scan("a.xyz", text).given_normals.is_some(), expect, "{text}");
    };
    check("1 2 3 0 0 1\n4 5 6 0.6 0 0.8\n", true);
    check("1 2 3 0 0 1\n4 5 6 0 0 0\n", true);
    check("1 2 3 0 0 0\n4 5 6 0 0 0\n", false);
    check("1 2 3 0 0 1\n4 5 6 0 0 255\n", false);
    check("1 2 3 0 0 1 9\n4 5 6 0 0 1 9\n", false);
    check("1 2 3\n", false);
    check("x y z r g b\n1 2 3 0 0 1\n", false);
    check("x y z r g b nx ny nz\n1 2 3 0 0 1 0 1 0\n", true);
}

#[test]
fn from_one_format_to_another() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
               end_header\n1.500 2 3 255\n-4e1 5 6 0\n";
    let scan = scan("scan.ply", ply);
    let normals = [Vec3::X, Vec3::NEG_Z];
    assert_eq!(
        written(&scan, &normals, "out.TXT"),
        b"# x y z nx ny nz red\n1.500 2 3 1 0 0 255\n-4e1 5 6 0 0 -1 0\n"
    );
    // A name without an extension does not change the format.
    assert!(written(&scan, &normals, "out").starts_with(b"ply\nformat ascii"));

    let check = |text: &str, type_name: &str, n_bytes: usize| {
        let scan = read_bytes(text.as_bytes().to_vec(), "scan.xyz", &Silent).unwrap();
        let out = written(&scan, &vec![Vec3::Y; scan.cloud.n_points()], "out.ply");
        let own = format!(
            "comment Normend {}: normals oriented, rule: up",
            env!("CARGO_PKG_VERSION")
        );
        let t = type_name;
        let head = format!(
            "ply\nformat binary_little_endian 1.0\n{own}\nelement vertex 2\nproperty {t} x\nproperty {t} y\nproperty {t} z\n\
             property float nx\nproperty float ny\nproperty float nz\nend_header\n"
        );
        assert!(out.starts_with(head.as_bytes()), "{}", String::from_utf8_lossy(&out));
        assert_eq!(out.len(), head.len() + 2 * n_bytes);
        let again = read_bytes(out, "out.ply", &Silent).unwrap();
        assert_eq!(points(&again), points(&scan));
        assert_eq!(again.given_normals.unwrap()[..], [Vec3::Y; 2]);
    };
    check("0.5 1 2\n-3 4 5\n", "float", 24);
    check("4500000.001 1 2\n4500000.002 4 5\n", "double", 36);
    // A decimal that f32 gives back is a float, though f32 rounds it.
    let scan = read_bytes(b"0.1 0.2 0.3\n".to_vec(), "a.xyz", &Silent).unwrap();
    assert!(String::from_utf8_lossy(&written(&scan, &[Vec3::X], "b.ply")).contains("property float x\n"));
}

#[test]
fn prose_in_comments_names_no_columns() {
    let normals = [Vec3::X];
    let xyz = [DVec3::new(1.0, 2.0, 3.0)];
    // Each comment has as many words as there are columns, among them x, y and z.
    let check_prose = |comment: &str, row: &str| {
        let input = format!("{comment}\n{row}\n");
        let scan = scan("a.xyz", &input);
        assert_eq!(points(&scan), xyz, "{comment}");
        let out = String::from_utf8(written(&scan, &normals, "out.xyz")).unwrap();
        let expect = input.replace("1 2 3", "1 2 3 1 0 0");
        assert_eq!(out, expect, "the comment stays");
    };
    check_prose("# each line has x y z", "1 2 3 9 8 7");
    check_prose("# the x and y and z", "1 2 3 9 8 7");
    check_prose("# x y z in scanner coordinates", "1 2 3 9 8 7");
    check_prose("// z up, y north, x east", "1 2 3 9 8 7");
    check_prose("# meters: x y z", "1 2 3 9");
    check_prose("# z axis, x first, y", "1 2 3 9 8");
    // Names they are.
    let check_names = |comment: &str, row: &str| {
        let scan = scan("a.xyz", format!("{comment}\n{row}\n"));
        assert_eq!(points(&scan), xyz, "{comment}");
        let out = String::from_utf8(written(&scan, &normals, "out.xyz")).unwrap();
        let again = read_bytes(out.into_bytes(), "out.xyz", &Silent).unwrap();
        assert_eq!(points(&again), xyz, "{comment}");
        assert_eq!(again.given_normals.unwrap()[..], normals, "{comment}");
    };
    check_names("# id x y z", "9 1 2 3");
    check_names("# label z y x", "9 3 2 1");
    check_names(
        "//X,Y,Z,Scalar_field,\"GPS time (s)\"".replace(' ', "_").as_str(),
        "1,2,3,7,8",
    );
    check_names("# index x y z nx ny nz intensity", "9 1 2 3 0 0 1 55");
}

#[test]
fn text_from_another_format_has_what_its_extension_asks_for() {
    let positions = [
        DVec3::new(0.1, -2.0, 3e-9),
        DVec3::new(f64::NAN, 1.0, 1.0),
        DVec3::new(4.5, 4_500_000.001, 1.0 / 3.0),
    ];
    let normals = [
        Vec3::new(0.6, 0.0, -0.8),
        Vec3::X,
        Vec3::new(1.0 / 3.0, 2.0 / 3.0, -2.0 / 3.0),
    ];
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("scan.ply");
    write_points(&source, Positions::Double(&positions), None, &Silent).unwrap();
    let scan = read(&source, &Silent).unwrap();
    let finite = [normals[0], normals[2]];
    let check = |name: &str, first_line: &str, separator: &str| {
        let text = String::from_utf8(written(&scan, &finite, name)).unwrap();
        let rows = text.strip_prefix(first_line).unwrap();
        assert_eq!(rows.lines().count(), 3, "{text}");
        for row in rows.lines() {
            assert_eq!(row.split(separator).count(), 6, "{text}");
        }
        let again = read_bytes(text.into_bytes(), name, &Silent).unwrap();
        assert_eq!((again.format(), again.n_left_out), (FileFormat::Xyz, 1));
        assert_eq!(points(&again), points(&scan), "{name}");
        assert_eq!(again.given_normals.unwrap()[..], finite, "{name}");

        // The same of a cloud that comes from no file.
        let fresh = folder.path().join(name);
        write_points(&fresh, Positions::Double(&positions), Some(&normals), &Silent).unwrap();
        let text = fs::read_to_string(&fresh).unwrap();
        assert!(text.starts_with(first_line), "{text}");
        let again = read(&fresh, &Silent).unwrap();
        assert_eq!(points(&again), points(&scan), "{name}");
        assert_eq!(again.given_normals.unwrap()[..], finite, "{name}");
        write_points(&fresh, Positions::Double(&positions), None, &Silent).unwrap();
        let again = read(&fresh, &Silent).unwrap();
        assert_eq!(points(&again), points(&scan), "{name}");
        assert!(again.given_normals.is_none(), "{name}");
    };
    check("out.csv", "x,y,z,nx,ny,nz\n", ",");
    check("out.PTS", "3\n", " ");
    for name in ["out.xyz", "out.txt", "out.asc"] {
        check(name, "", " ");
    }
}

#[test]
fn fresh_clouds() {
    let folder = tempfile::tempdir().unwrap();
    let positions = [Vec3::new(0.1, 2.0, 3.0), Vec3::new(4.0, 5.0, -6e-9)];
    let normals = [Vec3::X, Vec3::NEG_Z];
    let path = folder.path().join("new.ply");
    write_points(&path, Positions::Float(&positions), Some(&normals), &Silent).unwrap();
    let again = read(&path, &Silent).unwrap();
    assert_eq!(again.format(), FileFormat::Ply);
    assert_eq!(again.cloud.positions(), positions);
    assert_eq!((again.rows(), again.n_left_out), (None, 0));
    assert_eq!(again.given_normals.unwrap()[..], normals);

    let doubles = positions.map(|position| position.as_dvec3() + 1e6);
    write_points(&path, Positions::Double(&doubles), None, &Silent).unwrap();
    let again = read(&path, &Silent).unwrap();
    assert!(again.given_normals.is_none());
    assert!(
        points(&again)
            .iter()
            .zip(doubles)
            .all(|(point, expect)| point.distance(expect) < 1e-6)
    );

    let path = folder.path().join("new.xyz");
    write_points(&path, Positions::Float(&positions), Some(&normals), &Silent).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"0.1 2 3 1 0 0\n4 5 -6e-9 0 0 -1\n");
}

#[test]
fn normals_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.ply");
    let scan = scan("a.xyz", "1 2 3\n4 5 6\n");
    let check = |normals: &[Vec3], expect: &str| {
        let error = scan.write(normals, &path, &options(), &Silent).unwrap_err();
        assert_eq!(error.to_string(), expect);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    };
    check(&[Vec3::X], "1 normals were given for 2 points: give one for each");
    check(
        &[Vec3::X, Vec3::ZERO],
        "the normal of point 1 is (0, 0, 0), not a unit vector: propagate again",
    );
    check(
        &[Vec3::NAN, Vec3::X],
        "the normal of point 0 is (NaN, NaN, NaN), not a unit vector: propagate again",
    );
}

#[test]
fn the_input_is_written_over_only_on_demand() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.xyz");
    fs::write(&path, "1 2 3\n").unwrap();
    let scan = read(&path, &Silent).unwrap();
    let check = |target: &Path| {
        let error = scan.write(&[Vec3::X], target, &options(), &Silent).unwrap_err();
        assert!(matches!(error, WriteError::OverInput { .. }));
        let expect = format!(
            "{} is the file that was read: choose another name, or allow it to be written over",
            target.display()
        );
        assert_eq!(error.to_string(), expect);
        assert_eq!(fs::read(&path).unwrap(), b"1 2 3\n");
    };
    check(&path);
    check(&folder.path().join(".").join("scan.xyz"));
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&path, folder.path().join("link.xyz")).unwrap();
        check(&folder.path().join("link.xyz"));
        fs::hard_link(&path, folder.path().join("same.xyz")).unwrap();
        check(&folder.path().join("same.xyz"));
    }
    let options = WriteOptions {
        overwrite_input: true,
        ..options()
    };
    scan.write(&[Vec3::X], &path, &options, &Silent).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"1 2 3 1 0 0\n");
}

/// Cancels at the first report after `stage` began.
struct CancelAt(&'static str, std::sync::atomic::AtomicBool);

impl Progress for CancelAt {
    fn report(&self, _fraction: f32) -> Result<(), Cancelled> {
        if self.1.load(std::sync::atomic::Ordering::SeqCst) {
            Err(Cancelled)
        } else {
            Ok(())
        }
    }

    fn stage(&self, name: &str) {
        self.1.store(name == self.0, std::sync::atomic::Ordering::SeqCst);
    }
}

#[test]
fn cancelling_leaves_everything_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("in.ply"), folder.path().join("out.ply"));
    write_points(&input, Positions::Float(&[Vec3::X, Vec3::Y]), None, &Silent).unwrap();
    fs::write(&output, "old").unwrap();
    let progress = CancelAt("Reading", false.into());
    assert!(matches!(
        read(&input, &progress),
        Err(normend_io::ReadError::Cancelled(_))
    ));
    let progress = CancelAt("Writing", false.into());
    let scan = read(&input, &progress).unwrap();
    let error = scan.write(&[Vec3::X; 2], &output, &options(), &progress).unwrap_err();
    assert!(matches!(error, WriteError::Cancelled(_)));
    assert_eq!(fs::read(&output).unwrap(), b"old");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn a_name_must_not_promise_a_format_that_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("scan.dat");
    fs::write(&input, "1 2 3\n").unwrap();
    let scan = read(&input, &Silent).unwrap();
    let refused = |error: WriteError, target: &Path| {
        let expect = format!(
            "{} cannot be written: Normend writes .ply .las .laz .pcd .obj .xyz .txt .asc .pts .csv .e57 .ptx; choose a name that ends with one of these",
            target.display()
        );
        assert_eq!(error.to_string(), expect);
        assert!(!target.exists());
    };
    for name in ["out.stl", "out.dxf", "out.ply.bak"] {
        let target = folder.path().join(name);
        refused(
            scan.write(&[Vec3::X], &target, &options(), &Silent).unwrap_err(),
            &target,
        );
        let points = Positions::Float(&[Vec3::X]);
        refused(write_points(&target, points, None, &Silent).unwrap_err(), &target);
    }
    // No extension, or the one that the input has, promises nothing else.
    for name in ["out", "out.dat"] {
        let target = folder.path().join(name);
        scan.write(&[Vec3::X], &target, &options(), &Silent).unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"1 2 3 1 0 0\n");
    }
}

#[test]
fn targets_that_cannot_be_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let scan = scan("a.xyz", "1 2 3\n");
    let check = |target: &Path, expect: &str| {
        let error = scan.write(&[Vec3::X], target, &options(), &Silent).unwrap_err();
        assert_eq!(error.to_string(), format!("{} {expect}", target.display()));
    };
    check(folder.path(), "is a folder: name a file");
    check(
        &folder.path().join("none/out.xyz"),
        "lies in a folder that does not exist: create the folder first",
    );
    #[cfg(unix)]
    {
        use std::os::unix::fs::{PermissionsExt, symlink};
        check(Path::new("/dev/null"), "is a device, not a file: name a file");
        let path = folder.path().join("protected.xyz");
        fs::write(&path, "old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o444)).unwrap();
        check(
            &path,
            "is write-protected: change its permissions or choose another name",
        );
        assert_eq!(fs::read(&path).unwrap(), b"old");
        let ring = folder.path().join("ring.xyz");
        symlink(&ring, &ring).unwrap();
        check(
            &ring,
            "cannot be written: too many symbolic links: name the file itself",
        );
    }
}

#[cfg(unix)]
#[test]
fn permissions_stay_and_links_are_followed() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    let scan = scan("a.xyz", "1 2 3\n");

    let (real, link) = (folder.path().join("real.xyz"), folder.path().join("link.xyz"));
    fs::write(&real, "old").unwrap();
    fs::set_permissions(&real, fs::Permissions::from_mode(0o640)).unwrap();
    symlink("real.xyz", &link).unwrap();
    scan.write(&[Vec3::X], &link, &options(), &Silent).unwrap();
    assert_eq!(fs::read(&real).unwrap(), b"1 2 3 1 0 0\n");
    assert_eq!(mode(&real), 0o640);
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());

    // A link may lead to a file that is not there yet.
    let dangling = folder.path().join("dangling.xyz");
    symlink("later.xyz", &dangling).unwrap();
    scan.write(&[Vec3::X], &dangling, &options(), &Silent).unwrap();
    assert!(folder.path().join("later.xyz").is_file());

    // A new file gets the permissions of any new file.
    let other = folder.path().join("other");
    fs::write(&other, "").unwrap();
    assert_eq!(mode(&folder.path().join("later.xyz")), mode(&other));
}
