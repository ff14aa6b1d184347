//! Pixels on their way back from the GPU.

use std::sync::{Arc, OnceLock};

use egui_wgpu::wgpu;
use glam::UVec2;

/// Bytes of a pixel of ids and depths.
pub const SEEN_BYTES: u32 = 8;
/// Bytes of a pixel of the picture.
pub const COLOR_BYTES: u32 = 4;

/// A rectangle of a texture that is being copied to the CPU.
pub struct ReadBack {
    extent: UVec2,
    pixel_bytes: u32,
    row_bytes: u32,
    buffer: wgpu::Buffer,
    /// Set when the copy has ended: whether it can be read.
    arrived: Arc<OnceLock<bool>>,
}

impl ReadBack {
    /// Starts to copy `extent` pixels of `pixel_bytes` from `origin` on; the rectangle is not empty and lies within the
    /// texture.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        texture: &wgpu::Texture,
        origin: UVec2,
        extent: UVec2,
        pixel_bytes: u32,
    ) -> Self {
        let row_bytes = (extent.x * pixel_bytes).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: u64::from(row_bytes) * u64::from(extent.y),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("read back"),
        });
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d {
                    x: origin.x,
                    y: origin.y,
                    z: 0,
                },
                ..texture.as_image_copy()
            },
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes),
                    rows_per_image: None,
                },
            },
            wgpu::Extent3d {
                width: extent.x,
                height: extent.y,
                depth_or_array_layers: 1,
            },
        );
        queue.submit([encoder.finish()]);
        let arrived = Arc::new(OnceLock::new());
        let arrival = Arc::clone(&arrived);
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // A second arrival cannot happen, and the first one counts.
            let _ = arrival.set(result.is_ok());
        });
        Self {
            extent,
            pixel_bytes,
            row_bytes,
            buffer,
            arrived,
        }
    }

    /// Whether the copy has ended, well or not. Never blocks.
    pub fn has_arrived(&self, device: &wgpu::Device) -> bool {
        if let Err(error) = device.poll(wgpu::PollType::Poll) {
            tracing::debug!("polling the graphics device: {error}");
        }
        self.arrived.get().is_some()
    }

    /// Blocks until the copy has ended.
    pub fn wait(&self, device: &wgpu::Device) {
        if let Err(error) = device.poll(wgpu::PollType::wait_indefinitely()) {
            tracing::debug!("waiting for the graphics device: {error}");
        }
    }

    /// Gives each row of pixels, from the top, to `take`. `false`, without a row, when the copy is under way and when
    /// the device is lost.
    pub fn rows(&self, mut take: impl FnMut(&[u8])) -> bool {
        if self.arrived.get() != Some(&true) {
            return false;
        }
        let Ok(bytes) = self.buffer.get_mapped_range(..) else {
            return false;
        };
        for row in bytes.chunks(self.row_bytes as usize) {
            take(&row[..(self.extent.x * self.pixel_bytes) as usize]);
        }
        true
    }

    /// All pixels, row by row; empty where [`Self::rows`] gives none.
    pub fn pixels<T: bytemuck::Pod>(&self) -> Vec<T> {
        let mut pixels = Vec::with_capacity((self.extent.x * self.extent.y) as usize);
        self.rows(|row| {
            pixels.extend(
                row.chunks_exact(self.pixel_bytes as usize)
                    .map(bytemuck::pod_read_unaligned::<T>),
            );
        });
        pixels
    }
}
