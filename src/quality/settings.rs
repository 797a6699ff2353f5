//! Every setting of a frame's accuracy.

use super::{
    CullingVolume, DepthCurve, DepthKey, DiffuseFormat, NormalFormat, QualityError, ShadowQuality, ToneCurve,
    TransformPrecision, VertexFormat,
};

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
    /// How precisely opaque objects of one mesh are drawn front to back: 1 to [`DepthKey::MAX_OPAQUE_BITS`] bits.
    ///
    /// Error: pairs drawn back to front, which cost overdraw and leave the picture as it is. Cost: none but that of the bits
    /// to sort by.
    pub opaque_order: DepthKey,
    /// How precisely blended objects are drawn back to front: 1 to [`DepthKey::MAX_BLENDED_BITS`] bits.
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
    pub const OCCLUSION_TILE_SIZES: [u32; 5] = [1, 2, 4, 8, 16];

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
        self.opaque_order.check("opaque_order", DepthKey::MAX_OPAQUE_BITS)?;
        self.blended_order.check("blended_order", DepthKey::MAX_BLENDED_BITS)?;
        if let Some(square) = self.occlusion {
            if !Self::OCCLUSION_TILE_SIZES.contains(&square) {
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
            return Err(QualityError::OcclusionWithAbsoluteTransforms);
        }
        self.shadows.check()
    }
}

impl Default for Quality {
    fn default() -> Self {
        Self::balanced()
    }
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
        assert_eq!(elsewhere.check(), Err(QualityError::OcclusionWithAbsoluteTransforms));
    }
}
