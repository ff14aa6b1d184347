//! Selecting in the real editor without a window: each tool that draws, what is seen and what lies behind, how strokes join, and
//! the commands that select and hide.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, PointerButton, Pos2, Vec2};
use egui_kittest::kittest::Queryable;
use glam::Vec3;
use normend_app::command::{Action, Command};
use normend_app::tools::Tool;
use normend_core::{Parameters, PointSet, confidence};

use driver::{
    Editor, N_MANY_POINTS, N_POINTS, large_sphere_with_small_cap, sphere_with_wrong_cap, sphere_without_normals, start,
    start_scaled,
};

const SHIFT_CTRL: Modifiers = Modifiers {
    shift: true,
    ..Modifiers::COMMAND
};

fn oriented(pixels_per_point: f32) -> Option<Editor> {
    let mut editor = start_scaled(pixels_per_point, sphere_with_wrong_cap)?;
    editor.wait_until_oriented();
    Some(editor)
}

fn selected(editor: &Editor) -> PointSet {
    editor.app().document().unwrap().selected().clone()
}

fn n_steps(editor: &Editor) -> usize {
    editor.app().document().unwrap().n_done()
}

fn middle(editor: &Editor) -> Pos2 {
    editor.app().view_rect().center()
}

fn press(editor: &mut Editor, place: Pos2, pressed: bool, modifiers: Modifiers) {
    editor.harness.event(Event::PointerButton {
        pos: place,
        button: PointerButton::Primary,
        pressed,
        modifiers,
    });
    editor.harness.run_steps(1);
}

/// Drags along `path` with these keys held, and waits until the stroke is answered.
fn stroke(editor: &mut Editor, path: &[Pos2], modifiers: Modifiers) {
    editor.harness.event(Event::ModifiersChanged(modifiers));
    editor.hover(path[0]);
    press(editor, path[0], true, modifiers);
    for &place in &path[1..] {
        editor.harness.event(Event::PointerMoved(place));
        editor.harness.run_steps(1);
    }
    press(editor, path[path.len() - 1], false, modifiers);
    editor.harness.event(Event::ModifiersChanged(Modifiers::NONE));
    editor.wait("an answer to the stroke", |app| !app.is_selecting());
    editor.harness.run_steps(2);
}

fn rectangle(editor: &mut Editor, center: Pos2, half: Vec2, modifiers: Modifiers) {
    stroke(editor, &[center - half, center, center + half], modifiers);
}

/// The points seen at the pixels that `holds` says yes to, by their centers in pixels.
fn seen_where(editor: &Editor, holds: impl Fn(Vec2) -> bool) -> PointSet {
    let ([width, _], points) = editor.app().seen_points().unwrap();
    let centers = (0..).map(|index: u32| Vec2::new((index % width) as f32 + 0.5, (index / width) as f32 + 0.5));
    let seen = centers.zip(&points).filter(|&(center, _)| holds(center));
    seen.filter_map(|(_, &point)| point).collect()
}

/// Of `points` those on the side of the sphere that the camera is on.
fn n_in_front(editor: &Editor, points: &PointSet) -> usize {
    let document = editor.app().document().unwrap();
    let back = editor.app().camera().back();
    let middle = Vec3::ZERO;
    let positions = document.cloud().positions();
    let front = points
        .iter()
        .filter(|&point| (positions[point as usize] - middle).dot(back) > 0.0);
    front.count()
}

