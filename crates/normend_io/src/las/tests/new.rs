//! Tests of LAS and LAZ files that are made from other formats.

use std::path::Path;

use glam::DVec3;
use normend_core::Silent;
use proptest::prelude::*;

use super::{Sample, export, normals, points, scan};
use crate::las::head::parse;

#[test]
fn a_new_file_holds_what_the_source_does() {
    let text = "x,y,z,intensity,red,green,blue,gps_time,classification,id,roughness\n\
                500000.123,4500000.456,12.5,1000,255,0,128,300000000.25,2,-5,0.1\n\
                500001.001,4500000.457,12.625,0,1,2,3,300000001.5,31,70000,0.25\n";
    for name in ["a.las", "a.laz"] {
        let csv = scan(text.as_bytes(), "a.csv");
        let losses = csv.losses(Path::new(name)).unwrap();
        assert_eq!(losses, []);
        let normals = normals(2);
        let after = export(&csv, &normals, Some(&[255, 0]), name);
        let again = scan(&after, name);
        let values = |name: &str| again.scalar(name, &Silent).unwrap().unwrap();
        assert_eq!(values("x"), [500_000.123, 500_001.001]);
        assert_eq!(values("y"), [4_500_000.456, 4_500_000.457]);
        assert_eq!(values("z"), [12.5, 12.625]);
        assert_eq!(values("intensity"), [1000.0, 0.0]);
        assert_eq!(values("red"), [65535.0, 257.0]);
        assert_eq!(values("gps_time"), [300_000_000.25, 300_000_001.5]);
        assert_eq!(values("classification"), [2.0, 31.0]);
        assert_eq!(values("id"), [-5.0, 70_000.0]);
        assert_eq!(values("roughness")[1], 0.25);
        assert_eq!(values("oriented"), [1.0, 0.0]);
        assert_eq!(values("return_number"), [1.0, 1.0]);
        assert_eq!(again.given_normals.as_deref(), Some(&normals));
        let head = parse(&after).unwrap();
        assert_eq!(head.format, 7);
        assert_eq!(
            head.header.global_encoding, 17,
            "WKT, and times that are no seconds of a week"
        );
        assert_eq!((head.header.min_x, head.header.max_y), (500_000.123, 4_500_000.457));
        if name == "a.las" {
            let known = points(&after);
            assert!((known[1].x - 500_001.001).abs() < 1e-9);
            assert_eq!(known[0].color.unwrap().blue, 128 * 257);
        }
    }
}

#[test]
fn what_cannot_survive_is_named() {
    // Binary fractions over a wide range, of which 32 bits do not hold all.
    let mut ply = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
                    property float intensity\nend_header\n"
        .to_vec();
    let places = [
        DVec3::new(1.0 / 3.0, 1e6, 0.5),
        DVec3::new(1e6 / 7.0, -2e6, 0.25),
        DVec3::ONE,
    ];
    for (index, place) in places.iter().enumerate() {
        place
            .to_array()
            .iter()
            .for_each(|value| ply.extend(value.to_le_bytes()));
        ply.extend((index as f32 / 4.0).to_le_bytes());
    }
    let read = scan(&ply, "a.ply");
    let losses = read.losses(Path::new("b.las")).unwrap();
    assert_eq!(losses.len(), 1);
    assert_eq!(losses[0].what, "what coordinates have beyond steps of 1e-4");
    let again = scan(&export(&read, &normals(3), None, "b.las"), "b.las");
    let values = |name: &str| again.scalar(name, &Silent).unwrap().unwrap();
    for (value, place) in values("x").into_iter().zip(&places) {
        assert!((value - place.x).abs() <= 0.5001e-4);
    }
    assert_eq!(values("y"), [1e6, -2e6, 1.0], "an axis of few decimals survives");
    assert_eq!(values("intensity"), [0.0, 16384.0, 32768.0], "a share fills 16 bits");
    assert_eq!(values("intensity_2"), [0.0, 0.25, 0.5], "and is kept as it was");
}

#[test]
fn extents_of_any_size_are_written() {
    for scale in [1e-12, 1e-6, 1.0, 1e6, 1e12] {
        let text: String = (0..20)
            .map(|row| format!("{:e} {:e} {:e}\n", scale * f64::from(row), scale * 0.1, 0.0))
            .collect();
        let read = scan(text.as_bytes(), "a.xyz");
        let again = scan(&export(&read, &normals(20), None, "b.laz"), "b.laz");
        for (row, value) in again.scalar("x", &Silent).unwrap().unwrap().into_iter().enumerate() {
            assert!((value / scale - row as f64).abs() < 1e-7, "{value} of {scale}");
        }
    }
}

#[test]
fn rows_without_a_place_are_left_out() {
    let read = scan(b"0 0 1\nnan 1 2\n3 4 5\n", "a.xyz");
    let losses = read.losses(Path::new("b.las")).unwrap();
    assert!(losses.iter().any(|loss| loss.what.contains("1 row")), "{losses:?}");
    let again = scan(&export(&read, &normals(2), None, "b.las"), "b.las");
    assert_eq!(again.scalar("y", &Silent).unwrap().unwrap(), [0.0, 4.0]);
    assert_eq!(again.given_normals.as_deref(), Some(&normals(2)));
}

#[test]
fn what_other_formats_do_not_hold_is_named() {
    let mut sample = Sample::new(4, 6, 10);
    (sample.n_unnamed, sample.has_rest) = (3, true);
    let read = scan(&sample.bytes(), "a.las");
    let losses = read.losses(Path::new("b.ply")).unwrap();
    let whats: Vec<&str> = losses.iter().map(|loss| loss.what.as_str()).collect();
    let expect = [
        "the header's date, identifiers and encoding",
        "the record 34735 of \"LASF_Projection\"",
        "the record 7 of \"somebody\"",
        "the record 65535 of \"LASF_Spec\"",
        "the record 65534 of \"LASF_Spec\"",
        "3 bytes of each point that have no name",
    ];
    assert_eq!(whats, expect);
    let ply = scan(&export(&read, &normals(10), None, "b.ply"), "b.ply");
    for name in read.scalar_columns() {
        assert_eq!(
            ply.scalar(&name, &Silent).unwrap(),
            read.scalar(&name, &Silent).unwrap(),
            "{name}"
        );
    }
}

proptest! {
    /// Whatever decimals coordinates have, they come back bit by bit.
    #[test]
    fn decimals_survive(places in prop::collection::vec((-1_000_000_000_i64..1_000_000_000, 0_i32..=4), 1..50),
                        offset in prop::sample::select(vec![0.0, 500_000.0, 4_500_000.0])) {
        let mut values = Vec::new();
        let mut text = String::new();
        for (place, decimals) in places {
            let value = offset + (place % 100_000) as f64;
            let line = format!("{value}.{:0width$} 1 2\n", 7 % 10_i32.pow(decimals as u32), width = decimals as usize);
            let line = if decimals == 0 { format!("{value} 1 2\n") } else { line };
            values.push(line.split(' ').next().unwrap().parse::<f64>().unwrap());
            text += &line;
        }
        let read = scan(text.as_bytes(), "a.xyz");
        prop_assert_eq!(read.losses(Path::new("b.laz")).unwrap(), []);
        let again = scan(&export(&read, &normals(values.len()), None, "b.laz"), "b.laz");
        prop_assert_eq!(again.scalar("x", &Silent).unwrap().unwrap(), values);
    }
}
