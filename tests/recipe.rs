//! What outlives the editor: edits that a crash left behind, recipes that are saved, opened and replayed.
//!
//! Without a graphics adapter the tests of the editor say that they are skipped; with `NORMEND_REQUIRE_GPU=1` they fail instead.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use glam::Vec3;
use normend_app::App;
use normend_app::coloring::Coloring;
use normend_app::command::{Action, Command as Asked};
use normend_app::journal::found;
use normend_app::session::Session;
use normend_core::document::FlipReason;
use normend_core::sources::Origin;
use normend_core::{Document, Edit, Parameters, PointSet, Preset, Propagation, Silent, Source, shapes};
use normend_io::Positions;
use normend_io::recipe::{self, Recipe};

use driver::{Editor, large_sphere_with_small_cap, sphere_with_wrong_cap, sphere_without_normals, start};

fn scan_of(editor: &Editor) -> PathBuf {
    editor.folder.path().join("sphere.ply")
}

/// Leaves a picture of the window where a person can look at it.
fn picture_of(editor: &mut Editor, name: &str) {
    let picture = editor.harness.render().unwrap();
    picture.save(Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)).unwrap();
}

/// Types a path into the open window with this field, and presses the button.
fn type_path(editor: &mut Editor, field: &str, path: &Path, button: &str) {
    editor.harness.get_by_role_and_label(Role::TextInput, field).focus();
    editor.harness.run_steps(1);
    editor.key(Modifiers::COMMAND, Key::A);
    let field = editor.harness.get_by_role_and_label(Role::TextInput, field);
    field.type_text(&path.display().to_string());
    editor.harness.run_steps(2);
    editor.click_button(button);
}

