//! Bevy: its forward renderer with `StandardMaterial`, set up without plugins that the scene does not need.

mod app;
mod device;
mod probe;
mod scene;

use std::time::{Duration, Instant};

use bevy_app::{App, AppLabel, SubApps};
use bevy_pbr::MeshUniform;
use bevy_render::RenderApp;
use bevy_render::render_resource::ShaderType;
use bevy_render::renderer::{RenderDevice, RenderQueue};
use drawloom::wgpu;
use drawloom_benches::backends::BackendName;

use crate::contender::{Contender, Failure, FrameTime, timed_frame};
use crate::layout::Layout;
use crate::pictures;
use probe::Probe;

/// How systems are scheduled, where objects are culled, and where a frame is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Bevy's default: systems run in parallel, the CPU culls, and `app.update()` renders.
    Default,
    /// The systems of each world run one after the other, but share their loops with the task pool.
    SerialSchedules,
    /// Serial schedules, and all objects have the component `NoCpuCulling`: the device alone culls.
    DeviceCulling,
    /// Serial schedules and `PipelinedRenderingPlugin`: a frame is rendered while the next one is simulated.
    Pipelined,
}

impl Mode {
    pub fn name(self) -> &'static str {
        match self {
            Self::Default => "bevy",
            Self::SerialSchedules => "bevy-serial-schedules",
            Self::DeviceCulling => "bevy-device-culling",
            Self::Pipelined => "bevy-pipelined",
        }
    }

    fn has_serial_schedules(self) -> bool {
        self != Self::Default
    }

    fn is_pipelined(self) -> bool {
        self == Self::Pipelined
    }
}

/// What Bevy has for each object of each camera in one buffer.
pub fn bytes_per_object() -> u64 {
    MeshUniform::min_size().get()
}

/// A Bevy app.
pub struct Bevy {
    app: App,
    mode: Mode,
    device: RenderDevice,
    queue: RenderQueue,
    targets: Vec<wgpu::Texture>,
    probe: Probe,
}

/// The longest time in which shaders are loaded, pipelines are created, and meshes are prepared. Nothing moves
/// meanwhile. On a busy machine a million objects take minutes.
const WARM_UP: Duration = Duration::from_mins(10);
/// Frames of a pipelined burst for each frame of another: it has one time only.
const PIPELINED_FRAMES: u32 = 8;

impl Bevy {
    /// # Errors
    /// Returns an error if no device can be created.
    pub fn new(backend: BackendName, layout: &Layout, mode: Mode, threads: usize) -> Result<Self, Failure> {
        let resources = device::open(backend)?;
        let (device, queue) = (resources.0.clone(), resources.1.clone());
        let probe = Probe::default();
        let mut targets = Vec::new();
        let mut app = app::new(resources, mode, threads, &probe, |world| {
            targets = scene::spawn(world, layout, mode, &device);
        });
        let start = Instant::now();
        loop {
            probe.count();
            app.update();
            probe.wait()?;
            let drawn = probe.drawn();
            if drawn.as_ref().is_ok_and(|drawn| *drawn == vec![layout.objects; layout.cameras]) {
                break;
            }
            if start.elapsed() > WARM_UP {
                return Err(format!("Bevy draws {:?} objects instead of {}", drawn?, layout.objects).into());
            }
        }
        scene::start(app.world_mut());
        Ok(Self { app, mode, device, queue, targets, probe })
    }

    /// Frames of a pipelined app overlap. Their time is that from the first submit to the last one, so the burst's
    /// start and its end, where only one world works, are not charged.
    fn pipelined_burst(&mut self, frames: u32) -> Result<FrameTime, Failure> {
        self.probe.start();
        let start = Instant::now();
        for _ in 0..frames {
            self.app.update();
        }
        self.wait()?;
        let drawn = start.elapsed().as_secs_f64() / f64::from(frames);
        let submitted = self.probe.elapsed().as_secs_f64() / f64::from(frames - 1);
        Ok(FrameTime { submitted, parts: None, drawn })
    }
}

impl Contender for Bevy {
    fn name(&self) -> &'static str {
        self.mode.name()
    }

    fn color(&self) -> usize {
        1 + self.mode as usize
    }

    fn adapter(&self) -> wgpu::AdapterInfo {
        self.device.wgpu_device().adapter_info()
    }

    fn frame(&mut self) -> Result<[f64; 3], Failure> {
        let start = Instant::now();
        if self.mode.is_pipelined() {
            self.app.update();
            return Ok([start.elapsed().as_secs_f64(), 0.0, 0.0]);
        }
        // As `App::update` does it.
        let SubApps { main, sub_apps } = self.app.sub_apps_mut();
        let render = sub_apps.get_mut(&RenderApp.intern()).ok_or("there is no render world")?;
        main.run_default_schedule();
        let main_end = Instant::now();
        render.extract(main.world_mut());
        let extract_end = Instant::now();
        render.update();
        main.world_mut().clear_trackers();
        Ok([main_end - start, extract_end - main_end, extract_end.elapsed()].map(|part| part.as_secs_f64()))
    }

    fn wait(&mut self) -> Result<(), Failure> {
        self.probe.wait()?;
        self.device.wgpu_device().poll(wgpu::PollType::wait_indefinitely())?;
        Ok(())
    }

    fn counted_frame(&mut self) -> Result<Vec<usize>, Failure> {
        self.probe.count();
        self.frame()?;
        self.wait()?;
        self.probe.drawn()
    }

    fn picture(&mut self, camera: usize) -> Result<Vec<u8>, Failure> {
        pictures::read(self.device.wgpu_device(), &self.queue, &self.targets[camera])
    }

    fn burst(&mut self, frames: u32) -> Result<Vec<FrameTime>, Failure> {
        if self.mode.is_pipelined() {
            return Ok(vec![self.pipelined_burst(PIPELINED_FRAMES * frames)?]);
        }
        (0..frames).map(|_| timed_frame(self)).collect()
    }
}
