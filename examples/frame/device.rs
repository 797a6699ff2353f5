//! Waits for the device after each frame, and reads its pass times.

use std::error::Error;

use drawloom::backend::{Backend, DeviceClock, DevicePassTimes, WgpuBackend, WgpuSubmission};
use drawloom::timeline::{DeviceLog, Timeline};

/// A backend's device.
pub trait Device<B: Backend> {
    /// Called before the first frame on the timeline.
    ///
    /// # Errors
    /// Returns an error if the device fails.
    fn start(&mut self, backend: &B, timeline: &Timeline) -> Result<(), Box<dyn Error>>;

    /// Waits until a submitted frame is drawn. `number` is its number on the timeline, if it is recorded.
    ///
    /// # Errors
    /// Returns an error if the device fails.
    fn wait(&mut self, submission: &B::Submission, number: Option<u64>) -> Result<(), Box<dyn Error>>;

    /// Called after the last frame. Returns the device's log, if it has one.
    ///
    /// # Errors
    /// Returns an error if the device fails.
    fn end(self, backend: &B, timeline: &Timeline) -> Result<Option<DeviceLog>, Box<dyn Error>>;
}

/// No device, or one that is idle after each submission.
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

/// wgpu's device.
#[derive(Default)]
pub struct WgpuDevice {
    /// Whether pass times are read.
    pub is_timed: bool,
    clock: Option<DeviceClock>,
    times: Vec<(u64, DevicePassTimes)>,
}

impl WgpuDevice {
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
