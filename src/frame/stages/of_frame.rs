//! The stages that a frame has once.

use super::super::context::FrameContext;
use super::super::stage::{Chunking, Stage, StageInfo, StageJob};
use super::super::stage_clock::StageGroup;
use crate::backend::{Backend, BackendError};
use crate::view::{Frustum, ObjectTable};

/// Checks the objects that changed, and computes what all views need to know about them. An item is a word of objects.
pub(super) struct Objects;

impl<B: Backend> Stage<B> for Objects {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "objects",
            after: &[],
            group: StageGroup::Visibility,
            chunking: Chunking::ByCost { units_per_item: Frustum::WORD },
            cost_kind: "objects",
            depends_on_occlusion: false,
        }
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        frame.tables.objects.changed_word_count()
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        frame.tables.objects.describe(frame.request.scene, job.items);
        Ok(())
    }
}

/// Orders the bins of objects, if there are new ones.
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
        frame.tables.objects.finish();
        Ok(())
    }
}

/// Uploads what changed of the object table since the backend's buffers were written. An item is a block of objects.
pub(super) struct Upload;

impl<B: Backend> Stage<B> for Upload {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "upload",
            after: &["objects"],
            group: StageGroup::Record,
            chunking: Chunking::ByCost { units_per_item: ObjectTable::BLOCK_SIZE },
            cost_kind: "upload",
            depends_on_occlusion: false,
        }
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        let objects = &frame.tables.objects;
        if frame.backend.objects_epoch(frame.backend_frame) == objects.epoch() { 0 } else { objects.block_count() }
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        frame.backend.upload_objects(job.worker, frame.backend_frame, &frame.tables.objects, job.items)
    }
}
