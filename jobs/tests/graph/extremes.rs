//! Empty runs, long runs, and runs inside runs.

use std::cell::Cell;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use drawloom_jobs::graph::{Closure, FrameGraph};
use drawloom_jobs::task::Worker;

use crate::SCHEDULERS;
use crate::run::{run, single};

#[test]
fn an_empty_schedule_runs() {
    let mut schedule = FrameGraph::<Closure<'_, ()>>::new().compile().expect("the graph is valid");
    for scheduler in SCHEDULERS.iter() {
        run(&mut schedule, scheduler, &());
    }
}

#[test]
fn a_million_items_are_counted() {
    let mut schedule = single(
        Closure::new(|sum: &AtomicUsize, range: Range<usize>, _| {
            sum.fetch_add(range.sum::<usize>(), Ordering::Relaxed);
            Ok(())
        })
        .with_width(|_| 1_000_001)
        .with_chunk(7),
    );
    for scheduler in SCHEDULERS.iter() {
        let sum = AtomicUsize::new(0);
        run(&mut schedule, scheduler, &sum);
        assert_eq!(sum.into_inner(), 1_000_000 * 1_000_001 / 2);
    }
}

#[test]
fn the_widest_node_is_split_without_overflow() {
    let third = usize::MAX / 3 + 1;
    let whole = std::iter::once(0..usize::MAX).collect();
    for (chunk, expected) in [(usize::MAX, whole), (third, vec![0..third, third..2 * third, 2 * third..usize::MAX])] {
        let body = |done: &Mutex<Vec<Range<usize>>>, range: Range<usize>, _: &Worker| {
            done.lock().map_err(|_| "poisoned")?.push(range);
            Ok(())
        };
        let mut schedule = single(Closure::new(body).with_width(|_| usize::MAX).with_chunk(chunk));
        for scheduler in SCHEDULERS.iter() {
            let done = Mutex::new(Vec::new());
            run(&mut schedule, scheduler, &done);
            let mut done = done.into_inner().expect("no thread panics");
            done.sort_unstable_by_key(|range| range.start);
            assert_eq!(done, expected);
        }
    }
}

#[test]
fn chains_of_a_hundred_thousand_nodes_run() {
    const LENGTH: usize = 100_000;
    for width in [0, 1] {
        let mut graph = FrameGraph::new();
        let mut before = graph.resource("start");
        graph.import(before);
        for index in 0..LENGTH {
            let node = graph.add(
                format!("link {index}"),
                Closure::new(|count: &AtomicUsize, _, _| {
                    count.fetch_add(1, Ordering::Relaxed);
                    Ok(())
                })
                .with_width(move |_| width),
            );
            graph.read(node, before);
            before = graph.resource(format!("after {index}"));
            graph.write(node, before);
        }
        graph.output(before);
        let mut schedule = graph.compile().expect("the graph is valid");
        assert_eq!(schedule.len(), LENGTH);
        for scheduler in &SCHEDULERS[..2] {
            let count = AtomicUsize::new(0);
            run(&mut schedule, scheduler, &count);
            assert_eq!(count.into_inner(), width * LENGTH);
        }
    }
}

#[test]
fn a_waiting_chunk_runs_no_other_chunk_of_its_node() {
    thread_local! {
        static INSIDE: Cell<bool> = const { Cell::new(false) };
    }
    let scheduler = &SCHEDULERS[2];
    let nested = AtomicUsize::new(0);
    let mut schedule = single(
        Closure::new(|(): &(), _, opener: &Worker| {
            if INSIDE.replace(true) {
                nested.fetch_add(1, Ordering::Relaxed);
            }
            let opener = opener.index();
            let is_taken = AtomicBool::new(false);
            // Gives other workers time to steal the job, which takes a while there, so that this worker has to wait.
            scheduler.scope(|scope| {
                scope.spawn(|_, worker| {
                    is_taken.store(true, Ordering::Relaxed);
                    if worker.index() != opener {
                        (0..20).for_each(|_| thread::yield_now());
                    }
                });
                (0..50).take_while(|_| !is_taken.load(Ordering::Relaxed)).for_each(|_| thread::yield_now());
            })?;
            INSIDE.set(false);
            Ok(())
        })
        .with_width(|()| 500),
    );
    for _ in 0..10 {
        run(&mut schedule, scheduler, &());
    }
    assert_eq!(nested.load(Ordering::Relaxed), 0);
}

#[test]
fn a_schedule_runs_inside_another() {
    let scheduler = &SCHEDULERS[2];
    let count = AtomicUsize::new(0);
    let mut schedule = single(
        Closure::new(|(): &(), _, _| {
            let inner = |_: &(), _: Range<usize>, _: &Worker| {
                count.fetch_add(1, Ordering::Relaxed);
                Ok(())
            };
            single(Closure::new(inner).with_width(|()| 20)).run(scheduler, &())?;
            Ok(())
        })
        .with_width(|()| 20),
    );
    run(&mut schedule, scheduler, &());
    assert_eq!(count.load(Ordering::Relaxed), 400);
}
