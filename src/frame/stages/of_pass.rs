//! The stages of a pass: from visible objects to finished commands.

use std::array;
use std::mem;
use std::ops::Range;
use std::panic::resume_unwind;
use std::time::Duration;

use parking_lot::RwLock;

use super::super::context::{FrameContext, MAX_SEGMENTS};
use super::super::granularity::Granularity;
use super::super::pass_recording::PassRecording;
use super::super::pass_runs::{PassFailure, PassRuns};
use super::super::stage::{Chunking, Stage, StageInfo, StageJob, StageNeeds};
use super::super::stage_clock::StageGroup;
use crate::backend::{Backend, BackendError, PassRequest};
use crate::command::{DrawList, instance, sort};
use crate::task::{JobPanic, Worker, catch};
use crate::view::{self, SelectionFilter};

/// Makes a command for each visible object (M 10.3).
pub(super) struct Fill {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Fill {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "fill",
            after: &["compact"],
            group: StageGroup::Fill,
            chunking: Chunking::ByDraws { draws_per_item: 1 },
            cost_kind: "fill",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.sorts_commands()
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        if frame.keeps_list(self.pass) { 0 } else { frame.visible_count(self.pass) }
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let (table, view_index) = (&frame.tables.passes[self.pass], frame.view_index_of(self.pass));
        let selection = table.selection.unwrap_or_default();
        let fill = view::Fill {
            table: &frame.tables.objects,
            view: &frame.request.views[view_index],
            visible: &frame.tables.visibility[view_index].set,
            selection,
            filter: SelectionFilter::new(&frame.tables.objects, frame.request.scene, selection),
            levels: frame.levels_of_detail(view_index),
            scene: frame.request.scene,
            quality: frame.request.quality,
        };
        fill.run(job.items, &table.commands);
        Ok(())
    }
}

/// Divides the pass's commands into buckets.
pub(super) struct Split {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Split {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "split",
            after: &["fill"],
            group: StageGroup::Sort,
            chunking: Chunking::PerItem,
            // It shares the estimate of sort, because it chooses the size of the sort jobs.
            cost_kind: "sort",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.sorts_commands()
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        usize::from(!frame.keeps_list(self.pass))
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let table = &frame.tables.passes[self.pass];
        let count = frame.visible_count(self.pass);
        if let Some(draws) = frame.granularity.draws_per_job() {
            table.partition.write().divide(&table.commands, count, draws);
            return Ok(());
        }
        let mut splitters = table.splitters.write();
        let buckets = match frame.granularity {
            // The job of a bucket reads every key of the pass, so more buckets than workers are wasted work.
            Granularity::Adaptive => count.div_ceil(frame.items_worth_a_job(job.node, count)).min(frame.workers),
            _ => 1,
        };
        splitters.choose(&table.commands, count, buckets);
        frame.report_job_size(job.node, count, count.div_ceil(splitters.bucket_count()));
        Ok(())
    }
}

/// Sorts the commands of each bucket (M 10.5). An item is a bucket.
pub(super) struct Sort {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Sort {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "sort",
            after: &["split"],
            group: StageGroup::Sort,
            chunking: Chunking::PerItem,
            cost_kind: "sort",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.sorts_commands()
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        if frame.keeps_list(self.pass) { 0 } else { frame.bucket_count(self.pass) }
    }

    /// The bucket's share of the visible objects, drawn or not: the split knows only their number.
    fn measured_items(&self, frame: &FrameContext<'_, B>, items: Range<usize>) -> Option<usize> {
        Some(frame.visible_count(self.pass) * items.len() / frame.bucket_count(self.pass))
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let table = &frame.tables.passes[self.pass];
        if frame.granularity.draws_per_job().is_some() {
            let partition = table.partition.read();
            for part in job.items {
                partition.sort(part, &table.commands, &mut table.buckets[part].write().commands);
            }
            return Ok(());
        }
        let (count, splitters) = (frame.visible_count(self.pass), table.splitters.read());
        let mut scratch = frame.tables.sort_scratch[job.worker.index()].lock();
        for bucket in job.items {
            let sorted = &mut table.buckets[bucket].write().commands;
            sort(&table.commands, count, splitters.key_range(bucket), &mut scratch, sorted);
        }
        Ok(())
    }
}

/// Merges equal commands of each bucket into instanced draws (M 10.5). An item is a bucket.
pub(super) struct Instance {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Instance {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "instance",
            after: &["sort"],
            group: StageGroup::Instance,
            chunking: Chunking::PerItem,
            cost_kind: "instance",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.sorts_commands()
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        if frame.keeps_list(self.pass) { 0 } else { frame.bucket_count(self.pass) }
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        for bucket in job.items {
            let mut bucket = frame.tables.passes[self.pass].buckets[bucket].write();
            instance(&mut bucket, |mesh| frame.can_merge(self.pass, mesh));
        }
        Ok(())
    }
}

