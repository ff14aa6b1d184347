//! Suspects in the real editor without a window: looking, stepping, flipping, accepting, and why nothing is suspected.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::path::{Path, PathBuf};

use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use glam::Vec3;
use normend_app::command::Command;
use normend_app::suspects_list::Standing;
use normend_core::{EditKind, Silent, shapes};
use normend_io::Positions;

use driver::{Editor, N_POINTS, n_different, sphere_with_wrong_cap, sphere_without_normals, start};

const SHOWN: Vec3 = Vec3::new(0.577_350_3, -0.577_350_3, 0.577_350_3);

/// A sphere with two wrong caps, a large one below and a small one on top.
fn sphere_with_two_wrong_caps(folder: &Path) -> Option<PathBuf> {
    let shape = shapes::sphere(N_POINTS);
    let is_wrong = |normal: Vec3| normal.z < -0.75 || normal.z > 0.92;
    let normals: Vec<Vec3> = (shape.normals.iter())
        .map(|&normal| if is_wrong(normal) { -normal } else { normal })
        .collect();
    let path = folder.join("sphere.ply");
    normend_io::write_points(&path, Positions::Float(&shape.positions), Some(&normals), &Silent).unwrap();
    Some(path)
}

fn step(editor: &mut Editor, modifiers: Modifiers) {
    editor.key(modifiers, Key::N);
    editor.wait("the suspects", |app| app.suspects().unwrap().is_known());
    editor.harness.run_steps(3);
}

fn focus(editor: &Editor) -> Option<usize> {
    editor.app().suspects().unwrap().focus()
}

fn count(editor: &Editor, standing: Standing) -> usize {
    editor.app().suspects().unwrap().count(standing)
}

fn last_kind(editor: &Editor) -> Option<EditKind> {
    editor.app().document().unwrap().next_undo().map(|step| step.kind())
}

#[test]
fn the_wrong_cap_is_found_shown_flipped_and_comes_back_with_undo() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    assert!(
        !editor.app().suspects().unwrap().is_known(),
        "it is not looked for before it is wanted"
    );
    let before = editor.normals();
    // From elsewhere, so that the flight has somewhere to go.
    editor.key(Modifiers::NONE, Key::Num1);
    step(&mut editor, Modifiers::NONE);
    assert_eq!((focus(&editor), count(&editor, Standing::Open)), (Some(0), 1));
    let back = editor.app().camera().back();
    assert!(back.dot(SHOWN) > 0.95, "seen from {back}");
    for words in ["Suspect 1 of 1", "To flip it", "The automatic method disagrees."] {
        assert!(editor.shows(words), "{words}");
    }

    editor.key(Modifiers::NONE, Key::Enter);
    let outward = shapes::sphere(N_POINTS).normals;
    let n_cap = outward.iter().filter(|normal| normal.dot(SHOWN) > 0.8).count() as u64;
    assert_eq!(n_different(&before, &editor.normals()), n_cap);
    assert_eq!(last_kind(&editor), Some(EditKind::FlipSuspect));
    assert_eq!((focus(&editor), count(&editor, Standing::Turned)), (None, 1));
    assert!(editor.said("That was the last suspect."));
    assert!(!editor.shows("To flip it"));

    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(editor.normals(), before);
    assert_eq!(count(&editor, Standing::Open), 1);
    step(&mut editor, Modifiers::NONE);
    assert_eq!(focus(&editor), Some(0));
    editor.key(Modifiers::NONE, Key::Escape);
    assert_eq!(focus(&editor), None);
    assert!(editor.app().availability(Command::AcceptSuspect).is_err());
}

#[test]
fn accepted_suspects_are_not_listed_again_until_they_are_taken_back() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    step(&mut editor, Modifiers::NONE);
    let n_points = editor.app().suspects().unwrap().row(0).unwrap().points.len();
    editor.key(Modifiers::NONE, Key::Space);
    let document = editor.app().document().unwrap();
    assert_eq!(document.state().accepted.len(), n_points);
    assert_eq!(
        (last_kind(&editor), count(&editor, Standing::Accepted)),
        (Some(EditKind::Accept), 1)
    );

    editor.click_button("Suspects");
    assert!(editor.shows("Nothing is suspected"));
    editor.click_button("Look again");
    editor.wait("another look", |app| app.suspects().unwrap().status().is_none());
    editor.harness.run_steps(3);
    assert_eq!(
        (count(&editor, Standing::Open), count(&editor, Standing::Accepted)),
        (0, 1)
    );
    assert!(!editor.shows("Suspect 1:"));

    let show = editor
        .harness
        .get_by_role_and_label(Role::CheckBox, "Show the 1 accepted");
    show.click();
    editor.harness.run_steps(2);
    assert!(editor.shows("Suspect 1:"));
    editor.click_button("Take back");
    assert_eq!(count(&editor, Standing::Open), 1);
    assert!(editor.app().document().unwrap().state().accepted.is_empty());
}

