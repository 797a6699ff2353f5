//! The beginning of a frame: uploads, cached resources, and the bind groups and the strategy of each pass.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::backend::WgpuBackend;
use super::error_scope::with_error_scope;
use super::frame::{BundleKey, GeneratedUploads, PassResources, PendingUploads, WgpuFrame, WgpuPassState};
use super::pipelines::ProcessPipelines;
use super::resources::{
    BindingResource, CachedBindGroup, LightMeshes, StorageBuffers, SubdividedMesh, WgpuTargets, fits_in_buffers,
};
use super::strategy::{EncodingStrategy, RecordingStrategy};
use super::streaming::{FrameAssets, FrameUse, Residency};
use crate::backend::error::broken_rule;
use crate::backend::mip_schedule::MipSchedule;
use crate::backend::{BackendError, FrameRequest};
use crate::command::DrawList;
use crate::process::{Access, Draws, FramePlan, ItemRecorder, Pass, PlannedProcess, RawPassResources, ShaderResource};
use crate::scene::Mesh;
use crate::unwind::hold_events;
use crate::view::RenderView;

impl WgpuBackend {
    /// Begins a frame with these pipelines and targets: creates or reuses the other resources of its passes.
    ///
    /// # Errors
    /// If the device lacks room, or refuses a resource.
    pub(super) fn begin_frame(
        &self,
        request: &FrameRequest<'_>,
        pipelines: Arc<[Arc<ProcessPipelines>]>,
        targets: Arc<WgpuTargets>,
    ) -> Result<WgpuFrame, BackendError> {
        let FrameRequest { plan, draws, scene, workers, .. } = *request;
        // From here on, so that what a frame uploads that cannot begin is not kept either.
        let pending_uploads = PendingUploads::new(&self.device, self.queue());
        let light_meshes = self.light_meshes(draws)?;
        self.subdivisions.begin_frame(scene.assets);
        if self.meshes.lock().require_attributes(plan.attributes()) {
            self.subdivisions.clear();
        }
        let FrameAssets { meshes, materials, frame_use } = hold_events(|| self.update_resources_in_scope(request))?;
        let storage_buffers = self.storage_buffers(plan)?;
        let generated = GeneratedUploads::new(request, &storage_buffers, &meshes.imported_meshes);
        let mut buffers = self.buffers.take(&self.device)?;
        with_error_scope(&self.device, "the frame's buffers", || {
            buffers.begin(&self.device, &self.uploads, &self.layouts, &materials, request)?;
            if let Some(timing) = &self.device_timing {
                buffers.begin_timestamps(&self.device, request, timing.times_raw_passes)?;
            }
            // Relaxed: a counter that orders nothing.
            let number = self.frames.fetch_add(1, Ordering::Relaxed);
            let background = scene.background.as_dvec3().to_array();
            let (layouts, read_backs) = (self.layouts.clone(), Vec::new());
            let mut frame = WgpuFrame {
                number,
                workers,
                pipelines,
                layouts,
                meshes,
                _textures: Arc::clone(&materials.token),
                frame_use,
                light_meshes,
                targets,
                storage_buffers,
                generated,
                mip_schedule: MipSchedule::new(request.plan, request.views, (request.passes, request.sampled_views)),
                background,
                read_backs,
                buffers,
                pending_uploads,
            };
            self.begin_passes(&mut frame, request)?;
            Ok(frame)
        })?
    }

    /// [Updates](Self::update_resources) them, and submits what belongs to that.
    ///
    /// # Errors
    /// If the device has no room.
    fn update_resources_in_scope(&self, request: &FrameRequest<'_>) -> Result<FrameAssets, BackendError> {
        let update = || {
            let updated = self.update_resources(request)?;
            // The locks are not held any more.
            self.uploads.submit_commands();
            Ok(updated)
        };
        with_error_scope(&self.device, "meshes, materials and textures", update).flatten()
    }

