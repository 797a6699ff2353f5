//! Which part of a buffer belongs to whom.

use std::ops::Range;

/// Allots each owner a range of a buffer, of the length that `length` says, so that no two overlap. An owner whose
/// range has that length already keeps it: views and passes come and go, and those that stay are bound where they were.
/// Returns where the last range ends.
///
/// Ranges are allotted anew from the start where more than half of the buffer would belong to nobody.
pub(super) fn allot<T>(
    owners: &mut [T],
    range: impl Fn(&mut T) -> &mut Range<usize>,
    length: impl Fn(&T) -> usize,
) -> usize {
    let (mut end, mut sum, mut all_fit) = (0, 0, true);
    for owner in owners.iter_mut() {
        let length = length(owner);
        let range = range(owner);
        all_fit &= range.len() == length;
        (end, sum) = (end.max(range.end), sum + length);
    }
    if all_fit && end <= 2 * sum {
        return end;
    }
    let gaps = release_and_find_gaps(owners, &range, &length);
    let end = place(owners, gaps, &range, &length);
    if end <= 2 * sum {
        return end;
    }
    owners.iter_mut().for_each(|owner| *range(owner) = 0..0);
    let gaps = release_and_find_gaps(owners, &range, &length);
    place(owners, gaps, &range, &length)
}

/// Takes away the ranges that have the wrong length. Returns the gaps between the others, and all that lies behind
/// them.
fn release_and_find_gaps<T>(
    owners: &mut [T],
    range: impl Fn(&mut T) -> &mut Range<usize>,
    length: impl Fn(&T) -> usize,
) -> Vec<Range<usize>> {
    let mut kept = Vec::new();
    for owner in owners.iter_mut() {
        let length = length(owner);
        let range = range(owner);
        if range.len() != length {
            *range = 0..0;
        } else if length > 0 {
            kept.push(range.clone());
        }
    }
    kept.sort_unstable_by_key(|range| range.start);
    let mut gaps = Vec::with_capacity(kept.len() + 1);
    let mut end = 0;
    for range in kept {
        gaps.push(end..range.start);
        end = range.end;
    }
    gaps.push(end..usize::MAX);
    gaps
}

/// Places each owner without a range in the first gap with room for it. Returns where the last range ends.
fn place<T>(
    owners: &mut [T],
    mut gaps: Vec<Range<usize>>,
    range: impl Fn(&mut T) -> &mut Range<usize>,
    length: impl Fn(&T) -> usize,
) -> usize {
    // Gaps before this one are full.
    let mut first = 0;
    let mut end = 0;
    for owner in owners {
        let length = length(owner);
        let range = range(owner);
        if range.len() != length {
            while gaps[first].is_empty() {
                first += 1;
            }
            // The last gap has room for everything.
            if let Some(gap) = gaps[first..].iter_mut().find(|gap| gap.len() >= length) {
                *range = gap.start..gap.start + length;
                gap.start += length;
            }
        }
        end = end.max(range.end);
    }
    end
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[derive(Clone, Debug)]
    struct Owner {
        name: u32,
        length: usize,
        range: Range<usize>,
    }

    fn allot_all(owners: &mut [Owner]) -> usize {
        allot(owners, |owner| &mut owner.range, |owner| owner.length)
    }

    fn owner(name: u32, length: usize) -> Owner {
        Owner { name, length, range: 0..0 }
    }

    #[test]
    fn who_stays_keeps_its_range_and_who_comes_fills_gaps() {
        let mut owners = vec![owner(0, 4), owner(1, 2), owner(2, 3)];
        assert_eq!(allot_all(&mut owners), 9);
        owners.remove(1);
        owners.insert(0, owner(3, 1));
        assert_eq!(allot_all(&mut owners), 9);
        assert_eq!(owners.iter().map(|owner| owner.range.clone()).collect::<Vec<_>>(), [4..5, 0..4, 6..9]);
        owners.truncate(1);
        assert_eq!(allot_all(&mut owners), 1, "it is moved to the start, as most of the buffer belongs to nobody");
    }

    proptest! {
        /// Rounds of owners by name, each with its length.
        #[test]
        fn ranges_are_disjoint_long_enough_and_kept(
            rounds in prop::collection::vec(prop::collection::btree_map(0..20_u32, 0..6_usize, 0..12), 1..12)
        ) {
            let mut before: Vec<Owner> = Vec::new();
            for round in rounds {
                let range_of = |name| before.iter().find(|owner| owner.name == name).map(|owner| owner.range.clone());
                let mut owners: Vec<_> = round
                    .into_iter()
                    .map(|(name, length)| Owner { range: range_of(name).unwrap_or_default(), ..owner(name, length) })
                    .collect();
                let wanted = owners.clone();
                let end = allot_all(&mut owners);
                let sum: usize = owners.iter().map(|owner| owner.length).sum();
                let mut used = vec![false; end];
                for owner in &owners {
                    prop_assert_eq!(owner.range.len(), owner.length);
                    for index in owner.range.clone() {
                        prop_assert!(!std::mem::replace(&mut used[index], true), "{:?} overlap", owners);
                    }
                }
                prop_assert!(end <= 2 * sum);
                let moved = owners.iter().zip(&wanted).any(|(now, before)| before.range.len() == now.length && before.range != now.range);
                // Ranges move only together, to the start.
                prop_assert!(!moved || end == sum, "{:?} became {:?}", wanted, owners);
                before = owners;
            }
        }
    }
}
