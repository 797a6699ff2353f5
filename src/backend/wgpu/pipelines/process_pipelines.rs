//! The pipelines of a render process, one for each draw state.

use std::collections::{HashMap, HashSet};
use std::sync::OnceLock;

use parking_lot::{Mutex, RwLock, RwLockReadGuard};
use wgpu::util::{BufferInitDescriptor, DeviceExt};

use super::attachment_formats::{
    AttachmentFormats, DepthAttachmentFormat, blend_state, color_writes, compare_function,
};
use super::binding_limits::{GroupBindings, check_binding_limits};
use super::compile_shader::shader_label;
use super::compiled_shader::CompiledShader;
use super::pipeline_inputs::PipelineInputs;
use super::pipeline_key::VertexSource;
use super::pipeline_variant::PipelineVariant;
use super::shared_pipelines::{RenderPipelineDescription, SharedGroupLayout, SharedPipelines, SharedRenderPipeline};
use super::vertex_buffers::{VertexBuffers, attribute_defaults};
use crate::backend::BackendError;
use crate::backend::wgpu::resources::{BindGroupLayouts, engine_layout_entries, process_layout_entries};
use crate::backend::wgpu::strategy::{PassTuner, StrategySet};
use crate::command::{Cull, DrawState};
use crate::process::{Access, ColorMask, DeclaredAttribute, DepthBias, Draws, FramePlan, PlannedProcess, Primitive};
use crate::quality::Quality;
use crate::scene::{Blend, Topology};
use crate::unwind::emit_unlocked;

/// The pipelines of one render process: one for each draw state that a scene has needed so far.
pub(crate) struct ProcessPipelines {
    pub(super) inputs: PipelineInputs,
    /// Of `@group(2)`; `None` for a process without parameters and sampled targets.
    pub(crate) process_layout: Option<SharedGroupLayout>,
    /// Of `@group(3)`; `None` for a process that reads neither columns nor resources of the engine's own.
    pub(crate) engine_layout: Option<SharedGroupLayout>,
    /// The [values](attribute_defaults) that its attributes have in meshes that lack them; made for the first imported
    /// mesh.
    attribute_defaults: OnceLock<wgpu::Buffer>,
    /// `None` for a raw pass.
    shader: Option<CompiledShader>,
    variants: RwLock<HashMap<PipelineVariant, SharedRenderPipeline>>,
    /// The variants of meshes of which the shader cannot read an attribute.
    unreadable: RwLock<HashSet<PipelineVariant>>,
    /// What it shares with other processes.
    shared: SharedPipelines,
    /// The tuner of each view's pass.
    tuners: Mutex<Vec<Option<PassTuner>>>,
}

impl ProcessPipelines {
    /// Compiles the shader of a process, unless another process has the same.
    ///
    /// # Errors
    /// If it does not compile.
    pub(crate) fn new(
        device: &wgpu::Device,
        (shared, layouts): (&SharedPipelines, &BindGroupLayouts),
        plan: &FramePlan,
        planned: &PlannedProcess,
        draws: &Draws<'_>,
        quality: &Quality,
    ) -> Result<Self, BackendError> {
        let inputs = PipelineInputs::new(device.features(), plan, planned, draws, quality);
        let PipelineInputs { key, attachments, array_count, resources, .. } = &inputs;
        let is_compute = key.vertices == VertexSource::Compute;
        let AttachmentFormats { sampled, writes_buffers, .. } = attachments;
        let label = shader_label(&planned.name);
        let of_process = process_layout_entries(key.parameter_bytes, sampled, writes_buffers, is_compute);
        let of_engine = engine_layout_entries(*array_count, resources, is_compute);
        if key.vertices != VertexSource::None {
            let group = |what, entries| GroupBindings { what, entries };
            let groups = [
                group("of the frame and the view", &layouts.frame_entries[..]),
                group("of materials and their textures", &layouts.asset_entries),
                group("for its parameters, targets and buffers", &of_process),
                group("for its columns, materials and resources", &of_engine),
            ];
            check_binding_limits(&device.limits(), &planned.name, &groups, is_compute)?;
        }
        let process_layout = shared.group_layout(device, &label, of_process)?;
        let engine_layout = shared.group_layout(device, &label, of_engine)?;
        let shader = match key.vertices {
            VertexSource::None => None,
            _ => {
                let own = [process_layout.as_ref(), engine_layout.as_ref()];
                Some(CompiledShader::new(device, (shared, layouts), own, &planned.declaration, &inputs, draws)?)
            }
        };
        let pipelines = Self {
            inputs,
            process_layout,
            engine_layout,
            attribute_defaults: OnceLock::new(),
            shader,
            variants: RwLock::default(),
            unreadable: RwLock::default(),
            shared: shared.clone(),
            tuners: Mutex::default(),
        };
        if let Some(state) = pipelines.inputs.key.state {
            pipelines.insert(pipelines.create_missing(device, &label, pipelines.variants_of(state))?);
        }
        Ok(pipelines)
    }

