//! A run processes every item once, after its dependencies, on all workers.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Barrier, Mutex};
use std::thread;
use std::time::Duration;

use drawloom_jobs::graph::{Closure, FrameGraph, Node, NodeError, Schedule};
use drawloom_jobs::task::{Scheduler, Worker};
use proptest::collection::vec;
use proptest::prelude::*;

use crate::SCHEDULERS;
use crate::oracle::{Oracle, valid_graph};

/// How often each item of each node was processed.
type ItemCounts = Vec<Vec<AtomicUsize>>;

fn item_counts(widths: &[usize]) -> ItemCounts {
    widths.iter().map(|width| (0..*width).map(|_| AtomicUsize::new(0)).collect()).collect()
}

/// A node that counts its items, and fails if a node before it is not complete.
struct Counting {
    node: usize,
    chunk: usize,
    pinned: bool,
    before: Vec<usize>,
}

impl Counting {
    fn check(&self, counts: &ItemCounts) -> Result<(), NodeError> {
        // Relaxed: the schedule must make the counts visible.
        let is_done = |node: &usize| counts[*node].iter().all(|count| count.load(Ordering::Relaxed) == 1);
        match self.before.iter().find(|node| !is_done(node)) {
            Some(node) => Err(format!("p{node} is not complete").into()),
            None => Ok(()),
        }
    }
}

impl Node<ItemCounts> for Counting {
    fn width(&self, counts: &ItemCounts) -> usize {
        if let Err(error) = self.check(counts) {
            panic!("{error}");
        }
        counts[self.node].len()
    }

    fn chunk(&self, _counts: &ItemCounts) -> usize {
        self.chunk
    }

    fn pinned(&self) -> bool {
        self.pinned
    }

