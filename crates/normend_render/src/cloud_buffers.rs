//! The cloud on the GPU: points uploaded once in chunks below the adapter's limits, signs by touched words.
//!
//! Invariant: `turned` mirrors the GPU's sign bits, so a turn uploads words without reading anything back.

use std::ops::Range;

use egui_wgpu::wgpu;
use egui_wgpu::wgpu::util::DeviceExt as _;
use glam::Vec3;
use rayon::prelude::*;

use crate::camera::BoundingSphere;
use crate::error::RenderError;
use crate::gpu_types::{Chunk, MAX_SPLATS, Point};

/// Most points of a chunk: 64 MiB.
pub const MAX_CHUNK_POINTS: usize = 4 << 20;
/// Touched words closer than this are uploaded together: a kilobyte costs less than another upload.
const MERGE_WORDS: u32 = 256;
/// Points that one task reduces; fixed, so that no result depends on the number of threads.
const BLOCK: usize = 1 << 16;

/// One chunk of points.
struct ChunkBuffers {
    bind_group: wgpu::BindGroup,
    first: u32,
    n_points: u32,
}

/// The cloud on the GPU, with the mirror of its signs.
pub struct CloudBuffers {
    chunks: Vec<ChunkBuffers>,
    turned: Vec<u32>,
    turned_buffer: wgpu::Buffer,
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
    /// Uploads a cloud in chunks of at most `max_chunk_points`; all signs are 0. Returns the bytes uploaded too.
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
        let limits = device.limits();
        let limit = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size);
        let turned = vec![0_u32; n_points.div_ceil(32).max(1)];
        let needed = size_of_val(turned.as_slice()) as u64;
        if needed > limit {
            return Err(RenderError::BufferTooLarge {
                what: "signs of the points",
                needed,
                limit,
            });
        }
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
        let bytes = needed + (n_points * size_of::<Point>() + n_chunks * size_of::<Chunk>()) as u64;
        let out_of_memory = |error: wgpu::Error| RenderError::OutOfMemory {
            n_points,
            needed: bytes,
            reason: error.to_string(),
        };
        let turned_buffer = storage_buffer(device, "signs", &turned).map_err(out_of_memory)?;
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
            chunks,
            turned,
            turned_buffer,
            n_points: n_points as u32,
            max_radius,
            bounds,
        };
        Ok((buffers, bytes))
    }

    /// The sign bits on the GPU.
    pub fn turned_buffer(&self) -> &wgpu::Buffer {
        &self.turned_buffer
    }

    /// World radius of the largest splat.
    pub fn max_radius(&self) -> f32 {
        self.max_radius
    }

    /// The ball around all positions.
    pub fn bounds(&self) -> BoundingSphere {
        self.bounds
    }

    /// Draws every `stride`-th splat: three vertices each, in the order of the instances.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, stride: u32) {
        for chunk in &self.chunks {
            let skipped = (stride - chunk.first % stride) % stride;
            let n_drawn = chunk.n_points.saturating_sub(skipped).div_ceil(stride);
            if n_drawn > 0 {
                pass.set_bind_group(1, &chunk.bind_group, &[]);
                pass.draw(0..3 * n_drawn, 0..1);
            }
        }
    }

    /// Toggles the signs of `ranges` and uploads the words that they touch; returns the bytes uploaded.
    pub fn turn(&mut self, queue: &wgpu::Queue, ranges: &[Range<u32>]) -> u64 {
        let mut touched: Vec<Range<u32>> = Vec::with_capacity(ranges.len());
        for range in ranges {
            let range = range.start..range.end.min(self.n_points);
            if range.start < range.end {
                toggle(&mut self.turned, range.clone());
                touched.push(range.start / 32..(range.end - 1) / 32 + 1);
            }
        }
        touched.sort_unstable_by_key(|words| words.start);
        let mut uploaded = 0;
        for words in merge(&touched, MERGE_WORDS) {
            let slice = &self.turned[words.start as usize..words.end as usize];
            queue.write_buffer(
                &self.turned_buffer,
                u64::from(words.start) * 4,
                bytemuck::cast_slice(slice),
            );
            uploaded += size_of_val(slice) as u64;
        }
        uploaded
    }

    /// Sets all signs; words that are missing are 0. Returns the bytes uploaded.
    pub fn set_turned(&mut self, queue: &wgpu::Queue, words: &[u32]) -> u64 {
        let n = words.len().min(self.turned.len());
        self.turned[..n].copy_from_slice(&words[..n]);
        self.turned[n..].fill(0);
        queue.write_buffer(&self.turned_buffer, 0, bytemuck::cast_slice(&self.turned));
        size_of_val(self.turned.as_slice()) as u64
    }
}

/// A buffer that holds `data`, which is not empty and of whole words; an error when the graphics memory is full.
///
/// Not by `create_buffer_init`, which panics then.
fn storage_buffer<T: bytemuck::Pod>(
    device: &wgpu::Device,
    label: &str,
    data: &[T],
) -> Result<wgpu::Buffer, wgpu::Error> {
    let bytes: &[u8] = bytemuck::cast_slice(data);
    let memory_scope = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.len() as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: true,
    });
    if let Some(error) = pollster::block_on(memory_scope.pop()) {
        return Err(error);
    }
    // Only a lost device gives no range, and then there is nothing to write to.
    if let Ok(mut mapped) = buffer.get_mapped_range_mut(..) {
        mapped.slice(..).copy_from_slice(bytes);
        drop(mapped);
        buffer.unmap();
    }
    Ok(buffer)
}

/// Flips the bits of a range that is not empty and lies within `words`.
fn toggle(words: &mut [u32], range: Range<u32>) {
    let (first, last) = ((range.start / 32) as usize, ((range.end - 1) / 32) as usize);
    let head = u32::MAX << (range.start % 32);
    let tail = u32::MAX >> (31 - (range.end - 1) % 32);
    if first == last {
        words[first] ^= head & tail;
        return;
    }
    words[first] ^= head;
    for word in &mut words[first + 1..last] {
        *word = !*word;
    }
    words[last] ^= tail;
}

/// Joins ranges, sorted by start, that are less than `gap` apart.
fn merge(sorted: &[Range<u32>], gap: u32) -> Vec<Range<u32>> {
    let mut merged: Vec<Range<u32>> = Vec::new();
    for range in sorted {
        match merged.last_mut() {
            Some(last) if range.start <= last.end.saturating_add(gap) => last.end = last.end.max(range.end),
            _ => merged.push(range.clone()),
        }
    }
    merged
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn toggle_flips_the_bits_of_the_range_alone(start in 0_u32..200, len in 1_u32..200) {
            let range = start..(start + len).min(256);
            prop_assume!(!range.is_empty());
            let mut words = [0x5a5a_1234_u32; 8];
            toggle(&mut words, range.clone());
            for bit in 0..256 {
                let was = 0x5a5a_1234_u32 >> (bit % 32) & 1 == 1;
                let is = words[bit as usize / 32] >> (bit % 32) & 1 == 1;
                prop_assert_eq!(is != was, range.contains(&bit), "bit {}", bit);
            }
        }
    }

    #[test]
    fn merge_joins_what_is_near() {
        let check = |input: &[Range<u32>], expect: &[Range<u32>]| assert_eq!(merge(input, 10), expect);
        check(&[], &[]);
        check(&[0..3, 5..6, 17..18], &[0..6, 17..18]);
        check(&[0..30, 5..6, 50..60], &[0..30, 50..60]);
        check(&[0..1, 11..12, 23..24], &[0..12, 23..24]);
    }

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
