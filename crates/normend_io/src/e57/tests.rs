//! Tests of E57 files: made and read by the crate `e57`, so that two readers and writers check each other.

use std::io::Cursor;

use e57::{
    E57Reader, E57Writer, Extension, ImageFormat, Quaternion, RawValues, Record, RecordDataType, RecordName,
    RecordValue, Transform, Translation, VisualReferenceImageProperties,
};
use glam::{DVec3, Vec3};
use normend_core::Silent;
use proptest::prelude::*;

use crate::{FileFormat, Scan, WriteOptions, read, read_bytes};

const DOUBLE: RecordDataType = RecordDataType::Double { min: None, max: None };
pub(super) const SINGLE: RecordDataType = RecordDataType::Single { min: None, max: None };

pub(super) fn whole(min: i64, max: i64) -> RecordDataType {
    RecordDataType::Integer { min, max }
}

pub(super) fn record(name: RecordName, data_type: RecordDataType) -> Record {
    Record { name, data_type }
}

pub(super) fn other(namespace: &str, name: &str) -> RecordName {
    RecordName::Unknown {
        namespace: namespace.to_owned(),
        name: name.to_owned(),
    }
}

pub(super) fn place(kind: RecordDataType) -> Vec<Record> {
    [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ]
        .map(|name| record(name, kind.clone()))
        .into()
}

/// A quarter turn about z, and a move.
fn quarter_turn() -> Transform {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    Transform {
        rotation: Quaternion {
            w: half,
            x: 0.0,
            y: 0.0,
            z: half,
        },
        translation: Translation {
            x: 100.0,
            y: 200.0,
            z: 300.0,
        },
    }
}

/// Rows of the first scan: four points and one that is none.
fn first_rows() -> Vec<RawValues> {
    (0..5_i64)
        .map(|row| {
            vec![
                RecordValue::Double(row as f64 + 0.1),
                RecordValue::Double(1.0 + 0.5 * row as f64),
                RecordValue::Double(-2.0),
                RecordValue::Integer(if row == 2 { 2 } else { 0 }),
                RecordValue::Integer(2000 - row),
                RecordValue::Integer(10 * row),
                RecordValue::Integer(200),
                RecordValue::Integer(255),
                RecordValue::ScaledInteger(-500 + row),
            ]
        })
        .collect()
}

/// Rows of the second scan: a grid of ranges and angles with normals.
fn second_rows() -> Vec<RawValues> {
    (0..4_i64)
        .map(|row| {
            vec![
                RecordValue::Single(2.0),
                RecordValue::Single(std::f32::consts::FRAC_PI_2 * row as f32),
                RecordValue::Single(0.0),
                RecordValue::Integer(row % 2),
                RecordValue::Integer(row / 2),
                RecordValue::Double(1.0e-3 * row as f64),
                RecordValue::Single(0.6),
                RecordValue::Single(0.0),
                RecordValue::Single(0.8),
            ]
        })
        .collect()
}

