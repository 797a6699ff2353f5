//! What a worker writes.

use std::{ops::Range, time::Duration};

use crate::sync::{AtomicU64, Ordering};

use super::{
    clock::{Clock, Reader},
    log::{Chunk, Idle, IdleKind},
    ring::{Event, Ring},
};

/// Where one worker writes. Only one thread at a time is that worker.
pub(super) struct Lane {
    ring: Ring,
    /// What the worker has been passing its time with, and since when: 0 if it has something to do.
    idle: AtomicU64,
}

/// What an event tells, in the lowest bits of one of its words; the others are when the process was opened.
const TAGS: u32 = 3;
const CHUNK: u64 = 0;
const STOLEN_CHUNK: u64 = 1;
const EMPTY: u64 = 2;
const SEARCHING: u64 = 3;
const ASLEEP: u64 = 4;

/// An event, read.
pub(super) enum Entry {
    Chunk { run: u32, chunk: Chunk },
    Empty { run: u32, chunk: Chunk },
    Idle(Idle),
}

impl Lane {
    pub(super) fn new(capacity: usize) -> Self {
        Self { ring: Ring::new(capacity), idle: AtomicU64::new(0) }
    }

    /// Asks for memory, unless it has it.
    pub(super) fn make_room(&self) {
        self.ring.make_room();
    }

    /// How much memory it has.
    pub(super) fn bytes(&self) -> usize {
        self.ring.bytes()
    }

    /// The worker has nothing to do from this mark on, or passes its time in another way. Without a mark nothing is recorded,
    /// but if it is asleep still when something is, it has been so for all of that time.
    pub(super) fn start_idle(&self, kind: IdleKind, now: Option<u64>) {
        self.end_idle(now);
        // Release: whoever reads it finds the idle time before it in the ring.
        self.idle.store(now.unwrap_or(0) << TAGS | tag_of(kind), Ordering::Release);
    }

    /// Whether the worker had nothing to do.
    pub(super) fn is_idle(&self) -> bool {
        // Relaxed, here and below: it is the worker's own.
        self.idle.load(Ordering::Relaxed) != 0
    }

    /// The worker has something to do from this mark on. Without one nothing is recorded.
    pub(super) fn end_idle(&self, now: Option<u64>) {
        let idle = self.idle.load(Ordering::Relaxed);
        self.idle.store(0, Ordering::Relaxed);
        if let Some(now) = now.filter(|_| idle != 0) {
            self.ring.push([0, 0, 0, idle & mask(), idle >> TAGS, now]);
        }
    }

    /// What the worker passes its time with at this moment.
    pub(super) fn idle_until(&self, now: Duration, clock: &Clock) -> Option<Idle> {
        let idle = self.idle.load(Ordering::Acquire);
        let kind = kind_of(idle & mask())?;
        let since = clock.time(idle >> TAGS);
        Some(Idle { kind, began: since, ended: now.max(since) })
    }

    /// Takes out all that was written, the oldest first, and says how much was dropped.
    pub(super) fn drain(&self, worker: usize, clock: &Clock, mut take: impl FnMut(Entry)) -> u64 {
        self.ring.drain(|event| take(read(event, worker, clock)))
    }
}

fn read(event: Event, worker: usize, clock: &Clock) -> Entry {
    let [run_and_process, start, length, tagged, started, ended] = event;
    let tag = tagged & mask();
    let [started, ended] = [started, ended].map(|mark| clock.time(mark));
    if let Some(kind) = kind_of(tag) {
        return Entry::Idle(Idle { kind, began: started, ended });
    }
    let chunk = Chunk {
        process: run_and_process as u32 as usize,
        items: start as usize..start as usize + length as usize,
        worker,
        opened: clock.time(tagged >> TAGS),
        started,
        ended,
        stolen: tag == STOLEN_CHUNK,
    };
    let run = (run_and_process >> 32) as u32;
    if tag == EMPTY { Entry::Empty { run, chunk } } else { Entry::Chunk { run, chunk } }
}

