//! Moving around in the real editor without a window: drags, wheel, fingers, keys, flights, flying, clipping, and the axes to click on.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use egui::accesskit::Role;
use egui::{Event, Key, Modifiers, MouseWheelSource, MouseWheelUnit, PointerButton, Pos2, TouchPhase, Vec2};
use egui_kittest::kittest::Queryable;
use glam::Vec3;
use normend_app::command::Command;
use normend_app::panels::empty;
use normend_app::panels::side::SideTab;
use normend_app::settings::Settings;
use normend_app::viewport::{Navigation, Touchpad};
use normend_render::{Camera, Projection, UpAxis};

use driver::{Editor, is_flipped_source, sphere_with_wrong_cap, start_prepared};

/// The oriented sphere, with these settings.
fn start(prepare: impl FnOnce(&mut Settings)) -> Option<Editor> {
    let mut editor = start_prepared(1.0, prepare, sphere_with_wrong_cap)?;
    editor.wait_until_oriented();
    Some(editor)
}

fn camera(editor: &Editor) -> Camera {
    *editor.app().camera()
}

/// Presses at `from`, moves to `to` in steps, and releases.
fn drag(editor: &mut Editor, button: PointerButton, from: Pos2, to: Pos2) {
    take(editor, button, from);
    slide(editor, from, to);
    release(editor, button, to);
}

fn take(editor: &mut Editor, button: PointerButton, at: Pos2) {
    editor.hover(at);
    editor.harness.event(Event::PointerButton {
        pos: at,
        button,
        pressed: true,
        modifiers: Modifiers::NONE,
    });
    editor.harness.run_steps(1);
}

fn slide(editor: &mut Editor, from: Pos2, to: Pos2) {
    for step in 1..=8 {
        editor.harness.hover_at(from.lerp(to, step as f32 / 8.0));
        editor.harness.run_steps(1);
    }
}

fn release(editor: &mut Editor, button: PointerButton, at: Pos2) {
    editor.harness.event(Event::PointerButton {
        pos: at,
        button,
        pressed: false,
        modifiers: Modifiers::NONE,
    });
    editor.harness.run_steps(2);
}

fn scroll(editor: &mut Editor, unit: MouseWheelUnit, source: MouseWheelSource, delta: Vec2, modifiers: Modifiers) {
    editor.harness.event(Event::ModifiersChanged(modifiers));
    editor.harness.event(Event::MouseWheel {
        unit,
        delta,
        phase: TouchPhase::Move,
        source,
        modifiers,
    });
    // The wheel is smoothed over some frames.
    editor.harness.run_steps(40);
    editor.harness.event(Event::ModifiersChanged(Modifiers::NONE));
    editor.harness.run_steps(2);
}

fn wheel(editor: &mut Editor, notches: f32, modifiers: Modifiers) {
    let delta = Vec2::new(0.0, notches);
    scroll(editor, MouseWheelUnit::Line, MouseWheelSource::Wheel, delta, modifiers);
}

fn fingers(editor: &mut Editor, delta: Vec2) {
    scroll(
        editor,
        MouseWheelUnit::Point,
        MouseWheelSource::Trackpad,
        delta,
        Modifiers::NONE,
    );
}

fn hold_key(editor: &mut Editor, key: Key, pressed: bool) {
    editor.harness.event(Event::Key {
        key,
        physical_key: Some(key),
        pressed,
        repeat: false,
        modifiers: Modifiers::NONE,
    });
    editor.harness.run_steps(1);
}

/// Takes `wanted` from a list that may stand below the visible part of its tab.
fn choose_below(editor: &mut Editor, label: &str, wanted: &str) {
    editor
        .harness
        .get_by_role_and_label(Role::ComboBox, label)
        .scroll_to_me();
    editor.harness.run_steps(20);
    editor.choose(label, wanted);
}

fn middle(editor: &Editor) -> Pos2 {
    editor.app().view_rect().center()
}

fn assert_near(a: Vec3, b: Vec3) {
    assert!(a.distance(b) < 1e-3, "{a} is not {b}");
}

