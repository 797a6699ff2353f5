//! One process in one view.

/// One process in one view: recorded as a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Pass {
    /// The process's index in [`FramePlan::processes`](super::FramePlan::processes).
    pub process_index: usize,
    /// The view's index among the frame's views.
    pub view_index: usize,
}
