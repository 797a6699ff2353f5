//! Processes of one shader text compile it once. wgpu itself counts what the device has.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom::backend::{BackendError, PipelineLibrary, WgpuBackend};
use drawloom::glam::DVec3;
use drawloom::process::{
    BlendEquation, ClearColor, CommandDraws, Declare, Draws, Format, FullScreen, ProceduralDraws, RenderProcess,
};
use drawloom::scene::{Camera, Material, RenderObject, Scene};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Renderer, RendererBuilder, Submitter, wgpu};
use drawloom_testing::adapter;
use drawloom_testing::scenes::cube;

const GRAY: &str = "
    @fragment
    fn fragment() -> @location(0) vec4<f32> {
        return vec4<f32>(0.5);
    }
";

const OBJECTS: &str = "
    @vertex
    fn vertex(in: VertexInput) -> @builtin(position) vec4<f32> {
        return clip_position(relative_position(drawn_object(in.instance), in.position));
    }

    @fragment
    fn fragment() -> @location(0) vec4<f32> {
        return vec4<f32>(1.0);
    }
";

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    FullScreen,
    Objects,
}

/// A process with a target of its own.
#[derive(Clone)]
struct Layer {
    name: String,
    kind: Kind,
    format: Format,
    parameters: Vec<u8>,
    blend_equations: Vec<BlendEquation>,
    texts: Vec<String>,
    /// Which of the texts it draws with.
    text: Arc<AtomicUsize>,
}

impl Layer {
    fn new(name: impl Into<String>, kind: Kind) -> Self {
        let text = if kind == Kind::Objects { OBJECTS } else { GRAY };
        Self {
            name: name.into(),
            kind,
            format: Format::Rgba8Unorm,
            parameters: Vec::new(),
            blend_equations: Vec::new(),
            texts: vec![text.to_owned()],
            text: Arc::default(),
        }
    }

    fn with_text(self, text: impl Into<String>) -> Self {
        Self { texts: vec![text.into()], ..self }
    }
}

impl RenderProcess for Layer {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color(format!("target of {}", self.name), self.format, ClearColor::Background);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        let shader = self.texts[self.text.load(Ordering::Relaxed)].as_str();
        let (parameters, blend_equations) = ((&self.parameters[..]).into(), self.blend_equations.clone());
        match self.kind {
            Kind::FullScreen => {
                Draws::FullScreen(FullScreen { shader, parameters, blend_equations, ..FullScreen::default() })
            }
            Kind::Objects => {
                let fragment = Some("fragment");
                Draws::Commands(CommandDraws {
                    shader,
                    fragment,
                    parameters,
                    blend_equations,
                    ..CommandDraws::default()
                })
            }
        }
    }
}

type Pair = (Renderer<WgpuBackend>, Submitter<WgpuBackend>);

fn device() -> (wgpu::Instance, wgpu::Device, wgpu::Queue) {
    adapter::noop_instance_and_device(wgpu::Features::empty()).unwrap()
}

/// A scene that needs one draw state.
fn one_cube() -> Scene {
    let mut scene = Scene::new();
    let (mesh, material) = (scene.add(cube()).unwrap(), scene.add(Material::default()).unwrap());
    scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
    scene.cameras = vec![Camera::looking_at("main", DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO)];
    scene
}

fn build(backend: WgpuBackend, workers: usize, layers: impl IntoIterator<Item = Layer>) -> Pair {
    let builder = layers.into_iter().fold(Renderer::builder(backend), RendererBuilder::process);
    builder.build(Arc::new(Scheduler::new(workers).unwrap())).unwrap()
}

fn draw((renderer, submitter): &mut Pair) {
    let scene = one_cube();
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    submitter.submit(recorded).unwrap().submission.wait().unwrap();
}

/// The numbers of shader modules, pipeline layouts and render pipelines that a device has.
fn compiled(instance: &wgpu::Instance) -> [usize; 3] {
    let report = instance.generate_report().unwrap();
    let hub = report.hub_report();
    [&hub.shader_modules, &hub.pipeline_layouts, &hub.render_pipelines].map(|registry| registry.num_kept_from_user)
}

/// What a device has for these processes when a frame has drawn them.
fn compiled_for(layers: impl IntoIterator<Item = Layer>) -> [usize; 3] {
    let (instance, device, queue) = device();
    let mut pair = build(WgpuBackend::new(device, queue).unwrap(), 1, layers);
    draw(&mut pair);
    let pipelines = pair.0.backend().resources().pipelines;
    let counts = compiled(&instance);
    assert_eq!(pipelines, counts[2]);
    drop(pair);
    assert_eq!(compiled(&instance), [0; 3]);
    counts
}

