//! [`Stage`], all on the GPU that pictures are drawn from, and [`Canvas`], the textures that one is drawn into.

use egui_wgpu::wgpu;

use crate::cloud_buffers::Chunks;
use crate::gpu_types::{Frame, Look};
use crate::pass::{Passes, Targets};
use crate::uniforms::{Has, Shot, Tile};

/// What pictures are drawn from. Handles only: a clone is cheap, and draws in another thread too.
#[derive(Clone)]
pub struct Stage {
    /// Pipelines and layouts.
    pub passes: Passes,
    /// The points, if there are any.
    pub chunks: Option<Chunks>,
    /// World radius of the largest splat.
    pub max_radius: f32,
    /// Planes of bits.
    pub flags: wgpu::Buffer,
    /// Words of each plane.
    pub plane_words: u32,
    /// RGBA8 of each instance; anything when there are none.
    pub colors: wgpu::Buffer,
    /// Ranges.
    pub highlights: wgpu::Buffer,
    /// Spheres.
    pub spheres: wgpu::Buffer,
    /// How many.
    pub n_spheres: u32,
    /// What there is of the rest.
    pub has: Has,
}

/// Textures, uniforms, and what binds them to a stage.
pub struct Canvas {
    targets: Targets,
    frame_buffer: wgpu::Buffer,
    look_buffer: wgpu::Buffer,
    frame_group: wgpu::BindGroup,
    shade_group: wgpu::BindGroup,
    seen_group: wgpu::BindGroup,
}

impl Canvas {
    /// A canvas of `size` pixels, each side at least 1 and within the device's limits, for pictures of `stage`.
    pub fn new(device: &wgpu::Device, stage: &Stage, size: [u32; 2]) -> Self {
        let uniform = |label, size: usize| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let targets = Targets::new(device, size);
        let frame_buffer = uniform("frame", size_of::<Frame>());
        let look_buffer = uniform("look", size_of::<Look>());
        let (frame_group, shade_group) = stage.bind(device, &targets, &frame_buffer, &look_buffer);
        let seen_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("hair"),
            layout: &stage.passes.seen_layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&targets.seen_view),
            }],
        });
        Self {
            targets,
            frame_buffer,
            look_buffer,
            frame_group,
            shade_group,
            seen_group,
        }
    }

    /// Binds the buffers of `stage` anew, after some were replaced.
    pub fn bind(&mut self, device: &wgpu::Device, stage: &Stage) {
        (self.frame_group, self.shade_group) = stage.bind(device, &self.targets, &self.frame_buffer, &self.look_buffer);
    }

    /// The textures.
    pub fn targets(&self) -> &Targets {
        &self.targets
    }

    /// Draws `tile` of the picture that `shot` tells, which has this canvas' size. Without `geometry` only colors and
    /// hair are drawn anew.
    pub fn draw(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        stage: &Stage,
        shot: &Shot,
        tile: Tile,
        geometry: bool,
    ) {
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("picture") });
        let hair_step = shot.hair_step();
        if geometry {
            let frame = shot.frame(tile, stage.max_radius, stage.plane_words);
            queue.write_buffer(&self.frame_buffer, 0, bytemuck::bytes_of(&frame));
            let mut pass = self.targets.begin_geometry(&mut encoder, hair_step.is_some());
            pass.set_bind_group(0, &self.frame_group, &[]);
            if let Some(chunks) = &stage.chunks {
                pass.set_pipeline(&stage.passes.splat);
                chunks.draw(&mut pass, shot.stride(), 3);
            }
            if shot.settings.spheres && stage.n_spheres > 0 {
                pass.set_pipeline(&stage.passes.sphere);
                pass.draw(0..3 * stage.n_spheres, 0..1);
            }
        }
        let look = shot.look(stage.has);
        queue.write_buffer(&self.look_buffer, 0, bytemuck::bytes_of(&look));
        stage
            .passes
            .shade
            .draw(&mut encoder, &self.targets, &self.frame_group, &self.shade_group);
        if let (Some(step), Some(chunks)) = (hair_step, &stage.chunks) {
            let mut pass = self.targets.begin_hair(&mut encoder);
            pass.set_pipeline(&stage.passes.hair);
            pass.set_bind_group(0, &self.frame_group, &[]);
            pass.set_bind_group(2, &self.seen_group, &[]);
            chunks.draw(&mut pass, step, 6);
        }
        queue.submit([encoder.finish()]);
    }
}

impl Stage {
    fn bind(
        &self,
        device: &wgpu::Device,
        targets: &Targets,
        frame: &wgpu::Buffer,
        look: &wgpu::Buffer,
    ) -> (wgpu::BindGroup, wgpu::BindGroup) {
        let buffers = [frame, &self.spheres, &self.flags, look];
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0_u32..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let frame_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("frame"),
            layout: &self.passes.frame_layout,
            entries: &entries,
        });
        let shade_group = self.passes.shade.bind(device, targets, &self.highlights, &self.colors);
        (frame_group, shade_group)
    }
}
