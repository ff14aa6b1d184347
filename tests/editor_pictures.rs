//! Pictures of the view in the real editor without a window: as files of several sizes, in the clipboard, as a turntable.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::path::Path;

use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use image::RgbaImage;
use normend_app::command::Command;

use driver::{Editor, is_back, is_front, sphere_with_wrong_cap, start};

fn type_path(editor: &mut Editor, label: &str, path: &Path) {
    editor.harness.get_by_role_and_label(Role::TextInput, label).focus();
    editor.harness.run_steps(1);
    editor.key(Modifiers::COMMAND, Key::A);
    editor
        .harness
        .get_by_role_and_label(Role::TextInput, label)
        .type_text(&path.display().to_string());
    editor.harness.run_steps(2);
}

fn read(path: &Path) -> RgbaImage {
    image::open(path).unwrap().into_rgba8()
}

fn n_back(picture: &RgbaImage) -> usize {
    picture
        .pixels()
        .filter(|pixel| is_back([pixel[0], pixel[1], pixel[2]]))
        .count()
}

#[test]
fn a_picture_is_the_view_and_larger_ones_look_the_same() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let view = editor.picture();
    let height = view.rgba.len() / 4 / view.width;
    let path = editor.folder.path().join("view.png");
    editor.key(Modifiers::NONE, Key::F12);
    type_path(&mut editor, "Save to", &path);
    editor.click_button("Save");
    editor.wait("a picture", |app| !app.is_busy());
    assert!(editor.said("Saved"));
    let picture = read(&path);
    assert_eq!(picture.dimensions(), (view.width as u32, height as u32));
    assert!(*picture.as_raw() == view.rgba, "the picture is not the view");

    // Again to the same file: not without a word.
    editor.key(Modifiers::COMMAND | Modifiers::SHIFT, Key::S);
    type_path(&mut editor, "Save to", &path);
    editor.click_button("Save");
    assert!(editor.shows("This file exists"));
    editor
        .harness
        .get_by_role_and_label(Role::CheckBox, "Replace what is there")
        .click();
    editor.harness.run_steps(2);
    editor.choose("Size", "2 × the view");
    editor
        .harness
        .get_by_role_and_label(Role::CheckBox, "Transparent background")
        .click();
    editor.harness.run_steps(2);
    editor.click_button("Save");
    editor.wait("a picture", |app| !app.is_busy());
    let double = read(&path);
    assert_eq!(double.dimensions(), (2 * view.width as u32, 2 * height as u32));
    let (n_small, n_large) = (n_back(&picture), n_back(&double));
    assert!(
        n_large > 3 * n_small && n_large < 5 * n_small,
        "{n_large} and {n_small}"
    );
    assert_eq!(double.get_pixel(2, 2)[3], 0, "nothing stands behind the scan");
    assert_eq!(picture.get_pixel(2, 2)[3], 255);
    let center = double.get_pixel(view.width as u32, height as u32);
    assert_eq!(center[3], 255);
    editor.hover(editor.app().view_rect().left_bottom() + egui::Vec2::new(5.0, -5.0));
    editor.wait("nothing under the pointer", |app| app.n_would_turn().is_none());
    editor.harness.run_steps(10);
    assert!(editor.picture().rgba == view.rgba, "the view is not as it was");
}

#[test]
fn a_picture_goes_to_the_clipboard() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    editor.harness.state_mut().act(Command::Screenshot.into());
    editor.harness.run_steps(2);
    editor.click_button("Copy");
    let mut copied = None;
    for _ in 0..2000 {
        editor.harness.step();
        let commands = &editor.harness.output().platform_output.commands;
        copied = commands.iter().find_map(|command| match command {
            egui::OutputCommand::CopyImage(image) => Some(image.size),
            _ => None,
        });
        if copied.is_some() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let view = editor.picture();
    assert_eq!(copied.map(|size| size[0]), Some(view.width));
    assert!(editor.said("Copied a picture"));
}

#[test]
fn a_turntable_turns_once_around_and_can_be_cancelled() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let folder = editor.folder.path().join("film");
    editor.harness.state_mut().act(Command::Turntable.into());
    editor.harness.run_steps(2);
    type_path(&mut editor, "Folder", &folder);
    // 72 pictures take long here; the field takes a number like any other.
    let field = editor.harness.get_by_role_and_label(Role::SpinButton, "Pictures");
    field.focus();
    editor.harness.run_steps(2);
    editor.key(Modifiers::COMMAND, Key::A);
    editor.harness.event(egui::Event::Text("4".to_owned()));
    editor.harness.run_steps(2);
    editor.click_button("Save");
    editor.wait("the pictures", |app| !app.is_busy());
    assert!(
        editor.said("Saved 4 pictures"),
        "{:?}",
        editor.app().messages().entries()
    );
    let counts: Vec<usize> = (0..4)
        .map(|frame| n_back(&read(&folder.join(format!("turntable_{frame:03}.png")))))
        .collect();
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 4);
    // The cap faces the first picture, and is behind in the third.
    assert!(counts[0] > 2000 && counts[2] < counts[0] / 10, "{counts:?}");
    let view = editor.picture();
    let n_scan = view.count(|pixel| is_back(pixel) || is_front(pixel));
    assert!(n_scan > 10_000);

    editor.harness.state_mut().act(Command::Turntable.into());
    editor.harness.run_steps(2);
    let long = editor.folder.path().join("long");
    type_path(&mut editor, "Folder", &long);
    editor.click_button("Save");
    assert!(editor.app().is_busy());
    editor.key(Modifiers::NONE, Key::Escape);
    editor.wait("the end", |app| !app.is_busy());
    assert!(editor.said("No picture was made: cancelled"));
}