    /// The pipelines for a state, and meshes in the crate's pages, in all kinds of views that it draws in.
    pub(crate) fn variants_of(&self, state: DrawState) -> impl Iterator<Item = PipelineVariant> {
        let variant = PipelineVariant::of_pages(state);
        let clamped = self.has_clamped_pipelines().then(|| variant.clone().clamping(true));
        std::iter::once(variant).chain(clamped)
    }

    /// Whether there are pipelines of their own for views that [clamp depth](crate::view::RenderView::clamps_depth).
    pub(crate) fn has_clamped_pipelines(&self) -> bool {
        self.inputs.has_clamped_pipelines()
    }

    /// Creates the missing ones of these pipelines, but for those of meshes of which the shader cannot read an
    /// attribute. Errors are those of `label`.
    ///
    /// # Errors
    /// If the device refuses one.
    pub(crate) fn create_missing(
        &self,
        device: &wgpu::Device,
        label: &str,
        variants: impl Iterator<Item = PipelineVariant>,
    ) -> Result<HashMap<PipelineVariant, SharedRenderPipeline>, BackendError> {
        let is_missing =
            |variant: &PipelineVariant| !self.variants().contains_key(variant) && !self.is_unreadable(variant);
        // No lock is held while the driver compiles, so that frames go on meanwhile.
        let missing: HashSet<_> = variants.filter(is_missing).collect();
        let mut created = HashMap::new();
        for variant in missing {
            match self.create(device, label, &variant) {
                Err(
                    problem @ (BackendError::AttributeFormatMismatch { .. } | BackendError::MissingVertexIndex { .. }),
                ) => {
                    self.unreadable.write().insert(variant);
                    emit_unlocked(move || {
                        tracing::warn!(target: "drawloom", %problem, "objects with this mesh are left out by this process");
                    });
                }
                found => created.extend(found?.map(|pipeline| (variant, pipeline))),
            }
        }
        Ok(created)
    }

    /// Whether the shader cannot read an attribute of meshes with this layout, so that there is no pipeline for them.
    pub(crate) fn is_unreadable(&self, variant: &PipelineVariant) -> bool {
        variant.layout.is_some() && self.unreadable.read().contains(variant)
    }

    /// Whether this layout exists.
    pub(crate) fn has_unreadable(&self) -> bool {
        !self.unreadable.read().is_empty()
    }

    /// Adds created pipelines.
    pub(crate) fn insert(&self, created: impl IntoIterator<Item = (PipelineVariant, SharedRenderPipeline)>) {
        let mut created = created.into_iter().peekable();
        // Recording holds the read lock. Mostly there is no pipeline to add, and then this does not wait for it.
        if created.peek().is_some() {
            self.variants.write().extend(created);
        }
    }

