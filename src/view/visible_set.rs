//! The visible set of a view, filled in parallel and compacted by prefix sum.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

#[cfg(feature = "occlusion")]
use drawloom_jobs::internal::block_ranges;
use parking_lot::RwLock;

use crate::bit_set::{BITS_PER_WORD, set_bits};
use crate::command::Version;

/// The objects that a view sees: a bit for each object, in words of 64, and a prefix sum over the words that are not
/// empty. A view that sees few of many objects pays for the few.
///
/// Frustum culling sets bits and occlusion culling clears them. Any worker may do either for any object; the result
/// does not depend on which. So the compacted order is always that of the objects.
///
/// A set may be kept for the next frame, which tests only the objects that changed.
#[derive(Debug, Default)]
pub struct VisibleSet {
    words: Vec<AtomicU64>,
    /// A bit for each word. A word whose bit is not set is empty; compaction clears those of words that became empty.
    filled: Vec<AtomicU64>,
    compacted: RwLock<Compacted>,
}

#[derive(Debug, Default)]
struct Compacted {
    /// The words that are not empty, in order.
    words: Vec<VisibleWord>,
    /// The number of visible objects.
    total: u32,
    /// The version of `words`.
    version: Version,
}

/// Visible objects among 64, as a [`BitWord`](crate::bit_set::BitWord), which with a rank beside it would be larger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct VisibleWord {
    word: u32,
    /// The number of visible objects in the words before it.
    rank: u32,
    bits: u64,
}

impl Compacted {
    /// The words that are not empty; none between a reset and a compaction, when `words` are those of the set before.
    fn filled_words(&self) -> &[VisibleWord] {
        if self.total > 0 { &self.words } else { &[] }
    }
}

impl VisibleSet {
    /// The number of objects in a word.
    pub const OBJECTS_PER_WORD: usize = BITS_PER_WORD;

    /// Empties the set, and resizes it for `objects` objects.
    pub fn reset(&mut self, objects: usize) {
        for (index, filled) in self.filled.iter_mut().enumerate() {
            for bit in set_bits(std::mem::take(filled.get_mut())) {
                *self.words[index * Self::OBJECTS_PER_WORD + bit].get_mut() = 0;
            }
        }
        let words = objects.div_ceil(Self::OBJECTS_PER_WORD);
        self.words.resize_with(words, AtomicU64::default);
        self.filled.resize_with(words.div_ceil(Self::OBJECTS_PER_WORD), AtomicU64::default);
        self.compacted.get_mut().total = 0;
    }

    /// Replaces the objects of a word that are in a mask: those in `visible` are visible, the others are not. Objects
    /// replaced at the same time must differ, but may share words.
    pub fn replace(&self, word: usize, mask: u64, visible: u64) {
        // Relaxed, here and below: jobs that read the bits depend on this job.
        let bits = visible & mask;
        if self.words[word].load(Ordering::Relaxed) & mask == bits {
            return;
        }
        if mask == u64::MAX {
            self.words[word].store(bits, Ordering::Relaxed);
        } else {
            self.words[word].fetch_and(!mask, Ordering::Relaxed);
            self.words[word].fetch_or(bits, Ordering::Relaxed);
        }
        let (index, bit) = (word / Self::OBJECTS_PER_WORD, word % Self::OBJECTS_PER_WORD);
        if self.filled[index].load(Ordering::Relaxed) >> bit & 1 == 0 {
            self.filled[index].fetch_or(1 << bit, Ordering::Relaxed);
        }
    }

    /// Removes the hidden objects of a range, and returns their number. For each word that has visible objects in the
    /// range, `is_hidden` is called with the word's first object and a mask of the visible ones, and returns a mask of
    /// the hidden ones; excess bits are ignored. Ranges processed at the same time must not share objects, but may
    /// share words.
    #[cfg(feature = "occlusion")]
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

    /// Whether the view sees an object.
    ///
    /// # Panics
    /// If the set was not reset for that many objects.
    #[inline]
    pub fn contains(&self, object: usize) -> bool {
        let word = &self.words[object / Self::OBJECTS_PER_WORD];
        word.load(Ordering::Relaxed) >> (object % Self::OBJECTS_PER_WORD) & 1 == 1
    }

