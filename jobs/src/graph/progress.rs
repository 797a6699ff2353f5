//! The progress of a parallel run. It is allocated once for all runs, and each run leaves it as it was.
//!
//! # Memory ordering
//!
//! A node's writes must be visible to all its dependents. The worker that completes a node counts down each dependent's
//! dependencies with release and acquire. Read-modify-writes continue a release sequence, so the worker that counts
//! down the last dependency, or sees that its own is the only one left, has acquired from all others. A node's counter
//! is set again when the node starts. By then, no other worker counts it down in this run; those that do in the next
//! run are ordered after the end of this one.

use crossbeam_utils::CachePadded;

use super::adjacency::RankedAdjacency;
use super::shared_span::SharedSpan;
use crate::sync::{AtomicU32, AtomicUsize, Mutex, Ordering};
use crate::task::{Chunks, Tickets};

pub(super) struct Progress {
    /// Per node, how many of its dependencies are not complete.
    pending_dependencies: Box<[AtomicU32]>,
    /// Ready nodes on their way to a worker. Each node has a slot for each of its dependents, written at most once a
    /// run. The roots' slots come last.
    ready_slots: Box<[AtomicU32]>,
    open_nodes: Box<[CachePadded<OpenNode>]>,
}

impl Progress {
    pub(super) fn new(adjacency: &RankedAdjacency) -> Self {
        let nodes = 0..adjacency.len() as u32;
        let slots = adjacency.edge_count() + adjacency.roots().len();
        Self {
            pending_dependencies: nodes.clone().map(|node| AtomicU32::new(adjacency.dependency_count(node))).collect(),
            ready_slots: (0..slots).map(|_| AtomicU32::new(0)).collect(),
            open_nodes: nodes.map(|_| CachePadded::new(OpenNode::new())).collect(),
        }
    }

    /// Sets how many dependencies the node waits for, in the next run or in the rest of this one.
    pub(super) fn set_pending_dependencies(&self, node: u32, dependencies: u32) {
        // Relaxed: see the module's documentation.
        self.pending_dependencies[node as usize].store(dependencies, Ordering::Relaxed);
    }

    /// Counts down one of the node's dependencies, and returns whether it was the last.
    pub(super) fn complete_dependency(&self, node: u32) -> bool {
        let pending = &self.pending_dependencies[node as usize];
        // Each dependency counts down once, so the last one can skip the subtraction: nobody else looks at the counter
        // before it is set again. It acquires as the subtraction would.
        pending.load(Ordering::Acquire) == 1 || pending.fetch_sub(1, Ordering::AcqRel) == 1
    }

    /// Writes a ready node to a slot, for the worker that gets the token.
    pub(super) fn set_ready(&self, slot: u32, node: u32) {
        // Relaxed, here and below: the token that names the slots orders them.
        self.ready_slots[slot as usize].store(node, Ordering::Relaxed);
    }

    /// The ready node in a slot.
    pub(super) fn ready(&self, slot: u32) -> u32 {
        self.ready_slots[slot as usize].load(Ordering::Relaxed)
    }

    pub(super) fn open_node(&self, node: u32) -> &OpenNode {
        &self.open_nodes[node as usize]
    }
}

/// A node of more than one chunk while workers run it.
pub(super) struct OpenNode {
    chunks: Mutex<Chunks>,
    pub(super) tickets: Tickets,
    done: AtomicUsize,
    pub(super) span: SharedSpan,
}

impl OpenNode {
    fn new() -> Self {
        Self {
            chunks: Mutex::new(Chunks::new(0, 1)),
            tickets: Tickets::new(),
            done: AtomicUsize::new(0),
            span: SharedSpan::new(),
        }
    }

    /// Opens the node with `done` chunks already complete. No other worker may know of it yet.
    pub(super) fn open(&self, chunks: Chunks, done: usize) {
        *self.chunks.lock() = chunks;
        self.tickets.reset(done);
        // Relaxed: other workers join by a token that is pushed later.
        self.done.store(done, Ordering::Relaxed);
    }

    pub(super) fn chunks(&self) -> Chunks {
        *self.chunks.lock()
    }

    /// Counts complete chunks, and returns whether they were the last.
    pub(super) fn finish(&self, finished: usize, chunks: &Chunks) -> bool {
        // Release for what these chunks wrote, acquire for what all others wrote.
        finished > 0 && self.done.fetch_add(finished, Ordering::AcqRel) + finished == chunks.count()
    }
}

