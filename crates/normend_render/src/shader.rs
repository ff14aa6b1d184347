//! Every shader: the only place that includes WGSL. `common.wgsl` comes first in each, then `points.wgsl` in those that go
//! through points.

use egui_wgpu::wgpu;

/// One shader: its name and its full source.
pub struct Shader {
    /// Name in messages.
    pub name: &'static str,
    /// WGSL.
    pub source: &'static str,
}

/// Oriented discs.
pub const SPLAT: Shader = Shader {
    name: "splat",
    source: concat!(
        include_str!("../../../shaders/common.wgsl"),
        include_str!("../../../shaders/points.wgsl"),
        include_str!("../../../shaders/splat.wgsl")
    ),
};
/// Spheres.
pub const SPHERE: Shader = Shader {
    name: "sphere",
    source: concat!(
        include_str!("../../../shaders/common.wgsl"),
        include_str!("../../../shaders/sphere.wgsl")
    ),
};
/// Normals as lines.
pub const HAIR: Shader = Shader {
    name: "hair",
    source: concat!(
        include_str!("../../../shaders/common.wgsl"),
        include_str!("../../../shaders/points.wgsl"),
        include_str!("../../../shaders/hair.wgsl")
    ),
};
/// Ids and depths to colors.
pub const SHADE: Shader = Shader {
    name: "shade",
    source: concat!(
        include_str!("../../../shaders/common.wgsl"),
        include_str!("../../../shaders/shade.wgsl")
    ),
};

impl Shader {
    /// Compiles on `device`.
    pub fn module(&self, device: &wgpu::Device) -> wgpu::ShaderModule {
        device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.name),
            source: wgpu::ShaderSource::Wgsl(self.source.into()),
        })
    }
}
