//! Surfaces: the values of materials, as the shaders read them.

use drawloom::scene::{Blend, Material, MaterialType};

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
    /// Base colour, metalness and roughness, normals, occlusion, emission.
    pub(crate) textures: [TextureSlot; 5],
}

pub(crate) const UNLIT: u32 = 1;
pub(crate) const DOUBLE_SIDED: u32 = 2;
pub(crate) const BLENDED: u32 = 4;

/// A texture of a material: `TextureSlot` in `surfaces.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct TextureSlot {
    /// From the texture coordinates of vertices to those of the image.
    pub(crate) matrix: [f32; 4],
    pub(crate) offset: [f32; 2],
    /// Which use of an image it is; then the array and the layer of that. [`NO_TEXTURE`] for none.
    pub(crate) texture: u32,
    /// [`SECOND_COORDINATES`], how it is filtered, and how it wraps.
    pub(crate) flags: u32,
    /// Width and height of the image in pixels. It fills the layer, or its upper left.
    pub(crate) size: [u32; 2],
    pub(crate) padding: [u32; 2],
}

/// For no texture.
const NO_TEXTURE: u32 = u32::MAX;

/// For the second texture coordinates of vertices.
pub(crate) const SECOND_COORDINATES: u32 = 1;
/// For images whose nearest pixel is shown where they are magnified.
pub(crate) const MAGNIFIED_NEAREST: u32 = 2;
/// For images whose nearest pixel is shown where they are minified.
pub(crate) const MINIFIED_NEAREST: u32 = 4;
/// For images of which no mip level is shown but the first.
pub(crate) const WITHOUT_MIP_LEVELS: u32 = 8;
/// For images of which the nearest mip level is shown.
pub(crate) const NEAREST_MIP_LEVEL: u32 = 16;

pub(crate) const EMPTY_SLOT: TextureSlot = TextureSlot {
    matrix: [1.0, 0.0, 0.0, 1.0],
    offset: [0.0; 2],
    texture: NO_TEXTURE,
    flags: 0,
    size: [1; 2],
    padding: [0; 2],
};

/// Where the image of a slot is: the array above the layer, and its size in pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexturePlace {
    pub(crate) layer: u32,
    pub(crate) size: [u32; 2],
}

impl Surface {
    /// Replaces the numbers of texture uses by where their layers are. Those that are nowhere are left out.
    pub(crate) fn place_textures(&mut self, place: impl Fn(u32) -> Option<TexturePlace>) {
        for slot in self.textures.iter_mut().filter(|slot| slot.texture != NO_TEXTURE) {
            *slot = match place(slot.texture) {
                Some(TexturePlace { layer, size }) => TextureSlot { texture: layer, size, ..*slot },
                None => EMPTY_SLOT,
            };
        }
    }

    /// Drawloom's material with these values, apart from them what its own processes read. Those leave the shadows of
    /// holes to a process of this crate.
    pub(crate) fn into_material(self, name: String) -> Material {
        let material_type = if self.is_masked() { MASKED_SURFACE } else { SURFACE };
        Material {
            name,
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

    /// Whether it has a texture of normals.
    pub(crate) fn has_bumps(&self) -> bool {
        self.textures[2].texture != NO_TEXTURE
    }
}
