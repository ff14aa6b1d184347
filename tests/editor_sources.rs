//! Who says which side is right, in the real editor without a window: kinds of sources, votes, viewpoints, and the parts' rules.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::path::{Path, PathBuf};

use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, Pos2, Vec2};
use egui_kittest::kittest::Queryable;
use glam::Vec3;
use normend_app::command::Command;
use normend_core::sources::Origin;
use normend_core::{EditKind, Method, SideRule, Silent, SourceRule, Start, shapes};
use normend_io::Positions;

use driver::{Editor, N_POINTS, is_flipped_source, n_different, sphere_with_wrong_cap, sphere_without_normals, start};

const N_SMALL: usize = 1500;

/// Two spheres beside each other, the second smaller.
fn two_spheres(folder: &Path) -> Option<PathBuf> {
    let mut positions = shapes::sphere(N_POINTS).positions;
    let small = shapes::sphere(N_SMALL).positions;
    positions.extend(small.iter().map(|&place| 0.5 * place + Vec3::new(3.0, 0.0, 0.0)));
    let path = folder.join("spheres.ply");
    normend_io::write_points(&path, Positions::Float(&positions), None, &Silent).unwrap();
    Some(path)
}

fn open_sources(scan: impl FnOnce(&Path) -> Option<PathBuf>) -> Option<Editor> {
    let mut editor = start(scan)?;
    editor.wait_until_oriented();
    editor.click_button("Sources");
    Some(editor)
}

fn n_of(editor: &Editor, wanted: Origin) -> usize {
    let sources = editor.app().document().unwrap().sources();
    sources.iter().filter(|source| source.origin == wanted).count()
}

fn last_kind(editor: &Editor) -> Option<EditKind> {
    editor.app().document().unwrap().next_undo().map(|step| step.kind())
}

fn n_steps(editor: &Editor) -> usize {
    editor.app().document().unwrap().n_done()
}

fn wait_for_work(editor: &mut Editor) {
    editor.harness.run_steps(2);
    editor.wait("the end of the work", |app| !app.is_busy());
    editor.harness.run_steps(3);
}

fn button(editor: &mut Editor, pos: Pos2, pressed: bool) {
    editor.harness.event(Event::PointerButton {
        pos,
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    });
    editor.harness.run_steps(1);
}

/// Drags from one place to another without letting go.
fn drag(editor: &mut Editor, from: Pos2, to: Pos2) {
    editor.hover(from);
    button(editor, from, true);
    for part in [0.3, 0.7, 1.0] {
        editor.hover(from + (to - from) * part);
    }
}

#[test]
fn kinds_are_counted_hidden_and_dropped_as_a_whole() {
    let Some(mut editor) = open_sources(sphere_with_wrong_cap) else {
        return;
    };
    assert!(editor.shows("File") && !editor.shows("Picked"));
    let before = editor.normals();
    editor.mend();
    assert_eq!(n_of(&editor, Origin::Picked), 1);
    let mended = editor.normals();
    assert_ne!(before, mended);
    assert!(editor.shows("Picked"));

    let n_pink = |editor: &mut Editor| {
        editor.hover(editor.app().view_rect().left_top() + Vec2::splat(3.0));
        editor.harness.run_steps(30);
        editor.picture().count(is_flipped_source)
    };
    assert!(n_pink(&mut editor) > 0);
    let show = editor.harness.get_by_role_and_label(Role::CheckBox, "Show Picked");
    show.click();
    assert_eq!(n_pink(&mut editor), 0);
    assert_eq!(editor.normals(), mended, "hiding turns nothing");

    let steps = n_steps(&editor);
    editor.click_button("Drop Picked");
    assert_eq!((n_of(&editor, Origin::Picked), n_steps(&editor)), (0, steps + 1));
    assert_eq!(last_kind(&editor), Some(EditKind::RemoveSources));
    assert!(!editor.shows("Picked"));
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(editor.normals(), mended);
}

