//! What an engine supplies may panic: it is an error, or it is reported, and no job, no worker and no borrow is lost.

use std::{
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::Duration,
};

use drawloom::task::{Scheduler, SchedulerError};

use crate::{assert_intact, waits::ends};

/// A clock that panics from its `first`-th reading on, and the number of its readings so far.
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
fn a_clock_that_panics_takes_no_job_and_no_borrow_away() {
    ends(|| {
        // Whoever reads it first then: the caller or a worker, before a job, after one, or as it falls asleep.
        for first in 1..40 {
            let (clock, readings) = clock_that_panics(first);
            let scheduler = Scheduler::builder().workers(3).timeline_clock(clock).build().unwrap();
            scheduler.timeline().start();
            for frame in 0..100 {
                let mut lent = vec![0_usize; 64];
                let outcome = scheduler.scope(|scope| {
                    for place in &mut lent {
                        scope.spawn(move |scope, _worker| {
                            *place += 1;
                            scope.spawn_pinned(move |_scope, _worker| *place += 1);
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
            assert!(called <= first + scheduler.workers(), "only those who were at it have called it");
            scheduler.timeline().now();
            assert_eq!(readings.load(Ordering::Relaxed), called, "it is not called again");
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

    let error = builder().affinity(|worker| panic!("no place for {worker}")).build().unwrap_err();
    assert!(matches!(&error, SchedulerError::AffinityHook { worker: 1, .. }));
    assert_eq!(error.to_string(), "the hook that places the thread of worker 1 failed: no place for 1");
}
