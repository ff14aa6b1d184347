//! Files that cannot be read give one sentence: the place, the reason, what to do. None panics, none takes memory that
//! its size does not justify.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic, as tests do")]

use normend_core::Silent;
use normend_io::{ReadError, read, read_bytes};
use proptest::prelude::*;

fn check_named(name: &str, bytes: &[u8], expect: &str) {
    let error = read_bytes(bytes.to_vec(), name, &Silent).unwrap_err();
    assert_eq!(error.to_string(), format!("{name}{expect}"));
}

fn check(bytes: &[u8], expect: &str) {
    check_named("scan.ply", bytes, expect);
}

/// An ascii file with one line of header besides the usual ones.
fn with_line(line: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n{line}\nend_header\n1 2 3\n"
    )
}

/// A binary file of `count` announced points and `n_bytes` of payload.
fn binary(header_lines: &str, n_bytes: usize) -> Vec<u8> {
    let mut file = format!("ply\nformat binary_little_endian 1.0\n{header_lines}end_header\n").into_bytes();
    file.resize(file.len() + n_bytes, 0);
    file
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";

#[test]
fn what_is_no_point_cloud() {
    check(b"", ": the file is empty: copy or export it again");
    check(
        b"solid cube\nfacet",
        ", line 1: a PLY file begins with \"ply\", this one with \"solid cube\": name a PLY file",
    );
    check(
        b"plywood\n",
        ", line 1: a PLY file begins with \"ply\", this one with \"plywood\": name a PLY file",
    );
    check(
        b"\x1f\x8b\x08\0\0\0",
        ": this is compressed with gzip, which Normend does not read: convert it to PLY",
    );
    check_named(
        "scan.las",
        b"LASF\0\0\0",
        ", byte 7: the file ends inside its header: copy it again",
    );
    check_named(
        "scan.bin",
        b"\0\x01\x02\x03",
        ": this is neither PLY nor text with a point a line: convert it to PLY",
    );
    check_named(
        "scan.xyz",
        b"# nothing\n\n",
        ": the file has no points: open one that has",
    );
}

#[test]
fn headers_that_do_not_end() {
    check(
        b"ply",
        ", byte 3: the file ends before \"end_header\": it is cut off, copy or export it again",
    );
    check(
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x",
        ", byte 54: the file ends before \"end_header\": it is cut off, copy or export it again",
    );
}

#[test]
fn headers_with_more_declarations_than_any_scan() {
    let check_count = |n_elements: usize, n_properties: usize, expect: Option<usize>| {
        let mut file = format!("ply\nformat ascii 1.0\nelement vertex 1\n{XYZ}").into_bytes();
        for index in 3..n_properties {
            file.extend_from_slice(format!("property float p{index}\n").as_bytes());
        }
        for index in 1..n_elements {
            file.extend_from_slice(format!("element e{index} 0\n").as_bytes());
        }
        file.extend_from_slice(b"end_header\n");
        file.extend_from_slice(&b"1 ".repeat(n_properties));
        match expect {
            Some(line) => check(
                &file,
                &format!(
                    ", line {line}: more than 1024 elements or 4096 properties are declared: export the file with fewer"
                ),
            ),
            None => assert_eq!(read_bytes(file, "scan.ply", &Silent).unwrap().cloud.n_points(), 1),
        }
    };
    check_count(1024, 4096, None);
    check_count(1, 4097, Some(3 + 4097));
    check_count(1025, 3, Some(3 + 3 + 1024));
}

#[test]
fn lines_that_do_not_belong_into_a_header() {
    check(
        with_line("property int64 time").as_bytes(),
        ", line 7: property \"time\" has the type \"int64\", which is not char, uchar, short, ushort, int, uint, float or double: correct it",
    );
    check(
        with_line("property list uchar vertex_index").as_bytes(),
        ", line 7: \"property list uchar vertex_index\" is not a line of a PLY header: correct or remove it",
    );
    check(
        with_line("property list uchar quad i").as_bytes(),
        ", line 7: list \"i\" has the types \"uchar\" and \"quad\", which are not both char, uchar, short, ushort, int, uint, float or double: correct them",
    );
    check(
        with_line("property list float int i").as_bytes(),
        ", line 7: the length of list \"i\" is declared as a fraction: declare an integer type such as uchar",
    );
    check(
        with_line("element face -2").as_bytes(),
        ", line 7: the count of element \"face\" is \"-2\", not a whole number: correct it",
    );
    check(
        with_line("element face 99999999999999999999999").as_bytes(),
        ", line 7: element \"face\" announces \"99999999999999999999999\" rows, more than any file holds: correct the count",
    );
    check(
        with_line("colour red").as_bytes(),
        ", line 7: \"colour red\" is not a line of a PLY header: correct or remove it",
    );
    check(
        with_line("property float x").as_bytes(),
        ", line 7: a second property \"x\" in element \"vertex\": rename or remove it",
    );
    check(
        with_line("element vertex 1\nproperty uchar u").as_bytes(),
        ", line 7: a second element \"vertex\": rename or remove it",
    );
    check(
        with_line("format ascii 1.0").as_bytes(),
        ", line 7: a second format line: remove the wrong one",
    );
    check(
        b"ply\nproperty float x\nformat ascii 1.0\nend_header\n",
        ", line 2: a property before the first element: correct the order",
    );
    check(
        b"ply\nformat binary_middle_endian 1.0\nelement vertex 1\nend_header\n",
        ", line 2: \"format binary_middle_endian 1.0\" is not \"format\" with ascii, binary_little_endian or binary_big_endian and 1.0: correct it",
    );
    check(
        b"ply\nelement vertex 1\nproperty float x\nend_header\n1\n",
        ": the header has no valid format line: add \"format ascii 1.0\" or the like",
    );
}

#[test]
fn vertices_that_are_no_points() {
    check(
        b"ply\nformat ascii 1.0\nend_header\n",
        ": the header declares no element \"vertex\": export the file again",
    );
    check(
        b"ply\nformat ascii 1.0\nelement face 0\nelement edge 0\nend_header\n",
        ": there is no element \"vertex\" (only \"face, edge\"): rename the one that holds the points",
    );
    check(
        b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nend_header\n1 2\n3 4\n",
        ", line 3: the element \"vertex\" has no property \"z\": export the file with x, y and z",
    );
    check(
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty list uchar float y\nproperty float z\nend_header\n1 1 2 3\n",
        ", line 5: \"y\" is declared as a list: declare a number such as float",
    );
    check(
        with_line("property float nx\nproperty float nz").as_bytes(),
        ", line 7: there is a part of a normal, but not all of nx, ny, nz: add or remove them",
    );
    check(
        b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
        ", line 3: the file has no points: open one that has",
    );
    check(
        with_line("").replace("1 2 3", "nan 2 3").as_bytes(),
        ": no point has finite coordinates: export the file again",
    );
    check(
        format!("ply\nformat ascii 1.0\nelement vertex 2\n{XYZ}end_header\n0 0 0\n1e30 0 0\n").as_bytes(),
        ": the points span 1e30 units; Normend works with spans between 1e-15 and 1e15: change the unit, or take out \
         points that are far from all others",
    );
}

#[test]
fn counts_past_the_end_are_refused_before_anything_is_allocated() {
    check(
        &binary(&format!("element vertex 4000000000\n{XYZ}"), 24),
        ", line 3: 4000000000 rows of element \"vertex\" do not fit into the 24 bytes after byte 124: the file is cut off or the count is wrong, export it again",
    );
    check(
        &binary(&format!("element vertex 4294967295\n{XYZ}"), 24),
        ", line 3: 4294967295 points are more than the 4294967294 that Normend can number: split the scan",
    );
    check(
        &binary(&format!("element vertex 3\n{XYZ}"), 35),
        ", line 3: 3 rows of element \"vertex\" do not fit into the 35 bytes after byte 115: the file is cut off or the count is wrong, export it again",
    );
    check(
        &binary(&format!("element ghost 4000000000\nelement vertex 1\n{XYZ}"), 12),
        ", line 3: element \"ghost\" has 4000000000 rows but no properties: remove it or declare them",
    );
    check(
        &binary(
            &format!("element vertex 1\n{XYZ}element face 18446744073709551615\nproperty list uchar int i\n"),
            12,
        ),
        ", line 7: 18446744073709551615 rows of element \"face\" do not fit into the 0 bytes after byte 187: the file is cut off or the count is wrong, export it again",
    );
    check(
        &binary(
            &format!("element vertex 1\n{XYZ}element face 4611686018427387904\nproperty double a\n"),
            12,
        ),
        ", line 7: 4611686018427387904 rows of element \"face\" do not fit into the 0 bytes after byte 178: the file is cut off or the count is wrong, export it again",
    );
    check(
        format!("ply\nformat ascii 1.0\nelement vertex 1000000\n{XYZ}end_header\n1 2 3\n").as_bytes(),
        ", line 3: 1000000 rows of element \"vertex\" do not fit into the 6 bytes after byte 106: the file is cut off or the count is wrong, export it again",
    );
}

#[test]
fn lists_past_the_end() {
    let with_faces = |length_type: &str, payload: &[u8]| {
        let mut file = binary(
            &format!("element vertex 1\n{XYZ}element face 2\nproperty list {length_type} int i\n"),
            12,
        );
        file.extend_from_slice(payload);
        file
    };
    check(
        &with_faces("int", &[&(-1_i32).to_le_bytes()[..], &[0; 8]].concat()),
        ", byte 166: a list in row 1 of element \"face\" has the length -1, but 8 bytes are left: the file is damaged or cut off, export it again",
    );
    check(
        &with_faces("uint", &[&u32::MAX.to_le_bytes()[..], &[0; 8]].concat()),
        ", byte 167: a list in row 1 of element \"face\" has the length 4294967295, but 8 bytes are left: the file is damaged or cut off, export it again",
    );
    check(
        &with_faces("uchar", &[1, 0, 0, 0, 0, 3, 0, 0]),
        ", byte 173: a list in row 2 of element \"face\" has the length 3, but 2 bytes are left: the file is damaged or cut off, export it again",
    );
    check(
        &with_faces("uchar", &[1, 0, 0, 0, 0]),
        ", byte 173: the file ends in row 2 of the 2 rows of element \"face\": it is cut off, copy or export it again",
    );
    let text = |faces: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 1\n{XYZ}element face 2\nproperty list uchar int i\nend_header\n0 0 0\n{faces}"
        )
    };
    check(
        text("3 0 0 0\n1000000000 0\n").as_bytes(),
        ", line 12: a list in row 2 of element \"face\" has the length \"1000000000\", but 3 bytes are left: correct the line",
    );
    check(
        text("3 0 0 0\n-3 0 0 0\n").as_bytes(),
        ", line 12: a list in row 2 of element \"face\" has the length \"-3\", but 7 bytes are left: correct the line",
    );
    check(
        text("1 0\n2 0     ").as_bytes(),
        ", line 12: the file ends in row 2 of the 2 rows of element \"face\": it is cut off, copy or export it again",
    );
}

