//! Lays out overlapping slices on tracks.

use std::time::Duration;

/// The track of each slice, counted from 0: the first one on which it lies inside another slice or overlaps none.
///
/// Slices are given by when they began and ended, ascending by when they began. Of two that began at once the longer
/// one comes first.
pub(super) fn nested_tracks(slices: impl IntoIterator<Item = (Duration, Duration)>) -> Vec<usize> {
    // For each track the ends of its open slices, the innermost last.
    let mut tracks: Vec<Vec<Duration>> = Vec::new();
    let mut place = |(began, ended): (Duration, Duration)| {
        for (track, open) in tracks.iter_mut().enumerate() {
            while open.last().is_some_and(|&end| end <= began) {
                open.pop();
            }
            if open.last().is_none_or(|&end| ended <= end) {
                open.push(ended);
                return track;
            }
        }
        tracks.push(vec![ended]);
        tracks.len() - 1
    };
    slices.into_iter().map(&mut place).collect()
}

#[cfg(test)]
mod tests {
    use std::cmp::Reverse;
    use std::time::Duration;

    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::nested_tracks;

    proptest! {
        #[test]
        fn slices_of_a_track_nest_and_no_slice_is_further_down_than_necessary(
            mut slices in vec((0..30_u64, 0..12_u64), 0..20),
        ) {
            slices.sort_by_key(|&(began, length)| (began, Reverse(length)));
            let slices: Vec<_> = slices.into_iter().map(|(began, length)| (began, began + length)).collect();
            let at = Duration::from_nanos;
            let tracks = nested_tracks(slices.iter().map(|&(began, ended)| (at(began), at(ended))));
            prop_assert_eq!(tracks.len(), slices.len());
            let nest = |one: usize, other: usize| {
                let ((began, ended), (other_began, other_ended)) = (slices[one], slices[other]);
                ended <= other_began
                    || other_ended <= began
                    || (began <= other_began && other_ended <= ended)
                    || (other_began <= began && ended <= other_ended)
            };
            for one in 0..slices.len() {
                for other in (0..one).filter(|&other| tracks[other] == tracks[one]) {
                    prop_assert!(nest(one, other), "{:?} and {:?}", slices[one], slices[other]);
                }
                // On each track above there is a slice with which it does not nest.
                for track in 0..tracks[one] {
                    prop_assert!((0..one).any(|other| tracks[other] == track && !nest(one, other)));
                }
            }
        }
    }
}
