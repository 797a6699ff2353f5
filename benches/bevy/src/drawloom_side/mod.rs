//! Drawloom: its deferred pipeline as shipped, with tone mapping and without shadow maps.

mod arrays;
mod assets;
mod entities;

use std::sync::Arc;

use drawloom::backend::WgpuSubmission;
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::scene::SceneRef;
use drawloom::task::{JobPanic, Scheduler};
use drawloom::{FrameStatistics, Renderer, Submitter};
use drawloom_benches::backends::BackendName;

use crate::contender::{Contender, Failure};
use crate::layout::{self, Layout};
use crate::pictures;
use arrays::Arrays;
use entities::Entities;

type WgpuBackend = drawloom::backend::WgpuBackend;

/// Positions that one job moves: some microseconds of work.
const CHUNK: usize = 4096;

/// An engine's world.
trait World {
    /// Moves each object by `step`, in metres.
    fn advance(&mut self, step: DVec3, scheduler: &Scheduler) -> Result<(), JobPanic>;

    /// Lends the world to `draw`.
    fn lend(&mut self, draw: &mut dyn FnMut(SceneRef<'_>) -> Result<(), Failure>) -> Result<(), Failure>;
}

/// A renderer, and the world that it draws.
pub struct Drawloom {
    world: Box<dyn World>,
    scheduler: Arc<Scheduler>,
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    statistics: FrameStatistics,
    last: Option<WgpuSubmission>,
    frame: u32,
}

impl Drawloom {
    /// # Errors
    /// Returns an error if no device or renderer can be created.
    pub fn new(backend: BackendName, layout: &Layout, threads: usize) -> Result<Self, Failure> {
        let world: Box<dyn World> = match layout.has_entities {
            true => Box::new(Entities::new(layout)?),
            false => Box::new(Arrays::new(layout)?),
        };
        let scheduler = Arc::new(Scheduler::new(threads)?);
        let (renderer, submitter) = Renderer::builder(backend.open()?)
            .deferred(Deferred::to_picture().shadow_maps(None))
            .build(Arc::clone(&scheduler))?;
        let statistics = FrameStatistics::default();
        Ok(Self { world, scheduler, renderer, submitter, statistics, last: None, frame: 0 })
    }
}

impl Contender for Drawloom {
    fn name(&self) -> &'static str {
        "drawloom"
    }

    fn frame(&mut self) -> Result<(), Failure> {
        let Self { world, scheduler, renderer, submitter, statistics, last, frame } = self;
        world.advance(DVec3::from_array(layout::step(*frame)), scheduler)?;
        *frame += 1;
        world.lend(&mut |scene| {
            let submitted = submitter.submit(renderer.record(scene)?)?;
            *statistics = submitted.statistics;
            *last = Some(submitted.submission);
            Ok(())
        })
    }

    fn wait(&mut self) -> Result<(), Failure> {
        Ok(self.last.as_ref().map_or(Ok(()), WgpuSubmission::wait)?)
    }

    fn drawn_objects(&mut self) -> Result<usize, Failure> {
        Ok(self.statistics.views.iter().map(|view| view.visible - view.occluded).sum())
    }

    fn picture(&mut self, camera: usize) -> Result<Vec<u8>, Failure> {
        let texture = self.last.as_ref().and_then(|submission| submission.texture(camera, "picture"));
        let backend = self.renderer.backend();
        pictures::read(backend.device(), backend.queue(), texture.ok_or("no frame was drawn")?)
    }
}
