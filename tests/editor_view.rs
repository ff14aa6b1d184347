//! Ways of coloring in the real editor without a window: each is painted, follows edits, and values select points.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

#[expect(dead_code, reason = "the other tests of the editor use the rest")]
#[path = "editor/driver.rs"]
mod driver;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use egui::accesskit::Role;
use egui::{Key, Modifiers, Pos2, Vec2};
use egui_kittest::kittest::Queryable;
use glam::Vec3;
use normend_app::coloring::{self, Coloring};
use normend_app::command::{Action, Command};
use normend_app::panels::side::SideTab;
use normend_core::{Preset, shapes};

use driver::{Editor, Picture, is_back, is_front, sphere_with_wrong_cap, start_prepared};

const N_POINTS: usize = 3000;

/// A sphere with colors (red in the upper half, green in the lower), heights, and one missing value; without normals.
fn colored_sphere(folder: &Path) -> Option<PathBuf> {
    let mut text = "x y z red green blue height\n".to_owned();
    for (index, position) in shapes::sphere(N_POINTS).positions.into_iter().enumerate() {
        let [x, y, z] = position.to_array();
        let [red, green] = if z > 0.0 { [230, 20] } else { [20, 230] };
        let height = if index == 7 {
            "nan".to_owned()
        } else {
            format!("{}", 100.0 * z)
        };
        writeln!(text, "{x} {y} {z} {red} {green} 10 {height}").unwrap();
    }
    let path = folder.join("colored.xyz");
    std::fs::write(&path, text).unwrap();
    Some(path)
}

fn start(scan: fn(&Path) -> Option<PathBuf>) -> Option<Editor> {
    let mut editor = start_prepared(1.0, |settings| settings.side_tab = SideTab::View, scan)?;
    editor.wait_until_oriented();
    Some(editor)
}

fn show(editor: &mut Editor, coloring: Coloring) {
    editor.harness.state_mut().act(Action::Display(coloring));
    assert_eq!(editor.app().display_mode(), coloring);
    editor.wait("the colors", |app| app.is_painted());
    editor.harness.run_steps(3);
}

fn is_red([red, green, blue]: [u8; 3]) -> bool {
    i32::from(red) > i32::from(green.max(blue)) + 60
}

fn is_green([red, green, blue]: [u8; 3]) -> bool {
    i32::from(green) > i32::from(red.max(blue)) + 60
}

/// Strong colors of any hue.
fn is_colorful([red, green, blue]: [u8; 3]) -> bool {
    i32::from(red.max(green).max(blue)) > i32::from(red.min(green).min(blue)) + 40
}

/// The hues that are seen on many pixels.
fn hues(picture: &Picture) -> BTreeSet<u32> {
    let mut counts = [0; 24];
    for pixel in picture.rgba.chunks_exact(4) {
        let [red, green, blue] = [pixel[0], pixel[1], pixel[2]].map(f32::from);
        let (high, low) = (red.max(green).max(blue), red.min(green).min(blue));
        if high > low + 30.0 {
            let hue = if high == red {
                (green - blue) / (high - low)
            } else if high == green {
                2.0 + (blue - red) / (high - low)
            } else {
                4.0 + (red - green) / (high - low)
            };
            counts[((hue.rem_euclid(6.0)) * 4.0) as usize % 24] += 1;
        }
    }
    (0..24).filter(|&hue| counts[hue as usize] > 150).collect()
}

#[test]
fn every_coloring_is_chosen_from_the_list_and_by_key() {
    let Some(mut editor) = start(colored_sphere) else {
        return;
    };
    // One file has no layers to tell apart.
    let all: Vec<Coloring> = (Coloring::ALL.into_iter())
        .filter(|&coloring| coloring != Coloring::Layers)
        .collect();
    let mut seen = vec![editor.app().display_mode()];
    for _ in 1..all.len() {
        editor.key(Modifiers::NONE, Key::D);
        editor.wait("the colors", |app| app.is_painted());
        seen.push(editor.app().display_mode());
    }
    assert_eq!(seen, all, "the automatic method knows all of them");
    editor.key(Modifiers::NONE, Key::D);
    assert_eq!(editor.app().display_mode(), Coloring::Facing);
    editor.key(Modifiers::SHIFT, Key::D);
    assert_eq!(editor.app().display_mode(), Coloring::Scalar);
    editor.choose("Display", Coloring::Lit.label());
    assert_eq!(editor.app().display_mode(), Coloring::Lit);
}

