//! Readings of the device's clock, to convert its times to the timeline's axis.

use std::time::Duration;

use super::timestamps::{DevicePassTimes, DeviceTiming, ReadbackPool, new_query_set, read_timestamps, timestamp_bytes};
use crate::backend::BackendError;
use crate::backend::wgpu::error_scope::{poll, with_error_scope};
use crate::backend::wgpu::resources::GrowingBuffer;
use crate::timeline::{DeviceLog, DevicePass, Timeline};
use crate::unwind::emit;

/// A calibration of the device's clock against a timeline, which converts the device's times to the timeline's axis.
///
/// A reading submits an empty pass and waits for it: the device's timestamp lies between the two. So the error is half
/// of the time in between, and the narrowest of several readings is kept.
///
/// Clocks also drift apart, by some microseconds per second. So read the clock close to the frames, or before and after
/// them, and combine both readings with [`until`](Self::until).
///
/// ```no_run
/// # use drawloom::{Renderer, backend::WgpuBackend, process::Deferred, scene::Scene, task::Scheduler, wgpu};
/// # fn draw(device: wgpu::Device, queue: wgpu::Queue, scene: Scene) -> Result<(), Box<dyn std::error::Error>> {
/// # let scheduler = std::sync::Arc::new(Scheduler::new(2)?);
/// let backend = WgpuBackend::new(device, queue)?.time_passes()?;
/// # let builder = Renderer::builder(backend).pipeline(Deferred::to_picture());
/// # let (mut renderer, submitter) = builder.build(std::sync::Arc::clone(&scheduler))?;
/// // ...
/// let (timeline, mut times) = (scheduler.timeline(), Vec::new());
/// timeline.start();
/// let clock = submitter.backend().device_clock(timeline)?;
/// for _ in 0..10 {
///     let recorded = renderer.record(scene.as_scene_ref())?;
///     let number = recorded.frame_number();
///     let submitted = submitter.submit(recorded)?;
///     // Some frames later this would not wait for the device.
///     times.extend(number.zip(submitted.submission.pass_times().ok()));
/// }
/// let clock = clock.until(submitter.backend().device_clock(timeline)?);
/// let mut log = timeline.take();
/// log.device = Some(clock.log(times));
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceClock {
    /// The device's name.
    name: String,
    first: Reading,
    /// Equal to the first if there is only one.
    last: Reading,
}

/// A reading of both clocks, in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Reading {
    timeline: i128,
    device: i128,
    /// The error of the timeline's time.
    error: Duration,
}

impl Reading {
    /// A timestamp that the device wrote between two times of the timeline.
    fn between(before: Duration, after: Duration, device: u64) -> Self {
        let error = after.saturating_sub(before) / 2;
        Self { timeline: nanoseconds(before + error), device: device.into(), error }
    }

    /// Added to the device's time, it gives the timeline's.
    fn offset(&self) -> i128 {
        self.timeline - self.device
    }
}

impl DeviceClock {
    /// Readings per calibration.
    const ROUNDS: usize = 16;

    /// Reads the device's clock. Waits for all earlier submissions.
    ///
    /// # Errors
    /// If the device lacks `TIMESTAMP_QUERY`, is wgpu's `noop` backend, refuses or is lost.
    pub(crate) fn read(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        name: String,
        timeline: &Timeline,
    ) -> Result<Self, BackendError> {
        let timing = DeviceTiming::new(device, queue)?;
        let probe = ClockProbe::new(device, queue)?;
        let mut best: Option<Reading> = None;
        for _ in 0..Self::ROUNDS {
            let (before, after, stamp) = probe.bracket(timeline)?;
            let reading = timing.tick_period.nanoseconds(stamp).filter(|_| stamp > 0);
            let reading = reading.map(|stamp| Reading::between(before, after, stamp));
            best = best.into_iter().chain(reading).min_by_key(|reading| reading.error);
        }
        let none =
            || BackendError::MissingFeature { missing: "timestamps of compute passes (it wrote none)".to_owned() };
        let reading = best.ok_or_else(none)?;
        Ok(Self { name, first: reading, last: reading })
    }

