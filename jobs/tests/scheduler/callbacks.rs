//! Panics of the engine's hooks, clocks and captures are returned or reported, and no job, worker or borrow is lost.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use drawloom_jobs::task::{AffinityMask, Scheduler, SchedulerError};

use crate::assert_intact;
use crate::waits::assert_ends;

/// A clock that panics from reading number `first` on, and the number of its readings so far.
fn clock_that_panics(first: usize) -> (impl Fn() -> Duration + Send + Sync, Arc<AtomicUsize>) {
    let readings = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&readings);
    let clock = move || {
        let reading = counted.fetch_add(1, Ordering::Relaxed);
        assert!(reading < first, "the clock has stopped");
        Duration::from_micros(reading as u64)
    };
    (clock, readings)
}

#[test]
fn a_clock_that_panics_loses_no_job_and_no_borrow() {
    assert_ends(|| {
        // The clock panics on the caller and on workers: before a job, after one, and when the worker goes to sleep.
        for first in 1..40 {
            let (clock, readings) = clock_that_panics(first);
            let scheduler = Scheduler::builder().workers(3).timeline_clock(clock).build().unwrap();
            scheduler.timeline().start();
            for frame in 0..100 {
                let mut lent = vec![0_usize; 64];
                let outcome = scheduler.scope(|scope| {
                    for number in &mut lent {
                        scope.spawn(move |scope, _worker| {
                            *number += 1;
                            scope.spawn_pinned(move |_scope, _worker| *number += 1);
                        });
                    }
                });
                assert_eq!(outcome, Ok(()));
                assert_eq!(lent, [2; 64]);
                if frame > 10 && readings.load(Ordering::Relaxed) > first {
                    break;
                }
                thread::sleep(Duration::from_micros(200));
            }
            assert_intact(&scheduler);
            let log = scheduler.timeline().take();
            assert_eq!(log.clock_panic.as_deref(), Some("the clock has stopped"));
            let called = readings.load(Ordering::Relaxed);
            assert!(called <= first + scheduler.workers(), "only threads that were reading the clock have called it");
            scheduler.timeline().now();
            assert_eq!(readings.load(Ordering::Relaxed), called, "the clock is not called again");
        }
    });
}

#[test]
fn a_hook_that_panics_while_the_scheduler_is_built_is_an_error_that_names_it() {
    let ended = Arc::new(AtomicUsize::new(0));
    let builder = || {
        let ended = Arc::clone(&ended);
        Scheduler::builder().workers(3).on_stop(move |_worker| _ = ended.fetch_add(1, Ordering::Relaxed))
    };
    let error = builder().name(|worker| panic!("no name for {worker}")).build().unwrap_err();
    assert!(matches!(&error, SchedulerError::NameHook { worker: 1, panic } if panic.message == "no name for 1"));
    assert_eq!(error.to_string(), "the hook that names the thread of worker 1 failed: no name for 1");
    assert_eq!(ended.load(Ordering::Relaxed), 0, "no thread was started");

    // Elsewhere worker 1 cannot be restricted, so the hook is not asked about worker 2.
    if !cfg!(all(feature = "affinity", any(target_os = "linux", target_os = "android"))) {
        return;
    }
    let affinity = |worker| if worker == 2 { panic!("no affinity for {worker}") } else { AffinityMask::new(0..1024) };
    let error = builder().affinity(affinity).build().unwrap_err();
    assert!(matches!(&error, SchedulerError::AffinityHook { worker: 2, .. }));
    assert_eq!(error.to_string(), "the affinity hook of worker 2 failed: no affinity for 2");
    assert_eq!(ended.load(Ordering::Relaxed), 1, "the thread that was started has ended");
}

/// Panics when it is dropped, once it has been counted.
struct PanicsWhenDropped(Arc<AtomicUsize>);

impl Drop for PanicsWhenDropped {
    fn drop(&mut self) {
        self.0.fetch_add(1, Ordering::Relaxed);
        panic!("dropped");
    }
}

#[test]
fn captures_of_jobs_may_panic_when_they_are_dropped() {
    assert_ends(|| {
        for workers in [1, 3] {
            let scheduler = Scheduler::new(workers).unwrap();
            let dropped = Arc::new(AtomicUsize::new(0));
            let captured = || PanicsWhenDropped(Arc::clone(&dropped));
            let outcome = scheduler.scope(|scope| {
                for _job in 0..4 {
                    let captured = captured();
                    scope.spawn(move |_scope, _worker| _ = &captured);
                }
            });
            assert_eq!(outcome.unwrap_err().message, "dropped");
            for length in [0, 1, 1_000] {
                let captured = captured();
                let outcome = scheduler.parallel_for(length, 1, move |_range, _worker| _ = &captured);
                assert_eq!(outcome.unwrap_err().message, "dropped");
            }
            // The last thread that holds the job's result drops it.
            drop(scheduler.background({
                let captured = captured();
                move || captured
            }));
            let captured = captured();
            assert_eq!(scheduler.background(move || _ = &captured).wait().unwrap_err().message, "dropped");
            assert_intact(&scheduler);
            drop(scheduler);
            assert_eq!(dropped.load(Ordering::Relaxed), 9, "including the captures of a job that has not begun");
        }
    });
}