fn save_recipe(editor: &mut Editor, path: &Path) {
    editor.key(Modifiers::COMMAND, Key::S);
    picture_of(editor, "save_recipe.png");
    type_path(editor, "Save to", path, "Save");
    for _ in 0..1000 {
        if editor.said(&format!("Saved the recipe to {}", path.display())) {
            return;
        }
        editor.harness.step();
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    panic!("not saved: {:?}", editor.app().messages().entries());
}

fn wait_for_words(editor: &mut Editor, words: &str) {
    for _ in 0..1000 {
        if editor.said(words) || editor.shows(words) {
            editor.harness.run_steps(2);
            return;
        }
        editor.harness.step();
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    panic!("{words:?} was not said: {:?}", editor.app().messages().entries());
}

/// A mend and a flip of its source, which is undone.
fn mend_twice_and_undo(editor: &mut Editor) {
    editor.wait_until_oriented();
    editor.mend();
    // Not by the pointer: a message may be over the place by now.
    editor.harness.state_mut().act(Asked::SelectAllSources.into());
    editor.harness.state_mut().act(Asked::FlipSources.into());
    editor.wait("a second edit", |app| app.document().unwrap().n_done() == 2);
    editor.key(Modifiers::COMMAND, Key::Z);
    let document = editor.app().document().unwrap();
    assert_eq!((document.n_done(), document.steps().count()), (1, 2));
}

#[test]
fn edits_of_a_crash_are_offered_and_come_back_with_their_history() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    let scan = scan_of(&editor);
    editor.wait_until_oriented();
    assert!(editor.journals().is_empty(), "nothing is written before the first edit");
    mend_twice_and_undo(&mut editor);
    assert_eq!(editor.journals().len(), 1);
    let (bits, state) = (editor.bits(), editor.app().document().unwrap().state().clone());

    let mut editor = editor.crash_and_start(&scan);
    editor.wait_until_oriented();
    assert!(editor.shows("Restore 1 edit?"));
    assert!(editor.shows("Turn patch") || editor.shows("Mend"));
    assert!(editor.shows("Redo can bring back 1 edit that was undone."));
    assert_eq!(editor.n_sources(), 0);
    picture_of(&mut editor, "restore.png");
    editor.click_button("Restore");
    editor.wait_until_oriented();
    assert!(editor.said("Restored 1 edit."));
    assert_eq!(editor.bits(), bits);
    let document = editor.app().document().unwrap();
    assert_eq!(document.state(), &state);
    assert_eq!((document.n_done(), document.steps().count()), (1, 2));
    assert!(editor.app().is_unsaved());
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(editor.app().document().unwrap().n_done(), 2);
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_ne!(editor.bits(), bits);

    // What was done after the restoring is in the same journal.
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(editor.journals().len(), 1);
    let mut editor = editor.crash_and_start(&scan);
    editor.wait_until_oriented();
    assert!(editor.shows("Restore 1 edit?"));
    // Escape decides later.
    editor.key(Modifiers::NONE, Key::Escape);
    assert!(!editor.shows("Restore 1 edit?"));
    assert_eq!(editor.n_sources(), 0);
    let mut editor = editor.crash_and_start(&scan);
    editor.wait_until_oriented();
    editor.click_button("Discard");
    assert!(!editor.shows("Restore 1 edit?") && editor.journals().is_empty());
    assert_eq!(editor.n_sources(), 0);
}

#[test]
fn each_of_several_journals_can_be_looked_at_and_chosen() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    let scan = scan_of(&editor);
    editor.wait_until_oriented();
    editor.mend();
    let mut editor = editor.crash_and_start(&scan);
    editor.wait_until_oriented();
    editor.click_button("Decide later");
    mend_twice_and_undo(&mut editor);
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    let twice = editor.app().document().unwrap().state().clone();

    let mut editor = editor.crash_and_start(&scan);
    editor.wait_until_oriented();
    assert_eq!(editor.journals().len(), 2);
    for _ in 0..2 {
        let is_first = editor.shows("Restore 2 edits?");
        editor.click_button("Show another");
        editor.harness.run_steps(3);
        assert!(editor.shows(if is_first {
            "Restore 1 edit?"
        } else {
            "Restore 2 edits?"
        }));
    }
    if !editor.shows("Restore 2 edits?") {
        editor.click_button("Show another");
        editor.harness.run_steps(3);
    }
    editor.click_button("Restore");
    editor.wait_until_oriented();
    assert_eq!(editor.app().document().unwrap().state(), &twice);
    assert_eq!(editor.journals().len(), 2, "the other is kept for another time");
}

#[test]
fn edits_of_another_version_come_back_with_their_parameters() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    let scan = scan_of(&editor);
    mend_twice_and_undo(&mut editor);
    let [journal] = &editor.journals()[..] else {
        panic!("not one journal")
    };
    // As a program would write it that is older and begins with other parameters.
    let mut recipe = recipe::read(journal).unwrap().recipe;
    recipe.head.program = "0.0.9".to_owned();
    recipe.head.parameters = Parameters {
        k_graph: 9,
        ..Preset::Tree.parameters()
    };
    let (parameters, state) = (recipe.head.parameters, recipe.state());
    recipe.write(journal).unwrap();
    let mut editor = editor.crash_and_start(&scan);
    editor.wait_until_oriented();
    assert!(editor.shows("Made with Normend 0.0.9; this is"));
    editor.click_button("Restore");
    editor.wait("the other orientation", |app| {
        let propagation = app.document().unwrap().propagation();
        !app.is_busy() && propagation.is_some_and(|propagation| propagation.parameters == parameters)
    });
    let document = editor.app().document().unwrap();
    assert_eq!(document.state(), &state);
    // The parameters are where the history begins, so no undo reaches behind them.
    assert_eq!((document.n_done(), document.steps().count()), (1, 2));
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.wait_until_oriented();
    assert_eq!(editor.app().document().unwrap().parameters(), parameters);
}