/// Orders the pass's objects by bin, where their depth does not matter. An item is a segment of the visible objects.
pub(super) struct Bin {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Bin {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "bin",
            after: &["compact"],
            group: StageGroup::Sort,
            chunking: Chunking::PerItem,
            cost_kind: "bin",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.draws_commands && needs.orders_by_bin
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        if frame.keeps_list(self.pass) { 0 } else { frame.segment_count(self.pass) }
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let (table, objects) = (&frame.tables.passes[self.pass], &frame.tables.objects);
        let view_index = frame.view_index_of(self.pass);
        let (visible, levels) = (&frame.tables.visibility[view_index].set, frame.levels_of_detail(view_index));
        let selection = table.selection.unwrap_or_default();
        let filter = SelectionFilter::new(objects, frame.request.scene, selection);
        for index in job.items {
            let part = frame.part_of_segment(self.pass, index);
            let mut segment = table.segments[index].write();
            view::bin_visible(objects, visible, selection, filter, &part, &mut segment);
            if let Some(levels) = levels {
                let bins = objects.bins();
                let has_levels = |bin| frame.tables.mesh_levels.contains(bins.get(bin).mesh);
                segment.divide_by_level(has_levels, |object| levels.get(object as usize));
            }
        }
        Ok(())
    }
}

/// Joins the buckets, or segments, to the pass's draw list.
pub(super) struct Join {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Join {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "join",
            after: &["instance", "execute pieces", "bin"],
            group: StageGroup::Instance,
            chunking: Chunking::PerItem,
            cost_kind: "join",
            depends_on_occlusion: true,
        }
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        usize::from(!frame.keeps_list(self.pass))
    }

    fn run(&self, frame: &FrameContext<'_, B>, _: StageJob<'_>) -> Result<(), BackendError> {
        let table = &frame.tables.passes[self.pass];
        let can_merge = |mesh| frame.can_merge(self.pass, mesh);
        let mut list = table.list.write();
        list.set_batches_per_bundle(frame.granularity.batches_per_bundle());
        if frame.has_pieces(self.pass) {
            list.clear_own();
        } else {
            list.clear();
        }
        *table.list_inputs.write() = None;
        if frame.orders_by_bin(self.pass) {
            let (bins, count) = (frame.tables.objects.bins(), frame.segment_count(self.pass));
            if count <= MAX_SEGMENTS {
                // An array, so that no frame allocates for it.
                let mut segments = array::from_fn::<_, MAX_SEGMENTS, _>(|index| table.segments[index].write());
                list.join_bins(&mut segments[..count], &bins, can_merge);
            } else {
                let mut segments: Vec<_> = table.segments[..count].iter().map(RwLock::write).collect();
                list.join_bins(&mut segments, &bins, can_merge);
            }
        } else {
            for bucket in &table.buckets[..frame.bucket_count(self.pass)] {
                list.append(&mut bucket.write(), can_merge);
            }
        }
        if frame.pass_culls_triangles(self.pass) {
            table.triangles.write().find(&list, &frame.tables.cullable_meshes, frame.request.scene.assets);
        }
        if frame.can_keep_list(self.pass) {
            list.set_version(frame.tables.version(self.pass));
            *table.list_inputs.write() = Some(frame.list_inputs(self.pass));
        }
        Ok(())
    }
}

/// Culls the triangles of meshes with triangle culling (S 9.6).
pub(super) struct Triangles {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Triangles {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "triangles",
            after: &["join"],
            group: StageGroup::Instance,
            chunking: Chunking::ByDraws { draws_per_item: 1 },
            cost_kind: "triangles",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.draws_commands && needs.culls_triangles
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        frame.tables.passes[self.pass].triangles.read().len()
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let table = &frame.tables.passes[self.pass];
        let view = &frame.request.views[frame.view_index_of(self.pass)];
        table.triangles.read().cull(job.items, view, frame.request.scene, &table.list.read());
        Ok(())
    }
}

/// Leaves culled triangles out of the draw list.
pub(super) struct CullList {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for CullList {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "cull list",
            after: &["triangles"],
            group: StageGroup::Instance,
            chunking: Chunking::PerItem,
            cost_kind: "cull list",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.draws_commands && needs.culls_triangles
    }

    fn run(&self, frame: &FrameContext<'_, B>, _: StageJob<'_>) -> Result<(), BackendError> {
        let table = &frame.tables.passes[self.pass];
        table.triangles.read().apply(&mut table.list.write());
        Ok(())
    }
}

/// Uploads which objects the pass draws, and makes its pipelines.
pub(super) struct Prepare {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Prepare {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "prepare",
            after: &["cull list", "join"],
            group: StageGroup::Record,
            chunking: Chunking::PerItem,
            cost_kind: "prepare",
            depends_on_occlusion: true,
        }
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let table = &frame.tables.passes[self.pass];
        frame.recordings[self.pass].reserve(frame.part_count(self.pass));
        let list = table.list.read();
        frame.backend.prepare(job.worker, frame.backend_frame, &frame.pass_request(self.pass, &list))
    }
}

