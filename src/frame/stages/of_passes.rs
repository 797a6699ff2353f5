//! The stages of passes: from visible objects to the draw list, and from that to finished commands.

use std::ops::Range;
use std::{array, mem, slice};

use parking_lot::{MutexGuard, RwLock};

use super::context::FrameContext;
use super::granularity::Granularity;
use super::stage::StageJob;
use super::tables::MAX_SEGMENTS;
use crate::backend::{Backend, PassRequest};
use crate::command::{DrawList, instance, sort};
use crate::frame::encoders::PassRecording;
use crate::frame::encoders::{FailedPass, FrameEncoders, PassFailure};
use crate::graph::NodeError;
use crate::quality::CullingVolume;
use crate::task::catch;
use crate::view;
use crate::view::DrawFilter;

pub(super) fn one_unless_kept<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> usize {
    usize::from(!frame.keeps_list(pass))
}

/// The visible objects; 0 if the pass keeps its draw list, as for all stages that make it.
pub(super) fn visible_objects<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> usize {
    if frame.keeps_list(pass) { 0 } else { frame.visible_count(pass) }
}

/// The blocks of the items that a pass draws.
pub(super) fn item_blocks_of_pass<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> usize {
    frame.items_of(pass).map_or(0, |(table, _)| table.block_count())
}

/// Finds the items that the pass's view sees. An item of the stage is a block of items.
pub(super) fn cull_items<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let Some((table, lent)) = frame.items_of(job.of) else { return Ok(()) };
    let (view, visible) =
        (&frame.request.views[frame.view_index_of(job.of)], &frame.tables.passes[job.of].visible_items);
    let culls = frame.request.quality.culling != CullingVolume::None;
    job.items.for_each(|block| table.cull(&lent.columns(), (view, culls), block, visible));
    Ok(())
}

/// Lists the items that the pass's view sees, in draw order, and divides them into bundles.
pub(super) fn list_items<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let (pass, granularity) = (&frame.tables.passes[job.of], frame.granularity);
    let per_bundle = granularity.draws_per_job().map(|_| granularity.batches_per_bundle());
    let list = &mut pass.list.write().items;
    match frame.items_of(job.of) {
        Some((table, _)) => table.list(&pass.visible_items, per_bundle, job.of, list),
        None => list.clear(),
    }
    Ok(())
}

/// Makes a command for each visible object (M 10.3).
pub(super) fn make_commands<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let (table, view_index) = (&frame.tables.passes[job.of], frame.view_index_of(job.of));
    let selection = table.selection.unwrap_or_default();
    let fill = view::Fill {
        table: &frame.tables.objects,
        view: &frame.request.views[view_index],
        visible: &frame.tables.visibility[view_index].set,
        selection,
        filter: DrawFilter::new(&frame.tables.objects, frame.request.scene, selection),
        levels: frame.levels_of_detail(view_index),
        scene: frame.request.scene,
        quality: frame.request.quality,
    };
    if fill.run(job.items, &table.commands) {
        table.has_coarse_edges.get_or_init(|| ());
    }
    Ok(())
}

/// Divides the pass's commands into buckets.
pub(super) fn divide_commands<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let table = &frame.tables.passes[job.of];
    let count = frame.visible_count(job.of);
    if let Some(draws) = frame.granularity.draws_per_job() {
        table.partition.write().divide(&table.commands, count, draws);
        return Ok(());
    }
    let mut splitters = table.splitters.write();
    let buckets = match frame.granularity {
        Granularity::Adaptive => {
            count.div_ceil(frame.items_per_job_by_cost(job.node, count)).min(frame.max_buckets(job.of))
        }
        _ => 1,
    };
    splitters.choose(&table.commands, count, buckets);
    frame.report_job_size(job.node, count, count.div_ceil(splitters.bucket_count()));
    Ok(())
}

pub(super) fn buckets<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> usize {
    if frame.keeps_list(pass) { 0 } else { frame.bucket_count(pass) }
}

