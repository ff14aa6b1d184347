//! The list of what was done, through the real app: jumping in it, and parameters that undo takes back.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use driver::{sphere_with_wrong_cap, start};
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use normend_app::panels::side::SideTab;
use normend_core::{EditKind, Start};

#[test]
fn a_click_in_the_history_goes_there_and_back() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    editor.open_tab(SideTab::History);
    assert!(editor.shows("Nothing was done yet"));
    let first = editor.bits();
    editor.mend();
    let mended = editor.bits();
    editor.key(Modifiers::SHIFT, Key::Enter);
    // What is under the pointer is known after a frame or more.
    editor.wait("a turned region", |app| app.document().unwrap().n_done() == 2);
    let turned = editor.bits();
    assert!(first != mended && mended != turned);
    assert_eq!(editor.app().document().unwrap().n_done(), 2);

    editor.click_row("As opened");
    assert_eq!(editor.bits(), first);
    editor.click_row("Turn whole region");
    assert_eq!(editor.bits(), turned);
    editor.click_row("Mend");
    assert_eq!(editor.bits(), mended);
    let kinds: Vec<_> = (editor.app().document().unwrap().steps())
        .map(|step| step.kind())
        .collect();
    assert_eq!(kinds, [EditKind::Mend, EditKind::TurnWhole]);
    // What is done next forgets the steps that were taken back.
    editor.key(Modifiers::SHIFT, Key::Enter);
    editor.click_row("As opened");
    assert_eq!(editor.bits(), first);
}

#[test]
fn undo_takes_parameters_back_and_orients_again() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let kept = editor.bits();
    let start_of = |app: &normend_app::App| app.document().unwrap().propagation().unwrap().parameters.start;
    editor.click_button("Estimate");
    editor.click_button("Propagate");
    editor.wait("estimated normals", |app| {
        !app.is_busy() && start_of(app) == Start::Estimate
    });
    assert!(editor.app().is_unsaved());
    assert!(editor.shows("Estimated (the file has some)"));
    let estimated = editor.bits();

    editor.key(Modifiers::COMMAND, Key::Z);
    editor.wait("given normals again", |app| {
        !app.is_busy() && start_of(app) == Start::Keep
    });
    assert_eq!(editor.bits(), kept);
    assert!(editor.shows("In the file"));
    assert!(!editor.app().is_unsaved());
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    editor.wait("estimated normals again", |app| {
        !app.is_busy() && start_of(app) == Start::Estimate
    });
    assert_eq!(editor.bits(), estimated);

    // Back and forth before the job is done: what is wanted last is what comes.
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    editor.wait("no job", |app| !app.is_busy());
    assert_eq!(start_of(editor.app()), Start::Estimate);
    editor.open_tab(SideTab::History);
    assert!(editor.harness.query_by_label_contains("Parameters").is_some());
}
