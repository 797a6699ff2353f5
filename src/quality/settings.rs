//! The quality of frames: accuracy settings and presets.

use super::{
    CullingVolume, DepthCurve, DepthPrecision, DiffuseFormat, NormalFormat, QualityError, RadianceSum, ShadowQuality,
    ToneCurve, TransformPrecision, VertexFormat,
};

/// The settings that trade a frame's accuracy for speed.
///
/// There are three presets: [`Quality::fast`], [`Quality::balanced`], which is the default, and [`Quality::exact`].
/// [`Knob::ALL`](super::Knob::ALL) lists all settings with values to choose from, and `benches/examples/tradeoff`
/// measures error and cost of each for a scene of your own. Settings of shadow cascades, views and impostors are
/// [elsewhere](crate::quality).
///
/// ```
/// use drawloom::quality::{CullingVolume, Quality};
///
/// let quality = Quality { culling: CullingVolume::OrientedBox, depth_pre_pass: true, ..Quality::balanced() };
/// quality.check()?;
///
/// let wrong = Quality { level_of_detail: -1.0, ..quality };
/// assert_eq!(
///     wrong.check().unwrap_err().to_string(),
///     "quality setting level_of_detail is -1; valid: 0 pixels or more, and finite",
/// );
/// # Ok::<(), drawloom::quality::QualityError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// The depth precision of the front-to-back order of opaque objects of one mesh: 0 to
    /// [`DepthPrecision::MAX_OPAQUE_BITS`] bits. With 0 bits they are not ordered by depth.
    ///
    /// Error: pairs drawn back to front, which cause overdraw but do not change the picture, except that of coinciding
    /// surfaces the first drawn wins. Cost: with 0 bits, objects are counted by state and mesh, and a draw list is kept
    /// while the same objects are seen. From 1 bit on, every visible object becomes a command, and commands are sorted
    /// anew in every frame in which an object or the camera moves: 9 to 16 ns an object and view. That saves from half
    /// of the fragments of a city of one mesh to next to none where meshes are many (`benches/README.md`, "The order of
    /// opaque objects").
    pub opaque_order: DepthPrecision,
    /// The depth precision of the back-to-front order of blended objects: 1 to [`DepthPrecision::MAX_BLENDED_BITS`]
    /// bits.
    ///
    /// Error: pairs drawn in the wrong order, which is visible; none farther apart than [`DepthPrecision::step`]. Cost:
    /// a radix sort pass for some nine bits.
    pub blended_order: DepthPrecision,
    /// The bounding volume for view frustum culling.
    ///
    /// Error: invisible objects that are drawn; visible objects are never culled. So the picture does not change, with
    /// two exceptions: objects at or beyond the far plane of a perspective view, which culls whole objects by their
    /// volume, and absolute transforms, which draw objects at inaccurate positions. Cost: some 2 ns per object and
    /// view; boxes take as long again for objects that the bounding sphere does not decide.
    pub culling: CullingVolume,
    /// The tile size of occlusion culling, which removes objects that larger ones hide: 1, 2, 4, 8 or 16 pixels of the
    /// view's picture; `None` disables it, as all presets do. See S 9.6. Without the feature
    /// `occlusion`, [`check`](Self::check) accepts `None` alone.
    ///
    /// Error: hidden objects that are drawn; visible objects are never culled. Cost: a coarse depth buffer per view, on
    /// the CPU. If it takes more CPU time in a view than it saves until the frame is recorded, it is disabled there for
    /// a while, whatever it saves on the device. It requires that an engine's own shaders draw opaque objects exactly
    /// as their meshes are, or say that they [discard](crate::process::CommandDraws::discards) parts of them or
    /// [deform](crate::process::CommandDraws::deformation) them; objects that they move in another way must have bounds
    /// other than their mesh's.
    pub occlusion: Option<u32>,
    /// The format of normals in the geometry buffer.
    ///
    /// Error: degrees. Cost: bytes per pixel, written once and read for every light that reaches it.
    pub normals: NormalFormat,
    /// The format of diffuse colours in the geometry buffer.
    ///
    /// Error: steps of the colour. Cost: 4 or 8 bytes per pixel.
    pub diffuse: DiffuseFormat,
    /// The format of vertices in device memory (S 9.6).
    ///
    /// Error: degrees of the normal, and texels. Cost: 32 or 20 bytes per vertex. Meshes are uploaded again when it
    /// changes.
    pub vertices: VertexFormat,
    /// The largest error of [levels of detail](crate::scene::Mesh::with_levels), in pixels of a view's picture, 0 or
    /// more. Each object is drawn at the coarsest level whose error is at most this, at the nearest distance of its
    /// bounds; at 0, all are drawn at level 0.
    /// [`Camera::level_of_detail_scale`](crate::scene::Camera::level_of_detail_scale) multiplies it. In shadow maps it
    /// is twice as large, in pixels of the map.
    ///
    /// Error: no point of a surface is drawn farther than this from the surface of level 0, provided that the errors of
    /// the levels hold and bounds contain their objects. When a level changes, which it does with a margin of a quarter
    /// of this, nothing moves by more than twice this. Shading changes with the vertices that remain. Where an object
    /// has another level in a shadow map than in a picture, its surface may shadow itself within these errors, which
    /// [`ShadowQuality::bias`] does not know of. Cost: if a mesh has levels, up to 30 ns for each object that a view
    /// sees, in frames in which it or the camera moves: lists in which a level changes are made anew. It saves
    /// triangles.
    pub level_of_detail: f32,
    /// Whether a depth pre-pass precedes the geometry buffer.
    ///
    /// Error: where surfaces have exactly the same depth, another one may be visible; all other pixels do not change.
    /// Cost: all vertices are transformed twice, but each pixel is shaded only once. It is worth its cost if pixels
    /// cost more than vertices.
    pub depth_pre_pass: bool,
    /// The shadow map settings of a [`Deferred`](crate::process::Deferred) pipeline.
    pub shadows: ShadowQuality,
    /// The illuminance (in the units of the scene's lights) below which lights are cut off, at least 0. At 0, they end
    /// at their range.
    ///
    /// Error: at any point, the illuminance of each light differs by at most 1.089 times this. A light of intensity I
    /// is drawn up to r = √(I / cut-off), and windowed by (1 − (d/r)⁴)². With s = d/r the difference from I/d² is the
    /// cut-off times 2s² − s⁶ up to s = 1, whose maximum is at s⁴ = 2/3, and less than the cut-off beyond. A light that
    /// becomes brighter while its shadow map is [kept](ShadowQuality::interval) still ends up to a ninth too early:
    /// there it is 1.38 times. Cost: the pixels within the lights' reach.
    pub light_cut_off: f32,
    /// How lights and blended objects are added to the target `radiance` of a [`Deferred`](crate::process::Deferred)
    /// pipeline.
    ///
    /// Error: a fraction of the light that is added, by the number of lights or objects: see
    /// [`RadianceSum::max_light_error`] and [`RadianceSum::max_blended_error`]. Cost: bytes per pixel and light, or
    /// every pixel tests the lights of its tile.
    pub radiance_sum: RadianceSum,
    /// The tone mapping curve.
    ///
    /// Error: RMSE of the picture. Cost: five multiplications and a division per pixel and channel.
    pub tone_curve: ToneCurve,
    /// How positions are transformed to clip space.
    ///
    /// Error: pixels. Cost: some ten integer operations per vertex. Changing it creates new pipelines.
    pub transforms: TransformPrecision,
}

