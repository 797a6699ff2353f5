//! An engine that draws the world, and accounts for each fault.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use drawloom::backend::{BackendError, StreamingBudget, WgpuBackend};
use drawloom::process::{Declare, Deferred, Draws, FullScreen, RenderProcess, ToneMapping};
use drawloom::quality::Quality;
use drawloom::scene::SceneRef;
use drawloom::task::Scheduler;
use drawloom::{Buffering, FinishedFrame, FrameError, FrameInputs, FrameLoop, FrameLoopError, Renderer};
use drawloom_async_post::{AsyncPost, Bloom, LayerSettings};
use drawloom_testing::adapter;
use drawloom_testing::fault_injection::{CallKind, Fault, FaultyBackend};
use drawloom_testing::random::Random;

use crate::nodes::{Movement, Sparks};
use crate::world::World;

/// For the watchdog.
static FRAMES: AtomicU64 = AtomicU64::new(0);

pub fn frames_so_far() -> u64 {
    FRAMES.load(Ordering::Relaxed)
}

/// What a planned panic says.
const PLANNED: &str = "as planned";

/// Planned panics, of the test and of wgpu about devices that are lost on purpose, do not reach the console.
pub fn hide_planned_panics() {
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        let payload = info.payload();
        let text =
            payload.downcast_ref::<&str>().copied().or_else(|| payload.downcast_ref::<String>().map(String::as_str));
        if !text.is_some_and(|text| text.contains(PLANNED) || text.contains("fault")) {
            hook(info);
        }
    }));
}

/// How often what happened.
#[derive(Debug, Default)]
pub struct Totals {
    pub frames: u64,
    pub faults: u64,
    pub panics: u64,
    pub losses: u64,
    pub resizes: u64,
    pub qualities: u64,
    pub bufferings: u64,
    /// The frames in which a view draws a static group as a whole.
    pub static_groups: u64,
    /// The frames that show a result of asynchronous post-processing.
    pub results: u64,
}

/// Draws nothing into a picture, or panics.
struct MayPanic {
    panics: Arc<AtomicBool>,
}

impl RenderProcess for MayPanic {
    fn name(&self) -> &str {
        "may panic"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.draws_over("picture");
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        assert!(!self.panics.swap(false, Ordering::Relaxed), "{PLANNED}");
        Draws::FullScreen(FullScreen {
            shader: "@fragment fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> { return vec4<f32>(0.0); }",
            ..FullScreen::default()
        })
    }
}

type SoakLoop = FrameLoop<FaultyBackend<WgpuBackend>>;

/// Draws the world.
pub struct Engine {
    frames: SoakLoop,
    world: World,
    /// Computes a bloom on the workers, while the device draws.
    bloom: AsyncPost,
    sparks: Sparks,
    panics: Arc<AtomicBool>,
    in_flight: usize,
    totals: Totals,
}

/// Streams meshes and textures, with less room for textures than the largest world needs.
fn open() -> FaultyBackend<WgpuBackend> {
    let (device, queue) = adapter::noop_device().unwrap();
    let budget = StreamingBudget { mesh_bytes: 1 << 20, texture_bytes: 1 << 20, ..StreamingBudget::default() };
    FaultyBackend::new(WgpuBackend::new(device, queue).unwrap().stream_resources(budget).unwrap())
}

impl Engine {
    pub fn new() -> Self {
        let panics = Arc::new(AtomicBool::new(false));
        let process = MayPanic { panics: Arc::clone(&panics) };
        let scheduler = Arc::new(Scheduler::new(2).unwrap());
        let glow = Bloom::default();
        let bloom = AsyncPost::new(Arc::clone(&scheduler), glow.on_cpu(), glow.source());
        let deferred = Deferred::new().post(bloom.layer(LayerSettings::default())).post(ToneMapping::default());
        let builder = Renderer::builder(open()).pipeline(deferred).process(process);
        let builder = builder.process(bloom.downsample().unwrap()).output(bloom.source_target());
        let (renderer, submitter) = builder.build(scheduler).unwrap();
        let frames = FrameLoop::new(renderer, submitter, Buffering::Double).unwrap();
        let (world, sparks) = (World::new(), Sparks::new());
        Self { frames, world, bloom, sparks, panics, in_flight: 0, totals: Totals::default() }
    }

    /// Changes the world or a setting, and draws a frame; now and then one in which something fails.
    pub fn frame(&mut self, random: &mut Random) {
        self.totals.resizes += u64::from(self.world.change(random));
        match random.below(400) {
            0 => {
                let fast = Quality { occlusion: Some(16), ..Quality::fast() };
                let quality = [fast, Quality::balanced(), Quality::exact()][random.below(3)];
                self.frames.renderer().set_quality(quality).unwrap();
                self.totals.qualities += 1;
            }
            1..5 => {
                let buffering = Buffering::ALL[random.below(3)];
                self.frames.set_buffering(buffering);
                self.totals.bufferings += 1;
            }
            5 | 6 => {
                self.panic_in_a_process();
                return;
            }
            7..12 => {
                self.fail(random);
                return;
            }
            _ => {}
        }
        self.draw().unwrap();
    }

