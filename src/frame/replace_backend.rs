//! The renderer's backend: another device in the place of one that is lost, and work in the background.

use std::sync::Arc;

use super::{FrameError, Renderer, Submitter};
use crate::backend::{Backend, CallPanic, GuardedBackend};
use crate::task::{BackgroundJob, Scheduler};

impl<B: Backend> Renderer<B> {
    /// Puts another backend in the place of this one, from the next frame on: one on a new device, after the device was
    /// lost. The renderer never does that by itself. The next frame uploads everything that it draws from the scene's
    /// assets again, makes targets and pipelines, and is the same to the byte as it would have been on the device
    /// before, unless a process reads what only that one had. Plans, measured costs, and what is derived from the scene
    /// on the CPU stay.
    ///
    /// The thread that calls this becomes the device thread: the returned submitter cannot leave it. An engine that
    /// records on another thread hands the renderer to the device thread for this call, as when it was built. Frames
    /// that were recorded for the backend before are refused by the new submitter, as
    /// [`SubmitError::ForeignFrame`](super::SubmitError::ForeignFrame); the submitter before still takes them, and
    /// refuses those that follow. The backend before is dropped with its submitter and frames.
    ///
    /// These are the engine's to do:
    ///
    /// - What it set on the backend before, it sets on the new one: the recording and encoding strategy, the timing of
    ///   passes, transient targets, and imports for the next frame.
    /// - [Meshes in its own buffers](crate::scene::Mesh::from_buffers) and other resources of its own belong to the
    ///   device before. It makes their buffers anew and replaces the assets. Otherwise objects with these meshes are
    ///   left out, and [named](crate::view::IssueReason::UndrawableMesh), if the new device is of the same
    ///   `wgpu::Instance`; wgpu cannot tell resources of several instances apart.
    /// - A window's [surface](crate::backend::WindowSurface) belongs to a device too. It is dropped before another one
    ///   is made.
    /// - [Histories](crate::process::Declare::samples_previous) are empty, and buffers that processes share are zero,
    ///   as in the first frame.
    /// - Pipelines are made in the next frame, unless the engine calls [`prepare_pipelines`](Self::prepare_pipelines)
    ///   before it. One that it prepares in the background for the backend before goes on, and its result is of no use.
    ///
    /// ```
    /// use drawloom::backend::{Backend, BackendError};
    /// use drawloom::scene::SceneRef;
    /// use drawloom::{FrameError, Renderer, SubmitError, SubmittedFrame, Submitter};
    ///
    /// /// Draws a frame, on a new device if this one is lost. `open` makes a backend on a new device, as when the engine started.
    /// fn draw<B: Backend>(
    ///     renderer: &mut Renderer<B>,
    ///     submitter: &mut Submitter<B>,
    ///     world: SceneRef<'_>,
    ///     open: impl Fn() -> Result<B, BackendError>,
    /// ) -> Result<SubmittedFrame<B>, Box<dyn std::error::Error>> {
    ///     let is_loss = |error: Option<&BackendError>| matches!(error, Some(BackendError::DeviceLost { .. }));
    ///     match renderer.record(world) {
    ///         Ok(frame) => match submitter.submit(frame) {
    ///             Err(error) if is_loss(error.backend_error()) => {}
    ///             submitted => return Ok(submitted?),
    ///         },
    ///         Err(error) if is_loss(error.backend_error()) => {}
    ///         Err(error) => return Err(error.into()),
    ///     }
    ///     *submitter = renderer.replace_backend(open()?);
    ///     Ok(submitter.submit(renderer.record(world)?)?)
    /// }
    /// ```
    pub fn replace_backend(&mut self, backend: B) -> Submitter<B> {
        let backend = GuardedBackend::new(Arc::new(backend));
        self.set_backend(backend.clone());
        Submitter::new(backend, Arc::clone(self.scheduler().timeline()))
    }
}

/// What a backend does between frames: one job at a time.
#[derive(Default)]
pub(super) struct BackendMaintenance {
    /// The latest job, if there was any.
    job: Option<BackgroundJob<Result<(), CallPanic>>>,
}

impl BackendMaintenance {
    /// Starts a job if there is something to do and the last one has ended.
    ///
    /// # Errors
    /// If the backend panics, in the last job too.
    pub(super) fn start<B: Backend>(
        &mut self,
        backend: &GuardedBackend<B>,
        scheduler: &Scheduler,
    ) -> Result<(), FrameError> {
        if let Some(ended) = self.job.take_if(|job| job.is_finished()) {
            ended.wait()??;
        }
        if !backend.has_background_work()? || self.job.is_some() {
            return Ok(());
        }
        if scheduler.workers() == 1 {
            return Ok(backend.work_in_background()?);
        }
        let backend = backend.clone();
        self.job = Some(scheduler.background(move || backend.work_in_background()));
        Ok(())
    }
}