/// Two scans with different values, poses, an image, an extension that nobody knows, and a coordinate system.
pub(super) fn two_scans() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = E57Writer::new(Cursor::new(&mut bytes), "{file}").unwrap();
    writer.set_coordinate_metadata(Some("EPSG:25832".to_owned()));
    writer
        .register_extension(Extension::new("demo", "http://example.org/demo"))
        .unwrap();
    writer
        .register_extension(Extension::new("nor", super::metadata::NORMALS_URI))
        .unwrap();
    let mut prototype = place(DOUBLE);
    prototype.push(record(RecordName::CartesianInvalidState, whole(0, 2)));
    prototype.push(record(RecordName::Intensity, whole(0, 2047)));
    for name in [RecordName::ColorRed, RecordName::ColorGreen, RecordName::ColorBlue] {
        prototype.push(record(name, whole(0, 255)));
    }
    let scaled = RecordDataType::ScaledInteger {
        min: -1000,
        max: 1000,
        scale: 0.01,
        offset: 5.0,
    };
    prototype.push(record(other("demo", "gloss"), scaled));
    let mut scan = writer.add_pointcloud("{first}", prototype).unwrap();
    first_rows().into_iter().for_each(|row| scan.add_point(row).unwrap());
    scan.set_name(Some("Hall".to_owned()));
    scan.set_description(Some("before <the> fire & after".to_owned()));
    scan.set_sensor_vendor(Some("Someone".to_owned()));
    scan.set_temperature(Some(21.5));
    scan.set_transform(Some(quarter_turn()));
    scan.finalize().unwrap();

    let mut prototype: Vec<Record> = [
        RecordName::SphericalRange,
        RecordName::SphericalAzimuth,
        RecordName::SphericalElevation,
    ]
    .map(|name| record(name, SINGLE))
    .into();
    prototype.push(record(RecordName::RowIndex, whole(0, 1)));
    prototype.push(record(RecordName::ColumnIndex, whole(0, 1)));
    prototype.push(record(RecordName::TimeStamp, DOUBLE));
    for name in ["normalX", "normalY", "normalZ"] {
        prototype.push(record(other("nor", name), SINGLE));
    }
    let mut scan = writer.add_pointcloud("{second}", prototype).unwrap();
    second_rows().into_iter().for_each(|row| scan.add_point(row).unwrap());
    scan.finalize().unwrap();

    let mut image = writer.add_image("{image}").unwrap();
    image.set_name("A door");
    let properties = VisualReferenceImageProperties { width: 7, height: 7 };
    image
        .add_visual_reference(ImageFormat::Png, &mut &b"not a png, but bytes"[..], properties, None)
        .unwrap();
    image.finalize().unwrap();
    writer
        .finalize_customized_xml(|xml| {
            // Something that no program but one understands.
            Ok(xml.replace(
                "</e57Root>",
                "<demo:note xmlns:demo=\"http://example.org/demo\" type=\"String\"><![CDATA[keep me]]></demo:note>\n</e57Root>",
            ))
        })
        .unwrap();
    drop(writer);
    bytes
}

pub(super) fn scan(bytes: &[u8]) -> Scan {
    read_bytes(bytes.to_vec(), "scan.e57", &Silent).unwrap()
}

/// The positions of all points.
fn positions(scan: &Scan) -> Vec<DVec3> {
    let cloud = &scan.cloud;
    cloud
        .positions()
        .iter()
        .map(|position| cloud.origin() + position.as_dvec3())
        .collect()
}

pub(super) fn written(scan: &Scan, normals: &[Vec3], confidence: Option<&[u8]>, name: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let options = WriteOptions {
        rule: "outward".to_owned(),
        ..WriteOptions::default()
    };
    scan.write_with_confidence(normals, confidence, &path, &options, &Silent)
        .unwrap();
    std::fs::read(path).unwrap()
}

/// The values of a scan as the crate reads them.
fn values(bytes: &[u8], index: usize) -> (Vec<Record>, Vec<RawValues>) {
    let mut reader = E57Reader::new(Cursor::new(bytes)).unwrap();
    let cloud = reader.pointclouds().remove(index);
    let rows = reader.pointcloud_raw(&cloud).unwrap().map(Result::unwrap).collect();
    (cloud.prototype, rows)
}