#[test]
fn what_was_flipped_alone_is_dropped_by_flipping_it_back_and_pins_by_unpinning() {
    let Some(mut editor) = open_sources(sphere_with_wrong_cap) else {
        return;
    };
    let before = editor.normals();
    editor.key(Modifiers::NONE, Key::N);
    editor.wait("a suspect", |app| app.suspects().unwrap().focus().is_some());
    editor.key(Modifiers::NONE, Key::Enter);
    let flipped = n_different(&before, &editor.normals());
    assert!(flipped > 100);
    assert_eq!(editor.app().document().unwrap().marks().free().len(), flipped);
    editor.click_button("Drop Flipped alone");
    assert_eq!(editor.normals(), before);
    assert!(editor.app().document().unwrap().marks().is_empty());

    // The only part is what the buttons mean.
    editor.click_button("Select the part");
    editor.wait("a selection", |app| {
        app.document().unwrap().selected().len() == N_POINTS as u64
    });
    editor.harness.run_steps(2);
    editor.harness.state_mut().act(Command::Pin.into());
    editor.harness.run_steps(2);
    assert_eq!(editor.app().document().unwrap().marks().n_pinned(), N_POINTS);
    editor.click_button("Drop Pinned");
    assert!(editor.app().document().unwrap().marks().is_empty());
    assert_eq!((last_kind(&editor), editor.normals()), (Some(EditKind::Unpin), before));
}

#[test]
fn dropping_the_files_normals_estimates_them_and_undo_takes_them_again() {
    let Some(mut editor) = open_sources(sphere_with_wrong_cap) else {
        return;
    };
    let start_of = |editor: &Editor| editor.app().document().unwrap().propagation().unwrap().parameters.start;
    assert_eq!(start_of(&editor), Start::Keep);
    editor.click_button("Drop File");
    wait_for_work(&mut editor);
    assert_eq!(start_of(&editor), Start::Estimate);
    assert_eq!(
        (last_kind(&editor), n_steps(&editor)),
        (Some(EditKind::SetParameters), 1)
    );
    assert!(!editor.shows("Drop File"));
    editor.key(Modifiers::COMMAND, Key::Z);
    wait_for_work(&mut editor);
    assert_eq!(start_of(&editor), Start::Keep);
}

/// The editor on a sphere whose first sources are voted for.
fn start_voting() -> Option<Editor> {
    let mut editor = open_sources(|folder| Some(sphere_without_normals(folder, "sphere.ply", N_POINTS)))?;
    assert!(editor.shows("No viewpoints vote"));
    editor.click_button("Let viewpoints vote");
    wait_for_work(&mut editor);
    let parameters = editor.app().document().unwrap().parameters();
    assert_eq!(
        (parameters.method, parameters.sources),
        (Method::SpanningTree, SourceRule::HiddenPointsMended)
    );
    Some(editor)
}

fn n_voted(editor: &Editor) -> usize {
    editor
        .app()
        .document()
        .unwrap()
        .propagation()
        .unwrap()
        .voted_sources
        .len()
}

#[test]
fn the_intervals_of_votes_are_dragged_live_and_let_go_in_one_step() {
    let Some(mut editor) = start_voting() else { return };
    let (steps, voted) = (n_steps(&editor), n_voted(&editor));
    assert!(voted > 100);
    let text = |n: usize| format!("{} sources", thousands(n));
    assert!(editor.shows(&text(voted)));
    let handle = editor.harness.get_by_label("Upper interval of votes").rect().center();
    let to = handle - Vec2::new(40.0, 0.0);
    drag(&mut editor, handle, to);
    assert!(!editor.shows(&text(voted)), "the number of sources follows the drag");
    assert_eq!(
        (n_voted(&editor), n_steps(&editor)),
        (voted, steps),
        "nothing is applied before it is let go"
    );
    assert!(!editor.app().is_busy());
    let eta = editor.app().document().unwrap().parameters().eta;
    button(&mut editor, to, false);
    wait_for_work(&mut editor);
    let after = editor.app().document().unwrap().parameters().eta;
    assert!(after > eta, "{after} after {eta}");
    assert_eq!(
        (last_kind(&editor), n_steps(&editor)),
        (Some(EditKind::SetParameters), steps + 1)
    );
    assert!(n_voted(&editor) > voted);
    // What was promised is what there is.
    assert!(editor.shows(&text(n_voted(&editor))));
    editor.key(Modifiers::COMMAND, Key::Z);
    wait_for_work(&mut editor);
    assert_eq!(
        (n_voted(&editor), editor.app().document().unwrap().parameters().eta),
        (voted, eta)
    );

    let lower = editor.harness.get_by_label("Lower interval of votes");
    lower.focus();
    editor.harness.run_steps(1);
    editor.key(Modifiers::NONE, Key::ArrowRight);
    wait_for_work(&mut editor);
    assert!((editor.app().document().unwrap().parameters().eta - eta - 0.01).abs() < 1e-5);
}

fn thousands(n: usize) -> String {
    normend_app::theme::thousands(n as u64)
}

