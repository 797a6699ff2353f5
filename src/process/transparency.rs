//! Transparency: what the geometry buffer cannot hold.

use super::shadow::shadow_shader;
use super::{CommandDraws, Declare, Draws, RenderProcess, ShadowCasters};
use crate::queue::Selection;
use crate::scene::ViewKind;
use crate::view::ShadowMaps;

/// Draws objects that mix with what is behind them over `radiance`, back to front by the distance of their centres along the
/// view's axis: over it by their opacity, added to it, or taken from it (M listing 10.1).
///
/// They are lit where they are drawn, by all lights that reach the view and with the same shadows, on the side that is seen;
/// their emission is added. A subtractive object takes what it would otherwise reflect and give off, and may leave less than
/// nothing for what is drawn over it; tone mapping shows that as black. They cast no shadows themselves.
#[derive(Clone, Debug)]
pub struct Transparency {
    shader: String,
    shadowed: bool,
}

impl Transparency {
    /// With the shadow maps that [`ShadowCasters`] draws, if it does.
    pub fn new(maps: Option<&ShadowMaps>) -> Self {
        let shader = [
            include_str!("surface.wgsl"),
            include_str!("illumination.wgsl"),
            &shadow_shader(maps.map(|maps| (1, maps))),
            include_str!("transparency.wgsl"),
        ];
        Self { shader: shader.concat(), shadowed: maps.is_some() }
    }
}

impl RenderProcess for Transparency {
    fn name(&self) -> &str {
        "transparency"
    }

    fn declare(&self, declare: &mut Declare) {
        if self.shadowed {
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
}
