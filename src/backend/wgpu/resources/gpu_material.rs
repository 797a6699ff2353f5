//! A material's layout in the device's memory.

use super::texture_arrays::TextureLocation;
use crate::scene::Material;

/// A material as shaders read it: `Material` in `drawloom.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct GpuMaterial {
    diffuse: [f32; 3],
    opacity: f32,
    emission: [f32; 3],
    texture_array: u32,
    texture_layer: u32,
    double_sided: u32,
    blend: u32,
    alpha_cutoff: f32,
}

impl GpuMaterial {
    pub(crate) fn new(material: &Material, texture: Option<TextureLocation>) -> Self {
        let texture = texture.unwrap_or(TextureLocation::NONE);
        Self {
            diffuse: material.diffuse.to_array(),
            opacity: material.opacity,
            emission: material.emission.to_array(),
            texture_array: texture.array,
            texture_layer: texture.layer,
            double_sided: u32::from(material.double_sided),
            blend: material.blend as u32,
            alpha_cutoff: material.min_alpha(),
        }
    }
}