    /// The pipelines.
    pub(crate) fn variants(&self) -> RwLockReadGuard<'_, HashMap<PipelineVariant, SharedRenderPipeline>> {
        self.variants.read()
    }

    /// The pipeline of a compute shader; `None` for a process that draws.
    pub(crate) fn compute(&self) -> Option<&wgpu::ComputePipeline> {
        self.shader.as_ref()?.compute.as_deref()
    }

    /// Describes bundles for passes of this process.
    pub(crate) fn bundle_descriptor<'a>(&'a self, label: &'a str) -> wgpu::RenderBundleEncoderDescriptor<'a> {
        wgpu::RenderBundleEncoderDescriptor {
            label: Some(label),
            color_formats: &self.inputs.attachments.colors,
            depth_stencil: self.inputs.attachments.depth.map(DepthAttachmentFormat::bundle_state),
            sample_count: self.inputs.attachments.samples,
            multiview: None,
        }
    }

    /// Calls `work` with the tuner of one view's pass, which chooses among the strategies of the set.
    pub(crate) fn with_tuner<R>(&self, view: usize, set: &StrategySet, work: impl FnOnce(&mut PassTuner) -> R) -> R {
        let mut tuners = self.tuners.lock();
        if tuners.len() <= view {
            tuners.resize_with(view + 1, || None);
        }
        work(tuners[view].get_or_insert_with(|| set.tuner()))
    }

    /// The attributes of vertices that it reads, in the order of their buffers.
    pub(crate) fn attributes(&self) -> &[DeclaredAttribute] {
        &self.inputs.attributes
    }

    /// The values of attributes that imported meshes lack; `None` before there is a pipeline for imported meshes.
    pub(crate) fn attribute_defaults(&self) -> Option<&wgpu::Buffer> {
        self.attribute_defaults.get()
    }

    /// The process's name.
    pub(crate) fn name(&self) -> &str {
        &self.inputs.name
    }

    /// `None` for a raw pass, which has no pipeline.
    ///
    /// # Errors
    /// If the shader cannot read an attribute of a mesh, or the device refuses the pipeline.
    fn create(
        &self,
        device: &wgpu::Device,
        label: &str,
        variant: &PipelineVariant,
    ) -> Result<Option<SharedRenderPipeline>, BackendError> {
        let Some(shader) = &self.shader else { return Ok(None) };
        let state = variant.state;
        let PipelineInputs { name, key, attachments, attributes, .. } = &self.inputs;
        let AttachmentFormats { colors, can_be_blended, .. } = attachments;
        let (equations, own) = (&key.blend_equations, key.pipeline_state.as_deref());
        let write_mask = |index| {
            let mask = own.and_then(|own| own.color_masks.get(index)).copied().unwrap_or(ColorMask::ALL);
            color_writes(mask)
        };
        let target = |(index, (format, can_be_blended)): (usize, (&Option<wgpu::TextureFormat>, &bool))| {
            let equation = equations.get(index).copied().unwrap_or_else(|| state.blend().into());
            let blend = blend_state(equation).filter(|_| *can_be_blended);
            let write_mask = write_mask(index);
            format.map(|format| wgpu::ColorTargetState { format, blend, write_mask })
        };
        let targets: Vec<_> = colors.iter().zip(can_be_blended).enumerate().map(target).collect();
        let buffers = match &variant.layout {
            Some(layout) => {
                self.attribute_defaults.get_or_init(|| {
                    device.create_buffer_init(&BufferInitDescriptor {
                        label: Some("defaults of attributes"),
                        contents: &attribute_defaults(attributes),
                        usage: wgpu::BufferUsages::VERTEX,
                    })
                });
                VertexBuffers::of_imported_meshes(layout, attributes, name)?
            }
            None => VertexBuffers::new(key.vertices, attributes),
        };
        let masked = key.masked.as_ref().filter(|_| state.is_masked());
        let entry_point = match (key.vertices, masked) {
            (VertexSource::Meshes(_), Some([vertex, _])) => &**vertex,
            (VertexSource::Meshes(_) | VertexSource::Procedural(_), _) => "vertex",
            (VertexSource::LightVolumes, _) => "light_volume",
            (VertexSource::FullScreen | VertexSource::Compute | VertexSource::None, _) => "full_screen",
        };
        let fragment = masked.map(|[_, fragment]| fragment).or(key.fragment.as_ref());
        let (topology, strip_index_format) = match (key.vertices, state.topology()) {
            (VertexSource::Procedural(primitive), _) => (primitive_topology(primitive), None),
            (_, Topology::TriangleList) => (wgpu::PrimitiveTopology::TriangleList, None),
            (_, Topology::TriangleStrip) => {
                let of_pages = Some(wgpu::IndexFormat::Uint32);
                let format = variant.layout.as_ref().map_or(of_pages, |layout| layout.strip_index_format);
                (wgpu::PrimitiveTopology::TriangleStrip, format)
            }
        };
        let clamps_pixels = variant.clamps_depth && self.inputs.clamps_pixels();
        let [clamped, clamped_masked] = &key.clamped_fragments;
        let clamped = if masked.is_some() { clamped_masked } else { clamped };
        let fragment = clamped.as_ref().filter(|_| variant.clamps_depth && !clamps_pixels).or(fragment);
        let description = RenderPipelineDescription {
            layout: wgpu::PipelineLayout::clone(&shader.layout),
            module: wgpu::ShaderModule::clone(&shader.module),
            vertex: entry_point.to_owned(),
            buffers,
            primitive: wgpu::PrimitiveState {
                topology,
                strip_index_format,
                front_face: wgpu::FrontFace::Ccw,
                cull_mode: match key.face_culling.applied_to(state.cull()) {
                    Cull::Back => Some(wgpu::Face::Back),
                    Cull::Front => Some(wgpu::Face::Front),
                    Cull::Nothing => None,
                },
                unclipped_depth: clamps_pixels,
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: attachments.depth.map(|depth| {
                // A blended surface must not hide what is drawn after it, unless the process says so.
                let may_write_depth = !equations.is_empty() || state.blend() == Blend::None;
                let writes_depth = key.writes_depth && may_write_depth;
                let comparison = own.and_then(|own| own.depth_comparison).map(compare_function);
                let comparison = comparison.unwrap_or_else(|| self.depth_compare(depth));
                let bias = own.map_or_else(DepthBias::default, |own| own.depth_bias);
                depth.pipeline_state_of(writes_depth, comparison, bias, key.stencil)
            }),
            samples: attachments.samples,
            alpha_to_coverage: attachments.samples > 1 && own.is_some_and(|own| own.alpha_to_coverage),
            fragment: fragment.map(|entry_point| (entry_point.clone().into_owned(), targets)),
        };
        self.shared.render_pipeline(device, label, description).map(Some)
    }

    /// Depth is reversed: nearer is greater.
    fn depth_compare(&self, depth: DepthAttachmentFormat) -> wgpu::CompareFunction {
        match self.inputs.key.vertices {
            _ if depth.access == Access::MatchDepth => wgpu::CompareFunction::Equal,
            _ if depth.access == Access::TestStencil => wgpu::CompareFunction::Always,
            _ if depth.access == Access::MarkStencil => wgpu::CompareFunction::GreaterEqual,
            // At infinite distance (depth 0), so it covers the pixels without geometry.
            VertexSource::FullScreen => wgpu::CompareFunction::GreaterEqual,
            // The far side of a light volume, where it is behind a surface; never where there is no surface.
            VertexSource::LightVolumes => wgpu::CompareFunction::Less,
            VertexSource::Meshes(_) | VertexSource::Procedural(_) | VertexSource::Compute | VertexSource::None => {
                wgpu::CompareFunction::Greater
            }
        }
    }
}

