//! How shaders read textures: outside of them, and between texels.

/// How shaders read a texture of materials. The default repeats it and is linear in every direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Sampler {
    /// What is to the left and right of the texture, and what is above and below.
    pub outside: [Outside; 2],
    /// Where the texture is magnified.
    pub magnified: Filter,
    /// Where it is reduced.
    pub reduced: Filter,
    /// Between mip levels; `None` shows the first level alone.
    pub levels: Option<Filter>,
    /// The most samples along the direction in which a surface is seen at a slant, from 1 for one to 16; other numbers
    /// count as the nearest of these. It has an effect if all filters are linear. The software backend takes one.
    pub anisotropy: u8,
}

/// What a texture shows beyond its edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Outside {
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
        outside: [Outside::Repeat; 2],
        magnified: Filter::Linear,
        reduced: Filter::Linear,
        levels: Some(Filter::Linear),
        anisotropy: 1,
    };

    /// The same, with the texel at the edge beyond the texture.
    pub const CLAMP: Self = Self { outside: [Outside::Clamp; 2], ..Self::REPEAT };

    /// Repeats the texture, and shows the nearest texel of the nearest level.
    pub const NEAREST: Self =
        Self { magnified: Filter::Nearest, reduced: Filter::Nearest, levels: Some(Filter::Nearest), ..Self::REPEAT };

    /// The anisotropy that it has on a device: 1 unless all filters are linear.
    #[cfg(feature = "wgpu")]
    pub(crate) fn effective_anisotropy(self) -> u16 {
        let filters = [Some(self.magnified), Some(self.reduced), self.levels];
        let is_linear = filters.iter().all(|filter| *filter == Some(Filter::Linear));
        if is_linear { u16::from(self.anisotropy).clamp(1, 16) } else { 1 }
    }
}

impl Default for Sampler {
    fn default() -> Self {
        Self::REPEAT
    }
}