    /// Draws a frame. Those that finished meanwhile have no error.
    fn draw(&mut self) -> Result<(), FrameError> {
        let (slot, finished) = self.frames.begin();
        self.in_flight -= finished.len();
        for frame in finished {
            frame.outcome.unwrap();
        }
        let mut positions = self.world.scene.as_scene_ref().positions.to_vec();
        let moving = self.world.moving_objects();
        let movement = Movement::new(&mut positions, &moving, self.totals.frames);
        let scene = SceneRef { written: movement.columns(), ..self.world.report(&moving) };
        self.bloom.begin_frame(self.frames.renderer(), scene.cameras);
        let recorded = self
            .frames
            .renderer()
            .record_with(FrameInputs { nodes: &[&movement, &self.sparks], ..FrameInputs::new(scene) });
        drop(movement);
        // A frame that fails was told of them too, and the next one need not be told again.
        self.world.forget_changes();
        let mut recorded = recorded?;
        self.bloom.read_back(&mut recorded);
        self.totals.static_groups += u64::from(recorded.statistics().views.iter().any(|view| view.static_groups > 0));
        self.totals.results += u64::from(self.bloom.statistics().iter().any(|view| view.result.is_some()));
        slot.submit(recorded);
        self.in_flight += 1;
        self.totals.frames += 1;
        FRAMES.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }

    /// Waits for the frames in flight, and returns their outcomes.
    fn drain(&mut self) -> Vec<FinishedFrame<FaultyBackend<WgpuBackend>>> {
        let mut all = Vec::new();
        while all.len() < self.in_flight {
            let (slot, finished) = self.frames.begin();
            all.extend(finished);
            drop(slot);
            if all.len() < self.in_flight {
                thread::sleep(Duration::from_micros(20));
            }
        }
        self.in_flight = 0;
        all
    }

    fn drain_without_errors(&mut self) {
        for frame in self.drain() {
            frame.outcome.unwrap();
        }
    }

    /// A process panics. That is the error of its frame, and of no other.
    fn panic_in_a_process(&mut self) {
        self.panics.store(true, Ordering::Relaxed);
        let error = self.draw().expect_err("the process panicked").to_string();
        assert!(error.contains(PLANNED) && error.contains("may panic"), "{error}");
        self.totals.panics += 1;
        self.draw().unwrap();
    }

    /// A call of the backend fails. That is the error of one frame, and of no other.
    fn fail(&mut self, random: &mut Random) {
        self.drain_without_errors();
        let faults = [
            Fault::DeviceLost,
            Fault::OutOfMemory,
            Fault::Validation,
            Fault::Limit,
            Fault::Panic,
            Fault::Delay(Duration::from_micros(200)),
        ];
        let fault = faults[random.below(faults.len())].clone();
        let is_delay = matches!(fault, Fault::Delay(_));
        let kind = CallKind::ALL[random.below(CallKind::ALL.len())];
        self.frames.renderer().backend().inject(kind, random.below(4), fault);
        let recorded = self.draw();
        let mut errors: Vec<Option<bool>> = Vec::new();
        if let Err(error) = &recorded {
            errors.push(error.backend_error().map(|error| matches!(error, BackendError::DeviceLost { .. })));
        }
        for frame in self.drain() {
            match frame.outcome {
                Ok(_) => {}
                Err(FrameLoopError::Submit(error)) => {
                    errors.push(error.backend_error().map(|error| matches!(error, BackendError::DeviceLost { .. })));
                }
                Err(error) => panic!("not a submission's error: {error}"),
            }
        }
        let backend = self.frames.renderer().backend();
        let came = backend.failed_call();
        backend.clear();
        let expected = usize::from(came.is_some() && !is_delay);
        assert_eq!(errors.len(), expected, "{came:?}: {errors:?}");
        self.totals.faults += u64::from(came.is_some());
        if errors.contains(&Some(true)) {
            self.replace_device();
        }
        self.draw().unwrap();
    }

    /// Another device takes the place of one that is lost.
    fn replace_device(&mut self) {
        self.frames.replace_backend(open());
        self.totals.losses += 1;
    }

    /// Makes everything as it was at first, and waits for all frames. Another quality drops the stage graphs of the
    /// latest worlds.
    pub fn rest(&mut self) {
        self.world.reset();
        for quality in [Quality::exact(), Quality::balanced()] {
            self.frames.renderer().set_quality(quality).unwrap();
        }
        self.frames.set_buffering(Buffering::Double);
        for _ in 0..150 {
            self.draw().unwrap();
        }
        self.drain_without_errors();
    }

    /// Ends the loop. Returns what happened.
    pub fn finish(mut self) -> Totals {
        self.drain_without_errors();
        std::mem::take(&mut self.totals)
    }
}
