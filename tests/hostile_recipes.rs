//! Recipes that were made to do harm: none names a file that is read or written, whatever stands in it.

#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use normend_core::{Parameters, Silent, shapes};
use normend_io::Positions;
use normend_io::recipe::{Head, LineWriter};
use tempfile::TempDir;

/// Longer than any run here takes; a program that waits for a pipe is ended then.
const PATIENCE: Duration = Duration::from_secs(120);

/// Runs the program in `folder`; fails when it does not end.
fn normend(folder: &Path, arguments: &[&str]) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_normend"))
        .current_dir(folder)
        .env("NORMEND_CONFIG_DIR", folder.join("config"))
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let deadline = Instant::now() + PATIENCE;
    while child.try_wait().unwrap().is_none() {
        if Instant::now() > deadline {
            child.kill().unwrap();
            panic!("it does not end: {arguments:?}");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    child.wait_with_output().unwrap()
}

fn make_pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// A folder with a scan, its recipe's head, and files around that nobody should touch.
struct Place {
    folder: TempDir,
    head: Head,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let work = folder.path().join("work");
        fs::create_dir(&work).unwrap();
        fs::write(folder.path().join("outside.ply"), "not to be touched").unwrap();
        let scan = work.join("scan.xyz");
        let positions = shapes::torus(300).positions;
        normend_io::write_points(&scan, Positions::Float(&positions), None, &Silent).unwrap();
        let identity = normend_io::read(&scan, &Silent).unwrap().identity("scan.xyz");
        let head = Head::new(identity, Parameters::default());
        Self { folder, head }
    }

    fn work(&self) -> PathBuf {
        self.folder.path().join("work")
    }

    /// All files with their content, pipes without.
    fn files(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut files = BTreeMap::new();
        let mut open = vec![self.folder.path().to_path_buf()];
        while let Some(folder) = open.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                let metadata = fs::symlink_metadata(&path).unwrap();
                if metadata.is_dir() {
                    open.push(path);
                } else if metadata.is_file() {
                    let content = fs::read(&path).unwrap();
                    files.insert(path, content);
                } else {
                    files.insert(path, Vec::new());
                }
            }
        }
        files
    }
}

/// A line with `fields` more before its checksum, which is right again.
fn with_fields(line: &[u8], fields: &str) -> String {
    let text = std::str::from_utf8(line).unwrap();
    let body = &text[..text.rfind(",\"crc\"").unwrap()];
    let body = format!("{body},{fields}");
    // CRC-32 as zlib and PNG have it, a bit at a time.
    let mut crc = !0_u32;
    for byte in body.bytes() {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
        }
    }
    format!("{body},\"crc\":\"{:08x}\"}}\n", !crc)
}

#[test]
fn a_path_in_a_recipe_is_never_opened() {
    let place = Place::new();
    let pipe = place.folder.path().join("pipe");
    make_pipe(&pipe);
    let outside = place.folder.path().join("outside.ply");
    let expected = {
        let (_, line) = LineWriter::begin(&place.head).unwrap();
        fs::write(place.work().join("plain.normend"), line).unwrap();
        let run = normend(&place.work(), &["replay", "plain.normend", "scan.xyz", "-o", "out.xyz"]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        fs::read(place.work().join("out.xyz")).unwrap()
    };
    for named in [
        "../outside.ply",
        "../../../../../../etc/passwd",
        "/dev/zero",
        "/dev/stdin",
        "/proc/self/mem",
        "\\\\server\\share\\scan.ply",
        "//server/share/scan.ply",
        "file:///etc/passwd",
        "C:\\Windows\\scan.ply",
        "a\0b",
        "",
        pipe.to_str().unwrap(),
        outside.to_str().unwrap(),
    ] {
        let mut head = place.head.clone();
        head.scan.name = named.to_owned();
        head.scan.path = Some(named.to_owned());
        let (_, line) = LineWriter::begin(&head).unwrap();
        let named = serde_json::to_string(named).unwrap();
        // Names that other programs, or newer ones, may think of.
        let fields = [
            "output",
            "out",
            "export",
            "file",
            "input",
            "include",
            "stations",
            "reference",
            "sensors",
        ]
        .map(|field| format!("\"{field}\":{named}"));
        fs::write(
            place.work().join("hostile.normend"),
            with_fields(&line, &fields.join(",")),
        )
        .unwrap();
        fs::remove_file(place.work().join("out.xyz")).unwrap();
        let before = place.files();
        let run = normend(
            &place.work(),
            &["replay", "hostile.normend", "scan.xyz", "-o", "out.xyz"],
        );
        let said = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{named}: {said}");
        let mut after = place.files();
        assert_eq!(
            after.remove(&place.work().join("out.xyz")).as_ref(),
            Some(&expected),
            "{named}"
        );
        let names = |files: &BTreeMap<PathBuf, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&after), names(&before), "{named}");
        assert!(after == before, "{named}: a file has other content");
    }
}

#[test]
fn a_recipe_is_read_from_files_only() {
    let place = Place::new();
    make_pipe(&place.work().join("pipe.normend"));
    std::os::unix::fs::symlink("/dev/zero", place.work().join("zeros.normend")).unwrap();
    std::os::unix::fs::symlink("loop.normend", place.work().join("loop.normend")).unwrap();
    for (recipe, expect) in [
        ("pipe.normend", "this is a device or a pipe, not a file"),
        ("zeros.normend", "this is a device or a pipe, not a file"),
        ("/dev/zero", "this is a device or a pipe, not a file"),
        (".", "this is a folder"),
        ("loop.normend", "loop.normend: "),
        ("scan.xyz", "this is no recipe of Normend"),
    ] {
        let run = normend(&place.work(), &["replay", recipe, "scan.xyz", "-o", "out.xyz"]);
        let said = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(1), "{recipe}: {said}");
        assert!(said.contains(expect), "{recipe}: {said}");
        assert_eq!(said.trim_end().lines().count(), 1, "{said}");
        assert!(!place.work().join("out.xyz").exists());
    }
}

#[test]
fn the_output_does_not_take_the_place_of_the_recipe_by_another_name() {
    let place = Place::new();
    let (_, line) = LineWriter::begin(&place.head).unwrap();
    fs::write(place.work().join("a.normend"), line).unwrap();
    std::os::unix::fs::symlink("a.normend", place.work().join("link.xyz")).unwrap();
    fs::hard_link(place.work().join("a.normend"), place.work().join("hard.xyz")).unwrap();
    let before = place.files();
    for output in ["link.xyz", "hard.xyz"] {
        let run = normend(
            &place.work(),
            &["replay", "a.normend", "scan.xyz", "-o", output, "--overwrite"],
        );
        let said = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(2), "{output}: {said}");
        assert!(said.contains("the output would take the place of the recipe"), "{said}");
    }
    assert!(place.files() == before);
}

#[test]
fn names_in_recipes_give_a_terminal_no_commands() {
    let place = Place::new();
    let mut head = place.head.clone();
    head.scan.name = "\u{1b}]0;title\u{7}\u{1b}[2Jscan.xyz".to_owned();
    head.scan.hash = [0; 32];
    let (_, line) = LineWriter::begin(&head).unwrap();
    fs::write(place.work().join("a.normend"), line).unwrap();
    let run = normend(&place.work(), &["replay", "a.normend", "scan.xyz", "-o", "out.xyz"]);
    assert_eq!(run.status.code(), Some(1));
    let said = String::from_utf8(run.stderr).unwrap();
    assert!(said.contains("\\u{1b}]0;title\\u{7}"), "{said}");
    assert!(!said.trim_end().contains(char::is_control), "{said:?}");
}
