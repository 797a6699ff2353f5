//! The objects that a frame describes anew, as words of 64, and the blocks that these lie in.

use std::ops::Range;

use super::object_block::ObjectBlock;
use crate::bit_set::{BITS_PER_WORD, BitWord};
use crate::scene::Changes;

/// The objects that a frame describes anew: all of them, or those that changed.
#[derive(Debug, Default)]
pub(super) struct ChangedObjects {
    /// The number of objects if all of them are described.
    all: Option<usize>,
    /// Otherwise each word with changed objects, ascending.
    words: Vec<BitWord>,
    /// For each block with changed objects, ascending, where its words are in `words`.
    blocks: Vec<Range<usize>>,
    /// While changes are collected, a mask for each word; zeros otherwise.
    masks: Vec<u64>,
}

/// Changed objects of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ChangedBlock {
    /// The index of the block.
    pub(super) block: usize,
    /// A mask for each of its words.
    pub(super) masks: [u64; ObjectBlock::WORDS],
}

impl ChangedBlock {
    /// The first object of one of the block's words.
    pub(super) fn first_object(&self, word: usize) -> usize {
        self.block * ObjectBlock::SIZE + word * BITS_PER_WORD
    }
}

/// The index of the block that has a word.
fn block_of(word: &BitWord) -> usize {
    word.index() / ObjectBlock::WORDS
}

impl ChangedObjects {
    /// All objects of a scene.
    pub(super) fn set_all(&mut self, objects: usize) {
        self.all = Some(objects);
        self.words.clear();
        self.blocks.clear();
    }

    /// The reported objects, and those at indices that the last frame did not have. Indices beyond `objects` are
    /// ignored.
    pub(super) fn set(&mut self, changes: Changes<'_>, objects_before: usize, objects: usize) {
        self.all = None;
        self.words.clear();
        self.blocks.clear();
        self.masks.resize(objects.div_ceil(BITS_PER_WORD), 0);
        match changes {
            Changes::Unknown => return self.set_all(objects),
            Changes::Objects(indices) => {
                indices.iter().map(|&index| index as usize).filter(|&index| index < objects).for_each(|index| {
                    self.mark(index / BITS_PER_WORD, 1 << (index % BITS_PER_WORD));
                });
            }
            Changes::Ranges(ranges) => {
                ranges.iter().for_each(|range| self.mark_range(range.start as usize, (range.end as usize).min(objects)))
            }
        }
        self.mark_range(objects_before, objects);
        self.words.sort_unstable_by_key(|changed| changed.word);
        for changed in &mut self.words {
            changed.mask = std::mem::take(&mut self.masks[changed.index()]);
        }
        let mut end = 0;
        for words in self.words.chunk_by(|one, next| block_of(one) == block_of(next)) {
            self.blocks.push(end..end + words.len());
            end += words.len();
        }
    }

    fn mark_range(&mut self, start: usize, end: usize) {
        if start < end {
            for word in start / BITS_PER_WORD..end.div_ceil(BITS_PER_WORD) {
                let first = start.saturating_sub(word * BITS_PER_WORD);
                let excess = ((word + 1) * BITS_PER_WORD).saturating_sub(end);
                self.mark(word, (u64::MAX << first) & (u64::MAX >> excess));
            }
        }
    }

    fn mark(&mut self, word: usize, mask: u64) {
        if self.masks[word] == 0 {
            // The mask follows when all are marked.
            self.words.push(BitWord::new(word, 0));
        }
        self.masks[word] |= mask;
    }

    /// The number of words with changed objects.
    pub(super) fn word_count(&self) -> usize {
        self.all.map_or(self.words.len(), |objects| objects.div_ceil(BITS_PER_WORD))
    }

    /// The number of blocks with changed objects.
    pub(super) fn block_count(&self) -> usize {
        self.all.map_or(self.blocks.len(), |objects| objects.div_ceil(ObjectBlock::SIZE))
    }

    /// A block with changed objects, by its index among them. They ascend.
    ///
    /// # Panics
    /// If `index` is not below [`ChangedObjects::block_count`].
    pub(super) fn block(&self, index: usize) -> ChangedBlock {
        let words = if self.are_all() {
            let first = index * ObjectBlock::WORDS;
            first..self.word_count().min(first + ObjectBlock::WORDS)
        } else {
            self.blocks[index].clone()
        };
        let mut changed = ChangedBlock { block: block_of(&self.word(words.start)), masks: [0; ObjectBlock::WORDS] };
        for word in words.map(|index| self.word(index)) {
            changed.masks[word.index() % ObjectBlock::WORDS] = word.mask;
        }
        changed
    }

