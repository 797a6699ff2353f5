//! Pipelines: what a process and a draw's state become on the device.

use std::borrow::Cow;
use std::collections::HashMap;

use parking_lot::{Mutex, RwLock, RwLockReadGuard};

use super::chooser::Chooser;
use super::layouts::{Layouts, Sampled, process_layout, texture_format};
use super::vertices::{attributes, stride};
use super::ways::Ways;
use crate::command::Batch;
use crate::command::{Cull, DrawState};
use crate::process::{Access, Declaration, Draws, Format, FramePlan, PlannedProcess, SHADER_PRELUDE};
use crate::quality::{Quality, TransformPrecision, VertexFormat};
use crate::scene::{Blend, LightKind, Topology, ViewKind};

/// The pipelines of one process: one for each state that a scene has needed so far.
pub(super) struct ProcessPipelines {
    name: String,
    recipe: Recipe<'static>,
    attachments: Attachments,
    /// `@group(2)`; `None` for a process that has nothing there.
    process_layout: Option<wgpu::BindGroupLayout>,
    /// `None` for a raw pass.
    shader: Option<Shader>,
    by_state: RwLock<HashMap<DrawState, wgpu::RenderPipeline>>,
    /// Which way is taken, for each view that the process draws in.
    choosers: Mutex<Vec<Option<Chooser>>>,
}

/// All that pipelines are made from and that a process, or the quality, may change from frame to frame.
#[derive(Clone, Debug, PartialEq)]
struct Recipe<'a> {
    shader: Cow<'a, str>,
    vertices: Vertices,
    fragment: Option<Cow<'a, str>>,
    parameter_bytes: usize,
    writes_depth: bool,
    /// The one state of what is not drawn by commands.
    state: Option<DrawState>,
    transforms: TransformPrecision,
}

/// What a process draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Vertices {
    Meshes(VertexFormat),
    /// One triangle, infinitely far away.
    FullScreen,
    LightVolumes,
    /// Whatever a raw pass encodes.
    None,
}

impl<'a> Recipe<'a> {
    /// Borrowed, because every frame compares it with what the pipelines were made from.
    fn new(draws: &Draws<'a>, quality: &Quality) -> Self {
        let (transforms, format) = (quality.transforms, quality.vertices);
        let parameter_bytes = draws.parameters().len();
        let state = fixed_state(draws);
        let of = |shader: &'a str, vertices, fragment: Option<&'a str>, writes_depth| {
            let (shader, fragment) = (Cow::Borrowed(shader), fragment.map(Cow::Borrowed));
            Self { shader, vertices, fragment, parameter_bytes, writes_depth, state, transforms }
        };
        match draws {
            Draws::Commands(draws) => of(draws.shader, Vertices::Meshes(format), draws.fragment, draws.writes_depth),
            Draws::FullScreen(draws) => of(draws.shader, Vertices::FullScreen, Some("fragment"), false),
            Draws::Lights(draws) => of(draws.shader, Vertices::LightVolumes, Some("fragment"), false),
            Draws::Raw(_) => of("", Vertices::None, None, false),
        }
    }

    fn into_owned(self) -> Recipe<'static> {
        let owned = |text: Cow<'a, str>| Cow::Owned(text.into_owned());
        Recipe { shader: owned(self.shader), fragment: self.fragment.map(owned), ..self }
    }

    /// The whole of the WGSL.
    fn source(&self) -> String {
        let is_absolute = self.transforms == TransformPrecision::Absolute;
        format!("const ABSOLUTE_TRANSFORMS: bool = {is_absolute};\n{SHADER_PRELUDE}\n{}", self.shader)
    }
}

