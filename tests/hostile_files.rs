//! Files that were made to do harm: they take no more memory than their size and 64 MiB justify, give terminals no commands, and
//! are refused with a sentence. What fuzzing found (docs/fuzzing.md) stands here too.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic, as tests do")]

use std::alloc::System;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use base64::Engine as _;
use cap::Cap;
use normend_core::{Parameters, PointSet, Silent};
use normend_io::recipe::{self, End, Head, LineWriter};
use normend_io::{Positions, Scan, read, read_bytes};

#[global_allocator]
static MEMORY: Cap<System> = Cap::new(System, usize::MAX);

/// Runs `check`, in which memory beyond 64 MiB and four times `n_bytes` ends the process. One at a time, because the limit is
/// on the whole process.
fn limited<T>(n_bytes: usize, check: impl FnOnce() -> T) -> T {
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    MEMORY.set_limit(MEMORY.allocated() + (64 << 20) + 4 * n_bytes).unwrap();
    let result = check();
    MEMORY.set_limit(usize::MAX).unwrap();
    result
}

fn error_of(name: &str, bytes: &[u8]) -> String {
    let result = limited(bytes.len(), || read_bytes(bytes.to_vec(), name, &Silent));
    result.unwrap_err().to_string()
}

fn scan(text: &str) -> Scan {
    read_bytes(text.as_bytes().to_vec(), "scan.xyz", &Silent).unwrap()
}

#[test]
fn the_limit_on_memory_holds() {
    limited(0, || {
        let mut bytes: Vec<u8> = Vec::new();
        assert!(bytes.try_reserve_exact(60 << 20).is_ok());
        let mut more: Vec<u8> = Vec::new();
        assert!(more.try_reserve_exact(60 << 20).is_err());
    });
}

#[test]
fn names_in_files_give_a_terminal_no_commands() {
    let with_element = |name: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement {name} 7\nelement vertex 1\nproperty float x\nproperty float y\n\
             property float z\nend_header\n0 0 0\n"
        )
        .into_bytes()
    };
    let sentence = error_of("scan.ply", &with_element("\u{1b}[2J\u{7}face"));
    assert_eq!(
        sentence,
        "scan.ply, line 3: element \"\\u{1b}[2J\\u{7}face\" has 7 rows but no properties: remove it or declare them"
    );
    let long = error_of("scan.ply", &with_element(&"a".repeat(100_000)));
    assert!(long.len() < 500, "{long}");
    assert!(
        long.ends_with("rows but no properties: remove it or declare them"),
        "{long}"
    );
}

#[test]
fn a_title_does_not_become_the_names_of_other_columns() {
    // With the three values of a normal the rows would have as many values as the title has names.
    assert_eq!(
        error_of("scan.csv", b"i,t,z,r,g,b,y,x\n1,2,3,4,5\n1,2,4,4,5\n"),
        "scan.csv, line 1: \"i,t,z,r,g,b,y,x\" names 8 columns, and the first row has 5 values: correct or remove the line"
    );
    let is_read = |title: &str| {
        read_bytes(
            format!("{title}\n1 2 3 4 5\n1 2 4 4 5\n").into_bytes(),
            "scan.txt",
            &Silent,
        )
        .is_ok()
    };
    assert!(!is_read("# z y x r g b i t"));
    assert!(is_read("# x y z of the scanner and more"));
    assert!(is_read("x y z nx ny nz a b"));
    assert!(!is_read("x y z nz ny nx a b"));
}

/// A file named `name` of `n_points` points in one place.
fn of_one_place(name: &str, n_points: usize) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let positions = vec![glam::Vec3::ONE; n_points];
    normend_io::write_points(&path, Positions::Float(&positions), None, &Silent).unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn packed_points_are_no_bombs() {
    // The numbers of points in the header, of 32 and of 64 bits.
    let promise = |n_points: u64| {
        let mut bytes = of_one_place("scan.laz", 10);
        bytes[107..111].copy_from_slice(&u32::try_from(n_points).unwrap_or(0).to_le_bytes());
        bytes[247..255].copy_from_slice(&n_points.to_le_bytes());
        bytes
    };
    for n_points in [4_000_000_000, 1 << 60, u64::MAX] {
        let sentence = error_of("scan.laz", &promise(n_points));
        assert!(sentence.starts_with("scan.laz"), "{sentence}");
    }
    let sentence = error_of("scan.laz", &promise(4_000_000_000));
    assert!(sentence.contains("more than 100 times as many as these"), "{sentence}");
    // These are packed to next to nothing, and yet as small as any.
    let bytes = of_one_place("scan.laz", 300_000);
    let scan = limited(bytes.len(), || read_bytes(bytes.clone(), "scan.laz", &Silent).unwrap());
    assert_eq!(scan.cloud.n_points(), 300_000);
}

