//! Where one process stands in a run, and how its items are cut into chunks.

use std::ops::Range;

use crate::sync::{AtomicBool, AtomicUsize, Ordering};

/// How far a process is in the current run.
pub(super) struct Progress {
    /// How many of its dependencies are not done.
    pub(super) waits_for: AtomicUsize,
    width: AtomicUsize,
    chunk: AtomicUsize,
    /// The next chunk to be taken.
    pub(super) ticket: AtomicUsize,
    /// How many chunks are done.
    pub(super) done: AtomicUsize,
    /// Whether a job lies in the deques through which another worker can join.
    pub(super) invited: AtomicBool,
}

impl Progress {
    pub(super) fn new(dependencies: usize) -> Self {
        Self {
            waits_for: AtomicUsize::new(dependencies),
            width: AtomicUsize::new(0),
            chunk: AtomicUsize::new(0),
            ticket: AtomicUsize::new(0),
            done: AtomicUsize::new(0),
            invited: AtomicBool::new(false),
        }
    }

    /// Sets a new pass out, and arms the process for the next run.
    pub(super) fn open(&self, pass: Pass, dependencies: usize) {
        // Relaxed, all of them: nobody else looks at the process before this thread spawns an invitation, and nobody
        // counts its dependencies down again before the next run.
        self.waits_for.store(dependencies, Ordering::Relaxed);
        self.width.store(pass.width, Ordering::Relaxed);
        self.chunk.store(pass.chunk, Ordering::Relaxed);
        self.ticket.store(0, Ordering::Relaxed);
        self.done.store(0, Ordering::Relaxed);
        self.invited.store(false, Ordering::Relaxed);
    }

    /// The pass that is open, as a worker finds it that joins.
    pub(super) fn pass(&self) -> Pass {
        // Relaxed: both were stored before the invitation was spawned through which the worker came here.
        Pass { width: self.width.load(Ordering::Relaxed), chunk: self.chunk.load(Ordering::Relaxed) }
    }
}

/// The items of a process, and how they are cut up.
#[derive(Clone, Copy)]
pub(super) struct Pass {
    width: usize,
    chunk: usize,
}

impl Pass {
    /// The most chunks: half of what a ticket counts to, since each worker that finds none left has counted on once more.
    const MOST_CHUNKS: usize = usize::MAX / 2;

    pub(super) fn new(width: usize, chunk: usize) -> Self {
        Self { width, chunk: chunk.max(1).max(width.div_ceil(Self::MOST_CHUNKS)) }
    }

    pub(super) fn chunks(self) -> usize {
        self.width.div_ceil(self.chunk)
    }

    pub(super) fn range(self, index: usize) -> Range<usize> {
        let start = index * self.chunk;
        start..start.saturating_add(self.chunk).min(self.width)
    }
}
