//! What targets of each format hold, on wgpu and on the software backend.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::SoftwareBackend;
use drawloom::process::{
    ClearColor, CpuShader, Declare, Draws, Format, FullScreen, FullScreenCpuShader, FullScreenPixel, PassInputs,
    RenderProcess,
};
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom_testing::scenes::field;
use half::f16;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;

pub const CASES: &[Case] = &[("targets_hold_what_their_format_can", formats)];

/// Draws one colour, of which formats hold what they can.
#[derive(Clone, Copy)]
struct Constant(Format);

const COLOR: [f64; 4] = [0.5, 2.0, -1.0, 0.25];

impl RenderProcess for Constant {
    fn name(&self) -> &str {
        "constant"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("constant", self.0, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return vec4<f32>(0.5, 2.0, -1.0, 0.25);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(*self))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Constant {
    fn fragment(&self, _: &PassInputs<'_, R>, _: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        targets[0] = Vector(COLOR.map(R::of));
        true
    }
}

/// The bytes of a pixel of each format.
fn expected() -> Vec<(Format, Vec<u8>)> {
    let halves = |count: usize| COLOR[..count].iter().flat_map(|value| f16::from_f64(*value).to_le_bytes()).collect();
    let floats = |count: usize| COLOR[..count].iter().flat_map(|value| (*value as f32).to_le_bytes()).collect();
    vec![
        (Format::R8Unorm, vec![128]),
        (Format::Rg8Unorm, vec![128, 255]),
        (Format::Rgba8Unorm, vec![128, 255, 0, 64]),
        (Format::Rgba8Srgb, vec![188, 255, 0, 64]),
        (Format::Bgra8Unorm, vec![0, 255, 128, 64]),
        (Format::Bgra8Srgb, vec![0, 255, 188, 64]),
        (Format::R16Float, halves(1)),
        (Format::Rg16Float, halves(2)),
        (Format::Rgba16Float, halves(4)),
        (Format::R32Float, floats(1)),
        (Format::Rgba32Float, floats(4)),
    ]
}

fn formats() -> Result<(), Failed> {
    let mut scene: Scene = field(0);
    scene.cameras.truncate(1);
    scene.cameras[0].size = [7, 3];
    for (format, expected) in expected() {
        let mut fixture = Fixture::with(2, |builder| builder.process(Constant(format)).output("constant"))?;
        let recorded = fixture.record(&scene)?;
        let by_wgpu = fixture.submit(recorded)?.read(0, "constant")?;

        let scheduler = Arc::new(Scheduler::new(2)?);
        let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler)));
        let (mut renderer, submitter) = builder.process(Constant(format)).output("constant").build(scheduler)?;
        let recorded = renderer.record(scene.as_scene_ref())?;
        let by_software = submitter.submit(recorded)?.submission.read(0, "constant")?;

        let expected: Vec<u8> = expected.iter().copied().cycle().take(7 * 3 * expected.len()).collect();
        for (backend, found) in [("wgpu", by_wgpu), ("software", by_software)] {
            // A device may round a half step to either side.
            let is_near = |(one, other): (&u8, &u8)| one.abs_diff(*other) <= 1;
            if found.bytes.len() != expected.len() || !found.bytes.iter().zip(&expected).all(is_near) {
                return Err(format!("{format:?} on {backend}: {:?}", &found.bytes[..expected.len() / 21]).into());
            }
        }
    }
    Ok(())
}
