//! A pseudo-random order, the same for the same seed.

use std::cell::Cell;

/// Pseudo-random numbers (Steele, Lea & Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
pub(super) struct Shuffle {
    state: Cell<u64>,
}

impl Shuffle {
    /// The numbers of one worker. Every worker has different ones.
    pub(super) fn new(seed: u64, worker: usize) -> Self {
        let shuffle = Self { state: Cell::new(seed ^ (worker as u64).rotate_left(32)) };
        shuffle.next();
        shuffle
    }

    /// A number below `count`, or `None` if `count` is 0.
    pub(super) fn below(&self, count: usize) -> Option<usize> {
        let count = count as u64;
        // The bias of the remainder does not matter for an order.
        (count > 0).then(|| (self.next() % count) as usize)
    }

    fn next(&self) -> u64 {
        self.state.set(self.state.get().wrapping_add(0x9E37_79B9_7F4A_7C15));
        let mixed = self.state.get();
        let mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }
}
