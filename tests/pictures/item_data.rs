//! Bytes of an engine's own that go with items, and items of one view alone.

use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom::backend::{EncodingStrategy, Picture, RecordingStrategy, WgpuBackend};
use drawloom::glam::DVec3;
use drawloom::process::{
    ClearColor, Declare, Draws, Format, ItemContext, ItemDraws, ItemRange, ItemRecorder, ItemViews, Items, RecordItems,
    RenderProcess,
};
use drawloom::scene::{Assets, Camera, SceneRef};
use drawloom::task::Scheduler;
use drawloom::wgpu::util::RenderEncoder;
use drawloom::{FrameInputs, Granularity, RecordedFrame, Renderer, Submitter, wgpu};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{backend, pixel};
use crate::strategies::strategies;

pub const CASES: &[Case] = &[
    ("data_of_items_change_in_each_frame_with_every_strategy", changing),
    ("frames_in_flight_have_data_of_their_own", in_flight),
    ("data_of_items_grow_and_go", growing),
    ("views_have_items_and_data_of_their_own", of_views),
    ("code_that_records_items_knows_its_attachments", attachments),
    ("items_have_no_more_bind_groups_than_they_may", too_many),
];

const SIDE: u32 = 16;

/// Each item fills a pixel of a row with its value.
const SHADER: &str = "
    @group(0) @binding(0) var<storage, read> values: array<vec4<f32>>;

    struct Corner {
        @builtin(position) position: vec4<f32>,
        @location(0) @interpolate(flat) value: vec4<f32>,
    }

    @vertex
    fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) item: u32) -> Corner {
        let at = vec2(f32(item % 16u), f32(item / 16u)) + vec2(f32(corner & 1u), f32(corner >> 1u));
        return Corner(vec4(at / 8.0 - 1.0, 0.5, 1.0), values[item]);
    }

    @fragment
    fn fragment(in: Corner) -> @location(0) vec4<f32> {
        return in.value;
    }
";

#[derive(Default)]
struct Dots {
    is_multisampled: bool,
}

impl RenderProcess for Dots {
    fn name(&self) -> &str {
        "dots"
    }

    fn declare(&self, declare: &mut Declare) {
        let black = ClearColor::Value([0.0, 0.0, 0.0, 1.0]);
        if self.is_multisampled {
            declare.clears_color("color", Format::Rgba16Float, black);
            declare.clears_depth("depth", Format::Depth32Float);
            declare.multisampled("color");
            declare.multisampled("depth");
            declare.keep();
        } else {
            declare.clears_color("picture", Format::Rgba8Unorm, black);
        }
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Items(ItemDraws::default())
    }
}

/// The engine: one pipeline, and how often it made its bind group.
struct Engine {
    pipeline: wgpu::RenderPipeline,
    bind_groups: AtomicUsize,
}

impl Engine {
    fn new(device: &wgpu::Device) -> Self {
        let source = wgpu::ShaderSource::Wgsl(SHADER.into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("dots"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
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
                entry_point: None,
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(wgpu::TextureFormat::Rgba8Unorm.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { pipeline, bind_groups: AtomicUsize::new(0) }
    }
}

impl RecordItems for Engine {
    fn record<'e>(
        &'e self,
        encoder: &mut dyn RenderEncoder<'e>,
        items: ItemRange<'e>,
        context: &'e ItemContext<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        let data = context.data.ok_or("there are no data")?;
        let bind_group = context.bind_group(3, || {
            self.bind_groups.fetch_add(1, Ordering::Relaxed);
            context.resources.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("dots"),
                layout: &self.pipeline.get_bind_group_layout(0),
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: data.as_entire_binding() }],
            })
        });
        encoder.set_pipeline(&self.pipeline);
        encoder.set_bind_group(0, Some(bind_group), &[]);
        for &item in items.items() {
            encoder.draw(0..4, item..item + 1);
        }
        Ok(())
    }
}

struct Frames {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    assets: Assets,
    cameras: Vec<Camera>,
}

impl Frames {
    fn new(backend: WgpuBackend, views: &[&str]) -> Result<Self, Failed> {
        let builder = Renderer::builder(backend).process(Dots::default()).output("picture");
        let (renderer, submitter) = builder.granularity(Granularity::Chunk(50)).build(Arc::new(Scheduler::new(2)?))?;
        let camera = |name: &&str| Camera { size: [SIDE; 2], ..Camera::looking_at(*name, DVec3::ZERO, DVec3::NEG_Z) };
        Ok(Self { renderer, submitter, assets: Assets::default(), cameras: views.iter().map(camera).collect() })
    }