#[test]
fn a_turntable_keeps_up_up_and_a_trackball_goes_over_the_pole() {
    for style in Navigation::ALL {
        let Some(mut editor) = start(|settings| settings.navigation.style = style) else {
            return;
        };
        editor.key(Modifiers::NONE, Key::Num1);
        assert_near(camera(&editor).back(), Vec3::NEG_Y);
        let from = middle(&editor);
        drag(&mut editor, PointerButton::Primary, from, from + Vec2::new(60.0, 0.0));
        let turned = camera(&editor).back();
        assert!(
            turned.x < -0.2 && turned.z.abs() < 0.1,
            "the scan follows the pointer: {turned}"
        );
        for _ in 0..4 {
            drag(&mut editor, PointerButton::Primary, from, from + Vec2::new(0.0, 180.0));
        }
        let up = camera(&editor).up();
        match style {
            Navigation::Turntable => {
                assert_near(camera(&editor).back(), Vec3::Z);
                assert!(camera(&editor).right().z.abs() < 1e-4);
            }
            Navigation::Trackball => assert!(up.z < -0.2 || camera(&editor).back().z < 0.9, "{up}"),
        }
        assert_eq!(editor.n_sources(), 0, "a drag is no click");
    }
}

#[test]
fn changing_to_the_turntable_levels_the_horizon() {
    let prepare = |settings: &mut Settings| {
        settings.navigation.style = Navigation::Trackball;
        settings.side_tab = SideTab::View;
    };
    let Some(mut editor) = start(prepare) else {
        return;
    };
    let from = middle(&editor);
    drag(
        &mut editor,
        PointerButton::Primary,
        from,
        from + Vec2::new(-90.0, 120.0),
    );
    drag(&mut editor, PointerButton::Primary, from, from + Vec2::new(200.0, 10.0));
    assert!(
        camera(&editor).right().z.abs() > 0.05,
        "it rolled: {}",
        camera(&editor).right()
    );
    choose_below(&mut editor, "Drag", Navigation::Turntable.label());
    editor.harness.run_steps(3);
    assert!(camera(&editor).right().z.abs() < 1e-4 && camera(&editor).up().z >= -1e-4);
}

#[test]
fn the_up_axis_stands_the_scan_upright_and_names_the_views() {
    let prepare = |settings: &mut Settings| {
        settings.navigation.up_axis = UpAxis::YUp;
        settings.side_tab = SideTab::View;
    };
    let Some(mut editor) = start(prepare) else {
        return;
    };
    assert!(camera(&editor).up().y > 0.5, "opened upright: {}", camera(&editor).up());
    editor.key(Modifiers::NONE, Key::Num7);
    assert_near(camera(&editor).back(), Vec3::Y);
    editor.key(Modifiers::NONE, Key::Num1);
    assert_near(camera(&editor).back(), Vec3::Z);
    choose_below(&mut editor, "Up", UpAxis::YDown.label());
    editor.harness.run_steps(3);
    assert_near(camera(&editor).up(), Vec3::NEG_Y);
    assert_near(camera(&editor).back(), Vec3::NEG_Z);
    editor.harness.run_steps(3);
    let file = std::fs::read_to_string(editor.folder.path().join("settings/settings.toml")).unwrap();
    assert!(file.contains("up_axis = \"-y\""), "{file}");
}

#[test]
fn views_are_flown_to_and_any_input_arrives_at_once() {
    let Some(mut editor) = start(|settings| settings.reduce_motion = false) else {
        return;
    };
    let before = camera(&editor);
    editor.key(Modifiers::NONE, Key::Num3);
    editor.harness.run_steps(4);
    let between = camera(&editor).back();
    assert!(
        between.distance(before.back()) > 0.01 && between.distance(Vec3::X) > 0.01,
        "{between}"
    );
    editor.harness.run_steps(20);
    assert_near(camera(&editor).back(), Vec3::X);

    editor.key(Modifiers::NONE, Key::Num7);
    assert!(camera(&editor).back().distance(Vec3::Z) > 0.01);
    let at = middle(&editor);
    editor.hover(at);
    editor.harness.event(Event::Zoom(1.0));
    editor.harness.run_steps(1);
    assert_near(camera(&editor).back(), Vec3::Z);
    // Two views in one flight: the second begins where the first was going.
    editor.key(Modifiers::NONE, Key::Num1);
    editor.key(Modifiers::NONE, Key::Num5);
    assert_eq!(camera(&editor).projection, Projection::Orthographic);
    assert_near(camera(&editor).back(), Vec3::NEG_Y);
}

