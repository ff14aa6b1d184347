//! The real editor without a window: egui_kittest drives [`App`], and wgpu draws what it shows.
//!
//! Without a graphics adapter the tests say that they are skipped; with `NORMEND_REQUIRE_GPU=1` they fail instead.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use eframe::egui_wgpu::WgpuSetup;
use egui::accesskit::Role;
use egui::{Key, Modifiers, Pos2, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use glam::Vec3;
use normend_app::command::Command;
use normend_app::messages::Level;
use normend_app::{App, SettingsStore, graphics_setup};
use normend_core::{Silent, Start, shapes};
use normend_io::Positions;
use normend_render::HeadlessDevice;

/// The editor with its settings and its scans in a folder of its own.
struct Editor {
    harness: Harness<'static, App>,
    folder: tempfile::TempDir,
}

/// Starts the editor on `scan`; `None` when there is no graphics adapter and none is required.
fn start(scan: impl FnOnce(&Path) -> Option<PathBuf>) -> Option<Editor> {
    if let Err(error) = HeadlessDevice::new() {
        let required = std::env::var_os("NORMEND_REQUIRE_GPU").is_some_and(|value| value == "1");
        assert!(!required, "NORMEND_REQUIRE_GPU=1, but {error}");
        println!("skipped: {error}");
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    let scan = scan(folder.path());
    let (settings, problem) = SettingsStore::load_from(&folder.path().join("settings"));
    let harness = Harness::builder()
        .with_size(Vec2::new(1000.0, 700.0))
        .with_step_dt(1.0 / 60.0)
        .wgpu_setup(WgpuSetup::CreateNew(graphics_setup()))
        .build_eframe(move |cc| App::with_settings(cc, scan, settings, problem));
    Some(Editor { harness, folder })
}

impl Editor {
    fn app(&self) -> &App {
        self.harness.state()
    }

    /// Steps until `holds`; jobs and picks end in their own time.
    fn wait(&mut self, what: &str, holds: impl Fn(&App) -> bool) {
        for _ in 0..6000 {
            if holds(self.app()) {
                return;
            }
            self.harness.step();
            std::thread::sleep(Duration::from_millis(5));
        }
        panic!("never came: {what}; messages: {:?}", self.app().messages().entries());
    }

    fn wait_until_oriented(&mut self) {
        self.wait("an oriented document", |app| {
            !app.is_busy() && app.document().is_some_and(|document| document.orientation().is_some())
        });
        self.harness.run_steps(3);
    }

    fn key(&mut self, modifiers: Modifiers, key: Key) {
        self.harness.key_press_modifiers(modifiers, key);
        self.harness.run_steps(2);
    }

    fn click_button(&mut self, label: &str) {
        self.harness.get_by_role_and_label(Role::Button, label).click();
        self.harness.run_steps(2);
    }

    fn shows(&self, label: &str) -> bool {
        self.harness.query_all_by_label_contains(label).next().is_some()
    }

    fn hover(&mut self, place: Pos2) {
        self.harness.hover_at(place);
        self.harness.run_steps(2);
    }

    fn click(&mut self, place: Pos2) {
        self.harness.hover_at(place);
        self.harness.drag_at(place);
        self.harness.event(egui::Event::PointerButton {
            pos: place,
            button: egui::PointerButton::Primary,
            pressed: false,
            modifiers: Modifiers::NONE,
        });
        self.harness.run_steps(2);
    }

    fn picture(&self) -> Picture {
        let ([width, height], rgba) = self.app().picture().unwrap();
        Picture {
            width: width as usize,
            height: height as usize,
            rgba,
        }
    }

    /// The place in the window of a pixel of the view; one point is one pixel here.
    fn place(&self, pixel: (usize, usize)) -> Pos2 {
        self.app().view_rect().min + Vec2::new(pixel.0 as f32 + 0.5, pixel.1 as f32 + 0.5)
    }

    fn bits(&self) -> Vec<u32> {
        self.app().document().unwrap().orientation().unwrap().to_words()
    }

    fn normals(&self) -> Vec<Vec3> {
        self.app().document().unwrap().oriented_normals().unwrap()
    }

    fn n_sources(&self) -> usize {
        self.app().document().unwrap().sources().len()
    }

    fn said(&self, words: &str) -> bool {
        self.app()
            .messages()
            .entries()
            .iter()
            .any(|entry| entry.text.contains(words))
    }

    /// Moves the pointer over the middle of the wrong patch and waits for the preview.
    fn hover_wrong_patch(&mut self) -> (Pos2, u64) {
        let pixel = self.picture().inside(is_back).expect("no patch faces backward");
        let place = self.place(pixel);
        self.hover(place);
        self.wait("a preview", |app| app.n_would_turn().is_some());
        (place, self.app().n_would_turn().unwrap())
    }
}

struct Picture {
    width: usize,
    height: usize,
    rgba: Vec<u8>,
}

impl Picture {
    fn at(&self, x: usize, y: usize) -> [u8; 3] {
        let start = 4 * (y * self.width + x);
        [self.rgba[start], self.rgba[start + 1], self.rgba[start + 2]]
    }

    fn count(&self, is: fn([u8; 3]) -> bool) -> usize {
        (0..self.height)
            .flat_map(|y| (0..self.width).map(move |x| (x, y)))
            .filter(|&(x, y)| is(self.at(x, y)))
            .count()
    }

    /// A pixel whose surroundings are also such, as far from the border of the patch as possible.
    fn inside(&self, is: fn([u8; 3]) -> bool) -> Option<(usize, usize)> {
        [12_usize, 8, 5, 3, 1].into_iter().find_map(|reach| {
            (reach..self.height - reach)
                .flat_map(|y| (reach..self.width - reach).map(move |x| (x, y)))
                .find(|&(x, y)| (y - reach..=y + reach).all(|y| (x - reach..=x + reach).all(|x| is(self.at(x, y)))))
        })
    }
}

/// Orange, in any light.
fn is_back([red, _, blue]: [u8; 3]) -> bool {
    i32::from(red) > i32::from(blue) + 40
}

/// Blue, in any light.
fn is_front([red, _, blue]: [u8; 3]) -> bool {
    i32::from(blue) > i32::from(red) + 40
}

const N_POINTS: usize = 4000;

/// A sphere whose normals are right but for a cap that faces the corner view.
fn sphere_with_wrong_cap(folder: &Path) -> Option<PathBuf> {
    let shape = shapes::sphere(N_POINTS);
    let toward_view = Vec3::new(1.0, -1.0, 1.0) / 3.0_f32.sqrt();
    let normals: Vec<Vec3> = shape
        .normals
        .iter()
        .map(|&normal| if normal.dot(toward_view) > 0.8 { -normal } else { normal })
        .collect();
    let path = folder.join("sphere.ply");
    normend_io::write_points(&path, Positions::Float(&shape.positions), Some(&normals), &Silent).unwrap();
    Some(path)
}

fn sphere_without_normals(folder: &Path, name: &str, n_points: usize) -> PathBuf {
    let path = folder.join(name);
    normend_io::write_points(
        &path,
        Positions::Float(&shapes::sphere(n_points).positions),
        None,
        &Silent,
    )
    .unwrap();
    path
}

fn n_different(a: &[Vec3], b: &[Vec3]) -> u64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(|(a, b)| a != b).count() as u64
}

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
    export_to(&mut editor, &target);
    editor.wait("an exported file", |app| !app.is_busy());
    assert!(
        editor.said("Exported 4,000 points"),
        "{:?}",
        editor.app().messages().entries()
    );
    let written = normend_io::read(&target, &Silent).unwrap();
    assert_eq!(written.given_normals.unwrap().as_slice(), mended);
    assert!(!editor.app().is_unsaved());
}

