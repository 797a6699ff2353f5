//! Where the nodes stand in a run that is shared between workers. It is kept from run to run, so that a run takes no
//! memory, and left as it was found.
//!
//! # Memory ordering
//!
//! What one node wrote must be seen by all that depend on it. Whoever is done with one counts each dependent down with
//! release and acquire; read-modify-writes continue a release sequence, so the worker that takes the last count off, or
//! sees that its own is the only one left, has acquired from all others. A node is armed again when it starts: by then
//! nobody else counts it down any more in this run, and in the next one only who has come after the end of this one.

use crossbeam_utils::CachePadded;

use crate::{
    sync::{AtomicU32, AtomicUsize, Mutex, Ordering},
    task::{Chunks, Tickets},
};

use super::{flow::Flow, watch::Opened};

/// How far a run is.
pub(super) struct Progress {
    /// Per node, how many of its dependencies are not done.
    waits_for: Box<[AtomicU32]>,
    /// Where nodes stand that are ready, on their way to a worker. Each node has places for its dependents, which
    /// it fills once a run; behind those of all stand the roots.
    ready: Box<[AtomicU32]>,
    passes: Box<[CachePadded<OpenPass>]>,
}

impl Progress {
    pub(super) fn new(flow: &Flow) -> Self {
        let nodes = 0..flow.len() as u32;
        Self {
            waits_for: nodes.clone().map(|node| AtomicU32::new(flow.dependency_count(node))).collect(),
            ready: (0..flow.edges() + flow.roots().len()).map(|_| AtomicU32::new(0)).collect(),
            passes: nodes.map(|_| CachePadded::new(OpenPass::new())).collect(),
        }
    }

    /// Makes the node wait for so many dependencies, in the next run or in what is left of this one.
    pub(super) fn arm(&self, node: u32, dependencies: u32) {
        // Relaxed: see above.
        self.waits_for[node as usize].store(dependencies, Ordering::Relaxed);
    }

    /// Takes off one of the dependencies that a node waits for, and says whether it was the last.
    pub(super) fn release(&self, node: u32) -> bool {
        let waits_for = &self.waits_for[node as usize];
        // Every dependency takes its count off once, so the last one need not: nobody else is going to look. Acquire as
        // with the subtraction.
        waits_for.load(Ordering::Acquire) == 1 || waits_for.fetch_sub(1, Ordering::AcqRel) == 1
    }

    /// Puts a node at a place from which a worker is going to take it.
    pub(super) fn set_ready(&self, place: u32, node: u32) {
        // Relaxed, here and below: the token that says which places it is about orders them.
        self.ready[place as usize].store(node, Ordering::Relaxed);
    }

    pub(super) fn ready(&self, place: u32) -> u32 {
        self.ready[place as usize].load(Ordering::Relaxed)
    }

    pub(super) fn pass(&self, node: u32) -> &OpenPass {
        &self.passes[node as usize]
    }
}

/// The items of a node of more than one chunk, while workers are at it.
pub(super) struct OpenPass {
    chunks: Mutex<Chunks>,
    pub(super) tickets: Tickets,
    done: AtomicUsize,
    /// Of use only while somebody looks on.
    pub(super) opened: Opened,
}

impl OpenPass {
    fn new() -> Self {
        Self {
            chunks: Mutex::new(Chunks::new(0, 1)),
            tickets: Tickets::new(),
            done: AtomicUsize::new(0),
            opened: Opened::new(),
        }
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

#[cfg(all(test, drawloom_loom))]
mod loom_tests {
    use loom::{cell::UnsafeCell, model, thread};

    use super::{Flow, OpenPass, Progress};
    use crate::{sync::Arc, task::Chunks};

    /// What each of several threads writes, and the last of them reads, checked by loom for races.
    struct Cells<const COUNT: usize>([UnsafeCell<usize>; COUNT]);

    impl<const COUNT: usize> Cells<COUNT> {
        fn new() -> Self {
            Self([(); COUNT].map(|()| UnsafeCell::new(0)))
        }

        fn write(&self, place: usize, value: usize) {
            // SAFETY: Only one thread writes the cell, before it counts itself off; loom checks that.
            self.0[place].with_mut(|cell| unsafe { *cell = value });
        }

        fn values(&self) -> [usize; COUNT] {
            // SAFETY: They are read when all who write them are counted off; loom checks that.
            self.0.each_ref().map(|cell| cell.with(|cell| unsafe { *cell }))
        }
    }

    /// Calls `call` on as many threads with 0, 1 and so on, and says how many of the calls returned true.
    fn count_true<const THREADS: usize, T: 'static>(state: &Arc<T>, call: fn(&T, usize) -> bool) -> usize {
        let threads: Vec<_> = (1..THREADS)
            .map(|place| {
                let state = Arc::clone(state);
                thread::spawn(move || call(&state, place))
            })
            .collect();
        let here = usize::from(call(state, 0));
        here + threads.into_iter().map(|thread| usize::from(thread.join().unwrap())).sum::<usize>()
    }

    /// A node that depends on so many others.
    struct Joint<const COUNT: usize> {
        progress: Progress,
        cells: Cells<COUNT>,
    }

    impl<const COUNT: usize> Joint<COUNT> {
        fn new() -> Arc<Self> {
            let mut dependencies = vec![Vec::new(); COUNT];
            dependencies.push((0..COUNT).collect());
            Arc::new(Self { progress: Progress::new(&Flow::new(&dependencies)), cells: Cells::new() })
        }

        /// What one of the others does, and the joint if that was the last.
        fn complete(&self, place: usize) -> bool {
            self.cells.write(place, 1);
            let is_last = self.progress.release(COUNT as u32);
            if is_last {
                self.progress.arm(COUNT as u32, COUNT as u32);
                assert_eq!(self.cells.values(), [1; COUNT]);
            }
            is_last
        }
    }

    #[test]
    fn one_of_two_dependencies_is_the_last_and_sees_the_other_in_each_of_two_runs() {
        model(|| {
            let joint = Joint::<2>::new();
            for _run in 0..2 {
                assert_eq!(count_true::<2, _>(&joint, Joint::complete), 1);
                joint.cells.write(0, 0);
                joint.cells.write(1, 0);
            }
        });
    }

    #[test]
    fn one_of_three_dependencies_is_the_last_and_sees_the_others() {
        model(|| assert_eq!(count_true::<3, _>(&Joint::<3>::new(), Joint::complete), 1));
    }

    /// A pass of three chunks.
    struct Pass {
        pass: OpenPass,
        cells: Cells<3>,
    }

    impl Pass {
        /// The first does two of the chunks.
        fn work(&self, place: usize) -> bool {
            let chunks = self.pass.chunks();
            let own = if place == 0 { 0..2 } else { 2..3 };
            let finished = own.len();
            own.for_each(|chunk| self.cells.write(chunk, 1));
            let is_last = self.pass.finish(finished, &chunks);
            if is_last {
                assert_eq!(self.cells.values(), [1; 3]);
            }
            is_last
        }
    }

    #[test]
    fn one_of_two_workers_finishes_a_pass_and_sees_all_chunks() {
        model(|| {
            let pass = Arc::new(Pass { pass: OpenPass::new(), cells: Cells::new() });
            pass.pass.open(Chunks::new(3, 1), 0);
            assert_eq!(count_true::<2, _>(&pass, Pass::work), 1);
            assert!(!pass.pass.finish(0, &pass.pass.chunks()), "who has done nothing is not the last");
        });
    }
}
