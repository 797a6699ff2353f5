//! Why a frame cannot be reported on.

use thiserror::Error;

/// A frame cannot be reported on.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReportError {
    /// The log has no run of that frame.
    #[error("the log has no run of frame {frame}")]
    NoRun {
        /// The frame's number.
        frame: u64,
    },
    /// Chunks of one of its runs are missing: a worker had no room for them, or the log was taken during the run.
    #[error(
        "the log does not have all of frame {frame}: the timeline's capacity was too small, or the log was taken during the frame"
    )]
    Incomplete {
        /// The frame's number.
        frame: u64,
    },
    /// One of its runs is inconsistent: a node waits for a later one, a chunk belongs to a node or a worker that does
    /// not exist, or chunks have more items than a `usize` can count. No timeline records that.
    #[error("what the log says of frame {frame} contradicts itself")]
    Contradictory {
        /// The frame's number.
        frame: u64,
    },
    /// A node of one of its runs failed, so that the rest was cancelled.
    #[error("a node of frame {frame} failed, so the frame did not run to its end")]
    Failed {
        /// The frame's number.
        frame: u64,
    },
}
