//! A renderer's turns.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{WgpuBackend, WgpuSubmission};
use drawloom::process::Deferred;
use drawloom::task::Scheduler;
use drawloom::timeline::Run;
use drawloom::view::ShadowMaps;
use drawloom::{Renderer, RendererBuilder, Submitter};
use drawloom_benches::moving::Moving;
use drawloom_benches::stopwatch::timed_frame;

use crate::world::{PICTURE, VIEWS};

/// Somebody who draws.
pub struct Painter {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
}

/// What a turn took, in seconds a frame.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    pub frame: f64,
    /// How much of it the world was held.
    pub held: f64,
}

impl Painter {
    /// # Errors
    /// If there is no such renderer.
    pub fn new(backend: WgpuBackend, scheduler: &Arc<Scheduler>, instancing: bool) -> Result<Self, Box<dyn Error>> {
        let shadow_maps = Some(ShadowMaps { side: PICTURE, ..ShadowMaps::default() });
        let builder: RendererBuilder<_> =
            Renderer::builder(backend).deferred(Deferred::to_picture().shadow_maps(shadow_maps));
        let (renderer, submitter) = builder.instancing(instancing).build(Arc::clone(scheduler))?;
        Ok(Self { renderer, submitter })
    }

    /// As many frames as take so long, and one at least.
    ///
    /// # Errors
    /// If a frame cannot be drawn, or a view does not see all there is.
    pub fn turn(&mut self, world: &mut Moving, least: Duration) -> Result<Turn, Box<dyn Error>> {
        let (mut elapsed, mut held, mut frames) = (Duration::ZERO, Duration::ZERO, 0);
        while frames == 0 || elapsed < least {
            world.step();
            let scene = world.as_scene_ref();
            let Self { renderer, submitter } = self;
            let (submitted, time) = timed_frame(renderer, submitter, scene, WgpuSubmission::wait)?;
            let seen = submitted.statistics.views.iter().map(|view| view.visible);
            if !seen.clone().eq([scene.object_count(); VIEWS]) {
                let seen: Vec<_> = seen.collect();
                return Err(format!("of {} objects, views see {seen:?}", scene.object_count()).into());
            }
            elapsed += time.processor;
            held += time.held;
            frames += 1;
        }
        let share = |time: Duration| time.as_secs_f64() / f64::from(frames);
        Ok(Turn { frame: share(elapsed), held: share(held) })
    }

    /// What of a frame goes before and after its jobs, in seconds: a part of `record`, and `submit`.
    ///
    /// # Errors
    /// If the frame cannot be drawn.
    pub fn serial_part(&mut self, world: &mut Moving) -> Result<f64, Box<dyn Error>> {
        world.step();
        let timeline = Arc::clone(self.renderer.scheduler().timeline());
        timeline.start();
        let recorded = self.renderer.record(world.as_scene_ref())?;
        let submitted = self.submitter.submit(recorded)?;
        timeline.stop();
        submitted.submission.wait()?;
        let log = timeline.take();
        let in_runs: Duration = log.runs.iter().map(Run::took).sum();
        let in_spans: Duration = log.spans.iter().map(|span| span.ended - span.began).sum();
        Ok((in_spans - in_runs).as_secs_f64())
    }
}
