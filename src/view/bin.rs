//! Bin: objects of a pass, ordered by bin.

use std::ops::Range;

use super::block_reader::BlockReader;
use super::{DrawFilter, ObjectBlock, ObjectTable, VisibleSet};
use crate::bit_set::{BITS_PER_WORD, BitWord};
use crate::command::{BinnedSegment, MaterialShare, Selection};
use crate::scene::Blend;

/// A view that sees more than one in this many objects walks all objects in the order of their bins. Another one
/// collects and orders what it sees. An object that is passed by costs a quarter of one that is collected.
const WALK_THRESHOLD: usize = 4;

/// Whether a process that draws a selection may walk all objects in the order of their bins.
pub(crate) fn can_scan_bin_order(selection: Selection) -> bool {
    selection.materials == MaterialShare::ALL
}

/// Some of the objects that a view sees.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum VisibleRange {
    /// One of `count` parts that take about as long. All of them are all that the view sees.
    Share { index: usize, count: usize },
    /// Those whose rank, the index among the visible objects, is in this range.
    Ranks(Range<usize>),
}

impl VisibleRange {
    /// The indices among `length` entries.
    fn among(&self, length: usize) -> Range<usize> {
        match *self {
            Self::Share { index, count } => index * length / count..(index + 1) * length / count,
            Self::Ranks(ref ranks) => ranks.clone(),
        }
    }
}

/// Makes a segment the opaque objects among some of those that a view sees that a process draws, ordered by bin.
pub(crate) fn bin_visible(
    table: &ObjectTable,
    visible: &VisibleSet,
    selection: Selection,
    filter: DrawFilter<'_>,
    range: &VisibleRange,
    segment: &mut BinnedSegment,
) {
    let bins = table.bins();
    if matches!(range, VisibleRange::Share { .. })
        && can_scan_bin_order(selection)
        && visible.count() * WALK_THRESHOLD > table.len()
        && let Some(all) = table.objects_by_bin()
    {
        let is_opaque = |bin| bins.get(bin).state.blend() == Blend::None;
        let is_visible = |object: u32| visible.contains(object as usize);
        if filter.passes_all() {
            segment.select(&all, range.among(all.len()), is_opaque, is_visible);
        } else {
            segment.select(&all, range.among(all.len()), is_opaque, |object| {
                is_visible(object) && filter.passes(object as usize)
            });
        }
    } else {
        let mut reader = BlockReader::new(table);
        segment.clear();
        visible.visit(range.among(visible.count()), |_, word, bits| {
            push_word(BitWord::new(word, bits), reader.block_of_word(word), selection, &filter, segment);
        });
        segment.order(&bins);
    }
}

/// Makes a segment the opaque ones of some drawable objects that a process draws, ordered by bin.
pub(crate) fn bin_objects(
    table: &ObjectTable,
    words: &[BitWord],
    selection: Selection,
    filter: DrawFilter<'_>,
    segment: &mut BinnedSegment,
) {
    let mut reader = BlockReader::new(table);
    segment.clear();
    for &word in words {
        push_word(word, reader.block_of_word(word.index()), selection, &filter, segment);
    }
    segment.order(&table.bins());
}

/// Appends the opaque objects of a word, which is in a block, that a process draws to a segment.
#[inline]
fn push_word(
    objects: BitWord,
    block: &ObjectBlock,
    selection: Selection,
    filter: &DrawFilter<'_>,
    segment: &mut BinnedSegment,
) {
    let mask = objects.mask & block.opaque[objects.index() % ObjectBlock::WORDS];
    let drawn = filter.pass(objects.index() * BITS_PER_WORD, mask);
    for object in BitWord::new(objects.index(), drawn).indices() {
        let entry = object % ObjectBlock::SIZE;
        let draw = &block.draws[entry];
        if selection.materials == MaterialShare::ALL || selection.contains(draw.state.blend(), draw.material) {
            segment.push(object as u32, block.bins[entry]);
        }
    }
}
