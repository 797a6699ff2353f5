//! What keeps a frame from being reported on.

use thiserror::Error;

/// A frame cannot be reported on.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ReportError {
    /// There is no run of that frame in the log.
    #[error("the log has no run of frame {frame}")]
    NoRun {
        /// The frame's number.
        frame: u64,
    },
    /// Not all chunks of one of its runs are there: a worker had no room for them, or the log was taken amid the run.
    #[error(
        "the log does not have all of frame {frame}: the timeline's capacity was too small, or the log was taken amid the frame"
    )]
    Incomplete {
        /// The frame's number.
        frame: u64,
    },
    /// What the log says of one of its runs cannot be: a process waits for a later one, or a chunk is of a process or a worker
    /// that is not there. No timeline records that.
    #[error("what the log says of frame {frame} contradicts itself")]
    Contradictory {
        /// The frame's number.
        frame: u64,
    },
    /// A process of one of its runs failed, so that the rest was cancelled.
    #[error("a process of frame {frame} failed, so the frame did not run to its end")]
    Failed {
        /// The frame's number.
        frame: u64,
    },
}
