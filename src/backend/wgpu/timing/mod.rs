//! How long passes take: to record on the CPU, and to draw on the device.

mod device_clock;
mod device_pass_times;
mod pass_timing;
mod queries;
mod readback;
mod tick_period;
mod timestamps;

pub(crate) use pass_timing::PassTiming;
pub(crate) use readback::TimestampReadback;
pub(crate) use timestamps::{DeviceTiming, Timestamps};

pub use device_clock::DeviceClock;
pub use device_pass_times::{DevicePassTime, DevicePassTimes};
