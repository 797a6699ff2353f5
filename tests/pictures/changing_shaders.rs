//! Processes whose shaders and parameters change from frame to frame.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use drawloom::Renderer;
use drawloom::backend::{EncodingStrategy, RecordingStrategy, WgpuBackend};
use drawloom::command::Selection;
use drawloom::process::{ClearColor, CommandDraws, Declare, Deferred, Draws, Format, RenderProcess};
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom_testing::adapter;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, backend};
use crate::strategies::{counts, expect, many_batches};

pub const CASES: &[Case] = &[
    ("cached_bundles_are_recorded_again_when_a_shader_or_its_parameters_change", changing_shader),
    ("a_broken_shader_keeps_the_one_before_it_if_asked_to", broken_shader),
];

/// Draws everything in one colour: a constant of its shader, or one of a varying number of parameters.
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

fn changing_shader() -> Result<(), Failed> {
    let scene = many_batches();
    let step = Arc::new(AtomicU32::new(0));
    let fixture = |recording| {
        // Cases that count cached bundles use a device of their own: see `fixture_alone`.
        let is_counted = recording == RecordingStrategy::CachedBundles;
        let alone = || -> Result<_, Failed> {
            let (device, queue) = adapter::device()?;
            Ok(WgpuBackend::new(device, queue)?)
        };
        let backend = if is_counted { alone()? } else { backend()? };
        let backend = backend.recording_strategy(recording).encoding_strategy(EncodingStrategy::PerPass);
        let builder = Renderer::builder(backend);
        let builder = builder.process(Painted { step: Arc::clone(&step) }).output("paint");
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(2)?))?;
        Ok::<_, Failed>(Fixture { renderer, submitter })
    };
    let paint = |fixture: &mut Fixture| {
        let recorded = fixture.record(&scene)?;
        Ok::<_, Failed>(fixture.submit(recorded)?.read(0, "paint")?)
    };
    let mut cached = fixture(RecordingStrategy::CachedBundles)?;
    // Cached bundles read new parameter values of the same size, so they need no recording.
    let steps = [(0, true), (4, true), (1, true), (2, false), (5, true), (3, true), (0, true), (3, true), (1, true)];
    for (next, is_recorded) in steps {
        step.store(next, Ordering::Relaxed);
        let expected = paint(&mut fixture(RecordingStrategy::Direct)?)?;
        for frame in 0..2 {
            expect(paint(&mut cached)? == expected, || format!("step {next}, frame {frame}: another picture"))?;
            let (recorded, replayed) = counts(&cached, |_| true);
            let is_new = is_recorded && frame == 0;
            expect((recorded > 0, replayed > 0) == (is_new, !is_new), || format!("{next}: {recorded}, {replayed}"))?;
        }
    }
    Ok(())
}

/// Draws everything with one of these fragment shaders, of which some are wrong.
struct Edited {
    step: Arc<AtomicU32>,
}

const RED: u32 = 0;
const SYNTAX: u32 = 1;
const NO_ENTRY_POINT: u32 = 2;
const GREEN: u32 = 3;

impl RenderProcess for Edited {
    fn name(&self) -> &str {
        "edited"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("paint", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        macro_rules! edited {
            ($fragment:literal) => {
                concat!(
                    "@vertex fn vertex(in: VertexInput) -> @builtin(position) vec4<f32> {
                        return clip_position(relative_position(drawn_object(in.instance), in.position));
                    }\n",
                    $fragment
                )
            };
        }
        let shader = match self.step.load(Ordering::Relaxed) {
            RED => {
                edited!("@fragment fn fragment() -> @location(0) vec4<f32> { return vec4<f32>(1.0, 0.0, 0.0, 1.0); }")
            }
            SYNTAX => edited!("@fragment fn fragment() -> @location(0) vec4<f32> { return red; }"),
            NO_ENTRY_POINT => edited!("@fragment fn other() -> @location(0) vec4<f32> { return vec4<f32>(1.0); }"),
            _ => edited!("@fragment fn fragment() -> @location(0) vec4<f32> { return vec4<f32>(0.0, 1.0, 0.0, 1.0); }"),
        };
        Draws::Commands(CommandDraws { shader, selection: Selection::ALL, ..CommandDraws::default() })
    }
}

fn broken_shader() -> Result<(), Failed> {
    let (mut scene, step) = (many_batches(), Arc::new(AtomicU32::new(RED)));
    let build = |keeps| -> Result<Fixture, Failed> {
        let backend = backend()?;
        let backend = if keeps { backend.keep_working_shaders() } else { backend };
        let builder = Renderer::builder(backend).pipeline(Deferred::to_picture());
        let builder = builder.process(Edited { step: Arc::clone(&step) }).output("paint");
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(2)?))?;
        Ok(Fixture { renderer, submitter })
    };
    let draw = |fixture: &mut Fixture, scene: &Scene, edited: u32| -> Result<Vec<u8>, Failed> {
        step.store(edited, Ordering::Relaxed);
        let recorded = fixture.record(scene)?;
        Ok(fixture.submit(recorded)?.read(0, "paint")?.bytes)
    };
    let mut keeping = build(true)?;
    if draw(&mut keeping, &scene, SYNTAX).is_ok() {
        return Err("the first shader is broken, and drawn".into());
    }
    let (red, green) = (draw(&mut keeping, &scene, RED)?, draw(&mut keeping, &scene, GREEN)?);
    expect(red != green, || "red is green".to_owned())?;
    for (edited, expected, error) in [
        (RED, &red, None),
        (SYNTAX, &red, Some("line 4")),
        (SYNTAX, &red, Some("line 4")),
        (NO_ENTRY_POINT, &red, Some("fragment")),
        (GREEN, &green, None),
        (SYNTAX, &green, Some("line 4")),
        (GREEN, &green, None),
    ] {
        expect(draw(&mut keeping, &scene, edited)? == *expected, || {
            format!("step {edited} is drawn in another colour")
        })?;
        let errors = keeping.renderer.backend().shader_errors();
        let is_told = match error {
            None => errors.is_empty(),
            Some(part) => errors.len() == 1 && errors[0].contains(part) && errors[0].contains("edited"),
        };
        expect(is_told, || format!("step {edited}: {errors:?}"))?;
    }
    // Without lights the frame has another plan, whose processes have no pipelines of their own yet.
    let lights = std::mem::take(&mut scene.lights);
    expect(draw(&mut keeping, &scene, SYNTAX)? == green, || "a new plan has another colour".to_owned())?;
    scene.lights = lights;
    let mut usual = build(false)?;
    draw(&mut usual, &scene, RED)?;
    expect(draw(&mut usual, &scene, SYNTAX).is_err(), || "a broken shader is drawn".to_owned())?;
    expect(draw(&mut usual, &scene, GREEN)? == green, || "the frame after an error is wrong".to_owned())
}
