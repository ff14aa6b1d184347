//! Comparing in the real editor without a window: with the input, the automatic result, and a reference file.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::path::{Path, PathBuf};

use egui::{Key, Modifiers, Pos2};
use glam::Vec3;
use normend_app::command::{Action, Command};
use normend_app::compare::{Other, Style};
use normend_app::panels::side::SideTab;
use normend_core::{Preset, Silent, shapes};
use normend_io::Positions;

use driver::{Editor, N_POINTS, is_back, sphere_with_wrong_cap, start_prepared};

fn start() -> Option<Editor> {
    let mut editor = start_prepared(1.0, |settings| settings.side_tab = SideTab::View, sphere_with_wrong_cap)?;
    editor.wait_until_oriented();
    Some(editor)
}

fn n_back(editor: &Editor) -> usize {
    editor.picture().count(is_back)
}

fn leave_view(editor: &mut Editor) {
    editor.harness.hover_at(Pos2::new(5.0, 300.0));
    editor.harness.run_steps(3);
}

/// Orients by the automatic method, which finds the wrong cap.
fn orient(editor: &mut Editor) {
    let parameters = Preset::Auto.parameters();
    editor.harness.state_mut().act(Action::Propagate(parameters));
    editor.wait("the automatic result", |app| {
        !app.is_busy() && app.document().unwrap().parameters() == parameters
    });
    leave_view(editor);
}

/// The sphere as it should be, with `change` of its normals.
fn reference(folder: &Path, name: &str, n_points: usize, change: fn(&mut Vec<Vec3>)) -> PathBuf {
    let shape = shapes::sphere(n_points);
    let mut normals = shape.normals;
    change(&mut normals);
    let path = folder.join(name);
    normend_io::write_points(&path, Positions::Float(&shape.positions), Some(&normals), &Silent).unwrap();
    path
}

#[test]
fn the_input_is_shown_left_of_a_line_that_can_be_dragged() {
    let Some(mut editor) = start() else { return };
    let n_wrong = n_back(&editor);
    orient(&mut editor);
    let n_steps = editor.app().document().unwrap().steps().count();
    assert!(n_back(&editor) < n_wrong / 10);
    editor.key(Modifiers::NONE, Key::K);
    editor.wait("the input", |app| app.comparing().is_ready());
    editor.harness.run_steps(3);
    assert_eq!(editor.app().comparing().style, Style::Split);
    let picture = editor.picture();
    let middle = picture.width / 2;
    let height = picture.rgba.len() / 4 / picture.width;
    let side = |range: std::ops::Range<usize>| {
        let pixels = range.flat_map(|x| (0..height).map(move |y| (x, y)));
        pixels.filter(|&(x, y)| is_back(picture.at(x, y))).count()
    };
    let (left, right) = (side(0..middle - 8), side(middle + 8..picture.width));
    assert!(
        left > n_wrong / 4 && right < n_wrong / 20,
        "{left} left, {right} right of {n_wrong}"
    );
    // Drag the line to the right edge: the input is everywhere.
    let view = editor.app().view_rect();
    let event = |editor: &mut Editor, pos: Pos2, pressed: bool| {
        editor.harness.hover_at(pos);
        editor.harness.event(egui::Event::PointerButton {
            pos,
            button: egui::PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        });
        editor.harness.run_steps(2);
    };
    event(&mut editor, view.center(), true);
    editor.harness.hover_at(view.right_center() - egui::Vec2::new(4.0, 0.0));
    editor.harness.run_steps(2);
    event(&mut editor, view.right_center() - egui::Vec2::new(4.0, 0.0), false);
    assert!(editor.app().comparing().split > 0.98);
    leave_view(&mut editor);
    assert!(n_back(&editor) > n_wrong * 9 / 10);
    let n_now = editor.app().document().unwrap().steps().count();
    assert_eq!(n_now, n_steps, "comparing is no edit");
    editor.key(Modifiers::NONE, Key::K);
    editor.harness.run_steps(3);
    assert!(n_back(&editor) < n_wrong / 10);
}

#[test]
fn the_automatic_result_is_made_for_scans_that_kept_their_normals() {
    let Some(mut editor) = start() else { return };
    let n_wrong = n_back(&editor);
    editor.choose("With", Other::Automatic.label());
    // Motion is reduced here, so each press shows the other one.
    editor.key(Modifiers::SHIFT, Key::K);
    editor.wait("the automatic result", |app| app.comparing().is_ready());
    editor.harness.run_steps(3);
    assert!(editor.app().comparing().shows_other());
    assert!(n_back(&editor) < n_wrong / 10, "the automatic method finds the cap");
    editor.key(Modifiers::SHIFT, Key::K);
    editor.harness.run_steps(3);
    assert_eq!(n_back(&editor), n_wrong);
}

#[test]
fn the_input_is_shown_while_the_key_is_held() {
    let Some(mut editor) = start() else { return };
    orient(&mut editor);
    editor.harness.key_down_modifiers(Modifiers::SHIFT, Key::K);
    editor.wait("the input", |app| app.comparing().is_ready());
    for _ in 0..60 {
        // As keyboards do that are held.
        editor.harness.event_modifiers(
            egui::Event::Key {
                key: Key::K,
                physical_key: None,
                pressed: true,
                repeat: true,
                modifiers: Modifiers::SHIFT,
            },
            Modifiers::SHIFT,
        );
        editor.harness.step();
        assert!(editor.app().comparing().shows_other());
    }
    assert!(n_back(&editor) > 10_000, "{}", n_back(&editor));
    editor.harness.key_up_modifiers(Modifiers::SHIFT, Key::K);
    editor.harness.run_steps(4);
    assert_eq!(editor.app().comparing().style, Style::Off);
    leave_view(&mut editor);
    assert!(n_back(&editor) < 10_000);
}

