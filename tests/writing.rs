//! Writing loses nothing: full, read-only and vanishing disks, folders and files that may not be written, kills at any moment.
//!
//! Disks are mounted in a namespace of the test's own, so that nothing is left behind. Where the system allows no such thing the
//! test says that it is skipped; with `NORMEND_REQUIRE_MOUNT=1` it fails instead.

#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::ffi::{OsStr, OsString};
use std::fs::{self, Permissions};
use std::io::Write;
use std::os::unix::ffi::OsStringExt;
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use driver::{Editor, sphere_with_wrong_cap, sphere_without_normals, start};
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use normend_app::command::Command as Asked;
use normend_core::{Document, Silent};
use normend_io::recipe::Recipe;
use normend_io::{WriteError, WriteOptions, is_same_file, n_other_names};
use normend_render::HeadlessDevice;

/// Set in the process that has mounts of its own.
const INSIDE: &str = "NORMEND_TEST_HAS_OWN_MOUNTS";
/// What stands at a target before.
const OLD: &[u8] = b"what was there before";
/// Who owns nothing.
const NOBODY: u32 = 65534;
/// A guard against waiting forever, not a measure.
const PATIENCE: Duration = Duration::from_secs(120);

/// Whether this process may mount. Where not, the `test` is run again in one that may, unless the system forbids that.
fn has_own_mounts(test: &str) -> bool {
    if std::env::var_os(INSIDE).is_some() {
        return true;
    }
    let folder = tempfile::tempdir().unwrap();
    // As the superuser, or as somebody who is the superuser in a namespace.
    for flags in [&["--mount"][..], &["--mount", "--user", "--map-root-user"]] {
        let mut probe = Command::new("unshare");
        probe
            .args(flags)
            .args(["mount", "-t", "tmpfs", "none"])
            .arg(folder.path());
        let probe = probe.stdout(Stdio::null()).stderr(Stdio::null()).status();
        if probe.is_ok_and(|status| status.success()) {
            let mut inside = Command::new("unshare");
            inside.args(flags).arg(std::env::current_exe().unwrap());
            inside.args(["--exact", test, "--nocapture"]).env(INSIDE, "1");
            assert!(
                inside.status().unwrap().success(),
                "{test} failed with mounts of its own"
            );
            return false;
        }
    }
    let required = std::env::var_os("NORMEND_REQUIRE_MOUNT").is_some_and(|value| value == "1");
    assert!(!required, "NORMEND_REQUIRE_MOUNT=1, but nothing can be mounted here");
    println!("skipped: nothing can be mounted here");
    false
}

fn call(program: &str, arguments: &[&OsStr]) {
    let status = Command::new(program).args(arguments).status().unwrap();
    assert!(status.success(), "{program} {arguments:?}");
}

/// A small disk in memory.
struct Disk(PathBuf);

impl Disk {
    fn mount(path: PathBuf, size: &str) -> Self {
        fs::create_dir(&path).unwrap();
        let options = OsString::from(format!("size={size}"));
        call(
            "mount",
            &[
                "-t".as_ref(),
                "tmpfs".as_ref(),
                "-o".as_ref(),
                &options,
                "none".as_ref(),
                path.as_os_str(),
            ],
        );
        Self(path)
    }

    /// Fills it, but for `n_free` bytes.
    fn fill(&self, n_free: u64) {
        let mut file = fs::File::create(self.0.join("filler")).unwrap();
        while file.write_all(&[7; 4096]).is_ok() {}
        file.set_len(file.metadata().unwrap().len() - n_free).unwrap();
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        // One that was taken away in the test is not there any more.
        let _ = Command::new("umount")
            .arg("-l")
            .arg(&self.0)
            .stderr(Stdio::null())
            .status();
    }
}

/// The program in `folder`, with a settings folder of its own and no display.
fn normend(folder: &Path, arguments: &[&OsStr]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_normend"));
    command
        .args(arguments)
        .current_dir(folder)
        .env("NORMEND_CONFIG_DIR", folder.join("config"))
        // Drivers of graphics look for these, and say so where they find none.
        .env("XDG_RUNTIME_DIR", folder)
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .stdin(Stdio::null());
    for variable in ["RUST_LOG", "DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(variable);
    }
    command
}

/// Runs the program with `typed` split at spaces; it must end with `code`. Gives what it said.
fn run(folder: &Path, typed: &str, code: i32) -> String {
    let words: Vec<&OsStr> = typed.split_whitespace().map(OsStr::new).collect();
    end(normend(folder, &words).stdout(Stdio::null()), code)
}

