//! Loops with several frames in flight: how many there are, what is told of each, and that its pictures are those of a
//! plain loop.

mod failures;
mod in_flight;
#[cfg(feature = "software")]
mod pictures;

use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{Backend, NullBackend};
use drawloom::process::Deferred;
use drawloom::task::Scheduler;
use drawloom::{Buffering, FrameLoop, Renderer, Submitter};
use drawloom_testing::simulated_device::SimulatedDevice;

/// Longer than anything here takes, also on a machine that is busy.
const LONG: Duration = Duration::from_secs(60);

fn renderer<B: Backend>(backend: B, workers: usize) -> (Renderer<B>, Submitter<B>) {
    let scheduler = Arc::new(Scheduler::new(workers).unwrap());
    Renderer::builder(backend).pipeline(Deferred::to_picture()).build(scheduler).unwrap()
}

/// A loop whose device takes a given time for a frame.
fn simulated(frame_time: Duration, buffering: Buffering) -> FrameLoop<SimulatedDevice<NullBackend>> {
    let (renderer, submitter) = renderer(SimulatedDevice::new(NullBackend, frame_time), 1);
    FrameLoop::new(renderer, submitter, buffering).unwrap()
}
