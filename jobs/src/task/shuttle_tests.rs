//! Scopes, loops and background jobs on a whole scheduler, in random interleavings of shuttle's.
//!
//! The tests assert that each job runs once, on a worker that may run it. Shuttle asserts that no wake-up is lost: if a
//! call never returns, all threads sleep, which shuttle reports as a failure.

use std::iter;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::time::Duration;

use super::{JobPanic, Scheduler};
use crate::sync::{AtomicUsize, Condvar, Mutex, Ordering, check, thread};

fn counters(count: usize) -> Vec<AtomicUsize> {
    iter::repeat_with(|| AtomicUsize::new(0)).take(count).collect()
}

fn counts(counters: &[AtomicUsize]) -> Vec<usize> {
    counters.iter().map(|counter| counter.load(Ordering::Relaxed)).collect()
}

fn count(counter: &AtomicUsize) {
    counter.fetch_add(1, Ordering::Relaxed);
}

/// Panics without a message on the console, which would be printed in each interleaving.
fn panic_as_planned() -> ! {
    resume_unwind(Box::new("as planned"))
}

/// A scheduler of `workers` workers, `in_background` of which run background jobs at once.
fn scheduler(workers: usize, in_background: usize) -> Scheduler {
    let scheduler = Scheduler::new(workers).unwrap();
    scheduler.set_background_workers(in_background);
    scheduler
}

/// Checks `run` on schedulers of a few workers.
fn check_on_schedulers(run: impl Fn(&Scheduler) + Send + Sync + 'static) {
    let run = Arc::new(run);
    for (workers, in_background) in [(2, 1), (3, 1), (3, 2)] {
        let run = Arc::clone(&run);
        check(move || run(&scheduler(workers, in_background)));
    }
}

#[test]
fn shuttle_jobs_that_spawn_jobs_all_run_before_the_scope_ends() {
    check_on_schedulers(|scheduler| {
        let ran = counters(8);
        let outcome = scheduler.scope(|scope| {
            for jobs in ran.chunks(4) {
                scope.spawn(move |scope, _worker| {
                    for job in &jobs[1..] {
                        scope.spawn(move |_scope, _worker| count(job));
                    }
                    count(&jobs[0]);
                });
            }
        });
        assert_eq!(outcome, Ok(()));
        assert_eq!(counts(&ran), [1; 8]);
    });
}

#[test]
fn shuttle_pinned_jobs_run_on_the_calling_thread_in_order() {
    check_on_schedulers(|scheduler| {
        let caller = thread::current().id();
        let pinned = counters(2);
        let outcome = scheduler.scope(|scope| {
            for counter in &pinned {
                scope.spawn(move |scope, _worker| {
                    for position in 0..2 {
                        scope.spawn_pinned(move |_scope, worker| {
                            assert_eq!((worker.index(), thread::current().id()), (0, caller));
                            assert_eq!(counter.fetch_add(1, Ordering::Relaxed), position);
                        });
                    }
                });
            }
        });
        assert_eq!(outcome, Ok(()));
        assert_eq!(counts(&pinned), [2, 2]);
    });
}

#[test]
fn shuttle_a_loop_runs_each_index_once() {
    check_on_schedulers(|scheduler| {
        let ran = counters(7);
        for times in 1..3 {
            let outcome = scheduler.parallel_for(ran.len(), 2, |range, _worker| ran[range].iter().for_each(count));
            assert_eq!(outcome, Ok(()));
            assert_eq!(counts(&ran), [times; 7]);
        }
    });
}

#[test]
fn shuttle_a_worker_that_waits_for_a_loop_in_a_job_runs_no_foreign_job() {
    check_on_schedulers(|scheduler| {
        let ran = counters(4);
        let depths = counters(scheduler.workers());
        let outcome = scheduler.scope(|scope| {
            for _job in 0..3 {
                let (ran, depths) = (&ran, &depths);
                scope.spawn(move |_scope, worker| {
                    let depth = &depths[worker.index()];
                    assert_eq!(
                        depth.fetch_add(1, Ordering::Relaxed),
                        0,
                        "another job of the scope runs on this worker"
                    );
                    let inner = scheduler.parallel_for(2, 1, |range, _worker| count(&ran[range.start]));
                    assert_eq!(inner, Ok(()));
                    depth.fetch_sub(1, Ordering::Relaxed);
                    count(&ran[2]);
                });
            }
            count(&ran[3]);
        });
        assert_eq!(outcome, Ok(()));
        assert_eq!(counts(&ran), [3, 3, 3, 1]);
    });
}

