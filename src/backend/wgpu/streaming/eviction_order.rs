//! What makes room for what is streamed.

/// Something on the device that may make room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct EvictionCandidate {
    pub(super) slot: u32,
    /// The latest frame that drew it.
    pub(super) latest_use: u64,
    pub(super) priority: i32,
    /// Whether one of the latest frames drew it.
    pub(super) is_in_sight: bool,
}

/// What may make room, in the order in which it does: by last use.
pub(super) struct EvictionOrder {
    eviction_order: Vec<EvictionCandidate>,
    /// The lowest priority of those out of sight, and of those in sight.
    least_important: [Option<i32>; 2],
}

impl EvictionOrder {
    pub(super) fn new(eviction_order: impl Iterator<Item = EvictionCandidate>) -> Self {
        let mut eviction_order: Vec<_> = eviction_order.collect();
        // In sight last; then by last use, and of the same use by priority.
        eviction_order.sort_unstable_by_key(|candidate| {
            (candidate.is_in_sight, candidate.latest_use, candidate.priority, candidate.slot)
        });
        let least_important = [false, true].map(|is_in_sight| {
            let eviction_order = eviction_order.iter().filter(|candidate| candidate.is_in_sight == is_in_sight);
            eviction_order.map(|candidate| candidate.priority).min()
        });
        Self { eviction_order, least_important }
    }

    /// Those that may make room for what has this priority and slot, whether it is wanted or not. Some of them may have
    /// made room already.
    ///
    /// What is in sight evicts what is not, and of what is in sight only what has a lower priority. What is not evicts
    /// only what is not in sight either and has a lower priority. So nothing ever makes room for what it replaced
    /// before. The version of itself that it replaces comes last.
    pub(super) fn candidates(&self, (is_wanted, priority): (bool, i32), slot: u32) -> impl Iterator<Item = u32> {
        let is_lower = |lowest: Option<i32>| lowest.is_some_and(|lowest| lowest < priority);
        let [out_of_sight, in_sight] = self.least_important;
        let has_any = if is_wanted { out_of_sight.is_some() || is_lower(in_sight) } else { is_lower(out_of_sight) };
        let may_evict = move |candidate: &&EvictionCandidate| match (is_wanted, candidate.is_in_sight) {
            (true, false) => true,
            (true, true) | (false, false) => candidate.priority < priority,
            (false, true) => false,
        };
        let eviction_order: &[EvictionCandidate] = if has_any { &self.eviction_order } else { &[] };
        let others = eviction_order.iter().filter(move |candidate| candidate.slot != slot);
        others.filter(may_evict).map(|candidate| candidate.slot).chain([slot])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OWN: u32 = 99;

    fn candidate(slot: u32, latest_use: u64, priority: i32) -> EvictionCandidate {
        EvictionCandidate { slot, latest_use, priority, is_in_sight: latest_use > 100 }
    }

    fn candidates(eviction_order: &[EvictionCandidate], is_wanted: bool, priority: i32) -> Vec<u32> {
        let mut found: Vec<_> =
            EvictionOrder::new(eviction_order.iter().copied()).candidates((is_wanted, priority), OWN).collect();
        assert_eq!(found.pop(), Some(OWN), "the version before comes last");
        found
    }

    #[test]
    fn what_was_used_longest_ago_makes_room_first() {
        let eviction_order =
            [candidate(0, 7, 0), candidate(1, 3, 9), candidate(2, 5, 0), candidate(3, 101, -9), candidate(4, 3, 1)];
        assert_eq!(candidates(&eviction_order, true, 0), [4, 1, 2, 0, 3], "in sight, but less important");
        assert_eq!(candidates(&eviction_order, true, -9), [4, 1, 2, 0]);
        let others: Vec<_> = EvictionOrder::new(eviction_order.into_iter()).candidates((true, 0), 1).collect();
        assert_eq!(others, [4, 2, 0, 3, 1]);
    }

    #[test]
    fn what_is_out_of_sight_makes_room_only_for_what_is_more_important() {
        let eviction_order = [candidate(0, 1, 5), candidate(1, 2, 4), candidate(2, 101, 0)];
        assert_eq!(candidates(&eviction_order, false, 5), [1]);
        assert_eq!(candidates(&eviction_order, false, 4), [] as [u32; 0]);
        assert_eq!(candidates(&eviction_order, false, 6), [0, 1], "what is in sight stays");
        assert_eq!(candidates(&[candidate(2, 101, 0)], true, 0), [] as [u32; 0]);
    }
}
