//! Where the processes stand in a run that is shared between workers. It is kept from run to run, so that a run takes no
//! memory, and left as it was found.
//!
//! # Memory ordering
//!
//! What one process wrote must be seen by all that depend on it. Whoever is done with one counts each dependent down with
//! release and acquire; read-modify-writes continue a release sequence, so the worker that takes the last count off, or
//! sees that its own is the only one left, has acquired from all others. A process is armed again when it starts: by then
//! nobody else counts it down any more in this run, and in the next one only who has come after the end of this one.

use crossbeam_utils::CachePadded;

use crate::{
    sync::{AtomicU32, AtomicUsize, Mutex, Ordering},
    task::{Chunks, Tickets},
};

use super::flow::Flow;

/// How far a run is.
pub(super) struct Progress {
    /// Per process, how many of its dependencies are not done.
    waits_for: Box<[AtomicU32]>,
    /// Where processes stand that are ready, on their way to a worker. Each process has places for its dependents, which
    /// it fills once a run; behind those of all stand the roots.
    ready: Box<[AtomicU32]>,
    passes: Box<[CachePadded<OpenPass>]>,
}

impl Progress {
    pub(super) fn new(flow: &Flow) -> Self {
        let processes = 0..flow.len() as u32;
        Self {
            waits_for: processes.clone().map(|process| AtomicU32::new(flow.dependency_count(process))).collect(),
            ready: (0..flow.edges() + flow.roots().len()).map(|_| AtomicU32::new(0)).collect(),
            passes: processes.map(|_| CachePadded::new(OpenPass::new())).collect(),
        }
    }

    /// Makes the process wait for so many dependencies, in the next run or in what is left of this one.
    pub(super) fn arm(&self, process: u32, dependencies: u32) {
        // Relaxed: see above.
        self.waits_for[process as usize].store(dependencies, Ordering::Relaxed);
    }

    /// Takes off one of the dependencies that a process waits for, and says whether it was the last.
    pub(super) fn release(&self, process: u32) -> bool {
        let waits_for = &self.waits_for[process as usize];
        // Every dependency takes its count off once, so the last one need not: nobody else is going to look. Acquire as
        // with the subtraction.
        waits_for.load(Ordering::Acquire) == 1 || waits_for.fetch_sub(1, Ordering::AcqRel) == 1
    }

    /// Puts a process at a place from which a worker is going to take it.
    pub(super) fn set_ready(&self, place: u32, process: u32) {
        // Relaxed, here and below: the token that says which places it is about orders them.
        self.ready[place as usize].store(process, Ordering::Relaxed);
    }

    pub(super) fn ready(&self, place: u32) -> u32 {
        self.ready[place as usize].load(Ordering::Relaxed)
    }

    pub(super) fn pass(&self, process: u32) -> &OpenPass {
        &self.passes[process as usize]
    }
}

/// The items of a process of more than one chunk, while workers are at it.
pub(super) struct OpenPass {
    chunks: Mutex<Chunks>,
    pub(super) tickets: Tickets,
    done: AtomicUsize,
}

impl OpenPass {
    fn new() -> Self {
        Self { chunks: Mutex::new(Chunks::new(0, 1)), tickets: Tickets::new(), done: AtomicUsize::new(0) }
    }

    /// Sets a pass out of which so many chunks are done. Nobody else knows of it.
    pub(super) fn open(&self, chunks: Chunks, done: usize) {
        *self.chunks.lock() = chunks;
        self.tickets.reset(done);
        // Relaxed: who counts on has come by a token that is pushed later.
        self.done.store(done, Ordering::Relaxed);
    }

    pub(super) fn chunks(&self) -> Chunks {
        *self.chunks.lock()
    }

    /// Counts chunks off, and says whether they were the last.
    pub(super) fn finish(&self, finished: usize, chunks: &Chunks) -> bool {
        // Release for what these chunks wrote, acquire for what all others did.
        finished > 0 && self.done.fetch_add(finished, Ordering::AcqRel) + finished == chunks.count()
    }
}