/// Exports through the window: opens it, types the path, presses the button.
fn export_to(editor: &mut Editor, target: &Path) {
    editor.key(Modifiers::COMMAND, Key::E);
    let field = editor.harness.get_by_role_and_label(Role::TextInput, "Export to");
    assert!(
        field.value().unwrap().ends_with("sphere_oriented.ply"),
        "{:?}",
        field.value()
    );
    field.focus();
    editor.harness.run_steps(1);
    editor.key(Modifiers::COMMAND, Key::A);
    editor
        .harness
        .get_by_role_and_label(Role::TextInput, "Export to")
        .type_text(&target.display().to_string());
    editor.harness.run_steps(2);
    editor.click_button("Export");
}

#[test]
fn the_opened_file_is_replaced_only_after_a_second_word() {
    let Some(mut editor) = start(sphere_with_wrong_cap) else {
        return;
    };
    editor.wait_until_oriented();
    let input = editor.folder.path().join("sphere.ply");
    let before = fs::read(&input).unwrap();
    export_to(&mut editor, &input);
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

    // Its sphere is under the pointer now: a click on it selects it, and X and Delete act on it.
    editor.harness.run_steps(40);
    editor.click(place);
    editor.wait("a selection", |app| app.availability(Command::RemoveSources).is_ok());
    assert_eq!((editor.bits(), editor.n_sources()), (mended.clone(), 1));
    editor.key(Modifiers::NONE, Key::X);
    assert_eq!((editor.bits(), editor.n_sources()), (bits.clone(), 1));
    editor.key(Modifiers::NONE, Key::X);
    assert_eq!(editor.bits(), mended);
    editor.key(Modifiers::NONE, Key::Escape);
    assert!(editor.app().availability(Command::RemoveSources).is_err());

    // The list selects and removes too.
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
        !close(&mut editor).contains(&egui::ViewportCommand::CancelClose),
        "nothing was mended yet"
    );

    let (place, _) = editor.hover_wrong_patch();
    editor.click(place);
    editor.wait("a source", |app| app.document().unwrap().sources().len() == 1);
    assert!(close(&mut editor).contains(&egui::ViewportCommand::CancelClose));
    editor.harness.run_steps(2);
    assert!(editor.shows("Unsaved mends"));
    editor.click_button("Cancel");
    assert!(!editor.shows("Unsaved mends"));

    close(&mut editor);
    editor.harness.run_steps(2);
    editor.harness.get_by_role_and_label(Role::Button, "Discard").click();
    let commands = commands_of(&mut editor, 3);
    assert!(commands.contains(&egui::ViewportCommand::Close), "{commands:?}");
    assert!(!close(&mut editor).contains(&egui::ViewportCommand::CancelClose));
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
    close(&mut editor);
    editor.harness.run_steps(2);
    let question = editor.harness.get_by_label_contains("are in no exported file yet");
    assert!(question.value().is_some() || !format!("{question:?}").is_empty());
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
        commands.extend(commands_of(&mut editor, 1));
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

