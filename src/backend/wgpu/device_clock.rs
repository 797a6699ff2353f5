//! The device's clock, read beside the timeline's.

use std::time::Duration;

use super::WgpuBackend;
use super::error_scope::checked;
use super::growing_buffer::GrowingBuffer;
use super::pass_times::{PassTimes, mapped};
use super::timestamps::{Readbacks, Timing, bytes, new_set};
use crate::backend::{Backend, BackendError};
use crate::timeline::{DeviceLog, DevicePass, Timeline};

/// What the device's clock says at a moment of a timeline, so that its times can be told on the timeline's axis.
///
/// It is read by submitting next to nothing and waiting for it: the device's timestamp is of some moment between the two. So
/// half of the time that took is by how much the times may be off, and the narrowest of several readings is kept.
///
/// Clocks also drift apart, by some microseconds a second. So it is to be read close to the frames it is for, or before and
/// after them, which [`until`](Self::until) puts together.
///
/// ```no_run
/// # use drawloom::{Renderer, backend::WgpuBackend, process::Deferred, scene::Scene, task::Scheduler, wgpu};
/// # fn draw(device: wgpu::Device, queue: wgpu::Queue, scene: Scene) -> Result<(), Box<dyn std::error::Error>> {
/// # let scheduler = std::sync::Arc::new(Scheduler::new(2)?);
/// let backend = WgpuBackend::new(device, queue)?.time_passes()?;
/// # let builder = Renderer::builder(backend).deferred(Deferred::to_picture());
/// # let (mut renderer, submitter) = builder.build(std::sync::Arc::clone(&scheduler))?;
/// // ...
/// let (timeline, mut times) = (scheduler.timeline(), Vec::new());
/// timeline.start();
/// let clock = submitter.backend().device_clock(timeline)?;
/// for _ in 0..10 {
///     let recorded = renderer.record(scene.as_scene_ref())?;
///     let number = recorded.frame_number();
///     let submitted = submitter.submit(recorded)?;
///     // Or some frames later, lest the device be waited for.
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
    /// The same one where there are no others.
    last: Reading,
}

/// Both clocks at one moment, in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Reading {
    timeline: i128,
    device: i128,
    /// By how much the moment on the timeline may be off.
    error: Duration,
}

impl Reading {
    /// Of what the device wrote at some moment between two of the timeline.
    fn between(before: Duration, after: Duration, device: u64) -> Self {
        let error = after.saturating_sub(before) / 2;
        Self { timeline: nanoseconds(before + error), device: device.into(), error }
    }

    /// What is to be added to the device's time.
    fn offset(&self) -> i128 {
        self.timeline - self.device
    }
}

impl DeviceClock {
    /// How often the clock is read.
    const ROUNDS: usize = 16;

    /// By how much the times may be off, earlier or later.
    pub fn error(&self) -> Duration {
        self.first.error.max(self.last.error)
    }

    /// With a reading that was taken later, so that what the clocks drift apart between the two is allowed for.
    pub fn until(self, later: Self) -> Self {
        Self { last: later.last, ..self }
    }

    /// The times of passes on the timeline's axis: of frames, each with its number
    /// ([`Recorded::frame_number`](crate::Recorded::frame_number)). What cannot be on that axis is left out, and a warning
    /// tells how many passes that were, together with those that were [skipped](PassTimes::skipped).
    pub fn log(&self, frames: impl IntoIterator<Item = (u64, PassTimes)>) -> DeviceLog {
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
            tracing::warn!(target: "drawloom", skipped, "the device's timestamps of some passes cannot be");
        }
        // Stable: passes that began at once stay in the order of submission.
        passes.sort_by_key(|pass| pass.began);
        DeviceLog { name: self.name.clone(), error: self.error(), passes }
    }

    /// `None` before the timeline's first moment.
    fn on_timeline(&self, device: Duration) -> Option<Duration> {
        let (first, last, device) = (self.first, self.last, nanoseconds(device));
        let offset = match last.device - first.device {
            between @ 1.. => {
                let passed = (device - first.device).clamp(0, between);
                first.offset() + (last.offset() - first.offset()) * passed / between
            }
            // The device's clock has begun anew, and only after that was it less than at first.
            ..=0 if device < first.device => last.offset(),
            _ => first.offset(),
        };
        u64::try_from(device + offset).ok().map(Duration::from_nanos)
    }
}

fn nanoseconds(time: Duration) -> i128 {
    // No Duration is that long.
    i128::try_from(time.as_nanos()).unwrap_or(i128::MAX)
}

