//! Numbers of processes: sizes of targets, counts of draws and workgroups, effects.

use std::cell::OnceCell;
use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::{NullBackend, Picture, PipelineLibrary, SoftwareBackend};
use drawloom::command::Cull;
use drawloom::process::{
    ClearColor, Comparison, ComputeDispatch, Declare, Deferred, DepthBias, DrawCount, Draws, Exposure, Format,
    FullScreen, Fxaa, LightTiles, PipelineState, PostStep, ProceduralDraws, RenderProcess, Stencil, StorageBuffer,
    TargetSize, ToneMapping, Workgroups, lighting_shader, targets,
};
use drawloom::scene::ViewKind;
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom_async_post::{AsyncPost, AsyncStep, Bloom, LayerSettings, StepFrame, StepSource};
use drawloom_testing::adapter::noop_device;
use libtest_mimic::Failed;

use super::NumberCase;
use crate::fixture::{COUNTS, FLOATS, Fixture, ensure, noop_backend, refused, same, scene, small_maps};

pub const CASES: &[NumberCase] = &[
    NumberCase {
        name: "targets_of_any_size",
        numbers: &[
            "process::TargetSize::Divided",
            "process::TargetSize::Fixed",
            "process::TargetSize::in_view",
            "process::Declare::samples_view_layers",
        ],
        check: targets,
    },
    NumberCase {
        name: "draws_and_workgroups_of_any_number",
        numbers: &[
            "process::Declare::clears_depth_to",
            "process::DrawCount::Count::instances",
            "process::DrawCount::Count::vertices",
            "process::Workgroups::Count",
            "process::DepthBias::clamp",
            "process::DepthBias::constant",
            "process::DepthBias::slope",
            "process::Stencil::read_mask",
            "process::Stencil::reference",
            "process::Stencil::write_mask",
            "process::Stencil::mark",
            "process::Stencil::test",
        ],
        check: draws,
    },
    NumberCase {
        name: "bloom_and_sources_of_any_numbers",
        numbers: &[
            "drawloom_async_post::Bloom::divisor",
            "drawloom_async_post::Bloom::radius",
            "drawloom_async_post::Bloom::threshold",
            "drawloom_async_post::Bloom::on_device",
            "drawloom_async_post::LayerSettings::strength",
            "drawloom_async_post::StepSource::downsampled",
        ],
        check: bloom,
    },
    NumberCase {
        name: "post_processing_of_any_numbers",
        numbers: &[
            "process::Exposure::new",
            "process::Exposure::set",
            "process::Exposure::from",
            "process::Fxaa::contrast_threshold",
            "process::Fxaa::dark_threshold",
            "process::Fxaa::sub_pixel",
        ],
        check: post,
    },
    NumberCase {
        name: "the_geometry_is_shared_among_any_number_of_jobs",
        numbers: &["process::Deferred::geometry_shares"],
        check: shares,
    },
    NumberCase { name: "shadow_maps_of_any_numbers", numbers: &[], check: shadow_maps },
    NumberCase {
        name: "shaders_that_light_at_any_binding",
        numbers: &["process::lighting_shader", "process::LightTiles::lighting_shader"],
        check: lighting_shaders,
    },
];

/// A process that draws into a target of its own.
struct Process {
    size: TargetSize,
    layers: Option<u32>,
    draws: Draws<'static>,
}

const COUNTED: StorageBuffer<u32> = StorageBuffer::new("counted", 4).filled_by_nodes();

impl RenderProcess for Process {
    fn name(&self) -> &str {
        "a process"
    }

    fn declare(&self, declare: &mut Declare) {
        if let Draws::Compute(_) = self.draws {
            declare.changes_buffer(COUNTED);
            declare.keep();
            return;
        }
        if self.draws.arguments().is_some() {
            declare.reads_arguments(COUNTED);
        }
        declare.clears_color("own", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.size("own", self.size);
        declare.keep();
        if let Some(layers) = self.layers {
            declare.samples_view_layers(ViewKind::Main, "team", "picture", layers);
        }
    }

    fn draws(&self) -> Draws<'_> {
        self.draws.clone()
    }
}

/// Clears a depth target to this depth.
struct ClearsDepth(f32);

impl RenderProcess for ClearsDepth {
    fn name(&self) -> &str {
        "a process"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_depth("depth", Format::Depth32Float);
        declare.clears_depth_to(self.0);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Procedural(ProceduralDraws::default())
    }
}

