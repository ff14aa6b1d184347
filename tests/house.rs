//! The rules of the house that no lint knows: who may depend on whom, what is deliberately absent, tidy files.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use cargo_metadata::{DependencyKind, Metadata, MetadataCommand, PackageId};

/// Longest file of Rust; half of it is a good length.
const MAX_LINES: usize = 700;
/// Longest end-to-end test, which is a list that is read in parts.
const MAX_TEST_LINES: usize = 1000;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

fn metadata() -> Metadata {
    MetadataCommand::new()
        .manifest_path(root().join("Cargo.toml"))
        .exec()
        .unwrap()
}

/// Names of all packages that `package` is built with, itself left out; what only its tests use does not count.
fn reached_by(metadata: &Metadata, package: &str) -> BTreeSet<String> {
    let nodes = &metadata.resolve.as_ref().unwrap().nodes;
    let start = metadata
        .workspace_packages()
        .into_iter()
        .find(|candidate| candidate.name.as_str() == package)
        .unwrap();
    let mut reached: BTreeSet<&PackageId> = BTreeSet::new();
    let mut open = vec![&start.id];
    while let Some(id) = open.pop() {
        let node = nodes.iter().find(|node| &node.id == id).unwrap();
        for dependency in &node.deps {
            let is_built = dependency
                .dep_kinds
                .iter()
                .any(|kind| kind.kind != DependencyKind::Development);
            if is_built && reached.insert(&dependency.pkg) {
                open.push(&dependency.pkg);
            }
        }
    }
    metadata
        .packages
        .iter()
        .filter(|package| reached.contains(&package.id))
        .map(|package| package.name.to_string())
        .collect()
}