#[test]
fn shuttle_a_panic_is_returned_when_the_other_jobs_have_run() {
    check_on_schedulers(|scheduler| {
        let ran = counters(3);
        let outcome = scheduler.scope(|scope| {
            for (job, counter) in ran.iter().enumerate() {
                scope.spawn(move |scope, _worker| {
                    scope.spawn(move |_scope, _worker| count(counter));
                    if job == 1 {
                        panic_as_planned();
                    }
                });
            }
        });
        assert_eq!(outcome, Err(JobPanic { message: "as planned".to_owned() }));
        assert_eq!(counts(&ran), [1; 3]);
    });
}

#[test]
fn shuttle_two_threads_that_share_a_scheduler_are_served_in_turn() {
    check(|| {
        let scheduler = Arc::new(Scheduler::new(2).unwrap());
        let inside = Arc::new(AtomicUsize::new(0));
        let serve = |scheduler: &Scheduler, inside: &AtomicUsize| {
            let outcome = scheduler.scope(|scope| {
                scope.spawn_pinned(|_scope, _worker| {
                    assert_eq!(inside.fetch_add(1, Ordering::Relaxed), 0);
                    inside.fetch_sub(1, Ordering::Relaxed);
                });
                scope.spawn(|_scope, _worker| ());
            });
            assert_eq!(outcome, Ok(()));
        };
        let other = thread::spawn({
            let (scheduler, inside) = (Arc::clone(&scheduler), Arc::clone(&inside));
            move || serve(&scheduler, &inside)
        });
        serve(&scheduler, &inside);
        other.join().unwrap();
    });
}

#[test]
fn shuttle_background_jobs_run_beside_frames_and_off_the_calling_thread() {
    check_on_schedulers(|scheduler| {
        let caller = thread::current().id();
        let ran = Arc::new(AtomicUsize::new(0));
        let jobs = [1, 2].map(|number| {
            let ran = Arc::clone(&ran);
            scheduler.background(move || {
                assert_ne!(thread::current().id(), caller);
                count(&ran);
                number
            })
        });
        let frame = AtomicUsize::new(0);
        scheduler.parallel_for(3, 1, |_range, _worker| count(&frame)).unwrap();
        assert_eq!(frame.into_inner(), 3);
        while !jobs.iter().all(|job| job.is_finished()) {
            thread::yield_now();
        }
        assert_eq!(jobs.map(|job| job.wait()), [Ok(1), Ok(2)]);
        assert_eq!(ran.load(Ordering::Relaxed), 2);
    });
}

#[test]
fn shuttle_waiting_returns_the_result_of_a_background_job_wherever_it_ran() {
    check_on_schedulers(|scheduler| {
        let ran = Arc::new(AtomicUsize::new(0));
        let job = scheduler.background({
            let ran = Arc::clone(&ran);
            move || ran.fetch_add(1, Ordering::Relaxed)
        });
        let failing = scheduler.background(|| panic_as_planned());
        assert_eq!(failing.wait(), Err(JobPanic { message: "as planned".to_owned() }));
        assert_eq!(job.wait(), Ok(0));
        assert_eq!(ran.load(Ordering::Relaxed), 1);
    });
}

#[test]
fn shuttle_a_background_job_has_scopes_of_its_own() {
    check(|| {
        let scheduler = Arc::new(scheduler(3, 2));
        let caller = thread::current().id();
        let job = scheduler.background({
            let scheduler = Arc::clone(&scheduler);
            move || {
                let ran = counters(3);
                let outcome = scheduler.parallel_for(ran.len(), 1, |range, _worker| {
                    assert_ne!(thread::current().id(), caller);
                    count(&ran[range.start]);
                });
                outcome.map(|()| counts(&ran))
            }
        });
        scheduler.parallel_for(2, 1, |_range, _worker| ()).unwrap();
        while !job.is_finished() {
            thread::yield_now();
        }
        assert_eq!(job.wait(), Ok(Ok(vec![1; 3])));
    });
}

