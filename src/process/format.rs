//! The pixel formats of targets.

use crate::quality::{DiffuseFormat, NormalFormat};

/// The format of a target. Unless it says otherwise, it can be drawn to and read on every adapter. Objects with blended
/// materials are drawn to those that [cannot be blended](Format::can_be_blended) as if they did not blend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// A byte, linear, 0 to 1.
    R8Unorm,
    /// Two bytes, linear, 0 to 1.
    Rg8Unorm,
    /// Four bytes, linear, 0 to 1.
    Rgba8Unorm,
    /// Four bytes; red, green and blue are sRGB encoded.
    Rgba8Srgb,
    /// As [`Format::Rgba8Unorm`], with blue first.
    Bgra8Unorm,
    /// As [`Format::Rgba8Srgb`], with blue first, as the surfaces of many windows are. Its bytes can be copied
    /// unchanged to a surface of [`Format::Bgra8Unorm`].
    Bgra8Srgb,
    /// Three channels of 10 bits and one of 2, linear, 0 to 1.
    Rgb10a2Unorm,
    /// Four half floats.
    Rgba16Float,
    /// Two half floats.
    Rg16Float,
    /// A half float.
    R16Float,
    /// Four floats.
    Rgba32Float,
    /// Four floats that can be blended, for sums of many small numbers. Devices need the feature `FLOAT32_BLENDABLE`,
    /// which [`WgpuBackend::optional_features`](crate::backend::WgpuBackend::optional_features) has if the adapter has
    /// it: [`BackendExtras::can_blend_floats`](crate::backend::BackendExtras::can_blend_floats) tells.
    Rgba32FloatBlendable,
    /// A float.
    R32Float,
    /// A whole number: shaders write and read `u32`.
    R32Uint,
    /// Depth, a float.
    Depth32Float,
    /// Depth, a float, and a [stencil](super::Stencil). Devices need the feature `DEPTH32FLOAT_STENCIL8`, which
    /// [`WgpuBackend::optional_features`](crate::backend::WgpuBackend::optional_features) has if the adapter has it. It
    /// is not read back, and shaders sample its depth.
    Depth32FloatStencil8,
    /// A [stencil](super::Stencil) without depth, which shaders sample as a whole number.
    Stencil8,
}

impl Format {
    /// Whether it holds depth, a stencil or both, rather than colour.
    pub fn is_depth_stencil(self) -> bool {
        self.has_depth() || self.has_stencil()
    }

    /// Whether it holds depth.
    pub fn has_depth(self) -> bool {
        matches!(self, Self::Depth32Float | Self::Depth32FloatStencil8)
    }

    /// Whether it holds a stencil.
    pub fn has_stencil(self) -> bool {
        matches!(self, Self::Depth32FloatStencil8 | Self::Stencil8)
    }

    /// Whether a compute shader can write it as a storage texture on every adapter.
    pub fn can_be_stored(self) -> bool {
        matches!(self, Self::Rgba8Unorm | Self::Rgba16Float | Self::Rgba32Float | Self::R32Float | Self::R32Uint)
    }

    /// Whether what is drawn can be blended with it on every adapter that can have it.
    pub fn can_be_blended(self) -> bool {
        !self.is_depth_stencil() && !matches!(self, Self::Rgba32Float | Self::R32Float | Self::R32Uint)
    }

    /// Whether a target can be [multisampled](super::Declare::multisampled) on every adapter.
    pub fn can_be_multisampled(self) -> bool {
        self.is_depth_stencil() || self.can_be_resolved()
    }

    /// Whether the samples of a target of this format can be [resolved](super::Declare::resolves) on every adapter.
    pub fn can_be_resolved(self) -> bool {
        self.is_filterable()
    }

    /// Whether it holds whole numbers.
    pub fn is_integer(self) -> bool {
        matches!(self, Self::R32Uint | Self::Stencil8)
    }

    /// Whether a shader can sample it between pixels, with a filtering sampler, on every adapter.
    pub fn is_filterable(self) -> bool {
        self.can_be_blended() && self != Self::Rgba32FloatBlendable
    }

    /// Whether it holds negative numbers.
    pub fn is_signed(self) -> bool {
        let is_half = matches!(self, Self::Rgba16Float | Self::Rg16Float | Self::R16Float);
        is_half || matches!(self, Self::Rgba32Float | Self::Rgba32FloatBlendable | Self::R32Float)
    }

    /// Channels per pixel, as shaders sample them.
    pub fn channels(self) -> usize {
        match self {
            Self::Rgba8Unorm | Self::Rgba8Srgb | Self::Bgra8Unorm | Self::Bgra8Srgb => 4,
            Self::Rgb10a2Unorm | Self::Rgba16Float | Self::Rgba32Float | Self::Rgba32FloatBlendable => 4,
            Self::Rg8Unorm | Self::Rg16Float => 2,
            Self::R8Unorm | Self::R16Float | Self::R32Float | Self::R32Uint | Self::Depth32Float => 1,
            Self::Depth32FloatStencil8 | Self::Stencil8 => 1,
        }
    }

    /// Bytes per pixel, without the stencil beside depth.
    pub fn bytes(self) -> usize {
        match self {
            Self::R8Unorm | Self::Stencil8 => 1,
            Self::Rg8Unorm | Self::R16Float => 2,
            Self::Rgba8Unorm | Self::Rgba8Srgb | Self::Bgra8Unorm | Self::Bgra8Srgb | Self::Rgb10a2Unorm => 4,
            Self::Rg16Float | Self::R32Float | Self::R32Uint => 4,
            Self::Depth32Float | Self::Depth32FloatStencil8 => 4,
            Self::Rgba16Float => 8,
            Self::Rgba32Float | Self::Rgba32FloatBlendable => 16,
        }
    }
}

/// The format of the target `normal`: see [`GeometryFormats`](super::GeometryFormats).
impl From<NormalFormat> for Format {
    fn from(normals: NormalFormat) -> Self {
        match normals {
            NormalFormat::Octahedral8 => Self::Rg8Unorm,
            NormalFormat::Octahedral10 => Self::Rgb10a2Unorm,
            NormalFormat::Octahedral16 => Self::Rgba8Unorm,
            NormalFormat::HalfFloat => Self::Rg16Float,
        }
    }
}

/// The format of the target `diffuse`: see [`GeometryFormats`](super::GeometryFormats).
impl From<DiffuseFormat> for Format {
    fn from(diffuse: DiffuseFormat) -> Self {
        match diffuse {
            DiffuseFormat::Srgb8 => Self::Rgba8Srgb,
            DiffuseFormat::HalfFloat => Self::Rgba16Float,
        }
    }
}