fn primitive_topology(primitive: Primitive) -> wgpu::PrimitiveTopology {
    match primitive {
        Primitive::Triangles => wgpu::PrimitiveTopology::TriangleList,
        Primitive::TriangleStrip => wgpu::PrimitiveTopology::TriangleStrip,
        Primitive::Lines => wgpu::PrimitiveTopology::LineList,
        Primitive::LineStrip => wgpu::PrimitiveTopology::LineStrip,
        Primitive::Points => wgpu::PrimitiveTopology::PointList,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, mpsc};
    use std::time::Duration;

    use super::*;
    use crate::backend::wgpu::noop_device::noop_device;
    use crate::process::{GeometryBuffer, GeometryFormats};

    #[test]
    fn inserting_no_pipelines_does_not_wait_for_recording() {
        let (device, _) = noop_device();
        let process = Arc::new(GeometryBuffer::new(GeometryFormats::default()));
        let plan = FramePlan::new(vec![process], &["diffuse".to_owned()]).unwrap();
        let draws = plan.draws().unwrap();
        let quality = Quality::balanced();
        let (layouts, shared) = (BindGroupLayouts::new(&device), SharedPipelines::new(false));
        let pipelines =
            ProcessPipelines::new(&device, (&shared, &layouts), &plan, &plan.processes()[0], &draws[0], &quality)
                .unwrap();

        let (sender, receiver) = mpsc::channel();
        std::thread::scope(|scope| {
            let recording = pipelines.variants();
            scope.spawn(|| {
                pipelines.insert(pipelines.create_missing(&device, "none", std::iter::empty()).unwrap());
                sender.send(()).unwrap();
            });
            let inserted = receiver.recv_timeout(Duration::from_secs(10));
            drop(recording);
            inserted.unwrap();
        });
    }

    #[test]
    fn frames_add_pipelines_while_others_are_created() {
        let (device, _) = noop_device();
        let process = Arc::new(GeometryBuffer::new(GeometryFormats::default()));
        let plan = FramePlan::new(vec![process], &["diffuse".to_owned()]).unwrap();
        let draws = plan.draws().unwrap();
        let (layouts, shared) = (BindGroupLayouts::new(&device), SharedPipelines::new(false));
        let quality = Quality::balanced();
        let pipelines =
            ProcessPipelines::new(&device, (&shared, &layouts), &plan, &plan.processes()[0], &draws[0], &quality)
                .unwrap();

        let [first, second] = [Cull::Back, Cull::Nothing]
            .map(|cull| PipelineVariant::of_pages(DrawState::new(Topology::TriangleList, cull, Blend::None)));
        let (sender, receiver) = mpsc::channel();
        std::thread::scope(|scope| {
            let of_frame = || {
                let created = pipelines.create_missing(&device, "second", std::iter::once(second.clone())).unwrap();
                pipelines.insert(created);
                sender.send(()).unwrap();
            };
            let mut is_added = true;
            let prepared = [first].into_iter().inspect(|_| {
                scope.spawn(of_frame);
                is_added = receiver.recv_timeout(Duration::from_secs(10)).is_ok();
            });
            pipelines.insert(pipelines.create_missing(&device, "first", prepared).unwrap());
            assert!(is_added, "the frame waits");
        });
        assert_eq!(pipelines.variants().len(), 2);
    }
}
