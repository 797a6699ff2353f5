//! Limits of waits.

use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use drawloom::backend::WgpuBackend;
use drawloom::fence::{DeviceProgress, Fence, FenceSetter};
use drawloom::process::Deferred;
use drawloom::{Buffering, FencePoint, FrameLoop};
use drawloom_testing::adapter;
use libtest_mimic::Failed;

use super::NumberCase;
use crate::fixture::{DURATIONS, Fixture, LONG, ensure, refused, scene};

pub const CASES: &[NumberCase] = &[
    NumberCase { name: "fences_are_waited_for_without_a_limit", numbers: &["fence::Fence::wait"], check: fences },
    NumberCase {
        name: "submissions_wait_without_a_limit",
        numbers: &["RecordedFrame::submit_after"],
        check: submissions,
    },
    NumberCase {
        name: "frame_loops_wait_without_a_limit",
        numbers: &["FrameLoop::set_device_limit"],
        check: frame_loops,
    },
    NumberCase {
        name: "devices_are_waited_for_without_a_limit",
        numbers: &["backend::WgpuSubmission::wait_timeout"],
        check: devices,
    },
];

/// Long enough for a fence that is set soon, also on a machine that is busy.
fn is_long(limit: Duration) -> bool {
    limit > Duration::from_secs(1)
}

fn fences() -> Result<(), Failed> {
    for limit in DURATIONS {
        let (setter, fence) = Fence::new("soon");
        let wait = || fence.wait(limit);
        if is_long(limit) {
            let waited = thread::scope(|scope| {
                let waiting = scope.spawn(wait);
                thread::sleep(Duration::from_millis(5));
                setter.set();
                waiting.join()
            });
            waited.map_err(|_| "the wait panicked")??;
        } else {
            refused(wait(), "soon")?;
        }
    }
    // The same with a device, which sets its fence when it is asked for the third time.
    for limit in DURATIONS {
        let (setter, fence) = Fence::new("soon");
        let device = Arc::new(Device::default());
        setter.advance_by(Arc::clone(&device));
        *device.setter.lock().map_err(|_| "it is locked")? = Some(setter);
        let waited = fence.wait(limit);
        let asked = device.limits.lock().map_err(|_| "it is locked")?;
        let is_within = |asked: &Duration| *asked <= limit && (!is_long(limit) || limit - *asked < LONG);
        ensure(!asked.is_empty() && asked.iter().all(is_within), format_args!("{asked:?} of {limit:?}"))?;
        if is_long(limit) { waited? } else { refused(waited, "soon")? }
    }
    let mut fixture = Fixture::noop(1, Deferred::to_picture())?;
    for limit in DURATIONS.into_iter().filter(|limit| is_long(*limit)) {
        let mut recorded = fixture.record(&scene())?;
        let end = recorded.fence_at(FencePoint::End)?;
        fixture.submitter.submit(recorded)?;
        end.wait(limit)?;
    }
    Ok(())
}

/// A device that keeps the limits with which it was asked to advance.
#[derive(Default)]
struct Device {
    limits: Mutex<Vec<Duration>>,
    setter: Mutex<Option<FenceSetter>>,
}

impl DeviceProgress for Device {
    fn advance(&self, limit: Duration) -> Result<(), String> {
        let mut limits = self.limits.lock().map_err(|error| error.to_string())?;
        limits.push(limit);
        if limits.len() == 3 {
            let setter = self.setter.lock().map_err(|error| error.to_string())?.take();
            setter.ok_or("it sets its fence once")?.set();
        }
        Ok(())
    }
}

fn submissions() -> Result<(), Failed> {
    for limit in DURATIONS {
        let mut fixture = Fixture::null(1);
        let mut recorded = fixture.record(&scene())?;
        let (setter, fence) = Fence::new("soon");
        recorded.submit_after(&fence, limit);
        if is_long(limit) {
            let setting = thread::spawn(move || {
                thread::sleep(Duration::from_millis(5));
                setter.set();
            });
            fixture.submitter.submit(recorded)?;
            setting.join().map_err(|_| "setting panicked")?;
        } else {
            refused(fixture.submitter.submit(recorded), "soon")?;
        }
        fixture.expect_usual("the next frame")?;
    }
    Ok(())
}

fn frame_loops() -> Result<(), Failed> {
    for limit in DURATIONS {
        let Fixture { renderer, submitter } = Fixture::null(1);
        let mut frames = FrameLoop::new(renderer, submitter, Buffering::Double)?;
        frames.set_device_limit(limit);
        let mut finished = Vec::new();
        for _ in 0..5 {
            let (slot, earlier) = frames.begin();
            finished.extend(earlier);
            slot.submit(frames.renderer().record(scene().as_scene_ref())?);
        }
        finished.extend(frames.finish().1);
        ensure(finished.len() == 5, "five frames finish")?;
        for frame in finished {
            // The null backend sets fences at once.
            frame.outcome?;
        }
    }
    Ok(())
}

fn devices() -> Result<(), Failed> {
    let mut backends = vec![crate::fixture::noop_backend()?];
    if let Ok((device, queue)) = adapter::device() {
        backends.push(WgpuBackend::new(device, queue)?);
    }
    for backend in backends {
        let mut fixture = Fixture::new(backend, 1, Deferred::to_picture())?;
        for limit in DURATIONS {
            let submitted = fixture.draw(&scene())?;
            let waited = submitted.submission.wait_timeout(limit);
            ensure(waited.is_ok() || !is_long(limit), format_args!("{limit:?}: {waited:?}"))?;
            submitted.submission.wait()?;
        }
    }
    Ok(())
}
