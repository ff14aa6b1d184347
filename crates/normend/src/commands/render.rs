//! `normend render`: a picture of a scan, without a window.

use std::fmt;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::{Context, bail};
use image::{ExtendedColorType, ImageFormat};
use normend_core::progress::{Cancelled, Part};
use normend_core::{Document, EditError, Parameters, Progress, Propagation, Start};
use normend_render::{
    Camera, DisplayMode, DrawSettings, HeadlessDevice, MAX_PICTURE_SIDE, Palette, RenderError, SplatRenderer,
};

use super::{Outcome, check_is_file_name, check_may_write, prepare, title_of, wrong_use};
use crate::arguments::RenderArguments;
use crate::console::Bar;

/// Pixels of a picture's shorter side up to which its lines are one pixel wide.
const SCREEN_SIDE: f32 = 1000.0;

/// Width and height of a picture in pixels, typed as `1280x800`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureSize {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}

impl Default for PictureSize {
    fn default() -> Self {
        Self {
            width: 1280,
            height: 800,
        }
    }
}

impl fmt::Display for PictureSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

impl FromStr for PictureSize {
    type Err = String;

    fn from_str(typed: &str) -> Result<Self, String> {
        let side = |text: &str| text.parse().ok().filter(|side| (1..=MAX_PICTURE_SIDE).contains(side));
        typed
            .split_once(['x', 'X'])
            .and_then(|(width, height)| {
                Some(Self {
                    width: side(width)?,
                    height: side(height)?,
                })
            })
            .ok_or_else(|| format!("type width and height as 1280x800, each 1 to {MAX_PICTURE_SIDE}"))
    }
}

/// The palettes by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PaletteName {
    /// Front blue, back orange.
    #[default]
    BlueOrange,
    /// Front light gray, back black, as printed in papers.
    Paper,
}

impl PaletteName {
    /// All palettes, in the order of the help.
    pub const ALL: [Self; 2] = [Self::BlueOrange, Self::Paper];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::BlueOrange => "blue-orange",
            Self::Paper => "paper",
        }
    }

    fn palette(self) -> Palette {
        match self {
            Self::BlueOrange => Palette::BLUE_ORANGE,
            Self::Paper => Palette::PAPER,
        }
    }
}

/// Draws one scan into a PNG file.
///
/// # Errors
/// Wrong use, a scan that cannot be read, no graphics driver, a picture that cannot be written; Ctrl-C.
pub fn run(arguments: &RenderArguments) -> anyhow::Result<Outcome> {
    check_is_file_name(&arguments.output)?;
    if normend_io::is_same_file(&arguments.input, &arguments.output) {
        return Err(wrong_use(
            "the picture would take the place of the scan: name another output",
        ));
    }
    if !arguments
        .output
        .extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("png"))
    {
        return Err(wrong_use(
            "pictures are PNG files: let the name of the output end with .png",
        ));
    }
    let outputs = outputs(arguments);
    for output in &outputs {
        check_may_write(output, arguments.overwrite)?;
    }
    prepare(&arguments.common)?;
    // Before the work, so that a missing driver costs no time.
    let graphics = Graphics::open()?;
    let bar = Bar::new(&title_of(&arguments.input), arguments.common.quiet);
    let (document, colors) = read_oriented(arguments, &bar)?;
    bar.stage("Drawing");
    let PictureSize { width, height } = arguments.size;
    let progress = Part::new(&bar, 0.9..1.0);
    graphics.draw(&document, colors.as_deref(), arguments, &progress, |frame, rgba| {
        write(&outputs[frame], arguments.size, rgba)
    })?;
    let more = match outputs.len() {
        1 => String::new(),
        n_pictures => format!(", the first of {n_pictures}"),
    };
    bar.say(&format!("{}: {width}x{height} pixels{more}", outputs[0].display()));
    Ok(Outcome::Done)
}

/// The files to write: the output itself, or with a number before its extension those of a turntable.
fn outputs(arguments: &RenderArguments) -> Vec<PathBuf> {
    let output = &arguments.output;
    match arguments.turntable {
        None => vec![output.clone()],
        Some(n_frames) => {
            let stem = output.file_stem().unwrap_or_default().to_string_lossy();
            let name = |frame: u32| output.with_file_name(format!("{stem}_{frame:03}.png"));
            (0..n_frames).map(name).collect()
        }
    }
}

fn write(output: &Path, PictureSize { width, height }: PictureSize, rgba: &[u8]) -> anyhow::Result<()> {
    let mut png = Cursor::new(Vec::new());
    image::write_buffer_with_format(
        &mut png,
        rgba,
        width,
        height,
        ExtendedColorType::Rgba8,
        ImageFormat::Png,
    )
    .context("cannot make a PNG of the picture")?;
    normend_io::write_bytes(output, png.get_ref())?;
    Ok(())
}