/// Asks the window to close as a desktop does, and returns the commands of the frame that hears of it.
fn close(editor: &mut Editor) -> Vec<egui::ViewportCommand> {
    let input = editor.harness.input_mut();
    input
        .viewports
        .entry(egui::ViewportId::ROOT)
        .or_default()
        .events
        .push(egui::ViewportEvent::Close);
    let commands = commands_of(editor, 1);
    if let Some(info) = editor.harness.input_mut().viewports.get_mut(&egui::ViewportId::ROOT) {
        info.events.clear();
    }
    commands
}

fn commands_of(editor: &mut Editor, n_steps: usize) -> Vec<egui::ViewportCommand> {
    (0..n_steps)
        .flat_map(|_| {
            editor.harness.step();
            editor.harness.output().viewport_output[&egui::ViewportId::ROOT]
                .commands
                .clone()
        })
        .collect()
}

#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        fs::read(&self.0).map_err(|error| error.to_string())
    }
}

impl Editor {
    fn drop_file(&mut self, path: &Path) {
        self.harness
            .input_mut()
            .dropped_files
            .push(Arc::new(Dropped(path.to_path_buf())));
        self.harness.step();
    }
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
        assert!(last.text.contains(&format!("{name} was not opened")), "{}", last.text);
    }
    assert_eq!(editor.app().document().unwrap().cloud().n_points(), 300);
}

#[test]
fn the_sample_has_something_to_mend() {
    let Some(mut editor) = start(|_| None) else { return };
    editor.click_button("Try the sample");
    editor.wait_until_oriented();
    assert!(editor.app().document().unwrap().cloud().n_points() >= 50_000);
    let (place, n_would_turn) = editor.hover_wrong_patch();
    assert!(n_would_turn > 0);
    editor.click(place);
    editor.wait("a source", |app| !app.document().unwrap().sources().is_empty());
}

#[test]
fn the_sheet_lists_every_command() {
    let Some(mut editor) = start(|_| None) else { return };
    editor.key(Modifiers::NONE, Key::F1);
    editor.harness.run_steps(3);
    for command in Command::ALL {
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
