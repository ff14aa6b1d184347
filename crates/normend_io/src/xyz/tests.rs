//! Tests of what the columns of texts are taken for.

use normend_core::Silent;

use super::*;
use crate::{ReadOptions, Scan, read_bytes_with};

fn read_named(content: &str, columns: Option<&str>) -> Result<Scan, String> {
    let options = ReadOptions {
        columns: columns.map(|names| names.split(' ').map(str::to_owned).collect()),
    };
    let scan = read_bytes_with(content.into(), "a.txt", &options, &Silent);
    scan.map_err(|error| error.to_string())
}

fn scan(content: &str) -> Scan {
    read_named(content, None).unwrap()
}

fn first_point(scan: &Scan) -> [f64; 3] {
    (scan.cloud.origin() + scan.cloud.positions()[0].as_dvec3()).to_array()
}

#[test]
fn columns_are_found_in_any_order_by_their_names() {
    let check = |content: &str, point: [f64; 3], normal: Option<[f32; 3]>| {
        let scan = scan(content);
        assert_eq!(first_point(&scan), point, "{content}");
        let found = scan.given_normals.as_ref().map(|normals| normals[0].to_array());
        assert_eq!(found, normal, "{content}");
        assert!(scan.text_columns().unwrap().is_certain, "{content}");
    };
    check("nx ny nz x y z\n0 0 1 7 8 9\n", [7.0, 8.0, 9.0], Some([0.0, 0.0, 1.0]));
    check("\"Z\";\"Y\";\"X\";\"id\"\n3;2;1;5\n", [1.0, 2.0, 3.0], None);
    check("id|x|y|z\n1|2|3|4\n", [2.0, 3.0, 4.0], None);
    check("Easting,Northing,Elevation\n1,2,3\n", [1.0, 2.0, 3.0], None);
    check("Punkt\tRechtswert\tHochwert\tHöhe\n9\t1\t2\t3\n", [1.0, 2.0, 3.0], None);
    check(
        "//X Y Z Nx Ny Nz\n1 2 3 0 1 0\n",
        [1.0, 2.0, 3.0],
        Some([0.0, 1.0, 0.0]),
    );
}

#[test]
fn columns_without_names_are_told_by_their_look() {
    let check = |content: &str, names: &str, is_certain: bool| {
        let columns = scan(content).text_columns().unwrap();
        let found: Vec<&str> = columns
            .names
            .iter()
            .map(|name| if name.is_empty() { "-" } else { name })
            .collect();
        assert_eq!(found.join(" "), names, "{content}");
        assert_eq!(columns.by, ColumnsBy::Look);
        assert_eq!(columns.is_certain, is_certain, "{content}");
    };
    check("1 2 3\n", "x y z", true);
    check("1 2 3 0.6 0 -0.8\n4 5 6 0 0 1\n", "x y z nx ny nz", true);
    check("1 2 3 9\n", "x y z -", false);
    check("1 2 3 10 20 255\n4 5 6 0 1 2\n", "x y z red green blue", false);
    check(
        "2\n1 2 3 -51 10 20 255 0.6 0 -0.8\n4 5 6 7 0 1 2 0 0 1\n",
        "x y z intensity red green blue nx ny nz",
        false,
    );
    check(
        "1 2 3 0.6 0 -0.8 10 20 255\n4 5 6 0 0 1 3 4 5\n",
        "x y z nx ny nz red green blue",
        false,
    );
    // Colors in 0..=1 may have unit length.
    check("1 2 3 0 0 1 9.5\n4 5 6 1 0 0 8\n", "x y z - - - -", false);
    // A word does not hide what stands after it.
    check("1 2 3 wall 0.6 0 -0.8\n4 5 6 roof 0 -1 0\n", "x y z - nx ny nz", false);
}

#[test]
fn columns_go_by_their_look_into_other_formats() {
    let names = |content: &str| scan(content).scalar_columns();
    let coordinates = ["Column 1", "Column 2", "Column 3"];
    let pts = ["intensity", "red", "green", "blue"];
    assert_eq!(
        names("2\n1 2 3 -51 10 20 255\n4 5 6 7 0 1 2\n"),
        [&coordinates[..], &pts].concat()
    );
    assert_eq!(
        names("1 2 3 9 8\n"),
        [&coordinates[..], &["Column 4", "Column 5"]].concat()
    );
}

#[test]
fn the_caller_names_columns() {
    let content = "1 2 3 4 5 6 7\n11 12 13 14 15 16 17\n";
    let scan = read_named(content, Some("z - y x - value")).unwrap();
    assert_eq!(first_point(&scan), [4.0, 3.0, 1.0]);
    assert_eq!(scan.scalar("value", &Silent).unwrap().unwrap(), [6.0, 16.0]);
    assert_eq!(scan.columns_given().unwrap().len(), 6);
    assert_eq!(scan.identity("a.txt").columns.unwrap()[0], "z");
    let check = |names: &str, expect: &str| {
        let error = read_named(content, Some(names)).unwrap_err();
        assert!(error.contains(expect), "{error}");
    };
    check("x y", "no x, y and z");
    check("x y z nx ny", "all three or none");
    check("x y z x", "two columns are named x");
    check("x y z 4 5 6 7 8", "8 columns are named, and the first row has 7 values");
}

#[test]
fn decimal_commas_are_read_and_written() {
    let check = |content: &str, point: [f64; 3], expect: &str| {
        let scan = scan(content);
        assert_eq!(first_point(&scan), point, "{content}");
        assert!(scan.text_columns().unwrap().has_decimal_commas);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.txt");
        let normals = vec![glam::Vec3::new(0.6, 0.0, -0.8); scan.cloud.n_points()];
        scan.write(&normals, &path, &crate::WriteOptions::default(), &Silent)
            .unwrap();
        let out = std::fs::read_to_string(&path).unwrap();
        assert_eq!(out, expect);
        // In another format numbers have points.
        let csv = folder.path().join("out.ply");
        scan.convert(&csv, &crate::WriteOptions::default(), &Silent).unwrap();
        assert_eq!(first_point(&crate::read(&csv, &Silent).unwrap()), point);
    };
    check(
        "1,5;2,25;3\n4,5;5;6\n",
        [1.5, 2.25, 3.0],
        "1,5;2,25;3;0,6;0;-0,8\n4,5;5;6;0,6;0;-0,8\n",
    );
    check(
        "x\ty\tz\n1,5\t-2,25\t3e1\n",
        [1.5, -2.25, 30.0],
        "x\ty\tz\tnx\tny\tnz\n1,5\t-2,25\t3e1\t0,6\t0\t-0,8\n",
    );
    check("1,5 2,5 3,5\n", [1.5, 2.5, 3.5], "1,5 2,5 3,5 0,6 0 -0,8\n");
    let mixed = read_named("1,2,3 4 5 6\n", None).unwrap_err();
    assert!(mixed.contains("commas besides other separators"), "{mixed}");
    let points_too = read_named("1,5;2.5;3\n", None).unwrap_err();
    assert!(points_too.contains("commas besides other separators"), "{points_too}");
}
