//! Formats of the geometry buffer and of vertices.

/// The format of normals in the geometry buffer: octahedral encoding (Cigolle et al. 2014) with this many bits per
/// component.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum NormalFormat {
    /// 2 bytes; error up to 0.958°.
    Octahedral8,
    /// 4 bytes; error up to 0.238°.
    Octahedral10,
    /// 4 bytes; error up to 0.0039°.
    Octahedral16,
    /// 4 bytes; error up to 0.119°.
    #[default]
    HalfFloat,
}

impl NormalFormat {
    /// The maximum error of a normal, in degrees.
    ///
    /// If the error of a coordinate on the octahedron is at most h, the error of the point along its face is at most
    /// h·√6. The point's distance from the centre is at least 1/√3, so the error of the normal is at most h·√18. With n
    /// steps from −1 to 1, h is 1/n; n is 254, 1022 or 65,534, so that 0 is representable. For half floats h is 2⁻¹¹,
    /// because a device may truncate; it is half of that if the device rounds to nearest. The rounding of f32 adds at
    /// most 0.0001°: seven roundings of a coordinate, by h·√18.
    pub fn max_error_degrees(self) -> f64 {
        match self {
            Self::Octahedral8 => 0.958,
            Self::Octahedral10 => 0.238,
            Self::Octahedral16 => 0.0039,
            Self::HalfFloat => 0.119,
        }
    }
}

/// The format of diffuse colours in the geometry buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DiffuseFormat {
    /// A byte per channel, sRGB encoded: an error of half a step of 1/255, and up to a tenth more for the device's
    /// encoding.
    #[default]
    Srgb8,
    /// A half float per channel: an error of 2⁻¹⁰ of the value if a device truncates, 2⁻¹¹ if it rounds to nearest.
    HalfFloat,
}

/// The format of vertices in device memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum VertexFormat {
    /// 32 bytes: all attributes as floats.
    #[default]
    Full,
    /// 20 bytes: positions as floats, normals with a byte per coordinate, and texture coordinates as half floats. The
    /// error of normals is up to 0.391°, along the mesh's own axes. The error of texture coordinates is half a pixel of
    /// a texture of 1024 if they range from 0 to 1, and larger if the texture repeats: see
    /// [`VertexFormat::max_uv_error`].
    Packed,
}

impl VertexFormat {
    /// The maximum error of a normal, in degrees, along the axes of its mesh.
    ///
    /// With steps of 1/127, the error of each coordinate is at most 1/254, and that of all three √3/254, which is the
    /// sine of the angle.
    pub fn max_normal_error_degrees(self) -> f64 {
        match self {
            Self::Full => 0.0,
            Self::Packed => 0.391,
        }
    }

    /// The maximum error of a texture coordinate, in widths or heights of the texture. `repeats` is how often the
    /// texture repeats over the mesh: the difference between the highest and the lowest coordinate, of either sign.
    ///
    /// Coordinates are relative to the integer nearest the middle of their range, so their magnitude is at most half of
    /// `repeats`, plus 1/2. A half float has 11 bits and an error of 2⁻¹¹ of itself; coordinates beyond its maximum,
    /// 65,504, are clamped.
    pub fn max_uv_error(self, repeats: f64) -> f64 {
        let max_magnitude = repeats.abs() * 0.5 + 0.5;
        match self {
            Self::Full => 0.0,
            Self::Packed if max_magnitude <= 65_504.0 => max_magnitude / 2048.0,
            Self::Packed => max_magnitude,
        }
    }
}
