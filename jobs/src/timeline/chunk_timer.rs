//! Times the chunks that one worker runs one after another.

use std::ops::Range;

use super::clock::ClockReader;
use super::track::{ChunkKind, Track};
use crate::sync::{AtomicU64, Ordering};

/// Writes an event for each chunk that a worker runs of a node. The end of a chunk is the beginning of the next, so
/// each chunk takes one reading of the clock.
pub(crate) struct ChunkTimer<'run> {
    track: &'run Track,
    reader: ClockReader<'run>,
    run_and_node: u64,
    opened: u64,
    /// When the last chunk ended.
    last_end: u64,
    kind: ChunkKind,
    /// How many chunks of the run were dropped, on all workers.
    dropped: &'run AtomicU64,
}

impl<'run> ChunkTimer<'run> {
    /// A worker begins to run chunks of a node. Without a timestamp of when the node was opened, this worker opens it
    /// now.
    #[inline]
    pub(super) fn new(
        track: &'run Track,
        reader: ClockReader<'run>,
        [run, node]: [u32; 2],
        stolen: bool,
        opened: Option<u64>,
        dropped: &'run AtomicU64,
    ) -> Self {
        let last_end = reader.read_ordered();
        let kind = if stolen { ChunkKind::Stolen } else { ChunkKind::Own };
        let run_and_node = u64::from(run) << 32 | u64::from(node);
        Self { track, reader, run_and_node, opened: opened.unwrap_or(last_end), last_end, kind, dropped }
    }

    /// When the node was opened.
    pub(crate) fn opened(&self) -> u64 {
        self.opened
    }

    /// The worker opens another node right after the last chunk.
    #[inline]
    pub(crate) fn switch_to(&mut self, node: u32) {
        self.run_and_node = self.run_and_node >> 32 << 32 | u64::from(node);
        self.opened = self.last_end;
    }

    /// A chunk of these items has ended.
    #[inline]
    pub(crate) fn end_chunk(&mut self, items: &Range<usize>) {
        self.write(items, self.kind);
    }

    /// The node has no items.
    pub(crate) fn end_empty(&mut self) {
        self.write(&(0..0), ChunkKind::Empty);
    }

    #[inline]
    fn write(&mut self, items: &Range<usize>, kind: ChunkKind) {
        // An unordered reading may be earlier than the last one.
        let now = self.reader.read().max(self.last_end);
        if !self.track.push_chunk(self.run_and_node, items, kind, [self.opened, self.last_end, now]) {
            // Relaxed: the count is read after the end of the run.
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        self.last_end = now;
    }
}
