//! When the device drew which pass, read back.

use std::sync::mpsc;
use std::time::Duration;

use super::error_scope::checked;
use super::growing_buffer::GrowingBuffer;
use super::timestamps::{PassName, Readback, Readbacks, Ticks, bytes};
use crate::backend::BackendError;

/// When the device drew the passes of a frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PassTimes {
    /// In the order they were submitted. A device may draw several at once.
    pub passes: Vec<PassTime>,
    /// How many passes were left out because what the device has written cannot be: nothing, or an end before the beginning.
    pub skipped: usize,
}

/// When the device drew a pass.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PassTime {
    /// The process.
    pub process: String,
    /// The view.
    pub view: String,
    /// When it began, on the device's own clock: since some moment that only the device knows.
    pub began: Duration,
    /// When it ended, on the same clock.
    pub ended: Duration,
}

impl Readback {
    /// Reads the timestamps of a frame that the device is done with.
    ///
    /// # Errors
    /// If the device refuses or is lost.
    pub(super) fn read(&self, device: &wgpu::Device) -> Result<PassTimes, BackendError> {
        let mut buffer = self.buffer.lock();
        let stamps = mapped(device, &buffer, bytes(self.names.len())).inspect_err(|_| {
            // It may still be mapped, and then no frame could use it.
            *buffer = Readbacks::none();
        })?;
        Ok(times(&self.names, self.ticks, &stamps))
    }
}

/// The timestamps in a buffer, two a pass. The device must be done with what copies them there.
///
/// # Errors
/// If the device refuses or is lost.
pub(super) fn mapped(
    device: &wgpu::Device,
    buffer: &GrowingBuffer,
    bytes: usize,
) -> Result<Vec<[u64; 2]>, BackendError> {
    let lost = |message: String| BackendError::DeviceLost { message };
    if bytes == 0 {
        return Ok(Vec::new());
    }
    let buffer = buffer.buffer().ok_or_else(|| lost("its timestamps never came back".to_owned()))?;
    let range = 0..bytes as u64;
    let (sender, receiver) = mpsc::channel();
    checked(device, "timestamps", || {
        buffer.slice(range.clone()).map_async(wgpu::MapMode::Read, move |result| {
            // The receiver waits below, unless the device refused, and then nobody asks.
            let _ = sender.send(result);
        });
    })?;
    // Nothing is left to wait for, least of all what was submitted since.
    device.poll(wgpu::PollType::Poll).map_err(|error| lost(error.to_string()))?;
    let result = receiver.recv().map_err(|error| lost(error.to_string()))?;
    result.map_err(|error| lost(error.to_string()))?;
    let stamps = {
        let bytes = buffer.get_mapped_range(range).map_err(|error| lost(error.to_string()))?;
        bytemuck::pod_collect_to_vec(&bytes[..])
    };
    buffer.unmap();
    Ok(stamps)
}

/// What the timestamps say of passes of these names.
fn times(names: &[PassName], ticks: Ticks, stamps: &[[u64; 2]]) -> PassTimes {
    let time = |name: &PassName, [began, ended]: [u64; 2]| {
        let (process, view) = (name.process.clone(), name.view.clone());
        // 0 is what a device leaves where it writes nothing.
        if began == 0 || ended < began {
            return None;
        }
        let [began, ended] = [began, ended].map(|stamp| ticks.nanoseconds(stamp).map(Duration::from_nanos));
        Some(PassTime { process, view, began: began?, ended: ended? })
    };
    let passes: Vec<_> = names.iter().zip(stamps).filter_map(|(name, &stamps)| time(name, stamps)).collect();
    PassTimes { skipped: names.len() - passes.len(), passes }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_is_skipped_and_counted() {
        let name = |process: &str| PassName { process: process.to_owned(), view: "main".to_owned() };
        let names = ["first", "unwritten", "backwards", "half written", "endless", "last"].map(name);
        let stamps = [[10, 20], [0, 0], [30, 29], [0, 40], [50, u64::MAX], [60, 60]];
        let told = times(&names, Ticks::new(1.5), &stamps);
        let nanoseconds = |pass: &PassTime| (pass.process.clone(), pass.began.as_nanos(), pass.ended.as_nanos());
        let passes: Vec<_> = told.passes.iter().map(nanoseconds).collect();
        assert_eq!(passes, [("first".to_owned(), 15, 30), ("last".to_owned(), 90, 90)]);
        assert_eq!(told.skipped, 4);
    }

    #[test]
    fn ticks_keep_every_nanosecond_of_a_large_count() {
        let epoch = 1_700_000_000_000_000_001;
        assert_eq!(Ticks::new(1.0).nanoseconds(epoch), Some(epoch));
        assert_eq!(Ticks::new(2.0).nanoseconds(epoch), Some(epoch * 2));
        assert_eq!(Ticks::new(0.25).nanoseconds(41), Some(10));
        assert_eq!(Ticks::new(1000.0).nanoseconds(epoch), None);
        let coarse = Ticks::new(83.333_336);
        assert!((0..1000).map(|tick| coarse.nanoseconds(tick * 1_000_003)).is_sorted());
        assert_eq!(coarse.nanoseconds(12_000_000).map(|time| time / 1000), Some(1_000_000));
    }
}
