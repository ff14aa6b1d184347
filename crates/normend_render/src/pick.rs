//! What is under a pixel: a small window of ids and depths, read back without blocking.
//!
//! A click must not fall through a gap between splats to a surface behind, and must hit what is meant at an edge. So
//! the nearest surface in the window wins; on it, the pixel closest to the one asked for.

use egui_wgpu::wgpu;
use glam::{UVec2, Vec2, Vec3};

use crate::Camera;
use crate::camera::BoundingSphere;
use crate::gpu_types::{ID_NONE, ID_SPHERE};
use crate::read_back::{ReadBack, SEEN_BYTES};

/// Pixels that the window reaches beyond the picked one, on each side.
const REACH: u32 = 4;
/// How deep a surface may fall from one pixel to another, in lengths of a pixel per pixel of their distance (seen at 68°
/// to the line of sight), and beyond that, for discs that overlap.
const STEEPEST: f32 = 2.5;
const STEP: f32 = 2.0;

/// What is under the pointer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hit {
    /// A splat: its instance (index in the uploaded slices) and the world point seen.
    Splat {
        /// Index in the uploaded slices.
        instance: u32,
        /// World point on the splat.
        point: Vec3,
    },
    /// A sphere: its index in the slice given to `set_spheres`.
    Sphere {
        /// Index.
        index: u32,
        /// World point on what is drawn, which floats in front of the center by about the sphere's diameter.
        point: Vec3,
    },
}

impl Hit {
    /// The world point seen.
    pub fn point(&self) -> Vec3 {
        match *self {
            Self::Splat { point, .. } | Self::Sphere { point, .. } => point,
        }
    }
}

/// How a picture was seen; turns its ids and depths into hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureView {
    /// Its camera.
    pub camera: Camera,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// What its depths span.
    pub scene: BoundingSphere,
}

impl PictureView {
    fn size(&self) -> Vec2 {
        UVec2::from(self.size).as_vec2()
    }

    /// Depth (world length along the view axis) of a clip-space depth.
    pub fn depths(&self) -> impl Fn(f32) -> f32 + use<> {
        let [a, b, c, d] = self.camera.depth_from_clip(self.scene).to_array();
        move |clip_z| (a + b * clip_z) / (c + d * clip_z)
    }

    /// The hit that `window` means: its first pixel is `origin`, its rows have `width` pixels of id and depth bits.
    fn hit(&self, window: &[[u32; 2]], width: u32, origin: UVec2, pixel: UVec2) -> Option<Hit> {
        let depth_of = self.depths();
        let seen: Vec<(u32, UVec2, f32)> = window
            .iter()
            .enumerate()
            .filter(|(_, [id, _])| *id != ID_NONE)
            .map(|(i, &[id, bits])| {
                let at = origin + UVec2::new(i as u32 % width, i as u32 / width);
                (id, at, depth_of(f32::from_bits(bits)))
            })
            .collect();
        // A pixel is on the nearest surface unless another lies before it by more than one surface could.
        let is_nearest = |&&(_, at, depth): &&(u32, UVec2, f32)| {
            let len = self.camera.pixel_len(depth, self.size());
            seen.iter().all(|&(_, other, nearer)| {
                let distance = at.as_vec2().distance(other.as_vec2());
                depth - nearer <= len * (STEEPEST * distance + STEP)
            })
        };
        let &(id, at, depth) = seen.iter().filter(is_nearest).min_by(|a, b| {
            let distance = |at: UVec2| at.as_ivec2().distance_squared(pixel.as_ivec2());
            distance(a.1).cmp(&distance(b.1)).then(a.2.total_cmp(&b.2))
        })?;
        let point = self.camera.unproject(at.as_vec2() + 0.5, depth, self.size());
        Some(match id & ID_SPHERE {
            0 => Hit::Splat {
                instance: id - 1,
                point,
            },
            _ => Hit::Sphere {
                index: id & !ID_SPHERE,
                point,
            },
        })
    }
}

