//! The settings of the quality, each with values to choose from.

use drawloom::quality::{
    CullingVolume, DepthCurve, DepthKey, DiffuseFormat, NormalFormat, Quality, RadianceSum, ToneCurve,
    TransformPrecision, VertexFormat,
};

/// A setting of the quality.
#[derive(Debug)]
pub struct Knob {
    pub name: &'static str,
    /// Its error and its cost.
    pub explanation: &'static str,
    /// Its values: their names, and what sets them.
    pub values: &'static [(&'static str, SetValue)],
}

type SetValue = fn(&mut Quality);

impl Knob {
    /// The index of the value that a quality has; `None` if it has another one.
    pub fn chosen(&self, quality: &Quality) -> Option<usize> {
        self.values.iter().position(|(_, apply)| {
            let mut changed_quality = *quality;
            apply(&mut changed_quality);
            changed_quality == *quality
        })
    }
}

const fn logarithmic(bits: u32) -> DepthKey {
    DepthKey { bits, curve: DepthCurve::Logarithmic }
}

/// All settings, as in [`Quality`].
pub const KNOBS: &[Knob] = &[
    Knob {
        name: "order of opaque objects",
        explanation: "Error: objects drawn back to front cost overdraw; the picture does not change. Cost: with bits, every visible \
            object is a command, and commands are sorted anew when something moves.",
        values: &[
            ("unordered", |quality| quality.opaque_order = DepthKey::UNORDERED),
            ("10 bits", |quality| quality.opaque_order = logarithmic(10)),
            ("20 bits", |quality| quality.opaque_order = logarithmic(20)),
        ],
    },
    Knob {
        name: "order of blended objects",
        explanation: "Error: pairs drawn in the wrong order, which is visible. Cost: a pass of the radix sort for some nine bits.",
        values: &[
            ("9 bits", |quality| quality.blended_order = logarithmic(9)),
            ("18 bits", |quality| quality.blended_order = logarithmic(18)),
            ("exact", |quality| quality.blended_order = DepthKey::EXACT),
        ],
    },
    Knob {
        name: "culling volume",
        explanation: "Error: invisible objects that are drawn. Cost: the test of each object in each view.",
        values: &[
            ("none", |quality| quality.culling = CullingVolume::None),
            ("sphere", |quality| quality.culling = CullingVolume::Sphere),
            ("box", |quality| quality.culling = CullingVolume::Box),
            ("oriented box", |quality| quality.culling = CullingVolume::OrientedBox),
        ],
    },
    #[cfg(feature = "occlusion")]
    Knob {
        name: "occlusion culling",
        explanation: "Error: hidden objects that are drawn. Cost: a coarse depth buffer for each view, of tiles of this size.",
        values: &[
            ("off", |quality| quality.occlusion = None),
            ("16 pixels", |quality| quality.occlusion = Some(16)),
            ("8 pixels", |quality| quality.occlusion = Some(8)),
            ("4 pixels", |quality| quality.occlusion = Some(4)),
            ("2 pixels", |quality| quality.occlusion = Some(2)),
            ("1 pixel", |quality| quality.occlusion = Some(1)),
        ],
    },
    Knob {
        name: "normals",
        explanation: "Error: degrees. Cost: bytes a pixel of the geometry buffer, read for every light that reaches the pixel.",
        values: &[
            ("octahedral, 8 bits", |quality| quality.normals = NormalFormat::Octahedral8),
            ("octahedral, 10 bits", |quality| quality.normals = NormalFormat::Octahedral10),
            ("octahedral, 16 bits", |quality| quality.normals = NormalFormat::Octahedral16),
            ("half floats", |quality| quality.normals = NormalFormat::HalfFloat),
        ],
    },
    Knob {
        name: "diffuse colours",
        explanation: "Error: steps of the colour. Cost: 4 or 8 bytes a pixel of the geometry buffer.",
        values: &[
            ("sRGB, 8 bits", |quality| quality.diffuse = DiffuseFormat::Srgb8),
            ("half floats", |quality| quality.diffuse = DiffuseFormat::HalfFloat),
        ],
    },
    Knob {
        name: "vertices",
        explanation: "Error: degrees of the normal, and texels. Cost: 20 or 32 bytes a vertex.",
        values: &[
            ("packed", |quality| quality.vertices = VertexFormat::Packed),
            ("full", |quality| quality.vertices = VertexFormat::Full),
        ],
    },
    Knob {
        name: "levels of detail",
        explanation: "Error: pixels by which surfaces are off. Cost: a choice for each visible object; coarser levels save triangles. No \
            effect on meshes without levels.",
        values: &[
            ("full detail", |quality| quality.level_of_detail = 0.0),
            ("0.5 pixels", |quality| quality.level_of_detail = 0.5),
            ("1 pixel", |quality| quality.level_of_detail = 1.0),
            ("2 pixels", |quality| quality.level_of_detail = 2.0),
            ("4 pixels", |quality| quality.level_of_detail = 4.0),
        ],
    },
    Knob {
        name: "depth pre-pass",
        explanation: "Error: none, but where surfaces coincide. Cost: all vertices twice; it saves the shading of hidden pixels.",
        values: &[("off", |quality| quality.depth_pre_pass = false), ("on", |quality| quality.depth_pre_pass = true)],
    },
    Knob {
        name: "size of shadow maps",
        explanation: "Error: blocky edges of shadows. Cost: pixels, with its square.",
        values: &[
            ("512", |quality| quality.shadows.side = 512),
            ("1024", |quality| quality.shadows.side = 1024),
            ("2048", |quality| quality.shadows.side = 2048),
            ("4096", |quality| quality.shadows.side = 4096),
        ],
    },
    Knob {
        name: "filter of shadows",
        explanation: "Error: hard, blocky edges. Cost: samples of the map for each pixel and light, with its square.",
        values: &[
            ("none", |quality| quality.shadows.filter = 0),
            ("1 texel", |quality| quality.shadows.filter = 1),
            ("2 texels", |quality| quality.shadows.filter = 2),
            ("4 texels", |quality| quality.shadows.filter = 4),
        ],
    },
    Knob {
        name: "bias of shadows",
        explanation: "Error: too small, and surfaces shadow themselves; too large, and shadows leave their objects. No cost.",
        values: &[
            ("0.5", |quality| quality.shadows.bias = 0.5),
            ("1", |quality| quality.shadows.bias = 1.0),
            ("2", |quality| quality.shadows.bias = 2.0),
            ("4", |quality| quality.shadows.bias = 4.0),
        ],
    },
    Knob {
        name: "frames between shadow maps",
        explanation: "Error: shadows that lag behind. Cost: a map is drawn in one frame of so many.",
        values: &[
            ("every frame", |quality| quality.shadows.interval = 1),
            ("every 2nd", |quality| quality.shadows.interval = 2),
            ("every 4th", |quality| quality.shadows.interval = 4),
            ("every 8th", |quality| quality.shadows.interval = 8),
        ],
    },
    Knob {
        name: "edges in paraboloid maps",
        explanation: "Error: straight edges of large triangles bend in a paraboloid. Cost: triangles that are subdivided until their edges \
            are seen under this angle.",
        values: &[
            ("2°", |quality| quality.shadows.widest_edge = 2.0),
            ("5°", |quality| quality.shadows.widest_edge = 5.0),
            ("10°", |quality| quality.shadows.widest_edge = 10.0),
            ("20°", |quality| quality.shadows.widest_edge = 20.0),
        ],
    },
    Knob {
        name: "cut-off of lights",
        explanation: "Error: each light differs by at most 1.089 times this illuminance. Cost: the pixels within the lights' reach.",
        values: &[
            ("none", |quality| quality.light_cut_off = 0.0),
            ("1/255", |quality| quality.light_cut_off = 1.0 / 255.0),
            ("4/255", |quality| quality.light_cut_off = 4.0 / 255.0),
        ],
    },
    Knob {
        name: "sum of lights",
        explanation: "Error: a fraction of the sum, 1/1024 for each light in half floats; in all 1/1024 with a shader, and 2⁻²³ more for each light with floats. Cost: bytes a pixel for each \
            light that reaches it; with a shader, every pixel tests those of its tile.",
        values: &[
            ("half floats", |quality| quality.radiance_sum = RadianceSum::HalfFloat),
            ("floats", |quality| quality.radiance_sum = RadianceSum::Float),
            ("a shader", |quality| quality.radiance_sum = RadianceSum::Shader),
        ],
    },
    Knob {
        name: "tone curve",
        explanation: "Error: the picture's contrast. Cost: some operations a pixel.",
        values: &[
            ("filmic", |quality| quality.tone_curve = ToneCurve::Filmic),
            ("clipped", |quality| quality.tone_curve = ToneCurve::Clipped),
        ],
    },
    Knob {
        name: "transforms",
        explanation: "Error: pixels, the farther the camera is from the world's origin. Cost: some integer operations a vertex.",
        values: &[
            ("relative to the camera", |quality| quality.transforms = TransformPrecision::CameraRelative),
            ("absolute", |quality| quality.transforms = TransformPrecision::Absolute),
        ],
    },
];

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use drawloom::quality::ShadowQuality;

    use super::*;

    /// Names every field, so that a new one is an error here until it has a knob.
    fn fields(quality: &Quality) -> Vec<String> {
        let &Quality {
            opaque_order,
            blended_order,
            culling,
            occlusion,
            normals,
            diffuse,
            vertices,
            level_of_detail,
            depth_pre_pass,
            shadows: ShadowQuality { side, filter, bias, interval, widest_edge },
            light_cut_off,
            radiance_sum,
            tone_curve,
            transforms,
        } = quality;
        vec![
            format!("{opaque_order:?}"),
            format!("{blended_order:?}"),
            format!("{culling:?}"),
            format!("{occlusion:?}"),
            format!("{normals:?}"),
            format!("{diffuse:?}"),
            format!("{vertices:?}"),
            format!("{level_of_detail:?}"),
            format!("{depth_pre_pass:?}"),
            format!("{side:?}"),
            format!("{filter:?}"),
            format!("{bias:?}"),
            format!("{interval:?}"),
            format!("{widest_edge:?}"),
            format!("{light_cut_off:?}"),
            format!("{radiance_sum:?}"),
            format!("{tone_curve:?}"),
            format!("{transforms:?}"),
        ]
    }

    #[test]
    fn every_field_has_one_knob_and_a_knob_changes_nothing_else() {
        let default = Quality::default();
        let before = fields(&default);
        let mut changed_fields = HashSet::new();
        for knob in KNOBS {
            let changed_by = |apply: &fn(&mut Quality)| {
                let mut quality = default;
                apply(&mut quality);
                let after = fields(&quality);
                (0..before.len()).filter(|&field| before[field] != after[field]).collect::<Vec<_>>()
            };
            let changed: HashSet<usize> = knob.values.iter().flat_map(|(_, apply)| changed_by(apply)).collect();
            assert_eq!(changed.len(), 1, "{}", knob.name);
            assert!(changed_fields.is_disjoint(&changed), "{}", knob.name);
            changed_fields.extend(changed);
        }
        assert_eq!(changed_fields.len(), before.len());
    }

    #[test]
    fn values_are_valid_and_presets_are_among_them() {
        for knob in KNOBS {
            for (name, apply) in knob.values {
                let mut quality = Quality::balanced();
                apply(&mut quality);
                assert_eq!(quality.check(), Ok(()), "{}: {name}", knob.name);
            }
            for preset in [Quality::fast(), Quality::balanced(), Quality::exact()] {
                assert!(knob.chosen(&preset).is_some(), "{}", knob.name);
            }
        }
    }
}
