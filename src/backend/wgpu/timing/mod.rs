//! When the device draws each pass.

mod device_clock;
mod timestamps;

pub(crate) use timestamps::{DeviceTiming, TimestampReadback, Timestamps};

pub use device_clock::DeviceClock;
pub use timestamps::{DevicePassTime, DevicePassTimes};