    /// The error of converted times, in either direction.
    pub fn error(&self) -> Duration {
        self.first.error.max(self.last.error)
    }

    /// Combines this reading with a later one: times in between are corrected for drift.
    pub fn until(self, later: Self) -> Self {
        Self { last: later.last, ..self }
    }

    /// Converts the times of frames' passes to the timeline's axis. Each frame comes with its number
    /// ([`RecordedFrame::frame_number`](crate::RecordedFrame::frame_number)). Passes whose times cannot be converted
    /// are left out. A warning reports their number, together with the [skipped](DevicePassTimes::skipped) ones.
    pub fn log(&self, frames: impl IntoIterator<Item = (u64, DevicePassTimes)>) -> DeviceLog {
        let (mut passes, mut skipped) = (Vec::new(), 0);
        for (frame, times) in frames {
            skipped += times.skipped;
            for pass in times.passes {
                match (self.on_timeline(pass.began), self.on_timeline(pass.ended)) {
                    (Some(began), Some(ended)) if began <= ended => {
                        passes.push(DevicePass { frame, process: pass.process, view: pass.view, began, ended });
                    }
                    _ => skipped += 1,
                }
            }
        }
        if skipped > 0 {
            let message = "the device's timestamps of some passes are invalid";
            emit(|| tracing::warn!(target: "drawloom", skipped, "{message}"));
        }
        // A stable sort: passes that began at the same time stay in submission order.
        passes.sort_by_key(|pass| pass.began);
        DeviceLog { name: self.name.clone(), error: self.error(), passes }
    }

    /// `None` before the timeline's origin.
    fn on_timeline(&self, device: Duration) -> Option<Duration> {
        let (first, last, device) = (self.first, self.last, nanoseconds(device));
        let offset = match last.device - first.device {
            between @ 1.. => {
                let passed = (device - first.device).clamp(0, between);
                first.offset() + (last.offset() - first.offset()) * passed / between
            }
            // The device's clock restarted in between: smaller times are from after the restart.
            ..=0 if device < first.device => last.offset(),
            _ => first.offset(),
        };
        u64::try_from(device + offset).ok().map(Duration::from_nanos)
    }
}

fn nanoseconds(time: Duration) -> i128 {
    // Every `Duration` fits.
    i128::try_from(time.as_nanos()).unwrap_or(i128::MAX)
}

/// Has the device write timestamps around empty compute passes.
struct ClockProbe<'a> {
    device: &'a wgpu::Device,
    queue: &'a wgpu::Queue,
    set: wgpu::QuerySet,
    resolved: GrowingBuffer,
    mappable: GrowingBuffer,
}

impl<'a> ClockProbe<'a> {
    /// # Errors
    /// If the device has no room.
    fn new(device: &'a wgpu::Device, queue: &'a wgpu::Queue) -> Result<Self, BackendError> {
        with_error_scope(device, "the device's clock", || {
            let set = new_query_set(device, 2);
            let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
            let (mut resolved, mut mappable) =
                (GrowingBuffer::new("the device's clock", usage), ReadbackPool::new_buffer());
            resolved.reserve(device, timestamp_bytes(1))?;
            mappable.reserve(device, timestamp_bytes(1))?;
            Ok(Self { device, queue, set, resolved, mappable })
        })
        .flatten()
    }