fn end(command: &mut Command, code: i32) -> String {
    let output = command.output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{command:?}: {said}");
    assert!(!said.contains("panicked"), "{said}");
    said
}

/// What was said is one sentence that holds each of `words`.
fn expect_sentence(said: &str, words: &[&str]) {
    assert_eq!(said.trim_end().lines().count(), 1, "not one sentence: {said}");
    for word in words {
        assert!(said.contains(word), "no {word:?} in {said}");
    }
}

fn names_in(folder: &Path) -> Vec<OsString> {
    let mut names: Vec<OsString> = (fs::read_dir(folder).unwrap())
        .map(|entry| entry.unwrap().file_name())
        .collect();
    names.sort();
    names
}

fn parts_in(folder: &Path) -> Vec<OsString> {
    let mut names = names_in(folder);
    names.retain(|name| name.to_string_lossy().starts_with(".normend-"));
    names
}

/// A scan that is oriented in no time, and long to write: most of it is what Normend copies.
fn long_scan(folder: &Path, name: &str, n_mib: usize) -> PathBuf {
    let path = folder.join(name);
    let n = n_mib << 20;
    let scan = fs::read(sphere_without_normals(folder, "short.ply", 300)).unwrap();
    let text = b"end_header\n";
    let end = scan.windows(text.len()).position(|bytes| bytes == text).unwrap();
    let (header, rows) = (&scan[..end], &scan[end + text.len()..]);
    let more = format!("element blob {n}\nproperty uchar value\nend_header\n");
    fs::write(&path, [header, more.as_bytes(), rows, &vec![42; n]].concat()).unwrap();
    fs::remove_file(folder.join("short.ply")).unwrap();
    path
}

#[test]
fn a_full_disk_keeps_what_was_there() {
    if !has_own_mounts("a_full_disk_keeps_what_was_there") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let disk = Disk::mount(folder.join("disk"), "1m");
    let scan = normend_io::read(&sphere_without_normals(folder, "scan.ply", 5000), &Silent).unwrap();
    let document = Document::new(scan.cloud.clone(), None);
    let recipe = Recipe::of_document(scan.identity("scan.ply"), &document);
    recipe.write(&folder.join("r.normend")).unwrap();
    let mut commands = vec![
        ("orient scan.ply -o disk/old.ply --overwrite", "old.ply"),
        ("orient scan.ply -o disk/new.ply", "new.ply"),
        ("replay r.normend scan.ply -o disk/old.ply --overwrite", "old.ply"),
        ("generate torus --points 9000 -o disk/old.ply --overwrite", "old.ply"),
    ];
    if HeadlessDevice::new().is_ok() {
        commands.push(("render scan.ply -o disk/old.png --size 900x700 --overwrite", "old.png"));
    }
    for name in ["old.ply", "old.png"] {
        fs::write(disk.0.join(name), OLD).unwrap();
    }
    disk.fill(8192);
    let before = names_in(&disk.0);
    for (command, name) in &commands {
        let said = run(folder, &format!("{command} --quiet"), 1);
        let name = format!("disk/{name} cannot be written");
        expect_sentence(
            &said,
            &[
                &name,
                "the disk is full, there was room for only",
                "free some space there",
            ],
        );
        assert_eq!(names_in(&disk.0), before, "{command}");
        for name in ["old.ply", "old.png"] {
            assert_eq!(fs::read(disk.0.join(name)).unwrap(), OLD, "{command}");
        }
    }
    let error = recipe.write(&disk.0.join("r.normend"));
    assert!(error.is_ok(), "a small file still fits: {error:?}");
    fs::remove_file(disk.0.join("filler")).unwrap();
    for (command, name) in commands {
        run(folder, &format!("{command} --quiet"), 0);
        assert!(fs::metadata(disk.0.join(name)).unwrap().len() > 8192, "{command}");
    }
    assert!(parts_in(&disk.0).is_empty());
}

