//! Tests of LAS and LAZ files that are damaged, or lie.

use normend_core::Silent;
use proptest::prelude::*;

use super::{Sample, convert, normals};
use crate::las::dimensions::push_unnamed;
use crate::las::head::{PACKED_BIT, at, parse};
use crate::value::Scalar;
use crate::{ReadError, WriteOptions, read_bytes};

fn reason(bytes: Vec<u8>) -> String {
    match read_bytes(bytes, "a.las", &Silent) {
        Err(ReadError::Broken { broken, .. }) => broken.to_string(),
        other => panic!("{:?}", other.map(|_| ())),
    }
}

#[test]
fn broken_files_are_refused_in_words() {
    let good = Sample::new(4, 7, 20).with_extra(&[("height", Scalar::Float)]).bytes();
    let with = |at: usize, new: &[u8]| {
        let mut bytes = good.clone();
        bytes[at..at + new.len()].copy_from_slice(new);
        bytes
    };
    let check = |bytes: Vec<u8>, expect: &str| assert_eq!(reason(bytes), expect);
    check(
        good[..20].to_vec(),
        "byte 20: the file ends inside its header: copy it again",
    );
    check(
        good[..300].to_vec(),
        "byte 300: the file ends inside its header: copy it again",
    );
    check(
        with(25, &[7]),
        "byte 24: this is LAS 1.7, and Normend reads 1.0 to 1.4: save it as 1.4",
    );
    check(
        with(94, &227_u16.to_le_bytes()),
        "byte 94: the header says that it has 227 bytes, but in LAS 1.4 it has 375: export the file again",
    );
    check(
        with(at::FORMAT, &[11]),
        "byte 104: there is no point format 11: export the file again",
    );
    check(
        with(at::STRIDE, &35_u16.to_le_bytes()),
        "byte 105: points of format 7 have at least 36 bytes, not 35: export the file again",
    );
    check(
        with(131, &0_f64.to_le_bytes()),
        "byte 131: the scale of x is 0 and its offset 500000, so it has no values: export the file again",
    );
    check(
        with(247, &[0; 8]),
        "byte 107: the file has no points: open one that has",
    );
    check(
        with(247, &u64::MAX.to_le_bytes()),
        &format!(
            "byte 247: {}",
            normend_core::PointCloudError::TooMany { n_points: usize::MAX }
        ),
    );
    let points_at = parse(&good).unwrap().points_at;
    check(
        with(247, &1_000_000_u64.to_le_bytes()),
        &format!(
            "byte {points_at}: the header promises 1000000 points of 40 bytes, but there is room for 20: the file is cut off, copy it again"
        ),
    );
    check(
        with(at::POINTS, &u32::MAX.to_le_bytes()),
        &format!(
            "byte 96: the points are said to begin at byte 4294967295, but the header ends at 375 and the file at {}: copy or export it again",
            good.len()
        ),
    );
    check(
        with(at::N_RECORDS, &u32::MAX.to_le_bytes()),
        &format!(
            "byte {}: variable length record 4 goes on where the points begin: copy or export the file again",
            points_at - 2
        ),
    );
    check(
        with(375 + 20, &u16::MAX.to_le_bytes()),
        "byte 375: variable length record 1 goes on where the points begin: copy or export the file again",
    );
    check(
        with(at::FORMAT, &[7 | PACKED_BIT]),
        "byte 104: the points are packed, but nothing says how: export the file again",
    );
    let evlr = |start: u64| {
        let mut place = start.to_le_bytes().to_vec();
        place.extend(u32::MAX.to_le_bytes());
        with(at::EXTENDED, &place)
    };
    check(
        evlr(400),
        "byte 227: what follows the points is said to begin at byte 400, which is not after them: copy or export the file again",
    );
    check(
        evlr(good.len() as u64),
        &format!(
            "byte {}: extended variable length record 1 goes on where the file ends: copy or export the file again",
            good.len()
        ),
    );
    let descriptions = parse(&good).unwrap().records[1].data;
    check(
        with(descriptions.start + 2, &[10]),
        "the points have 4 extra bytes, but more are described: export the file again",
    );
    check(
        with(descriptions.start + 2, &[31]),
        "extra byte 1 has type 31, which there is not: export the file again",
    );
}

