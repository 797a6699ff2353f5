//! Every knob that trades accuracy for speed, in one place.

mod depth_key;
mod error;
mod shadows;

pub(crate) use depth_key::DepthCodes;
pub use depth_key::{DepthCurve, DepthKey};
pub use error::QualityError;
pub use shadows::ShadowQuality;

/// How accurate frames are, and so what they cost: all that a renderer may give up accuracy for.
///
/// Three presets are a start: [`Quality::fast`], [`Quality::balanced`], which is the default, and [`Quality::exact`].
/// `benches/examples/tradeoff` measures what each knob gives and takes on a scene of one's own.
///
/// ```
/// use drawloom::quality::{CullingVolume, Quality};
///
/// let quality = Quality { culling: CullingVolume::OrientedBox, occlusion: Some(8), ..Quality::balanced() };
/// quality.check()?;
///
/// let wrong = Quality { culling: CullingVolume::None, ..quality };
/// assert_eq!(
///     wrong.check().unwrap_err().to_string(),
///     "occlusion needs a culling volume: what has none is never hidden",
/// );
/// # Ok::<(), drawloom::quality::QualityError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// How precisely opaque objects of one mesh are drawn front to back: 1 to [`DepthKey::MOST_OPAQUE_BITS`] bits.
    ///
    /// Error: pairs drawn back to front, which cost overdraw and leave the picture as it is. Cost: none but that of the bits
    /// to sort by.
    pub opaque_order: DepthKey,
    /// How precisely blended objects are drawn back to front: 1 to [`DepthKey::MOST_BLENDED_BITS`] bits.
    ///
    /// Error: pairs drawn in the wrong order, which are seen; none that are farther apart than [`DepthKey::step`]. Cost: a pass of
    /// the sort for some nine bits.
    pub blended_order: DepthKey,
    /// What stands for an object when it is asked whether a view sees it.
    ///
    /// Error: objects drawn that nobody sees; never the other way round. So the picture stays as it is, but for what lies across or
    /// beyond a far plane in perspective, which leaves out objects as a whole and by their volume, and for what absolute transforms draw
    /// elsewhere than it is. Cost: some 2 ns an object and view; boxes add as much for those that a ball does not decide.
    pub culling: CullingVolume,
    /// Whether what larger objects hide is left out, and in how coarse a picture that is found out: in squares of 1, 2, 4, 8 or
    /// 16 pixels of the view's picture; `None` does not look. See S 9.6.
    ///
    /// Error: hidden objects that are drawn; never the other way round. Cost: a coarse depth buffer a view, on the CPU. A view in
    /// which that has not paid for itself, on the CPU until the frame is recorded, is left without for a while. An engine's own shaders draw opaque objects whole and where
    /// their meshes are; those of which they move or cut away a part have bounds other than their mesh's.
    pub occlusion: Option<u32>,
    /// How the geometry buffer holds normals.
    ///
    /// Error: degrees. Cost: bytes a pixel written once and read for every light that reaches it.
    pub normals: NormalFormat,
    /// How the geometry buffer holds diffuse colours.
    ///
    /// Error: steps of the colour. Cost: 4 or 8 bytes a pixel.
    pub diffuse: DiffuseFormat,
    /// How vertices lie in memory on the device (S 9.6).
    ///
    /// Error: degrees of the normal, and texels. Cost: 32 or 20 bytes a vertex. Meshes are uploaded again when it changes.
    pub vertices: VertexFormat,
    /// Whether depth is drawn before the geometry buffer.
    ///
    /// Error: pixels of surfaces at exactly one depth, of which another may be seen; the others stay as they are. Cost: all vertices
    /// once more, for each pixel's surface shaded once. It pays where pixels cost more than vertices.
    pub depth_pre_pass: bool,
    /// How shadow maps are drawn and read, by a [`Deferred`](crate::process::Deferred) pipeline.
    pub shadows: ShadowQuality,
    /// Where lights end: the illuminance (in the units of the scene's lights) below which one is cut off, at least 0. At 0 they
    /// end at their own range.
    ///
    /// Error: of the illuminance of one light at one place, at most 1.089 times this. A light of intensity I is drawn up to
    /// r = √(I / cut-off), and windowed by (1 − (d/r)⁴)²: with s = d/r the difference from I/d² is the cut-off times 2s² − s⁶ up to
    /// s = 1, whose maximum is at s⁴ = 2/3, and less than the cut-off beyond. Cost: the pixels within the lights' reach.
    pub light_cut_off: f32,
    /// How radiance becomes a picture.
    ///
    /// Error: RMSE of the picture. Cost: five multiplications and a division a pixel and colour.
    pub tone_curve: ToneCurve,
    /// How an object's place in a view is worked out.
    ///
    /// Error: pixels. Cost: some ten integer operations a vertex. To change it makes new pipelines.
    pub transforms: TransformPrecision,
}

