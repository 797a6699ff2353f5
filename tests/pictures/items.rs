//! Draws of an engine's own, with pipelines of its own: the same bytes as a loop by hand, with every strategy.

use std::error::Error;
use std::sync::Arc;

use drawloom::backend::{EncodingStrategy, Picture, RecordingStrategy, WgpuBackend};
use drawloom::glam::DVec3;
use drawloom::process::{
    ClearColor, Declare, Draws, Format, ItemContext, ItemDraws, ItemOrder, ItemRange, ItemRecorder, Items, RecordItems,
    RecordItemsInPass, RenderProcess,
};
use drawloom::scene::{Assets, Camera, SceneRef};
use drawloom::task::Scheduler;
use drawloom::view::BoundingSphere;
use drawloom::wgpu::util::RenderEncoder;
use drawloom::{FrameInputs, Granularity, Renderer, Submitter, wgpu};
use drawloom_testing::adapter;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{backend, pixel};
use crate::strategies::strategies;

pub const CASES: &[Case] = &[
    ("items_have_the_bytes_of_a_loop_by_hand_with_every_strategy", same_bytes),
    ("bundles_of_items_are_kept_until_a_version_changes", kept),
    ("items_whose_versions_lie_are_named_in_debug_builds", lying),
    ("items_that_are_recorded_into_passes_may_set_scissors", scissors),
    ("code_that_records_items_fails_its_frame_by_name", failing),
];

/// Squares in a picture, 30 in a row.
const SIDE: u32 = 30;
/// As many again lie under those of the first half.
const COUNT: u32 = SIDE * SIDE * 2;

const SHADER: &str = "
    struct Corner {
        @builtin(position) position: vec4<f32>,
        @location(0) @interpolate(flat) item: u32,
    }

    @vertex
    fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) item: u32) -> Corner {
        let square = item % 900u;
        let at = vec2(f32(square % 30u), f32(square / 30u)) + vec2(f32(corner & 1u), f32(corner >> 1u));
        return Corner(vec4(at / 15.0 - 1.0, 0.5, 1.0), item);
    }

    @fragment
    fn red(in: Corner) -> @location(0) vec4<f32> {
        return vec4(1.0, f32(in.item % 7u) / 255.0, f32(in.item % 11u) / 255.0, 1.0);
    }

    @fragment
    fn green(in: Corner) -> @location(0) vec4<f32> {
        return vec4(f32(in.item % 7u) / 255.0, 1.0, f32(in.item % 11u) / 255.0, 1.0);
    }
";

struct Squares;

impl RenderProcess for Squares {
    fn name(&self) -> &str {
        "squares"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("picture", Format::Rgba8Unorm, ClearColor::Value([0.0, 0.0, 0.0, 1.0]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Items(ItemDraws { order: ItemOrder::ByKey })
    }
}

/// What the code does with an item.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    Error(u32),
    Panic(u32),
    /// It sets no pipeline.
    NoPipeline,
}

/// The engine's world: two pipelines, one for each key.
struct World {
    pipelines: [wgpu::RenderPipeline; 2],
    keys: Vec<u64>,
    bounds: Vec<BoundingSphere>,
    versions: Vec<u64>,
    fault: Option<Fault>,
}

impl World {
    fn new(device: &wgpu::Device) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("squares"),
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let pipeline = |fragment| {
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(fragment),
                layout: None,
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("vertex"),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState {
                    topology: wgpu::PrimitiveTopology::TriangleStrip,
                    ..wgpu::PrimitiveState::default()
                },
                depth_stencil: None,
                multisample: wgpu::MultisampleState::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(fragment),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    targets: &[Some(wgpu::TextureFormat::Rgba8Unorm.into())],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        let sphere = |item: u32| {
            // Every fifth is behind the camera.
            let z = if item % 5 == 3 { 100.0 } else { -100.0 };
            BoundingSphere { center: DVec3::Z * z, radius: 1.0 }
        };
        Self {
            pipelines: ["red", "green"].map(pipeline),
            keys: (0..COUNT).map(|item| u64::from(item / 3 % 2)).collect(),
            bounds: (0..COUNT).map(sphere).collect(),
            versions: vec![0; COUNT as usize],
            fault: None,
        }
    }

    /// The picture, square by square: the last of those that lie on each other is seen.
    fn expected(&self) -> Vec<[u8; 3]> {
        let mut squares = vec![[0; 3]; (SIDE * SIDE) as usize];
        let mut order: Vec<_> = (0..COUNT).filter(|item| item % 5 != 3).collect();
        order.sort_by_key(|item| self.keys[*item as usize]);
        for item in order {
            let [low, high] = [(item % 7) as u8, (item % 11) as u8];
            let is_red = self.keys[item as usize] == 0;
            squares[(item % (SIDE * SIDE)) as usize] = if is_red { [255, low, high] } else { [low, 255, high] };
        }
        squares
    }

