//! What is left of a mending when the process that does it is killed at any moment: every edit that was acknowledged.
//!
//! Most kills are of the program without a window, which does the events of a recipe one after another through the editor's session
//! and journal; some are of the editor in its window, on a virtual display.

#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use glam::Vec3;
use normend_core::document::{FlipReason, Viewer};
use normend_core::{Document, Edit, PointSet, Propagation, Silent, shapes};
use normend_io::recipe::{self, End, Event, Recipe, RecordedStep};

/// A guard against waiting forever, not a measure.
const PATIENCE: Duration = Duration::from_secs(240);

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

/// A mending of `n_events` events of all kinds, as the editor would record it.
fn scripted(scan: &normend_io::Scan, name: &str, n_events: usize) -> Recipe {
    let parameters = normend_app::session::Session::new(scan.clone(), name.to_owned())
        .document
        .parameters();
    let given = scan.given_normals.as_ref().map(|normals| normals.as_slice());
    let propagation = Propagation::new(&scan.cloud, given, parameters, &Silent).unwrap();
    let mut document = Document::new(scan.cloud.clone(), scan.given_normals.clone()).with_parameters(parameters);
    document.install(propagation);
    let n_points = scan.cloud.n_points() as u64;
    let mut random = Random(7);
    let mut events = Vec::new();
    while events.len() < n_events {
        let point = random.below(n_points) as u32;
        // Some edits are of thousands of points: their lines are long enough to be cut off.
        let points: PointSet = (0..random.below(n_points / 2) as u32)
            .filter(|_| random.below(3) > 0)
            .collect();
        let edit = match random.below(12) {
            0..3 => Edit::Mend(point),
            3 => Edit::TurnWhole(point),
            4 => Edit::FlipPoints {
                points,
                reason: FlipReason::Asked,
            },
            5 => Edit::Pin(points),
            6 => Edit::Unpin(points),
            7 => Edit::Select(points),
            8 => Edit::FlipPoints {
                points: document.facing_away(&points, Viewer::At(Vec3::splat(9.0))).unwrap(),
                reason: FlipReason::FaceMe,
            },
            9 | 10 => {
                if document.undo().is_some() {
                    events.push(Event::Undo);
                }
                continue;
            }
            _ => {
                if document.redo().is_some() {
                    events.push(Event::Redo);
                }
                continue;
            }
        };
        let before = document.revision();
        if document.apply(edit).is_err() || document.revision() == before {
            continue;
        }
        let step = document.next_undo().unwrap();
        events.push(Event::Step(RecordedStep {
            kind: step.kind(),
            change: step.change().clone(),
            n_turned: step.n_turned(),
        }));
    }
    Recipe {
        head: recipe::Head::new(scan.identity(name), parameters),
        events,
    }
}

/// The one journal of the folder, as it is; `None` when there is none.
fn journal(state: &Path) -> Option<PathBuf> {
    let entries = fs::read_dir(state.join("journals")).into_iter().flatten();
    let paths = entries.map(|entry| entry.unwrap().path());
    let mut journals: Vec<PathBuf> = paths
        .filter(|path| path.extension().is_some_and(|extension| extension == "journal"))
        .collect();
    assert!(journals.len() <= 1, "{journals:?}");
    journals.pop()
}

/// Waits some microseconds: long sleeps are not as fine as the moments that are to be met.
fn wait(micros: u64) {
    let end = Instant::now() + Duration::from_micros(micros);
    while Instant::now() < end {
        std::thread::yield_now();
    }
}

