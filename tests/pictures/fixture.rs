//! A renderer and its submitter on the machine's adapter.

use std::sync::Arc;

use drawloom::backend::{Picture, SoftwareBackend, WgpuBackend, WgpuSubmission};
use drawloom::process::Deferred;
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom::{RecordedFrame, Renderer, RendererBuilder, Submitter, wgpu};
use drawloom_testing::adapter;
use half::f16;
use libtest_mimic::Failed;

/// The device of this thread's cases: see [`adapter::shared_device`].
pub fn device() -> Result<(wgpu::Device, wgpu::Queue), Failed> {
    Ok(adapter::shared_device()?)
}

/// A backend on that device, with all pipelines that cases on it have compiled.
pub fn backend() -> Result<WgpuBackend, Failed> {
    Ok(adapter::shared_backend()?)
}

/// A renderer and its submitter.
pub struct Fixture {
    pub renderer: Renderer<WgpuBackend>,
    pub submitter: Submitter<WgpuBackend>,
}

impl Fixture {
    /// The shipped processes on two workers.
    pub fn new() -> Result<Self, Failed> {
        Self::with(2, |builder| builder.pipeline(Deferred::to_picture()))
    }

    /// With other render processes or settings.
    pub fn with(
        workers: usize,
        build: impl FnOnce(RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend>,
    ) -> Result<Self, Failed> {
        Self::on_backend(backend()?, workers, build)
    }

    /// On another device.
    pub fn on(
        (device, queue): (wgpu::Device, wgpu::Queue),
        workers: usize,
        build: impl FnOnce(RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend>,
    ) -> Result<Self, Failed> {
        Self::on_backend(WgpuBackend::new(device, queue)?, workers, build)
    }

    /// With other render processes or settings, and with transient targets.
    pub fn with_transient_targets(
        workers: usize,
        build: impl FnOnce(RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend>,
    ) -> Result<Self, Failed> {
        Self::on_backend(backend()?.transient_targets(), workers, build)
    }

    /// On a backend.
    pub fn on_backend(
        backend: WgpuBackend,
        workers: usize,
        build: impl FnOnce(RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend>,
    ) -> Result<Self, Failed> {
        let scheduler = Arc::new(Scheduler::new(workers)?);
        let (renderer, submitter) = build(Renderer::builder(backend)).build(scheduler)?;
        Ok(Self { renderer, submitter })
    }

    pub fn record(&mut self, scene: &Scene) -> Result<RecordedFrame<WgpuBackend>, Failed> {
        Ok(self.renderer.record(scene.as_scene_ref())?)
    }

    pub fn submit(&self, recorded: RecordedFrame<WgpuBackend>) -> Result<WgpuSubmission, Failed> {
        Ok(self.submitter.submit(recorded)?.submission)
    }

    /// The first view's picture.
    pub fn draw(&mut self, scene: &Scene) -> Result<Picture, Failed> {
        let recorded = self.record(scene)?;
        Ok(self.submit(recorded)?.read(0, "picture")?)
    }
}

/// The picture of a scene, drawn by the shipped processes.
pub fn draw(scene: &Scene) -> Result<Picture, Failed> {
    Fixture::new()?.draw(scene)
}

/// The first view's target of this name, drawn by a software backend.
pub fn draw_on_processor(
    (backend, scheduler): (SoftwareBackend, Arc<Scheduler>),
    deferred: Deferred,
    scene: &Scene,
    target: &str,
) -> Result<Picture, Failed> {
    let (mut renderer, submitter) = Renderer::builder(backend).pipeline(deferred).build(scheduler)?;
    Ok(submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission.read(0, target)?)
}

/// Red, green and blue of a pixel.
pub fn pixel(picture: &Picture, x: u32, y: u32) -> [u8; 3] {
    let start = (y as usize * picture.width as usize + x as usize) * 4;
    [picture.bytes[start], picture.bytes[start + 1], picture.bytes[start + 2]]
}

/// Red, green and blue of every pixel of a view's `radiance`, which is in half floats.
pub fn radiance(submission: &WgpuSubmission, view: usize) -> Result<Vec<[f64; 3]>, Failed> {
    Ok(half_floats(&submission.read(view, "radiance")?))
}

/// Red, green and blue of every pixel of a picture in half floats.
pub fn half_floats(picture: &Picture) -> Vec<[f64; 3]> {
    let channel = |bytes: &[u8]| f16::from_le_bytes([bytes[0], bytes[1]]).to_f64();
    let pixels = picture.bytes.chunks_exact(8);
    pixels.map(|pixel| [channel(&pixel[0..]), channel(&pixel[2..]), channel(&pixel[4..])]).collect()
}
