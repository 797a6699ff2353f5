//! The stages of culling beyond the view frustum (S 9.6).

use super::super::context::FrameContext;
use super::super::stage::{Chunking, Stage, StageInfo, StageJob, StageNeeds};
use super::super::stage_clock::StageGroup;
use crate::backend::{Backend, BackendError};
use crate::command::Selection;
use crate::scene::Blend;
use crate::view::DrawFilter;

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
        needs.draws_commands && needs.culling.tests_occlusion
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        usize::from(frame.tables.culling.occlusion[self.view].is_on())
    }

    fn run(&self, frame: &FrameContext<'_, B>, _: StageJob<'_>) -> Result<(), BackendError> {
        let (tables, scene) = (frame.tables, frame.request.scene);
        let selections = frame.occlusion.occluders(self.view);
        let occlusion = &tables.culling.occlusion[self.view].occlusion;
        occlusion.select_occluders(
            scene,
            &tables.objects,
            &tables.visibility[self.view].set,
            &tables.culling.occluder_meshes,
            |object, draw| {
                let blend = draw.state.blend();
                let is_drawn = |selection: &Selection| {
                    selection.contains(blend, draw.material)
                        && DrawFilter::new(&tables.objects, scene, *selection).passes(object)
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
        needs.draws_commands && needs.culling.tests_occlusion
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        let occlusion = &frame.tables.culling.occlusion[self.view];
        if occlusion.is_on() { occlusion.occlusion.strip_count() } else { 0 }
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        job.items.for_each(|strip| frame.tables.culling.occlusion[self.view].occlusion.draw_occluders(strip));
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
        needs.draws_commands && needs.culling.tests_occlusion
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        if frame.tables.culling.occlusion[self.view].is_on() { frame.tables.objects.len() } else { 0 }
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let occlusion = &frame.tables.culling.occlusion[self.view];
        let hidden_of =
            |first, visible| occlusion.occlusion.hidden(frame.request.scene, &frame.tables.objects, first, visible);
        occlusion.add_hidden(frame.tables.visibility[self.view].set.remove_hidden(job.items, hidden_of));
        Ok(())
    }
}

/// Culls the triangles of meshes with triangle culling (S 9.6).
pub(super) struct Triangles {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for Triangles {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "triangles",
            after: &["join"],
            group: StageGroup::Instance,
            chunking: Chunking::ByDraws { draws_per_item: 1 },
            cost_kind: "triangles",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.draws_commands && needs.culling.culls_triangles
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        frame.tables.passes[self.pass].triangles.read().len()
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let table = &frame.tables.passes[self.pass];
        let view = &frame.request.views[frame.view_index_of(self.pass)];
        table.triangles.read().cull(job.items, view, frame.request.scene, &table.list.read());
        Ok(())
    }
}

/// Leaves culled triangles out of the draw list.
pub(super) struct CullList {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for CullList {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "cull list",
            after: &["triangles"],
            group: StageGroup::Instance,
            chunking: Chunking::PerItem,
            cost_kind: "cull list",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.draws_commands && needs.culling.culls_triangles
    }

    fn run(&self, frame: &FrameContext<'_, B>, _: StageJob<'_>) -> Result<(), BackendError> {
        let table = &frame.tables.passes[self.pass];
        table.triangles.read().apply(&mut table.list.write());
        Ok(())
    }
}
