//! The guarantees of the job system, compared with plain loops and counts.

mod background;
mod callbacks;
mod foreign_jobs;
mod loops;
mod panics;
mod pools;
mod stress;
mod waits;

use std::collections::HashSet;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Barrier, Mutex};
use std::thread::{self, ThreadId};
use std::time::Duration;

use drawloom_jobs::task::{Scheduler, SchedulerError, Scope};
use proptest::prelude::{ProptestConfig, prop_assert, prop_assert_eq, proptest};

fn scheduler(workers: usize) -> Scheduler {
    Scheduler::new(workers).expect("threads can be started")
}

/// Asserts that every worker of the scheduler still runs jobs.
fn assert_intact(scheduler: &Scheduler) {
    let together = Barrier::new(scheduler.workers());
    let outcome = scheduler.parallel_for(scheduler.workers(), 1, |_range, _worker| {
        together.wait();
    });
    assert_eq!(outcome, Ok(()));
}

/// Waits until the condition holds, with a timeout that suffices on the slowest machine. Returns whether it holds.
fn eventually(condition: impl Fn() -> bool) -> bool {
    (0..10_000).any(|_attempt| {
        condition() || {
            thread::sleep(Duration::from_millis(1));
            false
        }
    })
}

/// The number of visits of each item by a loop over `length` items, and the ranges of its chunks.
fn visits(scheduler: &Scheduler, length: usize, chunk: usize) -> (Vec<usize>, Vec<Range<usize>>) {
    let visited: Vec<AtomicUsize> = (0..length).map(|_| AtomicUsize::new(0)).collect();
    let ranges = Mutex::new(Vec::new());
    let outcome = scheduler.parallel_for(length, chunk, |range, _worker| {
        for index in range.clone() {
            visited[index].fetch_add(1, Ordering::Relaxed);
        }
        ranges.lock().unwrap().push(range);
    });
    assert_eq!(outcome, Ok(()));
    (visited.into_iter().map(AtomicUsize::into_inner).collect(), ranges.into_inner().unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn a_loop_visits_each_index_exactly_once(length in 0_usize..3_000, chunk in 0_usize..200) {
        for workers in [1, 2, 4, 7] {
            let (visited, mut ranges) = visits(&scheduler(workers), length, chunk);
            prop_assert!(visited.iter().all(|&count| count == 1));
            ranges.sort_by_key(|range| range.start);
            let plain: Vec<_> = (0..length).step_by(chunk.max(1)).map(|start| start..(start + chunk.max(1)).min(length)).collect();
            prop_assert_eq!(ranges, plain);
        }
    }
}

#[test]
fn an_empty_loop_does_not_call_its_body() {
    let outcome = scheduler(2).parallel_for(0, 0, |_range, _worker| panic!("the loop is empty"));
    assert_eq!(outcome, Ok(()));
}

#[test]
fn a_loop_of_usize_max_visits_the_last_index() {
    for workers in [1, 4] {
        let ranges = Mutex::new(Vec::new());
        let quarter = usize::MAX / 4;
        scheduler(workers)
            .parallel_for(usize::MAX, quarter, |range, _worker| ranges.lock().unwrap().push(range))
            .unwrap();
        let mut ranges = ranges.into_inner().unwrap();
        ranges.sort_by_key(|range| range.start);
        assert_eq!(ranges.len(), 5);
        assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start));
        assert_eq!((ranges[0].start, ranges[4].end), (0, usize::MAX));
    }
}

#[test]
fn workers_have_an_index_each_and_the_caller_has_the_first() {
    let scheduler = scheduler(4);
    assert_eq!(scheduler.workers(), 4);
    let together = Barrier::new(4);
    let workers = Mutex::new(Vec::new());
    scheduler
        .parallel_for(4, 1, |_range, worker| {
            // Four chunks that wait for each other need four workers.
            together.wait();
            workers.lock().unwrap().push((worker.index(), thread::current().id()));
        })
        .unwrap();
    let mut workers = workers.into_inner().unwrap();
    workers.sort_by_key(|&(index, _)| index);
    assert_eq!(workers.iter().map(|&(index, _)| index).collect::<Vec<_>>(), [0, 1, 2, 3]);
    assert_eq!(workers[0].1, thread::current().id());
    assert_eq!(workers.iter().map(|&(_, thread)| thread).collect::<HashSet<_>>().len(), 4);
}

