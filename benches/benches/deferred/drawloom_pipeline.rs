//! A pipeline of this crate.

use std::error::Error;

use drawloom::backend::{Picture, WgpuBackend, WgpuSubmission};
use drawloom::process::{Draws, targets};
use drawloom::scene::SceneRef;
use drawloom::{FrameStatistics, Renderer, Submitter};
use drawloom_benches::stopwatch::{FrameTime, timed_frame};

use crate::contender::{Contender, Counts};

pub struct DrawloomPipeline {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    statistics: FrameStatistics,
    submission: Option<WgpuSubmission>,
}

impl DrawloomPipeline {
    pub fn new(renderer: Renderer<WgpuBackend>, submitter: Submitter<WgpuBackend>) -> Self {
        Self { renderer, submitter, statistics: FrameStatistics::default(), submission: None }
    }
}

impl Contender for DrawloomPipeline {
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<FrameTime, Box<dyn Error>> {
        let (submitted, time) = timed_frame(&mut self.renderer, &self.submitter, scene, WgpuSubmission::wait)?;
        self.statistics = submitted.statistics;
        self.submission = Some(submitted.submission);
        Ok(time)
    }

    /// The draws are all batches of objects, and one for each process that draws lights. Every class of lights must be
    /// in view.
    fn counts(&self) -> Counts {
        let views = &self.statistics.views;
        let processes = self.renderer.plan().processes();
        let draws_lights = |draws: Draws<'_>| matches!(draws, Draws::Lights(_));
        let light_draws = processes.iter().filter(|planned| draws_lights(planned.process.draws())).count();
        Counts {
            views: views.len(),
            visible: views.first().map_or(0, |view| view.visible),
            lights: views.first().map_or(0, |view| view.lights),
            commands: views.iter().map(|view| view.commands).sum(),
            draws: views.iter().map(|view| view.batches).sum::<usize>() + light_draws,
            processes: processes.len(),
        }
    }

    fn picture(&self) -> Result<Picture, Box<dyn Error>> {
        let submission = self.submission.as_ref().ok_or("no frame was drawn")?;
        Ok(submission.read(0, targets::PICTURE)?)
    }
}
