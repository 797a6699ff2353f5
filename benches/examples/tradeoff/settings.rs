//! The settings that are measured: each knob alone at each of its settings, and the presets.

use drawloom::ViewForm;
use drawloom::quality::{
    CullingVolume, DepthCurve, DepthKey, DiffuseFormat, NormalFormat, Quality, RadianceSum, ShadowQuality, ToneCurve,
    TransformPrecision, VertexFormat,
};
use drawloom::view::ShadowMaps;

use crate::configuration::Configuration;
use crate::subject::Subject;

/// A setting of one knob, with all others as in [`Configuration::exact`]; or a preset.
#[derive(Clone, Debug)]
pub struct Setting {
    pub knob: Knob,
    /// Its name in reports.
    pub name: String,
    pub configuration: Configuration,
}

impl Setting {
    /// Whether its frames show pictures of earlier frames.
    pub fn keeps_pictures(&self) -> bool {
        let Configuration { quality, mirrors, impostor, .. } = self.configuration;
        quality.shadows.interval > 1 || mirrors.interval > 1 || impostor.is_some()
    }
}

/// What trades accuracy for speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Knob {
    Preset,
    OpaqueOrder,
    BlendedOrder,
    Culling,
    Occlusion,
    Normals,
    Diffuse,
    Vertices,
    LevelOfDetail,
    DepthPrePass,
    ShadowSide,
    ShadowFilter,
    ShadowBias,
    ShadowInterval,
    ShadowEdge,
    LightCutOff,
    RadianceSum,
    ToneCurve,
    Transforms,
    Cascades,
    MaxDistance,
    Redraw,
    ViewSize,
    ViewLevelOfDetail,
    ViewCameras,
    ViewLeftOut,
    ImpostorAngle,
}

impl Knob {
    /// All knobs, in the order of reports.
    pub const ALL: [Self; 27] = [
        Self::Preset,
        Self::OpaqueOrder,
        Self::BlendedOrder,
        Self::Culling,
        Self::Occlusion,
        Self::Normals,
        Self::Diffuse,
        Self::Vertices,
        Self::LevelOfDetail,
        Self::DepthPrePass,
        Self::ShadowSide,
        Self::ShadowFilter,
        Self::ShadowBias,
        Self::ShadowInterval,
        Self::ShadowEdge,
        Self::LightCutOff,
        Self::RadianceSum,
        Self::ToneCurve,
        Self::Transforms,
        Self::Cascades,
        Self::MaxDistance,
        Self::Redraw,
        Self::ViewSize,
        Self::ViewLevelOfDetail,
        Self::ViewCameras,
        Self::ViewLeftOut,
        Self::ImpostorAngle,
    ];