#[test]
fn what_is_exported_or_given_up_is_not_offered_and_what_is_kept_is() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    let scan = scan_of(&editor);
    mend_twice_and_undo(&mut editor);
    let target = editor.folder.path().join("out.ply");
    editor.export_to(&target);
    editor.wait("the export", |app| !app.is_unsaved() && !app.is_busy());
    let mut editor = editor.crash_and_start(&scan);
    editor.wait_until_oriented();
    assert!(!editor.shows("Restore"));
    assert!(editor.journals().is_empty());

    editor.mend();
    editor.close();
    editor.harness.run_steps(2);
    assert!(editor.shows("Unsaved mends"));
    picture_of(&mut editor, "unsaved.png");
    editor.click_button("Keep for next time");
    let mut editor = editor.crash_and_start(&scan);
    editor.wait_until_oriented();
    editor.click_button("Restore");
    editor.wait_until_oriented();
    assert_eq!(editor.n_sources(), 1);

    // Opened again, the scan is as it was; its edits are kept and offered at once.
    editor.drop_file(&scan);
    editor.harness.run_steps(2);
    editor.click_button("Keep for next time");
    wait_for_words(&mut editor, "Restore 1 edit?");
    editor.click_button("Restore");
    editor.wait_until_oriented();
    assert_eq!(editor.n_sources(), 1);
    // Given up, they are gone.
    editor.drop_file(&scan);
    editor.harness.run_steps(2);
    editor.click_button("Discard");
    editor.wait("the scan once more", |app| {
        !app.is_busy() && app.document().is_some_and(|document| document.sources().is_empty())
    });
    assert!(!editor.shows("Restore 1 edit?") && editor.journals().is_empty());
}

#[test]
fn edits_of_a_file_that_changed_are_never_applied() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    let scan = scan_of(&editor);
    mend_twice_and_undo(&mut editor);
    let sources = editor.app().document().unwrap().sources().clone();
    let folder = editor.folder.path().to_path_buf();
    fs::rename(sphere_without_normals(&folder, "other.ply", 3000), &scan).unwrap();
    let mut editor = editor.crash_and_start(&scan);
    editor.wait_until_oriented();
    assert!(editor.shows("The scan has changed"));
    assert!(editor.shows("4,000 points; now 3,000"));
    picture_of(&mut editor, "restore_changed.png");
    assert!(
        editor
            .harness
            .query_by_role_and_label(Role::Button, "Restore")
            .is_none()
    );
    assert_eq!(editor.n_sources(), 0);

    // Kept as a recipe, it is one for the file that it was made for.
    editor.click_button("Keep as recipe…");
    editor.harness.run_steps(2);
    let field = editor.harness.get_by_role_and_label(Role::TextInput, "Save to");
    let target = folder.join("sphere.before.normend");
    assert_eq!(field.value(), Some(target.display().to_string()));
    editor.click_button("Save");
    wait_for_words(&mut editor, "Saved the recipe to");
    assert!(!editor.shows("The scan has changed") && editor.journals().is_empty());
    let kept = recipe::read(&target).unwrap().recipe;
    assert_eq!(kept.state().sources, sources);
    editor.drop_file(&target);
    wait_for_words(
        &mut editor,
        "it is of sphere.ply with 4,000 points, and this scan has 3,000",
    );
    assert_eq!(editor.n_sources(), 0);
}

