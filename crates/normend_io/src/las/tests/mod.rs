//! Tests of LAS and LAZ files, which are made byte by byte, and read by the `las` and `laz` crates' own readers.

mod broken;
mod new;

use std::fs;
use std::io::Cursor;
use std::path::Path;

use glam::Vec3;
use normend_core::Silent;

use super::dimensions::push_description;
use super::head::{PACKED_BIT, at, new_record, standard_size};
use crate::value::Scalar;
use crate::{FileFormat, Scan, WriteOptions, read_bytes};

/// SplitMix64 (Steele et al. 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn unit(&mut self) -> Vec3 {
        let mut component = || (self.next() % 2001) as f32 / 1000.0 - 1.0;
        Vec3::new(component(), component(), component()).normalize_or(Vec3::Y)
    }
}

/// What a file is made of.
#[derive(Clone)]
struct Sample {
    minor: u8,
    format: u8,
    n_points: usize,
    /// Named extra bytes.
    extra: Vec<(&'static str, Scalar)>,
    /// Extra bytes that nothing is said of.
    n_unnamed: usize,
    /// Whether something stands after the points.
    has_rest: bool,
    seed: u64,
}

impl Sample {
    fn new(minor: u8, format: u8, n_points: usize) -> Self {
        Self {
            minor,
            format,
            n_points,
            extra: Vec::new(),
            n_unnamed: 0,
            has_rest: false,
            seed: 1,
        }
    }

