//! Shadow maps (L 4.2.2, steps 1 to 6).

#[cfg(feature = "software")]
mod cpu_shader;

use crate::process::{CommandDraws, Declare, Draws, Format, MaskedEntryPoints, RenderProcess, targets};
use crate::scene::ViewKind;

/// Draws the depth of all opaque objects as seen from each light that casts shadows, into the target `shadow map` of
/// [`ViewKind::Shadow`], which has a layer for each map.
///
/// Objects whose material [is a mask](crate::scene::Material::is_masked) cast shadows of the mask's shape, also if the
/// material has a [`MaterialType`](crate::scene::MaterialType): its `alpha_cutoff`, `opacity`, and the alpha of its
/// `texture` at the vertices' first texture coordinates decide. If a type finds its holes in another way, its materials
/// have an `alpha_cutoff` above 0 and an `opacity` of 0, so that they cast no shadow here, and a process of the engine
/// draws them into [`targets::SHADOW_MAP`] after this one, which the pipeline [keeps](super::Deferred::keep) if
/// processes of the engine read the maps.
///
/// Each map is a view, so its objects are culled, sorted, merged and recorded like those of other views, at the same
/// time (M 10.4, L 5). The first six steps of L 4.2.2 are: set the viewport, the depth buffer, the depth state and the
/// rasterizer state; clear the depth; draw all objects that cast shadows. The last three are those of
/// [`LightVolumes`](super::LightVolumes).
///
/// An engine's process may read the maps too, with
/// [`Declare::samples_layers`](crate::process::Declare::samples_layers): if a scene's [`Deferred`](super::Deferred)
/// pipeline has no light that casts shadows, it reads an empty map of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct ShadowCasters {
    /// Whether there are hemispherical lights, whose maps must not show what is behind the light. They need a fragment
    /// shader for all objects, and other maps only for masked ones.
    pub hemispheres: bool,
}

impl ShadowCasters {
    pub(crate) const NAME: &str = "shadow casters";
}

impl RenderProcess for ShadowCasters {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(ViewKind::Shadow);
        declare.clears_depth_layer(targets::SHADOW_MAP, Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = include_str!("shadow_casters/shadow_casters.wgsl");
        Draws::Commands(CommandDraws {
            shader,
            fragment: self.hemispheres.then_some("fragment"),
            clamped_fragment: Some("clamped_fragment"),
            masked: Some(MaskedEntryPoints { vertex: "masked_vertex", fragment: "masked_fragment" }),
            clamped_masked_fragment: Some("clamped_masked_fragment"),
            ..CommandDraws::default()
        })
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<crate::process::CpuShader> {
        Some(crate::process::CpuShader::objects(cpu_shader::ShadowCastersCpuShader { hemispheres: self.hemispheres }))
    }
}
