//! Sets of indices as bits, in words of 64.

/// The number of bits in a word.
pub(crate) const BITS_PER_WORD: usize = u64::BITS as usize;

/// A word of a set: bit `b` of the mask is index `word × 64 + b`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BitWord {
    pub(crate) word: u32,
    pub(crate) mask: u64,
}

impl BitWord {
    /// # Panics
    /// If debug assertions are on and `word` exceeds 32 bits; no index does.
    #[inline]
    pub(crate) fn new(word: usize, mask: u64) -> Self {
        debug_assert!(u32::try_from(word).is_ok(), "word {word}");
        Self { word: word as u32, mask }
    }

    /// Which word it is.
    #[inline]
    pub(crate) fn index(self) -> usize {
        self.word as usize
    }

    /// The indices in it, ascending.
    #[inline]
    pub(crate) fn indices(self) -> impl Iterator<Item = usize> {
        set_bits(self.mask).map(move |bit| self.index() * BITS_PER_WORD + bit)
    }

    /// Whether it contains an index. The index is one of this word.
    #[inline]
    pub(crate) fn contains(self, index: usize) -> bool {
        self.mask >> (index % BITS_PER_WORD) & 1 == 1
    }
}

/// The positions of the set bits, from the lowest.
#[inline]
pub(crate) fn set_bits(mut bits: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let index = (bits != 0).then(|| bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        index
    })
}

/// A set of indices, with a bit for each one up to the largest.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct BitSet {
    words: Vec<u64>,
}

impl BitSet {
    /// Makes room for the indices below `length`, and drops those of words beyond.
    pub(crate) fn resize(&mut self, length: usize) {
        self.words.resize(length.div_ceil(BITS_PER_WORD), 0);
    }

    /// There is room for the indices below this one.
    #[inline]
    pub(crate) fn room(&self) -> usize {
        self.words.len() * BITS_PER_WORD
    }

    /// Empties the set, which then has no room.
    pub(crate) fn clear(&mut self) {
        self.words.clear();
    }

    /// Makes it the same as another set, in the memory that it has.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.words.clone_from(&other.words);
    }

    /// Adds an index.
    ///
    /// # Panics
    /// If there is no room for it.
    #[inline]
    pub(crate) fn insert(&mut self, index: usize) {
        self.words[index / BITS_PER_WORD] |= 1 << (index % BITS_PER_WORD);
    }

    /// Adds the indices of a word.
    ///
    /// # Panics
    /// If there is no room for them.
    #[inline]
    pub(crate) fn insert_word(&mut self, added: BitWord) {
        self.words[added.index()] |= added.mask;
    }

    /// Removes the indices of a word, which may be beyond the room.
    #[inline]
    pub(crate) fn remove_word(&mut self, removed: BitWord) {
        if let Some(word) = self.words.get_mut(removed.index()) {
            *word &= !removed.mask;
        }
    }

    /// Whether it contains an index, which may be beyond the room.
    #[inline]
    pub(crate) fn contains(&self, index: usize) -> bool {
        self.mask(index / BITS_PER_WORD) >> (index % BITS_PER_WORD) & 1 == 1
    }

    /// A mask of the indices in a word; 0 beyond the room.
    #[inline]
    pub(crate) fn mask(&self, word: usize) -> u64 {
        self.words.get(word).copied().unwrap_or(0)
    }

    /// The indices, ascending.
    pub(crate) fn iter(&self) -> impl Iterator<Item = usize> {
        self.words.iter().enumerate().flat_map(|(word, &mask)| BitWord::new(word, mask).indices())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_set_of_bits_contains_what_a_set_of_indices_does(
            changes in prop::collection::vec((any::<bool>(), 0_usize..6, any::<u64>(), 0_usize..300), 0..20),
            length in 0_usize..400,
        ) {
            let (mut set, mut expected) = (BitSet::default(), BTreeSet::new());
            set.resize(300);
            prop_assert_eq!(set.room(), 320);
            for (is_added, word, mask, index) in changes {
                let changed = BitWord::new(word, mask);
                let indices: Vec<_> =
                    (0..64).filter(|bit| mask >> bit & 1 == 1).map(|bit| word * 64 + bit).collect();
                prop_assert_eq!(changed.indices().collect::<Vec<_>>(), indices.clone());
                let mut of_word = word * 64..word * 64 + 64;
                prop_assert!(of_word.all(|index| changed.contains(index) == indices.contains(&index)));
                if !is_added {
                    set.remove_word(changed);
                    expected.retain(|index| !indices.contains(index));
                } else if word < 5 {
                    set.insert_word(changed);
                    set.insert(index);
                    expected.extend(indices.into_iter().chain([index]));
                }
            }
            prop_assert_eq!(set.iter().collect::<Vec<_>>(), expected.iter().copied().collect::<Vec<_>>());
            prop_assert!((0..500).all(|index| set.contains(index) == expected.contains(&index)));
            prop_assert_eq!(set.mask(7), 0);
            let mut copy = BitSet::default();
            copy.copy_from(&set);
            prop_assert_eq!(&copy, &set);
            set.resize(length);
            expected.retain(|index| *index < length.next_multiple_of(64));
            prop_assert!(set.iter().eq(expected));
            copy.clear();
            prop_assert_eq!(copy, BitSet::default());
        }
    }
}
