//! E57 files that are broken, or made to break what reads them.

use std::io::Cursor;

use e57::{E57Writer, Extension, RecordValue};
use glam::Vec3;
use normend_core::Silent;

use super::pages::{PAGE, PAYLOAD};
use super::tests::{SINGLE, other, place, record, scan, two_scans, whole, written};
use crate::read_bytes;

fn error(bytes: &[u8]) -> String {
    read_bytes(bytes.to_vec(), "scan.e57", &Silent).unwrap_err().to_string()
}

/// Writes the checksums anew, for files that are wrong in another way.
fn seal(bytes: &mut [u8]) {
    for page in bytes.chunks_exact_mut(PAGE) {
        let checksum = crc32c::crc32c(&page[..PAYLOAD]).to_be_bytes();
        page[PAYLOAD..].copy_from_slice(&checksum);
    }
}

/// A file of one scan of a few points whose XML is changed before it is written.
fn with_xml(change: impl Fn(String) -> String) -> Vec<u8> {
    with_rows(4, change)
}

fn with_rows(n_rows: usize, change: impl Fn(String) -> String) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = E57Writer::new(Cursor::new(&mut bytes), "{file}").unwrap();
    let mut scan = writer.add_pointcloud("{scan}", place(SINGLE)).unwrap();
    for row in 0..n_rows {
        scan.add_point(vec![RecordValue::Single(row as f32); 3]).unwrap();
    }
    scan.finalize().unwrap();
    writer.finalize_customized_xml(|xml| Ok(change(xml))).unwrap();
    drop(writer);
    bytes
}

fn check_error(bytes: &[u8], expect: &str) {
    let error = error(bytes);
    assert!(error.contains(expect), "{error}\nbut expected: {expect}");
}

#[test]
fn broken_files_are_refused_with_the_place() {
    let good = two_scans();
    check_error(&good[..40], "ends within the header");
    check_error(&good[..1024], "it is cut off");
    let mut damaged = good.clone();
    damaged[1500] ^= 1;
    check_error(&damaged, "byte 1024: the checksum of page 2 is wrong");
    let mut version = good.clone();
    version[8] = 2;
    check_error(&version, "byte 8: E57 of version 2");
    let mut page = good.clone();
    page[41] = 8;
    check_error(&page, "byte 40: pages of 2048 bytes");
    let mut xml = good.clone();
    xml[32..40].copy_from_slice(&u64::MAX.to_le_bytes());
    check_error(&xml, "the XML section");
    let mut section = good.clone();
    section[48] = 7;
    seal(&mut section);
    check_error(&section, "byte 48: points should begin here, but something else does");
    let mut packet = good;
    packet[80] = 9;
    seal(&mut packet);
    check_error(&packet, "byte 80: a packet of kind 9");
}

#[test]
fn bombs_are_refused_before_they_grow() {
    check_error(
        &with_xml(|xml| xml.replace("recordCount=\"4\"", "recordCount=\"1000000000\"")),
        "1000000000 points of 96 bits each do not fit",
    );
    check_error(
        &with_xml(|xml| xml.replace("recordCount=\"4\"", "recordCount=\"5000000000\"")),
        "Normend can number",
    );
    // Points of no bits at all, which would fit any number of times.
    let no_bits = |xml: String| {
        let constant = "type=\"Integer\" minimum=\"5\" maximum=\"5\"";
        xml.replace("type=\"Float\" precision=\"single\"", constant)
            .replace("recordCount=\"4\"", "recordCount=\"1000000000\"")
    };
    check_error(&with_xml(no_bits), "nothing is stored of them");
    // Many constant values beside one bit.
    let wide = |xml: String| {
        let constants: String = (0..890)
            .map(|index| format!("<c{index} type=\"Integer\" minimum=\"-9000000000\" maximum=\"-9000000000\"/>"))
            .collect();
        xml.replace("</prototype>", &format!("{constants}</prototype>"))
    };
    check_error(&with_xml(wide), "that does not hold the 893 values");
    // Values that take nothing in the file and eight bytes each out of it.
    let mut bytes = Vec::new();
    let mut writer = E57Writer::new(Cursor::new(&mut bytes), "{file}").unwrap();
    writer
        .register_extension(Extension::new("demo", "http://example.org/demo"))
        .unwrap();
    let mut prototype = place(SINGLE);
    let constant = |index: usize| record(other("demo", &format!("c{index}")), whole(-1 << 40, -1 << 40));
    prototype.extend((0..200).map(constant));
    let mut scan_writer = writer.add_pointcloud("{scan}", prototype).unwrap();
    for row in 0..20_000 {
        let mut values = vec![RecordValue::Single(row as f32); 3];
        values.extend(vec![RecordValue::Integer(-1 << 40); 200]);
        scan_writer.add_point(values).unwrap();
    }
    scan_writer.finalize().unwrap();
    writer.finalize().unwrap();
    drop(writer);
    check_error(&bytes, "more than 16 times as many");
    // The same section many times.
    let repeated = |xml: String| {
        let start = xml.find("<vectorChild").unwrap();
        let end = xml.rfind("</data3D>").unwrap();
        let scan = xml[start..end].to_owned();
        format!("{}{}{}", &xml[..end], scan.repeat(200), &xml[end..])
    };
    check_error(
        &with_rows(5000, repeated),
        "5000 points of 96 bits each do not fit into the",
    );
    check_error(
        &with_xml(|xml| xml.replace("</e57Root>", &format!("{}</e57Root>", "<a/>".repeat(700_000)))),
        "larger than Normend reads",
    );
    let deep = format!("{}{}</e57Root>", "<a>".repeat(50_000), "</a>".repeat(50_000));
    assert_eq!(
        scan(&with_xml(|xml| xml.replace("</e57Root>", &deep))).cloud.n_points(),
        4
    );
    check_error(
        &with_xml(|xml| xml.replace("<e57Root", "<!DOCTYPE a [<!ENTITY b \"bb\">]><e57Root")),
        "XML",
    );
    check_error(
        &with_xml(|xml| xml.replace("cartesianX", "somethingElse")),
        "has no coordinates",
    );
}

#[test]
fn damage_anywhere_is_no_panic() {
    let good = two_scans();
    // A simple sequence that is the same in each run.
    let mut state = 12345_u64;
    let mut next = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 33) as usize
    };
    let mut n_read = 0;
    for _ in 0..2000 {
        let mut bytes = good.clone();
        for _ in 0..=next() % 4 {
            let at = next() % bytes.len();
            bytes[at] = match next() % 3 {
                0 => next() as u8,
                1 => bytes[at] ^ (1 << (next() % 8)),
                _ => [0, 1, 0x7f, 0xff][next() % 4],
            };
        }
        seal(&mut bytes);
        if let Ok(scan) = read_bytes(bytes, "a.e57", &Silent) {
            n_read += 1;
            let normals = vec![Vec3::X; scan.cloud.n_points()];
            let copy = written(&scan, &normals, None, "a.e57");
            let again = read_bytes(copy, "a.e57", &Silent).map(|scan| scan.cloud.n_points());
            // A comment or a name may be damaged so that the crate takes the copy for something else; points stay.
            assert!(again.is_err() || again.is_ok_and(|n_points| n_points == scan.cloud.n_points()));
        }
    }
    assert!(n_read > 100, "most of the bytes are values: {n_read}");
}
