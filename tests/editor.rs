//! The real editor without a window: egui_kittest drives [`App`], and wgpu draws what it shows.
//!
//! Without a graphics adapter the tests say that they are skipped; with `NORMEND_REQUIRE_GPU=1` they fail instead.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::fs;
use std::time::Duration;

use egui::accesskit::Role;
use egui::{Key, Modifiers, Vec2};
use egui_kittest::kittest::Queryable;
use normend_app::command::Command;
use normend_app::messages::Level;
use normend_app::panels::side::SideTab;
use normend_core::{Silent, SourceRule, Start, shapes};

use driver::{
    N_POINTS, is_back, is_flipped_source, is_front, n_different, sphere_with_wrong_cap, sphere_without_normals, start,
    start_scaled,
};

#[test]
fn the_empty_state_invites_and_every_widget_has_a_name() {
    let Some(mut editor) = start(|_| None) else { return };
    // `run` also fails when an input has no accessible name.
    editor.harness.run();
    for label in ["Open a scan…", "Try the sample", "Type a path…"] {
        assert!(
            editor.harness.query_by_role_and_label(Role::Button, label).is_some(),
            "{label}"
        );
    }
    assert!(editor.harness.query_by_label("3D view").is_none());
    assert!(editor.shows("No scan is open"));
    assert!(!editor.app().is_unsaved());
}

#[test]
fn a_wrong_patch_is_mended_undone_redone_and_exported() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    assert_eq!(editor.app().document().unwrap().parameters().start, Start::Keep);
    editor.harness.run_steps(2);
    assert!(editor.harness.query_by_role_and_label(Role::Image, "3D view").is_some());

    // Hovering shows what a click would turn, in numbers and in the picture, and changes nothing.
    let (bits, normals) = (editor.bits(), editor.normals());
    let plain = editor.picture();
    let (place, n_would_turn) = editor.hover_wrong_patch();
    editor.harness.run_steps(2);
    assert!((1..N_POINTS as u64).contains(&n_would_turn), "{n_would_turn}");
    assert_ne!(editor.picture().rgba, plain.rgba, "nothing is highlighted");
    assert_eq!(editor.bits(), bits);
    assert!(editor.shows("A click turns"));

    // The click turns exactly that.
    editor.click(place);
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    editor.harness.run_steps(2);
    let mended = editor.normals();
    assert_eq!(n_different(&normals, &mended), n_would_turn);
    let truth = shapes::sphere(N_POINTS).normals;
    assert_eq!(
        n_different(&mended, &truth) + n_would_turn,
        n_different(&normals, &truth)
    );
    let picture = editor.picture();
    assert!(
        picture.count(is_back) < plain.count(is_back),
        "the patch is still shown from its back"
    );
    assert!(picture.count(is_front) > plain.count(is_front));
    assert!(editor.app().is_unsaved());

    // Undo restores every bit, redo does it again.
    let mended_bits = editor.bits();
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!((editor.bits(), editor.n_sources()), (bits, 0));
    assert!(!editor.app().is_unsaved());
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!((editor.bits(), editor.n_sources()), (mended_bits, 1));

    // The exported file has the normals of the document.
    let target = editor.folder.path().join("out dir").join("mended.ply");
    fs::create_dir(target.parent().unwrap()).unwrap();
    editor.export_to(&target);
    editor.wait("an exported file", |app| !app.is_busy());
    assert!(
        editor.said("Exported 4,000 points"),
        "{:?}",
        editor.app().messages().entries()
    );
    let written = normend_io::read(&target, &Silent).unwrap();
    assert_eq!(written.given_normals.unwrap().as_slice(), mended);
    assert!(!editor.app().is_unsaved());

    // As it was opened, nothing is to be lost; the same mend once more is as the file has it.
    editor.key(Modifiers::COMMAND, Key::Z);
    assert!(!editor.app().is_unsaved());
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert!(!editor.app().is_unsaved());
    let (place, _) = editor.hover_wrong_patch();
    editor.click(place);
    editor.wait("another source", |app| app.document().unwrap().n_done() == 2);
    assert!(editor.app().is_unsaved());
}

