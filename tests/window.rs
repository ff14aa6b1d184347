//! The real program in a real window, on a virtual display, with a pointer and keys: open, mend, undo, redo, export.
//!
//! Needs Xvfb, xdotool and a graphics driver. Where one is missing the test says that it is skipped, and fails when
//! `NORMEND_REQUIRE_GPU=1`. X11 is what can be driven without a person, so this runs on Linux only.

#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// How long to wait for anything before the test fails; a guard against waiting forever, not a measure.
const PATIENCE: Duration = Duration::from_secs(240);
const POLL: Duration = Duration::from_millis(100);
/// Half the side of the square in which colors are counted, in pixels: larger than the mark of a source.
const REACH: usize = 16;

/// Clicks after the first that the scan may need; more would mean that clicks do not mend.
const MOST_CLICKS: usize = 4;

type Pixel = (usize, usize);

/// A child that is ended with the test, however it ends.
struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A virtual display whose pixels lie in a file.
struct Display {
    _server: Killed,
    name: String,
    framebuffer: PathBuf,
}

impl Display {
    fn start(folder: &Path) -> Self {
        let frames = folder.join("frames");
        fs::create_dir(&frames).unwrap();
        // The server picks a free number and writes it to its standard output.
        let mut server = Command::new("Xvfb")
            .args([
                "-displayfd",
                "1",
                "-screen",
                "0",
                "1280x900x24",
                "-nolisten",
                "tcp",
                "-noreset",
                "-fbdir",
            ])
            .arg(&frames)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap())
            .read_line(&mut number)
            .unwrap();
        let name = format!(":{}", number.trim().parse::<u32>().unwrap());
        Self {
            _server: Killed(server),
            name,
            framebuffer: frames.join("Xvfb_screen0"),
        }
    }

    fn shot(&self) -> Shot {
        Shot::from_xwd(&fs::read(&self.framebuffer).unwrap())
    }

    fn xdotool(&self, arguments: &[&str]) {
        let output = Command::new("xdotool")
            .args(arguments)
            .env("DISPLAY", &self.name)
            .output()
            .unwrap();
        assert!(
            output.status.success(),
            "xdotool {arguments:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
    }

    fn move_pointer(&self, (x, y): Pixel) {
        self.xdotool(&["mousemove", &x.to_string(), &y.to_string()]);
    }

    /// Waits until the picture stays the same for half a second.
    fn wait_for_rest(&self) {
        let mut last = self.shot();
        let mut n_same = 0;
        self.wait_for("a picture at rest", |_| {
            let shot = self.shot();
            n_same = if shot == last { n_same + 1 } else { 0 };
            last = shot;
            (n_same >= 5).then_some(())
        });
    }

    /// Waits until `is_there` accepts a picture; fails with `what` and the last picture in a file.
    fn wait_for<T>(&self, what: &str, mut is_there: impl FnMut(&Shot) -> Option<T>) -> T {
        let started = Instant::now();
        loop {
            let shot = self.shot();
            if let Some(found) = is_there(&shot) {
                return found;
            }
            if started.elapsed() > PATIENCE {
                let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("window.png");
                shot.save(&path);
                panic!("{what} did not come; the last picture is {}", path.display());
            }
            std::thread::sleep(POLL);
        }
    }
}

/// A picture of the screen, rows of RGB from the top.
#[derive(PartialEq)]
struct Shot {
    width: usize,
    height: usize,
    rgb: Vec<[u8; 3]>,
}

impl Shot {
    /// Reads an X window dump (XWDFile.h): a header of big-endian words, a color table, rows of 32-bit pixels.
    fn from_xwd(bytes: &[u8]) -> Self {
        let word = |index: usize| {
            let bytes: [u8; 4] = bytes[4 * index..4 * index + 4].try_into().unwrap();
            u32::from_be_bytes(bytes) as usize
        };
        let (header_size, version, width, height) = (word(0), word(1), word(4), word(5));
        let (is_big_endian, bits_per_pixel, bytes_per_line, n_colors) = (word(7) == 1, word(11), word(12), word(19));
        assert_eq!(
            (version, bits_per_pixel, is_big_endian),
            (7, 32, false),
            "an unknown kind of framebuffer"
        );
        let rows = bytes[header_size + 12 * n_colors..]
            .chunks_exact(bytes_per_line)
            .take(height);
        let rgb: Vec<[u8; 3]> = rows
            .flat_map(|row| row[..4 * width].chunks_exact(4).map(|bgrx| [bgrx[2], bgrx[1], bgrx[0]]))
            .collect();
        assert_eq!(rgb.len(), width * height);
        Self { width, height, rgb }
    }

