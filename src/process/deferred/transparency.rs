//! Transparency: blended objects, which the geometry buffer cannot hold.

#[cfg(feature = "software")]
mod cpu_shader;

use super::FloatSum;
use super::shading::{
    COLORED_SURFACE_SHADER, ILLUMINATION_SHADER, LIGHT_BATCHES_SHADER, SURFACE_SHADER, shadow_shader,
};
use crate::command::Selection;
use crate::process::{CommandDraws, Declare, Draws, RenderProcess, targets};
use crate::scene::{VERTEX_COLOR, ViewKind};
use crate::view::ShadowMaps;

/// Draws blended objects over `radiance`, back to front by the distance of their centres along the view's axis, with
/// alpha, additive or subtractive blending (M listing 10.1). It leaves out those whose material has a
/// [`MaterialType`](crate::scene::MaterialType). In a [`Deferred`](super::Deferred) pipeline they may be summed in
/// floats first: see [`RadianceSum`](crate::quality::RadianceSum).
///
/// Their shader lights them with all lights that reach the view and with the same shadows, on the visible side, and
/// adds their emission. A subtractive object subtracts the light that it would otherwise reflect and emit. The result
/// may be negative, which tone mapping shows as black. Blended objects cast no shadows.
///
/// If lights add up to more than the greatest half float, some devices store infinity, and infinity times 0 is NaN: on
/// those even an opaque pixel that is blended over it does not hide it.
#[derive(Clone, Debug)]
pub struct Transparency {
    shader: String,
    maps: Option<ShadowMaps>,
    has_colors: bool,
    /// Whether the objects are added to a sum of floats, and not to `radiance`.
    sums: bool,
}

impl Transparency {
    pub(super) const NAME: &str = "transparency";

    /// With the shadow maps that [`ShadowCasters`](super::ShadowCasters) draws, if there are any.
    pub fn new(maps: Option<&ShadowMaps>) -> Self {
        Self { shader: shader(SURFACE_SHADER, maps, false), maps: maps.copied(), has_colors: false, sums: false }
    }

    /// The same with [`VERTEX_COLOR`]: it multiplies diffuse colours by those of the vertices, which are white in
    /// meshes without colours.
    pub fn with_vertex_colors(self) -> Self {
        let shader = shader(COLORED_SURFACE_SHADER, self.maps.as_ref(), self.sums);
        Self { shader, has_colors: true, ..self }
    }

    /// The same, but it adds the objects to a sum of floats.
    pub(super) fn into_sum(self) -> Self {
        let surface = if self.has_colors { COLORED_SURFACE_SHADER } else { SURFACE_SHADER };
        Self { shader: shader(surface, self.maps.as_ref(), true), sums: true, ..self }
    }
}

/// The shader that draws such surfaces.
fn shader(surface: &str, maps: Option<&ShadowMaps>, sums: bool) -> String {
    let shadows = shadow_shader(maps.map(|maps| (1, maps)));
    let sums = format!("const SUMS: bool = {sums};\n");
    let shader = include_str!("transparency/transparency.wgsl");
    [surface, ILLUMINATION_SHADER, &shadows, LIGHT_BATCHES_SHADER, &sums, shader].concat()
}

impl RenderProcess for Transparency {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn declare(&self, declare: &mut Declare) {
        if self.has_colors {
            declare.reads_attribute(VERTEX_COLOR, [1.0; 3]);
        }
        if self.maps.is_some() {
            declare.samples_layers(ViewKind::Shadow, targets::SHADOW_MAP);
        }
        declare.tests_depth(targets::DEPTH);
        if self.sums {
            FloatSum::BLENDED_OBJECTS.declare_term(declare, true);
        } else {
            declare.draws_over(targets::RADIANCE);
        }
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            shader: &self.shader,
            selection: Selection::BLENDED.of_shipped_materials(),
            writes_depth: false,
            ..CommandDraws::default()
        })
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<crate::process::CpuShader> {
        let shader = cpu_shader::TransparencyCpuShader::new(self.maps.as_ref(), self.has_colors, self.sums);
        Some(crate::process::CpuShader::objects(shader))
    }
}