    fn record(&mut self, items: &[Items<'_>]) -> Result<RecordedFrame<WgpuBackend>, Failed> {
        let scene = SceneRef { cameras: &self.cameras, ..SceneRef::new(&self.assets) };
        Ok(self.renderer.record_with(FrameInputs { items, ..FrameInputs::new(scene) })?)
    }

    /// The picture of each view.
    fn pictures(&self, recorded: RecordedFrame<WgpuBackend>) -> Result<Vec<Picture>, Failed> {
        let submission = self.submitter.submit(recorded)?.submission;
        let pictures = (0..self.cameras.len()).map(|view| submission.read(view, "picture"));
        Ok(pictures.collect::<Result<_, _>>()?)
    }

    fn draw(&mut self, items: &[Items<'_>]) -> Result<Vec<Picture>, Failed> {
        let recorded = self.record(items)?;
        self.pictures(recorded)
    }
}

/// The values of so many items in a frame.
fn values(count: usize, frame: usize) -> Vec<[f32; 4]> {
    let value = |item: usize| [(item * 3 + frame * 7) % 256, (item + frame) % 256, frame, 255];
    (0..count).map(|item| value(item).map(|byte| byte as f32 / 255.0)).collect()
}

fn bytes_of(values: &[[f32; 4]]) -> Vec<u8> {
    values.iter().flatten().flat_map(|value| value.to_ne_bytes()).collect()
}

fn check(picture: &Picture, values: &[[f32; 4]], label: &str) -> Result<(), Failed> {
    for item in 0..(SIDE * SIDE) as usize {
        let (x, y) = (item as u32 % SIDE, SIDE - 1 - item as u32 / SIDE);
        let [r, g, b, _] = values.get(item).copied().unwrap_or_default().map(|value| (value * 255.0).round() as u8);
        let found = pixel(picture, x, y);
        if found != [r, g, b] {
            return Err(format!("{label}, item {item}: {found:?} instead of {:?}", [r, g, b]).into());
        }
    }
    Ok(())
}

fn changing() -> Result<(), Failed> {
    for (recording, encoding) in strategies() {
        let backend = backend()?.recording_strategy(recording).encoding_strategy(encoding);
        let engine = Engine::new(backend.device());
        let mut frames = Frames::new(backend, &["main"])?;
        let (keys, versions) = ([0; 256], [1; 256]);
        for frame in 0..6 {
            let values = values(256, frame);
            let data = &bytes_of(&values);
            let items = Items { data, versions: &versions, ..Items::new("dots", &keys, ItemRecorder::Any(&engine)) };
            let pictures = frames.draw(&[items])?;
            check(&pictures[0], &values, &format!("{recording:?}, {encoding:?}, frame {frame}"))?;
        }
        // At most one for each set of buffers, however many ranges and frames.
        let made = engine.bind_groups.into_inner();
        assert!((1..=3).contains(&made), "{recording:?}, {encoding:?}: {made}");
    }
    Ok(())
}

fn in_flight() -> Result<(), Failed> {
    let backend = backend()?;
    let engine = Engine::new(backend.device());
    let mut frames = Frames::new(backend, &["main"])?;
    let keys = [0; 100];
    let values: Vec<_> = (0..3).map(|frame| values(100, frame)).collect();
    let recorded: Vec<_> = values
        .iter()
        .map(|values| {
            let data = &bytes_of(values);
            frames.record(&[Items { data, ..Items::new("dots", &keys, ItemRecorder::Any(&engine)) }])
        })
        .collect::<Result<_, _>>()?;
    for (index, (recorded, values)) in recorded.into_iter().zip(&values).enumerate() {
        check(&frames.pictures(recorded)?[0], values, &format!("frame {index}"))?;
    }
    Ok(())
}

fn growing() -> Result<(), Failed> {
    let backend = backend()?.recording_strategy(RecordingStrategy::CachedBundles);
    let backend = backend.encoding_strategy(EncodingStrategy::PerPass);
    let engine = Engine::new(backend.device());
    let mut frames = Frames::new(backend, &["main"])?;
    for (frame, count) in [3, 3, 256, 256, 20, 1, 0, 256].into_iter().enumerate() {
        let (keys, versions, values) = (vec![0; count], vec![0; count], values(count, frame));
        let data = &bytes_of(&values);
        let items = Items { data, versions: &versions, ..Items::new("dots", &keys, ItemRecorder::Any(&engine)) };
        check(&frames.draw(&[items])?[0], &values, &format!("frame {frame}"))?;
    }
    // The same items, whose kept bundles have the smaller buffer.
    let (keys, versions) = ([0; 64], [1; 64]);
    for (frame, further) in [0, 0, 0, 0, 5_000, 5_000, 0].into_iter().enumerate() {
        let values = values(64, frame);
        let mut data = bytes_of(&values);
        data.resize(data.len() + further, 0);
        let items = Items { data: &data, versions: &versions, ..Items::new("dots", &keys, ItemRecorder::Any(&engine)) };
        check(&frames.draw(&[items])?[0], &values, &format!("{further} bytes more, frame {frame}"))?;
    }
    let without_data = frames.draw(&[Items::new("dots", &[0], ItemRecorder::Any(&engine))]);
    let error = without_data.err().ok_or("nobody asked for the data")?;
    let message = error.message().unwrap_or_default();
    assert!(message.contains("there are no data"), "{message}");
    Ok(())
}

fn of_views() -> Result<(), Failed> {
    for (recording, encoding) in strategies() {
        let backend = backend()?.recording_strategy(recording).encoding_strategy(encoding);
        let engines = [Engine::new(backend.device()), Engine::new(backend.device())];
        let mut frames = Frames::new(backend, &["left", "right"])?;
        let (keys, versions) = ([0; 64], [0; 64]);
        let values = [values(64, 1), values(40, 2)];
        let bytes = [bytes_of(&values[0]), bytes_of(&values[1])];
        let set = |views, engine: usize, values: usize| {
            let count = [64, 40][values];
            Items {
                views,
                data: &bytes[values],
                versions: &versions[..count],
                ..Items::new("dots", &keys[..count], ItemRecorder::Any(&engines[engine]))
            }
        };
        let (left, right) = (ItemViews::Named("left"), ItemViews::Named("right"));
        let own = [set(left, 0, 0), set(right, 1, 1)];
        let label = |frame: usize| format!("{recording:?}, {encoding:?}, frame {frame}");
        // What is kept of one set is not another's, whatever their order.
        let lent = [own.to_vec(), own.to_vec(), own.to_vec(), vec![own[1], own[0]], own.to_vec()];
        for (frame, lent) in lent.iter().enumerate() {
            let pictures = frames.draw(lent)?;
            check(&pictures[0], &values[0], &label(frame))?;
            check(&pictures[1], &values[1], &label(frame))?;
        }
        for (frame, of_all) in [(5, 0), (6, 1)] {
            let pictures = frames.draw(&[set(ItemViews::All, 1, of_all)])?;
            pictures.iter().try_for_each(|picture| check(picture, &values[of_all], &label(frame)))?;
        }
    }
    Ok(())
}

/// Asks for the bind group of an index.
struct BindGroupAt(usize);

impl RecordItems for BindGroupAt {
    fn record<'e>(
        &'e self,
        _: &mut dyn RenderEncoder<'e>,
        _: ItemRange<'e>,
        context: &'e ItemContext<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        context.bind_group(self.0, || {
            let device = context.resources.device;
            let layout =
                device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &[] });
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &[] })
        });
        Ok(())
    }
}

