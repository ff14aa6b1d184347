//! What is done with selected points in the real editor without a window: verbs, "What I see faces me", pins, the menu of a right
//! click, and what the tools say beside the pointer.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, Pos2, Vec2};
use egui_kittest::kittest::Queryable;
use normend_app::command::Command;
use normend_core::{EditKind, PointSet};

use driver::{
    Editor, N_MANY_POINTS, N_POINTS, is_flipped_source, large_sphere_with_small_cap, n_different,
    sphere_with_wrong_cap, start,
};

fn oriented() -> Option<Editor> {
    let mut editor = start(sphere_with_wrong_cap)?;
    editor.wait_until_oriented();
    Some(editor)
}

fn selected(editor: &Editor) -> PointSet {
    editor.app().document().unwrap().selected().clone()
}

fn last_kind(editor: &Editor) -> EditKind {
    editor.app().document().unwrap().next_undo().unwrap().kind()
}

/// Selects what a rectangle around a place shows.
fn select_around(editor: &mut Editor, center: Pos2, half: Vec2) {
    editor.key(Modifiers::NONE, Key::R);
    let button = |editor: &mut Editor, pos: Pos2, pressed: bool| {
        editor.harness.event(Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        });
        editor.harness.run_steps(1);
    };
    editor.hover(center - half);
    button(editor, center - half, true);
    editor.hover(center + half);
    button(editor, center + half, false);
    editor.wait("an answer to the stroke", |app| !app.is_selecting());
    editor.harness.run_steps(2);
    assert!(!selected(editor).is_empty());
}

/// The wrong cap faces the first view, so its middle is in the middle, where no message is shown.
fn wrong_place(editor: &Editor) -> Pos2 {
    editor.app().view_rect().center()
}