#[test]
fn shuttle_a_scheduler_can_be_dropped_while_its_workers_are_busy() {
    check_on_schedulers(|_scheduler| ());
    check(|| {
        let scheduler = scheduler(3, 2);
        let ran = Arc::new(AtomicUsize::new(0));
        let jobs = [(); 2].map(|()| {
            let ran = Arc::clone(&ran);
            scheduler.background(move || count(&ran))
        });
        drop(scheduler);
        let before = ran.load(Ordering::Relaxed);
        assert_eq!(jobs.map(|job| job.wait()), [Ok(()), Ok(())]);
        assert!(before <= 2);
        assert_eq!(
            ran.load(Ordering::Relaxed),
            2,
            "each has run once, before the scheduler ended or when it was waited for"
        );
    });
}

/// A worker runs a job of the background job's scope, spawns another one, and goes on to a frame's job. That waits for
/// a scope, a job of which waits for the background job. So no worker may keep a job that another one waits for.
#[test]
fn shuttle_a_frames_nested_job_waits_for_a_background_job() {
    check(|| {
        let scheduler = Arc::new(scheduler(3, 2));
        let background = scheduler.background({
            let scheduler = Arc::clone(&scheduler);
            move || {
                let ran = counters(4);
                let outcome = scheduler.scope(|scope| {
                    for jobs in ran.chunks(2) {
                        scope.spawn(move |scope, _worker| {
                            scope.spawn(move |_scope, _worker| count(&jobs[1]));
                            count(&jobs[0]);
                        });
                    }
                });
                outcome.map(|()| counts(&ran))
            }
        });
        let (frame, ran) = (&*scheduler, AtomicUsize::new(0));
        let outcome = frame.scope(|scope| {
            scope.spawn(|_scope, _worker| {
                let inner = frame.scope(|inner| {
                    inner.spawn(|_inner, _worker| assert_eq!(background.wait(), Ok(Ok(vec![1; 4]))));
                });
                assert_eq!(inner, Ok(()));
                count(&ran);
            });
            scope.spawn(|_scope, _worker| count(&ran));
        });
        assert_eq!((outcome, ran.load(Ordering::Relaxed)), (Ok(()), 2));
    });
}

/// A thief of an inner scope's job spawns into both scopes, and may run either job next.
#[test]
fn shuttle_jobs_for_two_scopes_spawned_under_a_nested_wait_all_run() {
    check_on_schedulers(|scheduler| {
        let [inner_ran, outer_ran] = [(); 2].map(|()| AtomicUsize::new(0));
        let (inner_ran, outer_ran) = (&inner_ran, &outer_ran);
        let outcome = scheduler.scope(|outer| {
            outer.spawn(move |outer, _worker| {
                let outcome = scheduler.scope(|inner| {
                    for _job in 0..2 {
                        inner.spawn(move |inner, _worker| {
                            inner.spawn(|_inner, _worker| count(inner_ran));
                            outer.spawn(|_outer, _worker| count(outer_ran));
                        });
                    }
                });
                assert_eq!((outcome, inner_ran.load(Ordering::Relaxed)), (Ok(()), 2));
            });
        });
        assert_eq!((outcome, outer_ran.load(Ordering::Relaxed)), (Ok(()), 2));
    });
}

#[test]
fn shuttle_running_and_waiting_for_background_jobs_runs_each_once() {
    check_on_schedulers(|scheduler| {
        let ran = Arc::new(AtomicUsize::new(0));
        let jobs = [(); 3].map(|()| {
            let ran = Arc::clone(&ran);
            scheduler.background(move || count(&ran))
        });
        let (here, outcomes) = thread::scope(|threads| {
            let waiting = threads.spawn(|| jobs.map(|job| job.wait()));
            (scheduler.run_background(Duration::MAX), waiting.join().unwrap())
        });
        assert_eq!(outcomes, [const { Ok(()) }; 3]);
        assert_eq!(ran.load(Ordering::Relaxed), 3);
        assert!(here <= 3);
        assert!(scheduler.shared().background().is_empty(), "a job that was waited for is not queued any more");
    });
}

