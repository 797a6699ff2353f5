//! A backend with lower limits than its device has.

use drawloom::backend::{Backend, BackendError, BackendExtras, BackendLayer, SceneLimits};
use drawloom::quality::VertexFormat;
use drawloom::scene::Mesh;

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
}

impl<B: Backend> BackendLayer for LimitedBackend<B> {
    type Inner = B;

    fn inner(&self) -> &B {
        &self.inner
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

    fn extras(&self) -> &dyn BackendExtras {
        self
    }
}

impl<B: Backend> BackendExtras for LimitedBackend<B> {
    fn inner_extras(&self) -> Option<&dyn BackendExtras> {
        Some(self.inner.extras())
    }

    fn can_blend_floats(&self) -> bool {
        !self.lacks_float_blending && self.inner.extras().can_blend_floats()
    }
}
