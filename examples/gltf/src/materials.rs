//! Materials: metallic-roughness surfaces as the material types of `surfaces.wgsl`.

use drawloom::glam::{Mat2, Vec2, Vec3};
use drawloom::scene::{Blend, Material, MaterialType};
use gltf::json::Value;
use gltf::material::AlphaMode;
use gltf::texture::{MagFilter, WrappingMode};

use crate::error::Problem;
use crate::texture_arrays::{ColorSpace, TextureUse, TextureUses};
use crate::warnings::Warnings;

/// Materials without holes, and blended ones.
pub(crate) const SURFACE: MaterialType<Surface> = MaterialType::new("gltf surface");

/// Materials with holes where alpha is below their cut-off. A type of their own, because the process that draws them must not count as
/// one that hides what is behind the whole shape.
pub(crate) const MASKED_SURFACE: MaterialType<Surface> = MaterialType::new("gltf masked surface");

/// What distinguishes materials: `GltfMaterial` in `surfaces.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Surface {
    base_color: [f32; 4],
    emission: [f32; 3],
    /// Fragments with less alpha are holes; 0 for none.
    alpha_cutoff: f32,
    metallic: f32,
    roughness: f32,
    normal_scale: f32,
    occlusion_strength: f32,
    /// [`UNLIT`], [`DOUBLE_SIDED`], [`BLENDED`].
    flags: u32,
    padding: [u32; 3],
    /// Base colour, metalness and roughness, normals, occlusion, emission.
    textures: [TextureSlot; 5],
}

const UNLIT: u32 = 1;
const DOUBLE_SIDED: u32 = 2;
const BLENDED: u32 = 4;

/// A texture of a material: `TextureSlot` in `surfaces.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct TextureSlot {
    /// From the texture coordinates of vertices to those of the image.
    matrix: [f32; 4],
    offset: [f32; 2],
    /// Which use of an image it is; then the array and the layer of that. [`NO_TEXTURE`] for none.
    pub(crate) texture: u32,
    /// [`SECOND_COORDINATES`], [`NEAREST`], and how it wraps.
    flags: u32,
}

/// For no texture.
pub(crate) const NO_TEXTURE: u32 = u32::MAX;
const SECOND_COORDINATES: u32 = 1;
const NEAREST: u32 = 2;

impl Surface {
    /// Replaces the numbers of texture uses by where their layers are.
    pub(crate) fn place_textures(&mut self, place: impl Fn(u32) -> u32) {
        let used = self.textures.iter_mut().filter(|slot| slot.texture != NO_TEXTURE);
        used.for_each(|slot| slot.texture = place(slot.texture));
    }

