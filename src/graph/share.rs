//! A run on all workers.
//!
//! No job ever waits. A node with something left to wait for is nothing but a counter of dependencies; whoever brings
//! that counter to zero has made the node *ready*. Who completes a node goes on with the first that became ready by
//! that, and pushes the others, all of them as one token; who takes such a token pushes one half of it, and half of the rest,
//! until one node is left, so that the largest part lies where thieves take it.
//!
//! A node asks its width when it starts. More than one chunk makes it a *pass*: chunks go by ticket, and a token is pushed
//! through which another worker joins. Whoever finishes the last chunk completes the node.
//!
//! After a failure the run is *drained*: nodes are completed without being run, so that all counters come to rest where
//! they began.

use std::ops::Range;

use crate::{
    sync::Instant,
    task::{Chunks, JobPanic, Priority, TicketSize, TokenContext, Tokens, Worker, run_tokens},
};

use super::{
    alone::Left,
    execute::Run,
    node::Node,
    progress::OpenPass,
    schedule::Schedule,
    token::Token,
    watch::{Onlooker, Watching},
};

impl<P: Node<C>, C: Sync + ?Sized, W: Watching> Run<'_, P, C, W> {
    /// Runs everything.
    ///
    /// # Errors
    ///
    /// A panic outside of every node.
    pub(super) fn share(&self, worker: &Worker) -> Result<(), JobPanic> {
        self.let_others_in(worker);
        run_tokens(worker, self, |crew| {
            let flow = &self.schedule.flow;
            let mut ready = Ready::new(self, flow.edges() as u32, crew);
            for &root in flow.roots() {
                ready.add(root);
            }
            if let Some(first) = ready.push_all_but_one() {
                self.start(first, false, crew);
            }
        })
    }

    /// Runs what is left of a run that one thread has begun.
    ///
    /// # Errors
    ///
    /// As [`share`](Self::share).
    pub(super) fn share_rest(&self, left: Left<W::Turn<'_>>, worker: &Worker) -> Result<(), JobPanic> {
        let is_half_done = left.done < left.chunks.count();
        let first_open = if is_half_done { left.node } else { left.node + 1 };
        self.let_others_in(worker);
        run_tokens(worker, self, |crew| {
            // It is left before anything that waits for it begins.
            let half_done = is_half_done.then_some(left.onlooker);
            // All are armed before the first of them can be counted down.
            let rest = left.node + 1..self.schedule.flow.len() as u32;
            for node in rest.clone() {
                self.schedule.progress.arm(node, self.open_dependencies(node, first_open));
            }
            for node in rest.filter(|&node| self.open_dependencies(node, first_open) == 0) {
                self.send(node, crew);
            }
            if let Some(onlooker) = half_done {
                let pass = self.schedule.progress.pass(left.node);
                pass.open(left.chunks, left.done);
                onlooker.leave(&pass.opened);
                if self.join(left.node, crew) {
                    self.go_on_after(left.node, crew);
                }
            }
        })
    }

    fn let_others_in(&self, worker: &Worker) {
        // A job that was stolen may have called for the run, and then that is its own.
        self.watch.forget_stolen(worker);
        self.watch.let_others_in();
    }

    /// How many of the nodes that one waits for stand at `first_open` or after it.
    fn open_dependencies(&self, node: u32, first_open: u32) -> u32 {
        let dependencies = self.schedule.dependencies(node as usize);
        (dependencies.len() - dependencies.partition_point(|&dependency| dependency < first_open as usize)) as u32
    }

    /// Pushes a node that is ready.
    fn send(&self, node: u32, crew: &TokenContext<'_>) {
        self.watch.count_ready();
        if self.is_pinned(node) {
            crew.push_pinned(Token::StartPinned(node).encode());
        } else {
            crew.push(Token::Start(node).encode(), self.band(node));
        }
    }

    /// Starts one of these nodes, and leaves the others to whoever comes.
    fn start_one_of(&self, mut places: Range<u32>, crew: &TokenContext<'_>) {
        while places.len() > 1 {
            let middle = places.start + places.len() as u32 / 2;
            self.push_ready(middle..places.end, crew);
            places.end = middle;
        }
        self.start(self.schedule.progress.ready(places.start), false, crew);
    }

    fn push_ready(&self, places: Range<u32>, crew: &TokenContext<'_>) {
        let band = self.band(self.schedule.progress.ready(places.start));
        crew.push(Token::Ready(places).encode(), band);
    }

    /// Starts a node that is ready, and goes on from one to the next as long as there is one to go on with.
    ///
    /// It is a loop and no recursion, so that a chain of nodes may be as long as memory lasts.
    fn start(&self, node: u32, is_pinned: bool, crew: &TokenContext<'_>) {
        let worker = crew.worker();
        let mut next = Some((node, is_pinned));
        while let Some((node, is_pinned)) = next {
            self.schedule.progress.arm(node, self.schedule.flow.dependency_count(node));
            self.clock.start(node);
            self.watch.count_taken(worker);
            let is_done = self.work_on(node, is_pinned, crew);
            self.watch.forget_stolen(worker);
            if !is_done {
                return;
            }
            next = self.complete(node, crew).map(|next| (next, false));
            // Nobody else can run what is pinned, and anybody can go on here.
            if let Some((node, _)) = next
                && crew.has_pinned()
            {
                crew.push(Token::Start(node).encode(), self.band(node));
                return;
            }
        }
    }

    /// Goes on with what a completed node has made ready.
    fn go_on_after(&self, node: u32, crew: &TokenContext<'_>) {
        if let Some(next) = self.complete(node, crew) {
            self.start(next, false, crew);
        }
    }

    /// Runs a node that has just started. True if it is done, and false if whoever finishes its last chunk is to
    /// complete it.
    fn work_on(&self, node: u32, is_pinned: bool, crew: &TokenContext<'_>) -> bool {
        if self.is_stopped() {
            return true;
        }
        let worker = crew.worker();
        let mut onlooker = self.watch.open(worker, node);
        let chunks = self.clock.work(|| {
            self.attempt(node, |position| {
                let chunks = self.chunks(node, worker);
                if chunks.count() > 1 && !is_pinned {
                    return Ok(Some(chunks));
                }
                if chunks.count() == 0 {
                    onlooker.end_empty();
                }
                self.run_chunks(position, &chunks, 0..chunks.count(), worker, &mut onlooker)?;
                Ok(None)
            })
        });
        let Some(Some(chunks)) = chunks else { return true };
        let pass = self.schedule.progress.pass(node);
        pass.open(chunks, 0);
        onlooker.leave(&pass.opened);
        self.join(node, crew)
    }

    /// Takes part in a pass. True for the one worker that finished its last chunk.
    fn join(&self, node: u32, crew: &TokenContext<'_>) -> bool {
        let pass = self.schedule.progress.pass(node);
        let chunks = pass.chunks();
        let pace = pass.tickets.join();
        let finished = self.clock.work(|| self.take_chunks(node, pass, &chunks, pace, crew));
        self.watch.forget_stolen(crew.worker());
        let is_last = pass.finish(finished, &chunks);
        if is_last {
            self.watch.close(&pass.opened);
        }
        is_last
    }

    /// Runs chunks until none is left, and says how many. After a failure they are only counted. Who looks on does so from the
    /// first chunk on: who gets none has no part in the node, and may come when it is done.
    fn take_chunks(
        &self,
        node: u32,
        pass: &OpenPass,
        chunks: &Chunks,
        mut pace: TicketSize,
        crew: &TokenContext<'_>,
    ) -> usize {
        let (worker, mut onlooker) = (crew.worker(), None);
        let mut finished = 0;
        loop {
            if finished > 0 && crew.has_pinned() {
                // Nobody else can run that, and anybody can join in this.
                if pass.tickets.leave(chunks) {
                    crew.push(Token::Join(node).encode(), self.band(node));
                }
                return finished;
            }
            let places = if self.is_stopped() {
                pass.tickets.take_rest(chunks)
            } else {
                pass.tickets.take(chunks, &mut pace, worker.workers(), Instant::now)
            };
            if places.is_empty() {
                return finished;
            }
            finished += places.len();
            if pass.tickets.should_invite(places.end, chunks, worker.workers()) {
                crew.push(Token::Join(node).encode(), self.band(node));
            }
            let onlooker = onlooker.get_or_insert_with(|| self.watch.join(worker, node, &pass.opened));
            self.attempt(node, |position| self.run_chunks(position, chunks, places, worker, onlooker));
        }
    }

    /// Counts down all that depend on the node. Those that became ready are pushed, but for one that can run anywhere:
    /// it is given back, to be gone on with at once.
    fn complete(&self, node: u32, crew: &TokenContext<'_>) -> Option<u32> {
        self.clock.end(node);
        let Schedule { flow, progress, .. } = self.schedule;
        let mut ready = Ready::new(self, flow.first_place(node), crew);
        for &dependent in flow.dependents(node) {
            if progress.release(dependent) {
                ready.add(dependent);
            }
        }
        ready.push_all_but_one()
    }

    /// Whether the node is one for the calling thread. If that failed, nobody is to run it.
    fn is_pinned(&self, node: u32) -> bool {
        self.attempt(node, |_position| Ok(self.node(node).pinned())).unwrap_or(false)
    }

    fn band(&self, node: u32) -> Priority {
        if self.schedule.flow.is_urgent(node) { Priority::Urgent } else { Priority::Normal }
    }
}

