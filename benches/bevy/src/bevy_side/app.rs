//! The app: the plugins that a lit 3D scene without a window needs.

use bevy_app::{App, TaskPoolOptions, TaskPoolPlugin, TaskPoolThreadAssignmentPolicy};
use bevy_asset::AssetPlugin;
use bevy_camera::CameraPlugin;
use bevy_core_pipeline::CorePipelinePlugin;
use bevy_diagnostic::FrameCountPlugin;
use bevy_ecs::schedule::{Schedules, SingleThreadedExecutor};
use bevy_ecs::world::World;
use bevy_image::ImagePlugin;
use bevy_light::LightPlugin;
use bevy_light::cluster::GlobalClusterSettings;
use bevy_mesh::MeshPlugin;
use bevy_pbr::PbrPlugin;
use bevy_render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy_render::settings::{RenderCreation, RenderResources};
use bevy_render::{ExtractSchedule, RenderApp, RenderPlugin};
use bevy_time::TimePlugin;
use bevy_transform::{StaticTransformOptimizations, TransformPlugin};
use bevy_window::{ExitCondition, WindowPlugin};

use super::probe::Probe;
use super::{Mode, scene};

/// An app that renders on the device of `resources`. `spawn` adds the scene.
///
/// The task pools belong to the process, so the first app determines their threads.
pub fn new(
    resources: RenderResources,
    mode: Mode,
    threads: usize,
    probe: &Probe,
    spawn: impl FnOnce(&mut World),
) -> App {
    let mut app = App::new();
    app.add_plugins((
        TaskPoolPlugin { task_pool_options: task_pools(threads) },
        FrameCountPlugin,
        TimePlugin,
        TransformPlugin,
        WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..WindowPlugin::default() },
        AssetPlugin::default(),
        RenderPlugin {
            render_creation: RenderCreation::Manual(Box::new(resources)),
            // No frame is drawn without its pipelines.
            synchronous_pipeline_compilation: true,
            ..RenderPlugin::default()
        },
        ImagePlugin::default(),
        MeshPlugin,
        CameraPlugin,
        LightPlugin,
    ));
    if mode.is_pipelined() {
        app.add_plugins(PipelinedRenderingPlugin);
    }
    app.add_plugins((
        CorePipelinePlugin,
        PbrPlugin { prepass_enabled: false, add_default_deferred_lighting_plugin: false, ..PbrPlugin::default() },
    ));
    // Objects have no children, so there are no trees to skip.
    app.insert_resource(StaticTransformOptimizations::Disabled);
    scene::add_systems(&mut app);
    spawn(app.world_mut());
    app.finish();
    // There are no lights to cluster.
    if let Some(mut settings) = app.world_mut().get_resource_mut::<GlobalClusterSettings>() {
        settings.gpu_clustering = None;
    }
    if mode.has_serial_schedules() {
        run_schedules_serially(app.world_mut());
    }
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        probe.add_to(render_app);
        if mode.has_serial_schedules() {
            run_schedules_serially(render_app.world_mut());
        }
    }
    app.cleanup();
    app
}

/// Runs the systems of a world on the calling thread. They still share loops with the task pool.
fn run_schedules_serially(world: &mut World) {
    let mut schedules = world.resource_mut::<Schedules>();
    for (_, schedule) in schedules.iter_mut() {
        schedule.set_executor(SingleThreadedExecutor::new());
    }
    // A new executor would apply the commands of extraction at once. Bevy applies them in the render world.
    if let Some(extract) = schedules.get_mut(ExtractSchedule) {
        extract.set_apply_final_deferred(false);
    }
}

/// The thread that calls `update` works for the pool while it waits. A pool of one thread does not share loops at all:
/// that is right for one worker, but two are a pool of two. The other pools have nothing to do here; each must have a
/// thread.
fn task_pools(threads: usize) -> TaskPoolOptions {
    let exactly = |threads| TaskPoolThreadAssignmentPolicy {
        min_threads: threads,
        max_threads: threads,
        percent: 1.0,
        on_thread_spawn: None,
        on_thread_destroy: None,
    };
    TaskPoolOptions {
        io: exactly(1),
        async_compute: exactly(1),
        compute: exactly(if threads == 1 { 1 } else { (threads - 1).max(2) }),
        ..TaskPoolOptions::default()
    }
}
