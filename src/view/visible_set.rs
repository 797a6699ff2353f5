//! The visible set of a view, filled in parallel and compacted by prefix sum.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::RwLock;

use crate::chunked_array::block_ranges;
use crate::command::Version;

/// The objects that a view sees: a bit for each object, and a prefix sum over words of 64.
///
/// Frustum culling sets bits and occlusion culling clears them. Any worker may do either for any object; the result does
/// not depend on which. So the compacted order is always that of the objects.
///
/// A set may be kept for the next frame, which tests only the objects that changed.
#[derive(Debug, Default)]
pub struct VisibleSet {
    words: Vec<AtomicU64>,
    compacted: RwLock<Compacted>,
}

#[derive(Debug, Default)]
struct Compacted {
    /// For each word, the number of bits set in the words before it; the last entry is the total.
    offsets: Vec<u32>,
    /// The words that `version` is of.
    words: Vec<u64>,
    version: Version,
}

impl VisibleSet {
    /// Resizes the set for `objects` objects, all of which have to be tested.
    pub fn reset(&mut self, objects: usize) {
        self.words.resize_with(objects.div_ceil(Self::OBJECTS_PER_WORD), AtomicU64::default);
        // No object is tested for the bits after the last one.
        if let Some(last) = self.words.last_mut() {
            *last.get_mut() = 0;
        }
        self.compacted.get_mut().offsets.clear();
    }

    /// Tests a range of objects. `is_visible` is called with the part of the range in each word of [`VisibleSet::OBJECTS_PER_WORD`]
    /// objects, and returns a mask whose bit 0 is the first object of the part; excess bits are ignored. Ranges tested
    /// at the same time must not share objects, but may share words.
    pub fn test(&self, objects: Range<usize>, is_visible: impl Fn(Range<usize>) -> u64) {
        for (word, part) in block_ranges(objects, Self::OBJECTS_PER_WORD) {
            let shift = part.start % Self::OBJECTS_PER_WORD;
            let mask = (u64::MAX >> (Self::OBJECTS_PER_WORD - part.len())) << shift;
            let bits = (is_visible(part) << shift) & mask;
            // Relaxed: jobs that read the bits depend on this job.
            if mask == u64::MAX {
                self.words[word].store(bits, Ordering::Relaxed);
            } else {
                self.words[word].fetch_and(!mask, Ordering::Relaxed);
                self.words[word].fetch_or(bits, Ordering::Relaxed);
            }
        }
    }

    /// Removes the hidden objects of a range, and returns their number. For each word that has visible objects in the
    /// range, `is_hidden` is called with the word's first object and a mask of the visible ones, and returns a mask of
    /// the hidden ones; excess bits are ignored. Ranges processed at the same time must not share objects, but may
    /// share words.
    pub fn remove_hidden(&self, objects: Range<usize>, is_hidden: impl Fn(usize, u64) -> u64) -> usize {
        let mut count = 0;
        for (word, part) in block_ranges(objects, Self::OBJECTS_PER_WORD) {
            let mask = (u64::MAX >> (Self::OBJECTS_PER_WORD - part.len())) << (part.start % Self::OBJECTS_PER_WORD);
            let visible = self.words[word].load(Ordering::Relaxed) & mask;
            if visible != 0 {
                let hidden = is_hidden(word * Self::OBJECTS_PER_WORD, visible) & visible;
                self.words[word].fetch_and(!hidden, Ordering::Relaxed);
                count += hidden.count_ones() as usize;
            }
        }
        count
    }

    /// A mask of the visible objects from `word` × [`VisibleSet::OBJECTS_PER_WORD`] on; 0 beyond the last word.
    pub fn word(&self, word: usize) -> u64 {
        self.words.get(word).map_or(0, |bits| bits.load(Ordering::Relaxed))
    }

    /// The number of objects in a word.
    pub const OBJECTS_PER_WORD: usize = u64::BITS as usize;

