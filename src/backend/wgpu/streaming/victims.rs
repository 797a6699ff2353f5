//! What makes room for what is streamed.

/// Something on the device that may make room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Victim {
    pub(super) slot: u32,
    /// The latest frame that drew it.
    pub(super) latest_use: u64,
    pub(super) priority: i32,
    /// Whether one of the latest frames drew it.
    pub(super) is_in_sight: bool,
}

/// What may make room, in the order in which it does: by last use.
pub(super) struct Victims {
    victims: Vec<Victim>,
    /// The lowest priority of those out of sight, and of those in sight.
    least_important: [Option<i32>; 2],
}

impl Victims {
    pub(super) fn new(victims: impl Iterator<Item = Victim>) -> Self {
        let mut victims: Vec<_> = victims.collect();
        // In sight last; then by last use, and of the same use by priority.
        victims.sort_unstable_by_key(|victim| (victim.is_in_sight, victim.latest_use, victim.priority, victim.slot));
        let least_important = [false, true].map(|is_in_sight| {
            let victims = victims.iter().filter(|victim| victim.is_in_sight == is_in_sight);
            victims.map(|victim| victim.priority).min()
        });
        Self { victims, least_important }
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
        let may_evict = move |victim: &&Victim| match (is_wanted, victim.is_in_sight) {
            (true, false) => true,
            (true, true) | (false, false) => victim.priority < priority,
            (false, true) => false,
        };
        let victims: &[Victim] = if has_any { &self.victims } else { &[] };
        let others = victims.iter().filter(move |victim| victim.slot != slot);
        others.filter(may_evict).map(|victim| victim.slot).chain([slot])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OWN: u32 = 99;

    fn victim(slot: u32, latest_use: u64, priority: i32) -> Victim {
        Victim { slot, latest_use, priority, is_in_sight: latest_use > 100 }
    }

    fn candidates(victims: &[Victim], is_wanted: bool, priority: i32) -> Vec<u32> {
        let mut found: Vec<_> = Victims::new(victims.iter().copied()).candidates((is_wanted, priority), OWN).collect();
        assert_eq!(found.pop(), Some(OWN), "the version before comes last");
        found
    }

    #[test]
    fn what_was_used_longest_ago_makes_room_first() {
        let victims = [victim(0, 7, 0), victim(1, 3, 9), victim(2, 5, 0), victim(3, 101, -9), victim(4, 3, 1)];
        assert_eq!(candidates(&victims, true, 0), [4, 1, 2, 0, 3], "in sight, but less important");
        assert_eq!(candidates(&victims, true, -9), [4, 1, 2, 0]);
        let others: Vec<_> = Victims::new(victims.into_iter()).candidates((true, 0), 1).collect();
        assert_eq!(others, [4, 2, 0, 3, 1]);
    }

    #[test]
    fn what_is_out_of_sight_makes_room_only_for_what_is_more_important() {
        let victims = [victim(0, 1, 5), victim(1, 2, 4), victim(2, 101, 0)];
        assert_eq!(candidates(&victims, false, 5), [1]);
        assert_eq!(candidates(&victims, false, 4), [] as [u32; 0]);
        assert_eq!(candidates(&victims, false, 6), [0, 1], "what is in sight stays");
        assert_eq!(candidates(&[victim(2, 101, 0)], true, 0), [] as [u32; 0]);
    }
}
