//! The items of an engine's own that one pass draws.

use std::ops::Range;

use super::Version;
use crate::bit_set::{BITS_PER_WORD, set_bits};

/// The items that a pass draws, in draw order, and the bundles that divide them.
///
/// An item's place in draw order is its rank. Ranks lie in groups of one size, a power of two, and a bundle has the
/// visible items of one group, or of a part of it if these are many. So an item that comes into view, or leaves it,
/// changes one bundle.
#[derive(Clone, Debug, Default)]
pub struct ItemList {
    items: Vec<u32>,
    bundles: Vec<ItemBundle>,
    /// The number of ranks in a group; 0 where groups do not divide the list.
    group: usize,
    size: BundleSize,
    slots: usize,
    /// What it was made from, and the version that it has since; `None` if it is empty.
    made_from: Option<MadeFrom>,
    version: Version,
    /// The set of items, by the version of the frame that began with it.
    pub(crate) set: Version,
    /// The version of the keys and versions of all items that are lent.
    pub(crate) contents_version: Version,
}

/// A bit for each rank of a block: whether the view sees the item.
pub(crate) type BlockBits = [u64; ItemList::BLOCK_SIZE / BITS_PER_WORD];

/// What changed since a list was updated last.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ListChanges {
    /// The number of ranks that came into view or left it; `None` if that is unknown.
    pub(crate) seen: Option<usize>,
    /// The number of items, of all that are lent, that have another version; `None` if items have none.
    pub(crate) versions: Option<usize>,
}

/// What a list is made from, beside what the view sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct MadeFrom {
    /// The version of the draw order.
    order: Version,
    /// The number of items in a bundle; `None` if groups decide.
    per_bundle: Option<usize>,
    group: usize,
}

/// The end of a bundle in the list, and where it is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct ItemBundle {
    end: usize,
    slot: usize,
}

/// The number of items in a bundle: large bundles are cheap to replay, and of small ones fewer items are recorded anew
/// where one changes.
///
/// It is chosen as one decides between renting and buying: another size is taken once it would have saved, in the frames
/// before, what the change costs.
#[derive(Clone, Copy, Debug)]
struct BundleSize {
    /// The current size, as an index of [`BundleSize::ALL`].
    current: usize,
    /// What each size would have saved, in the costs of recording an item.
    saved: [f32; Self::ALL.len()],
}

impl Default for BundleSize {
    fn default() -> Self {
        Self { current: Self::FIRST, saved: [0.0; Self::ALL.len()] }
    }
}

impl BundleSize {
    const ALL: [usize; 6] = [32, 64, 128, 256, 512, 1024];
    /// The size as long as nothing is known: cheap, and enough bundles for all workers.
    const FIRST: usize = 3;
    /// A bundle that is replayed costs as much as so many items that are recorded, in 0.3 to 0.7 µs: more if the caches
    /// do not have it any more.
    const REPLAY: f32 = 5.0;
    /// Another size costs as much as so many times all items: they are recorded anew, and strategies are compared again.
    const CHANGE: f32 = 2.0;
    /// Larger bundles than the first size leave a pass at least as many, for workers and encoders.
    const MIN_BUNDLES: usize = 8;

    fn items(self) -> usize {
        Self::ALL[self.current]
    }

    /// Adds a frame, in which `changed` of the `count` items that a view sees came, went or changed. Returns whether
    /// another size is better from now on.
    fn add(&mut self, changed: f32, count: f32) -> bool {
        let rate = changed / count;
        // Of the bundles of n items as many stay the same as n items that change at this rate.
        let cost = |items: f32| count / items * Self::REPLAY + count * (1.0 - (-rate * items).exp());
        let current = cost(self.items() as f32);
        for (saved, items) in self.saved.iter_mut().zip(Self::ALL) {
            *saved = (*saved + current - cost(items as f32)).max(0.0);
        }
        let is_possible =
            |index: &usize| *index <= Self::FIRST || (Self::ALL[*index] * Self::MIN_BUNDLES) as f32 <= count;
        let best = (0..Self::ALL.len())
            .filter(is_possible)
            .max_by(|&one, &other| self.saved[one].total_cmp(&self.saved[other]));
        match best.filter(|best| self.saved[*best] > Self::CHANGE * count) {
            Some(best) => *self = Self { current: best, ..Self::default() },
            None => return false,
        }
        true
    }
}

impl ItemList {
    /// The most items in a bundle.
    pub const ITEMS_PER_BUNDLE: usize = 1024;
    /// The number of ranks in a block.
    pub(crate) const BLOCK_SIZE: usize = 256;
    /// The least number of ranks in a group.
    const MIN_GROUP: usize = 32;

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

    /// The number of ranks in a group. Bundles of groups of another size are other ones.
    #[cfg(feature = "wgpu")]
    pub(crate) fn group_size(&self) -> usize {
        self.group
    }

    /// Equal versions are of equal bundles, whose items have equal keys and versions.
    #[cfg(feature = "wgpu")]
    pub(crate) fn versions(&self) -> [Version; 2] {
        [self.version, self.contents_version]
    }