#[test]
fn a_read_only_disk_is_told() {
    if !has_own_mounts("a_read_only_disk_is_told") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let disk = Disk::mount(folder.join("disk"), "1m");
    sphere_without_normals(folder, "scan.ply", 300);
    fs::write(disk.0.join("old.ply"), OLD).unwrap();
    call(
        "mount",
        &["-o".as_ref(), "remount,bind,ro".as_ref(), disk.0.as_os_str()],
    );
    for name in ["old.ply", "new.ply"] {
        let said = run(
            folder,
            &format!("orient scan.ply -o disk/{name} --overwrite --quiet"),
            1,
        );
        expect_sentence(&said, &[name, "the disk is read-only: choose a place on another one"]);
    }
    assert_eq!(fs::read(disk.0.join("old.ply")).unwrap(), OLD);
    assert_eq!(names_in(&disk.0), ["old.ply"]);
}

/// Starts to orient `scan` into `folder`/out.ply, and stops the program while it writes.
fn stopped_in_writing(scan: &Path, folder: &Path) -> Child {
    let deadline = Instant::now() + PATIENCE;
    while Instant::now() < deadline {
        let target = folder.join("out.ply");
        let arguments = [
            OsStr::new("orient"),
            scan.as_os_str(),
            "-o".as_ref(),
            target.as_os_str(),
        ];
        let mut command = normend(scan.parent().unwrap(), &arguments);
        let mut child = command
            .args(["--overwrite", "--quiet"])
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        while parts_in(folder).is_empty() && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        let _ = Command::new("kill").args(["-STOP", &child.id().to_string()]).status();
        // A moment until it has stopped; then it is in the middle, or it was too fast and is done.
        std::thread::sleep(Duration::from_millis(20));
        if !parts_in(folder).is_empty() && fs::read(&target).unwrap() == OLD {
            return child;
        }
        let _ = Command::new("kill").args(["-CONT", &child.id().to_string()]).status();
        child.wait().unwrap();
        fs::write(&target, OLD).unwrap();
    }
    panic!("the program was never met in writing");
}

/// Lets it go on; it must end with `code`. Gives what it said.
fn go_on(child: Child, code: i32) -> String {
    call("kill", &["-CONT".as_ref(), child.id().to_string().as_ref()]);
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{said}");
    said
}

#[test]
fn a_drive_that_vanishes_keeps_the_old_file() {
    if !has_own_mounts("a_drive_that_vanishes_keeps_the_old_file") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let scan = long_scan(folder, "scan.ply", 24);
    let disk = Disk::mount(folder.join("disk"), "80m");
    // The same disk at another place, which is taken away.
    let place = folder.join("place");
    fs::create_dir(&place).unwrap();
    call("mount", &["--bind".as_ref(), disk.0.as_os_str(), place.as_os_str()]);
    fs::write(disk.0.join("out.ply"), OLD).unwrap();
    let child = stopped_in_writing(&scan, &place);
    call("umount", &["-l".as_ref(), place.as_os_str()]);
    let said = go_on(child, 1);
    expect_sentence(
        &said,
        &[
            "place/out.ply",
            "its folder vanished meanwhile",
            "connect the drive again",
        ],
    );
    assert_eq!(fs::read(disk.0.join("out.ply")).unwrap(), OLD);
    assert!(names_in(&place).is_empty(), "nothing is written where the drive was");
    // The part could not be removed; whoever writes there next does that.
    assert_eq!(parts_in(&disk.0).len(), 1);
    run(folder, "orient scan.ply -o disk/out.ply --overwrite --quiet", 0);
    assert_eq!(names_in(&disk.0), ["out.ply"]);
    assert!(fs::metadata(disk.0.join("out.ply")).unwrap().len() > 24 << 20);
}

#[test]
fn a_folder_that_vanishes_and_a_target_that_changes_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let scan = long_scan(folder, "scan.ply", 24);
    let place = folder.join("place");
    fs::create_dir(&place).unwrap();
    fs::write(place.join("out.ply"), OLD).unwrap();

    let child = stopped_in_writing(&scan, &place);
    fs::write(place.join("out.ply"), "of another program").unwrap();
    let said = go_on(child, 1);
    expect_sentence(
        &said,
        &["out.ply", "was changed by another program while it was to be replaced"],
    );
    assert_eq!(fs::read(place.join("out.ply")).unwrap(), b"of another program");
    assert!(parts_in(&place).is_empty());

    // One that is only removed is written anew.
    fs::write(place.join("out.ply"), OLD).unwrap();
    let child = stopped_in_writing(&scan, &place);
    fs::remove_file(place.join("out.ply")).unwrap();
    go_on(child, 0);
    assert!(fs::metadata(place.join("out.ply")).unwrap().len() > 24 << 20);

    fs::write(place.join("out.ply"), OLD).unwrap();
    let child = stopped_in_writing(&scan, &place);
    fs::remove_dir_all(&place).unwrap();
    let said = go_on(child, 1);
    expect_sentence(&said, &["place/out.ply", "its folder vanished meanwhile"]);
    assert!(!place.exists());
}

