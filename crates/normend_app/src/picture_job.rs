//! Pictures of the view as files: one of any size, or those of a turntable; and one for the clipboard.

use std::path::{Path, PathBuf};

use egui::ColorImage;
use image::{ExtendedColorType, ImageFormat};
use normend_core::Progress;
use normend_render::{Compare, DrawSettings, HairLen, MAX_PICTURE_SIDE, PictureMaker, RenderError};

use crate::app::App;
use crate::job::{Job, JobError};
use crate::panels::modal::Modal;
use crate::panels::screenshot::{PictureWindow, usual_folder};
use crate::settings::Purpose;
use crate::theme;
use crate::work::Work;

/// How many pictures a turntable has.
pub const FRAMES: std::ops::RangeInclusive<u32> = 2..=720;

/// What is to be drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureOrder {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Nothing behind the scan.
    pub transparent: bool,
    /// With the spheres of sources.
    pub spheres: bool,
    /// Where to.
    pub target: PictureTarget,
}

/// Where pictures go.
#[derive(Clone, Debug, PartialEq)]
pub enum PictureTarget {
    /// One picture into this file; what is there is replaced.
    File(PathBuf),
    /// One picture into the clipboard.
    Clipboard,
    /// So many into this folder, each turned a little further around the up axis.
    Turntable {
        /// The folder; it is made where it is missing.
        folder: PathBuf,
        /// How many for a whole turn.
        n_frames: u32,
    },
}

/// What a job made.
pub enum Made {
    /// Files, all in one folder.
    Files(PathBuf),
    /// A picture for the clipboard.
    Picture(ColorImage),
}

/// The name of a turntable's picture in its folder.
pub fn frame_name(frame: u32) -> String {
    format!("turntable_{frame:03}.png")
}

/// The settings of a picture that is `scale` times as large as the view, so that it looks the same.
fn scaled(settings: &DrawSettings, scale: f32, width: f32) -> DrawSettings {
    let mut settings = *settings;
    settings.stride = 1;
    if let Some(hair) = &mut settings.hair
        && let HairLen::Pixels(len) = &mut hair.len
    {
        *len *= scale;
    }
    if let Compare::Split(x) = &mut settings.compare {
        *x *= width;
    }
    settings
}

impl App {
    /// The view's size in physical pixels.
    fn view_pixels(&self) -> [u32; 2] {
        let size = self.viewport.size_in_pixels();
        [size.x as u32, size.y as u32]
    }

    /// Opens the window for pictures.
    pub(crate) fn ask_picture(&mut self, is_turntable: bool) {
        let Some(session) = &self.session else { return };
        let scan = session.scan.path();
        let folder = self.settings.settings.folder(Purpose::Picture).map(Path::to_path_buf);
        let folder = folder.unwrap_or_else(|| usual_folder(scan));
        let window = PictureWindow::new(is_turntable, self.view_pixels(), &session.name, &folder);
        self.windows.modal = Some(Modal::Picture(window));
    }

    /// Starts to draw pictures.
    pub(crate) fn make_pictures(&mut self, order: &PictureOrder) {
        if self.work.is_some() {
            self.messages
                .error("No picture was made: other work is running. Wait for it, or cancel it.");
            return;
        }
        let Some(scene) = &self.scene else {
            self.messages
                .error("No picture was made: there is no graphics adapter.");
            return;
        };
        let dark = self.ctx.theme() == egui::Theme::Dark;
        let view = self.viewport.size_in_pixels();
        let scale = order.size[1] as f32 / view.y.max(1.0);
        let pixels_per_point = self.ctx.pixels_per_point();
        let settings = DrawSettings {
            clip: self.viewport.clip,
            compare: self.comparing.compare(view.x),
            hair: self.settings.settings.display.hair(pixels_per_point),
            spheres: order.spheres,
            ..self.draw_settings(dark)
        };
        let settings = scaled(&settings, scale, order.size[0] as f32 / view.x.max(1.0));
        let camera = *self.viewport.camera();
        let maker = scene.picture_maker(&camera, order.size, pixels_per_point * scale, &settings);
        let maker = maker.with_transparency(order.transparent);
        let order = order.clone();
        let size = order.size;
        let target = order.target.clone();
        let job = Job::start(&self.ctx, "pictures", "Drawing", move |progress| match order.target {
            PictureTarget::Clipboard => {
                let rgba = draw(&maker, progress, 0.0..1.0)?;
                let size = size.map(|side| side as usize);
                Ok(Made::Picture(ColorImage::from_rgba_unmultiplied(size, &rgba)))
            }
            PictureTarget::File(path) => {
                let rgba = draw(&maker, progress, 0.0..0.9)?;
                progress.stage("Writing");
                write(&path, size, &rgba)?;
                Ok(Made::Files(path))
            }
            PictureTarget::Turntable { folder, n_frames } => {
                std::fs::create_dir_all(&folder).map_err(|error| {
                    JobError::Failed(format!(
                        "{} cannot be made: {}.",
                        folder.display(),
                        normend_io::io_words(&error)
                    ))
                })?;
                let mut maker = maker;
                for frame in 0..n_frames {
                    progress.stage(&format!("Picture {} of {n_frames}", frame + 1));
                    let share = |frame: u32| frame as f32 / n_frames as f32;
                    maker = maker.with_camera(&camera.on_turntable(share(frame)));
                    let rgba = draw(&maker, progress, share(frame)..share(frame + 1))?;
                    write(&folder.join(frame_name(frame)), size, &rgba)?;
                }
                Ok(Made::Files(folder))
            }
        });
        self.work = Some(Work::Pictures { job, target });
    }