    fn save(&self, path: &Path) {
        image::save_buffer(
            path,
            self.rgb.as_flattened(),
            self.width as u32,
            self.height as u32,
            image::ColorType::Rgb8,
        )
        .unwrap();
    }

    /// How many pixels differ.
    fn n_changed_since(&self, before: &Self) -> usize {
        self.rgb
            .iter()
            .zip(&before.rgb)
            .filter(|(now, before)| now != before)
            .count()
    }

    fn is_orange(&self, x: usize, y: usize) -> bool {
        let [red, _, blue] = self.rgb[y * self.width + x].map(i32::from);
        red > blue + 50
    }

    /// Share of orange in the square of [`REACH`] around a pixel, in 0..=1.
    fn orange_around(&self, (x, y): Pixel) -> f64 {
        let (left, right) = (x.saturating_sub(REACH), (x + REACH).min(self.width - 1));
        let (top, bottom) = (y.saturating_sub(REACH), (y + REACH).min(self.height - 1));
        let pixels = (top..=bottom).flat_map(|y| (left..=right).map(move |x| (x, y)));
        let (mut n, mut n_orange) = (0_u32, 0_u32);
        for (x, y) in pixels {
            n += 1;
            n_orange += u32::from(self.is_orange(x, y));
        }
        f64::from(n_orange) / f64::from(n)
    }

    /// The pixel that is deepest inside an orange patch: the center of the largest all-orange square; `None` when that
    /// is smaller than the square of [`orange_around`](Self::orange_around).
    fn middle_of_orange(&self) -> Option<Pixel> {
        // Side of the largest all-orange square that ends at each pixel: one more than the least of three before it.
        let mut sides = vec![0_usize; self.rgb.len()];
        let (mut largest, mut end) = (0, (0, 0));
        for y in 1..self.height {
            for x in 1..self.width {
                let here = y * self.width + x;
                if self.is_orange(x, y) {
                    sides[here] = 1 + sides[here - 1]
                        .min(sides[here - self.width])
                        .min(sides[here - self.width - 1]);
                }
                if sides[here] > largest {
                    (largest, end) = (sides[here], (x, y));
                }
            }
        }
        (largest > 2 * REACH).then(|| (end.0 - largest / 2, end.1 - largest / 2))
    }
}

