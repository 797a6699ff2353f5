//! The implementation of [`Backend`], its extras, and [`FrameRecorder`].

use std::mem;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use super::backend::WgpuBackend;
use super::error_scope::{catch_wgpu_panic, check_device, loss_or, with_error_scope};
use super::frame::{PassCommands, RecordedPart, WgpuCommands, WgpuFrame, WgpuPart};
use super::pipelines::{PipelineVariant, ProcessPipelines, shader_label};
use super::recording::{PassEncoder, encode_after_segments, encode_pass, encode_passes};
use super::resources::check_mesh;
use super::strategy::{EncodingStrategy, PassStrategy, RecordingStrategy};
use super::streaming::Streamer;
use super::submission::WgpuSubmission;
use crate::backend::{
    Backend, BackendError, BackendExtras, FrameFence, FrameRecorder, FrameRequest, PassRequest, ReadBack, SceneLimits,
    TargetMemory, ViewQueue,
};
use crate::command::{Batch, DrawList, DrawState};
use crate::process::{Draws, FramePlan};
use crate::quality::{Quality, VertexFormat};
use crate::scene::Mesh;
use crate::timeline::{Labels, TuningAlternative, TuningChoice, TuningSubject};
use crate::view::IssueReason;

impl Backend for WgpuBackend {
    type Submission = WgpuSubmission;

    fn adapter_name(&self) -> String {
        let info = self.device.adapter_info();
        format!("{} ({})", info.name, info.backend)
    }

    fn limits(&self) -> SceneLimits {
        let limits = self.device.limits();
        let (buffer_bytes, binding_bytes) = (limits.max_buffer_size, limits.max_storage_buffer_binding_size);
        let texture_layers = limits.max_texture_array_layers;
        SceneLimits { buffer_bytes, binding_bytes: binding_bytes.min(buffer_bytes), texture_layers }
    }

    fn check_mesh(&self, mesh: &Mesh, vertices: VertexFormat) -> Result<(), BackendError> {
        check_mesh(&self.device, mesh, vertices)
    }

    fn prepare_pipelines(
        &self,
        plan: &FramePlan,
        draws: &[Draws<'_>],
        states: &[Vec<DrawState>],
        quality: &Quality,
    ) -> Result<(), BackendError> {
        for ((planned, draws), states) in plan.processes().iter().zip(draws).zip(states) {
            let label = shader_label(&planned.name);
            let found = self.pipelines.lock().find(plan, planned, draws, quality).cloned();
            // No lock is held while the driver compiles, so that frames go on meanwhile.
            match found {
                Some(pipelines) => {
                    let variants = states.iter().flat_map(|state| pipelines.variants_of(*state));
                    let create = || pipelines.create_missing(&self.device, &label, variants);
                    pipelines.insert(with_error_scope(&self.device, &label, create).flatten()?);
                }
                None => {
                    let create = || {
                        let (device, shared) = (&self.device, (&self.shared_pipelines, &self.layouts));
                        let made = ProcessPipelines::new(device, shared, plan, planned, draws, quality)?;
                        let variants = states.iter().flat_map(|state| made.variants_of(*state));
                        made.insert(made.create_missing(&self.device, &label, variants)?);
                        Ok(made)
                    };
                    let made = with_error_scope(&self.device, &label, create).flatten()?;
                    self.pipelines.lock().add_prepared(plan, planned, draws, quality, made);
                }
            }
        }
        Ok(())
    }

    fn begin(&self, request: &FrameRequest<'_>) -> Result<WgpuFrame, BackendError> {
        let imports = mem::take(&mut *self.imports.lock());
        // Nothing has changed yet, so a camera out of reach, a picture too large, too many layers, or a shader that
        // does not compile leave everything as it is.
        request.check_reach()?;
        let imports: Result<Vec<_>, _> =
            imports.iter().map(|import| import.resolve(request.plan, request.views)).collect();
        let imports = imports?;
        check_device(&self.device).inspect_err(|_| self.clear())?;
        self.replace_destroyed(request)?;
        let pipelines = self.update_pipelines(request)?;
        let update = || self.targets.lock().update(&self.device, request, &imports, self.transient_targets);
        let targets = with_error_scope(&self.device, "targets", update).inspect_err(|_| self.clear())??;
        self.begin_frame(request, pipelines, targets).inspect_err(|error| {
            self.fail_frame(error);
            // If a limit is exceeded, the frame asks too much of its own buffers. Meshes, materials and textures are as
            // they should be.
            if !matches!(error, BackendError::Limit { .. }) {
                self.clear();
            }
        })
    }

    fn target_memory(&self, frame: &WgpuFrame) -> TargetMemory {
        frame.targets.memory()
    }

    fn recording_choice(&self, frame: &WgpuFrame, pass: usize, labels: &Arc<Labels>) -> Option<TuningChoice> {
        let strategies = self.strategies.strategies();
        let state = frame.pass(pass);
        if strategies.len() == 1 || !state.is_tuned {
            return None;
        }
        let (view, pipelines) = (state.pass.view_index, frame.pipelines(state.pass));
        let named = |(strategy, nanoseconds): (&PassStrategy, _)| TuningAlternative {
            name: strategy.name().into(),
            nanoseconds,
        };
        let alternatives = pipelines
            .with_tuner(view, &self.strategies, |own| strategies.iter().zip(own.tuner.costs()).map(named).collect());
        Some(TuningChoice {
            subject: TuningSubject::Recording,
            labels: Arc::clone(labels),
            alternatives,
            chosen: state.strategy_index,
            is_trial: state.is_trial,
        })
    }

    fn read_back(&self, frame: &mut WgpuFrame, view: usize, target: &str) -> Result<Box<dyn ReadBack>, BackendError> {
        Ok(Box::new(frame.read_back_whole(view, target)?))
    }

    fn submit(
        &self,
        mut frame: WgpuFrame,
        queues: Vec<ViewQueue<WgpuCommands>>,
        fences: Vec<FrameFence>,
    ) -> Result<WgpuSubmission, BackendError> {
        let submission = catch_wgpu_panic("the frame", || self.submit_frame(&mut frame, queues, fences));
        let submission = submission.flatten().inspect_err(|error| {
            self.fail_frame(error);
            if let Some(timing) = &self.device_timing {
                timing.readback_pool.clear();
            }
        })?;
        frame.buffers.keep_objects();
        Ok(submission)
    }

    fn extras(&self) -> &dyn BackendExtras {
        self
    }
}

impl BackendExtras for WgpuBackend {
    fn inner_extras(&self) -> Option<&dyn BackendExtras> {
        None
    }

