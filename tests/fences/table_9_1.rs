//! S table 9.1, row by row: what the CPU and the device do, and what becomes of the report, here a fence.
//!
//! The device's side of a wait is the submission of a frame, on the device thread, which is the thread of the test.

use std::sync::mpsc::channel;
use std::thread;
use std::time::{Duration, Instant};

use drawloom::fence::{Fence, FenceError, FenceSetter, FenceWait};
use drawloom::{FencePoint, SubmitError};

use crate::{Fixture, LONG};

/// Waits until someone waits for a fence of this name, and returns who. A wait of a fence that nobody sets tells of all
/// others.
fn await_waiter(fence: &str) -> FenceWait {
    let (_setter, probe) = Fence::new("probe");
    let start = Instant::now();
    loop {
        assert!(start.elapsed() < LONG, "nobody waits for {fence:?}");
        let Err(FenceError::TimedOut { waits, .. }) = probe.wait(Duration::from_millis(1)) else {
            panic!("nobody sets the probe");
        };
        if let Some(wait) = waits.into_iter().find(|wait| wait.fence == fence) {
            return wait;
        }
    }
}

/// | `...` | `WaitReport(22)` | 0 | GPU waits for report to be set |
#[test]
fn row_1_the_device_waits_for_a_report_that_is_not_set() {
    let mut fixture = Fixture::new(Duration::ZERO);
    let (setter, report) = Fence::new("row 1: 22");
    let mut frame = fixture.record();
    let drawn = frame.fence_at(FencePoint::End).unwrap();
    frame.submit_after(&report, LONG);
    let cpu = thread::spawn(move || {
        let waiter = await_waiter("row 1: 22").waiter;
        let was_drawn = drawn.is_set();
        drop(setter);
        (waiter, was_drawn)
    });
    let outcome = fixture.submitter.submit(frame);
    let (waiter, was_drawn) = cpu.join().unwrap();
    assert_eq!(waiter, "the submission of a frame");
    assert!(!was_drawn, "the frame was submitted although the report was not set");
    // The report can no longer be set, and the device does not wait in vain.
    assert!(matches!(outcome, Err(SubmitError::Fence(FenceError::Abandoned { fence })) if fence == "row 1: 22"));
}

/// | `SetReport(22)` | `WaitReport(22)` | 22 | GPU is now unlocked |
#[test]
fn row_2_the_cpu_sets_the_report_and_the_device_goes_on() {
    let mut fixture = Fixture::new(Duration::ZERO);
    let (setter, report) = Fence::new("row 2: 22");
    let mut frame = fixture.record();
    let drawn = frame.fence_at(FencePoint::End).unwrap();
    frame.submit_after(&report, LONG);
    let cpu = thread::spawn(move || {
        await_waiter("row 2: 22");
        setter.set();
    });
    fixture.submitter.submit(frame).unwrap();
    cpu.join().unwrap();
    drawn.wait(LONG).unwrap();
}

/// | `...` | `...` | 22 | |
#[test]
fn row_3_a_report_stays_set() {
    let mut fixture = Fixture::new(Duration::ZERO);
    let (setter, report) = Fence::new("row 3: 22");
    setter.set();
    for _ in 0..2 {
        let mut frame = fixture.record();
        frame.submit_after(&report, Duration::ZERO);
        fixture.submitter.submit(frame).unwrap();
    }
    assert!(report.is_set());
}

/// | `WaitReport(33)` | | | CPU wait for report to be set |
/// | `WaitReport(33)` | `SetReport(33)` | 33 | GPU set the report & unlock CPU |
/// | `...` | `...` | 33 | |
#[test]
fn rows_4_to_6_the_cpu_waits_for_a_report_that_the_device_sets() {
    let mut fixture = Fixture::new(Duration::from_millis(5));
    let mut frame = fixture.record();
    let report = frame.fence_at(FencePoint::End).unwrap();
    let (unlocked, is_unlocked) = channel();
    let cpu = {
        let report = report.clone();
        thread::Builder::new().name("row 4".into()).spawn(move || unlocked.send(report.wait(LONG)).unwrap()).unwrap()
    };
    let wait = loop {
        let wait = await_waiter(report.name());
        if wait.waiter == "thread \"row 4\"" {
            break wait;
        }
    };
    assert_eq!(wait.fence, "the end of a frame");
    assert!(is_unlocked.try_recv().is_err(), "the CPU went on before the device set the report");
    fixture.submitter.submit(frame).unwrap();
    assert_eq!(is_unlocked.recv(), Ok(Ok(())));
    cpu.join().unwrap();
    assert!(report.is_set());
}