#[test]
fn a_brush_stroke_selects_exactly_what_it_is_over() {
    for pixels_per_point in [1.0, 2.0] {
        let Some(mut editor) = oriented(pixels_per_point) else {
            return;
        };
        editor.key(Modifiers::NONE, Key::B);
        assert_eq!(editor.app().tool(), Tool::Brush);
        let center = middle(&editor);
        let (from, to) = (center - Vec2::new(40.0, 10.0), center + Vec2::new(40.0, 10.0));
        let camera = *editor.app().camera();
        let before = n_steps(&editor);
        stroke(&mut editor, &[from, to], Modifiers::NONE);
        assert_eq!(*editor.app().camera(), camera, "the drag turned the view");
        assert_eq!(n_steps(&editor), before + 1, "a stroke is one step");

        let offset = editor.app().view_rect().min;
        let [a, b] = [from, to].map(|place| (place - offset) * pixels_per_point);
        // The brush is 24 points wide each way at first; right at its border rounding decides.
        let radius = 24.0 * pixels_per_point;
        let distance = |center: Vec2| {
            let t = ((center - a).dot(b - a) / (b - a).length_sq()).clamp(0.0, 1.0);
            (center - a - t * (b - a)).length()
        };
        let inside = seen_where(&editor, |center| distance(center) < radius - 0.05);
        let at_most = seen_where(&editor, |center| distance(center) < radius + 0.05);
        let points = selected(&editor);
        assert!(points.len() > 15, "{} points", points.len());
        assert!(
            inside.is_subset(&points) && points.is_subset(&at_most),
            "at {pixels_per_point}"
        );
        assert_eq!(
            n_in_front(&editor, &points),
            points.len() as usize,
            "the back was taken too"
        );

        editor.key(Modifiers::COMMAND, Key::Z);
        assert!(selected(&editor).is_empty());
        editor.key(SHIFT_CTRL, Key::Z);
        assert_eq!(selected(&editor), points);
    }
}

