//! Reading objects one after another.

use parking_lot::RwLockReadGuard;

use super::{ObjectBlock, ObjectTable};

/// Reads blocks of an object table. The block that was read last stays locked, because what comes next is mostly in the
/// same one.
pub(super) struct BlockReader<'a> {
    table: &'a ObjectTable,
    /// With its index.
    open: Option<(usize, RwLockReadGuard<'a, Box<ObjectBlock>>)>,
}

impl<'a> BlockReader<'a> {
    pub(super) fn new(table: &'a ObjectTable) -> Self {
        Self { table, open: None }
    }

    /// The block that has a word of objects.
    ///
    /// # Panics
    /// As [`BlockReader::block`].
    #[inline]
    pub(super) fn block_of_word(&mut self, word: usize) -> &ObjectBlock {
        self.block(word / ObjectBlock::WORDS)
    }

    /// A block, by index.
    ///
    /// # Panics
    /// If `index` is not below [`ObjectTable::block_count`].
    #[inline]
    pub(super) fn block(&mut self, index: usize) -> &ObjectBlock {
        let (_, block) = match self.open.take() {
            Some((current, block)) if current == index => self.open.insert((current, block)),
            _ => self.open.insert((index, self.table.block(index))),
        };
        block
    }
}
