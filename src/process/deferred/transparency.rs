//! Transparency: blended objects, which the geometry buffer cannot hold.

#[cfg(feature = "software")]
mod cpu_shader;

use super::ShadowCasters;
use super::shading::{ILLUMINATION_SHADER, SURFACE_SHADER, shadow_shader};
use crate::command::Selection;
use crate::process::{CommandDraws, Declare, Draws, RenderProcess};
use crate::scene::ViewKind;
use crate::view::ShadowMaps;

/// Draws blended objects over `radiance`, back to front by the distance of their centres along the view's axis, with
/// alpha, additive or subtractive blending (M listing 10.1). It leaves out those whose material has a
/// [`MaterialType`](crate::scene::MaterialType).
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
}

impl Transparency {
    pub(super) const NAME: &str = "transparency";

    /// With the shadow maps that [`ShadowCasters`] draws, if there are any.
    pub fn new(maps: Option<&ShadowMaps>) -> Self {
        let shader = [
            SURFACE_SHADER,
            ILLUMINATION_SHADER,
            &shadow_shader(maps.map(|maps| (1, maps))),
            include_str!("transparency/transparency.wgsl"),
        ];
        Self { shader: shader.concat(), maps: maps.copied() }
    }
}

impl RenderProcess for Transparency {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn declare(&self, declare: &mut Declare) {
        if self.maps.is_some() {
            declare.samples_layers(ViewKind::Shadow, ShadowCasters::TARGET);
        }
        declare.tests_depth("depth");
        declare.draws_over("radiance");
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
        Some(crate::process::CpuShader::objects(cpu_shader::TransparencyCpuShader::new(self.maps.as_ref())))
    }
}
