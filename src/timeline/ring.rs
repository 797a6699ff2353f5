//! A ring of events that one thread writes and another one takes out.
//!
//! It never waits and never grows: an event for which there is no room is dropped and counted. Its memory is asked for when it
//! is needed for the first time.
//!
//! # Memory ordering
//!
//! An event's words are written relaxed, and `written` is stored after them with release; the reader acquires it before it
//! reads them. The reader stores `taken` with release after it has read, and the writer acquires that before it writes over
//! what was there. So no word is read while it is written, without anything but loads and stores on the way in.

use std::sync::OnceLock;

use crossbeam_utils::CachePadded;

use crate::sync::{AtomicU64, AtomicUsize, Ordering};

/// The words of an event.
pub(super) const WORDS: usize = 6;

pub(super) type Event = [u64; WORDS];

pub(super) struct Ring {
    /// A power of two.
    capacity: usize,
    words: OnceLock<Box<[AtomicU64]>>,
    /// How many events were written. The writer alone changes it.
    written: CachePadded<AtomicUsize>,
    /// How many events were taken out. The reader alone changes it.
    taken: CachePadded<AtomicUsize>,
    /// How many events were dropped, and have not been told of.
    dropped: AtomicU64,
}

impl Ring {
    /// Of room for so many events at least. It takes no memory yet, and drops everything.
    pub(super) fn new(capacity: usize) -> Self {
        Self {
            capacity: capacity.next_power_of_two(),
            words: OnceLock::new(),
            written: CachePadded::new(AtomicUsize::new(0)),
            taken: CachePadded::new(AtomicUsize::new(0)),
            dropped: AtomicU64::new(0),
        }
    }

    /// Asks for its memory, unless it has it.
    pub(super) fn make_room(&self) {
        self.words.get_or_init(|| (0..self.capacity * WORDS).map(|_| AtomicU64::new(0)).collect());
    }

    /// How much memory it has.
    pub(super) fn bytes(&self) -> usize {
        self.words.get().map_or(0, |words| size_of_val(&**words))
    }

    /// Writes an event, and says whether there was room. One thread at a time may do so, each after the one before.
    #[inline]
    pub(super) fn push(&self, event: Event) -> bool {
        // Relaxed: it is the writer's own.
        let written = self.written.load(Ordering::Relaxed);
        let room = self.capacity - written.wrapping_sub(self.taken.load(Ordering::Acquire));
        let Some(words) = self.words.get().filter(|_| room > 0) else {
            self.drop_one();
            return false;
        };
        let start = (written & (self.capacity - 1)) * WORDS;
        for (word, value) in words[start..start + WORDS].iter().zip(event) {
            word.store(value, Ordering::Relaxed);
        }
        self.written.store(written.wrapping_add(1), Ordering::Release);
        true
    }

    /// Takes out all events that are there, the oldest first, and says how many were dropped since the last time. One thread at
    /// a time may do so.
    pub(super) fn drain(&self, mut take: impl FnMut(Event)) -> u64 {
        let dropped = self.dropped.swap(0, Ordering::Relaxed);
        let Some(words) = self.words.get() else { return dropped };
        let written = self.written.load(Ordering::Acquire);
        // Relaxed: it is the reader's own.
        let mut taken = self.taken.load(Ordering::Relaxed);
        while taken != written {
            let start = (taken & (self.capacity - 1)) * WORDS;
            let mut event = [0; WORDS];
            for (value, word) in event.iter_mut().zip(&words[start..start + WORDS]) {
                *value = word.load(Ordering::Relaxed);
            }
            take(event);
            taken = taken.wrapping_add(1);
        }
        self.taken.store(taken, Ordering::Release);
        dropped
    }

    #[cold]
    fn drop_one(&self) {
        // Relaxed: it is a count, and hands nothing over.
        self.dropped.fetch_add(1, Ordering::Relaxed);
    }
}

#[cfg(all(test, not(any(drawloom_loom, drawloom_shuttle))))]
mod tests {
    use super::{Event, Ring, WORDS};

    fn event(number: u64) -> Event {
        [number; WORDS]
    }

    fn numbers(ring: &Ring) -> (Vec<u64>, u64) {
        let mut numbers = Vec::new();
        let dropped = ring.drain(|event| numbers.push(event[0]));
        (numbers, dropped)
    }

    #[test]
    fn what_was_written_comes_out_in_order_round_after_round() {
        let ring = Ring::new(4);
        ring.make_room();
        for round in 0..10 {
            assert!((0..3).all(|step| ring.push(event(round * 3 + step))));
            assert_eq!(numbers(&ring), ((round * 3..round * 3 + 3).collect(), 0));
        }
    }

    #[test]
    fn what_does_not_fit_is_dropped_and_counted_once() {
        let ring = Ring::new(3);
        assert!(!ring.push(event(7)));
        assert_eq!(numbers(&ring), (vec![], 1), "there is no memory yet");
        ring.make_room();
        assert_eq!((0..10).filter(|&number| ring.push(event(number))).count(), 4);
        assert_eq!(numbers(&ring), (vec![0, 1, 2, 3], 6));
        assert!(ring.push(event(10)));
        assert_eq!(numbers(&ring), (vec![10], 0));
    }
}

#[cfg(all(test, drawloom_loom))]
mod loom_tests {
    use loom::{model, thread};

    use super::{Event, Ring, WORDS};
    use crate::sync::{Arc, Mutex};

    fn event(number: u64) -> Event {
        [number; WORDS]
    }

    #[test]
    fn an_event_is_taken_out_whole_or_not_at_all_and_none_is_lost_uncounted() {
        model(|| {
            let ring = Arc::new(Ring::new(2));
            ring.make_room();
            let writer = {
                let ring = Arc::clone(&ring);
                thread::spawn(move || (1..4).filter(|&number| !ring.push(event(number))).count() as u64)
            };
            let mut taken = Vec::new();
            let early = ring.drain(|event| taken.push(event));
            let refused = writer.join().unwrap();
            let late = ring.drain(|event| taken.push(event));
            assert!(taken.iter().all(|words| *words == event(words[0])), "torn: {taken:?}");
            assert!(taken.is_sorted_by_key(|words| words[0]));
            assert_eq!(taken.len() as u64 + early + late, 3);
            assert_eq!(early + late, refused, "the reader and the writer count the same");
        });
    }

    /// The ring of worker 0 is written by whichever thread calls the scheduler: one after another, handed on with the lock of the
    /// caller's slot, while some thread takes events out.
    #[test]
    fn one_thread_goes_on_where_another_stopped_writing() {
        model(|| {
            let ring = Arc::new(Ring::new(2));
            ring.make_room();
            let turn = Arc::new(Mutex::new(0));
            let write = |number: u64| {
                let (ring, turn) = (Arc::clone(&ring), Arc::clone(&turn));
                move || {
                    let mut written = turn.lock();
                    ring.push(event(number));
                    *written += 1;
                }
            };
            let other = thread::spawn(write(1));
            let reader = thread::spawn({
                let ring = Arc::clone(&ring);
                move || {
                    let mut taken = Vec::new();
                    let dropped = ring.drain(|event| taken.push(event));
                    (taken, dropped)
                }
            });
            write(2)();
            other.join().unwrap();
            let (mut taken, mut dropped) = reader.join().unwrap();
            dropped += ring.drain(|event| taken.push(event));
            assert_eq!((*turn.lock(), dropped), (2, 0));
            taken.sort_unstable();
            assert_eq!(taken, [event(1), event(2)], "none is lost, torn or written over");
        });
    }
}
