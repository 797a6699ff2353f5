//! Graphs: what compiles, in which order, is what naive rules say; a run processes each item once after all that it
//! waits for; and a failure is that of the first node that fails.

#![no_main]

use std::ops::Range;
use std::panic;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use arbitrary::{Arbitrary, Unstructured};
use drawloom::graph::{FrameGraph, Node, NodeError, RunError, Schedule};
use drawloom::task::{Scheduler, Worker};
#[path = "../../jobs/tests/graph/graph_model.rs"]
mod graph_model;

use graph_model::{GraphModel, Oracle, Role, check_compiled};
use libfuzzer_sys::fuzz_target;

const MAX_NODES: usize = 12;
const MAX_RESOURCES: usize = 4;
const MAX_WIDTH: usize = 40;

/// What nodes panic with on purpose.
const ON_PURPOSE: &str = "the node panics on purpose";

#[derive(Debug)]
struct Input {
    model: GraphModel,
    works: Vec<Work>,
    /// Nodes that are added and removed again, with the resources that they read and write.
    removed: Vec<[Option<u8>; 2]>,
}

/// What a node does.
#[derive(Arbitrary, Clone, Debug)]
struct Work {
    width: u8,
    chunk: u8,
    is_pinned: bool,
    outcome: Outcome,
}

#[derive(Arbitrary, Clone, Copy, Debug)]
enum Outcome {
    Done,
    /// All is well, which most nodes are.
    AlsoDone,
    FailsAt(u8),
    PanicsAt(u8),
    WidthPanics,
}

impl<'a> Arbitrary<'a> for Input {
    fn arbitrary(input: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let nodes = input.int_in_range(1..=MAX_NODES)?;
        let resources = input.int_in_range(0..=MAX_RESOURCES)?;
        // The writers, modifiers and readers of a resource are made in this order where a byte says so, as else few
        // graphs compile.
        let mut roles = vec![vec![None; resources]; nodes];
        for role in roles.iter_mut().flatten() {
            *role =
                [None, None, Some(Role::Reads), Some(Role::Modifies), Some(Role::Writes)][input.int_in_range(0..=4)?];
        }
        let mut flags =
            |count: usize| (0..count).map(|_| bool::arbitrary(input)).collect::<arbitrary::Result<Vec<_>>>();
        let (kept, imported, output) = (flags(nodes)?, flags(resources)?, flags(resources)?);
        let mut orders = Vec::new();
        if bool::arbitrary(input)? {
            orders.extend((1..nodes).map(|node| (node - 1, node)));
        }
        for _ in 0..input.int_in_range(0..=2 * nodes)? {
            orders.push((input.int_in_range(0..=nodes - 1)?, input.int_in_range(0..=nodes - 1)?));
        }
        let works = (0..nodes).map(|_| Work::arbitrary(input)).collect::<arbitrary::Result<_>>()?;
        let removed = if resources == 0 { Vec::new() } else { Vec::arbitrary(input)? };
        Ok(Self { model: GraphModel { roles, orders, kept, imported, output }, works, removed })
    }
}

/// A run: how often each item of each node was processed, and whether nodes fail.
struct Run {
    counts: Vec<Vec<AtomicUsize>>,
    may_fail: bool,
}

impl Run {
    fn new(works: &[Work], may_fail: bool) -> Self {
        let counts = works.iter().map(|work| (0..work.width()).map(|_| AtomicUsize::new(0)).collect());
        Self { counts: counts.collect(), may_fail }
    }

    fn is_done(&self, node: usize) -> bool {
        // Relaxed: the schedule has to make the counts visible.
        self.counts[node].iter().all(|count| count.load(Ordering::Relaxed) == 1)
    }
}

impl Work {
    fn width(&self) -> usize {
        usize::from(self.width) % (MAX_WIDTH + 1)
    }

    /// Whether a run of the node fails.
    fn fails(&self) -> bool {
        match self.outcome {
            Outcome::Done | Outcome::AlsoDone => false,
            Outcome::FailsAt(item) | Outcome::PanicsAt(item) => usize::from(item) < self.width(),
            Outcome::WidthPanics => true,
        }
    }
}

/// A node that counts its items, and panics if a node before it is not complete.
struct Counting {
    node: usize,
    work: Work,
    before: Vec<usize>,
}

impl Node<Run> for Counting {
    fn width(&self, run: &Run) -> usize {
        assert!(self.before.iter().all(|&node| run.is_done(node)), "p{} begins too early", self.node);
        assert!(!run.may_fail || !matches!(self.work.outcome, Outcome::WidthPanics), "{ON_PURPOSE}");
        self.work.width()
    }

