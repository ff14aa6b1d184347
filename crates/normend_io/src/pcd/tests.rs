//! Reading, rewriting and writing PCD, and `pcd_rs` as a reader of what is written.

use std::fs;

use glam::{DVec3, Vec3};
use normend_core::Silent;
use pcd_rs::{DynReader, Field};
use proptest::prelude::*;

use super::*;
use crate::{Scan, WriteOptions, read_bytes};

fn scan(bytes: &[u8]) -> Scan {
    read_bytes(bytes.to_vec(), "scan.pcd", &Silent).unwrap()
}

fn points(scan: &Scan) -> Vec<DVec3> {
    let positions = scan.cloud.positions().iter();
    positions
        .map(|position| scan.cloud.origin() + position.as_dvec3())
        .collect()
}

fn options() -> WriteOptions {
    WriteOptions {
        rule: "up".to_owned(),
        ..WriteOptions::default()
    }
}

fn own_comment() -> String {
    format!("# Normend {}: normals oriented, rule: up", env!("CARGO_PKG_VERSION"))
}

fn written(scan: &Scan, normals: &[Vec3], confidence: Option<&[u8]>, name: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    scan.write_with_confidence(normals, confidence, &path, &options(), &Silent)
        .unwrap();
    fs::read(path).unwrap()
}

/// The values of each row as an independent reader sees them.
fn by_pcd_rs(bytes: &[u8]) -> Vec<Vec<Field>> {
    let reader = DynReader::from_bytes(bytes).unwrap();
    reader.map(|record| record.unwrap().0).collect()
}

const FIELDS: &str = "VERSION .7\nFIELDS x y _ z normal_x normal_y normal_z curvature rgb label hist\n\
                      SIZE 4 4 1 4 4 4 4 4 4 2 2\nTYPE F F U F F F F F F U I\nCOUNT 1 1 3 1 1 1 1 1 1 1 2\n\
                      WIDTH 2\nHEIGHT 2\nVIEWPOINT 1 2 3 1 0 0 0\nPOINTS 4\n";

/// A row of [`FIELDS`] for each of four points, the third without a place.
fn rows() -> Vec<u8> {
    let mut bytes = Vec::new();
    for row in 0..4_u8 {
        let value = f32::from(row);
        let z = if row == 2 { f32::NAN } else { -value };
        bytes.extend(value.to_le_bytes());
        bytes.extend((10.0 * value).to_le_bytes());
        bytes.extend([7, 8, 9]);
        bytes.extend(z.to_le_bytes());
        [0.0, 0.6, 0.8_f32, 0.01]
            .iter()
            .for_each(|value| bytes.extend(value.to_le_bytes()));
        bytes.extend([row, 20, 200, 0]);
        bytes.extend(u16::from(row).to_le_bytes());
        [-1_i16, 300].iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    }
    bytes
}

fn binary() -> Vec<u8> {
    [
        b"# .PCD v.7 - made by hand\n# with a comment in Latin 1: \xe9\n",
        FIELDS.as_bytes(),
        b"DATA binary\n",
        &rows(),
        b"after",
    ]
    .concat()
}

/// The same, packed, without what fills space only, as PCL packs it.
fn packed() -> Vec<u8> {
    let sizes = [4, 4, 4, 4, 4, 4, 4, 4, 2, 4];
    let offsets = [0, 4, 11, 15, 19, 23, 27, 31, 35, 37];
    let rows = rows();
    let mut columns = Vec::new();
    for (size, offset) in sizes.iter().zip(offsets) {
        rows.chunks(41)
            .for_each(|row| columns.extend(&row[offset..offset + size]));
    }
    let mut packed = Vec::new();
    lzf::pack(&columns, &mut packed);
    let sizes = [packed.len(), columns.len()]
        .map(|size| (size as u32).to_le_bytes())
        .concat();
    [
        b"# .PCD v.7\n",
        FIELDS.as_bytes(),
        b"DATA binary_compressed\n",
        &sizes,
        &packed,
        b"after",
    ]
    .concat()
}

