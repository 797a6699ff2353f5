//! Passes.

use std::ops::Range;

use crossbeam_utils::CachePadded;

use crate::sync::{AtomicUsize, Ordering};

use super::{
    job::{JobPanic, catch},
    scope::{self, Scope},
    worker::Worker,
};

/// One parallel loop.
pub(super) struct Pass<Body> {
    length: usize,
    chunk: usize,
    chunks: usize,
    body: Body,
    ticket: CachePadded<AtomicUsize>,
}

impl<Body: Fn(Range<usize>, &Worker) + Sync> Pass<Body> {
    /// The most chunks of a pass: half of what the ticket counts to.
    const MOST_CHUNKS: usize = usize::MAX / 2;

    pub(super) fn new(length: usize, chunk: usize, body: Body) -> Self {
        let chunk = chunk.max(1).max(length.div_ceil(Self::MOST_CHUNKS));
        Self { length, chunk, chunks: length.div_ceil(chunk), body, ticket: CachePadded::new(AtomicUsize::new(0)) }
    }

    pub(super) fn run(&self, worker: &Worker) -> Result<(), JobPanic> {
        if self.chunks == 1 || worker.shared().stealers().len() == 1 {
            return catch(|| {
                while let Some(range) = self.take() {
                    (self.body)(range, worker);
                }
            });
        }
        scope::open(worker, |scope| self.join(scope, worker))
    }

    /// Takes chunks until none is left, and sees to it that somebody else can join.
    fn join<'scope>(&'scope self, scope: &Scope<'scope>, worker: &Worker) {
        if !worker.enter(self.address()) {
            return;
        }
        let outcome = catch(|| {
            loop {
                if self.remaining() > 1 && worker.take_token() {
                    scope.spawn(|scope, worker| self.join(scope, worker));
                }
                let Some(range) = self.take() else { break };
                (self.body)(range, worker);
            }
        });
        worker.leave();
        if let Err(panic) = outcome {
            self.stop();
            scope.state().fail(panic);
        }
    }

    fn take(&self) -> Option<Range<usize>> {
        let ticket = self.ticket.fetch_add(1, Ordering::Relaxed);
        if ticket >= self.chunks {
            return None;
        }
        let start = ticket * self.chunk;
        Some(start..start.saturating_add(self.chunk).min(self.length))
    }

    fn remaining(&self) -> usize {
        self.chunks.saturating_sub(self.ticket.load(Ordering::Relaxed))
    }

    fn stop(&self) {
        self.ticket.store(self.chunks, Ordering::Relaxed);
    }

    fn address(&self) -> usize {
        std::ptr::from_ref(self).addr()
    }
}
