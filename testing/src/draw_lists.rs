//! The sorted commands of a frame whose objects are ordered by depth.

use std::error::Error;
use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::NullBackend;
use drawloom::command::RenderCommand;
use drawloom::process::Deferred;
use drawloom::quality::Quality;
use drawloom::scene::Scene;
use drawloom::task::Scheduler;

/// The commands of each process of a deferred pipeline in each view, in the exact order, without empty lists.
///
/// # Errors
/// Returns an error if the frame cannot be drawn.
pub fn draw_lists(scene: &Scene) -> Result<Vec<Vec<RenderCommand>>, Box<dyn Error>> {
    let scheduler = Arc::new(Scheduler::new(1)?);
    let (mut renderer, submitter) =
        Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).quality(Quality::exact()).build(scheduler)?;
    let submitted = submitter.submit(renderer.record(scene.as_scene_ref())?)?;
    let passes = submitted.submission.passes.iter();
    let list = |process: &str, view| {
        renderer.draw_list(process, view).map(|list| list.commands().copied().collect::<Vec<_>>())
    };
    Ok(passes.filter_map(|pass| list(&pass.process, pass.view)).filter(|commands| !commands.is_empty()).collect())
}
