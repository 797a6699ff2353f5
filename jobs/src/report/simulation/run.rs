//! The simulation of one run: which tokens its workers push, and how chunks are handed out. This follows
//! `graph/parallel.rs`, and uses the tickets, ranks and chunks of real runs.

use std::ops::Range;
use std::time::Duration;

use super::measured_run::{MeasuredRun, nanoseconds};
use super::scheduler_costs::SchedulerCosts;
use super::workers::{Event, SimulatedWorkers};
use crate::graph::RankedAdjacency;
use crate::sync::Instant;
use crate::task::{Priority, TicketSize, Tickets};

/// Simulates runs of one schedule, one after another.
pub(super) struct Simulation<'replay> {
    run: &'replay MeasuredRun,
    costs: &'replay SchedulerCosts,
    workers: usize,
    /// Whether the other workers look for jobs when a run begins, and do not sleep.
    are_awake: bool,
    /// One for each node. They remember their sizes from run to run.
    tickets: Vec<Tickets>,
}

/// What happened in a simulated run. Times are in nanoseconds.
#[derive(Clone, Debug)]
pub(super) struct Outcome {
    pub(super) time: u64,
    /// From when to when each node ran.
    pub(super) node_spans: Vec<Range<u64>>,
    /// How long each worker was in chunks.
    pub(super) busy: Vec<u64>,
}

impl<'replay> Simulation<'replay> {
    pub(super) fn new(
        run: &'replay MeasuredRun,
        costs: &'replay SchedulerCosts,
        workers: usize,
        are_awake: bool,
    ) -> Self {
        let tickets = run.nodes.iter().map(|_| Tickets::new()).collect();
        Self { run, costs, workers, are_awake, tickets }
    }

    /// Simulates one run, with the ranks that `adjacency` gives the nodes.
    pub(super) fn run(&self, adjacency: &RankedAdjacency) -> Outcome {
        let nodes = self.run.nodes.len();
        let mut run = SimulatedRun {
            simulation: self,
            adjacency,
            start: Instant::now(),
            workers: SimulatedWorkers::new(self.workers, self.costs, self.are_awake, Action::Begin),
            dependencies_left: (0..nodes as u32).map(|node| adjacency.dependency_count(node)).collect(),
            chunks_done: vec![0; nodes],
            nodes_left: nodes,
            outcome: Outcome { time: 0, node_spans: vec![0..0; nodes], busy: vec![0; self.workers] },
        };
        run.simulate();
        run.outcome
    }
}

struct SimulatedRun<'run> {
    simulation: &'run Simulation<'run>,
    adjacency: &'run RankedAdjacency,
    /// Tickets take an `Instant`. Only differences matter, so simulated time is added to this one.
    start: Instant,
    workers: SimulatedWorkers<Token, Action>,
    /// How many dependencies of each node are not done.
    dependencies_left: Vec<u32>,
    /// How many chunks of each node are done.
    chunks_done: Vec<usize>,
    /// How many nodes are not done.
    nodes_left: usize,
    outcome: Outcome,
}

/// What lies in a queue.
enum Token {
    /// The worker starts one of these nodes, and leaves the others to thieves.
    Ready(Vec<u32>),
    Start(u32),
    StartPinned(u32),
    Join(u32),
}

/// What a worker does next.
enum Action {
    /// Starts the nodes without dependencies.
    Begin,
    TakeUp(Token),
    Start {
        node: u32,
        is_pinned: bool,
    },
    /// Takes chunks of an open node, of which it has finished this many.
    TakeChunks {
        node: u32,
        ticket_size: TicketSize,
        finished: usize,
    },
    Complete(u32),
}