/// The same as text, in which nothing fills space.
fn ascii() -> Vec<u8> {
    let mut text = format!("# .PCD v.7\r\n{FIELDS}DATA ascii\n");
    for row in 0..4 {
        let z = if row == 2 {
            "nan".to_owned()
        } else {
            format!("-{row}.0")
        };
        let color = f32::from_bits(200 << 16 | 20 << 8 | row);
        let color = if row == 3 {
            format!("{}", color.to_bits())
        } else {
            format!("{color:e}")
        };
        text += &format!("{row} {}e1 {z} 0 0.60 .8 0.01 {color}  {row} -1\t300\r\n", row);
    }
    text.into_bytes()
}

#[test]
fn all_three_kinds_hold_the_same() {
    for bytes in [binary(), packed(), ascii()] {
        let scan = scan(&bytes);
        assert_eq!(
            points(&scan),
            [DVec3::ZERO, DVec3::new(1.0, 10.0, -1.0), DVec3::new(3.0, 30.0, -3.0)]
        );
        assert_eq!(scan.n_left_out, 1);
        assert_eq!(scan.given_normals.as_ref().unwrap()[..], [Vec3::new(0.0, 0.6, 0.8); 3]);
        let columns = [
            "x",
            "y",
            "z",
            "normal_x",
            "normal_y",
            "normal_z",
            "curvature",
            "red",
            "green",
            "blue",
            "label",
            "hist_0",
            "hist_1",
        ];
        assert_eq!(scan.scalar_columns(), columns);
        let values = |name| scan.scalar(name, &Silent).unwrap().unwrap();
        assert_eq!(values("label"), [0.0, 1.0, 3.0]);
        assert_eq!(values("hist_0"), [-1.0; 3]);
        assert_eq!(values("hist_1"), [300.0; 3]);
        assert_eq!(
            scan.colors(&Silent).unwrap().unwrap(),
            [[200, 20, 0], [200, 20, 1], [200, 20, 3]]
        );
        let stations = scan.stations();
        assert_eq!(stations.len(), 1);
        assert_eq!(
            (stations[0].points.clone(), stations[0].position),
            (0..3, DVec3::new(1.0, 2.0, 3.0))
        );
    }
}

#[test]
fn only_normals_change_in_place() {
    let normals = [Vec3::new(0.0, -0.6, -0.8), Vec3::X, Vec3::new(0.0, 0.6, 0.8)];
    let input = binary();
    let out = written(&scan(&input), &normals, None, "out.pcd");
    let comment = own_comment() + "\n";
    let at = b"# .PCD v.7 - made by hand\n".len();
    let mut expect = [&input[..at], comment.as_bytes(), &input[at..]].concat();
    let first = expect.len() - b"after".len() - 4 * 41;
    for (row, normal) in [(0, normals[0]), (1, normals[1])] {
        let bytes: Vec<u8> = normal.to_array().iter().flat_map(|value| value.to_le_bytes()).collect();
        expect[first + 41 * row + 15..][..12].copy_from_slice(&bytes);
    }
    assert_eq!(out, expect);
    // Who writes again replaces the comment.
    assert_eq!(written(&scan(&out), &normals, None, "out.pcd"), expect);

    let out = written(&scan(&ascii()), &normals, None, "out.pcd");
    let text = String::from_utf8(ascii()).unwrap();
    let mut lines: Vec<String> = text.split('\n').map(str::to_owned).collect();
    lines[11] = lines[11].replace(" 0 0.60 .8 ", " 0 -0.60 -.8 ");
    lines[12] = lines[12].replace(" 0 0.60 .8 ", " 1 0 0 ");
    lines.insert(1, own_comment() + "\r");
    assert_eq!(String::from_utf8(out).unwrap(), lines.join("\n"));

    let out = written(&scan(&packed()), &normals, None, "out.pcd");
    let again = scan(&out);
    assert_eq!(again.layers()[0].file.layout.table().n_rows, 4);
    assert_eq!(again.given_normals.as_ref().unwrap()[..], normals);
    let head = format!("# .PCD v.7\n{}\n{FIELDS}DATA binary_compressed\n", own_comment());
    assert!(out.starts_with(head.as_bytes()) && out.ends_with(b"after"));
    let rows_of = |scan: &Scan| scan.layers()[0].file.bytes[scan.layers()[0].file.layout.table().start()..].to_vec();
    let mut expect = rows_of(&scan(&packed()));
    for (row, normal) in [(0, normals[0]), (1, normals[1])] {
        let bytes: Vec<u8> = normal.to_array().iter().flat_map(|value| value.to_le_bytes()).collect();
        expect[38 * row + 12..][..12].copy_from_slice(&bytes);
    }
    assert_eq!(rows_of(&again), expect);
}

