//! A forward pipeline: surfaces are lit where they are drawn, in one pass.

use drawloom::command::Selection;
use drawloom::process::{
    ClearColor, CommandDraws, Declare, DepthPrePass, DeviceSupport, Draws, Format, ILLUMINATION_SHADER,
    MaskedEntryPoints, Pipeline, PipelineProcesses, PlanError, PostStep, RenderProcess, Requirements, SURFACE_SHADER,
    SceneContents, ToneMapping,
};

/// Lights objects with all lamps of the scene, without shadows.
///
/// Its requirements are its own: how many lamps its shader loops over at most, in steps, so that a scene without lamps
/// has a shader without a loop, and one more lamp seldom needs another shader. Depth is drawn first where the loop is
/// long: then it runs once a pixel, and not for surfaces that others cover.
pub struct Forward;

/// The numbers of lamps that there are shaders for.
pub const STEPS: [u32; 4] = [0, 4, 16, u32::MAX];

impl Pipeline for Forward {
    fn requirements(&self, scene: &SceneContents<'_>) -> Requirements {
        let is_enough = |step: &u32| scene.lights.len() <= *step as usize;
        let step = STEPS.iter().position(is_enough).unwrap_or(STEPS.len() - 1);
        let requirements = Requirements::default().with_own(step as u64);
        if scene.transparency { requirements.with_transparency() } else { requirements }
    }

    fn build(
        &self,
        requirements: &Requirements,
        _: DeviceSupport,
        processes: &mut PipelineProcesses,
    ) -> Result<(), PlanError> {
        let lamps = STEPS[(requirements.own() as usize).min(STEPS.len() - 1)];
        let has_depth = lamps > 4;
        match has_depth {
            true => processes.process(DepthPrePass::new(Format::Depth32Float)),
            false => processes.absent("depth pre-pass"),
        }
        processes.process(Surfaces::opaque(lamps, has_depth));
        match requirements.transparency() {
            true => processes.process(Surfaces::blended(lamps)),
            false => processes.absent("blended surfaces"),
        }
        processes.process(ToneMapping::default().process("radiance", "picture"));
        processes.output("picture");
        Ok(())
    }

    fn to_prepare(&self) -> Vec<Requirements> {
        let all = Requirements::default().with_transparency();
        (0..STEPS.len()).rev().map(|step| all.with_own(step as u64)).collect()
    }
}

/// Draws surfaces, lit, into `radiance`.
struct Surfaces {
    shader: String,
    has_depth: bool,
    is_blended: bool,
}

impl Surfaces {
    fn opaque(lamps: u32, has_depth: bool) -> Self {
        Self { shader: shader(lamps), has_depth, is_blended: false }
    }

    fn blended(lamps: u32) -> Self {
        Self { shader: shader(lamps), has_depth: true, is_blended: true }
    }
}

/// The shader that loops over at most this many lamps.
fn shader(lamps: u32) -> String {
    let lamps = format!("const LAMPS: u32 = {lamps}u;\n");
    [SURFACE_SHADER, ILLUMINATION_SHADER, &lamps, include_str!("forward.wgsl")].concat()
}

impl RenderProcess for Surfaces {
    fn name(&self) -> &str {
        if self.is_blended { "blended surfaces" } else { "opaque surfaces" }
    }

    fn declare(&self, declare: &mut Declare) {
        match (self.is_blended, self.has_depth) {
            (true, _) => declare.tests_depth("depth"),
            (false, true) => declare.matches_depth("depth"),
            (false, false) => declare.clears_depth("depth", Format::Depth32Float),
        }
        match self.is_blended {
            true => declare.draws_over("radiance"),
            false => declare.clears_color("radiance", Format::Rgba16Float, ClearColor::Background),
        }
    }

    fn draws(&self) -> Draws<'_> {
        let selection = if self.is_blended { Selection::BLENDED } else { Selection::OPAQUE };
        let masked = MaskedEntryPoints { vertex: "vertex", fragment: "masked_fragment" };
        Draws::Commands(CommandDraws {
            shader: &self.shader,
            selection: selection.of_shipped_materials(),
            masked: (!self.is_blended).then_some(masked),
            writes_depth: !self.has_depth,
            ..CommandDraws::default()
        })
    }
}
