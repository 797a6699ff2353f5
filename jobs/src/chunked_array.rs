//! An array that many jobs fill at the same time, each its own range.

use std::ops::Range;

use parking_lot::{RwLock, RwLockReadGuard, RwLockWriteGuard};

/// An array in blocks of [`ChunkedArray::BLOCK_SIZE`] entries, each behind its own lock.
///
/// Jobs that write different blocks never wait for each other, and the graph's order keeps jobs that use the same block
/// apart. So a lock is never contended, and one uncontended lock a block costs a fraction of a nanosecond an entry:
/// cheap enough to need no unsafe code.
#[derive(Debug)]
pub struct ChunkedArray<T> {
    blocks: Vec<RwLock<Box<[T]>>>,
}

/// The number of entries in a block, for code that has no type of entries.
pub(crate) const BLOCK_SIZE: usize = 256;

impl<T: Clone> ChunkedArray<T> {
    /// The number of entries in a block.
    pub const BLOCK_SIZE: usize = BLOCK_SIZE;

    /// An empty array.
    pub fn new() -> Self {
        Self { blocks: Vec::new() }
    }

    /// Grows the array to at least `length` entries. New entries are `value`, the others keep theirs.
    pub fn grow(&mut self, length: usize, value: T) {
        let count = length.div_ceil(Self::BLOCK_SIZE).max(self.blocks.len());
        self.blocks.resize_with(count, || RwLock::new(vec![value.clone(); Self::BLOCK_SIZE].into()));
    }

    /// Cuts `range` at the borders of blocks: the index of each block, and the indices of `range` in it.
    pub fn block_ranges(range: Range<usize>) -> impl Iterator<Item = (usize, Range<usize>)> {
        block_ranges(range, Self::BLOCK_SIZE)
    }

    /// Locks a block to read it; entry `index` of the array is at `index % BLOCK_SIZE`.
    ///
    /// # Panics
    /// If the block does not exist.
    pub fn read(&self, block: usize) -> RwLockReadGuard<'_, Box<[T]>> {
        self.blocks[block].read()
    }

    /// Locks a block to write it; entry `index` of the array is at `index % BLOCK_SIZE`.
    ///
    /// # Panics
    /// If the block does not exist.
    pub fn write(&self, block: usize) -> RwLockWriteGuard<'_, Box<[T]>> {
        self.blocks[block].write()
    }
}

/// Cuts `range` at multiples of `size`: the index of each block of `size`, and the indices of `range` in it. An empty
/// range has no blocks.
#[inline]
pub fn block_ranges(range: Range<usize>, size: usize) -> impl Iterator<Item = (usize, Range<usize>)> {
    let blocks = if range.is_empty() { 0..0 } else { range.start / size..range.end.div_ceil(size) };
    blocks.map(move |block| (block, range.start.max(block * size)..range.end.min((block + 1) * size)))
}

impl<T: Clone> Default for ChunkedArray<T> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn block_ranges_cover_a_range_once_and_stay_in_their_block() {
        for range in [0..0, 0..1, 5..5, 3..256, 255..257, 0..1000, 256..512, 700..701] {
            let parts: Vec<_> = ChunkedArray::<u8>::block_ranges(range.clone()).collect();
            let entries: Vec<usize> = parts.iter().flat_map(|(_, part)| part.clone()).collect();
            assert_eq!(entries, range.clone().collect::<Vec<_>>());
            assert!(parts.iter().all(|(block, part)| part.clone().all(|entry| entry / 256 == *block)));
        }
    }

    #[test]
    fn growing_keeps_what_was_written() {
        let mut array = ChunkedArray::new();
        array.grow(1, 0);
        array.write(0)[7] = 9;
        array.grow(1000, 1);
        assert_eq!((array.read(0)[7], array.read(3)[255]), (9, 1));
    }
}
