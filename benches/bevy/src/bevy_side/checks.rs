//! Whether Bevy draws what it is asked to draw.

use std::any::TypeId;

use bevy_app::App;
use bevy_camera::Camera;
use bevy_camera::visibility::{ViewVisibility, VisibleEntities};
use bevy_core_pipeline::core_3d::Opaque3d;
use bevy_ecs::query::With;
use bevy_ecs::world::World;
use bevy_mesh::Mesh3d;
use bevy_render::RenderApp;
use bevy_render::render_phase::ViewBinnedRenderPhases;
use bevy_render::render_resource::{CachedPipelineState, PipelineCache};

use super::Mode;
use super::scene::Moving;
use crate::contender::Failure;
use crate::layout::Layout;

/// The number of objects that the main world extracts for the cameras. If the device culls, each camera gets every object.
pub fn visible_objects(world: &mut World, layout: &Layout, mode: Mode) -> usize {
    if mode == Mode::DeviceCulling {
        let mut objects = world.query_filtered::<&ViewVisibility, With<Moving>>();
        return layout.cameras * objects.iter(world).filter(|visibility| visibility.get()).count();
    }
    let mut cameras = world.query_filtered::<&VisibleEntities, With<Camera>>();
    cameras.iter(world).map(|visible| visible.get(TypeId::of::<Mesh3d>()).len()).sum()
}

/// Checks that all pipelines exist, and that every camera has opaque objects to draw. A pipelined app's render world belongs to another
/// thread, and is not checked.
///
/// # Errors
/// Returns an error if a draw is left out.
pub fn check_render_world(app: &App, layout: &Layout) -> Result<(), Failure> {
    let Some(render_app) = app.get_sub_app(RenderApp) else { return Ok(()) };
    let world = render_app.world();
    for pipeline in world.resource::<PipelineCache>().pipelines() {
        match &pipeline.state {
            CachedPipelineState::Ok(_) => {}
            CachedPipelineState::Err(error) => return Err(format!("a pipeline of Bevy is invalid: {error}").into()),
            CachedPipelineState::Queued | CachedPipelineState::Creating(_) => {
                return Err("a pipeline of Bevy is not ready".into());
            }
        }
    }
    let phases = world.resource::<ViewBinnedRenderPhases<Opaque3d>>();
    let drawing = phases.values().filter(|phase| !phase.is_empty()).count();
    if drawing != layout.cameras {
        return Err(format!("of {} cameras, {drawing} draw objects", layout.cameras).into());
    }
    Ok(())
}
