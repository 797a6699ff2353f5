//! Parallel execution: a run on all workers.
//!
//! No job ever waits. A node that is not ready exists only as a counter of pending dependencies. The worker that brings
//! the counter to zero makes the node *ready*. When a worker completes a node, it continues with the first dependent
//! that became ready, and pushes the others as a single token. A worker that takes this token pushes half of its nodes,
//! then half of the rest, until one node is left, so the largest part is where thieves steal first.
//!
//! A node's width is asked for when the node starts. A node of more than one chunk becomes an *open node*: workers
//! claim its chunks by ticket, and a token invites another worker to join. The worker that finishes the last chunk
//! completes the node.
//!
//! After a failure the run is *drained*: the remaining nodes are skipped. Skipped nodes still decrement counters, so
//! that these are reset for the next run.

use std::ops::Range;

use super::execute::Run;
use super::flat_graph::FlatGraph;
use super::instrument::{Instrument, NodeSpan};
use super::node::Node;
use super::progress::OpenNode;
use super::schedule::Schedule;
use super::serial::Suspended;
use super::token::Token;
use crate::sync::Instant;
use crate::task::{Chunks, JobPanic, Priority, TicketSize, TokenContext, Tokens, Worker, run_tokens};

impl<P: Node<C>, C: Sync + ?Sized, I: Instrument> Run<'_, P, C, I> {
    /// Runs all nodes.
    ///
    /// # Errors
    /// Returns the panic if something panicked outside of every node.
    pub(super) fn run_parallel(&self, worker: &Worker) -> Result<(), JobPanic> {
        self.start_parallel(worker);
        run_tokens(worker, self, |context| {
            let adjacency = &self.schedule.graph.adjacency;
            let mut ready = ReadyNodes::new(self, adjacency.edge_count() as u32, context);
            for &root in adjacency.roots() {
                ready.add(root);
            }
            if let Some(first) = ready.push_all_but_one() {
                self.start(first, false, context);
            }
        })
    }

    /// Runs the rest of a suspended serial run.
    ///
    /// # Errors
    /// As [`run_parallel`](Self::run_parallel).
    pub(super) fn resume_parallel(&self, suspended: Suspended<I::Span<'_>>, worker: &Worker) -> Result<(), JobPanic> {
        let Suspended { node: current, chunks, done, span } = suspended;
        let is_half_done = done < chunks.count();
        let first_pending = if is_half_done { current } else { current + 1 };
        self.start_parallel(worker);
        run_tokens(worker, self, |context| {
            // The span of a complete node is dropped before any of its dependents begins.
            let half_done = is_half_done.then_some(span);
            // All counters are set before any of them can be counted down.
            let rest = current + 1..self.schedule.graph.adjacency.len() as u32;
            for node in rest.clone() {
                self.schedule.progress.set_pending_dependencies(node, self.pending_dependencies(node, first_pending));
            }
            for node in rest.filter(|&node| self.pending_dependencies(node, first_pending) == 0) {
                self.push_start(node, context);
            }
            if let Some(span) = half_done {
                let open = self.schedule.progress.open_node(current);
                open.open(chunks, done);
                span.share(&open.span);
                if self.join(current, context) {
                    self.complete_and_continue(current, context);
                }
            }
        })
    }

    fn start_parallel(&self, worker: &Worker) {
        // The job that started the run may be a stolen one. The run's own jobs are not.
        self.instrument.clear_stolen(worker);
        self.instrument.start_parallel();
    }

    /// How many of a node's dependencies have the index `first_pending` or a higher one.
    fn pending_dependencies(&self, node: u32, first_pending: u32) -> u32 {
        let dependencies = self.schedule.dependencies(node as usize);
        (dependencies.len() - dependencies.partition_point(|&dependency| dependency < first_pending as usize)) as u32
    }

    /// Pushes a ready node.
    fn push_start(&self, node: u32, context: &TokenContext<'_>) {
        self.instrument.count_ready();
        if self.is_pinned(node) {
            context.push_pinned(Token::StartPinned(node).encode());
        } else {
            context.push(Token::Start(node).encode(), self.priority(node));
        }
    }

    /// Starts one of the ready nodes in these slots, and pushes the others.
    fn start_one_of(&self, mut slots: Range<u32>, context: &TokenContext<'_>) {
        while slots.len() > 1 {
            let middle = slots.start + slots.len() as u32 / 2;
            self.push_ready(middle..slots.end, context);
            slots.end = middle;
        }
        self.start(self.schedule.progress.ready(slots.start), false, context);
    }

    fn push_ready(&self, slots: Range<u32>, context: &TokenContext<'_>) {
        let priority = self.priority(self.schedule.progress.ready(slots.start));
        context.push(Token::Ready(slots).encode(), priority);
    }

    /// Starts a ready node, and continues from node to node as long as completing one makes another ready.
    ///
    /// This is a loop and not a recursion, so the length of a chain of nodes is not limited by the stack.
    fn start(&self, node: u32, is_pinned: bool, context: &TokenContext<'_>) {
        let worker = context.worker();
        let mut next = Some((node, is_pinned));
        while let Some((node, is_pinned)) = next {
            self.schedule.progress.set_pending_dependencies(node, self.schedule.graph.adjacency.dependency_count(node));
            self.timer.start(node);
            self.instrument.count_taken(worker);
            let is_done = self.run_node_parallel(node, is_pinned, context);
            self.instrument.clear_stolen(worker);
            if !is_done {
                return;
            }
            next = self.complete(node, context).map(|next| (next, false));
            // Only this worker can run pinned nodes, and any worker can run the next node.
            if let Some((node, _)) = next
                && context.has_pinned()
            {
                context.push(Token::Start(node).encode(), self.priority(node));
                return;
            }
        }
    }

    /// Completes a node, and continues with a dependent that this makes ready.
    fn complete_and_continue(&self, node: u32, context: &TokenContext<'_>) {
        if let Some(next) = self.complete(node, context) {
            self.start(next, false, context);
        }
    }

    /// Runs a node that has just started. Returns true if this worker finished it and must complete it, and false if
    /// the worker that finishes its last chunk will do so.
    fn run_node_parallel(&self, node: u32, is_pinned: bool, context: &TokenContext<'_>) -> bool {
        if self.is_stopped() {
            return true;
        }
        let worker = context.worker();
        let mut span = self.instrument.open(worker, node);
        let chunks = self.timer.work(|| {
            self.attempt(node, |location| {
                let chunks = self.chunks(node, worker);
                if chunks.count() > 1 && !is_pinned {
                    return Ok(Some(chunks));
                }
                if chunks.count() == 0 {
                    span.end_empty();
                }
                self.run_chunks(location, &chunks, 0..chunks.count(), worker, &mut span)?;
                Ok(None)
            })
        });
        let Some(Some(chunks)) = chunks else { return true };
        let open = self.schedule.progress.open_node(node);
        open.open(chunks, 0);
        span.share(&open.span);
        self.join(node, context)
    }

    /// Takes part in an open node. Returns true for the one worker that finished its last chunk.
    fn join(&self, node: u32, context: &TokenContext<'_>) -> bool {
        let open = self.schedule.progress.open_node(node);
        let chunks = open.chunks();
        let size = open.tickets.join();
        let finished = self.timer.work(|| self.take_chunks(node, open, &chunks, size, context));
        self.instrument.clear_stolen(context.worker());
        let is_last = open.finish(finished, &chunks);
        if is_last {
            self.instrument.close(&open.span);
        }
        is_last
    }

    /// Claims and runs chunks until none is left, and returns how many. After a failure, chunks are only counted.
    ///
    /// The worker's span begins at its first chunk: a worker that gets no chunk takes no part in the node, and may even
    /// come after the node is complete.
    fn take_chunks(
        &self,
        node: u32,
        open: &OpenNode,
        chunks: &Chunks,
        mut size: TicketSize,
        context: &TokenContext<'_>,
    ) -> usize {
        let (worker, mut span) = (context.worker(), None);
        let mut finished = 0;
        loop {
            if finished > 0 && context.has_pinned() {
                // Only this worker can run pinned nodes, and any worker can join this node.
                if open.tickets.leave(chunks) {
                    context.push(Token::Join(node).encode(), self.priority(node));
                }
                return finished;
            }
            let indices = if self.is_stopped() {
                open.tickets.take_rest(chunks)
            } else {
                open.tickets.take(chunks, &mut size, worker.workers(), Instant::now)
            };
            if indices.is_empty() {
                return finished;
            }
            finished += indices.len();
            if open.tickets.should_invite(indices.end, chunks, worker.workers()) {
                context.push(Token::Join(node).encode(), self.priority(node));
            }
            let span = span.get_or_insert_with(|| self.instrument.join(worker, node, &open.span));
            self.attempt(node, |location| self.run_chunks(location, chunks, indices, worker, span));
        }
    }

    /// Counts down the dependents of a complete node. Pushes those that became ready, except for one that any worker
    /// can run, and returns that one for this worker to run next.
    fn complete(&self, node: u32, context: &TokenContext<'_>) -> Option<u32> {
        self.timer.end(node);
        let Schedule { graph: FlatGraph { adjacency, .. }, progress, .. } = self.schedule;
        let mut ready = ReadyNodes::new(self, adjacency.dependents_start(node), context);
        for &dependent in adjacency.dependents(node) {
            if progress.complete_dependency(dependent) {
                ready.add(dependent);
            }
        }
        ready.push_all_but_one()
    }

    /// Whether only the calling thread may run the node. If the call fails, it does not matter which worker drains the
    /// node.
    fn is_pinned(&self, node: u32) -> bool {
        self.attempt(node, |_location| Ok(self.node(node).pinned())).unwrap_or(false)
    }

    fn priority(&self, node: u32) -> Priority {
        if self.schedule.graph.adjacency.is_critical(node) { Priority::Urgent } else { Priority::Normal }
    }
}