#[test]
fn new_normals_go_after_the_coordinates() {
    let input = "# .PCD v.7\nVERSION 0.7\nFIELDS z intensity y x\nSIZE 4 2 8 4\nTYPE F U F F\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\n\
                 VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n3 7 2 1\n6 8 5 4";
    let plain = scan(input.as_bytes());
    assert!(plain.given_normals.is_none() && plain.stations().is_empty());
    assert_eq!(points(&plain), [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)]);
    let out = written(&plain, &[Vec3::X, Vec3::NEG_Y], Some(&[255, 0]), "out.pcd");
    let own = own_comment();
    let expect = format!(
        "# .PCD v.7\n{own}\nVERSION 0.7\nFIELDS z intensity y x normal_x normal_y normal_z confidence oriented\n\
         SIZE 4 2 8 4 4 4 4 4 1\nTYPE F U F F F F F F U\nCOUNT 1 1 1 1 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\n\
         VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n3 7 2 1 1 0 0 1 1\n6 8 5 4 0 -1 0 0 0"
    );
    assert_eq!(String::from_utf8(out).unwrap(), expect);

    // A packed file stays packed, and `pcd_rs` reads from it what it reads from the other.
    let rows: Vec<u8> = (0..500_u32).flat_map(|value| (value as f32).to_le_bytes()).collect();
    let header = "VERSION .7\nFIELDS x y z i\nSIZE 4 4 4 4\nTYPE F F F U\nWIDTH 125\nHEIGHT 1\nPOINTS 125\n";
    let normals: Vec<Vec3> = (0..125).map(|point| [Vec3::X, Vec3::NEG_Z][point % 2]).collect();
    let confidence: Vec<u8> = (0..125).map(|point| 2 * point).collect();
    let plain = [header.as_bytes(), b"DATA binary\n", &rows].concat();
    let mut columns = Vec::new();
    (0..4).for_each(|field| {
        rows.chunks(16)
            .for_each(|row| columns.extend(&row[4 * field..4 * field + 4]))
    });
    let mut packed = Vec::new();
    lzf::pack(&columns, &mut packed);
    let sizes = [packed.len(), columns.len()]
        .map(|size| (size as u32).to_le_bytes())
        .concat();
    let packed = [header.as_bytes(), b"DATA binary_compressed\n", &sizes, &packed].concat();
    let [plain, packed] = [plain, packed].map(|input| written(&scan(&input), &normals, Some(&confidence), "out.pcd"));
    assert!(String::from_utf8_lossy(&packed).contains("DATA binary_compressed\n"));
    let rows = by_pcd_rs(&plain);
    assert_eq!(rows.len(), 125);
    let mut expect: Vec<Field> = [0.0_f32, 0.0, -1.0, 2.0 / 255.0]
        .map(|value| Field::F32(vec![value]))
        .to_vec();
    expect.extend([Field::U8(vec![0]), Field::U32(vec![7.0_f32.to_bits()])]);
    assert_eq!(rows[1][3..], expect);
    assert_eq!(rows, by_pcd_rs(&packed));
}

