//! Texts whose columns have no names, in the real editor without a window: asked once, read again, remembered.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::fs;
use std::path::{Path, PathBuf};

use egui::{Key, Modifiers};
use normend_app::App;
use normend_app::command::Command;
use normend_core::shapes::sphere;

use driver::start;

/// The middle of the open cloud, rounded.
fn middle(app: &App) -> [f64; 3] {
    let cloud = app.document().unwrap().cloud();
    let (min, max) = cloud.bounding_box();
    let middle = cloud.origin() + 0.5 * (min + max).as_dvec3();
    middle.to_array().map(|value| value.round() + 0.0)
}

const TITLE: &str = "What the columns are";

/// A sphere around (2, 0, 0): a number, then z y x, then intensity and a color, without names.
fn text(folder: &Path) -> PathBuf {
    let path = folder.join("scan.txt");
    let shape = sphere(400);
    let line = |(index, position): (usize, &glam::Vec3)| {
        format!(
            "{index} {} {} {} -51 10 20 {}\n",
            position.z,
            position.y,
            position.x + 2.0,
            index % 256
        )
    };
    let lines: String = shape.positions.iter().enumerate().map(line).collect();
    fs::write(&path, lines).unwrap();
    path
}

#[test]
fn columns_are_asked_once_and_read_as_the_user_says() {
    let Some(mut editor) = start(|folder| Some(text(folder))) else {
        return;
    };
    editor.wait_until_oriented();
    assert!(editor.shows(TITLE));
    // The first three columns were taken: the number, z and y.
    assert_eq!(middle(editor.app()), [200.0, 0.0, 0.0]);
    for (column, role) in [
        ("Column 1 is", "–"),
        ("Column 2 is", "z"),
        ("Column 3 is", "y"),
        ("Column 4 is", "x"),
    ] {
        editor.choose(column, role);
    }
    editor.click_button("Read again");
    editor.wait("the scan to be read again", |app| middle(app) == [2.0, 0.0, 0.0]);
    editor.wait_until_oriented();
    assert_eq!(middle(editor.app()), [2.0, 0.0, 0.0]);
    assert!(!editor.shows(TITLE), "what the user said is not asked again");

    // The command shows them whenever the user wants, and Escape changes nothing.
    editor.harness.state_mut().act(Command::Columns.into());
    editor.harness.run_steps(2);
    assert!(editor.shows(TITLE));
    editor.key(Modifiers::NONE, Key::Escape);
    assert!(!editor.shows(TITLE));
    assert_eq!(middle(editor.app()), [2.0, 0.0, 0.0]);
}

#[test]
fn columns_that_are_certain_are_not_asked() {
    let Some(mut editor) = start(|folder| Some(driver::sphere_without_normals(folder, "scan.xyz", 300))) else {
        return;
    };
    editor.wait_until_oriented();
    assert!(!editor.shows(TITLE));
}