#[test]
fn a_recipe_is_one_step_on_the_same_scan_and_asks_on_another() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    mend_twice_and_undo(&mut editor);
    let folder = editor.folder.path().to_path_buf();
    let saved = folder.join("mine.normend");
    save_recipe(&mut editor, &saved);
    let (bits, state) = (editor.bits(), editor.app().document().unwrap().state().clone());
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_ne!(editor.bits(), bits);
    editor.drop_file(&saved);
    wait_for_words(&mut editor, "Applied mine.normend");
    assert_eq!(editor.bits(), bits);
    assert_eq!(editor.app().document().unwrap().state(), &state);
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_ne!(editor.bits(), bits);

    // The same points in another file.
    let other = folder.join("again.ply");
    let text = fs::read(scan_of(&editor)).unwrap();
    let header = b"ply\n";
    fs::write(
        &other,
        [&header[..], b"comment copied\n", &text[header.len()..]].concat(),
    )
    .unwrap();
    editor.drop_file(&other);
    editor.harness.run_steps(2);
    editor.wait("the other scan", |app| {
        !app.is_busy() && app.document().is_some_and(|document| document.orientation().is_some())
    });
    for (button, n_sources) in [("Cancel", 0), ("Apply", 1)] {
        editor.drop_file(&saved);
        wait_for_words(&mut editor, "A recipe of another file");
        editor.click_button(button);
        assert_eq!(editor.n_sources(), n_sources);
    }

    // A recipe that is damaged changes nothing.
    let mut bytes = fs::read(&saved).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    let damaged = folder.join("damaged.normend");
    fs::write(&damaged, bytes).unwrap();
    let revision = editor.app().document().unwrap().revision();
    editor.drop_file(&damaged);
    wait_for_words(&mut editor, "The recipe was not opened.");
    assert_eq!(editor.app().document().unwrap().revision(), revision);
    // By its path, without the system's dialog.
    editor.drop_file(&folder.join("nowhere.normend"));
    wait_for_words(&mut editor, "there is no such file");
}

#[test]
fn editing_goes_on_where_no_journal_can_be_written() {
    let Some(mut editor) = start(|folder| {
        let state = folder.join("settings/state");
        fs::create_dir_all(&state).unwrap();
        // In the way of the folder.
        fs::write(state.join("journals"), "").unwrap();
        sphere_with_wrong_cap(folder)
    }) else {
        return;
    };
    let scan = scan_of(&editor);
    mend_twice_and_undo(&mut editor);
    assert!(editor.said("Edits are not being journaled: "));
    let n_said = editor
        .app()
        .messages()
        .entries()
        .iter()
        .filter(|entry| entry.text.contains("not being journaled"))
        .count();
    assert_eq!(n_said, 1);
    fs::remove_file(editor.folder.path().join("settings/state/journals")).unwrap();
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    wait_for_words(&mut editor, "Edits are being journaled again, the ones before too.");
    let mut editor = editor.crash_and_start(&scan);
    editor.wait_until_oriented();
    assert!(editor.shows("Restore 2 edits?"));
}