#[test]
fn two_hundred_processes_of_one_text_have_one_module_and_one_pipeline() {
    for kind in [Kind::FullScreen, Kind::Objects] {
        for workers in [1, 4] {
            let (instance, device, queue) = device();
            let backend = WgpuBackend::new(device, queue).unwrap();
            let mut pair = build(backend, workers, (0..200).map(|index| Layer::new(format!("layer {index}"), kind)));
            draw(&mut pair);
            assert_eq!(compiled(&instance), [1; 3], "{kind:?}");
            assert_eq!(pair.0.backend().resources().pipelines, 1);
            draw(&mut pair);
            assert_eq!(compiled(&instance), [1; 3], "{kind:?}");
        }
    }
}

#[test]
fn pipelines_that_are_prepared_are_shared_too() {
    let (instance, device, queue) = device();
    let backend = WgpuBackend::new(device, queue).unwrap();
    let mut pair = build(backend, 2, (0..20).map(|index| Layer::new(format!("layer {index}"), Kind::Objects)));
    let scene = one_cube();
    pair.0.prepare_pipelines_in_background(scene.as_scene_ref()).unwrap().wait().unwrap().unwrap();
    assert_eq!(compiled(&instance), [1; 3]);
    draw(&mut pair);
    assert_eq!(compiled(&instance), [1; 3]);
}

#[test]
fn what_differs_in_anything_that_wgpu_is_told_is_not_shared() {
    let one = |kind| Layer::new("one", kind);
    let two = |kind| Layer::new("two", kind);
    for kind in [Kind::FullScreen, Kind::Objects] {
        assert_eq!(compiled_for([one(kind), two(kind)]), [1, 1, 1], "equal");
        let format = Layer { format: Format::Rgba16Float, ..two(kind) };
        assert_eq!(compiled_for([one(kind), format]), [1, 1, 2], "formats");
        let blends = Layer { blend_equations: vec![BlendEquation::ADDITIVE], ..two(kind) };
        assert_eq!(compiled_for([one(kind), blends]), [1, 1, 2], "blending");
        let parameters = Layer { parameters: vec![0; 16], ..two(kind) };
        assert_eq!(compiled_for([one(kind), parameters]), [1, 2, 2], "layouts");
        let [text, other] = [0.25, 0.75].map(|constant| {
            let text = if kind == Kind::Objects { OBJECTS } else { GRAY };
            format!("const GRAY: f32 = {constant};\n{text}")
        });
        assert_eq!(compiled_for([one(kind).with_text(text), two(kind).with_text(other)]), [2, 1, 2], "constants");
        // Values of parameters are no part of a pipeline.
        let [zeros, ones] = [0, 1].map(|byte| vec![byte; 16]);
        let values = [Layer { parameters: zeros, ..one(kind) }, Layer { parameters: ones, ..two(kind) }];
        assert_eq!(compiled_for(values), [1, 1, 1], "parameters");
    }
    assert_eq!(compiled_for([one(Kind::FullScreen), two(Kind::Objects)]), [2, 1, 2], "sources of vertices");
}

/// Draws with an entry point of a name that it is given.
struct EntryPoint(&'static str);

impl RenderProcess for EntryPoint {
    fn name(&self) -> &str {
        self.0
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color(format!("target of {}", self.0), Format::Rgba8Unorm, ClearColor::Background);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @vertex
            fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
                return vec4<f32>(f32(index % 2u), f32(index / 2u), 0.0, 1.0);
            }

            @fragment
            fn first() -> @location(0) vec4<f32> { return vec4<f32>(0.0); }

            @fragment
            fn second() -> @location(0) vec4<f32> { return vec4<f32>(1.0); }
        ";
        let fragment = Some(self.0);
        Draws::Procedural(ProceduralDraws { shader, fragment, ..ProceduralDraws::default() })
    }
}

#[test]
fn two_entry_points_of_one_text_share_the_module_alone() {
    let (instance, device, queue) = device();
    let builder = Renderer::builder(WgpuBackend::new(device, queue).unwrap());
    let builder = builder.process(EntryPoint("first")).process(EntryPoint("second"));
    let mut pair = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    draw(&mut pair);
    assert_eq!(compiled(&instance), [1, 1, 2]);
}