    fn uploaded_bytes(&self) -> u64 {
        self.uploads.bytes()
    }

    fn can_blend_floats(&self) -> bool {
        self.device.features().contains(Self::BLENDING_FEATURES)
    }

    fn has_background_work(&self) -> bool {
        self.streamer.as_ref().is_some_and(Streamer::has_work)
    }

    fn work_in_background(&self) {
        if let Some(streamer) = &self.streamer {
            streamer.work(&self.device, &self.uploads);
        }
    }

    fn counters(&self, count: &mut dyn FnMut(&'static str, f64)) {
        if let Some(statistics) = self.streaming_statistics() {
            count("bytes resident", statistics.resident_bytes() as f64);
            count("streaming requests", (statistics.requested + statistics.in_flight) as f64);
            count("streaming evictions", statistics.evictions as f64);
        }
    }

    fn discard_frame(&self) {
        self.imports.lock().clear();
    }

    fn forget_histories(&self) {
        self.targets.lock().forget_histories();
    }

    fn imports_targets_of(&self, view: &str) -> bool {
        self.imports.lock().iter().any(|import| import.view == view)
    }
}

impl FrameRecorder for WgpuBackend {
    type Frame = WgpuFrame;
    type Part = WgpuPart;
    type Commands = WgpuCommands;

    fn objects_epoch(&self, frame: &WgpuFrame) -> u64 {
        frame.buffers.held_epoch()
    }

    fn upload_objects(
        &self,
        frame: &WgpuFrame,
        request: &FrameRequest<'_>,
        blocks: Range<usize>,
    ) -> Result<(), BackendError> {
        with_error_scope(&self.device, "objects", || frame.buffers.write_objects(&self.uploads, request, blocks))
            .flatten()
            .map_err(|error| loss_or(&self.device, error))
            .inspect_err(|error| self.fail_frame(error))
    }

