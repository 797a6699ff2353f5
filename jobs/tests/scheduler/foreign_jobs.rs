//! A thread that waits inside a job runs jobs that belong to that job, and no foreign jobs.

use std::cell::RefCell;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Barrier, Mutex};
use std::thread;

use drawloom_jobs::graph::{Closure, FrameGraph};
use drawloom_jobs::task::{Scheduler, Scope, Worker};

use crate::{eventually, scheduler};

thread_local! {
    /// The families of the jobs that are running on this thread, the innermost last.
    static WITHIN: RefCell<Vec<usize>> = const { RefCell::new(Vec::new()) };
}

/// Calls `job` as a job of a family. It may run only on top of jobs of the same family; other jobs are counted as
/// foreign.
fn run_in_family(family: usize, foreign: &AtomicUsize, job: impl FnOnce()) {
    WITHIN.with_borrow_mut(|within| {
        if within.iter().any(|&other| other != family) {
            foreign.fetch_add(1, Ordering::Relaxed);
        }
        within.push(family);
    });
    job();
    WITHIN.with_borrow_mut(|within| within.pop());
}

/// Waits inside a job for a scope, a loop or a graph. All of its jobs belong to the job's family.
fn wait_inside(scheduler: &Scheduler, family: usize, foreign: &AtomicUsize) {
    let child = |_: Range<usize>, _: &Worker| run_in_family(family, foreign, thread::yield_now);
    match family % 3 {
        0 => scheduler.parallel_for(8, 1, child).unwrap(),
        1 => scheduler
            .scope(|scope| {
                for _child in 0..4 {
                    scope.spawn(|scope, _worker| {
                        scope.spawn(|_scope, worker| child(0..1, worker));
                        scope.spawn_pinned(|_scope, worker| child(0..1, worker));
                    });
                }
            })
            .unwrap(),
        _ => {
            let mut graph = FrameGraph::new();
            let child = |(): &(), range: Range<usize>, worker: &Worker| {
                child(range, worker);
                Ok(())
            };
            let [first, wide, pinned] = [
                graph.add("first", Closure::new(child)),
                graph.add("wide", Closure::new(child).with_width(|()| 6)),
                graph.add("pinned", Closure::new(child).on_calling_thread()),
            ];
            graph.order(first, wide);
            graph.order(first, pinned);
            [wide, pinned].into_iter().for_each(|node| graph.keep(node));
            let mut schedule = graph.compile().expect("the graph is valid");
            schedule.always_parallel(true);
            schedule.run(scheduler, &()).unwrap();
        }
    }
}

#[test]
fn a_job_that_waits_runs_no_foreign_jobs() {
    for workers in [1, 2, 4] {
        let scheduler = scheduler(workers);
        let foreign = AtomicUsize::new(0);
        for _round in 0..60 {
            scheduler
                .scope(|scope| {
                    for family in 0..24 {
                        let (scheduler, foreign) = (&scheduler, &foreign);
                        scope.spawn(move |_scope, _worker| {
                            run_in_family(family, foreign, || wait_inside(scheduler, family, foreign));
                        });
                    }
                })
                .unwrap();
        }
        assert_eq!(foreign.into_inner(), 0, "{workers} workers");
    }
}

#[test]
fn jobs_of_an_outer_scope_do_not_run_in_an_inner_wait() {
    for workers in [1, 2, 4] {
        let scheduler = scheduler(workers);
        let (foreign, ran) = (AtomicUsize::new(0), AtomicUsize::new(0));
        for _round in 0..20 {
            scheduler
                .scope(|outer| {
                    for family in 0..8 {
                        let (scheduler, foreign, ran) = (&scheduler, &foreign, &ran);
                        outer.spawn(move |outer, _worker| {
                            run_in_family(family, foreign, || {
                                // A job of another family, which the inner scope does not wait for.
                                let spawn = || {
                                    outer.spawn(move |_scope, _worker| {
                                        run_in_family(family + 100, foreign, || {
                                            ran.fetch_add(1, Ordering::Relaxed);
                                        });
                                    });
                                };
                                let inner = scheduler.scope(|inner| {
                                    inner.spawn(|_scope, _worker| run_in_family(family, foreign, thread::yield_now));
                                    spawn();
                                    inner.spawn(|_scope, _worker| run_in_family(family, foreign, thread::yield_now));
                                });
                                inner.unwrap();
                            });
                        });
                    }
                })
                .unwrap();
        }
        assert_eq!((foreign.into_inner(), ran.into_inner()), (0, 20 * 8), "{workers} workers");
    }
}

#[test]
fn an_idle_owner_runs_jobs_that_a_stealing_worker_spawns_into_its_scope() {
    let scheduler = scheduler(2);
    for _round in 0..50 {
        let (together, has_run) = (Barrier::new(2), AtomicBool::new(false));
        let ran_on = Mutex::new(Vec::new());
        let pinned = |_: &Scope<'_>, _: &Worker| {
            // The owner waits inside a job, so it does not steal, and finds the stealing worker's jobs in its mailbox.
            let inner = scheduler.scope(|scope| {
                scope.spawn(|scope, stealing| {
                    together.wait();
                    thread::yield_now();
                    for _job in 0..1_000 {
                        scope.spawn(|_scope, worker| {
                            ran_on.lock().unwrap().push(worker.index());
                            has_run.store(true, Ordering::Relaxed);
                        });
                        if has_run.load(Ordering::Relaxed) {
                            break;
                        }
                        thread::sleep(std::time::Duration::from_millis(1));
                    }
                    assert!(
                        eventually(|| has_run.load(Ordering::Relaxed)),
                        "no worker helps worker {}",
                        stealing.index()
                    );
                });
                together.wait();
            });
            inner.unwrap();
        };
        scheduler.scope(|scope| scope.spawn_pinned(pinned)).unwrap();
        assert_eq!(ran_on.into_inner().unwrap()[0], 0, "the owner runs the first job");
    }
}
