//! A backend with lower limits than its device has.

use std::ops::Range;

use drawloom::backend::{Backend, BackendError, FrameFence, FrameRequest, PassRequest, SceneLimits, ViewQueue};
use drawloom::command::DrawState;
use drawloom::process::{Draws, FramePlan};
use drawloom::quality::{Quality, VertexFormat};
use drawloom::scene::Mesh;
use drawloom::task::Worker;

use crate::forwarded_calls::forward_unchanged_calls;

/// Passes calls on to another backend, as if that one had lower limits: what takes gigabytes on a device needs
/// kilobytes here.
pub struct LimitedBackend<B> {
    inner: B,
    limits: SceneLimits,
}

impl<B> LimitedBackend<B> {
    /// The backend with these limits. A mesh fits if its vertices, at their full size, fit in a buffer, and so do its
    /// indices.
    pub fn new(inner: B, limits: SceneLimits) -> Self {
        Self { inner, limits }
    }

    /// The backend that does the work.
    pub fn inner(&self) -> &B {
        &self.inner
    }
}

impl<B: Backend> Backend for LimitedBackend<B> {
    type Frame = B::Frame;
    type Part = B::Part;
    type Commands = B::Commands;
    type Submission = B::Submission;

    forward_unchanged_calls!();

    fn limits(&self) -> SceneLimits {
        self.limits
    }

    fn check_mesh(&self, mesh: &Mesh, vertices: VertexFormat) -> Result<(), BackendError> {
        let allowed = self.limits.buffer_bytes;
        let of_levels: usize = mesh.levels().iter().map(|level| level.indices().len()).sum();
        let indices = (mesh.indices().len() + of_levels) * size_of::<u32>();
        let needed = size_of_val(mesh.vertices()).max(indices) as u64;
        if needed > allowed {
            return Err(BackendError::Limit { limit: "max_limited", allowed, needed });
        }
        self.inner.check_mesh(mesh, vertices)
    }

    fn adapter_name(&self) -> String {
        self.inner.adapter_name()
    }

    fn prepare_pipelines(
        &self,
        plan: &FramePlan,
        draws: &[Draws<'_>],
        states: &[Vec<DrawState>],
        quality: &Quality,
    ) -> Result<(), BackendError> {
        self.inner.prepare_pipelines(plan, draws, states, quality)
    }

    fn begin(&self, request: &FrameRequest<'_>) -> Result<B::Frame, BackendError> {
        self.inner.begin(request)
    }

    fn upload_objects(
        &self,
        worker: &Worker,
        frame: &B::Frame,
        request: &FrameRequest<'_>,
        blocks: Range<usize>,
    ) -> Result<(), BackendError> {
        self.inner.upload_objects(worker, frame, request, blocks)
    }

    fn prepare(&self, worker: &Worker, frame: &B::Frame, pass: &PassRequest<'_>) -> Result<(), BackendError> {
        self.inner.prepare(worker, frame, pass)
    }

    fn record(
        &self,
        worker: &Worker,
        frame: &B::Frame,
        pass: &PassRequest<'_>,
        parts: Range<usize>,
        emit: &mut dyn FnMut(B::Part),
    ) -> Result<(), BackendError> {
        self.inner.record(worker, frame, pass, parts, emit)
    }

    fn finish(
        &self,
        worker: &Worker,
        frame: &B::Frame,
        pass: &PassRequest<'_>,
        parts: &mut Vec<B::Part>,
    ) -> Result<B::Commands, BackendError> {
        self.inner.finish(worker, frame, pass, parts)
    }

    fn continues_previous_pass(&self, frame: &B::Frame, pass: usize) -> bool {
        self.inner.continues_previous_pass(frame, pass)
    }

    fn finish_together(
        &self,
        worker: &Worker,
        frame: &B::Frame,
        passes: &[PassRequest<'_>],
        parts: &mut [Vec<B::Part>],
        emit: &mut dyn FnMut(B::Commands),
    ) -> Result<(), BackendError> {
        self.inner.finish_together(worker, frame, passes, parts, emit)
    }

    fn submit(
        &self,
        frame: B::Frame,
        queues: Vec<ViewQueue<B::Commands>>,
        fences: Vec<FrameFence>,
    ) -> Result<B::Submission, BackendError> {
        self.inner.submit(frame, queues, fences)
    }
}
