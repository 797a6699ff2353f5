//! The stages of static groups: recorded once, executed by passes.

use super::super::context::FrameContext;
use super::super::stage::StageJob;
use crate::backend::Backend;
use crate::graph::NodeError;

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