impl Quality {
    /// The valid tile sizes of [`Quality::occlusion`], in pixels.
    pub const OCCLUSION_TILE_SIZES: [u32; 5] = [1, 2, 4, 8, 16];

    /// The fastest preset: errors are visible on inspection.
    pub fn fast() -> Self {
        Self {
            opaque_order: DepthPrecision::UNORDERED,
            blended_order: DepthPrecision { bits: 18, curve: DepthCurve::Logarithmic },
            culling: CullingVolume::Sphere,
            occlusion: None,
            normals: NormalFormat::Octahedral8,
            diffuse: DiffuseFormat::Srgb8,
            vertices: VertexFormat::Packed,
            level_of_detail: 2.0,
            depth_pre_pass: false,
            shadows: ShadowQuality { side: 512, filter: 0, interval: 2, widest_edge: 10.0, ..ShadowQuality::default() },
            light_cut_off: 1.0 / 255.0,
            radiance_sum: RadianceSum::HalfFloat,
            tone_curve: ToneCurve::Filmic,
            transforms: TransformPrecision::CameraRelative,
        }
    }

    /// The default preset: errors are below what is visible.
    pub fn balanced() -> Self {
        Self {
            opaque_order: DepthPrecision::UNORDERED,
            blended_order: DepthPrecision::EXACT,
            culling: CullingVolume::Sphere,
            occlusion: None,
            normals: NormalFormat::HalfFloat,
            diffuse: DiffuseFormat::Srgb8,
            vertices: VertexFormat::Full,
            level_of_detail: 0.5,
            depth_pre_pass: false,
            shadows: ShadowQuality::default(),
            light_cut_off: 0.0,
            radiance_sum: RadianceSum::HalfFloat,
            tone_curve: ToneCurve::Filmic,
            transforms: TransformPrecision::CameraRelative,
        }
    }