    /// The meshes, materials and textures of a frame: uploads what is missing or, if they are streamed, takes over what
    /// jobs have uploaded.
    ///
    /// # Errors
    /// If the device has no room.
    fn update_resources(&self, request: &FrameRequest<'_>) -> Result<FrameAssets, BackendError> {
        let (device, uploads) = (&self.device, &self.uploads);
        let (mut meshes, mut materials) = (self.meshes.lock(), self.materials.lock());
        let mut residency = Residency { device, uploads, meshes: &mut meshes, materials: &mut materials };
        if let Some(streamer) = &self.streamer {
            return streamer.begin_frame(residency, request);
        }
        residency.begin_frame(request, None)?;
        let (meshes, materials) = residency.snapshots(request, false);
        Ok(FrameAssets { meshes, materials, frame_use: FrameUse::default() })
    }

    /// The buffers that a plan's processes share. If creation fails, existing buffers keep their content, and the next
    /// frame tries again.
    ///
    /// # Errors
    /// If the device lacks room.
    fn storage_buffers(&self, plan: &FramePlan) -> Result<Arc<StorageBuffers>, BackendError> {
        let mut current = self.storage_buffers.lock();
        if !current.covers(plan) {
            let label = "the buffers of processes";
            let next = with_error_scope(&self.device, label, || current.with_missing_buffers_of(&self.device, plan))??;
            *current = Arc::new(next);
        }
        Ok(Arc::clone(&current))
    }

    /// The pipelines of the frame's processes, made where they are missing.
    ///
    /// # Errors
    /// If a shader does not compile, or the device refuses a pipeline. Nothing is lost then.
    pub(super) fn update_pipelines(
        &self,
        request: &FrameRequest<'_>,
    ) -> Result<Arc<[Arc<ProcessPipelines>]>, BackendError> {
        let FrameRequest { plan, draws, quality, .. } = *request;
        hold_events(|| {
            let mut pipelines = self.pipelines.lock();
            pipelines.update(&self.device, (&self.shared_pipelines, &self.layouts), plan, draws, quality)
        })
    }

    /// Updates the bind groups of each pass, and chooses its strategy.
    ///
    /// # Errors
    /// If the device refuses a resource of the engine's.
    fn begin_passes(&self, frame: &mut WgpuFrame, request: &FrameRequest<'_>) -> Result<(), BackendError> {
        let (strategies, mut may_try) = (self.strategies.strategies(), true);
        let WgpuFrame { number, pipelines, meshes, targets, storage_buffers, buffers, .. } = frame;
        let (passes, resources) = buffers.passes_mut();
        for (index_of_pass, pass) in passes.iter_mut().enumerate() {
            let Pass { process_index: process, view_index: view } = pass.pass;
            let pipelines = &pipelines[process];
            self.update_bind_groups(request, pipelines, targets, storage_buffers, &resources, pass)?;

            pass.raw_encoders = raw_encoders(&request.draws[process], &request.views[view])?;
            let (mut index, mut is_trial) = (0, false);
            let lent = request.items_of(index_of_pass);
            let into_passes = lent.is_some_and(|items| matches!(items.recorder, ItemRecorder::Pass(_)));
            let fixed = into_passes.then(|| self.strategies.of_passes_alone(request.passes.len() < request.workers));
            pass.is_tuned = pass.has_list() && fixed.is_none();
            if strategies.len() > 1 && pass.is_tuned {
                let is_distinct = |index: usize, batches| {
                    strategies[index].is_distinct(batches)
                        && (strategies[index].divides_bundles() || !request.records_bundles)
                };
                (index, is_trial) = pipelines
                    .with_tuner(view, &self.strategies, |own| own.tuner.choose(*number, &mut may_try, is_distinct));
            }
            pass.clamps_depth = request.views[view].clamps_depth() && pipelines.has_clamped_pipelines();
            let strategy = fixed.unwrap_or(strategies[index]);
            pass.set_strategy(strategy, index, is_trial);
            pass.can_share_encoder =
                pass.strategy.encoding != EncodingStrategy::OnSubmit && pass.is_small(&request.draws[process]);
            let caches_bundles = pass.has_list() && pass.strategy.recording == RecordingStrategy::CachedBundles;
            if let Some(frame_bind_group) = pass.frame_bind_group.as_ref().filter(|_| caches_bundles) {
                pass.bundle_cache.begin_frame(BundleKey {
                    frame_bind_group: frame_bind_group.clone(),
                    materials_bind_groups: Arc::clone(resources.materials_bind_groups),
                    process_bind_group: pass.process_bind_group.as_ref().map(|process| process.group.clone()),
                    engine_bind_group: pass.engine_bind_group.as_ref().map(|columns| columns.group.clone()),
                    item_data: request.items_of_passes[index_of_pass]
                        .and_then(|set| resources.item_data.of_set(set).cloned()),
                    meshes: meshes.number(),
                    pipelines: Arc::clone(pipelines),
                    clamps_depth: pass.clamps_depth,
                });
            }
        }
        share_encoders(buffers.passes_mut().0);
        Ok(())
    }