#[test]
fn a_larger_brush_selects_more() {
    let Some(mut editor) = oriented(1.0) else { return };
    editor.key(Modifiers::NONE, Key::B);
    let center = middle(&editor);
    let mut sizes = Vec::new();
    for key in [None, Some(Key::CloseBracket), Some(Key::OpenBracket)] {
        if let Some(key) = key {
            editor.key(Modifiers::NONE, key);
        }
        stroke(&mut editor, &[center, center], Modifiers::NONE);
        sizes.push(selected(&editor).len());
    }
    assert!(sizes[1] > sizes[0] && sizes[0] == sizes[2], "{sizes:?}");
    editor.harness.event(Event::ModifiersChanged(Modifiers::ALT));
    editor.harness.event(Event::MouseWheel {
        unit: egui::MouseWheelUnit::Line,
        delta: Vec2::new(0.0, 3.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: Modifiers::ALT,
    });
    editor.harness.run_steps(20);
    editor.harness.event(Event::ModifiersChanged(Modifiers::NONE));
    stroke(&mut editor, &[center, center], Modifiers::NONE);
    assert!(selected(&editor).len() > sizes[0]);
}

#[test]
fn through_takes_what_lies_behind_and_visible_only_does_not() {
    let Some(mut editor) = oriented(1.0) else { return };
    editor.key(Modifiers::NONE, Key::R);
    assert!(editor.app().selects_visible_only());
    let (center, half) = (middle(&editor), Vec2::new(60.0, 50.0));
    rectangle(&mut editor, center, half, Modifiers::NONE);
    let visible = selected(&editor);
    assert!(!visible.is_empty());
    assert_eq!(n_in_front(&editor, &visible), visible.len() as usize);

    let name = Command::VisibleOnly.label();
    editor.harness.get_by_role_and_label(Role::CheckBox, name).click();
    editor.harness.run_steps(2);
    assert!(!editor.app().selects_visible_only());
    rectangle(&mut editor, center, half, Modifiers::NONE);
    let through = selected(&editor);
    let front = n_in_front(&editor, &through);
    let back = through.len() as usize - front;
    assert!(back > 50 && front > 20, "{front} in front, {back} behind");
    // What is behind is what is projected there.
    let document = editor.app().document().unwrap();
    let rect = editor.app().view_rect();
    let size = glam::Vec2::new(rect.width(), rect.height());
    let from = center - half - rect.min;
    let projected = (0_u32..).zip(document.cloud().positions()).filter(|(_, position)| {
        let pixel = editor.app().camera().project(**position, size).unwrap();
        let place = Vec2::new(pixel.x, pixel.y) - from;
        // Pixels count when their center is inside.
        place.x > 0.5 && place.y > 0.5 && place.x < 2.0 * half.x - 0.5 && place.y < 2.0 * half.y - 0.5
    });
    let projected: PointSet = projected.map(|(point, _)| point).collect();
    assert!(projected.is_subset(&through));
    assert!(
        through.len() - projected.len() < 40,
        "{} and {}",
        through.len(),
        projected.len()
    );
}

#[test]
fn hidden_points_are_not_selected_and_uncover_what_is_behind() {
    let Some(mut editor) = oriented(1.0) else { return };
    editor.key(Modifiers::NONE, Key::R);
    let (center, half) = (middle(&editor), Vec2::new(50.0, 40.0));
    rectangle(&mut editor, center, half, Modifiers::NONE);
    let front = selected(&editor);
    editor.key(Modifiers::NONE, Key::H);
    assert_eq!(*editor.app().document().unwrap().hidden(), front);
    assert!(
        editor.app().availability(Command::Flip).is_err(),
        "hidden points are not meant"
    );
    editor.harness.run_steps(3);
    rectangle(&mut editor, center, 0.5 * half, Modifiers::NONE);
    let behind = selected(&editor);
    assert!(behind.len() > 10 && behind.is_disjoint(&front));
    assert!(
        n_in_front(&editor, &behind) < behind.len() as usize,
        "the inside is seen now"
    );
    // Through leaves hidden points out, and so does selecting all.
    editor.key(Modifiers::NONE, Key::V);
    rectangle(&mut editor, center, half, Modifiers::NONE);
    assert!(selected(&editor).is_disjoint(&front));
    editor.key(Modifiers::COMMAND, Key::A);
    assert_eq!(selected(&editor).len(), N_POINTS as u64 - front.len());

    editor.key(Modifiers::ALT, Key::H);
    assert!(editor.app().document().unwrap().hidden().is_empty());
    assert!(editor.app().availability(Command::ShowAll).is_err());
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(*editor.app().document().unwrap().hidden(), front);
}

#[test]
fn only_the_selection_stays_when_isolated() {
    let Some(mut editor) = oriented(1.0) else { return };
    let before = seen_where(&editor, |_| true).len();
    editor.key(Modifiers::NONE, Key::R);
    let center = middle(&editor);
    rectangle(&mut editor, center, Vec2::new(50.0, 40.0), Modifiers::NONE);
    let points = selected(&editor);
    editor.key(Modifiers::SHIFT, Key::H);
    editor.harness.run_steps(3);
    let seen = seen_where(&editor, |_| true);
    assert!(seen.is_subset(&points) && !seen.is_empty() && seen.len() < before);
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.harness.run_steps(3);
    assert_eq!(seen_where(&editor, |_| true).len(), before);
}

#[test]
fn keys_say_how_a_stroke_joins() {
    let Some(mut editor) = oriented(1.0) else { return };
    editor.key(Modifiers::NONE, Key::L);
    assert_eq!(editor.app().tool(), Tool::Lasso);
    let center = middle(&editor);
    let around = |center: Pos2| {
        let corner = |x: f32, y: f32| center + Vec2::new(40.0 * x, 30.0 * y);
        [
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ]
    };
    let (left, right) = (
        around(center - Vec2::new(20.0, 0.0)),
        around(center + Vec2::new(20.0, 0.0)),
    );
    let mut alone = |path: &[Pos2]| {
        stroke(&mut editor, path, Modifiers::NONE);
        selected(&editor)
    };
    let (a, b) = (alone(&left), alone(&right));
    assert!(!(&a & &b).is_empty() && !(&a - &b).is_empty() && !(&b - &a).is_empty());
    for (modifiers, expect) in [
        (Modifiers::SHIFT, &a | &b),
        (Modifiers::COMMAND, &a - &b),
        (SHIFT_CTRL, &a & &b),
    ] {
        stroke(&mut editor, &left, Modifiers::NONE);
        stroke(&mut editor, &right, modifiers);
        assert_eq!(selected(&editor), expect, "{modifiers:?}");
        editor.key(Modifiers::COMMAND, Key::Z);
        assert_eq!(selected(&editor), a);
    }
    // A click beside the scan picks nothing, in place of all or of nothing.
    let corner = editor.app().view_rect().left_bottom() + Vec2::new(30.0, -30.0);
    stroke(&mut editor, &[corner], Modifiers::SHIFT);
    assert_eq!(selected(&editor), a);
    stroke(&mut editor, &[corner], Modifiers::NONE);
    assert!(selected(&editor).is_empty());
}

#[test]
fn a_polygon_is_clicked_mended_and_closed() {
    let Some(mut editor) = oriented(1.0) else { return };
    editor.key(Modifiers::NONE, Key::O);
    let center = middle(&editor);
    let corner = |x: f32, y: f32| center + Vec2::new(x, y);
    let click = |editor: &mut Editor, place: Pos2| {
        editor.hover(place);
        press(editor, place, true, Modifiers::NONE);
        press(editor, place, false, Modifiers::NONE);
    };
    let corners = [corner(-60.0, -40.0), corner(60.0, -40.0), corner(0.0, 60.0)];
    click(&mut editor, corners[0]);
    click(&mut editor, corners[1]);
    click(&mut editor, corner(150.0, 150.0));
    editor.key(Modifiers::NONE, Key::Backspace);
    click(&mut editor, corners[2]);
    assert!(selected(&editor).is_empty(), "it is not closed yet");
    editor.key(Modifiers::NONE, Key::Enter);
    editor.wait("an answer to the polygon", |app| !app.is_selecting());
    let points = selected(&editor);
    let origin = editor.app().view_rect().min;
    let inside = |reach: f32| {
        let corners = corners.map(|corner| corner - origin);
        seen_where(&editor, move |at| {
            (0..3).all(|index| {
                let (a, b) = (corners[index], corners[(index + 1) % 3]);
                let across = (b - a).rot90().normalized();
                (at - a).dot(across) < reach
            })
        })
    };
    assert!(inside(-0.05).is_subset(&points) && points.is_subset(&inside(0.05)));
    assert!(points.len() > 15, "{}", points.len());
    assert_eq!(editor.n_sources(), 0, "Enter mended");

    // Escape leaves it, the first corner and a double-click close it.
    click(&mut editor, corners[0]);
    editor.key(Modifiers::NONE, Key::Escape);
    assert_eq!(selected(&editor), points);
    for last in [corners[0], corners[2]] {
        editor.key(SHIFT_CTRL, Key::A);
        for corner in corners {
            click(&mut editor, corner);
        }
        click(&mut editor, last);
        editor.wait("an answer to the polygon", |app| !app.is_selecting());
        assert_eq!(selected(&editor), points, "closed at {last:?}");
    }
}

#[test]
fn commands_select_all_none_and_the_others() {
    let Some(mut editor) = oriented(1.0) else { return };
    assert!(editor.app().availability(Command::SelectNone).is_err());
    editor.key(Modifiers::COMMAND, Key::A);
    assert_eq!(selected(&editor).len(), N_POINTS as u64);
    editor.key(Modifiers::COMMAND, Key::I);
    assert!(selected(&editor).is_empty());
    editor.key(Modifiers::NONE, Key::R);
    let center = middle(&editor);
    rectangle(&mut editor, center, Vec2::new(30.0, 30.0), Modifiers::NONE);
    let some = selected(&editor);
    editor.key(Modifiers::COMMAND, Key::I);
    assert_eq!(selected(&editor).len(), N_POINTS as u64 - some.len());
    editor.key(SHIFT_CTRL, Key::A);
    assert!(selected(&editor).is_empty());
    // Escape deselects too, and undo brings it back.
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.key(Modifiers::NONE, Key::Escape);
    assert!(selected(&editor).is_empty());
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(selected(&editor).len(), N_POINTS as u64 - some.len());
}

#[test]
fn a_selection_grows_and_shrinks_by_about_a_splat() {
    let Some(mut editor) = oriented(1.0) else { return };
    editor.key(Modifiers::NONE, Key::R);
    let center = middle(&editor);
    rectangle(&mut editor, center, Vec2::new(30.0, 30.0), Modifiers::NONE);
    let some = selected(&editor);
    editor.key(Modifiers::SHIFT, Key::CloseBracket);
    editor.wait("a grown selection", |app| !app.is_selecting());
    let grown = selected(&editor);
    assert!(some.is_subset(&grown) && grown.len() > some.len());
    assert!(grown.len() < 3 * some.len(), "{} from {}", grown.len(), some.len());
    // Two at once come one after the other.
    editor.key(Modifiers::SHIFT, Key::OpenBracket);
    editor.key(Modifiers::SHIFT, Key::OpenBracket);
    editor.wait("a shrunk selection", |app| !app.is_selecting());
    let shrunk = selected(&editor);
    assert!(shrunk.is_subset(&grown) && shrunk.len() < some.len());
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(selected(&editor), grown);
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(selected(&editor), some);
}

#[test]
fn what_shows_its_back_is_selected_by_the_picture() {
    let Some(mut editor) = oriented(1.0) else { return };
    editor.key(Modifiers::COMMAND, Key::P);
    editor.harness.run_steps(2);
    editor.harness.event(Event::Text("shows its back".to_owned()));
    editor.harness.run_steps(2);
    editor.key(Modifiers::NONE, Key::Enter);
    editor.wait("what shows its back", |app| {
        !app.is_selecting() && !app.document().unwrap().selected().is_empty()
    });
    let document = editor.app().document().unwrap();
    let eye = editor.app().camera().eye();
    for point in document.selected() {
        let toward_eye = eye - document.cloud().positions()[point as usize];
        assert!(document.oriented_normal(point).unwrap().dot(toward_eye) < 0.0);
    }
    let wrong = n_in_front(&editor, &selected(&editor));
    assert!(wrong > 100 && wrong == selected(&editor).len() as usize, "{wrong}");
    assert!(editor.said("seen from the back"));
}

#[test]
fn pinned_and_undecided_points_are_selected_by_name() {
    let Some(mut editor) = start(|folder| Some(sphere_without_normals(folder, "sphere.ply", 3000))) else {
        return;
    };
    editor.wait_until_oriented();
    assert!(editor.app().availability(Command::SelectPinned).is_err());
    let run = |editor: &mut Editor, words: &str| {
        editor.key(Modifiers::COMMAND, Key::P);
        editor.harness.run_steps(2);
        editor.harness.event(Event::Text(words.to_owned()));
        editor.harness.run_steps(2);
        editor.key(Modifiers::NONE, Key::Enter);
        editor.wait("an answer", |app| !app.is_selecting());
        editor.harness.run_steps(2);
    };
    editor.key(Modifiers::NONE, Key::R);
    let center = middle(&editor);
    rectangle(&mut editor, center, Vec2::new(30.0, 30.0), Modifiers::NONE);
    let pinned = selected(&editor);
    editor.key(Modifiers::NONE, Key::P);
    run(&mut editor, "undecided points");
    let document = editor.app().document().unwrap();
    let sure = confidence::confidence(document.propagation().unwrap()).unwrap();
    let undecided = (0_u32..).zip(&sure).filter(|&(_, &sure)| sure <= confidence::UNDECIDED);
    assert_eq!(selected(&editor), undecided.map(|(point, _)| point).collect());
    run(&mut editor, "pinned points");
    assert_eq!(selected(&editor), pinned);
    assert!(editor.shows(&format!("{} selected", pinned.len())));
}

#[test]
fn the_picture_follows_what_is_selected_through_undo_and_redo() {
    let Some(mut editor) = oriented(1.0) else { return };
    editor.hover(editor.app().view_rect().left_bottom() + Vec2::new(200.0, -8.0));
    editor.harness.run_steps(10);
    let plain = editor.picture().rgba;
    editor.key(Modifiers::COMMAND, Key::A);
    editor.harness.run_steps(3);
    let all = editor.picture().rgba;
    assert_ne!(all, plain);
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.harness.run_steps(3);
    assert_eq!(editor.picture().rgba, plain);
    editor.key(SHIFT_CTRL, Key::Z);
    editor.harness.run_steps(3);
    assert_eq!(editor.picture().rgba, all);
}

#[test]
fn another_propagation_selects_the_same_points_in_its_own_order() {
    let Some(mut editor) = oriented(1.0) else { return };
    let parameters = editor.app().document().unwrap().parameters();
    let other = Parameters {
        k_graph: *Parameters::K_GRAPH.start(),
        ..parameters
    };
    let propagate = |editor: &mut Editor, parameters: Parameters| {
        let app = editor.harness.state_mut();
        app.act(Action::Propagate(parameters));
        editor.wait("another propagation", |app| {
            let in_force = app
                .document()
                .unwrap()
                .propagation()
                .map(|propagation| propagation.parameters);
            !app.is_busy() && in_force == Some(parameters)
        });
        let tree = &editor.app().document().unwrap().propagation().unwrap().tree;
        tree.order().to_vec()
    };
    let other_order = propagate(&mut editor, other);
    let away = editor.app().view_rect().left_bottom() + Vec2::new(200.0, -8.0);
    editor.hover(away);
    editor.harness.run_steps(10);
    let plain = editor.picture();
    let (_, seen) = editor.app().seen_points().unwrap();

    assert!(
        propagate(&mut editor, parameters) != other_order,
        "the order is the same"
    );
    editor.key(Modifiers::NONE, Key::R);
    let center = middle(&editor);
    rectangle(&mut editor, center, Vec2::new(70.0, 40.0), Modifiers::NONE);
    let chosen = selected(&editor);
    assert!(!chosen.is_empty() && chosen.len() < N_POINTS as u64 / 4);

    assert!(propagate(&mut editor, other) == other_order, "the order is another one");
    assert_eq!(selected(&editor), chosen);
    editor.hover(away);
    editor.harness.run_steps(10);
    let shown = editor.picture();
    let pixels = plain.rgba.chunks_exact(4).zip(shown.rgba.chunks_exact(4)).zip(&seen);
    for (index, ((before, after), point)) in pixels.enumerate() {
        let is_chosen = point.is_some_and(|point| chosen.contains(point));
        assert_eq!(before != after, is_chosen, "pixel {index} of point {point:?}");
    }
}

#[test]
fn selecting_uploads_what_was_selected_alone() {
    let Some(mut editor) = start(large_sphere_with_small_cap) else {
        return;
    };
    editor.wait_until_oriented();
    editor.key(Modifiers::NONE, Key::B);
    let center = middle(&editor);
    editor.harness.run_steps(3);
    let before = editor.app().bytes_uploaded();
    stroke(&mut editor, &[center, center], Modifiers::NONE);
    let n_points = selected(&editor).len();
    let bytes = editor.app().bytes_uploaded() - before;
    // A bit a point in words of 32, and what lies between words that are near; far less than a bit for each point of the scan.
    assert!(
        bytes > 0 && bytes < N_MANY_POINTS as u64 / 8 / 4,
        "{bytes} for {n_points}"
    );
    // The same again changes nothing.
    let before = (editor.app().bytes_uploaded(), n_steps(&editor));
    stroke(&mut editor, &[center, center], Modifiers::NONE);
    assert_eq!((editor.app().bytes_uploaded(), n_steps(&editor)), before);
}

#[test]
fn the_view_moves_while_a_tool_draws() {
    let Some(mut editor) = oriented(1.0) else { return };
    editor.key(Modifiers::NONE, Key::B);
    let center = middle(&editor);
    for (button, modifiers) in [
        (PointerButton::Secondary, Modifiers::NONE),
        (PointerButton::Middle, Modifiers::NONE),
        (PointerButton::Primary, Modifiers::ALT),
    ] {
        let camera = *editor.app().camera();
        editor.hover(center);
        for (place, pressed) in [(center, true), (center + Vec2::new(60.0, 20.0), false)] {
            editor.harness.event(Event::PointerMoved(place));
            editor.harness.run_steps(2);
            editor.harness.event(Event::PointerButton {
                pos: place,
                button,
                pressed,
                modifiers,
            });
            editor.harness.run_steps(2);
        }
        assert_ne!(*editor.app().camera(), camera, "{button:?} did not move the view");
        assert!(selected(&editor).is_empty(), "{button:?} selected something");
    }
}

#[test]
fn tools_are_chosen_by_buttons_and_keys() {
    let Some(editor) = start(|_| None) else { return };
    assert!(
        editor.app().availability(Command::BrushTool).is_err(),
        "there is nothing to use it on"
    );
    drop(editor);
    let Some(mut editor) = oriented(1.0) else { return };
    for tool in Tool::ALL {
        let name = tool.command().label();
        editor.harness.get_by_role_and_label(Role::RadioButton, name).click();
        editor.harness.run_steps(2);
        assert_eq!(editor.app().tool(), tool);
    }
    for (key, tool) in [
        (Key::M, Tool::Mend),
        (Key::B, Tool::Brush),
        (Key::L, Tool::Lasso),
        (Key::R, Tool::Rectangle),
        (Key::O, Tool::Polygon),
        (Key::A, Tool::Patch),
        (Key::C, Tool::Component),
    ] {
        editor.key(Modifiers::NONE, key);
        assert_eq!(editor.app().tool(), tool);
    }
}