/// Numbers that are as good as random and the same in each run.
struct Random(u64);

impl Random {
    fn below(&mut self, end: u64) -> u64 {
        // SplitMix64 (Steele et al., Fast splittable pseudorandom number generators).
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (bits ^ (bits >> 31)) % end
    }
}

#[test]
fn a_target_is_old_or_new_after_a_hundred_kills() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    long_scan(folder, "scan.ply", 24);
    fs::create_dir(folder.join("place")).unwrap();
    let target = folder.join("place/out.ply");
    let started = Instant::now();
    run(folder, "orient scan.ply -o place/out.ply --quiet", 0);
    let micros = started.elapsed().as_micros() as u64;
    let new = fs::read(&target).unwrap();

    let mut random = Random(3);
    let (mut n_old, mut n_new, mut n_parts) = (0, 0, 0);
    for kill in 0..100 {
        fs::write(&target, OLD).unwrap();
        let words = ["orient", "scan.ply", "-o", "place/out.ply", "--overwrite", "--quiet"].map(OsStr::new);
        let mut child = normend(folder, &words).spawn().unwrap();
        // Every other kill is for the time from the first byte that is written.
        let is_in_writing = kill % 2 == 1;
        let before = parts_in(&folder.join("place"));
        while is_in_writing && parts_in(&folder.join("place")) == before && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        std::thread::sleep(Duration::from_micros(random.below(if is_in_writing {
            micros / 8
        } else {
            micros
        })));
        child.kill().unwrap();
        child.wait().unwrap();
        let found = fs::read(&target).unwrap();
        if found == OLD {
            n_old += 1;
        } else {
            assert!(
                found == new,
                "{} bytes that are neither, after {kill} kills",
                found.len()
            );
            n_new += 1;
        }
        n_parts += usize::from(!parts_in(&folder.join("place")).is_empty());
    }
    println!("100 kills: {n_old} old files whole, {n_new} new ones, {n_parts} in the middle of writing");
    assert!(n_old > 0 && n_parts > 0);
    run(folder, "orient scan.ply -o place/out.ply --overwrite --quiet", 0);
    assert!(fs::read(&target).unwrap() == new);
    assert_eq!(names_in(&folder.join("place")), ["out.ply"], "litter");
}

#[test]
fn who_may_not_write_is_told_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    sphere_without_normals(folder, "scan.ply", 300);
    let set_mode = |path: &Path, mode| fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
    set_mode(folder, 0o755);
    let is_root = fs::metadata(folder).unwrap().uid() == 0;
    let refused = |target: &str, words: &[&str]| {
        let words_typed = ["orient", "scan.ply", "-o", target, "--overwrite", "--quiet"].map(OsStr::new);
        let mut command = normend(folder, &words_typed);
        if is_root {
            // The superuser may do all.
            command.uid(NOBODY).gid(NOBODY);
        }
        let said = end(&mut command, 1);
        expect_sentence(&said, &[&[target], words].concat());
    };
    let closed = folder.join("closed");
    fs::create_dir(&closed).unwrap();
    fs::write(closed.join("out.ply"), OLD).unwrap();
    set_mode(&closed.join("out.ply"), 0o666);
    set_mode(&closed, 0o555);
    refused(
        "closed/out.ply",
        &["a folder that you may not add files to", "choose another"],
    );
    refused(
        "closed/new.ply",
        &["a folder that you may not add files to", "choose another"],
    );
    assert_eq!(fs::read(closed.join("out.ply")).unwrap(), OLD);
    set_mode(&closed, 0o755);

    let open = folder.join("open");
    fs::create_dir(&open).unwrap();
    set_mode(&open, 0o777);
    fs::write(open.join("out.ply"), OLD).unwrap();
    for mode in if is_root { vec![0o444, 0o644] } else { vec![0o444] } {
        set_mode(&open.join("out.ply"), mode);
        // The folder would let anybody replace it.
        refused("open/out.ply", &["is write-protected", "change its permissions"]);
        assert_eq!(fs::read(open.join("out.ply")).unwrap(), OLD);
    }
    assert_eq!(names_in(&open), ["out.ply"]);
    if is_root {
        // A file of another is replaced by one's own; what the old owner gave it does not come along.
        set_mode(&open.join("out.ply"), 0o4666);
        let words = ["orient", "scan.ply", "-o", "open/out.ply", "--overwrite", "--quiet"].map(OsStr::new);
        end(normend(folder, &words).uid(NOBODY).gid(NOBODY), 0);
        let metadata = fs::metadata(open.join("out.ply")).unwrap();
        assert_eq!((metadata.uid(), metadata.mode() & 0o7777), (NOBODY, 0o666));
        // The superuser gives it back to whose it was.
        run(folder, "orient scan.ply -o open/out.ply --overwrite --quiet", 0);
        assert_eq!(fs::metadata(open.join("out.ply")).unwrap().uid(), NOBODY);
    }
}