    /// Updates `@group(2)` and `@group(3)` of a pass: makes them anew if something else is to be bound.
    ///
    /// # Errors
    /// If the device refuses a resource of the engine's, or a target is missing. The latter is a bug in Drawloom.
    fn update_bind_groups(
        &self,
        request: &FrameRequest<'_>,
        pipelines: &ProcessPipelines,
        targets: &WgpuTargets,
        buffers: &StorageBuffers,
        resources: &PassResources<'_>,
        pass: &mut WgpuPassState,
    ) -> Result<(), BackendError> {
        let Pass { process_index: process, view_index: view } = pass.pass;
        let PlannedProcess { declaration, targets: used, .. } = &request.plan.processes()[process];

        let parameters =
            pass.parameter_bytes().and_then(|bytes| resources.parameters.binding(bytes.start, bytes.len()));
        let parameters = parameters.map(|binding| (0, BindingResource::Buffer(binding)));
        let sampled = |&(target, access): &(usize, Access)| match access {
            Access::Sample | Access::SamplePrevious => targets.get(view, target).map(|target| &target.sampled),
            Access::SampleView(_, index) | Access::SampleViewPrevious(_, index) => {
                let views = request.sampled_views.find(pass.pass, index);
                let planned = (target, &request.plan.targets()[target]);
                targets.find_sampled(views, planned, declaration.sampled_views[index].shape)
            }
            Access::SampleLayers(_) => targets.layered(target).map(|(_, array)| array),
            _ => None,
        };
        let sampled = used.accesses.iter().filter_map(sampled);
        let samples = declaration.samples().count();
        if sampled.clone().count() != samples {
            return Err(broken_rule("a frame has the targets that its passes sample"));
        }
        let sampled = (1..).zip(sampled.map(BindingResource::Texture));
        let (before, layout) = (pass.process_bind_group.take(), pipelines.process_layout.as_deref());
        let shared = declaration.bound_buffers().filter_map(|(buffer, _)| buffers.find(buffer));
        let shared = shared.map(|buffer| BindingResource::Buffer(buffer.as_entire_buffer_binding()));
        let bound = parameters.into_iter().chain(sampled).chain((1 + samples as u32..).zip(shared));
        pass.process_bind_group = CachedBindGroup::update(before, &self.device, &pass.label, layout, bound)?;

        let columns = declaration.columns.iter().filter_map(|column| resources.objects.column(*column));
        let draws = &request.draws[process];
        let mut bytes = resources.bytes.of_process(process);
        let materials: Vec<_> =
            bytes.by_ref().take(declaration.material_types.len()).map(BindingResource::Buffer).collect();
        let own = draws.resources().iter().filter_map(move |resource| match resource {
            ShaderResource::Bytes(_) | ShaderResource::SharedBytes(_) => bytes.next().map(BindingResource::Buffer),
            ShaderResource::Buffer(buffer) => Some(BindingResource::Buffer(buffer.as_entire_buffer_binding())),
            ShaderResource::Texture { view, .. } => Some(BindingResource::Texture(view)),
            ShaderResource::TextureOfView { views, other, .. } => {
                let of_view = views.iter().find(|(name, _)| name == request.views[view].name());
                Some(BindingResource::Texture(of_view.map_or(other, |(_, texture)| texture)))
            }
            ShaderResource::Sampler { sampler, .. } => Some(BindingResource::Sampler(sampler)),
        });
        let (before, layout) = (pass.engine_bind_group.take(), pipelines.engine_layout.as_deref());
        let bound = (0..).zip(columns.map(BindingResource::Buffer).chain(materials).chain(own));
        pass.engine_bind_group = CachedBindGroup::update(before, &self.device, &pass.label, layout, bound)?;
        Ok(())
    }