#[test]
fn with_reduced_motion_views_are_there_at_once() {
    let Some(mut editor) = start(|settings| settings.reduce_motion = true) else {
        return;
    };
    editor.harness.key_press(Key::Num3);
    editor.harness.run_steps(1);
    assert_near(camera(&editor).back(), Vec3::X);
}

#[test]
fn f_frames_what_is_selected_and_home_frames_all() {
    let Some(mut editor) = start(|_| {}) else { return };
    let whole = camera(&editor);
    editor.mend();
    let source = editor.app().document().unwrap().sources().iter().next().unwrap().point;
    let position = editor.app().document().unwrap().cloud().positions()[source as usize];
    editor.key(Modifiers::NONE, Key::Escape);
    editor.key(Modifiers::NONE, Key::F);
    assert!(
        (camera(&editor).distance / whole.distance - 1.0).abs() < 0.05,
        "nothing is selected: all"
    );
    let action = Command::SelectAllSources.into();
    editor.harness.state_mut().act(action);
    editor.key(Modifiers::NONE, Key::F);
    assert_near(camera(&editor).pivot, position);
    assert!(camera(&editor).distance < 0.3 * whole.distance);
    assert_near(camera(&editor).back(), whole.back());
    editor.key(Modifiers::NONE, Key::Home);
    assert!((camera(&editor).distance / whole.distance - 1.0).abs() < 0.05);
}

#[test]
fn the_wheel_with_ctrl_cuts_with_alt_sizes_splats_and_with_shift_still_zooms() {
    let Some(mut editor) = start(|_| {}) else { return };
    let place = middle(&editor);
    editor.hover(place);
    let (before, picture) = (camera(&editor), editor.picture());

    wheel(&mut editor, 30.0, Modifiers::COMMAND | Modifiers::CTRL);
    let near = editor.app().clip().near;
    assert!((near - 0.6).abs() < 1e-4, "{near}");
    assert_eq!(camera(&editor), before, "the cut moves no camera");
    assert!(editor.shows("The nearest 60 % is cut away"));
    let is_other = editor
        .picture()
        .rgba
        .iter()
        .zip(&picture.rgba)
        .filter(|(a, b)| a != b)
        .count();
    assert!(
        is_other > 1000,
        "the front of the sphere is gone: {is_other} bytes differ"
    );
    wheel(&mut editor, -29.0, Modifiers::COMMAND | Modifiers::CTRL);
    wheel(&mut editor, -5.0, Modifiers::COMMAND | Modifiers::CTRL);
    assert_eq!(editor.app().clip().near, 0.0);
    assert!(!editor.shows("is cut away"));
    // And by keys.
    editor.key(Modifiers::SHIFT, Key::PageUp);
    assert!(editor.app().clip().near > 0.0);
    editor.key(Modifiers::SHIFT, Key::PageDown);
    assert_eq!(editor.app().clip().near, 0.0);

    wheel(&mut editor, 2.0, Modifiers::ALT);
    assert_eq!(camera(&editor), before, "splats grow, nothing moves");
    editor.harness.run_steps(2);
    let file = std::fs::read_to_string(editor.folder.path().join("settings/settings.toml")).unwrap();
    let scale: f32 = file
        .lines()
        .find_map(|line| line.strip_prefix("splat_scale = "))
        .unwrap()
        .parse()
        .unwrap();
    assert!(scale > 1.05, "{scale}");

    wheel(&mut editor, 1.0, Modifiers::NONE);
    let once = before.distance / camera(&editor).distance;
    assert!(once > 1.05, "{once}");
    wheel(&mut editor, 1.0, Modifiers::SHIFT);
    let twice = before.distance / camera(&editor).distance;
    assert!((twice / once / once - 1.0).abs() < 0.02, "{once} {twice}");
}

