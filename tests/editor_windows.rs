//! The windows over the editor: what they hold back, what they say, and that they fit.
//!
//! Without a graphics adapter the tests say that they are skipped; with `NORMEND_REQUIRE_GPU=1` they fail instead.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::fs;

use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use normend_app::messages::Level;
use normend_app::panels::side::SideTab;

use driver::{sphere_with_wrong_cap, sphere_without_normals, start};

#[test]
fn nothing_acts_behind_an_open_question() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let place = editor.mend();
    editor.key(Modifiers::COMMAND, Key::A);
    editor.harness.run_steps(20);
    let (bits, camera) = (editor.bits(), *editor.app().camera());

    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::O);
    assert!(editor.is_focused(Role::TextInput, "Path of the scan"));
    for (modifiers, key) in [
        (Modifiers::NONE, Key::Enter),
        (Modifiers::SHIFT, Key::Enter),
        (Modifiers::COMMAND, Key::Enter),
        (Modifiers::COMMAND, Key::E),
        (Modifiers::COMMAND, Key::Z),
        (Modifiers::NONE, Key::X),
        (Modifiers::NONE, Key::Delete),
        (Modifiers::NONE, Key::Num7),
        (Modifiers::NONE, Key::F1),
    ] {
        editor.key(modifiers, key);
        assert!(!editor.app().is_busy(), "{key:?}");
        assert_eq!((editor.bits(), editor.n_sources()), (bits.clone(), 1), "{key:?}");
    }
    assert!(editor.export_path().is_none() && !editor.shows("Right, middle"));

    // Nor does the pointer, and with nothing in focus the keys still do not reach the view.
    editor.click(place + egui::Vec2::new(0.0, -120.0));
    editor.key(Modifiers::NONE, Key::X);
    editor.key(Modifiers::NONE, Key::Num7);
    editor.harness.run_steps(20);
    assert_eq!((editor.bits(), editor.n_sources()), (bits.clone(), 1));

    editor.key(Modifiers::NONE, Key::Escape);
    assert!(!editor.shows("Path of the scan"));
    editor.hover(place);
    editor.harness.run_steps(20);
    assert_eq!(editor.app().camera(), &camera, "the view turned behind the window");
    editor.key(Modifiers::NONE, Key::X);
    assert_ne!(editor.bits(), bits, "the keys act again");
}

#[test]
fn the_focus_stays_in_the_question() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    editor.mend();
    editor.close();
    editor.harness.run_steps(2);
    let mut seen = [false; 4];
    for _ in 0..7 {
        editor.key(Modifiers::NONE, Key::Tab);
        let focused =
            ["Export…", "Keep for next time", "Discard", "Cancel"].map(|label| editor.is_focused(Role::Button, label));
        assert!(focused.contains(&true), "the focus left the question");
        for (seen, focused) in seen.iter_mut().zip(focused) {
            *seen |= focused;
        }
    }
    assert_eq!(seen, [true; 4]);
    editor.key(Modifiers::NONE, Key::Escape);
    assert!(!editor.shows("Unsaved mends"));

    // Enter is the primary button: export first.
    editor.close();
    editor.harness.run_steps(2);
    editor.key(Modifiers::NONE, Key::Enter);
    assert!(editor.export_path().is_some() && !editor.shows("Unsaved mends"));
}

#[test]
fn enter_says_why_an_existing_file_is_not_replaced() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let target = editor.folder.path().join("taken.ply");
    fs::write(&target, "something else").unwrap();
    editor.key(Modifiers::COMMAND, Key::E);
    let height = |editor: &driver::Editor| {
        let cancel = editor
            .harness
            .get_all_by_role_and_label(Role::Button, "Cancel")
            .last()
            .unwrap();
        cancel.rect().top()
            - editor
                .harness
                .get_by_role_and_label(Role::TextInput, "Export to")
                .rect()
                .top()
    };
    let before = height(&editor);
    editor.type_export_path(&target);
    editor.key(Modifiers::NONE, Key::Enter);
    assert!(editor.shows("This file exists"));
    assert_eq!(height(&editor), before, "the window jumps");
    assert!(editor.is_focused(Role::TextInput, "Export to"));
    assert_eq!(fs::read_to_string(&target).unwrap(), "something else");
    editor.harness.get_by_label("Replace the existing file").click();
    editor.harness.run_steps(2);
    assert!(!editor.shows("This file exists"));
    editor.click_button("Export");
    editor.wait("an exported file", |app| !app.is_busy());
    assert!(editor.said("Exported"), "{:?}", editor.app().messages().entries());
}

#[test]
fn a_failed_export_keeps_the_path_and_says_why() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let target = editor.folder.path().join("no such folder").join("mended.ply");
    editor.export_to(&target);
    editor.wait("the end of the export", |app| !app.is_busy());
    editor.harness.run_steps(2);
    assert_eq!(editor.export_path(), Some(target.display().to_string()));
    assert!(editor.shows("The target lies in a folder that does not exist"));
    assert!(editor.shows("mended.ply was not written."));
    // The folder is made meanwhile, and Enter tries again.
    fs::create_dir(target.parent().unwrap()).unwrap();
    editor.key(Modifiers::NONE, Key::Enter);
    editor.wait("an exported file", |app| !app.is_busy());
    assert!(target.exists() && editor.export_path().is_none());
}

