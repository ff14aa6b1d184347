//! Geometry pass of the spheres.

use egui_wgpu::wgpu;

use crate::pass::geometry_pipeline;
use crate::shader;

/// The pipeline of spheres: group 0 is the frame, which holds them.
pub fn pipeline(device: &wgpu::Device, frame_layout: &wgpu::BindGroupLayout) -> wgpu::RenderPipeline {
    let module = shader::SPHERE.module(device);
    geometry_pipeline(device, shader::SPHERE.name, &module, &[Some(frame_layout)])
}
