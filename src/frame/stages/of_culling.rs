//! The stages of culling beyond the view frustum (S 9.6).

use super::context::FrameContext;
use super::stage::StageJob;
use crate::backend::Backend;
use crate::command::Selection;
use crate::graph::NodeError;
use crate::scene::Blend;
use crate::view::DrawFilter;

pub(super) fn one_if_testing<B: Backend>(frame: &FrameContext<'_, B>, view: usize) -> usize {
    usize::from(frame.tables.culling.occlusion[view].is_on())
}

/// Chooses the visible objects that may occlude others.
pub(super) fn choose_occluders<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let (tables, scene) = (frame.tables, frame.request.scene);
    let selections = frame.occlusion.occluders(job.of);
    let occlusion = &tables.culling.occlusion[job.of].occlusion;
    occlusion.select_occluders(
        scene,
        &tables.objects,
        &tables.visibility[job.of].set,
        &tables.culling.occluder_meshes,
        |object, draw| {
            let blend = draw.state.blend();
            let is_drawn = |selection: &Selection| {
                selection.contains(blend, draw.material)
                    && DrawFilter::new(&tables.objects, scene, *selection).passes(object)
            };
            // Only the mesh itself is known to cover its convex parts, and a mask has holes.
            let is_whole =
                !draw.state.is_masked() && frame.levels_of_detail(job.of).is_none_or(|levels| levels.get(object) == 0);
            blend == Blend::None && is_whole && selections.iter().any(is_drawn)
        },
    );
    Ok(())
}

/// The strips of the view's coarse depth buffer: rows of blocks of tiles.
pub(super) fn depth_strips<B: Backend>(frame: &FrameContext<'_, B>, view: usize) -> usize {
    let occlusion = &frame.tables.culling.occlusion[view];
    if occlusion.is_on() { occlusion.occlusion.strip_count() } else { 0 }
}

/// Draws the occluders into the view's coarse depth buffer. An item is a strip.
pub(super) fn draw_occluders<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    job.items.for_each(|strip| frame.tables.culling.occlusion[job.of].occlusion.draw_occluders(strip));
    Ok(())
}

pub(super) fn objects_if_testing<B: Backend>(frame: &FrameContext<'_, B>, view: usize) -> usize {
    if frame.tables.culling.occlusion[view].is_on() { frame.tables.objects.len() } else { 0 }
}

/// Tests the visible objects against the coarse depth buffer, and removes the hidden ones.
pub(super) fn test_occlusion<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let occlusion = &frame.tables.culling.occlusion[job.of];
    let hidden_of =
        |first, visible| occlusion.occlusion.hidden(frame.request.scene, &frame.tables.objects, first, visible);
    occlusion.add_hidden(frame.tables.visibility[job.of].set.remove_hidden(job.items, hidden_of));
    Ok(())
}

/// The draws of meshes with triangle culling.
pub(super) fn cullable_draws<B: Backend>(frame: &FrameContext<'_, B>, pass: usize) -> usize {
    frame.tables.passes[pass].triangles.read().len()
}

/// Culls the triangles of meshes with triangle culling (S 9.6).
pub(super) fn cull_triangles<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let table = &frame.tables.passes[job.of];
    let view = &frame.request.views[frame.view_index_of(job.of)];
    table.triangles.read().cull(job.items, view, frame.request.scene, &table.list.read());
    Ok(())
}

/// Leaves culled triangles out of the draw list.
pub(super) fn remove_culled<B: Backend>(frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), NodeError> {
    let table = &frame.tables.passes[job.of];
    table.triangles.read().apply(&mut table.list.write());
    Ok(())
}