    fn check(&self, picture: &Picture) -> Result<(), Failed> {
        let found: Vec<_> = (0..SIDE).rev().flat_map(|y| (0..SIDE).map(move |x| (x, y))).collect();
        let found: Vec<_> = found.into_iter().map(|(x, y)| pixel(picture, x, y)).collect();
        match found.iter().zip(self.expected()).position(|(found, expected)| *found != expected) {
            None => Ok(()),
            Some(square) => Err(format!("square {square}: {:?}", found[square]).into()),
        }
    }

    fn record_range<'e>(
        &'e self,
        encoder: &mut dyn RenderEncoder<'e>,
        items: ItemRange<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        for (key, run) in items.runs() {
            if self.fault != Some(Fault::NoPipeline) {
                encoder.set_pipeline(&self.pipelines[key as usize]);
            }
            for &item in run {
                match self.fault {
                    Some(Fault::Error(faulty)) if faulty == item => return Err("the engine lost it".into()),
                    Some(Fault::Panic(faulty)) => assert!(faulty != item, "the engine broke"),
                    _ => {}
                }
                encoder.draw(0..4, item..item + 1);
            }
        }
        Ok(())
    }

    fn items<'a>(&'a self, recorder: ItemRecorder<'a>) -> Items<'a> {
        let Self { keys, bounds, versions, .. } = self;
        Items { bounds, versions, ..Items::new("squares", keys, recorder) }
    }
}

impl RecordItems for World {
    fn record<'e>(
        &'e self,
        encoder: &mut dyn RenderEncoder<'e>,
        items: ItemRange<'e>,
        context: &'e ItemContext<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        assert_eq!((context.view.name(), context.resources.size), ("main", [SIDE, SIDE]));
        self.record_range(encoder, items)
    }
}

/// Draws the lower half of the picture only.
struct LowerHalf<'a>(&'a World);

impl RecordItemsInPass for LowerHalf<'_> {
    fn record<'e>(
        &'e self,
        pass: &mut wgpu::RenderPass<'e>,
        items: ItemRange<'e>,
        _: &'e ItemContext<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        pass.set_scissor_rect(0, SIDE / 2, SIDE, SIDE / 2);
        self.0.record_range(pass, items)
    }
}

struct Frames {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    assets: Assets,
    cameras: [Camera; 1],
}

impl Frames {
    fn new(backend: WgpuBackend, workers: usize, granularity: Granularity) -> Result<Self, Failed> {
        let builder = Renderer::builder(backend).process(Squares).output("picture").granularity(granularity);
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(workers)?))?;
        let camera = Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z);
        let cameras = [Camera { size: [SIDE, SIDE], ..camera }];
        Ok(Self { renderer, submitter, assets: Assets::default(), cameras })
    }

    fn draw(&mut self, items: Items<'_>) -> Result<Picture, Failed> {
        let scene = SceneRef { cameras: &self.cameras, ..SceneRef::new(&self.assets) };
        let recorded = self.renderer.record_with(FrameInputs { items: &[items], ..FrameInputs::new(scene) })?;
        Ok(self.submitter.submit(recorded)?.submission.read(0, "picture")?)
    }
}

fn same_bytes() -> Result<(), Failed> {
    for (recording, encoding) in strategies() {
        for (workers, granularity) in
            [(1, Granularity::Adaptive), (2, Granularity::Chunk(100)), (3, Granularity::PerDraw)]
        {
            let backend = backend()?.recording_strategy(recording).encoding_strategy(encoding);
            let world = World::new(backend.device());
            let mut frames = Frames::new(backend, workers, granularity)?;
            for _frame in 0..2 {
                world.check(&frames.draw(world.items(ItemRecorder::Any(&world)))?)?;
            }
        }
    }
    Ok(())
}

