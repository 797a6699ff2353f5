//! A radix sort of integers.

/// Sorts `entries` by the `width` bits that begin at bit `low`; no higher bit is set. The sort is stable. `swapped` and
/// `counts` are scratch memory.
///
/// It runs a counting sort per digit, from the lowest to the highest (Knuth, *The Art of Computer Programming* 3,
/// 5.2.5).
pub(super) fn radix_sort(
    entries: &mut Vec<u64>,
    swapped: &mut Vec<u64>,
    counts: &mut Vec<[u32; DIGIT_VALUES]>,
    low: u32,
    width: u32,
) {
    let passes = width.div_ceil(MAX_DIGIT_BITS);
    if passes == 0 {
        return;
    }
    // Digits of equal width: no pass scatters to more positions than it must.
    let digit_bits = width.div_ceil(passes);
    let digits = 1 << digit_bits;
    let digit = |entry: u64, pass: u32| (entry >> (low + pass * digit_bits)) as usize & (digits - 1);
    counts.resize(counts.len().max(passes as usize), [0; DIGIT_VALUES]);
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
            let position = &mut counts[digit(entry, pass)];
            swapped[*position as usize] = entry;
            *position += 1;
        }
        std::mem::swap(entries, swapped);
    }
}

/// The widest digit: its counters fit into the L1 cache beside the entries that move.
const MAX_DIGIT_BITS: u32 = 11;

/// The number of values of the widest digit.
pub(super) const DIGIT_VALUES: usize = 1 << MAX_DIGIT_BITS;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn entries_are_sorted_as_by_a_stable_sort(
            mut entries in prop::collection::vec(any::<u64>(), 0..600),
            low in 0_u32..30,
            width in 0_u32..=34,
        ) {
            entries.iter_mut().for_each(|entry| *entry &= (1 << (low + width)) - 1);
            let mut expected = entries.clone();
            expected.sort_by_key(|entry| entry >> low);
            radix_sort(&mut entries, &mut vec![7; 3], &mut vec![[9; DIGIT_VALUES]; 2], low, width);
            prop_assert_eq!(entries, expected);
        }
    }
}