#[test]
fn whole_numbers_become_floats_where_a_normal_is_written() {
    let header = "VERSION .7\nFIELDS x y z nx ny nz i\nSIZE 4 4 4 1 2 8 1\nTYPE F F F I I F U\nCOUNT 1 1 1 1 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA binary\n";
    let mut input = header.as_bytes().to_vec();
    [1.0_f32, 2.0, 3.0]
        .iter()
        .for_each(|value| input.extend(value.to_le_bytes()));
    input.extend([0, 1, 0]);
    input.extend(0.0_f64.to_le_bytes());
    input.push(9);
    let given = scan(&input);
    assert_eq!(given.given_normals.as_ref().unwrap()[..], [Vec3::Y]);
    let rows = by_pcd_rs(&written(&given, &[Vec3::new(0.6, 0.0, 0.8)], None, "out.pcd"));
    let expect = [
        Field::F32(vec![0.6]),
        Field::F32(vec![0.0]),
        Field::F64(vec![f64::from(0.8_f32)]),
        Field::U8(vec![9]),
    ];
    assert_eq!(rows[0][3..], expect);
}

#[test]
fn headers_as_programs_write_them() {
    let read = |header: &str| points(&scan(format!("{header}1 2 3\n4 5 6\n").as_bytes()));
    let expect = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)];
    // Without a version, a count, a grid; in lower case; with what nobody knows.
    assert_eq!(
        read("# .PCD\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 2\nDATA ascii\n"),
        expect
    );
    assert_eq!(
        read("version .5\ncolumns X Y Z # names\nsize 4 4 4\ntype f f f\nwidth 1\nheight 2\nunits m\ndata ASCII\n"),
        expect
    );
    // No shift and a rotation: the scanner stood where zero is.
    let with = |viewpoint: &str| {
        let header =
            format!("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nVIEWPOINT {viewpoint}\nPOINTS 1\nDATA ascii\n1 2 3\n");
        let stations = scan(header.as_bytes()).stations();
        stations.first().map(|station| station.position)
    };
    assert_eq!(with("0 0 0 1 0 0 0"), None);
    assert_eq!(with("0 0 0 0.8 0.6 0 0"), Some(DVec3::ZERO));
    assert_eq!(
        with("500000.001 -3 2 1 0 0 0"),
        Some(DVec3::new(500_000.001, -3.0, 2.0))
    );
    assert_eq!(with("nan nan nan 1 0 0 0"), None);
}

