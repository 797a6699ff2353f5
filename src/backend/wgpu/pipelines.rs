//! Pipelines: what a process and a draw's state become on the device.

use std::borrow::Cow;
use std::collections::HashMap;

use parking_lot::{RwLock, RwLockReadGuard};

use super::layouts::{Layouts, process_layout, texture_format};
use super::targets::ViewTargets;
use crate::command::{Cull, DrawState};
use crate::process::{Declaration, Draws, Format, FramePlan, PlannedProcess, SHADER_PRELUDE};
use crate::queue::Batch;
use crate::scene::{Blend, Topology, Vertex};

/// The pipelines of one process: one for each state that a scene has needed so far.
pub(super) struct ProcessPipelines {
    recipe: Recipe<'static>,
    /// `@group(2)`; `None` for a process that has nothing there.
    process_layout: Option<wgpu::BindGroupLayout>,
    /// `None` for a raw pass.
    shader: Option<Shader>,
    colors: Vec<wgpu::TextureFormat>,
    depth: Option<Depth>,
    by_state: RwLock<HashMap<DrawState, wgpu::RenderPipeline>>,
}

/// All that pipelines are made from and that a process may change from frame to frame.
#[derive(Clone, Debug, Default, PartialEq)]
struct Recipe<'a> {
    shader: Cow<'a, str>,
    /// Empty for a raw pass.
    vertex: &'static str,
    fragment: Option<Cow<'a, str>>,
    parameter_bytes: usize,
    writes_depth: bool,
    /// For a full-screen triangle.
    blend: Blend,
}

impl<'a> Recipe<'a> {
    /// Borrowed, because every frame compares it with what the pipelines were made from.
    fn new(draws: &Draws<'a>) -> Self {
        match draws {
            Draws::Commands(commands) => Self {
                shader: Cow::Borrowed(commands.shader),
                vertex: "vertex",
                fragment: commands.fragment.map(Cow::Borrowed),
                parameter_bytes: commands.parameters.len(),
                writes_depth: commands.writes_depth,
                blend: Blend::None,
            },
            Draws::FullScreen(full_screen) => Self {
                shader: Cow::Borrowed(full_screen.shader),
                vertex: "full_screen",
                fragment: Some(Cow::Borrowed("fragment")),
                parameter_bytes: full_screen.parameters.len(),
                writes_depth: false,
                blend: full_screen.blend,
            },
            Draws::Raw(_) => Self::default(),
        }
    }

    fn into_owned(self) -> Recipe<'static> {
        let owned = |text: Cow<'a, str>| Cow::Owned(text.into_owned());
        Recipe { shader: owned(self.shader), fragment: self.fragment.map(owned), ..self }
    }
}

struct Shader {
    module: wgpu::ShaderModule,
    layout: wgpu::PipelineLayout,
}

#[derive(Clone, Copy)]
struct Depth {
    format: wgpu::TextureFormat,
    writes: bool,
}

impl ProcessPipelines {
    pub(super) fn new(
        device: &wgpu::Device,
        layouts: &Layouts,
        plan: &FramePlan,
        planned: &PlannedProcess,
        draws: &Draws<'_>,
    ) -> Self {
        let declaration = &planned.declaration;
        let format_of = |target: &str| {
            let mut targets = plan.targets().iter().filter(|planned| planned.views == declaration.views);
            targets.find(|planned| planned.name == target).map_or(Format::Rgba8Unorm, |planned| planned.format)
        };
        let recipe = Recipe::new(draws).into_owned();
        let process_layout = process_layout(device, recipe.parameter_bytes, declaration.samples().map(format_of));
        let shader = (!recipe.vertex.is_empty()).then(|| {
            let name = planned.process.name();
            let source = format!("{SHADER_PRELUDE}\n{}", recipe.shader);
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(name),
                source: wgpu::ShaderSource::Wgsl(source.into()),
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
        let depth = declaration.depth().map(|(target, cleared)| Depth {
            format: texture_format(format_of(target)),
            writes: cleared && recipe.writes_depth,
        });
        let colors = declaration.colors().map(|(target, _)| texture_format(format_of(target))).collect();
        let pipelines = Self { recipe, process_layout, shader, colors, depth, by_state: RwLock::default() };
        if let Draws::FullScreen(full_screen) = draws {
            pipelines.keep(pipelines.make(device, full_screen_state(full_screen.blend)));
        }
        pipelines
    }

    /// Whether they are what a process that draws this needs.
    pub(super) fn fit(&self, draws: &Draws<'_>) -> bool {
        self.recipe == Recipe::new(draws)
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
            let state = run[0].state;
            if !prepared.contains_key(&state) && !made.contains_key(&state) {
                made.extend(self.make(device, state));
            }
        }
        made
    }

    /// Keeps pipelines that were made.
    pub(super) fn keep(&self, made: impl IntoIterator<Item = (DrawState, wgpu::RenderPipeline)>) {
        self.by_state.write().extend(made);
    }

    /// The pipelines there are, by state.
    pub(super) fn prepared(&self) -> RwLockReadGuard<'_, HashMap<DrawState, wgpu::RenderPipeline>> {
        self.by_state.read()
    }

