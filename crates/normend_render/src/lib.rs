//! Oriented disc splats on the GPU, camera and picking, from plain slices. Knows nothing of orientation.
//!
//! Points are drawn in the order of the slices ("instances"); the app gives them in the tree's preorder, so that what
//! an edit turns is a few ranges.

pub mod camera;
mod cloud_buffers;
pub mod display_mode;
mod error;
mod gpu_types;
pub mod headless;
mod marks;
mod pass;
mod pick;
pub mod renderer;
mod shader;

#[cfg(test)]
mod picture_tests;

pub use camera::{BoundingSphere, Camera, Projection, StandardView, UpAxis};
pub use display_mode::{DisplayMode, DrawSettings, Palette};
/// The one wgpu of the workspace: the version that eframe draws with.
pub use egui_wgpu::wgpu;
pub use error::RenderError;
pub use headless::HeadlessDevice;
pub use marks::Sphere;
pub use pick::{Hit, PickRequest};
pub use renderer::{CloudUploader, SplatRenderer, UploadedCloud};