    /// Computes the prefix sum over words. Call it once, after all objects have been tested and hidden ones removed. If the set
    /// differs from the one that was compacted before, it gets `version`, which no other set has.
    pub fn compact(&self, version: Version) {
        let Compacted { offsets, words, version: current } = &mut *self.compacted.write();
        offsets.clear();
        let mut total = 0;
        let mut differs = words.len() != self.words.len();
        words.resize(self.words.len(), 0);
        for (word, before) in self.words.iter().zip(words) {
            offsets.push(total);
            let bits = word.load(Ordering::Relaxed);
            total += bits.count_ones();
            differs |= *before != bits;
            *before = bits;
        }
        offsets.push(total);
        if differs {
            *current = version;
        }
    }

    /// The version that the latest set with these objects got.
    pub fn version(&self) -> Version {
        self.compacted.read().version
    }

    /// The number of words.
    pub fn word_count(&self) -> usize {
        self.words.len()
    }

    /// The number of visible objects; 0 before [`VisibleSet::compact`].
    pub fn count(&self) -> usize {
        self.compacted.read().offsets.last().map_or(0, |&total| total as usize)
    }

    /// Calls `visit(rank, word, bits)` for each word, in order, with the visible objects whose rank (index among the
    /// visible objects) is in `ranks`. Bit `b` is object `word × OBJECTS_PER_WORD + b`; the lowest set bit has the rank `rank`.
    /// Ranks beyond the last are ignored.
    pub fn visit(&self, ranks: Range<usize>, mut visit: impl FnMut(usize, usize, u64)) {
        let offsets = &self.compacted.read().offsets;
        let end = ranks.end.min(offsets.last().map_or(0, |&total| total as usize));
        let mut rank = ranks.start;
        // The last word whose first rank is not beyond `rank`: empty words before it have the same first rank.
        let mut word = offsets.partition_point(|&offset| offset as usize <= rank).saturating_sub(1);
        while rank < end {
            let mut bits = self.words[word].load(Ordering::Relaxed);
            for _ in offsets[word] as usize..rank {
                bits &= bits - 1;
            }
            let excess = (offsets[word + 1] as usize).saturating_sub(end);
            for _ in 0..excess {
                bits &= !(1 << (u64::BITS - 1 - bits.leading_zeros()));
            }
            if bits != 0 {
                visit(rank, word, bits);
                rank += bits.count_ones() as usize;
            }
            word += 1;
        }
    }
}

/// The indices of the set bits, from the lowest.
pub(crate) fn set_bits(mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let index = (bits != 0).then(|| bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        index
    })
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn mask_of(objects: Range<usize>, is_visible: impl Fn(usize) -> bool) -> u64 {
        (0..).zip(objects).fold(0, |mask, (bit, object)| mask | u64::from(is_visible(object)) << bit)
    }

    proptest! {
        #[test]
        fn the_set_contains_what_a_plain_filter_finds(
            visible in prop::collection::vec(prop::bool::weighted(0.3), 0..700),
            chunk in 1_usize..200,
            ranks in 1_usize..100,
        ) {
            let expected: Vec<usize> = (0..visible.len()).filter(|&object| visible[object]).collect();
            let mut set = VisibleSet::default();
            set.reset(visible.len());
            let mut starts: Vec<usize> = (0..visible.len()).step_by(chunk).collect();
            starts.reverse();
            for start in starts {
                set.test(start..(start + chunk).min(visible.len()), |part| mask_of(part, |object| visible[object]));
            }
            set.compact(Version::default());
            prop_assert_eq!(set.count(), expected.len());
            let mut found = Vec::new();
            for start in (0..visible.len() + 1).step_by(ranks) {
                set.visit(start..start + ranks, |rank, word, bits| {
                    assert_eq!(rank, found.len());
                    found.extend(set_bits(bits).map(|bit| word * VisibleSet::OBJECTS_PER_WORD + bit));
                });
                prop_assert_eq!(found.len(), expected.len().min(start + ranks));
            }
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn a_reset_clears_the_set() {
        let mut set = VisibleSet::default();
        set.reset(3);
        set.test(0..3, |_| u64::MAX);
        set.compact(Version::default());
        set.reset(130);
        assert_eq!(set.count(), 0);
        set.test(0..130, |part| mask_of(part, |object| object == 129));
        set.compact(Version::default());
        assert_eq!(set.count(), 1);
    }
}
