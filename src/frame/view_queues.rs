//! From recorded passes to the queues of views.

use super::FrameError;
use super::pass_recording::PassRecording;
use crate::backend::{Backend, BackendError, FrameRequest, ViewQueue};

/// One queue for each view, its passes in the order of the plan.
///
/// # Errors
/// If a pass is not finished. This is a bug in Drawloom.
pub(super) fn view_queues<B: Backend>(
    request: &FrameRequest<'_>,
    recordings: &mut [PassRecording<B>],
) -> Result<Vec<ViewQueue<B::Commands>>, FrameError> {
    // A process has at most one pass in a view.
    let empty = |view| ViewQueue { view, passes: Vec::with_capacity(request.plan.processes().len()) };
    let mut queues: Vec<_> = (0..request.views.len()).map(empty).collect();
    for (&pass, recording) in request.passes.iter().zip(recordings) {
        let missing = || BackendError::BrokenRule { rule: "every pass is finished before its frame is".to_owned() };
        queues[pass.view_index].passes.push((pass, recording.take().ok_or_else(missing)?));
    }
    Ok(queues)
}
