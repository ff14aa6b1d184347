//! The side panel of the real editor without a window: which rows it shows, and what the rule for the right side does.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::path::{Path, PathBuf};

use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use glam::Vec3;
use normend_core::{Preset, SideRule, Silent, Start, shapes};
use normend_io::Positions;

use driver::{Editor, N_POINTS, n_different, sphere_with_wrong_cap, sphere_without_normals, start};

/// Rows of the spanning tree, which choose nothing for the automatic method.
const TREE_ROWS: [&str; 5] = [
    "Estimator",
    "k for normals",
    "k for the graph",
    "Edge rule",
    "First sources",
];

fn shown_rows(editor: &Editor) -> Vec<&'static str> {
    let rows = TREE_ROWS.into_iter().chain(["Preset", "Right side"]);
    rows.filter(|row| editor.shows(row)).collect()
}

fn propagate(editor: &mut Editor) {
    editor.click_button("Propagate");
    editor.wait("another propagation", |app| !app.is_busy());
    editor.harness.run_steps(3);
    assert!(!editor.shows("Changed, not applied yet"));
}

#[test]
fn only_rows_with_an_effect_are_shown() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    // Every normal is given and keeps its side; the graph bounds what a click turns.
    assert_eq!(shown_rows(&editor), ["k for the graph", "Edge rule"]);
    editor.click_button("Estimate");
    assert_eq!(shown_rows(&editor), ["Preset", "Right side"]);
    for (preset, hides) in [(Preset::Tree, false), (Preset::Paper, false), (Preset::Auto, true)] {
        editor.choose("Preset", preset.label());
        assert_eq!(!editor.shows("Estimator"), hides, "{}", preset.name());
        assert_eq!(
            shown_rows(&editor).len(),
            if hides { 2 } else { 7 },
            "{}",
            preset.name()
        );
    }
    editor.harness.check_accessibility();
}

#[test]
fn the_right_side_is_that_of_the_rule() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    editor.click_button("Estimate");
    let truth = shapes::sphere(N_POINTS).normals;
    let n_inward = |editor: &Editor| {
        let normals = editor.normals();
        normals.iter().zip(&truth).filter(|(a, b)| a.dot(**b) < 0.0).count()
    };
    propagate(&mut editor);
    assert_eq!(n_inward(&editor), 0);
    for (rule, expect) in [(SideRule::IntoRoom, N_POINTS), (SideRule::Given, 0)] {
        editor.choose("Right side", rule.label());
        assert!(editor.shows("Changed, not applied yet"));
        propagate(&mut editor);
        let document = editor.app().document().unwrap();
        assert_eq!(
            (document.parameters().rule, document.parameters().start),
            (rule, Start::Estimate)
        );
        assert_eq!(n_inward(&editor), expect, "{}", rule.name());
    }
    // Another preset does not take the rule back.
    editor.choose("Preset", Preset::Tree.label());
    propagate(&mut editor);
    assert_eq!(editor.app().document().unwrap().parameters().rule, SideRule::Given);
    assert!(!editor.shows("could face either way"));
}

#[test]
fn rules_without_anything_to_go_by_cannot_be_chosen() {
    let Some(mut editor) = start(|folder| Some(sphere_without_normals(folder, "bare.ply", 600))) else {
        return;
    };
    editor.wait_until_oriented();
    for rule in [SideRule::TowardScanner, SideRule::Given] {
        editor.choose("Right side", rule.label());
        editor.key(Modifiers::NONE, Key::Escape);
        assert!(!editor.shows("Changed, not applied yet"), "{}", rule.name());
    }
    let combo = editor.harness.get_by_role_and_label(Role::ComboBox, "Right side");
    assert_eq!(combo.value().unwrap_or_default(), SideRule::default().label());
}

/// A flat square, which views from outside see from both sides.
fn sheet(folder: &Path) -> Option<PathBuf> {
    let positions: Vec<Vec3> = (0..1600)
        .map(|i| Vec3::new((i % 40) as f32 + 0.3 * ((i / 40) % 2) as f32, (i / 40) as f32, 0.0))
        .collect();
    let path = folder.join("sheet.ply");
    normend_io::write_points(&path, Positions::Float(&positions), None, &Silent).unwrap();
    Some(path)
}

#[test]
fn what_could_face_either_way_is_said_until_the_user_decides() {
    let Some(mut editor) = start(sheet) else { return };
    editor.wait_until_oriented();
    // In the status bar, by itself.
    let is_said = |editor: &Editor| {
        let mut labels = editor.harness.query_all_by_label("1 component could face either way");
        labels.next().is_some()
    };
    assert!(is_said(&editor));
    assert!(editor.said("Ctrl-click turns one"));
    let normals = editor.normals();
    editor.hover(editor.app().view_rect().center());
    editor.wait("a preview", |app| app.n_would_turn().is_some());
    editor.key(Modifiers::SHIFT, Key::Enter);
    editor.wait("a source", |app| !app.document().unwrap().sources().is_empty());
    editor.harness.run_steps(3);
    assert_eq!(n_different(&normals, &editor.normals()), 1600);
    assert!(!is_said(&editor));
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.harness.run_steps(2);
    assert!(is_said(&editor));
}