/// Sorts the commands of each bucket (M 10.5). An item is a bucket.
pub(super) fn sort_commands<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let table = &frame.tables.passes[job.of];
    if frame.granularity.draws_per_job().is_some() {
        let partition = table.partition.read();
        for part in job.items {
            partition.sort(part, &mut table.buckets[part].write().commands);
        }
        return Ok(());
    }
    let (count, splitters) = (frame.visible_count(job.of), table.splitters.read());
    let mut scratch = frame.tables.sort_scratch[job.worker.index()].lock();
    for bucket in job.items {
        let sorted = &mut table.buckets[bucket].write().commands;
        sort(&table.commands, count, splitters.key_range(bucket), &mut scratch, sorted);
    }
    Ok(())
}

/// Merges equal commands of each bucket into instanced draws (M 10.5). An item is a bucket.
pub(super) fn merge_commands<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    for bucket in job.items {
        let mut bucket = frame.tables.passes[job.of].buckets[bucket].write();
        instance(&mut bucket, |mesh| frame.can_merge(job.of, mesh));
    }
    Ok(())
}

/// The segments of the visible objects.
pub(super) fn segments<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> usize {
    if frame.keeps_list(pass) { 0 } else { frame.segment_count(pass) }
}

/// Orders the pass's objects by bin, where their depth does not matter. An item is a segment.
pub(super) fn bin_objects<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let (table, objects) = (&frame.tables.passes[job.of], &frame.tables.objects);
    let view_index = frame.view_index_of(job.of);
    let (visible, levels) = (&frame.tables.visibility[view_index].set, frame.levels_of_detail(view_index));
    let selection = table.selection.unwrap_or_default();
    let filter = DrawFilter::new(objects, frame.request.scene, selection);
    for index in job.items {
        let range = frame.range_of_segment(job.of, index);
        let mut segment = table.segments[index].write();
        view::bin_visible(objects, visible, selection, filter, &range, &mut segment);
        if let Some(levels) = levels {
            let bins = objects.bins();
            let has_levels = |bin| frame.tables.mesh_levels.contains(bins.get(bin).mesh);
            segment.divide_by_level(has_levels, |object| levels.get(object as usize));
        }
    }
    Ok(())
}

/// Joins the buckets, or segments, to the pass's draw list.
pub(super) fn join<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let table = &frame.tables.passes[job.of];
    let can_merge = |mesh| frame.can_merge(job.of, mesh);
    let mut list = table.list.write();
    list.set_batches_per_bundle(frame.granularity.batches_per_bundle());
    if table.mode.lists_static_groups() {
        list.clear_own();
    } else {
        list.clear();
    }
    *table.list_inputs.write() = None;
    if table.mode.orders_by_bin {
        let (bins, count) = (frame.tables.objects.bins(), frame.segment_count(job.of));
        if count <= MAX_SEGMENTS {
            // An array, so that no frame allocates for it.
            let mut segments = array::from_fn::<_, MAX_SEGMENTS, _>(|index| table.segments[index].write());
            list.join_bins(&mut segments[..count], &bins, can_merge);
        } else {
            let mut segments: Vec<_> = table.segments[..count].iter().map(RwLock::write).collect();
            list.join_bins(&mut segments, &bins, can_merge);
        }
    } else {
        for bucket in &table.buckets[..frame.bucket_count(job.of)] {
            list.append(&mut bucket.write(), can_merge);
        }
    }
    if table.culls_triangles {
        table.triangles.write().find(&list, &frame.tables.culling, frame.request.scene.assets);
    }
    if table.can_keep_list && table.has_coarse_edges.get().is_none() {
        list.set_version(frame.tables.version(job.of));
        *table.list_inputs.write() = Some(frame.list_inputs(job.of));
    }
    Ok(())
}

/// Uploads which objects the pass draws, and makes its pipelines.
pub(super) fn prepare<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let table = &frame.tables.passes[job.of];
    frame.recordings[job.of].reserve(frame.part_count(job.of));
    let list = table.list.read();
    Ok(frame.backend.prepare(frame.backend_frame, &frame.pass_request(job.of, &list))?)
}

/// The parts that the backend records the pass in.
pub(super) fn parts<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> usize {
    frame.part_count(pass)
}

