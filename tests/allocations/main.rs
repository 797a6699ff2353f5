//! A steady frame allocates nothing on any thread, neither in graphs nor in loops. Finished jobs release their memory.
//!
//! The allocator of this binary counts for all threads, so everything is in one test. A second test, or the harness
//! that starts it, would be counted too.
//!
//! Queues keep their memory, and allocate only when they hold more jobs than ever before. If a worker is late, that may
//! happen in any frame. So the test first fills each queue with more jobs than the frames could put there.

mod absent_features;
mod static_groups;
mod view_names;

use std::alloc::System;
use std::hint::black_box;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Barrier, Mutex};
use std::thread;
use std::time::Duration;

use drawloom::graph::{Closure, FrameGraph, NodeId, Schedule};
use drawloom::task::{Scheduler, Worker, catch};
use fastrand::Rng;
use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// The number of allocations so far, of all threads.
fn allocation_count() -> usize {
    let stats = ALLOCATOR.stats();
    stats.allocations + stats.reallocations
}

/// How many bytes are allocated.
fn allocated_bytes() -> usize {
    let stats = ALLOCATOR.stats();
    stats.bytes_allocated - stats.bytes_deallocated
}

/// More jobs than any frame of this test has at once.
const MAX_JOBS: usize = 600;
const WARM_UP: usize = 50;
const COUNTED: usize = 100;
const ROUNDS: usize = 3;

/// Runs frames, and returns the number of allocations in the best of three rounds. When a thread steals or waits for a
/// lock for the first time, that may allocate, in any frame.
fn allocations_of(mut frame: impl FnMut(usize)) -> usize {
    (0..WARM_UP).for_each(&mut frame);
    let rounds = (0..ROUNDS).map(|_| {
        let before = allocation_count();
        (0..COUNTED).for_each(&mut frame);
        allocation_count() - before
    });
    rounds.min().expect("at least one round")
}

/// The context of a frame, with the work per item.
#[derive(Default)]
struct World {
    work: AtomicUsize,
    items: AtomicUsize,
}

type TestNode = Closure<'static, World>;

fn node() -> TestNode {
    Closure::new(|world: &World, range: Range<usize>, _: &Worker| {
        world.items.fetch_add(range.len(), Ordering::Relaxed);
        (0..world.work.load(Ordering::Relaxed)).for_each(|step| {
            black_box(step);
        });
        Ok(())
    })
}

/// A layered graph of narrow, wide and pinned nodes, each of which depends on some nodes of the layer before.
fn layered(seed: u64, layers: &[usize]) -> Schedule<TestNode> {
    let mut random = Rng::with_seed(seed);
    let mut graph = FrameGraph::new();
    let mut before: Vec<NodeId> = Vec::new();
    for (layer, &width) in layers.iter().enumerate() {
        let nodes: Vec<NodeId> = (0..width)
            .map(|index| {
                let (items, chunk) = (2 + random.usize(..100), 1 + random.usize(..4));
                let payload = match random.usize(..8) {
                    0 => node().on_calling_thread(),
                    1 | 2 => node().with_width(move |_| items).with_chunk(chunk),
                    _ => node(),
                };
                let added = graph.add(format!("{layer} {index}"), payload);
                graph.keep(added);
                for _ in 0..before.len().min(1 + random.usize(..3)) {
                    graph.order(before[random.usize(..before.len())], added);
                }
                added
            })
            .collect();
        before = nodes;
    }
    graph.compile().expect("the graph is valid")
}

/// A root that sleeps for the given time, and then a chain of nodes, the spine. Each makes its successor ready, and a
/// tooth on which nothing depends. So the worker that runs the spine queues all teeth.
fn comb() -> Schedule<Closure<'static, Duration>> {
    let nothing = || Closure::new(|_: &Duration, _, _| Ok(()));
    let mut graph = FrameGraph::new();
    let root = Closure::new(|long: &Duration, _, _| {
        thread::sleep(*long);
        Ok(())
    });
    // Of nodes with equal cost the one that was added first comes first, so the spine does.
    let mut last = graph.add("root", root);
    graph.keep(last);
    let spine_nodes: Vec<NodeId> = (0..MAX_JOBS).map(|index| graph.add(format!("spine {index}"), nothing())).collect();
    for (index, spine_node) in spine_nodes.into_iter().enumerate() {
        graph.order(last, spine_node);
        last = spine_node;
        let tooth = graph.add(format!("tooth {index}"), nothing());
        graph.order(spine_node, tooth);
        graph.keep(spine_node);
        graph.keep(tooth);
    }
    let mut schedule = graph.compile().expect("the graph is valid");
    schedule.always_parallel(true);
    schedule
}

/// A root on which all pinned nodes depend.
fn pinned_nodes() -> Schedule<TestNode> {
    let mut graph = FrameGraph::new();
    let root = graph.add("root", node());
    graph.keep(root);
    for index in 0..MAX_JOBS {
        let pinned = graph.add(format!("pinned {index}"), node().on_calling_thread());
        graph.order(root, pinned);
        graph.keep(pinned);
    }
    let mut schedule = graph.compile().expect("the graph is valid");
    schedule.always_parallel(true);
    schedule
}

