//! Background jobs: where and when they run, and their results.

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
