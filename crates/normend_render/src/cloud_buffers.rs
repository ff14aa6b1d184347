//! The cloud on the GPU: points uploaded once in chunks below the adapter's limits, their bits by touched words, their
//! colors when something gives them.

use std::ops::Range;
use std::sync::Arc;

use egui_wgpu::wgpu;
use egui_wgpu::wgpu::util::DeviceExt as _;
use glam::Vec3;
use rayon::prelude::*;

use crate::camera::BoundingSphere;
use crate::error::RenderError;
use crate::flags::Flags;
use crate::gpu_types::{Chunk, MAX_SPLATS, Point};
use crate::storage::{binding_limit, storage_buffer};

/// Most points of a chunk: 64 MiB.
pub const MAX_CHUNK_POINTS: usize = 4 << 20;
/// Points that one task reduces; fixed, so that no result depends on the number of threads.
const BLOCK: usize = 1 << 16;

/// One chunk of points.
struct ChunkBuffers {
    bind_group: wgpu::BindGroup,
    first: u32,
    n_points: u32,
}

/// Colors on the GPU, RGBA8 with red in the lowest byte.
pub struct ColorBuffer {
    /// None for no colors at all, because a buffer must not be empty.
    buffer: Option<wgpu::Buffer>,
    len: u32,
}

impl ColorBuffer {
    /// Uploads `colors`.
    ///
    /// # Errors
    /// [`RenderError::TooManyPoints`], [`RenderError::BufferTooLarge`] and [`RenderError::OutOfMemory`].
    pub fn new(device: &wgpu::Device, colors: &[u32]) -> Result<Self, RenderError> {
        let n_points = colors.len();
        let (needed, limit) = (size_of_val(colors) as u64, binding_limit(device));
        if n_points > MAX_SPLATS {
            return Err(RenderError::TooManyPoints {
                n_points,
                limit: MAX_SPLATS,
            });
        }
        if needed > limit {
            return Err(RenderError::BufferTooLarge {
                what: "colors of the points",
                needed,
                limit,
            });
        }
        let out_of_memory = |error: wgpu::Error| RenderError::OutOfMemory {
            n_points,
            needed,
            reason: error.to_string(),
        };
        let buffer = match colors {
            [] => None,
            colors => Some(storage_buffer(device, "colors", colors).map_err(out_of_memory)?),
        };
        Ok(Self {
            buffer,
            len: n_points as u32,
        })
    }

    /// Bytes uploaded.
    pub fn n_bytes(&self) -> u64 {
        u64::from(self.len) * size_of::<u32>() as u64
    }
}

/// The points of a cloud: handles, so a clone is cheap and can be drawn in another thread.
#[derive(Clone)]
pub struct Chunks(Arc<[ChunkBuffers]>);

impl Chunks {
    /// Draws every `step`-th instance, in their order, with `vertices` vertices each.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, step: u32, vertices: u32) {
        for chunk in &*self.0 {
            let skipped = (step - chunk.first % step) % step;
            let n_drawn = chunk.n_points.saturating_sub(skipped).div_ceil(step);
            if n_drawn > 0 {
                pass.set_bind_group(1, &chunk.bind_group, &[]);
                pass.draw(0..vertices * n_drawn, 0..1);
            }
        }
    }
}

/// The cloud on the GPU.
pub struct CloudBuffers {
    chunks: Chunks,
    /// Signs and marks.
    pub flags: Flags,
    colors: Option<wgpu::Buffer>,
    n_points: u32,
    max_radius: f32,
    bounds: BoundingSphere,
}

/// The slices of a cloud, as `SplatRenderer::set_cloud` documents them.
#[derive(Clone, Copy)]
pub struct CloudSlices<'a> {
    /// World positions.
    pub positions: &'a [Vec3],
    /// Unit normals, one per position.
    pub normals: Option<&'a [Vec3]>,
    /// Radii, one per position.
    pub radii: &'a [f32],
    /// Instance to index.
    pub order: Option<&'a [u32]>,
}

impl CloudSlices<'_> {
    fn check(&self) -> Result<(), RenderError> {
        let expected = self.positions.len();
        if expected > MAX_SPLATS {
            return Err(RenderError::TooManyPoints {
                n_points: expected,
                limit: MAX_SPLATS,
            });
        }
        let lens = [
            ("normals of the points", self.normals.map(<[Vec3]>::len)),
            ("radii of the points", Some(self.radii.len())),
            ("order of the points", self.order.map(<[u32]>::len)),
        ];
        for (what, len) in lens {
            if let Some(found) = len.filter(|&len| len != expected) {
                return Err(RenderError::Mismatch { what, expected, found });
            }
        }
        let largest = self.order.and_then(|order| order.par_iter().max());
        match largest {
            Some(&largest) if largest as usize >= expected => Err(RenderError::Mismatch {
                what: "largest index in the order of the points, plus one",
                expected,
                found: largest as usize + 1,
            }),
            _ => Ok(()),
        }
    }

    /// The largest finite radius and the ball around all positions.
    fn extent(&self) -> (f32, BoundingSphere) {
        let max_radius = self
            .radii
            .par_iter()
            .copied()
            .filter(|r| r.is_finite())
            .reduce(|| 0.0, f32::max);
        let (min, max) = self
            .positions
            .par_chunks(BLOCK)
            .map(|block| block.iter().fold(EMPTY_BOX, |(min, max), &p| (min.min(p), max.max(p))))
            .reduce(|| EMPTY_BOX, |a, b| (a.0.min(b.0), a.1.max(b.1)));
        if !(min.is_finite() && max.is_finite()) {
            return (max_radius, BoundingSphere::default());
        }
        (max_radius, BoundingSphere::of_box(min, max))
    }

    /// Packs the instances of `range`.
    fn pack(&self, range: Range<usize>, max_radius: f32) -> Vec<Point> {
        range
            .into_par_iter()
            .map(|instance| {
                let index = self.order.map_or(instance, |order| order[instance] as usize);
                let normal = self.normals.map(|normals| normals[index]);
                Point::new(self.positions[index], normal, self.radii[index], max_radius)
            })
            .collect()
    }
}