impl<P: Node<C>, C: Sync + ?Sized, W: Watching> Tokens for Run<'_, P, C, W> {
    fn run(&self, token: u64, crew: &TokenContext<'_>) {
        match Token::decode(token) {
            Token::Ready(places) => self.start_one_of(places, crew),
            Token::Start(node) => self.start(node, false, crew),
            Token::StartPinned(node) => self.start(node, true, crew),
            Token::Join(node) => {
                if self.join(node, crew) {
                    self.go_on_after(node, crew);
                }
            }
        }
    }
}

/// Nodes that became ready by one and the same.
struct Ready<'run, P, C: ?Sized, W> {
    run: &'run Run<'run, P, C, W>,
    crew: &'run TokenContext<'run>,
    /// Where those stand that have not been pushed: all of one band.
    places: Range<u32>,
    /// The one that is not pushed.
    kept: Option<u32>,
    has_pinned: bool,
}

impl<'run, P: Node<C>, C: Sync + ?Sized, W: Watching> Ready<'run, P, C, W> {
    /// None. They are to stand at the places from this one on.
    fn new(run: &'run Run<'run, P, C, W>, place: u32, crew: &'run TokenContext<'run>) -> Self {
        Self { run, crew, places: place..place, kept: None, has_pinned: false }
    }

