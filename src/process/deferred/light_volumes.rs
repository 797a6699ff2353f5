//! Lighting (L 4.2).

#[cfg(feature = "software")]
mod cpu_shader;

use std::borrow::Cow;

use super::shading::{ILLUMINATION_SHADER, shadow_shader};
use super::{FloatSum, GeometryFormats};
use crate::process::{Declare, Draws, LightDraws, RenderProcess, targets};
use crate::scene::{LightKind, ViewKind};
use crate::view::{LightClass, ShadowMaps};

/// Lights the geometry buffer with the lights of one class, and adds the reflected light to the target `radiance`.
/// Surfaces are Lambertian. In a [`Deferred`](super::Deferred) pipeline it may add to a sum in floats first, or a
/// shader that sums all lights may take its place: see [`RadianceSum`](crate::quality::RadianceSum).
///
/// A light is drawn as a light volume (L 4.2.1; Calver 2003): a sphere for a point light, a cone for a spot or
/// hemispherical light, the whole picture for a directional one. The back faces are drawn, and a pixel is shaded if
/// they are behind its surface: so a light costs only the pixels that it may reach, and the camera may be inside of the
/// volume. All lights of a class are one instanced draw, whose cost is N + L and not N × L (L 2).
///
/// The steps of L 4.2.1 are: set the viewport; the radiance as target; test depth but do not write it; the rasterizer
/// state; the geometry buffer as the shader's input; draw each light; finish. Those of L 4.2.2 that concern a light
/// with a shadow map are the same with the map as one more input.
#[derive(Clone, Debug)]
pub struct LightVolumes {
    name: String,
    shader: String,
    class: LightClass,
    #[cfg_attr(not(feature = "software"), expect(dead_code, reason = "the WGSL is generated for them"))]
    formats: GeometryFormats,
    maps: Option<ShadowMaps>,
    /// `None` if lights are added to `radiance` one by one; otherwise whether this process adds the first terms of
    /// their sum.
    sum: Option<bool>,
}

impl LightVolumes {
    /// Draws the lights of a kind that have no shadow map.
    pub fn new(kind: LightKind, formats: GeometryFormats) -> Self {
        Self::of_class(kind, formats, None)
    }

    /// Draws the lights of a kind that have a shadow map, drawn by [`ShadowCasters`](super::ShadowCasters).
    pub fn shadowed(kind: LightKind, formats: GeometryFormats, maps: &ShadowMaps) -> Self {
        Self::of_class(kind, formats, Some(maps))
    }

    fn of_class(kind: LightKind, formats: GeometryFormats, maps: Option<&ShadowMaps>) -> Self {
        let class = LightClass { kind, shadowed: maps.is_some() };
        let shader = [
            &formats.normal_encoding_wgsl(),
            ILLUMINATION_SHADER,
            &shadow_shader(maps.map(|maps| (SHADOW_MAPS_BINDING, maps))),
            include_str!("light_volumes/light_volumes.wgsl"),
        ];
        Self { name: Self::name_of(class), shader: shader.concat(), class, formats, maps: maps.copied(), sum: None }
    }

    /// The same, but it adds the lights to a sum of floats. The first process that does so begins the sum.
    pub(super) fn into_sum(self, is_first: bool) -> Self {
        Self { sum: Some(is_first), ..self }
    }

    /// The name of a class' process, such as "point lights" or "shadowed spot lights".
    pub fn name_of(class: LightClass) -> String {
        format!("{}{} lights", if class.shadowed { "shadowed " } else { "" }, class.kind.name())
    }
}

/// After depth, normal and diffuse.
const SHADOW_MAPS_BINDING: u32 = 4;

impl RenderProcess for LightVolumes {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(targets::DEPTH);
        declare.samples(targets::NORMAL);
        declare.samples(targets::DIFFUSE);
        if self.maps.is_some() {
            declare.samples_layers(ViewKind::Shadow, targets::SHADOW_MAP);
        }
        declare.tests_depth(targets::DEPTH);
        match self.sum {
            Some(is_first) => FloatSum::LIGHTS.declare_term(declare, is_first),
            None => declare.draws_over(targets::RADIANCE),
        }
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Lights(LightDraws {
            shader: &self.shader,
            class: self.class,
            parameters: Cow::Borrowed(&[]),
            resources: Vec::new(),
        })
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<crate::process::CpuShader> {
        Some(crate::process::CpuShader::lights(cpu_shader::LightVolumesCpuShader::new(
            self.formats,
            self.maps.as_ref(),
        )))
    }
}
