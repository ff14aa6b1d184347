//! Storage buffers that fit the adapter, or an error instead of a panic.

use egui_wgpu::wgpu;

/// The most bytes of one storage buffer that a shader of `device` reads.
pub fn binding_limit(device: &wgpu::Device) -> u64 {
    let limits = device.limits();
    limits.max_buffer_size.min(limits.max_storage_buffer_binding_size)
}

/// A buffer that holds `data`, which is not empty and of whole words; an error when the graphics memory is full.
///
/// Not by `create_buffer_init`, which panics then.
pub fn storage_buffer<T: bytemuck::Pod>(
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