#[test]
fn bombs_are_refused_before_they_go_off() {
    for format in [1, 7] {
        let packed = convert(&Sample::new(4, format, 1000).bytes(), "a.las", "a.laz");
        let head = parse(&packed).unwrap();
        let with = |at: usize, new: &[u8]| {
            let mut bytes = packed.clone();
            bytes[at..at + new.len()].copy_from_slice(new);
            bytes
        };
        let count = |n_points: u64| {
            let mut bytes = with(247, &n_points.to_le_bytes());
            bytes[107..111].copy_from_slice(&[0; 4]);
            bytes
        };
        assert!(
            reason(count(3_000_000_000)).contains("the header is wrong"),
            "{}",
            reason(count(3_000_000_000))
        );
        assert!(reason(count(1001)).contains("damaged") || reason(count(1001)).contains("contradicts"));
        let table = head.points_at;
        assert!(reason(with(table, &i64::MAX.to_le_bytes())).contains("beyond the file"));
        let table_at = u64::from_le_bytes(packed[table..table + 8].try_into().unwrap()) as usize;
        assert!(reason(with(table_at + 4, &u32::MAX.to_le_bytes())).contains("more than there is room for"));
        assert!(reason(with(table_at + 4, &0_u32.to_le_bytes())).contains("1000 less"));
        // The packing of other points.
        let record = head
            .records
            .iter()
            .find(|record| record.record_id == 22204)
            .unwrap()
            .data
            .start;
        assert!(reason(with(record + 34 + 2, &u16::MAX.to_le_bytes())).contains("does not fit point format"));
        assert!(reason(with(record + 32, &u16::MAX.to_le_bytes())).contains("cannot be read"));
        // Layers of a chunk that are larger than it.
        if format == 7 {
            let layers = head.points_at + 8 + head.stride + 4;
            assert!(reason(with(layers, &u32::MAX.to_le_bytes())).contains("contradicts itself"));
        }
    }
    // Points that are all the same: a real bomb. Its table of chunks is right, and it unpacks to a thousand times its size.
    let n_points = 2_000_000;
    let mut header = Sample::new(4, 6, 1).bytes();
    let head = parse(&header).unwrap();
    let row = header.split_off(head.points_at);
    header[247..255].copy_from_slice(&(n_points as u64).to_le_bytes());
    let plain: Vec<u8> = header
        .iter()
        .copied()
        .chain(row.iter().copied().cycle().take(n_points * 30))
        .collect();
    let bomb = convert(&plain, "a.las", "a.laz");
    let times = plain.len() / bomb.len();
    assert!(times > 1000, "{times}");
    assert!(reason(bomb).contains("the header is wrong"));
}

#[test]
fn too_many_descriptions_are_refused_at_writing() {
    let mut descriptions = Vec::new();
    push_unnamed(300, &mut descriptions);
    assert_eq!(descriptions.len(), 2 * 192, "255 and 45 bytes");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    /// Whatever is damaged, reading ends with points or with words.
    #[test]
    fn damage_is_no_danger(format in prop::sample::select(vec![0_u8, 1, 3, 5, 6, 7, 8, 10]), is_packed: bool,
                           damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
                           cut: Option<prop::sample::Index>) {
        let mut sample = Sample::new(4, format, 200).with_extra(&[("height", Scalar::Float)]);
        sample.has_rest = true;
        let mut bytes = sample.bytes();
        if is_packed {
            bytes = convert(&bytes, "a.las", "a.laz");
        }
        for (index, new) in damage {
            let at = index.index(bytes.len());
            bytes[at] = new;
        }
        if let Some(cut) = cut {
            let length = cut.index(bytes.len());
            bytes.truncate(length);
        }
        if let Ok(scan) = read_bytes(bytes, "a.laz", &Silent) {
            let normals = normals(scan.cloud.n_points());
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("b.laz");
            if scan.write(&normals, &path, &WriteOptions::default(), &Silent).is_ok() {
                let again = crate::read(&path, &Silent).unwrap();
                prop_assert_eq!(again.given_normals.as_deref(), Some(&normals));
            }
        }
    }
}