    fn prepare(
        &self,
        frame: &WgpuFrame,
        &PassRequest { frame: request, index, pass, list }: &PassRequest<'_>,
    ) -> Result<(), BackendError> {
        let (pipelines, pass) = (frame.pipelines(pass), frame.pass(index));
        pass.timing.set_size(list.draw_count(), list.bundle_count(), pass.strategy.part_count(list));
        if pass.draws_items {
            pass.timing.set_group_size(list.items.group_size());
            let caches_bundles = pass.strategy.recording == RecordingStrategy::CachedBundles;
            if caches_bundles && pass.bundle_cache.begin_items(&list.items) {
                pass.timing.set_cold();
            }
            return Ok(());
        }
        if !pass.draws_commands {
            return Ok(());
        }
        if self.streamer.is_some() {
            mark_drawn(frame, request, list);
        }
        let created = with_error_scope(&self.device, &pass.label, || {
            frame.buffers.write_object_indices(&self.uploads, index, list);
            pass.upload_partial_indices(&self.device, &self.uploads, list.remaining_indices())?;
            self.subdivide(frame, request, list)?;
            if pass.strategy.recording == RecordingStrategy::CachedBundles {
                pass.bundle_cache.set_bundle_count(list.bundle_slot_count());
            }
            let runs = list.batches.chunk_by(|one, next| frame.meshes.share_pipeline(one, next));
            let variant = |run: &[Batch]| PipelineVariant::of_batch(&frame.meshes, &run[0]).clamping(pass.clamps_depth);
            pipelines.create_missing(&self.device, &pass.label, runs.map(variant))
        })
        .flatten()
        // Some of the resources just created may be unusable.
        .inspect_err(|error| {
            self.subdivisions.clear();
            self.fail_frame(error);
        })?;
        pipelines.insert(created);
        if pipelines.has_unreadable() {
            count_unreadable(frame, request, pipelines, list, pass.clamps_depth);
        }
        Ok(())
    }

    fn part_count(&self, frame: &WgpuFrame, pass: &PassRequest<'_>) -> usize {
        let state = frame.pass(pass.index);
        match state.raw_encoders {
            0 => state.strategy.part_count(pass.list),
            1 => 0,
            encoders => encoders,
        }
    }

    fn record(
        &self,
        frame: &WgpuFrame,
        request: &PassRequest<'_>,
        mut parts: Range<usize>,
        emit: &mut dyn FnMut(WgpuPart),
    ) -> Result<(), BackendError> {
        let pass = frame.pass(request.index);
        let has_bundles = pass.raw_encoders == 0 && pass.strategy.encoder_count(request.list.bundle_count()) == 1;
        let encoder = PassEncoder::new(&self.device, frame, request);
        // Cached bundles need no error scope, which locks the device twice.
        let replayed = pass.timing.time_parallel(|| {
            while has_bundles
                && !parts.is_empty()
                && let Some(cached) = encoder.cached_bundle(parts.start)?
            {
                emit(cached);
                parts.start += 1;
            }
            Ok(())
        });
        replayed.inspect_err(|error| self.fail_frame(error))?;
        if parts.is_empty() {
            return Ok(());
        }
        let record = |part| match has_bundles {
            true => encoder.record_bundle(part).map(RecordedPart::Bundle),
            false => encoder.encode_segment(part),
        };
        let all = || parts.map(record).try_for_each(|part| part.map(|part| emit(WgpuPart(part))));
        // One error scope for all other parts.
        pass.timing
            .time_parallel(|| with_error_scope(&self.device, &pass.label, || catch_wgpu_panic(&pass.label, all)))
            .flatten()
            .flatten()
            .inspect_err(|error| self.fail_frame(error))
    }

    fn shares_encoder(&self, frame: &WgpuFrame, pass: usize) -> bool {
        frame.pass(pass).shares_encoder
    }