fn normend(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_normend"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

#[test]
fn a_replay_gives_the_bytes_of_the_editors_export() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    mend_twice_and_undo(&mut editor);
    // Sets of points, which recipes of other programs may have too.
    let folder = editor.folder.path().to_path_buf();
    let saved = folder.join("first.normend");
    save_recipe(&mut editor, &saved);
    let mut recipe = recipe::read(&saved).unwrap().recipe;
    let scan = normend_io::read(&scan_of(&editor), &Silent).unwrap();
    let mut document =
        Document::new(scan.cloud.clone(), scan.given_normals.clone()).with_parameters(recipe.head.parameters);
    for step in recipe.history().0 {
        document
            .apply_recorded(step.kind, step.change.clone(), step.n_turned)
            .unwrap();
    }
    let given = scan.given_normals.as_ref().map(|normals| normals.as_slice());
    document.install(Propagation::new(&scan.cloud, given, document.parameters(), &Silent).unwrap());
    document.apply(Edit::Pin(PointSet::from_iter(100..400))).unwrap();
    document
        .apply(Edit::FlipPoints {
            points: PointSet::from_iter((1000..3000).step_by(3)),
            reason: FlipReason::Asked,
        })
        .unwrap();
    document.apply(Edit::Select(PointSet::from_iter(5..50))).unwrap();
    recipe = Recipe::of_document(recipe.head.scan, &document);
    recipe.write(&saved).unwrap();
    editor.drop_file(&saved);
    wait_for_words(&mut editor, "Applied first.normend");
    editor.wait_until_oriented();
    editor.key(Modifiers::COMMAND, Key::A);
    editor.key(Modifiers::NONE, Key::X);
    let saved = folder.join("second.normend");
    save_recipe(&mut editor, &saved);
    let exported = folder.join("exported.ply");
    editor.export_to(&exported);
    editor.wait("the export", |app| !app.is_unsaved() && !app.is_busy());

    let output = normend(
        &folder,
        &[
            "replay",
            "second.normend",
            "sphere.ply",
            "-o",
            "replayed.ply",
            "--json",
            "-",
        ],
    );
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert_eq!(
        fs::read(folder.join("replayed.ply")).unwrap(),
        fs::read(&exported).unwrap()
    );
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let recipe = recipe::read(&saved).unwrap().recipe;
    let state = recipe.state();
    assert!(state.marks.n_pinned() > 0 && state.marks.len() > 900 && !state.sources.is_empty());
    for (field, expect) in [
        ("points", 4000),
        ("edits", recipe.history().1),
        ("sources", state.sources.len()),
        ("marks", state.marks.len()),
        ("pinned", state.marks.n_pinned()),
    ] {
        assert_eq!(report[field], expect, "{field}");
    }
    assert_eq!(report["same_content"], true);

    // Other ways to estimate and to connect: what was decided holds, the rest is found anew.
    for (n, flags) in [
        &["--k-graph", "9"][..],
        &["--start", "estimate", "--preset", "tree"],
        &["--start", "estimate", "--estimator", "pca", "--k-normals", "20"],
        &["--start", "estimate", "--preset", "auto"],
    ]
    .into_iter()
    .enumerate()
    {
        let target = format!("other_{n}.ply");
        let arguments = [
            &["replay", "second.normend", "sphere.ply", "-o", &target, "--quiet"],
            flags,
        ]
        .concat();
        let output = normend(&folder, &arguments);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let normals = normend_io::read(&folder.join(&target), &Silent)
            .unwrap()
            .given_normals
            .unwrap();
        for source in state
            .sources
            .iter()
            .filter(|source| state.marks.get(source.point).is_none())
        {
            assert!(!source.turns(normals[source.point as usize]), "{flags:?}: {source:?}");
        }
        for (point, mark) in state.marks.iter() {
            assert!(!mark.turns(normals[point as usize]), "{flags:?}: {point}");
        }
    }
}

#[test]
fn confidence_is_exported_when_asked_and_known_and_replayed_the_same() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let folder = editor.folder.path().to_path_buf();
    let is_disabled = |editor: &Editor| {
        let found = editor.harness.get_by_role_and_label(Role::CheckBox, "With confidence");
        found.accesskit_node().is_disabled()
    };
    // The normals that came with the file say nothing of how sure they are.
    editor.key(Modifiers::COMMAND, Key::E);
    assert!(is_disabled(&editor));
    editor.key(Modifiers::NONE, Key::Escape);
    let saved = folder.join("kept.normend");
    save_recipe(&mut editor, &saved);
    let output = normend(
        &folder,
        &["replay", "kept.normend", "sphere.ply", "-o", "none.ply", "--confidence"],
    );
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("--start estimate --preset auto"));
    assert!(!folder.join("none.ply").exists());

    let parameters = Preset::Auto.parameters();
    editor.harness.state_mut().act(Action::Propagate(parameters));
    editor.wait("the automatic result", |app| {
        !app.is_busy() && app.document().unwrap().parameters() == parameters
    });
    for command in [Asked::SelectAll, Asked::Flip] {
        editor.harness.state_mut().act(command.into());
        editor.harness.run_steps(2);
    }
    assert!(editor.app().document().unwrap().marks().len() > 3000);
    editor.key(Modifiers::COMMAND, Key::E);
    assert!(!is_disabled(&editor));
    editor.harness.get_by_label("With confidence").click();
    editor.harness.run_steps(2);
    picture_of(&mut editor, "export_with_confidence.png");
    let exported = folder.join("with_confidence.ply");
    editor.type_export_path(&exported);
    editor.click_button("Export");
    editor.wait("an exported file", |app| !app.is_busy());
    let bytes = fs::read(&exported).unwrap();
    assert!(String::from_utf8_lossy(&bytes).contains("property float confidence\nproperty uchar oriented\n"));
    assert_eq!(
        normend_io::read(&exported, &Silent)
            .unwrap()
            .given_normals
            .unwrap()
            .as_slice(),
        editor.normals()
    );

    save_recipe(&mut editor, &folder.join("auto.normend"));
    let output = normend(
        &folder,
        &[
            "replay",
            "auto.normend",
            "sphere.ply",
            "-o",
            "replayed.ply",
            "--confidence",
        ],
    );
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(fs::read(folder.join("replayed.ply")).unwrap() == bytes);
}

