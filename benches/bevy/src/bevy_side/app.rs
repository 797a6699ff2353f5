//! The app: the plugins that a lit 3D scene without a window needs.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use bevy_app::{App, TaskPoolOptions, TaskPoolPlugin, TaskPoolThreadAssignmentPolicy, Update};
use bevy_asset::AssetPlugin;
use bevy_camera::CameraPlugin;
use bevy_core_pipeline::CorePipelinePlugin;
use bevy_diagnostic::FrameCountPlugin;
use bevy_ecs::schedule::IntoScheduleConfigs;
use bevy_image::ImagePlugin;
use bevy_light::LightPlugin;
use bevy_mesh::MeshPlugin;
use bevy_pbr::PbrPlugin;
use bevy_render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy_render::settings::{RenderCreation, RenderResources};
use bevy_render::{Render, RenderApp, RenderPlugin, RenderSystems};
use bevy_time::TimePlugin;
use bevy_transform::TransformPlugin;
use bevy_window::{ExitCondition, WindowPlugin};

use super::{Mode, scene};

/// An app that renders on the device of `resources`, and counts the frames that it has submitted in `rendered`.
///
/// The task pools belong to the process, so the first app determines their threads.
pub fn new(resources: RenderResources, mode: Mode, threads: usize, rendered: Arc<AtomicUsize>) -> App {
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
    if mode == Mode::Pipelined {
        app.add_plugins(PipelinedRenderingPlugin);
    }
    app.add_plugins((
        CorePipelinePlugin,
        PbrPlugin { prepass_enabled: false, add_default_deferred_lighting_plugin: false, ..PbrPlugin::default() },
    ));
    app.add_systems(Update, scene::advance);
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        let count = move || {
            rendered.fetch_add(1, Ordering::Release);
        };
        render_app.add_systems(Render, count.after(RenderSystems::Render));
    }
    app
}

/// As many compute threads as Drawloom has workers. The thread that calls `update` waits for them while systems run on them. The
/// other pools have nothing to do here; each must have a thread.
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
        compute: exactly(threads),
        ..TaskPoolOptions::default()
    }
}