#[test]
fn nothing_that_was_acknowledged_is_lost_in_two_hundred_kills() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let shape = shapes::sphere(2000);
    let path = folder.join("scan.ply");
    normend_io::write_points(
        &path,
        normend_io::Positions::Float(&shape.positions),
        Some(&shape.normals),
        &Silent,
    )
    .unwrap();
    let scan = normend_io::read(&path, &Silent).unwrap();
    let script = scripted(&scan, "scan.ply", 1500);
    script.write(&folder.join("script.normend")).unwrap();

    let mut random = Random(1);
    let (mut n_kills, mut n_cut_off, mut n_whole, mut n_runs) = (0, 0, 0, 0);
    let mut n_before = 0;
    while n_kills < 200 {
        n_runs += 1;
        let mut child = Command::new(env!("CARGO_BIN_EXE_normend"))
            .args(["rehearse", "script.normend", "scan.ply"])
            .current_dir(folder)
            .env("NORMEND_STATE_DIR", folder.join("state"))
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        // What the journal held at the start; then the edits come.
        out.read_line(&mut line).unwrap();
        let restored: usize = line.trim().parse().unwrap();
        assert_eq!(restored, n_before, "all that was in the journal is restored");
        wait(random.below(40_000));
        child.kill().unwrap();
        child.wait().unwrap();
        // What it said before it died, but not a number that is cut off.
        let rest: Vec<String> = out
            .split(b'\n')
            .map(|line| String::from_utf8(line.unwrap()).unwrap())
            .collect();
        let acknowledged = rest.iter().filter_map(|line| line.parse().ok()).max();
        let acknowledged: usize = acknowledged.unwrap_or(restored);
        let Some(journal) = journal(&folder.join("state")) else {
            assert_eq!(acknowledged, 0);
            n_kills += 1;
            continue;
        };
        let reading = recipe::read(&journal).unwrap();
        match reading.end {
            End::Whole => n_whole += 1,
            End::CutOff => n_cut_off += 1,
            End::Damaged(broken) => panic!("a corrupt journal after {n_kills} kills: {broken}"),
        }
        let n_events = reading.recipe.events.len();
        // A number may be cut off, so that a smaller one was read; never one that is too large.
        assert!(
            n_events >= acknowledged,
            "{acknowledged} acknowledged, {n_events} in the journal"
        );
        assert_eq!(reading.recipe.head.scan, script.head.scan);
        assert_eq!(reading.recipe.events, script.events[..n_events]);
        n_before = n_events;
        if n_events == script.events.len() {
            // All is done; from the beginning.
            fs::remove_file(journal).unwrap();
            n_before = 0;
        } else {
            n_kills += 1;
        }
    }
    println!(
        "{n_kills} kills in {n_runs} runs: {n_whole} journals whole, {n_cut_off} cut off in their last line, none damaged"
    );
    assert!(n_whole > 0);
}

/// A child that is ended with the test, however it ends.
struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A virtual display, its name and its server.
fn display() -> Option<(Killed, String)> {
    let mut server = Command::new("Xvfb")
        .args([
            "-displayfd",
            "1",
            "-screen",
            "0",
            "1000x700x24",
            "-nolisten",
            "tcp",
            "-noreset",
        ])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .ok()?;
    let mut number = String::new();
    BufReader::new(server.stdout.take().unwrap())
        .read_line(&mut number)
        .unwrap();
    Some((Killed(server), format!(":{}", number.trim())))
}

fn xdotool(display: &str, arguments: &[&str]) -> bool {
    let status = Command::new("xdotool")
        .args(arguments)
        .env("DISPLAY", display)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|status| status.success())
}

/// Begins to type edits into the editor's window: keys that come as fast as frames.
fn type_keys(display: &str) -> Killed {
    // Without a window manager nobody gives the keyboard to the window.
    xdotool(
        display,
        &["search", "--onlyvisible", "--name", "Normend", "windowfocus", "--sync"],
    );
    xdotool(display, &["mousemove", "330", "380"]);
    // A mend, or what it made is selected; flips of that, undo, redo.
    let keys = ["Return", "Return", "x", "x", "ctrl+z", "ctrl+shift+z", "x"];
    let typing = Command::new("xdotool")
        .args(["key", "--delay", "15"])
        .args(keys.repeat(40))
        .env("DISPLAY", display)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn();
    Killed(typing.unwrap())
}

/// Whether a window can be shown; fails where it must be.
fn can_run(folder: &Path) -> bool {
    let rendered = Command::new(env!("CARGO_BIN_EXE_normend"))
        .args(["render", "scan.ply", "-o", "picture.png", "--quiet"])
        .current_dir(folder)
        .env("XDG_RUNTIME_DIR", folder)
        .output()
        .unwrap();
    let can_point = display().is_some_and(|(_server, display)| xdotool(&display, &["getmouselocation"]));
    let can = rendered.status.success() && can_point;
    let is_required = std::env::var_os("NORMEND_REQUIRE_GPU").is_some_and(|value| value == "1");
    assert!(
        can || !is_required,
        "Xvfb, xdotool or a graphics driver is missing; scripts/setup test installs them"
    );
    if !can {
        println!("skipped: Xvfb, xdotool or a graphics driver is missing");
    }
    can
}

