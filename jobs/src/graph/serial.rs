//! Serial execution: the calling thread runs one node after another. No dependencies are counted, because the nodes are
//! in topological order.

use std::time::Duration;

use super::error::NodeError;
use super::execute::{Location, Run};
use super::instrument::{Instrument, NodeSpan};
use super::node::Node;
use crate::task::{Chunks, Worker};
use crate::timeline::Stopwatch;

/// Where a serial run stopped because it exceeded its limit. All nodes before this one are complete.
pub(super) struct Suspended<S> {
    pub(super) node: u32,
    pub(super) chunks: Chunks,
    /// How many of the node's chunks are complete.
    pub(super) done: usize,
    pub(super) span: S,
}

impl<P: Node<C>, C: Sync + ?Sized, I: Instrument> Run<'_, P, C, I> {
    /// Runs all nodes. If that takes longer than the limit, measured by the given stopwatch, it returns where it
    /// stopped.
    pub(super) fn run_serial(
        &self,
        worker: &Worker,
        limit: Option<(Stopwatch<'_>, Duration)>,
    ) -> Option<Suspended<I::Span<'_>>> {
        let mut span = self.instrument.start_serial(worker);
        let mut deadline = limit.map(|(start, limit)| Deadline { start, limit, chunks: 0, next_check: 1 });
        // One attempt for all nodes: an attempt for each would cost more than the rest of a node's overhead.
        let suspended = self.attempt(0, |location| {
            for node in 0..self.schedule.graph.adjacency.len() as u32 {
                *location = Location { node, item: 0 };
                span.switch_to(node);
                if let Some((chunks, done)) = self.run_node_serial(location, worker, deadline.as_mut(), &mut span)? {
                    return Ok(Some(Suspended { node, chunks, done, span }));
                }
            }
            Ok(None)
        });
        suspended.flatten()
    }

    /// Runs one node. If the deadline passes, it returns the chunks and how many of them are complete. A pinned node is
    /// always completed, because no other worker could.
    #[inline]
    fn run_node_serial(
        &self,
        location: &mut Location,
        worker: &Worker,
        mut deadline: Option<&mut Deadline<'_>>,
        span: &mut impl NodeSpan,
    ) -> Result<Option<(Chunks, usize)>, NodeError> {
        let node = location.node;
        // Only needed if the deadline passes, but always called, so that a panic in it fails serial runs as it fails
        // parallel ones.
        let is_pinned = self.node(node).pinned();
        let chunks = self.chunks(node, worker);
        if chunks.count() == 0 {
            span.end_empty();
        }
        for chunk in 0..chunks.count() {
            let done = chunk + 1;
            self.run_chunks(location, &chunks, chunk..done, worker, span)?;
            let has_passed = deadline.as_mut().is_some_and(|deadline| deadline.has_passed());
            if has_passed && (done == chunks.count() || !is_pinned) {
                return Ok(Some((chunks, done)));
            }
        }
        Ok(None)
    }
}

/// The end of a serial run's time limit. It does not read the clock at every chunk.
struct Deadline<'run> {
    start: Stopwatch<'run>,
    limit: Duration,
    chunks: u32,
    next_check: u32,
}

impl Deadline<'_> {
    /// The largest number of chunks between two readings of the clock. A frame that suddenly takes longer than its
    /// limit overruns it by at most this many chunks.
    const MAX_CHUNKS: u32 = 16;

    /// Counts a complete chunk, and returns whether the deadline is known to have passed.
    #[inline]
    fn has_passed(&mut self) -> bool {
        self.chunks += 1;
        self.chunks >= self.next_check && self.check()
    }

    /// Reads the clock. At the start of a run, the number of chunks between two readings doubles each time.
    #[cold]
    fn check(&mut self) -> bool {
        self.chunks = 0;
        self.next_check = (self.next_check * 2).min(Self::MAX_CHUNKS);
        self.start.elapsed() > self.limit
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use super::*;
    use crate::timeline::{Timeline, TimelineSettings};

    #[test]
    fn the_clock_is_read_at_intervals_that_double_up_to_sixteen_chunks() {
        let timeline = Timeline::new(Vec::new(), TimelineSettings::default());
        let mut deadline =
            Deadline { start: timeline.stopwatch(), limit: Duration::from_secs(3_600), chunks: 0, next_check: 1 };
        let mut read_at = Vec::new();
        for chunk in 1..=64 {
            assert!(!deadline.has_passed());
            if deadline.chunks == 0 {
                read_at.push(chunk);
            }
        }
        assert_eq!(read_at, [1, 3, 7, 15, 31, 47, 63]);
        deadline.limit = Duration::ZERO;
        // Until time has passed by any clock.
        while deadline.start.elapsed().is_zero() {}
        assert_eq!((65..).find(|_| deadline.has_passed()), Some(79));
    }
}