fn right_click(editor: &mut Editor, pos: Pos2) {
    editor.hover(pos);
    for pressed in [true, false] {
        editor.harness.event(Event::PointerButton {
            pos,
            button: PointerButton::Secondary,
            pressed,
            modifiers: Modifiers::NONE,
        });
        editor.harness.run_steps(1);
    }
    // What is there is known after a frame or more.
    for _ in 0..200 {
        editor.harness.step();
        if editor.shows("Turn around this point") || editor.shows("No point is here") {
            // It moves to where there is room for it.
            editor.harness.run_steps(4);
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    panic!("no menu came");
}

#[test]
fn flipping_turns_the_selection_and_pinned_points_stay() {
    let Some(mut editor) = oriented() else { return };
    assert!(editor.app().availability(Command::Flip).is_err());
    let center = wrong_place(&editor);
    select_around(&mut editor, center, Vec2::splat(12.0));
    let pinned = selected(&editor);
    editor.key(Modifiers::NONE, Key::P);
    assert_eq!(editor.app().document().unwrap().marks().n_pinned() as u64, pinned.len());
    assert!(editor.said("Pinned "));
    // Again there is nothing to pin.
    let n_done = editor.app().document().unwrap().n_done();
    editor.key(Modifiers::NONE, Key::P);
    assert!(editor.said("nothing had to change") && editor.app().document().unwrap().n_done() == n_done);

    select_around(&mut editor, center, Vec2::splat(30.0));
    let (normals, n_selected) = (editor.normals(), selected(&editor).len());
    editor.key(Modifiers::NONE, Key::X);
    let n_turned = n_different(&normals, &editor.normals());
    assert_eq!(n_turned, n_selected - pinned.len());
    let said = format!("Turned {n_turned} points; {} pinned stayed.", pinned.len());
    assert!(editor.said(&said), "{said}: {:?}", editor.app().messages().entries());
    assert_eq!(last_kind(&editor), EditKind::FlipPoints);
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(editor.normals(), normals);

    editor.key(Modifiers::SHIFT, Key::P);
    assert_eq!(editor.app().document().unwrap().marks().n_pinned(), 0);
    assert!(editor.said("Unpinned "));
    editor.key(Modifiers::NONE, Key::X);
    assert_eq!(n_different(&normals, &editor.normals()), n_selected);
}

#[test]
fn a_click_on_a_pinned_point_says_so_and_turns_nothing() {
    let Some(mut editor) = oriented() else { return };
    let center = wrong_place(&editor);
    select_around(&mut editor, center, Vec2::splat(15.0));
    editor.key(Modifiers::NONE, Key::P);
    editor.key(Modifiers::NONE, Key::M);
    let normals = editor.normals();
    editor.hover(center);
    editor.harness.run_steps(20);
    assert_eq!(editor.app().n_would_turn(), None);
    editor.click(center);
    editor.harness.run_steps(20);
    assert!(
        editor.said("the point is pinned: unpin first"),
        "{:?}",
        editor.app().messages().entries()
    );
    assert_eq!((editor.normals(), editor.n_sources()), (normals, 0));
}

#[test]
fn the_selection_comes_to_face_the_viewer() {
    let Some(mut editor) = oriented() else { return };
    let center = wrong_place(&editor);
    select_around(&mut editor, center, Vec2::splat(25.0));
    editor.key(Modifiers::SHIFT, Key::G);
    let document = editor.app().document().unwrap();
    let eye = editor.app().camera().eye();
    for point in document.selected() {
        let toward_eye = eye - document.cloud().positions()[point as usize];
        assert!(document.oriented_normal(point).unwrap().dot(toward_eye) > 0.0);
    }
    assert_eq!(last_kind(&editor), EditKind::FaceMe);
    editor.key(Modifiers::SHIFT, Key::G);
    assert!(editor.said("face you already"));
}

#[test]
fn what_i_see_faces_me_is_shown_before_it_is_done() {
    let Some(mut editor) = oriented() else { return };
    let (bits, normals) = (editor.bits(), editor.normals());
    let ask = |editor: &mut Editor| {
        editor.key(Modifiers::NONE, Key::G);
        editor.wait("a proposal", |app| app.n_proposed().is_some());
        editor.harness.run_steps(3);
        editor.app().n_proposed().unwrap()
    };
    let n_proposed = ask(&mut editor);
    assert!(editor.shows("would turn to face you"));
    assert_eq!(editor.bits(), bits, "it is only shown");
    editor.key(Modifiers::NONE, Key::Escape);
    assert_eq!((editor.app().n_proposed(), editor.bits()), (None, bits.clone()));

    for answer in [Some(Key::Enter), Some(Key::G), None] {
        assert_eq!(ask(&mut editor), n_proposed);
        match answer {
            Some(key) => editor.key(Modifiers::NONE, key),
            None => editor.click_button("Apply"),
        }
        assert_eq!(editor.app().n_proposed(), None);
        assert_eq!(n_different(&normals, &editor.normals()), n_proposed, "by {answer:?}");
        assert_eq!(last_kind(&editor), EditKind::Seen);
        editor.key(Modifiers::COMMAND, Key::Z);
        assert_eq!(editor.bits(), bits);
    }
    ask(&mut editor);
    editor.click_button("Leave");
    assert_eq!((editor.app().n_proposed(), editor.bits()), (None, bits));

    // The cap that was wrong is right afterwards.
    ask(&mut editor);
    editor.key(Modifiers::NONE, Key::Enter);
    let document = editor.app().document().unwrap();
    let positions = document.cloud().positions();
    let outward = (0..N_POINTS as u32).filter(|&point| {
        let normal = document.oriented_normal(point).unwrap();
        normal.dot(positions[point as usize]) > 0.0
    });
    let n_outward = outward.count();
    assert!(n_outward > N_POINTS - 100, "{n_outward}");
}

#[test]
fn what_is_seen_is_judged_from_where_it_was_seen() {
    let Some(mut editor) = oriented() else { return };
    let run = |editor: &mut Editor, command: Command, moves: bool| {
        editor.harness.run_steps(10);
        editor.harness.state_mut().act(command.into());
        if moves {
            // Before the picture has answered.
            editor.harness.state_mut().act(Command::ViewBack.into());
        }
        editor.wait("an answer of the picture", |app| !app.is_selecting());
        editor.harness.run_steps(2);
    };
    run(&mut editor, Command::SelectBacks, false);
    let backs = selected(&editor);
    assert!(!backs.is_empty());
    editor.key(Modifiers::COMMAND, Key::Z);
    let camera = *editor.app().camera();
    run(&mut editor, Command::SelectBacks, true);
    assert_ne!(*editor.app().camera(), camera, "the view did not move");
    assert_eq!(selected(&editor), backs);

    editor.harness.state_mut().act(Command::ViewCorner.into());
    run(&mut editor, Command::WhatISeeFacesMe, false);
    let n_proposed = editor.app().n_proposed();
    assert!(n_proposed.is_some());
    editor.key(Modifiers::NONE, Key::Escape);
    run(&mut editor, Command::WhatISeeFacesMe, true);
    assert_eq!(editor.app().n_proposed(), n_proposed);
}

#[test]
fn signs_spread_from_the_selection_and_into_it() {
    let Some(mut editor) = oriented() else { return };
    let center = wrong_place(&editor);
    let normals = editor.normals();
    select_around(&mut editor, center, Vec2::splat(20.0));
    let points = selected(&editor);
    // Flipped, then found again from what is around.
    editor.key(Modifiers::NONE, Key::X);
    assert_eq!(n_different(&normals, &editor.normals()), points.len());
    editor.key(Modifiers::ALT, Key::X);
    assert_eq!(last_kind(&editor), EditKind::PropagateInside);
    assert!(editor.said("follow what is around them"));
    let n_left = n_different(&normals, &editor.normals());
    assert!(n_left < points.len() / 4, "{n_left} of {}", points.len());
    editor.key(Modifiers::COMMAND, Key::Z);

    // The flipped points are right; all that hangs together follows them, so the sphere looks outward.
    editor.key(Modifiers::SHIFT, Key::X);
    assert_eq!(last_kind(&editor), EditKind::PropagateFrom);
    let document = editor.app().document().unwrap();
    let positions = document.cloud().positions();
    let outward = (0..N_POINTS as u32).filter(|&point| {
        let normal = document.oriented_normal(point).unwrap();
        normal.dot(positions[point as usize]) > 0.0
    });
    let n_outward = outward.count();
    assert!(n_outward > N_POINTS - 100, "{n_outward}");
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(editor.normals(), normals);
}

#[test]
fn patches_and_components_are_selected_by_a_click() {
    let Some(mut editor) = oriented() else { return };
    let center = wrong_place(&editor);
    editor.hover(center);
    editor.wait("a preview", |app| app.n_would_turn().is_some());
    let n_points = editor.app().n_would_turn().unwrap();
    editor.key(Modifiers::NONE, Key::A);
    editor.click(center);
    editor.wait("a selection", |app| !app.document().unwrap().selected().is_empty());
    // The normals are kept, so there are no patches: what a click would turn is selected.
    assert_eq!(selected(&editor).len(), n_points);
    // A click that is no second one of a double-click.
    editor.harness.run_steps(40);
    editor.key(Modifiers::NONE, Key::C);
    editor.hover(center + Vec2::new(3.0, 0.0));
    editor.click(center + Vec2::new(3.0, 0.0));
    editor.wait("all that hangs together", |app| {
        app.document().unwrap().selected().len() == N_POINTS as u64
    });
    assert_eq!(editor.n_sources(), 0, "selecting turned something");
    // A click beside the scan deselects.
    let corner = editor.app().view_rect().left_bottom() + Vec2::new(30.0, -30.0);
    editor.click(corner);
    editor.wait("nothing selected", |app| app.document().unwrap().selected().is_empty());
}

#[test]
fn a_right_click_offers_what_can_be_done_there() {
    let Some(mut editor) = oriented() else { return };
    let center = wrong_place(&editor);
    let bits = editor.bits();
    right_click(&mut editor, center);
    for label in [
        "Mend here",
        "Turn whole region here",
        "Select patch here",
        "Pin patch here",
    ] {
        assert!(
            editor.harness.query_by_role_and_label(Role::Button, label).is_some(),
            "{label} is missing"
        );
    }
    editor.click_button("Select patch here");
    editor.wait("a selection", |app| !app.document().unwrap().selected().is_empty());
    assert_eq!(editor.bits(), bits);
    let points = selected(&editor);
    right_click(&mut editor, center);
    editor.click_button("Pin patch here");
    editor.wait("pins", |app| app.document().unwrap().marks().n_pinned() > 0);
    let document = editor.app().document().unwrap();
    assert!(points.iter().all(|point| document.marks().is_pinned(point)));
    editor.key(Modifiers::COMMAND, Key::Z);
    right_click(&mut editor, center);
    editor.click_button("Mend here");
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    assert_eq!(n_different_bits(&bits, &editor.bits()), points.len());

    // Beside the scan there is nothing to mend, and a drag opens nothing.
    let corner = editor.app().view_rect().left_bottom() + Vec2::new(30.0, -30.0);
    right_click(&mut editor, corner);
    assert!(editor.shows("No point is here"));
    editor.key(Modifiers::NONE, Key::Escape);
    assert!(!editor.shows("No point is here"));
}

fn n_different_bits(a: &[u32], b: &[u32]) -> u64 {
    a.iter().zip(b).map(|(a, b)| u64::from((a ^ b).count_ones())).sum()
}

#[test]
fn interactions_are_counted_and_undo_takes_none_back() {
    let Some(mut editor) = oriented() else { return };
    assert_eq!(editor.app().n_interactions(), 0);
    editor.mend();
    assert_eq!(editor.app().n_interactions(), 1);
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(editor.app().n_interactions(), 1);
    let center = wrong_place(&editor);
    select_around(&mut editor, center, Vec2::splat(15.0));
    editor.key(Modifiers::NONE, Key::X);
    assert_eq!(editor.app().n_interactions(), 3);
}

#[test]
fn a_click_uploads_as_much_as_it_turns() {
    let Some(mut editor) = start(large_sphere_with_small_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let (place, n_points) = editor.hover_wrong_patch();
    let before = editor.app().bytes_uploaded();
    editor.click(place);
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    let bytes = editor.app().bytes_uploaded() - before;
    // The turned words, and two spheres; the highlight of the next hover is as small.
    let bound = 4 * n_points + 1024;
    assert!(bytes > 0 && bytes <= bound, "{bytes} for {n_points} points");
    // A bit for each point would be more.
    assert!(
        bound < N_MANY_POINTS as u64 / 8,
        "{n_points} points are too many to tell"
    );
}

/// Steps for as long as a pick takes.
fn let_picks_end(editor: &mut Editor) {
    for _ in 0..60 {
        editor.harness.step();
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
}

/// Clicks twice where what is there is known, so that each click acts at once.
fn double_click(editor: &mut Editor, place: Pos2) {
    editor.hover(place);
    let_picks_end(editor);
    editor.click(place);
    editor.click(place);
    let_picks_end(editor);
}

#[test]
fn a_double_click_takes_nothing_back_but_its_first_click() {
    let Some(mut editor) = oriented() else { return };
    let place = editor.mend();
    let center = wrong_place(&editor);
    select_around(&mut editor, center + Vec2::new(0.0, 60.0), Vec2::splat(15.0));
    editor.key(Modifiers::NONE, Key::P);
    editor.key(Modifiers::NONE, Key::M);
    let state = |editor: &Editor| {
        let document = editor.app().document().unwrap();
        (document.n_done(), document.revision(), document.marks().n_pinned())
    };
    let before = state(&editor);
    assert_eq!(last_kind(&editor), EditKind::Pin);

    // The first click is refused: the point is pinned.
    let pivot = editor.app().camera().pivot;
    double_click(&mut editor, center + Vec2::new(0.0, 60.0));
    editor.wait("a pivot by the double-click", |app| app.camera().pivot != pivot);
    assert!(editor.said("Nothing changed"), "the click was not refused");
    assert_eq!(state(&editor), before);

    // The first click is beside the scan.
    let corner = editor.app().view_rect().left_bottom() + Vec2::new(30.0, -30.0);
    double_click(&mut editor, corner);
    assert_eq!(state(&editor), before);

    // The first click selects a source, which is no edit.
    let sphere = editor.picture().inside(is_flipped_source).unwrap();
    let sphere = editor.place(sphere);
    assert!(sphere.distance(place) < 200.0);
    double_click(&mut editor, sphere);
    assert_eq!(state(&editor), before);

    // What a tool selects anew and finds selected already is no edit either.
    editor.key(Modifiers::NONE, Key::C);
    editor.click(center);
    editor.wait("all points", |app| {
        app.document().unwrap().selected().len() == N_POINTS as u64
    });
    let before = state(&editor);
    editor.harness.run_steps(40);
    double_click(&mut editor, center + Vec2::new(5.0, 0.0));
    assert_eq!(state(&editor), before);
}
