//! From recorded passes to the queues of views.

use super::FrameError;
use super::pass_recording::PassRecording;
use crate::backend::{Backend, BackendError, FrameRequest, ViewQueue};
use crate::process::Pass;
use crate::unwind::discard;

/// The queues of a frame, by view index.
pub(super) struct ViewQueues<T>(Vec<ViewQueue<T>>);

impl<T> ViewQueues<T> {
    pub(super) fn as_slice(&self) -> &[ViewQueue<T>] {
        &self.0
    }

    /// The queues that are submitted one after the other: each view's whole queue, or several for a view whose passes
    /// alternate with those of other views.
    pub(super) fn in_submission_order(mut self, order: &[Pass]) -> Vec<ViewQueue<T>> {
        let passes_by_view = order.chunk_by(|one, next| one.view_index == next.view_index);
        let take = |passes: &[Pass]| {
            let view = passes[0].view_index;
            // A whole queue is moved, not copied: nothing is left to split off.
            let later = self.0[view].passes.split_off(passes.len());
            ViewQueue { view, passes: std::mem::replace(&mut self.0[view].passes, later) }
        };
        passes_by_view.map(take).collect()
    }
}

/// Commands are the backend's: their destructors may panic.
impl<T> Drop for ViewQueues<T> {
    fn drop(&mut self) {
        self.0.iter_mut().flat_map(|queue| queue.passes.drain(..)).for_each(discard);
    }
}

/// One queue for each view, its passes in the order of the plan.
///
/// # Errors
/// If a pass is not finished. This is a bug in Drawloom.
pub(super) fn view_queues<B: Backend>(
    request: &FrameRequest<'_>,
    recordings: &mut [PassRecording<B>],
) -> Result<ViewQueues<B::Commands>, FrameError> {
    // A process has at most one pass in a view.
    let empty = |view| ViewQueue { view, passes: Vec::with_capacity(request.plan.processes().len()) };
    let mut queues = ViewQueues((0..request.views.len()).map(empty).collect());
    for (&pass, recording) in request.passes.iter().zip(recordings) {
        let missing = || BackendError::BrokenRule { rule: "every pass is finished before its frame is".to_owned() };
        queues.0[pass.view_index].passes.push((pass, recording.take().ok_or_else(missing)?));
    }
    Ok(queues)
}