fn draw(process: Process) -> Result<(), Failed> {
    let builder = Renderer::builder(noop_backend()?).pipeline(Deferred::to_picture()).process(process);
    let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(1)?))?;
    let mut fixture = Fixture { renderer, submitter };
    fixture.draw(&scene()).map(drop)
}

const PAINT: &str = "@fragment fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> { return vec4<f32>(1.0); }";

fn targets() -> Result<(), Failed> {
    for number in COUNTS {
        let full_screen = || Draws::FullScreen(FullScreen { shader: PAINT, ..FullScreen::default() });
        let drawn = draw(Process { size: TargetSize::Divided(number), layers: None, draws: full_screen() });
        ensure(drawn.is_ok() == (number > 0), format_args!("divided by {number}: {drawn:?}"))?;
        same(TargetSize::Divided(number).in_view([16, u32::MAX])[0], 16_u32.div_ceil(number.max(1)), "the width")?;
        for size in [[number, 4], [4, number]] {
            let drawn = draw(Process { size: TargetSize::Fixed(size), layers: None, draws: full_screen() });
            ensure(drawn.is_ok() == (number == 1), format_args!("{size:?}: {drawn:?}"))?;
        }
        let drawn = draw(Process { size: TargetSize::Picture, layers: Some(number), draws: full_screen() });
        ensure(drawn.is_ok() == (number == 1), format_args!("{number} layers: {drawn:?}"))?;
    }
    Ok(())
}

fn draws() -> Result<(), Failed> {
    let shader = "@vertex fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> { return vec4<f32>(f32(index)); }
        @fragment fn fragment() -> @location(0) vec4<f32> { return vec4<f32>(1.0); }";
    for number in COUNTS {
        for (vertices, instances) in [(number, 1), (3, number), (number, number)] {
            let count = DrawCount::Count { vertices, instances };
            let draws =
                Draws::Procedural(ProceduralDraws { shader, count, cull: Cull::Back, ..ProceduralDraws::default() });
            draw(Process { size: TargetSize::Picture, layers: None, draws })?;
        }
        let limit = drawloom::wgpu::Limits::default().max_compute_workgroups_per_dimension;
        for count in [[number, 1, 1], [1, number, 1], [1, 1, number], [number; 3]] {
            let shader = "@group(2) @binding(1) var<storage, read_write> counted: array<u32>;
                @compute @workgroup_size(1) fn compute() { counted[0] = 1u; }";
            let draws = Draws::Compute(ComputeDispatch {
                shader,
                workgroups: Workgroups::Count(count),
                ..ComputeDispatch::default()
            });
            let drawn = draw(Process { size: TargetSize::Picture, layers: None, draws });
            let is_valid = count.iter().all(|count| *count <= limit);
            ensure(drawn.is_ok() == is_valid, format_args!("{count:?} workgroups: {drawn:?}"))?;
        }
    }
    for index in [1, u32::MAX] {
        let count = DrawCount::Indirect(COUNTED.at(index));
        let draws = Draws::Procedural(ProceduralDraws { shader, count, ..ProceduralDraws::default() });
        let drawn = draw(Process { size: TargetSize::Picture, layers: None, draws });
        ensure(drawn.is_err(), format_args!("arguments at {index} lie beyond the buffer"))?;
    }
    for number in FLOATS {
        for depth_bias in [
            DepthBias { slope: number, constant: i32::MIN, clamp: 0.0 },
            DepthBias { clamp: number, constant: i32::MAX, slope: 1.0 },
        ] {
            let pipeline_state = PipelineState { depth_bias, ..PipelineState::default() };
            let count = DrawCount::Count { vertices: 3, instances: 1 };
            let draws = ProceduralDraws { shader, count, pipeline_state, ..ProceduralDraws::default() };
            let drawn = draw(Process { size: TargetSize::Picture, layers: None, draws: Draws::Procedural(draws) });
            ensure(drawn.is_ok() == number.is_finite(), format_args!("{depth_bias:?}: {drawn:?}"))?;
        }
    }
    for number in FLOATS {
        let built = Renderer::builder(NullBackend).process(ClearsDepth(number)).build(Arc::new(Scheduler::new(1)?));
        ensure(built.is_ok() == (0.0..=1.0).contains(&number), format_args!("cleared to {number}"))?;
    }
    for mask in [0, 1, u8::MAX] {
        let stencils = [
            Stencil::mark(mask),
            Stencil::test(Comparison::Equal, mask),
            Stencil { read_mask: mask, write_mask: mask, reference: !mask, ..Stencil::mark(1) },
        ];
        for stencil in stencils {
            let draws =
                Draws::FullScreen(FullScreen { shader: PAINT, stencil: Some(stencil), ..FullScreen::default() });
            // The process has no stencil, which is said.
            refused(
                draw(Process { size: TargetSize::Picture, layers: None, draws })
                    .map_err(|failed| failed.message().unwrap_or_default().to_owned()),
                "stencil",
            )?;
        }
    }
    Ok(())
}

