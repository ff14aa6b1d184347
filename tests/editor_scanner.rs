//! Places of the scanner in the real editor without a window: found with the scan, listed, drawn, typed, taken back.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::fs;
use std::path::{Path, PathBuf};

use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use glam::Vec3;
use normend_app::panels::side::SideTab;
use normend_core::{EditKind, shapes};

use driver::{Editor, sphere_without_normals, start};

const N: usize = 2000;

/// A sphere whose halves were measured from two places in it.
fn from_within(folder: &Path) -> Option<PathBuf> {
    let path = sphere_without_normals(folder, "ball.ply", N);
    fs::write(folder.join("ball.sensors.tsv"), "0 1000 0 0 0.1\n1000 1000 0 0 -0.1\n").unwrap();
    Some(path)
}

fn without_places(folder: &Path) -> Option<PathBuf> {
    Some(sphere_without_normals(folder, "ball.ply", N))
}

fn wait_for_work(editor: &mut Editor) {
    editor.harness.run_steps(2);
    editor.wait("the end of the work", |app| !app.is_busy());
    editor.harness.run_steps(3);
}

/// How many normals point out of the sphere.
fn n_outward(editor: &Editor) -> usize {
    let places = shapes::sphere(N).positions;
    let normals = editor.normals();
    places
        .iter()
        .zip(normals)
        .filter(|(place, normal)| place.dot(*normal) > 0.0)
        .count()
}

fn steps(editor: &Editor) -> usize {
    editor.app().document().unwrap().n_done()
}

#[test]
fn places_beside_the_scan_are_used_listed_and_drawn() {
    let Some(mut editor) = start(from_within) else { return };
    editor.wait_until_oriented();
    assert!(editor.said("2 scanner positions from ball.sensors.tsv"));
    assert_eq!(n_outward(&editor), 0);
    editor.open_tab(SideTab::Sources);
    editor.wait("counts", |_| true);
    for _ in 0..200 {
        if editor.shows("1,000, 0 against") {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
        editor.harness.run_steps(1);
    }
    assert!(editor.shows("1,000, 0 against") && editor.shows("Place 1") && editor.shows("Place 2"));

    // The marks are in the picture of the window, and go with the box of the tab View.
    editor.open_tab(SideTab::View);
    let picture = |editor: &mut Editor| editor.harness.render().unwrap();
    let before = picture(&mut editor);
    editor
        .harness
        .get_by_role_and_label(Role::CheckBox, "Scanner places")
        .click();
    editor.harness.run_steps(3);
    let after = picture(&mut editor);
    // Left of the panel nothing else changes: marks and their names cover some hundred pixels.
    let in_view = before.width() / 2;
    let differs = |(x, y, pixel): (u32, u32, &_)| x < in_view && after.get_pixel(x, y) != pixel;
    let n_different = before.enumerate_pixels().filter(|&pixel| differs(pixel)).count();
    assert!(n_different > 200, "{n_different} pixels differ");

    // Without them it is an object as any other, and that is one step.
    editor.open_tab(SideTab::Sources);
    let n_steps = steps(&editor);
    editor
        .harness
        .get_by_role_and_label(Role::CheckBox, "2 scanner positions from ball.sensors.tsv")
        .click();
    wait_for_work(&mut editor);
    assert_eq!((n_outward(&editor), steps(&editor)), (N, n_steps + 1));
    assert!(!editor.shows("Place 1"));
    editor.key(Modifiers::COMMAND, Key::Z);
    wait_for_work(&mut editor);
    assert_eq!((n_outward(&editor), steps(&editor)), (0, n_steps));
}

#[test]
fn a_place_that_is_typed_turns_the_scan_and_is_one_step() {
    let Some(mut editor) = start(without_places) else {
        return;
    };
    editor.wait_until_oriented();
    assert_eq!(n_outward(&editor), N);
    editor.open_tab(SideTab::Sources);
    let n_steps = steps(&editor);
    editor
        .harness
        .get_by_role_and_label(Role::TextInput, "Scanner place")
        .focus();
    editor.harness.run_steps(1);
    editor
        .harness
        .get_by_role_and_label(Role::TextInput, "Scanner place")
        .type_text("0.1 0 -0.2");
    editor.harness.run_steps(2);
    editor.click_button("Add scanner place");
    wait_for_work(&mut editor);
    assert_eq!((n_outward(&editor), steps(&editor)), (0, n_steps + 1));
    let document = editor.app().document().unwrap();
    assert_eq!(document.next_undo().map(|step| step.kind()), Some(EditKind::SetScanner));
    assert_eq!(
        document.state().scanner.own[0].position.as_vec3(),
        Vec3::new(0.1, 0.0, -0.2)
    );
    assert!(editor.shows("Place 1"));

    editor.key(Modifiers::COMMAND, Key::Z);
    wait_for_work(&mut editor);
    assert_eq!((n_outward(&editor), steps(&editor)), (N, n_steps));
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    wait_for_work(&mut editor);
    assert_eq!(n_outward(&editor), 0);
    editor.click_button("Remove Place 1");
    wait_for_work(&mut editor);
    assert_eq!((n_outward(&editor), editor.shows("Place 1")), (N, false));
}
