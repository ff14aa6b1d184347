//! [`SplatRenderer`]: uploads, draws when something changed, picks.

use std::ops::Range;

use egui_wgpu::wgpu;
use glam::Vec3;

use crate::{Camera, DisplayMode};

/// What cannot be drawn, in words.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A buffer past the adapter's limits.
    #[error("{what} needs {needed} bytes in one buffer; this graphics adapter allows {limit}")]
    BufferTooLarge {
        /// What for.
        what: &'static str,
        /// Bytes asked for.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
    },
    // more: no adapter, device lost, …
}

/// Front and back colors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Palette {
    /// Front side, linear RGB in 0..=1 (gamma-encoded as displayed).
    pub front: [f32; 3],
    /// Back side.
    pub back: [f32; 3],
    /// Behind everything.
    pub background: [f32; 3],
    /// Mixed into the hovered region.
    pub highlight: [f32; 3],
}

/// How the next picture is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawSettings {
    /// Coloring.
    pub mode: DisplayMode,
    /// Colors.
    pub palette: Palette,
    /// Factor on all splat radii.
    pub splat_scale: f32,
    /// 1 draws every point; s draws each s-th with radii grown by √s, for a quick picture while the camera moves.
    pub stride: u32,
}

/// A sphere in the view, picked before splats at the same depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Center, in world space.
    pub center: Vec3,
    /// Color as displayed.
    pub color: [f32; 3],
    /// Drawn with a ring around it.
    pub selected: bool,
}

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
        /// World point.
        point: Vec3,
    },
}

/// A pick under way: the ids are on their way back from the GPU.
pub struct PickRequest {}

impl PickRequest {
    /// `None` while under way; then `Some(hit)`, where `hit` is `None` for background. Never blocks.
    pub fn poll(&mut self, device: &wgpu::Device) -> Option<Option<Hit>> {
        let _ = device;
        unimplemented!()
    }

    /// Waits for the result; for tests and headless use.
    pub fn wait(self, device: &wgpu::Device) -> Option<Hit> {
        let _ = device;
        unimplemented!()
    }
}

/// Draws a cloud of oriented disc splats into its own texture.
pub struct SplatRenderer {}

impl SplatRenderer {
    /// The device that this renderer needs: the adapter's own limits, so that big buffers are allowed.
    pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
        let _ = adapter;
        unimplemented!()
    }

    /// Pipelines for `device`, no cloud.
    pub fn new(device: &wgpu::Device) -> Self {
        let _ = device;
        unimplemented!()
    }

    /// Uploads a cloud. `normals` may be absent (points just read): then splats face the camera.
    /// `order` gives instance → index in `positions`, `normals`, `radii`; absent: as they are. All states become 0.
    ///
    /// # Errors
    /// [`RenderError::BufferTooLarge`]; the renderer then draws no cloud.
    pub fn set_cloud(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        positions: &[Vec3],
        normals: Option<&[Vec3]>,
        radii: &[f32],
        order: Option<&[u32]>,
    ) -> Result<(), RenderError> {
        let _ = (device, queue, positions, normals, radii, order);
        unimplemented!()
    }

    /// Draws no cloud from now on.
    pub fn clear_cloud(&mut self) {
        unimplemented!()
    }

    /// Toggles the sign of `ranges` of instances: uploads their state words only.
    pub fn turn(&mut self, queue: &wgpu::Queue, ranges: &[Range<u32>]) {
        let _ = (queue, ranges);
        unimplemented!()
    }

    /// Sets all signs from a bit per instance (words of 32, lowest first).
    pub fn set_turned(&mut self, queue: &wgpu::Queue, words: &[u32]) {
        let _ = (queue, words);
        unimplemented!()
    }

    /// Highlights `ranges` of instances (ascending, disjoint); empty for none. Uploads the ranges only.
    pub fn set_highlight(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, ranges: &[Range<u32>]) {
        let _ = (device, queue, ranges);
        unimplemented!()
    }

    /// The spheres to draw, in the order that [`Hit::Sphere`] counts.
    pub fn set_spheres(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, spheres: &[Sphere]) {
        let _ = (device, queue, spheres);
        unimplemented!()
    }

    /// Draws if anything changed since the last call (camera, size, settings, states, highlight, spheres); says whether it did.
    /// `size` in physical pixels; `pixels_per_point` scales lines and spheres.
    #[expect(clippy::too_many_arguments, reason = "a picture depends on all of these")]
    pub fn draw(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        camera: &Camera,
        size: [u32; 2],
        pixels_per_point: f32,
        settings: &DrawSettings,
    ) -> bool {
        let _ = (device, queue, camera, size, pixels_per_point, settings);
        unimplemented!()
    }

    /// The picture of the last [`Self::draw`] (`Rgba8Unorm`, gamma-encoded), with a number that changes with the texture.
    pub fn picture(&self) -> Option<(&wgpu::TextureView, u64)> {
        unimplemented!()
    }

    /// Reads back what the last picture shows at `pixel` (from the top left): the nearest in a small window wins, so a click never falls
    /// through a gap to the back.
    pub fn pick(&self, device: &wgpu::Device, queue: &wgpu::Queue, pixel: [u32; 2]) -> Option<PickRequest> {
        let _ = (device, queue, pixel);
        unimplemented!()
    }

    /// Reads the picture back as RGBA rows from the top; for screenshots and tests. Blocks.
    pub fn read_picture(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Option<([u32; 2], Vec<u8>)> {
        let _ = (device, queue);
        unimplemented!()
    }
}