#[test]
fn rows_of_text_that_are_no_rows() {
    let header = format!("ply\nformat ascii 1.0\nelement vertex 3\n{XYZ}property uchar u\nend_header\n");
    check(
        format!("{header}1 2 3 4\n1 2,5 3 4\n1 2 3 4\n").as_bytes(),
        ", line 10: y is \"2,5\", which is not a number: correct it",
    );
    check(
        format!("{header}1 2 3 400\n1 2 3 400\n1 2 3\n").as_bytes(),
        ", line 12: the file ends in row 3 of the 3 rows of element \"vertex\": it is cut off, copy or export it again",
    );
    check(
        format!("{header}1 2 3 4\n1 2 3\n1 2 3 4\n").as_bytes(),
        ", line 10: 3 values where a row of element \"vertex\" has 4: correct the line, or the header",
    );
    check(
        format!("{header}1 2 3 4 5\n1 2 3 4 5\n1 2 3 4 5\n").as_bytes(),
        ", line 9: 5 values where a row of element \"vertex\" has 4: correct the line, or the header",
    );
}

#[test]
fn text_without_a_header() {
    let check = |text: &str, expect: &str| check_named("scan.xyz", text.as_bytes(), expect);
    check(
        "1 2 3\n4 5\n",
        ", line 2: 2 values where at least 3 belong: correct or remove the line \"4 5\"",
    );
    check(
        "1 2 3\n\n4 five 6\n",
        ", line 3: y is \"five\", which is not a number: correct it",
    );
    check(
        "X Y Z\nnorth east up\n1 2 3\n",
        ", line 2: \"north east up\" does not begin with a number: correct or remove the line",
    );
    check(
        "1,5;2.5;3,5\n",
        ", line 1: \"1,5;2.5;3,5\" has commas besides other separators, which are no decimal commas either: write numbers with a point",
    );
    check(
        "1,5,3 2 3\n",
        ", line 1: \"1,5,3 2 3\" has commas besides other separators, which are no decimal commas either: write numbers with a point",
    );
    check(
        "3\n1 2 3\n4 5 6\n",
        ", line 1: 3 points are announced, but fewer follow: the file is cut off or the count is wrong",
    );
    check(
        "1 2 3\n7\n4 5 6\n",
        ", line 2: 1 values where at least 3 belong: correct or remove the line \"7\"",
    );
    check(
        "x;y;z;nx;ny;nz\n1;2;3;0;0;1\n1;2;3\n",
        ", line 3: 3 values where at least 6 belong: correct or remove the line \"1;2;3\"",
    );
}