#[test]
fn what_is_not_known_cannot_be_shown_and_says_why() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.harness.state_mut().act(Action::Display(Coloring::Confidence));
    assert_eq!(editor.app().display_mode(), Coloring::Facing);
    assert!(editor.said("only the automatic method knows"));
    editor.harness.state_mut().act(Action::Display(Coloring::File));
    assert!(editor.said("the file has no colors"));
    editor.harness.state_mut().act(Action::Display(Coloring::Layers));
    assert!(editor.said("the scan is of one file"));
}

#[test]
fn a_coloring_goes_when_other_parameters_take_away_what_it_shows() {
    let Some(mut editor) = start(colored_sphere) else {
        return;
    };
    show(&mut editor, Coloring::Confidence);
    let propagate = |editor: &mut Editor, preset: Preset| {
        editor.harness.state_mut().act(Action::Propagate(preset.parameters()));
        editor.wait("the result", |app| {
            !app.is_busy() && app.document().unwrap().parameters() == preset.parameters()
        });
        editor.harness.run_steps(3);
    };
    propagate(&mut editor, Preset::Tree);
    assert_eq!(editor.app().display_mode(), Coloring::Facing);
    show(&mut editor, Coloring::Scalar);
    let before = editor.picture();
    propagate(&mut editor, Preset::Auto);
    assert_eq!(editor.app().display_mode(), Coloring::Scalar, "the file is the same");
    editor.wait("the colors", |app| app.is_painted());
    editor.harness.run_steps(3);
    // The points are in another order on the graphics adapter now, and in the same colors.
    let after = editor.picture();
    let pairs = before.rgba.chunks_exact(4).zip(after.rgba.chunks_exact(4));
    let is_near = |(a, b): &(&[u8], &[u8])| (0..3).all(|channel| a[channel].abs_diff(b[channel]) < 60);
    let n_near = pairs.filter(is_near).count();
    assert!(n_near > before.rgba.len() / 4 * 9 / 10, "{n_near} pixels are alike");
    show(&mut editor, Coloring::Confidence);
}

#[test]
fn colors_of_the_file_are_those_of_its_points() {
    let Some(mut editor) = start(colored_sphere) else {
        return;
    };
    assert_eq!(editor.picture().count(is_green), 0);
    show(&mut editor, Coloring::File);
    editor.key(Modifiers::NONE, Key::Num1);
    editor.harness.run_steps(3);
    let picture = editor.picture();
    let (n_red, n_green) = (picture.count(is_red), picture.count(is_green));
    assert!(n_red > 5000 && n_green > 5000, "{n_red} red, {n_green} green");
    // The upper half is red.
    let middle = picture.width / 2;
    let rows: Vec<usize> = (0..picture.rgba.len() / 4 / picture.width).collect();
    let first = |is: fn([u8; 3]) -> bool| rows.iter().position(|&row| is(picture.at(middle, row))).unwrap();
    assert!(first(is_red) < first(is_green));
}

#[test]
fn confidence_has_a_scale_and_a_plain_body_is_sure() {
    let Some(mut editor) = start(colored_sphere) else {
        return;
    };
    show(&mut editor, Coloring::Confidence);
    let [red, green, _] = coloring::scale(1.0).map(|channel| (channel * 255.0) as i32);
    assert!(red > 200 && green > 200, "the upper end is yellow");
    let is_yellow = |[red, green, blue]: [u8; 3]| red > 110 && green > 100 && i32::from(blue) < i32::from(red) - 50;
    assert!(editor.picture().count(is_yellow) > 20_000);
    assert!(editor.shows("Histogram of confidence"));
    assert!(editor.shows("Undecided"));
}

#[test]
fn a_turned_patch_has_a_color_of_its_own_and_only_it_is_uploaded() {
    let Some(mut editor) = start(colored_sphere) else {
        return;
    };
    show(&mut editor, Coloring::Regions);
    let before = editor.picture();
    assert_eq!(hues(&before).len(), 1, "one body is one region: {:?}", hues(&before));
    let visible = editor.picture().inside(is_colorful).unwrap();
    let place = editor.place(visible);
    editor.hover(place);
    editor.wait("a preview", |app| app.n_would_turn().is_some());
    let n_uploaded = editor.app().bytes_uploaded();
    editor.click(place);
    editor.wait("a source", |app| !app.document().unwrap().sources().is_empty());
    editor.wait("the colors", |app| app.is_painted());
    let n_uploaded = editor.app().bytes_uploaded() - n_uploaded;
    editor.harness.run_steps(3);
    let n_turned = editor.app().document().unwrap().next_undo().unwrap().n_turned();
    assert!(n_turned > 0 && (n_turned as usize) < N_POINTS / 2);
    // Colors take 4 bytes a point; bits, highlights and the sphere of the source take little besides.
    assert!(
        n_uploaded < 5 * n_turned + 2048,
        "{n_uploaded} bytes for {n_turned} points"
    );
    let document = editor.app().document().unwrap();
    let names: BTreeSet<u32> = document.region_names(0..N_POINTS as u32).into_iter().collect();
    assert_eq!(names.len(), 2);
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.wait("the colors", |app| app.is_painted());
    editor.harness.hover_at(Pos2::new(5.0, 300.0));
    editor.harness.run_steps(4);
    assert_eq!(hues(&editor.picture()).len(), 1);
}