#[test]
fn fingers_pinch_to_zoom_and_slide_to_pan_as_the_settings_say() {
    for touchpad in Touchpad::ALL {
        let Some(mut editor) = start(|settings| settings.navigation.touchpad = touchpad) else {
            return;
        };
        let place = middle(&editor);
        editor.hover(place);
        let before = camera(&editor);
        editor.harness.event(Event::Zoom(1.5));
        editor.harness.run_steps(2);
        let pinched = camera(&editor);
        assert!((before.distance / pinched.distance - 1.5).abs() < 1e-3);
        fingers(&mut editor, Vec2::new(0.0, 60.0));
        let slid = camera(&editor);
        let is_zoomed = (slid.distance / pinched.distance - 1.0).abs() > 0.01;
        assert_eq!(is_zoomed, touchpad == Touchpad::Zoom, "{touchpad:?}");
        if touchpad == Touchpad::Pan {
            let size = editor.app().view_rect().size();
            let seen = slid.project(pinched.pivot, glam::Vec2::new(size.x, size.y)).unwrap();
            let was = pinched.project(pinched.pivot, glam::Vec2::new(size.x, size.y)).unwrap();
            assert!(
                (seen - was).distance(glam::Vec2::new(0.0, 60.0)) < 2.0,
                "{was} to {seen}"
            );
        }
    }
}

#[test]
fn a_drag_can_turn_around_what_it_begins_on() {
    for is_on in [false, true] {
        let Some(mut editor) = start(|settings| settings.navigation.orbit_under_pointer = is_on) else {
            return;
        };
        let (place, _) = editor.hover_wrong_patch();
        let before = camera(&editor);
        drag(
            &mut editor,
            PointerButton::Primary,
            place,
            place + Vec2::new(50.0, 20.0),
        );
        let pivot = camera(&editor).pivot;
        if is_on {
            assert!((pivot.length() - 1.0).abs() < 0.05, "on the sphere: {pivot}");
            let size = editor.app().view_rect().size();
            let size = glam::Vec2::new(size.x, size.y);
            let moved = camera(&editor).project(pivot, size).unwrap() - before.project(pivot, size).unwrap();
            assert!(moved.length() < 1.0, "it stays in place: {moved}");
        } else {
            assert_near(pivot, before.pivot);
        }
    }
}

#[test]
fn flying_moves_the_eye_by_keys_that_are_no_commands_meanwhile() {
    let Some(mut editor) = start(|_| {}) else { return };
    editor.key(Modifiers::NONE, Key::Num1);
    editor.key(Modifiers::SHIFT, Key::F);
    assert!(editor.shows("Flying at speed 1.00"));
    let start = camera(&editor);
    hold_key(&mut editor, Key::W, true);
    editor.harness.run_steps(20);
    hold_key(&mut editor, Key::W, false);
    let there = camera(&editor);
    let way = there.eye() - start.eye();
    assert!(
        way.dot(-start.back()) > 0.05 && way.dot(start.right()).abs() < 1e-3,
        "forward: {way}"
    );
    editor.harness.run_steps(5);
    assert_eq!(camera(&editor), there, "it stops with the key");

    // D moves to the right and does not change the colors.
    let mode = editor.app().display_mode();
    hold_key(&mut editor, Key::D, true);
    editor.harness.run_steps(5);
    hold_key(&mut editor, Key::D, false);
    assert_eq!(editor.app().display_mode(), mode);
    assert!((camera(&editor).eye() - there.eye()).dot(there.right()) > 0.01);

    // A drag looks around from where the eye is.
    let there = camera(&editor);
    let from = middle(&editor);
    drag(&mut editor, PointerButton::Primary, from, from + Vec2::new(80.0, 30.0));
    assert!(camera(&editor).eye().distance(there.eye()) < 1e-3);
    assert!(camera(&editor).back().distance(there.back()) > 0.05);

    editor.hover(from);
    wheel(&mut editor, 2.0, Modifiers::NONE);
    assert!(!editor.shows("Flying at speed 1.00") && editor.shows("Flying at speed 1."));
    assert!(
        camera(&editor).eye().distance(there.eye()) < 1e-3,
        "the wheel sets the speed"
    );

    editor.key(Modifiers::NONE, Key::Escape);
    assert!(!editor.shows("Flying"));
    editor.key(Modifiers::NONE, Key::D);
    assert_ne!(editor.app().display_mode(), mode, "D is a command again");
}

