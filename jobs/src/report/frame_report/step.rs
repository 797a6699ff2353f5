//! A step of the critical path.

use std::time::Duration;

/// A step of the critical path: a worker span of a run, or what a thread did outside of all runs.
///
/// A worker span is the time in which a worker runs chunks of one node, and of no other node of the run in between. It
/// can begin when the last of its node's dependencies and the worker's previous span have ended. Whichever of these
/// ended last is what it was [held up by](Self::held_by), and is the step before it. The first step of a run begins
/// with the run, so there is no gap between one step and the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The name of the node or of the thread's span.
    pub name: String,
    /// The group it is counted in: see [`NodeInfo::group`](crate::timeline::NodeInfo::group).
    pub group: String,
    /// The index of the run in the log, and of the node in its graph. `None` for what a thread did outside of all runs,
    /// and for the end of a run after its last node.
    pub node: Option<(usize, usize)>,
    /// The worker whose span it is. `None` if there is no node, or if no chunk of the node is in the log.
    pub worker: Option<usize>,
    /// What it waited for last.
    pub held_by: HeldBy,
    /// When it could have begun: when the step before it ended.
    pub ready: Duration,
    /// When it began. From `ready` until then it waited for a worker, which had to be woken or was looking for work.
    pub started: Duration,
    /// When it ended.
    pub ended: Duration,
}

/// What a step of the critical path waited for last: the kind of the step before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeldBy {
    /// Nothing but the start of its run, or it is no node.
    Start,
    /// A dependency of its node.
    Dependency,
    /// Its worker, which was busy with another node until then.
    Worker,
}

impl Step {
    /// How long it took, including its wait for a worker.
    pub fn duration(&self) -> Duration {
        self.ended.saturating_sub(self.ready)
    }

    /// How long it waited for a worker.
    pub fn waited(&self) -> Duration {
        self.started.saturating_sub(self.ready)
    }
}
