//! Frames on the software backend, which need no graphics adapter.

mod drawn;
mod generated;
mod light_sums;
mod mip_levels;
mod refused;
mod same_bytes;
mod sampled_histories;

use std::sync::Arc;

use drawloom::backend::{Picture, SoftwareBackend, SoftwareSubmission};
use drawloom::process::{Deferred, Fxaa, ToneMapping};
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::{Granularity, Renderer, RendererBuilder, Submitter};

/// A renderer on the software backend.
struct Fixture {
    renderer: Renderer<SoftwareBackend>,
    submitter: Submitter<SoftwareBackend>,
}

impl Fixture {
    /// In f32, with this number of workers.
    fn new(
        workers: usize,
        build: impl FnOnce(RendererBuilder<SoftwareBackend>) -> RendererBuilder<SoftwareBackend>,
    ) -> Self {
        let scheduler = Arc::new(Scheduler::new(workers).unwrap());
        let backend = SoftwareBackend::new(Arc::clone(&scheduler));
        let (renderer, submitter) = build(Renderer::builder(backend)).build(scheduler).unwrap();
        Self { renderer, submitter }
    }

    /// The shipped processes in f32.
    fn with_granularity(workers: usize, granularity: Granularity) -> Self {
        Self::new(workers, |builder| builder.pipeline(deferred()).granularity(granularity))
    }

    /// The shipped processes in f64.
    fn reference() -> Self {
        let scheduler = Arc::new(Scheduler::new(2).unwrap());
        let builder = Renderer::builder(SoftwareBackend::reference()).pipeline(deferred());
        let (renderer, submitter) = builder.build(scheduler).unwrap();
        Self { renderer, submitter }
    }

    fn draw(&mut self, scene: &Scene) -> SoftwareSubmission {
        let recorded = self.renderer.record(scene.as_scene_ref()).unwrap();
        self.submitter.submit(recorded).unwrap().submission
    }

    fn picture(&mut self, scene: &Scene) -> Picture {
        self.draw(scene).read(0, "picture").unwrap()
    }
}

/// All shipped processes, with small shadow maps.
fn deferred() -> Deferred {
    let maps = ShadowMaps { side: 100, ..ShadowMaps::default() };
    Deferred::new().shadow_maps(Some(maps)).post(ToneMapping::default()).post(Fxaa::default())
}

/// Red, green and blue of a pixel.
fn pixel(picture: &Picture, x: u32, y: u32) -> [u8; 3] {
    let start = (y as usize * picture.width as usize + x as usize) * 4;
    [picture.bytes[start], picture.bytes[start + 1], picture.bytes[start + 2]]
}