#[test]
fn the_opened_file_is_replaced_only_after_a_second_word() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let input = editor.folder.path().join("sphere.ply");
    let before = fs::read(&input).unwrap();
    editor.export_to(&input);
    editor.harness.run_steps(5);
    assert!(!editor.app().is_busy());
    assert_eq!(fs::read(&input).unwrap(), before);
    editor.harness.get_by_label("Replace the scan that was opened").click();
    editor.harness.run_steps(2);
    editor.click_button("Export");
    editor.wait("an exported file", |app| !app.is_busy());
    assert!(editor.said("Exported"), "{:?}", editor.app().messages().entries());
    assert_ne!(fs::read(&input).unwrap(), before, "the comment line is missing");
}

#[test]
fn a_click_without_hovering_first_is_picked_first() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let place = editor.place(editor.picture().inside(is_back).unwrap());
    editor.click(place);
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    let view = editor.app().view_rect();
    editor.click(view.left_top() + Vec2::splat(3.0));
    editor.harness.run_steps(10);
    assert_eq!(editor.n_sources(), 1, "a click on the background is no mend");
}

#[test]
fn a_drag_orbits_and_is_no_click() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let before = editor.picture();
    let place = editor.place(before.inside(is_back).unwrap());
    editor.harness.hover_at(place);
    editor.harness.drag_at(place);
    for step in 1..=6 {
        editor.harness.hover_at(place + Vec2::new(12.0 * step as f32, 0.0));
    }
    editor.harness.drop_at(place + Vec2::new(72.0, 0.0));
    editor.harness.run_steps(20);
    assert_eq!(editor.n_sources(), 0);
    assert_ne!(editor.picture().rgba, before.rgba, "the view did not turn");
}

#[test]
fn a_double_click_sets_the_pivot_and_leaves_the_signs_alone() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let bits = editor.bits();
    let (place, _) = editor.hover_wrong_patch();
    editor.click(place);
    editor.click(place);
    editor.wait("no pick under way", |app| app.document().unwrap().sources().is_empty());
    editor.harness.run_steps(10);
    assert_eq!((editor.bits(), editor.n_sources()), (bits, 0));
}

#[test]
fn sources_are_selected_flipped_and_removed() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let bits = editor.bits();
    let (place, _) = editor.hover_wrong_patch();
    editor.click(place);
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    let mended = editor.bits();
    let point = editor.app().document().unwrap().sources().iter().next().unwrap().point;

    // A click on its sphere selects it, and X and Delete act on it.
    editor.harness.run_steps(40);
    let sphere = editor.picture().inside(is_flipped_source).unwrap();
    editor.click(editor.place(sphere));
    editor.wait("a selection", |app| app.availability(Command::RemoveSources).is_ok());
    assert_eq!((editor.bits(), editor.n_sources()), (mended.clone(), 1));
    editor.key(Modifiers::NONE, Key::X);
    assert_eq!((editor.bits(), editor.n_sources()), (bits.clone(), 1));
    editor.key(Modifiers::NONE, Key::X);
    assert_eq!(editor.bits(), mended);
    editor.key(Modifiers::NONE, Key::Escape);
    assert!(editor.app().availability(Command::RemoveSources).is_err());

    // The list selects and removes too.
    editor.open_tab(SideTab::Sources);
    let row = format!("Point {}", normend_app::theme::thousands(u64::from(point)));
    editor.harness.get_by_label_contains(&row).scroll_to_me();
    editor.harness.run_steps(60);
    editor.harness.get_by_label_contains(&row).click();
    editor.harness.run_steps(2);
    assert!(
        editor.app().availability(Command::RemoveSources).is_ok(),
        "the row was not selected"
    );
    editor.click_button("Remove");
    assert_eq!((editor.bits(), editor.n_sources()), (bits, 0));
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!((editor.bits(), editor.n_sources()), (mended, 1));
}

#[test]
fn other_parameters_keep_the_sources() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let (place, _) = editor.hover_wrong_patch();
    editor.click(place);
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    let source = *editor.app().document().unwrap().sources().iter().next().unwrap();

    editor.click_button("Estimate");
    assert!(editor.shows("Changed, not applied yet"));
    assert_eq!(editor.app().document().unwrap().parameters().start, Start::Keep);
    editor.click_button("Propagate");
    editor.wait("another propagation", |app| {
        !app.is_busy() && app.document().unwrap().parameters().start == Start::Estimate
    });
    editor.harness.run_steps(2);
    assert!(!editor.shows("Changed, not applied yet"));
    let document = editor.app().document().unwrap();
    assert_eq!(document.sources().iter().copied().collect::<Vec<_>>(), [source]);
    assert!(document.oriented_normal(source.point).unwrap().dot(source.normal) > 0.9);
}