impl SimulatedRun<'_> {
    fn simulate(&mut self) {
        let steal = nanoseconds(self.simulation.costs.steal);
        while let Some((worker, event)) = self.workers.next_event() {
            let (spent, then) = match event {
                Event::TakeUp { token, is_stolen, spent } => {
                    (spent + if is_stolen { steal } else { 0 }, Some(Action::TakeUp(token)))
                }
                Event::Act(action) => self.act(action, worker),
                Event::Idle if self.nodes_left == 0 && self.workers.is_idle() => {
                    self.outcome.time = self.workers.now() + self.workers.time_to_notice_end(worker, steal);
                    return;
                }
                Event::Idle => continue,
            };
            self.workers.resume(worker, spent, then);
        }
    }

    /// Returns how long the action takes the worker, and what it does then. If that is `None`, it looks for work.
    fn act(&mut self, action: Action, worker: usize) -> (u64, Option<Action>) {
        match action {
            Action::Begin => self.hand_out(self.adjacency.roots().to_vec(), worker),
            Action::TakeUp(token) => self.take_up(token, worker),
            Action::Start { node, is_pinned } => self.start(node, is_pinned, worker),
            Action::TakeChunks { node, ticket_size, finished } => self.take_chunks(node, ticket_size, finished, worker),
            Action::Complete(node) => self.complete(node, worker),
        }
    }

    fn take_up(&mut self, token: Token, worker: usize) -> (u64, Option<Action>) {
        match token {
            Token::Ready(mut nodes) => {
                let mut spent = 0;
                while nodes.len() > 1 {
                    let half = nodes.split_off(nodes.len() / 2);
                    spent += self.push_ready(half, worker);
                }
                (spent, Some(Action::Start { node: nodes[0], is_pinned: false }))
            }
            Token::Start(node) => (0, Some(Action::Start { node, is_pinned: false })),
            Token::StartPinned(node) => (0, Some(Action::Start { node, is_pinned: true })),
            Token::Join(node) => (0, Some(self.join(node))),
        }
    }

    fn start(&mut self, node: u32, is_pinned: bool, worker: usize) -> (u64, Option<Action>) {
        self.outcome.node_spans[node as usize].start = self.workers.now();
        let spent = nanoseconds(self.simulation.costs.node);
        let count = self.simulation.run.nodes[node as usize].chunks.count();
        if count > 1 && !is_pinned {
            self.simulation.tickets[node as usize].reset(0);
            return (spent, Some(self.join(node)));
        }
        (spent + self.run_chunks(node, 0..count, worker), Some(Action::Complete(node)))
    }

    fn join(&self, node: u32) -> Action {
        Action::TakeChunks { node, ticket_size: self.simulation.tickets[node as usize].join(), finished: 0 }
    }

    fn take_chunks(
        &mut self,
        node: u32,
        mut ticket_size: TicketSize,
        finished: usize,
        worker: usize,
    ) -> (u64, Option<Action>) {
        let simulation = self.simulation;
        let tickets = &simulation.tickets[node as usize];
        let chunks = &simulation.run.nodes[node as usize].chunks;
        if finished > 0 && self.has_pinned(worker) {
            let spent = if tickets.leave(chunks) { self.invite(node, worker) } else { 0 };
            return (spent, self.leave(node, finished));
        }
        let now = self.start + Duration::from_nanos(self.workers.now());
        let taken = tickets.take(chunks, &mut ticket_size, self.workers.count(), || now);
        if taken.is_empty() {
            return (0, self.leave(node, finished));
        }
        let finished = finished + taken.len();
        let mut spent = nanoseconds(simulation.costs.ticket);
        if tickets.should_invite(taken.end, chunks, self.workers.count()) {
            spent += self.invite(node, worker);
        }
        spent += self.run_chunks(node, taken, worker);
        (spent, Some(Action::TakeChunks { node, ticket_size, finished }))
    }

    /// What a worker does that has finished this many chunks of a node and takes no more.
    fn leave(&mut self, node: u32, finished: usize) -> Option<Action> {
        let done = &mut self.chunks_done[node as usize];
        *done += finished;
        let is_last = finished > 0 && *done == self.simulation.run.nodes[node as usize].chunks.count();
        is_last.then_some(Action::Complete(node))
    }

    fn invite(&mut self, node: u32, worker: usize) -> u64 {
        self.workers.push(worker, Token::Join(node), self.priority(node))
    }

    /// Counts these chunks as the worker's. Returns how long they take.
    fn run_chunks(&mut self, node: u32, chunks: Range<usize>, worker: usize) -> u64 {
        let count = chunks.len() as u64;
        let work = self.simulation.run.nodes[node as usize].work(chunks);
        self.outcome.busy[worker] += work;
        work + count * nanoseconds(self.simulation.costs.chunk)
    }

    fn complete(&mut self, node: u32, worker: usize) -> (u64, Option<Action>) {
        self.outcome.node_spans[node as usize].end = self.workers.now();
        self.nodes_left -= 1;
        let mut ready = Vec::new();
        for &dependent in self.adjacency.dependents(node) {
            let dependencies_left = &mut self.dependencies_left[dependent as usize];
            *dependencies_left -= 1;
            if *dependencies_left == 0 {
                ready.push(dependent);
            }
        }
        self.hand_out(ready, worker)
    }

    /// Pushes these nodes, which became ready together, except for one that the worker goes on with.
    fn hand_out(&mut self, ready: Vec<u32>, worker: usize) -> (u64, Option<Action>) {
        let (mut spent, mut own, mut batch) = (0, None, Vec::<u32>::new());
        let is_pinned = |node: u32| self.simulation.run.nodes[node as usize].pinned;
        let (pinned, others): (Vec<u32>, Vec<u32>) = ready.into_iter().partition(|&node| is_pinned(node));
        for node in pinned {
            spent += self.workers.push_pinned(worker, Token::StartPinned(node));
        }
        for node in others {
            if own.is_none() {
                own = Some(node);
                continue;
            }
            if batch.first().is_some_and(|&first| self.priority(first) != self.priority(node)) {
                spent += self.push_ready(std::mem::take(&mut batch), worker);
            }
            batch.push(node);
        }
        if !batch.is_empty() {
            spent += self.push_ready(batch, worker);
        }
        let Some(own) = own else { return (spent, None) };
        if self.has_pinned(worker) {
            spent += self.workers.push(worker, Token::Start(own), self.priority(own));
            return (spent, None);
        }
        (spent, Some(Action::Start { node: own, is_pinned: false }))
    }

    fn push_ready(&mut self, nodes: Vec<u32>, worker: usize) -> u64 {
        let priority = self.priority(nodes[0]);
        self.workers.push(worker, Token::Ready(nodes), priority)
    }

    fn has_pinned(&self, worker: usize) -> bool {
        worker == 0 && self.workers.has_pinned()
    }

    fn priority(&self, node: u32) -> Priority {
        if self.adjacency.is_critical(node) { Priority::Urgent } else { Priority::Normal }
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use proptest::prelude::*;

    use super::super::test_run::any_test_run;
    use super::{MeasuredRun, RankedAdjacency, SchedulerCosts, Simulation};

    proptest! {
        #[test]
        fn a_node_starts_after_all_its_dependencies_have_ended(
            test_run in any_test_run(true),
            workers in 1..8_usize,
        ) {
            let run = MeasuredRun::new(&test_run.run(&SchedulerCosts::ZERO), &SchedulerCosts::ZERO);
            let adjacency = RankedAdjacency::new(&run.dependencies);
            let outcome = Simulation::new(&run, &SchedulerCosts::ZERO, workers, false).run(&adjacency);
            for (node, span) in test_run.nodes.iter().zip(&outcome.node_spans) {
                prop_assert!(span.start <= span.end && span.end <= outcome.time);
                for &dependency in &node.dependencies {
                    prop_assert!(outcome.node_spans[dependency].end <= span.start);
                }
            }
        }
    }
}