#[test]
fn all_scans_are_read_with_their_poses() {
    let scan = scan(&two_scans());
    assert_eq!(scan.format(), FileFormat::E57);
    assert_eq!(scan.cloud.n_points(), 8);
    assert_eq!(scan.n_left_out, 1, "an invalid point is none");
    let found = positions(&scan);
    // (0.1, 1, -2) turned by a quarter, and moved.
    assert!(
        found[0].abs_diff_eq(DVec3::new(99.0, 200.1, 298.0), 1e-4),
        "{}",
        found[0]
    );
    assert!(found[5].abs_diff_eq(DVec3::new(0.0, 2.0, 0.0), 1e-4), "{}", found[5]);
    let stations = scan.stations();
    assert_eq!(stations.len(), 2);
    assert_eq!(
        (stations[0].points.clone(), stations[0].position),
        (0..4, DVec3::new(100.0, 200.0, 300.0))
    );
    assert_eq!((stations[1].points.clone(), stations[1].position), (4..8, DVec3::ZERO));
    let expected = [
        "x",
        "y",
        "z",
        "cartesianInvalidState",
        "intensity",
        "red",
        "green",
        "blue",
        "demo:gloss",
        "sphericalRange",
        "sphericalAzimuth",
        "sphericalElevation",
        "rowIndex",
        "columnIndex",
        "timeStamp",
        "nx",
        "ny",
        "nz",
    ];
    assert_eq!(scan.scalar_columns(), expected);
    let column = |name: &str| scan.scalar(name, &Silent).unwrap().unwrap();
    assert_eq!(
        column("intensity"),
        [2000.0, 1999.0, 1997.0, 1996.0, 0.0, 0.0, 0.0, 0.0]
    );
    let gloss = column("demo:gloss");
    assert_eq!(
        gloss[..4],
        [0.0, 0.01, 0.03, 0.04].map(|step| (-500.0 + step * 100.0_f64).round() * 0.01 + 5.0)
    );
    assert!(gloss[4].is_nan(), "the other scan has none");
    assert_eq!(column("timeStamp")[7], 3.0e-3);
    assert_eq!(scan.colors(&Silent).unwrap().unwrap()[1], [10, 200, 255]);
    let given = scan.given_normals.clone().unwrap();
    assert_eq!((given[0], given[4]), (Vec3::ZERO, Vec3::new(0.6, 0.0, 0.8)));
}

#[test]
fn a_copy_differs_in_normals_alone() {
    let bytes = two_scans();
    let scan = scan(&bytes);
    let mut normals = vec![Vec3::X; 8];
    normals[4..].copy_from_slice(&[Vec3::new(0.6, 0.0, 0.8); 4]);
    normals[5] = -normals[5];
    let copy = written(&scan, &normals, None, "copy.e57");

    for (index, n_former) in [(0, 9), (1, 6)] {
        let (former, rows) = values(&bytes, index);
        let (prototype, new_rows) = values(&copy, index);
        assert_eq!(prototype.len(), n_former + 3);
        for (record, former) in prototype.iter().zip(&former) {
            assert_eq!(format!("{record:?}"), format!("{former:?}"));
        }
        for (row, new) in rows.iter().zip(&new_rows) {
            assert_eq!(row[..n_former], new[..n_former], "values are the same bits");
        }
    }
    let (_, rows) = values(&copy, 0);
    // +x of all scans is -y of the turned one.
    let normal = |row: &RawValues, first: usize| -> Vec<f64> {
        row[first..first + 3]
            .iter()
            .map(|value| value.to_f64(&SINGLE).unwrap())
            .collect()
    };
    for (found, expected) in normal(&rows[0], 9).iter().zip([0.0, -1.0, 0.0]) {
        assert!((found - expected).abs() < 1e-6, "{found}");
    }
    assert_eq!(normal(&rows[2], 9), [0.0, 0.0, 1.0], "a row that is no point");
    let (_, rows) = values(&copy, 1);
    assert_eq!(rows[0][6..], second_rows()[0][6..], "what stays has the same bits");
    assert_eq!(rows[1][6..], [-0.6, 0.0, -0.8].map(RecordValue::Single));

    let reader = |bytes| E57Reader::new(Cursor::new(bytes)).unwrap();
    let (former, mut new) = (reader(&bytes[..]), reader(&copy[..]));
    assert_eq!(
        (former.guid(), former.coordinate_metadata()),
        (new.guid(), new.coordinate_metadata())
    );
    for (former, new) in former.pointclouds().into_iter().zip(new.pointclouds()) {
        let without_rows = |mut cloud: e57::PointCloud| {
            cloud.prototype.clear();
            cloud.file_offset = 0;
            format!("{cloud:?}")
        };
        assert_eq!(without_rows(former), without_rows(new));
    }
    let image = new.images().remove(0);
    let mut blob = Vec::new();
    new.blob(&image.visual_reference.unwrap().blob.data, &mut blob).unwrap();
    assert_eq!(blob, b"not a png, but bytes");
    assert_eq!(image.name.as_deref(), Some("A door"));
    for kept in [
        "<demo:note",
        "keep me",
        "before <the> fire & after",
        "Normend",
        "rule: outward",
    ] {
        assert!(new.xml().contains(kept), "{kept}");
    }
    assert_eq!(E57Reader::validate_crc(Cursor::new(&copy[..])).unwrap(), 1024);

    // And so is a copy of the copy, down to the comment.
    let again = read_bytes(copy.clone(), "copy.e57", &Silent).unwrap();
    let given = again.given_normals.clone().unwrap();
    for (given, normal) in given.iter().zip(&normals) {
        assert!(given.abs_diff_eq(*normal, 1e-6), "{given} {normal}");
    }
    assert_eq!(written(&again, &given, None, "again.e57"), copy);
}

