//! The depth pre-pass (L 4.1 advises it).

#[cfg(feature = "software")]
mod cpu_shader;

use crate::command::Selection;
use crate::process::{CommandDraws, Declare, Draws, Format, MaskedEntryPoints, RenderProcess, targets};

/// Draws the depth of every opaque object whose material has no [`MaterialType`](crate::scene::MaterialType) into
/// `depth` before the geometry buffer, which then stores each pixel once instead of once for each surface that is
/// nearer than those drawn before it. It is worth it where pixels cost more than vertices. Only
/// [masked](crate::scene::Material::is_masked) objects need a fragment shader.
///
/// Of two surfaces at exactly the same depth, the one drawn last is visible, and not the one drawn first.
#[derive(Clone, Copy, Debug)]
pub struct DepthPrePass {
    format: Format,
}

impl DepthPrePass {
    /// Draws into `depth` of this format: that of [`GeometryFormats::depth`](super::GeometryFormats::depth).
    pub fn new(format: Format) -> Self {
        Self { format }
    }
}

impl RenderProcess for DepthPrePass {
    fn name(&self) -> &str {
        "depth pre-pass"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_depth(targets::DEPTH, self.format);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = include_str!("depth_pre_pass/depth_pre_pass.wgsl");
        // The geometry buffer draws the same objects, so each pixel that has depth gets a surface.
        let selection = Selection::OPAQUE.of_shipped_materials();
        let masked = Some(MaskedEntryPoints { vertex: "masked_vertex", fragment: "masked_fragment" });
        Draws::Commands(CommandDraws { shader, fragment: None, masked, selection, ..CommandDraws::default() })
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<crate::process::CpuShader> {
        Some(crate::process::CpuShader::objects(cpu_shader::DepthPrePassCpuShader))
    }
}
