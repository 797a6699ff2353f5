//! Two forward pipelines. They draw the same picture as the deferred one, for lights without shadows and opaque objects.

use std::borrow::Cow;

use drawloom::RendererBuilder;
use drawloom::backend::WgpuBackend;
use drawloom::command::Selection;
use drawloom::process::{ClearColor, CommandDraws, Declare, Draws, Format, RenderProcess, ToneMapping};

/// Draws all objects once without lights, and then once more for each light: N × L (L 2). For the lights it draws additive copies of
/// the opaque objects.
pub fn pass_per_light(builder: RendererBuilder<WgpuBackend>, lights: usize) -> RendererBuilder<WgpuBackend> {
    let first = builder.process(WithoutLights).process(ToneMapping::default()).output("picture");
    (0..lights).fold(first, |builder, light| builder.process(OneLight::new(light)))
}

/// Draws all objects once; the fragment shader loops over all lights that reach the view.
pub fn loop_over_lights(builder: RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend> {
    builder.process(AllLights).process(ToneMapping::default()).output("picture")
}

struct WithoutLights;

impl RenderProcess for WithoutLights {
    fn name(&self) -> &str {
        NAME_WITHOUT_LIGHTS
    }

    fn declare(&self, declare: &mut Declare) {
        declare_first(declare);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = concat!(
            include_str!("../../../src/process/deferred/shading/surface.wgsl"),
            include_str!("without_lights.wgsl")
        );
        Draws::Commands(CommandDraws { shader, ..CommandDraws::default() })
    }
}

const NAME_WITHOUT_LIGHTS: &str = "without lights";

struct OneLight {
    name: String,
    /// Its index among the lights that reach the view.
    light: u32,
    after: String,
}

impl OneLight {
    fn new(light: usize) -> Self {
        let name_of = |light: usize| format!("light {light}");
        let after = light.checked_sub(1).map_or_else(|| NAME_WITHOUT_LIGHTS.to_owned(), name_of);
        Self { name: name_of(light), light: light as u32, after }
    }
}

impl RenderProcess for OneLight {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.matches_depth("depth");
        declare.draws_over("radiance");
        declare.after(&self.after);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = concat!(
            include_str!("../../../src/process/deferred/shading/surface.wgsl"),
            include_str!("../../../src/process/deferred/shading/illumination.wgsl"),
            include_str!("one_light.wgsl")
        );
        let parameters = [self.light, 0, 0, 0].map(u32::to_le_bytes).concat();
        Draws::Commands(CommandDraws {
            shader,
            selection: Selection::BLENDED,
            writes_depth: false,
            parameters: Cow::Owned(parameters),
            ..CommandDraws::default()
        })
    }
}

struct AllLights;

impl RenderProcess for AllLights {
    fn name(&self) -> &str {
        "all lights"
    }

    fn declare(&self, declare: &mut Declare) {
        declare_first(declare);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = concat!(
            include_str!("../../../src/process/deferred/shading/surface.wgsl"),
            include_str!("../../../src/process/deferred/shading/illumination.wgsl"),
            include_str!("all_lights.wgsl")
        );
        Draws::Commands(CommandDraws { shader, ..CommandDraws::default() })
    }
}

fn declare_first(declare: &mut Declare) {
    declare.clears_color("radiance", Format::Rgba16Float, ClearColor::Background);
    declare.clears_depth("depth", Format::Depth32Float);
}