#[test]
fn broken_files_are_refused_in_words() {
    let check = |bytes: &[u8], expect: &str| {
        let error = read_bytes(bytes.to_vec(), "scan.pcd", &Silent).unwrap_err();
        assert_eq!(error.to_string(), format!("scan.pcd{expect}"));
    };
    let with = |from: &str, to: &str, expect: &str| {
        let header = "# .PCD v.7\nVERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n\
                      VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3\n4 5 6\n";
        assert!(header.contains(from), "{from}");
        check(header.replace(from, to).as_bytes(), expect);
    };
    with(
        "DATA ascii\n",
        "",
        ": there is no line that begins with DATA, which ends the header of a PCD file: copy or export the file again",
    );
    with(
        "FIELDS x y z\n",
        "",
        ": the header has no line FIELDS, which names what a point has: export the file again",
    );
    with(
        "SIZE 4 4 4\n",
        "",
        ": the header has no line SIZE: export the file again",
    );
    with(
        "SIZE 4 4 4",
        "SIZE 4 4",
        ", line 4: SIZE has 2, but should have 3 values: correct the line",
    );
    with(
        "SIZE 4 4 4",
        "SIZE 4 4 3",
        ", line 4: SIZE is \"4 4 3\", but numbers of PCD take 1, 2, 4 or 8 bytes: correct it",
    );
    with(
        "TYPE F F F",
        "TYPE F F D",
        ", line 5: TYPE is \"F F D\", but numbers of PCD are of type I, U or F: correct it",
    );
    with(
        "COUNT 1 1 1",
        "COUNT 1 1 -1",
        ", line 6: COUNT is \"1 1 -1\", not whole numbers: correct it",
    );
    with(
        "VERSION .7",
        "VERSION .8",
        ", line 2: VERSION is \".8\", but Normend reads .5, .6 and .7: export the file as .7",
    );
    with(
        "0 1 0 0 0",
        "0 1 0 0 x",
        ", line 9: VIEWPOINT is \"0 0 0 1 0 0 x\", not seven numbers: correct it",
    );
    with(
        "DATA ascii",
        "DATA zip",
        ", line 11: DATA is \"zip\", but should be ascii, binary or binary_compressed: correct it",
    );
    with(
        "HEIGHT 1",
        "WIDTH 1",
        ", line 8: a second line WIDTH: remove the wrong one",
    );
    with("POINTS 2", "POINTS 0", ": the file has no points: open one that has");
    with(
        "POINTS 2",
        "POINTS 99999999999",
        &format!(
            ": 99999999999 points are more than the {} that Normend can number: split the scan",
            PointCloud::MAX_POINTS
        ),
    );
    with(
        "COUNT 1 1 1",
        "COUNT 1 1 9999",
        ": a point has more than 4096 numbers: export the file with fewer",
    );
    with(
        "FIELDS x y z",
        "FIELDS x y w",
        ": FIELDS does not name x, y and z: export the file with them",
    );
    with(
        "COUNT 1 1 1",
        "COUNT 1 1 2",
        ": COUNT of \"z\" is 2, but it is one number: correct the header",
    );
    with(
        "4 5 6",
        "44 55",
        ", line 13: \"44 55\" has 2 values, but FIELDS and COUNT announce 3 for each point: correct the line",
    );
    with(
        "4 5 6",
        "4 5 east",
        ", line 13: z is \"east\", which is not a number: correct it",
    );
    with(
        "4 5 6\n",
        "",
        ": 2 points do not fit into the 6 bytes after the header: the file is cut off or POINTS is wrong, export it again",
    );
    with(
        "4 5 6",
        "4 5 6\n7 8 9",
        ", line 14: 2 points are announced, but more lines follow: correct POINTS and WIDTH, or remove the lines",
    );
    let header = FIELDS.replace("normal_z", "other");
    check(
        format!("{header}DATA binary\n").as_bytes(),
        ": FIELDS names \"normal_x\", but not all of normal_x, normal_y, normal_z: add or remove them",
    );
    let binary = binary();
    check(
        &binary[..binary.len() - 6],
        ": 4 points do not fit into the 163 bytes after the header: the file is cut off or POINTS is wrong, export it again",
    );
    // Sizes that lie are noticed before anything is allocated.
    let packed = packed();
    let at = packed.windows(5).position(|window| window == b"ssed\n").unwrap() + 5;
    check(
        &packed[..packed.len() - 6],
        &format!(", byte {at}: the packed points do not fit into the file: it is cut off, copy or export it again"),
    );
    let huge = String::from_utf8_lossy(FIELDS.as_bytes()).replace("POINTS 4", "POINTS 100000000");
    let lie = [
        huge.as_bytes(),
        b"DATA binary_compressed\n",
        &3_u32.to_le_bytes(),
        &3_800_000_000_u32.to_le_bytes(),
        &[1, 0, 0],
    ]
    .concat();
    let at = lie.len() - 7;
    check(
        &lie,
        &format!(
            ", byte {at}: the packed points are not as many as announced: the file is damaged, copy or export it again"
        ),
    );
    let mut wrong = packed;
    let at = wrong.windows(5).position(|window| window == b"ssed\n").unwrap() + 9;
    wrong[at] ^= 1;
    check(
        &wrong,
        &format!(", byte {at}: 4 points do not have the 153 bytes that are said to be packed: export the file again"),
    );
}