#[test]
fn shuttle_a_scope_takes_jobs_from_a_thread_that_is_no_worker() {
    check_on_schedulers(|scheduler| {
        let ran = AtomicUsize::new(0);
        let ran = &ran;
        let outcome = scheduler.scope(|scope| {
            scope.spawn(move |scope, _worker| {
                thread::scope(|threads| {
                    threads.spawn(|| {
                        scope.spawn(|_scope, _worker| count(ran));
                        scope.spawn_pinned(|scope, worker| {
                            assert_eq!(worker.index(), 0);
                            scope.spawn(|_scope, _worker| count(ran));
                        });
                    });
                });
            });
        });
        assert_eq!((outcome, ran.load(Ordering::Relaxed)), (Ok(()), 2));
    });
}

#[test]
fn shuttle_a_background_job_drops_the_last_reference_to_its_scheduler() {
    check(|| {
        let scheduler = Arc::new(scheduler(3, 2));
        let ran = Arc::new(AtomicUsize::new(0));
        let jobs = [(); 2].map(|()| {
            let (owned, ran) = (Arc::clone(&scheduler), Arc::clone(&ran));
            scheduler.background(move || {
                assert_eq!(owned.parallel_for(2, 1, |_range, _worker| count(&ran)), Ok(()));
                drop(owned);
            })
        });
        drop(scheduler);
        // Waiting for a job that has not begun runs it here, so this thread may drop the scheduler.
        assert_eq!(jobs.map(|job| job.wait()), [const { Ok(()) }; 2]);
        assert_eq!(ran.load(Ordering::Relaxed), 4);
    });
}

/// Frames take workers from the background and give them back, and the limit changes meanwhile. Nobody waits for the
/// jobs, so a wake-up that is lost leaves them in the queue for ever.
#[test]
fn shuttle_background_jobs_beyond_the_limit_run_when_a_worker_is_free() {
    for limits in [[1, 1], [1, 2], [2, 1], [0, 1]] {
        check(move || {
            let scheduler = Arc::new(scheduler(3, limits[0]));
            let running = Arc::new(AtomicUsize::new(0));
            let jobs = [(); 3].map(|()| {
                let (owned, running) = (Arc::clone(&scheduler), Arc::clone(&running));
                scheduler.background(move || {
                    assert!(running.fetch_add(1, Ordering::Relaxed) < limits[0].max(limits[1]));
                    assert_eq!(owned.parallel_for(2, 1, |_range, _worker| ()), Ok(()));
                    running.fetch_sub(1, Ordering::Relaxed);
                })
            });
            scheduler.parallel_for(3, 1, |_range, _worker| ()).unwrap();
            scheduler.set_background_workers(limits[1]);
            while !jobs.iter().all(|job| job.is_finished()) {
                thread::yield_now();
            }
        });
    }
}

/// A frame and one of its jobs wait for the background. A worker that turns to that job must hand the rest of the
/// background over to the one that sleeps.
#[test]
fn shuttle_a_worker_that_turns_to_a_frame_hands_the_background_over() {
    check(|| {
        let scheduler = scheduler(3, 1);
        let left = Arc::new((Mutex::new(2), Condvar::new()));
        for _job in 0..2 {
            let left = Arc::clone(&left);
            drop(scheduler.background(move || {
                *left.0.lock() -= 1;
                (0..2).for_each(|_waiting| left.1.notify_one());
            }));
        }
        let wait = || {
            let mut count = left.0.lock();
            while *count > 0 {
                count = left.1.wait(count);
            }
        };
        let outcome = scheduler.scope(|scope| {
            scope.spawn(|_scope, _worker| wait());
            wait();
        });
        assert_eq!(outcome, Ok(()));
    });
}
