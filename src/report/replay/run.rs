//! One run of a replay: which tokens its workers push, and how chunks are handed out. It follows `graph/share.rs`, and
//! uses that file's tickets, ranks and chunks as they are.

use std::{ops::Range, time::Duration};

use crate::{
    graph::RankedAdjacency,
    sync::Instant,
    task::{Priority, TicketSize, Tickets},
};

use super::{
    costs::{Costs, nanoseconds},
    crew::{Crew, Turn},
    prices::Prices,
};

/// Runs of one schedule, one after another.
pub(super) struct Replays<'replay> {
    costs: &'replay Costs,
    prices: &'replay Prices,
    workers: usize,
    /// One for each process, kept from run to run for their pace.
    tickets: Vec<Tickets>,
}

/// What a run was, in nanoseconds.
#[derive(Clone, Debug)]
pub(super) struct Outcome {
    pub(super) time: u64,
    /// Per process, from when to when.
    pub(super) processes: Vec<Range<u64>>,
    /// Per worker, its time in chunks.
    pub(super) busy: Vec<u64>,
}

impl<'replay> Replays<'replay> {
    pub(super) fn new(costs: &'replay Costs, prices: &'replay Prices, workers: usize) -> Self {
        let tickets = costs.processes.iter().map(|_| Tickets::new()).collect();
        Self { costs, prices, workers, tickets }
    }

    /// One run, which takes up processes as they are ranked.
    pub(super) fn run(&self, adjacency: &RankedAdjacency) -> Outcome {
        let processes = self.costs.processes.len();
        let mut run = Run {
            replays: self,
            adjacency,
            start: Instant::now(),
            crew: Crew::new(self.workers, self.prices, Action::Begin),
            waits_for: (0..processes as u32).map(|process| adjacency.dependency_count(process)).collect(),
            chunks_done: vec![0; processes],
            open: processes,
            outcome: Outcome { time: 0, processes: vec![0..0; processes], busy: vec![0; self.workers] },
        };
        run.go();
        run.outcome
    }
}

struct Run<'run> {
    replays: &'run Replays<'run>,
    adjacency: &'run RankedAdjacency,
    /// Tickets take real moments. Only what lies between them counts.
    start: Instant,
    crew: Crew<Token, Action>,
    /// Per process, how many of its dependencies are not done.
    waits_for: Vec<u32>,
    /// Per process, in this run.
    chunks_done: Vec<usize>,
    /// How many processes are not done.
    open: usize,
    outcome: Outcome,
}

/// What lies in a queue.
enum Token {
    /// One of these is to be started, and the others left to whoever comes.
    Ready(Vec<u32>),
    Start(u32),
    StartPinned(u32),
    Join(u32),
}

/// What a worker does next.
enum Action {
    /// Starts what depends on nothing.
    Begin,
    TakeUp(Token),
    Start {
        process: u32,
        is_pinned: bool,
    },
    /// Takes chunks of a pass, of which it has done so many.
    TakeChunks {
        process: u32,
        pace: TicketSize,
        finished: usize,
    },
    Complete(u32),
}

