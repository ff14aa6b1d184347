//! From every format to every other and back: what the formats hold comes through, and what they do not is named.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::fs;
use std::path::Path;

use normend_core::Silent;
use normend_io::{FileFormat, Scan, WriteOptions, read, read_bytes};
use proptest::prelude::*;

/// Millimeters from a corner, a color, and a number of each of three types.
type Row = ([i32; 3], [u8; 3], i16, f32, f64);

/// A PLY with normals, colors, and numbers of every type; georeferenced, with millimetres.
fn ply(rows: &[Row]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\n\
         property uchar blue\nproperty short level\nproperty float quality\nproperty double time\nend_header\n",
        rows.len()
    )
    .into_bytes();
    for ([x, y, z], color, level, quality, time) in rows {
        for (value, offset) in [(x, 500_000.0), (y, 4_500_000.0), (z, 100.0)] {
            bytes.extend((offset + f64::from(*value) / 1000.0).to_le_bytes());
        }
        for component in [0.6_f32, 0.0, -0.8] {
            bytes.extend(component.to_le_bytes());
        }
        bytes.extend(color);
        bytes.extend(level.to_le_bytes());
        bytes.extend(quality.to_le_bytes());
        bytes.extend(time.to_le_bytes());
    }
    bytes
}

fn rows() -> impl Strategy<Value = Vec<Row>> {
    let row = (
        prop::array::uniform3(-2_000_000..2_000_000),
        any::<[u8; 3]>(),
        any::<i16>(),
        -1.0e6_f32..1.0e6,
        -1.0e12_f64..1.0e12,
    );
    // The second point keeps the extent from being nothing.
    prop::collection::vec(row, 2..40)
}

/// The first column of this name, in any case of letters.
fn column(scan: &Scan, name: &str) -> Option<Vec<f64>> {
    let columns = scan.scalar_columns();
    let own = columns.iter().find(|column| column.eq_ignore_ascii_case(name))?;
    scan.scalar(own, &Silent).unwrap()
}

fn convert(scan: &Scan, path: &Path) -> Scan {
    scan.convert(path, &WriteOptions::default(), &Silent).unwrap();
    read(path, &Silent).unwrap()
}

/// All extensions of one file name each, that a PLY is converted to.
fn others() -> impl Iterator<Item = &'static str> {
    let others = FileFormat::ALL.into_iter().filter(|format| *format != FileFormat::Ply);
    others.flat_map(|format| format.extensions().iter().copied())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn what_a_format_holds_comes_back(rows in rows()) {
        let scan = read_bytes(ply(&rows), "scan.ply", &Silent).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let numbers = ["level", "quality", "time"];
        for extension in others() {
            let losses = scan.losses(&folder.path().join("other").with_extension(extension)).unwrap();
            let is_lost = |name: &str| losses.iter().any(|loss| loss.what.contains(name));
            let other = convert(&scan, &folder.path().join("other").with_extension(extension));
            let back = convert(&other, &folder.path().join(format!("back_from_{extension}.ply")));
            for (step, again) in [("there", &other), ("back", &back)] {
                prop_assert_eq!(again.cloud.n_points(), rows.len(), "{} {}", extension, step);
                if !is_lost("coordinates") {
                    let own = scan.cloud.positions().iter().map(|position| scan.cloud.origin() + position.as_dvec3());
                    let theirs = again.cloud.positions().iter().map(|position| again.cloud.origin() + position.as_dvec3());
                    for (own, theirs) in own.zip(theirs) {
                        // A millimetre is far above what `f32` rounds around the middle of 4 km.
                        prop_assert!((own - theirs).length() < 5e-4, "{} {}: {} {}", extension, step, own, theirs);
                    }
                }
                if !is_lost("normal") {
                    let normals = again.given_normals.as_ref().expect("normals are named as lost, or there");
                    let error = normals.iter().map(|normal| (*normal - scan.given_normals.as_ref().unwrap()[0]).length());
                    prop_assert!(error.fold(0.0, f32::max) < 1e-5, "{} {}", extension, step);
                }
                if !is_lost("red") {
                    let colors = scan.colors(&Silent).unwrap();
                    prop_assert_eq!(again.colors(&Silent).unwrap(), colors, "{} {}", extension, step);
                }
                for name in numbers.iter().filter(|name| !is_lost(name)) {
                    // A float is written as the shortest decimal that is the same float.
                    let of = |scan: &Scan| -> Option<Vec<f64>> {
                        let narrow = |value: f64| if *name == "quality" { f64::from(value as f32) } else { value };
                        Some(column(scan, name)?.into_iter().map(narrow).collect())
                    };
                    prop_assert_eq!(of(again), of(&scan), "{} {} {}", extension, step, name);
                }
            }
        }
    }
}

#[test]
fn what_is_lost_is_named() {
    let content = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
                   property list uchar int near\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
                   1 2 3 1 7\n4 5 6 0\n3 0 1 0\n";
    let scan = read_bytes(content.into(), "scan.ply", &Silent).unwrap();
    let named = |name: &str| -> Vec<String> {
        let losses = scan.losses(Path::new(name)).unwrap();
        losses.into_iter().map(|loss| loss.what).collect()
    };
    assert!(named("same.ply").is_empty());
    let expect = ["1 row of element \"face\"", "the list \"near\" of each point"];
    for extension in others() {
        let found = named(&format!("other.{extension}"));
        assert_eq!(found[..2], expect, "{extension}");
    }
    let folder = tempfile::tempdir().unwrap();
    let error = scan.convert(&folder.path().join("b.ply"), &WriteOptions::default(), &Silent);
    assert!(error.unwrap_err().to_string().contains("copy the file"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
