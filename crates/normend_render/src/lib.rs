//! Oriented disc splats on the GPU, camera and picking, from plain slices. Knows nothing of orientation.
//!
//! Points are drawn in the order of the slices ("instances"); the app gives them in the tree's preorder, so that what
//! an edit turns is a few ranges.

pub mod camera;
mod canvas;
mod cloud_buffers;
pub mod display_mode;
mod error;
mod flags;
mod gpu_types;
pub mod headless;
mod ids;
mod lens;
mod marks;
mod pass;
mod pick;
mod picture_maker;
mod read_back;
pub mod renderer;
mod shader;
mod storage;
mod uniforms;

#[cfg(test)]
mod picture_tests;

pub use camera::{BoundingSphere, Camera, Projection, StandardView, UpAxis};
pub use display_mode::{Clip, Compare, DisplayMode, DrawSettings, Hair, HairLen, Palette, Section};
/// The one wgpu of the workspace: the version that eframe draws with.
pub use egui_wgpu::wgpu;
pub use error::RenderError;
pub use headless::HeadlessDevice;
pub use ids::{IdsRequest, SeenIds};
pub use lens::Lens;
pub use marks::Sphere;
pub use pick::{Hit, PickRequest};
pub use picture_maker::{MAX_PICTURE_SIDE, PictureMaker};
pub use renderer::{CloudUploader, SplatRenderer, UploadedCloud, UploadedColors};
