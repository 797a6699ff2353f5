//! The stages of a view: from all objects to the visible ones.

use super::super::context::FrameContext;
use super::super::stage::{Chunking, Stage, StageInfo, StageJob, StageNeeds};
use super::super::stage_clock::StageGroup;
use crate::backend::{Backend, BackendError};

/// Tests objects against the view's frustum: all of them, or those that changed. An item is a word of objects.
pub(super) struct Visibility {
    pub(super) view: usize,
}

impl<B: Backend> Stage<B> for Visibility {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "visibility",
            after: &["bins"],
            group: StageGroup::Visibility,
            chunking: Chunking::ByCost,
            cost_kind: "visibility",
            depends_on_occlusion: false,
        }
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        frame.tables.visibility[self.view].word_count(&frame.tables.objects)
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let (visibility, objects) = (&frame.tables.visibility[self.view], &frame.tables.objects);
        let (frustum, volume) = (&frame.request.views[self.view].frustum, frame.request.quality.culling);
        visibility.test_words(job.items, objects, frustum, volume);
        Ok(())
    }
}

/// Chooses the levels of detail of the objects in the view's frustum. An item is a word of objects.
pub(super) struct Levels {
    pub(super) view: usize,
}

impl<B: Backend> Stage<B> for Levels {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "levels",
            after: &["visibility"],
            group: StageGroup::Visibility,
            chunking: Chunking::ByCost,
            cost_kind: "levels",
            depends_on_occlusion: false,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.draws_commands && needs.chooses_levels
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        let tables = frame.tables;
        tables.levels[self.view].word_count(&tables.visibility[self.view], &tables.objects)
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let tables = frame.tables;
        let inputs = (frame.request.scene, &tables.objects, &tables.mesh_levels);
        tables.levels[self.view].choose(job.items, inputs, &tables.visibility[self.view]);
        Ok(())
    }
}

/// Counts the visible objects, which gives each its rank.
pub(super) struct Compact {
    pub(super) view: usize,
}

impl<B: Backend> Stage<B> for Compact {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "compact",
            after: &["occlusion", "levels", "visibility"],
            group: StageGroup::Visibility,
            chunking: Chunking::PerItem,
            cost_kind: "compact",
            depends_on_occlusion: false,
        }
    }

    fn run(&self, frame: &FrameContext<'_, B>, _: StageJob<'_>) -> Result<(), BackendError> {
        let version = frame.tables.version(self.view);
        frame.tables.visibility[self.view].compact(version);
        if let Some(levels) = frame.levels_of_detail(self.view) {
            levels.complete(version);
        }
        Ok(())
    }
}
