//! The stages that a frame has once.

use super::super::context::FrameContext;
use super::super::stage::StageJob;
use super::super::tables::PassTable;
use crate::backend::Backend;
use crate::graph::NodeError;
use crate::view;

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
