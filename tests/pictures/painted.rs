//! Kept bundles of a process that draws otherwise from one frame to the next.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use drawloom::Renderer;
use drawloom::backend::{EncodingStrategy, RecordingStrategy, WgpuBackend};
use drawloom::command::Selection;
use drawloom::process::{ClearColor, CommandDraws, Declare, Draws, Format, RenderProcess};
use drawloom::task::Scheduler;
use libtest_mimic::Failed;

use crate::Case;
use crate::studio::Studio;
use crate::techniques::{counts, device, expect, many_batches};

pub const CASES: &[Case] = &[("kept_bundles_follow_a_process_that_draws_otherwise", painted_otherwise)];

/// Paints everything in one colour: its shader's own, or that of its parameters, of which there are more or fewer.
struct Painted {
    step: Arc<AtomicU32>,
}

impl RenderProcess for Painted {
    fn name(&self) -> &str {
        "painted"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("paint", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        macro_rules! painted {
            ($color:literal) => {
                concat!(
                    "struct Colors { first: vec4<f32>, } struct More { first: vec4<f32>, second: vec4<f32>, }
                    @vertex fn vertex(in: VertexInput) -> @builtin(position) vec4<f32> {
                        return clip_position(relative_position(drawn_object(in.instance), in.position));
                    }",
                    $color
                )
            };
        }
        let own =
            painted!("@fragment fn fragment() -> @location(0) vec4<f32> { return vec4<f32>(1.0, 0.0, 0.0, 1.0); }");
        let other = painted!("@fragment fn fragment() -> @location(0) vec4<f32> { return vec4<f32>(1.0); }");
        let one = painted!(
            "@group(2) @binding(0) var<uniform> colors: Colors;
            @fragment fn fragment() -> @location(0) vec4<f32> { return colors.first; }"
        );
        let two = painted!(
            "@group(2) @binding(0) var<uniform> colors: More;
            @fragment fn fragment() -> @location(0) vec4<f32> { return colors.second; }"
        );
        let (shader, parameters): (&str, &[[f32; 4]]) = match self.step.load(Ordering::Relaxed) {
            0 => (own, &[]),
            1 => (one, &[[0.0, 1.0, 0.0, 1.0]]),
            2 => (one, &[[0.0, 0.0, 1.0, 1.0]]),
            3 => (two, &[[0.0; 4], [1.0, 1.0, 0.0, 1.0]]),
            4 => (other, &[]),
            _ => (one, &[[0.0, 1.0, 1.0, 1.0], [0.0; 4]]),
        };
        Draws::Commands(CommandDraws {
            shader,
            parameters: parameters.iter().flatten().flat_map(|value| value.to_le_bytes()).collect(),
            selection: Selection::ALL,
            ..CommandDraws::default()
        })
    }
}

fn painted_otherwise() -> Result<(), Failed> {
    let scene = many_batches();
    let step = Arc::new(AtomicU32::new(0));
    let studio = |record| {
        let (device, queue) = device()?;
        let builder = Renderer::builder(
            WgpuBackend::new(device, queue)?.recording_strategy(record)?.encoding_strategy(EncodingStrategy::PerPass),
        );
        let builder = builder.process(Painted { step: Arc::clone(&step) }).output("paint");
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(2)?))?;
        Ok::<_, Failed>(Studio { renderer, submitter })
    };
    let paint = |studio: &mut Studio| {
        let recorded = studio.record(&scene)?;
        Ok::<_, Failed>(studio.submit(recorded)?.read(0, "paint")?)
    };
    let mut kept = studio(RecordingStrategy::CachedBundles)?;
    // Other bytes in the same place are read by the bundles that are there.
    let steps = [(0, true), (4, true), (1, true), (2, false), (5, true), (3, true), (0, true), (3, true), (1, true)];
    for (next, is_recorded) in steps {
        step.store(next, Ordering::Relaxed);
        let expected = paint(&mut studio(RecordingStrategy::Direct)?)?;
        for turn in 0..2 {
            expect(paint(&mut kept)? == expected, || format!("step {next}, frame {turn}: another picture"))?;
            let (recorded, replayed) = counts(&kept, |_| true);
            let is_new = is_recorded && turn == 0;
            expect((recorded > 0, replayed > 0) == (is_new, !is_new), || format!("{next}: {recorded}, {replayed}"))?;
        }
    }
    Ok(())
}
