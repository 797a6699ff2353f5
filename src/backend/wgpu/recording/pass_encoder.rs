//! Encoding of passes, or of segments of them: from batches and recorded parts to command encoders.

use crate::backend::error::broken_rule;
use crate::backend::wgpu::frame::{RecordedPart, WgpuFrame, WgpuPart, WgpuPassState};
use crate::backend::wgpu::pipelines::{PipelineVariant, ProcessPipelines, fixed_state};
use crate::backend::wgpu::strategy::{PassSegment, RecordingStrategy};
use crate::backend::{BackendError, FrameRequest, PassRequest};
use crate::command::DrawList;
use crate::process::{
    BufferLayout, ClearColor, ComputeDispatch, DrawCount, Draws, ItemBindGroups, ItemContext, Items, PlannedProcess,
    ProceduralDraws, RawAccess, RawPass, RawPassResources, Workgroups,
};

/// No device supports more colour attachments.
const MAX_COLOR_ATTACHMENTS: usize = 8;

/// Records one pass of a frame into command encoders and bundles.
pub(crate) struct PassEncoder<'a> {
    pub(super) device: &'a wgpu::Device,
    pub(super) frame: &'a WgpuFrame,
    request: &'a FrameRequest<'a>,
    /// Its index in the frame.
    pub(super) index: usize,
    pub(super) state: &'a WgpuPassState,
    pub(super) planned: &'a PlannedProcess,
    pub(super) pipelines: &'a ProcessPipelines,
    pub(super) draws: &'a Draws<'a>,
    pub(super) list: &'a DrawList,
    /// The items that the engine lends, of a pass that draws items.
    pub(super) items: Option<&'a Items<'a>>,
}

impl<'a> PassEncoder<'a> {
    pub(crate) fn new(device: &'a wgpu::Device, frame: &'a WgpuFrame, pass: &PassRequest<'a>) -> Self {
        let PassRequest { frame: request, index, list, .. } = *pass;
        let state = frame.pass(index);
        let process = state.pass.process_index;
        let (planned, draws) = (&request.plan.processes()[process], &request.draws[process]);
        let (pipelines, items) = (frame.pipelines(state.pass), pass.items());
        Self { device, frame, request, index, state, planned, pipelines, draws, list, items }
    }

