//! The objects of a static group: those that are recorded, their bounds, and their order.

use super::block_reader::BlockReader;
use super::bounds4::Bounds4;
use super::{DrawFilter, ObjectTable, set_bits};
use crate::command::{BinnedSegment, MaterialShare, Selection};
use crate::scene::ObjectSet;

/// Objects among 64: bit `b` of the mask is object `word × 64 + b`.
pub(crate) type ObjectWord = (usize, u64);

const WORDS_PER_BLOCK: usize = ObjectTable::BLOCK_SIZE / u64::BITS as usize;

/// Collects the objects of a set that need no order and look the same in every view: drawable opaque ones with meshes
/// that `is_recordable`. Returns their bounds, those of the first group.
pub(crate) fn recordable_objects(
    table: &ObjectTable,
    set: &ObjectSet,
    is_recordable: impl Fn(u32) -> bool,
    words: &mut Vec<ObjectWord>,
) -> Bounds4 {
    let (mut reader, mut bounds) = (BlockReader::new(table), Bounds4::default());
    words.clear();
    for (word, mask) in set.masks(0..table.len().div_ceil(u64::BITS as usize)) {
        let block = reader.block(word / WORDS_PER_BLOCK);
        let word_in_block = word % WORDS_PER_BLOCK;
        let first = word_in_block * u64::BITS as usize;
        let mut recorded = 0;
        for bit in set_bits(mask & block.drawable(word_in_block) & block.opaque[word_in_block]) {
            if is_recordable(block.draws[first + bit].mesh) {
                recorded |= 1 << bit;
                bounds.extend_word(0, block.spheres.get(first + bit));
            }
        }
        if recorded != 0 {
            words.push((word, recorded));
        }
    }
    bounds
}

/// Makes a segment those of some objects that a process draws, ordered by bin. All of them are drawable and opaque.
pub(crate) fn bin_objects(
    table: &ObjectTable,
    words: &[ObjectWord],
    selection: Selection,
    filter: DrawFilter<'_>,
    segment: &mut BinnedSegment,
) {
    let mut reader = BlockReader::new(table);
    segment.clear();
    for &(word, mask) in words {
        let block = reader.block(word / WORDS_PER_BLOCK);
        let first = word * u64::BITS as usize;
        for object in set_bits(filter.pass(first, mask)).map(|bit| first + bit) {
            let entry = object % ObjectTable::BLOCK_SIZE;
            let draw = &block.draws[entry];
            if selection.materials == MaterialShare::ALL || selection.contains(draw.state.blend(), draw.material) {
                segment.push(object as u32, block.bins[entry]);
            }
        }
    }
    segment.order(&table.bins());
}
