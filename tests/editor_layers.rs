//! Several files as layers of one cloud in the real editor without a window: shown, hidden, mended across, exported, restored.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::path::{Path, PathBuf};

use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use glam::Vec3;
use normend_app::command::{Action, Command};
use normend_core::shapes::sphere;
use normend_core::{PointSet, Silent};
use normend_io::Positions;

use driver::{Editor, start};

/// A sphere in two files, cut across.
fn halves(folder: &Path) -> [PathBuf; 2] {
    let shape = sphere(2000);
    let (upper, lower): (Vec<Vec3>, Vec<Vec3>) = shape.positions.iter().partition(|position| position.z > 0.0);
    let write = |name: &str, positions: &[Vec3]| {
        let path = folder.join(name);
        normend_io::write_points(&path, Positions::Float(positions), None, &Silent).unwrap();
        path
    };
    [write("upper.ply", &upper), write("lower.xyz", &lower)]
}

fn open() -> Option<(Editor, [PathBuf; 2])> {
    let mut editor = start(|_| None)?;
    let paths = halves(editor.folder.path());
    editor.harness.state_mut().act(Action::OpenFiles(paths.to_vec()));
    editor.wait_until_oriented();
    Some((editor, paths))
}

fn n_hidden(editor: &Editor) -> u64 {
    editor.app().document().unwrap().hidden().len()
}

fn click_check(editor: &mut Editor, label: &str) {
    editor.harness.get_by_role_and_label(Role::CheckBox, label).click();
    editor.harness.run_steps(2);
}

/// Saves what is seen where `NORMEND_PICTURES` says, for eyes.
fn picture(editor: &mut Editor, name: &str) {
    if let Some(folder) = std::env::var_os("NORMEND_PICTURES") {
        let image = editor.harness.render().unwrap();
        image.save(Path::new(&folder).join(name)).unwrap();
    }
}

#[test]
fn files_are_layers_that_are_hidden_selected_and_exported() {
    let Some((mut editor, paths)) = open() else { return };
    assert_eq!(editor.app().document().unwrap().cloud().n_points(), 2000);
    assert!(editor.shows("upper.ply + 1 more"));
    let n_upper = normend_io::read(&paths[0], &Silent).unwrap().cloud.n_points() as u32;
    picture(&mut editor, "layers.png");

    click_check(&mut editor, "upper.ply");
    assert_eq!(n_hidden(&editor), u64::from(n_upper));
    click_check(&mut editor, "upper.ply");
    assert_eq!(n_hidden(&editor), 0);
    editor.click_button("Only lower.xyz");
    assert_eq!(n_hidden(&editor), u64::from(n_upper));
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(n_hidden(&editor), 0);
    editor.click_button("Select upper.ply");
    let selected = editor.app().document().unwrap().selected().clone();
    assert_eq!(selected, (0..n_upper).collect::<PointSet>());
    editor.click_button("Zoom to lower.xyz");

    // An edit that goes across the files, then each to its own.
    editor.harness.state_mut().act(Command::SelectAll.into());
    editor.wait("all points", |app| app.document().unwrap().selected().len() == 2000);
    let before = editor.normals();
    editor.harness.state_mut().act(Command::Flip.into());
    let first = before[0];
    editor.wait("the flip", |app| {
        app.document().unwrap().oriented_normals().unwrap()[0] == -first
    });
    editor.harness.run_steps(2);
    editor.key(Modifiers::COMMAND, Key::E);
    assert!(editor.shows("Export 2 files"), "one window for both");
    picture(&mut editor, "export.png");
    editor.click_button("Export 2 files");
    editor.wait("the export", |app| !app.is_busy());
    editor.harness.run_steps(2);
    assert!(
        editor.said("Exported 2,000 points"),
        "{:?}",
        editor.app().messages().entries()
    );
    assert!(!editor.app().is_unsaved());
    let normals = editor.normals();
    assert!(normals.iter().zip(&before).all(|(now, before)| *now == -*before));
    let folder = editor.folder.path().to_path_buf();
    let mut written = Vec::new();
    for name in ["upper_oriented.ply", "lower_oriented.xyz"] {
        let scan = normend_io::read(&folder.join(name), &Silent).unwrap();
        written.extend_from_slice(&scan.given_normals.unwrap());
    }
    let is_close = |(a, b): (&Vec3, &Vec3)| a.dot(*b) > 0.999;
    assert!(written.len() == 2000 && written.iter().zip(&normals).all(is_close));

    // Both again: given normals are kept.
    let again = ["upper_oriented.ply", "lower_oriented.xyz"].map(|name| folder.join(name));
    editor.harness.state_mut().act(Action::OpenFiles(again.to_vec()));
    editor.wait("the exported files", |app| {
        !app.is_busy()
            && app
                .document()
                .is_some_and(|document| document.given_normals().is_some())
    });
    editor.wait_until_oriented();
    assert!(editor.normals().iter().zip(&normals).all(is_close));
}

#[test]
fn names_that_exist_are_asked_about_at_once() {
    let Some((mut editor, _)) = open() else { return };
    let folder = editor.folder.path().to_path_buf();
    std::fs::write(folder.join("lower_oriented.xyz"), "mine").unwrap();
    editor.key(Modifiers::COMMAND, Key::E);
    editor.key(Modifiers::NONE, Key::Enter);
    assert!(editor.shows("Replace 1 existing file"));
    assert!(!folder.join("upper_oriented.ply").exists());
    click_check(&mut editor, "Replace 1 existing file");
    picture(&mut editor, "replace.png");
    editor.click_button("Export 2 files");
    editor.wait("the export", |app| !app.is_busy());
    assert_ne!(std::fs::read(folder.join("lower_oriented.xyz")).unwrap(), b"mine");
    assert!(folder.join("upper_oriented.ply").exists());
}

#[test]
fn files_that_are_added_keep_what_was_decided() {
    let Some(mut editor) = start(|folder| Some(halves(folder)[0].clone())) else {
        return;
    };
    editor.wait_until_oriented();
    let lower = editor.folder.path().join("lower.xyz");
    editor.harness.state_mut().act(Command::SelectAll.into());
    editor.wait("a selection", |app| !app.document().unwrap().selected().is_empty());
    let selected = editor.app().document().unwrap().selected().clone();
    editor.harness.state_mut().act(Action::AddFiles(vec![lower]));
    editor.wait("both files", |app| app.document().unwrap().cloud().n_points() == 2000);
    editor.wait_until_oriented();
    assert_eq!(*editor.app().document().unwrap().selected(), selected);
    assert!(editor.shows("lower.xyz"));
}

#[test]
fn edits_of_several_files_are_restored_after_a_crash() {
    let Some((mut editor, paths)) = open() else { return };
    editor.click_button("Only lower.xyz");
    let hidden = editor.app().document().unwrap().hidden().clone();
    assert!(!hidden.is_empty());
    // The journal is written beside the window.
    for _ in 0..40 {
        editor.harness.step();
        std::thread::sleep(std::time::Duration::from_millis(25));
    }
    assert_eq!(editor.journals().len(), 1);
    let mut editor = editor.crash_and_start(&paths[0]);
    editor.wait_until_oriented();
    assert!(!editor.shows("Restore"), "the file alone is another scan");
    editor.harness.state_mut().act(Action::OpenFiles(paths.to_vec()));
    editor.wait("the offer", |app| app.document().unwrap().cloud().n_points() == 2000);
    editor.harness.run_steps(3);
    editor.click_button("Restore");
    editor.wait_until_oriented();
    assert_eq!(*editor.app().document().unwrap().hidden(), hidden);
}
