//! Random graphs on few and many workers, against a plain loop over their nodes.
//!
//! `cargo test` runs a short form. `DRAWLOOM_STRESS_SECONDS=60 cargo test --release --test graph stress` goes on with further
//! seeds for that many seconds.

use std::{
    ops::Range,
    sync::{
        Mutex,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread::{self, ThreadId},
    time::{Duration, Instant},
};

use drawloom::{
    graph::{FrameGraph, Node, NodeError, NodeId, RunError, Schedule},
    task::{Scheduler, Worker},
};

/// Numbers by the generator SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) % count as u64) as usize
    }
}

/// A node of a random graph. It waits for nodes before it in the list.
#[derive(Clone)]
struct Plan {
    waits_for: Vec<usize>,
    width: usize,
    chunk: usize,
    is_pinned: bool,
}

fn plans(seed: u64) -> Vec<Plan> {
    let mut random = Random(seed);
    // Mostly small, for there to be many.
    let most = [4, 20, 100, 400, 2_000][[0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 2, 3, 3, 3, 4][random.below(16)]];
    let reach = 1 + random.below(most);
    (0..1 + random.below(most))
        .map(|place| Plan {
            waits_for: (0..random.below(4).min(place)).map(|_| place - 1 - random.below(reach.min(place))).collect(),
            width: [1, 1, 1, random.below(51)][random.below(4)],
            chunk: random.below(8),
            is_pinned: random.below(10) == 0,
        })
        .collect()
}

/// What a run is lent: how often each item was done, who called, and which node is to fail, if any.
struct World {
    done: Vec<Vec<AtomicUsize>>,
    /// Whether something was done too early or in the wrong place.
    is_wrong: AtomicBool,
    caller: ThreadId,
    failing: Option<usize>,
}

impl World {
    fn new(plans: &[Plan], failing: Option<usize>) -> Self {
        let done = plans.iter().map(|plan| (0..plan.width).map(|_| AtomicUsize::new(0)).collect()).collect();
        Self { done, is_wrong: AtomicBool::new(false), caller: thread::current().id(), failing }
    }

    /// Per node, how often each of its items was done.
    fn counts(self) -> Vec<Vec<usize>> {
        assert!(!self.is_wrong.into_inner(), "something was done too early, or in the wrong place");
        self.done.into_iter().map(|items| items.into_iter().map(AtomicUsize::into_inner).collect()).collect()
    }
}

struct BusyNode {
    place: usize,
    plan: Plan,
}

impl Node<World> for BusyNode {
    fn width(&self, world: &World) -> usize {
        world.done[self.place].len()
    }

    fn chunk(&self, _world: &World) -> usize {
        self.plan.chunk
    }

    fn pinned(&self) -> bool {
        self.plan.is_pinned
    }

    fn run(&self, world: &World, range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
        // Relaxed: that the counts are seen at all is what the schedule is to see to.
        let is_done = |&node: &usize| world.done[node].iter().all(|count| count.load(Ordering::Relaxed) == 1);
        let is_astray = self.plan.is_pinned && thread::current().id() != world.caller;
        if is_astray || !self.plan.waits_for.iter().all(is_done) {
            world.is_wrong.store(true, Ordering::Relaxed);
        }
        if world.failing == Some(self.place) {
            return Err("as planned".into());
        }
        world.done[self.place][range].iter().for_each(|count| {
            count.fetch_add(1, Ordering::Relaxed);
        });
        Ok(())
    }
}

fn compiled(plans: &[Plan]) -> Schedule<BusyNode> {
    let mut graph = FrameGraph::new();
    let nodes: Vec<NodeId> = plans
        .iter()
        .enumerate()
        .map(|(place, plan)| graph.add(format!("p{place}"), BusyNode { place, plan: plan.clone() }))
        .collect();
    for (place, plan) in plans.iter().enumerate() {
        plan.waits_for.iter().for_each(|&before| graph.order(nodes[before], nodes[place]));
        graph.keep(nodes[place]);
    }
    graph.compile().expect("nothing is wrong")
}

/// What a run leaves that a failure does not cut short, by a plain loop.
fn serially(plans: &[Plan]) -> Vec<Vec<usize>> {
    plans.iter().map(|plan| vec![1; plan.width]).collect()
}

/// Whether the node waits for the failing one, through any number of others.
fn cancelled(plans: &[Plan], failing: usize) -> Vec<bool> {
    let mut cancelled = vec![false; plans.len()];
    for (place, plan) in plans.iter().enumerate() {
        cancelled[place] = place == failing || plan.waits_for.iter().any(|&before| cancelled[before]);
    }
    cancelled
}

fn check(seed: u64, schedulers: &[Scheduler]) {
    let plans = plans(seed);
    let mut random = Random(!seed);
    let whole = serially(&plans);
    for scheduler in schedulers {
        let at = format!("seed {seed}, {scheduler:?}");
        let mut schedule = compiled(&plans);
        for always_parallel in [true, false, false, true] {
            schedule.always_parallel(always_parallel);
            let chosen = random.below(plans.len());
            let failing = (random.below(3) == 0 && plans[chosen].width > 0).then_some(chosen);
            let world = World::new(&plans, failing);
            let outcome = schedule.run(scheduler, &world);
            let counts = world.counts();
            let Some(failing) = failing else {
                outcome.unwrap_or_else(|error| panic!("{at}: {error}"));
                assert!(counts == whole, "{at}: an item was not done once");
                continue;
            };
            let Err(RunError::Failed { node, .. }) = outcome else { panic!("{at}: no failure") };
            assert_eq!(node, format!("p{failing}"), "{at}");
            assert!(counts.iter().flatten().all(|&count| count <= 1), "{at}: an item was done twice");
            let cancelled = cancelled(&plans, failing);
            let ran = |place: usize| counts[place].contains(&1);
            assert!((0..plans.len()).all(|place| !(cancelled[place] && ran(place))), "{at}: a dependent ran");
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
fn random_graphs_do_what_a_plain_loop_does() {
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
    struct Noting(usize);
    impl Node<Mutex<Vec<(usize, usize)>>> for Noting {
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
    for place in 0..6 {
        let node = graph.add(format!("p{place}"), Noting(place));
        graph.keep(node);
    }
    let log = Mutex::new(Vec::new());
    let mut schedule = graph.compile().expect("nothing is wrong");
    (0..3).for_each(|_frame| schedule.run(&scheduler, &log).expect("nothing fails"));
    let body = |range: Range<usize>, _: &Worker| log.lock().unwrap().push((usize::MAX, range.start));
    scheduler.parallel_for(20, 1, body).unwrap();
    log.into_inner().unwrap()
}

#[test]
fn a_seed_decides_the_order_of_one_worker() {
    let orders: Vec<_> = (0..8).map(shuffled_order).collect();
    for (seed, order) in orders.iter().enumerate() {
        assert_eq!(*order, shuffled_order(seed as u64));
        assert_eq!(order.len(), 3 * 36 + 20);
    }
    assert!(orders[1..].iter().any(|order| *order != orders[0]), "no seed changes anything");
    // A result that depends on which of two comes first shows both faces, for nodes, chunks and loops alike.
    let first = |order: &[(usize, usize)], two: [(usize, usize); 2]| order.iter().find(|&at| two.contains(at)).copied();
    for two in [[(0, 0), (5, 0)], [(0, 0), (0, 5)], [(usize::MAX, 0), (usize::MAX, 19)]] {
        assert!(two.map(|one| orders.iter().any(|order| first(order, two) == Some(one))).iter().all(|&seen| seen));
    }
}
