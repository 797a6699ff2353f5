//! Sets of a scene's objects.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use crate::bit_set::{BITS_PER_WORD, BitWord};

/// A set of a scene's objects, by index: what an [`ViewFilter`](super::ViewFilter) lists. A clone shares its
/// memory, which is 16 bytes for each 64 indices of the scene among which one is in the set.
///
/// An index is that of an entry in the slices of a [`SceneRef`](super::SceneRef), in every frame anew. If an object
/// moves to another index, the set contains whichever object is at the index now, so an engine then makes the set
/// again. [`Scene::object_set`](super::Scene::object_set) makes one of handles.
///
/// ```
/// use drawloom::scene::ObjectSet;
///
/// let head = ObjectSet::new([7, 3, 7]);
/// assert!(head.contains(3) && !head.contains(4));
/// assert_eq!(head.iter().collect::<Vec<_>>(), [3, 7]);
/// assert_eq!(head, (3..8).step_by(4).collect());
/// ```
#[derive(Clone, Default)]
pub struct ObjectSet {
    /// Ascending by word; no mask is 0.
    words: Arc<[BitWord]>,
}

impl ObjectSet {
    /// The set of the objects at these indices, in any order, repeated or not.
    pub fn new(indices: impl IntoIterator<Item = u32>) -> Self {
        let mut indices: Vec<_> = indices.into_iter().collect();
        indices.sort_unstable();
        let in_same_word = |one: &u32, next: &u32| one / u64::BITS == next / u64::BITS;
        let word = |indices: &[u32]| BitWord {
            word: indices[0] / u64::BITS,
            mask: indices.iter().fold(0, |mask, index| mask | 1 << (index % u64::BITS)),
        };
        Self { words: indices.chunk_by(in_same_word).map(word).collect() }
    }

    /// Whether it contains the object at an index.
    pub fn contains(&self, object: usize) -> bool {
        self.mask(object / BITS_PER_WORD) >> (object % BITS_PER_WORD) & 1 == 1
    }

    /// The number of objects.
    pub fn len(&self) -> usize {
        self.words.iter().map(|word| word.mask.count_ones() as usize).sum()
    }

    /// Whether it contains no object.
    pub fn is_empty(&self) -> bool {
        self.words.is_empty()
    }

    /// The indices of its objects, in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = u32> {
        self.iter_from(0)
    }

    /// The indices from `first` on.
    pub(crate) fn iter_from(&self, first: usize) -> impl Iterator<Item = u32> {
        let words = &self.words[self.position(first / BITS_PER_WORD)..];
        words.iter().flat_map(|word| word.indices()).filter(move |index| *index >= first).map(|index| index as u32)
    }

    /// A mask of its objects among the 64 from `word` × 64 on.
    pub(crate) fn mask(&self, word: usize) -> u64 {
        let found = self.words.get(self.position(word));
        found.filter(|found| found.index() == word).map_or(0, |found| found.mask)
    }

    /// The words of a range that have objects, in order.
    pub(crate) fn words(&self, range: Range<usize>) -> impl Iterator<Item = BitWord> {
        self.words[self.position(range.start)..].iter().copied().take_while(move |word| word.index() < range.end)
    }

    /// The number of words below one.
    fn position(&self, word: usize) -> usize {
        self.words.partition_point(|known| known.index() < word)
    }
}

impl PartialEq for ObjectSet {
    fn eq(&self, other: &Self) -> bool {
        // Frames compare sets with those of the frame before, which are mostly clones.
        Arc::ptr_eq(&self.words, &other.words) || self.words == other.words
    }
}

impl Eq for ObjectSet {}

impl FromIterator<u32> for ObjectSet {
    fn from_iter<I: IntoIterator<Item = u32>>(indices: I) -> Self {
        Self::new(indices)
    }
}

impl fmt::Debug for ObjectSet {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_set().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_set_contains_what_it_was_made_of(
            indices in prop::collection::vec(prop_oneof![0_u32..400, Just(u32::MAX), Just(u32::MAX - 64)], 0..60),
            words in (0_usize..8, 0_usize..8),
            first in 0_usize..500,
        ) {
            let expected: BTreeSet<u32> = indices.iter().copied().collect();
            let set = ObjectSet::new(indices.iter().rev().copied());
            prop_assert_eq!(set.iter().collect::<Vec<_>>(), expected.iter().copied().collect::<Vec<_>>());
            prop_assert_eq!((set.len(), set.is_empty()), (expected.len(), expected.is_empty()));
            prop_assert!((0..500).all(|index| set.contains(index) == expected.contains(&(index as u32))));
            prop_assert_eq!(set.iter_from(first).count(), expected.range(first as u32..).count());
            for word in 0..8 {
                let bits = expected.range(word * 64..(word + 1) * 64).fold(0, |mask, index| mask | 1 << (index % 64));
                prop_assert_eq!(set.mask(word as usize), bits);
            }
            let found: Vec<_> = set.words(words.0..words.1).collect();
            let expected = (words.0..words.1).map(|word| BitWord::new(word, set.mask(word)));
            prop_assert_eq!(found, expected.filter(|word| word.mask != 0).collect::<Vec<_>>());
        }
    }

    #[test]
    fn sets_of_the_same_objects_are_equal() {
        assert_eq!(ObjectSet::new([3, 900, 3]), ObjectSet::new([900, 3]));
        assert_ne!(ObjectSet::new([3]), ObjectSet::new([4]));
        assert_eq!(ObjectSet::new([]), ObjectSet::default());
        assert_eq!(format!("{:?}", ObjectSet::new([70, 3])), "{3, 70}");
    }
}