/// A process that is lit at each pixel.
struct Lit {
    shader: String,
    has_tiles: bool,
}

impl RenderProcess for Lit {
    fn name(&self) -> &str {
        "lit"
    }

    fn declare(&self, declare: &mut Declare) {
        if self.has_tiles {
            declare.samples(LightTiles::TARGET);
        }
        declare.samples_layers(ViewKind::Shadow, targets::SHADOW_MAP);
        declare.clears_color("own", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen { shader: &self.shader, ..FullScreen::default() })
    }
}

/// A binding that is not that of the target is an error of the process, and not of the device.
fn lighting_shaders() -> Result<(), Failed> {
    let maps = small_maps();
    for number in COUNTS.into_iter().chain([2]) {
        let lit = |lighting: String, illuminance: &str| {
            let has_tiles = illuminance.contains("tile");
            let fragment = "@fragment fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32>";
            let shader = format!("{lighting}\n{fragment} {{ return vec4<f32>({illuminance}, 1.0); }}");
            let builder = Renderer::builder(noop_backend()?).pipeline(Deferred::to_picture().shadow_maps(Some(maps)));
            let builder = builder.process(LightTiles).process(Lit { shader, has_tiles });
            let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(1)?))?;
            Fixture { renderer, submitter }.draw(&scene()).map(drop)
        };
        let at = "illuminance_at(vec3<f32>(1.0), vec3<f32>(0.0, 1.0, 0.0))";
        let in_tile = "illuminance_in_tile(vec2<u32>(in.position.xy), vec3<f32>(1.0), vec3<f32>(0.0, 1.0, 0.0))";
        for (drawn, expected) in [
            (lit(lighting_shader(Some((number, &maps))), at), 1),
            (lit(LightTiles::lighting_shader(number, Some((2, &maps))), in_tile), 1),
            (lit(LightTiles::lighting_shader(1, Some((number, &maps))), in_tile), 2),
        ] {
            let is_right = number == expected;
            let names_it = |failed: &Failed| failed.message().is_some_and(|message| message.contains("\"lit\""));
            ensure(
                if is_right { drawn.is_ok() } else { drawn.as_ref().is_err_and(names_it) },
                format_args!("binding {number}: {drawn:?}"),
            )?;
        }
    }
    Ok(())
}

/// A step that makes a picture of one pixel.
struct Pixel;

impl AsyncStep for Pixel {
    fn name(&self) -> &str {
        "pixel"
    }

    fn compute(&self, _: &StepFrame<'_>) -> Picture {
        Picture { width: 1, height: 1, format: Format::Rgba8Unorm, bytes: vec![0; 4] }
    }
}

fn bloom() -> Result<(), Failed> {
    let usual = Bloom::default();
    let mut all: Vec<_> = COUNTS.iter().map(|divisor| Bloom { divisor: *divisor, ..usual }).collect();
    all.extend(COUNTS.iter().map(|radius| Bloom { radius: *radius, ..usual }));
    all.extend(FLOATS.iter().map(|threshold| Bloom { threshold: *threshold, ..usual }));
    for (bloom, strength) in all.into_iter().map(|bloom| (bloom, 0.5)).chain(FLOATS.map(|number| (usual, number))) {
        let (processes, step) = bloom.on_device(strength);
        expect_drawn((&processes, None), step, format_args!("{bloom:?} of {strength}"))?;
    }
    let layers = COUNTS.map(|divisor| (divisor, 1.0)).into_iter().chain(FLOATS.map(|strength| (4, strength)));
    for (divisor, strength) in layers {
        let source = StepSource::downsampled("radiance", divisor);
        let async_post = AsyncPost::new(Arc::new(Scheduler::new(1)?), Pixel, source);
        let processes: Vec<_> = async_post.downsample().map(|process| Arc::new(process) as _).into_iter().collect();
        let layer = async_post.layer(LayerSettings { strength, ..LayerSettings::default() });
        let drawn = expect_drawn((&processes, Some(async_post.source_target())), layer, divisor);
        ensure(drawn.is_ok() == (divisor > 0), format_args!("divided by {divisor}, {strength}: {drawn:?}"))?;
    }
    Ok(())
}