impl Run<'_> {
    fn go(&mut self) {
        let steal = nanoseconds(self.replays.prices.steal);
        while let Some((worker, turn)) = self.crew.turn() {
            let (spent, then) = match turn {
                Turn::TakeUp { token, is_stolen, spent } => {
                    (spent + if is_stolen { steal } else { 0 }, Some(Action::TakeUp(token)))
                }
                Turn::Go(action) => self.act(action, worker),
                Turn::Rest if self.open == 0 && self.crew.is_idle() => {
                    self.outcome.time = self.crew.now() + self.crew.end(worker, steal);
                    return;
                }
                Turn::Rest => continue,
            };
            self.crew.go_on(worker, spent, then);
        }
    }

    /// How long that takes the worker, and what it does then: it looks for something if that is `None`.
    fn act(&mut self, action: Action, worker: usize) -> (u64, Option<Action>) {
        match action {
            Action::Begin => self.hand_out(self.adjacency.roots().to_vec(), worker),
            Action::TakeUp(token) => self.take_up(token, worker),
            Action::Start { process, is_pinned } => self.start(process, is_pinned, worker),
            Action::TakeChunks { process, pace, finished } => self.take_chunks(process, pace, finished, worker),
            Action::Complete(process) => self.complete(process, worker),
        }
    }

    fn take_up(&mut self, token: Token, worker: usize) -> (u64, Option<Action>) {
        match token {
            Token::Ready(mut processes) => {
                let mut spent = 0;
                while processes.len() > 1 {
                    let half = processes.split_off(processes.len() / 2);
                    spent += self.push_ready(half, worker);
                }
                (spent, Some(Action::Start { process: processes[0], is_pinned: false }))
            }
            Token::Start(process) => (0, Some(Action::Start { process, is_pinned: false })),
            Token::StartPinned(process) => (0, Some(Action::Start { process, is_pinned: true })),
            Token::Join(process) => (0, Some(self.join(process))),
        }
    }

    fn start(&mut self, process: u32, is_pinned: bool, worker: usize) -> (u64, Option<Action>) {
        self.outcome.processes[process as usize].start = self.crew.now();
        let spent = nanoseconds(self.replays.prices.process);
        let count = self.replays.costs.processes[process as usize].chunks.count();
        if count > 1 && !is_pinned {
            self.replays.tickets[process as usize].reset(0);
            return (spent, Some(self.join(process)));
        }
        (spent + self.work(process, 0..count, worker), Some(Action::Complete(process)))
    }

    fn join(&self, process: u32) -> Action {
        Action::TakeChunks { process, pace: self.replays.tickets[process as usize].join(), finished: 0 }
    }

    fn take_chunks(
        &mut self,
        process: u32,
        mut pace: TicketSize,
        finished: usize,
        worker: usize,
    ) -> (u64, Option<Action>) {
        let replays = self.replays;
        let tickets = &replays.tickets[process as usize];
        let chunks = &replays.costs.processes[process as usize].chunks;
        if finished > 0 && self.has_pinned(worker) {
            let spent = if tickets.leave(chunks) { self.invite(process, worker) } else { 0 };
            return (spent, self.leave(process, finished));
        }
        let now = self.start + Duration::from_nanos(self.crew.now());
        let places = tickets.take(chunks, &mut pace, self.crew.workers(), || now);
        if places.is_empty() {
            return (0, self.leave(process, finished));
        }
        let finished = finished + places.len();
        let mut spent = nanoseconds(replays.prices.ticket);
        if tickets.should_invite(places.end, chunks, self.crew.workers()) {
            spent += self.invite(process, worker);
        }
        spent += self.work(process, places, worker);
        (spent, Some(Action::TakeChunks { process, pace, finished }))
    }

    /// What a worker does that has done so many chunks of a pass and takes no more of them.
    fn leave(&mut self, process: u32, finished: usize) -> Option<Action> {
        let done = &mut self.chunks_done[process as usize];
        *done += finished;
        let is_last = finished > 0 && *done == self.replays.costs.processes[process as usize].chunks.count();
        is_last.then_some(Action::Complete(process))
    }

    fn invite(&mut self, process: u32, worker: usize) -> u64 {
        self.crew.push(worker, Token::Join(process), self.band(process))
    }

    /// How long these chunks take.
    fn work(&mut self, process: u32, places: Range<usize>, worker: usize) -> u64 {
        let count = places.len() as u64;
        let work = self.replays.costs.processes[process as usize].of(places);
        self.outcome.busy[worker] += work;
        work + count * nanoseconds(self.replays.prices.chunk)
    }

    fn complete(&mut self, process: u32, worker: usize) -> (u64, Option<Action>) {
        self.outcome.processes[process as usize].end = self.crew.now();
        self.open -= 1;
        let mut ready = Vec::new();
        for &dependent in self.adjacency.dependents(process) {
            let waits_for = &mut self.waits_for[dependent as usize];
            *waits_for -= 1;
            if *waits_for == 0 {
                ready.push(dependent);
            }
        }
        self.hand_out(ready, worker)
    }

    /// Pushes these processes, which became ready together, but for one to go on with.
    fn hand_out(&mut self, ready: Vec<u32>, worker: usize) -> (u64, Option<Action>) {
        let (mut spent, mut kept, mut together) = (0, None, Vec::<u32>::new());
        let is_pinned = |process: u32| self.replays.costs.processes[process as usize].pinned;
        let (pinned, others): (Vec<u32>, Vec<u32>) = ready.into_iter().partition(|&process| is_pinned(process));
        for process in pinned {
            spent += self.crew.push_pinned(worker, Token::StartPinned(process));
        }
        for process in others {
            if kept.is_none() {
                kept = Some(process);
                continue;
            }
            if together.first().is_some_and(|&first| self.band(first) != self.band(process)) {
                spent += self.push_ready(std::mem::take(&mut together), worker);
            }
            together.push(process);
        }
        if !together.is_empty() {
            spent += self.push_ready(together, worker);
        }
        let Some(kept) = kept else { return (spent, None) };
        if self.has_pinned(worker) {
            spent += self.crew.push(worker, Token::Start(kept), self.band(kept));
            return (spent, None);
        }
        (spent, Some(Action::Start { process: kept, is_pinned: false }))
    }

    fn push_ready(&mut self, processes: Vec<u32>, worker: usize) -> u64 {
        let band = self.band(processes[0]);
        self.crew.push(worker, Token::Ready(processes), band)
    }

    fn has_pinned(&self, worker: usize) -> bool {
        worker == 0 && self.crew.has_pinned()
    }

    fn band(&self, process: u32) -> Priority {
        if self.adjacency.is_critical(process) { Priority::Urgent } else { Priority::Normal }
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::super::sketch::any_sketch;
    use super::{Costs, Prices, RankedAdjacency, Replays};

    proptest! {
        #[test]
        fn a_process_starts_when_all_it_depends_on_has_ended(sketch in any_sketch(true), workers in 1..8_usize) {
            let costs = Costs::new(&sketch.run(&Prices::FREE), &Prices::FREE);
            let adjacency = RankedAdjacency::new(&costs.dependencies);
            let outcome = Replays::new(&costs, &Prices::FREE, workers).run(&adjacency);
            for (process, span) in sketch.processes.iter().zip(&outcome.processes) {
                prop_assert!(span.start <= span.end && span.end <= outcome.time);
                for &dependency in &process.dependencies {
                    prop_assert!(outcome.processes[dependency].end <= span.start);
                }
            }
        }
    }
}
