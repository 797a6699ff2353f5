//! The settings of the quality as a table, for panels that show them and programs that measure them.

use super::{
    CullingVolume, DepthCurve, DepthPrecision, DiffuseFormat, NormalFormat, Quality, RadianceSum, ToneCurve,
    TransformPrecision, VertexFormat,
};

type Setter = fn(&mut Quality);

/// A setting of [`Quality`] with values to choose from.
///
/// ```
/// use drawloom::quality::{Knob, Quality};
///
/// let knob = Knob::ALL.iter().find(|knob| knob.field == "shadows.side").unwrap();
/// let mut quality = Quality::balanced();
/// for (name, set) in knob.values {
///     set(&mut quality);
///     println!("{}: {name} is {} pixels", knob.name, quality.shadows.side);
/// }
/// ```
#[derive(Debug)]
pub struct Knob {
    /// The field, such as `shadows.side`.
    pub field: &'static str,
    /// What a panel calls it.
    pub name: &'static str,
    /// Its error and its cost.
    pub explanation: &'static str,
    /// Its values: the name of each with its unit, and what sets it. Those of the presets are among them.
    pub values: &'static [(&'static str, Setter)],
    copy: fn(&mut Quality, &Quality),
}

impl Knob {
    /// The index of the value that a quality has; `None` if it has another one.
    pub fn chosen(&self, quality: &Quality) -> Option<usize> {
        self.values.iter().position(|(_, set)| {
            let mut changed = *quality;
            set(&mut changed);
            changed == *quality
        })
    }

    /// Gives `quality` the value that `other` has.
    pub fn copy(&self, quality: &mut Quality, other: &Quality) {
        (self.copy)(quality, other);
    }
}

/// A knob: its field in brackets, name, explanation, and values by name.
macro_rules! knob {
    ($field:tt, $name:literal, $explanation:literal, { $($value:literal => $set:expr,)+ }) => {
        Knob {
            field: field!($field),
            name: $name,
            explanation: $explanation,
            values: &[$(($value, set!($field, $set))),+],
            copy: copy!($field),
        }
    };
}

macro_rules! field {
    ([$first:ident $(.$rest:ident)?]) => { concat!(stringify!($first) $(, ".", stringify!($rest))?) };
}

macro_rules! set {
    ([$first:ident $(.$rest:ident)?], $value:expr) => { |quality| quality.$first$(.$rest)? = $value };
}

macro_rules! copy {
    ([$first:ident $(.$rest:ident)?]) => { |quality, other| quality.$first$(.$rest)? = other.$first$(.$rest)? };
}

const fn logarithmic(bits: u32) -> DepthPrecision {
    DepthPrecision { bits, curve: DepthCurve::Logarithmic }
}

const fn linear_to_1_km(bits: u32) -> DepthPrecision {
    DepthPrecision { bits, curve: DepthCurve::Linear { far: 1000.0 } }
}