#[test]
fn what_is_turned_against_the_evidence_is_shown_as_a_conflict() {
    let Some(mut editor) = start(colored_sphere) else {
        return;
    };
    show(&mut editor, Coloring::Conflict);
    assert!(
        editor.picture().count(is_red) < 200,
        "nothing speaks against a plain body"
    );
    show(&mut editor, Coloring::Scalar);
    editor.harness.state_mut().act(Action::SelectValues {
        range: [0.0, f64::INFINITY],
        modifiers: Modifiers::NONE,
    });
    editor.wait("the selection", |app| !app.is_selecting_values());
    show(&mut editor, Coloring::Conflict);
    let n_selected = editor.app().document().unwrap().selected().len();
    assert!((1300..1700).contains(&n_selected), "{n_selected}");
    let selected_red = editor.picture().count(is_red);
    editor.key(Modifiers::NONE, Key::X);
    editor.harness.run_steps(1);
    editor.wait("the colors", |app| app.is_painted());
    editor.harness.run_steps(3);
    let n_red = editor.picture().count(is_red);
    assert!(n_red > selected_red + 5000, "{n_red} and {selected_red} before");
    editor.key(Modifiers::COMMAND, Key::Z);
    editor.wait("the colors", |app| app.is_painted());
    editor.harness.run_steps(3);
    assert_eq!(editor.picture().count(is_red), selected_red);
}

#[test]
fn a_drag_over_the_histogram_selects_points() {
    let Some(mut editor) = start(colored_sphere) else {
        return;
    };
    show(&mut editor, Coloring::Scalar);
    assert!(editor.shows("Histogram of height"));
    let drag = |editor: &mut Editor, from: f32, to: f32, modifiers: Modifiers| {
        let histogram = editor.harness.get_by_role_and_label(Role::Image, "Histogram of height");
        let rect = histogram.rect();
        let at = |share: f32| rect.left_center() + Vec2::new(share * rect.width(), 0.0);
        let event = |editor: &mut Editor, place: Pos2, pressed: Option<bool>| {
            editor.harness.hover_at(place);
            if let Some(pressed) = pressed {
                editor.harness.event_modifiers(
                    egui::Event::PointerButton {
                        pos: place,
                        button: egui::PointerButton::Primary,
                        pressed,
                        modifiers,
                    },
                    modifiers,
                );
            }
            editor.harness.step();
        };
        event(editor, at(from), Some(true));
        event(editor, at(0.5 * (from + to)), None);
        event(editor, at(to), None);
        event(editor, at(to), Some(false));
        editor.harness.run_steps(2);
        editor.wait("the selection", |app| !app.is_selecting_values());
    };
    let n_steps = editor.app().document().unwrap().steps().count();
    drag(&mut editor, 0.5, 1.0, Modifiers::NONE);
    let document = editor.app().document().unwrap();
    assert_eq!(document.steps().count(), n_steps + 1, "a drag is one step");
    let upper = document.selected().clone();
    let positions = document.cloud().positions().to_vec();
    assert!((1300..1700).contains(&upper.len()), "{} points", upper.len());
    assert!(upper.iter().all(|point| positions[point as usize].z > -0.03));
    assert!(!upper.contains(7), "a point without a value is in no range");
    drag(&mut editor, 0.9, 1.0, Modifiers::COMMAND);
    let rest = editor.app().document().unwrap().selected().clone();
    assert!(rest.len() < upper.len() && !rest.is_empty());
    assert!(rest.iter().all(|point| positions[point as usize].z < 0.85));
    editor.key(Modifiers::COMMAND, Key::Z);
    assert_eq!(*editor.app().document().unwrap().selected(), upper);
}

