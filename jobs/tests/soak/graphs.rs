//! Random graphs inside of random programs: every item runs once, after its dependencies, also in runs after a failure.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use drawloom_jobs::graph::{FrameGraph, Node, NodeError, RunError, Schedule};
use drawloom_jobs::task::Worker;
use fastrand::Rng;

use crate::program::{World, items, panic_as_planned, run_items};
use crate::watchdog::{Activity, during};

/// The maximum width of a node.
const MAX_WIDTH: usize = if cfg!(miri) { 4 } else { 20 };

/// The description of a node, which depends on some nodes before it.
struct Plan {
    seed: u64,
    depends_on: Vec<usize>,
    width: usize,
    chunk: usize,
    is_pinned: bool,
}

fn plans(seed: u64) -> Vec<Plan> {
    let mut random = Rng::with_seed(!seed);
    (0..1 + random.usize(..9))
        .map(|index| Plan {
            seed: random.u64(..),
            depends_on: (0..random.usize(..3).min(index)).map(|_| random.usize(..index)).collect(),
            width: [1, 1, random.usize(..MAX_WIDTH)][random.usize(..3)],
            chunk: random.usize(..4),
            is_pinned: random.u8(..6) == 0,
        })
        .collect()
}

/// The sum over all items of a graph, computed without jobs.
pub fn value(seed: u64, height: usize) -> u64 {
    let of_node = |plan: &Plan| items(plan.seed, 0..plan.width, height);
    plans(seed).iter().map(of_node).fold(0, u64::wrapping_add)
}

#[derive(Clone, Copy, PartialEq)]
enum Failure {
    Error,
    Panic,
}

/// The context of a run.
struct Frame<'frame> {
    world: &'frame Arc<World>,
    height: usize,
    /// For each node, how many of its items are done, and their sum.
    done: Vec<(AtomicU64, AtomicU64)>,
    began_too_early: AtomicBool,
    /// The node that fails, and how.
    failing: Option<(usize, Failure)>,
}

struct RandomNode {
    index: usize,
    plan: Plan,
    /// The nodes that it depends on, with their widths.
    before: Vec<(usize, usize)>,
}

impl Node<Frame<'_>> for RandomNode {
    fn width(&self, _frame: &Frame<'_>) -> usize {
        self.plan.width
    }

    fn chunk(&self, _frame: &Frame<'_>) -> usize {
        self.plan.chunk
    }

    fn pinned(&self) -> bool {
        self.plan.is_pinned
    }

    fn run(&self, frame: &Frame<'_>, range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
        // Relaxed, so that only the schedule makes the counts visible.
        let is_done = |&(before, width): &(usize, usize)| frame.done[before].0.load(Ordering::Relaxed) == width as u64;
        if !self.before.iter().all(is_done) {
            frame.began_too_early.store(true, Ordering::Relaxed);
        }
        match frame.failing.filter(|&(failing, _)| failing == self.index) {
            Some((_, Failure::Error)) => return Err("as planned".into()),
            Some((_, Failure::Panic)) => panic_as_planned(),
            None => {}
        }
        let (count, sum) = &frame.done[self.index];
        let length = range.len();
        sum.fetch_add(run_items(frame.world, self.plan.seed, range, frame.height), Ordering::Relaxed);
        count.fetch_add(length as u64, Ordering::Relaxed);
        Ok(())
    }
}

/// Runs a graph, and returns the sum over all of its items. Some runs that fail may come before.
pub fn run(world: &Arc<World>, seed: u64, height: usize) -> u64 {
    let widths: Vec<usize> = plans(seed).iter().map(|plan| plan.width).collect();
    let mut graph = FrameGraph::new();
    let mut ids = Vec::new();
    for (index, plan) in plans(seed).into_iter().enumerate() {
        let depends_on = plan.depends_on.clone();
        let before = depends_on.iter().map(|&before| (before, widths[before])).collect();
        // The name contains the width, for `check_log`.
        let id = graph.add(format!("{index} of width {}", plan.width), RandomNode { index, plan, before });
        depends_on.iter().for_each(|&before| graph.order(ids[before], id));
        graph.keep(id);
        ids.push(id);
    }
    let mut schedule = graph.compile().expect("each node depends on nodes before it");
    let mut random = Rng::with_seed(seed);
    for _run in 0..random.usize(..4) {
        schedule.always_parallel(random.bool());
        let node = random.usize(..widths.len());
        let failure = [Failure::Error, Failure::Panic][random.usize(..2)];
        let failing = (widths[node] > 0 && random.bool()).then_some((node, failure));
        run_once(world, &mut schedule, &widths, seed, height, failing);
    }
    run_once(world, &mut schedule, &widths, seed, height, None).expect("no node fails")
}

/// Returns the sum over all items, or `None` if a node was made to fail.
fn run_once(
    world: &Arc<World>,
    schedule: &mut Schedule<RandomNode>,
    widths: &[usize],
    seed: u64,
    height: usize,
    failing: Option<(usize, Failure)>,
) -> Option<u64> {
    let done = widths.iter().map(|_| Default::default()).collect();
    let frame = Frame { world, height, done, began_too_early: AtomicBool::new(false), failing };
    let outcome = during(Activity::Graph, seed, || schedule.run(&world.scheduler, &frame));
    let at = format!("{}: graph {seed:x}", world.name);
    assert!(!frame.began_too_early.into_inner(), "{at}: a node ran before a dependency");
    let (counts, sums): (Vec<u64>, Vec<u64>) =
        frame.done.into_iter().map(|(count, sum)| (count.into_inner(), sum.into_inner())).unzip();
    let Some((node, failure)) = failing else {
        assert!(outcome.is_ok(), "{at}: {outcome:?}");
        assert!(
            counts.iter().zip(widths).all(|(&count, &width)| count == width as u64),
            "{at}: {counts:?} of {widths:?}"
        );
        let total = sums.into_iter().fold(0, u64::wrapping_add);
        assert_eq!(total, value(seed, height), "{at}");
        return Some(total);
    };
    let name = format!("{node} of width {}", widths[node]);
    match (failure, outcome) {
        (Failure::Error, Err(RunError::Failed { node: failed, .. })) => assert_eq!(failed, name, "{at}"),
        (Failure::Panic, Err(RunError::Panicked { node: failed, message })) => {
            assert_eq!((failed, message.as_str()), (name, "as planned"), "{at}");
        }
        (_, outcome) => panic!("{at}: node {node} should fail, but the outcome is {outcome:?}"),
    }
    assert!(counts.iter().zip(widths).all(|(&count, &width)| count <= width as u64), "{at}: {counts:?} of {widths:?}");
    None
}
