//! What a frame would take without the work of one group.

use std::cmp::Reverse;
use std::collections::HashMap;
use std::time::Duration;

use super::run_spans::RunSpans;
use crate::report::simulation::Replay;

/// How long a frame would take if the nodes of one group had nothing to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WhatIf {
    /// The group.
    pub group: String,
    /// How long the frame would take.
    pub time: Duration,
    /// How much that saves of the frame's [replayed](super::FrameReport::replayed) time.
    pub saved: Duration,
}

/// How many groups are replayed, those with the most work first.
const MAX_GROUPS: usize = 32;

/// One for each group with much work, what saves the most first.
pub(super) fn what_if(runs: &[RunSpans<'_>], replay: &Replay, workers: usize, replayed: Duration) -> Vec<WhatIf> {
    let mut work = HashMap::<&str, Duration>::new();
    for RunSpans { run, .. } in runs {
        for (index, node) in run.graph.nodes.iter().enumerate() {
            *work.entry(node.group()).or_default() += run.chunks_of(index).iter().map(|chunk| chunk.duration()).sum();
        }
    }
    let mut groups: Vec<_> = work.into_iter().collect();
    groups.sort_by_key(|&(group, work)| (Reverse(work), group));
    groups.truncate(MAX_GROUPS);
    let mut all: Vec<_> = groups
        .into_iter()
        .map(|(group, _work)| {
            // Less work can take longer, because it changes the order of the rest (Graham, "Bounds on Multiprocessing
            // Timing Anomalies", 1969). That is chance, not a cost of the work that was left out.
            let time = replay.clone().without_work_of(group).frame_time(workers).min(replayed);
            WhatIf { group: group.to_owned(), time, saved: replayed - time }
        })
        .collect();
    all.sort_by_key(|what_if| Reverse(what_if.saved));
    all
}