    /// Drawloom's material with these values, apart from them what its own processes read.
    pub(crate) fn into_material(self, name: String) -> Material {
        let material_type = if self.alpha_cutoff > 0.0 { MASKED_SURFACE } else { SURFACE };
        Material {
            name,
            blend: if self.flags & BLENDED == 0 { Blend::None } else { Blend::Alpha },
            double_sided: self.flags & DOUBLE_SIDED != 0,
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

/// Reads a material, and adds the images that it uses.
///
/// # Errors
/// If a number is not finite, or a texture has coordinates that no vertex can have.
pub(crate) fn read_material(
    material: &gltf::Material<'_>,
    uses: &mut TextureUses,
    warnings: &mut Warnings,
) -> Result<Surface, Problem> {
    let name = material_name(material);
    let (pbr, alpha_mode) = (material.pbr_metallic_roughness(), material.alpha_mode());
    let mut reader = SlotReader { element: &name, uses, warnings };
    let emission = Vec3::from(material.emissive_factor()) * material.emissive_strength().unwrap_or(1.0);
    let (normals, occlusion) = (material.normal_texture(), material.occlusion_texture());
    let textures = [
        reader.of_info(pbr.base_color_texture(), ColorSpace::Srgb)?,
        reader.of_info(pbr.metallic_roughness_texture(), ColorSpace::Linear)?,
        match &normals {
            Some(normals) => {
                let transform = normals.extension_value("KHR_texture_transform").map(transform_of_json);
                reader.slot(&normals.texture(), normals.tex_coord(), transform, ColorSpace::Linear)?
            }
            None => EMPTY_SLOT,
        },
        match &occlusion {
            Some(occlusion) => {
                let transform = occlusion.extension_value("KHR_texture_transform").map(transform_of_json);
                reader.slot(&occlusion.texture(), occlusion.tex_coord(), transform, ColorSpace::Linear)?
            }
            None => EMPTY_SLOT,
        },
        reader.of_info(material.emissive_texture(), ColorSpace::Srgb)?,
    ];
    let is_masked = alpha_mode == AlphaMode::Mask;
    let flag = |flag: u32, is_set: bool| if is_set { flag } else { 0 };
    let surface = Surface {
        base_color: pbr.base_color_factor(),
        emission: emission.to_array(),
        // A cut-off of 0 has no holes.
        alpha_cutoff: if is_masked { material.alpha_cutoff().unwrap_or(0.5) } else { 0.0 },
        metallic: pbr.metallic_factor(),
        roughness: pbr.roughness_factor(),
        normal_scale: normals.map_or(1.0, |normals| normals.scale()),
        occlusion_strength: occlusion.map_or(1.0, |occlusion| occlusion.strength()),
        flags: flag(UNLIT, material.unlit())
            | flag(DOUBLE_SIDED, material.double_sided())
            | flag(BLENDED, alpha_mode == AlphaMode::Blend),
        padding: [0; 3],
        textures,
    };
    check(&name, &surface)?;
    Ok(surface)
}

/// How errors and reports call it.
pub(crate) fn material_name(material: &gltf::Material<'_>) -> String {
    match (material.index(), material.name()) {
        (None, _) => "the default material".to_owned(),
        (Some(index), None) => format!("material {index}"),
        (Some(index), Some(name)) => format!("material {index} ({name})"),
    }
}

const EMPTY_SLOT: TextureSlot =
    TextureSlot { matrix: [1.0, 0.0, 0.0, 1.0], offset: [0.0; 2], texture: NO_TEXTURE, flags: 0 };

/// `KHR_texture_transform`.
#[derive(Clone, Copy)]
struct Transform {
    offset: Vec2,
    rotation: f32,
    scale: Vec2,
    coordinates: Option<u32>,
}

struct SlotReader<'a> {
    element: &'a str,
    uses: &'a mut TextureUses,
    warnings: &'a mut Warnings,
}

impl SlotReader<'_> {
    fn of_info(&mut self, info: Option<gltf::texture::Info<'_>>, space: ColorSpace) -> Result<TextureSlot, Problem> {
        let Some(info) = info else { return Ok(EMPTY_SLOT) };
        let transform = info.texture_transform().map(|transform| Transform {
            offset: transform.offset().into(),
            rotation: transform.rotation(),
            scale: transform.scale().into(),
            coordinates: transform.tex_coord(),
        });
        self.slot(&info.texture(), info.tex_coord(), transform, space)
    }

    fn slot(
        &mut self,
        texture: &gltf::Texture<'_>,
        coordinates: u32,
        transform: Option<Transform>,
        space: ColorSpace,
    ) -> Result<TextureSlot, Problem> {
        let coordinates = transform.and_then(|transform| transform.coordinates).unwrap_or(coordinates);
        if coordinates > 1 {
            let warning = "uses texture coordinates {}: only 0 and 1 are read, and its texture is ignored";
            self.warnings.add(format!("{} {}", self.element, warning.replace("{}", &coordinates.to_string())));
            return Ok(EMPTY_SLOT);
        }
        let Some(image) = texture.source() else {
            let warning = "has no image of a format that is read, and is ignored";
            self.warnings.add(format!("{}: its texture {} {warning}", self.element, texture.index()));
            return Ok(EMPTY_SLOT);
        };
        let sampler = texture.sampler();
        let wrap = |mode| match mode {
            WrappingMode::Repeat => 0,
            WrappingMode::ClampToEdge => 1,
            WrappingMode::MirroredRepeat => 2,
        };
        let is_nearest = sampler.mag_filter() == Some(MagFilter::Nearest);
        let mut flags = wrap(sampler.wrap_s()) << 8 | wrap(sampler.wrap_t()) << 10;
        flags |= if coordinates == 1 { SECOND_COORDINATES } else { 0 };
        flags |= if is_nearest { NEAREST } else { 0 };
        let used = self.uses.add(TextureUse { image: image.index(), space });
        let mut slot = TextureSlot { texture: used, flags, ..EMPTY_SLOT };
        if let Some(Transform { offset, rotation, scale, .. }) = transform {
            // Counter-clockwise in an image whose v grows downwards.
            let matrix = Mat2::from_angle(-rotation) * Mat2::from_diagonal(scale);
            (slot.matrix, slot.offset) = (matrix.to_cols_array(), offset.to_array());
        }
        Ok(slot)
    }
}

/// Of an extension that the crate does not read for this kind of texture.
fn transform_of_json(value: &Value) -> Transform {
    let number =
        |value: Option<&Value>, default: f32| value.and_then(Value::as_f64).map_or(default, |value| value as f32);
    let pair = |name: &str, default: f32| {
        let pair = value.get(name);
        let item = |index: usize| number(pair.and_then(|pair| pair.get(index)), default);
        Vec2::new(item(0), item(1))
    };
    Transform {
        offset: pair("offset", 0.0),
        rotation: number(value.get("rotation"), 0.0),
        scale: pair("scale", 1.0),
        coordinates: value.get("texCoord").and_then(Value::as_u64).map(|set| set.min(99) as u32),
    }
}

fn check(name: &str, surface: &Surface) -> Result<(), Problem> {
    let factors =
        [surface.metallic, surface.roughness, surface.normal_scale, surface.occlusion_strength, surface.alpha_cutoff];
    let of_slots = surface.textures.iter().flat_map(|slot| slot.matrix.into_iter().chain(slot.offset));
    let numbers = surface.base_color.into_iter().chain(surface.emission).chain(factors).chain(of_slots);
    if !numbers.into_iter().all(f32::is_finite) {
        return Err(Problem::invalid(name, "has a factor that is not finite"));
    }
    let positive = surface.base_color.into_iter().chain(surface.emission).chain([surface.metallic, surface.roughness]);
    if positive.into_iter().any(|factor| factor < 0.0) {
        return Err(Problem::invalid(name, "has a negative factor"));
    }
    Ok(())
}