/// The program, run to its end in `folder`.
fn finished(folder: &Path, typed: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_normend"))
        .args(typed.split_whitespace())
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

/// What the program writes to standard output; it must succeed.
fn normend(folder: &Path, typed: &str) -> String {
    let output = finished(folder, typed);
    assert!(
        output.status.success(),
        "normend {typed}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).unwrap()
}

fn n_wrong(folder: &Path, result: &str) -> u64 {
    let report: Value = serde_json::from_str(&normend(
        folder,
        &format!("check {result} --reference truth.ply --json"),
    ))
    .unwrap();
    report["wrong"].as_u64().unwrap()
}

/// Whether everything is there to show `scan` in a window; says so when not, and fails where it must be there.
fn can_run(folder: &Path, scan: &str) -> bool {
    let mut missing = Vec::new();
    for program in ["Xvfb", "xdotool"] {
        let found = Command::new(program)
            .arg("-help")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        if found.is_err() {
            missing.push(program);
        }
    }
    let rendered = finished(folder, &format!("render {scan} -o picture.png --quiet"));
    if String::from_utf8_lossy(&rendered.stderr).contains("mesa-vulkan-drivers") {
        missing.push("a graphics driver");
    }
    if missing.is_empty() {
        return true;
    }
    let is_required = std::env::var_os("NORMEND_REQUIRE_GPU").is_some_and(|value| value == "1");
    assert!(!is_required, "missing: {missing:?}; scripts/setup test installs them");
    println!("skipped: missing {missing:?}");
    false
}

/// The editor on that display, with everything of its own in `folder` and its log in the file `log`.
fn editor(folder: &Path, display: &Display) -> Command {
    let mut editor = Command::new(env!("CARGO_BIN_EXE_normend"));
    editor
        .current_dir(folder)
        .env("DISPLAY", &display.name)
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .env("NORMEND_CONFIG_DIR", folder.join("config"))
        .env("NORMEND_STATE_DIR", folder.join("state"))
        .env("XDG_RUNTIME_DIR", folder)
        .env("RUST_LOG", "normend_app=debug")
        .stdin(Stdio::null())
        .stderr(fs::File::create(folder.join("log")).unwrap());
    editor
}

#[test]
fn the_editor_comes_back_when_the_graphics_device_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    normend(folder, "generate part -o scan.ply --points 20000");
    normend(folder, "orient scan.ply -o before.ply --preset tree --quiet");
    if !can_run(folder, "before.ply") {
        return;
    }
    let display = Display::start(folder);
    let log = || fs::read_to_string(folder.join("log")).unwrap();
    let mut first = Killed(
        editor(folder, &display)
            .arg("before.ply")
            .env("NORMEND_LOSE_DEVICE", "1")
            .spawn()
            .unwrap(),
    );
    let status = display.wait_for("the end of the first editor", |_| first.0.try_wait().unwrap());
    assert!(status.success(), "{status}: {}", log());
    // The second one is a child of the first; it writes to the same log and ends with the display.
    display.wait_for("the second editor", |_| {
        log().contains("so Normend started again with your scan").then_some(())
    });
    display.wait_for("the scan in its window", |shot| {
        let is_front = |[red, _, blue]: &&[u8; 3]| i32::from(*blue) > i32::from(*red) + 40;
        (shot.rgb.iter().filter(is_front).count() > 5000).then_some(())
    });
    let log = log();
    let n_opened = log.matches("Kept the given normals of 20,000 points").count();
    assert_eq!(n_opened, 2, "both show the same scan: {log}");
    // A lost device is no fault of the program, so there is nothing to report.
    let state = fs::read_dir(folder.join("state")).into_iter().flatten();
    let names: Vec<_> = state.map(|entry| entry.unwrap().file_name()).collect();
    let is_report = |name: &std::ffi::OsString| name.to_string_lossy().starts_with("crash-");
    assert!(!names.iter().any(is_report), "{names:?}");
    display.xdotool(&["search", "--onlyvisible", "--name", "Normend", "windowfocus", "--sync"]);
    display.xdotool(&["key", "ctrl+q"]);
}

#[test]
fn a_crash_leaves_a_report_that_the_next_start_names() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    normend(folder, "generate part -o scan.ply --points 2000");
    if !can_run(folder, "scan.ply") {
        return;
    }
    let display = Display::start(folder);
    let log = || fs::read_to_string(folder.join("log")).unwrap();
    let mut crashing = Killed(editor(folder, &display).env("NORMEND_PANIC", "1").spawn().unwrap());
    let status = display.wait_for("the end of the editor", |_| crashing.0.try_wait().unwrap());
    assert_eq!(status.code(), Some(1), "{}", log());
    let reports: Vec<_> = fs::read_dir(folder.join("state"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "txt"))
        .collect();
    assert_eq!(reports.len(), 1, "{reports:?}");
    let path = reports[0].display().to_string();
    assert!(log().contains(&format!("A report is at {path}")), "{}", log());
    let report = fs::read_to_string(&reports[0]).unwrap();
    for part in [
        "this panic was asked for",
        "Graphics: ",
        "Backtrace:",
        env!("CARGO_PKG_VERSION"),
    ] {
        assert!(report.contains(part), "{part}: {report}");
    }
    // The next start names it once.
    for is_told in [true, false] {
        let mut next = Killed(editor(folder, &display).spawn().unwrap());
        let blank = display.shot();
        display.wait_for("the window", |shot| {
            (shot.n_changed_since(&blank) > 50_000).then_some(())
        });
        display.wait_for_rest();
        assert_eq!(
            log().contains("Normend closed unexpectedly the last time"),
            is_told,
            "{}",
            log()
        );
        display.xdotool(&["search", "--onlyvisible", "--name", "Normend", "windowfocus", "--sync"]);
        display.xdotool(&["key", "ctrl+q"]);
        let status = display.wait_for("the end of the editor", |_| next.0.try_wait().unwrap());
        assert!(status.success(), "{}", log());
    }
}

