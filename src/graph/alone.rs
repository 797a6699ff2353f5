//! A run on one thread: one node after another, as they stand. Nothing is counted, as each stands after all it depends
//! on.

use std::time::Duration;

use crate::{
    sync::Instant,
    task::{Chunks, Worker},
};

use super::{
    error::NodeError,
    execute::{Position, Run},
    node::Node,
    watch::{Onlooker, Watching},
};

/// Where a run stood when it took too long for one thread: all before this node is done.
pub(super) struct Left<O> {
    pub(super) node: u32,
    pub(super) chunks: Chunks,
    /// How many of the node's chunks are done.
    pub(super) done: usize,
    /// Who looks on at it.
    pub(super) onlooker: O,
}

impl<P: Node<C>, C: Sync + ?Sized, W: Watching> Run<'_, P, C, W> {
    /// Runs everything, unless it takes longer than a limit since some moment; then it says where it stopped.
    pub(super) fn go_alone(&self, worker: &Worker, limit: Option<(Instant, Duration)>) -> Option<Left<W::Turn<'_>>> {
        let mut onlooker = self.watch.go_alone(worker);
        let mut patience = limit.map(|(start, at_most)| Patience { start, at_most, chunks: 0, next_look: 1 });
        // One attempt for all: an attempt a node would cost more than the rest of what is done for it.
        let left = self.attempt(0, |position| {
            for node in 0..self.schedule.flow.len() as u32 {
                *position = Position { node, item: 0 };
                onlooker.go_on(node);
                if let Some((chunks, done)) = self.run_alone(position, worker, patience.as_mut(), &mut onlooker)? {
                    return Ok(Some(Left { node, chunks, done, onlooker }));
                }
            }
            Ok(None)
        });
        left.flatten()
    }

    /// Runs one node, unless the time is over: then it says how many of which chunks are done. Whoever may run a pinned one
    /// has begun it, and ends it.
    #[inline]
    fn run_alone(
        &self,
        position: &mut Position,
        worker: &Worker,
        mut patience: Option<&mut Patience>,
        onlooker: &mut impl Onlooker,
    ) -> Result<Option<(Chunks, usize)>, NodeError> {
        let node = position.node;
        // Of no use here, unless the time is over; but what fails is to fail on one thread as on many.
        let is_pinned = self.node(node).pinned();
        let chunks = self.chunks(node, worker);
        if chunks.count() == 0 {
            onlooker.end_empty();
        }
        for place in 0..chunks.count() {
            let done = place + 1;
            self.run_chunks(position, &chunks, place..done, worker, onlooker)?;
            let is_over = patience.as_mut().is_some_and(|patience| patience.is_over());
            if is_over && (done == chunks.count() || !is_pinned) {
                return Ok(Some((chunks, done)));
            }
        }
        Ok(None)
    }
}

/// Tells when a run has taken too long, without asking the time at every chunk.
struct Patience {
    start: Instant,
    at_most: Duration,
    chunks: u32,
    next_look: u32,
}

impl Patience {
    /// How many chunks go by without a look at most. What a frame needs longer, once it is another one than before, is
    /// that many chunks.
    const MOST_CHUNKS: u32 = 16;

    /// Another chunk is done.
    #[inline]
    fn is_over(&mut self) -> bool {
        self.chunks += 1;
        self.chunks >= self.next_look && self.look()
    }

    /// Asks the time. At the start of a run every look is twice as far from the one before.
    #[cold]
    fn look(&mut self) -> bool {
        self.chunks = 0;
        self.next_look = (self.next_look * 2).min(Self::MOST_CHUNKS);
        self.start.elapsed() > self.at_most
    }
}
