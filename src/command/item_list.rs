//! The items of an engine's own that one pass draws.

use std::ops::Range;

use super::Version;
use crate::bit_set::{BITS_PER_WORD, set_bits};

/// The items that a pass draws, in draw order, and the bundles that divide them.
///
/// An item's place in draw order is its rank. Ranks lie in blocks of 256, and blocks in groups of one size. A bundle
/// has the visible items of blocks of one group that follow each other. So an item that comes into view, or leaves it,
/// changes the bundles of its group alone.
#[derive(Clone, Debug, Default)]
pub struct ItemList {
    items: Vec<u32>,
    bundles: Vec<ItemBundle>,
    /// The number of blocks in a group; 0 before the first frame.
    group: usize,
    slots: usize,
    /// What it was made from, and the version that it has since; `None` if it is empty.
    made_from: Option<(Version, usize)>,
    version: Version,
    /// The version of the keys and versions of all items that are lent.
    pub(crate) contents_version: Version,
}

/// A bit for each rank of a block: whether the view sees the item.
pub(crate) type BlockBits = [u64; ItemList::BLOCK_SIZE / BITS_PER_WORD];

/// The end of a bundle in the list, and where it is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct ItemBundle {
    end: usize,
    slot: usize,
}

impl ItemList {
    /// The most items in a bundle: as many as a [draw list](super::DrawList) has batches in one.
    pub const ITEMS_PER_BUNDLE: usize = 256;
    /// The number of ranks in a block.
    pub(crate) const BLOCK_SIZE: usize = 256;

    /// The visible items in draw order, by index among those that are lent.
    pub fn items(&self) -> &[u32] {
        &self.items
    }

    /// The number of bundles. None is empty.
    pub fn bundle_count(&self) -> usize {
        self.bundles.len()
    }

    /// A bundle's range of [`ItemList::items`].
    ///
    /// # Panics
    /// If there is no such bundle.
    pub fn bundle_range(&self, bundle: usize) -> Range<usize> {
        let start = if bundle == 0 { 0 } else { self.bundles[bundle - 1].end };
        start..self.bundles[bundle].end
    }

    /// The number of [slots](Self::bundle_slot).
    pub fn slot_count(&self) -> usize {
        self.slots
    }

    /// Where a bundle is kept from frame to frame: a number below [`ItemList::slot_count`], another one for each bundle.
    ///
    /// # Panics
    /// If there is no such bundle.
    pub fn bundle_slot(&self, bundle: usize) -> usize {
        self.bundles[bundle].slot
    }

    /// Empties it, and keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.items.clear();
        self.bundles.clear();
        self.slots = 0;
        self.made_from = None;
    }

    /// Equal versions are of equal bundles, whose items have equal keys and versions.
    pub(crate) fn versions(&self) -> [Version; 2] {
        [self.version, self.contents_version]
    }

    /// Makes it the list of the visible ones of these items, which are in a draw order of this version: see
    /// [`fill`](Self::fill). If `has_same_bits`, it is kept, as long as the rest is the same too.
    pub(crate) fn update(
        &mut self,
        (order, order_version): (&[u32], Version),
        visible: impl Fn(usize) -> BlockBits,
        per_bundle: usize,
        has_same_bits: bool,
        version: Version,
    ) {
        let made_from = Some((order_version, per_bundle));
        if !has_same_bits || self.made_from != made_from {
            self.fill(order, visible, per_bundle);
            (self.made_from, self.version) = (made_from, version);
        }
    }

    /// Makes it the list of the visible ones of these items, which are in draw order, with at most `per_bundle` items in
    /// a bundle. `visible` has a bit for each rank of a block.
    fn fill(&mut self, order: &[u32], visible: impl Fn(usize) -> BlockBits, per_bundle: usize) {
        self.clear();
        let blocks = order.len().div_ceil(Self::BLOCK_SIZE);
        let count_of = |bits: BlockBits| bits.iter().map(|bits| bits.count_ones() as usize).sum::<usize>();
        self.choose_group((0..blocks).map(|block| count_of(visible(block))).sum(), blocks);
        let (mut slot, mut start) = (0, 0);
        for (block, order) in order.chunks(Self::BLOCK_SIZE).enumerate() {
            let (before, words) = (self.items.len(), visible(block));
            let count = count_of(words);
            if block % self.group == 0 || before + count - start > Self::ITEMS_PER_BUNDLE {
                self.end_bundle(slot);
                (slot, start) = (block, before);
            }
            if count == order.len() {
                self.items.extend_from_slice(order);
                continue;
            }
            self.items.resize(before + count, 0);
            let bits = words.into_iter().enumerate();
            let seen = bits.flat_map(|(word, bits)| set_bits(bits).map(move |bit| word * BITS_PER_WORD + bit));
            self.items[before..].iter_mut().zip(seen).for_each(|(item, rank)| *item = order[rank]);
        }
        self.end_bundle(slot);
        self.slots = blocks;
        if per_bundle < Self::ITEMS_PER_BUNDLE {
            self.divide_evenly(per_bundle);
        }
    }

    /// Ends a bundle behind the latest item, unless it is empty.
    fn end_bundle(&mut self, slot: usize) {
        let end = self.items.len();
        if self.bundles.last().map_or(0, |bundle| bundle.end) < end {
            self.bundles.push(ItemBundle { end, slot });
        }
    }

    /// Chooses the size of groups: the items that are seen of one fill a quarter of a bundle at least. Fewer make
    /// bundles costly; of more, fewer bundles stay the same while a camera turns. A size stays until it is wrong by a
    /// quarter.
    fn choose_group(&mut self, count: usize, blocks: usize) {
        let least = Self::ITEMS_PER_BUNDLE / 4;
        let smallest = |least: usize| {
            let is_suitable = |group: &usize| *group >= blocks || count * group >= least * blocks;
            (0..usize::BITS).map(|power| 1 << power).find(is_suitable).unwrap_or(1)
        };
        self.group = self.group.clamp(smallest(least * 3 / 4), smallest(least * 5 / 4));
    }

    /// Divides it into bundles of this many items.
    fn divide_evenly(&mut self, per_bundle: usize) {
        let (items, per_bundle) = (self.items.len(), per_bundle.max(1));
        self.slots = items.div_ceil(per_bundle);
        let bundle = |slot| ItemBundle { end: items.min((slot + 1) * per_bundle), slot };
        self.bundles.clear();
        self.bundles.extend((0..self.slots).map(bundle));
    }
}