fn viewpoints(editor: &Editor) -> (Vec<Vec3>, Vec<Vec3>) {
    let document = editor.app().document().unwrap();
    let in_force = document.propagation().unwrap().viewpoints.to_vec();
    (document.state().viewpoints.to_vec(), in_force)
}

#[test]
fn viewpoints_are_added_moved_removed_and_vote() {
    let Some(mut editor) = start_voting() else { return };
    assert!(editor.shows("The usual 8"));
    let steps = n_steps(&editor);
    editor.click_button("Add here");
    wait_for_work(&mut editor);
    let (wanted, in_force) = viewpoints(&editor);
    assert_eq!((wanted.len(), &wanted), (9, &in_force));
    assert!(wanted[8].distance(editor.app().camera().eye()) < 1e-5);
    assert_eq!(
        (last_kind(&editor), n_steps(&editor)),
        (Some(EditKind::SetViewpoints), steps + 1)
    );
    assert!(editor.shows("9 of your own"));

    // In the view: a drag is one step, made when it ends.
    editor.click_button("Show all");
    editor.harness.run_steps(3);
    // One that nothing else in the view lies over.
    let middle = editor.app().view_rect().shrink(100.0);
    let place = |editor: &Editor, index: usize| {
        let label = format!("Viewpoint {}", index + 1);
        let mut marks = editor.harness.query_all_by_label(&label);
        marks.next().map(|mark| mark.rect().center())
    };
    let index = (0..9).find(|&index| place(&editor, index).is_some_and(|at| middle.contains(at)));
    let index = index.unwrap();
    let mark = place(&editor, index).unwrap();
    let to = mark + Vec2::new(25.0, 10.0);
    drag(&mut editor, mark, to);
    assert_eq!(viewpoints(&editor).0, wanted);
    button(&mut editor, to, false);
    wait_for_work(&mut editor);
    let (moved, in_force) = viewpoints(&editor);
    assert_eq!((&moved, moved.len()), (&in_force, 9));
    assert!(moved[index].distance(wanted[index]) > 0.1);
    assert!(
        (moved[index] - wanted[index]).dot(editor.app().camera().back()).abs() < 1e-2,
        "parallel to the screen"
    );
    assert_eq!((0..9).filter(|&each| moved[each] != wanted[each]).count(), 1);
    assert_eq!(n_steps(&editor), steps + 2);
    let mark = place(&editor, index).unwrap();
    assert!(mark.distance(to) < 2.0, "{mark} is not where it was let go, {to}");

    editor.click_button("Remove");
    wait_for_work(&mut editor);
    let mut left = moved.clone();
    left.remove(index);
    assert_eq!(viewpoints(&editor), (left.clone(), left));
    editor.click_button("Reset");
    wait_for_work(&mut editor);
    assert_eq!(viewpoints(&editor), (vec![], vec![]));
    for _ in 0..4 {
        editor.key(Modifiers::COMMAND, Key::Z);
        wait_for_work(&mut editor);
    }
    assert_eq!((viewpoints(&editor), n_steps(&editor)), ((vec![], vec![]), steps));
}

#[test]
fn a_viewpoint_is_set_by_numbers() {
    let Some(mut editor) = start_voting() else { return };
    let field = editor.harness.get_by_label("Viewpoint 2, z");
    field.click();
    editor.harness.run_steps(2);
    editor.key(Modifiers::COMMAND, Key::A);
    editor.harness.event(Event::Text("7.5".to_owned()));
    editor.harness.run_steps(2);
    editor.key(Modifiers::NONE, Key::Enter);
    wait_for_work(&mut editor);
    let (wanted, in_force) = viewpoints(&editor);
    assert_eq!((wanted.len(), &wanted), (8, &in_force));
    assert!((wanted[1].z - 7.5).abs() < 1e-5, "{:?}", wanted[1]);
}

/// The row of the part of so many points.
fn choose_rule(editor: &mut Editor, n_points: usize, rule: &str) {
    editor.choose(&format!("Rule of the part of {n_points} points"), rule);
    editor.harness.run_steps(2);
}

fn wait_for_rules(editor: &mut Editor, n: usize) {
    editor.wait("a rule", |app| {
        let sources = app.document().unwrap().sources();
        sources
            .iter()
            .filter(|source| matches!(source.origin, Origin::Rule(_)))
            .count()
            == n
    });
    editor.harness.run_steps(2);
}