impl Quality {
    /// The coarseness of [`Quality::occlusion`] that there is, in pixels.
    pub const OCCLUSION_SQUARES: [u32; 5] = [1, 2, 4, 8, 16];

    /// For frames that must be cheap: what is given up is seen when looked for.
    pub fn fast() -> Self {
        Self {
            opaque_order: DepthKey { bits: 8, curve: DepthCurve::Logarithmic },
            blended_order: DepthKey { bits: 18, curve: DepthCurve::Logarithmic },
            culling: CullingVolume::Sphere,
            occlusion: Some(16),
            normals: NormalFormat::Octahedral8,
            diffuse: DiffuseFormat::Srgb8,
            vertices: VertexFormat::Packed,
            depth_pre_pass: false,
            shadows: ShadowQuality { side: 512, filter: 0, interval: 2, widest_edge: 10.0, ..ShadowQuality::default() },
            light_cut_off: 1.0 / 255.0,
            tone_curve: ToneCurve::Filmic,
            transforms: TransformPrecision::CameraRelative,
        }
    }

    /// For most: what is given up is below what is seen.
    pub fn balanced() -> Self {
        Self {
            opaque_order: DepthKey { bits: 20, curve: DepthCurve::Logarithmic },
            blended_order: DepthKey::EXACT,
            culling: CullingVolume::Sphere,
            occlusion: None,
            normals: NormalFormat::HalfFloat,
            diffuse: DiffuseFormat::Srgb8,
            vertices: VertexFormat::Full,
            depth_pre_pass: false,
            shadows: ShadowQuality::default(),
            light_cut_off: 0.0,
            tone_curve: ToneCurve::Filmic,
            transforms: TransformPrecision::CameraRelative,
        }
    }

    /// For pictures to measure others by: what is still given up is below what a byte of the picture shows.
    pub fn exact() -> Self {
        Self {
            culling: CullingVolume::OrientedBox,
            normals: NormalFormat::Octahedral16,
            diffuse: DiffuseFormat::HalfFloat,
            shadows: ShadowQuality { side: 2048, filter: 2, widest_edge: 2.0, ..ShadowQuality::default() },
            ..Self::balanced()
        }
    }

    /// Whether there can be frames of this quality.
    ///
    /// # Errors
    /// If a knob is out of its range, or two of them do not go together: see [`QualityError`].
    pub fn check(&self) -> Result<(), QualityError> {
        self.opaque_order.check("opaque_order", DepthKey::MOST_OPAQUE_BITS)?;
        self.blended_order.check("blended_order", DepthKey::MOST_BLENDED_BITS)?;
        if let Some(square) = self.occlusion {
            if !Self::OCCLUSION_SQUARES.contains(&square) {
                return Err(QualityError::OutOfRange {
                    knob: "occlusion",
                    value: square.to_string(),
                    range: "1, 2, 4, 8 or 16 pixels",
                });
            }
            if self.culling == CullingVolume::None {
                return Err(QualityError::OcclusionWithoutVolume);
            }
        }
        if !(self.light_cut_off >= 0.0 && self.light_cut_off.is_finite()) {
            let value = self.light_cut_off.to_string();
            return Err(QualityError::OutOfRange { knob: "light_cut_off", value, range: "0 or more, and finite" });
        }
        if self.occlusion.is_some() && self.transforms == TransformPrecision::Absolute {
            return Err(QualityError::OcclusionOfAbsolute);
        }
        self.shadows.check()
    }
}

impl Default for Quality {
    fn default() -> Self {
        Self::balanced()
    }
}

/// What stands for an object when it is asked whether a view sees it: the smaller it is, the fewer objects are drawn that nobody
/// sees, and the longer it takes to ask.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum CullingVolume {
    /// Everything is drawn.
    None,
    /// The ball around it.
    #[default]
    Sphere,
    /// The box around it along the world's axes. An object whose bounds an engine made larger than its mesh has them as its box.
    Box,
    /// The box around its mesh along its own axes.
    OrientedBox,
}

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
    pub fn bound(self) -> f64 {
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
    /// to 1, and by more where a texture is repeated: see [`VertexFormat::uv_bound`].
    Packed,
}

