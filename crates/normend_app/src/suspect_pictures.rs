//! Small pictures of the suspects in the list: made one at a time beside the window's, only for rows that were in sight.

use std::collections::BTreeMap;

use egui::{ColorImage, TextureHandle, TextureOptions};
use normend_render::PictureMaker;

use crate::job::{Job, JobError};

/// Size of a picture, in points.
pub const SIZE: egui::Vec2 = egui::Vec2::new(76.0, 57.0);

/// What the pictures depend on; those of another look are forgotten.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Look {
    /// The list, see [`crate::suspects_list::SuspectsList::generation`].
    pub generation: u64,
    /// The theme.
    pub dark: bool,
    /// Pixels of a picture.
    pub pixels: [u32; 2],
}

/// The pictures that are there, and the one that is being made.
#[derive(Default)]
pub struct SuspectPictures {
    look: Look,
    done: BTreeMap<usize, Option<TextureHandle>>,
    job: Option<(usize, Job<Vec<u8>>)>,
    wanted: Vec<usize>,
}

impl SuspectPictures {
    /// How many are there.
    pub fn len(&self) -> usize {
        self.done.values().flatten().count()
    }

    /// The picture of a row, and a wish for it when it is not there yet.
    pub fn get(&mut self, row: usize) -> Option<&TextureHandle> {
        if !self.done.contains_key(&row) {
            self.wanted.push(row);
        }
        self.done.get(&row)?.as_ref()
    }

    /// Takes a finished picture and starts the next that is wanted; `maker` gives what draws a row.
    pub fn keep(&mut self, ctx: &egui::Context, look: Look, maker: impl FnOnce(usize) -> Option<PictureMaker>) {
        let wanted = std::mem::take(&mut self.wanted);
        if look != self.look {
            *self = Self {
                look,
                ..Self::default()
            };
        }
        if let Some((row, job)) = self.job.take() {
            match job.poll() {
                None => self.job = Some((row, job)),
                Some(Ok(rgba)) => {
                    let image = ColorImage::from_rgba_unmultiplied(look.pixels.map(|side| side as usize), &rgba);
                    let texture = ctx.load_texture(format!("suspect {row}"), image, TextureOptions::LINEAR);
                    self.done.insert(row, Some(texture));
                    ctx.request_repaint();
                }
                // The row says all without its picture.
                Some(Err(_)) => {
                    self.done.insert(row, None);
                }
            }
        }
        if self.job.is_some() {
            return;
        }
        let next = wanted.into_iter().find(|row| !self.done.contains_key(row));
        if let Some(row) = next
            && let Some(maker) = maker(row)
        {
            let job = Job::start(ctx, "suspect picture", "Drawing", move |progress| {
                let picture = maker.make(&mut |fraction| progress.report(fraction).is_ok());
                picture.map_err(|error| JobError::Failed(error.to_string()))
            });
            self.job = Some((row, job));
        }
    }
}
