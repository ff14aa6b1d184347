//! The window for pictures of the view: how large, of what, and where to.

use std::path::{Path, PathBuf};

use egui::{Checkbox, ComboBox, DragValue, Label, RichText, TextEdit, Ui};
use normend_render::MAX_PICTURE_SIDE;

use super::modal;
use super::open_path::typed_path;
use crate::picture_job::{FRAMES, PictureOrder, PictureTarget, enlarged, frame_name};
use crate::theme::{self, SPACE_S};

const WIDTH: f32 = 480.0;
/// Room for a problem, so that the window keeps its size.
const PROBLEM_HEIGHT: f32 = 38.0;
/// Pictures in a second that a turntable's length is told for.
const FRAMES_PER_SEC: f32 = 25.0;

/// How large a picture is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Size {
    #[default]
    Window,
    Double,
    Fourfold,
    Own,
}

impl Size {
    const ALL: [Self; 4] = [Self::Window, Self::Double, Self::Fourfold, Self::Own];

    fn label(self) -> &'static str {
        match self {
            Self::Window => "As the view",
            Self::Double => "2 × the view",
            Self::Fourfold => "4 × the view",
            Self::Own => "Other",
        }
    }
}

/// The window.
#[derive(Clone, Debug)]
pub struct PictureWindow {
    is_turntable: bool,
    size: Size,
    own_size: [u32; 2],
    view: [u32; 2],
    transparent: bool,
    spheres: bool,
    path: String,
    n_frames: u32,
    replace: bool,
    problem: Option<String>,
    wants_focus: bool,
}

/// What the user decided.
#[derive(Clone, Debug, PartialEq)]
pub enum Decision {
    /// Not yet.
    Wait,
    /// Nothing is drawn.
    Close,
    /// Draw this.
    Draw(PictureOrder),
}

impl PictureWindow {
    /// For one picture of a view of so many pixels, or those of a turntable. `name` is the scan's, `folder` where they go unless the
    /// user says otherwise.
    pub fn new(is_turntable: bool, view: [u32; 2], name: &str, folder: &Path) -> Self {
        let stem = Path::new(name).file_stem().unwrap_or_default().to_string_lossy();
        let names = (1..).map(|number: u32| {
            let number = if number == 1 {
                String::new()
            } else {
                format!("_{number}")
            };
            if is_turntable {
                folder.join(format!("{stem}_turntable{number}"))
            } else {
                folder.join(format!("{stem}_view{number}.png"))
            }
        });
        // After a hundred the user sorts them out.
        let free = names.take(100).find(|path| !path.exists());
        let path = free.unwrap_or_else(|| folder.join(format!("{stem}_view.png")));
        Self {
            is_turntable,
            size: Size::default(),
            own_size: [1920, 1080],
            view,
            transparent: false,
            spheres: false,
            path: path.display().to_string(),
            n_frames: 72,
            replace: false,
            problem: None,
            wants_focus: true,
        }
    }

    fn pixels(&self) -> Option<[u32; 2]> {
        match self.size {
            Size::Window => enlarged(self.view, 1),
            Size::Double => enlarged(self.view, 2),
            Size::Fourfold => enlarged(self.view, 4),
            Size::Own => enlarged(self.own_size, 1),
        }
    }

    /// Shows the window.
    pub fn ui(&mut self, ui: &Ui) -> Decision {
        let title = if self.is_turntable {
            "Turntable"
        } else {
            "Picture of the view"
        };
        modal::show(ui, title, WIDTH, |ui| self.content(ui))
    }

    fn content(&mut self, ui: &mut Ui) -> Decision {
        let mut decision = Decision::Wait;
        if self.is_turntable {
            let about = "Pictures of the scan turning once around the point in the middle of the view, for a film.";
            ui.add(Label::new(RichText::new(about).weak()).wrap());
        }
        theme::rows(ui, "picture window", |ui| {
            theme::input_row(ui, "Size", "How many pixels", |ui| {
                ComboBox::from_id_salt("picture size")
                    .selected_text(self.size.label())
                    .show_ui(ui, |ui| {
                        for each in Size::ALL {
                            ui.selectable_value(&mut self.size, each, each.label());
                        }
                    })
                    .response
            });
            ui.label(RichText::new("Pixels").weak());
            ui.horizontal(|ui| match (self.size, self.pixels()) {
                (Size::Own, _) => {
                    for (side, name) in self.own_size.iter_mut().zip(["Width", "Height"]) {
                        let field = ui.add(DragValue::new(side).range(1..=MAX_PICTURE_SIDE));
                        field.widget_info(|| egui::WidgetInfo::labeled(egui::accesskit::Role::SpinButton, true, name));
                    }
                }
                (_, Some([width, height])) => {
                    ui.label(format!("{width} × {height}"));
                }
                (_, None) => {
                    ui.label(format!("more than {MAX_PICTURE_SIDE}: choose a smaller size"));
                }
            });
            ui.end_row();
            if self.is_turntable {
                theme::input_row(ui, "Pictures", "How many for a whole turn", |ui| {
                    ui.add(DragValue::new(&mut self.n_frames).range(FRAMES))
                });
                let secs = self.n_frames as f32 / FRAMES_PER_SEC;
                theme::row(
                    ui,
                    "Length",
                    format!("{secs:.1} s at {FRAMES_PER_SEC:.0} pictures a second"),
                );
            }
        });
        ui.checkbox(&mut self.transparent, "Transparent background")
            .on_hover_text("Nothing stands behind the scan, for a picture over another");
        ui.checkbox(&mut self.spheres, "With the spheres of sources");
        ui.add_space(SPACE_S);
        let label = ui.label(if self.is_turntable { "Folder" } else { "Save to" });
        let field = ui.add(TextEdit::singleline(&mut self.path).desired_width(f32::INFINITY));
        let field = field.labelled_by(label.id);
        if field.changed() {
            (self.replace, self.problem) = (false, None);
        }
        if std::mem::take(&mut self.wants_focus) {
            field.request_focus();
        }
        ui.vertical(|ui| {
            ui.set_min_height(PROBLEM_HEIGHT);
            if let Some(problem) = &self.problem {
                ui.add(Label::new(RichText::new(problem).color(ui.visuals().error_fg_color)).wrap());
                ui.add(Checkbox::new(&mut self.replace, "Replace what is there"));
            }
        });
        ui.horizontal(|ui| {
            let enter = modal::enter_pressed(ui);
            let pixels = self.pixels();
            let no_size = "Give a width and a height first";
            let save = ui.add_enabled(pixels.is_some(), theme::primary_button(ui, "Save"));
            let save = save
                .on_hover_text("Write the file (Enter)")
                .on_disabled_hover_text(no_size);
            if (save.clicked() || enter)
                && let Some(size) = pixels
                && let Some(target) = self.target()
            {
                decision = Decision::Draw(self.order(size, target));
            }
            if !self.is_turntable {
                let copy = ui.add_enabled(pixels.is_some(), egui::Button::new("Copy"));
                let copy = copy.on_hover_text("Put the picture into the clipboard");
                if copy.on_disabled_hover_text(no_size).clicked()
                    && let Some(size) = pixels
                {
                    decision = Decision::Draw(self.order(size, PictureTarget::Clipboard));
                }
            }
            if modal::cancel_button(ui) {
                decision = Decision::Close;
            }
        });
        decision
    }

