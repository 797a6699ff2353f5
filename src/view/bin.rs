//! Bin: the visible objects of a pass, ordered by bin.

use std::ops::Range;

use super::block_reader::BlockReader;
use super::{ObjectTable, SelectionFilter, VisibleSet, set_bits};
use crate::command::{BinnedSegment, MaterialShare, Selection};
use crate::scene::Blend;

/// A view that sees more than one in this many objects walks all objects in the order of their bins. Another one collects and orders
/// what it sees. An object that is passed by costs a quarter of one that is collected.
const WALK_THRESHOLD: usize = 4;

/// Whether a process that draws a selection may walk all objects in the order of their bins.
pub(crate) fn may_walk(selection: Selection) -> bool {
    selection.materials == MaterialShare::ALL
}

/// Makes a segment the opaque objects that a view sees and a process draws, ordered by bin: part `index` of `count`.
pub(crate) fn bin_visible(
    table: &ObjectTable,
    visible: &VisibleSet,
    selection: Selection,
    filter: SelectionFilter<'_>,
    (index, count): (usize, usize),
    segment: &mut BinnedSegment,
) {
    let part = |length: usize| index * length / count..(index + 1) * length / count;
    let bins = table.bins();
    if may_walk(selection)
        && visible.count() * WALK_THRESHOLD > table.len()
        && let Some(all) = table.objects_by_bin()
    {
        let is_opaque = |bin| bins.get(bin).state.blend() == Blend::None;
        let is_visible = |object: u32| visible.contains(object as usize);
        if filter.passes_all() {
            segment.select(&all, part(all.len()), is_opaque, is_visible);
        } else {
            segment.select(&all, part(all.len()), is_opaque, |object| {
                is_visible(object) && filter.passes(object as usize)
            });
        }
    } else {
        segment.clear();
        collect(table, visible, selection, filter, part(visible.filled_word_count()), segment);
        segment.order(&bins);
    }
}

/// Appends the objects among some words of the visible set to a segment.
fn collect(
    table: &ObjectTable,
    visible: &VisibleSet,
    selection: Selection,
    filter: SelectionFilter<'_>,
    words: Range<usize>,
    segment: &mut BinnedSegment,
) {
    let in_block = ObjectTable::BLOCK_SIZE / VisibleSet::OBJECTS_PER_WORD;
    let mut reader = BlockReader::new(table);
    visible.visit_words(words, |word, bits| {
        let block = reader.block(word / in_block);
        let first = word * VisibleSet::OBJECTS_PER_WORD;
        for object in set_bits(filter.pass(first, bits & block.opaque[word % in_block])).map(|bit| first + bit) {
            let entry = object % ObjectTable::BLOCK_SIZE;
            let draw = &block.draws[entry];
            if selection.materials == MaterialShare::ALL || selection.contains(draw.state.blend(), draw.material) {
                segment.push(object as u32, block.bins[entry]);
            }
        }
    });
}
