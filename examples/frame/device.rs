//! What is asked of the device as frames are drawn: to be done with each, and when it drew which pass.

use std::error::Error;

use drawloom::backend::{Backend, DeviceClock, DevicePassTimes, WgpuBackend, WgpuSubmission};
use drawloom::timeline::{DeviceLog, Timeline};

/// A backend's device, as frames are drawn.
pub trait Device<B: Backend> {
    /// The first frame that is recorded is about to be drawn.
    ///
    /// # Errors
    /// If the device refuses.
    fn start(&mut self, backend: &B, timeline: &Timeline) -> Result<(), Box<dyn Error>>;

    /// A frame was submitted, and has that number on the timeline if it is recorded: waits until it is drawn.
    ///
    /// # Errors
    /// If the device fails.
    fn wait(&mut self, submission: &B::Submission, number: Option<u64>) -> Result<(), Box<dyn Error>>;

    /// All frames were drawn. Says when the device drew them, if it knows.
    ///
    /// # Errors
    /// If the device refuses.
    fn end(self, backend: &B, timeline: &Timeline) -> Result<Option<DeviceLog>, Box<dyn Error>>;
}

/// There is none, or none that works on by itself.
pub struct NoDevice;

impl<B: Backend> Device<B> for NoDevice {
    fn start(&mut self, _backend: &B, _timeline: &Timeline) -> Result<(), Box<dyn Error>> {
        Ok(())
    }

    fn wait(&mut self, _submission: &B::Submission, _number: Option<u64>) -> Result<(), Box<dyn Error>> {
        Ok(())
    }

    fn end(self, _backend: &B, _timeline: &Timeline) -> Result<Option<DeviceLog>, Box<dyn Error>> {
        Ok(None)
    }
}

/// wgpu's.
#[derive(Default)]
pub struct WgpuDevice {
    /// Whether it is to say when it drew which pass.
    pub is_timed: bool,
    clock: Option<DeviceClock>,
    times: Vec<(u64, DevicePassTimes)>,
}

impl WgpuDevice {
    /// One that says when it drew which pass, or does not.
    pub fn timed(is_timed: bool) -> Self {
        Self { is_timed, ..Self::default() }
    }
}

impl Device<WgpuBackend> for WgpuDevice {
    fn start(&mut self, backend: &WgpuBackend, timeline: &Timeline) -> Result<(), Box<dyn Error>> {
        self.clock = self.is_timed.then(|| backend.device_clock(timeline)).transpose()?;
        Ok(())
    }

    fn wait(&mut self, submission: &WgpuSubmission, number: Option<u64>) -> Result<(), Box<dyn Error>> {
        submission.wait()?;
        if let Some(number) = number.filter(|_| self.clock.is_some()) {
            self.times.push((number, submission.pass_times()?));
        }
        Ok(())
    }

    fn end(self, backend: &WgpuBackend, timeline: &Timeline) -> Result<Option<DeviceLog>, Box<dyn Error>> {
        let Some(clock) = self.clock else { return Ok(None) };
        Ok(Some(clock.until(backend.device_clock(timeline)?).log(self.times)))
    }
}