#[test]
fn a_preset_votes_for_sources_that_clicks_overrule() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    assert!(!editor.shows("Drop Voted"));
    editor.click_button("Estimate");
    editor.choose("Preset", "Paper");
    assert!(editor.shows("Viewpoints") && editor.shows("Changed, not applied yet"));
    editor.click_button("Propagate");
    editor.wait("voted sources", |app| {
        let propagation = app.document().unwrap().propagation();
        !app.is_busy() && propagation.is_some_and(|propagation| !propagation.voted_sources.is_empty())
    });
    editor.open_tab(SideTab::Sources);
    assert!(editor.shows("Drop Voted"));
    let document = editor.app().document().unwrap();
    assert!(document.sources().is_empty(), "voted sources are not the user's");
    assert_eq!(document.parameters().sources, SourceRule::HiddenPoints);
}

#[test]
fn keeping_normals_needs_normals() {
    let Some(mut editor) = start(|folder| Some(sphere_without_normals(folder, "bare.ply", 500))) else {
        return;
    };
    editor.wait_until_oriented();
    editor.click_button("Keep given");
    assert!(!editor.shows("Changed, not applied yet"));
    assert_eq!(editor.app().document().unwrap().parameters().start, Start::Estimate);
}

#[test]
fn closing_asks_about_unsaved_mends() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    assert!(
        !editor.close().contains(&egui::ViewportCommand::CancelClose),
        "nothing was mended yet"
    );

    let (place, _) = editor.hover_wrong_patch();
    editor.click(place);
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    assert!(editor.close().contains(&egui::ViewportCommand::CancelClose));
    editor.harness.run_steps(2);
    assert!(editor.shows("Unsaved mends"));
    editor.click_button("Cancel");
    assert!(!editor.shows("Unsaved mends"));

    editor.close();
    editor.harness.run_steps(2);
    editor.harness.get_by_role_and_label(Role::Button, "Discard").click();
    let commands = editor.commands_of(3);
    assert!(commands.contains(&egui::ViewportCommand::Close), "{commands:?}");
    assert!(!editor.close().contains(&egui::ViewportCommand::CancelClose));
}

#[test]
fn another_propagation_is_unsaved_until_it_is_exported() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    assert!(!editor.app().is_unsaved(), "as it came in");
    editor.click_button("Estimate");
    assert!(!editor.app().is_unsaved(), "not applied yet");
    editor.click_button("Propagate");
    editor.wait("another propagation", |app| !app.is_busy());
    assert!(editor.app().is_unsaved());
    assert!(editor.close().contains(&egui::ViewportCommand::CancelClose));
    editor.harness.run_steps(2);
    assert!(editor.shows("The new propagation of sphere.ply is in no exported file yet"));
    editor.key(Modifiers::NONE, Key::Escape);
    let target = editor.folder.path().join("again.ply");
    editor.export_to(&target);
    editor.wait("an exported file", |app| !app.is_busy());
    assert!(!editor.app().is_unsaved());
    editor.click_button("Keep given");
    editor.click_button("Propagate");
    editor.wait("a third propagation", |app| !app.is_busy());
    assert!(editor.app().is_unsaved(), "the file has the second");
    assert!(editor.said("Kept the given normals of 4,000 points"));
}