    fn with_extra(mut self, extra: &[(&'static str, Scalar)]) -> Self {
        self.extra = extra.to_vec();
        self
    }

    fn stride(&self) -> usize {
        let named: usize = self.extra.iter().map(|(_, scalar)| scalar.size()).sum();
        standard_size(self.format).unwrap() + named + self.n_unnamed
    }

    /// A small coordinate system, an odd record, the descriptions, two bytes between, points of random bytes in a small box.
    fn bytes(&self) -> Vec<u8> {
        let mut random = Random(self.seed);
        let mut records = vec![
            new_record("LASF_Projection", 34735, "GeoTIFF", &[1, 0, 1, 0, 0, 0, 0, 0]),
            new_record("somebody", 7, "", b"odd content\0\xff"),
        ];
        if !self.extra.is_empty() {
            let mut descriptions = Vec::new();
            for (name, scalar) in &self.extra {
                push_description(name, *scalar, "", &mut descriptions);
            }
            records.insert(1, new_record("LASF_Spec", 4, "extra", &descriptions));
        }
        let header_size = [227, 227, 227, 235, 375][usize::from(self.minor)];
        let n_bytes: usize = records.iter().map(Vec::len).sum();
        let points_at = header_size + n_bytes + 2;
        let rest_at = points_at + self.n_points * self.stride();
        let mut header = las::raw::Header {
            version: las::Version::new(1, self.minor),
            generating_software: *b"a program with thirty-two letter",
            header_size: header_size as u16,
            offset_to_point_data: points_at as u32,
            number_of_variable_length_records: records.len() as u32,
            point_data_record_format: self.format,
            point_data_record_length: self.stride() as u16,
            x_scale_factor: 0.001,
            y_scale_factor: 0.001,
            z_scale_factor: 0.01,
            x_offset: 500_000.0,
            y_offset: 4_500_000.0,
            z_offset: 0.0,
            max_x: 17.0,
            ..Default::default()
        };
        if self.minor < 4 || self.format < 6 {
            header.number_of_point_records = self.n_points as u32;
        }
        if self.minor == 4 {
            header.large_file = Some(las::raw::header::LargeFile {
                number_of_point_records: self.n_points as u64,
                number_of_points_by_return: [3; 15],
            });
        }
        if self.has_rest && self.minor >= 3 {
            header.start_of_waveform_data_packet_record = Some(rest_at as u64);
        }
        if self.has_rest && self.minor == 4 {
            header.evlr = Some(las::raw::header::Evlr {
                start_of_first_evlr: rest_at as u64,
                number_of_evlrs: 2,
            });
        }
        let mut bytes = Vec::new();
        header.write_to(&mut bytes).unwrap();
        records.iter().for_each(|record| bytes.extend(record));
        bytes.extend([0xcc, 0xdd]);
        assert_eq!(bytes.len(), points_at);
        for row in 0..self.n_points {
            let start = bytes.len();
            for axis in 0..3 {
                // A wavy surface, so that points differ and their numbers do not grow.
                let place = [row % 100, row / 100, (row % 100) * (row / 100) % 37][axis];
                bytes.extend((place as i32 * 1000 - 20_000 + (random.next() % 100) as i32).to_le_bytes());
            }
            while bytes.len() < start + self.stride() {
                bytes.push(random.next() as u8);
            }
            // Times that are numbers, because others are not equal to themselves.
            if !matches!(self.format, 0 | 2) {
                let time_at = start + if self.format < 6 { 20 } else { 22 };
                bytes[time_at..time_at + 8].copy_from_slice(&(1e5 + row as f64 / 1e4).to_le_bytes());
            }
        }
        if self.has_rest {
            for (number, length) in [5_u64, 40].into_iter().enumerate() {
                let mut record = new_record("LASF_Spec", 65535 - number as u16, "", &[]);
                record.splice(20..22, length.to_le_bytes());
                record.extend((0..length).map(|byte| byte as u8));
                bytes.extend(record);
            }
        }
        bytes
    }
}

fn scan(bytes: &[u8], name: &str) -> Scan {
    read_bytes(bytes.to_vec(), name, &Silent).unwrap()
}

/// Writes a scan as a file of this name, with normals.
fn export(scan: &Scan, normals: &[Vec3], confidence: Option<&[u8]>, name: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let options = WriteOptions::default();
    scan.write_with_confidence(normals, confidence, &path, &options, &Silent)
        .unwrap();
    fs::read(&path).unwrap()
}

fn convert(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(from), bytes).unwrap();
    let scan = crate::read(&folder.path().join(from), &Silent).unwrap();
    scan.convert(&folder.path().join(to), &WriteOptions::default(), &Silent)
        .unwrap();
    fs::read(folder.path().join(to)).unwrap()
}

fn normals(n_points: usize) -> Vec<Vec3> {
    let mut random = Random(99);
    (0..n_points).map(|_| random.unit()).collect()
}

/// All points of a plain file as the `las` crate reads them.
fn points(bytes: &[u8]) -> Vec<las::Point> {
    let mut reader = las::Reader::new(Cursor::new(bytes.to_vec())).unwrap();
    let points = reader.read_all().unwrap();
    let points: las::Result<Vec<las::Point>> = points.points().collect();
    points.unwrap()
}

/// Rows of a packed file as the decoder of `laz` unpacks them, one after the other.
fn rows(bytes: &[u8]) -> Vec<u8> {
    let head = super::head::parse(bytes).unwrap();
    let record = head.records.iter().find(|record| record.record_id == 22204).unwrap();
    let vlr = laz::LazVlr::from_buffer(record.data.of(bytes)).unwrap();
    let mut source = Cursor::new(bytes);
    source.set_position(head.points_at as u64);
    let mut rows = vec![0; head.n_points * head.stride];
    let mut decoder = laz::LasZipDecompressor::new(source, vlr).unwrap();
    decoder.decompress_many(&mut rows).unwrap();
    rows
}

/// All versions and the point formats that each has.
fn kinds() -> impl Iterator<Item = (u8, u8)> {
    [1_u8, 1, 3, 5, 10]
        .into_iter()
        .enumerate()
        .flat_map(|(minor, last)| (0..=last).map(move |format| (minor as u8, format)))
}

#[test]
fn all_versions_and_formats_are_read_as_another_reader_does() {
    for (minor, format) in kinds() {
        let sample = Sample::new(minor, format, 300).with_extra(&[("height", Scalar::Double)]);
        let bytes = sample.bytes();
        let scan = scan(&bytes, "a.las");
        assert_eq!((scan.cloud.n_points(), scan.format()), (300, FileFormat::Las));
        let values = |name: &str| scan.scalar(name, &Silent).unwrap();
        let known = points(&bytes);
        let check = |name: &str, of: &dyn Fn(&las::Point) -> f64| {
            let expect: Vec<f64> = known.iter().map(of).collect();
            assert_eq!(values(name), Some(expect), "{name} of format {format} in 1.{minor}");
        };
        check("intensity", &|point| point.intensity.into());
        check("return_number", &|point| point.return_number.into());
        check("number_of_returns", &|point| point.number_of_returns.into());
        check("edge_of_flight_line", &|point| point.is_edge_of_flight_line.into());
        check("synthetic", &|point| point.is_synthetic.into());
        check("key_point", &|point| point.is_key_point.into());
        check("withheld", &|point| point.is_withheld.into());
        check("user_data", &|point| point.user_data.into());
        check("point_source_id", &|point| point.point_source_id.into());
        if format >= 6 {
            check("scanner_channel", &|point| point.scanner_channel.into());
            check("overlap", &|point| point.is_overlap.into());
        }
        match known[0].gps_time {
            Some(_) => check("gps_time", &|point| point.gps_time.unwrap()),
            None => assert_eq!(values("gps_time"), None),
        }
        match known[0].color {
            Some(_) => check("green", &|point| point.color.unwrap().green.into()),
            None => assert_eq!(values("green"), None),
        }
        match known[0].nir {
            Some(_) => check("nir", &|point| point.nir.unwrap().into()),
            None => assert_eq!(values("nir"), None),
        }
        // Other than theirs, these are next to the decimal number.
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            for (value, point) in values(name).unwrap().into_iter().zip(&known) {
                let theirs = [point.x, point.y, point.z][axis];
                assert!((value - theirs).abs() < 2e-9, "{value} {theirs}");
                assert!(value.to_string().len() <= "4500000.123".len(), "{value}");
            }
        }
        assert!(values("height").is_some());
    }
}

/// Compares a file with normals with the one it was made from: all that was there is there.
fn check_kept(sample: &Sample, before: &[u8], after: &[u8], normals: &[Vec3]) {
    let heads = [before, after].map(|bytes| super::head::parse(bytes).unwrap());
    let [old, new] = &heads;
    assert_eq!(new.stride, old.stride + 12);
    assert_eq!(old.n_points, new.n_points);
    let mut at_row = new.points_at;
    for (row, normal) in normals.iter().enumerate() {
        let start = old.points_at + row * old.stride;
        assert_eq!(after[at_row..at_row + old.stride], before[start..start + old.stride]);
        for component in 0..3 {
            let value = &after[at_row + old.stride + 4 * component..][..4];
            assert_eq!(f32::from_le_bytes(value.try_into().unwrap()), normal[component]);
        }
        at_row += new.stride;
    }
    // What stands after the points is the same, and the header says where.
    assert_eq!(after[new.rest_at..], before[old.rest_at..]);
    let rest = |head: &super::Head| {
        let waveforms = head.header.start_of_waveform_data_packet_record;
        let extended = head.header.evlr.map(|evlr| evlr.start_of_first_evlr);
        (waveforms, extended)
    };
    if sample.has_rest && sample.minor >= 3 {
        assert_eq!(rest(new).0, Some(new.rest_at as u64));
    }
    if sample.has_rest && sample.minor == 4 {
        assert_eq!(rest(new).1, Some(new.rest_at as u64));
    }
    // Records come in their order, with the descriptions where they were or before the new comment.
    let names = |head: &super::Head| -> Vec<(String, u16)> {
        head.records
            .iter()
            .map(|record| (record.user_id.clone(), record.record_id))
            .collect()
    };
    let mut expect = names(old);
    let n_before = old.records.iter().filter(|record| !record.is_extended).count();
    let mut added = vec![("Normend".to_owned(), 1)];
    if sample.extra.is_empty() {
        added.insert(0, ("LASF_Spec".to_owned(), 4));
    }
    expect.splice(n_before..n_before, added);
    assert_eq!(names(new), expect);
    for record in &old.records {
        let same = new
            .records
            .iter()
            .find(|other| other.is(&record.user_id, record.record_id))
            .unwrap();
        if !record.is("LASF_Spec", 4) {
            assert_eq!(same.span.of(after), record.span.of(before));
        } else {
            assert!(same.data.of(after).starts_with(record.data.of(before)));
        }
    }
    // The header is the same but for places, numbers and sizes of what was added.
    let mut expect = old.header.clone();
    expect.offset_to_point_data = new.header.offset_to_point_data;
    expect.number_of_variable_length_records = new.header.number_of_variable_length_records;
    expect.point_data_record_length = new.header.point_data_record_length;
    expect.evlr = new.header.evlr;
    expect.start_of_waveform_data_packet_record = new.header.start_of_waveform_data_packet_record;
    assert_eq!(new.header, expect);
    assert_eq!(after[new.points_at - 2..new.points_at], [0xcc, 0xdd]);
}

#[test]
fn normals_are_added_and_nothing_else_changes() {
    for (minor, format) in kinds() {
        for n_extra in [0, 2] {
            let mut sample = Sample::new(minor, format, 120);
            sample.has_rest = true;
            sample.extra = [("height", Scalar::Float), ("class of x", Scalar::UShort)][..n_extra].to_vec();
            let before = sample.bytes();
            let normals = normals(120);
            let after = export(&scan(&before, "a.las"), &normals, None, "b.las");
            check_kept(&sample, &before, &after, &normals);
            // Another reader reads it, and so do we.
            let (old, new) = (points(&before), points(&after));
            for ((old, new), normal) in old.iter().zip(&new).zip(&normals) {
                assert_eq!(
                    (old.x, old.y, old.z, old.intensity),
                    (new.x, new.y, new.z, new.intensity)
                );
                assert_eq!(new.extra_bytes[new.extra_bytes.len() - 4..], normal.z.to_le_bytes());
            }
            let again = scan(&after, "b.las");
            assert_eq!(again.given_normals.as_deref(), Some(&normals));
            // The same normals once more change nothing, others only themselves.
            assert_eq!(export(&again, &normals, None, "c.las"), after);
            let flipped: Vec<Vec3> = normals.iter().map(|normal| -*normal).collect();
            let twice = export(
                &scan(&export(&again, &flipped, None, "c.las"), "c.las"),
                &normals,
                None,
                "d.las",
            );
            assert_eq!(twice, after);
        }
    }
}

#[test]
fn packing_and_unpacking_gives_every_byte_back() {
    for (minor, format) in kinds() {
        let mut sample = Sample::new(minor, format, 1500).with_extra(&[("height", Scalar::Double)]);
        sample.has_rest = minor >= 3;
        let plain = sample.bytes();
        let packed = convert(&plain, "a.las", "a.laz");
        assert_eq!(packed[at::FORMAT], format | PACKED_BIT);
        let head = super::head::parse(&plain).unwrap();
        assert_eq!(rows(&packed), plain[head.points_at..head.rest_at], "format {format}");
        assert_eq!(convert(&packed, "a.laz", "a.las"), plain, "format {format}");
        // With normals both are the same points.
        let normals = normals(1500);
        let from_packed = export(&scan(&packed, "a.laz"), &normals, None, "b.las");
        assert_eq!(from_packed, export(&scan(&plain, "a.las"), &normals, None, "b.las"));
        let repacked = export(&scan(&packed, "a.laz"), &normals, None, "b.laz");
        let head = super::head::parse(&from_packed).unwrap();
        assert_eq!(rows(&repacked), from_packed[head.points_at..head.rest_at]);
        assert_eq!(convert(&repacked, "b.laz", "b.las"), from_packed);
        assert_eq!(scan(&repacked, "b.laz").given_normals.as_deref(), Some(&normals));
    }
}

#[test]
fn several_chunks_of_any_size_are_unpacked() {
    for format in [3, 7] {
        let sample = Sample::new(4, format, 120_000);
        let plain = sample.bytes();
        let packed = convert(&plain, "a.las", "a.laz");
        assert!(packed.len() < plain.len());
        assert_eq!(convert(&packed, "a.laz", "a.las"), plain);
        // Chunks of different sizes, as indexed files have them.
        let head = super::head::parse(&plain).unwrap();
        let stride = head.stride;
        let vlr = laz::LazVlrBuilder::default()
            .with_point_format(format, 0)
            .unwrap()
            .with_variable_chunk_size()
            .build();
        let mut record = Vec::new();
        vlr.write_to(&mut record).unwrap();
        let mut bytes = plain[..head.points_at - 2].to_vec();
        bytes.extend(new_record("laszip encoded", 22204, "", &record));
        let points_at = bytes.len() as u32;
        bytes[at::POINTS..at::POINTS + 4].copy_from_slice(&points_at.to_le_bytes());
        bytes[at::N_RECORDS] += 1;
        bytes[at::FORMAT] |= PACKED_BIT;
        let mut target = Cursor::new(bytes);
        target.set_position(u64::from(points_at));
        let mut packer = laz::LasZipCompressor::new(target, vlr).unwrap();
        let rows_of = |first: usize, end: usize| &plain[head.points_at + first * stride..head.points_at + end * stride];
        packer.compress_many(rows_of(0, 7)).unwrap();
        packer.finish_current_chunk().unwrap();
        packer.compress_many(rows_of(7, 70_000)).unwrap();
        packer.finish_current_chunk().unwrap();
        packer.compress_many(rows_of(70_000, 120_000)).unwrap();
        packer.done().unwrap();
        let bytes = packer.into_inner().into_inner();
        let scan = scan(&bytes, "a.laz");
        assert_eq!(scan.cloud.n_points(), 120_000);
        let normals = normals(120_000);
        let after = export(&scan, &normals, None, "b.laz");
        let again = read_bytes(after, "b.laz", &Silent).unwrap();
        assert_eq!(again.given_normals.as_deref(), Some(&normals));
        assert_eq!(again.scalar("y", &Silent).unwrap(), scan.scalar("y", &Silent).unwrap());
    }
}

#[test]
fn normals_are_found_by_any_of_their_names() {
    for (names, scalar) in [
        (["NormalX", "NormalY", "NormalZ"], Scalar::Float),
        (["nx", "ny", "nz"], Scalar::Double),
        (["Normal_X", "Normal_Y", "Normal_Z"], Scalar::Float),
    ] {
        let sample = Sample::new(4, 6, 50).with_extra(&[
            (names[0], scalar),
            ("else", Scalar::Int),
            (names[1], scalar),
            (names[2], scalar),
        ]);
        let before = sample.bytes();
        let normals = normals(50);
        let read = scan(&before, "a.las");
        assert!(read.given_normals.is_some());
        let after = export(&read, &normals, None, "b.las");
        let head = super::head::parse(&after).unwrap();
        assert_eq!(head.stride, sample.stride(), "they are written where they are");
        let again = scan(&after, "b.las");
        assert_eq!(again.given_normals.as_deref(), Some(&normals));
        let values = |scan: &Scan| scan.scalar("else", &Silent).unwrap();
        assert_eq!(values(&again), values(&read));
    }
    // Whole numbers without a scale hold no normal, so others are added.
    let names = ["NormalX", "NormalY", "NormalZ"];
    let sample = Sample::new(2, 0, 50).with_extra(&names.map(|name| (name, Scalar::Char)));
    let read = scan(&sample.bytes(), "a.las");
    assert!(read.given_normals.is_none());
    let after = export(&read, &normals(50), None, "b.las");
    assert_eq!(super::head::parse(&after).unwrap().stride, sample.stride() + 12);
}

#[test]
fn scaled_normals_are_written_as_steps() {
    let names = ["nx", "ny", "nz"];
    let mut bytes = Sample::new(4, 6, 40)
        .with_extra(&names.map(|name| (name, Scalar::Short)))
        .bytes();
    let head = super::head::parse(&bytes).unwrap();
    let descriptions = head
        .records
        .iter()
        .find(|record| record.is("LASF_Spec", 4))
        .unwrap()
        .data;
    for index in 0..3 {
        let at = descriptions.start + 192 * index;
        // A scale, and a range that does not hold afterwards.
        bytes[at + 3] = 8 | 2 | 4;
        bytes[at + 112..at + 120].copy_from_slice(&1e-4_f64.to_le_bytes());
    }
    let normals = normals(40);
    let after = export(&scan(&bytes, "a.las"), &normals, None, "b.las");
    assert_eq!(after[descriptions.start + 3], 8, "the range is not known any more");
    let again = scan(&after, "b.las");
    for (given, normal) in again.given_normals.as_deref().unwrap().iter().zip(&normals) {
        assert!((*given - *normal).abs().max_element() <= 0.5001e-4, "{given} {normal}");
    }
}

#[test]
fn bytes_without_a_name_stay_before_new_ones() {
    for extra in [&[][..], &[("height", Scalar::Float)]] {
        let mut sample = Sample::new(4, 7, 30).with_extra(extra);
        sample.n_unnamed = 300;
        let before = sample.bytes();
        let normals = normals(30);
        let after = export(&scan(&before, "a.las"), &normals, None, "b.las");
        check_kept_rows(&before, &after);
        assert_eq!(scan(&after, "b.las").given_normals.as_deref(), Some(&normals));
    }
}

fn check_kept_rows(before: &[u8], after: &[u8]) {
    let [old, new] = [before, after].map(|bytes| super::head::parse(bytes).unwrap());
    for row in 0..old.n_points {
        let [start, new_start] = [&old, &new].map(|head| head.points_at + row * head.stride);
        assert_eq!(
            after[new_start..new_start + old.stride],
            before[start..start + old.stride]
        );
    }
}

#[test]
fn confidence_is_written_and_read_and_written_in_place() {
    for name in ["a.las", "a.laz"] {
        let sample = Sample::new(4, 6, 3);
        let first = scan(&sample.bytes(), "a.las");
        let normals = normals(3);
        let after = export(&first, &normals, Some(&[255, 128, 127]), name);
        let again = scan(&after, name);
        let values = |field: &str| again.scalar(field, &Silent).unwrap().unwrap();
        assert_eq!(values("oriented"), [1.0, 0.0, 0.0]);
        assert_eq!(values("confidence")[0], 1.0);
        assert_eq!(export(&again, &normals, Some(&[255, 128, 127]), name), after);
    }
}

#[test]
fn the_rule_is_written_once() {
    let read = scan(&Sample::new(2, 1, 5).bytes(), "a.las");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("b.las");
    let write = |scan: &Scan, rule: &str| {
        let options = WriteOptions {
            rule: rule.into(),
            ..Default::default()
        };
        scan.write(&normals(5), &path, &options, &Silent).unwrap();
        fs::read(&path).unwrap()
    };
    let once = write(&read, "outward");
    let twice = write(&scan(&once, "b.las"), "up");
    let head = super::head::parse(&twice).unwrap();
    let comments: Vec<&[u8]> = head
        .records
        .iter()
        .filter(|record| record.user_id == "Normend")
        .map(|record| record.data.of(&twice))
        .collect();
    let expect = format!("Normend {}: normals oriented, rule: up", env!("CARGO_PKG_VERSION"));
    assert_eq!(comments, [expect.as_bytes()]);
}

#[test]
fn an_index_of_chunks_is_left_out_and_named() {
    let mut sample = Sample::new(4, 7, 50);
    sample.has_rest = true;
    let plain = sample.bytes();
    let mut bytes = convert(&plain, "a.las", "a.laz");
    // The records of an index, which stands in place of others here.
    let head = super::head::parse(&bytes).unwrap();
    let spans: Vec<usize> = [1, 3].iter().map(|&index| head.records[index].span.start).collect();
    for start in &spans {
        bytes[start + 2..start + 18].copy_from_slice(b"copc\0\0\0\0\0\0\0\0\0\0\0\0");
    }
    let read = scan(&bytes, "a.copc.laz");
    let losses = read.losses(Path::new("b.laz")).unwrap();
    assert!(losses.iter().any(|loss| loss.what.contains("COPC")), "{losses:?}");
    let after = export(&read, &normals(50), None, "b.laz");
    let head = super::head::parse(&after).unwrap();
    assert!(head.records.iter().all(|record| record.user_id != "copc"));
    let evlr = head.header.evlr.unwrap();
    assert_eq!(
        (evlr.number_of_evlrs, evlr.start_of_first_evlr),
        (1, head.rest_at as u64)
    );
    let last = head.records.last().unwrap();
    assert_eq!(last.data.of(&after), (0..40).collect::<Vec<u8>>());
    // The waveforms were the first record; what the header says of them is where its bytes would be.
    assert_eq!(scan(&after, "b.laz").cloud.n_points(), 50);
}
