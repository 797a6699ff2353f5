//! What recording a frame took.

use std::time::Duration;

use crate::graph::RunMeasure;

/// What [recording](super::Renderer::record_measured) a frame took: its jobs one by one, and what the calling thread did
/// before and after them.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FrameMeasure {
    /// Every job.
    pub jobs: RunMeasure,
    /// From the call to the first job.
    pub before: Duration,
    /// From the last job to the return.
    pub after: Duration,
}

impl FrameMeasure {
    /// What the calling thread did by itself, before and after the jobs.
    pub fn serial(&self) -> Duration {
        self.before + self.after
    }
}