#[test]
fn exporting_from_the_question_goes_on_to_close() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let (place, _) = editor.hover_wrong_patch();
    editor.click(place);
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    editor.close();
    editor.harness.run_steps(2);
    assert!(editor.shows("are in no exported file yet"));
    // The toolbar has a button of the same name; the question's comes last.
    editor
        .harness
        .get_all_by_role_and_label(Role::Button, "Export…")
        .last()
        .unwrap()
        .click();
    editor.harness.run_steps(3);
    editor.click_button("Export");
    let mut commands = Vec::new();
    for _ in 0..2000 {
        commands.extend(editor.commands_of(1));
        if commands.contains(&egui::ViewportCommand::Close) {
            break;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(
        commands.contains(&egui::ViewportCommand::Close),
        "{:?}",
        editor.app().messages().entries()
    );
    assert!(editor.folder.path().join("sphere_oriented.ply").exists());
}

#[test]
fn a_dropped_file_is_opened_and_remembered() {
    let Some(mut editor) = start(|_| None) else { return };
    let path = sphere_without_normals(editor.folder.path(), "dropped scan.ply", 700);
    editor.drop_file(&path);
    editor.wait_until_oriented();
    assert_eq!(editor.app().document().unwrap().cloud().n_points(), 700);
    editor.harness.run_steps(3);
    let settings = fs::read_to_string(editor.folder.path().join("settings/settings.toml")).unwrap();
    assert!(settings.contains("dropped scan.ply"), "{settings}");
}

#[test]
fn a_stale_job_is_dropped() {
    let Some(mut editor) = start(|_| None) else { return };
    let first = sphere_without_normals(editor.folder.path(), "first.ply", 60_000);
    let second = sphere_without_normals(editor.folder.path(), "second.ply", 900);
    editor.drop_file(&first);
    editor.drop_file(&second);
    editor.wait_until_oriented();
    editor.harness.run_steps(30);
    assert_eq!(editor.app().document().unwrap().cloud().n_points(), 900);
    assert!(!editor.said("60,000"), "{:?}", editor.app().messages().entries());
}

#[test]
fn a_job_can_be_cancelled_and_run_again() {
    let n_points = 400_000;
    let Some(mut editor) = start(|folder| Some(sphere_without_normals(folder, "large.ply", n_points))) else {
        return;
    };
    editor.wait("points before normals", |app| app.document().is_some() && app.is_busy());
    editor.harness.run_steps(2);
    // The points are there to look at while the work goes on.
    assert!(editor.app().document().unwrap().orientation().is_none());
    assert!(
        editor
            .picture()
            .count(|[red, green, blue]| red.max(green).max(blue) > 60)
            > 1000
    );
    editor.click_button("Cancel");
    editor.wait("the end of the job", |app| !app.is_busy());
    assert!(editor.said("cancelled"), "{:?}", editor.app().messages().entries());
    assert!(editor.app().document().unwrap().orientation().is_none());
    assert!(editor.app().availability(Command::Export).is_err());
    editor.click_button("Propagate");
    editor.wait_until_oriented();
}

#[test]
fn a_broken_file_gives_words_and_keeps_what_is_open() {
    let Some(mut editor) = start(|folder| Some(sphere_without_normals(folder, "good.ply", 300))) else {
        return;
    };
    editor.wait_until_oriented();
    let broken = editor.folder.path().join("broken.ply");
    fs::write(&broken, "ply\nformat ascii 1.0\nelement vertex 5\n").unwrap();
    for path in [broken, editor.folder.path().join("missing.ply")] {
        editor.drop_file(&path);
        editor.wait("an error", |app| !app.is_busy());
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let last = editor.app().messages().entries().last().unwrap();
        assert_eq!(last.level, Level::Error);
        assert!(
            last.text.ends_with(&format!(". {name} was not opened.")),
            "{}",
            last.text
        );
        assert_eq!(last.text.matches(&name).count(), 1, "{}", last.text);
    }
    assert_eq!(editor.app().document().unwrap().cloud().n_points(), 300);
}

#[test]
fn the_sample_is_mended_undone_and_exported() {
    let Some(mut editor) = start(|_| None) else { return };
    editor.click_button("Try the sample");
    editor.wait_until_oriented();
    let n_points = editor.app().document().unwrap().cloud().n_points();
    assert!(n_points >= 50_000);
    let (bits, normals, plain) = (editor.bits(), editor.normals(), editor.picture());
    let (place, n_would_turn) = editor.hover_wrong_patch();
    // The patch, and not the whole part.
    assert!((1_000..n_points as u64 / 2).contains(&n_would_turn), "{n_would_turn}");

    editor.click(place);
    editor.wait("a source", |app| !app.document().unwrap().sources().is_empty());
    editor.harness.run_steps(2);
    assert_eq!(n_different(&normals, &editor.normals()), n_would_turn);
    assert!(editor.picture().count(is_back) < plain.count(is_back) / 2);
    // The default source is vouched for together with the picked point, and undone with it.
    assert_eq!(editor.n_sources(), 2);
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!((editor.bits(), editor.n_sources()), (bits, 0));
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);

    let target = editor.folder.path().join("sample_oriented.ply");
    editor.export_to(&target);
    editor.wait("an exported file", |app| !app.is_busy());
    let written = normend_io::read(&target, &Silent).unwrap();
    assert_eq!(written.given_normals.unwrap().as_slice(), editor.normals());
}

