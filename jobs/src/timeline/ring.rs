//! A single-producer, single-consumer ring buffer of events.
//!
//! It never waits and never grows: if it is full, an event is dropped and counted. Its memory is allocated when the
//! timeline is first switched on.
//!
//! # Memory ordering
//!
//! The writer stores an event's words relaxed, and then `written` with release. The reader acquires `written` before it
//! reads the words. After reading, the reader stores `taken` with release, and the writer acquires `taken` before it
//! overwrites the words. So no word is read while it is written, and the writer only needs loads and stores.

use std::sync::OnceLock;

use crossbeam_utils::CachePadded;

use crate::sync::{AtomicU64, AtomicUsize, Ordering};

/// The number of words in an event.
pub(super) const WORDS: usize = 6;

pub(super) type Event = [u64; WORDS];

pub(super) struct Ring {
    /// A power of two.
    capacity: usize,
    words: OnceLock<Box<[AtomicU64]>>,
    /// The number of events written so far. Only the writer changes it.
    written: CachePadded<AtomicUsize>,
    /// The number of events read so far. Only the reader changes it.
    taken: CachePadded<AtomicUsize>,
    /// The number of dropped events that no call of `drain` has returned yet.
    dropped: AtomicU64,
}

impl Ring {
    /// A ring for at least `capacity` events. Until its memory is allocated, it drops all events.
    pub(super) fn new(capacity: usize) -> Self {
        Self {
            capacity: capacity.next_power_of_two(),
            words: OnceLock::new(),
            written: CachePadded::new(AtomicUsize::new(0)),
            taken: CachePadded::new(AtomicUsize::new(0)),
            dropped: AtomicU64::new(0),
        }
    }

    /// Allocates the memory, unless it is allocated.
    pub(super) fn allocate(&self) {
        self.words.get_or_init(|| (0..self.capacity * WORDS).map(|_| AtomicU64::new(0)).collect());
    }

    /// The size of the allocated memory.
    pub(super) fn bytes(&self) -> usize {
        self.words.get().map_or(0, |words| size_of_val(&**words))
    }

    /// Writes an event, and returns whether there was room. Calls must not overlap, and each must be ordered after the
    /// last.
    #[inline]
    pub(super) fn push(&self, event: Event) -> bool {
        // Relaxed: only the writer changes it.
        let written = self.written.load(Ordering::Relaxed);
        let room = self.capacity - written.wrapping_sub(self.taken.load(Ordering::Acquire));
        let Some(words) = self.words.get().filter(|_| room > 0) else {
            self.count_dropped();
            return false;
        };
        let start = (written & (self.capacity - 1)) * WORDS;
        for (word, value) in words[start..start + WORDS].iter().zip(event) {
            word.store(value, Ordering::Relaxed);
        }
        self.written.store(written.wrapping_add(1), Ordering::Release);
        true
    }

    /// Takes out all events, the oldest first, and returns how many were dropped since the last call. Calls must not
    /// overlap.
    pub(super) fn drain(&self, mut take: impl FnMut(Event)) -> u64 {
        let dropped = self.dropped.swap(0, Ordering::Relaxed);
        let Some(words) = self.words.get() else { return dropped };
        let written = self.written.load(Ordering::Acquire);
        // Relaxed: only the reader changes it.
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
    fn count_dropped(&self) {
        // Relaxed: the count hands nothing over.
        self.dropped.fetch_add(1, Ordering::Relaxed);
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
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
    fn events_are_read_in_the_order_they_were_written() {
        let ring = Ring::new(4);
        ring.allocate();
        for round in 0..10 {
            assert!((0..3).all(|step| ring.push(event(round * 3 + step))));
            assert_eq!(numbers(&ring), ((round * 3..round * 3 + 3).collect(), 0));
        }
    }

    #[test]
    fn events_without_room_are_dropped_and_counted_once() {
        let ring = Ring::new(3);
        assert!(!ring.push(event(7)));
        assert_eq!(numbers(&ring), (vec![], 1), "there is no memory yet");
        ring.allocate();
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
    fn an_event_is_read_whole_or_not_at_all_and_dropped_ones_are_counted() {
        model(|| {
            let ring = Arc::new(Ring::new(2));
            ring.allocate();
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

    /// Any thread that calls the scheduler writes to the ring of worker 0: one thread at a time, ordered by the lock of
    /// the caller slot, while another thread reads.
    #[test]
    fn one_thread_continues_to_write_where_another_stopped() {
        model(|| {
            let ring = Arc::new(Ring::new(2));
            ring.allocate();
            let slot = Arc::new(Mutex::new(0));
            let write = |number: u64| {
                let (ring, slot) = (Arc::clone(&ring), Arc::clone(&slot));
                move || {
                    let mut written = slot.lock();
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
            assert_eq!((*slot.lock(), dropped), (2, 0));
            taken.sort_unstable();
            assert_eq!(taken, [event(1), event(2)], "no event is lost, torn or overwritten");
        });
    }
}