    /// Makes it the list of the visible ones of these items, which are in a draw order of this version. `visible` has a
    /// bit for each rank of a block. A bundle has `per_bundle` items, or as many as change little. If the view sees the
    /// same items as before, it is kept, as long as the rest is the same too.
    pub(crate) fn update(
        &mut self,
        (order, order_version): (&[u32], Version),
        visible: impl Fn(usize) -> BlockBits,
        per_bundle: Option<usize>,
        changes: ListChanges,
        version: Version,
    ) {
        let made_from = |list: &Self| Some(MadeFrom { order: order_version, per_bundle, group: list.group });
        let is_same = changes.seen == Some(0) && self.made_from == made_from(self);
        let count = if is_same {
            self.items.len()
        } else {
            let blocks = order.len().div_ceil(Self::BLOCK_SIZE);
            (0..blocks).map(|block| count_of(visible(block))).sum()
        };
        match per_bundle {
            Some(_) => self.group = 0,
            None => self.choose_group(count, order.len(), changes),
        }
        if !is_same || self.made_from != made_from(self) {
            self.fill(order, &visible, count);
            match per_bundle {
                Some(per_bundle) => self.divide_evenly(per_bundle),
                None => self.divide_by_groups(order.len(), &visible),
            }
            (self.made_from, self.version) = (made_from(self), version);
        }
    }

    /// Makes it the list of the visible ones of these items, which are `count`, without bundles.
    fn fill(&mut self, order: &[u32], visible: &impl Fn(usize) -> BlockBits, count: usize) {
        self.clear();
        self.items.reserve(count);
        for (block, order) in order.chunks(Self::BLOCK_SIZE).enumerate() {
            let (words, before) = (visible(block), self.items.len());
            let end = before + count_of(words);
            if end - before == order.len() {
                self.items.extend_from_slice(order);
                continue;
            }
            self.items.resize(end, 0);
            let bits = words.into_iter().enumerate();
            let seen = bits.flat_map(|(word, bits)| set_bits(bits).map(move |bit| word * BITS_PER_WORD + bit));
            self.items[before..].iter_mut().zip(seen).for_each(|(item, rank)| *item = order[rank]);
        }
    }

    /// Divides it into bundles of the groups of `ranks` ranks.
    fn divide_by_groups(&mut self, ranks: usize, visible: &impl Fn(usize) -> BlockBits) {
        let step = self.group.min(Self::BLOCK_SIZE);
        let (mut slot, mut start, mut end) = (0, 0, 0);
        for first in (0..ranks).step_by(Self::BLOCK_SIZE) {
            let words = visible(first / Self::BLOCK_SIZE);
            for rank in (first..ranks.min(first + Self::BLOCK_SIZE)).step_by(step) {
                let count = count_of_ranks(words, rank - first, step);
                if rank % self.group == 0 || end + count - start > Self::ITEMS_PER_BUNDLE {
                    self.end_bundle(slot, start..end);
                    (slot, start) = (rank / Self::MIN_GROUP, end);
                }
                end += count;
            }
        }
        self.end_bundle(slot, start..end);
        self.slots = ranks.div_ceil(Self::MIN_GROUP);
    }

    /// Adds a bundle of this range of items, unless it is empty.
    fn end_bundle(&mut self, slot: usize, Range { start, end }: Range<usize>) {
        if start < end {
            self.bundles.push(ItemBundle { end, slot });
        }
    }

    /// Chooses the size of groups of `ranks` ranks, of which the view sees `count`. It stays while bundles have about as
    /// many items as they should: with another one all are recorded anew.
    fn choose_group(&mut self, count: usize, ranks: usize, changes: ListChanges) {
        if count == 0 {
            self.group = self.group.max(Self::MIN_GROUP);
            return;
        }
        match changes {
            ListChanges { seen: Some(seen), versions: Some(versions) } => {
                let of_visible = versions as f32 * count as f32 / ranks as f32;
                if self.size.add(seen as f32 + of_visible, count as f32) {
                    self.group = 0;
                }
            }
            ListChanges { versions: None, .. } => self.size = BundleSize::default(),
            ListChanges { seen: None, .. } => {}
        }
        // The largest group of which the view sees at most so many items.
        let largest = |items: usize| {
            let mut group = Self::MIN_GROUP;
            while group < ranks && 2 * group * count <= items * ranks {
                group *= 2;
            }
            group
        };
        let items = self.size.items();
        self.group = self.group.clamp(largest(items), largest(items * 9 / 4));
    }

    /// Divides it into bundles of this many items.
    fn divide_evenly(&mut self, per_bundle: usize) {
        let (items, per_bundle) = (self.items.len(), per_bundle.max(1));
        self.slots = items.div_ceil(per_bundle);
        let bundle = |slot| ItemBundle { end: items.min((slot + 1) * per_bundle), slot };
        self.bundles.extend((0..self.slots).map(bundle));
    }
}

/// The number of visible ranks of a block.
fn count_of(bits: BlockBits) -> usize {
    bits.iter().map(|bits| bits.count_ones() as usize).sum()
}

/// The number of visible ones of `count` ranks of a block from `first` on: of a whole block, a whole number of words,
/// or a part of a word.
fn count_of_ranks(bits: BlockBits, first: usize, count: usize) -> usize {
    match count {
        ItemList::BLOCK_SIZE => count_of(bits),
        BITS_PER_WORD.. => {
            let words = &bits[first / BITS_PER_WORD..(first + count) / BITS_PER_WORD];
            words.iter().map(|bits| bits.count_ones() as usize).sum()
        }
        _ => {
            let bits = bits[first / BITS_PER_WORD] >> (first % BITS_PER_WORD);
            (bits & (u64::MAX >> (BITS_PER_WORD - count))).count_ones() as usize
        }
    }
}
