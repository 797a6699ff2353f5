//! A forward pipeline of this crate's processes. It draws the same picture as the deferred one, for lights without
//! shadows and opaque objects.

use drawloom::RendererBuilder;
use drawloom::backend::WgpuBackend;
use drawloom::process::{ClearColor, CommandDraws, Declare, Draws, Format, RenderProcess, ToneMapping};

/// Draws all objects once; the fragment shader loops over all lights that reach the view.
pub fn loop_over_lights(builder: RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend> {
    builder.process(AllLights).process(ToneMapping::default()).output("picture")
}

struct AllLights;

impl RenderProcess for AllLights {
    fn name(&self) -> &str {
        "all lights"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("radiance", Format::Rgba16Float, ClearColor::Background);
        declare.clears_depth("depth", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = concat!(
            include_str!("../../../src/process/deferred/shading/uncolored_surface.wgsl"),
            include_str!("../../../src/process/deferred/shading/surface.wgsl"),
            include_str!("../../../src/process/deferred/shading/illumination.wgsl"),
            include_str!("all_lights.wgsl")
        );
        Draws::Commands(CommandDraws { shader, ..CommandDraws::default() })
    }
}