#[test]
fn edits_survive_kills_of_the_window() {
    const N_KILLS: usize = 12;
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let shape = shapes::sphere(4000);
    let positions = normend_io::Positions::Float(&shape.positions);
    normend_io::write_points(&folder.join("scan.ply"), positions, Some(&shape.normals), &Silent).unwrap();
    if !can_run(folder) {
        return;
    }
    let (_server, display) = display().unwrap();
    let log = || fs::read_to_string(folder.join("log")).unwrap_or_default();
    let n_logged = |words: &str| log().matches(words).count();
    let mut random = Random(3);
    let mut events: Vec<Event> = Vec::new();
    let (mut n_acknowledged, mut n_cut_off) = (0, 0);
    for n_kills in 0..N_KILLS {
        let mut editor = Killed(
            Command::new(env!("CARGO_BIN_EXE_normend"))
                .args(["scan.ply", "--restore"])
                .current_dir(folder)
                .env("DISPLAY", &display)
                .env_remove("WAYLAND_DISPLAY")
                .env_remove("WAYLAND_SOCKET")
                .env("NORMEND_CONFIG_DIR", folder.join("config"))
                .env("NORMEND_STATE_DIR", folder.join("state"))
                .env("XDG_RUNTIME_DIR", folder)
                .env("RUST_LOG", "normend_app=debug")
                .stdin(Stdio::null())
                .stderr(fs::File::create(folder.join("log")).unwrap())
                .spawn()
                .unwrap(),
        );
        let started = Instant::now();
        let restored = format!(
            "Restored {} edit",
            normend_app::theme::thousands(n_in_force(&events) as u64)
        );
        let is_ready = || n_logged("Kept the given normals") > 0 && (events.is_empty() || n_logged(&restored) > 0);
        while !is_ready() {
            assert!(editor.0.try_wait().unwrap().is_none(), "the editor ended: {}", log());
            assert!(
                started.elapsed() < PATIENCE,
                "not ready after {n_kills} kills: {}",
                log()
            );
            std::thread::sleep(Duration::from_millis(50));
        }
        let n_first = n_logged("is in the journal");
        let mut typing = type_keys(&display);
        while n_logged("is in the journal") == n_first {
            assert!(editor.0.try_wait().unwrap().is_none(), "the editor ended: {}", log());
            assert!(
                started.elapsed() < PATIENCE,
                "no key made an edit after {n_kills} kills: {}",
                log()
            );
            if typing.0.try_wait().unwrap().is_some() {
                // On a busy machine all keys may have come before the window had the keyboard, or showed what is under the pointer.
                typing = type_keys(&display);
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        wait(random.below(1_500_000));
        editor.0.kill().unwrap();
        editor.0.wait().unwrap();
        drop(typing);
        let acknowledged = n_logged("is in the journal");
        n_acknowledged += acknowledged;
        let reading = recipe::read(&journal(&folder.join("state")).unwrap()).unwrap();
        match reading.end {
            End::Whole => {}
            End::CutOff => n_cut_off += 1,
            End::Damaged(broken) => panic!("a corrupt journal after {n_kills} kills: {broken}"),
        }
        let now = reading.recipe.events;
        assert!(now.starts_with(&events), "the journal goes on where it was");
        assert!(
            now.len() >= events.len() + acknowledged,
            "{} were there and {acknowledged} were acknowledged, but {} are in the journal",
            events.len(),
            now.len()
        );
        events = now;
    }
    println!(
        "{N_KILLS} kills of the window: {n_acknowledged} events acknowledged, {} in the journal, {n_cut_off} cut off",
        events.len()
    );
}

/// How many of the events' steps are not undone.
fn n_in_force(events: &[Event]) -> usize {
    events.iter().fold(0, |n_done, event| match event {
        Event::Step(_) | Event::Redo => n_done + 1,
        Event::Undo => n_done - 1,
        Event::Exported => n_done,
    })
}