    /// Creates or reuses the subdivided meshes that a list draws.
    ///
    /// # Errors
    /// If the device has no room.
    pub(super) fn subdivide(
        &self,
        frame: &WgpuFrame,
        request: &FrameRequest<'_>,
        list: &DrawList,
    ) -> Result<(), BackendError> {
        let (vertices, limits) = (request.quality.vertices, request.limits);
        let make = |mesh: Mesh| {
            if !fits_in_buffers(&mesh, vertices, limits.buffer_bytes) {
                return Ok(None);
            }
            let attributes = self.meshes.lock().attributes_of(&self.device, &self.uploads, &mesh)?;
            SubdividedMesh::new(&self.device, &self.uploads, &mesh, vertices, attributes).map(Some)
        };
        self.subdivisions.collect(request, list, vertices, make, |key, mesh| {
            frame.buffers.subdivided().write().insert(key, mesh);
        })
    }

    /// The light volumes if a process draws lights; created on first use.
    ///
    /// # Errors
    /// If the device has no room.
    fn light_meshes(&self, draws: &[Draws<'_>]) -> Result<Option<Arc<LightMeshes>>, BackendError> {
        if !draws.iter().any(|draws| matches!(draws, Draws::Lights(_))) {
            return Ok(None);
        }
        let mut meshes = self.light_meshes.lock();
        if meshes.is_none() {
            let create = || LightMeshes::new(&self.device, &self.uploads);
            *meshes = Some(Arc::new(with_error_scope(&self.device, "light volumes", create)??));
        }
        Ok(meshes.clone())
    }
}

/// Decides which passes share the encoder of the pass before: those of one view that can, and in frames of many small
/// views those of several.
fn share_encoders(passes: &mut [WgpuPassState]) {
    /// The fewest encoders of a frame of many small views, for workers to share.
    const MIN_ENCODERS: usize = 16;
    let max_across_views = passes.iter().filter(|pass| pass.can_share_encoder).count() / MIN_ENCODERS;
    // The passes in the encoder so far; 0 if the next pass cannot share it.
    let mut in_encoder = 0;
    let are_together = |one: &WgpuPassState, next: &WgpuPassState| {
        one.can_share_encoder && next.can_share_encoder && one.pass.view_index == next.pass.view_index
    };
    for passes in passes.chunk_by_mut(are_together) {
        let (count, can_share) = (passes.len(), passes[0].can_share_encoder);
        let continues = can_share && in_encoder > 0 && in_encoder + count <= max_across_views;
        for (index, pass) in passes.iter_mut().enumerate() {
            pass.shares_encoder = index > 0 || continues;
        }
        in_encoder = match (can_share, continues) {
            (false, _) => 0,
            (true, false) => count,
            (true, true) => in_encoder + count,
        };
    }
}

/// The number of encoders of a pass in a view that the engine encodes; 0 of another one.
///
/// # Errors
/// If there are too many.
fn raw_encoders(draws: &Draws<'_>, view: &RenderView) -> Result<usize, BackendError> {
    let Draws::Raw(raw) = draws else { return Ok(0) };
    let (encoders, allowed) = (raw.encoder_count(view).max(1), RawPassResources::MAX_ENCODERS);
    match encoders > allowed {
        true => Err(BackendError::Limit {
            limit: "RawPassResources::MAX_ENCODERS",
            allowed: allowed as u64,
            needed: encoders as u64,
        }),
        false => Ok(encoders),
    }
}