#[test]
fn without_reduced_motion_both_are_shown_in_turn_and_no_faster_than_two_a_second() {
    let Some(mut editor) = start_prepared(
        1.0,
        |settings| {
            settings.side_tab = SideTab::View;
            settings.reduce_motion = false;
        },
        sphere_with_wrong_cap,
    ) else {
        return;
    };
    editor.wait_until_oriented();
    editor.harness.state_mut().act(Action::Compare(Style::Blink));
    editor.wait("the input", |app| app.comparing().is_ready());
    let mut shown = Vec::new();
    // A step is a sixtieth of a second.
    for _ in 0..240 {
        editor.harness.step();
        shown.push(editor.app().comparing().shows_other());
    }
    let n_changes = shown.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert!((6..=8).contains(&n_changes), "{n_changes} changes in four seconds");
}

#[test]
fn wrong_points_are_marked_and_counted_with_every_edit() {
    let Some(mut editor) = start() else { return };
    let path = reference(editor.folder.path(), "truth.ply", N_POINTS, |_| {});
    let n_cap = editor
        .normals()
        .iter()
        .zip(shapes::sphere(N_POINTS).normals)
        .filter(|(a, b)| a.dot(*b) < 0.0)
        .count();
    assert!(editor.app().availability(Command::NextWrong).is_err());
    editor.harness.state_mut().act(Action::OpenReference(path));
    editor.wait("the counts", |app| app.comparing().judged().is_some());
    editor.harness.run_steps(3);
    assert_eq!(editor.app().comparing().other, Other::Reference);
    assert!(editor.app().availability(Command::NextWrong).is_ok());
    let judged = editor.app().comparing().judged().unwrap();
    assert_eq!(judged.n_judged(), N_POINTS as u64);
    assert_eq!(judged.n_wrong(), n_cap as u64);
    let label = format!("{n_cap} wrong points");
    assert!(editor.shows(&label), "{label}");
    let is_ball = |[red, green, blue]: [u8; 3]| blue > 45 && red < 30 && green < 30;
    let n_marked = editor.picture().count(is_ball);
    assert!(n_marked > 500, "{n_marked}");
    editor.wait("the regions", |app| app.comparing().regions().is_some());
    let (_, regions) = editor.app().comparing().regions().unwrap().clone();
    assert_eq!((regions.len(), regions[0].n_points), (1, n_cap));
    let before = *editor.app().camera();
    editor.key(Modifiers::NONE, Key::W);
    editor.harness.run_steps(3);
    assert_ne!(*editor.app().camera(), before, "the camera flew there");

    editor.harness.state_mut().act(Command::ViewCorner.into());
    editor.key(Modifiers::NONE, Key::Home);
    editor.mend();
    leave_view(&mut editor);
    let n_turned = editor.app().document().unwrap().next_undo().unwrap().n_turned();
    let n_wrong = |editor: &Editor| editor.app().comparing().judged().map(|judged| judged.n_wrong());
    assert!(n_turned > 0);
    assert_eq!(n_wrong(&editor), Some(n_cap as u64 - n_turned));
    assert!(editor.picture().count(is_ball) < n_marked);
    assert!(editor.shows("1 interaction"));
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(n_wrong(&editor), Some(n_cap as u64));
    assert!(editor.shows("1 interaction"), "taking back is none");
    orient(&mut editor);
    editor.wait("the counts", |app| app.comparing().judged().is_some());
    assert_eq!(n_wrong(&editor), Some(0));
    leave_view(&mut editor);
    assert_eq!(editor.picture().count(is_ball), 0);
    editor.wait("the regions", |app| {
        app.comparing().regions().is_some_and(|(_, regions)| regions.is_empty())
    });
    editor.harness.run_steps(2);
    assert!(editor.shows("No point is wrong"));
    let refusal = editor.app().availability(Command::NextWrong);
    assert_eq!(refusal, Err("no point is wrong against the reference"));
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.wait_until_oriented();
    editor.wait("the counts", |app| {
        app.comparing().judged().is_some_and(|judged| judged.n_wrong() > 0)
    });
    leave_view(&mut editor);
    assert!(editor.picture().count(is_ball) > 500);
    editor.click_button("Close reference");
    leave_view(&mut editor);
    assert_eq!(editor.picture().count(is_ball), 0);
}

#[test]
fn a_file_of_other_points_is_refused_in_words() {
    let Some(mut editor) = start() else { return };
    let fewer = reference(editor.folder.path(), "fewer.ply", 100, |_| {});
    editor.harness.state_mut().act(Action::OpenReference(fewer));
    editor.wait("an answer", |app| !app.comparing().is_busy());
    assert!(editor.said("it has 100 points, the scan has 4,000"));
    let mut shape = shapes::sphere(N_POINTS);
    shape.positions.reverse();
    let path = editor.folder.path().join("reversed.ply");
    normend_io::write_points(&path, Positions::Float(&shape.positions), Some(&shape.normals), &Silent).unwrap();
    editor.harness.state_mut().act(Action::OpenReference(path));
    editor.wait("an answer", |app| !app.comparing().is_busy());
    assert!(editor.said("another order"));
    assert!(editor.app().comparing().reference().is_none());
}