#[test]
fn jobs_borrow_what_outlives_the_scope() {
    let words: Vec<String> = (0..100).map(|number| number.to_string()).collect();
    let mut lengths = vec![0; words.len()];
    let returned = scheduler(3).scope(|scope| {
        for (word, length) in words.iter().zip(&mut lengths) {
            scope.spawn(move |_scope, _worker| *length = word.len());
        }
        "the body's result"
    });
    assert_eq!(returned, Ok("the body's result"));
    assert_eq!(lengths, words.iter().map(String::len).collect::<Vec<_>>());
}

#[test]
fn captures_are_dropped_before_the_scope_returns() {
    struct Counted<'count>(&'count AtomicUsize);
    impl Drop for Counted<'_> {
        fn drop(&mut self) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }
    let scheduler = scheduler(4);
    for panics in [false, true] {
        let dropped = AtomicUsize::new(0);
        let outcome = scheduler.scope(|scope| {
            for index in 0..200 {
                let counted = Counted(&dropped);
                scope.spawn(move |_scope, _worker| {
                    let _counted = &counted;
                    assert!(!panics || index % 3 != 0, "every third");
                });
            }
        });
        assert_eq!(outcome.is_err(), panics);
        assert_eq!(dropped.into_inner(), 200);
    }
}

fn grow<'scope>(scope: &Scope<'scope>, grown: &'scope AtomicUsize, depth: usize) {
    grown.fetch_add(1, Ordering::Relaxed);
    if depth > 0 {
        for _branch in 0..10 {
            scope.spawn(move |scope, _worker| grow(scope, grown, depth - 1));
        }
    }
}

#[test]
fn jobs_spawn_jobs_into_their_scope() {
    for workers in [1, 2, 4] {
        let grown = AtomicUsize::new(0);
        scheduler(workers).scope(|scope| grow(scope, &grown, 4)).unwrap();
        assert_eq!(grown.into_inner(), 11_111);
    }
}

#[test]
fn scopes_and_loops_nest_on_every_worker() {
    let scheduler = scheduler(4);
    let together = Barrier::new(4);
    let sum = AtomicUsize::new(0);
    scheduler
        .parallel_for(4, 1, |_range, outer| {
            together.wait();
            scheduler
                .scope(|scope| {
                    for _job in 0..5 {
                        scope.spawn(|_scope, _worker| {
                            scheduler
                                .parallel_for(100, 7, |range, _worker| {
                                    sum.fetch_add(range.sum(), Ordering::Relaxed);
                                })
                                .unwrap();
                        });
                    }
                })
                .unwrap();
            let opener = (thread::current().id(), outer.index());
            let pinned = scheduler.scope(|scope| {
                scope.spawn_pinned(move |_scope, inner| assert_eq!((thread::current().id(), inner.index()), opener));
            });
            assert_eq!(pinned, Ok(()));
        })
        .unwrap();
    assert_eq!(sum.into_inner(), 4 * 5 * 4_950);
}

#[test]
fn pinned_jobs_run_on_the_thread_that_opened_their_scope() {
    fn pin<'scope>(scope: &Scope<'scope>, ran: &'scope Mutex<Vec<(ThreadId, usize)>>) {
        scope.spawn_pinned(|_scope, worker| ran.lock().unwrap().push((thread::current().id(), worker.index())));
    }
    let scheduler = scheduler(4);
    let together = Barrier::new(4);
    let ran = Mutex::new(Vec::new());
    scheduler
        .scope(|scope| {
            pin(scope, &ran);
            for _job in 0..4 {
                // The barrier spreads the jobs over four workers, so three of them pin jobs to another worker.
                scope.spawn(|scope, _worker| {
                    together.wait();
                    pin(scope, &ran);
                    scope.spawn_pinned(|scope, _worker| pin(scope, &ran));
                });
            }
        })
        .unwrap();
    assert_eq!(ran.into_inner().unwrap(), vec![(thread::current().id(), 0); 9]);
}