#[test]
fn a_replay_refuses_what_is_not_meant_and_writes_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let scan = sphere_without_normals(folder, "scan.ply", 500);
    sphere_without_normals(folder, "larger.ply", 501);
    let text = fs::read(&scan).unwrap();
    fs::write(
        folder.join("same_points.ply"),
        [b"ply\ncomment again\n", &text[4..]].concat(),
    )
    .unwrap();
    let scan = normend_io::read(&scan, &Silent).unwrap();
    let mut document = Document::new(scan.cloud.clone(), None);
    let source = Source {
        point: 7,
        normal: -Vec3::Z,
        origin: Origin::Picked,
        patch: None,
    };
    document.apply(Edit::AddSources(vec![source])).unwrap();
    document.apply(Edit::Select(PointSet::from_iter(0..9))).unwrap();
    let recipe = Recipe::of_document(scan.identity("scan.ply"), &document);
    recipe.write(&folder.join("r.normend")).unwrap();
    let bytes = fs::read(folder.join("r.normend")).unwrap();
    let n_first = bytes.iter().position(|&byte| byte == b'\n').unwrap();
    let mut damaged = bytes.clone();
    damaged[n_first + 20] ^= 1;
    fs::write(folder.join("damaged.normend"), damaged).unwrap();
    fs::write(folder.join("cut.normend"), &bytes[..bytes.len() - 20]).unwrap();
    let files = || {
        let mut names: Vec<_> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name())
            .collect();
        names.sort();
        names
    };
    let before = files();
    let check = |arguments: &[&str], code: i32, words: &str| {
        let output = normend(folder, &[&["replay"], arguments].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(said.contains(words), "{arguments:?}: {said}");
        String::from_utf8(output.stdout).unwrap()
    };
    check(
        &["r.normend", "larger.ply", "-o", "out.ply"],
        1,
        "of scan.ply with 500 points",
    );
    check(&["r.normend", "same_points.ply", "-o", "out.ply"], 1, "--same-points");
    check(
        &["damaged.normend", "scan.ply", "-o", "out.ply"],
        1,
        "line 2: the line is damaged",
    );
    check(&["scan.ply", "scan.ply", "-o", "out.ply"], 1, "this is no recipe");
    check(
        &["nowhere.normend", "scan.ply", "-o", "out.ply"],
        1,
        "there is no such file",
    );
    check(&["r.normend", "scan.ply", "-o", "scan.ply"], 2, "is an input");
    check(&["r.normend", "scan.ply", "-o", "r.normend"], 2, "");
    check(
        &["r.normend", "scan.ply", "-o", "out.ply", "--json", "scan.ply"],
        2,
        "another name",
    );
    check(
        &["r.normend", "scan.ply", "-o", "out.ply", "--rule", "toward-scanner"],
        1,
        "the scanner's place",
    );
    check(&["r.normend", "scan.ply"], 2, "--output");
    let report = check(&["nowhere.normend", "scan.ply", "-o", "out.ply", "--json", "-"], 1, "");
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(
        (&report["recipe"], &report["input"]),
        (&"nowhere.normend".into(), &"scan.ply".into())
    );
    assert!(report["error"].as_str().unwrap().contains("no such file"));
    assert_eq!(files(), before, "a replay that is refused writes nothing");

    check(
        &["r.normend", "same_points.ply", "-o", "a.ply", "--same-points"],
        0,
        "2 edits",
    );
    check(
        &["cut.normend", "scan.ply", "-o", "b.ply"],
        0,
        "in the middle of a line",
    );
    check(&["r.normend", "scan.ply", "-o", "b.ply"], 1, "exists already");
    check(
        &["r.normend", "scan.ply", "-o", "b.ply", "--overwrite", "--quiet"],
        0,
        "",
    );
    let normals = normend_io::read(&folder.join("b.ply"), &Silent)
        .unwrap()
        .given_normals
        .unwrap();
    assert!(normals[7].z <= 0.0);
    assert_eq!(files().len(), before.len() + 2);
}