#[cfg(all(test, drawloom_loom))]
mod loom_tests {
    use loom::cell::UnsafeCell;
    use loom::{model, thread};

    use super::{OpenNode, Progress, RankedAdjacency};
    use crate::sync::Arc;
    use crate::task::Chunks;

    /// Each thread writes one cell, and the last thread reads all. loom checks them for races.
    struct Cells<const COUNT: usize>([UnsafeCell<usize>; COUNT]);

    impl<const COUNT: usize> Cells<COUNT> {
        fn new() -> Self {
            Self([(); COUNT].map(|()| UnsafeCell::new(0)))
        }

        fn write(&self, index: usize, value: usize) {
            // SAFETY: No other access may run at the same time: each thread writes its own cell, before it counts down.
            // loom checks that.
            self.0[index].with_mut(|cell| unsafe { *cell = value });
        }

        fn values(&self) -> [usize; COUNT] {
            // SAFETY: No write may run at the same time: the cells are read after all threads have counted down. loom
            // checks that.
            self.0.each_ref().map(|cell| cell.with(|cell| unsafe { *cell }))
        }
    }

    /// Calls `call` on `THREADS` threads with 0, 1 and so on, and returns how many calls returned true.
    fn count_true<const THREADS: usize, T: 'static>(state: &Arc<T>, call: fn(&T, usize) -> bool) -> usize {
        let threads: Vec<_> = (1..THREADS)
            .map(|index| {
                let state = Arc::clone(state);
                thread::spawn(move || call(&state, index))
            })
            .collect();
        let here = usize::from(call(state, 0));
        here + threads.into_iter().map(|thread| usize::from(thread.join().unwrap())).sum::<usize>()
    }

    /// A node that depends on `COUNT` others.
    struct Join<const COUNT: usize> {
        progress: Progress,
        cells: Cells<COUNT>,
    }

    impl<const COUNT: usize> Join<COUNT> {
        fn new() -> Arc<Self> {
            let mut dependencies = vec![Vec::new(); COUNT];
            dependencies.push((0..COUNT).collect());
            Arc::new(Self { progress: Progress::new(&RankedAdjacency::new(&dependencies)), cells: Cells::new() })
        }

        /// Completes a dependency, and starts the node if that was the last one.
        fn complete(&self, index: usize) -> bool {
            self.cells.write(index, 1);
            let is_last = self.progress.complete_dependency(COUNT as u32);
            if is_last {
                self.progress.set_pending_dependencies(COUNT as u32, COUNT as u32);
                assert_eq!(self.cells.values(), [1; COUNT]);
            }
            is_last
        }
    }

    #[test]
    fn the_last_of_two_dependencies_sees_the_other_in_each_of_two_runs() {
        model(|| {
            let join = Join::<2>::new();
            for _run in 0..2 {
                assert_eq!(count_true::<2, _>(&join, Join::complete), 1);
                join.cells.write(0, 0);
                join.cells.write(1, 0);
            }
        });
    }

    #[test]
    fn the_last_of_three_dependencies_sees_the_others() {
        model(|| assert_eq!(count_true::<3, _>(&Join::<3>::new(), Join::complete), 1));
    }

    /// A node of three chunks.
    struct ThreeChunks {
        node: OpenNode,
        cells: Cells<3>,
    }

    impl ThreeChunks {
        /// Worker 0 runs two of the chunks, worker 1 one.
        fn work(&self, index: usize) -> bool {
            let chunks = self.node.chunks();
            let own = if index == 0 { 0..2 } else { 2..3 };
            let finished = own.len();
            own.for_each(|chunk| self.cells.write(chunk, 1));
            let is_last = self.node.finish(finished, &chunks);
            if is_last {
                assert_eq!(self.cells.values(), [1; 3]);
            }
            is_last
        }
    }

    #[test]
    fn the_worker_that_finishes_a_node_sees_all_its_chunks() {
        model(|| {
            let node = Arc::new(ThreeChunks { node: OpenNode::new(), cells: Cells::new() });
            node.node.open(Chunks::new(3, 1), 0);
            assert_eq!(count_true::<2, _>(&node, ThreeChunks::work), 1);
            assert!(!node.node.finish(0, &node.node.chunks()), "a worker that ran no chunk is not the last");
        });
    }
}