    /// Computes the prefix sum. Call it once, after all objects have been tested and hidden ones removed. If the set
    /// differs from the one that was compacted before, it gets `version`, which no other set has.
    pub fn compact(&self, version: Version) {
        let Compacted { words, total, version: current } = &mut *self.compacted.write();
        let (mut length, mut rank, mut differs) = (0, 0, false);
        for (index, filled) in self.filled.iter().enumerate() {
            for bit in set_bits(filled.load(Ordering::Relaxed)) {
                let word = index * Self::OBJECTS_PER_WORD + bit;
                let bits = self.words[word].load(Ordering::Relaxed);
                if bits == 0 {
                    filled.fetch_and(!(1 << bit), Ordering::Relaxed);
                    continue;
                }
                let now = VisibleWord { word: word as u32, rank, bits };
                match words.get_mut(length) {
                    Some(before) => differs |= std::mem::replace(before, now) != now,
                    None => {
                        differs = true;
                        words.push(now);
                    }
                }
                length += 1;
                rank += bits.count_ones();
            }
        }
        differs |= words.len() != length;
        words.truncate(length);
        *total = rank;
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

    /// The number of visible objects; 0 between a reset and [`VisibleSet::compact`].
    pub fn count(&self) -> usize {
        self.compacted.read().total as usize
    }

    /// The number of words that are not empty; 0 between a reset and [`VisibleSet::compact`].
    pub fn filled_word_count(&self) -> usize {
        self.compacted.read().filled_words().len()
    }

    /// Calls `visit(word, bits)` for words that are not empty, in order: those whose index among them is in `indices`.
    ///
    /// # Panics
    /// If `indices` are not below [`VisibleSet::filled_word_count`].
    pub fn visit_words(&self, indices: Range<usize>, mut visit: impl FnMut(usize, u64)) {
        for &VisibleWord { word, bits, .. } in &self.compacted.read().filled_words()[indices] {
            visit(word as usize, bits);
        }
    }

    /// Calls `visit(rank, word, bits)` for each word, in order, with the visible objects whose rank (index among the
    /// visible objects) is in `ranks`. Bit `b` is object `word × OBJECTS_PER_WORD + b`; the lowest set bit has the rank
    /// `rank`. Ranks beyond the last are ignored.
    pub fn visit(&self, ranks: Range<usize>, mut visit: impl FnMut(usize, usize, u64)) {
        let compacted = self.compacted.read();
        let words = compacted.filled_words();
        let first = words.partition_point(|word| word.rank as usize <= ranks.start).saturating_sub(1);
        for &VisibleWord { word, rank, mut bits } in &words[first..] {
            let rank = rank as usize;
            if rank >= ranks.end {
                break;
            }
            let excess = (rank + bits.count_ones() as usize).saturating_sub(ranks.end);
            for _ in 0..excess {
                bits &= !(1 << (u64::BITS - 1 - bits.leading_zeros()));
            }
            for _ in rank..ranks.start {
                bits &= bits.wrapping_sub(1);
            }
            if bits != 0 {
                visit(rank.max(ranks.start), word as usize, bits);
            }
        }
    }
}

#[cfg(test)]
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
                for (word, part) in block_ranges(start..(start + chunk).min(visible.len()), VisibleSet::OBJECTS_PER_WORD) {
                    let shift = part.start % VisibleSet::OBJECTS_PER_WORD;
                    let mask = mask_of(part.clone(), |_| true) << shift;
                    set.replace(word, mask, mask_of(part, |object| visible[object]) << shift);
                }
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
    fn a_reset_empties_the_set() {
        let mut set = VisibleSet::default();
        set.reset(3);
        set.replace(0, 0b111, u64::MAX);
        set.compact(Version::default());
        assert_eq!(set.count(), 3);
        set.reset(130);
        assert_eq!((set.count(), set.filled_word_count()), (0, 0));
        set.visit(0..10, |_, word, _| panic!("{word}"));
        set.compact(Version::default());
        assert_eq!((set.count(), set.filled_word_count()), (0, 0));
        set.replace(2, 0b11, 0b10);
        set.compact(Version::default());
        assert_eq!((set.count(), set.word(2)), (1, 0b10));
        set.reset(65);
        set.reset(130);
        assert_eq!((set.word(0), set.word(2)), (0, 0));
    }

    /// One word tells for 64 others whether they are empty, so for 4,096 objects.
    #[test]
    fn words_are_found_and_forgotten_beyond_4096_objects() {
        let mut set = VisibleSet::default();
        set.reset(20_000);
        let filled = [(3, 0b101), (67, 0b11), (130, 1 << 63), (312, 0b1)];
        filled.iter().for_each(|&(word, visible)| set.replace(word, u64::MAX, visible));
        let words = |set: &VisibleSet| {
            set.compact(Version::default());
            let mut words = Vec::new();
            set.visit_words(0..set.filled_word_count(), |word, bits| words.push((word, bits)));
            words
        };
        assert_eq!(words(&set), filled);
        set.replace(67, u64::MAX, 0);
        assert_eq!(words(&set), [filled[0], filled[2], filled[3]]);
        set.reset(20_000);
        assert!((0..set.word_count()).all(|word| set.word(word) == 0));
        assert_eq!(words(&set), []);
    }

    #[test]
    fn a_set_gets_a_version_where_it_differs_from_the_one_before() {
        let version = |frame| Version { frame, index: 0 };
        let mut set = VisibleSet::default();
        set.reset(200);
        let compact = |set: &VisibleSet, frame| {
            set.compact(version(frame));
            set.version()
        };
        set.replace(1, u64::MAX, 0b100);
        assert_eq!(compact(&set, 1), version(1));
        set.reset(200);
        set.replace(1, u64::MAX, 0b100);
        assert_eq!(compact(&set, 2), version(1));
        set.replace(3, u64::MAX, 0b1);
        assert_eq!(compact(&set, 3), version(3));
        set.replace(1, 0b100, 0);
        assert_eq!(compact(&set, 4), version(4));
        set.replace(1, 0b1000, 0);
        assert_eq!(compact(&set, 5), version(4));
        set.reset(0);
        assert_eq!(compact(&set, 6), version(6));
    }
}