const EMPTY_BOX: (Vec3, Vec3) = (Vec3::INFINITY, Vec3::NEG_INFINITY);

impl CloudBuffers {
    /// Uploads a cloud in chunks of at most `max_chunk_points`; all bits are 0, and there are no colors. Returns
    /// the bytes uploaded too.
    ///
    /// # Errors
    /// [`RenderError`] for slices that do not belong together and clouds past the adapter's limits.
    pub fn new(
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        cloud: CloudSlices<'_>,
        max_chunk_points: usize,
    ) -> Result<(Self, u64), RenderError> {
        cloud.check()?;
        let n_points = cloud.positions.len();
        let limit = binding_limit(device);
        let flags = Flags::new(device, n_points)?;
        let chunk_points = max_chunk_points.min((limit / size_of::<Point>() as u64) as usize);
        if chunk_points == 0 {
            return Err(RenderError::BufferTooLarge {
                what: "a single point",
                needed: size_of::<Point>() as u64,
                limit,
            });
        }

        let (max_radius, bounds) = cloud.extent();
        let n_chunks = n_points.div_ceil(chunk_points);
        let bytes = flags.n_bytes() + (n_points * size_of::<Point>() + n_chunks * size_of::<Chunk>()) as u64;
        let out_of_memory = |error: wgpu::Error| RenderError::OutOfMemory {
            n_points,
            needed: bytes,
            reason: error.to_string(),
        };
        let mut chunks = Vec::with_capacity(n_chunks);
        for first in (0..n_points).step_by(chunk_points) {
            let end = n_points.min(first + chunk_points);
            let packed = cloud.pack(first..end, max_radius);
            let points = storage_buffer(device, "points", &packed).map_err(out_of_memory)?;
            let uniform = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("chunk"),
                contents: bytemuck::bytes_of(&Chunk {
                    first: first as u32,
                    pad_0: 0,
                    pad_1: 0,
                    pad_2: 0,
                }),
                usage: wgpu::BufferUsages::UNIFORM,
            });
            let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("chunk"),
                layout,
                entries: &[
                    wgpu::BindGroupEntry {
                        binding: 0,
                        resource: uniform.as_entire_binding(),
                    },
                    wgpu::BindGroupEntry {
                        binding: 1,
                        resource: points.as_entire_binding(),
                    },
                ],
            });
            chunks.push(ChunkBuffers {
                bind_group,
                first: first as u32,
                n_points: (end - first) as u32,
            });
        }
        let buffers = Self {
            chunks: Chunks(chunks.into()),
            flags,
            colors: None,
            n_points: n_points as u32,
            max_radius,
            bounds,
        };
        Ok((buffers, bytes))
    }

    /// What is drawn.
    pub fn chunks(&self) -> &Chunks {
        &self.chunks
    }

    /// The colors of the instances, when something gave them.
    pub fn colors(&self) -> Option<&wgpu::Buffer> {
        self.colors.as_ref()
    }

    /// World radius of the largest splat.
    pub fn max_radius(&self) -> f32 {
        self.max_radius
    }

    /// The ball around all positions.
    pub fn bounds(&self) -> BoundingSphere {
        self.bounds
    }

    /// Gives every instance a color, or none.
    ///
    /// # Errors
    /// [`RenderError::Mismatch`]; there are no colors then.
    pub fn set_colors(&mut self, colors: Option<ColorBuffer>) -> Result<(), RenderError> {
        self.colors = None;
        let Some(colors) = colors else { return Ok(()) };
        if colors.len != self.n_points {
            return Err(RenderError::Mismatch {
                what: "colors of the points",
                expected: self.n_points as usize,
                found: colors.len as usize,
            });
        }
        self.colors = colors.buffer;
        Ok(())
    }

    /// Replaces the colors of the instances from `first` on, as many as there are; nothing without colors. Returns the
    /// bytes uploaded.
    pub fn update_colors(&self, queue: &wgpu::Queue, first: u32, colors: &[u32]) -> u64 {
        let Some(buffer) = &self.colors else { return 0 };
        let n = colors.len().min(self.n_points.saturating_sub(first) as usize);
        if n > 0 {
            queue.write_buffer(buffer, u64::from(first) * 4, bytemuck::cast_slice(&colors[..n]));
        }
        size_of_val(&colors[..n]) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_that_do_not_belong_together_are_refused() {
        let positions = [Vec3::ZERO; 3];
        let good = CloudSlices {
            positions: &positions,
            normals: None,
            radii: &[1.0; 3],
            order: None,
        };
        let check = |cloud: CloudSlices<'_>, expect: &str| {
            assert_eq!(cloud.check().unwrap_err().to_string(), expect);
        };
        assert!(good.check().is_ok());
        check(
            CloudSlices { radii: &[1.0], ..good },
            "radii of the points: expected 3, found 1",
        );
        check(
            CloudSlices {
                normals: Some(&[]),
                ..good
            },
            "normals of the points: expected 3, found 0",
        );
        check(
            CloudSlices {
                order: Some(&[0, 1]),
                ..good
            },
            "order of the points: expected 3, found 2",
        );
        check(
            CloudSlices {
                order: Some(&[0, 1, 3]),
                ..good
            },
            "largest index in the order of the points, plus one: expected 3, found 4",
        );
    }
}