#[test]
fn each_part_has_its_rule() {
    let Some(mut editor) = open_sources(two_spheres) else {
        return;
    };
    assert!(editor.shows("2 parts"));
    let outward = editor.normals();
    choose_rule(&mut editor, N_SMALL, "Into the room");
    wait_for_rules(&mut editor, 1);
    let inward = editor.normals();
    assert_eq!(n_of(&editor, Origin::Rule(SideRule::IntoRoom)), 1);
    assert_eq!(outward[..N_POINTS], inward[..N_POINTS]);
    assert!((N_POINTS..N_POINTS + N_SMALL).all(|point| inward[point] == -outward[point]));
    assert_eq!((last_kind(&editor), n_steps(&editor)), (Some(EditKind::Rule), 1));
    let label = format!("Rule of the part of {N_SMALL} points");
    let combo = editor.harness.get_by_role_and_label(Role::ComboBox, &label);
    assert_eq!(combo.value().as_deref(), Some("Into the room, chosen"));

    choose_rule(&mut editor, N_SMALL, "Outward");
    editor.wait("outward", |app| {
        app.document().unwrap().oriented_normals().unwrap() == outward
    });
    assert_eq!(editor.n_sources(), 1, "one source a part");

    // All at once.
    editor.choose("All parts", "Into the room");
    editor.wait("all inward", |app| {
        let normals = app.document().unwrap().oriented_normals().unwrap();
        normals.iter().zip(&outward).all(|(now, outward)| *now == -*outward)
    });
    wait_for_rules(&mut editor, 2);
    assert_eq!(n_steps(&editor), 3);
    for _ in 0..3 {
        editor.key(Modifiers::COMMAND, Key::Z);
    }
    assert_eq!((editor.normals(), editor.n_sources()), (outward, 0));
}

#[test]
fn a_part_is_flipped_isolated_selected_and_faces_me() {
    let Some(mut editor) = open_sources(two_spheres) else {
        return;
    };
    let outward = editor.normals();
    editor.click_button("1,500 points");
    editor.click_button("Flip the part");
    let flipped = editor.normals();
    assert_eq!(n_different(&outward, &flipped), N_SMALL as u64);
    assert_eq!(outward[..N_POINTS], flipped[..N_POINTS]);

    editor.click_button("Isolate the part");
    editor.wait("the others hidden", |app| {
        app.document().unwrap().hidden().len() == N_POINTS as u64
    });
    editor.harness.run_steps(2);
    assert!(editor.app().document().unwrap().hidden().contains(0));
    editor.click_button("Show hidden");
    assert!(editor.app().document().unwrap().hidden().is_empty());
    editor.click_button("Select the part");
    editor.wait("a selection", |app| {
        app.document().unwrap().selected().len() == N_SMALL as u64
    });

    // From outside, all of it that the viewer could see faces the viewer when it is outward.
    choose_rule(&mut editor, N_SMALL, "Toward me");
    wait_for_rules(&mut editor, 1);
    assert!(editor.normals() == outward);
    let pivot = editor.app().camera().pivot;
    editor.click_button("Show the part");
    editor.harness.run_steps(2);
    assert!(editor.app().camera().pivot.distance(pivot) > 0.5);
    assert!(editor.app().camera().pivot.distance(Vec3::new(3.0, 0.0, 0.0)) < 0.3);
}

/// A scan of a scene from one place.
fn scan_from_one_place(folder: &Path) -> Option<PathBuf> {
    let clouds = shapes::benchmark_clouds();
    let cloud = clouds
        .iter()
        .find(|cloud| cloud.name == "room_office_1_station")
        .unwrap();
    let positions = cloud.generate(&Silent).unwrap().shape.positions;
    let path = folder.join("scan.ply");
    normend_io::write_points(&path, Positions::Float(&positions), None, &Silent).unwrap();
    Some(path)
}

#[test]
fn the_scanners_place_is_dropped_for_outward() {
    let Some(mut editor) = open_sources(scan_from_one_place) else {
        return;
    };
    let rule = |editor: &Editor| editor.app().document().unwrap().parameters().rule;
    assert!(editor.shows("Scanner"));
    editor.click_button("Drop Scanner");
    wait_for_work(&mut editor);
    assert_eq!(rule(&editor), SideRule::Outward);
    assert!(!editor.shows("Drop Scanner"));
    editor.key(Modifiers::COMMAND, Key::Z);
    wait_for_work(&mut editor);
    assert_eq!(rule(&editor), SideRule::Automatic);
    assert!(editor.shows("Drop Scanner"));
}