    fn finish(
        &self,
        frame: &WgpuFrame,
        passes: &[PassRequest<'_>],
        parts: &mut [Vec<WgpuPart>],
        emit: &mut dyn FnMut(WgpuCommands),
    ) -> Result<(), BackendError> {
        if let ([pass], [parts]) = (passes, &mut *parts) {
            emit(self.finish_pass(frame, pass, parts)?);
            return Ok(());
        }
        // One of them may have grown since these buffers were used last.
        if !parts.iter().any(|parts| is_split(parts)) {
            let start = Instant::now();
            let label = &frame.pass(passes[0].index).label;
            let encode = || Ok(encode_passes(&self.device, frame, passes, parts)?.finish());
            let encoded = with_error_scope(&self.device, label, || catch_wgpu_panic(label, encode));
            if let Ok(commands) = encoded.flatten().flatten() {
                // wgpu encodes all of them when the encoder is finished, so none can be timed alone. A trial of a
                // recording strategy is measured with its neighbours, which blurs it; a small pass has few batches, so
                // there is little to choose.
                for (pass, share) in passes.iter().zip(PassRequest::divide_time(passes, start.elapsed())) {
                    frame.pass(pass.index).timing.add_serial(share.as_nanos() as u64);
                }
                emit(WgpuCommands(PassCommands::Finished(commands)));
                for pass in &passes[1..] {
                    frame.pass(pass.index).is_in_previous_encoder.store(true, Ordering::Relaxed);
                    emit(WgpuCommands(PassCommands::InEarlierPass));
                }
                return Ok(());
            }
            self.buffers.clear();
        }
        // Alone, the pass that the device refuses is found.
        for (pass, parts) in passes.iter().zip(parts) {
            let label = &frame.pass(pass.index).label;
            let finished = catch_wgpu_panic(label, || self.finish_pass(frame, pass, parts)).flatten();
            emit(finished.inspect_err(|error| self.fail_frame(error))?);
        }
        Ok(())
    }
}

impl WgpuBackend {
    /// Finishes a pass in an encoder of its own, or in several.
    ///
    /// # Errors
    /// If the device refuses it.
    fn finish_pass(
        &self,
        frame: &WgpuFrame,
        request: &PassRequest<'_>,
        parts: &mut Vec<WgpuPart>,
    ) -> Result<WgpuCommands, BackendError> {
        let index = request.index;
        let pass = frame.pass(index);
        if is_split(parts) {
            if frame.generates_mip_levels(index) {
                let encode = || encode_after_segments(&self.device, frame, request);
                let last = pass.timing.time_serial(|| with_error_scope(&self.device, &pass.label, encode)).flatten();
                parts.push(WgpuPart(last.inspect_err(|error| self.fail_frame(error))?));
            }
            return Ok(WgpuCommands(PassCommands::Parts(std::mem::take(parts))));
        }
        let finish = || {
            let encoder = encode_pass(&self.device, frame, request, parts)?;
            Ok(match pass.strategy.encoding {
                EncodingStrategy::OnSubmit => PassCommands::Open(encoder),
                EncodingStrategy::PerPass | EncodingStrategy::Split => PassCommands::Finished(encoder.finish()),
            })
        };
        let commands = pass.timing.time_serial(|| with_error_scope(&self.device, &pass.label, finish)).flatten();
        commands.map(WgpuCommands).inspect_err(|error| self.fail_frame(error))
    }
}

/// Marks the meshes and materials of a list as drawn, and counts what is not on the device yet.
fn mark_drawn(frame: &WgpuFrame, request: &FrameRequest<'_>, list: &DrawList) {
    let (frame_use, meshes) = (&frame.frame_use, &frame.meshes);
    for batch in &list.batches {
        let objects = &list.objects[batch.first as usize..][..batch.count as usize];
        frame_use.mark_mesh(batch.mesh);
        if meshes.is_missing(batch) && batch.state.subdivision_level() == 0 {
            let objects = objects.iter().map(|object| *object as usize);
            request.scene_issues.count_all_once(IssueReason::NotResident, objects);
        }
        for &object in objects {
            let material = request.scene.materials[object as usize].index();
            if frame_use.mark_material(material) {
                request.scene_issues.count_once(IssueReason::TextureNotResident, material as usize);
            }
        }
    }
}

/// Counts the objects of a list with meshes of which the process's shader cannot read an attribute.
fn count_unreadable(
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    pipelines: &ProcessPipelines,
    list: &DrawList,
    clamps_depth: bool,
) {
    for batch in &list.batches {
        if pipelines.is_unreadable(&PipelineVariant::of_batch(&frame.meshes, batch).clamping(clamps_depth)) {
            let objects = &list.objects[batch.first as usize..][..batch.count as usize];
            let objects = objects.iter().map(|object| *object as usize);
            request.scene_issues.count_all_once(IssueReason::UndrawableMesh, objects);
        }
    }
}

/// Whether the parts of a pass are its encoders.
fn is_split(parts: &[WgpuPart]) -> bool {
    matches!(parts.first(), Some(WgpuPart(RecordedPart::Encoder(_))))
}