/// What a process draws into and reads from.
#[derive(Clone, Debug, PartialEq)]
struct Attachments {
    colors: Vec<Option<wgpu::TextureFormat>>,
    depth: Option<Depth>,
    sampled: Vec<Sampled>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Depth {
    format: wgpu::TextureFormat,
    /// Whether the pass may write it at all; a draw may still leave it alone.
    writable: bool,
    /// Whether only what has just the depth that is there is drawn.
    matches: bool,
}

impl Attachments {
    fn new(plan: &FramePlan, declaration: &Declaration) -> Self {
        let planned = |views: ViewKind, target: &str| {
            plan.targets().iter().find(|planned| planned.views == views && planned.name == target)
        };
        let format_of =
            |views, target: &str| planned(views, target).map_or(Format::Rgba8Unorm, |planned| planned.format);
        let colors = declaration.colors().map(|(target, _)| Some(texture_format(format_of(declaration.views, target))));
        let depth = declaration.depth().map(|(target, access)| Depth {
            format: texture_format(format_of(declaration.views, target)),
            writable: access.writes(),
            matches: access == Access::MatchDepth,
        });
        let sampled = declaration.accesses.iter().filter_map(|(target, access)| match access {
            Access::Sample => Some(Sampled { format: format_of(declaration.views, target), layered: false }),
            Access::SampleLayers(views) => Some(Sampled { format: format_of(*views, target), layered: true }),
            _ => None,
        });
        Self { colors: colors.collect(), depth, sampled: sampled.collect() }
    }
}

struct Shader {
    module: wgpu::ShaderModule,
    layout: wgpu::PipelineLayout,
}

impl ProcessPipelines {
    pub(super) fn new(
        device: &wgpu::Device,
        layouts: &Layouts,
        plan: &FramePlan,
        planned: &PlannedProcess,
        draws: &Draws<'_>,
        quality: &Quality,
    ) -> Self {
        let name = planned.process.name();
        let recipe = Recipe::new(draws, quality).into_owned();
        let attachments = Attachments::new(plan, &planned.declaration);
        let process_layout = process_layout(device, recipe.parameter_bytes, &attachments.sampled);
        let shader = (recipe.vertices != Vertices::None).then(|| {
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(name),
                source: wgpu::ShaderSource::Wgsl(recipe.source().into()),
            });
            let groups = [Some(&layouts.frame), Some(&layouts.assets), process_layout.as_ref()];
            let used = if process_layout.is_some() { 3 } else { 2 };
            let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(name),
                bind_group_layouts: &groups[..used],
                immediate_size: 0,
            });
            Shader { module, layout }
        });
        let (name, by_state, choosers) = (name.to_owned(), RwLock::default(), Mutex::default());
        let pipelines = Self { name, recipe, attachments, process_layout, shader, by_state, choosers };
        if let Some(state) = pipelines.recipe.state {
            pipelines.keep(pipelines.make(device, state));
        }
        pipelines
    }

    /// Whether they are what a process of this plan that draws this needs, in frames of this quality.
    pub(super) fn fit(&self, plan: &FramePlan, planned: &PlannedProcess, draws: &Draws<'_>, quality: &Quality) -> bool {
        self.name == planned.process.name()
            && self.still_fit(draws, quality)
            && self.attachments == Attachments::new(plan, &planned.declaration)
    }

    /// Whether they still are what a process draws, which they were made for.
    pub(super) fn still_fit(&self, draws: &Draws<'_>, quality: &Quality) -> bool {
        self.recipe == Recipe::new(draws, quality)
    }

    /// Makes the pipelines that these batches need and that are not there yet. They are to be kept only if the device found
    /// no error in them.
    #[must_use]
    pub(super) fn make_missing(
        &self,
        device: &wgpu::Device,
        batches: &[Batch],
    ) -> HashMap<DrawState, wgpu::RenderPipeline> {
        let mut made = HashMap::new();
        let prepared = self.prepared();
        for run in batches.chunk_by(|one, next| one.state == next.state) {
            let state = run[0].state.pipeline_state();
            if !prepared.contains_key(&state) && !made.contains_key(&state) {
                made.extend(self.make(device, state));
            }
        }
        made
    }

    /// Keeps pipelines that were made.
    pub(super) fn keep(&self, made: impl IntoIterator<Item = (DrawState, wgpu::RenderPipeline)>) {
        let mut made = made.into_iter().peekable();
        // Whoever records reads the pipelines for as long as that takes. As a rule there is none to add, and nothing to wait for.
        if made.peek().is_some() {
            self.by_state.write().extend(made);
        }
    }

    /// The pipelines there are, by state.
    pub(super) fn prepared(&self) -> RwLockReadGuard<'_, HashMap<DrawState, wgpu::RenderPipeline>> {
        self.by_state.read()
    }

    /// What the process has at `@group(2)` in one pass; `None` where it has nothing there.
    pub(super) fn process_group<'a>(
        &self,
        device: &wgpu::Device,
        parameters: Option<wgpu::BufferBinding<'a>>,
        sampled: impl Iterator<Item = &'a wgpu::TextureView>,
    ) -> Option<wgpu::BindGroup> {
        let layout = self.process_layout.as_ref()?;
        let parameters = parameters.map(|buffer| (0, wgpu::BindingResource::Buffer(buffer)));
        let sampled = (1..).zip(sampled);
        let sampled = sampled.map(|(binding, texture)| (binding, wgpu::BindingResource::TextureView(texture)));
        let entries: Vec<_> = parameters
            .into_iter()
            .chain(sampled)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let descriptor = wgpu::BindGroupDescriptor { label: Some("process"), layout, entries: &entries };
        Some(device.create_bind_group(&descriptor))
    }

    /// What a bundle must know of the pass that it is for.
    pub(super) fn bundle_descriptor<'a>(&'a self, label: &'a str) -> wgpu::RenderBundleEncoderDescriptor<'a> {
        wgpu::RenderBundleEncoderDescriptor {
            label: Some(label),
            color_formats: &self.attachments.colors,
            depth_stencil: self.attachments.depth.map(|depth| wgpu::RenderBundleDepthStencil {
                format: depth.format,
                depth_read_only: !depth.writable,
                stencil_read_only: true,
            }),
            sample_count: 1,
            multiview: None,
        }
    }

    /// Asks or tells what chooses the way of one view's pass.
    pub(super) fn with_chooser<R>(&self, view: usize, ways: &Ways, work: impl FnOnce(&mut Chooser) -> R) -> R {
        let mut choosers = self.choosers.lock();
        if choosers.len() <= view {
            choosers.resize_with(view + 1, || None);
        }
        work(choosers[view].get_or_insert_with(|| ways.chooser()))
    }

    /// The process's name.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// `None` for a raw pass, which has no pipelines.
    fn make(&self, device: &wgpu::Device, state: DrawState) -> Option<(DrawState, wgpu::RenderPipeline)> {
        let shader = self.shader.as_ref()?;
        let target = |format: &Option<wgpu::TextureFormat>| {
            let (blend, write_mask) = (blend_state(state.blend()), wgpu::ColorWrites::ALL);
            format.map(|format| wgpu::ColorTargetState { format, blend, write_mask })
        };
        let targets: Vec<_> = self.attachments.colors.iter().map(target).collect();
        let layout = |array_stride, attributes| wgpu::VertexBufferLayout {
            array_stride,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes,
        };
        let (entry_point, vertices) = match self.recipe.vertices {
            Vertices::Meshes(format) => ("vertex", Some(Some(layout(stride(format), attributes(format))))),
            Vertices::LightVolumes => ("light_volume", Some(Some(layout(size_of::<[f32; 3]>() as u64, &PLACE_ALONE)))),
            Vertices::FullScreen | Vertices::None => ("full_screen", None),
        };
        let (topology, strip_index_format) = match state.topology() {
            Topology::TriangleList => (wgpu::PrimitiveTopology::TriangleList, None),
            Topology::TriangleStrip => (wgpu::PrimitiveTopology::TriangleStrip, Some(wgpu::IndexFormat::Uint32)),
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&shader.layout),
            vertex: wgpu::VertexState {
                module: &shader.module,
                entry_point: Some(entry_point),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: vertices.as_slice(),
            },
            primitive: wgpu::PrimitiveState {
                topology,
                strip_index_format,
                front_face: wgpu::FrontFace::Ccw,
                cull_mode: match state.cull() {
                    Cull::Back => Some(wgpu::Face::Back),
                    Cull::Front => Some(wgpu::Face::Front),
                    Cull::Nothing => None,
                },
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: self.attachments.depth.map(|depth| wgpu::DepthStencilState {
                format: depth.format,
                // What mixes with what is behind it must not hide what is drawn after it.
                depth_write_enabled: Some(depth.writable && self.recipe.writes_depth && state.blend() == Blend::None),
                depth_compare: Some(self.depth_compare(depth)),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: self.recipe.fragment.as_ref().map(|entry_point| wgpu::FragmentState {
                module: &shader.module,
                entry_point: Some(entry_point),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        });
        Some((state, pipeline))
    }

    /// Depth is reversed: what is nearer is greater.
    fn depth_compare(&self, depth: Depth) -> wgpu::CompareFunction {
        match self.recipe.vertices {
            _ if depth.matches => wgpu::CompareFunction::Equal,
            // Infinitely far away, it shows where nothing else is.
            Vertices::FullScreen => wgpu::CompareFunction::GreaterEqual,
            // The far side of what a light reaches, where it is behind a surface; and never where there is none.
            Vertices::LightVolumes => wgpu::CompareFunction::Less,
            Vertices::Meshes(_) | Vertices::None => wgpu::CompareFunction::Greater,
        }
    }
}

/// Of a light's geometry.
const PLACE_ALONE: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![0 => Float32x3];

/// The one state that is drawn with what is not drawn by commands; `None` for commands, of which each has its own.
pub(super) fn fixed_state(draws: &Draws<'_>) -> Option<DrawState> {
    match draws {
        Draws::FullScreen(full_screen) => {
            Some(DrawState::new(Topology::TriangleList, Cull::Nothing, full_screen.blend))
        }
        Draws::Lights(lights) => {
            // Their far sides alone: those are seen from inside too.
            let cull = if lights.class.kind == LightKind::Directional { Cull::Nothing } else { Cull::Front };
            Some(DrawState::new(Topology::TriangleList, cull, Blend::Additive))
        }
        _ => None,
    }
}

fn blend_state(blend: Blend) -> Option<wgpu::BlendState> {
    use wgpu::{BlendComponent, BlendFactor, BlendOperation};
    let both = |component: BlendComponent| wgpu::BlendState { color: component, alpha: component };
    let add = |operation| BlendComponent { src_factor: BlendFactor::One, dst_factor: BlendFactor::One, operation };
    match blend {
        Blend::None => None,
        Blend::Alpha => Some(wgpu::BlendState::ALPHA_BLENDING),
        Blend::Additive => Some(both(add(BlendOperation::Add))),
        Blend::Subtractive => Some(both(add(BlendOperation::ReverseSubtract))),
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use std::sync::{Arc, mpsc};
    use std::time::Duration;

    use super::*;
    use crate::process::{GeometryBuffer, GeometryFormats};

    #[test]
    fn who_has_no_pipeline_to_add_does_not_wait_for_those_who_record() {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::NOOP;
        descriptor.backend_options.noop = wgpu::NoopBackendOptions { enable: true, ..Default::default() };
        let instance = wgpu::Instance::new(descriptor);
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default())).unwrap();
        let (device, _) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default())).unwrap();
        let process = Arc::new(GeometryBuffer::new(GeometryFormats::default()));
        let plan = FramePlan::new(Vec::new(), vec![process], &["diffuse".to_owned()]).unwrap();
        let draws = plan.draws().unwrap();
        let quality = Quality::balanced();
        let layouts = Layouts::new(&device);
        let pipelines = ProcessPipelines::new(&device, &layouts, &plan, &plan.processes()[0], &draws[0], &quality);

        let (sender, receiver) = mpsc::channel();
        std::thread::scope(|scope| {
            let recording = pipelines.prepared();
            scope.spawn(|| {
                pipelines.keep(pipelines.make_missing(&device, &[]));
                sender.send(()).unwrap();
            });
            let kept = receiver.recv_timeout(Duration::from_secs(10));
            drop(recording);
            kept.unwrap();
        });
    }
}
