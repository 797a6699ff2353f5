//! A backend whose panics are errors.

use std::sync::Arc;

use super::{Backend, BackendError, FrameFence, FrameRequest, ReadBack, SceneLimits, TargetMemory, ViewQueue};
use crate::command::DrawState;
use crate::process::{Draws, FramePlan};
use crate::quality::{Quality, VertexFormat};
use crate::scene::Mesh;
use crate::task::{JobPanic, catch};
use crate::timeline::{Labels, TuningChoice};
use crate::unwind::Contained;

/// A call of a backend's method panicked.
#[derive(Debug)]
pub(crate) struct CallPanic {
    /// The name of the method.
    pub(crate) call: &'static str,
    pub(crate) message: String,
}

impl CallPanic {
    /// For calls whose other errors are the backend's.
    pub(crate) fn into_backend_error(self) -> BackendError {
        BackendError::Panicked { call: self.call, message: self.message }
    }
}

/// The backend of a renderer, for calls outside of the frame's jobs: there no run catches the panics of the engine's
/// code. Outside of jobs the rest of the crate calls it in no other way.
///
/// The methods are those of [`Backend`] and its extras, and one of
/// [`FrameRecorder`](super::FrameRecorder). Those that can fail already return the panic as a [`BackendError`] where
/// the caller cannot tell it from other errors, and as a [`CallPanic`] elsewhere.
pub(crate) struct GuardedBackend<B> {
    // Whoever drops the last reference may be a thread of a frame loop.
    backend: Contained<Arc<B>>,
}

impl<B> Clone for GuardedBackend<B> {
    fn clone(&self) -> Self {
        Self::new(Arc::clone(&self.backend))
    }
}

impl<B> GuardedBackend<B> {
    pub(crate) fn new(backend: Arc<B>) -> Self {
        Self { backend: Contained::new(backend) }
    }

    /// The backend itself, for the engine, and for calls in jobs of the frame: their run catches panics, and its error
    /// names the node.
    pub(crate) fn unguarded(&self) -> &Arc<B> {
        &self.backend
    }

    /// Whether both are the same backend.
    pub(crate) fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.backend, &other.backend)
    }

    /// Calls a method of the backend.
    ///
    /// # Errors
    /// If it panics.
    fn call<R>(&self, call: &'static str, method: impl FnOnce(&B) -> R) -> Result<R, CallPanic> {
        catch(|| method(&self.backend)).map_err(|JobPanic { message, .. }| CallPanic { call, message })
    }
}

impl<B: Backend> GuardedBackend<B> {
    pub(crate) fn uploaded_bytes(&self) -> Result<u64, CallPanic> {
        self.call("uploaded_bytes", |backend| backend.extras().uploaded_bytes())
    }

    /// A backend that panics instead of an answer blends none: what is then summed in half floats is what it can draw.
    pub(crate) fn can_blend_floats(&self) -> bool {
        self.call("can_blend_floats", |backend| backend.extras().can_blend_floats()).unwrap_or(false)
    }

    pub(crate) fn prepare_pipelines(
        &self,
        plan: &FramePlan,
        draws: &[Draws<'_>],
        states: &[Vec<DrawState>],
        quality: &Quality,
    ) -> Result<Result<(), BackendError>, CallPanic> {
        self.call("prepare_pipelines", |backend| backend.prepare_pipelines(plan, draws, states, quality))
    }

    pub(crate) fn has_background_work(&self) -> Result<bool, CallPanic> {
        self.call("has_background_work", |backend| backend.extras().has_background_work())
    }

    pub(crate) fn work_in_background(&self) -> Result<(), CallPanic> {
        self.call("work_in_background", |backend| backend.extras().work_in_background())
    }

    pub(crate) fn counters(&self, count: &mut dyn FnMut(&'static str, f64)) -> Result<(), CallPanic> {
        self.call("counters", |backend| backend.extras().counters(count))
    }

    pub(crate) fn limits(&self) -> Result<SceneLimits, CallPanic> {
        self.call("limits", B::limits)
    }

    pub(crate) fn check_mesh(
        &self,
        mesh: &Mesh,
        vertices: VertexFormat,
    ) -> Result<Result<(), BackendError>, CallPanic> {
        self.call("check_mesh", |backend| backend.check_mesh(mesh, vertices))
    }

    pub(crate) fn begin(
        &self,
        request: &FrameRequest<'_>,
    ) -> Result<Result<Contained<B::Frame>, BackendError>, CallPanic> {
        self.call("begin", |backend| backend.begin(request).map(Contained::new))
    }

    pub(crate) fn discard_frame(&self) -> Result<(), CallPanic> {
        self.call("discard_frame", |backend| backend.extras().discard_frame())
    }

    pub(crate) fn forget_histories(&self) -> Result<(), CallPanic> {
        self.call("forget_histories", |backend| backend.extras().forget_histories())
    }

    pub(crate) fn imports_targets_of(&self, view: &str) -> Result<bool, CallPanic> {
        self.call("imports_targets_of", |backend| backend.extras().imports_targets_of(view))
    }

    pub(crate) fn target_memory(&self, frame: &B::Frame) -> Result<TargetMemory, CallPanic> {
        self.call("target_memory", |backend| backend.target_memory(frame))
    }

    pub(crate) fn shares_encoder(&self, frame: &B::Frame, pass: usize) -> Result<bool, CallPanic> {
        self.call("shares_encoder", |backend| backend.shares_encoder(frame, pass))
    }

    pub(crate) fn recording_choice(
        &self,
        frame: &B::Frame,
        pass: usize,
        labels: &Arc<Labels>,
    ) -> Result<Option<TuningChoice>, CallPanic> {
        self.call("recording_choice", |backend| backend.recording_choice(frame, pass, labels))
    }

    pub(crate) fn read_back(
        &self,
        frame: &mut B::Frame,
        view: usize,
        target: &str,
    ) -> Result<Box<dyn ReadBack>, BackendError> {
        let begun = self.call("read_back", |backend| backend.read_back(frame, view, target));
        begun.map_err(CallPanic::into_backend_error)?
    }

    pub(crate) fn submit(
        &self,
        frame: B::Frame,
        queues: Vec<ViewQueue<B::Commands>>,
        fences: Vec<FrameFence>,
    ) -> Result<Result<B::Submission, BackendError>, CallPanic> {
        self.call("submit", |backend| backend.submit(frame, queues, fences))
    }
}