#[test]
fn hair_stands_on_points_and_spheres_can_be_hidden() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    let before = editor.picture();
    editor.key(Modifiers::NONE, Key::I);
    editor.harness.run_steps(3);
    let n_outside = |picture: &Picture| picture.count(|pixel| is_back(pixel) || is_front(pixel));
    assert!(
        n_outside(&editor.picture()) > n_outside(&before) + 300,
        "hair stands out beyond the sphere"
    );
    assert!(editor.shows("Length"));
    editor.key(Modifiers::NONE, Key::I);
    editor.harness.run_steps(3);
    assert_eq!(editor.picture().rgba, before.rgba);
    editor.mend();
    editor.harness.hover_at(Pos2::new(5.0, 300.0));
    editor.harness.run_steps(3);
    let n_pink = editor.picture().count(driver::is_flipped_source);
    assert!(n_pink > 20, "{n_pink}");
    editor.key(Modifiers::SHIFT, Key::I);
    editor.harness.run_steps(3);
    assert_eq!(editor.picture().count(driver::is_flipped_source), 0);
}

#[test]
fn a_section_leaves_a_slice() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    let is_scan = |pixel| is_back(pixel) || is_front(pixel);
    let n_before = editor.picture().count(is_scan);
    editor.key(Modifiers::SHIFT, Key::S);
    editor.harness.run_steps(3);
    let section = editor.app().clip().section.expect("a section");
    assert!(section.direction.dot(editor.app().camera().back()) > 0.999);
    let n_slice = editor.picture().count(is_scan);
    assert!(n_slice > 100 && n_slice < n_before / 3, "{n_slice} of {n_before}");
    editor.key(Modifiers::NONE, Key::Num7);
    let button = editor.harness.get_by_role_and_label(Role::Button, "Across the view");
    button.scroll_to_me();
    editor.harness.run_steps(20);
    editor.click_button("Across the view");
    let turned = editor.app().clip().section.unwrap();
    assert!(turned.direction.dot(Vec3::Z) > 0.999, "{turned:?}");
    editor.key(Modifiers::SHIFT, Key::S);
    assert_eq!(editor.app().clip().section, None);
}

/// The brightness of all pixels.
fn brightness(editor: &Editor) -> u64 {
    editor.picture().rgba.iter().map(|&channel| u64::from(channel)).sum()
}

#[test]
fn the_slider_of_edge_shading_darkens_edges() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    let set = |editor: &mut Editor, key: Key| {
        let slider = editor.harness.get_by_role_and_label(Role::Slider, "Edge shading");
        slider.focus();
        editor.harness.run_steps(3);
        // To the end.
        for _ in 0..150 {
            editor.harness.key_press(key);
            editor.harness.step();
        }
        editor.harness.run_steps(10);
        brightness(editor)
    };
    let usual = brightness(&editor);
    let without = set(&mut editor, Key::ArrowLeft);
    let strong = set(&mut editor, Key::ArrowRight);
    assert!(strong < usual && usual < without, "{strong}, {usual}, {without}");
}

#[test]
fn sliders_end_where_lists_end() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.harness.state_mut().act(Command::ToggleHair.into());
    editor.harness.run_steps(3);
    let right = |role, label| editor.harness.get_by_role_and_label(role, label).rect().right();
    let list = right(Role::ComboBox, "Theme");
    for label in ["Edge shading", "Splat size", "Length", "One in"] {
        let number = right(Role::SpinButton, label);
        assert!(
            (number - list).abs() <= 1.0,
            "{label} ends at {number}, lists at {list}"
        );
    }
}

#[test]
fn a_broken_settings_file_is_set_aside_and_said() {
    let broken = "version = 99";
    let scan = |folder: &Path| {
        let settings = folder.join("settings");
        std::fs::create_dir_all(&settings).unwrap();
        std::fs::write(settings.join("settings.toml"), broken).unwrap();
        sphere_with_wrong_cap(folder)
    };
    let Some(mut editor) = start_prepared(1.0, |_| {}, scan) else {
        return;
    };
    editor.wait_until_oriented();
    assert!(editor.said("settings.toml.broken"));
    assert!(editor.shows("settings.toml.broken"), "nothing on the screen says so");
    let settings = editor.folder.path().join("settings");
    let kept = std::fs::read_to_string(settings.join("settings.toml.broken")).unwrap();
    assert_eq!(kept, broken);
    // What is set from now on is saved.
    editor.harness.state_mut().act(Command::ToggleHair.into());
    for _ in 0..600 {
        editor.harness.step();
    }
    let saved = std::fs::read_to_string(settings.join("settings.toml")).unwrap();
    assert!(saved.contains("hair = true"), "{saved}");
}