    fn run(&self, counts: &ItemCounts, range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
        let chunk = self.chunk.max(1);
        if range.is_empty()
            || !range.start.is_multiple_of(chunk)
            || range.end != (range.start + chunk).min(counts[self.node].len())
        {
            return Err(format!("{range:?} is not a chunk").into());
        }
        for count in &counts[self.node][range] {
            count.fetch_add(1, Ordering::Relaxed);
        }
        self.check(counts)
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    #[test]
    fn every_item_is_processed_once_after_all_dependencies(
        model in valid_graph(),
        shapes in vec((prop_oneof![0..4usize, 0..100usize], 0..12usize, prop::bool::weighted(0.1)), 24),
    ) {
        let oracle = Oracle::new(&model);
        let graph = model.graph(|node| Counting {
            node,
            chunk: shapes[node].1,
            pinned: shapes[node].2,
            before: (0..oracle.needed.len()).filter(|&before| oracle.needed[before] && oracle.before[before][node]).collect(),
        });
        let mut schedule = graph.compile().map_err(|error| TestCaseError::fail(error.to_string()))?;
        for scheduler in SCHEDULERS.iter() {
            for always_parallel in [true, true, false, false] {
                schedule.always_parallel(always_parallel);
                let widths: Vec<usize> = (0..oracle.needed.len()).map(|node| shapes[node].0).collect();
                let counts = item_counts(&widths);
                schedule.run(scheduler, &counts).map_err(|error| TestCaseError::fail(error.to_string()))?;
                for (node, items) in counts.into_iter().enumerate() {
                    for count in items {
                        prop_assert_eq!(count.into_inner(), usize::from(oracle.needed[node]));
                    }
                }
            }
        }
    }
}

/// A schedule of one kept node.
pub fn single<P>(node: P) -> Schedule<P> {
    let mut graph = FrameGraph::new();
    let node = graph.add("single", node);
    graph.keep(node);
    graph.compile().expect("the graph is valid")
}

/// Runs the schedule in parallel, even if it has little work.
pub fn run<C: Sync, P: Node<C>>(schedule: &mut Schedule<P>, scheduler: &Scheduler, context: &C) {
    schedule.always_parallel(true);
    schedule.run(scheduler, context).expect("no node fails");
}

#[test]
fn all_workers_join_a_wide_node() {
    // Each item waits for the others, so the run ends only if each has a worker of its own.
    let mut schedule = single(Closure::new(|barrier: &Barrier, _, _| {
        barrier.wait();
        Ok(())
    }));
    let [_, two, four] = &*SCHEDULERS;
    for (scheduler, width) in [(two, 2), (four, 4)] {
        let (_, node) = schedule.nodes_mut().next().expect("there is one");
        *node = Closure::new(|barrier: &Barrier, _, _| {
            barrier.wait();
            Ok(())
        })
        .with_width(move |_| width);
        for _ in 0..20 {
            run(&mut schedule, scheduler, &Barrier::new(width));
        }
    }
}

#[test]
fn independent_nodes_run_at_the_same_time() {
    let mut graph = FrameGraph::new();
    let source = graph.add("source", Closure::new(|_: &Barrier, _, _| Ok(())));
    for name in ["a", "b", "c", "d"] {
        let node = graph.add(
            name,
            Closure::new(|barrier: &Barrier, _, _| {
                barrier.wait();
                Ok(())
            }),
        );
        graph.order(source, node);
        graph.keep(node);
    }
    graph.keep(source);
    let mut schedule = graph.compile().expect("the graph is valid");
    for _ in 0..20 {
        run(&mut schedule, &SCHEDULERS[2], &Barrier::new(4));
    }
}

#[test]
fn the_width_may_depend_on_earlier_nodes() {
    let mut graph = FrameGraph::new();
    let list = graph.resource("list");
    let read = graph.add(
        "read",
        Closure::new(|counts: &[AtomicUsize; 2], range: Range<usize>, _| {
            counts[1].fetch_add(range.len(), Ordering::Relaxed);
            Ok(())
        })
        .with_width(|counts| counts[0].load(Ordering::Relaxed)),
    );
    let write = graph.add(
        "write",
        Closure::new(|counts: &[AtomicUsize; 2], range: Range<usize>, _| {
            counts[0].fetch_add(range.len(), Ordering::Relaxed);
            Ok(())
        })
        .with_width(|_| 300)
        .with_chunk(3),
    );
    graph.read(read, list);
    graph.write(write, list);
    graph.keep(read);
    let mut schedule = graph.compile().expect("the graph is valid");
    for scheduler in SCHEDULERS.iter() {
        let counts = [AtomicUsize::new(0), AtomicUsize::new(0)];
        run(&mut schedule, scheduler, &counts);
        assert_eq!(counts.map(AtomicUsize::into_inner), [300, 300]);
    }
}

#[test]
fn pinned_nodes_run_in_order_on_the_calling_thread() {
    let log = |log: &Mutex<Vec<(thread::ThreadId, usize)>>, range: Range<usize>, _: &Worker| {
        log.lock().map_err(|_| "poisoned")?.push((thread::current().id(), range.start));
        Ok(())
    };
    let mut graph = FrameGraph::new();
    let first = graph.add("first", Closure::new(log).with_width(|_| 50).on_calling_thread());
    let between = graph.add("between", Closure::new(|_: &Mutex<_>, _, _| Ok(())).with_width(|_| 50));
    let last = graph.add("last", Closure::new(log).with_width(|_| 50).with_chunk(10).on_calling_thread());
    graph.order(first, between);
    graph.order(between, last);
    [first, between, last].into_iter().for_each(|node| graph.keep(node));
    let mut schedule = graph.compile().expect("the graph is valid");
    let here = thread::current().id();
    let expected: Vec<_> = (0..50).chain((0..50).step_by(10)).map(|start| (here, start)).collect();
    for scheduler in SCHEDULERS.iter() {
        for _ in 0..20 {
            let log = Mutex::new(Vec::new());
            run(&mut schedule, scheduler, &log);
            assert_eq!(log.into_inner().expect("no thread panics"), expected);
        }
    }
}

#[test]
fn the_context_may_be_unsized() {
    let mut graph = FrameGraph::<Box<dyn Node<[AtomicUsize]>>>::new();
    let node = Closure::new(|items: &[AtomicUsize], range: Range<usize>, _| {
        items[range].iter().for_each(|item| item.store(1, Ordering::Relaxed));
        Ok(())
    });
    let node = graph.add("fill", Box::new(node.with_width(<[AtomicUsize]>::len).with_chunk(4)));
    graph.keep(node);
    let mut schedule = graph.compile().expect("the graph is valid");
    let items: Vec<AtomicUsize> = (0..10).map(|_| AtomicUsize::new(0)).collect();
    schedule.run(&SCHEDULERS[1], items.as_slice()).expect("no node fails");
    assert!(items.into_iter().all(|item| item.into_inner() == 1));
}

/// The number of chunks of [`a_pinned_node_does_not_wait_for_the_end_of_a_wide_one`]'s wide node.
const WIDE: usize = 64;

/// How many chunks of a wide node are complete when a pinned node runs that another worker makes ready while the
/// calling thread runs such chunks. `None` if it was the calling thread that made it ready, as the scheduler may
/// decide.
fn chunks_before_pinned() -> Option<usize> {
    let caller = thread::current().id();
    let (caller_has_run_wide, caller_has_run_before) = (AtomicBool::new(false), AtomicBool::new(false));
    let (chunks, chunks_before) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let mut graph = FrameGraph::new();
    let wide = Closure::new(|_: &(), _, _| {
        caller_has_run_wide.fetch_or(thread::current().id() == caller, Ordering::Relaxed);
        thread::sleep(Duration::from_millis(1));
        chunks.fetch_add(1, Ordering::Relaxed);
        Ok(())
    });
    let wide = graph.add("wide", wide.with_width(|_| WIDE));
    let before = graph.add(
        "before",
        Closure::new(|_, _, _| {
            if thread::current().id() == caller {
                caller_has_run_before.store(true, Ordering::Relaxed);
                return Ok(());
            }
            while !caller_has_run_wide.load(Ordering::Relaxed) {
                thread::yield_now();
            }
            Ok(())
        }),
    );
    let pinned = Closure::new(|_, _, _| {
        chunks_before.store(chunks.load(Ordering::Relaxed), Ordering::Relaxed);
        Ok(())
    });
    let pinned = graph.add("pinned", pinned.on_calling_thread());
    graph.order(before, pinned);
    [wide, before, pinned].into_iter().for_each(|node| graph.keep(node));
    run(&mut graph.compile().expect("the graph is valid"), &SCHEDULERS[1], &());
    (!caller_has_run_before.into_inner()).then(|| chunks_before.into_inner())
}

#[test]
fn a_pinned_node_does_not_wait_for_the_end_of_a_wide_one() {
    // Another process may delay the calling thread, but not always.
    let mut late = Vec::new();
    for _ in 0..100 {
        match chunks_before_pinned() {
            Some(chunks) if chunks < WIDE / 2 => return,
            chunks => late.extend(chunks),
        }
    }
    panic!("the pinned node ran after so many of {WIDE} chunks: {late:?}");
}

#[test]
fn pinned_roots_run_on_the_calling_thread() {
    // The first node blocks the caller until another worker takes part, which would run the last node if it could.
    let meeting = |(barrier, _): &(Barrier, thread::ThreadId), _: Range<usize>, _: &Worker| {
        barrier.wait();
        Ok(())
    };
    let checked = |(_, caller): &(Barrier, thread::ThreadId), _: Range<usize>, _: &Worker| {
        if thread::current().id() == *caller { Ok(()) } else { Err("this is not the caller".into()) }
    };
    let mut graph = FrameGraph::new();
    for (name, node) in [
        ("meeting pinned", Closure::new(meeting).on_calling_thread()),
        ("meeting free", Closure::new(meeting)),
        ("checked", Closure::new(checked).on_calling_thread()),
    ] {
        let node = graph.add(name, node);
        graph.keep(node);
    }
    let mut schedule = graph.compile().expect("the graph is valid");
    for scheduler in &SCHEDULERS[1..] {
        for _ in 0..50 {
            run(&mut schedule, scheduler, &(Barrier::new(2), thread::current().id()));
        }
    }
}

#[test]
fn chunked_by_cost_is_not_called_if_nobody_records() {
    struct Asked(AtomicUsize);

    impl Node<()> for Asked {
        fn width(&self, _context: &()) -> usize {
            1
        }

        fn chunked_by_cost(&self, _context: &()) -> bool {
            self.0.fetch_add(1, Ordering::Relaxed);
            true
        }

        fn run(&self, _context: &(), _range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
            Ok(())
        }
    }

    let mut schedule = single(Asked(AtomicUsize::new(0)));
    run(&mut schedule, &SCHEDULERS[1], &());
    assert!(schedule.nodes().all(|(_, asked)| asked.0.load(Ordering::Relaxed) == 0));
}

#[test]
fn a_closure_is_printed_with_its_settings() {
    let closure = Closure::new(|_: &(), _, _| Ok(())).with_chunk(3).on_calling_thread();
    assert_eq!(format!("{closure:?}"), "Closure { chunk: 3, pinned: true, .. }");
}