/// | `SetReport(12)` | `SetReport(15)` | ? | Race condition |
///
/// It does not compile, which the documentation of [`Fence`] tests as well: a fence has one setter, which setting
/// consumes and nothing clones.
#[test]
fn row_7_the_race_is_refused_by_types() {
    /// Implemented once for all types, and once more for those that can be cloned, so that naming its function for one
    /// of these is ambiguous.
    trait AmbiguousIfClone<Which> {
        fn check() {}
    }
    struct AlsoClone;
    impl<T> AmbiguousIfClone<()> for T {}
    impl<T: Clone> AmbiguousIfClone<AlsoClone> for T {}

    <FenceSetter as AmbiguousIfClone<_>>::check();
    let consumes: fn(FenceSetter) = FenceSetter::set;
    let (setter, report) = Fence::new("row 7: 12 or 15");
    consumes(setter);
    assert!(report.is_set());
}

/// | `WaitReport(33)` | `WaitReport(22)` | ? | Deadlock |
#[test]
fn row_8_the_deadlock_is_found_and_both_waiters_are_named() {
    let mut fixture = Fixture::new(Duration::ZERO);
    // First the device's side has less patience, then the CPU's.
    for (device_limit, cpu_limit) in [(Duration::from_millis(50), LONG), (LONG, Duration::from_millis(50))] {
        let (setter_of_22, report_22) = Fence::new("row 8: 22");
        let mut frame = fixture.record();
        let report_33 = frame.fence_at(FencePoint::End).unwrap();
        frame.submit_after(&report_22, device_limit);
        // Both wait before either loses its patience: the one that has less begins when the other one waits.
        let cpu_is_patient = cpu_limit == LONG;
        let cpu = {
            let report_33 = report_33.clone();
            let wait = move || {
                if !cpu_is_patient {
                    await_waiter("row 8: 22");
                }
                let outcome = report_33.wait(cpu_limit);
                // Only now would it set the report that the device waits for.
                match &outcome {
                    Ok(()) => setter_of_22.set(),
                    Err(_) => drop(setter_of_22),
                }
                outcome
            };
            thread::Builder::new().name("row 8".into()).spawn(wait).unwrap()
        };
        if cpu_is_patient {
            while await_waiter(report_33.name()).waiter != "thread \"row 8\"" {}
        }
        let device_outcome = fixture.submitter.submit(frame).map(drop);
        let cpu_outcome = cpu.join().unwrap();

        let (found, other) = match (device_outcome, cpu_outcome) {
            (Err(SubmitError::Fence(device)), Err(cpu)) if cpu_is_patient => (device, cpu),
            (Err(SubmitError::Fence(device)), Err(cpu)) => (cpu, device),
            other => panic!("both must fail: {other:?}"),
        };
        let FenceError::TimedOut { waits, .. } = &found else { panic!("{found}") };
        let names = |waiter: &str, fence: &str| waits.iter().any(|wait| wait.waiter == waiter && wait.fence == fence);
        assert!(names("thread \"row 8\"", "the end of a frame"), "{found}");
        assert!(names("the submission of a frame", "row 8: 22"), "{found}");
        let message = found.to_string();
        assert!(message.contains("row 8: 22") && message.contains("the end of a frame"), "{message}");
        // The other one is told as well, instead of waiting for its own limit.
        assert!(matches!(other, FenceError::Abandoned { .. }), "{other}");

        // The next frame goes on as if nothing had happened.
        let mut frame = fixture.record();
        let drawn = frame.fence_at(FencePoint::End).unwrap();
        fixture.submitter.submit(frame).unwrap();
        drawn.wait(LONG).unwrap();
    }
}