#[test]
fn packed_files_do_not_unpack_to_any_size() {
    let pack = |n_points: usize| {
        let mut packed = Vec::new();
        lzf::pack(&vec![0; 12 * n_points], &mut packed);
        let sizes = [packed.len(), 12 * n_points]
            .map(|size| (size as u32).to_le_bytes())
            .concat();
        let header = format!("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS {n_points}\nDATA binary_compressed\n");
        read_bytes([header.as_bytes(), &sizes, &packed].concat(), "scan.pcd", &Silent)
    };
    assert_eq!(pack(100_000).unwrap().cloud.n_points(), 100_000);
    let error = pack(2_000_000).unwrap_err().to_string();
    assert!(
        error.ends_with("unpack to more than 32 times their size, as those of no scan do: export the file as binary"),
        "{error}"
    );
}

#[test]
fn new_files_have_the_names_of_pcl() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\n\
               property uchar red\nproperty uchar green\nproperty uchar blue\nproperty ushort scalar_Intensity\n\
               property uint id\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
               500000.125 2 3 1 2 255 65535 4000000000\n4 5 6 0 128 7 0 1\n3 0 1 0\n";
    let ply = read_bytes(ply.into(), "scan.ply", &Silent).unwrap();
    let losses: Vec<String> = ply
        .losses(std::path::Path::new("out.pcd"))
        .unwrap()
        .iter()
        .map(ToString::to_string)
        .collect();
    assert_eq!(
        losses,
        ["1 row of element \"face\": PCD made from PLY holds points alone"]
    );
    let out = written(&ply, &[Vec3::X, Vec3::NEG_Z], None, "out.pcd");
    let head = format!(
        "# .PCD v0.7 - Point Cloud Data file format\n{}\nVERSION 0.7\n\
         FIELDS x y z normal_x normal_y normal_z rgb intensity id\nSIZE 4 4 4 4 4 4 4 4 4\nTYPE F F F F F F F F U\n\
         COUNT 1 1 1 1 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA binary\n",
        own_comment()
    );
    assert_eq!(String::from_utf8_lossy(&out[..head.len()]), head);
    let rows = by_pcd_rs(&out);
    let float = |value: f32| Field::F32(vec![value]);
    let row = |position: [f32; 3], normal: [f32; 3], rgb: u32, intensity: f32, id: u32| {
        let values = position
            .into_iter()
            .chain(normal)
            .chain([f32::from_bits(rgb), intensity]);
        values.map(float).chain([Field::U32(vec![id])]).collect::<Vec<Field>>()
    };
    assert_eq!(
        rows[0],
        row(
            [500_000.12, 2.0, 3.0],
            [1.0, 0.0, 0.0],
            0x0102ff,
            65535.0,
            4_000_000_000
        )
    );
    assert_eq!(rows[1], row([4.0, 5.0, 6.0], [0.0, 0.0, -1.0], 0x008007, 0.0, 1));
    let again = scan(&out);
    assert_eq!(again.colors(&Silent).unwrap().unwrap(), [[1, 2, 255], [0, 128, 7]]);
    assert_eq!(points(&again), points(&ply));
}