#[test]
fn what_the_system_refuses() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing.ply");
    let check = |path: &std::path::Path, expect: &str| {
        let error = read(path, &Silent).unwrap_err();
        assert!(matches!(error, ReadError::Io { .. }));
        assert_eq!(error.to_string(), format!("{}: {expect}", path.display()));
    };
    check(&missing, "there is no such file or folder: check the path");
    check(folder.path(), "this is a folder: name a file");
    if cfg!(unix) {
        // Nobody ever writes into this pipe: opening it would wait forever.
        let pipe = folder.path().join("pipe.ply");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        for path in [std::path::Path::new("/dev/zero"), &pipe] {
            check(path, "this is a device or a pipe, not a file: save it as a file first");
        }
    }
}

/// Files of every kind, each of which can be read.
fn valid_files() -> Vec<(&'static str, Vec<u8>)> {
    let mut with_lists = binary(
        &format!(
            "element camera 1\nproperty list uchar float m\nelement vertex 3\n{XYZ}property list ushort uchar tags\n\
             property double nx\nproperty double ny\nproperty double nz\nelement face 1\nproperty list uchar int i\n"
        ),
        0,
    );
    with_lists.extend_from_slice(&[2, 0, 0, 0, 0, 0, 0, 0, 0]);
    for row in 0..3_u8 {
        for value in [1.0, f32::from(row), 2.5] {
            with_lists.extend_from_slice(&value.to_le_bytes());
        }
        with_lists.extend_from_slice(&[row, 0]);
        with_lists.extend_from_slice(&vec![7; usize::from(row)]);
        for value in [0.0_f64, 0.0, 1.0] {
            with_lists.extend_from_slice(&value.to_le_bytes());
        }
    }
    with_lists.extend_from_slice(&[3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    let text = format!(
        "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 3\n{XYZ}property list uchar int tags\nelement face 1\n\
         property list uchar int i\nend_header\n0 0 0 1 5\n1 0 0.5 0\n0 1e2 -3 2 1 1\n3 0 1 2\n"
    );
    let mut fixed = binary(&format!("element vertex 20\n{XYZ}property uchar u\n"), 260);
    let start = fixed.len() - 260;
    fixed[start + 3] = 0x40;
    vec![
        ("lists.ply", with_lists),
        ("text.ply", text.into_bytes()),
        ("fixed.ply", fixed),
        (
            "points.xyz",
            b"# a comment\nX Y Z R G B\n1 2 3 4 5 6\n1.5 2 3 4 5 6\n".to_vec(),
        ),
        ("cloud.asc", b"//X Y Z R\n1 2 3 4\n1.5 2 3 4\n".to_vec()),
        ("scan.pts", b"2\n1 2 3 0 0 1\n4 5 6 0 1 0\n".to_vec()),
    ]
}

#[test]
fn the_files_to_be_damaged_are_whole() {
    for (name, bytes) in valid_files() {
        read_bytes(bytes, name, &Silent).unwrap();
    }
}

#[test]
fn every_truncation_gives_a_result() {
    for (name, bytes) in valid_files() {
        for length in 0..bytes.len() {
            if let Err(error) = read_bytes(bytes[..length].to_vec(), name, &Silent) {
                check_sentence(&error, name);
            }
        }
    }
}

/// One line that begins with the name of the file.
fn check_sentence(error: &ReadError, name: &str) {
    let sentence = error.to_string();
    assert!(sentence.starts_with(name), "{sentence}");
    assert!(!sentence.contains('\n'), "{sentence}");
    assert!(sentence.len() < 400, "{sentence}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damage_gives_a_sentence_or_a_scan_that_can_be_written(
        which in 0..6_usize,
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4_u8), 1..6),
    ) {
        let (name, mut bytes) = valid_files().swap_remove(which);
        for (place, byte, kind) in damage {
            if bytes.is_empty() {
                break;
            }
            let at = place.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => { bytes.remove(at); }
                2 => bytes.insert(at, byte),
                // What numbers are made of does more harm than noise.
                _ => bytes[at] = b"0123456789-.e \n"[usize::from(byte) % 15],
            }
        }
        match read_bytes(bytes, name, &Silent) {
            Err(error) => check_sentence(&error, name),
            Ok(scan) => {
                prop_assert!(scan.cloud.n_points() > 0);
                let folder = tempfile::tempdir().unwrap();
                let normals = vec![glam::Vec3::X; scan.cloud.n_points()];
                scan.write(&normals, &folder.path().join(name), &Default::default(), &Silent).unwrap();
            }
        }
    }
}
