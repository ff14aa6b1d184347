//! The passes of a picture: splats and spheres leave ids, depths and surfaces in [`Targets`]; shading makes colors of
//! them; hair is drawn over it all, hidden by the same depths.

mod hair;
pub mod shade;
mod sphere;
mod splat;

use egui_wgpu::wgpu;

use crate::pass::shade::ShadePass;

/// Id and clip-space depth of what is seen. Not the depth texture itself and not a float texture: the one cannot be
/// read on OpenGL, the other cannot be drawn to.
pub const SEEN_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
/// Packed normal with its cosine, and the center of what is seen.
pub const SURFACE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
/// Reversed depth: near 1, far 0.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Gamma-encoded colors, as egui takes them.
pub const PICTURE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// All pipelines, and the layouts of the bind groups that several of them share.
#[derive(Clone)]
pub struct Passes {
    /// Group 0 of every pass: frame, spheres, flags, look.
    pub frame_layout: wgpu::BindGroupLayout,
    /// Group 1 of the passes that go through points: a chunk of them.
    pub chunk_layout: wgpu::BindGroupLayout,
    /// Group 2 of the hair: what is seen.
    pub seen_layout: wgpu::BindGroupLayout,
    /// Discs.
    pub splat: wgpu::RenderPipeline,
    /// Spheres.
    pub sphere: wgpu::RenderPipeline,
    /// Colors.
    pub shade: ShadePass,
    /// Normals as lines.
    pub hair: wgpu::RenderPipeline,
}

impl Passes {
    /// Compiles everything.
    pub fn new(device: &wgpu::Device) -> Self {
        use wgpu::BufferBindingType::{Storage, Uniform};
        let storage = Storage { read_only: true };
        let chunk_layout = buffers(device, "chunk", wgpu::ShaderStages::VERTEX, &[Uniform, storage]);
        let frame_layout = buffers(
            device,
            "frame",
            wgpu::ShaderStages::VERTEX_FRAGMENT,
            &[Uniform, storage, storage, Uniform],
        );
        let seen_layout = hair::seen_layout(device);
        Self {
            splat: splat::pipeline(device, &frame_layout, &chunk_layout),
            sphere: sphere::pipeline(device, &frame_layout),
            shade: ShadePass::new(device, &frame_layout),
            hair: hair::pipeline(device, &frame_layout, &chunk_layout, &seen_layout),
            seen_layout,
            chunk_layout,
            frame_layout,
        }
    }
}

/// The textures of one picture size.
pub struct Targets {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Ids and depths.
    pub seen: wgpu::Texture,
    /// View of `seen`.
    pub seen_view: wgpu::TextureView,
    /// View of the surfaces.
    pub surface_view: wgpu::TextureView,
    /// View of the depth buffer.
    pub depth_view: wgpu::TextureView,
    /// The finished picture.
    pub picture: wgpu::Texture,
    /// View of `picture`.
    pub picture_view: wgpu::TextureView,
}

impl Targets {
    /// Textures of `size`, each side at least 1 and within the device's limits.
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Self {
        let texture = |label, format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width: size[0],
                    height: size[1],
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let (read, copy) = (wgpu::TextureUsages::TEXTURE_BINDING, wgpu::TextureUsages::COPY_SRC);
        let seen = texture("seen", SEEN_FORMAT, read | copy);
        let surface = texture("surfaces", SURFACE_FORMAT, read);
        let depth = texture("depth", DEPTH_FORMAT, wgpu::TextureUsages::empty());
        let picture = texture("picture", PICTURE_FORMAT, read | copy);
        let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self {
            size,
            seen_view: view(&seen),
            surface_view: view(&surface),
            depth_view: view(&depth),
            picture_view: view(&picture),
            seen,
            picture,
        }
    }

    /// Begins the geometry pass: everything cleared to background. `keeps_depth` for hair after it.
    pub fn begin_geometry<'a>(&self, encoder: &'a mut wgpu::CommandEncoder, keeps_depth: bool) -> wgpu::RenderPass<'a> {
        let cleared = |view| {
            Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("geometry"),
            color_attachments: &[cleared(&self.seen_view), cleared(&self.surface_view)],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth_view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: if keeps_depth {
                        wgpu::StoreOp::Store
                    } else {
                        wgpu::StoreOp::Discard
                    },
                }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        })
    }

    /// Begins the pass of the hair, over the finished picture.
    pub fn begin_hair<'a>(&self, encoder: &'a mut wgpu::CommandEncoder) -> wgpu::RenderPass<'a> {
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("hair"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.picture_view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Load,
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth_view,
                // Read only: a turn draws the hair anew before the depths of the same geometry.
                depth_ops: None,
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        })
    }
}

/// A pipeline that draws into the geometry targets.
fn geometry_pipeline(
    device: &wgpu::Device,
    label: &str,
    module: &wgpu::ShaderModule,
    layouts: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::RenderPipeline {
    let targets = [Some(SEEN_FORMAT.into()), Some(SURFACE_FORMAT.into())];
    depth_tested_pipeline(device, label, module, layouts, &targets, true)
}

/// A pipeline whose triangles nearer ones hide.
fn depth_tested_pipeline(
    device: &wgpu::Device,
    label: &str,
    module: &wgpu::ShaderModule,
    layouts: &[Option<&wgpu::BindGroupLayout>],
    targets: &[Option<wgpu::ColorTargetState>],
    writes_depth: bool,
) -> wgpu::RenderPipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: layouts,
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(writes_depth),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some("fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// The layout of a bind group of buffers, bound in this order.
fn buffers(
    device: &wgpu::Device,
    label: &str,
    visibility: wgpu::ShaderStages,
    types: &[wgpu::BufferBindingType],
) -> wgpu::BindGroupLayout {
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0_u32..)
        .zip(types)
        .map(|(binding, &ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: wgpu::BindingType::Buffer {
                ty,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &entries,
    })
}