#[test]
fn new_files_keep_digits_viewpoint_and_colors_of_any_range() {
    let check = |content: &str, name: &str, fields: &str, losses: &[&str]| {
        let scan = read_bytes(content.into(), name, &Silent).unwrap();
        let named: Vec<String> = scan
            .losses("out.pcd".as_ref())
            .unwrap()
            .iter()
            .map(|loss| loss.what.clone())
            .collect();
        assert_eq!(named, losses, "{content}");
        let normals = vec![Vec3::X; scan.cloud.n_points()];
        let out = written(&scan, &normals, None, "out.pcd");
        assert!(
            String::from_utf8_lossy(&out).contains(&format!("\nFIELDS x y z normal_x normal_y normal_z{fields}\n")),
            "{content}"
        );
        let again = read_bytes(out, "out.pcd", &Silent).unwrap();
        assert_eq!(points(&again), points(&scan));
        assert_eq!(again.has_colors(), scan.has_colors());
        again
    };
    let utm = check("500000.001 4649776.223 12.5\n1 2 3\n", "a.xyz", "", &[]);
    assert_eq!(utm.scalar("y", &Silent).unwrap().unwrap()[0], 4_649_776.223);
    let shares = check(
        "x y z R G B word\n1 2 3 0.5019608 0 1 wall\n",
        "a.xyz",
        " rgb",
        &["\"word\""],
    );
    assert_eq!(shares.colors(&Silent).unwrap().unwrap(), [[128, 0, 255]]);
    let fine = check("x y z r g b a%\n1 2 3 0.123 0.5 1 7\n", "a.xyz", " r g b a_", &[]);
    assert_eq!(fine.scalar("r", &Silent).unwrap().unwrap()[0] as f32, 0.123);
    let deep = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                property ushort red\nproperty ushort green\nproperty ushort blue\nproperty uchar nonsense\nend_header\n1 2 3 65535 0 1000 5\n";
    let deep = check(
        deep,
        "a.ply",
        " rgb nonsense",
        &["\"red\", \"green\" and \"blue\" beyond 8 bits"],
    );
    assert_eq!(deep.colors(&Silent).unwrap().unwrap(), [[255, 0, 4]]);
}

proptest! {
    #[test]
    fn damage_never_panics(kind in 0..3, at in 0_usize..4000, byte in any::<u8>(), cut in 0_usize..4000) {
        let mut bytes = match kind {
            0 => binary(),
            1 => packed(),
            _ => ascii(),
        };
        let n_bytes = bytes.len();
        bytes[at % n_bytes] = byte;
        bytes.truncate(1 + cut % (2 * n_bytes));
        if let Ok(scan) = read_bytes(bytes, "scan.pcd", &Silent) {
            let normals = vec![Vec3::X; scan.cloud.n_points()];
            let out = written(&scan, &normals, None, "out.pcd");
            let again = read_bytes(out, "out.pcd", &Silent).unwrap();
            prop_assert_eq!(again.given_normals.unwrap().to_vec(), normals);
        }
    }
}

proptest! {
    // Each writes a file of some hundred kilobytes.
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn large_packed_files_come_back(n_points in 1_usize..60_000, seed in any::<u32>()) {
        let value = |index: usize| (index as u32).wrapping_mul(seed) >> 12;
        let positions: Vec<Vec3> = (0..n_points).map(|point| Vec3::new(value(point) as f32, point as f32, 0.5)).collect();
        let columns: Vec<u8> = (0..3).flat_map(|axis| positions.iter().flat_map(move |position| position[axis].to_le_bytes())).collect();
        let mut packed = Vec::new();
        columns.chunks(1 << 14).for_each(|piece| lzf::pack(piece, &mut packed));
        let sizes = [packed.len(), columns.len()].map(|size| (size as u32).to_le_bytes()).concat();
        let header = format!(
            "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH {n_points}\nHEIGHT 1\nPOINTS {n_points}\nDATA binary_compressed\n"
        );
        let scan = scan(&[header.as_bytes(), &sizes, &packed].concat());
        prop_assert_eq!(points(&scan), positions.iter().map(|position| position.as_dvec3()).collect::<Vec<DVec3>>());
        let normals: Vec<Vec3> = (0..n_points).map(|point| if value(point) % 2 == 0 { Vec3::X } else { Vec3::NEG_Z }).collect();
        let out = written(&scan, &normals, None, "out.pcd");
        let rows = by_pcd_rs(&out);
        prop_assert_eq!(rows.len(), n_points);
        let again = read_bytes(out, "out.pcd", &Silent).unwrap();
        prop_assert_eq!(points(&again), points(&scan));
        prop_assert_eq!(again.given_normals.unwrap().to_vec(), normals);
    }
}