    /// Takes what a job made.
    pub(crate) fn take_pictures(&mut self, outcome: Result<Made, JobError>, target: &PictureTarget) {
        match outcome {
            Ok(Made::Picture(picture)) => {
                let [width, height] = picture.size;
                self.ctx.copy_image(picture);
                self.messages
                    .info(format!("Copied a picture of {width} × {height} pixels."));
            }
            Ok(Made::Files(path)) => {
                match target {
                    PictureTarget::Turntable { n_frames, .. } => {
                        // The folder of the next one is beside this one.
                        self.settings.settings.remember_folder(Purpose::Picture, &path);
                        let n_pictures = theme::counted(u64::from(*n_frames), "picture", "pictures");
                        self.messages.info(format!("Saved {n_pictures} in {}.", path.display()));
                    }
                    _ => {
                        self.settings.settings.remember_folder(Purpose::Picture, &path);
                        self.messages.info(format!("Saved {}.", path.display()));
                    }
                }
            }
            Err(JobError::Cancelled) => self.messages.note("No picture was made: cancelled."),
            Err(JobError::Failed(reason)) => self.messages.error(format!("No picture was made: {reason}")),
        }
    }
}

fn draw(maker: &PictureMaker, progress: &dyn Progress, part: std::ops::Range<f32>) -> Result<Vec<u8>, JobError> {
    let mut report = |fraction: f32| progress.report(part.start + (part.end - part.start) * fraction).is_ok();
    maker.make(&mut report).map_err(|error| match error {
        RenderError::Canceled => JobError::Cancelled,
        error => JobError::Failed(format!("{error}.")),
    })
}

fn write(path: &Path, [width, height]: [u32; 2], rgba: &[u8]) -> Result<(), JobError> {
    let mut png = std::io::Cursor::new(Vec::new());
    image::write_buffer_with_format(
        &mut png,
        rgba,
        width,
        height,
        ExtendedColorType::Rgba8,
        ImageFormat::Png,
    )
    .map_err(|error| JobError::Failed(format!("{} cannot be made: {error}.", path.display())))?;
    normend_io::write_bytes(path, png.get_ref()).map_err(|error| JobError::Failed(format!("{error}.")))
}

/// `size` times `factor`, when that is not more than a picture can have.
pub fn enlarged(size: [u32; 2], factor: u32) -> Option<[u32; 2]> {
    let size = size.map(|side| side.saturating_mul(factor));
    size.iter()
        .all(|side| (1..=MAX_PICTURE_SIDE).contains(side))
        .then_some(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_not_larger_than_can_be_drawn() {
        assert_eq!(enlarged([1000, 700], 4), Some([4000, 2800]));
        assert_eq!(enlarged([1000, 700], 9), None);
        assert_eq!(enlarged([0, 700], 1), None);
    }

    #[test]
    fn a_larger_picture_looks_the_same() {
        let settings = DrawSettings {
            stride: 4,
            compare: Compare::Split(100.0),
            hair: crate::settings::DisplaySettings {
                hair: true,
                ..Default::default()
            }
            .hair(1.0),
            ..DrawSettings::default()
        };
        let scaled = scaled(&settings, 2.0, 3.0);
        assert_eq!((scaled.stride, scaled.compare), (1, Compare::Split(300.0)));
        assert_eq!(scaled.hair.map(|hair| hair.len), Some(HairLen::Pixels(28.0)));
    }
}
