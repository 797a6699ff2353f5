//! The queue of a view.

use crate::process::Pass;

/// The queue of one view: its finished passes in order, ready to submit (M 10.3).
#[derive(Debug)]
pub struct ViewQueue<T> {
    /// The view's index.
    pub view: usize,
    /// The passes, each with its commands.
    pub passes: Vec<(Pass, T)>,
}