#[test]
fn a_text_goes_with_the_last_process_that_uses_it() {
    let (instance, device, queue) = device();
    let text = Arc::new(AtomicUsize::new(0));
    let texts = vec![GRAY.to_owned(), GRAY.replace("0.5", "0.25")];
    let changing = Layer { texts: texts.clone(), text: Arc::clone(&text), ..Layer::new("changing", Kind::FullScreen) };
    let other = Arc::new(AtomicUsize::new(0));
    let follower = Layer { texts, text: Arc::clone(&other), ..Layer::new("follower", Kind::FullScreen) };
    let mut pair = build(WgpuBackend::new(device, queue).unwrap(), 1, [changing, follower]);
    let mut counts = Vec::new();
    for selected in [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]] {
        text.store(selected[0], Ordering::Relaxed);
        other.store(selected[1], Ordering::Relaxed);
        // A pool keeps the latest frame, which has pipelines of its own.
        draw(&mut pair);
        draw(&mut pair);
        counts.push(compiled(&instance));
    }
    assert_eq!(counts, [[1, 1, 1], [2, 1, 2], [1, 1, 1], [2, 1, 2], [1, 1, 1]]);
}

#[test]
fn a_broken_shader_is_drawn_as_before_until_its_process_is_removed() {
    let (instance, device, queue) = device();
    let text = Arc::new(AtomicUsize::new(0));
    let broken = GRAY.replace("0.5", "unknown");
    let edited = Layer { text: Arc::clone(&text), ..Layer::new("edited", Kind::FullScreen) };
    let edited = Layer { texts: vec![GRAY.to_owned(), broken], ..edited };
    let backend = WgpuBackend::new(device, queue).unwrap().keep_working_shaders();
    let mut pair = build(backend, 1, [Layer::new("other", Kind::Objects), edited]);
    let errors = |pair: &mut Pair| {
        draw(pair);
        draw(pair);
        pair.0.backend().shader_errors().len()
    };
    assert_eq!(errors(&mut pair), 0);
    text.store(1, Ordering::Relaxed);
    assert_eq!(errors(&mut pair), 1);
    // It is not removed while it is off.
    pair.0.set_process_enabled("edited", false).unwrap();
    draw(&mut pair);
    pair.0.set_process_enabled("edited", true).unwrap();
    assert_eq!(errors(&mut pair), 1);
    pair.0.remove_process("edited").unwrap();
    assert_eq!(errors(&mut pair), 0);
    assert_eq!(compiled(&instance), [1; 3]);
}

#[test]
fn an_error_of_a_shared_text_names_each_process() {
    type IsNamed = fn(&BackendError, &str) -> bool;
    let wrong = "@fragment fn fragment() -> @location(0) vec4<f32> { return unknown; }";
    let nameless = "@fragment fn other() -> @location(0) vec4<f32> { return vec4<f32>(1.0); }";
    let scene = one_cube();
    let compiler: IsNamed = |error, name| matches!(error, BackendError::Shader { process, .. } if process == name);
    let device_error: IsNamed =
        |error, name| matches!(error, BackendError::Validation { label, .. } if label.contains(name));
    for (text, is_named) in [(wrong, compiler), (nameless, device_error)] {
        let (_, device, queue) = device();
        // Whatever a backend of a library does, the next one finds.
        let library = PipelineLibrary::new(device, queue);
        for name in ["first", "second", "first"] {
            let layer = Layer::new(name, Kind::FullScreen).with_text(text);
            let (mut renderer, _) = build(library.backend().unwrap(), 1, [layer]);
            for _ in 0..2 {
                let error = renderer.record(scene.as_scene_ref()).err().unwrap();
                assert!(matches!(&error, FrameError::Backend(error) if is_named(error, name)), "{error:?}");
            }
        }
        // And beside a process of that text in the same frame.
        let layers = ["right", "wrong"].map(|name| Layer::new(name, Kind::FullScreen));
        let [right, broken] = layers;
        let (mut renderer, _) = build(library.backend().unwrap(), 1, [right, broken.with_text(text)]);
        let error = renderer.record(scene.as_scene_ref()).err().unwrap();
        assert!(matches!(&error, FrameError::Backend(error) if is_named(error, "wrong")), "{error:?}");
        assert_eq!(library.pipeline_count(), 1);
    }
}
