//! Transparency: what the geometry buffer cannot hold.

mod cpu_shader;

use self::cpu_shader::TransparencyCpuShader;
use super::ShadowCasters;
use super::shading::shadow::{ShadowFilter, shadow_shader};
use crate::command::Selection;
use crate::process::{CommandDraws, CpuShader, Declare, Draws, RenderProcess};
use crate::scene::ViewKind;
use crate::view::ShadowMaps;

/// Draws objects that mix with what is behind them over `radiance`, back to front by the distance of their centres along the
/// view's axis: over it by their opacity, added to it, or taken from it (M listing 10.1).
///
/// They are lit where they are drawn, by all lights that reach the view and with the same shadows, on the side that is seen;
/// their emission is added. A subtractive object takes what it would otherwise reflect and give off, and may leave less than
/// nothing for what is drawn over it; tone mapping shows that as black. They cast no shadows themselves.
///
/// Where lights add up to more than a half float can say, some devices store an infinity, and an infinity times 0 is no number:
/// there, even what is opaque does not hide it.
#[derive(Clone, Debug)]
pub struct Transparency {
    shader: String,
    cpu_shader: TransparencyCpuShader,
}

impl Transparency {
    /// With the shadow maps that [`ShadowCasters`] draws, if it does.
    pub fn new(maps: Option<&ShadowMaps>) -> Self {
        let shader = [
            include_str!("shading/surface.wgsl"),
            include_str!("shading/illumination.wgsl"),
            &shadow_shader(maps.map(|maps| (1, maps))),
            include_str!("transparency/transparency.wgsl"),
        ];
        Self { shader: shader.concat(), cpu_shader: TransparencyCpuShader { shadows: maps.map(ShadowFilter::new) } }
    }
}

impl RenderProcess for Transparency {
    fn name(&self) -> &str {
        "transparency"
    }

    fn declare(&self, declare: &mut Declare) {
        if self.cpu_shader.shadows.is_some() {
            declare.samples_layers(ViewKind::Shadow, ShadowCasters::TARGET);
        }
        declare.tests_depth("depth");
        declare.draws_over("radiance");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            shader: &self.shader,
            selection: Selection::BLENDED,
            writes_depth: false,
            ..CommandDraws::default()
        })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(self.cpu_shader))
    }
}