/// Records the pass in parts, such as bundles. An item is a part.
pub(super) struct Record {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Record {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "record",
            after: &["prepare"],
            group: StageGroup::Record,
            chunking: Chunking::ByDraws { draws_per_item: DrawList::BATCHES_PER_BUNDLE },
            cost_kind: "record",
            depends_on_occlusion: true,
        }
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        frame.part_count(self.pass)
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let list = frame.tables.passes[self.pass].list.read();
        let request = frame.pass_request(self.pass, &list);
        let mut put_part = frame.recordings[self.pass].put_parts_from(job.items.start);
        frame.backend.record(job.worker, frame.backend_frame, &request, job.items, &mut put_part)
    }
}

/// Finishes the pass: its commands are ready to submit. Of passes that are finished together, the job of the one that becomes ready last
/// finishes all.
pub(super) struct Finish {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Finish {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "finish",
            after: &["record"],
            group: StageGroup::Record,
            chunking: Chunking::PerItem,
            cost_kind: "finish",
            depends_on_occlusion: true,
        }
    }

    /// Every pass is finished, with commands or without.
    fn is_needed(&self, _: &StageNeeds) -> bool {
        true
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        match frame.pass_runs.complete(self.pass) {
            None => Ok(()),
            Some(passes) if passes.len() == 1 => finish_pass(frame, job.worker, self.pass),
            Some(passes) => finish_together(frame, job.worker, passes, self.pass),
        }
    }
}

fn finish_pass<B: Backend>(frame: &FrameContext<'_, B>, worker: &Worker, pass: usize) -> Result<(), BackendError> {
    let list = frame.tables.passes[pass].list.read();
    let mut parts = frame.recordings[pass].ordered_parts()?;
    let request = frame.pass_request(pass, &list);
    let commands = frame.backend.finish(worker, frame.backend_frame, &request, &mut parts)?;
    frame.recordings[pass].put_finished(commands);
    Ok(())
}

fn finish_together<B: Backend>(
    frame: &FrameContext<'_, B>,
    worker: &Worker,
    passes: Range<usize>,
    job_of: usize,
) -> Result<(), BackendError> {
    // Arrays, so that no frame allocates for them.
    let (first, count, empty) = (passes.start, passes.len(), DrawList::default());
    let lists: [_; PassRuns::MAX_PASSES] =
        array::from_fn(|index| (index < count).then(|| frame.tables.passes[first + index].list.read()));
    let requests: [_; PassRuns::MAX_PASSES] = array::from_fn(|index| match &lists[index] {
        Some(list) => frame.pass_request(first + index, list),
        None => frame.pass_request(first, &empty),
    });
    let recordings = &frame.recordings[passes];
    let mut taken = TakenParts { parts: array::from_fn(|_| Vec::new()), recordings };
    let parts = &mut taken.parts;
    let fail = |index: usize| frame.pass_runs.add_failure(PassFailure { failed: first + index.min(count - 1), job_of });
    for (index, (parts, recording)) in parts.iter_mut().zip(recordings).enumerate() {
        *parts = mem::take(&mut *recording.ordered_parts().inspect_err(|_| fail(index))?);
    }
    let mut finished = 0;
    let mut emit = |commands| {
        if let Some(recording) = recordings.get(finished) {
            recording.put_finished(commands);
        }
        finished += 1;
    };
    let (requests, parts) = (&requests[..count], &mut parts[..count]);
    let start = frame.clock.stopwatch();
    let result = catch(|| frame.backend.finish_together(worker, frame.backend_frame, requests, parts, &mut emit));
    let result = result.unwrap_or_else(|JobPanic { message }| {
        fail(finished);
        // The run reports it.
        resume_unwind(Box::new(message))
    });
    attribute_time(frame, requests, job_of, start.elapsed());
    if result.is_err() {
        fail(finished);
    }
    result
}

/// The parts of passes that are finished together. When this is dropped, on every path, those that the backend leaves
/// are dropped, and their memory goes back to the recordings.
struct TakenParts<'a, B: Backend> {
    parts: [Vec<B::Part>; PassRuns::MAX_PASSES],
    recordings: &'a [PassRecording<B>],
}

impl<B: Backend> Drop for TakenParts<'_, B> {
    fn drop(&mut self) {
        for (parts, recording) in self.parts.iter_mut().zip(self.recordings) {
            recording.keep_memory(mem::take(parts));
        }
    }
}

/// Divides the time of passes that one job finished among their views, by their batches. When the job ends, its whole time is added to the
/// view of its own pass.
fn attribute_time<B: Backend>(
    frame: &FrameContext<'_, B>,
    requests: &[PassRequest<'_>],
    job_of: usize,
    took: Duration,
) {
    let all: u64 = requests.iter().map(PassRequest::relative_cost).sum();
    for request in requests {
        frame.add_view_time(request.index, took.mul_f64(request.relative_cost() as f64 / all as f64));
    }
    frame.subtract_view_time(job_of, took);
}