/// Makes every worker sleep once, and every queue and mailbox allocate the memory that it will ever need.
fn grow_queues(scheduler: &Scheduler) {
    let together = Barrier::new(scheduler.workers());
    for runner in 0..scheduler.workers() {
        // The other workers have nothing to do meanwhile. A lock allocates when a thread waits for the first time.
        let outcome = scheduler.parallel_for(scheduler.workers(), 1, |_range, worker| {
            together.wait();
            if worker.index() == runner {
                thread::sleep(Duration::from_millis(20));
            }
        });
        assert_eq!(outcome, Ok(()));
        with_others_blocked(scheduler, runner, || {
            pinned_nodes().run(scheduler, &World::default()).unwrap();
            // The costs are unknown, so nothing is urgent.
            let mut schedule = comb();
            // The first run is not measured, and the second is.
            (0..2).for_each(|_| schedule.run(scheduler, &Duration::from_millis(200)).unwrap());
            // Compared with the root all other nodes cost nothing, so all paths are critical, and everything is urgent.
            schedule.run(scheduler, &Duration::ZERO).unwrap();
        });
    }
}

/// Calls `call` on one worker, while the other workers cannot steal from it.
fn with_others_blocked(scheduler: &Scheduler, chosen: usize, call: impl FnMut() + Send) {
    let [begin, end] = [(); 2].map(|()| Barrier::new(scheduler.workers()));
    let call = Mutex::new(call);
    let outcome = scheduler.parallel_for(scheduler.workers(), 1, |_range, worker| {
        begin.wait();
        let outcome = if worker.index() == chosen { catch(|| call.lock().unwrap()()) } else { Ok(()) };
        end.wait();
        outcome.unwrap();
    });
    assert_eq!(outcome, Ok(()));
}

/// The allocations of frames of a graph whose work changes. Heavy frames are too long to run serially.
fn allocations_of_graph(scheduler: &Scheduler, mut schedule: Schedule<TestNode>, always_parallel: bool) -> usize {
    schedule.always_parallel(always_parallel);
    let world = World::default();
    let allocations = allocations_of(|frame| {
        world.work.store(if frame % 5 == 4 { 200 } else { 0 }, Ordering::Relaxed);
        schedule.run(scheduler, &world).unwrap();
    });
    assert!(world.items.into_inner() >= schedule.len() * (WARM_UP + ROUNDS * COUNTED), "every item ran");
    allocations
}

/// Background jobs that were waited for before they began leave the queue, even if no worker takes jobs from it.
fn check_that_waiting_frees_memory(workers: usize) {
    const JOBS: usize = 1_000;
    const RESULT: usize = 16_384;
    let scheduler = Scheduler::new(workers).unwrap();
    let wait_for_all = || {
        for job in 0..JOBS {
            assert_eq!(scheduler.background(move || [job as u8; RESULT]).wait(), Ok([job as u8; RESULT]));
        }
    };
    wait_for_all();
    let before = allocated_bytes();
    wait_for_all();
    let left = allocated_bytes().saturating_sub(before);
    assert!(left < 2 * RESULT, "{workers} workers: {JOBS} jobs that were waited for leave {left} bytes allocated");
}

fn a_steady_frame_allocates_nothing() {
    [1, 2].into_iter().for_each(check_that_waiting_frees_memory);

    // The allocator counts on every thread.
    let before = allocation_count();
    thread::spawn(|| drop(black_box(Box::new(7)))).join().unwrap();
    assert!(allocation_count() > before);

    let scheduler = Scheduler::builder().workers(2).build().unwrap();
    grow_queues(&scheduler);

    let mut found = Vec::new();
    let mut check = |case: String, allocations: usize| {
        found.extend((allocations > 0).then(|| format!("{case}: {allocations}")));
    };
    for (seed, layers) in [&[1, 12, 3, 30, 7, 1][..], &[5, 100, 2, 150, 40], &[200, 1, 200]].into_iter().enumerate() {
        for always_parallel in [true, false] {
            let allocations = allocations_of_graph(&scheduler, layered(seed as u64, layers), always_parallel);
            check(format!("layers of {layers:?}, always parallel: {always_parallel}"), allocations);
        }
    }
    let mut schedule = comb();
    let mut allocations = 0;
    with_others_blocked(&scheduler, 0, || {
        allocations = allocations_of(|_frame| schedule.run(&scheduler, &Duration::ZERO).unwrap());
    });
    check("more jobs than fit into a deque".to_owned(), allocations);
    let allocations = allocations_of(|_frame| schedule.run(&scheduler, &Duration::ZERO).unwrap());
    check("the same while others steal".to_owned(), allocations);
    for (length, chunk) in [(1_000, 1), (1_000, 7), (2, 1), (1, 1)] {
        let sum = AtomicUsize::new(0);
        let allocations = allocations_of(|_frame| {
            let body = |range: Range<usize>, _: &Worker| {
                sum.fetch_add(range.len(), Ordering::Relaxed);
            };
            scheduler.parallel_for(length, chunk, body).unwrap();
        });
        check(format!("a loop over {length} by {chunk}"), allocations);
        assert_eq!(sum.into_inner(), length * (WARM_UP + ROUNDS * COUNTED));
    }
    check(
        "loops in a loop".to_owned(),
        allocations_of(|_frame| {
            let inner = |_: Range<usize>, _: &Worker| scheduler.parallel_for(20, 1, |_range, _worker| {}).unwrap();
            scheduler.parallel_for(20, 1, inner).unwrap();
        }),
    );
    assert_eq!(found, [""; 0], "allocations in {COUNTED} frames each");
}

#[test]
fn frames_allocate_no_more_than_they_need() {
    absent_features::what_a_scene_does_not_use_allocates_nothing();
    static_groups::frames_that_execute_static_groups_allocate_nothing_more();
    view_names::views_of_ever_new_names_leave_no_memory_behind();
    a_steady_frame_allocates_nothing();
}