impl Knob {
    /// All settings, in the order of the fields of [`Quality`].
    pub const ALL: &[Self] = &[
        knob!(
            [opaque_order],
            "order of opaque objects",
            "Error: objects drawn back to front cost overdraw; the picture does not change. Cost: with bits, every visible object is a \
             command, and commands are sorted anew when something moves.",
            {
                "unordered" => DepthPrecision::UNORDERED,
                "1 bit, logarithmic" => logarithmic(1),
                "8 bits, logarithmic" => logarithmic(8),
                "16 bits, logarithmic" => logarithmic(16),
                "16 bits, linear to 1 km" => linear_to_1_km(16),
                "20 bits, logarithmic" => logarithmic(20),
            }
        ),
        knob!(
            [blended_order],
            "order of blended objects",
            "Error: pairs drawn in the wrong order, which is visible. Cost: one pass of the radix sort for about nine bits.",
            {
                "8 bits, logarithmic" => logarithmic(8),
                "16 bits, logarithmic" => logarithmic(16),
                "18 bits, logarithmic" => logarithmic(18),
                "24 bits, logarithmic" => logarithmic(24),
                "16 bits, linear to 1 km" => linear_to_1_km(16),
                "exact" => DepthPrecision::EXACT,
            }
        ),
        knob!(
            [culling],
            "culling volume",
            "Error: invisible objects that are drawn. Cost: the test of each object in each view.",
            {
                "none" => CullingVolume::None,
                "sphere" => CullingVolume::Sphere,
                "box" => CullingVolume::Box,
                "oriented box" => CullingVolume::OrientedBox,
            }
        ),
        #[cfg(feature = "occlusion")]
        knob!(
            [occlusion],
            "occlusion culling",
            "Error: hidden objects that are drawn. Cost: a coarse depth buffer for each view, of tiles of this size.",
            {
                "off" => None,
                "1 pixel" => Some(1),
                "2 pixels" => Some(2),
                "4 pixels" => Some(4),
                "8 pixels" => Some(8),
                "16 pixels" => Some(16),
            }
        ),
        knob!(
            [normals],
            "normals",
            "Error: degrees. Cost: bytes a pixel of the geometry buffer, read for every light that reaches the pixel.",
            {
                "octahedral, 8 bits" => NormalFormat::Octahedral8,
                "octahedral, 10 bits" => NormalFormat::Octahedral10,
                "octahedral, half floats" => NormalFormat::HalfFloat,
                "octahedral, 16 bits" => NormalFormat::Octahedral16,
            }
        ),
        knob!(
            [diffuse],
            "diffuse colours",
            "Error: steps of the colour. Cost: 4 or 8 bytes a pixel of the geometry buffer.",
            {
                "sRGB, 8 bits" => DiffuseFormat::Srgb8,
                "half floats" => DiffuseFormat::HalfFloat,
            }
        ),
        knob!(
            [vertices],
            "vertices",
            "Error: degrees of the normal, and texels. Cost: 20 or 32 bytes a vertex.",
            {
                "packed" => VertexFormat::Packed,
                "full" => VertexFormat::Full,
            }
        ),
        knob!(
            [level_of_detail],
            "levels of detail",
            "Error: pixels by which surfaces are off. Cost: a choice for each visible object; coarser levels save triangles. No effect on \
             meshes without levels.",
            {
                "full detail" => 0.0,
                "0.5 pixels" => 0.5,
                "1 pixel" => 1.0,
                "2 pixels" => 2.0,
                "4 pixels" => 4.0,
            }
        ),
        knob!(
            [depth_pre_pass],
            "depth pre-pass",
            "Error: none, but where surfaces coincide. Cost: all vertices twice; it saves the shading of hidden pixels.",
            {
                "off" => false,
                "on" => true,
            }
        ),
        knob!(
            [shadows.side],
            "size of shadow maps",
            "Error: blocky edges of shadows. Cost: pixels, with its square.",
            {
                "256 pixels" => 256,
                "512 pixels" => 512,
                "1024 pixels" => 1024,
                "2048 pixels" => 2048,
                "4096 pixels" => 4096,
            }
        ),
        knob!(
            [shadows.filter],
            "filter of shadows",
            "Error: hard, blocky edges. Cost: samples of the map for each pixel and light, with its square.",
            {
                "none" => 0,
                "1 texel" => 1,
                "2 texels" => 2,
                "4 texels" => 4,
            }
        ),
        knob!(
            [shadows.bias],
            "bias of shadows",
            "Error: too small, and surfaces shadow themselves; too large, and shadows leave their objects. No cost.",
            {
                "0.5" => 0.5,
                "1" => 1.0,
                "2" => 2.0,
                "4" => 4.0,
            }
        ),
        knob!(
            [shadows.interval],
            "redraw interval of shadow maps",
            "Error: shadows lag behind. Cost: one frame in this many draws a map.",
            {
                "every frame" => 1,
                "every 2nd frame" => 2,
                "every 4th frame" => 4,
                "every 8th frame" => 8,
            }
        ),
        knob!(
            [shadows.widest_edge],
            "edges in paraboloid maps",
            "Error: straight edges of large triangles bend in a paraboloid. Cost: triangles are \
             subdivided until each edge spans at most this angle.",
            {
                "2°" => 2.0,
                "5°" => 5.0,
                "10°" => 10.0,
                "20°" => 20.0,
                "45°" => 45.0,
            }
        ),
        knob!(
            [light_cut_off],
            "cut-off of lights",
            "Error: each light differs by at most 1.089 times this illuminance. Cost: the pixels within the lights' reach.",
            {
                "none" => 0.0,
                "1/1020" => 1.0 / 1020.0,
                "1/255" => 1.0 / 255.0,
                "4/255" => 4.0 / 255.0,
            }
        ),
        knob!(
            [radiance_sum],
            "sum of lights",
            "Error: a fraction of the sum, 1/1024 for each light in half floats; in all 1/1024 with a shader, and 2⁻²³ more for each light \
             with floats. Cost: bytes a pixel for each light that reaches it; with a shader, every pixel tests those of its tile.",
            {
                "half floats" => RadianceSum::HalfFloat,
                "floats" => RadianceSum::Float,
                "shader" => RadianceSum::Shader,
            }
        ),
        knob!(
            [tone_curve],
            "tone curve",
            "Error: the picture's contrast. Cost: some operations a pixel.",
            {
                "filmic" => ToneCurve::Filmic,
                "clipped" => ToneCurve::Clipped,
            }
        ),
        knob!(
            [transforms],
            "transforms",
            "Error: pixels, the farther the camera is from the world's origin. Cost: some integer operations a vertex.",
            {
                "camera-relative" => TransformPrecision::CameraRelative,
                "absolute" => TransformPrecision::Absolute,
            }
        ),
    ];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quality::ShadowQuality;

