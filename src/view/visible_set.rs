//! Which objects a view sees, found in parallel and compacted by prefix sum.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::RwLock;

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

    /// Tests a range of objects. Ranges tested at the same time must not share objects, but may share words.
    pub fn test(&self, objects: Range<usize>, sees: impl Fn(usize) -> bool) {
        let mut object = objects.start;
        while object < objects.end {
            let word_end = (object / 64 + 1) * 64;
            let mut bits = 0;
            for candidate in object..word_end.min(objects.end) {
                bits |= u64::from(sees(candidate)) << (candidate % 64);
            }
            // Whoever reads the bits does so in a job that depends on this one, which orders the two.
            self.words[object / 64].fetch_or(bits, Ordering::Relaxed);
            object = word_end;
        }
    }

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

    /// Calls `visit(rank, object)` for the visible objects whose rank among them is in `ranks`, in order. Ranks past the
    /// last are left out.
    pub fn visit(&self, ranks: Range<usize>, mut visit: impl FnMut(usize, usize)) {
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
            while bits != 0 && rank < end {
                visit(rank, word * 64 + bits.trailing_zeros() as usize);
                bits &= bits - 1;
                rank += 1;
            }
            word += 1;
        }
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::*;

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
                set.test(start..(start + chunk).min(seen.len()), |object| seen[object]);
            }
            set.compact();
            prop_assert_eq!(set.count(), expected.len());
            let mut found = Vec::new();
            for start in (0..seen.len() + 1).step_by(ranks) {
                set.visit(start..start + ranks, |rank, object| {
                    assert_eq!(rank, found.len());
                    found.push(object);
                });
            }
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn a_reset_forgets() {
        let mut set = VisibleSet::default();
        set.reset(3);
        set.test(0..3, |_| true);
        set.compact();
        set.reset(130);
        assert_eq!(set.count(), 0);
        set.test(0..130, |object| object == 129);
        set.compact();
        assert_eq!(set.count(), 1);
    }
}
