//! Surfaces: the values of materials, as the shaders read them.

use drawloom::handle::Handle;
use drawloom::scene::{Blend, Material, MaterialType, Texture};

/// Materials without holes, and blended ones.
pub(crate) const SURFACE: MaterialType<Surface> = MaterialType::new("gltf surface");

/// Materials with holes where alpha is below their cut-off. A type of their own, because the process that draws them
/// must not count as one that hides what is behind the whole shape.
pub(crate) const MASKED_SURFACE: MaterialType<Surface> = MaterialType::new("gltf masked surface");

/// What distinguishes materials: `GltfMaterial` in `surfaces.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Surface {
    pub(crate) base_color: [f32; 4],
    pub(crate) emission: [f32; 3],
    /// Fragments with less alpha are holes; 0 for none.
    pub(crate) alpha_cutoff: f32,
    pub(crate) metallic: f32,
    pub(crate) roughness: f32,
    pub(crate) normal_scale: f32,
    pub(crate) occlusion_strength: f32,
    /// [`UNLIT`], [`DOUBLE_SIDED`], [`BLENDED`].
    pub(crate) flags: u32,
    pub(crate) padding: [u32; 3],
    /// How its textures are placed.
    pub(crate) textures: [TextureSlot; TEXTURES],
}

pub(crate) const UNLIT: u32 = 1;
pub(crate) const DOUBLE_SIDED: u32 = 2;
pub(crate) const BLENDED: u32 = 4;

/// How a texture of a material is placed: `TextureSlot` in `surfaces.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct TextureSlot {
    /// From the texture coordinates of vertices to those of the image.
    pub(crate) matrix: [f32; 4],
    pub(crate) offset: [f32; 2],
    /// Which texture coordinates of vertices: 0 for the first ones, 1 for the second ones.
    pub(crate) coordinates: u32,
    pub(crate) padding: u32,
}

pub(crate) const PLAIN_SLOT: TextureSlot =
    TextureSlot { matrix: [1.0, 0.0, 0.0, 1.0], offset: [0.0; 2], coordinates: 0, padding: 0 };

/// The number of textures that a material has at most: base colour, metalness and roughness, normals, occlusion,
/// emission. They are in this order in the places of Drawloom's materials.
pub(crate) const TEXTURES: usize = 5;

impl Surface {
    /// Drawloom's material with these values, apart from them what its own processes read. Those leave the shadows of
    /// holes to a process of this crate.
    pub(crate) fn into_material(self, name: String, textures: [Option<Handle<Texture>>; TEXTURES]) -> Material {
        let (texture, textures) = (textures[0], textures[1..].to_vec());
        let material_type = if self.is_masked() { MASKED_SURFACE } else { SURFACE };
        Material {
            name,
            texture,
            textures,
            blend: if self.is_blended() { Blend::Alpha } else { Blend::None },
            double_sided: self.flags & DOUBLE_SIDED != 0,
            // No alpha reaches the cutoff.
            opacity: if self.is_masked() { 0.0 } else { 1.0 },
            alpha_cutoff: self.is_masked().then_some(1.0),
            values: Some(material_type.values(self)),
            ..Material::default()
        }
    }

    /// Whether it is blended over what is behind it.
    pub(crate) fn is_blended(&self) -> bool {
        self.flags & BLENDED != 0
    }

    /// Whether it has holes.
    pub(crate) fn is_masked(&self) -> bool {
        self.alpha_cutoff > 0.0
    }
}
