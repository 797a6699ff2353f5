//! Lighting by a shader that sums all lights.

#[cfg(feature = "software")]
mod cpu_shader;

use super::light_tiles::LIGHT_TILES_SHADER;
use super::shading::{ILLUMINATION_SHADER, LIGHT_BATCHES_SHADER, shadow_shader};
use super::{GeometryFormats, LightClasses, LightTiles};
use crate::process::{Declare, Draws, FullScreen, RenderProcess, targets};
use crate::scene::{Blend, ViewKind};
use crate::view::{LightClass, ShadowMaps};

/// Lights the geometry buffer with the lights of several classes, and adds the sum of the reflected light to the target
/// `radiance` once: see [`RadianceSum::Shader`](crate::quality::RadianceSum::Shader). Of each pixel it tests the lights
/// that [`LightTiles`] marks. [`LightVolumes`](super::LightVolumes) adds them one by one.
#[derive(Clone, Debug)]
pub(super) struct LightSum {
    shader: String,
    #[cfg_attr(not(feature = "software"), expect(dead_code, reason = "the WGSL is generated for them"))]
    classes: LightClasses,
    #[cfg_attr(not(feature = "software"), expect(dead_code, reason = "the WGSL is generated for them"))]
    formats: GeometryFormats,
    maps: Option<ShadowMaps>,
}

impl LightSum {
    pub(super) const NAME: &str = "sum of lights";

    /// `maps` are those that [`ShadowCasters`](super::ShadowCasters) draws, if there are any.
    pub(super) fn new(classes: LightClasses, formats: GeometryFormats, maps: Option<&ShadowMaps>) -> Self {
        let shader = [
            &formats.normal_encoding_wgsl(),
            ILLUMINATION_SHADER,
            &shadow_shader(maps.map(|maps| (SHADOW_MAPS_BINDING, maps))),
            &format!("const CLASSES: u32 = {:#x}u;\n", classes.bits()),
            LIGHT_TILES_SHADER,
            LIGHT_BATCHES_SHADER,
            &include_str!("light_sum/light_sum.wgsl").replace("ENDED_CLASSES", &ended_classes()),
        ];
        Self { shader: shader.concat(), classes, formats, maps: maps.copied() }
    }
}

/// Counts the classes of lights that end before an index, in the four parts of a vector.
fn ended_classes() -> String {
    let vectors = 0..LightClass::COUNT.div_ceil(4);
    let ended = vectors.map(|vector| format!("vec4<u32>(vec4<u32>(index) >= view.light_ends[{vector}])"));
    ended.collect::<Vec<_>>().join(" + ")
}

/// After depth, normal, diffuse and tiles.
const SHADOW_MAPS_BINDING: u32 = 5;

impl RenderProcess for LightSum {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(targets::DEPTH);
        declare.samples(targets::NORMAL);
        declare.samples(targets::DIFFUSE);
        declare.samples(LightTiles::TARGET);
        if self.maps.is_some() {
            declare.samples_layers(ViewKind::Shadow, targets::SHADOW_MAP);
        }
        declare.draws_over(targets::RADIANCE);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen { shader: &self.shader, blend: Blend::Additive, ..FullScreen::default() })
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<crate::process::CpuShader> {
        let shader = cpu_shader::LightSumCpuShader::new(self.classes, self.formats, self.maps.as_ref());
        Some(crate::process::CpuShader::full_screen(shader))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shaders_know_where_each_class_of_lights_ends() {
        let vectors = LightClass::COUNT.div_ceil(4);
        let shader = LightSum::new(LightClasses::default(), GeometryFormats::default(), None).shader;
        assert_eq!(shader.matches("view.light_ends[").count(), vectors);
    }
}
