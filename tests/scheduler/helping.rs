//! What a thread does while it waits in the midst of a job: what belongs to that job, and nothing else.

use std::{
    cell::RefCell,
    ops::Range,
    sync::{
        Barrier, Mutex,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread,
};

use drawloom::{
    graph::{Closure, FrameGraph},
    task::{Scheduler, Scope, Worker},
};

use crate::{eventually, scheduler};

thread_local! {
    /// The families whose jobs this thread is in the midst of, the innermost last.
    static WITHIN: RefCell<Vec<usize>> = const { RefCell::new(Vec::new()) };
}

/// Calls `job` as one of a family. It may lie on top of others of that family, and of no other.
fn as_one_of(family: usize, strangers: &AtomicUsize, job: impl FnOnce()) {
    WITHIN.with_borrow_mut(|within| {
        if within.iter().any(|&other| other != family) {
            strangers.fetch_add(1, Ordering::Relaxed);
        }
        within.push(family);
    });
    job();
    WITHIN.with_borrow_mut(|within| within.pop());
}

/// Something to do inside of a job: a scope, a loop or a graph, all of whose jobs are of its family.
fn wait_inside(scheduler: &Scheduler, family: usize, strangers: &AtomicUsize) {
    let child = |_: Range<usize>, _: &Worker| as_one_of(family, strangers, thread::yield_now);
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
            [wide, pinned].into_iter().for_each(|process| graph.keep(process));
            let mut schedule = graph.compile().expect("nothing is wrong");
            schedule.always_parallel(true);
            schedule.run(scheduler, &()).unwrap();
        }
    }
}

#[test]
fn who_waits_in_a_job_runs_nothing_else() {
    for workers in [1, 2, 4] {
        let scheduler = scheduler(workers);
        let strangers = AtomicUsize::new(0);
        for _round in 0..60 {
            scheduler
                .scope(|scope| {
                    for family in 0..24 {
                        let (scheduler, strangers) = (&scheduler, &strangers);
                        scope.spawn(move |_scope, _worker| {
                            as_one_of(family, strangers, || wait_inside(scheduler, family, strangers));
                        });
                    }
                })
                .unwrap();
        }
        assert_eq!(strangers.into_inner(), 0, "{workers} workers");
    }
}

#[test]
fn what_is_spawned_into_an_outer_scope_does_not_run_in_an_inner_wait() {
    for workers in [1, 2, 4] {
        let scheduler = scheduler(workers);
        let (strangers, ran) = (AtomicUsize::new(0), AtomicUsize::new(0));
        for _round in 0..20 {
            scheduler
                .scope(|outer| {
                    for family in 0..8 {
                        let (scheduler, strangers, ran) = (&scheduler, &strangers, &ran);
                        outer.spawn(move |outer, _worker| {
                            as_one_of(family, strangers, || {
                                // Another family's, and nobody waits for it in here.
                                let spawn = || {
                                    outer.spawn(move |_scope, _worker| {
                                        as_one_of(family + 100, strangers, || {
                                            ran.fetch_add(1, Ordering::Relaxed);
                                        });
                                    });
                                };
                                let inner = scheduler.scope(|inner| {
                                    inner.spawn(|_scope, _worker| as_one_of(family, strangers, thread::yield_now));
                                    spawn();
                                    inner.spawn(|_scope, _worker| as_one_of(family, strangers, thread::yield_now));
                                });
                                inner.unwrap();
                            });
                        });
                    }
                })
                .unwrap();
        }
        assert_eq!((strangers.into_inner(), ran.into_inner()), (0, 20 * 8), "{workers} workers");
    }
}

#[test]
fn an_owner_with_nothing_to_do_gets_jobs_that_a_thief_spawns_into_its_scope() {
    let scheduler = scheduler(2);
    for _round in 0..50 {
        let (together, is_there) = (Barrier::new(2), AtomicBool::new(false));
        let ran_on = Mutex::new(Vec::new());
        let midst = |_: &Scope<'_>, _: &Worker| {
            // In a job of its own the owner steals nothing, so it finds what the other one spawns in its mailbox.
            let inner = scheduler.scope(|scope| {
                scope.spawn(|scope, thief| {
                    together.wait();
                    thread::yield_now();
                    for _job in 0..1_000 {
                        scope.spawn(|_scope, worker| {
                            ran_on.lock().unwrap().push(worker.index());
                            is_there.store(true, Ordering::Relaxed);
                        });
                        if is_there.load(Ordering::Relaxed) {
                            break;
                        }
                        thread::sleep(std::time::Duration::from_millis(1));
                    }
                    assert!(eventually(|| is_there.load(Ordering::Relaxed)), "worker {} is left alone", thief.index());
                });
                together.wait();
            });
            inner.unwrap();
        };
        scheduler.scope(|scope| scope.spawn_pinned(midst)).unwrap();
        assert_eq!(ran_on.into_inner().unwrap()[0], 0, "the first is the owner's");
    }
}