#[test]
fn the_clip_box_is_dragged_by_its_faces() {
    let Some(mut editor) = start(|_| {}) else { return };
    let whole = editor.picture();
    editor.key(Modifiers::SHIFT, Key::B);
    editor.harness.run_steps(2);
    let before = editor.app().clip().bounds.unwrap();
    assert!(
        before[0].max_element() < -0.99 && before[1].min_element() > 0.99,
        "{before:?}"
    );
    assert_eq!(editor.picture().rgba, whole.rgba, "a new box cuts nothing");

    let handle = |editor: &Editor, label: &str| {
        editor
            .harness
            .get_by_role_and_label(Role::Slider, label)
            .rect()
            .center()
    };
    let from = handle(&editor, "Clip box, high x");
    // Toward the opposite handle, half of the way.
    let to = from.lerp(handle(&editor, "Clip box, low x"), 0.5);
    take(&mut editor, PointerButton::Primary, from);
    slide(&mut editor, from, to);
    let during = editor.app().clip().bounds.unwrap();
    assert!(during[1].x.abs() < 0.3, "near the middle: {during:?}");
    assert!(editor.shows("Clip box, high x"));
    release(&mut editor, PointerButton::Primary, to);
    editor.harness.run_steps(30);
    let after = editor.app().clip().bounds.unwrap();
    assert_eq!(after, during);
    assert_eq!(
        (after[0], after[1].y, after[1].z),
        (before[0], before[1].y, before[1].z),
        "only that face moved"
    );
    assert_eq!(editor.n_sources(), 0, "no click on the scan");
    let is_other = editor
        .picture()
        .rgba
        .iter()
        .zip(&whole.rgba)
        .filter(|(a, b)| a != b)
        .count();
    assert!(is_other > 1000, "half of the sphere is gone: {is_other}");

    // Escape in the middle of a drag takes it back.
    let from = handle(&editor, "Clip box, high y");
    take(&mut editor, PointerButton::Primary, from);
    let opposite = handle(&editor, "Clip box, low y");
    slide(&mut editor, from, from.lerp(opposite, 0.3));
    assert_ne!(editor.app().clip().bounds.unwrap(), after);
    editor.key(Modifiers::NONE, Key::Escape);
    assert_eq!(editor.app().clip().bounds.unwrap(), after);
    release(&mut editor, PointerButton::Primary, from);
    assert_eq!(editor.app().clip().bounds.unwrap(), after);

    // And by keys.
    editor
        .harness
        .get_by_role_and_label(Role::Slider, "Clip box, high x")
        .focus();
    editor.harness.run_steps(2);
    let view = camera(&editor);
    editor.key(Modifiers::NONE, Key::ArrowLeft);
    let bounds = editor.app().clip().bounds.unwrap();
    assert!(bounds[1].x < after[1].x - 0.01, "{bounds:?}");
    editor.key(Modifiers::NONE, Key::ArrowUp);
    assert!((editor.app().clip().bounds.unwrap()[1].x - after[1].x).abs() < 1e-5);
    assert_eq!(camera(&editor), view, "the arrows are the handle's");

    editor.key(Modifiers::SHIFT, Key::B);
    editor.harness.run_steps(2);
    assert_eq!(editor.app().clip().bounds, None);
    assert!(!editor.shows("Clip box, high x"));
}

#[test]
fn a_click_on_an_axis_looks_from_there_and_again_from_the_other_side() {
    let Some(mut editor) = start(|_| {}) else { return };
    for (axis, direction) in [("+x", Vec3::X), ("−y", Vec3::NEG_Y), ("+z", Vec3::Z)] {
        let label = format!("Look from {axis}");
        let place = editor
            .harness
            .get_by_role_and_label(Role::Button, &label)
            .rect()
            .center();
        editor.click(place);
        editor.harness.run_steps(2);
        assert_near(camera(&editor).back(), direction);
        let place = editor
            .harness
            .get_by_role_and_label(Role::Button, &label)
            .rect()
            .center();
        editor.click(place);
        assert_near(camera(&editor).back(), -direction);
        // Back to where all axes are apart.
        editor.key(Modifiers::NONE, Key::Num9);
    }
    assert_eq!(editor.n_sources(), 0);
    // Assistive technology presses it too.
    editor.click_button("Look from −x");
    assert_near(camera(&editor).back(), Vec3::NEG_X);
}