    /// What the process has at `@group(2)` in one pass.
    pub(super) fn process_group(
        &self,
        device: &wgpu::Device,
        parameters: Option<wgpu::BufferBinding<'_>>,
        targets: &ViewTargets,
        declaration: &Declaration,
    ) -> Option<wgpu::BindGroup> {
        let layout = self.process_layout.as_ref()?;
        let parameters = parameters.map(|buffer| (0, wgpu::BindingResource::Buffer(buffer)));
        let sampled = (1..).zip(declaration.samples()).filter_map(|(binding, name)| {
            targets.find(name).map(|target| (binding, wgpu::BindingResource::TextureView(&target.view)))
        });
        let entries: Vec<_> = parameters
            .into_iter()
            .chain(sampled)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let descriptor = wgpu::BindGroupDescriptor { label: Some("process"), layout, entries: &entries };
        Some(device.create_bind_group(&descriptor))
    }

    /// What a bundle must know of the pass that it is for.
    pub(super) fn bundle_descriptor<'a>(
        &self,
        label: &'a str,
        color_formats: &'a [Option<wgpu::TextureFormat>],
    ) -> wgpu::RenderBundleEncoderDescriptor<'a> {
        wgpu::RenderBundleEncoderDescriptor {
            label: Some(label),
            color_formats,
            depth_stencil: self.depth.map(|depth| wgpu::RenderBundleDepthStencil {
                format: depth.format,
                depth_read_only: !depth.writes,
                stencil_read_only: true,
            }),
            sample_count: 1,
            multiview: None,
        }
    }

    /// The formats of the colour targets.
    pub(super) fn color_formats(&self) -> Vec<Option<wgpu::TextureFormat>> {
        self.colors.iter().copied().map(Some).collect()
    }

    /// `None` for a raw pass, which has no pipelines.
    fn make(&self, device: &wgpu::Device, state: DrawState) -> Option<(DrawState, wgpu::RenderPipeline)> {
        let shader = self.shader.as_ref()?;
        let target = |format: &wgpu::TextureFormat| {
            Some(wgpu::ColorTargetState {
                format: *format,
                blend: blend_state(state.blend()),
                write_mask: wgpu::ColorWrites::ALL,
            })
        };
        let targets: Vec<_> = self.colors.iter().map(target).collect();
        let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2];
        let vertices = [Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &attributes,
        })];
        let full_screen = self.recipe.vertex == "full_screen";
        let (topology, strip_index_format) = match state.topology() {
            Topology::TriangleList => (wgpu::PrimitiveTopology::TriangleList, None),
            Topology::TriangleStrip => (wgpu::PrimitiveTopology::TriangleStrip, Some(wgpu::IndexFormat::Uint32)),
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&shader.layout),
            vertex: wgpu::VertexState {
                module: &shader.module,
                entry_point: Some(self.recipe.vertex),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: if full_screen { &[] } else { &vertices },
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
            depth_stencil: self.depth.map(|depth| wgpu::DepthStencilState {
                format: depth.format,
                // What mixes with what is behind it must not hide what is drawn after it.
                depth_write_enabled: Some(depth.writes && state.blend() == Blend::None),
                // The full-screen triangle is infinitely far away, and is to show where nothing else is.
                depth_compare: Some(if full_screen {
                    wgpu::CompareFunction::GreaterEqual
                } else {
                    wgpu::CompareFunction::Greater
                }),
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
}

/// The state that a full-screen triangle is drawn with.
pub(super) fn full_screen_state(blend: Blend) -> DrawState {
    DrawState::new(Topology::TriangleList, Cull::Nothing, blend)
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