impl VertexFormat {
    /// How far a normal can be off, in degrees, along the axes of its mesh.
    ///
    /// In steps of 1/127 each coordinate is off by 1/254 at most, all three by √3/254, and that is the sine of the angle.
    pub fn normal_bound(self) -> f64 {
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
    pub fn uv_bound(self, repeats: f64) -> f64 {
        let farthest = repeats * 0.5 + 0.5;
        match self {
            Self::Full => 0.0,
            Self::Packed if farthest <= 65_504.0 => farthest / 2048.0,
            Self::Packed => farthest,
        }
    }
}

/// How radiance, which has no upper end, becomes a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ToneCurve {
    /// The filmic curve that Narkowicz (2015) fitted to ACES.
    #[default]
    Filmic,
    /// Cut off at 1: cheap, and without any drawing in what is brighter.
    Clipped,
}

/// How an object's place in a view is worked out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum TransformPrecision {
    /// The camera's place is taken from the object's in 64-bit fixed point: off by less than 1e-3 pixels wherever in the world the
    /// camera is, for what is farther from it than it is large, at 1080p and fields of view from 27° to 90°; see
    /// [`GpuView`](crate::view::GpuView) for others.
    #[default]
    CameraRelative,
    /// Places in the world in f32, as most engines have them: off by 0.05 pixels in the mean and 2 at most at 1 km from the world's
    /// origin, by 50 in the mean and anything at most at 1,000 km, and not to be used at 100,000 km. It is here to be compared with.
    Absolute,
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    #[test]
    fn presets_are_valid() {
        for preset in [Quality::fast(), Quality::balanced(), Quality::exact()] {
            assert_eq!(preset.check(), Ok(()));
        }
    }

    #[test]
    fn what_cannot_be_is_named() {
        let valid = Quality::exact();
        let shadows = valid.shadows;
        let order = |bits, curve| DepthKey { bits, curve };
        for (wrong, knob) in [
            (Quality { occlusion: Some(3), ..valid }, "occlusion"),
            (Quality { occlusion: Some(0), ..valid }, "occlusion"),
            (Quality { light_cut_off: -1.0, ..valid }, "light_cut_off"),
            (Quality { light_cut_off: f32::NAN, ..valid }, "light_cut_off"),
            (Quality { light_cut_off: f32::INFINITY, ..valid }, "light_cut_off"),
            (Quality { opaque_order: order(21, DepthCurve::Logarithmic), ..valid }, "opaque_order"),
            (Quality { opaque_order: order(0, DepthCurve::Logarithmic), ..valid }, "opaque_order"),
            (Quality { blended_order: order(33, DepthCurve::Logarithmic), ..valid }, "blended_order"),
            (Quality { blended_order: order(9, DepthCurve::Linear { far: 0.0 }), ..valid }, "blended_order"),
            (Quality { blended_order: order(9, DepthCurve::Linear { far: f32::INFINITY }), ..valid }, "blended_order"),
            (Quality { shadows: ShadowQuality { side: 0, ..shadows }, ..valid }, "shadows.side"),
            (Quality { shadows: ShadowQuality { filter: 5, ..shadows }, ..valid }, "shadows.filter"),
            (Quality { shadows: ShadowQuality { bias: f32::NAN, ..shadows }, ..valid }, "shadows.bias"),
            (Quality { shadows: ShadowQuality { interval: 0, ..shadows }, ..valid }, "shadows.interval"),
            (Quality { shadows: ShadowQuality { widest_edge: 0.0, ..shadows }, ..valid }, "shadows.widest_edge"),
            (Quality { shadows: ShadowQuality { widest_edge: 91.0, ..shadows }, ..valid }, "shadows.widest_edge"),
        ] {
            let error = wrong.check().unwrap_err();
            let is_named = matches!(&error, QualityError::OutOfRange { knob: named, .. } if *named == knob);
            assert!(is_named, "{knob}: {error}");
        }
        let blind = Quality { occlusion: Some(8), culling: CullingVolume::None, ..valid };
        assert_eq!(blind.check(), Err(QualityError::OcclusionWithoutVolume));
        let elsewhere = Quality { occlusion: Some(8), transforms: TransformPrecision::Absolute, ..valid };
        assert_eq!(elsewhere.check(), Err(QualityError::OcclusionOfAbsolute));
    }
}
