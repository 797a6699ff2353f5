//! The techniques of this crate: one process with the same targets and the same picture as the other techniques.

use std::sync::Arc;

use drawloom::backend::{Backend, WgpuBackend, WgpuSubmission};
use drawloom::process::{ClearColor, CommandDraws, Declare, Draws, Format, RenderProcess};
use drawloom::scene::SceneRef;
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};

use crate::pictures;
use crate::technique::{Failure, Technique};

pub struct Drawloom {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    last: Option<WgpuSubmission>,
    drawn: usize,
}

impl Drawloom {
    pub fn new(backend: WgpuBackend, workers: usize, instancing: bool) -> Result<Self, Failure> {
        let (renderer, submitter) = renderer(backend, workers, instancing)?;
        Ok(Self { renderer, submitter, last: None, drawn: 0 })
    }
}

/// A renderer with this process, on any backend.
pub fn renderer<B: Backend>(
    backend: B,
    workers: usize,
    instancing: bool,
) -> Result<(Renderer<B>, Submitter<B>), Failure> {
    let builder = Renderer::builder(backend).process(Surfaces).output(COLOR).instancing(instancing);
    Ok(builder.build(Arc::new(Scheduler::new(workers)?))?)
}

impl Technique for Drawloom {
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<(), Failure> {
        let recorded = self.renderer.record(scene)?;
        let submitted = self.submitter.submit(recorded)?;
        self.drawn = submitted.statistics.views.iter().map(|view| view.visible).sum();
        self.last = Some(submitted.submission);
        Ok(())
    }

    fn wait(&mut self) -> Result<(), Failure> {
        Ok(self.last.as_ref().map_or(Ok(()), WgpuSubmission::wait)?)
    }

    fn drawn(&self) -> usize {
        self.drawn
    }

    fn picture(&mut self, camera: usize) -> Result<Vec<u8>, Failure> {
        let texture = self.last.as_ref().and_then(|submission| Some(submission.texture(camera, COLOR).ok()?.0));
        let backend = self.renderer.backend();
        pictures::read(backend.device(), backend.queue(), texture.ok_or("no frame was drawn")?)
    }
}

const COLOR: &str = "color";

struct Surfaces;

impl RenderProcess for Surfaces {
    fn name(&self) -> &str {
        "surfaces"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color(COLOR, Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.clears_depth("depth", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            shader: include_str!("surface.wgsl"),
            fragment: Some("fragment"),
            ..CommandDraws::default()
        })
    }
}
