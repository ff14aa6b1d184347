//! Pass of the hair, over the finished picture.

use egui_wgpu::wgpu;

use crate::pass::{PICTURE_FORMAT, depth_tested_pipeline};
use crate::shader;

/// The pipeline of lines: group 0 is the frame, group 1 a chunk of points. It reads depths and leaves them.
pub fn pipeline(
    device: &wgpu::Device,
    frame_layout: &wgpu::BindGroupLayout,
    chunk_layout: &wgpu::BindGroupLayout,
) -> wgpu::RenderPipeline {
    let module = shader::HAIR.module(device);
    depth_tested_pipeline(
        device,
        shader::HAIR.name,
        &module,
        &[Some(frame_layout), Some(chunk_layout)],
        &[Some(PICTURE_FORMAT.into())],
        false,
    )
}