/// Records the pass in parts, such as bundles. An item is a part.
pub(super) fn record<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let list = frame.tables.passes[job.of].list.read();
    let request = frame.pass_request(job.of, &list);
    let mut put_part = frame.recordings[job.of].put_parts_from(job.items.start);
    Ok(frame.backend.record(frame.backend_frame, &request, job.items, &mut put_part)?)
}

/// Finishes the pass: its commands are ready to submit. The job of the pass that becomes ready last finishes all passes
/// of its encoder.
pub(super) fn finish<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    match frame.encoders.complete(job.of) {
        None => {}
        Some(passes) if passes.len() == 1 => finish_pass(frame, job.of)?,
        Some(passes) => finish_passes(frame, passes, job.of)?,
    }
    Ok(())
}

fn finish_pass<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> Result<(), FailedPass> {
    let list = frame.tables.passes[pass].list.read();
    let mut parts = ordered_parts(frame, pass)?;
    finish_encoder(frame, &[frame.pass_request(pass, &list)], slice::from_mut(&mut *parts))
}

fn finish_passes<B: Backend>(
    frame: &FrameContext<'_, B>,
    passes: Range<usize>,
    job_of: usize,
) -> Result<(), FailedPass> {
    // Arrays, so that no frame allocates for them.
    let (first, count, empty) = (passes.start, passes.len(), DrawList::default());
    let lists: [_; FrameEncoders::MAX_PASSES] =
        array::from_fn(|index| (index < count).then(|| frame.tables.passes[first + index].list.read()));
    let requests: [_; FrameEncoders::MAX_PASSES] = array::from_fn(|index| match &lists[index] {
        Some(list) => frame.pass_request(first + index, list),
        None => frame.pass_request(first, &empty),
    });
    let recordings = &frame.recordings[passes.clone()];
    let mut taken = TakenParts { parts: array::from_fn(|_| Vec::new()), recordings };
    for (parts, pass) in taken.parts.iter_mut().zip(passes) {
        *parts = mem::take(&mut *ordered_parts(frame, pass)?);
    }
    let requests = &requests[..count];
    let start = frame.clock.stopwatch();
    let result = finish_encoder(frame, requests, &mut taken.parts[..count]);
    let took = start.elapsed();
    for (request, share) in requests.iter().zip(PassRequest::divide_time(requests, took)) {
        frame.add_view_time(request.index, share);
    }
    // When the job ends, its whole time is added to the view of its own pass.
    frame.subtract_view_time(job_of, took);
    result
}

/// Has the backend finish an encoder with these passes.
fn finish_encoder<B: Backend>(
    frame: &FrameContext<'_, B>,
    passes: &[PassRequest<'_>],
    parts: &mut [Vec<B::Part>],
) -> Result<(), FailedPass> {
    let mut finished = 0;
    let mut emit = |commands| {
        if let Some(pass) = passes.get(finished) {
            frame.recordings[pass.index].put_finished(commands);
        }
        finished += 1;
    };
    let failure = match catch(|| frame.backend.finish(frame.backend_frame, passes, parts, &mut emit)) {
        Ok(Ok(())) => return Ok(()),
        Ok(Err(error)) => PassFailure::Error(error),
        Err(panic) => PassFailure::Panic(panic),
    };
    Err(FailedPass { pass: passes[finished.min(passes.len() - 1)].index, failure })
}

fn ordered_parts<'a, B: Backend>(
    frame: &FrameContext<'a, B>,
    pass: usize,
) -> Result<MutexGuard<'a, Vec<B::Part>>, FailedPass> {
    let parts = frame.recordings[pass].ordered_parts();
    parts.map_err(|error| FailedPass { pass, failure: PassFailure::Error(error) })
}

/// The parts of an encoder's passes. When this is dropped, on every path, those that the backend leaves are dropped,
/// and their memory goes back to the recordings.
struct TakenParts<'a, B: Backend> {
    parts: [Vec<B::Part>; FrameEncoders::MAX_PASSES],
    recordings: &'a [PassRecording<B>],
}

impl<B: Backend> Drop for TakenParts<'_, B> {
    fn drop(&mut self) {
        for (parts, recording) in self.parts.iter_mut().zip(self.recordings) {
            recording.keep_memory(mem::take(parts));
        }
    }
}