#[test]
fn steps_go_round_and_a_flip_goes_on() {
    let Some(mut editor) = start(sphere_with_two_wrong_caps) else {
        return;
    };
    editor.wait_until_oriented();
    step(&mut editor, Modifiers::NONE);
    assert_eq!(count(&editor, Standing::Open), 2);
    // Of equally likely ones the larger is first.
    let sizes: Vec<u64> = editor
        .app()
        .suspects()
        .unwrap()
        .rows()
        .map(|(row, _)| row.points.len())
        .collect();
    assert!(sizes[0] > sizes[1], "{sizes:?}");
    let mut seen = vec![focus(&editor)];
    for modifiers in [Modifiers::NONE, Modifiers::NONE, Modifiers::SHIFT] {
        step(&mut editor, modifiers);
        seen.push(focus(&editor));
    }
    assert_eq!(seen, [Some(0), Some(1), Some(0), Some(1)]);
    editor.key(Modifiers::NONE, Key::Enter);
    assert_eq!(focus(&editor), Some(0));
    assert!(editor.shows("Suspect 1 of 1"));
    editor.click_button("Suspects");
    assert!(editor.shows("Signs changed since this was looked for."));
    assert!(editor.shows("1 suspect · 1 flipped"));
}

#[test]
fn the_list_has_small_pictures_and_a_click_flies_there() {
    let Some(mut editor) = start(sphere_with_two_wrong_caps) else {
        return;
    };
    editor.wait_until_oriented();
    // The tab alone starts to look.
    editor.click_button("Suspects");
    editor.wait("the suspects", |app| app.suspects().unwrap().is_known());
    editor.wait("their pictures", |app| app.n_suspect_pictures() == 2);
    editor.harness.run_steps(2);
    let row = editor.harness.get_by_label_contains("Suspect 2:");
    let rect = row.rect();
    row.click();
    editor.harness.run_steps(2);
    assert_eq!(focus(&editor), Some(1));
    assert!(editor.app().camera().back().z > 0.95, "the small cap is on top");
    let image = editor.harness.render().unwrap();
    let picture = egui::Rect::from_min_size(rect.min + egui::Vec2::splat(6.0), egui::Vec2::new(60.0, 45.0));
    let mut colors = std::collections::BTreeSet::new();
    for y in picture.top() as u32..picture.bottom() as u32 {
        for x in picture.left() as u32..picture.right() as u32 {
            colors.insert(image.get_pixel(x, y).0);
        }
    }
    assert!(colors.len() > 50, "only {} colors in the small picture", colors.len());
}

#[test]
fn where_nothing_is_suspected_it_says_why() {
    let scan = |folder: &Path| Some(sphere_without_normals(folder, "sphere.ply", N_POINTS));
    let Some(mut editor) = start(scan) else { return };
    editor.wait_until_oriented();
    // The automatic method ran, so looking is quick and starts by itself.
    editor.wait("the suspects", |app| app.suspects().unwrap().is_known());
    editor.click_button("Suspects");
    assert!(editor.shows("Nothing is suspected"));
    assert!(editor.shows("of the points is seen"));
    step(&mut editor, Modifiers::NONE);
    assert!(editor.said("Nothing is suspected"));
    assert_eq!(focus(&editor), None);
}

#[test]
fn a_list_of_other_signs_says_so_and_the_next_suspect_is_looked_for_again() {
    let Some(mut editor) = start(sphere_with_two_wrong_caps) else {
        return;
    };
    editor.wait_until_oriented();
    editor.click_button("Suspects");
    step(&mut editor, Modifiers::NONE);
    assert_eq!((focus(&editor), count(&editor, Standing::Open)), (Some(0), 2));
    editor.key(Modifiers::NONE, Key::Escape);
    let is_fresh = |app: &normend_app::App| {
        let (list, document) = (app.suspects().unwrap(), app.document().unwrap());
        list.status().is_none() && !list.is_old(document)
    };
    // All is turned around, and that is taken back: each time the list is of signs that are no more.
    for (modifiers, is_turned_back) in [(Modifiers::NONE, false), (Modifiers::COMMAND, true)] {
        if is_turned_back {
            editor.key(modifiers, Key::Z);
        } else {
            editor.key(Modifiers::COMMAND, Key::A);
            editor.key(modifiers, Key::X);
        }
        editor.harness.run_steps(2);
        assert!(editor.shows("Signs changed since this was looked for."));
        for words in ["Nothing is suspected", " flipped", "of the points is seen"] {
            assert!(!editor.shows(words), "{words}, by a list of other signs");
        }
        editor.key(Modifiers::NONE, Key::N);
        editor.wait("a new list", is_fresh);
        editor.harness.run_steps(3);
        assert!(!editor.shows("Signs changed since this was looked for."));
    }
    assert_eq!((focus(&editor), count(&editor, Standing::Open)), (Some(0), 2));
}