#[test]
fn links_names_and_modes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    sphere_without_normals(folder, "scan.ply", 300);
    let orient = |target: &OsStr, code| {
        let arguments = [OsStr::new("orient"), "scan.ply".as_ref(), "-o".as_ref(), target];
        end(normend(folder, &arguments).arg("--overwrite"), code)
    };
    // A chain of links through another folder, and back by a relative one.
    fs::create_dir(folder.join("sub")).unwrap();
    let real = folder.join("real.ply");
    fs::write(&real, OLD).unwrap();
    fs::set_permissions(&real, Permissions::from_mode(0o2640)).unwrap();
    symlink("../real.ply", folder.join("sub/second.ply")).unwrap();
    symlink("sub/second.ply", folder.join("first.ply")).unwrap();
    orient("first.ply".as_ref(), 0);
    assert_ne!(fs::read(&real).unwrap(), OLD);
    assert_eq!(fs::metadata(&real).unwrap().mode() & 0o7777, 0o2640);
    assert!(fs::symlink_metadata(folder.join("first.ply")).unwrap().is_symlink());
    assert!(
        fs::symlink_metadata(folder.join("sub/second.ply"))
            .unwrap()
            .is_symlink()
    );
    assert_eq!(names_in(&folder.join("sub")), ["second.ply"]);
    symlink("sub/none/later.ply", folder.join("dangling.ply")).unwrap();
    expect_last(
        &orient("dangling.ply".as_ref(), 1),
        "lies in a folder that does not exist",
    );

    // Another name of the file is left alone, and that is said.
    let (one, other) = (folder.join("one.ply"), folder.join("other.ply"));
    fs::write(&one, OLD).unwrap();
    fs::hard_link(&one, &other).unwrap();
    assert!(is_same_file(&one, &other) && n_other_names(&one) == 1);
    assert!(orient("one.ply".as_ref(), 0).contains("one.ply has 1 other name (hard links)"));
    assert_eq!(fs::read(&other).unwrap(), OLD);
    assert!(!is_same_file(&one, &other) && n_other_names(&one) == 0);

    // Names that are as long as can be, too long, and no text.
    let longest = OsString::from(format!("{}.ply", "n".repeat(251)));
    orient(&longest, 0);
    assert!(folder.join(&longest).is_file());
    let too_long = OsString::from(format!("{}.ply", "n".repeat(252)));
    expect_last(&orient(&too_long, 1), "the name is too long");
    let no_text = OsString::from_vec(b"\xff\xfe \xf0.ply".to_vec());
    orient(&no_text, 0);
    assert!(folder.join(&no_text).is_file());
    assert!(parts_in(folder).is_empty());
}

fn expect_last(said: &str, words: &str) {
    let last = said.trim_end().lines().last().unwrap_or_default();
    assert!(last.contains(words), "no {words:?} in {said}");
}

