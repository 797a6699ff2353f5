//! The stages of a view: from all objects to the visible ones.

use super::super::context::FrameContext;
use super::super::stage::StageJob;
use crate::backend::Backend;
use crate::graph::NodeError;

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