    /// The changed objects of a range of blocks, where not all objects changed. They ascend.
    pub(super) fn objects_of_blocks(&self, blocks: Range<usize>) -> impl Iterator<Item = usize> {
        debug_assert!(!self.are_all());
        let index_of = |block: usize| self.words.partition_point(|word| block_of(word) < block);
        let words = &self.words[index_of(blocks.start)..index_of(blocks.end)];
        words.iter().flat_map(|word| word.indices())
    }

    /// Whether all objects are described, reported or not.
    pub(super) fn are_all(&self) -> bool {
        self.all.is_some()
    }

    /// A word with changed objects, by index.
    ///
    /// # Panics
    /// If `index` is not below [`ChangedObjects::word_count`].
    pub(super) fn word(&self, index: usize) -> BitWord {
        match self.all {
            Some(objects) => {
                let excess = ((index + 1) * BITS_PER_WORD).saturating_sub(objects);
                BitWord::new(index, u64::MAX >> excess)
            }
            None => self.words[index],
        }
    }

    /// Whether an object is described.
    pub(super) fn contains(&self, object: usize) -> bool {
        let is_marked = |index: usize| self.words[index].contains(object);
        let word = object / BITS_PER_WORD;
        self.are_all() || self.words.binary_search_by_key(&word, |changed| changed.index()).is_ok_and(is_marked)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    fn objects_of(changed: &ChangedObjects) -> Vec<usize> {
        let words = (0..changed.word_count()).map(|index| changed.word(index));
        words
            .flat_map(|BitWord { word, mask }| {
                (0..64).filter(move |bit| mask >> bit & 1 == 1).map(move |bit| word as usize * 64 + bit)
            })
            .collect()
    }

    /// The changed objects, as the blocks have them.
    fn objects_by_block(changed: &ChangedObjects) -> Vec<usize> {
        let blocks: Vec<_> = (0..changed.block_count()).map(|index| changed.block(index)).collect();
        assert!(blocks.is_sorted_by(|one, next| one.block < next.block), "{blocks:?}");
        assert!(blocks.iter().all(|block| block.masks != [0; 4]), "{blocks:?}");
        let bits = |block: &ChangedBlock| {
            let ChangedBlock { block, masks } = *block;
            (0..256).filter(move |bit| masks[bit / 64] >> (bit % 64) & 1 == 1).map(move |bit| block * 256 + bit)
        };
        blocks.iter().flat_map(bits).collect()
    }

    proptest! {
        #[test]
        fn reported_and_new_objects_are_found_once_each(
            indices in prop::collection::vec(0_u32..700, 0..40),
            ranges in prop::collection::vec((0_u32..700, 0_u32..200), 0..5),
            before in 0_usize..600,
            objects in 0_usize..600,
            blocks in (0_usize..3, 0_usize..3).prop_map(|(start, length)| start..start + length),
        ) {
            // A range that ends before it starts is empty.
            let ranges: Vec<Range<u32>> = ranges.iter().map(|&(start, length)| start..start + length.saturating_sub(5)).collect();
            let mut changed = ChangedObjects::default();
            let new: BTreeSet<_> = (before..objects).collect();
            for (changes, reported) in [
                (Changes::Objects(&indices), indices.clone()),
                (Changes::Ranges(&ranges), ranges.iter().cloned().flatten().collect()),
            ] {
                changed.set(changes, before, objects);
                let reported = reported.into_iter().map(|index| index as usize).filter(|&index| index < objects);
                let expected: BTreeSet<_> = reported.chain(new.iter().copied()).collect();
                prop_assert_eq!(objects_of(&changed), expected.iter().copied().collect::<Vec<_>>());
                prop_assert_eq!(objects_by_block(&changed), objects_of(&changed));
                let of_blocks: Vec<_> = changed.objects_of_blocks(blocks.clone()).collect();
                let expected_of_blocks = expected.iter().copied().filter(|object| blocks.contains(&(object / 256)));
                prop_assert_eq!(of_blocks, expected_of_blocks.collect::<Vec<_>>());
                prop_assert!((0..objects).all(|object| changed.contains(object) == expected.contains(&object)));
            }
            changed.set(Changes::Unknown, before, objects);
            prop_assert_eq!(objects_of(&changed), (0..objects).collect::<Vec<_>>());
            prop_assert_eq!(objects_by_block(&changed), objects_of(&changed));
        }
    }
}