#[test]
fn counts_of_every_format_are_compared_with_the_size() {
    let swap = |bytes: &[u8], from: &str, to: &str| {
        let at = bytes.windows(from.len()).position(|window| window == from.as_bytes());
        let at = at.unwrap_or_else(|| panic!("no {from}"));
        [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
    };
    let many = "4000000000";
    let ply = swap(
        &of_one_place("a.ply", 10),
        "element vertex 10",
        &format!("element vertex {many}"),
    );
    let pcd = of_one_place("a.pcd", 10);
    let pcd = swap(
        &swap(&pcd, "WIDTH 10", &format!("WIDTH {many}")),
        "POINTS 10",
        &format!("POINTS {many}"),
    );
    let pts = swap(&of_one_place("a.pts", 10), "10\n", &format!("{many}\n"));
    let mut las = of_one_place("a.las", 10);
    las[107..111].copy_from_slice(&4_000_000_000_u32.to_le_bytes());
    las[247..255].copy_from_slice(&4_000_000_000_u64.to_le_bytes());
    let ptx =
        format!("{many}\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 2 3 0.5\n").into_bytes();
    for (name, bytes) in [
        ("a.ply", ply),
        ("a.pcd", pcd),
        ("a.pts", pts),
        ("a.las", las),
        ("a.ptx", ptx),
    ] {
        let sentence = error_of(name, &bytes);
        assert!(sentence.starts_with(name) && sentence.contains(many), "{sentence}");
    }
    // E57 has a checksum on each page, and its count in an XML section.
    let mut e57 = swap(&of_one_place("a.e57", 10), "recordCount=\"10\"", "recordCount=\"99\"");
    for page in e57.chunks_exact_mut(1024) {
        let (content, checksum) = page.split_at_mut(1020);
        checksum.copy_from_slice(&crc32c::crc32c(content).to_be_bytes());
    }
    let sentence = error_of("a.e57", &e57);
    assert!(sentence.starts_with("a.e57, byte "), "{sentence}");
}

/// What `bytes` become when they are written as a file named `target`, with all normals up.
fn written(name: &str, bytes: &[u8], target: &str) -> String {
    let scan = read_bytes(bytes.to_vec(), name, &Silent).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(target);
    let normals = vec![glam::Vec3::Z; scan.cloud.n_points()];
    scan.write(&normals, &path, &Default::default(), &Silent).unwrap();
    let again = read(&path, &Silent).unwrap();
    assert_eq!(again.cloud.positions(), scan.cloud.positions());
    assert_eq!(again.given_normals.unwrap().as_slice(), normals);
    std::fs::read_to_string(path).unwrap()
}

#[test]
fn empty_values_add_no_columns() {
    assert_eq!(
        written("a.csv", b"x,y,,z,i\n1,2,,3,4\n1,2,7,4,4\n", "b.csv"),
        "x,y,,z,nx,ny,nz,i\n1,2,,3,0,0,1,4\n1,2,7,4,0,0,1,4\n"
    );
}

#[test]
fn faces_name_no_normals_that_are_written_later() {
    assert_eq!(
        error_of("a.obj", b"v 0 0 0\nf 1//1 2//2 3//3\n"),
        "a.obj, line 2: \"1//1\" refers to a point or normal that is not there (1 points, 0 normals): correct it, or remove \
         the part after the last slash"
    );
}

#[test]
fn separators_within_values_are_none_in_another_format() {
    let ply = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
        property float i\nend_header\n1 2 3 0,5;7\n";
    assert_eq!(written("a.ply", ply, "b.csv"), "x,y,z,nx,ny,nz,i\n1,2,3,0,0,1,0_5_7\n");
}

#[cfg(unix)]
#[test]
fn recipes_are_files() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe.normend");
    assert!(
        std::process::Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    let link = folder.path().join("link.normend");
    std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
    for path in [&pipe, &link, Path::new("/dev/zero"), Path::new("/dev/stdin")] {
        let error = recipe::read(path).unwrap_err().to_string();
        assert_eq!(
            error,
            format!(
                "{}: this is a device or a pipe, not a file: save it as a file first",
                path.display()
            )
        );
    }
    assert!(
        recipe::read(folder.path())
            .unwrap_err()
            .to_string()
            .contains("this is a folder")
    );
    // A scan, or anything else that is long, is no recipe.
    let sample = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/sample.ply"));
    assert!(
        recipe::read(sample)
            .unwrap_err()
            .to_string()
            .contains("this is no recipe of Normend")
    );
}

/// A recipe of `scan` whose lines are the JSON objects `bodies`, with right checksums.
fn recipe_of(scan: &Scan, bodies: &[String]) -> Vec<u8> {
    let head = Head::new(scan.identity("scan.xyz"), Parameters::default());
    let (_, mut lines) = LineWriter::begin(&head).unwrap();
    let tail = ",\"crc\":\"00000000\"}\n".len();
    let mut checksum = u32::from_str_radix(
        std::str::from_utf8(&lines[lines.len() - 11..lines.len() - 3]).unwrap(),
        16,
    )
    .unwrap();
    assert_eq!(
        lines.len() - tail,
        lines.iter().rposition(|&byte| byte == b',').unwrap()
    );
    for body in bodies {
        let body = body.strip_suffix('}').unwrap();
        let mut hasher = crc32fast::Hasher::new_with_initial(checksum);
        hasher.update(body.as_bytes());
        checksum = hasher.finalize();
        lines.extend_from_slice(format!("{body},\"crc\":\"{checksum:08x}\"}}\n").as_bytes());
    }
    lines
}

/// All points that ids can number but every `step`th thousand, as runs, in text.
fn huge_set(first: u16) -> String {
    // Roaring's portable format: runs, for each of the 65,536 containers one, of nearly all ids.
    let mut bytes = Vec::new();
    bytes.extend_from_slice(&(12_347_u32 | 0xffff << 16).to_le_bytes());
    bytes.extend_from_slice(&[0xff; 65_536 / 8]);
    for key in 0..=u16::MAX {
        bytes.extend_from_slice(&key.to_le_bytes());
        bytes.extend_from_slice(&(u16::MAX - first).to_le_bytes());
    }
    bytes.extend_from_slice(&[0; 4 * 65_536]);
    for _ in 0..=u16::MAX {
        for value in [1, first, u16::MAX - first] {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
    }
    let set = PointSet::deserialize_from(&bytes[..]).unwrap();
    assert_eq!(set.len(), (1 << 32) - 65_536 * u64::from(first));
    base64::engine::general_purpose::STANDARD_NO_PAD.encode(bytes)
}

#[test]
fn sets_of_more_points_than_there_are_take_no_memory() {
    let scan = scan("0 0 0\n1 0 0\n0 1 0\n0 0 1\n");
    let step = |first: u16| {
        format!(
            "{{\"do\":\"step\",\"kind\":\"select\",\"selected\":\"{}\"}}",
            huge_set(first)
        )
    };
    let bytes = recipe_of(&scan, &[step(0), step(100), step(3)]);
    limited(bytes.len(), || {
        let reading = recipe::parse(&bytes, "a.normend").unwrap();
        let End::Damaged(broken) = reading.end else {
            panic!(
                "points that do not exist are taken: {:?}",
                reading.recipe.state().selected.len()
            );
        };
        assert_eq!(
            broken.to_string(),
            "line 2: the step names point 4294967295, and the scan has 4 points: it is of another scan"
        );
        assert!(reading.recipe.events.is_empty());
        assert!(reading.recipe.state().selected.is_empty());
    });
}

#[test]
fn numbers_in_recipes_are_bounded() {
    let scan = scan("0 0 0\n1 0 0\n0 1 0\n0 0 1\n");
    let check = |body: &str, expect: &str| {
        let bytes = recipe_of(&scan, &[body.to_owned()]);
        let reading = limited(bytes.len(), || recipe::parse(&bytes, "a.normend").unwrap());
        let End::Damaged(broken) = reading.end else {
            panic!("{body} is taken");
        };
        assert_eq!(broken.to_string(), format!("line 2: {expect}"));
    };
    check(
        r#"{"do":"step","kind":"flip-points","marks":{"points":"AA","states":[["marked",18446744073709551615]],"normals":""}}"#,
        "the list of normals of marked points is too short",
    );
    check(
        r#"{"do":"step","kind":"mend","sources":[{"point":4,"normal":[0,0,1],"origin":"picked"}]}"#,
        "the step names point 4, and the scan has 4 points: it is of another scan",
    );
    let nested = format!(
        r#"{{"do":"step","kind":"mend","sources":{}1{}}}"#,
        "[".repeat(100_000),
        "]".repeat(100_000)
    );
    let bytes = recipe_of(&scan, &[nested]);
    let reading = limited(bytes.len(), || recipe::parse(&bytes, "a.normend").unwrap());
    assert!(matches!(reading.end, End::Damaged(_)));
}
