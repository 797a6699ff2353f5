//! When the device drew each pass.

use std::time::Duration;

/// When the device drew the passes of a frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DevicePassTimes {
    /// In submission order. A device may draw several passes at once.
    pub passes: Vec<DevicePassTime>,
    /// The number of passes left out because their timestamps are invalid: not written, or an end before the begin.
    pub skipped: usize,
}

/// When the device drew a pass.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DevicePassTime {
    /// The render process's name.
    pub process: String,
    /// The view's name.
    pub view: String,
    /// When it began, on the device's own clock, whose origin only the device knows.
    pub began: Duration,
    /// When it ended, on the same clock.
    pub ended: Duration,
}
