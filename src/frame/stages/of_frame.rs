//! The stages that a frame has once.

use super::super::context::FrameContext;
use super::super::stage::{Chunking, Stage, StageInfo, StageJob};
use super::super::stage_clock::StageGroup;
use crate::backend::{Backend, BackendError};
use crate::view::ObjectTable;

/// Checks every object, and computes what all views need to know about it.
pub(super) struct Objects;

impl<B: Backend> Stage<B> for Objects {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "objects",
            after: &[],
            group: StageGroup::Visibility,
            chunking: Chunking::ByCost { units_per_item: 1 },
            cost_kind: "objects",
            depends_on_occlusion: false,
        }
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        frame.tables.objects.len()
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        frame.tables.objects.fill(frame.request.scene, job.items);
        Ok(())
    }
}

/// Uploads the object table. An item is a block of objects.
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
        frame.tables.objects.block_count()
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        frame.backend.upload_objects(job.worker, frame.backend_frame, &frame.tables.objects, job.items)
    }
}
