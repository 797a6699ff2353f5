//! The stages that make the draw list of a pass: from visible objects to batches.

use std::array;

use parking_lot::RwLock;

use super::super::context::FrameContext;
use super::super::granularity::Granularity;
use super::super::stage::StageJob;
use super::super::tables::MAX_SEGMENTS;
use crate::backend::Backend;
use crate::command::{instance, sort};
use crate::graph::NodeError;
use crate::view::{self, DrawFilter};

pub(super) fn one_unless_kept<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> usize {
    usize::from(!frame.keeps_list(pass))
}

/// The visible objects; 0 if the pass keeps its draw list, as for all stages that make it.
pub(super) fn visible_objects<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> usize {
    if frame.keeps_list(pass) { 0 } else { frame.visible_count(pass) }
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
    fill.run(job.items, &table.commands);
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
    if table.can_keep_list {
        list.set_version(frame.tables.version(job.of));
        *table.list_inputs.write() = Some(frame.list_inputs(job.of));
    }
    Ok(())
}
