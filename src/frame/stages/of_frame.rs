//! The stages that a frame has once.

use super::super::context::FrameContext;
use super::super::stage::{Chunking, Stage, StageInfo, StageJob};
use super::super::stage_clock::StageGroup;
use super::super::tables::PassTable;
use crate::backend::{Backend, BackendError};
use crate::view;

/// Checks the objects that changed, and computes what all views need to know about them. If these are all objects, it
/// also uploads them, while they are in the worker's caches. An item is a block with changed objects.
pub(super) struct Objects;

impl<B: Backend> Stage<B> for Objects {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "objects",
            after: &[],
            group: StageGroup::Visibility,
            chunking: Chunking::ByCost,
            cost_kind: "objects",
            depends_on_occlusion: false,
        }
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        frame.tables.objects.changed_block_count()
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let objects = &frame.tables.objects;
        objects.describe(frame.request.scene, job.items.clone());
        if !objects.all_changed() {
            return Ok(());
        }
        frame.backend.upload_objects(job.worker, frame.backend_frame, frame.request, job.items)
    }
}

/// Completes the object table, and orders its objects by bin if a pass may use that.
pub(super) struct Bins;

impl<B: Backend> Stage<B> for Bins {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "bins",
            after: &["objects"],
            group: StageGroup::Visibility,
            chunking: Chunking::PerItem,
            cost_kind: "bins",
            depends_on_occlusion: false,
        }
    }

    fn run(&self, frame: &FrameContext<'_, B>, _: StageJob<'_>) -> Result<(), BackendError> {
        let objects = &frame.tables.objects;
        objects.finish();
        let can_scan_bin_order =
            |table: &PassTable| table.orders_by_bin && table.selection.is_some_and(view::can_scan_bin_order);
        if frame.tables.passes.iter().any(can_scan_bin_order) {
            objects.order_by_bin();
        }
        Ok(())
    }
}

/// Uploads what changed of the object table since the backend's buffers were written, unless that is done. An item is a
/// block of objects.
pub(super) struct Upload;

impl<B: Backend> Stage<B> for Upload {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "upload",
            after: &["objects"],
            group: StageGroup::Record,
            chunking: Chunking::ByCost,
            cost_kind: "upload",
            depends_on_occlusion: false,
        }
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        let objects = &frame.tables.objects;
        let is_current = frame.backend.objects_epoch(frame.backend_frame) == objects.epoch();
        if objects.all_changed() || is_current { 0 } else { objects.block_count() }
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        frame.backend.upload_objects(job.worker, frame.backend_frame, frame.request, job.items)
    }
}