#[test]
fn confidence_is_kept_in_a_namespace_of_its_own() {
    let scan = scan(&two_scans());
    let copy = written(
        &scan,
        &[Vec3::Y; 8],
        Some(&[0, 255, 128, 3, 200, 255, 0, 1]),
        "copy.e57",
    );
    let (prototype, rows) = values(&copy, 0);
    let names: Vec<String> = prototype[12..]
        .iter()
        .map(|record| format!("{:?}", record.name))
        .collect();
    assert!(
        names[0].contains("normend") && names[0].contains("confidence"),
        "{names:?}"
    );
    assert_eq!(rows[1][12..], [RecordValue::Single(1.0), RecordValue::Integer(1)]);
    let again = read_bytes(copy, "copy.e57", &Silent).unwrap();
    let confidence = again.scalar("confidence", &Silent).unwrap().unwrap();
    assert_eq!(confidence[1], 1.0);
    assert_eq!(again.scalar("oriented", &Silent).unwrap().unwrap()[0], 0.0);
    // A second time they are replaced rather than added.
    let twice = written(&again, &[Vec3::Y; 8], Some(&[255; 8]), "twice.e57");
    assert_eq!(values(&twice, 0).0.len(), prototype.len());
}

#[test]
fn a_pose_that_only_moves_is_a_scanner_when_points_surround_it() {
    let check = |offset: f64, sensor: bool, expect: usize| {
        let mut bytes = Vec::new();
        let mut writer = E57Writer::new(Cursor::new(&mut bytes), "{file}").unwrap();
        let mut scan = writer.add_pointcloud("{scan}", place(DOUBLE)).unwrap();
        for side in [-1.0, 1.0] {
            scan.add_point(vec![RecordValue::Double(side + offset); 3]).unwrap();
        }
        scan.set_sensor_model(sensor.then(|| "X330".to_owned()));
        scan.set_transform(Some(Transform {
            rotation: Quaternion::default(),
            translation: quarter_turn().translation,
        }));
        scan.finalize().unwrap();
        writer.finalize().unwrap();
        drop(writer);
        let scan = read_bytes(bytes, "a.e57", &Silent).unwrap();
        assert_eq!(scan.stations().len(), expect, "{offset} {sensor}");
    };
    check(0.0, false, 1);
    check(50.0, false, 0);
    check(50.0, true, 1);
}