#[test]
fn the_sheet_fits_into_the_smallest_window() {
    let Some(mut editor) = start(|_| None) else { return };
    for size in [egui::Vec2::new(900.0, 600.0), egui::Vec2::new(1400.0, 1000.0)] {
        editor.harness.set_size(size);
        editor.key(Modifiers::NONE, Key::F1);
        editor.harness.run_steps(4);
        // What is done stands left, the keys right: both are inside, and no column is squeezed over another.
        let tools = normend_app::tools::Tool::Mend.hints().iter();
        let hints = tools.filter_map(|hint| Some((hint.what, hint.how_text(&editor.harness.ctx)?)));
        let mouse = normend_app::command::MOUSE.map(|(what, how)| (what, how.to_owned()));
        for (what, how) in mouse.into_iter().chain(hints.collect::<Vec<_>>()) {
            let [what, how] = [what, how.as_str()].map(|label| {
                let found = editor.harness.query_all_by_label(label);
                found
                    .map(|node| node.rect())
                    .max_by(|a, b| a.left().total_cmp(&b.left()))
                    .unwrap()
            });
            assert!(
                what.left() > 16.0 && how.right() < size.x - 16.0,
                "{what:?} {how:?} {size:?}"
            );
        }
        let titles: Vec<_> = editor
            .harness
            .get_all_by_label("Keys and mouse")
            .map(|node| node.rect())
            .collect();
        assert!(titles.iter().all(|rect| rect.top() > 0.0), "{titles:?} {size:?}");
        editor.key(Modifiers::NONE, Key::Escape);
    }
}

#[test]
fn the_sample_is_exported_to_a_folder_of_the_user() {
    let Some(mut editor) = start(|_| None) else { return };
    editor.click_button("Try the sample");
    editor.wait_until_oriented();
    editor.key(Modifiers::COMMAND, Key::E);
    let path = std::path::PathBuf::from(editor.export_path().unwrap());
    assert!(path.ends_with("sample_oriented.ply"));
    assert!(
        path.is_absolute() && path.parent().unwrap().is_dir(),
        "{}",
        path.display()
    );
}

#[test]
fn the_newest_source_is_in_sight_in_the_list() {
    let Some(mut editor) = start(|folder| Some(sphere_without_normals(folder, "bare.ply", 4000))) else {
        return;
    };
    editor.wait_until_oriented();
    editor.harness.set_size(egui::Vec2::new(1000.0, 1400.0));
    editor.harness.run_steps(4);
    editor.open_tab(SideTab::Sources);
    let middle = editor.app().view_rect().center();
    let mut known = std::collections::BTreeSet::new();
    for step in 0..24 {
        let angle = step as f32 * 2.4;
        editor.click(middle + 12.0 * (step as f32).sqrt() * 3.0 * egui::Vec2::angled(angle));
        editor.harness.run_steps(30);
        let sources = editor.app().document().unwrap().sources().iter();
        let points: std::collections::BTreeSet<_> = sources.map(|source| source.point).collect();
        for &point in points.difference(&known) {
            let row = format!("Point {}", normend_app::theme::thousands(u64::from(point)));
            let rect = editor
                .harness
                .get_all_by_label_contains(&row)
                .next()
                .map(|node| node.rect());
            let view = editor.app().view_rect();
            assert!(
                rect.is_some_and(|rect| rect.bottom() < view.bottom()),
                "{row} at {rect:?}"
            );
        }
        known = points;
    }
    assert!(
        known.len() > 12,
        "only {} sources: the list did not need to scroll",
        known.len()
    );
}

#[test]
fn refusals_are_notes_and_errors_begin_with_the_reason() {
    let Some(mut editor) = start(|_| None) else { return };
    editor.key(Modifiers::COMMAND, Key::E);
    let entries = editor.app().messages().entries();
    let last = entries.last().unwrap();
    assert_eq!(
        (last.level, last.text.as_str()),
        (Level::Note, "Export: no scan is open.")
    );
    editor.key(Modifiers::NONE, Key::F2);
    let n_rows =
        |editor: &driver::Editor, level| editor.harness.query_all_by_role_and_label(Role::Label, level).count();
    assert_eq!((n_rows(&editor, "Note"), n_rows(&editor, "Done")), (1, 0));
    let clock = editor.app().messages().entries().last().unwrap().clock();
    assert!(editor.shows(&clock));
    editor.key(Modifiers::NONE, Key::Escape);
    assert!(!editor.shows(&clock));
}

#[test]
fn a_change_does_not_move_what_stands_below() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    editor.click_button("Estimate");
    editor.click_button("Propagate");
    editor.wait_until_oriented();
    let top = |editor: &driver::Editor| editor.harness.get_by_label("Sources").rect().top();
    let before = top(&editor);
    editor.choose("Right side", "Up");
    assert!(editor.shows("Changed, not applied yet"));
    assert_eq!(top(&editor), before);
}
