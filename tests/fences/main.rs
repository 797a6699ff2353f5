//! Fences between the CPU and a device (S 9.4).

mod frames;
mod table_9_1;

use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::NullBackend;
use drawloom::process::Deferred;
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom::{RecordedFrame, Renderer, Submitter};
use drawloom_testing::scenes::field;
use drawloom_testing::simulated_device::SimulatedDevice;

/// Longer than anything here takes, also on a machine that is busy.
const LONG: Duration = Duration::from_secs(60);

/// A renderer whose device takes a given time for a frame.
struct Fixture {
    scene: Scene,
    renderer: Renderer<SimulatedDevice<NullBackend>>,
    submitter: Submitter<SimulatedDevice<NullBackend>>,
}

impl Fixture {
    fn new(frame_time: Duration) -> Self {
        let backend = SimulatedDevice::new(NullBackend, frame_time);
        let scheduler = Arc::new(Scheduler::new(1).unwrap());
        let (renderer, submitter) =
            Renderer::builder(backend).pipeline(Deferred::to_picture()).build(scheduler).unwrap();
        Self { scene: field(20), renderer, submitter }
    }

    fn record(&mut self) -> RecordedFrame<SimulatedDevice<NullBackend>> {
        self.renderer.record(self.scene.as_scene_ref()).unwrap()
    }
}
