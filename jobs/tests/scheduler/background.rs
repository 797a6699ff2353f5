//! Background jobs: where and when they run, and their results.

use std::collections::HashSet;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread;
use std::time::Duration;

use crate::{assert_intact, eventually, scheduler};

#[test]
fn frames_never_run_background_jobs_on_the_calling_thread() {
    let scheduler = Arc::new(scheduler(3));
    let here = thread::current().id();
    let on_caller = Arc::new(AtomicUsize::new(0));
    let jobs: Vec<_> = (0..12)
        .map(|_job| {
            let (scheduler, on_caller) = (Arc::clone(&scheduler), Arc::clone(&on_caller));
            scheduler.clone().background(move || {
                let record_thread = || {
                    // Long enough for other workers to join.
                    thread::sleep(Duration::from_micros(200));
                    on_caller.fetch_add(usize::from(thread::current().id() == here), Ordering::Relaxed);
                };
                record_thread();
                // Its loops and scopes are background work too.
                scheduler.parallel_for(8, 1, |_range, _worker| record_thread()).unwrap();
                let inner =
                    scheduler.scope(|scope| (0..8).for_each(|_| scope.spawn(|_scope, _worker| record_thread())));
                inner.unwrap();
            })
        })
        .collect();
    let are_finished = || jobs.iter().all(|job| job.is_finished());
    while !are_finished() {
        scheduler.parallel_for(30, 1, |_range, _worker| thread::yield_now()).unwrap();
    }
    assert_eq!(on_caller.load(Ordering::Relaxed), 0);
    assert!(jobs.into_iter().all(|job| job.wait() == Ok(())));
    assert_intact(&scheduler);
}

#[test]
fn with_one_worker_background_jobs_run_only_on_request() {
    let scheduler = scheduler(1);
    let ran = Arc::new(Mutex::new(Vec::new()));
    let jobs: Vec<_> = (0..4)
        .map(|number| {
            let ran = Arc::clone(&ran);
            scheduler.background(move || ran.lock().unwrap().push(number))
        })
        .collect();
    scheduler.parallel_for(10, 1, |_range, _worker| {}).unwrap();
    assert_eq!(*ran.lock().unwrap(), [0; 0], "a frame has run background jobs");
    let mut jobs = jobs.into_iter();
    let third = jobs.by_ref().nth(2).unwrap();
    assert_eq!(third.wait(), Ok(()));
    assert_eq!(*ran.lock().unwrap(), [2], "the awaited job runs before older ones");
    // The handles of the first two have been dropped, and the jobs run nevertheless. The third is not run again.
    assert_eq!(scheduler.run_background(Duration::MAX), 3);
    assert_eq!(*ran.lock().unwrap(), [2, 0, 1, 3]);
    assert!(jobs.all(|job| job.is_finished()));
}

#[test]
fn no_background_job_begins_after_the_budget() {
    let scheduler = scheduler(1);
    let budget = Duration::from_millis(5);
    let _jobs = [(); 3].map(|()| scheduler.background(move || thread::sleep(2 * budget)));
    assert_eq!(scheduler.run_background(Duration::ZERO), 0);
    assert_eq!(scheduler.run_background(budget), 1);
    assert_eq!(scheduler.run_background(Duration::MAX), 2);
}

#[test]
fn waiting_returns_the_panic_of_the_job() {
    for workers in [1, 3] {
        let scheduler = scheduler(workers);
        let job = scheduler.background(|| panic!("in the background"));
        let outcome: Result<(), _> = job.wait();
        assert_eq!(outcome.unwrap_err().message, "in the background");
        // No thread waits for this job.
        drop(scheduler.background(|| panic!("not waited for")));
        scheduler.run_background(Duration::MAX);
        assert_intact(&scheduler);
    }
}

#[test]
fn a_waiting_thread_sleeps_until_a_running_job_ends() {
    let scheduler = scheduler(2);
    for _round in 0..20 {
        let (go, may_go) = mpsc::channel::<()>();
        let has_begun = Arc::new(AtomicBool::new(false));
        let begun = Arc::clone(&has_begun);
        let job = scheduler.background(move || {
            begun.store(true, Ordering::Relaxed);
            may_go.recv().unwrap();
            7
        });
        assert!(eventually(|| has_begun.load(Ordering::Relaxed)));
        assert!(!job.is_finished());
        let waiting = thread::spawn(|| job.wait());
        go.send(()).unwrap();
        assert_eq!(waiting.join().unwrap(), Ok(7));
    }
}