#[test]
fn work_that_panics_leaves_a_report_and_the_editor() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    normend(folder, "generate part -o scan.ply --points 2000");
    if !can_run(folder, "scan.ply") {
        return;
    }
    let display = Display::start(folder);
    let log = || fs::read_to_string(folder.join("log")).unwrap();
    let mut command = editor(folder, &display);
    let mut editor = Killed(command.env("NORMEND_PANIC", "work").arg("scan.ply").spawn().unwrap());
    display.wait_for("the message", |_| {
        log().contains("An internal error stopped this work").then_some(())
    });
    display.wait_for_rest();
    let report = fs::read_dir(folder.join("state"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .find(|path| path.file_name().unwrap().to_string_lossy().starts_with("work-"))
        .unwrap();
    assert!(
        log().contains(&format!("A report is at {}", report.display())),
        "{}",
        log()
    );
    let text = fs::read_to_string(report).unwrap();
    assert!(
        text.contains("had to stop some work") && text.contains("this panic was asked for"),
        "{text}"
    );
    display.xdotool(&["search", "--onlyvisible", "--name", "Normend", "windowfocus", "--sync"]);
    display.xdotool(&["key", "ctrl+q"]);
    let status = display.wait_for("the end of the editor", |_| editor.0.try_wait().unwrap());
    assert!(status.success(), "{}", log());
}

#[test]
fn a_wrong_patch_is_mended_in_the_window() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // As the bundled sample: oriented by a method that leaves a patch wrong.
    normend(
        folder,
        "generate part -o scan.ply --truth truth.ply --points 60000 --noise 0.0006",
    );
    normend(folder, "orient scan.ply -o before.ply --preset tree --quiet");
    if !can_run(folder, "before.ply") {
        return;
    }
    let n_wrong_before = n_wrong(folder, "before.ply");
    assert!(n_wrong_before > 0, "the scan needs a wrong patch");

    let display = Display::start(folder);
    let log = || fs::read_to_string(folder.join("log")).unwrap();
    let mut editor = Killed(editor(folder, &display).arg("before.ply").spawn().unwrap());
    // Where the pointer highlights nothing.
    let aside = (4, display.shot().height - 4);
    display.move_pointer(aside);
    let patch = display.wait_for("an orange patch", |shot| {
        let ended = editor.0.try_wait().unwrap();
        assert!(ended.is_none(), "the editor ended: {ended:?}: {}", log());
        shot.middle_of_orange()
    });
    // Without a window manager nobody gives the keyboard to the window.
    display.xdotool(&["search", "--onlyvisible", "--name", "Normend", "windowfocus", "--sync"]);
    let expect_orange = |what: &str, at: Pixel, is_expected: fn(f64) -> bool| {
        display.move_pointer(aside);
        display.wait_for(what, |shot| is_expected(shot.orange_around(at)).then_some(()));
    };
    let click = |at: Pixel| {
        display.move_pointer(at);
        display.xdotool(&["click", "1"]);
        expect_orange("the mended patch", at, |share| share < 0.3);
    };
    click(patch);
    display.xdotool(&["key", "ctrl+z"]);
    expect_orange("the patch after undo", patch, |share| share > 0.9);
    display.xdotool(&["key", "ctrl+shift+z"]);
    expect_orange("the patch after redo", patch, |share| share < 0.3);
    // Whatever else is seen wrong, as users do.
    for _ in 0..MOST_CLICKS {
        display.wait_for_rest();
        match display.shot().middle_of_orange() {
            Some(patch) => click(patch),
            None => break,
        }
    }

    let before_export = display.shot();
    display.xdotool(&["key", "ctrl+e"]);
    display.wait_for("the export window", |shot| {
        (shot.n_changed_since(&before_export) > 5000).then_some(())
    });
    let target = folder.join("after.ply");
    display.xdotool(&["key", "ctrl+a"]);
    display.xdotool(&["type", "--delay", "20", &target.display().to_string()]);
    display.xdotool(&["key", "Return"]);
    display.wait_for("the exported file", |_| target.exists().then_some(()));
    let n_wrong_after = n_wrong(folder, "after.ply");
    assert!(
        n_wrong_after < n_wrong_before,
        "{n_wrong_after} wrong after the mend, {n_wrong_before} before"
    );

    // Nothing is unsaved, so the editor closes without asking.
    display.wait_for_rest();
    display.xdotool(&["key", "ctrl+q"]);
    let status = display.wait_for("the end of the editor", |_| editor.0.try_wait().unwrap());
    let log = log();
    assert!(status.success(), "{status}: {log}");
    // Colors are for terminals, not for files.
    assert!(log.contains("DEBUG normend_app") && !log.contains('\x1b'), "{log:?}");
}