#[test]
fn a_scope_may_be_lent_to_a_thread_that_is_not_a_worker() {
    let scheduler = scheduler(2);
    let ran = AtomicUsize::new(0);
    scheduler
        .scope(|scope| {
            thread::scope(|threads| {
                threads.spawn(|| {
                    for _job in 0..10 {
                        scope.spawn(|_scope, _worker| {
                            ran.fetch_add(1, Ordering::Relaxed);
                        });
                    }
                });
            });
        })
        .unwrap();
    assert_eq!(ran.into_inner(), 10);
}

#[test]
fn threads_take_turns_on_one_scheduler() {
    let scheduler = scheduler(3);
    let (together, busy) = (Barrier::new(4), AtomicBool::new(false));
    thread::scope(|threads| {
        for _thread in 0..4 {
            threads.spawn(|| {
                together.wait();
                for _round in 0..200 {
                    let sum = AtomicUsize::new(0);
                    let outcome = scheduler.scope(|scope| {
                        // Gives the other threads time to find the caller slot taken.
                        thread::yield_now();
                        assert!(!busy.swap(true, Ordering::Relaxed), "two threads are in the caller slot");
                        scope.spawn_pinned(|_scope, _worker| busy.store(false, Ordering::Relaxed));
                        scope.spawn(|_scope, _worker| {
                            sum.fetch_add(1, Ordering::Relaxed);
                        });
                    });
                    assert_eq!((outcome, sum.into_inner()), (Ok(()), 1));
                }
            });
        }
    });
}

#[test]
fn schedulers_nest() {
    let (outer, inner) = (scheduler(3), scheduler(2));
    let together = Barrier::new(3);
    let sum = AtomicUsize::new(0);
    let outcome = outer.parallel_for(3, 1, |_range, on_outer| {
        together.wait();
        let index = on_outer.index();
        for _round in 0..20 {
            let outcome = inner.scope(|scope| {
                scope.spawn(|_scope, on_inner| {
                    assert!(on_inner.index() < 2);
                    sum.fetch_add(1, Ordering::Relaxed);
                });
                // The thread is a worker of both schedulers, and still the same worker of the outer one.
                let again = outer.parallel_for(1, 1, |_range, worker| assert_eq!(worker.index(), index));
                assert_eq!(again, Ok(()));
            });
            assert_eq!(outcome, Ok(()));
        }
    });
    assert_eq!((outcome, sum.into_inner()), (Ok(()), 60));
}

#[test]
fn a_scheduler_may_have_many_more_workers_than_cores() {
    let scheduler = scheduler(64);
    assert_intact(&scheduler);
    let (visited, _ranges) = visits(&scheduler, 10_000, 3);
    assert!(visited.iter().all(|&count| count == 1));
}

#[test]
fn a_scheduler_has_at_least_one_and_at_most_max_workers() {
    assert!(matches!(Scheduler::new(0), Err(SchedulerError::NoWorkers)));
    assert!(matches!(Scheduler::new(usize::MAX), Err(SchedulerError::TooManyWorkers { workers: usize::MAX })));
    assert!(Scheduler::with_available_parallelism().unwrap().workers() >= 1);
}