impl WgpuBackend {
    /// Reads the device's clock. It waits for all that was submitted before, so it is not for the midst of a frame; and it
    /// takes some submissions, so not for every frame either.
    ///
    /// # Errors
    /// If the device lacks `TIMESTAMP_QUERY`, is wgpu's `noop` backend, refuses or is lost.
    pub fn device_clock(&self, timeline: &Timeline) -> Result<DeviceClock, BackendError> {
        let device = self.device();
        let timing = Timing::new(device, self.queue())?;
        let (set, resolved, copied) = checked(device, "the device's clock", || {
            let set = new_set(device, 2);
            let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
            let (mut resolved, mut copied) = (GrowingBuffer::new("the device's clock", usage), Readbacks::none());
            resolved.reserve(device, bytes(1))?;
            copied.reserve(device, bytes(1))?;
            Ok((set, resolved, copied))
        })
        .flatten()?;
        let mut best: Option<Reading> = None;
        for _ in 0..DeviceClock::ROUNDS {
            let (before, after, stamp) = self.bracket(timeline, &set, &resolved, &copied)?;
            let reading = timing.ticks.nanoseconds(stamp).filter(|_| stamp > 0);
            let reading = reading.map(|stamp| Reading::between(before, after, stamp));
            best = best.into_iter().chain(reading).min_by_key(|reading| reading.error);
        }
        let none =
            || BackendError::MissingFeature { missing: "timestamps of compute passes (it wrote none)".to_owned() };
        let reading = best.ok_or_else(none)?;
        Ok(DeviceClock { name: self.adapter(), first: reading, last: reading })
    }

    /// Has the device write down a timestamp, in ticks, between two moments of the timeline.
    ///
    /// # Errors
    /// If the device refuses or is lost.
    fn bracket(
        &self,
        timeline: &Timeline,
        set: &wgpu::QuerySet,
        resolved: &GrowingBuffer,
        copied: &GrowingBuffer,
    ) -> Result<(Duration, Duration, u64), BackendError> {
        let device = self.device();
        let commands = checked(device, "the device's clock", || {
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("the device's clock"),
                timestamp_writes: Some(wgpu::ComputePassTimestampWrites {
                    query_set: set,
                    beginning_of_pass_write_index: Some(0),
                    end_of_pass_write_index: Some(1),
                }),
            });
            if let Some((resolved, copied)) = resolved.buffer().zip(copied.buffer()) {
                encoder.resolve_query_set(set, 0..2, resolved, 0);
                encoder.copy_buffer_to_buffer(resolved, 0, copied, 0, bytes(1) as u64);
            }
            encoder.finish()
        })?;
        let before = timeline.now();
        let index = checked(device, "the device's clock", || self.queue().submit([commands]))?;
        let poll = wgpu::PollType::Wait { submission_index: Some(index), timeout: None };
        device.poll(poll).map_err(|error| BackendError::DeviceLost { message: error.to_string() })?;
        let after = timeline.now();
        let ended = mapped(device, copied, bytes(1))?.first().map_or(0, |[_, ended]| *ended);
        Ok((before, after, ended))
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;
    use crate::backend::PassTime;

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
    fn one_reading_moves_all_times_alike() {
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
    fn between_two_readings_drift_is_allowed_for() {
        // The device's clock is fast by a thousandth.
        let both = clock(1_000_000, 50, 10).until(clock(2_000_000, 1_001_050, 30));
        assert_eq!(both.error(), Duration::from_nanos(30));
        for (device, expected) in [(50, 1_000_000), (500_550, 1_500_000), (1_001_050, 2_000_000)] {
            assert_eq!(on_timeline(&both, device), Some(expected));
        }
        // Past them nobody knows how it went on.
        assert_eq!(on_timeline(&both, 25), Some(999_975));
        assert_eq!(on_timeline(&both, 2_001_050), Some(3_000_000));
        let times: Vec<_> = (0..1_100_000).step_by(777).map(|device| on_timeline(&both, device).unwrap()).collect();
        assert!(times.is_sorted());
    }

    #[test]
    fn where_the_device_began_anew_each_time_goes_by_the_reading_on_its_side() {
        let both = clock(1_000, 900, 1).until(clock(2_000, 100, 1));
        assert_eq!(on_timeline(&both, 950), Some(1_050));
        assert_eq!(on_timeline(&both, 50), Some(1_950));
    }

    #[test]
    fn a_log_has_passes_by_when_they_began_and_leaves_out_what_cannot_be() {
        let pass = |process: &str, began, ended| PassTime {
            process: process.to_owned(),
            view: "main".to_owned(),
            began: Duration::from_nanos(began),
            ended: Duration::from_nanos(ended),
        };
        let late = PassTimes { passes: vec![pass("late", 700, 900), pass("early", 600, 800)], skipped: 0 };
        let before_all = PassTimes { passes: vec![pass("before all", 100, 650)], skipped: 3 };
        let log = clock(200, 500, 7).log([(4, late), (5, before_all)]);
        let told: Vec<_> = log.passes.iter().map(|pass| (pass.frame, &*pass.process, pass.began.as_nanos())).collect();
        assert_eq!(told, [(4, "early", 300), (4, "late", 400)]);
        assert_eq!((log.name.as_str(), log.error), ("abacus", Duration::from_nanos(7)));
    }
}