fn too_many() -> Result<(), Failed> {
    let mut frames = Frames::new(backend()?, &["main"])?;
    for index in [0, ItemContext::MAX_BIND_GROUPS - 1, ItemContext::MAX_BIND_GROUPS, usize::MAX] {
        let drawn = frames.draw(&[Items::new("dots", &[0], ItemRecorder::Any(&BindGroupAt(index)))]);
        match drawn {
            Ok(_) => assert!(index < ItemContext::MAX_BIND_GROUPS, "{index}"),
            Err(error) => {
                let message = error.message().unwrap_or_default();
                assert!(index >= ItemContext::MAX_BIND_GROUPS, "{index}: {message}");
                assert!(message.contains("dots") && message.contains("panicked"), "{message}");
            }
        }
    }
    Ok(())
}

/// Looks at its context, and draws nothing.
struct Attachments;

impl RecordItems for Attachments {
    fn record<'e>(
        &'e self,
        _: &mut dyn RenderEncoder<'e>,
        _: ItemRange<'e>,
        context: &'e ItemContext<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        let attachments = (context.color_formats, context.depth_format, context.sample_count);
        let color = [Some(wgpu::TextureFormat::Rgba16Float)];
        let expected = (&color[..], Some(wgpu::TextureFormat::Depth32Float), 4);
        if attachments == expected { Err("as declared".into()) } else { Err(format!("{attachments:?}").into()) }
    }
}

fn attachments() -> Result<(), Failed> {
    let builder = Renderer::builder(backend()?).process(Dots { is_multisampled: true });
    let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1)?))?;
    let (assets, cameras) = (Assets::default(), [Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z)]);
    let scene = SceneRef { cameras: &cameras, ..SceneRef::new(&assets) };
    let items = [Items::new("dots", &[0], ItemRecorder::Any(&Attachments))];
    let recorded = renderer.record_with(FrameInputs { items: &items, ..FrameInputs::new(scene) });
    let error = recorded.err().ok_or("nobody looked")?;
    assert!(error.to_string().contains("as declared"), "{error}");
    Ok(())
}
