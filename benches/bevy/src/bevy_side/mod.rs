//! Bevy: its forward renderer with `StandardMaterial`, set up without plugins that the scene does not need.

mod app;
mod checks;
mod device;
mod scene;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use bevy_app::App;
use bevy_render::renderer::{RenderDevice, RenderQueue};
use drawloom::wgpu;
use drawloom_benches::backends::BackendName;

use crate::contender::{Contender, Failure, FrameTime, separate_frames};
use crate::layout::Layout;
use crate::pictures;

/// Where a frame's objects are culled, and where it is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Bevy's default: the CPU culls, in `app.update()`, which renders too.
    Default,
    /// All objects have the component `NoCpuCulling`: the device alone culls.
    DeviceCulling,
    /// As the default, but with `PipelinedRenderingPlugin`: a frame is rendered while the next one is simulated.
    Pipelined,
}

/// A Bevy app.
pub struct Bevy {
    app: App,
    mode: Mode,
    layout: Layout,
    device: RenderDevice,
    queue: RenderQueue,
    targets: Vec<wgpu::Texture>,
    /// The number of frames that the render world has submitted.
    rendered: Arc<AtomicUsize>,
    /// The number of frames that it will have submitted when it is idle.
    requested: usize,
}

/// Updates in which pipelines are created, assets are prepared, and the render world becomes ready.
const WARM_UP: usize = 8;
/// The longest time in which a pipelined frame is rendered.
const RENDER_TIMEOUT: Duration = Duration::from_secs(60);

impl Bevy {
    /// # Errors
    /// Returns an error if no device can be created.
    pub fn new(backend: BackendName, layout: &Layout, mode: Mode, threads: usize) -> Result<Self, Failure> {
        let resources = device::open(backend)?;
        let (device, queue) = (resources.0.clone(), resources.1.clone());
        let rendered = Arc::new(AtomicUsize::new(0));
        let mut app = app::new(resources, mode, threads, Arc::clone(&rendered));
        let targets = scene::spawn(app.world_mut(), layout, mode, &device);
        app.finish();
        app.cleanup();
        for _ in 0..WARM_UP {
            app.update();
            // Nothing tells how many of the first updates the render world skips, so a pipelined one gets time to finish.
            if mode == Mode::Pipelined {
                thread::sleep(Duration::from_millis(200));
            }
        }
        let requested = rendered.load(Ordering::Acquire);
        let mut bevy = Self { app, mode, layout: *layout, device, queue, targets, rendered, requested };
        bevy.wait()?;
        Ok(bevy)
    }

    /// Waits until the render world has submitted all frames.
    fn wait_for_render_world(&self) -> Result<(), Failure> {
        let start = Instant::now();
        while self.rendered.load(Ordering::Acquire) < self.requested {
            if start.elapsed() > RENDER_TIMEOUT {
                return Err("Bevy's render world does not finish its frame".into());
            }
            thread::yield_now();
        }
        Ok(())
    }
}

impl Contender for Bevy {
    fn name(&self) -> &'static str {
        match self.mode {
            Mode::Default => "bevy",
            Mode::DeviceCulling => "bevy, device culling",
            Mode::Pipelined => "bevy, pipelined",
        }
    }

    fn frame(&mut self) -> Result<(), Failure> {
        self.requested += 1;
        self.app.update();
        Ok(())
    }

    fn wait(&mut self) -> Result<(), Failure> {
        self.wait_for_render_world()?;
        self.device.wgpu_device().poll(wgpu::PollType::wait_indefinitely())?;
        Ok(())
    }

    fn drawn_objects(&mut self) -> Result<usize, Failure> {
        self.wait()?;
        checks::check_render_world(&self.app, &self.layout)?;
        Ok(checks::visible_objects(self.app.world_mut(), &self.layout, self.mode))
    }

    fn picture(&mut self, camera: usize) -> Result<Vec<u8>, Failure> {
        self.wait()?;
        pictures::read(self.device.wgpu_device(), &self.queue, &self.targets[camera])
    }

    /// Pipelined frames overlap, so their burst is timed as a whole, until its last frame is submitted.
    fn burst(&mut self, frames: u32) -> Result<FrameTime, Failure> {
        if self.mode != Mode::Pipelined {
            return separate_frames(self, frames);
        }
        let start = Instant::now();
        (0..frames).try_for_each(|_| self.frame())?;
        self.wait_for_render_world()?;
        let submitted = start.elapsed();
        self.wait()?;
        Ok(FrameTime::mean(submitted, start.elapsed(), frames))
    }
}
