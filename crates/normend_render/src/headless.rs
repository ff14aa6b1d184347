//! A graphics device without a window, for pictures from the command line and for tests.

use egui_wgpu::wgpu;

use crate::error::RenderError;
use crate::renderer::SplatRenderer;

/// An adapter with its device and queue.
pub struct HeadlessDevice {
    /// The adapter.
    pub adapter: wgpu::Adapter,
    /// The device, with the adapter's own limits.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
}

impl HeadlessDevice {
    /// Opens the best adapter that can draw splats and be opened: graphics cards first, then software; OpenGL only where
    /// there is nothing else. The environment variable `WGPU_BACKEND` (`vulkan`, `gl`, …) restricts the choice.
    ///
    /// # Errors
    /// [`RenderError::NoAdapter`], [`RenderError::Unsupported`] or [`RenderError::Device`], in words for the user.
    pub fn new() -> Result<Self, RenderError> {
        match wgpu::Backends::from_env() {
            Some(backends) => Self::with_backends(backends),
            None => Self::with_backends(wgpu::Backends::PRIMARY)
                .or_else(|_| Self::with_backends(wgpu::Backends::PRIMARY | wgpu::Backends::GL)),
        }
    }

    /// Like [`Self::new`], with the given backends only.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_backends(backends: wgpu::Backends) -> Result<Self, RenderError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends,
            flags: wgpu::InstanceFlags::from_build_config().with_env(),
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let mut adapters = pollster::block_on(instance.enumerate_adapters(backends));
        adapters.sort_by_key(rank);
        let mut refused = None;
        for adapter in adapters {
            match SplatRenderer::check_adapter(&adapter).and_then(|()| Self::open(adapter)) {
                Ok(device) => return Ok(device),
                // A card whose driver is broken must not keep the software behind it from drawing.
                Err(error) => refused = refused.or(Some(error)),
            }
        }
        Err(refused.unwrap_or_else(|| RenderError::NoAdapter {
            reason: format!("looked for {}", names(backends)),
        }))
    }

    fn open(adapter: wgpu::Adapter) -> Result<Self, RenderError> {
        match pollster::block_on(adapter.request_device(&SplatRenderer::device_descriptor(&adapter))) {
            Ok((device, queue)) => Ok(Self { adapter, device, queue }),
            Err(error) => Err(RenderError::Device {
                adapter: adapter.get_info().name,
                reason: error.to_string(),
            }),
        }
    }
}

/// Real graphics cards before software, and Vulkan and its like before OpenGL.
fn rank(adapter: &wgpu::Adapter) -> (u32, u32) {
    let info = adapter.get_info();
    let device = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    };
    (device, u32::from(info.backend == wgpu::Backend::Gl))
}

fn names(backends: wgpu::Backends) -> String {
    let names: Vec<String> = backends.iter_names().map(|(name, _)| name.to_lowercase()).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_adapter_is_told_in_words_with_the_packages() {
        let Err(error) = HeadlessDevice::with_backends(wgpu::Backends::empty()) else {
            panic!("an adapter of nothing")
        };
        let message = error.to_string();
        assert!(
            message.contains("mesa-vulkan-drivers") && message.contains("libvulkan1"),
            "{message}"
        );
    }
}