    /// Begins the pass, or a segment of it. Only the first segment clears the targets.
    ///
    /// # Errors
    /// If a target is missing. This is a bug in Drawloom.
    pub(super) fn begin<'encoder>(
        &self,
        encoder: &'encoder mut wgpu::CommandEncoder,
        segment: PassSegment,
    ) -> Result<wgpu::RenderPass<'encoder>, BackendError> {
        let target = |index: usize| self.frame.targets.of_view(self.state.pass.view_index, index);
        let used = &self.planned.targets;
        let mut colors = [const { None }; MAX_COLOR_ATTACHMENTS];
        for (attachment, color) in colors.iter_mut().zip(&used.colors) {
            let clear = color.clear.filter(|_| segment.is_first);
            let resolved_into = color.resolved_into.filter(|_| segment.is_last).map(target).transpose()?;
            *attachment = Some(wgpu::RenderPassColorAttachment {
                view: &target(color.index)?.view,
                depth_slice: None,
                resolve_target: resolved_into.map(|into| &into.view),
                ops: wgpu::Operations { load: load_op(clear, self.frame.background), store: wgpu::StoreOp::Store },
            });
        }
        let depth = match used.depth {
            None => None,
            Some((index, access)) => {
                let target = target(index)?;
                let (is_loaded, store) = (access.keeps_depth() || !segment.is_first, wgpu::StoreOp::Store);
                let clear_value = self.planned.declaration.depth_clear_value.unwrap_or(0.0);
                let depth = if is_loaded { wgpu::LoadOp::Load } else { wgpu::LoadOp::Clear(clear_value) };
                let stencil = if is_loaded { wgpu::LoadOp::Load } else { wgpu::LoadOp::Clear(0) };
                let writes_depth = target.format().has_depth() && access.writes_depth();
                let writes_stencil = target.format().has_stencil() && access.writes();
                Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &target.view,
                    depth_ops: writes_depth.then_some(wgpu::Operations { load: depth, store }),
                    stencil_ops: writes_stencil.then_some(wgpu::Operations { load: stencil, store }),
                })
            }
        };
        let timestamps = self.frame.buffers.timestamps().zip(self.state.timed_pass_index);
        let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(&self.state.label),
            color_attachments: &colors[..used.colors.len().min(MAX_COLOR_ATTACHMENTS)],
            depth_stencil_attachment: depth,
            timestamp_writes: timestamps.and_then(|(timestamps, pass)| timestamps.writes_of_segment(pass, segment)),
            ..wgpu::RenderPassDescriptor::default()
        });
        if let Some(stencil) = self.draws.stencil() {
            render_pass.set_stencil_reference(u32::from(stencil.reference));
        }
        Ok(render_pass)
    }

    /// The bind groups that the pass has, each with its index: of materials, those with the first set of textures.
    pub(super) fn bind_groups(&self) -> impl Iterator<Item = (u32, &'a wgpu::BindGroup)> + use<'a> {
        let state = self.state;
        let [of_process, of_engine] =
            [&state.process_bind_group, &state.engine_bind_group].map(|own| own.as_ref().map(|own| &own.group));
        let shared = [state.frame_bind_group.as_ref(), self.frame.buffers.materials_bind_groups().first()];
        let groups = shared.into_iter().chain([of_process, of_engine]);
        (0..).zip(groups).filter_map(|(index, group)| Some((index, group?)))
    }

    /// Records a segment that replays bundles.
    ///
    /// # Errors
    /// If a target is missing. This is a bug in Drawloom.
    pub(super) fn replay_bundles<'b>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        segment: PassSegment,
        bundles: impl IntoIterator<Item = &'b wgpu::RenderBundle>,
    ) -> Result<(), BackendError> {
        let pipelines = self.pipelines.variants();
        let mut render_pass = self.begin(encoder, segment)?;
        // wgpu gives the device the reference only with a pipeline that tests it, and does not look for one in bundles.
        if let Some(pipeline) = pipelines.values().next().filter(|_| self.draws.stencil().is_some()) {
            render_pass.set_pipeline(pipeline);
        }
        render_pass.execute_bundles(bundles);
        Ok(())
    }

    /// Records a pass that draws lights, a full-screen triangle, or vertices that the shader makes.
    ///
    /// # Errors
    /// If a resource of the pass is missing. This is a bug in Drawloom.
    pub(super) fn record_without_commands(&self, encoder: &mut wgpu::CommandEncoder) -> Result<(), BackendError> {
        let pipelines = self.pipelines.variants();
        let variant = |state| PipelineVariant::of_pages(state).clamping(self.state.clamps_depth);
        let pipeline = fixed_state(self.draws).and_then(|state| pipelines.get(&variant(state)));
        let pipeline = pipeline.ok_or_else(|| broken_rule("a pipeline is created before it is used"))?;
        let mut render_pass = self.begin(encoder, PassSegment::WHOLE)?;
        render_pass.set_pipeline(pipeline);
        self.bind_groups().for_each(|(index, group)| render_pass.set_bind_group(index, group, &[]));
        match self.draws {
            Draws::Lights(draws) => {
                let meshes = self.frame.light_meshes.as_ref();
                let meshes = meshes.ok_or_else(|| broken_rule("light volumes are uploaded before they are drawn"))?;
                let lights = self.request.light_tables[self.state.pass.view_index].range(draws.class);
                if !lights.is_empty() {
                    render_pass.set_vertex_buffer(0, meshes.vertices.slice(..));
                    render_pass.draw(meshes.range(draws.class.kind), lights);
                }
            }
            Draws::Procedural(ProceduralDraws { count: DrawCount::Count { vertices, instances }, .. }) => {
                render_pass.draw(0..*vertices, 0..*instances);
            }
            Draws::Procedural(ProceduralDraws { count: DrawCount::Indirect(offset), .. }) => {
                render_pass.draw_indirect(self.buffer(offset.buffer)?, offset.bytes);
            }
            _ => render_pass.draw(0..3, 0..1),
        }
        Ok(())
    }

    /// Encodes the pass of a compute shader.
    ///
    /// # Errors
    /// If a resource of the pass is missing. This is a bug in Drawloom.
    pub(super) fn encode_compute(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        dispatch: &ComputeDispatch<'_>,
    ) -> Result<(), BackendError> {
        let pipeline = self.pipelines.compute().ok_or_else(|| broken_rule("a compute shader has a pipeline"))?;
        let timestamp_writes = self.queries().map(|(query_set, [begin, end])| wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index: Some(begin),
            end_of_pass_write_index: Some(end),
        });
        let descriptor = wgpu::ComputePassDescriptor { label: Some(&self.state.label), timestamp_writes };
        let mut compute_pass = encoder.begin_compute_pass(&descriptor);
        compute_pass.set_pipeline(pipeline);
        self.bind_groups().for_each(|(index, group)| compute_pass.set_bind_group(index, group, &[]));
        match dispatch.workgroups {
            Workgroups::Count([x, y, z]) => compute_pass.dispatch_workgroups(x, y, z),
            Workgroups::Indirect(offset) => {
                compute_pass.dispatch_workgroups_indirect(self.buffer(offset.buffer)?, offset.bytes);
            }
        }
        Ok(())
    }

    /// Has a raw pass encode itself, or one of its encoders.
    ///
    /// # Errors
    /// If the raw pass asks for what its process does not declare, or reports an error, or a resource of the pass is
    /// missing. The latter is a bug in Drawloom.
    pub(super) fn encode_raw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        raw: &dyn RawPass,
        index: usize,
    ) -> Result<(), BackendError> {
        let queries = self.queries();
        if let Some((set, [begin, _])) = queries.filter(|_| index == 0) {
            encoder.write_timestamp(set, begin);
        }
        self.with_context(index, |context| raw.encode(encoder, &context.resources))?.map_err(BackendError::RawPass)?;
        if let Some((set, [_, end])) = queries.filter(|_| index + 1 == self.state.raw_encoders) {
            encoder.write_timestamp(set, end);
        }
        Ok(())
    }

    /// Calls the engine's code with what it may use, in one of the encoders of a raw pass.
    ///
    /// # Errors
    /// If the code asks for what its process does not declare, or a resource of the pass is missing. The latter is a bug
    /// in Drawloom.
    pub(super) fn with_context<R>(
        &self,
        encoder: usize,
        call: impl FnOnce(&ItemContext<'_>) -> R,
    ) -> Result<R, BackendError> {
        let (frame, pass, plan) = (self.frame, self.state.pass, self.request.plan);
        let PlannedProcess { name, declaration, requests, .. } = self.planned;
        let textures = |name: &str| {
            let target = frame.targets.get(pass.view_index, plan.target_index(declaration.views, name)?);
            target.map(|target| &target.texture)
        };
        let layered = |kind, name: &str| {
            let target = frame.targets.layered(plan.target_index(kind, name)?);
            target.map(|(texture, _)| texture)
        };
        let columns = |column| frame.buffers.objects().column(column);
        let materials = |material_type| {
            let index = declaration.material_types.iter().position(|declared| *declared == material_type)?;
            frame.buffers.resource_bytes().of_process(pass.process_index).nth(index)
        };
        let buffers = |buffer| frame.storage_buffers.find(buffer);
        let of_frame = self.state.frame_bind_group.as_ref();
        let of_frame = of_frame.ok_or_else(|| broken_rule("a pass has bind groups before it is recorded"))?;
        let materials_bind_groups = frame.buffers.materials_bind_groups();
        let of_materials = materials_bind_groups.first();
        let of_materials =
            of_materials.ok_or_else(|| broken_rule("a frame has its materials before it is recorded"))?;
        let view = &self.request.views[pass.view_index];
        let resources = RawPassResources {
            device: self.device,
            view: pass.view_index,
            size: view.camera.size,
            encoder,
            bind_group_layouts: [&frame.layouts.frame, &frame.layouts.assets],
            bind_groups: [of_frame, of_materials],
            materials_bind_groups,
            texture_sets: self.request.objects.texture_sets(),
            access: RawAccess::new(name, declaration, requests),
            columns: &columns,
            materials: &materials,
            buffers: &buffers,
            textures: &textures,
            layered: &layered,
        };
        let set = self.request.items_of_passes.get(self.index).copied().flatten();
        let item_data = frame.buffers.item_data();
        let (attachments, none) = (self.pipelines.bundle_descriptor(&self.state.label), ItemBindGroups::default());
        let context = ItemContext {
            view,
            resources,
            color_formats: attachments.color_formats,
            depth_format: attachments.depth_stencil.map(|depth_stencil| depth_stencil.format),
            sample_count: attachments.sample_count,
            data: set.and_then(|set| item_data.of_set(set)),
            bind_groups: set.and_then(|set| item_data.bind_groups_of_set(set)).unwrap_or(&none),
        };
        let result = call(&context);
        // Before the code's own error, which may follow from it, and even if there is none: code that goes on without a
        // resource draws something else than its process promises.
        context.resources.access.end().map_err(BackendError::Access)?;
        Ok(result)
    }

    /// The timestamp queries at the beginning and the end of the pass, if it is timed.
    fn queries(&self) -> Option<(&'a wgpu::QuerySet, [u32; 2])> {
        self.frame.buffers.timestamps()?.queries(self.state.timed_pass_index?)
    }

    /// # Errors
    /// If the frame lacks the buffer.
    fn buffer(&self, buffer: BufferLayout) -> Result<&'a wgpu::Buffer, BackendError> {
        let found = self.frame.storage_buffers.find(buffer);
        found.ok_or_else(|| broken_rule("a buffer is made before it is used"))
    }
}

