//! Materials.

use glam::Vec3;

use super::{MaterialValues, Texture};
use crate::handle::Handle;

/// The optical properties of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name in reports.
    pub name: String,
    /// Diffuse reflectance, linear. Above 1, a surface reflects more light than it receives.
    pub diffuse: Vec3,
    /// Multiplied by `diffuse`, if there is one.
    pub texture: Option<Handle<Texture>>,
    /// Further textures, at most [`MAX_TEXTURES`](Self::MAX_TEXTURES) with the first one. Shaders of the engine's own
    /// processes read them: `texture_at(material, place, uv, dpdx(uv), dpdy(uv))` in WGSL, where place 0 is that of
    /// `texture`, 1 the first of these, and so on. It is white where a material has none in that place, or the texture
    /// is not on the device; `has_texture(material, place)` tells. Shipped processes ignore them.
    pub textures: Vec<Option<Handle<Texture>>>,
    /// Emitted radiance, linear.
    pub emission: Vec3,
    /// 0 is transparent, 1 is opaque. Only blended and masked materials use it.
    pub opacity: f32,
    /// How the surface is blended with what is behind it.
    pub blend: Blend,
    /// Makes the material a mask: a surface with holes. A hole is where alpha, which is `opacity` times the alpha of
    /// the `texture`, is below this cutoff, which is from 0 to 1. Holes show in pictures and in shadows; elsewhere the
    /// surface is opaque. `None` is a surface without holes. Blended materials ignore the cutoff. It is glTF's
    /// `alphaCutoff` for `alphaMode: MASK`.
    ///
    /// Masked objects write depth, so leaves need no order. They hide nothing from occlusion culling. A mask has no
    /// holes while its texture is not on the device.
    ///
    /// Shaders read the mask at the texture's full resolution at every distance, so the surface covers the same share
    /// of distant pixels as of near ones. The average of many texels would be below the cutoff everywhere, or nowhere.
    /// Each pixel is covered or not, as by triangles of that size. Devices round when they filter, so an alpha counts
    /// as equal to the cutoff if it is less by up to 1/4096 of the cutoff.
    pub alpha_cutoff: Option<f32>,
    /// Whether back faces are drawn too.
    pub double_sided: bool,
    /// Its values, if it has a [`MaterialType`](super::MaterialType): then the engine's own processes draw it. Of the
    /// other fields the shipped ones use `blend` and `double_sided`, and the [shadow
    /// casters](crate::process::ShadowCasters) use the mask: `alpha_cutoff`, `opacity` and `texture`.
    pub values: Option<MaterialValues>,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::from("default"),
            diffuse: Vec3::splat(0.8),
            texture: None,
            textures: Vec::new(),
            emission: Vec3::ZERO,
            opacity: 1.0,
            blend: Blend::None,
            alpha_cutoff: None,
            double_sided: false,
            values: None,
        }
    }
}

impl Material {
    /// The most textures of a material.
    pub const MAX_TEXTURES: usize = 6;

    /// Its textures, each with its place.
    pub fn all_textures(&self) -> impl Iterator<Item = (usize, Handle<Texture>)> {
        let places = (0..).zip([&self.texture].into_iter().chain(&self.textures));
        places.filter_map(|(place, texture)| Some((place, (*texture)?)))
    }

    /// Whether it is a mask: it does not blend, and has an [`alpha_cutoff`](Self::alpha_cutoff).
    pub fn is_masked(&self) -> bool {
        self.blend == Blend::None && self.alpha_cutoff.is_some()
    }

    /// The alpha below which shaders leave out a pixel: less than the cutoff by what filtering may round off. 0 without
    /// a mask.
    #[cfg(any(feature = "wgpu", feature = "software"))]
    pub(crate) fn min_alpha(&self) -> f32 {
        const ROUNDING: f32 = 1.0 / 4096.0;
        self.alpha_cutoff.filter(|_| self.is_masked()).map_or(0.0, |cutoff| cutoff * (1.0 - ROUNDING))
    }

    /// Whether its colours are finite and not negative, its opacity and alpha cutoff are from 0 to 1, and it has no more
    /// textures than it may.
    pub(super) fn is_valid(&self) -> bool {
        let finite = self.diffuse.is_finite() && self.emission.is_finite();
        let positive = self.diffuse.min_element() >= 0.0 && self.emission.min_element() >= 0.0;
        let is_fraction = |value: f32| (0.0..=1.0).contains(&value);
        let has_room = self.textures.len() < Self::MAX_TEXTURES;
        has_room && finite && positive && is_fraction(self.opacity) && self.alpha_cutoff.is_none_or(is_fraction)
    }
}

/// How a surface is blended with what is behind it (M listing 10.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Blend {
    /// It covers what is behind it.
    #[default]
    None = 0,
    /// It is blended over what is behind it by its opacity: alpha, by which shaders have not multiplied the colour yet.
    Alpha = 1,
    /// It is added to what is behind it.
    Additive = 2,
    /// It is subtracted from what is behind it.
    Subtractive = 3,
}