/// The scan with the normals of its file; points without one get an oriented normal. And the file's colors, where the mode
/// shows them: RGBA8 by point.
fn read_oriented(arguments: &RenderArguments, bar: &Bar) -> anyhow::Result<(Document, Option<Vec<u32>>)> {
    let scan = super::read(&arguments.input, &arguments.reading, bar, &Part::new(bar, 0.0..0.08))?;
    let colors = match arguments.mode {
        DisplayMode::Colors => {
            let colors = scan
                .colors(&Part::new(bar, 0.08..0.1))?
                .with_context(|| format!("{} has no colors: choose another --mode", arguments.input.display()))?;
            Some(
                colors
                    .iter()
                    .map(|&[r, g, b]| u32::from_le_bytes([r, g, b, 255]))
                    .collect(),
            )
        }
        DisplayMode::Facing | DisplayMode::Lit | DisplayMode::Normals => None,
    };
    let given = scan.given_normals.as_ref().map(|normals| normals.as_slice());
    let parameters = Parameters {
        start: Start::Keep,
        ..Parameters::default()
    };
    let propagation = Propagation::new(&scan.cloud, given, parameters, &Part::new(bar, 0.1..0.9))?;
    let mut document = Document::new(scan.cloud, scan.given_normals);
    document.install(propagation);
    Ok((document, colors))
}

/// A graphics device without a window, and the first thing that went wrong on it.
struct Graphics {
    headless: HeadlessDevice,
    failure: Arc<Mutex<Option<String>>>,
}

impl Graphics {
    fn open() -> anyhow::Result<Self> {
        let headless = HeadlessDevice::new()?;
        let failure = Arc::new(Mutex::new(None));
        let kept = Arc::clone(&failure);
        // Without a handler wgpu panics.
        headless.device.on_uncaptured_error(Arc::new(move |error| {
            kept.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .get_or_insert_with(|| error.to_string());
        }));
        Ok(Self { headless, failure })
    }

    /// Hands each picture over by its number: rows of RGBA from the top.
    fn draw(
        &self,
        document: &Document,
        colors: Option<&[u32]>,
        arguments: &RenderArguments,
        progress: &dyn Progress,
        mut take: impl FnMut(usize, &[u8]) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let HeadlessDevice { device, queue, .. } = &self.headless;
        let PictureSize { width, height } = arguments.size;
        let cloud = document.cloud();
        let normals = document.oriented_normals().ok_or(EditError::NotReady)?;
        let radii = document
            .propagation()
            .map(|propagation| &propagation.splat_radii)
            .ok_or(EditError::NotReady)?;
        let (min, max) = cloud.bounding_box();
        let aspect = width as f32 / height as f32;
        let mut camera = Camera::new(arguments.view, arguments.up);
        camera.frame(min, max, aspect);
        camera.frame_points(cloud.positions().iter().copied(), aspect);
        let settings = DrawSettings {
            mode: arguments.mode,
            palette: arguments.palette.palette(),
            ..DrawSettings::default()
        };
        let mut renderer = SplatRenderer::new(device);
        renderer.set_cloud(device, queue, cloud.positions(), Some(&normals), radii, None)?;
        renderer.set_colors(device, colors)?;
        let size = [width, height];
        // Edges are as wide on a large picture, seen as a whole, as on one that fits a screen.
        let line_scale = (width.min(height) as f32 / SCREEN_SIDE).max(1.0);
        let mut maker = renderer
            .picture_maker(device, queue, &camera, size, line_scale, &settings)
            .with_transparency(arguments.transparent);
        let n_frames = arguments.turntable.unwrap_or(1);
        for frame in 0..n_frames {
            let share = |frame: u32| frame as f32 / n_frames as f32;
            maker = maker.with_camera(&camera.on_turntable(share(frame)));
            let part = Part::new(progress, share(frame)..share(frame + 1));
            let picture = maker.make(&mut |fraction| part.report(fraction).is_ok());
            if let Some(failure) = self.failure.lock().unwrap_or_else(PoisonError::into_inner).take() {
                bail!("the graphics driver cannot draw this ({failure}): try a smaller --size");
            }
            match picture {
                // The code of the program tells this apart from a failure.
                Err(RenderError::Canceled) => return Err(Cancelled.into()),
                picture => take(frame as usize, &picture?)?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_width_x_height() {
        fn check(typed: &str, expect: Option<(u32, u32)>) {
            let size = typed.parse::<PictureSize>().ok();
            assert_eq!(size.map(|size| (size.width, size.height)), expect, "{typed:?}");
        }
        check("1280x800", Some((1280, 800)));
        check("1X8192", Some((1, 8192)));
        check(&PictureSize::default().to_string(), Some((1280, 800)));
        for wrong in ["", "x", "1280", "0x800", "1280x8193", "-1x2", "1280x800x3", "12 x 8"] {
            check(wrong, None);
        }
    }
}