fn mask() -> u64 {
    (1 << TAGS) - 1
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

/// A worker at the chunks of one process, one after another.
pub(crate) struct Lap<'run> {
    lane: &'run Lane,
    reader: Reader<'run>,
    run_and_process: u64,
    opened: u64,
    /// When the last chunk ended.
    since: u64,
    tag: u64,
    /// How many chunks of the run there was no room for, on all workers.
    dropped: &'run AtomicU64,
}

impl<'run> Lap<'run> {
    /// A worker begins with chunks of a process: of one that was opened at that mark, or else it opens it now.
    #[inline]
    pub(super) fn new(
        lane: &'run Lane,
        reader: Reader<'run>,
        [run, process]: [u32; 2],
        stolen: bool,
        opened: Option<u64>,
        dropped: &'run AtomicU64,
    ) -> Self {
        let since = reader.in_order();
        let tag = if stolen { STOLEN_CHUNK } else { CHUNK };
        let run_and_process = u64::from(run) << 32 | u64::from(process);
        Self { lane, reader, run_and_process, opened: opened.unwrap_or(since), since, tag, dropped }
    }

    /// When the process was opened.
    pub(crate) fn opened(&self) -> u64 {
        self.opened
    }

    /// The worker goes on with another process without a break, and opens it.
    #[inline]
    pub(crate) fn go_on(&mut self, process: u32) {
        self.run_and_process = self.run_and_process >> 32 << 32 | u64::from(process);
        self.opened = self.since;
    }

    /// A chunk of these items has ended.
    #[inline]
    pub(crate) fn end_chunk(&mut self, items: &Range<usize>) {
        self.write(items, self.tag);
    }

    /// The process has turned out to have no items.
    pub(crate) fn end_empty(&mut self) {
        self.write(&(0..0), EMPTY);
    }

    #[inline]
    fn write(&mut self, items: &Range<usize>, tag: u64) {
        // A reading out of order may be of a moment before the last one.
        let now = self.reader.read().max(self.since);
        let (start, length) = (items.start as u64, items.len() as u64);
        let event = [self.run_and_process, start, length, self.opened << TAGS | tag, self.since, now];
        if !self.lane.ring.push(event) {
            // Relaxed: whoever reads the count has come after the end of the run.
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        self.since = now;
    }
}

#[cfg(all(test, drawloom_loom))]
mod loom_tests {
    use loom::{model, thread};

    use super::{Clock, Duration, Entry, IdleKind, Lane};
    use crate::{sync::Arc, timeline::clock::EngineClock};

    #[test]
    fn an_idle_time_that_goes_on_is_read_after_those_before_it() {
        model(|| {
            let lane = Arc::new(Lane::new(2));
            lane.make_room();
            let reader = thread::spawn({
                let lane = Arc::clone(&lane);
                move || {
                    let clock = Clock::Engine(EngineClock::new(Box::new(|| Duration::ZERO)));
                    let goes_on = lane.idle_until(Duration::from_nanos(4), &clock);
                    let mut ended = Vec::new();
                    let take = |entry| match entry {
                        Entry::Idle(idle) => ended.push((idle.began.as_nanos(), idle.ended.as_nanos())),
                        Entry::Chunk { .. } | Entry::Empty { .. } => unreachable!("the worker runs nothing"),
                    };
                    assert_eq!(lane.drain(0, &clock, take), 0);
                    if goes_on.is_some_and(|idle| idle.kind == IdleKind::Asleep) {
                        assert_eq!(ended, [(1, 2)]);
                    }
                }
            });
            lane.start_idle(IdleKind::Searching, Some(1));
            lane.end_idle(Some(2));
            lane.start_idle(IdleKind::Asleep, Some(3));
            reader.join().unwrap();
        });
    }
}
