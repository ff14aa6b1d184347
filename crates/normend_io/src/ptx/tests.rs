//! Tests of PTX files.

use std::path::Path;

use glam::{DVec3, Vec3};
use normend_core::Silent;
use proptest::prelude::*;

use crate::{FileFormat, Scan, WriteOptions, read_bytes};

/// The header of a grid, turned by a quarter about z and moved to (10, 20, 30).
fn header(columns: usize, rows: usize) -> String {
    format!("{columns}\n{rows}\n10 20 30\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 30 1\n")
}

/// Two grids: one with colors, Windows line ends and a ray into the sky; one without.
fn two_grids() -> String {
    let first = header(2, 2) + "1 0 0 0.5 1 2 3\n0 0 0 0.500000 0 0 0\n0 2 0 0.25 4 5 6\n0 0 -3 1 7 8 9\n";
    let second = "1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n5.5 6 7 0.125\n-8 9 10 0.75\n";
    first.replace('\n', "\r\n") + second
}

fn scan(text: &str) -> Scan {
    read_bytes(text.as_bytes().to_vec(), "a.ptx", &Silent).unwrap()
}

fn positions(scan: &Scan) -> Vec<DVec3> {
    let cloud = &scan.cloud;
    cloud
        .positions()
        .iter()
        .map(|position| cloud.origin() + position.as_dvec3())
        .collect()
}

fn written(scan: &Scan, normals: &[Vec3], name: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    scan.write(normals, &path, &WriteOptions::default(), &Silent).unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn grids_are_read_with_their_poses() {
    let scan = scan(&two_grids());
    assert_eq!(
        (scan.format(), scan.cloud.n_points(), scan.n_left_out),
        (FileFormat::Ptx, 5, 1)
    );
    let expected = [
        [10.0, 21.0, 30.0],
        [8.0, 20.0, 30.0],
        [10.0, 20.0, 27.0],
        [5.5, 6.0, 7.0],
        [-8.0, 9.0, 10.0],
    ];
    for (found, expected) in positions(&scan).into_iter().zip(expected) {
        assert!(found.abs_diff_eq(DVec3::from(expected), 1e-5), "{found}");
    }
    let stations = scan.stations();
    assert_eq!(stations.len(), 1, "a list without a pose was scanned from nowhere");
    assert_eq!(
        (stations[0].points.clone(), stations[0].position),
        (0..3, DVec3::new(10.0, 20.0, 30.0))
    );
    assert_eq!(
        scan.scalar_columns(),
        ["x", "y", "z", "intensity", "red", "green", "blue"]
    );
    assert_eq!(
        scan.scalar("intensity", &Silent).unwrap().unwrap(),
        [0.5, 0.25, 1.0, 0.125, 0.75]
    );
    assert_eq!(scan.colors(&Silent).unwrap().unwrap()[2], [7, 8, 9]);
    assert!(scan.given_normals.is_none());
}

#[test]
fn a_copy_has_all_bytes_and_normals_at_the_end_of_lines() {
    let text = two_grids();
    let scan = scan(&text);
    let normals = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, Vec3::new(0.6, 0.0, -0.8)];
    let copy = String::from_utf8(written(&scan, &normals, "b.ptx")).unwrap();
    let lines: Vec<(&str, &str)> = text.lines().zip(copy.lines()).collect();
    assert_eq!(
        (text.lines().count(), text.matches('\r').count()),
        (copy.lines().count(), copy.matches('\r').count())
    );
    let added: Vec<&str> = lines
        .iter()
        .map(|(former, new)| new.strip_prefix(former).unwrap())
        .collect();
    // +x of the scan is -y of the turned grid.
    let turned = added[10].split_whitespace().map(|value| value.parse::<f32>().unwrap());
    assert!(Vec3::from_iter_of(turned).abs_diff_eq(-Vec3::Y, 1e-6), "{}", added[10]);
    assert_eq!((added[11], added[24], added[25]), (" 0 0 1", " -1 0 0", " 0.6 0 -0.8"));
    assert!(added[..10].iter().chain(&added[14..24]).all(|added| added.is_empty()));

    let again = read_bytes(copy.clone().into_bytes(), "b.ptx", &Silent).unwrap();
    let given = again.given_normals.clone().unwrap();
    for (given, normal) in given.iter().zip(&normals) {
        assert!(given.abs_diff_eq(*normal, 1e-6), "{given}");
    }
    assert_eq!(again.scalar_columns()[..7], scan.scalar_columns()[..]);
    assert_eq!(written(&again, &given, "c.ptx"), copy.clone().into_bytes());
    let flipped: Vec<Vec3> = given.iter().map(|normal| -*normal).collect();
    let flipped = String::from_utf8(written(&again, &flipped, "c.ptx")).unwrap();
    assert!(flipped.ends_with("-8 9 10 0.75 -0.6 0 0.8\n"), "{flipped}");
    assert_eq!(
        scan.losses(Path::new("b.ptx")).unwrap().len(),
        1,
        "few programs read normals there"
    );
    assert_eq!(again.losses(Path::new("b.ptx")).unwrap(), []);
}

