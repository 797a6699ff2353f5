//! The stages of the frame and of its views: objects, static groups, visibility, levels of detail.

use super::context::FrameContext;
use super::stage::StageJob;
use super::tables::PassTable;
use crate::backend::Backend;
use crate::graph::NodeError;
use crate::view::{self, IssueReason};

pub(super) fn changed_blocks<B: Backend>(frame: &FrameContext<'_, B>, _: usize) -> usize {
    frame.tables.objects.changed_block_count()
}

/// Checks the objects that changed, and computes what all views need to know about them. If these are all objects, it
/// also uploads them, while they are in the worker's caches. An item is a block with changed objects.
pub(super) fn update_objects<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let objects = &frame.tables.objects;
    objects.describe(frame.request.scene, job.items.clone());
    if objects.all_changed() { upload_objects(frame, job) } else { Ok(()) }
}

/// Completes the object table, and orders its objects by bin if a pass may use that.
pub(super) fn complete_objects<B: Backend>(frame: &FrameContext<'_, B>, _: StageJob<'_>) -> Result<(), NodeError> {
    let objects = &frame.tables.objects;
    objects.finish();
    let can_scan_bin_order =
        |table: &PassTable| table.mode.orders_by_bin && table.selection.is_some_and(view::can_scan_bin_order);
    if frame.tables.passes.iter().any(can_scan_bin_order) {
        objects.order_by_bin();
    }
    Ok(())
}

/// The blocks of objects, unless the backend's buffers have what changed.
pub(super) fn outdated_blocks<B: Backend>(frame: &FrameContext<'_, B>, _: usize) -> usize {
    let objects = &frame.tables.objects;
    let is_current = frame.backend.objects_epoch(frame.backend_frame) == objects.epoch();
    if objects.all_changed() || is_current { 0 } else { objects.block_count() }
}

/// Uploads what changed of the object table since the backend's buffers were written. An item is a block of objects.
pub(super) fn upload_objects<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    Ok(frame.backend.upload_objects(frame.backend_frame, frame.request, job.items)?)
}

/// The sets of items that the engine lends.
pub(super) fn lent_items<B: Backend>(frame: &FrameContext<'_, B>, _: usize) -> usize {
    frame.tables.items.len()
}

/// Orders items, if they do not have the order of the frame before. An item of the stage is a set of them.
pub(super) fn sort_items<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    frame.tables.items[job.items].iter().for_each(|(table, _)| table.sort());
    Ok(())
}

/// The blocks of all sets of items.
pub(super) fn item_blocks<B: Backend>(frame: &FrameContext<'_, B>, _: usize) -> usize {
    frame.tables.items.iter().map(|(table, _)| table.block_count()).sum()
}

/// Copies the bounds of items in draw order, for all views, and counts those that are invalid. An item of the stage is a
/// block of items.
pub(super) fn copy_item_bounds<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let (mut first_block, mut first_item) = (0, 0);
    for ((table, _), lent) in frame.tables.items.iter().zip(frame.request.items) {
        let end = first_block + table.block_count();
        let reject = |item| {
            frame.request.scene_issues.count(IssueReason::InvalidItemBounds, first_item + item as usize);
        };
        for block in job.items.start.max(first_block)..job.items.end.min(end) {
            table.copy_bounds(&lent.columns(), block - first_block, reject);
        }
        (first_block, first_item) = (end, first_item + lent.keys.len());
    }
    Ok(())
}

/// The words of objects that the view tests: all of them, or those with changed objects.
pub(super) fn tested_words<B: Backend>(frame: &FrameContext<'_, B>, view: usize) -> usize {
    frame.tables.visibility[view].word_count(&frame.tables.objects)
}

/// Tests objects against the view's frustum. An item is a word of objects.
pub(super) fn test_frustum<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let (visibility, objects) = (&frame.tables.visibility[job.of], &frame.tables.objects);
    let (frustum, volume) = (&frame.request.views[job.of].frustum, frame.request.quality.culling);
    visibility.test_words(job.items, objects, frustum, volume);
    Ok(())
}

pub(super) fn level_words<B: Backend>(frame: &FrameContext<'_, B>, view: usize) -> usize {
    let tables = frame.tables;
    tables.levels[view].word_count(&tables.visibility[view], &tables.objects)
}

/// Chooses the levels of detail of the objects in the view's frustum. An item is a word of objects.
pub(super) fn choose_levels<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let tables = frame.tables;
    let inputs = (frame.request.scene, &tables.objects, &tables.mesh_levels);
    tables.levels[job.of].choose(job.items, inputs, &tables.visibility[job.of]);
    Ok(())
}

/// Counts the visible objects, which gives each its rank.
pub(super) fn rank_visible<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let version = frame.tables.version(job.of);
    frame.tables.visibility[job.of].compact(version);
    if let Some(levels) = frame.levels_of_detail(job.of) {
        levels.complete(version);
    }
    Ok(())
}

/// The static groups that have to be recorded.
pub(super) fn changed_groups<B: Backend>(frame: &FrameContext<'_, B>, _: usize) -> usize {
    frame.tables.static_groups.recording_count()
}

/// Records static groups, for all views: makes what each process draws of them. An item is a static group.
pub(super) fn record_groups<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let tables = frame.tables;
    let changes_by_view =
        |mesh| tables.mesh_levels.contains(mesh) || frame.culls_triangles && tables.culling.is_cullable(mesh);
    let timeline = job.worker.timeline();
    for index in job.items {
        // A slice of its own, by name.
        let name = || format!("record static group {:?}", tables.static_groups.recorded_name(index));
        let _span = timeline.is_on().then(|| timeline.span(name()));
        let is_recordable = |mesh| !changes_by_view(mesh);
        tables.static_groups.record(index, frame.request.scene, &tables.objects, is_recordable, |_| frame.instancing);
    }
    Ok(())
}

/// 1 if the view executes static groups: also if the draw list, which executes them as well, is kept, so that timelines
/// have the stage in every frame that does.
pub(super) fn one_if_executed<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> usize {
    let executed = frame.tables.visibility[frame.view_index_of(pass)].static_groups.executed();
    usize::from(!executed.is_empty() || !frame.keeps_list(pass))
}

/// Puts what a pass draws of the static groups that its view sees into the draw list.
pub(super) fn execute_groups<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    if frame.keeps_list(job.of) {
        return Ok(());
    }
    let table = &frame.tables.passes[job.of];
    let static_groups = &frame.tables.visibility[frame.view_index_of(job.of)].static_groups;
    if let Some(selection) = table.selection {
        let executed = (|static_group| static_groups.executes(static_group), static_groups.version());
        frame.tables.static_groups.execute(selection, executed, |_| frame.instancing, &mut table.list.write());
    }
    Ok(())
}