/// A pick under way: the ids are on their way back from the GPU.
pub struct PickRequest {
    view: PictureView,
    pixel: UVec2,
    origin: UVec2,
    width: u32,
    read_back: ReadBack,
}

impl PickRequest {
    /// Copies the window around `pixel` (clamped to the picture) out of `seen`.
    pub(crate) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        seen: &wgpu::Texture,
        view: PictureView,
        pixel: [u32; 2],
    ) -> Self {
        let size = UVec2::from(view.size);
        let pixel = UVec2::from(pixel).min(size - 1);
        let origin = pixel.saturating_sub(UVec2::splat(REACH));
        let extent = (pixel + REACH + 1).min(size) - origin;
        Self {
            view,
            pixel,
            origin,
            width: extent.x,
            read_back: ReadBack::new(device, queue, seen, origin, extent, SEEN_BYTES),
        }
    }

    /// `None` while under way; then `Some(hit)`, where `hit` is `None` for background and for a lost device. Never
    /// blocks.
    pub fn poll(&mut self, device: &wgpu::Device) -> Option<Option<Hit>> {
        self.read_back.has_arrived(device).then(|| self.read())
    }

    /// Waits for the result; for tests and headless use.
    pub fn wait(self, device: &wgpu::Device) -> Option<Hit> {
        self.read_back.wait(device);
        self.read()
    }

    fn read(&self) -> Option<Hit> {
        self.view
            .hit(&self.read_back.pixels(), self.width, self.origin, self.pixel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::StandardView;

    const SIZE: [u32; 2] = [100, 100];

    fn view() -> PictureView {
        let scene = BoundingSphere {
            center: Vec3::ZERO,
            radius: 1.0,
        };
        PictureView {
            camera: Camera::framing(Vec3::splat(-1.0), Vec3::ONE, StandardView::Front, 1.0),
            size: SIZE,
            scene,
        }
    }

    /// Clip-space depth bits of a depth that lies `pixels` pixel lengths behind the pivot.
    fn bits_behind(view: &PictureView, pixels: f32) -> u32 {
        let depth = view.camera.distance + pixels * view.camera.pixel_len_at_pivot(view.size());
        let (near, _) = view.camera.depth_range(view.scene);
        (near / depth).to_bits()
    }

    /// A 3×3 window around pixel (50, 50): each cell is an id and how deep it is.
    fn check(cells: [(u32, f32); 9], expect: Option<u32>) {
        let view = view();
        let window = cells.map(|(id, pixels)| [id, bits_behind(&view, pixels)]);
        let hit = view.hit(&window, 3, UVec2::splat(49), UVec2::splat(50));
        let instance = hit.map(|hit| match hit {
            Hit::Splat { instance, .. } => instance,
            Hit::Sphere { index, .. } => index + 1000,
        });
        assert_eq!(instance, expect);
    }

    #[test]
    fn the_nearest_surface_wins_and_on_it_the_closest_pixel() {
        const NONE: (u32, f32) = (ID_NONE, 0.0);
        check([NONE; 9], None);
        let mut cells = [NONE; 9];
        cells[0] = (7, 5.0);
        check(cells, Some(6));
        // The back surface in the middle is seen through a gap.
        cells[4] = (9, 50.0);
        check(cells, Some(6));
        // On one surface, the middle wins although a neighbor is a little nearer.
        cells[4] = (9, 7.0);
        check(cells, Some(8));
        cells[4] = (ID_SPHERE | 3, 4.0);
        check(cells, Some(1003));
    }

    #[test]
    fn the_point_is_where_the_pixel_and_its_depth_say() {
        let view = view();
        let window = [[5, bits_behind(&view, 3.0)]];
        let hit = view.hit(&window, 1, UVec2::new(50, 50), UVec2::new(50, 50)).unwrap();
        let len = view.camera.pixel_len_at_pivot(view.size());
        let expect = Vec3::new(0.5 * len, 3.0 * len, -0.5 * len);
        assert!(
            hit.point().distance(expect) < 0.1 * len,
            "{} instead of {expect}",
            hit.point()
        );
    }
}