/// Reads three numbers as a vector.
trait FromNumbers {
    fn from_iter_of(numbers: impl Iterator<Item = f32>) -> Self;
}

impl FromNumbers for Vec3 {
    fn from_iter_of(numbers: impl Iterator<Item = f32>) -> Self {
        let numbers: Vec<f32> = numbers.collect();
        Self::from_slice(&numbers)
    }
}

#[test]
fn other_formats_become_grids_of_one_row() {
    let text = "x y z reflectance red green blue class\n1e6 2 3 0.5 0 128 255 wall\nnan 0 0 0.25 1 2 3 roof\n4 5 6 1 9 9 9 wall\n";
    let scan = read_bytes(text.as_bytes().to_vec(), "a.xyz", &Silent).unwrap();
    let losses = scan.losses(Path::new("a.ptx")).unwrap();
    assert!(losses.iter().any(|loss| loss.what == "\"class\""), "{losses:?}");
    let ptx = String::from_utf8(written(&scan, &[Vec3::X, -Vec3::Z], "a.ptx")).unwrap();
    let expected = "3\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n\
        1e6 2 3 0.5 0 128 255 1 0 0\n0 0 0 0.25 1 2 3 0 0 1\n4 5 6 1 9 9 9 0 0 -1\n";
    assert_eq!(ptx, expected);
    let again = read_bytes(ptx.into_bytes(), "a.ptx", &Silent).unwrap();
    assert!(again.stations().is_empty());
    assert_eq!(again.given_normals.as_deref().unwrap(), &[Vec3::X, -Vec3::Z]);
    // What is no point in PTX is none anywhere else.
    let xyz = String::from_utf8(written(&again, &[Vec3::X, -Vec3::Z], "b.xyz")).unwrap();
    assert!(
        xyz.lines().nth(2).unwrap().to_lowercase().starts_with("nan nan nan"),
        "{xyz}"
    );
}

#[test]
fn broken_files_are_refused_with_the_line() {
    let check = |text: &str, expect: &str| {
        let error = read_bytes(text.as_bytes().to_vec(), "a.ptx", &Silent)
            .unwrap_err()
            .to_string();
        assert!(error.contains(expect), "{error}\nbut expected: {expect}");
    };
    let good = two_grids();
    check(
        &good.replace("5.5 6 7 0.125", "5.5 6 7"),
        "line 26: 4 values where 3 belong",
    );
    check(
        &good.replace("5.5 6 7 0.125", "5.5 six 7 0.125"),
        "line 25: y is \"six\"",
    );
    check(&good[..good.len() - 13], "the file ends after 1 of 2 cells");
    check(
        &header(1000, 1_000_000),
        "line 1: a grid of 1000 columns and 1000000 rows does not fit",
    );
    check(
        &(header(1, 1) + "1 2 3 4\n9\n"),
        "the file ends before the number of rows",
    );
    check(
        &(header(1, 1) + "1 2 3 4\n5 6 7 8\n"),
        "line 12: \"5 6 7 8\" where the number of columns belongs",
    );
    check(
        &good.replacen("0 1 0 0\r\n", "0 1 0\r\n", 1),
        "line 7: \"0 1 0\" where the matrix belongs, 4 numbers",
    );
    check(
        &good.replacen("0 1 0 0\r\n", "1 1 1 0\r\n", 1),
        "line 7: the matrix does not turn and move",
    );
    check(&header(0, 0), "the file has no points");
    check(&(header(1, 1) + "0 0 0 0\n"), "no point has finite coordinates");
}