    /// The fields and their values. Names every field, so that a new one is an error here until it has a knob.
    fn fields(quality: &Quality) -> Vec<(&'static str, String)> {
        let &Quality {
            opaque_order,
            blended_order,
            culling,
            #[cfg(feature = "occlusion")]
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
            ("opaque_order", format!("{opaque_order:?}")),
            ("blended_order", format!("{blended_order:?}")),
            ("culling", format!("{culling:?}")),
            #[cfg(feature = "occlusion")]
            ("occlusion", format!("{occlusion:?}")),
            ("normals", format!("{normals:?}")),
            ("diffuse", format!("{diffuse:?}")),
            ("vertices", format!("{vertices:?}")),
            ("level_of_detail", format!("{level_of_detail:?}")),
            ("depth_pre_pass", format!("{depth_pre_pass:?}")),
            ("shadows.side", format!("{side:?}")),
            ("shadows.filter", format!("{filter:?}")),
            ("shadows.bias", format!("{bias:?}")),
            ("shadows.interval", format!("{interval:?}")),
            ("shadows.widest_edge", format!("{widest_edge:?}")),
            ("light_cut_off", format!("{light_cut_off:?}")),
            ("radiance_sum", format!("{radiance_sum:?}")),
            ("tone_curve", format!("{tone_curve:?}")),
            ("transforms", format!("{transforms:?}")),
        ]
    }

    /// The fields whose values differ.
    fn differing(one: &Quality, other: &Quality) -> Vec<&'static str> {
        let pairs = fields(one).into_iter().zip(fields(other));
        pairs.filter(|(one, other)| one != other).map(|((field, _), _)| field).collect()
    }

    #[test]
    fn every_field_has_one_knob_and_a_knob_changes_nothing_else() {
        let names: Vec<_> = fields(&Quality::default()).into_iter().map(|(field, _)| field).collect();
        assert_eq!(Knob::ALL.iter().map(|knob| knob.field).collect::<Vec<_>>(), names);
        for knob in Knob::ALL {
            let mut changes = 0;
            for (name, set) in knob.values {
                let (mut quality, mut copied) = (Quality::default(), Quality::default());
                set(&mut quality);
                let differing = differing(&quality, &Quality::default());
                assert!(differing.is_empty() || differing == [knob.field], "{name}: {differing:?}");
                changes += differing.len();
                knob.copy(&mut copied, &quality);
                assert_eq!(copied, quality, "{}", knob.field);
            }
            assert!(changes + 1 >= knob.values.len(), "{}: two values are the same", knob.field);
        }
    }

    #[test]
    fn values_are_valid_and_those_of_presets_are_among_them() {
        for knob in Knob::ALL {
            for (name, set) in knob.values {
                let mut quality = Quality::balanced();
                set(&mut quality);
                assert_eq!(quality.check(), Ok(()), "{}: {name}", knob.field);
            }
            for preset in [Quality::fast(), Quality::balanced(), Quality::exact()] {
                assert!(knob.chosen(&preset).is_some(), "{}", knob.field);
            }
        }
    }
}
