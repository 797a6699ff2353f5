//! A renderer of this crate.

use std::error::Error;
use std::sync::Arc;

use drawloom::backend::{WgpuBackend, WgpuSubmission};
use drawloom::quality::Quality;
use drawloom::task::Scheduler;
use drawloom::timeline::TuningSubject;
use drawloom::{FrameStatistics, Renderer, Submitter};
use drawloom_benches::backends::BackendName;
use drawloom_benches::plain::Plain;
use drawloom_benches::stopwatch::{FrameTime, timed_frame};

use crate::walk::Walk;

/// A renderer and the walk that it draws.
pub struct DrawloomRenderer {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    world: Walk,
    /// Of the last frame.
    pub statistics: FrameStatistics,
}

impl DrawloomRenderer {
    /// # Errors
    /// Returns an error if the renderer cannot be built.
    pub fn new(backend: BackendName, workers: usize, quality: Quality, world: Walk) -> Result<Self, Box<dyn Error>> {
        let builder = Renderer::builder(backend.open()?).process(Plain).output("plain").quality(quality);
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(workers)?))?;
        Ok(Self { renderer, submitter, world, statistics: FrameStatistics::default() })
    }

    /// Draws a frame of the walk, and waits until the device has drawn it. The camera stands still unless it `moves`.
    ///
    /// # Errors
    /// Returns an error if the frame cannot be drawn.
    pub fn frame(&mut self, moves: bool) -> Result<FrameTime, Box<dyn Error>> {
        if moves {
            self.world.step();
        }
        let scene = self.world.as_scene_ref();
        let (submitted, time) = timed_frame(&mut self.renderer, &self.submitter, scene, WgpuSubmission::wait)?;
        self.statistics = submitted.statistics;
        Ok(time)
    }

    /// Whether the last frame tested for occlusion.
    pub fn has_tested(&self) -> bool {
        let mut tests =
            self.statistics.tuning.choices.iter().filter(|choice| choice.subject == TuningSubject::OcclusionTest);
        tests.any(|choice| choice.alternatives[choice.chosen].name == "on")
    }
}