#[test]
fn a_recipe_keeps_the_colors_and_the_reference_in_the_picture() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    let reference = editor.folder.path().join("reference.ply");
    let shape = shapes::sphere(driver::N_POINTS);
    normend_io::write_points(
        &reference,
        Positions::Float(&shape.positions),
        Some(&shape.normals),
        &Silent,
    )
    .unwrap();
    mend_twice_and_undo(&mut editor);
    let saved = editor.folder.path().join("mine.normend");
    save_recipe(&mut editor, &saved);
    editor.harness.state_mut().act(Action::OpenReference(reference));
    editor.harness.state_mut().act(Action::Display(Coloring::Regions));
    let settle = |editor: &mut Editor| {
        editor.harness.hover_at(egui::Pos2::new(5.0, 300.0));
        editor.wait("colors and counts", |app| {
            app.is_painted() && app.comparing().judged().is_some() && !app.comparing().is_busy()
        });
        editor.harness.run_steps(5);
    };
    // A recipe has no selected sources, which are drawn in another color.
    editor.key(Modifiers::NONE, Key::Escape);
    settle(&mut editor);
    let mended = editor.picture().rgba;
    editor.key(Modifiers::COMMAND, Key::Z);
    settle(&mut editor);
    let before = editor.picture().rgba;
    assert!(before != mended, "the regions are others");
    let n_interactions = editor.app().n_interactions();
    editor.drop_file(&saved);
    wait_for_words(&mut editor, "Applied mine.normend");
    settle(&mut editor);
    // What is painted is drawn in one of the next frames.
    for _ in 0..400 {
        if editor.picture().rgba == mended {
            break;
        }
        editor.harness.step();
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert!(editor.picture().rgba == mended, "the picture is as it was");
    assert_eq!(editor.app().n_interactions(), n_interactions + 1, "a recipe is one");
}

