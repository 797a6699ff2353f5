//! Bin: the visible objects of a pass, with the bin of each.

use std::ops::Range;

use super::{ObjectTable, VisibleSet, set_bits};
use crate::chunked_array::block_ranges;
use crate::command::{BinnedSegment, MaterialShare, Selection};

/// Appends to a segment the opaque objects that a view sees and a process draws, among some words of the visible set.
pub(crate) fn bin_visible(
    table: &ObjectTable,
    visible: &VisibleSet,
    selection: Selection,
    words: Range<usize>,
    segment: &mut BinnedSegment,
) {
    let in_block = ObjectTable::BLOCK_SIZE / VisibleSet::OBJECTS_PER_WORD;
    for (index, words) in block_ranges(words, in_block) {
        let block = table.block(index);
        for word in words {
            let first = word * VisibleSet::OBJECTS_PER_WORD;
            let bits = visible.word(word) & block.opaque[word % in_block];
            for object in set_bits(bits).map(|bit| first + bit) {
                let entry = object % ObjectTable::BLOCK_SIZE;
                let draw = &block.draws[entry];
                if selection.materials == MaterialShare::ALL || selection.contains(draw.state.blend(), draw.material) {
                    segment.push(object as u32, block.bins[entry]);
                }
            }
        }
    }
}