    fn chunk(&self, _run: &Run) -> usize {
        self.work.chunk.into()
    }

    fn pinned(&self) -> bool {
        self.work.is_pinned
    }

    fn run(&self, run: &Run, range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
        let (chunk, width) = (usize::from(self.work.chunk).max(1), self.work.width());
        assert!(
            range.start.is_multiple_of(chunk) && range.end == (range.start + chunk).min(width) && !range.is_empty()
        );
        run.counts[self.node][range.clone()].iter().for_each(|count| _ = count.fetch_add(1, Ordering::Relaxed));
        match self.work.outcome {
            Outcome::FailsAt(item) if run.may_fail && range.contains(&item.into()) => Err("it fails on purpose".into()),
            Outcome::PanicsAt(item) if run.may_fail && range.contains(&item.into()) => panic!("{ON_PURPOSE}"),
            _ => Ok(()),
        }
    }
}

static SCHEDULERS: LazyLock<[Scheduler; 2]> = LazyLock::new(|| [1, 2].map(|workers| Scheduler::new(workers).unwrap()));

fuzz_target!(
    init: {
        // Any other panic ends the process, even one that a run would catch.
        let abort = panic::take_hook();
        panic::set_hook(Box::new(move |information| {
            if information.payload_as_str() != Some(ON_PURPOSE) {
                abort(information);
            }
        }));
    },
    |input: Input| {
        let oracle = Oracle::new(&input.model);
        let is_needed = |node: &usize| oracle.needed[*node];
        let mut graph = input.model.graph(|node| Counting {
            node,
            work: input.works[node].clone(),
            before: (0..oracle.needed.len()).filter(is_needed).filter(|&before| oracle.before[before][node]).collect(),
        });
        add_and_remove(&mut graph, &input);
        let compiled = graph.compile();
        check_compiled(&input.model, compiled.as_ref().map_err(|error| &error.problem));
        if let Ok(mut schedule) = compiled {
            check_runs(&mut schedule, &input.works, &oracle);
        }
    }
);

/// Nodes that were removed leave nothing in the graph.
fn add_and_remove(graph: &mut FrameGraph<Counting>, input: &Input) {
    let resources = input.model.output.len();
    let mut nodes = Vec::new();
    for (index, accesses) in input.removed.iter().take(4).enumerate() {
        let work = Work { width: 0, chunk: 0, is_pinned: false, outcome: Outcome::Done };
        let node = graph.add(format!("x{index}"), Counting { node: 0, work, before: Vec::new() });
        graph.keep(node);
        let [read, write] = accesses.map(|access| access.map(|access| format!("r{}", usize::from(access) % resources)));
        if let Some(read) = read {
            let resource = graph.resource(read);
            graph.read(node, resource);
        }
        if let Some(write) = write {
            let resource = graph.resource(write);
            graph.write(node, resource);
        }
        nodes.iter().for_each(|&before| graph.order(before, node));
        nodes.push(node);
    }
    assert!(nodes.iter().all(|&node| graph.remove(node).is_some() && graph.remove(node).is_none()));
}

fn check_runs(schedule: &mut Schedule<Counting>, works: &[Work], oracle: &Oracle) {
    let needed = || (0..works.len()).filter(|&node| oracle.needed[node]);
    let failing: Vec<_> = needed().filter(|&node| works[node].fails()).collect();
    for scheduler in SCHEDULERS.iter() {
        for (always_parallel, may_fail) in [(true, true), (true, false), (false, true), (false, false)] {
            schedule.always_parallel(always_parallel);
            let run = Run::new(works, may_fail);
            let result = schedule.run(scheduler, &run);
            let failed = match &result {
                Ok(()) => None,
                Err(RunError::Failed { node, .. } | RunError::Panicked { node, .. }) => node[1..].parse::<usize>().ok(),
                Err(error) => panic!("{error}"),
            };
            if !may_fail || failing.is_empty() {
                assert!(result.is_ok(), "{result:?}");
                assert!(needed().all(|node| run.is_done(node)));
                continue;
            }
            let failed = failed.expect("a node fails");
            assert!(failing.contains(&failed), "p{failed} fails");
            let message = result.unwrap_err().to_string();
            assert!(message.contains(&format!("\"p{failed}\"")) && message.contains("on purpose"), "{message}");
            for node in needed() {
                let counts: Vec<_> = run.counts[node].iter().map(|count| count.load(Ordering::Relaxed)).collect();
                assert!(counts.iter().all(|count| *count <= 1));
                let waits = failing.iter().any(|&other| oracle.before[other][node]);
                assert!(!waits || counts.iter().all(|count| *count == 0), "p{node} runs after a failure");
            }
        }
    }
}
