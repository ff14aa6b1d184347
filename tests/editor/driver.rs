//! Drives the editor as a user does, and reads what it shows.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use eframe::egui_wgpu::WgpuSetup;
use egui::accesskit::Role;
use egui::{Key, Modifiers, Pos2, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use glam::Vec3;
use normend_app::panels::hints::Card;
use normend_app::panels::side::SideTab;
use normend_app::settings::Settings;
use normend_app::{App, SettingsStore, graphics_setup};
use normend_core::{Silent, shapes};
use normend_io::Positions;
use normend_render::HeadlessDevice;

/// The editor with its settings and its scans in a folder of its own.
pub struct Editor {
    pub harness: Harness<'static, App>,
    pub folder: tempfile::TempDir,
}

/// Starts the editor on `scan`; `None` when there is no graphics adapter and none is required.
pub fn start(scan: impl FnOnce(&Path) -> Option<PathBuf>) -> Option<Editor> {
    start_scaled(1.0, scan)
}

/// As [`start`], on a screen with this many pixels a point.
pub fn start_scaled(pixels_per_point: f32, scan: impl FnOnce(&Path) -> Option<PathBuf>) -> Option<Editor> {
    start_prepared(pixels_per_point, |_| {}, scan)
}

/// As [`start_scaled`], with settings that `prepare` has changed. Without it the camera does not fly, so that it is where it
/// is asked to be in the next frame, and no hint for the first steps stands over the view.
pub fn start_prepared(
    pixels_per_point: f32,
    prepare: impl FnOnce(&mut Settings),
    scan: impl FnOnce(&Path) -> Option<PathBuf>,
) -> Option<Editor> {
    if let Err(error) = HeadlessDevice::new() {
        let required = std::env::var_os("NORMEND_REQUIRE_GPU").is_some_and(|value| value == "1");
        assert!(!required, "NORMEND_REQUIRE_GPU=1, but {error}");
        println!("skipped: {error}");
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    let scan = scan(folder.path());
    Some(start_in(folder, pixels_per_point, prepare, scan))
}

/// The editor with its settings in this folder.
fn start_in(
    folder: tempfile::TempDir,
    pixels_per_point: f32,
    prepare: impl FnOnce(&mut Settings),
    scan: Option<PathBuf>,
) -> Editor {
    let (mut settings, problem) = SettingsStore::load_from(&folder.path().join("settings"));
    settings.settings.reduce_motion = true;
    // The first hints lie over the view.
    settings.settings.dismissed_hints = Card::ALL.map(|card| card.name().to_owned()).into();
    prepare(&mut settings.settings);
    let harness = Harness::builder()
        .with_size(Vec2::new(1000.0, 700.0))
        .with_step_dt(1.0 / 60.0)
        .with_pixels_per_point(pixels_per_point)
        .wgpu_setup(WgpuSetup::CreateNew(graphics_setup()))
        .build_eframe(move |cc| App::with_settings(cc, scan, settings, problem));
    Editor { harness, folder }
}

impl Editor {
    /// Ends the editor as a crash does, nothing is asked and nothing closed, and starts it again with the same settings.
    pub fn crash_and_start(self, scan: &Path) -> Self {
        drop(self.harness);
        start_in(self.folder, 1.0, |_| {}, Some(scan.to_path_buf()))
    }

    /// Where the editor keeps its journals.
    pub fn journals(&self) -> Vec<PathBuf> {
        let folder = self.folder.path().join("settings/state/journals");
        let entries = fs::read_dir(folder).into_iter().flatten();
        let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
        paths.sort();
        paths
    }

    pub fn app(&self) -> &App {
        self.harness.state()
    }

    /// Steps until `holds`; jobs and picks end in their own time.
    pub fn wait(&mut self, what: &str, holds: impl Fn(&App) -> bool) {
        for _ in 0..6000 {
            if holds(self.app()) {
                return;
            }
            self.harness.step();
            std::thread::sleep(Duration::from_millis(5));
        }
        panic!("never came: {what}; messages: {:?}", self.app().messages().entries());
    }

    pub fn wait_until_oriented(&mut self) {
        self.wait("an oriented document", |app| {
            !app.is_busy() && app.document().is_some_and(|document| document.orientation().is_some())
        });
        self.harness.run_steps(3);
    }

    pub fn key(&mut self, modifiers: Modifiers, key: Key) {
        self.harness.key_press_modifiers(modifiers, key);
        self.harness.run_steps(2);
    }

    pub fn click_button(&mut self, label: &str) {
        self.harness.get_by_role_and_label(Role::Button, label).click();
        self.harness.run_steps(2);
    }

    /// Opens a tab of the side panel.
    pub fn open_tab(&mut self, tab: SideTab) {
        // A menu may have the same name; it comes before.
        let tabs = self.harness.query_all_by_role_and_label(Role::Button, tab.label());
        tabs.last().unwrap().click();
        self.harness.run_steps(2);
    }

    /// Clicks the row of the side panel that begins with `text`; what stands before the panel may begin so too.
    pub fn click_row(&mut self, text: &str) {
        let begins = |row: &egui_kittest::Node<'_>| {
            let label = row.accesskit_node().label();
            label.is_some_and(|label| label.starts_with(text))
        };
        let row = self.harness.query_all_by_role(Role::Button).rfind(begins);
        row.unwrap_or_else(|| panic!("no row begins with {text}")).click();
        self.harness.run_steps(2);
    }

    /// Opens the list in the row with this label and takes `wanted` from it.
    pub fn choose(&mut self, label: &str, wanted: &str) {
        self.harness.get_by_role_and_label(Role::ComboBox, label).click();
        self.harness.run_steps(2);
        self.click_button(wanted);
    }

    pub fn shows(&self, label: &str) -> bool {
        self.harness.query_all_by_label_contains(label).next().is_some()
    }

    /// Whether the widget with this label has the keyboard.
    pub fn is_focused(&self, role: Role, label: &str) -> bool {
        let mut widgets = self.harness.query_all_by_role_and_label(role, label);
        widgets.any(|widget| widget.is_focused())
    }

    /// What stands in the field of the export window; `None` when it is closed.
    pub fn export_path(&self) -> Option<String> {
        let field = self.harness.query_by_role_and_label(Role::TextInput, "Export to")?;
        field.value()
    }

    /// Mends the wrong patch, so that there is one source.
    pub fn mend(&mut self) -> Pos2 {
        let (place, _) = self.hover_wrong_patch();
        self.click(place);
        self.wait("a source", |app| app.document().unwrap().sources().len() == 1);
        self.harness.run_steps(2);
        place
    }

    pub fn hover(&mut self, place: Pos2) {
        self.harness.hover_at(place);
        self.harness.run_steps(2);
    }

    pub fn click(&mut self, place: Pos2) {
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

    pub fn picture(&self) -> Picture {
        let ([width, height], rgba) = self.app().picture().unwrap();
        Picture {
            width: width as usize,
            height: height as usize,
            rgba,
        }
    }

    /// The place in the window of a pixel of the view.
    pub fn place(&self, pixel: (usize, usize)) -> Pos2 {
        let offset = Vec2::new(pixel.0 as f32 + 0.5, pixel.1 as f32 + 0.5);
        self.app().view_rect().min + offset / self.harness.ctx.pixels_per_point()
    }

    pub fn bits(&self) -> Vec<u32> {
        self.app().document().unwrap().orientation().unwrap().to_words()
    }

    pub fn normals(&self) -> Vec<Vec3> {
        self.app().document().unwrap().oriented_normals().unwrap()
    }

    pub fn n_sources(&self) -> usize {
        self.app().document().unwrap().sources().len()
    }

    pub fn said(&self, words: &str) -> bool {
        self.app()
            .messages()
            .entries()
            .iter()
            .any(|entry| entry.text.contains(words))
    }

    /// Moves the pointer over the middle of the wrong patch and waits for the preview.
    pub fn hover_wrong_patch(&mut self) -> (Pos2, u64) {
        let pixel = self.picture().inside(is_back).expect("no patch faces backward");
        let place = self.place(pixel);
        self.hover(place);
        self.wait("a preview", |app| app.n_would_turn().is_some());
        (place, self.app().n_would_turn().unwrap())
    }

    /// Exports through the window: opens it, types the path, presses the button.
    pub fn export_to(&mut self, target: &Path) {
        self.key(Modifiers::COMMAND, Key::E);
        let suggested = self.export_path().unwrap();
        let names = ["sphere_oriented.ply", "sample_oriented.ply"];
        assert!(names.iter().any(|name| suggested.ends_with(name)), "{suggested}");
        self.type_export_path(target);
        self.click_button("Export");
    }

    /// Types another path into the open export window.
    pub fn type_export_path(&mut self, target: &Path) {
        let field = self.harness.get_by_role_and_label(Role::TextInput, "Export to");
        field.focus();
        self.harness.run_steps(1);
        self.key(Modifiers::COMMAND, Key::A);
        self.harness
            .get_by_role_and_label(Role::TextInput, "Export to")
            .type_text(&target.display().to_string());
        self.harness.run_steps(2);
    }

    /// Asks the window to close as a desktop does, and returns the commands of the frame that hears of it.
    pub fn close(&mut self) -> Vec<egui::ViewportCommand> {
        let input = self.harness.input_mut();
        input
            .viewports
            .entry(egui::ViewportId::ROOT)
            .or_default()
            .events
            .push(egui::ViewportEvent::Close);
        let commands = self.commands_of(1);
        if let Some(info) = self.harness.input_mut().viewports.get_mut(&egui::ViewportId::ROOT) {
            info.events.clear();
        }
        commands
    }

    pub fn commands_of(&mut self, n_steps: usize) -> Vec<egui::ViewportCommand> {
        (0..n_steps)
            .flat_map(|_| {
                self.harness.step();
                self.harness.output().viewport_output[&egui::ViewportId::ROOT]
                    .commands
                    .clone()
            })
            .collect()
    }

    pub fn drop_file(&mut self, path: &Path) {
        self.harness
            .input_mut()
            .dropped_files
            .push(Arc::new(Dropped(path.to_path_buf())));
        self.harness.step();
    }
}

pub struct Picture {
    pub width: usize,
    height: usize,
    pub rgba: Vec<u8>,
}

impl Picture {
    pub fn at(&self, x: usize, y: usize) -> [u8; 3] {
        let start = 4 * (y * self.width + x);
        [self.rgba[start], self.rgba[start + 1], self.rgba[start + 2]]
    }

    pub fn count(&self, is: fn([u8; 3]) -> bool) -> usize {
        (0..self.height)
            .flat_map(|y| (0..self.width).map(move |x| (x, y)))
            .filter(|&(x, y)| is(self.at(x, y)))
            .count()
    }

    /// A pixel whose surroundings are also such, as far from the border of the patch as possible.
    pub fn inside(&self, is: fn([u8; 3]) -> bool) -> Option<(usize, usize)> {
        [12_usize, 8, 5, 3, 1].into_iter().find_map(|reach| {
            (reach..self.height - reach)
                .flat_map(|y| (reach..self.width - reach).map(move |x| (x, y)))
                .find(|&(x, y)| (y - reach..=y + reach).all(|y| (x - reach..=x + reach).all(|x| is(self.at(x, y)))))
        })
    }
}

/// Orange, in any light.
pub fn is_back([red, _, blue]: [u8; 3]) -> bool {
    i32::from(red) > i32::from(blue) + 40
}

/// The pink of the sphere of a source that turned its point.
pub fn is_flipped_source([red, green, blue]: [u8; 3]) -> bool {
    i32::from(red.min(blue)) > i32::from(green) + 40
}

/// Blue, in any light.
pub fn is_front([red, _, blue]: [u8; 3]) -> bool {
    i32::from(blue) > i32::from(red) + 40
}

pub const N_POINTS: usize = 4000;

/// A sphere whose normals are right but for a cap that faces the corner view.
pub fn sphere_with_wrong_cap(folder: &Path) -> Option<PathBuf> {
    sphere_with_cap(folder, N_POINTS, 0.8)
}

/// So many points that a bit for each of them is far more than what a small edit uploads.
pub const N_MANY_POINTS: usize = 200_000;

/// As [`sphere_with_wrong_cap`], of [`N_MANY_POINTS`], half a hundredth of them in the cap.
pub fn large_sphere_with_small_cap(folder: &Path) -> Option<PathBuf> {
    sphere_with_cap(folder, N_MANY_POINTS, 0.99)
}

/// `cosine` is that of the angle from the middle of the cap to its border.
fn sphere_with_cap(folder: &Path, n_points: usize, cosine: f32) -> Option<PathBuf> {
    let shape = shapes::sphere(n_points);
    let toward_view = Vec3::new(1.0, -1.0, 1.0) / 3.0_f32.sqrt();
    let normals: Vec<Vec3> = shape
        .normals
        .iter()
        .map(|&normal| {
            if normal.dot(toward_view) > cosine {
                -normal
            } else {
                normal
            }
        })
        .collect();
    let path = folder.join("sphere.ply");
    normend_io::write_points(&path, Positions::Float(&shape.positions), Some(&normals), &Silent).unwrap();
    Some(path)
}

pub fn sphere_without_normals(folder: &Path, name: &str, n_points: usize) -> PathBuf {
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

pub fn n_different(a: &[Vec3], b: &[Vec3]) -> u64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(|(a, b)| a != b).count() as u64
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
