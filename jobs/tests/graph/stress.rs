//! Runs random graphs on different numbers of workers, and compares the results with a serial loop over the nodes.
//!
//! `cargo test` runs a short form. `DRAWLOOM_STRESS_SECONDS=60 cargo test --release -p drawloom-jobs --test graph
//! stress` tests further seeds for that many seconds.

use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{self, ThreadId};
use std::time::{Duration, Instant};

use drawloom_jobs::graph::{FrameGraph, Node, NodeError, NodeId, RunError, Schedule};
use drawloom_jobs::task::{Scheduler, Worker};
use fastrand::Rng;

/// A node of a random graph. It depends on nodes with lower indices.
#[derive(Clone)]
struct Plan {
    dependencies: Vec<usize>,
    width: usize,
    chunk: usize,
    is_pinned: bool,
}

fn plans(seed: u64) -> Vec<Plan> {
    let mut random = Rng::with_seed(seed);
    // Mostly small graphs, so that many can be tested.
    let max = [4, 20, 100, 400, 2_000][[0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 2, 3, 3, 3, 4][random.usize(..16)]];
    let reach = 1 + random.usize(..max);
    (0..1 + random.usize(..max))
        .map(|index| Plan {
            dependencies: (0..random.usize(..4).min(index))
                .map(|_| index - 1 - random.usize(..reach.min(index)))
                .collect(),
            width: [1, 1, 1, random.usize(..51)][random.usize(..4)],
            chunk: random.usize(..8),
            is_pinned: random.usize(..10) == 0,
        })
        .collect()
}

/// The context of a run: how often each item was processed, the calling thread, and the node that fails, if any.
struct RunContext {
    done: Vec<Vec<AtomicUsize>>,
    /// Whether a node ran too early or on the wrong thread.
    is_invalid: AtomicBool,
    caller: ThreadId,
    failing: Option<usize>,
}

impl RunContext {
    fn new(plans: &[Plan], failing: Option<usize>) -> Self {
        let done = plans.iter().map(|plan| (0..plan.width).map(|_| AtomicUsize::new(0)).collect()).collect();
        Self { done, is_invalid: AtomicBool::new(false), caller: thread::current().id(), failing }
    }

    /// Per node, how often each of its items was processed.
    fn counts(self) -> Vec<Vec<usize>> {
        assert!(!self.is_invalid.into_inner(), "a node ran too early or on the wrong thread");
        self.done.into_iter().map(|items| items.into_iter().map(AtomicUsize::into_inner).collect()).collect()
    }
}

struct CountingNode {
    index: usize,
    plan: Plan,
}

impl Node<RunContext> for CountingNode {
    fn width(&self, context: &RunContext) -> usize {
        context.done[self.index].len()
    }

    fn chunk(&self, _context: &RunContext) -> usize {
        self.plan.chunk
    }

    fn pinned(&self) -> bool {
        self.plan.is_pinned
    }

    fn run(&self, context: &RunContext, range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
        // Relaxed: the schedule must make the counts visible.
        let is_done = |&node: &usize| context.done[node].iter().all(|count| count.load(Ordering::Relaxed) == 1);
        let is_on_wrong_thread = self.plan.is_pinned && thread::current().id() != context.caller;
        if is_on_wrong_thread || !self.plan.dependencies.iter().all(is_done) {
            context.is_invalid.store(true, Ordering::Relaxed);
        }
        if context.failing == Some(self.index) {
            return Err("as planned".into());
        }
        context.done[self.index][range].iter().for_each(|count| {
            count.fetch_add(1, Ordering::Relaxed);
        });
        Ok(())
    }
}

fn compiled(plans: &[Plan]) -> Schedule<CountingNode> {
    let mut graph = FrameGraph::new();
    let nodes: Vec<NodeId> = plans
        .iter()
        .enumerate()
        .map(|(index, plan)| graph.add(format!("p{index}"), CountingNode { index, plan: plan.clone() }))
        .collect();
    for (index, plan) in plans.iter().enumerate() {
        plan.dependencies.iter().for_each(|&before| graph.order(nodes[before], nodes[index]));
        graph.keep(nodes[index]);
    }
    graph.compile().expect("the graph is valid")
}

/// The counts of a run without a failure, by a serial loop.
fn serial_counts(plans: &[Plan]) -> Vec<Vec<usize>> {
    plans.iter().map(|plan| vec![1; plan.width]).collect()
}

/// Per node, whether it is the failing node or depends on it, directly or through others.
fn cancelled(plans: &[Plan], failing: usize) -> Vec<bool> {
    let mut cancelled = vec![false; plans.len()];
    for (index, plan) in plans.iter().enumerate() {
        cancelled[index] = index == failing || plan.dependencies.iter().any(|&before| cancelled[before]);
    }
    cancelled
}

