//! Textures of materials: which image, how it is placed, filtered and wrapped.

use drawloom::glam::{Mat2, Vec2};
use drawloom::scene::{AddressMode, Filter, Sampler};

use crate::document::Source;
use crate::element::{Element, Kind};
use crate::error::Problem;
use crate::surface::{PLAIN_SLOT, TextureSlot};
use crate::textures::{ColorSpace, TextureUse};
use crate::warnings::Warnings;

pub(crate) struct SlotReader<'r> {
    pub(crate) source: &'r Source,
    pub(crate) warnings: &'r mut Warnings,
}

impl SlotReader<'_> {
    /// Reads what a material says of a texture: how it is placed, and which it is.
    ///
    /// # Errors
    /// If its texture coordinates are not read, or it has no image.
    pub(crate) fn slot(&mut self, info: &Element<'_>, space: ColorSpace) -> Result<(TextureSlot, TextureUse), Problem> {
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
        let sampler = self.sampler(&texture)?;
        let mut slot = TextureSlot { coordinates: coordinates as u32, ..PLAIN_SLOT };
        if let Some(transform) = transform {
            let lost = format_args!("{info} is drawn without the transform of a texture");
            let placed = self.warnings.keep(matrix_of(&transform), lost)?;
            (slot.matrix, slot.offset) = placed.unwrap_or((slot.matrix, slot.offset));
        }
        Ok((slot, TextureUse { image: image.index, space, sampler }))
    }

    /// How a texture is filtered and wrapped: smoothly with mip levels, and repeated, unless its sampler says
    /// otherwise.
    fn sampler(&mut self, texture: &Element<'_>) -> Result<Sampler, Problem> {
        let read = self.source.member(texture, "sampler", Kind::Sampler);
        let lost = format_args!("{texture} is drawn with the default sampler");
        let Some(sampler) = self.warnings.keep(read, lost)?.flatten() else { return Ok(Sampler::REPEAT) };
        let mag_filter = self.choose(&sampler, "magFilter", &[(9728, Filter::Nearest), (9729, Filter::Linear)])?;
        let [nearest, linear] = [Filter::Nearest, Filter::Linear];
        let min_filters = [
            (9728, (nearest, None)),
            (9729, (linear, None)),
            (9984, (nearest, Some(nearest))),
            (9985, (linear, Some(nearest))),
            (9986, (nearest, Some(linear))),
            (9987, (linear, Some(linear))),
        ];
        let min_filter = self.choose(&sampler, "minFilter", &min_filters)?;
        let modes = [(10497, AddressMode::Repeat), (33071, AddressMode::Clamp), (33648, AddressMode::Mirror)];
        let [across, down] = [self.choose(&sampler, "wrapS", &modes)?, self.choose(&sampler, "wrapT", &modes)?];
        let mag_filter = mag_filter.unwrap_or_default();
        // Where the file leaves the choice, texels that are nearest in one direction are so in the other.
        let is_free = sampler.json.get("minFilter").is_none();
        let (min_filter, mip_filter) = match min_filter {
            None if is_free => (mag_filter, Some(linear)),
            chosen => chosen.unwrap_or((linear, Some(linear))),
        };
        let address_modes = [across.unwrap_or_default(), down.unwrap_or_default()];
        Ok(Sampler { address_modes, mag_filter, min_filter, mip_filter, anisotropy: 1 })
    }

    /// What a member of a sampler chooses; `None` for the default.
    fn choose<T: Copy>(
        &mut self,
        sampler: &Element<'_>,
        member: &str,
        choices: &[(usize, T)],
    ) -> Result<Option<T>, Problem> {
        let lost = format_args!("{sampler} is drawn with the default {member}");
        let Some(number) = self.warnings.keep(sampler.index(member), lost)?.flatten() else { return Ok(None) };
        let chosen = choices.iter().find(|(of_choice, _)| *of_choice == number).map(|(_, chosen)| *chosen);
        if chosen.is_none() {
            let warning = format!("has the {member} {number}, which is not known, and is drawn with the default");
            self.warnings.add(format!("{sampler} {warning}"));
        }
        Ok(chosen)
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
