//! Jobs that wait for their own scopes, for background jobs and for locks. No job waits for ever, and no foreign job
//! runs on top of one that waits.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread;
use std::time::Duration;

use drawloom_jobs::task::{BackgroundJob, Scheduler};

/// Runs `body` on another thread, and fails if it does not end within a time that is long for the slowest machine.
pub fn assert_ends(body: impl FnOnce() + Send + 'static) {
    let (done, is_done) = mpsc::channel();
    let thread = thread::spawn(move || {
        body();
        // The receiver is dropped only after the timeout.
        let _ = done.send(());
    });
    match is_done.recv_timeout(Duration::from_secs(30)) {
        Ok(()) | Err(mpsc::RecvTimeoutError::Disconnected) => thread.join().unwrap(),
        Err(mpsc::RecvTimeoutError::Timeout) => panic!("the test waits for ever"),
    }
}

#[derive(Default)]
struct Flag(AtomicBool);

impl Flag {
    fn raise(&self) {
        self.0.store(true, Ordering::Release);
    }

    fn wait(&self) {
        while !self.0.load(Ordering::Acquire) {
            thread::sleep(Duration::from_micros(100));
        }
    }
}

/// Waits for the background job in a frame's job, and lets the worker that helps with the background job continue. That
/// worker may find the frame's job.
fn wait_in_a_frame(scheduler: &Scheduler, background: BackgroundJob<()>, may_go_on: &Flag) {
    let waits = Flag::default();
    let outcome = scheduler.scope(|scope| {
        scope.spawn(|_scope, _worker| {
            waits.raise();
            assert_eq!(background.wait(), Ok(()));
        });
        may_go_on.raise();
        waits.wait();
    });
    assert_eq!(outcome, Ok(()));
}

/// A scheduler with two threads, both of which run background jobs at the same time.
fn two_in_background() -> Arc<Scheduler> {
    let scheduler = Scheduler::new(3).unwrap();
    scheduler.set_background_workers(2);
    Arc::new(scheduler)
}

/// A worker runs a job of a background job's scope, and then a frame's job that waits for that background job.
#[test]
fn a_worker_that_has_helped_a_background_job_may_wait_for_it() {
    assert_ends(|| {
        let scheduler = two_in_background();
        let [helped, may_go_on] = [(); 2].map(|()| Arc::new(Flag::default()));
        let background = scheduler.background({
            let (scheduler, helped, may_go_on) = (Arc::clone(&scheduler), Arc::clone(&helped), Arc::clone(&may_go_on));
            move || {
                let helped = &helped;
                let outcome = scheduler.scope(|scope| {
                    scope.spawn(move |_scope, _worker| {
                        helped.raise();
                        may_go_on.wait();
                    });
                    helped.wait();
                });
                assert_eq!(outcome, Ok(()));
            }
        });
        helped.wait();
        wait_in_a_frame(&scheduler, background, &may_go_on);
    });
}

/// As above, but the token that the background job still waits for is in the queues of the worker that waits for the
/// background job.
#[test]
fn a_worker_that_holds_a_background_loops_token_may_wait_for_that_loop() {
    assert_ends(|| {
        let scheduler = two_in_background();
        let [joined, may_go_on, has_left] = [(); 3].map(|()| Arc::new(Flag::default()));
        let background = scheduler.background({
            let flags = [&joined, &may_go_on, &has_left].map(Arc::clone);
            let scheduler = Arc::clone(&scheduler);
            move || {
                let [joined, may_go_on, has_left] = flags;
                let outcome = scheduler.parallel_for(3, 1, |range, _worker| match range.start {
                    0 => has_left.wait(),
                    1 => {
                        joined.raise();
                        may_go_on.wait();
                        has_left.raise();
                    }
                    _ => {}
                });
                assert_eq!(outcome, Ok(()));
            }
        });
        joined.wait();
        wait_in_a_frame(&scheduler, background, &may_go_on);
    });
}

/// A job holds a lock while it waits for its own scope. A worker runs a job of that scope, and then a job that needs
/// the lock.
#[test]
fn a_lock_may_be_held_over_a_wait() {
    assert_ends(|| {
        let scheduler = &Scheduler::new(2).unwrap();
        let lock = &Mutex::new(());
        let [is_held, has_helped] = &[(); 2].map(|()| Flag::default());
        let outcome = scheduler.scope(|outer| {
            outer.spawn(move |outer, _worker| {
                let _guard = lock.lock().unwrap();
                is_held.raise();
                let outcome = scheduler.scope(|inner| {
                    inner.spawn(move |_inner, _worker| {
                        outer.spawn(move |_outer, _worker| drop(lock.lock().unwrap()));
                        has_helped.raise();
                    });
                    has_helped.wait();
                });
                assert_eq!(outcome, Ok(()));
            });
            is_held.wait();
        });
        assert_eq!(outcome, Ok(()));
    });
}