#[test]
fn other_formats_become_scans_and_come_back() {
    let ply = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float scalar_Intensity\n\
        property int 7th\nproperty ushort class\nend_header\n\
        500000.125 5000000.001 1 1 2 3 0.25 -7 9\nnan 0 0 4 5 6 0.5 8 65535\n500001 5000001 2 7 8 9 0.75 0 0\n";
    let scan = read_bytes(ply.to_vec(), "a.ply", &Silent).unwrap();
    let path = std::path::Path::new("a.e57");
    assert_eq!(scan.losses(path).unwrap(), []);
    let bytes = written(&scan, &[Vec3::X, -Vec3::Z], Some(&[255, 3]), "a.e57");
    let (prototype, rows) = values(&bytes, 0);
    assert_eq!(rows[1][3], RecordValue::Integer(2), "a row without a place");
    assert!(prototype.iter().any(|record| record.name == RecordName::Intensity));
    let cloud = E57Reader::new(Cursor::new(&bytes[..])).unwrap().pointclouds().remove(0);
    assert!(cloud.transform.is_none() && cloud.color_limits.is_some() && cloud.intensity_limits.is_some());

    let again = read_bytes(bytes, "a.e57", &Silent).unwrap();
    assert_eq!(again.given_normals.as_deref().unwrap(), &[Vec3::X, -Vec3::Z]);
    let column = |name: &str| again.scalar(name, &Silent).unwrap().unwrap();
    assert_eq!(column("x"), [500000.125, 500001.0]);
    assert_eq!(column("y"), [5000000.001, 5000001.0]);
    assert_eq!(
        (column("intensity"), column("class")),
        (vec![0.25, 0.75], vec![9.0, 0.0])
    );
    assert_eq!(column("field_7th"), [-7.0, 0.0]);
    assert_eq!(again.colors(&Silent).unwrap().unwrap(), [[1, 2, 3], [7, 8, 9]]);
    assert!(again.stations().is_empty());
}

#[test]
fn scans_stay_scans_and_grids_stay_grids_in_ptx() {
    let scan = scan(&two_scans());
    let normals = vec![Vec3::X; 8];
    let ptx = written(&scan, &normals, None, "a.ptx");
    let text = String::from_utf8(ptx.clone()).unwrap();
    assert!(text.starts_with("5\n1\n100 200 300\n"), "{text}");
    assert!(text.contains("\n2\n2\n0 0 0\n1 0 0\n"), "a grid: {text}");
    let again = read_bytes(ptx, "a.ptx", &Silent).unwrap();
    for (found, expected) in positions(&again).iter().zip(positions(&scan)) {
        assert!(found.abs_diff_eq(expected, 1e-4), "{found} {expected}");
    }
    assert_eq!(again.n_left_out, 1);
    let places: Vec<DVec3> = again.stations().iter().map(|station| station.position).collect();
    assert_eq!(places, [DVec3::new(100.0, 200.0, 300.0), DVec3::ZERO]);
    // And back: the poses are still there.
    let e57 = written(&again, &normals, None, "b.e57");
    let clouds = E57Reader::new(Cursor::new(&e57[..])).unwrap().pointclouds();
    let pose = clouds[0].transform.clone().unwrap();
    assert!((pose.rotation.z - std::f64::consts::FRAC_1_SQRT_2).abs() < 1e-9 && pose.translation.y == 200.0);
    let last = read_bytes(e57, "b.e57", &Silent).unwrap();
    assert!(clouds[1].has_row_column(), "{clouds:?}");
    let grids = String::from_utf8(written(&last, &normals, None, "b.ptx")).unwrap();
    assert!(grids.contains("\n2\n2\n0 0 0\n1 0 0\n"), "still a grid: {grids}");
    for (found, expected) in last.given_normals.as_deref().unwrap().iter().zip(&normals) {
        assert!(found.abs_diff_eq(*expected, 1e-5), "{found}");
    }
}

#[test]
fn what_a_table_of_points_cannot_hold_is_named() {
    let losses = scan(&two_scans()).losses(std::path::Path::new("a.ply")).unwrap();
    let words: Vec<String> = losses.iter().map(ToString::to_string).collect();
    for expected in [
        "1 image",
        "the coordinate system",
        "sensors",
        "names of scans (1) and places of scanners (2)",
    ] {
        assert!(
            words.iter().any(|loss| loss.contains(expected)),
            "{expected}: {words:?}"
        );
    }
}

