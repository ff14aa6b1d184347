//! Tests of what is written besides normals: how sure they are.

use std::fs;

use glam::Vec3;
use normend_core::Silent;

use crate::{WriteError, WriteOptions, read_bytes};

/// Writes `file` with +z normals and confidence 255, 128, 127 by point, and gives what came out without the comment.
fn written(file: &[u8], name: &str) -> Result<Vec<u8>, WriteError> {
    let scan = read_bytes(file.to_vec(), name, &Silent).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let n_points = scan.cloud.n_points();
    let normals = vec![Vec3::Z; n_points];
    let confidence = &[255, 128, 127][..n_points];
    scan.write_with_confidence(&normals, Some(confidence), &path, &WriteOptions::default(), &Silent)?;
    let bytes = fs::read(&path).unwrap();
    // A second time changes nothing: what is there is written in place.
    let again = read_bytes(bytes.clone(), name, &Silent).unwrap();
    again
        .write_with_confidence(&normals, Some(confidence), &path, &WriteOptions::default(), &Silent)
        .unwrap();
    assert_eq!(fs::read(&path).unwrap(), bytes);
    let is_comment = |line: &&[u8]| line.starts_with(b"comment Normend");
    let lines = bytes
        .split_inclusive(|&byte| byte == b'\n')
        .filter(|line| !is_comment(line));
    Ok(lines.flatten().copied().collect())
}

fn check(file: &str, name: &str, expect: &str) {
    let found = String::from_utf8(written(file.as_bytes(), name).unwrap()).unwrap();
    assert_eq!(found, expect);
}

#[test]
fn confidence_stands_after_the_normal() {
    check(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty int id\n\
         end_header\n0 0 1 7\n1 0 1 8\n0 1 1 9\n",
        "a.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n\
         property float ny\nproperty float nz\nproperty float confidence\nproperty uchar oriented\nproperty int id\n\
         end_header\n0 0 1 0 0 1 1 1 7\n1 0 1 0 0 1 0.5019608 0 8\n0 1 1 0 0 1 0.49803922 0 9\n",
    );
    check(
        "x,y,z,id\n0,0,1,7\n1,0,1,8\n",
        "a.csv",
        "x,y,z,nx,ny,nz,confidence,oriented,id\n0,0,1,0,0,1,1,1,7\n1,0,1,0,0,1,0.5019608,0,8\n",
    );
}

#[test]
fn confidence_takes_the_place_of_what_is_there() {
    check(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float confidence\nproperty float nx\nproperty float ny\n\
         property float nz\nproperty int id\nproperty float x\nproperty float y\nproperty float z\nend_header\n\
         0.25 0 0 1 7 0 0 1\n0.5 0 0 1 8 1 0 1\n0.75 0 0 -1 9 0 1 nan\n",
        "a.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float confidence\nproperty float nx\nproperty float ny\n\
         property float nz\nproperty uchar oriented\nproperty int id\nproperty float x\nproperty float y\nproperty float z\n\
         end_header\n1 0 0 1 1 7 0 0 1\n0.5019608 0 0 1 0 8 1 0 1\n0.75 0 0 -1 0 9 0 1 nan\n",
    );
}

#[test]
fn binary_flags_keep_their_type() {
    for (order, is_big) in [("little", false), ("big", true)] {
        let header = format!(
            "ply\nformat binary_{order}_endian 1.0\nelement vertex 1\nproperty short oriented\nproperty float x\n\
             property float y\nproperty float z\nend_header\n"
        );
        let float = |value: f32| {
            if is_big {
                value.to_be_bytes()
            } else {
                value.to_le_bytes()
            }
        };
        let row = [0.5, 1.0, 2.0].map(float).concat();
        let file = [header.as_bytes(), &[9, 9], &row].concat();
        let found = written(&file, "a.ply").unwrap();
        let flag = if is_big { [0, 1] } else { [1, 0] };
        let added = [0.0, 0.0, 1.0, 1.0].map(float).concat();
        let expect = [&flag[..], &row, &added].concat();
        assert_eq!(&found[found.len() - expect.len()..], &expect[..]);
        let words = "property float nz\nproperty float confidence\nend_header\n";
        assert!(String::from_utf8_lossy(&found).contains(words));
    }
}

#[test]
fn what_cannot_hold_confidence_is_refused() {
    let refused = |file: &str, name: &str| {
        let error = written(file.as_bytes(), name).unwrap_err();
        assert!(matches!(error, WriteError::NoConfidence { .. }), "{error}");
    };
    refused("0 0 1\n1 0 1\n", "a.xyz");
    refused(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
         property list uchar int oriented\nend_header\n0 0 1 1 5\n",
        "a.ply",
    );
}