/// A worker spawns a job into a background job's scope, and begins a frame's job that waits for a scope. A job of that
/// scope waits for the background job. The owner of the background job's scope must find the spawned job.
#[test]
fn a_worker_that_has_helped_a_background_job_may_wait_for_a_job_that_waits_for_it() {
    assert_ends(|| {
        let scheduler = two_in_background();
        let [helped, may_spawn, has_spawned] = [(); 3].map(|()| Arc::new(Flag::default()));
        let background = scheduler.background({
            let flags = [&helped, &may_spawn, &has_spawned].map(Arc::clone);
            let scheduler = Arc::clone(&scheduler);
            move || {
                let [helped, may_spawn, has_spawned] = &flags;
                let outcome = scheduler.scope(|scope| {
                    scope.spawn(move |scope, _worker| {
                        helped.raise();
                        may_spawn.wait();
                        scope.spawn(|_scope, _worker| ());
                        has_spawned.raise();
                    });
                    has_spawned.wait();
                });
                assert_eq!(outcome, Ok(()));
            }
        });
        helped.wait();
        let [begins, waits] = &[(); 2].map(|()| Flag::default());
        let frame = &*scheduler;
        let outcome = scheduler.scope(|scope| {
            scope.spawn(move |_scope, _worker| {
                let outcome = frame.scope(|inner| {
                    inner.spawn(move |_inner, _worker| {
                        waits.raise();
                        assert_eq!(background.wait(), Ok(()));
                    });
                    begins.raise();
                    waits.wait();
                });
                assert_eq!(outcome, Ok(()));
            });
            // The third worker runs the background job, so the worker that has helped with it begins this job.
            may_spawn.raise();
            begins.wait();
        });
        assert_eq!(outcome, Ok(()));
    });
}

/// A job holds a lock while it waits for its own scope. A worker runs a job of that scope, spawns another job into it,
/// and then finds a job first that needs the lock.
#[test]
fn a_job_spawned_into_a_scope_does_not_wait_for_the_next_job_of_the_spawning_worker() {
    assert_ends(|| {
        let scheduler = &Scheduler::new(2).unwrap();
        let lock = &Mutex::new(());
        let [is_held, has_spawned] = &[(); 2].map(|()| Flag::default());
        let outcome = scheduler.scope(|outer| {
            outer.spawn(move |outer, _worker| {
                let _guard = lock.lock().unwrap();
                is_held.raise();
                let outcome = scheduler.scope(|inner| {
                    inner.spawn(move |inner, _worker| {
                        inner.spawn(|_inner, _worker| ());
                        outer.spawn(move |_outer, _worker| drop(lock.lock().unwrap()));
                        has_spawned.raise();
                    });
                    has_spawned.wait();
                });
                assert_eq!(outcome, Ok(()));
            });
            is_held.wait();
        });
        assert_eq!(outcome, Ok(()));
    });
}

#[test]
fn a_job_of_an_outer_scope_does_not_run_inside_the_wait_for_an_inner_one() {
    thread_local! {
        static INSIDE: Cell<bool> = const { Cell::new(false) };
    }
    for workers in [1, 2, 4] {
        let scheduler = &Scheduler::new(workers).unwrap();
        let ran = &AtomicUsize::new(0);
        let outcome = scheduler.scope(|outer| {
            for _ in 0..50 {
                outer.spawn(move |outer, _worker| {
                    assert!(!INSIDE.replace(true));
                    let outcome = scheduler.scope(|_inner| {
                        outer.spawn(|_outer, _worker| {
                            assert!(!INSIDE.get(), "it runs on top of a job that does not wait for it");
                            ran.fetch_add(1, Ordering::Relaxed);
                        });
                    });
                    assert_eq!(outcome, Ok(()));
                    INSIDE.set(false);
                });
            }
        });
        assert_eq!(outcome, Ok(()));
        assert_eq!(ran.load(Ordering::Relaxed), 50);
    }
}

/// A worker steals two jobs out of an overflow at once, and the jobs wait for each other.
#[test]
fn extra_stolen_jobs_are_visible_to_other_workers() {
    assert_ends(|| {
        // A shuffled scheduler keeps all jobs in overflows.
        let scheduler = Scheduler::builder().workers(3).shuffle(1).build().unwrap();
        for _ in 0..20 {
            // Until all workers sleep.
            thread::sleep(Duration::from_millis(5));
            let [started, ended] = &[(); 2].map(|()| AtomicUsize::new(0));
            let outcome = scheduler.scope(|scope| {
                for _ in 0..2 {
                    scope.spawn(move |_scope, _worker| {
                        started.fetch_add(1, Ordering::Relaxed);
                        while started.load(Ordering::Relaxed) < 2 {
                            thread::yield_now();
                        }
                        ended.fetch_add(1, Ordering::Relaxed);
                    });
                }
                while ended.load(Ordering::Relaxed) < 2 {
                    thread::yield_now();
                }
            });
            assert_eq!(outcome, Ok(()));
        }
    });
}

/// The owner of a scope waits inside a job and is idle. Jobs that are spawned into the scope then also run on other
/// workers.
#[test]
fn an_idle_owner_does_not_run_all_jobs_of_its_scope() {
    let scheduler = &Scheduler::new(5).unwrap();
    let by: &[AtomicUsize; 5] = &[const { AtomicUsize::new(0) }; 5];
    let [is_away, is_over] = &[(); 2].map(|()| Flag::default());
    let outcome = scheduler.scope(|outer| {
        outer.spawn(move |_outer, _worker| {
            let outcome = scheduler.scope(|inner| {
                inner.spawn(move |inner, _worker| {
                    is_away.raise();
                    // The owner goes to sleep meanwhile.
                    thread::sleep(Duration::from_millis(20));
                    for _ in 0..200 {
                        inner.spawn(move |_inner, worker| {
                            by[worker.index()].fetch_add(1, Ordering::Relaxed);
                            thread::sleep(Duration::from_millis(1));
                        });
                    }
                });
                is_away.wait();
            });
            assert_eq!(outcome, Ok(()));
            is_over.raise();
        });
        is_over.wait();
    });
    assert_eq!(outcome, Ok(()));
    let by = by.each_ref().map(|jobs| jobs.load(Ordering::Relaxed));
    assert!(by.iter().filter(|&&jobs| jobs > 20).count() >= 2, "200 jobs by worker: {by:?}");
}
