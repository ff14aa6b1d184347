//! Pictures of any size, in tiles, beside the window's picture.

use std::ops::Range;

use egui_wgpu::wgpu;
use glam::UVec2;

use crate::canvas::{Canvas, Stage};
use crate::marks::{GrowingBuffer, highlight_words};
use crate::read_back::{COLOR_BYTES, ReadBack};
use crate::uniforms::{Shot, Tile};
use crate::{Camera, RenderError};

/// Largest side of a picture in pixels.
pub const MAX_PICTURE_SIDE: u32 = 8192;
/// Largest side of what is drawn at once, in pixels, its margins included: textures of 400 MB, where a whole picture of
/// the largest size would need 1.6 GB.
const MAX_TILE_SIDE: u32 = 4096;
/// Pixels that tiles overlap on each side, because colors depend on pixels nearby: as far as the rim of a disc from its
/// center.
const MARGIN: u32 = 64;

/// All that a picture is made from, to be drawn in any thread while the renderer goes on. It shows the points, signs and
/// marks as they are when it is drawn. A clone is cheap.
#[derive(Clone)]
pub struct PictureMaker {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) stage: Stage,
    pub(crate) shot: Shot,
    pub(crate) max_tile_side: u32,
}

impl PictureMaker {
    /// The same picture seen by another camera, for those of a turntable.
    #[must_use]
    pub fn with_camera(mut self, camera: &Camera) -> Self {
        self.shot.view.camera = *camera;
        self
    }

    /// The same picture without its background, which is then clear, or with it, as at first.
    #[must_use]
    pub fn with_transparency(mut self, transparent: bool) -> Self {
        self.shot.transparent = transparent;
        self
    }

    /// The same picture with other `ranges` of instances highlighted (ascending, disjoint), whatever the window
    /// highlights. Uploads 8 bytes a range.
    #[must_use]
    pub fn with_highlight(mut self, ranges: &[Range<u32>]) -> Self {
        let mut highlights = GrowingBuffer::new(&self.device, "highlighted ranges of a picture");
        highlights.set(&self.device, &self.queue, highlight_words(ranges));
        self.stage.has.n_highlights = highlights.len();
        self.stage.highlights = highlights.buffer().clone();
        self
    }

    /// What fits on `device` of a tile's side.
    pub(crate) fn tile_side(device: &wgpu::Device) -> u32 {
        device.limits().max_texture_dimension_2d.min(MAX_TILE_SIDE)
    }

    /// Draws and reads the picture back: RGBA rows from the top, gamma-encoded, not multiplied by alpha. Blocks;
    /// O(points × tiles + pixels). `progress` gets the fraction done after each tile, and says whether to go on.
    ///
    /// # Errors
    /// [`RenderError::Picture`] when it is empty, larger than [`MAX_PICTURE_SIDE`], or the device refuses it or is lost;
    /// [`RenderError::Canceled`].
    pub fn make(&self, progress: &mut dyn FnMut(f32) -> bool) -> Result<Vec<u8>, RenderError> {
        let [width, height] = self.shot.view.size;
        let refused = |reason: &str| RenderError::Picture {
            width,
            height,
            reason: reason.to_owned(),
        };
        if !([width, height].iter().all(|side| (1..=MAX_PICTURE_SIDE).contains(side))) {
            return Err(refused("its sides must be 1 to 8192 pixels"));
        }
        let tiles = tiles(UVec2::new(width, height), self.max_tile_side);
        let mut rgba = vec![0; (width * height * COLOR_BYTES) as usize];
        let mut canvas: Option<Canvas> = None;
        for (done, (drawn, kept)) in tiles.iter().enumerate() {
            if !progress(done as f32 / tiles.len() as f32) {
                return Err(RenderError::Canceled);
            }
            let memory_scope = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
            let size = drawn.size.to_array();
            let canvas = match canvas.take() {
                Some(same) if same.targets().size == size => canvas.insert(same),
                _ => canvas.insert(Canvas::new(&self.device, &self.stage, size)),
            };
            canvas.draw(&self.device, &self.queue, &self.stage, &self.shot, *drawn, true);
            let from = kept.origin - drawn.origin;
            let picture = &canvas.targets().picture;
            let read_back = ReadBack::new(&self.device, &self.queue, picture, from, kept.size, COLOR_BYTES);
            if let Some(error) = pollster::block_on(memory_scope.pop()) {
                return Err(refused(&error.to_string()));
            }
            read_back.wait(&self.device);
            let mut at = (kept.origin.y * width + kept.origin.x) as usize * COLOR_BYTES as usize;
            let has_arrived = read_back.rows(|row| {
                rgba[at..at + row.len()].copy_from_slice(row);
                at += (width * COLOR_BYTES) as usize;
            });
            if !has_arrived {
                return Err(refused("the graphics device gave nothing back"));
            }
        }
        progress(1.0);
        Ok(rgba)
    }
}

/// The tiles of a picture: what is drawn, within `max_side`, and what is kept of it. Those kept cover the picture once.
fn tiles(size: UVec2, max_side: u32) -> Vec<(Tile, Tile)> {
    if size.max_element() <= max_side {
        let whole = Tile {
            origin: UVec2::ZERO,
            size,
        };
        return vec![(whole, whole)];
    }
    let step = max_side.saturating_sub(2 * MARGIN).max(1);
    let mut tiles = Vec::new();
    for y in (0..size.y).step_by(step as usize) {
        for x in (0..size.x).step_by(step as usize) {
            let origin = UVec2::new(x, y);
            let end = (origin + step).min(size);
            let drawn_origin = origin.saturating_sub(UVec2::splat(MARGIN));
            let drawn_end = (end + MARGIN).min(size);
            tiles.push((
                Tile {
                    origin: drawn_origin,
                    size: drawn_end - drawn_origin,
                },
                Tile {
                    origin,
                    size: end - origin,
                },
            ));
        }
    }
    tiles
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn tiles_cover_each_pixel_once_within_the_limit(w in 1_u32..700, h in 1_u32..700, max_side in 150_u32..800) {
            let size = UVec2::new(w, h);
            let mut covered = vec![0_u8; (w * h) as usize];
            for (drawn, kept) in tiles(size, max_side) {
                prop_assert!(drawn.size.max_element() <= max_side);
                prop_assert!(drawn.origin.cmple(kept.origin).all());
                prop_assert!((kept.origin + kept.size).cmple(drawn.origin + drawn.size).all());
                prop_assert!((drawn.origin + drawn.size).cmple(size).all());
                for y in kept.origin.y..kept.origin.y + kept.size.y {
                    for x in kept.origin.x..kept.origin.x + kept.size.x {
                        covered[(y * w + x) as usize] += 1;
                    }
                }
            }
            prop_assert!(covered.iter().all(|&n| n == 1));
        }
    }
}