fn load_op(clear: Option<ClearColor>, background: [f64; 3]) -> wgpu::LoadOp<wgpu::Color> {
    let [r, g, b, a] = match clear {
        None => return wgpu::LoadOp::Load,
        Some(ClearColor::Value(value)) => value,
        // A larger value would be infinite in a half float.
        Some(ClearColor::Background) => {
            let [r, g, b] = background.map(|radiance| radiance.min(60_000.0));
            [r, g, b, 1.0]
        }
    };
    wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a })
}

/// Encodes a whole pass in one encoder: replays its bundles, or records it without bundles. Then it generates the mip
/// levels that the pass leaves out of date.
///
/// # Errors
/// If a resource of the pass is missing, or a raw pass fails.
pub(crate) fn encode_pass(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    pass: &PassRequest<'_>,
    parts: &[WgpuPart],
) -> Result<wgpu::CommandEncoder, BackendError> {
    let pass = PassEncoder::new(device, frame, pass);
    pass.encode(|encoder| pass.record(encoder, parts))
}

/// Encodes whole passes in one encoder, one after the other, each as [`encode_pass`] does. It is labelled as the first.
///
/// # Errors
/// As [`encode_pass`].
pub(crate) fn encode_passes(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    passes: &[PassRequest<'_>],
    parts: &[Vec<WgpuPart>],
) -> Result<wgpu::CommandEncoder, BackendError> {
    let encoder_of = |pass| PassEncoder::new(device, frame, pass);
    encoder_of(&passes[0]).encode(|encoder| {
        passes.iter().zip(parts).try_for_each(|(pass, parts)| encoder_of(pass).record(encoder, parts))
    })
}

/// Encodes what follows the segments of a pass that is split over several encoders: the mip levels that it leaves out
/// of date.
///
/// # Errors
/// As [`encode_pass`].
pub(crate) fn encode_after_segments(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    pass: &PassRequest<'_>,
) -> Result<RecordedPart, BackendError> {
    let pass = PassEncoder::new(device, frame, pass);
    let encoder = pass.encode(|encoder| frame.generate_mip_levels(encoder, pass.index))?;
    Ok(RecordedPart::Encoder(encoder.finish()))
}

impl PassEncoder<'_> {
    /// Records the whole pass, and generates the mip levels that it leaves out of date.
    fn record(&self, encoder: &mut wgpu::CommandEncoder, parts: &[WgpuPart]) -> Result<(), BackendError> {
        use RecordingStrategy::{Bundles, CachedBundles, Direct};
        let WgpuPassState { strategy, timed_pass_index, .. } = *self.state;
        let accesses = &self.planned.declaration.accesses;
        let clears = accesses.iter().any(|(_, access)| access.writes() && !access.reads());
        match (self.draws, strategy.recording) {
            (Draws::Raw(raw), _) => self.encode_raw(encoder, *raw, 0)?,
            // A pass that would only load and store its targets.
            (Draws::Commands(_) | Draws::Items(_), _)
                if self.list.draw_count() == 0 && timed_pass_index.is_none() && !clears => {}
            (Draws::Compute(dispatch), _) => self.encode_compute(encoder, dispatch)?,
            (Draws::Commands(_), Direct) => {
                self.record_batches(encoder, PassSegment::WHOLE, 0..self.list.bundle_count())?;
            }
            (Draws::Items(_), Direct) => {
                self.record_items(encoder, PassSegment::WHOLE, 0..self.list.bundle_count())?;
            }
            (Draws::Commands(_) | Draws::Items(_), Bundles | CachedBundles) => {
                let bundles = parts.iter().filter_map(|part| match &part.0 {
                    RecordedPart::Bundle(bundle) => Some(bundle),
                    RecordedPart::Encoder(_) => None,
                });
                self.replay_bundles(encoder, PassSegment::WHOLE, bundles)?;
            }
            _ => self.record_without_commands(encoder)?,
        }
        self.frame.generate_mip_levels(encoder, self.index)
    }

    /// Encodes one segment of a pass that is split over several encoders.
    ///
    /// # Errors
    /// If a resource of the pass is missing. This is a bug in Drawloom.
    pub(crate) fn encode_segment(&self, segment: usize) -> Result<RecordedPart, BackendError> {
        use RecordingStrategy::{Bundles, CachedBundles, Direct};
        if let Draws::Raw(raw) = self.draws {
            let encoder = self.encode(|encoder| self.encode_raw(encoder, *raw, segment))?;
            return Ok(RecordedPart::Encoder(encoder.finish()));
        }
        let strategy = self.state.strategy;
        let bundles = strategy.bundles_of_encoder(self.list, segment);
        let segment = strategy.segment_of_encoder(self.list, segment);
        let encoder = match strategy.recording {
            Direct => self.encode(|encoder| match self.draws {
                Draws::Items(_) => self.record_items(encoder, segment, bundles),
                _ => self.record_batches(encoder, segment, bundles),
            }),
            Bundles | CachedBundles => {
                let recorded = bundles.map(|bundle| self.record_bundle(bundle));
                let recorded = recorded.collect::<Result<Vec<_>, _>>()?;
                self.encode(|encoder| self.replay_bundles(encoder, segment, &recorded))
            }
        };
        Ok(RecordedPart::Encoder(encoder?.finish()))
    }

    /// Calls `record` with a new encoder, labelled as the pass.
    fn encode(
        &self,
        record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<(), BackendError>,
    ) -> Result<wgpu::CommandEncoder, BackendError> {
        let label = Some(self.state.label.as_str());
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
        record(&mut encoder)?;
        Ok(encoder)
    }
}
