//! Formats of the geometry buffer and of vertices.

/// How normals are stored: octahedral (Cigolle et al. 2014), in numbers of so many bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum NormalFormat {
    /// 2 bytes; up to 0.958° off.
    Octahedral8,
    /// 4 bytes; up to 0.238° off.
    Octahedral10,
    /// 4 bytes; up to 0.0039° off.
    Octahedral16,
    /// 4 bytes; up to 0.119° off.
    #[default]
    HalfFloat,
}

impl NormalFormat {
    /// How far a normal can be off, in degrees.
    ///
    /// If a coordinate of its point on the octahedron is off by h at most, the point is off by h·√6 along its face, and it is 1/√3
    /// or more from the middle: so the normal is off by h·√18. Over n steps from −1 to 1, h is 1/n: there are 254, 1022 and 65,534,
    /// so that 0 is one of them. For half floats it is 2⁻¹¹, because a device may cut them short; it is half of that where it rounds
    /// to nearest. The rounding of f32 adds 0.0001° at most: seven roundings of a coordinate, by h·√18.
    pub fn max_error_degrees(self) -> f64 {
        match self {
            Self::Octahedral8 => 0.958,
            Self::Octahedral10 => 0.238,
            Self::Octahedral16 => 0.0039,
            Self::HalfFloat => 0.119,
        }
    }
}

/// How diffuse colours are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DiffuseFormat {
    /// A byte a channel, sRGB encoded: half a step of 1/255 off, and up to a tenth more for how a device encodes it.
    #[default]
    Srgb8,
    /// A half float a channel: 2⁻¹⁰ of the value off where a device cuts it short, 2⁻¹¹ where it rounds to nearest.
    HalfFloat,
}

/// How vertices lie in memory on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum VertexFormat {
    /// 32 bytes: everything as floats.
    #[default]
    Full,
    /// 20 bytes: places as floats, normals in a byte a coordinate, and texture coordinates as half floats. Normals are up to
    /// 0.391° off, along the mesh's own axes. Texture coordinates are off by half a pixel of a texture of 1024 where they go from 0
    /// to 1, and by more where a texture is repeated: see [`VertexFormat::max_uv_error`].
    Packed,
}

impl VertexFormat {
    /// How far a normal can be off, in degrees, along the axes of its mesh.
    ///
    /// In steps of 1/127 each coordinate is off by 1/254 at most, all three by √3/254, and that is the sine of the angle.
    pub fn max_normal_error_degrees(self) -> f64 {
        match self {
            Self::Full => 0.0,
            Self::Packed => 0.391,
        }
    }

    /// How far a texture coordinate can be off, in widths or heights of the texture, in a mesh over which it repeats so many times:
    /// the difference between its highest and its lowest coordinate.
    ///
    /// Coordinates are counted from the whole number nearest the middle, so they are half of that and 1/2 from 0 at most. A half
    /// float has 11 bits, and is off by 2⁻¹¹ of itself; it ends at 65,504, and what is beyond stands there.
    pub fn max_uv_error(self, repeats: f64) -> f64 {
        let farthest = repeats * 0.5 + 0.5;
        match self {
            Self::Full => 0.0,
            Self::Packed if farthest <= 65_504.0 => farthest / 2048.0,
            Self::Packed => farthest,
        }
    }
}