#[test]
fn everything_moves_by_keys_alone() {
    let Some(mut editor) = start(|_| {}) else { return };
    let start = camera(&editor);
    editor.key(Modifiers::NONE, Key::ArrowLeft);
    assert_near(camera(&editor).pivot, start.pivot);
    assert!(camera(&editor).back().distance(start.back()) > 0.05);
    editor.key(Modifiers::NONE, Key::ArrowRight);
    assert_near(camera(&editor).back(), start.back());
    for (there, back) in [(Key::ArrowLeft, Key::ArrowRight), (Key::ArrowUp, Key::ArrowDown)] {
        editor.key(Modifiers::SHIFT, there);
        assert_near(camera(&editor).back(), start.back());
        assert!(camera(&editor).pivot.distance(start.pivot) > 0.01);
        editor.key(Modifiers::SHIFT, back);
        assert_near(camera(&editor).pivot, start.pivot);
    }
    editor.key(Modifiers::NONE, Key::PageUp);
    assert!(camera(&editor).distance < 0.9 * start.distance);
    editor.key(Modifiers::NONE, Key::PageDown);
    assert!((camera(&editor).distance / start.distance - 1.0).abs() < 1e-3);
}

/// A click at a place of the window means the same point on every screen, and marks are as large to the eye.
#[test]
fn screens_of_any_density_pick_the_same_point() {
    let mut clicked = Vec::new();
    let mut sphere_sizes = Vec::new();
    for pixels_per_point in [1.0, 1.5, 2.0] {
        let Some(mut editor) = start_prepared(pixels_per_point, |_| {}, sphere_with_wrong_cap) else {
            return;
        };
        editor.wait_until_oriented();
        let place = middle(&editor) + Vec2::new(13.0, -9.0);
        editor.click(place);
        editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
        editor.hover(editor.app().view_rect().left_top() + Vec2::splat(3.0));
        editor.harness.run_steps(30);
        clicked.push(editor.app().document().unwrap().sources().iter().next().unwrap().point);
        let n_pixels = editor.picture().count(is_flipped_source) as f32;
        sphere_sizes.push(n_pixels / pixels_per_point / pixels_per_point);
    }
    assert!(clicked.iter().all(|point| *point == clicked[0]), "{clicked:?}");
    assert!(sphere_sizes[0] > 20.0, "{sphere_sizes:?}");
    for size in &sphere_sizes {
        assert!((size / sphere_sizes[0] - 1.0).abs() < 0.35, "{sphere_sizes:?}");
    }
}

#[test]
fn windows_of_any_size_show_the_scan() {
    let Some(mut editor) = start(|_| {}) else { return };
    for size in [
        Vec2::new(420.0, 260.0),
        Vec2::new(400.0, 1400.0),
        Vec2::new(2200.0, 300.0),
        Vec2::new(1000.0, 700.0),
    ] {
        editor.harness.set_size(size);
        editor.harness.run_steps(3);
        editor.key(Modifiers::NONE, Key::F);
        editor.harness.run_steps(3);
        assert!(camera(&editor).eye().is_finite() && camera(&editor).distance > 0.0);
        let rect = editor.app().view_rect();
        if rect.width() > 1.0 && rect.height() > 1.0 {
            let seen = camera(&editor)
                .project(Vec3::ZERO, glam::Vec2::new(rect.width(), rect.height()))
                .unwrap();
            assert!(
                rect.contains(rect.min + Vec2::new(seen.x, seen.y)),
                "{size}: {seen} in {rect}"
            );
        }
    }
}

#[test]
fn where_files_cannot_be_dropped_the_first_page_says_so() {
    for can_drop in [true, false] {
        let page = egui_kittest::Harness::builder()
            .with_size(Vec2::new(800.0, 600.0))
            .build_ui(|ui| {
                empty::ui(ui, &[], can_drop);
            });
        let says = |words| page.query_by_label_contains(words).is_some();
        assert_eq!(says("You can also drop a file"), can_drop);
        assert_eq!(says("On Wayland, files cannot be dropped"), !can_drop);
    }
}