impl<P: Node<C>, C: Sync + ?Sized, I: Instrument> Tokens for Run<'_, P, C, I> {
    fn run(&self, token: u64, context: &TokenContext<'_>) {
        match Token::decode(token) {
            Token::Ready(slots) => self.start_one_of(slots, context),
            Token::Start(node) => self.start(node, false, context),
            Token::StartPinned(node) => self.start(node, true, context),
            Token::Join(node) => {
                if self.join(node, context) {
                    self.complete_and_continue(node, context);
                }
            }
        }
    }
}

/// Nodes that became ready together, when one node completed or the run began.
struct ReadyNodes<'run, P, C: ?Sized, I> {
    run: &'run Run<'run, P, C, I>,
    context: &'run TokenContext<'run>,
    /// The slots of the nodes that are not pushed yet: all of one priority.
    slots: Range<u32>,
    /// The node that this worker runs next.
    next: Option<u32>,
    has_pinned: bool,
}

impl<'run, P: Node<C>, C: Sync + ?Sized, I: Instrument> ReadyNodes<'run, P, C, I> {
    /// No nodes yet. Those that are added take the slots from `slot` on.
    fn new(run: &'run Run<'run, P, C, I>, slot: u32, context: &'run TokenContext<'run>) -> Self {
        Self { run, context, slots: slot..slot, next: None, has_pinned: false }
    }