    /// Where an engine sets it: a field of `Quality`, unless a type is named.
    pub fn name(self) -> &'static str {
        match self {
            Self::Preset => "preset",
            Self::OpaqueOrder => "opaque_order",
            Self::BlendedOrder => "blended_order",
            Self::Culling => "culling",
            Self::Occlusion => "occlusion",
            Self::Normals => "normals",
            Self::Diffuse => "diffuse",
            Self::Vertices => "vertices",
            Self::LevelOfDetail => "level_of_detail",
            Self::DepthPrePass => "depth_pre_pass",
            Self::ShadowSide => "shadows.side",
            Self::ShadowFilter => "shadows.filter",
            Self::ShadowBias => "shadows.bias",
            Self::ShadowInterval => "shadows.interval",
            Self::ShadowEdge => "shadows.widest_edge",
            Self::LightCutOff => "light_cut_off",
            Self::RadianceSum => "radiance_sum",
            Self::ToneCurve => "tone_curve",
            Self::Transforms => "transforms",
            Self::Cascades => "ShadowMaps.cascades",
            Self::MaxDistance => "ShadowMaps.max_distance",
            Self::Redraw => "Camera.redraw",
            Self::ViewSize => "ViewForm.size",
            Self::ViewLevelOfDetail => "ViewForm.level_of_detail_scale",
            Self::ViewCameras => "ViewForm.max_cameras",
            Self::ViewLeftOut => "Rung.LeftOut",
            Self::ImpostorAngle => "Camera.impostor",
        }
    }

    /// `configuration` with this knob set as in `other`.
    pub fn changed(self, configuration: &Configuration, other: &Configuration) -> Configuration {
        let mut changed = *configuration;
        let (quality, others) = (&mut changed.quality, &other.quality);
        let (form, forms) = (&mut changed.mirrors, &other.mirrors);
        match self {
            Self::Preset => changed = *other,
            Self::OpaqueOrder => quality.opaque_order = others.opaque_order,
            Self::BlendedOrder => quality.blended_order = others.blended_order,
            Self::Culling => quality.culling = others.culling,
            Self::Occlusion => quality.occlusion = others.occlusion,
            Self::Normals => quality.normals = others.normals,
            Self::Diffuse => quality.diffuse = others.diffuse,
            Self::Vertices => quality.vertices = others.vertices,
            Self::LevelOfDetail => quality.level_of_detail = others.level_of_detail,
            Self::DepthPrePass => quality.depth_pre_pass = others.depth_pre_pass,
            Self::ShadowSide => quality.shadows.side = others.shadows.side,
            Self::ShadowFilter => quality.shadows.filter = others.shadows.filter,
            Self::ShadowBias => quality.shadows.bias = others.shadows.bias,
            Self::ShadowInterval => quality.shadows.interval = others.shadows.interval,
            Self::ShadowEdge => quality.shadows.widest_edge = others.shadows.widest_edge,
            Self::LightCutOff => quality.light_cut_off = others.light_cut_off,
            Self::RadianceSum => quality.radiance_sum = others.radiance_sum,
            Self::ToneCurve => quality.tone_curve = others.tone_curve,
            Self::Transforms => quality.transforms = others.transforms,
            Self::Cascades => changed.maps.cascades = other.maps.cascades,
            Self::MaxDistance => changed.maps.max_distance = other.maps.max_distance,
            Self::Redraw => form.interval = forms.interval,
            Self::ViewSize => form.size = forms.size,
            Self::ViewLevelOfDetail => form.level_of_detail_scale = forms.level_of_detail_scale,
            Self::ViewCameras => form.max_cameras = forms.max_cameras,
            Self::ViewLeftOut => changed.draws_mirrors = other.draws_mirrors,
            Self::ImpostorAngle => changed.impostor = other.impostor,
        }
        changed
    }
}

/// All settings of what the subject has; [`Configuration::exact`] first.
pub fn all(subject: &Subject) -> Vec<Setting> {
    let exact = Configuration::exact();
    let mut settings = Vec::new();
    let mut add =
        |knob, name: &str, configuration| settings.push(Setting { knob, name: name.to_owned(), configuration });
    add(Knob::Preset, "exact", exact);
    add(Knob::Preset, "balanced", Configuration::preset(Quality::balanced()));
    add(Knob::Preset, "fast", Configuration::preset(Quality::fast()));
    add_of_quality(|knob, name, quality| add(knob, name, Configuration { quality, ..exact }));
    add_of_maps(|knob, name, maps| add(knob, name, Configuration { maps, ..exact }));
    if !subject.mirrors.is_empty() {
        add_of_mirrors(&mut add);
    }
    if subject.impostor.is_some() {
        for degrees in [0.0, 0.5, 2.0, 5.0] {
            let impostor = Some(degrees);
            add(Knob::ImpostorAngle, &format!("{degrees}°"), Configuration { impostor, ..exact });
        }
    }
    settings
}

fn add_of_maps(mut add: impl FnMut(Knob, &str, ShadowMaps)) {
    let exact = Configuration::exact().maps;
    for cascades in 1..exact.cascades {
        add(Knob::Cascades, &cascades.to_string(), ShadowMaps { cascades, ..exact });
    }
    for max_distance in [7.5, 15.0, 30.0] {
        add(Knob::MaxDistance, &format!("{max_distance} m"), ShadowMaps { max_distance, ..exact });
    }
}

fn add_of_mirrors(mut add: impl FnMut(Knob, &str, Configuration)) {
    let exact = Configuration::exact();
    let best = ViewForm::BEST;
    let drawn = |mirrors| Configuration { mirrors, ..exact };
    for interval in [2, 4] {
        add(Knob::Redraw, &format!("{interval} frames"), drawn(ViewForm { interval, ..best }));
    }
    for size in [0.5, 0.25] {
        add(Knob::ViewSize, &size.to_string(), drawn(ViewForm { size, ..best }));
    }
    for level_of_detail_scale in [2.0, 4.0] {
        // There is nothing to scale in `exact`.
        let quality = Quality { level_of_detail: 1.0, ..exact.quality };
        let configuration = Configuration { quality, ..drawn(ViewForm { level_of_detail_scale, ..best }) };
        add(Knob::ViewLevelOfDetail, &format!("{level_of_detail_scale} × 1 pixel"), configuration);
    }
    add(Knob::ViewCameras, "1 of 2", drawn(ViewForm { max_cameras: 1, ..best }));
    add(Knob::ViewLeftOut, "left out", Configuration { draws_mirrors: false, ..exact });
}

