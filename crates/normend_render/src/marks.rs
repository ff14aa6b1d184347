//! What is drawn over the cloud: highlighted ranges and spheres, in small buffers that grow as needed.

use std::ops::Range;

use egui_wgpu::wgpu;
use glam::Vec3;

use crate::gpu_types::SphereMark;

/// A sphere of constant size on the screen, for a point that matters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Center, in world space.
    pub center: Vec3,
    /// Color as displayed.
    pub color: [f32; 3],
    /// Drawn larger, with a ring around it.
    pub selected: bool,
}

impl From<&Sphere> for SphereMark {
    fn from(sphere: &Sphere) -> Self {
        Self {
            center: sphere.center,
            selected: sphere.selected.into(),
            color: sphere.color.into(),
            pad_0: 0,
        }
    }
}

/// A storage buffer of `T` that is replaced by a larger one when its content outgrows it.
pub struct GrowingBuffer<T> {
    label: &'static str,
    buffer: wgpu::Buffer,
    capacity: usize,
    content: Vec<T>,
}

impl<T: bytemuck::Pod + PartialEq> GrowingBuffer<T> {
    /// An empty buffer with room for one element, because a binding must not be empty.
    pub fn new(device: &wgpu::Device, label: &'static str) -> Self {
        Self {
            label,
            buffer: Self::allocate(device, label, 1),
            capacity: 1,
            content: Vec::new(),
        }
    }

    fn allocate(device: &wgpu::Device, label: &'static str, capacity: usize) -> wgpu::Buffer {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: (capacity * size_of::<T>()) as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// The buffer to bind.
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// What is in it.
    pub fn content(&self) -> &[T] {
        &self.content
    }

    /// Elements in it.
    pub fn len(&self) -> u32 {
        self.content.len() as u32
    }

    /// Replaces the content. Past the adapter's limit the rest is left out with a warning: these are marks on a picture.
    pub fn set(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, mut content: Vec<T>) -> BufferChange {
        let limits = device.limits();
        let limit = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size) as usize / size_of::<T>();
        if content.len() > limit {
            tracing::warn!(
                "{} {} are more than the graphics adapter holds; {limit} are shown",
                content.len(),
                self.label
            );
            content.truncate(limit);
        }
        if content == self.content {
            return BufferChange::default();
        }
        let replaced = content.len() > self.capacity;
        if replaced {
            self.capacity = content.len().next_power_of_two().min(limit);
            self.buffer = Self::allocate(device, self.label, self.capacity);
        }
        let bytes = bytemuck::cast_slice(&content);
        if !bytes.is_empty() {
            queue.write_buffer(&self.buffer, 0, bytes);
        }
        let uploaded = bytes.len() as u64;
        self.content = content;
        BufferChange {
            changed: true,
            replaced,
            uploaded,
        }
    }
}

/// What [`GrowingBuffer::set`] did.
#[derive(Clone, Copy, Debug, Default)]
pub struct BufferChange {
    /// The content is another.
    pub changed: bool,
    /// The buffer is another: bind groups must be made anew.
    pub replaced: bool,
    /// Bytes uploaded.
    pub uploaded: u64,
}

/// Ranges that are empty are left out, so that the shader's search sees ascending starts.
pub fn highlight_words(ranges: &[Range<u32>]) -> Vec<[u32; 2]> {
    ranges
        .iter()
        .filter(|range| !range.is_empty())
        .map(|range| [range.start, range.end])
        .collect()
}
