//! An array that many jobs fill at once, each its own part.

use std::ops::Range;

use parking_lot::{RwLock, RwLockReadGuard, RwLockWriteGuard};

/// An array in blocks of [`Blocks::SIZE`] entries, each behind a lock of its own.
///
/// Jobs that write different blocks never wait for each other, and one uncontended lock a block is a fraction of a
/// nanosecond an entry: cheap enough to need no unsafe code for what is, by the graph's order, never contended.
#[derive(Debug)]
pub struct Blocks<T> {
    blocks: Vec<RwLock<Box<[T]>>>,
}

impl<T: Clone> Blocks<T> {
    /// Entries in a block.
    pub const SIZE: usize = 256;

    /// No entries.
    pub fn new() -> Self {
        Self { blocks: Vec::new() }
    }

    /// Makes room for at least `length` entries; those that are new are `value`, the others stay as they were.
    pub fn reserve(&mut self, length: usize, value: T) {
        let count = length.div_ceil(Self::SIZE).max(self.blocks.len());
        self.blocks.resize_with(count, || RwLock::new(vec![value.clone(); Self::SIZE].into()));
    }

    /// The parts of `range` that lie in one block each: which block, and which entries.
    pub fn parts(range: Range<usize>) -> impl Iterator<Item = (usize, Range<usize>)> {
        parts(range, Self::SIZE)
    }

    /// A block to read; entry `index` is at `index % SIZE`.
    ///
    /// # Panics
    /// If there is no such block.
    pub fn read(&self, block: usize) -> RwLockReadGuard<'_, Box<[T]>> {
        self.blocks[block].read()
    }

    /// A block to write; entry `index` is at `index % SIZE`.
    ///
    /// # Panics
    /// If there is no such block.
    pub fn write(&self, block: usize) -> RwLockWriteGuard<'_, Box<[T]>> {
        self.blocks[block].write()
    }
}

/// The parts of `range` that lie in one block of `size` each: which block, and which entries. There is none of an empty range.
pub(crate) fn parts(range: Range<usize>, size: usize) -> impl Iterator<Item = (usize, Range<usize>)> {
    let blocks = if range.is_empty() { 0..0 } else { range.start / size..range.end.div_ceil(size) };
    blocks.map(move |block| (block, range.start.max(block * size)..range.end.min((block + 1) * size)))
}

impl<T: Clone> Default for Blocks<T> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_a_range_once_and_stay_in_their_block() {
        for range in [0..0, 0..1, 5..5, 3..256, 255..257, 0..1000, 256..512, 700..701] {
            let parts: Vec<_> = Blocks::<u8>::parts(range.clone()).collect();
            let entries: Vec<usize> = parts.iter().flat_map(|(_, part)| part.clone()).collect();
            assert_eq!(entries, range.clone().collect::<Vec<_>>());
            assert!(parts.iter().all(|(block, part)| part.clone().all(|entry| entry / 256 == *block)));
        }
    }

    #[test]
    fn growing_keeps_what_was_written() {
        let mut blocks = Blocks::new();
        blocks.reserve(1, 0);
        blocks.write(0)[7] = 9;
        blocks.reserve(1000, 1);
        assert_eq!((blocks.read(0)[7], blocks.read(3)[255]), (9, 1));
    }
}