/// A range of whole numbers and numbers in it; the crate writes no wider ones.
fn numbers() -> impl Strategy<Value = (i64, i64, Vec<i64>)> {
    (any::<i64>(), any::<i64>(), 1..=63_u32).prop_flat_map(|(one, two, shift)| {
        let (min, max) = ((one >> shift).min(two >> shift), (one >> shift).max(two >> shift));
        (Just(min), Just(max), proptest::collection::vec(min..=max, 40))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whole numbers of any number of bits are read as the crate wrote them, and a copy has the same.
    #[test]
    fn whole_numbers_of_any_size_come_back(columns in proptest::collection::vec(numbers(), 1..6), n_rows in 1..40_usize) {
        let mut bytes = Vec::new();
        let mut writer = E57Writer::new(Cursor::new(&mut bytes), "{file}").unwrap();
        writer.register_extension(Extension::new("demo", "http://example.org/demo")).unwrap();
        let mut prototype = place(SINGLE);
        for (index, (min, max, _)) in columns.iter().enumerate() {
            prototype.push(record(other("demo", &format!("c{index}")), whole(*min, *max)));
        }
        let mut scan = writer.add_pointcloud("{scan}", prototype).unwrap();
        for row in 0..n_rows {
            let mut values = vec![RecordValue::Single(row as f32); 3];
            values.extend(columns.iter().map(|(_, _, numbers)| RecordValue::Integer(numbers[row])));
            scan.add_point(values).unwrap();
        }
        scan.finalize().unwrap();
        writer.finalize().unwrap();
    drop(writer);
        let scan = read_bytes(bytes.clone(), "a.e57", &Silent).unwrap();
        for (index, (_, _, numbers)) in columns.iter().enumerate() {
            let found = scan.scalar(&format!("demo:c{index}"), &Silent).unwrap().unwrap();
            let expected: Vec<f64> = numbers[..n_rows].iter().map(|&number| number as f64).collect();
            prop_assert_eq!(found, expected);
        }
        let copy = written(&scan, &vec![Vec3::Y; n_rows], None, "b.e57");
        let (former, new) = (values(&bytes, 0).1, values(&copy, 0).1);
        prop_assert_eq!(former.len(), new.len());
        for (former, new) in former.iter().zip(&new) {
            prop_assert_eq!(&former[..], &new[..former.len()]);
        }
    }
}

#[test]
fn scans_of_many_packets_and_parts_come_back() {
    const N_ROWS: usize = 40_000;
    let mut bytes = Vec::new();
    let mut writer = E57Writer::new(Cursor::new(&mut bytes), "{file}").unwrap();
    let mut prototype = place(SINGLE);
    prototype.push(record(RecordName::Intensity, whole(0, 4095)));
    for name in ["{a}", "{b}"] {
        let mut scan = writer.add_pointcloud(name, prototype.clone()).unwrap();
        for row in 0..N_ROWS {
            let mut values = [row % 200, row / 200, 7]
                .map(|value| RecordValue::Single(value as f32))
                .to_vec();
            values.push(RecordValue::Integer((row % 4096) as i64));
            scan.add_point(values).unwrap();
        }
        scan.finalize().unwrap();
    }
    writer.finalize().unwrap();
    drop(writer);
    let scan = read_bytes(bytes.clone(), "a.e57", &Silent).unwrap();
    assert_eq!(scan.cloud.n_points(), 2 * N_ROWS);
    let normals: Vec<Vec3> = (0..2 * N_ROWS)
        .map(|point| if point % 3 == 0 { Vec3::X } else { -Vec3::Y })
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("b.e57");
    scan.write(&normals, &path, &WriteOptions::default(), &Silent).unwrap();
    let again = read(&path, &Silent).unwrap();
    assert_eq!(again.given_normals.as_deref().unwrap(), &normals);
    assert_eq!(
        again.scalar("intensity", &Silent).unwrap(),
        scan.scalar("intensity", &Silent).unwrap()
    );
    let copy = std::fs::read(&path).unwrap();
    let mut reader = E57Reader::new(Cursor::new(&copy[..])).unwrap();
    let cloud = reader.pointclouds().remove(1);
    let points: Result<Vec<e57::Point>, e57::Error> = reader.pointcloud_simple(&cloud).unwrap().collect();
    assert_eq!(points.unwrap().len(), N_ROWS);
    for index in 0..2 {
        let (former, new) = (values(&bytes, index).1, values(&copy, index).1);
        assert!(former.iter().zip(&new).all(|(former, new)| former[..] == new[..4]));
    }
}