#[test]
fn an_input_that_another_program_changed_is_not_replaced_unasked() {
    let folder = tempfile::tempdir().unwrap();
    let path = sphere_without_normals(folder.path(), "scan.ply", 300);
    let scan = normend_io::read(&path, &Silent).unwrap();
    let normals = normend_core::shapes::sphere(300).normals;
    let options = |overwrite_changed| WriteOptions {
        rule: "outward".to_owned(),
        overwrite_input: true,
        overwrite_changed,
    };
    let as_read = scan.identity("scan.ply");
    assert!(!scan.is_changed_on_disk());
    // Written over by this very program, it is known again, and again.
    for _ in 0..2 {
        scan.write(&normals, &path, &options(false), &Silent).unwrap();
        assert!(!scan.is_changed_on_disk());
        let again = normend_io::read(&path, &Silent).unwrap();
        assert_eq!(again.identity("scan.ply"), scan.identity("scan.ply"));
        assert!(!as_read.is_same_content(&scan.identity("scan.ply")));
        assert_eq!(again.given_normals.unwrap().as_slice(), normals);
    }
    fs::write(&path, "of another program").unwrap();
    assert!(scan.is_changed_on_disk());
    let error = scan.write(&normals, &path, &options(false), &Silent).unwrap_err();
    assert!(matches!(error, WriteError::InputChanged { .. }));
    assert!(
        error
            .to_string()
            .contains("scan.ply was changed by another program after it was read: open it again")
    );
    assert_eq!(fs::read(&path).unwrap(), b"of another program");
    scan.write(&normals, &path, &options(true), &Silent).unwrap();
    assert!(!scan.is_changed_on_disk());
    // What is gone is no loss.
    fs::remove_file(&path).unwrap();
    assert!(!scan.is_changed_on_disk());
}

/// Waits until the editor says or shows `words`.
fn wait_for_words(editor: &mut Editor, words: &str) {
    for _ in 0..2000 {
        if editor.said(words) || editor.shows(words) {
            editor.harness.run_steps(2);
            return;
        }
        editor.harness.step();
        std::thread::sleep(Duration::from_millis(5));
    }
    panic!("{words:?} was not said: {:?}", editor.app().messages().entries());
}

/// Leaves a picture of the window where a person can look at it.
fn picture_of(editor: &mut Editor, name: &str) {
    let picture = editor.harness.render().unwrap();
    picture.save(Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)).unwrap();
}

#[test]
fn the_editor_says_that_the_disk_is_full_and_keeps_the_mends() {
    if !has_own_mounts("the_editor_says_that_the_disk_is_full_and_keeps_the_mends") {
        return;
    }
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    let disk = Disk::mount(editor.folder.path().join("disk"), "1m");
    let target = disk.0.join("out.ply");
    fs::write(&target, OLD).unwrap();
    disk.fill(8192);
    editor.wait_until_oriented();
    editor.mend();
    let mended = editor.normals();
    editor.export_to(&target);
    editor.harness.get_by_label("Replace the existing file").click();
    editor.harness.run_steps(2);
    editor.click_button("Export");
    wait_for_words(&mut editor, "the disk is full, there was room for only");
    assert!(editor.shows("out.ply was not written."));
    picture_of(&mut editor, "writing_full_disk.png");
    assert!(editor.app().is_unsaved());
    assert_eq!(editor.export_path(), Some(target.display().to_string()));
    assert_eq!(fs::read(&target).unwrap(), OLD);
    assert!(parts_in(&disk.0).is_empty());
    // With room, the same window goes on.
    fs::remove_file(disk.0.join("filler")).unwrap();
    editor.harness.get_by_label("Replace the existing file").click();
    editor.harness.run_steps(2);
    editor.click_button("Export");
    editor.wait("the export", |app| !app.is_busy() && !app.is_unsaved());
    let written = normend_io::read(&target, &Silent).unwrap();
    assert_eq!(written.given_normals.unwrap().as_slice(), mended);
}

/// Exports over the scan that is open.
fn export_over(editor: &mut Editor, scan: &Path, tick: &str) {
    editor.key(Modifiers::COMMAND, Key::E);
    editor.type_export_path(scan);
    editor.harness.get_by_label(tick).click();
    editor.harness.run_steps(2);
    editor.click_button("Export");
    editor.wait("the export", |app| !app.is_busy() && !app.is_unsaved());
}

