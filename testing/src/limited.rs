//! A backend with lower limits than its device has.

use drawloom::backend::{Backend, BackendError, FrameFence, SceneLimits, ViewQueue};
use drawloom::quality::VertexFormat;
use drawloom::scene::Mesh;

use crate::forwarded_calls::{forward_recording_calls, forward_unchanged_calls};

/// Passes calls on to another backend, as if that one had lower limits: what takes gigabytes on a device needs
/// kilobytes here.
pub struct LimitedBackend<B> {
    inner: B,
    limits: SceneLimits,
    lacks_float_blending: bool,
}

impl<B> LimitedBackend<B> {
    /// The backend with these limits. A mesh fits if its vertices, at their full size, fit in a buffer, and so do its
    /// indices.
    pub fn new(inner: B, limits: SceneLimits) -> Self {
        Self { inner, limits, lacks_float_blending: false }
    }

    /// The same, as if it could not blend floats.
    pub fn without_float_blending(self) -> Self {
        Self { lacks_float_blending: true, ..self }
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
    forward_recording_calls!();

    fn can_blend_floats(&self) -> bool {
        !self.lacks_float_blending && self.inner.can_blend_floats()
    }

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

    fn submit(
        &self,
        frame: B::Frame,
        queues: Vec<ViewQueue<B::Commands>>,
        fences: Vec<FrameFence>,
    ) -> Result<B::Submission, BackendError> {
        self.inner.submit(frame, queues, fences)
    }
}
