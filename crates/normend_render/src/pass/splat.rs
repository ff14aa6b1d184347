//! Geometry pass of the splats.

use egui_wgpu::wgpu;

use crate::pass::geometry_pipeline;
use crate::shader;

/// The pipeline of oriented discs: group 0 is the frame, group 1 a chunk of points.
pub fn pipeline(
    device: &wgpu::Device,
    frame_layout: &wgpu::BindGroupLayout,
    chunk_layout: &wgpu::BindGroupLayout,
) -> wgpu::RenderPipeline {
    let module = shader::SPLAT.module(device);
    geometry_pipeline(
        device,
        shader::SPLAT.name,
        &module,
        &[Some(frame_layout), Some(chunk_layout)],
    )
}
