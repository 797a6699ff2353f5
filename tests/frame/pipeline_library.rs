//! Backends of one library share what they compile, and only what the device accepts. wgpu itself counts what the
//! device has.

use std::sync::Arc;

use drawloom::backend::{BackendError, EncodingStrategy, PipelineLibrary, RecordingStrategy, WgpuBackend};
use drawloom::process::{
    ClearColor, ComputeDispatch, Declare, Deferred, Draws, Format, FullScreen, RenderProcess, StorageBuffer,
};
use drawloom::quality::{Quality, VertexFormat};
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom::{FrameError, Renderer, RendererBuilder, Submitter, wgpu};
use drawloom_testing::adapter;
use drawloom_testing::scenes::everything::everything;

const NUMBERS: StorageBuffer<u32> = StorageBuffer::new("numbers", 64);

/// A compute shader, which fills a buffer.
struct Fill;

impl RenderProcess for Fill {
    fn name(&self) -> &str {
        "fill"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.changes_buffer(NUMBERS);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var<storage, read_write> numbers: array<u32>;

            @compute @workgroup_size(64)
            fn compute(@builtin(global_invocation_id) id: vec3<u32>) {
                numbers[id.x] = id.x;
            }
        ";
        Draws::Compute(ComputeDispatch { shader, ..ComputeDispatch::default() })
    }
}

/// Shows the buffer.
struct Show;

impl RenderProcess for Show {
    fn name(&self) -> &str {
        "show"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("shown", Format::R32Uint, ClearColor::Value([0.0; 4]));
        declare.reads_buffer(NUMBERS);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var<storage, read> numbers: array<u32>;

            @fragment
            fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) u32 {
                return numbers[u32(position.x) % 64u];
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

/// A process whose shader compiles, and lacks the entry point of its pipeline.
struct Nameless;

impl RenderProcess for Nameless {
    fn name(&self) -> &str {
        "nameless"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("nothing", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "@fragment fn other() -> @location(0) vec4<f32> { return vec4<f32>(1.0); }";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

type Build = fn(RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend>;

fn shipped(builder: RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend> {
    builder.pipeline(Deferred::to_picture()).process(Fill).process(Show).output("shown")
}

fn renderer(backend: WgpuBackend, build: Build) -> (Renderer<WgpuBackend>, Submitter<WgpuBackend>) {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    build(Renderer::builder(backend)).build(scheduler).unwrap()
}

fn draw((renderer, submitter): &mut (Renderer<WgpuBackend>, Submitter<WgpuBackend>), scene: &Scene) {
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    submitter.submit(recorded).unwrap().submission.wait().unwrap();
}

/// The numbers of shader modules, render pipelines and compute pipelines that a device has.
fn compiled(instance: &wgpu::Instance) -> [usize; 3] {
    let report = instance.generate_report().unwrap();
    let hub = report.hub_report();
    [&hub.shader_modules, &hub.render_pipelines, &hub.compute_pipelines].map(|registry| registry.num_kept_from_user)
}

fn library() -> (wgpu::Instance, PipelineLibrary) {
    let (instance, device, queue) = adapter::noop_instance_and_device(wgpu::Features::empty()).unwrap();
    (instance, PipelineLibrary::new(device, queue))
}

#[test]
fn the_second_backend_of_a_library_compiles_nothing_and_another_quality_its_difference() {
    let (scene, (instance, library)) = (everything(), library());
    assert_eq!((compiled(&instance), library.pipeline_count()), ([0; 3], 0));

    let mut first = renderer(library.backend().unwrap(), shipped);
    draw(&mut first, &scene);
    let (all, pipelines) = (compiled(&instance), first.0.backend().resources().pipelines);
    assert!(all[0] > 5 && all[1] > all[0] && all[2] == 1, "{all:?}");
    assert_eq!((pipelines, library.pipeline_count()), (all[1], all[1] + all[2]));

    // With strategies of its own.
    let backend = library.backend().unwrap().recording_strategy(RecordingStrategy::Bundles);
    let mut second = renderer(backend.encoding_strategy(EncodingStrategy::OnSubmit), shipped);
    draw(&mut second, &scene);
    assert_eq!((compiled(&instance), second.0.backend().resources().pipelines), (all, pipelines));
    assert!(second.0.backend().pass_statistics().iter().all(|pass| pass.recording == RecordingStrategy::Bundles));

    // No backend uses the pipelines now, and the library keeps them.
    drop((first, second));
    assert_eq!(compiled(&instance), all);
    let mut third = renderer(library.backend().unwrap(), shipped);
    draw(&mut third, &scene);
    assert_eq!(compiled(&instance), all);

    // Only processes that draw meshes have other pipelines.
    third.0.set_quality(Quality { vertices: VertexFormat::Packed, ..Quality::balanced() }).unwrap();
    draw(&mut third, &scene);
    let [_, more, compute] = compiled(&instance);
    assert!(more > all[1] && more < 2 * all[1] && compute == all[2], "{more} and {compute}, at first {all:?}");

    // A renderer keeps the pipelines that it uses.
    library.clear();
    assert_eq!(library.pipeline_count(), 0);
    draw(&mut third, &scene);
    assert_eq!(library.pipeline_count(), 0);
    drop(third);
    assert_eq!(compiled(&instance), [0; 3]);
}

#[test]
fn backends_without_a_library_share_nothing() {
    let (instance, device, queue) = adapter::noop_instance_and_device(wgpu::Features::empty()).unwrap();
    let scene = everything();
    let mut renderers = [(); 2].map(|()| renderer(WgpuBackend::new(device.clone(), queue.clone()).unwrap(), shipped));
    draw(&mut renderers[0], &scene);
    let of_one = compiled(&instance);
    draw(&mut renderers[1], &scene);
    assert_eq!(compiled(&instance), of_one.map(|count| 2 * count));
}

#[test]
fn pipelines_that_one_backend_prepares_another_draws_with() {
    let scene = everything();
    let [by_one, by_two] = [false, true].map(|draws_with_another| {
        let (instance, library) = library();
        let mut first = renderer(library.backend().unwrap(), shipped);
        first.0.prepare_pipelines_in_background(scene.as_scene_ref()).unwrap().wait().unwrap().unwrap();
        let prepared = compiled(&instance);
        if draws_with_another {
            first = renderer(library.backend().unwrap(), shipped);
        }
        draw(&mut first, &scene);
        (prepared, compiled(&instance))
    });
    assert_eq!(by_one, by_two);
    assert!(by_two.0[1] > 10, "{by_two:?}");
}

#[test]
fn what_the_device_refuses_is_not_shared() {
    let (scene, (_, library)) = (everything(), library());
    for _ in 0..2 {
        for keeps in [false, true] {
            let backend = library.backend().unwrap();
            let backend = if keeps { backend.keep_working_shaders() } else { backend };
            let (mut renderer, _) = renderer(backend, |builder| builder.process(Nameless).output("nothing"));
            for _ in 0..2 {
                let error = renderer.record(scene.as_scene_ref()).err().unwrap();
                let is_named = matches!(&error, FrameError::Backend(BackendError::Validation { label, .. }) if label.contains("nameless"));
                assert!(is_named, "{error:?}");
            }
            assert_eq!(library.pipeline_count(), 0);
        }
    }
}
