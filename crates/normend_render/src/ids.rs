//! What is seen in a rectangle: ids and depths, read back without blocking. Masks of brush, lasso and rectangle are laid
//! over these, so they select what is seen and nothing else.

use egui_wgpu::wgpu;
use glam::UVec2;

use crate::gpu_types::{ID_NONE, ID_SPHERE};
use crate::pick::PictureView;
use crate::read_back::{ReadBack, SEEN_BYTES};

/// What is seen in a rectangle of a picture, row by row from its top.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenIds {
    /// Its first pixel, counted from the top left of the picture.
    pub min: [u32; 2],
    /// Its width and height in pixels; smaller than asked for at the edges of the picture.
    pub size: [u32; 2],
    /// The instance at each pixel; [`Self::NONE`] for background and spheres.
    pub instances: Vec<u32>,
    /// Its depth at each pixel: world length from the eye along the view axis; infinite where there is none.
    pub depths: Vec<f32>,
}

impl SeenIds {
    /// No instance.
    pub const NONE: u32 = u32::MAX;

    /// The instance at a pixel of the picture, if it is in the rectangle and one is seen there.
    pub fn at(&self, [x, y]: [u32; 2]) -> Option<u32> {
        let (x, y) = (x.checked_sub(self.min[0])?, y.checked_sub(self.min[1])?);
        if x >= self.size[0] || y >= self.size[1] {
            return None;
        }
        let instance = self.instances[y as usize * self.size[0] as usize + x as usize];
        (instance != Self::NONE).then_some(instance)
    }
}

/// Ids of a rectangle on their way back from the GPU.
pub struct IdsRequest {
    view: PictureView,
    min: UVec2,
    extent: UVec2,
    read_back: ReadBack,
}

impl IdsRequest {
    /// Copies the rectangle, brought within the picture, out of `seen`; `None` when nothing is left of it.
    pub(crate) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        seen: &wgpu::Texture,
        view: PictureView,
        min: [u32; 2],
        size: [u32; 2],
    ) -> Option<Self> {
        let whole = UVec2::from(view.size);
        let min = UVec2::from(min).min(whole);
        let extent = UVec2::from(size).min(whole - min);
        if extent.min_element() == 0 {
            return None;
        }
        Some(Self {
            view,
            min,
            extent,
            read_back: ReadBack::new(device, queue, seen, min, extent, SEEN_BYTES),
        })
    }

    /// `None` while under way; then what is seen, which is nothing at all when the device is lost. Never blocks. O(pixels)
    /// when it arrives.
    pub fn poll(&mut self, device: &wgpu::Device) -> Option<SeenIds> {
        self.read_back.has_arrived(device).then(|| self.read())
    }

    /// Waits for the result; for tests and headless use.
    pub fn wait(self, device: &wgpu::Device) -> SeenIds {
        self.read_back.wait(device);
        self.read()
    }

    fn read(&self) -> SeenIds {
        let mut pixels: Vec<[u32; 2]> = self.read_back.pixels();
        pixels.resize((self.extent.x * self.extent.y) as usize, [ID_NONE, 0]);
        let depth_of = self.view.depths();
        let (instances, depths) = pixels
            .iter()
            .map(|&[id, bits]| {
                if id == ID_NONE || id & ID_SPHERE != 0 {
                    (SeenIds::NONE, f32::INFINITY)
                } else {
                    (id - 1, depth_of(f32::from_bits(bits)))
                }
            })
            .unzip();
        SeenIds {
            min: self.min.into(),
            size: self.extent.into(),
            instances,
            depths,
        }
    }
}
