//! Code of an engine's that records items wrongly: the frame fails, or the rest of the picture is right, and the next
//! frame is drawn.

use std::error::Error;
use std::sync::Arc;

use drawloom::backend::{RecordingStrategy, WgpuBackend};
use drawloom::glam::DVec3;
use drawloom::process::{
    ClearColor, Declare, Draws, Format, ItemContext, ItemDraws, ItemRange, ItemRecorder, Items, RecordItems,
    RecordItemsInPass, RenderProcess,
};
use drawloom::scene::{Assets, Camera, SceneRef};
use drawloom::task::Scheduler;
use drawloom::wgpu::util::RenderEncoder;
use drawloom::{FrameInputs, RecordedFrame, Renderer, Submitter, WarmUp, wgpu};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{backend, pixel};
use crate::strategies::strategies;

pub const CASES: &[Case] = &[
    ("code_that_records_no_items_leaves_the_picture_empty", nothing),
    ("items_with_a_pipeline_of_other_formats_fail_their_frame_by_name", other_formats),
    ("items_that_leave_a_debug_group_open_fail_their_frame_by_name", open_group),
    ("a_warm_up_has_no_items", warm_up),
];

const SHADER: &str = "
    @vertex
    fn vertex(@builtin(vertex_index) corner: u32) -> @builtin(position) vec4<f32> {
        return vec4(vec2(f32(corner & 1u), f32(corner >> 1u)) * 4.0 - 1.0, 0.5, 1.0);
    }

    @fragment
    fn fragment() -> @location(0) vec4<f32> {
        return vec4(0.0, 1.0, 0.0, 1.0);
    }
";

/// What the code does.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Deed {
    Draw,
    Nothing,
    OtherFormats,
    /// In a pass: bundles have no debug groups.
    OpenGroup,
}

struct Engine {
    pipeline: wgpu::RenderPipeline,
    of_other_formats: wgpu::RenderPipeline,
    deed: Deed,
}

impl Engine {
    fn new(device: &wgpu::Device) -> Self {
        let source = wgpu::ShaderSource::Wgsl(SHADER.into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
        let pipeline = |format: wgpu::TextureFormat| {
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("green"),
                layout: None,
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: None,
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: None,
                multisample: wgpu::MultisampleState::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: None,
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    targets: &[Some(format.into())],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        Self {
            pipeline: pipeline(wgpu::TextureFormat::Rgba8Unorm),
            of_other_formats: pipeline(wgpu::TextureFormat::Rgba16Float),
            deed: Deed::Draw,
        }
    }

    fn draw<'e>(&'e self, encoder: &mut dyn RenderEncoder<'e>) {
        match self.deed {
            Deed::Nothing => return,
            Deed::OtherFormats => encoder.set_pipeline(&self.of_other_formats),
            Deed::Draw | Deed::OpenGroup => encoder.set_pipeline(&self.pipeline),
        }
        encoder.draw(0..3, 0..1);
    }
}

impl RecordItems for Engine {
    fn record<'e>(
        &'e self,
        encoder: &mut dyn RenderEncoder<'e>,
        _: ItemRange<'e>,
        _: &'e ItemContext<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        self.draw(encoder);
        Ok(())
    }
}

/// Records into passes alone.
struct InPass<'a>(&'a Engine);

impl RecordItemsInPass for InPass<'_> {
    fn record<'e>(
        &'e self,
        pass: &mut wgpu::RenderPass<'e>,
        _: ItemRange<'e>,
        _: &'e ItemContext<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        if self.0.deed == Deed::OpenGroup {
            pass.push_debug_group("never closed");
        }
        self.0.draw(pass);
        Ok(())
    }
}

struct Own;

