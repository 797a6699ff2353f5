//! The objects of a static group: those that are recorded, and their bounds.

use super::block_reader::BlockReader;
use super::bounds4::Bounds4;
use super::{ObjectBlock, ObjectTable};
use crate::bit_set::{BITS_PER_WORD, BitWord, set_bits};
use crate::scene::ObjectSet;

/// Collects the objects of a set that need no order and look the same in every view: drawable opaque ones with meshes
/// that `is_recordable`. Returns their bounds, those of the first group.
pub(crate) fn recordable_objects(
    table: &ObjectTable,
    set: &ObjectSet,
    is_recordable: impl Fn(u32) -> bool,
    words: &mut Vec<BitWord>,
) -> Bounds4 {
    let (mut reader, mut bounds) = (BlockReader::new(table), Bounds4::default());
    words.clear();
    for word in set.words(0..table.len().div_ceil(BITS_PER_WORD)) {
        let block = reader.block_of_word(word.index());
        let word_in_block = word.index() % ObjectBlock::WORDS;
        let first = word_in_block * BITS_PER_WORD;
        let mut recorded = 0;
        for bit in set_bits(word.mask & block.drawable(word_in_block) & block.opaque[word_in_block]) {
            if is_recordable(block.draws[first + bit].mesh) {
                recorded |= 1 << bit;
                bounds.extend_word(0, block.spheres.get(first + bit));
            }
        }
        if recorded != 0 {
            words.push(BitWord { mask: recorded, ..word });
        }
    }
    bounds
}
