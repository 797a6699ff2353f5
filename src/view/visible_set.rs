//! Which objects a view sees, found in parallel and compacted by prefix sum.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::RwLock;

use crate::chunked_array::block_ranges;

/// The objects that a view sees, as a bit each, and how many come before each word of 64.
///
/// Bits are set by whoever tested the object; which worker that was leaves no trace, so the compacted order is the order
/// of the objects, always.
#[derive(Debug, Default)]
pub struct VisibleSet {
    words: Vec<AtomicU64>,
    /// For each word, the number of bits set in the words before it; and the total at the end.
    offsets: RwLock<Vec<u32>>,
}

impl VisibleSet {
    /// Makes room for `objects` objects, none of them seen.
    pub fn reset(&mut self, objects: usize) {
        self.words.clear();
        self.words.resize_with(objects.div_ceil(64), AtomicU64::default);
        self.offsets.get_mut().clear();
    }

    /// Tests a range of objects: `sees` is asked for at most [`VisibleSet::WORD`] objects at a time, none of them past a
    /// multiple of that, and answers with a bit each, from the lowest; further bits are left out. Ranges tested at the same
    /// time must not share objects, but may share words.
    pub fn test(&self, objects: Range<usize>, sees: impl Fn(Range<usize>) -> u64) {
        for (word, asked) in block_ranges(objects, Self::WORD) {
            let known = u64::MAX >> (Self::WORD - asked.len());
            let bits = (sees(asked.clone()) & known) << (asked.start % Self::WORD);
            // Whoever reads the bits does so in a job that depends on this one, which orders the two.
            self.words[word].fetch_or(bits, Ordering::Relaxed);
        }
    }

    /// Takes away what is hidden of a range of objects, and says how many that were: `hides` is asked for the objects of a word
    /// of which any is seen, from `first`, a multiple of [`VisibleSet::WORD`], on, with a bit for each that is. Bits it answers
    /// with beyond those do not count. Ranges looked at at the same time must not share objects, but may share words.
    pub fn hide(&self, objects: Range<usize>, hides: impl Fn(usize, u64) -> u64) -> usize {
        let mut count = 0;
        for (word, asked) in block_ranges(objects, Self::WORD) {
            let known = (u64::MAX >> (Self::WORD - asked.len())) << (asked.start % Self::WORD);
            let seen = self.words[word].load(Ordering::Relaxed) & known;
            if seen != 0 {
                let hidden = hides(word * Self::WORD, seen) & seen;
                self.words[word].fetch_and(!hidden, Ordering::Relaxed);
                count += hidden.count_ones() as usize;
            }
        }
        count
    }

    /// A bit for each object from `word` × [`VisibleSet::WORD`] on, from the lowest: whether it is seen. None are past the last
    /// word.
    pub fn word(&self, word: usize) -> u64 {
        self.words.get(word).map_or(0, |bits| bits.load(Ordering::Relaxed))
    }

    /// Objects in a word.
    pub const WORD: usize = u64::BITS as usize;

    /// Counts what was seen: the prefix sum over words. To be called once, when every object was tested.
    pub fn compact(&self) {
        let mut offsets = self.offsets.write();
        offsets.clear();
        let mut total = 0;
        for word in &self.words {
            offsets.push(total);
            total += word.load(Ordering::Relaxed).count_ones();
        }
        offsets.push(total);
    }

    /// The number of objects seen; 0 before [`VisibleSet::compact`].
    pub fn count(&self) -> usize {
        self.offsets.read().last().map_or(0, |&total| total as usize)
    }

    /// Calls `visit(rank, word, bits)` for the visible objects whose rank among them is in `ranks`, word by word and in
    /// order: bit `b` is object `word × WORD + b`, and the lowest is that of `rank`. Ranks past the last are left out.
    pub fn visit(&self, ranks: Range<usize>, mut visit: impl FnMut(usize, usize, u64)) {
        let offsets = self.offsets.read();
        let end = ranks.end.min(offsets.last().map_or(0, |&total| total as usize));
        let mut rank = ranks.start;
        // The last word that starts at or before the rank; empty words before it start at the same rank.
        let mut word = offsets.partition_point(|&offset| offset as usize <= rank).saturating_sub(1);
        while rank < end {
            let mut bits = self.words[word].load(Ordering::Relaxed);
            for _ in offsets[word] as usize..rank {
                bits &= bits - 1;
            }
            let past_the_end = (offsets[word + 1] as usize).saturating_sub(end);
            for _ in 0..past_the_end {
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

/// The set bits' places, from the lowest.
pub(crate) fn set_bits(mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = (bits != 0).then(|| bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        place
    })
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn bits_of(asked: Range<usize>, sees: impl Fn(usize) -> bool) -> u64 {
        (0..).zip(asked).fold(0, |bits, (place, object)| bits | u64::from(sees(object)) << place)
    }

    proptest! {
        #[test]
        fn the_set_holds_what_a_plain_filter_holds(
            seen in prop::collection::vec(prop::bool::weighted(0.3), 0..700),
            chunk in 1_usize..200,
            ranks in 1_usize..100,
        ) {
            let expected: Vec<usize> = (0..seen.len()).filter(|&object| seen[object]).collect();
            let mut set = VisibleSet::default();
            set.reset(seen.len());
            let mut starts: Vec<usize> = (0..seen.len()).step_by(chunk).collect();
            starts.reverse();
            for start in starts {
                set.test(start..(start + chunk).min(seen.len()), |asked| bits_of(asked, |object| seen[object]));
            }
            set.compact();
            prop_assert_eq!(set.count(), expected.len());
            let mut found = Vec::new();
            for start in (0..seen.len() + 1).step_by(ranks) {
                set.visit(start..start + ranks, |rank, word, bits| {
                    assert_eq!(rank, found.len());
                    found.extend(set_bits(bits).map(|place| word * VisibleSet::WORD + place));
                });
                prop_assert_eq!(found.len(), expected.len().min(start + ranks));
            }
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn a_reset_forgets() {
        let mut set = VisibleSet::default();
        set.reset(3);
        set.test(0..3, |_| u64::MAX);
        set.compact();
        set.reset(130);
        assert_eq!(set.count(), 0);
        set.test(0..130, |asked| bits_of(asked, |object| object == 129));
        set.compact();
        assert_eq!(set.count(), 1);
    }
}
