//! Oriented disc splats on the GPU, camera and picking, from plain slices. Knows nothing of orientation.
//!
//! Points are drawn in the order of the slices ("instances"); the app gives them in the tree's preorder, so that what
//! an edit turns is a few ranges.

pub mod camera;
pub mod display_mode;
pub mod renderer;

pub use camera::{Camera, Projection, StandardView};
pub use display_mode::DisplayMode;
/// The one wgpu of the workspace: the version that eframe draws with.
pub use egui_wgpu::wgpu;
pub use renderer::{DrawSettings, Hit, Palette, PickRequest, RenderError, Sphere, SplatRenderer};