#[test]
fn a_pinned_job_does_not_keep_another_job_from_a_sleeping_worker() {
    let scheduler = scheduler(3);
    let (begun, elsewhere) = (AtomicBool::new(false), AtomicBool::new(false));
    let outcome = scheduler.scope(|scope| {
        scope.spawn(|scope, worker| {
            elsewhere.store(worker.index() != 0, Ordering::SeqCst);
            // Long enough for the others to fall asleep, the owner last. Otherwise the test is vacuous.
            thread::sleep(Duration::from_millis(30));
            scope.spawn(|_scope, _worker| begun.store(true, Ordering::SeqCst));
            // The pinned job waits for the other job, and so does this one, so only the third worker can run that.
            scope.spawn_pinned(|_scope, _worker| assert!(eventually(|| begun.load(Ordering::SeqCst))));
            assert!(eventually(|| begun.load(Ordering::SeqCst)));
        });
        // This worker runs no jobs until another worker has begun the job.
        eventually(|| elsewhere.load(Ordering::SeqCst));
        thread::sleep(Duration::from_millis(10));
    });
    assert_eq!(outcome, Ok(()));
}

#[cfg(target_os = "linux")]
#[test]
fn a_dropped_scheduler_leaves_no_thread() {
    /// The number of threads of this process with the name.
    fn threads_named(name: &str) -> usize {
        let tasks = std::fs::read_dir("/proc/self/task").unwrap();
        // A thread of another test may end after it was listed and before its name is read.
        let names = tasks.filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("comm")).ok());
        names.filter(|found| found.trim() == name).count()
    }
    // No other test has this many workers, so only this one starts threads of this name.
    let (workers, last) = (66, "drawloom-65");
    for _scheduler in 0..60 {
        let scheduler = scheduler(workers);
        assert_eq!(scheduler.parallel_for(2, 1, |_range, _worker| {}), Ok(()));
    }
    // A joined thread may be listed for a moment longer; a leaked one would be listed for ever.
    assert!(eventually(|| threads_named(last) == 0));
    let intact = scheduler(workers);
    assert_intact(&intact);
    assert_eq!(threads_named(last), 1);
}

/// The test would time out if finding a job took a search among all others.
#[test]
fn a_million_pinned_jobs_run_in_linear_time() {
    const JOBS: usize = if cfg!(debug_assertions) { 200_000 } else { 1_000_000 };
    waits::assert_ends(|| {
        for workers in [1, 2] {
            let scheduler = scheduler(workers);
            let ran = AtomicUsize::new(0);
            let outcome = scheduler.scope(|outer| {
                // The jobs of the outer scope wait meanwhile.
                (0..JOBS)
                    .for_each(|_job| outer.spawn_pinned(|_scope, _worker| _ = ran.fetch_add(1, Ordering::Relaxed)));
                let inner = scheduler.scope(|inner| {
                    for _job in 0..JOBS {
                        inner.spawn_pinned(|_scope, _worker| _ = ran.fetch_add(1, Ordering::Relaxed));
                    }
                });
                assert_eq!((inner, ran.load(Ordering::Relaxed)), (Ok(()), JOBS));
            });
            assert_eq!((outcome, ran.into_inner()), (Ok(()), 2 * JOBS));
        }
    });
}

#[test]
fn a_loop_shorter_than_a_wake_up_runs_on_the_caller() {
    let run = |cost| {
        let scheduler = Scheduler::builder().workers(4).wake_up_cost(cost).build().unwrap();
        let by: [AtomicUsize; 4] = Default::default();
        for _frame in 0..20 {
            // Until the other workers sleep.
            thread::sleep(Duration::from_millis(5));
            let outcome = scheduler.parallel_for(256, 1, |range, worker| {
                by[worker.index()].fetch_add(range.len(), Ordering::Relaxed);
                if cost.is_zero() {
                    thread::yield_now();
                }
            });
            assert_eq!(outcome, Ok(()));
        }
        let by = by.map(AtomicUsize::into_inner);
        assert_eq!(by.iter().sum::<usize>(), 20 * 256);
        by[0]
    };
    assert_eq!(run(Duration::from_secs(3600)), 20 * 256);
    // No worker joins every loop in time, but in one of 20 loops some worker does.
    assert!(run(Duration::ZERO) < 20 * 256);
}