/// All files below `folder` whose names end with `ending`, in the order of their paths.
fn files_below(folder: &str, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![root().join(folder)];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.to_string_lossy().ends_with(ending) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// `path:line` of every line of `files` that holds one of `words`, comments left out.
fn lines_with(files: &[PathBuf], words: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    for path in files {
        for (index, line) in fs::read_to_string(path).unwrap().lines().enumerate() {
            let code = line.split("//").next().unwrap_or("");
            if words.iter().any(|word| code.contains(word)) {
                found.push(format!("{}:{}: {}", path.display(), index + 1, line.trim()));
            }
        }
    }
    found
}

#[test]
fn the_crates_depend_in_one_direction() {
    let metadata = metadata();
    let check = |package: &str, expect: &[&str], forbidden: &[&str]| {
        let reached = reached_by(&metadata, package);
        for name in expect {
            assert!(reached.contains(*name), "{package} does not depend on {name}");
        }
        for name in forbidden {
            assert!(!reached.contains(*name), "{package} depends on {name}");
        }
    };
    let graphics = ["wgpu", "naga", "egui", "eframe", "egui-wgpu", "winit", "rfd"];
    check("normend_core", &["kiddo", "rayon"], &graphics);
    check(
        "normend_core",
        &[],
        &[
            "normend_io",
            "normend_render",
            "normend_app",
            "normend",
            "tempfile",
            "clap",
            "indicatif",
        ],
    );
    check("normend_io", &["normend_core"], &graphics);
    check(
        "normend_io",
        &[],
        &["normend_render", "normend_app", "normend", "clap", "indicatif"],
    );
    check(
        "normend_render",
        &["wgpu"],
        &["normend_core", "normend_io", "normend_app", "normend", "eframe"],
    );
    check(
        "normend_app",
        &["normend_core", "normend_io", "normend_render", "eframe"],
        &["normend", "clap", "indicatif"],
    );
    check(
        "normend",
        &["normend_app", "normend_core", "normend_io", "normend_render"],
        &[],
    );
}

#[test]
fn there_is_one_version_of_what_must_be_one() {
    let metadata = metadata();
    for name in ["wgpu", "naga", "egui", "winit"] {
        let versions: Vec<String> = (metadata.packages.iter())
            .filter(|package| package.name.as_str() == name)
            .map(|package| package.version.to_string())
            .collect();
        assert_eq!(versions.len(), 1, "{name}: {versions:?}");
    }
    // The original writes wrong list lengths; its maintained fork carries another package name.
    assert!(
        metadata
            .packages
            .iter()
            .all(|package| package.name.as_str() != "ply-rs")
    );
}

#[test]
fn the_core_touches_no_file_no_network_and_no_screen() {
    let files = files_below("crates/normend_core/src", ".rs");
    assert!(files.len() > 10, "the sources of the core are not where they were");
    let found = lines_with(
        &files,
        &[
            "std::fs",
            "std::net",
            "std::process",
            "std::env",
            "std::io",
            "File::open",
            "println!",
            "eprintln!",
            "thread::Builder",
        ],
    );
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn the_search_finds_what_it_forbids() {
    let this_file = [root().join("tests/house.rs")];
    assert!(
        lines_with(&this_file, &["use std::fs"])
            .iter()
            .any(|line| line.contains("house.rs:"))
    );
    assert!(lines_with(&this_file, &["word that only this comment holds"]).len() == 1);
    assert!(
        lines_with(&this_file, &["The rules of the house"]).len() == 1,
        "comments are not code"
    );
}

#[test]
fn no_lint_against_panics_is_excused() {
    let excuses = [
        "allow(clippy::unwrap_used",
        "expect(clippy::unwrap_used",
        "allow(clippy::all",
        "allow(warnings",
        "allow(dead_code",
    ];
    // Helpers of end-to-end tests, in the folder tests/, may panic; programs and libraries may not.
    let files = files_below("crates", ".rs");
    let found = lines_with(&files, &excuses);
    assert!(found.is_empty(), "{found:#?}");
}

/// Files that may lift the lint against unsafe code, and why: none so far. What is in the list runs under Miri (`scripts/miri`).
const MAY_BE_UNSAFE: [(&str, &str); 0] = [];

/// Code of `files` that could do what the compiler does not check, without comments.
fn unsafe_lines(files: &[PathBuf]) -> Vec<String> {
    let words = ["unsafe", "no_mangle", "link_section", "extern \"C\""];
    let mut found = lines_with(files, &words);
    // Lints that forbid it.
    found.retain(|line| !line.contains("forbid(unsafe_code)") && !line.contains("deny(unsafe_code)"));
    found
}

#[test]
fn unsafe_code_stands_only_where_the_list_says() {
    let mut files = Vec::new();
    for folder in ["crates", "tests", "fuzz/src", "fuzz/fuzz_targets"] {
        files.extend(files_below(folder, ".rs"));
    }
    assert!(files.len() > 100, "the sources are not where they were");
    let this_file = root().join("tests/house.rs");
    let is_listed = |path: &PathBuf| MAY_BE_UNSAFE.iter().any(|(listed, _)| path.ends_with(listed));
    files.retain(|path| *path != this_file && !is_listed(path));
    let found = unsafe_lines(&files);
    assert!(found.is_empty(), "{found:#?}");
    for (path, reason) in MAY_BE_UNSAFE {
        let still_needs_it = !unsafe_lines(&[root().join(path)]).is_empty();
        assert!(
            still_needs_it && !reason.is_empty(),
            "{path} is not unsafe any more: take it off the list"
        );
    }
    // The search finds what it looks for.
    assert!(!unsafe_lines(&[this_file]).is_empty());
    let manifest = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    assert!(manifest.contains("\nunsafe_code = \"deny\"\n"));
}

#[test]
fn every_target_of_fuzzing_has_seeds_and_words() {
    let manifest = fs::read_to_string(root().join("fuzz/Cargo.toml")).unwrap();
    let page = fs::read_to_string(root().join("docs/fuzzing.md")).unwrap();
    let targets = files_below("fuzz/fuzz_targets", ".rs");
    assert!(targets.len() >= 12, "the targets are not where they were");
    for target in targets {
        let name = target.file_stem().unwrap().to_string_lossy().into_owned();
        assert!(manifest.contains(&format!("name = \"{name}\"")), "{name} is not built");
        assert!(
            page.contains(&format!("| `{name}` |")),
            "docs/fuzzing.md says nothing of {name}"
        );
        assert!(
            !files_below(&format!("fuzz/seeds/{name}"), "").is_empty(),
            "{name} has no seeds"
        );
        let words = fs::read_to_string(root().join(format!("fuzz/dictionaries/{name}.dict"))).unwrap();
        assert!(
            words.lines().filter(|line| line.starts_with('"')).count() > 5,
            "{name} has no words"
        );
    }
    let n_bytes: u64 = (files_below("fuzz/seeds", "").iter())
        .map(|seed| fs::metadata(seed).unwrap().len())
        .sum();
    assert!(n_bytes < 300_000, "the seeds have {n_bytes} bytes: keep them small");
}

#[test]
fn every_crate_takes_the_lints_of_the_workspace() {
    for manifest in files_below("crates", "Cargo.toml") {
        let text = fs::read_to_string(&manifest).unwrap();
        assert!(text.contains("[lints]\nworkspace = true"), "{}", manifest.display());
    }
}

#[test]
fn files_are_short_and_say_what_they_are() {
    for (folder, max_lines) in [("crates", MAX_LINES), ("tests", MAX_TEST_LINES)] {
        for path in files_below(folder, ".rs") {
            let text = fs::read_to_string(&path).unwrap();
            let n_lines = text.lines().count();
            assert!(n_lines <= max_lines, "{} has {n_lines} lines: split it", path.display());
            // Unit tests that have a file of their own say it with its name.
            let says_it = text.starts_with("//! ") || path.ends_with("tests.rs");
            assert!(says_it, "{} does not begin by saying what it is", path.display());
        }
    }
}

#[test]
fn every_end_to_end_test_is_claimed_by_one_crate() {
    let manifests: Vec<String> = files_below("crates", "Cargo.toml")
        .iter()
        .map(|path| fs::read_to_string(path).unwrap())
        .collect();
    let mut tests = files_below("tests", ".rs");
    // Modules of a test lie in a folder of its name.
    tests.retain(|path| path.parent().is_some_and(|folder| folder.ends_with("tests")));
    assert!(tests.len() > 3, "the tests are not where they were");
    for test in tests {
        let claim = format!("path = \"../../tests/{}\"", test.file_name().unwrap().to_string_lossy());
        let n_claims = manifests.iter().filter(|text| text.contains(&claim)).count();
        assert_eq!(n_claims, 1, "{claim}: it runs only when exactly one manifest names it");
    }
}

#[cfg(unix)]
#[test]
fn scripts_parse_stop_at_errors_and_can_be_run() {
    use std::os::unix::fs::PermissionsExt;

    let mut scripts = files_below("scripts", "");
    scripts.extend(files_below(".ci", ""));
    assert!(scripts.len() >= 4);
    for script in scripts {
        let text = fs::read_to_string(&script).unwrap();
        assert!(text.starts_with("#!/usr/bin/env bash\n# "), "{}", script.display());
        assert!(text.contains("\nset -euo pipefail\n"), "{}", script.display());
        assert!(
            fs::metadata(&script).unwrap().permissions().mode() & 0o111 != 0,
            "{}",
            script.display()
        );
        assert!(
            Command::new("bash").arg("-n").arg(&script).status().unwrap().success(),
            "{}",
            script.display()
        );
    }
}
