//! Lighting by a shader that sums all lights.

#[cfg(feature = "software")]
mod cpu_shader;

use super::light_tiles::LIGHT_TILES_SHADER;
use super::shading::{ILLUMINATION_SHADER, LIGHT_BATCHES_SHADER, shadow_shader};
use super::{GeometryFormats, LightClasses, LightTiles, ShadowCasters};
use crate::process::{Declare, Draws, FullScreen, RenderProcess};
use crate::scene::{Blend, ViewKind};
use crate::view::ShadowMaps;

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

    /// `maps` are those that [`ShadowCasters`] draws, if there are any.
    pub(super) fn new(classes: LightClasses, formats: GeometryFormats, maps: Option<&ShadowMaps>) -> Self {
        let shader = [
            &formats.normal_encoding_wgsl(),
            ILLUMINATION_SHADER,
            &shadow_shader(maps.map(|maps| (SHADOW_MAPS_BINDING, maps))),
            &format!("const CLASSES: u32 = {:#x}u;\n", classes.bits()),
            LIGHT_TILES_SHADER,
            LIGHT_BATCHES_SHADER,
            include_str!("light_sum/light_sum.wgsl"),
        ];
        Self { shader: shader.concat(), classes, formats, maps: maps.copied() }
    }
}

/// After depth, normal, diffuse and tiles.
const SHADOW_MAPS_BINDING: u32 = 5;

impl RenderProcess for LightSum {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples("depth");
        declare.samples("normal");
        declare.samples("diffuse");
        declare.samples(LightTiles::TARGET);
        if self.maps.is_some() {
            declare.samples_layers(ViewKind::Shadow, ShadowCasters::TARGET);
        }
        declare.draws_over("radiance");
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
