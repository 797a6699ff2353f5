//! What `drawloom` uses, and nobody else should: it is not part of the interface, and may change in any release.

pub use crate::chunked_array::{ChunkedArray, block_ranges};
pub use crate::fence::waits::{current_thread, list_wait};
pub use crate::timeline::stopwatch::Stopwatch;
pub use crate::tuning::{
    CostSample, Estimate, Filter, Hysteresis, MAX_JOB, MIN_JOB, PARALLEL_THRESHOLD, Tuner, job_size,
};
pub use crate::unwind::{CaughtSpan, Contained, discard, discard_all, emit, emit_unlocked, hold_events};
