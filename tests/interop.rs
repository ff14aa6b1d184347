//! Files are exchanged with readers that are not ours, as `scripts/interop` does, with those that install in seconds.
//!
//! Where they cannot be installed (no network, no Python) this skips itself, saying so; `NORMEND_REQUIRE_INTEROP=1`
//! makes that a failure. The whole list and its table are in `docs/formats.md`.

#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::env;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The code of `scripts/interop` where something cannot be installed.
const CANNOT_INSTALL: i32 = 3;

/// Exchanges files between `program` and some readers; none means all small ones. `None` where they cannot be installed.
fn exchange(program: &Path, readers: &[&str]) -> Option<Output> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scripts/interop");
    let output = Command::new("bash")
        .args([script, "--small"])
        .args(readers)
        .env("NORMEND", program)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    if output.status.code() != Some(CANNOT_INSTALL) {
        return Some(output);
    }
    let reason = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        env::var_os("NORMEND_REQUIRE_INTEROP").is_none(),
        "NORMEND_REQUIRE_INTEROP is set, and the readers cannot be installed: {reason}"
    );
    eprintln!("skipped: the readers cannot be installed: {reason}");
    None
}

#[test]
fn readers_that_are_not_ours_agree() {
    let program = Path::new(env!("CARGO_BIN_EXE_normend"));
    let Some(output) = exchange(program, &[]) else {
        return;
    };
    let (table, faults) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    assert!(output.status.success(), "{faults}\n{table}");
    // All of them took part.
    for reader in ["numpy", "plyfile", "laspy", "lazrs", "laszip", "pye57", "pypcd4"] {
        assert!(table.contains(&format!("| {reader} ")), "no {reader}: {table}");
    }
}

#[test]
fn a_program_that_turns_a_normal_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let turns = folder.path().join("turns");
    // Negates the last value of the first row of any text that it writes.
    let script = format!(
        "#!/bin/sh\n'{}' \"$@\" || exit 1\ncase $4 in *.xyz) sed -i '1s/ \\([^ ]*\\)$/ -\\1/;1s/--//' \"$4\" ;; esac\n",
        env!("CARGO_BIN_EXE_normend")
    );
    fs::write(&turns, script).unwrap();
    fs::set_permissions(&turns, fs::Permissions::from_mode(0o755)).unwrap();
    let Some(output) = exchange(&turns, &["numpy"]) else {
        return;
    };
    let faults = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{faults}");
    assert!(faults.contains("normals:") && faults.contains("at point 0"), "{faults}");
}