#[test]
fn the_sheet_lists_every_command() {
    let Some(mut editor) = start(|_| None) else { return };
    editor.key(Modifiers::NONE, Key::F1);
    editor.harness.run_steps(3);
    for &command in Command::ALL {
        let label = command.label();
        assert!(editor.harness.query_all_by_label(label).next().is_some(), "{label}");
    }
    editor.key(Modifiers::NONE, Key::Escape);
    assert!(!editor.shows("Wheel"));
}

#[test]
fn every_widget_of_a_full_window_has_a_name() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let (place, _) = editor.hover_wrong_patch();
    editor.click(place);
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    for key in [Key::F1, Key::F2] {
        editor.key(Modifiers::NONE, key);
    }
    editor.key(Modifiers::COMMAND, Key::E);
    editor.harness.run_steps(3);
    editor.harness.check_accessibility();
}

#[test]
fn display_keys_change_the_picture() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let mut before = editor.picture();
    for (modifiers, key) in [
        (Modifiers::NONE, Key::Num1),
        (Modifiers::COMMAND, Key::Num1),
        (Modifiers::NONE, Key::Num7),
        (Modifiers::NONE, Key::Num5),
        (Modifiers::NONE, Key::D),
        (Modifiers::NONE, Key::Minus),
        (Modifiers::NONE, Key::PageUp),
        (Modifiers::NONE, Key::ArrowRight),
        (Modifiers::NONE, Key::F),
    ] {
        editor.key(modifiers, key);
        editor.harness.run_steps(14);
        let after = editor.picture();
        assert_ne!(after.rgba, before.rgba, "{key:?} changes nothing");
        before = after;
    }
}

#[test]
fn a_whole_region_turns_on_request() {
    let Some(mut editor) = start(|folder| Some(sphere_without_normals(folder, "bare.ply", 2000))) else {
        return;
    };
    editor.wait_until_oriented();
    let before = editor.normals();
    let place = editor.app().view_rect().center();
    editor.hover(place);
    editor.wait("a preview", |app| app.n_would_turn().is_some());
    assert!(
        editor.app().n_would_turn().unwrap() < 2000,
        "a mend turns a part of the sphere"
    );
    editor.key(Modifiers::SHIFT, Key::Enter);
    editor.wait("a source", |app| !app.document().unwrap().sources().is_empty());
    assert_eq!(n_different(&before, &editor.normals()), 2000);
}

#[test]
fn a_typed_path_is_opened() {
    let Some(mut editor) = start(|_| None) else { return };
    let path = sphere_without_normals(editor.folder.path(), "typed.ply", 400);
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::O);
    let field = editor
        .harness
        .get_by_role_and_label(Role::TextInput, "Path of the scan");
    field.type_text(&path.display().to_string());
    editor.harness.run_steps(2);
    editor.key(Modifiers::NONE, Key::Enter);
    editor.wait_until_oriented();
    assert_eq!(editor.app().document().unwrap().cloud().n_points(), 400);
}

#[test]
fn pixels_and_points_are_told_apart() {
    let Some(mut editor) = start_scaled(1.5, sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let (view, picture) = (editor.app().view_rect(), editor.picture());
    assert!(
        (view.width() * 1.5 - picture.width as f32).abs() < 0.01,
        "{view:?}, {} pixels",
        picture.width
    );
    let before = editor.normals();
    let truth = shapes::sphere(N_POINTS).normals;
    let (place, n_would_turn) = editor.hover_wrong_patch();
    editor.click(place);
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    // Had the click gone elsewhere, right normals would have turned.
    assert_eq!(
        n_different(&editor.normals(), &truth) + n_would_turn,
        n_different(&before, &truth)
    );
}