    /// The reference preset: errors are below a step of the picture's 8-bit channels.
    pub fn exact() -> Self {
        Self {
            opaque_order: DepthPrecision { bits: 20, curve: DepthCurve::Logarithmic },
            culling: CullingVolume::OrientedBox,
            normals: NormalFormat::Octahedral16,
            diffuse: DiffuseFormat::HalfFloat,
            level_of_detail: 0.0,
            radiance_sum: RadianceSum::Shader,
            shadows: ShadowQuality { side: 2048, filter: 2, widest_edge: 2.0, ..ShadowQuality::default() },
            ..Self::balanced()
        }
    }

    /// Checks that all settings are valid.
    ///
    /// # Errors
    /// Returns a [`QualityError`] if a setting is out of range, or if two settings are incompatible.
    pub fn check(&self) -> Result<(), QualityError> {
        self.opaque_order.check("opaque_order", 0..=DepthPrecision::MAX_OPAQUE_BITS)?;
        self.blended_order.check("blended_order", 1..=DepthPrecision::MAX_BLENDED_BITS)?;
        self.check_occlusion()?;
        if !(self.light_cut_off >= 0.0 && self.light_cut_off.is_finite()) {
            let value = self.light_cut_off.to_string();
            return Err(QualityError::OutOfRange { setting: "light_cut_off", value, range: "0 or more, and finite" });
        }
        if !(self.level_of_detail >= 0.0 && self.level_of_detail.is_finite()) {
            let value = self.level_of_detail.to_string();
            return Err(QualityError::OutOfRange {
                setting: "level_of_detail",
                value,
                range: "0 pixels or more, and finite",
            });
        }
        self.shadows.check()
    }

    fn check_occlusion(&self) -> Result<(), QualityError> {
        let Some(tile_size) = self.occlusion else { return Ok(()) };
        if !cfg!(feature = "occlusion") {
            return Err(QualityError::OcclusionFeature);
        }
        if !Self::OCCLUSION_TILE_SIZES.contains(&tile_size) {
            return Err(QualityError::OutOfRange {
                setting: "occlusion",
                value: tile_size.to_string(),
                range: "1, 2, 4, 8 or 16 pixels",
            });
        }
        if self.culling == CullingVolume::None {
            return Err(QualityError::OcclusionWithoutVolume);
        }
        if self.transforms == TransformPrecision::Absolute {
            return Err(QualityError::OcclusionWithAbsoluteTransforms);
        }
        Ok(())
    }
}

impl Default for Quality {
    fn default() -> Self {
        Self::balanced()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_valid() {
        for preset in [Quality::fast(), Quality::balanced(), Quality::exact()] {
            assert_eq!(preset.check(), Ok(()));
        }
    }

    #[test]
    fn errors_name_the_invalid_setting() {
        let valid = Quality::exact();
        let shadows = valid.shadows;
        let order = |bits, curve| DepthPrecision { bits, curve };
        for (wrong, setting) in [
            (Quality { occlusion: Some(3), ..valid }, "occlusion"),
            (Quality { occlusion: Some(0), ..valid }, "occlusion"),
            (Quality { light_cut_off: -1.0, ..valid }, "light_cut_off"),
            (Quality { light_cut_off: f32::NAN, ..valid }, "light_cut_off"),
            (Quality { light_cut_off: f32::INFINITY, ..valid }, "light_cut_off"),
            (Quality { level_of_detail: -1.0, ..valid }, "level_of_detail"),
            (Quality { level_of_detail: f32::NAN, ..valid }, "level_of_detail"),
            (Quality { opaque_order: order(21, DepthCurve::Logarithmic), ..valid }, "opaque_order"),
            (Quality { blended_order: order(0, DepthCurve::Logarithmic), ..valid }, "blended_order"),
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
            let is_named = matches!(&error, QualityError::OutOfRange { setting: named, .. } if *named == setting);
            assert!(is_named, "{setting}: {error}");
        }
        let without_volume = Quality { occlusion: Some(8), culling: CullingVolume::None, ..valid };
        assert_eq!(without_volume.check(), Err(QualityError::OcclusionWithoutVolume));
        let absolute = Quality { occlusion: Some(8), transforms: TransformPrecision::Absolute, ..valid };
        assert_eq!(absolute.check(), Err(QualityError::OcclusionWithAbsoluteTransforms));
    }
}
