//! Materials: metallic-roughness surfaces.

use drawloom::glam::Vec3;

use crate::document::Source;
use crate::element::Element;
use crate::error::Problem;
use crate::surface::{BLENDED, DOUBLE_SIDED, PLAIN_SLOT, Surface, TEXTURES, UNLIT};
use crate::texture_slots::SlotReader;
use crate::textures::{ColorSpace, TextureUse};
use crate::warnings::Warnings;

/// The greatest factor of a colour. A brighter one is drawn as bright.
const MAX_FACTOR: f32 = 1e30;

/// A material as a file has it.
pub(crate) struct ReadMaterial {
    /// In messages.
    pub(crate) name: String,
    pub(crate) surface: Surface,
    /// The textures, in the order of the surface's.
    pub(crate) textures: [Option<TextureUse>; TEXTURES],
}

impl ReadMaterial {
    /// Whether it has a texture of normals.
    pub(crate) fn has_bumps(&self) -> bool {
        self.textures[2].is_some()
    }
}

/// Reads a material, which messages call by a name. What is wrong with one of its values is a warning, and the value is
/// the default one.
///
/// # Errors
/// If a limit is exceeded.
pub(crate) fn read_material(
    source: &Source,
    material: &Element<'_>,
    name: String,
    warnings: &mut Warnings,
) -> Result<ReadMaterial, Problem> {
    let mut reader = MaterialReader { material, warnings };
    let pbr = reader.keep(material.object("pbrMetallicRoughness"), "is drawn with default factors")?.flatten();
    let [metallic, roughness] =
        [reader.factor(pbr, "metallicFactor", 1.0, 1.0)?, reader.factor(pbr, "roughnessFactor", 1.0, 1.0)?];
    let base_color = reader.base_color(pbr)?;
    let strength = material.extension("KHR_materials_emissive_strength");
    let strength = reader.factor(strength, "emissiveStrength", 1.0, MAX_FACTOR)?;
    let emission = (reader.emission()? * strength).min(Vec3::splat(MAX_FACTOR));
    let [normals, occlusion] =
        [reader.info(Some(*material), "normalTexture")?, reader.info(Some(*material), "occlusionTexture")?];
    let infos = [
        (reader.info(pbr, "baseColorTexture")?, ColorSpace::Srgb),
        (reader.info(pbr, "metallicRoughnessTexture")?, ColorSpace::Linear),
        (normals, ColorSpace::Linear),
        (occlusion, ColorSpace::Linear),
        (reader.info(Some(*material), "emissiveTexture")?, ColorSpace::Srgb),
    ];
    let (mut slots, mut textures) = ([PLAIN_SLOT; TEXTURES], [None; TEXTURES]);
    for (place, (info, space)) in infos.into_iter().enumerate() {
        let Some(info) = info else { continue };
        let read = SlotReader { source, warnings: reader.warnings }.slot(&info, space);
        if let Some((slot, used)) = reader.keep(read, "is drawn without a texture")? {
            (slots[place], textures[place]) = (slot, Some(used));
        }
    }
    let alpha_mode = reader.keep(material.text("alphaMode"), "is drawn without holes")?.flatten().unwrap_or("OPAQUE");
    if !matches!(alpha_mode, "OPAQUE" | "MASK" | "BLEND") {
        reader.warnings.add(format!("{material} has an `alphaMode` that is not known, and is drawn as OPAQUE"));
    }
    let cutoff = reader.factor(Some(*material), "alphaCutoff", 0.5, MAX_FACTOR)?;
    let double_sided = reader.keep(material.flag("doubleSided"), "is drawn from its front")?.flatten().unwrap_or(false);
    let flag = |flag: u32, is_set: bool| if is_set { flag } else { 0 };
    let surface = Surface {
        base_color,
        emission: emission.to_array(),
        // A cut-off of 0 has no holes.
        alpha_cutoff: if alpha_mode == "MASK" { cutoff } else { 0.0 },
        metallic,
        roughness,
        normal_scale: reader.signed_factor(normals, "scale")?,
        occlusion_strength: reader.factor(occlusion, "strength", 1.0, 1.0)?,
        flags: flag(UNLIT, material.extension("KHR_materials_unlit").is_some())
            | flag(DOUBLE_SIDED, double_sided)
            | flag(BLENDED, alpha_mode == "BLEND"),
        padding: [0; 3],
        textures: slots,
    };
    Ok(ReadMaterial { name, surface, textures })
}

struct MaterialReader<'a, 'r> {
    material: &'r Element<'a>,
    warnings: &'r mut Warnings,
}

impl<'a> MaterialReader<'a, '_> {
    fn keep<T>(&mut self, read: Result<T, Problem>, lost: &str) -> Result<Option<T>, Problem> {
        self.warnings.keep(read, format_args!("{} {lost}", self.material))
    }

    /// An object that refers to a texture.
    fn info(&mut self, holder: Option<Element<'a>>, member: &str) -> Result<Option<Element<'a>>, Problem> {
        let read = holder.map_or(Ok(None), |holder| holder.object(member));
        Ok(self.keep(read, &format!("is drawn without its {member}"))?.flatten())
    }

    /// A number from 0 on. A greater one than the greatest is drawn as that.
    fn factor(
        &mut self,
        holder: Option<Element<'a>>,
        member: &str,
        default: f32,
        greatest: f32,
    ) -> Result<f32, Problem> {
        let read = holder.map_or(Ok(None), |holder| holder.number(member));
        let wanted = self.keep(read, &format!("is drawn with the default {member}"))?.flatten().unwrap_or(default);
        let drawn = wanted.clamp(0.0, greatest);
        if drawn != wanted {
            self.warnings.add(format!("{} has a {member} of {wanted}, and is drawn with {drawn}", self.material));
        }
        Ok(drawn)
    }

    /// The scale of normals.
    fn signed_factor(&mut self, holder: Option<Element<'a>>, member: &str) -> Result<f32, Problem> {
        let read = holder.map_or(Ok(None), |holder| holder.number(member));
        let scale = self.keep(read, &format!("is drawn with the default {member}"))?.flatten().unwrap_or(1.0);
        Ok(scale.clamp(-MAX_FACTOR, MAX_FACTOR))
    }

    fn base_color(&mut self, pbr: Option<Element<'a>>) -> Result<[f32; 4], Problem> {
        let read = pbr.map_or(Ok(None), |pbr| pbr.numbers::<4>("baseColorFactor"));
        let wanted = self.keep(read, "is drawn white")?.flatten().unwrap_or([1.0; 4]);
        Ok(self.positive(wanted, "baseColorFactor"))
    }

    fn emission(&mut self) -> Result<Vec3, Problem> {
        let read = self.material.numbers::<3>("emissiveFactor");
        let wanted = self.keep(read, "is drawn without emission")?.flatten().unwrap_or([0.0; 3]);
        Ok(Vec3::from_array(self.positive(wanted, "emissiveFactor")))
    }

    fn positive<const N: usize>(&mut self, wanted: [f64; N], member: &str) -> [f32; N] {
        let drawn = wanted.map(|factor| factor.clamp(0.0, MAX_FACTOR.into()));
        if drawn != wanted {
            let warning = "is negative or very great, and is drawn with the nearest one that is not";
            self.warnings.add(format!("{} has a {member} that {warning}", self.material));
        }
        drawn.map(|factor| factor as f32)
    }
}
