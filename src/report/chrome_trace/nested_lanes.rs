//! Lanes on which things that overlap are laid out side by side.

use std::time::Duration;

/// On which lane each is, counted from 0: the first on which it either lies inside of another or overlaps none.
///
/// They are told by when they began and ended, and come by when they began, the longer of two that began at once first.
pub(super) fn nested_lanes(times: impl IntoIterator<Item = (Duration, Duration)>) -> Vec<usize> {
    // Per lane, when what is open there ends, the inmost last.
    let mut lanes: Vec<Vec<Duration>> = Vec::new();
    let mut put = |(began, ended): (Duration, Duration)| {
        for (lane, open) in lanes.iter_mut().enumerate() {
            while open.last().is_some_and(|&end| end <= began) {
                open.pop();
            }
            if open.last().is_none_or(|&end| ended <= end) {
                open.push(ended);
                return lane;
            }
        }
        lanes.push(vec![ended]);
        lanes.len() - 1
    };
    times.into_iter().map(&mut put).collect()
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use std::{cmp::Reverse, time::Duration};

    use proptest::{collection::vec, prelude::*};

    use super::nested_lanes;

    proptest! {
        #[test]
        fn those_of_a_lane_nest_and_there_are_no_more_lanes_than_it_takes(
            mut times in vec((0..30_u64, 0..12_u64), 0..20),
        ) {
            times.sort_by_key(|&(began, length)| (began, Reverse(length)));
            let times: Vec<_> = times.into_iter().map(|(began, length)| (began, began + length)).collect();
            let at = Duration::from_nanos;
            let lanes = nested_lanes(times.iter().map(|&(began, ended)| (at(began), at(ended))));
            prop_assert_eq!(lanes.len(), times.len());
            let nest = |one: usize, other: usize| {
                let ((began, ended), (other_began, other_ended)) = (times[one], times[other]);
                ended <= other_began
                    || other_ended <= began
                    || (began <= other_began && other_ended <= ended)
                    || (other_began <= began && ended <= other_ended)
            };
            for one in 0..times.len() {
                for other in (0..one).filter(|&other| lanes[other] == lanes[one]) {
                    prop_assert!(nest(one, other), "{:?} and {:?}", times[one], times[other]);
                }
                // It stands on a lane further down only because of somebody on each one above.
                for lane in 0..lanes[one] {
                    prop_assert!((0..one).any(|other| lanes[other] == lane && !nest(one, other)));
                }
            }
        }
    }
}