fn check(seed: u64, schedulers: &[Scheduler]) {
    let plans = plans(seed);
    let mut random = Rng::with_seed(!seed);
    let expected = serial_counts(&plans);
    for scheduler in schedulers {
        let case = format!("seed {seed}, {scheduler:?}");
        let mut schedule = compiled(&plans);
        for always_parallel in [true, false, false, true] {
            schedule.always_parallel(always_parallel);
            let chosen = random.usize(..plans.len());
            let failing = (random.usize(..3) == 0 && plans[chosen].width > 0).then_some(chosen);
            let context = RunContext::new(&plans, failing);
            let outcome = schedule.run(scheduler, &context);
            let counts = context.counts();
            let Some(failing) = failing else {
                outcome.unwrap_or_else(|error| panic!("{case}: {error}"));
                assert!(counts == expected, "{case}: an item was not processed once");
                continue;
            };
            let Err(RunError::Failed { node, .. }) = outcome else { panic!("{case}: no failure") };
            assert_eq!(node, format!("p{failing}"), "{case}");
            assert!(counts.iter().flatten().all(|&count| count <= 1), "{case}: an item was processed twice");
            let cancelled = cancelled(&plans, failing);
            let ran = |index: usize| counts[index].contains(&1);
            assert!((0..plans.len()).all(|index| !(cancelled[index] && ran(index))), "{case}: a dependent ran");
        }
    }
}

fn schedulers() -> Vec<Scheduler> {
    let plain = [1, 2, 4, 8].map(|workers| Scheduler::new(workers).expect("threads can be started"));
    let shuffled = [(1, 1), (4, 2)].map(|(workers, seed)| {
        Scheduler::builder().workers(workers).shuffle(seed).build().expect("threads can be started")
    });
    plain.into_iter().chain(shuffled).collect()
}

#[test]
fn random_graphs_give_the_same_results_as_a_serial_loop() {
    let schedulers = schedulers();
    (0..200).for_each(|seed| check(seed, &schedulers));
    let Ok(seconds) = std::env::var("DRAWLOOM_STRESS_SECONDS") else { return };
    let seconds = seconds.parse().expect("DRAWLOOM_STRESS_SECONDS is a number");
    let start = Instant::now();
    let mut seeds = 200..;
    while start.elapsed() < Duration::from_secs(seconds) {
        seeds.by_ref().take(20).for_each(|seed| check(seed, &schedulers));
    }
}

/// The order in which one worker runs the chunks of a graph and of a loop.
fn shuffled_order(seed: u64) -> Vec<(usize, usize)> {
    struct Logging(usize);
    impl Node<Mutex<Vec<(usize, usize)>>> for Logging {
        fn width(&self, _: &Mutex<Vec<(usize, usize)>>) -> usize {
            6
        }

        fn run(&self, log: &Mutex<Vec<(usize, usize)>>, range: Range<usize>, _: &Worker) -> Result<(), NodeError> {
            log.lock().map_err(|_| "poisoned")?.push((self.0, range.start));
            Ok(())
        }
    }
    let scheduler = Scheduler::builder().workers(1).shuffle(seed).build().expect("no thread is needed");
    let mut graph = FrameGraph::new();
    for index in 0..6 {
        let node = graph.add(format!("p{index}"), Logging(index));
        graph.keep(node);
    }
    let log = Mutex::new(Vec::new());
    let mut schedule = graph.compile().expect("the graph is valid");
    (0..3).for_each(|_frame| schedule.run(&scheduler, &log).expect("no node fails"));
    let body = |range: Range<usize>, _: &Worker| log.lock().unwrap().push((usize::MAX, range.start));
    scheduler.parallel_for(20, 1, body).unwrap();
    log.into_inner().unwrap()
}

#[test]
fn a_seed_determines_the_order_of_one_worker() {
    let orders: Vec<_> = (0..8).map(shuffled_order).collect();
    for (seed, order) in orders.iter().enumerate() {
        assert_eq!(*order, shuffled_order(seed as u64));
        assert_eq!(order.len(), 3 * 36 + 20);
    }
    assert!(orders[1..].iter().any(|order| *order != orders[0]), "all seeds give the same order");
    // Of two nodes, two chunks or two iterations, each comes first with some seed.
    let first = |order: &[(usize, usize)], two: [(usize, usize); 2]| order.iter().find(|&at| two.contains(at)).copied();
    for two in [[(0, 0), (5, 0)], [(0, 0), (0, 5)], [(usize::MAX, 0), (usize::MAX, 19)]] {
        assert!(two.map(|one| orders.iter().any(|order| first(order, two) == Some(one))).iter().all(|&occurs| occurs));
    }
}
