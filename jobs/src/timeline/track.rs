//! One worker's track: its chunks and idle intervals.

use std::ops::Range;
use std::time::Duration;

use super::clock::Clock;
use super::log::{Chunk, Idle, IdleKind};
use super::ring::{Event, Ring};
use crate::sync::{AtomicU64, Ordering};

/// What one worker writes. Only one thread at a time is that worker.
pub(super) struct Track {
    ring: Ring,
    /// The worker's open idle interval: its start and kind, or 0 if the worker is busy.
    idle: AtomicU64,
}

/// An event's tag is in the lowest bits of one of its words. The other bits are the timestamp of when the node was
/// opened.
const TAG_BITS: u32 = 3;
const TAG_MASK: u64 = (1 << TAG_BITS) - 1;
const SEARCHING: u64 = 3;
const ASLEEP: u64 = 4;

/// How a worker came by a chunk. The values are tags.
#[derive(Clone, Copy)]
#[repr(u64)]
pub(super) enum ChunkKind {
    Own = 0,
    /// Through a stolen job.
    Stolen = 1,
    /// The node has no items.
    Empty = 2,
}

/// An event, decoded.
pub(super) enum Entry {
    Chunk { run: u32, chunk: Chunk },
    Empty { run: u32, chunk: Chunk },
    Idle(Idle),
}

impl Track {
    pub(super) fn new(capacity: usize) -> Self {
        Self { ring: Ring::new(capacity), idle: AtomicU64::new(0) }
    }

    /// Allocates the ring's memory, unless it is allocated.
    pub(super) fn allocate(&self) {
        self.ring.allocate();
    }

    /// The size of the ring's memory.
    pub(super) fn bytes(&self) -> usize {
        self.ring.bytes()
    }

    /// Writes a chunk, with the timestamps of when its node was opened, when it started and when it ended. Returns
    /// whether there was room.
    #[inline]
    pub(super) fn push_chunk(
        &self,
        run_and_node: u64,
        items: &Range<usize>,
        kind: ChunkKind,
        [opened, started, ended]: [u64; 3],
    ) -> bool {
        let (start, length) = (items.start as u64, items.len() as u64);
        self.ring.push([run_and_node, start, length, opened << TAG_BITS | kind as u64, started, ended])
    }

    /// The worker becomes idle, or idle in another way. `now` is a timestamp if the timeline is on. Without one, the
    /// interval is only recorded if it is still open when the timeline is on.
    pub(super) fn start_idle(&self, kind: IdleKind, now: Option<u64>) {
        self.end_idle(now);
        // Release: a thread that reads this interval finds the one before it in the ring.
        self.idle.store(now.unwrap_or(0) << TAG_BITS | tag_of(kind), Ordering::Release);
    }

    /// Whether the worker is idle.
    pub(super) fn is_idle(&self) -> bool {
        // Relaxed, here and below: only the worker writes it.
        self.idle.load(Ordering::Relaxed) != 0
    }

    /// The worker becomes busy. The idle interval is recorded if `now` is a timestamp.
    pub(super) fn end_idle(&self, now: Option<u64>) {
        let idle = self.idle.load(Ordering::Relaxed);
        self.idle.store(0, Ordering::Relaxed);
        if let Some(now) = now.filter(|_| idle != 0) {
            self.ring.push([0, 0, 0, idle & TAG_MASK, idle >> TAG_BITS, now]);
        }
    }

    /// The worker's open idle interval, up to now.
    pub(super) fn idle_until(&self, now: Duration, clock: &Clock) -> Option<Idle> {
        let idle = self.idle.load(Ordering::Acquire);
        let kind = kind_of(idle & TAG_MASK)?;
        let since = clock.time(idle >> TAG_BITS);
        Some(Idle { kind, began: since, ended: now.max(since) })
    }

    /// Takes out all events, the oldest first, and returns how many were dropped.
    pub(super) fn drain(&self, worker: usize, clock: &Clock, mut take: impl FnMut(Entry)) -> u64 {
        self.ring.drain(|event| take(decode(event, worker, clock)))
    }
}

fn decode(event: Event, worker: usize, clock: &Clock) -> Entry {
    let [run_and_node, start, length, tagged, started, ended] = event;
    let tag = tagged & TAG_MASK;
    let [started, ended] = [started, ended].map(|timestamp| clock.time(timestamp));
    if let Some(kind) = kind_of(tag) {
        return Entry::Idle(Idle { kind, began: started, ended });
    }
    let chunk = Chunk {
        node: run_and_node as u32 as usize,
        items: start as usize..start as usize + length as usize,
        worker,
        opened: clock.time(tagged >> TAG_BITS),
        started,
        ended,
        stolen: tag == ChunkKind::Stolen as u64,
    };
    let run = (run_and_node >> 32) as u32;
    if tag == ChunkKind::Empty as u64 { Entry::Empty { run, chunk } } else { Entry::Chunk { run, chunk } }
}

fn tag_of(kind: IdleKind) -> u64 {
    match kind {
        IdleKind::Searching => SEARCHING,
        IdleKind::Asleep => ASLEEP,
    }
}

fn kind_of(tag: u64) -> Option<IdleKind> {
    match tag {
        SEARCHING => Some(IdleKind::Searching),
        ASLEEP => Some(IdleKind::Asleep),
        _ => None,
    }
}

#[cfg(all(test, drawloom_loom))]
mod loom_tests {
    use loom::{model, thread};

    use super::{Clock, Duration, Entry, IdleKind, Track};
    use crate::sync::Arc;
    use crate::timeline::clock::EngineClock;
    use crate::unwind::Contained;

    #[test]
    fn an_open_idle_interval_is_read_after_the_closed_ones_before_it() {
        model(|| {
            let track = Arc::new(Track::new(2));
            track.allocate();
            let reader = thread::spawn({
                let track = Arc::clone(&track);
                move || {
                    let clock = Clock::Engine(EngineClock::new(Contained::new(Box::new(|| Duration::ZERO))));
                    let open = track.idle_until(Duration::from_nanos(4), &clock);
                    let mut closed = Vec::new();
                    let take = |entry| match entry {
                        Entry::Idle(idle) => closed.push((idle.began.as_nanos(), idle.ended.as_nanos())),
                        Entry::Chunk { .. } | Entry::Empty { .. } => unreachable!("the worker runs no chunks"),
                    };
                    assert_eq!(track.drain(0, &clock, take), 0);
                    if open.is_some_and(|idle| idle.kind == IdleKind::Asleep) {
                        assert_eq!(closed, [(1, 2)]);
                    }
                }
            });
            track.start_idle(IdleKind::Searching, Some(1));
            track.end_idle(Some(2));
            track.start_idle(IdleKind::Asleep, Some(3));
            reader.join().unwrap();
        });
    }
}