fn kept() -> Result<(), Failed> {
    let (device, queue) = adapter::device()?;
    let backend = WgpuBackend::new(device, queue)?.recording_strategy(RecordingStrategy::CachedBundles);
    let backend = backend.encoding_strategy(EncodingStrategy::PerPass);
    let mut world = World::new(backend.device());
    let mut frames = Frames::new(backend, 2, Granularity::Adaptive)?;
    let mut recorded = |world: &World| -> Result<[usize; 2], Failed> {
        world.check(&frames.draw(world.items(ItemRecorder::Any(world)))?)?;
        let of_passes = frames.renderer.backend().pass_statistics();
        Ok([of_passes[0].recorded_bundles, of_passes[0].replayed_bundles])
    };
    // Each set of buffers has bundles of its own.
    let [first, .., last] = [recorded(&world)?, recorded(&world)?, recorded(&world)?, recorded(&world)?];
    let bundles = first[0];
    assert!(bundles >= 6 && first == [bundles, 0] && last == [0, bundles], "{first:?} {last:?}");
    // Items that move are recorded to the same commands.
    world.bounds.iter_mut().filter(|sphere| sphere.center.z < 0.0).for_each(|sphere| sphere.center.z -= 1.0);
    assert_eq!(recorded(&world)?, [0, bundles]);
    world.versions[700] += 1;
    assert_eq!(recorded(&world)?, [1, bundles - 1]);
    // An item that changes its key changes its place too.
    world.keys[700] = 1 - world.keys[700];
    assert!((1..bundles).contains(&recorded(&world)?[0]));
    world.versions.clear();
    assert_eq!([recorded(&world)?, recorded(&world)?], [[bundles, 0]; 2], "nothing is known of them");
    Ok(())
}

/// A bundle is replayed with a frame that changes what it draws, and says that nothing changed.
fn lying() -> Result<(), Failed> {
    let (device, queue) = adapter::device()?;
    let backend = WgpuBackend::new(device, queue)?.recording_strategy(RecordingStrategy::CachedBundles);
    let mut world = World::new(backend.device());
    let mut frames = Frames::new(backend, 1, Granularity::Adaptive)?;
    (0..4).try_for_each(|_| world.check(&frames.draw(world.items(ItemRecorder::Any(&world)))?))?;
    world.pipelines.swap(0, 1);
    let drawn = frames.draw(world.items(ItemRecorder::Any(&world)));
    if !cfg!(debug_assertions) {
        return drawn.map(drop);
    }
    let error = drawn.err().ok_or("nobody noticed")?;
    let message = error.message().unwrap_or_default();
    let expected = "are recorded to other commands than in an earlier frame with the same versions";
    assert!(["squares", "main", expected].iter().all(|part| message.contains(part)), "{message}");
    world.versions.fill(1);
    world.check(&frames.draw(world.items(ItemRecorder::Any(&world)))?).err().ok_or("the colours have changed")?;
    Ok(())
}

fn scissors() -> Result<(), Failed> {
    for (recording, encoding) in strategies() {
        let backend = backend()?.recording_strategy(recording).encoding_strategy(encoding);
        let world = World::new(backend.device());
        let mut frames = Frames::new(backend, 2, Granularity::Chunk(100))?;
        let picture = frames.draw(world.items(ItemRecorder::Pass(&LowerHalf(&world))))?;
        for (x, y) in [(0, 0), (SIDE - 1, SIDE / 2 - 1)] {
            assert_eq!(pixel(&picture, x, y), [0; 3]);
        }
        let expected = world.expected();
        for (x, y) in [(0, SIDE / 2), (7, SIDE - 1)] {
            assert_eq!(pixel(&picture, x, y), expected[((SIDE - 1 - y) * SIDE + x) as usize]);
        }
    }
    Ok(())
}

fn failing() -> Result<(), Failed> {
    let faults = [
        (Fault::Error(900), "cannot be recorded: the engine lost it"),
        (Fault::Panic(900), "panicked: the engine broke"),
        (Fault::NoPipeline, "pipeline"),
    ];
    for (recording, encoding) in strategies() {
        let backend = backend()?.recording_strategy(recording).encoding_strategy(encoding);
        let mut world = World::new(backend.device());
        let mut frames = Frames::new(backend, 2, Granularity::Adaptive)?;
        for (version, (fault, expected)) in (1..).zip(faults) {
            world.fault = Some(fault);
            // Otherwise bundles of the frame before are replayed.
            world.versions.fill(version);
            let error = frames.draw(world.items(ItemRecorder::Any(&world))).err().ok_or("the fault is lost")?;
            let message = error.message().unwrap_or_default().to_owned();
            let is_named = message.contains(expected) && message.contains("squares") && message.contains("main");
            assert!(is_named, "{recording:?}, {encoding:?}: {message}");
            if fault != Fault::NoPipeline {
                assert!(message.contains("items ") && message.contains(" of the 1440 that the view sees"), "{message}");
            }
            world.fault = None;
            world.check(&frames.draw(world.items(ItemRecorder::Any(&world)))?)?;
        }
    }
    Ok(())
}
