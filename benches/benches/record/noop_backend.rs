//! A backend that does nothing and allocates nothing, which leaves the allocations of the renderer itself.

use std::ops::Range;

use drawloom::backend::{Backend, BackendError, FrameFence, FrameRequest, PassRequest, ViewQueue};
use drawloom::task::Worker;

/// Ignores all that it receives.
pub struct NoopBackend;

impl Backend for NoopBackend {
    type Frame = ();
    type Part = ();
    type Commands = ();
    type Submission = ();

    fn adapter_name(&self) -> String {
        "no-op backend".to_owned()
    }

    fn begin(&self, _request: &FrameRequest<'_>) -> Result<(), BackendError> {
        Ok(())
    }

    fn upload_objects(
        &self,
        _worker: &Worker,
        _frame: &(),
        _request: &FrameRequest<'_>,
        _blocks: Range<usize>,
    ) -> Result<(), BackendError> {
        Ok(())
    }

    fn prepare(&self, _worker: &Worker, _frame: &(), _pass: &PassRequest<'_>) -> Result<(), BackendError> {
        Ok(())
    }

    fn part_count(&self, _frame: &(), _pass: &PassRequest<'_>) -> usize {
        0
    }

    fn record(
        &self,
        _worker: &Worker,
        _frame: &(),
        _pass: &PassRequest<'_>,
        _parts: Range<usize>,
        _put: &mut dyn FnMut(()),
    ) -> Result<(), BackendError> {
        Ok(())
    }

    fn finish(
        &self,
        _worker: &Worker,
        _frame: &(),
        _pass: &PassRequest<'_>,
        _parts: &mut Vec<()>,
    ) -> Result<(), BackendError> {
        Ok(())
    }

    fn submit(&self, _frame: (), _queues: Vec<ViewQueue<()>>, fences: Vec<FrameFence>) -> Result<(), BackendError> {
        fences.into_iter().for_each(|fence| fence.setter.set());
        Ok(())
    }
}