/// How many background jobs run at once, while each waits until `go_on` is set. They are queued before the limit is
/// set.
fn running_at_once(workers: usize, limit: Option<usize>, jobs: usize) -> usize {
    let scheduler = scheduler(workers);
    let [running, most] = [(); 2].map(|()| Arc::new(AtomicUsize::new(0)));
    let go_on = Arc::new(AtomicBool::new(false));
    if limit.is_some() {
        // Nothing begins before the limit is set, and then all that may begin does.
        scheduler.set_background_workers(0);
    }
    let jobs: Vec<_> = (0..jobs)
        .map(|_job| {
            let (running, most, go_on) = (Arc::clone(&running), Arc::clone(&most), Arc::clone(&go_on));
            scheduler.background(move || {
                most.fetch_max(running.fetch_add(1, Ordering::Relaxed) + 1, Ordering::Relaxed);
                assert!(eventually(|| go_on.load(Ordering::Relaxed)));
                running.fetch_sub(1, Ordering::Relaxed);
            })
        })
        .collect();
    let expected = limit.unwrap_or((workers / 4).max(1)).min(workers - 1).min(jobs.len());
    if let Some(limit) = limit {
        scheduler.set_background_workers(limit);
    }
    assert!(eventually(|| running.load(Ordering::Relaxed) == expected), "{running:?} of {expected} jobs run");
    // What holds a worker that the limit keeps free would show here: jobs of a frame that need all of those at once.
    let free = workers - expected;
    let (inside, frame) = (AtomicUsize::new(0), &scheduler);
    let outcome = frame.scope(|scope| {
        for _job in 0..free {
            scope.spawn(|_scope, _worker| {
                inside.fetch_add(1, Ordering::Relaxed);
                assert!(eventually(|| inside.load(Ordering::Relaxed) == free), "a worker is not free for the frame");
            });
        }
    });
    assert_eq!(outcome, Ok(()));
    go_on.store(true, Ordering::Relaxed);
    if limit == Some(0) {
        assert_eq!(scheduler.run_background(Duration::MAX), jobs.len(), "on this thread they run nevertheless");
    }
    assert!(eventually(|| jobs.iter().all(|job| job.is_finished())), "all run in the end");
    assert!(jobs.into_iter().all(|job| job.wait() == Ok(())));
    assert_intact(&scheduler);
    most.load(Ordering::Relaxed)
}

#[test]
fn long_background_jobs_leave_workers_to_frames() {
    for (workers, limit) in [(2, 1), (3, 1), (4, 1), (8, 2), (9, 2)] {
        assert_eq!(running_at_once(workers, None, 12), limit, "{workers} workers");
    }
}

#[test]
fn an_engine_sets_how_many_workers_run_background_jobs() {
    for limit in [0, 1, 2, 3, 4, usize::MAX] {
        // With 0 this thread runs one after another.
        assert_eq!(running_at_once(5, Some(limit), 7), limit.clamp(1, 4), "a limit of {limit}");
    }
}

/// The parts of one background job, a loop or a scope, count as much as jobs do.
#[test]
fn parts_of_a_background_job_leave_workers_to_frames() {
    for limit in [1, 2, 4] {
        let scheduler = Arc::new(scheduler(5));
        scheduler.set_background_workers(limit);
        let threads = Arc::new(Mutex::new(HashSet::new()));
        let job = scheduler.background({
            let (scheduler, threads) = (Arc::clone(&scheduler), Arc::clone(&threads));
            move || {
                let part = || {
                    threads.lock().unwrap().insert(thread::current().id());
                    thread::sleep(Duration::from_micros(300));
                };
                scheduler.scope(|scope| (0..40).for_each(|_| scope.spawn(|_scope, _worker| part()))).unwrap();
                scheduler.parallel_for(40, 1, |_range, _worker| part()).unwrap();
            }
        });
        assert!(eventually(|| job.is_finished()));
        assert_eq!(job.wait(), Ok(()));
        // A thread may give its slot to another one between two parts, so more threads than slots may have run some.
        let used = threads.lock().unwrap().len();
        assert!(used <= 4 && (limit > 1 || used == 1), "{used} threads with a limit of {limit}");
    }
}

/// A worker that frees its slot for a frame's job wakes another one for the jobs that are left.
#[test]
fn a_worker_that_goes_on_with_a_frame_hands_the_background_over() {
    for _round in 0..50 {
        let scheduler = scheduler(3);
        let jobs = [(); 6].map(|()| scheduler.background(|| thread::sleep(Duration::from_micros(50))));
        let outcome = scheduler.parallel_for(6, 1, |_range, _worker| thread::sleep(Duration::from_micros(50)));
        assert_eq!(outcome, Ok(()));
        assert!(eventually(|| jobs.iter().all(|job| job.is_finished())));
        drop(jobs);
    }
}