/// The settings of the fields of [`Quality`].
fn add_of_quality(mut add: impl FnMut(Knob, &str, Quality)) {
    let exact = Quality::exact();

    let far = 1000.0;
    let key = |bits, curve| DepthKey { bits, curve };
    add(Knob::OpaqueOrder, "unordered", Quality { opaque_order: DepthKey::UNORDERED, ..exact });
    for bits in [1, 8, 16] {
        let name = format!("{bits} {}, logarithmic", if bits == 1 { "bit" } else { "bits" });
        add(Knob::OpaqueOrder, &name, Quality { opaque_order: key(bits, DepthCurve::Logarithmic), ..exact });
    }
    add(
        Knob::OpaqueOrder,
        "16 bits, linear to 1 km",
        Quality { opaque_order: key(16, DepthCurve::Linear { far }), ..exact },
    );
    for bits in [8, 16, 24] {
        let name = format!("{bits} bits, logarithmic");
        add(Knob::BlendedOrder, &name, Quality { blended_order: key(bits, DepthCurve::Logarithmic), ..exact });
    }
    add(
        Knob::BlendedOrder,
        "16 bits, linear to 1 km",
        Quality { blended_order: key(16, DepthCurve::Linear { far }), ..exact },
    );
    for (name, culling) in
        [("none", CullingVolume::None), ("sphere", CullingVolume::Sphere), ("box", CullingVolume::Box)]
    {
        add(Knob::Culling, name, Quality { culling, ..exact });
    }
    for tile_size in Quality::OCCLUSION_TILE_SIZES {
        add(Knob::Occlusion, &format!("1/{tile_size}"), Quality { occlusion: Some(tile_size), ..exact });
    }
    for (name, normals) in [
        ("octahedral, 8 bits", NormalFormat::Octahedral8),
        ("octahedral, 10 bits", NormalFormat::Octahedral10),
        ("octahedral, half floats", NormalFormat::HalfFloat),
    ] {
        add(Knob::Normals, name, Quality { normals, ..exact });
    }
    add(Knob::Diffuse, "sRGB, 8 bits", Quality { diffuse: DiffuseFormat::Srgb8, ..exact });
    add(Knob::Vertices, "packed", Quality { vertices: VertexFormat::Packed, ..exact });
    for level_of_detail in [0.5, 1.0, 2.0, 4.0] {
        let name = format!("{level_of_detail} pixels");
        add(Knob::LevelOfDetail, &name, Quality { level_of_detail, ..exact });
    }
    add(Knob::DepthPrePass, "on", Quality { depth_pre_pass: true, ..exact });

    let shadows = exact.shadows;
    let shadowed = |shadows| Quality { shadows, ..exact };
    for side in [256, 512, 1024] {
        add(Knob::ShadowSide, &format!("{side} pixels"), shadowed(ShadowQuality { side, ..shadows }));
    }
    for filter in [0, 1] {
        add(Knob::ShadowFilter, &filter.to_string(), shadowed(ShadowQuality { filter, ..shadows }));
    }
    for bias in [0.5, 2.0] {
        add(Knob::ShadowBias, &bias.to_string(), shadowed(ShadowQuality { bias, ..shadows }));
    }
    for interval in [2, 4] {
        add(Knob::ShadowInterval, &format!("{interval} frames"), shadowed(ShadowQuality { interval, ..shadows }));
    }
    for widest_edge in [5.0, 10.0, 20.0, 45.0] {
        add(Knob::ShadowEdge, &format!("{widest_edge}°"), shadowed(ShadowQuality { widest_edge, ..shadows }));
    }
    for (name, light_cut_off) in [("1/1020", 1.0 / 1020.0), ("1/255", 1.0 / 255.0), ("4/255", 4.0 / 255.0)] {
        add(Knob::LightCutOff, name, Quality { light_cut_off, ..exact });
    }
    for (name, radiance_sum) in
        [("half floats", RadianceSum::HalfFloat), ("floats", RadianceSum::Float), ("shader", RadianceSum::Shader)]
    {
        add(Knob::RadianceSum, name, Quality { radiance_sum, ..exact });
    }
    add(Knob::ToneCurve, "clipped", Quality { tone_curve: ToneCurve::Clipped, ..exact });
    add(Knob::Transforms, "camera-relative", exact);
    add(Knob::Transforms, "absolute", Quality { transforms: TransformPrecision::Absolute, ..exact });
}