    /// Has the device write a timestamp, in ticks, between two times of the timeline.
    ///
    /// # Errors
    /// If the device refuses or is lost.
    fn bracket(&self, timeline: &Timeline) -> Result<(Duration, Duration, u64), BackendError> {
        let Self { device, queue, set, resolved, mappable } = self;
        let commands = with_error_scope(device, "the device's clock", || {
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("the device's clock"),
                timestamp_writes: Some(wgpu::ComputePassTimestampWrites {
                    query_set: set,
                    beginning_of_pass_write_index: Some(0),
                    end_of_pass_write_index: Some(1),
                }),
            });
            if let Some((resolved, mappable)) = resolved.buffer().zip(mappable.buffer()) {
                encoder.resolve_query_set(set, 0..2, resolved, 0);
                encoder.copy_buffer_to_buffer(resolved, 0, mappable, 0, timestamp_bytes(1) as u64);
            }
            encoder.finish()
        })?;
        let before = timeline.now();
        let index = with_error_scope(device, "the device's clock", || queue.submit([commands]))?;
        poll(device, wgpu::PollType::Wait { submission_index: Some(index), timeout: None })?;
        let after = timeline.now();
        let ended = read_timestamps(device, mappable, 1)?.first().map_or(0, |[_, ended]| *ended);
        Ok((before, after, ended))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::DevicePassTime;

    fn clock(timeline: u64, device: u64, error: u64) -> DeviceClock {
        let middle = Duration::from_nanos(timeline);
        let error = Duration::from_nanos(error);
        let reading = Reading::between(middle - error, middle + error, device);
        DeviceClock { name: "abacus".to_owned(), first: reading, last: reading }
    }

    fn on_timeline(clock: &DeviceClock, device: u64) -> Option<u64> {
        let time = clock.on_timeline(Duration::from_nanos(device))?;
        Some(time.as_nanos() as u64)
    }

    #[test]
    fn one_reading_shifts_all_times_equally() {
        // A device that counts from 1970.
        let epoch = 1_700_000_000_000_000_000;
        let clock = clock(5_000, epoch, 40);
        assert_eq!(clock.error(), Duration::from_nanos(40));
        for passed in [0, 1, 1 << 30] {
            assert_eq!(on_timeline(&clock, epoch + passed), Some(5_000 + passed));
        }
        assert_eq!(on_timeline(&clock, epoch - 5_000), Some(0));
        assert_eq!(on_timeline(&clock, epoch - 5_001), None);
    }

    #[test]
    fn drift_between_two_readings_is_corrected() {
        // The device's clock is fast by a thousandth.
        let both = clock(1_000_000, 50, 10).until(clock(2_000_000, 1_001_050, 30));
        assert_eq!(both.error(), Duration::from_nanos(30));
        for (device, expected) in [(50, 1_000_000), (500_550, 1_500_000), (1_001_050, 2_000_000)] {
            assert_eq!(on_timeline(&both, device), Some(expected));
        }
        // Outside of the readings the drift is unknown, so the offset is that of the nearer reading.
        assert_eq!(on_timeline(&both, 25), Some(999_975));
        assert_eq!(on_timeline(&both, 2_001_050), Some(3_000_000));
        let times: Vec<_> = (0..1_100_000).step_by(777).map(|device| on_timeline(&both, device).unwrap()).collect();
        assert!(times.is_sorted());
    }

    #[test]
    fn after_a_restart_of_the_device_each_time_uses_the_reading_on_its_side() {
        let both = clock(1_000, 900, 1).until(clock(2_000, 100, 1));
        assert_eq!(on_timeline(&both, 950), Some(1_050));
        assert_eq!(on_timeline(&both, 50), Some(1_950));
    }

    #[test]
    fn a_log_sorts_passes_by_begin_and_leaves_out_invalid_times() {
        let pass = |process: &str, began, ended| DevicePassTime {
            process: process.to_owned(),
            view: "main".to_owned(),
            began: Duration::from_nanos(began),
            ended: Duration::from_nanos(ended),
        };
        let late = DevicePassTimes { passes: vec![pass("late", 700, 900), pass("early", 600, 800)], skipped: 0 };
        let before_origin = DevicePassTimes { passes: vec![pass("before all", 100, 650)], skipped: 3 };
        let log = clock(200, 500, 7).log([(4, late), (5, before_origin)]);
        let logged: Vec<_> =
            log.passes.iter().map(|pass| (pass.frame, &*pass.process, pass.began.as_nanos())).collect();
        assert_eq!(logged, [(4, "early", 300), (4, "late", 400)]);
        assert_eq!((log.name.as_str(), log.error), ("abacus", Duration::from_nanos(7)));
    }
}
