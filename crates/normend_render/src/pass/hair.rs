//! Pass of the hair, over the finished picture.

use egui_wgpu::wgpu;

use crate::pass::{PICTURE_FORMAT, depth_tested_pipeline};
use crate::shader;

/// The layout of group 2: what is seen.
pub fn seen_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("hair"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Uint,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        }],
    })
}

/// The pipeline of lines: group 0 is the frame, group 1 a chunk of points, group 2 what is seen. It reads depths and
/// leaves them.
pub fn pipeline(
    device: &wgpu::Device,
    frame_layout: &wgpu::BindGroupLayout,
    chunk_layout: &wgpu::BindGroupLayout,
    seen_layout: &wgpu::BindGroupLayout,
) -> wgpu::RenderPipeline {
    let module = shader::HAIR.module(device);
    depth_tested_pipeline(
        device,
        shader::HAIR.name,
        &module,
        &[Some(frame_layout), Some(chunk_layout), Some(seen_layout)],
        &[Some(PICTURE_FORMAT.into())],
        false,
    )
}
