//! The stages of a view: from all objects to the visible ones.

use super::super::context::FrameContext;
use super::super::stage::{Chunking, Stage, StageInfo, StageJob, StageNeeds};
use super::super::stage_clock::StageGroup;
use crate::backend::{Backend, BackendError};
use crate::command::Selection;
use crate::scene::Blend;
use crate::view::SelectionFilter;

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

/// Chooses the visible objects that may occlude others.
pub(super) struct Occluders {
    pub(super) view: usize,
}

impl<B: Backend> Stage<B> for Occluders {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "occluders",
            after: &["levels", "visibility"],
            group: StageGroup::Visibility,
            chunking: Chunking::PerItem,
            cost_kind: "occluders",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.draws_commands && needs.tests_occlusion
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        usize::from(frame.tables.occlusion[self.view].is_on())
    }

    fn run(&self, frame: &FrameContext<'_, B>, _: StageJob<'_>) -> Result<(), BackendError> {
        let (tables, scene) = (frame.tables, frame.request.scene);
        let selections = frame.occlusion[self.view].occluders.as_deref().unwrap_or_default();
        let occlusion = &tables.occlusion[self.view].occlusion;
        occlusion.select_occluders(
            scene,
            &tables.objects,
            &tables.visibility[self.view].set,
            &tables.occluder_meshes,
            |object, draw| {
                let blend = draw.state.blend();
                let is_drawn = |selection: &Selection| {
                    selection.contains(blend, draw.material)
                        && SelectionFilter::new(&tables.objects, scene, *selection).passes(object)
                };
                // Only the mesh itself is known to cover its convex parts, and a mask has holes.
                let is_whole = !draw.state.is_masked()
                    && frame.levels_of_detail(self.view).is_none_or(|levels| levels.get(object) == 0);
                blend == Blend::None && is_whole && selections.iter().any(is_drawn)
            },
        );
        Ok(())
    }
}

/// Draws the occluders into the view's coarse depth buffer. An item is a strip: a row of blocks of tiles.
pub(super) struct CoarseDepth {
    pub(super) view: usize,
}

impl<B: Backend> Stage<B> for CoarseDepth {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "coarse depth",
            after: &["occluders"],
            group: StageGroup::Visibility,
            chunking: Chunking::ByCost,
            cost_kind: "coarse depth",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.draws_commands && needs.tests_occlusion
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        let occlusion = &frame.tables.occlusion[self.view];
        if occlusion.is_on() { occlusion.occlusion.strip_count() } else { 0 }
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        job.items.for_each(|strip| frame.tables.occlusion[self.view].occlusion.draw_occluders(strip));
        Ok(())
    }
}

/// Tests the visible objects against the coarse depth buffer, and removes the hidden ones.
pub(super) struct Occlusion {
    pub(super) view: usize,
}

impl<B: Backend> Stage<B> for Occlusion {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "occlusion",
            after: &["coarse depth"],
            group: StageGroup::Visibility,
            chunking: Chunking::ByCost,
            cost_kind: "occlusion",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.draws_commands && needs.tests_occlusion
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        if frame.tables.occlusion[self.view].is_on() { frame.tables.objects.len() } else { 0 }
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let occlusion = &frame.tables.occlusion[self.view];
        let hidden_of =
            |first, visible| occlusion.occlusion.hidden(frame.request.scene, &frame.tables.objects, first, visible);
        occlusion.add_hidden(frame.tables.visibility[self.view].set.remove_hidden(job.items, hidden_of));
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