    fn add(&mut self, node: u32) {
        let run = self.run;
        run.instrument.count_ready();
        if run.is_pinned(node) {
            self.context.push_pinned(Token::StartPinned(node).encode());
            self.has_pinned = true;
        } else if self.context.worker().is_shuffled() {
            // One token each, so that any of them can come next.
            self.context.push(Token::Start(node).encode(), run.priority(node));
        } else if self.next.is_none() {
            self.next = Some(node);
        } else {
            let progress = &run.schedule.progress;
            if !self.slots.is_empty() && run.priority(progress.ready(self.slots.start)) != run.priority(node) {
                self.push();
            }
            progress.set_ready(self.slots.end, node);
            self.slots.end += 1;
        }
    }

    /// Pushes all nodes but one, and returns that one. Returns `None` on the calling thread if one of the nodes is
    /// pinned, because only that thread can run it.
    fn push_all_but_one(mut self) -> Option<u32> {
        if !self.slots.is_empty() {
            self.push();
        }
        if self.has_pinned && self.context.is_owner() {
            let next = self.next.take()?;
            self.context.push(Token::Start(next).encode(), self.run.priority(next));
        }
        self.next
    }

    fn push(&mut self) {
        self.run.push_ready(self.slots.clone(), self.context);
        self.slots.start = self.slots.end;
    }
}
