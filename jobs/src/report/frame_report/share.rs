//! How much of the critical path each group takes.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::time::Duration;

use super::step::Step;

/// How much of the critical path a group takes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathShare {
    /// The group.
    pub group: String,
    /// How long its steps ran, from each one's start to its end.
    pub ran: Duration,
    /// How long they waited for a worker before that.
    pub waited: Duration,
}

impl PathShare {
    /// How long its steps took, including their waits for a worker.
    pub fn duration(&self) -> Duration {
        self.ran + self.waited
    }
}

/// The share of each group, the longest first.
pub(super) fn shares(path: &[Step]) -> Vec<PathShare> {
    let mut by_group = BTreeMap::<&str, (Duration, Duration)>::new();
    for step in path {
        let (ran, waited) = by_group.entry(&step.group).or_default();
        *ran += step.ended.saturating_sub(step.started);
        *waited += step.waited();
    }
    let share = |(group, (ran, waited)): (&str, _)| PathShare { group: group.to_owned(), ran, waited };
    let mut shares: Vec<_> = by_group.into_iter().map(share).collect();
    shares.sort_by_key(|share| Reverse(share.duration()));
    shares
}
