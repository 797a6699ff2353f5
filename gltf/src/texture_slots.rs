//! Textures of materials: which image, how it is placed, filtered and wrapped.

use drawloom::glam::{Mat2, Vec2};

use crate::document::Source;
use crate::element::{Element, Kind};
use crate::error::Problem;
use crate::mip_levels::ColorSpace;
use crate::surface::{
    EMPTY_SLOT, MAGNIFIED_NEAREST, MINIFIED_NEAREST, NEAREST_MIP_LEVEL, SECOND_COORDINATES, TextureSlot,
    WITHOUT_MIP_LEVELS,
};
use crate::texture_arrays::{TextureUse, TextureUses};
use crate::warnings::Warnings;

pub(crate) struct SlotReader<'r> {
    pub(crate) source: &'r Source,
    pub(crate) uses: &'r mut TextureUses,
    pub(crate) warnings: &'r mut Warnings,
}

impl SlotReader<'_> {
    /// Reads what a material says of a texture.
    ///
    /// # Errors
    /// If its texture coordinates are not read, or it has no image.
    pub(crate) fn slot(&mut self, info: &Element<'_>, space: ColorSpace) -> Result<TextureSlot, Problem> {
        let transform = info.extension("KHR_texture_transform");
        let of_transform = transform.map_or(Ok(None), |transform| transform.index("texCoord"))?;
        let coordinates = of_transform.map_or_else(|| info.index("texCoord"), |set| Ok(Some(set)))?.unwrap_or(0);
        if coordinates > 1 {
            let reason = format!("uses texture coordinates {coordinates}: only 0 and 1 are read");
            return Err(Problem::invalid(info, reason));
        }
        let texture = self.source.referred(info, Kind::Texture, info.needed_index("index")?)?;
        let Some(image) = self.source.member(&texture, "source", Kind::Image)? else {
            return Err(Problem::invalid(texture, "has no image of a format that is read"));
        };
        let mut flags = if coordinates == 1 { SECOND_COORDINATES } else { 0 };
        flags |= self.sampler_flags(&texture)?;
        let mut slot = EMPTY_SLOT;
        if let Some(transform) = transform {
            let lost = format_args!("{info} is drawn without the transform of a texture");
            let placed = self.warnings.keep(matrix_of(&transform), lost)?;
            (slot.matrix, slot.offset) = placed.unwrap_or((slot.matrix, slot.offset));
        }
        let texture = self.uses.add(TextureUse { image: image.index, space });
        Ok(TextureSlot { texture, flags, ..slot })
    }

    /// How a texture is filtered and wrapped: smoothly with mip levels, and repeated, unless its sampler says
    /// otherwise.
    fn sampler_flags(&mut self, texture: &Element<'_>) -> Result<u32, Problem> {
        let read = self.source.member(texture, "sampler", Kind::Sampler);
        let lost = format_args!("{texture} is drawn with the default sampler");
        let Some(sampler) = self.warnings.keep(read, lost)?.flatten() else { return Ok(0) };
        let mut choose = |member: &str, choices: &[(usize, u32)]| {
            let lost = format_args!("{sampler} is drawn with the default {member}");
            let Some(number) = self.warnings.keep(sampler.index(member), lost)?.flatten() else { return Ok(0) };
            match choices.iter().find(|(of_choice, _)| *of_choice == number) {
                Some((_, flags)) => Ok(*flags),
                None => {
                    let warning =
                        format!("has the {member} {number}, which is not known, and is drawn with the default");
                    self.warnings.add(format!("{sampler} {warning}"));
                    Ok(0)
                }
            }
        };
        let magnified = choose("magFilter", &[(9728, MAGNIFIED_NEAREST), (9729, 0)])?;
        let minified = choose(
            "minFilter",
            &[
                (9728, MINIFIED_NEAREST | WITHOUT_MIP_LEVELS),
                (9729, WITHOUT_MIP_LEVELS),
                (9984, MINIFIED_NEAREST | NEAREST_MIP_LEVEL),
                (9985, NEAREST_MIP_LEVEL),
                (9986, MINIFIED_NEAREST),
                (9987, 0),
            ],
        )?;
        let wraps = [(10497, 0), (33071, 1), (33648, 2)];
        let wrapped = choose("wrapS", &wraps)? << 8 | choose("wrapT", &wraps)? << 10;
        // Where the file leaves the choice, pixels that are nearest in one direction are so in the other.
        let is_free = sampler.json.get("minFilter").is_none();
        let minified = if is_free && magnified != 0 { MINIFIED_NEAREST } else { minified };
        Ok(magnified | minified | wrapped)
    }
}

/// The matrix and the offset of a `KHR_texture_transform`.
fn matrix_of(transform: &Element<'_>) -> Result<([f32; 4], [f32; 2]), Problem> {
    let pair = |member: &str, default: f64| {
        let [x, y] = transform.numbers::<2>(member)?.unwrap_or([default; 2]);
        Ok::<_, Problem>(Vec2::new(x as f32, y as f32))
    };
    let rotation = transform.number("rotation")?.unwrap_or(0.0);
    // Counter-clockwise in an image whose v grows downwards.
    let matrix = Mat2::from_angle(-rotation) * Mat2::from_diagonal(pair("scale", 1.0)?);
    let offset = pair("offset", 0.0)?;
    if !matrix.is_finite() || !offset.is_finite() {
        return Err(Problem::invalid(transform, "has a texture transform that is not finite"));
    }
    Ok((matrix.to_cols_array(), offset.to_array()))
}
