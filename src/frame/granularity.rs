//! How finely a frame is cut into jobs.

use crate::queue::DrawList;

/// The job size of visibility, fill and record (M 10.5, "Better Load Balancing"). It decides who does what when, never what
/// is drawn: bundles are cut at fixed places whatever it is, so every granularity gives the same picture to the byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Granularity {
    /// A job a view: M's first design.
    PerCamera,
    /// A job a draw: M's "more advanced solution". When recording, a job a bundle, which is the smallest part there is.
    PerDraw,
    /// A job for this many objects or draws; when recording, for as many whole bundles as hold them. Not 0.
    Chunk(usize),
}

impl Granularity {
    /// Objects or commands in a job.
    pub(super) fn items(self) -> usize {
        match self {
            Self::PerCamera => usize::MAX,
            Self::PerDraw => 1,
            Self::Chunk(items) => items,
        }
    }

    /// Bundles in a job.
    pub(super) fn bundles(self) -> usize {
        self.items().div_ceil(DrawList::BATCHES_PER_BUNDLE)
    }
}

impl Default for Granularity {
    fn default() -> Self {
        Self::Chunk(512)
    }
}
