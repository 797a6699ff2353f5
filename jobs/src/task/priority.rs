//! How urgent a job is.

/// The priority of a job. There is a queue for each; a worker takes urgent jobs first, from its own queues and from
/// those of others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Priority {
    /// On the critical path of the frame.
    Urgent,
    /// Any other job of a frame.
    Normal,
    /// Jobs that no frame waits for. Worker 0 runs them only on request.
    Background,
}

impl Priority {
    pub(super) const ALL: [Self; 3] = [Self::Urgent, Self::Normal, Self::Background];
    /// The priorities of a frame's jobs.
    pub(crate) const FRAME: [Self; 2] = [Self::Urgent, Self::Normal];
}