/// Makes each pipeline once.
fn library() -> Result<PipelineLibrary, Failed> {
    thread_local! {
        static LIBRARY: OnceCell<PipelineLibrary> = const { OnceCell::new() };
    }
    LIBRARY.with(|library| match library.get() {
        Some(library) => Ok(library.clone()),
        None => {
            let (device, queue) = noop_device()?;
            Ok(library.get_or_init(|| PipelineLibrary::new(device, queue)).clone())
        }
    })
}

/// Draws with processes and a step behind the shipped ones, and with another target that is kept.
fn expect_drawn(
    (processes, output): (&[Arc<dyn RenderProcess>], Option<&str>),
    step: impl PostStep + 'static,
    what: impl std::fmt::Display,
) -> Result<(), Failed> {
    let scheduler = Arc::new(Scheduler::new(1)?);
    let deferred = Deferred::new().post(step).post(ToneMapping::default());
    let mut noop = Renderer::builder(library()?.backend()?).pipeline(deferred.clone());
    let mut software =
        Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))).pipeline(deferred).shadow_maps(small_maps());
    for process in processes {
        (noop, software) = (noop.process(Arc::clone(process)), software.process(Arc::clone(process)));
    }
    if let Some(output) = output {
        (noop, software) = (noop.output(output), software.output(output));
    }
    let (renderer, submitter) = noop.build(Arc::clone(&scheduler))?;
    Fixture { renderer, submitter }.expect_usual(&what)?;
    // Its CPU shaders compute in Rust, where numbers may overflow; the device's are checked to compile.
    let (renderer, submitter) = software.build(scheduler)?;
    Fixture { renderer, submitter }.expect_usual(&what)
}

fn post() -> Result<(), Failed> {
    for number in FLOATS {
        let set = Exposure::new(1.0);
        set.set(number);
        for exposure in [Exposure::new(number), Exposure::from(number), set] {
            same(exposure.get().to_bits(), number.to_bits(), "the exposure")?;
            let deferred = Deferred::new().post(ToneMapping::new(exposure));
            let drawn = Fixture::software(deferred)?.draw(&scene())?;
            let picture = drawn.submission.read(0, "picture")?;
            ensure(picture.bytes.chunks(4).all(|pixel| pixel[3] == 255), "a picture of numbers")?;
        }
        for fxaa in [
            Fxaa { contrast_threshold: number, ..Fxaa::default() },
            Fxaa { dark_threshold: number, ..Fxaa::default() },
            Fxaa { sub_pixel: number, ..Fxaa::default() },
        ] {
            let deferred = Deferred::to_picture().post(fxaa);
            Fixture::software(deferred)?.expect_usual(format_args!("{number} in FXAA"))?;
        }
    }
    Ok(())
}

fn shares() -> Result<(), Failed> {
    for shares in [0, 1, u32::MAX] {
        let mut fixture = Fixture::new(NullBackend, 2, Deferred::to_picture().geometry_shares(shares))?;
        fixture.expect_usual(format_args!("{shares} shares"))?;
    }
    Ok(())
}

fn shadow_maps() -> Result<(), Failed> {
    let usual = ShadowMaps::default();
    let mut all: Vec<_> = COUNTS.iter().map(|side| ShadowMaps { side: *side, ..usual }).collect();
    all.extend(COUNTS.iter().map(|filter| ShadowMaps { filter: *filter, ..usual }));
    all.extend(COUNTS.iter().map(|cascades| ShadowMaps { cascades: *cascades, ..usual }));
    all.extend(FLOATS.iter().map(|bias| ShadowMaps { bias: *bias, ..usual }));
    all.extend(FLOATS.iter().map(|max_distance| ShadowMaps { max_distance: *max_distance, ..usual }));
    all.extend(FLOATS.iter().map(|split_lambda| ShadowMaps { split_lambda: *split_lambda, ..usual }));
    for maps in all {
        let what = format!("{maps:?}");
        let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).shadow_maps(maps);
        if let Ok((renderer, submitter)) = builder.build(Arc::new(Scheduler::new(1)?)) {
            let drawn = Fixture { renderer, submitter }.draw(&scene());
            ensure(drawn.is_ok(), format_args!("{what}: {drawn:?}", drawn = drawn.map(drop)))?;
        }
    }
    Ok(())
}