#[test]
fn a_scan_that_is_written_over_goes_on_and_its_edits_come_back() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    let scan = editor.folder.path().join("sphere.ply");
    editor.wait_until_oriented();
    let opened = editor.normals();
    editor.mend();
    export_over(&mut editor, &scan, "Replace the scan that was opened");
    let on_disk = || {
        normend_io::read(&scan, &Silent)
            .unwrap()
            .given_normals
            .unwrap()
            .to_vec()
    };
    assert_eq!(on_disk(), editor.normals());
    // Undo goes back behind the export, to what the file was.
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(editor.normals(), opened);
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(on_disk(), editor.normals());

    // More is mended and exported to the same file, which asks for no more than before.
    editor.harness.state_mut().act(Asked::SelectAllSources.into());
    editor.harness.state_mut().act(Asked::FlipSources.into());
    editor.wait("a second edit", |app| app.document().unwrap().n_done() == 2);
    assert!(editor.app().is_unsaved());
    export_over(&mut editor, &scan, "Replace the scan that was opened");
    assert_eq!(on_disk(), editor.normals());
    editor.harness.state_mut().act(Asked::FlipSources.into());
    editor.wait("a third edit", |app| app.document().unwrap().n_done() == 3);
    let (normals, state) = (editor.normals(), editor.app().document().unwrap().state().clone());
    assert_ne!(on_disk(), normals);

    // The journal belongs to what stands there now; it is written anew beside the window.
    let deadline = Instant::now() + PATIENCE;
    let identity = normend_io::read(&scan, &Silent).unwrap().identity("sphere.ply");
    let [journal] = &editor.journals()[..] else {
        panic!("not one journal")
    };
    let journal = journal.clone();
    let head = || normend_io::recipe::read(&journal).unwrap().recipe.head.scan;
    while !head().is_same_content(&identity) {
        assert!(Instant::now() < deadline, "the journal is of {:?}", head());
        std::thread::sleep(Duration::from_millis(20));
    }
    let mut editor = editor.crash_and_start(&scan);
    editor.wait_until_oriented();
    assert!(editor.shows("Restore 3 edits?"));
    editor.click_button("Restore");
    editor.wait_until_oriented();
    assert_eq!(editor.app().document().unwrap().state(), &state);
    assert_eq!(editor.normals(), normals);
    assert!(editor.app().is_unsaved());
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(editor.app().document().unwrap().n_done(), 1);
    // Exported once more, there is nothing to restore.
    export_over(&mut editor, &scan, "Replace the scan that was opened");
    assert_eq!(on_disk(), editor.normals());
    let mut editor = editor.crash_and_start(&scan);
    editor.wait_until_oriented();
    assert!(!editor.shows("Restore") && editor.journals().is_empty());
}

#[test]
fn the_editor_asks_before_changes_of_another_program_are_lost() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    let scan = editor.folder.path().join("sphere.ply");
    editor.wait_until_oriented();
    editor.mend();
    let mended = editor.normals();
    editor.key(Modifiers::COMMAND, Key::E);
    editor.type_export_path(&scan);
    editor.harness.get_by_label("Replace the scan that was opened").click();
    editor.harness.run_steps(2);
    // It changes while the window is open.
    fs::write(&scan, "of another program").unwrap();
    editor.click_button("Export");
    wait_for_words(&mut editor, "was changed by another program after it was read");
    assert_eq!(fs::read(&scan).unwrap(), b"of another program");
    assert!(editor.app().is_unsaved());
    editor.key(Modifiers::NONE, Key::Escape);

    // From now on the window says so at once.
    editor.key(Modifiers::COMMAND, Key::E);
    editor.type_export_path(&scan);
    assert!(editor.shows("Another program has changed this file since it was opened."));
    picture_of(&mut editor, "writing_changed_input.png");
    editor.key(Modifiers::NONE, Key::Enter);
    assert_eq!(fs::read(&scan).unwrap(), b"of another program");
    editor
        .harness
        .get_by_label("Replace the scan, and lose those changes")
        .click();
    editor.harness.run_steps(2);
    editor.click_button("Export");
    editor.wait("the export", |app| !app.is_busy() && !app.is_unsaved());
    let written = normend_io::read(&scan, &Silent).unwrap();
    assert_eq!(written.given_normals.unwrap().as_slice(), mended);
}

#[test]
fn a_second_editor_of_a_scan_is_told_of_the_first() {
    let Some(mut first) = start(sphere_with_wrong_cap) else {
        return;
    };
    let scan = first.folder.path().join("sphere.ply");
    first.wait_until_oriented();
    first.mend();
    let words = "Another editor has edits of this scan";
    assert!(!first.said(words));
    let state = first.folder.path().join("settings/state/journals");
    let Some(mut second) = start(|folder| {
        let here = folder.join("settings/state");
        fs::create_dir_all(&here).unwrap();
        symlink(&state, here.join("journals")).unwrap();
        Some(scan.clone())
    }) else {
        return;
    };
    second.wait_until_oriented();
    assert!(second.said(words), "{:?}", second.app().messages().entries());
    assert!(!second.shows("Restore"));
}