    fn order(&self, size: [u32; 2], target: PictureTarget) -> PictureOrder {
        PictureOrder {
            size,
            transparent: self.transparent,
            spheres: self.spheres,
            target,
        }
    }

    /// Where it goes; `None`, saying why, when that is not possible or would replace something that the user was not asked about.
    fn target(&mut self) -> Option<PictureTarget> {
        let Some(path) = typed_path(&self.path) else {
            self.problem = Some("Type where the picture goes.".to_owned());
            return None;
        };
        // A relative path means the folder that the editor was started in; the message names it in full.
        let mut path = std::path::absolute(&path).unwrap_or(path);
        if self.is_turntable {
            let is_there = path.is_file() || path.join(frame_name(0)).exists();
            if path.is_file() || (is_there && !self.replace) {
                self.problem = Some(if path.is_file() {
                    "This is a file: type the name of a folder.".to_owned()
                } else {
                    "This folder has such pictures already: tick “Replace”, or type another name.".to_owned()
                });
                return None;
            }
            return Some(PictureTarget::Turntable {
                folder: path,
                n_frames: self.n_frames,
            });
        }
        if !path
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("png"))
        {
            let mut name = path.file_name().unwrap_or_default().to_owned();
            name.push(".png");
            path.set_file_name(name);
        }
        if path.is_dir() {
            self.problem = Some("This is a folder: add a file name.".to_owned());
            return None;
        }
        if path.exists() && !self.replace {
            self.problem = Some("This file exists: tick “Replace”, or type another name.".to_owned());
            return None;
        }
        Some(PictureTarget::File(path))
    }
}

/// Where pictures go unless the user said otherwise: beside the scan, else the home folder.
pub fn usual_folder(scan: Option<&PathBuf>) -> PathBuf {
    let beside = scan.and_then(|path| path.parent()).map(Path::to_path_buf);
    let pictures = || {
        let folders = directories::UserDirs::new()?;
        let pictures = folders.picture_dir().filter(|folder| folder.is_dir());
        Some(pictures.unwrap_or_else(|| folders.home_dir()).to_path_buf())
    };
    beside.or_else(pictures).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_replaced_without_asking() {
        let folder = tempfile::tempdir().unwrap();
        let mut window = PictureWindow::new(false, [100, 50], "scan.ply", folder.path());
        let first = folder.path().join("scan_view.png");
        assert_eq!(window.target(), Some(PictureTarget::File(first.clone())));
        std::fs::write(&first, "a picture").unwrap();
        assert_eq!(window.target(), None);
        assert!(
            window
                .problem
                .as_ref()
                .is_some_and(|problem| problem.contains("exists"))
        );
        window.replace = true;
        assert_eq!(window.target(), Some(PictureTarget::File(first)));
        let next = PictureWindow::new(false, [100, 50], "scan.ply", folder.path());
        assert!(next.path.ends_with("scan_view_2.png"), "{}", next.path);
        let mut turntable = PictureWindow::new(true, [100, 50], "scan.ply", folder.path());
        let frames = folder.path().join("scan_turntable");
        let target = PictureTarget::Turntable {
            folder: frames.clone(),
            n_frames: 72,
        };
        assert_eq!(turntable.target(), Some(target));
        std::fs::create_dir(&frames).unwrap();
        std::fs::write(frames.join(frame_name(0)), "a picture").unwrap();
        assert_eq!(turntable.target(), None);
    }

    #[test]
    fn names_get_their_extension() {
        let folder = tempfile::tempdir().unwrap();
        let mut window = PictureWindow::new(false, [100, 50], "scan.ply", folder.path());
        window.path = folder.path().join("a.b").display().to_string();
        assert_eq!(
            window.target(),
            Some(PictureTarget::File(folder.path().join("a.b.png")))
        );
        window.path = folder.path().display().to_string() + ".PNG";
        assert!(matches!(window.target(), Some(PictureTarget::File(path)) if path.extension().unwrap() == "PNG"));
        window.size = Size::Fourfold;
        assert_eq!(window.pixels(), Some([400, 200]));
        window.view = [3000, 100];
        assert_eq!(window.pixels(), None);
    }
}
