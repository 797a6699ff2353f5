//! Bin: the visible objects of a pass, with the bin of each.

use std::ops::Range;

use super::block_reader::BlockReader;
use super::{ObjectTable, VisibleSet, set_bits};
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
    let mut reader = BlockReader::new(table);
    visible.visit_words(words, |word, bits| {
        let block = reader.block(word / in_block);
        let first = word * VisibleSet::OBJECTS_PER_WORD;
        for object in set_bits(bits & block.opaque[word % in_block]).map(|bit| first + bit) {
            let entry = object % ObjectTable::BLOCK_SIZE;
            let draw = &block.draws[entry];
            if selection.materials == MaterialShare::ALL || selection.contains(draw.state.blend(), draw.material) {
                segment.push(object as u32, block.bins[entry]);
            }
        }
    });
}
