//! Shadow maps (L 4.2.2, steps 1 to 6).

mod cpu_shader;

use self::cpu_shader::ShadowCastersCpuShader;
use crate::process::{CommandDraws, CpuShader, Declare, Draws, Format, RenderProcess};
use crate::scene::ViewKind;

/// Draws, for every light that casts shadows, the depth of all opaque objects as the light sees them: the target `shadow map`
/// of [`ViewKind::Shadow`], of which each light has a layer.
///
/// Each map is a view of its own, so its objects are culled, sorted, merged and recorded like any other's, at the same time
/// (M 10.4, L 5). The first six steps of L 4.2.2 are: set the viewport, the depth buffer, the depth state and the rasterizer
/// state; clear the depth; draw all objects that cast shadows. The last three are those of
/// [`LightVolumes`](super::LightVolumes).
///
/// A process of an engine's own may read the maps too, by
/// [`Declare::samples_layers`](crate::process::Declare::samples_layers): beside a [`Deferred`](super::Deferred) pipeline, where no light
/// of the scene casts shadows, there is one of a single pixel, with nothing in it.
#[derive(Clone, Copy, Debug)]
pub struct ShadowCasters {
    /// Whether there are hemispherical lights, whose maps must not show what is behind the light. It costs a look at each
    /// pixel, which other maps do without.
    pub hemispheres: bool,
}

impl ShadowCasters {
    /// The target's name.
    pub const TARGET: &str = "shadow map";

    pub(in crate::process) const NAME: &str = "shadow casters";
}

impl RenderProcess for ShadowCasters {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Shadow);
        declare.clears_depth_layer(Self::TARGET, Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = include_str!("shadow_casters/shadow_casters.wgsl");
        Draws::Commands(CommandDraws {
            shader,
            fragment: self.hemispheres.then_some("fragment"),
            ..CommandDraws::default()
        })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(ShadowCastersCpuShader { hemispheres: self.hemispheres }))
    }
}
