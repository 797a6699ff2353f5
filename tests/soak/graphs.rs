//! Random graphs inside of random programs: every item once, after all that it depends on, and again after a failure.

use std::{
    ops::Range,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
};

use drawloom::{
    graph::{FrameGraph, Node, NodeError, RunError, Schedule},
    task::Worker,
};

use crate::{
    program::{World, items, panic_as_planned, run_items},
    random::Random,
    watchdog::{Activity, during},
};

/// The most items of a node.
const WIDEST: usize = if cfg!(miri) { 4 } else { 20 };

/// A node, which waits for some of those before it.
struct Plan {
    seed: u64,
    waits_for: Vec<usize>,
    width: usize,
    chunk: usize,
    is_pinned: bool,
}

fn plans(seed: u64) -> Vec<Plan> {
    let mut random = Random(!seed);
    (0..1 + random.below(9))
        .map(|index| Plan {
            seed: random.next(),
            waits_for: (0..random.below(3).min(index)).map(|_| random.below(index)).collect(),
            width: [1, 1, random.below(WIDEST)][random.below(3)],
            chunk: random.below(4),
            is_pinned: random.one_in(6),
        })
        .collect()
}

/// The sum over all items of a graph, without any job.
pub fn value(seed: u64, height: usize) -> u64 {
    let of_node = |plan: &Plan| items(plan.seed, 0..plan.width, height);
    plans(seed).iter().map(of_node).fold(0, u64::wrapping_add)
}

#[derive(Clone, Copy, PartialEq)]
enum Failure {
    Error,
    Panic,
}

/// What a run is lent.
struct Frame<'frame> {
    world: &'frame Arc<World>,
    height: usize,
    /// Per node, how many of its items are done, and their sum.
    done: Vec<(AtomicU64, AtomicU64)>,
    came_too_early: AtomicBool,
    /// The node that fails, and how.
    failing: Option<(usize, Failure)>,
}

struct Process {
    index: usize,
    plan: Plan,
    /// What it waits for, with their widths.
    before: Vec<(usize, usize)>,
}

impl Node<Frame<'_>> for Process {
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
        // Relaxed: that the counts are seen is what the schedule is to see to.
        let is_done = |&(before, width): &(usize, usize)| frame.done[before].0.load(Ordering::Relaxed) == width as u64;
        if !self.before.iter().all(is_done) {
            frame.came_too_early.store(true, Ordering::Relaxed);
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

/// Runs a graph, and says the sum over all of its items. Before that it may fail a few times.
pub fn run(world: &Arc<World>, seed: u64, height: usize) -> u64 {
    let widths: Vec<usize> = plans(seed).iter().map(|plan| plan.width).collect();
    let mut graph = FrameGraph::new();
    let mut ids = Vec::new();
    for (index, plan) in plans(seed).into_iter().enumerate() {
        let waits_for = plan.waits_for.clone();
        let before = waits_for.iter().map(|&before| (before, widths[before])).collect();
        // The width stands in the name, for whoever reads a log.
        let id = graph.add(format!("{index} of width {}", plan.width), Process { index, plan, before });
        waits_for.iter().for_each(|&before| graph.order(ids[before], id));
        graph.keep(id);
        ids.push(id);
    }
    let mut schedule = graph.compile().expect("each waits for some before it");
    let mut random = Random(seed);
    for _run in 0..random.below(4) {
        schedule.always_parallel(random.one_in(2));
        let node = random.below(widths.len());
        let failure = [Failure::Error, Failure::Panic][random.below(2)];
        let failing = (widths[node] > 0 && random.one_in(2)).then_some((node, failure));
        run_once(world, &mut schedule, &widths, seed, height, failing);
    }
    run_once(world, &mut schedule, &widths, seed, height, None).expect("nothing was to fail")
}

/// Says the sum over all items, unless a node is to fail.
fn run_once(
    world: &Arc<World>,
    schedule: &mut Schedule<Process>,
    widths: &[usize],
    seed: u64,
    height: usize,
    failing: Option<(usize, Failure)>,
) -> Option<u64> {
    let done = widths.iter().map(|_| Default::default()).collect();
    let frame = Frame { world, height, done, came_too_early: AtomicBool::new(false), failing };
    let outcome = during(Activity::Graph, seed, || schedule.run(&world.scheduler, &frame));
    let at = format!("{}: graph {seed:x}", world.name);
    assert!(!frame.came_too_early.into_inner(), "{at}: a node ran before what it waits for");
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
        (_, outcome) => panic!("{at}: node {node} was to fail, and the outcome is {outcome:?}"),
    }
    assert!(counts.iter().zip(widths).all(|(&count, &width)| count <= width as u64), "{at}: {counts:?} of {widths:?}");
    None
}
