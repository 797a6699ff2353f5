//! What has been computed for a view.

use std::time::Duration;

/// The results computed for a view, and the one that a frame shows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AsyncPostStatistics {
    /// The step's name.
    pub step: String,
    /// The view's name.
    pub view: String,
    /// The number of the frame, counted from 1 by [`AsyncPost::begin_frame`](crate::AsyncPost::begin_frame).
    pub frame: u64,
    /// The number of the frame whose result this one shows; `None` if there is no result for it: in the first frames,
    /// in those after the view has another size, and until a first result succeeds.
    pub result: Option<u64>,
    /// How many sources have been computed for the view so far.
    pub computed: u64,
    /// How many sources were skipped, because a newer one came before the step had time for them.
    pub skipped: u64,
    /// How long the latest result took, from the arrival of its pixels until it was uploaded.
    pub latest_took: Duration,
}

impl AsyncPostStatistics {
    /// How many frames old the result is that the frame shows: 1 if it is of the frame before.
    pub fn age(&self) -> Option<u64> {
        self.result.map(|result| self.frame.saturating_sub(result))
    }
}
