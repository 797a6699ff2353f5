//! Encodes and decodes normals in the target `normal`, in WGSL.

use crate::process::{Format, GeometryFormats};

/// A normal is stored as a point of the unfolded octahedron, each coordinate from −1 to 1 (Cigolle et al. 2014).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum NormalEncoding {
    /// Unchanged, in the first two channels.
    Signed,
    /// As an integer from 0 to twice `steps` in the first two channels, where the value 1 is the integer `largest`.
    /// Twice `steps` is even, so that a coordinate of 0 is exact, and so are the normals of floors and walls.
    Steps { steps: f64, largest: f64 },
    /// As an integer from 0 to 65,534: the high bytes in the first two channels, the low bytes in the others.
    TwoBytes,
}

/// Half of the greatest integer that is stored in two bytes.
pub(super) const STEPS_OF_TWO_BYTES: f64 = 32_767.0;

impl NormalEncoding {
    pub(super) fn of(format: Format) -> Self {
        match format {
            Format::Rg8Unorm => Self::Steps { steps: 127.0, largest: 255.0 },
            Format::Rgb10a2Unorm => Self::Steps { steps: 511.0, largest: 1023.0 },
            Format::Rgba8Unorm => Self::TwoBytes,
            _ if format.is_signed() => Self::Signed,
            // Finer than the steps of any such format.
            _ => Self::Steps { steps: STEPS_OF_TWO_BYTES, largest: 2.0 * STEPS_OF_TWO_BYTES },
        }
    }
}

/// The normal encoding follows from the format of `normal`.
impl GeometryFormats {
    /// WGSL for shaders that write or read the target `normal`: `encode_normal(normal: vec3<f32>) -> vec4<f32>` and
    /// `decode_normal(texel: vec4<f32>) -> vec3<f32>`.
    ///
    /// Both coordinates of a normal's point on the octahedron (Cigolle et al. 2014) are stored:
    ///
    /// | format | encoding | greatest error |
    /// | --- | --- | --- |
    /// | [`Format::Rg8Unorm`] | −1 to 1 as bytes from 0 to 254 | 0.958° |
    /// | [`Format::Rgb10a2Unorm`] | −1 to 1 as 0 to 1022 | 0.238° |
    /// | [`Format::Rgba8Unorm`] | −1 to 1 as 0 to 65,534: both high bytes, then both low bytes | 0.0039° |
    /// | [`Format::Rg16Float`], [`Format::Rgba16Float`] | unchanged | 0.119° |
    /// | any other without negative numbers | −1 to 1 as 0 to 1 | its steps |
    ///
    /// In all but the last, normals along an axis of the world are exact. The bounds are those of
    /// [`NormalFormat::max_error_degrees`](crate::quality::NormalFormat::max_error_degrees).
    pub fn normal_encoding_wgsl(&self) -> String {
        let (code, steps, largest) = match NormalEncoding::of(self.normal) {
            NormalEncoding::Signed => (0, 1.0, 1.0),
            NormalEncoding::Steps { steps, largest } => (1, steps, largest),
            NormalEncoding::TwoBytes => (2, STEPS_OF_TWO_BYTES, 1.0),
        };
        let steps = format!("const NORMAL_STEPS: f32 = {steps:?};\nconst NORMAL_LARGEST: f32 = {largest:?};\n");
        format!("const NORMAL_ENCODING: u32 = {code}u;\n{steps}{}", include_str!("normal_encoding.wgsl"))
    }
}
