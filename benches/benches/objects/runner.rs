//! A renderer, and the times of its frames.

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
use drawloom_benches::stopwatch::{mean_frame, timed_frame};

use crate::world::{PICTURE, VIEWS};

/// A renderer with timed frames.
pub struct Runner {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
}

/// Mean times of several frames, in seconds.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub frame: f64,
    /// The part of the frame in which the world is borrowed.
    pub borrowed: f64,
}

impl Runner {
    /// # Errors
    /// Returns an error if the renderer cannot be built.
    pub fn new(backend: WgpuBackend, scheduler: &Arc<Scheduler>, instancing: bool) -> Result<Self, Box<dyn Error>> {
        let shadow_maps = Some(ShadowMaps { side: PICTURE, ..ShadowMaps::default() });
        let builder: RendererBuilder<_> =
            Renderer::builder(backend).deferred(Deferred::to_picture().shadow_maps(shadow_maps));
        let (renderer, submitter) = builder.instancing(instancing).build(Arc::clone(scheduler))?;
        Ok(Self { renderer, submitter })
    }

    /// Draws one frame, and more until they have taken `at_least`.
    ///
    /// # Errors
    /// Returns an error if a frame cannot be drawn, or if a view does not see all objects.
    pub fn sample(&mut self, world: &mut Moving, at_least: Duration) -> Result<Sample, Box<dyn Error>> {
        let (mut borrowed, mut frames) = (Duration::ZERO, 0);
        let frame = mean_frame(at_least, || {
            world.step();
            let scene = world.as_scene_ref();
            let Self { renderer, submitter } = self;
            let (submitted, time) = timed_frame(renderer, submitter, scene, WgpuSubmission::wait)?;
            let visible = submitted.statistics.views.iter().map(|view| view.visible);
            if !visible.clone().eq([scene.object_count(); VIEWS]) {
                let visible: Vec<_> = visible.collect();
                return Err(format!("of {} objects, views see {visible:?}", scene.object_count()).into());
            }
            borrowed += time.borrowed;
            frames += 1;
            Ok::<_, Box<dyn Error>>(time.cpu)
        })?;
        Ok(Sample { frame, borrowed: borrowed.as_secs_f64() / f64::from(frames) })
    }

    /// The time of a frame outside its jobs, in seconds: a part of `record`, and `submit`.
    ///
    /// # Errors
    /// Returns an error if the frame cannot be drawn.
    pub fn serial_part(&mut self, world: &mut Moving) -> Result<f64, Box<dyn Error>> {
        world.step();
        let timeline = Arc::clone(self.renderer.scheduler().timeline());
        timeline.start();
        let recorded = self.renderer.record(world.as_scene_ref())?;
        let submitted = self.submitter.submit(recorded)?;
        timeline.stop();
        submitted.submission.wait()?;
        let log = timeline.take();
        let in_runs: Duration = log.runs.iter().map(Run::duration).sum();
        let in_spans: Duration = log.spans.iter().map(|span| span.ended - span.began).sum();
        Ok((in_spans - in_runs).as_secs_f64())
    }
}
