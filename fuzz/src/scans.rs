//! Readers and writers of scans.

use std::fs;

use glam::Vec3;
use normend_core::{PointCloud, Silent};
use normend_io::{FileFormat, ReadError, Scan, WriteOptions, read, read_bytes};

use crate::limits::{folder, limited};

/// Unit vectors that every type of number holds.
const NORMALS: [Vec3; 6] = [Vec3::X, Vec3::NEG_Z, Vec3::Y, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Y];
/// One extension for each way of writing.
const EXTENSIONS: [&str; 9] = ["ply", "xyz", "csv", "pts", "las", "laz", "pcd", "e57", "obj"];
/// Longest sentence that says what is wrong with a file.
const MOST_WORDS: usize = 600;

/// Reads `bytes` as a file named `name`; what can be read is written in the same format and in the others, and read again.
pub fn check(bytes: &[u8], name: &str) {
    limited(bytes.len(), || {
        let Some(scan) = read_sentence(bytes, name) else { return };
        check_finite(&scan);
        check_values(&scan);
        let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
        check_written(&scan, extension);
        // One of the others at a time, chosen by the input.
        let other = EXTENSIONS[bytes.len() % EXTENSIONS.len()];
        if other != extension {
            check_written(&scan, other);
        }
    });
}

/// Like [`check`], for E57: also with the checksums that pages should have, which no mutation finds by itself.
pub fn check_e57(bytes: &[u8]) {
    const PAGE: usize = 1024;
    check(bytes, "a.e57");
    let mut sealed = bytes.to_vec();
    sealed.resize(bytes.len().next_multiple_of(PAGE), 0);
    for page in sealed.chunks_exact_mut(PAGE) {
        let (content, checksum) = page.split_at_mut(PAGE - 4);
        checksum.copy_from_slice(&crc32c::crc32c(content).to_be_bytes());
    }
    check(&sealed, "a.e57");
}

/// The scan in `bytes`, or `None` where a sentence says why there is none.
pub fn read_sentence(bytes: &[u8], name: &str) -> Option<Scan> {
    match read_bytes(bytes.to_vec(), name, &Silent) {
        Ok(scan) => Some(scan),
        Err(error) => {
            check_sentence(&error, name);
            None
        }
    }
}

/// One line that begins with the name of the file.
pub fn check_sentence(error: &ReadError, name: &str) {
    let sentence = error.to_string();
    assert!(sentence.starts_with(name), "{sentence}");
    assert!(!sentence.chars().any(char::is_control), "{sentence:?}");
    assert!(sentence.chars().count() < MOST_WORDS, "{sentence}");
}

fn check_finite(scan: &Scan) {
    let n_points = scan.cloud.n_points();
    assert!(n_points > 0 && scan.cloud.origin().is_finite());
    assert!(scan.cloud.positions().iter().all(|position| position.is_finite()));
    if let Some(normals) = &scan.given_normals {
        assert_eq!(normals.len(), n_points);
        assert!(normals.iter().all(|normal| normal.is_finite()));
    }
    if let Some(rows) = scan.rows() {
        assert_eq!(rows.len(), n_points);
        assert!(rows.is_sorted_by(|a, b| a < b), "rows are not in their order");
        assert!(rows.iter().all(|&row| (row as usize) < n_points + scan.n_left_out));
    } else {
        assert_eq!(scan.n_left_out, 0);
    }
}

/// What is shown of a scan besides its points.
fn check_values(scan: &Scan) {
    let n_points = scan.cloud.n_points();
    // A column that cannot be read is said in words; the scan stays.
    if let Ok(Some(colors)) = scan.colors(&Silent) {
        assert_eq!(colors.len(), n_points);
    }
    for column in scan.scalar_columns().iter().take(4) {
        if let Ok(Some(values)) = scan.scalar(column, &Silent) {
            assert_eq!(values.len(), n_points);
        }
    }
}

/// Writes the scan with other normals, reads it again, and compares.
fn check_written(scan: &Scan, extension: &str) {
    let n_points = scan.cloud.n_points();
    let normals: Vec<Vec3> = (0..n_points).map(|point| NORMALS[point % NORMALS.len()]).collect();
    let path = folder().join("written").with_extension(extension);
    let options = WriteOptions {
        rule: "fuzz".to_owned(),
        ..WriteOptions::default()
    };
    scan.write(&normals, &path, &options, &Silent)
        .unwrap_or_else(|error| panic!("what was read cannot be written as {extension}: {error}"));
    let again = read(&path, &Silent);
    let again = again.unwrap_or_else(|error| panic!("what was written as {extension} cannot be read: {error}"));
    fs::remove_file(&path).expect("the file is gone");
    let is_same_format = scan.format() == again.format();
    assert_eq!(scan.cloud.n_points(), again.cloud.n_points(), "points as {extension}");
    // In another format coordinates are rounded where a pose was taken off, and rows that are no points may be left out.
    let has_frames = matches!(scan.format(), FileFormat::E57 | FileFormat::Ptx);
    if is_same_format {
        check_same_points(&scan.cloud, &again.cloud, extension);
        assert_eq!(
            again.n_left_out, scan.n_left_out,
            "rows without a point, as {extension}"
        );
        assert_eq!(again.rows(), scan.rows(), "rows of the points, as {extension}");
    } else if !has_frames {
        check_near_points(&scan.cloud, &again.cloud, extension);
    }
    // Text whose columns have no names tells normals only when there are six; a copy of it adds no names.
    let has_odd_rows = scan.n_left_out > 0 && again.format() == FileFormat::Xyz;
    let is_untold =
        (is_same_format && scan.format() == FileFormat::Xyz || has_odd_rows) && again.given_normals.is_none();
    if !is_untold {
        let given = again.given_normals.as_ref();
        let given = given.unwrap_or_else(|| panic!("there are no normals as {extension}"));
        for (point, (&given, &written)) in given.iter().zip(&normals).enumerate() {
            // Poses turn normals, and back; in LAS they may be whole numbers of steps.
            let is_near = (has_frames || scan.format() == FileFormat::Las) && given.distance(written) < 0.02;
            let is_same = given == written || is_near;
            assert!(is_same, "normal {point} is {given} instead of {written} as {extension}");
        }
    }
}

fn check_same_points(one: &PointCloud, other: &PointCloud, extension: &str) {
    assert_eq!(one.origin(), other.origin(), "the origin as {extension}");
    for (point, (one, other)) in one.positions().iter().zip(other.positions()).enumerate() {
        assert_eq!(one, other, "point {point} as {extension}");
    }
}

/// In another format a `float` may be the shortest decimal that gives the same `float`, which as `double` is another number, and a
/// number of steps.
fn check_near_points(one: &PointCloud, other: &PointCloud, extension: &str) {
    let diagonal = f64::from(one.diagonal());
    for (point, (one_at, other_at)) in one.positions().iter().zip(other.positions()).enumerate() {
        let one_at = one.origin() + one_at.as_dvec3();
        let other_at = other.origin() + other_at.as_dvec3();
        let allowed = f64::from(f32::EPSILON) * (one_at.length() + diagonal) + f64::from(f32::MIN_POSITIVE);
        let distance = (one_at - other_at).length();
        assert!(
            distance <= allowed,
            "point {point} is at {other_at} instead of {one_at} as {extension}"
        );
    }
}
