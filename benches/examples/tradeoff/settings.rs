//! The settings that are measured: each knob alone at each of its settings, and the presets.

use drawloom::quality::{
    CullingVolume, DepthCurve, DepthKey, DiffuseFormat, NormalFormat, Quality, RadianceSum, ShadowQuality, ToneCurve,
    TransformPrecision, VertexFormat,
};

/// A setting of one knob, with all others as in [`Quality::exact`]; or a preset.
#[derive(Clone, Debug)]
pub struct Setting {
    pub knob: Knob,
    /// Its name in reports.
    pub name: String,
    pub quality: Quality,
}

/// A quality knob.
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
}

impl Knob {
    /// All knobs, in the order of reports.
    pub const ALL: [Self; 19] = [
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
    ];

    /// The name of the field of `Quality`.
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
        }
    }

    /// `quality` with this knob set as in `other`.
    pub fn changed(self, quality: &Quality, other: &Quality) -> Quality {
        let mut changed = *quality;
        match self {
            Self::Preset => changed = *other,
            Self::OpaqueOrder => changed.opaque_order = other.opaque_order,
            Self::BlendedOrder => changed.blended_order = other.blended_order,
            Self::Culling => changed.culling = other.culling,
            Self::Occlusion => changed.occlusion = other.occlusion,
            Self::Normals => changed.normals = other.normals,
            Self::Diffuse => changed.diffuse = other.diffuse,
            Self::Vertices => changed.vertices = other.vertices,
            Self::LevelOfDetail => changed.level_of_detail = other.level_of_detail,
            Self::DepthPrePass => changed.depth_pre_pass = other.depth_pre_pass,
            Self::ShadowSide => changed.shadows.side = other.shadows.side,
            Self::ShadowFilter => changed.shadows.filter = other.shadows.filter,
            Self::ShadowBias => changed.shadows.bias = other.shadows.bias,
            Self::ShadowInterval => changed.shadows.interval = other.shadows.interval,
            Self::ShadowEdge => changed.shadows.widest_edge = other.shadows.widest_edge,
            Self::LightCutOff => changed.light_cut_off = other.light_cut_off,
            Self::RadianceSum => changed.radiance_sum = other.radiance_sum,
            Self::ToneCurve => changed.tone_curve = other.tone_curve,
            Self::Transforms => changed.transforms = other.transforms,
        }
        changed
    }
}

/// All settings; [`Quality::exact`] first.
pub fn all() -> Vec<Setting> {
    let mut settings = Vec::new();
    let mut add = |knob, name: &str, quality| settings.push(Setting { knob, name: name.to_owned(), quality });
    let exact = Quality::exact();
    for (name, quality) in [("exact", exact), ("balanced", Quality::balanced()), ("fast", Quality::fast())] {
        add(Knob::Preset, name, quality);
    }

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
    settings
}
