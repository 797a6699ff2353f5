//! The stages of static groups: recorded once, executed by passes.

use super::super::context::FrameContext;
use super::super::stage::{Chunking, Stage, StageInfo, StageJob, StageNeeds};
use super::super::stage_clock::StageGroup;
use crate::backend::{Backend, BackendError};

/// Records static groups, for all views: makes what each process draws of them. An item is a static group that has to
/// be recorded.
pub(super) struct RecordStaticGroups;

impl<B: Backend> Stage<B> for RecordStaticGroups {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "record static groups",
            after: &["bins"],
            group: StageGroup::Sort,
            chunking: Chunking::PerItem,
            cost_kind: "record static groups",
            depends_on_occlusion: false,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.has_static_groups
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        frame.tables.static_groups.recording_count()
    }

    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError> {
        let tables = frame.tables;
        let changes_by_view =
            |mesh| tables.mesh_levels.contains(mesh) || frame.culls_triangles && tables.culling.is_cullable(mesh);
        let timeline = job.worker.timeline();
        for index in job.items {
            // A slice of its own, by name.
            let name = || format!("record static group {:?}", tables.static_groups.recorded_name(index));
            let _span = timeline.is_on().then(|| timeline.span(name()));
            let is_recordable = |mesh| !changes_by_view(mesh);
            tables
                .static_groups
                .record(index, frame.request.scene, &tables.objects, is_recordable, |_| frame.instancing);
        }
        Ok(())
    }
}

/// Puts what a pass draws of the static groups that its view sees into the draw list.
pub(super) struct ExecuteStaticGroups {
    pub(super) pass: usize,
}

impl<B: Backend> Stage<B> for ExecuteStaticGroups {
    fn info(&self) -> &'static StageInfo {
        &StageInfo {
            name: "execute static groups",
            after: &["bin"],
            group: StageGroup::Instance,
            chunking: Chunking::PerItem,
            cost_kind: "execute static groups",
            depends_on_occlusion: true,
        }
    }

    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.draws_commands && needs.orders_by_bin && needs.has_static_groups
    }

    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        let executed = frame.tables.visibility[frame.view_index_of(self.pass)].static_groups.executed();
        // A kept list executes them as well: the stage is there in every frame that does, for the timeline.
        usize::from(frame.has_static_groups(self.pass) && (!executed.is_empty() || !frame.keeps_list(self.pass)))
    }

    fn run(&self, frame: &FrameContext<'_, B>, _: StageJob<'_>) -> Result<(), BackendError> {
        if frame.keeps_list(self.pass) {
            return Ok(());
        }
        let table = &frame.tables.passes[self.pass];
        let static_groups = &frame.tables.visibility[frame.view_index_of(self.pass)].static_groups;
        if let Some(selection) = table.selection {
            let executed = (|static_group| static_groups.executes(static_group), static_groups.version());
            frame.tables.static_groups.execute(selection, executed, |_| frame.instancing, &mut table.list.write());
        }
        Ok(())
    }
}
