//! Draws frames of what the demonstration content makes.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::NullBackend;
use drawloom::process::Deferred;
use drawloom::scene::SceneRef;
use drawloom::task::Scheduler;

/// Draws a frame of the scene.
///
/// # Panics
/// If the scene has an invalid camera, or a light or object that is left out.
pub(super) fn draw_whole(scene: SceneRef<'_>) {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture());
    let (mut renderer, submitter) = builder.build(scheduler).unwrap();
    let submitted = submitter.submit(renderer.record(scene).unwrap()).unwrap();
    assert!(submitted.statistics.scene_issues.is_empty(), "{:?}", submitted.statistics.scene_issues);
}