#[test]
fn nothing_is_exported_until_it_is_oriented_as_the_history_says() {
    let Some(mut editor) = start(large_sphere_with_small_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let first = editor.app().document().unwrap().parameters();
    let second = Parameters {
        k_graph: first.k_graph + 3,
        ..first
    };
    editor.harness.state_mut().act(Action::Propagate(second));
    editor.wait_until_oriented();
    let is_in_force = |app: &App, parameters| app.document().unwrap().propagation().unwrap().parameters == parameters;
    assert!(is_in_force(editor.app(), second));

    // The job that follows an undo ends just when that is done again: it must not become a step.
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.wait("the job", App::is_busy);
    editor
        .harness
        .key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    editor.harness.step();
    std::thread::sleep(std::time::Duration::from_secs(3));
    editor.wait_until_oriented();
    let document = editor.app().document().unwrap();
    assert_eq!((document.n_done(), document.steps().count()), (1, 1));
    assert!(is_in_force(editor.app(), second));
    assert_eq!(editor.app().availability(Asked::Export), Ok(()));

    // It is cancelled: what is in force is not what is wanted.
    editor.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    editor.wait("the job", App::is_busy);
    editor.harness.state_mut().act(Action::CancelJob);
    editor.wait("the end of the job", |app| !app.is_busy());
    editor.harness.run_steps(3);
    assert!(!editor.app().is_busy(), "what was cancelled is not begun again");
    assert!(is_in_force(editor.app(), second));
    assert_eq!(editor.app().document().unwrap().parameters(), first);
    let reason = editor.app().availability(Asked::Export).unwrap_err();
    assert!(reason.contains("press Propagate, or undo"), "{reason}");
    editor.harness.state_mut().act(Asked::Export.into());
    editor.harness.run_steps(3);
    assert!(editor.said(reason) && editor.export_path().is_none());

    // Both ways out: do it again, or propagate.
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(editor.app().availability(Asked::Export), Ok(()));
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.wait_until_oriented();
    assert!(is_in_force(editor.app(), first), "asked once more, it comes");
    assert_eq!(editor.app().availability(Asked::Export), Ok(()));
}

#[test]
fn journals_of_before_are_all_offered_again_but_never_mixed_with_new_edits() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    let scan = scan_of(&editor);
    editor.wait_until_oriented();
    editor.mend();
    let mut editor = editor.crash_and_start(&scan);
    editor.wait_until_oriented();
    editor.click_button("Decide later");
    editor.mend();
    assert_eq!(editor.journals().len(), 2);
    // Opened again, both are there.
    editor.drop_file(&scan);
    editor.harness.run_steps(2);
    editor.click_button("Keep for next time");
    wait_for_words(&mut editor, "Restore 1 edit?");
    editor.wait_until_oriented();
    assert!(
        editor
            .harness
            .query_by_label_contains("There is 1 other journal")
            .is_some()
    );
    // An edit that comes meanwhile, as from a script.
    editor.harness.state_mut().act(Asked::SelectAll.into());
    editor.wait("the edit", |app| app.document().unwrap().n_done() == 1);
    editor.harness.run_steps(3);
    assert!(!editor.shows("Restore 1 edit?"));
    assert!(editor.said("open it again to restore those"));
    assert_eq!(editor.app().document().unwrap().steps().count(), 1);
    assert_eq!(editor.journals().len(), 3, "both stay");
}

#[test]
fn what_is_accepted_after_an_export_is_kept_and_interactions_are_counted_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = sphere_with_wrong_cap(folder.path()).unwrap();
    let journals = folder.path().join("journals");
    let open = || {
        let scan = normend_io::read(&path, &Silent).unwrap();
        let mut session = Session::new(scan, "sphere.ply".to_owned());
        let offer = found::find(&journals, &session.identity(), std::time::Duration::ZERO)
            .offers
            .pop();
        session.keep_journal(&journals);
        if let Some(offer) = offer {
            session.restore(offer).unwrap();
        }
        let parameters = session.document.parameters();
        let given = session.scan.given_normals.clone();
        let given = given.as_ref().map(|normals| normals.as_slice());
        let propagation = Propagation::new(&session.scan.cloud, given, parameters, &Silent).unwrap();
        session.install(propagation);
        session
    };
    let accept = |session: &mut Session, point| session.apply(Edit::Accept(PointSet::from_iter(0..=point))).unwrap();
    let n_journals = || fs::read_dir(&journals).unwrap().count();
    let mut session = open();
    accept(&mut session, 0);
    session.apply(Edit::Mend(5)).unwrap();
    session.mark_saved(session.document.signs_revision());
    accept(&mut session, 1);
    session.finish();
    assert_eq!(n_journals(), 1, "one more was accepted");

    let mut session = open();
    assert_eq!(session.document.state().accepted.len(), 2);
    assert_eq!(session.n_interactions, 1, "the mend");
    session.apply(Edit::Mend(9)).unwrap();
    assert_eq!(session.n_interactions, 2);
    let recipe = Recipe::of_document(session.identity(), &session.document);
    session.undo();
    session.take_recipe(&recipe).unwrap();
    assert_eq!(session.n_interactions, 3);
    session.mark_saved(session.document.signs_revision());
    session.finish();
    assert_eq!(n_journals(), 0, "all is exported");
}