impl RenderProcess for Own {
    fn name(&self) -> &str {
        "own draws"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("picture", Format::Rgba8Unorm, ClearColor::Value([1.0, 0.0, 0.0, 1.0]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Items(ItemDraws::default())
    }
}

const GREEN: [u8; 3] = [0, 255, 0];
const CLEARED: [u8; 3] = [255, 0, 0];

struct Frames {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    assets: Assets,
    cameras: [Camera; 1],
}

impl Frames {
    fn new(backend: WgpuBackend) -> Result<Self, Failed> {
        let builder = Renderer::builder(backend).process(Own).output("picture");
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(2)?))?;
        let cameras = [Camera { size: [8, 8], ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) }];
        Ok(Self { renderer, submitter, assets: Assets::default(), cameras })
    }

    /// Draws items of this version, and returns a pixel.
    fn draw(&mut self, recorder: ItemRecorder<'_>, version: u64) -> Result<[u8; 3], Failed> {
        let (keys, versions) = ([0; 600], [version; 600]);
        let items = [Items { versions: &versions, ..Items::new("own draws", &keys, recorder) }];
        let scene = SceneRef { cameras: &self.cameras, ..SceneRef::new(&self.assets) };
        let recorded = self.renderer.record_with(FrameInputs { items: &items, ..FrameInputs::new(scene) })?;
        self.pixel(recorded)
    }

    fn pixel(&self, recorded: RecordedFrame<WgpuBackend>) -> Result<[u8; 3], Failed> {
        let picture = self.submitter.submit(recorded)?.submission.read(0, "picture")?;
        Ok(pixel(&picture, 3, 3))
    }
}

fn nothing() -> Result<(), Failed> {
    for (recording, encoding) in strategies() {
        let backend = backend()?.recording_strategy(recording).encoding_strategy(encoding);
        let mut engine = Engine::new(backend.device());
        let mut frames = Frames::new(backend)?;
        for (version, (deed, expected)) in
            (0..).zip([(Deed::Nothing, CLEARED), (Deed::Draw, GREEN), (Deed::Nothing, CLEARED), (Deed::Draw, GREEN)])
        {
            engine.deed = deed;
            assert_eq!(frames.draw(ItemRecorder::Any(&engine), version)?, expected, "{recording:?}, {encoding:?}");
            assert_eq!(frames.draw(ItemRecorder::Pass(&InPass(&engine)), version)?, expected, "in passes");
        }
    }
    Ok(())
}

/// Draws, fails with a message that names the process and the view, and draws again.
fn check_failure(
    frames: &mut Frames,
    engine: &mut Engine,
    (deed, in_passes): (Deed, bool),
    expected: &str,
) -> Result<(), Failed> {
    for (version, deed) in (0..).zip([Deed::Draw, deed, deed, Deed::Draw]) {
        engine.deed = deed;
        let drawn = match in_passes {
            true => frames.draw(ItemRecorder::Pass(&InPass(engine)), version),
            false => frames.draw(ItemRecorder::Any(engine), version),
        };
        match (deed, drawn) {
            (Deed::Draw, drawn) => assert_eq!(drawn?, GREEN),
            (_, Ok(pixel)) => return Err(format!("the frame does not fail: {pixel:?}").into()),
            (_, Err(error)) => {
                let message = error.message().unwrap_or_default();
                let is_named = ["own draws", "main", expected].iter().all(|part| message.contains(part));
                assert!(is_named, "{deed:?}, in passes: {in_passes}: {message}");
            }
        }
    }
    Ok(())
}

fn other_formats() -> Result<(), Failed> {
    for (recording, encoding) in strategies() {
        let backend = backend()?.recording_strategy(recording).encoding_strategy(encoding);
        let mut engine = Engine::new(backend.device());
        let mut frames = Frames::new(backend)?;
        for in_passes in [false, true] {
            check_failure(&mut frames, &mut engine, (Deed::OtherFormats, in_passes), "Rgba16Float")?;
        }
    }
    Ok(())
}

fn open_group() -> Result<(), Failed> {
    for (recording, encoding) in strategies() {
        let backend = backend()?.recording_strategy(recording).encoding_strategy(encoding);
        let mut engine = Engine::new(backend.device());
        check_failure(&mut Frames::new(backend)?, &mut engine, (Deed::OpenGroup, true), "debug group")?;
    }
    Ok(())
}

fn warm_up() -> Result<(), Failed> {
    for recording in [RecordingStrategy::Direct, RecordingStrategy::Bundles, RecordingStrategy::CachedBundles] {
        let backend = backend()?.recording_strategy(recording);
        let engine = Engine::new(backend.device());
        let mut frames = Frames::new(backend)?;
        let (assets, cameras) = (Assets::default(), frames.cameras.clone());
        let mut warm_up = WarmUp::new(SceneRef { cameras: &cameras, ..SceneRef::new(&assets) });
        while let Some(recorded) = warm_up.record_next(&mut frames.renderer)? {
            assert_eq!(frames.pixel(recorded)?, CLEARED, "{recording:?}");
        }
        assert_eq!(frames.draw(ItemRecorder::Any(&engine), 0)?, GREEN, "{recording:?}");
    }
    Ok(())
}