#[test]
fn damage_anywhere_is_no_panic() {
    let good = two_grids().into_bytes();
    let mut state = 99_u64;
    let mut next = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 33) as usize
    };
    for _ in 0..3000 {
        let mut bytes = good.clone();
        let at = next() % bytes.len();
        match next() % 3 {
            0 => bytes[at] = b"0123456789.-+eE \n\r\tnaif,"[next() % 24],
            1 => bytes.truncate(at),
            _ => drop(bytes.drain(at..(at + next() % 30).min(good.len()))),
        }
        if let Ok(scan) = read_bytes(bytes, "a.ptx", &Silent) {
            let normals = vec![Vec3::X; scan.cloud.n_points()];
            written(&scan, &normals, "b.ptx");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Any grids come back as they are, with normals of any points, across parts.
    #[test]
    fn any_grids_come_back(
        sizes in proptest::collection::vec((0..5_usize, 0..6_usize), 1..5),
        seed in any::<u32>(),
    ) {
        let mut text = String::new();
        let mut n_points = 0;
        let mut value = u64::from(seed);
        for (columns, rows) in sizes {
            text += &header(columns, rows);
            for _ in 0..columns * rows {
                value = value.wrapping_mul(6364136223846793005).wrapping_add(1);
                let is_missing = value >> 62 == 0;
                n_points += usize::from(!is_missing);
                text += &match is_missing {
                    true => "0 0.0 -0e5 0.5\n".to_owned(),
                    false => format!("{} {} 1 0.5\n", (value >> 40) as f64 / 1000.0, (value >> 20) % 977),
                };
            }
        }
        prop_assume!(n_points > 0);
        let scan = scan(&text);
        prop_assert_eq!(scan.cloud.n_points(), n_points);
        let copy = String::from_utf8(written(&scan, &vec![Vec3::Z; n_points], "b.ptx")).unwrap();
        let without: String = copy.lines().map(|line| line.strip_suffix(" 0 0 1").unwrap_or(line).to_owned() + "\n").collect();
        prop_assert_eq!(without, text);
    }
}

#[test]
fn grids_across_parts_keep_their_rows() {
    let mut text = String::new();
    for grid in 0..3 {
        text += &header(130, 170);
        for cell in 0..130 * 170 {
            text += &format!("{} {} {grid} 0.5\n", cell % 130 + 1, cell / 130);
        }
    }
    let scan = scan(&text);
    assert_eq!(scan.cloud.n_points(), 3 * 130 * 170);
    assert_eq!(scan.stations().len(), 3);
    let last = *positions(&scan).last().unwrap();
    assert!(
        last.abs_diff_eq(DVec3::new(10.0 - 169.0, 20.0 + 130.0, 32.0), 1e-3),
        "{last}"
    );
    let copy = String::from_utf8(written(&scan, &vec![Vec3::Z; scan.cloud.n_points()], "b.ptx")).unwrap();
    assert!(
        copy.lines()
            .zip(text.lines())
            .all(|(new, former)| new.starts_with(former))
    );
    assert_eq!(
        copy.lines().filter(|line| line.ends_with(" 0.5 0 0 1")).count(),
        scan.cloud.n_points()
    );
}