    fn add(&mut self, node: u32) {
        let run = self.run;
        run.watch.count_ready();
        if run.is_pinned(node) {
            self.crew.push_pinned(Token::StartPinned(node).encode());
            self.has_pinned = true;
        } else if self.crew.worker().is_shuffled() {
            // Each by itself, so that any of them can come next.
            self.crew.push(Token::Start(node).encode(), run.band(node));
        } else if self.kept.is_none() {
            self.kept = Some(node);
        } else {
            let progress = &run.schedule.progress;
            if !self.places.is_empty() && run.band(progress.ready(self.places.start)) != run.band(node) {
                self.push();
            }
            progress.set_ready(self.places.end, node);
            self.places.end += 1;
        }
    }

    /// Pushes those that have not been pushed, but for one, and gives that back. There is none for a worker that is the only
    /// one to run another of them.
    fn push_all_but_one(mut self) -> Option<u32> {
        if !self.places.is_empty() {
            self.push();
        }
        if self.has_pinned && self.crew.is_owner() {
            let kept = self.kept.take()?;
            self.crew.push(Token::Start(kept).encode(), self.run.band(kept));
        }
        self.kept
    }

    fn push(&mut self) {
        self.run.push_ready(self.places.clone(), self.crew);
        self.places.start = self.places.end;
    }
}
