//! A radix sort of numbers.

/// Sorts `entries` by their bits from `low` on, `width` of them, above which there is none; those that are equal in these keep
/// their order. `swapped` and `counts` are memory to work in.
///
/// From the lowest digit to the highest, each pass a counting sort (Knuth, *The Art of Computer Programming* 3, 5.2.5).
pub(super) fn sort_by_bits(
    entries: &mut Vec<u64>,
    swapped: &mut Vec<u64>,
    counts: &mut Vec<[u32; DIGITS]>,
    low: u32,
    width: u32,
) {
    let passes = width.div_ceil(DIGIT_BITS);
    if passes == 0 {
        return;
    }
    // All digits are about as wide as each other, so that no pass has more places to write to than it must.
    let digit_bits = width.div_ceil(passes);
    let digits = 1 << digit_bits;
    let digit = |entry: u64, pass: u32| (entry >> (low + pass * digit_bits)) as usize & (digits - 1);
    counts.resize(counts.len().max(passes as usize), [0; DIGITS]);
    let counts = &mut counts[..passes as usize];
    for counts in &mut *counts {
        counts[..digits].fill(0);
    }
    for &entry in &*entries {
        for (pass, counts) in (0..).zip(&mut *counts) {
            counts[digit(entry, pass)] += 1;
        }
    }
    swapped.clear();
    swapped.resize(entries.len(), 0);
    for (pass, counts) in (0..).zip(counts) {
        let mut next = 0;
        for count in &mut counts[..digits] {
            next += std::mem::replace(count, next);
        }
        for &entry in &*entries {
            let place = &mut counts[digit(entry, pass)];
            swapped[*place as usize] = entry;
            *place += 1;
        }
        std::mem::swap(entries, swapped);
    }
}

/// Bits looked at in one pass at most: as many counters as fit into the nearest memory beside what is moved.
const DIGIT_BITS: u32 = 11;

/// The values of a digit.
pub(super) const DIGITS: usize = 1 << DIGIT_BITS;

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn entries_are_sorted_as_a_stable_sort_would(
            mut entries in prop::collection::vec(any::<u64>(), 0..600),
            low in 0_u32..30,
            width in 0_u32..=34,
        ) {
            entries.iter_mut().for_each(|entry| *entry &= (1 << (low + width)) - 1);
            let mut expected = entries.clone();
            expected.sort_by_key(|entry| entry >> low);
            sort_by_bits(&mut entries, &mut vec![7; 3], &mut vec![[9; DIGITS]; 2], low, width);
            prop_assert_eq!(entries, expected);
        }
    }
}
