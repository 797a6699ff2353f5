//! How shaders read textures: outside of them, and between texels.

/// How shaders read a texture of materials. The default repeats it and is linear in every direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Sampler {
    /// What is to the left and right of the texture, and what is above and below.
    pub address_modes: [AddressMode; 2],
    /// Where the texture is magnified.
    pub mag_filter: Filter,
    /// Where it is reduced.
    pub min_filter: Filter,
    /// Between mip levels; `None` shows the first level alone.
    pub mip_filter: Option<Filter>,
    /// The most samples along the direction in which a surface is seen at a slant, from 1 for one to 16; other numbers
    /// count as the nearest of these. It has an effect if all filters are linear. The software backend takes one.
    pub anisotropy: u8,
}

/// What a texture shows beyond its edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum AddressMode {
    /// The texture again.
    #[default]
    Repeat,
    /// The texture again, mirrored each time.
    Mirror,
    /// The texel at the edge.
    Clamp,
}

/// What a texture shows between its texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Filter {
    /// The nearest one.
    Nearest,
    /// A mixture of the ones around.
    #[default]
    Linear,
}

impl Sampler {
    /// Repeats the texture, linear in every direction, without anisotropy.
    pub const REPEAT: Self = Self {
        address_modes: [AddressMode::Repeat; 2],
        mag_filter: Filter::Linear,
        min_filter: Filter::Linear,
        mip_filter: Some(Filter::Linear),
        anisotropy: 1,
    };

    /// The same, with the texel at the edge beyond the texture.
    pub const CLAMP: Self = Self { address_modes: [AddressMode::Clamp; 2], ..Self::REPEAT };

    /// Repeats the texture, and shows the nearest texel of the nearest level.
    pub const NEAREST: Self = Self {
        mag_filter: Filter::Nearest,
        min_filter: Filter::Nearest,
        mip_filter: Some(Filter::Nearest),
        ..Self::REPEAT
    };

    /// The anisotropy that it has on a device: 1 unless all filters are linear.
    #[cfg(feature = "wgpu")]
    pub(crate) fn effective_anisotropy(self) -> u16 {
        let filters = [Some(self.mag_filter), Some(self.min_filter), self.mip_filter];
        let is_linear = filters.iter().all(|filter| *filter == Some(Filter::Linear));
        if is_linear { u16::from(self.anisotropy).clamp(1, 16) } else { 1 }
    }
}

impl Default for Sampler {
    fn default() -> Self {
        Self::REPEAT
    }
}
