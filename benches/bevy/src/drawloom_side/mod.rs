//! Drawloom: its deferred pipeline as shipped, with tone mapping and without shadow maps.

mod arrays;
mod assets;
mod entities;

use std::sync::Arc;
use std::time::Instant;

use drawloom::backend::{WgpuBackend, WgpuSubmission};
use drawloom::process::{Deferred, targets};
use drawloom::scene::SceneRef;
use drawloom::task::{JobPanic, Scheduler};
use drawloom::{FrameStatistics, Renderer, Submitter, wgpu};
use drawloom_benches::backends::BackendName;
use drawloom_testing::adapter;

use crate::contender::{Contender, Failure};
use crate::layout::Layout;
use crate::pictures;
use arrays::Arrays;
use entities::Entities;

/// Positions that one job moves: some microseconds of work.
const CHUNK: usize = 4096;

/// An engine's world.
trait World {
    /// Moves what moves in this frame.
    fn advance(&mut self, frame: u32, scheduler: &Scheduler) -> Result<(), JobPanic>;

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
    pub const NAME: &str = "drawloom";

    /// # Errors
    /// Returns an error if no device or renderer can be created.
    pub fn new(backend: BackendName, layout: &Layout, threads: usize) -> Result<Self, Failure> {
        let world: Box<dyn World> = match layout.has_entities {
            true => Box::new(Entities::new(layout)?),
            false => Box::new(Arrays::new(layout)?),
        };
        let scheduler = Arc::new(Scheduler::new(threads)?);
        let (device, queue) = match backend {
            // A graphics card with memory of its own: uploads are staged, as Bevy's always are.
            BackendName::Noop => adapter::noop_device_without(wgpu::Features::MAPPABLE_PRIMARY_BUFFERS)?,
            BackendName::Adapter => adapter::device_without_indirect_validation()?,
        };
        let (renderer, submitter) = Renderer::builder(WgpuBackend::new(device, queue)?)
            .pipeline(Deferred::to_picture().shadow_maps(None))
            .build(Arc::clone(&scheduler))?;
        let statistics = FrameStatistics::default();
        Ok(Self { world, scheduler, renderer, submitter, statistics, last: None, frame: 0 })
    }
}

impl Contender for Drawloom {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn color(&self) -> usize {
        5
    }

    fn adapter(&self) -> wgpu::AdapterInfo {
        self.renderer.backend().device().adapter_info()
    }

    fn frame(&mut self) -> Result<[f64; 3], Failure> {
        let Self { world, scheduler, renderer, submitter, statistics, last, frame } = self;
        let start = Instant::now();
        world.advance(*frame, scheduler)?;
        *frame += 1;
        let updated = Instant::now();
        let mut recorded = updated;
        world.lend(&mut |scene| {
            let frame = renderer.record(scene)?;
            recorded = Instant::now();
            let submitted = submitter.submit(frame)?;
            *statistics = submitted.statistics;
            *last = Some(submitted.submission);
            Ok(())
        })?;
        Ok([updated - start, recorded - updated, recorded.elapsed()].map(|part| part.as_secs_f64()))
    }

    fn wait(&mut self) -> Result<(), Failure> {
        Ok(self.last.as_ref().map_or(Ok(()), WgpuSubmission::wait)?)
    }

    fn counted_frame(&mut self) -> Result<Vec<usize>, Failure> {
        self.frame()?;
        self.wait()?;
        Ok(self.statistics.views.iter().map(|view| view.visible - view.occluded).collect())
    }

    fn picture(&mut self, camera: usize) -> Result<Vec<u8>, Failure> {
        let texture = self.last.as_ref().and_then(|submission| Some(submission.texture(camera, targets::PICTURE).ok()?.0));
        let backend = self.renderer.backend();
        pictures::read(backend.device(), backend.queue(), texture.ok_or("no frame was drawn")?)
    }
}
