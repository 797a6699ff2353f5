//! What an engine changes of a renderer that it has: the backend, the pipeline, processes, outputs and the quality; and
//! what the backend does between frames.

use std::sync::Arc;

use super::plan_cache::PlanSources;
use super::{BuildError, FrameError, Renderer, Submitter};
use crate::backend::{Backend, CallPanic, GuardedBackend};
use crate::process::{Contained, DeviceSupport, Pipeline, PlanError, RenderProcess};
use crate::quality::Quality;
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

    /// Puts a backend in the place of the one before, and drops what belongs to that one.
    fn set_backend(&mut self, backend: GuardedBackend<B>) {
        self.plans.set_device(DeviceSupport::new(backend.can_blend_floats()));
        self.backend = backend;
        self.capacity.forget_backend();
        self.recordings.clear();
        self.backend_maintenance = BackendMaintenance::default();
        self.view_cache.forget_frames_in_flight();
    }

    /// Replaces the pipeline from the next frame on. Device pipelines of the latest frame that both have in common are
    /// kept; those that were only prepared are not.
    ///
    /// # Errors
    /// If the processes make no frame, or one of them panics; then nothing changes.
    pub fn set_pipeline(&mut self, pipeline: impl Pipeline + 'static) -> Result<(), BuildError> {
        let pipeline: Contained<Arc<dyn Pipeline>> = Contained::new(Arc::new(pipeline));
        self.change_plans(|sources| {
            sources.pipeline = Some(pipeline);
            Ok(())
        })?;
        self.pipeline_has_quality = false;
        Ok(())
    }

    /// Adds a process from the next frame on, behind those that were added before. What the other processes have in the
    /// latest frame stays: histories, lists, device pipelines; pipelines that were only prepared do not. Frames that are
    /// recorded already are drawn as they were recorded.
    ///
    /// ```
    /// # use drawloom::process::{Deferred, Declare, Draws, FullScreen, InjectionPoint, RenderProcess};
    /// # use drawloom::{Renderer, backend::NullBackend, task::Scheduler};
    /// # struct Fog;
    /// # impl RenderProcess for Fog {
    /// #     fn name(&self) -> &str {
    /// #         "fog"
    /// #     }
    /// #     fn declare(&self, declare: &mut Declare) {
    /// #         declare.draws_over("radiance");
    /// #         declare.at(InjectionPoint::AfterLighting);
    /// #     }
    /// #     fn draws(&self) -> Draws<'_> {
    /// #         Draws::FullScreen(FullScreen::default())
    /// #     }
    /// # }
    /// # let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture());
    /// # let (mut renderer, _) = builder.build(std::sync::Arc::new(Scheduler::new(1)?))?;
    /// renderer.add_process(Fog)?;
    /// renderer.set_process_enabled("fog", false)?;
    /// renderer.remove_process("fog")?;
    /// assert!(renderer.remove_process("fog").is_err());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// If the processes make no frame, as of [`build`](super::RendererBuilder::build); then nothing changes.
    pub fn add_process(&mut self, process: impl RenderProcess + 'static) -> Result<(), BuildError> {
        let process = Arc::new(Contained::new(process));
        self.change_plans(|sources| sources.add_process(process))
    }

    /// Removes the processes of this name that the engine added, from the next frame on.
    ///
    /// # Errors
    /// If there is none, or the others make no frame; then nothing changes.
    pub fn remove_process(&mut self, name: &str) -> Result<(), BuildError> {
        self.change_plans(|sources| sources.remove_process(name))
    }

    /// Switches the processes of this name that the engine added off, or on again, from the next frame on. Without
    /// those that are off, frames are as if they had been removed.
    ///
    /// # Errors
    /// If there is none, or the processes that are on make no frame; then nothing changes.
    pub fn set_process_enabled(&mut self, name: &str, is_enabled: bool) -> Result<(), BuildError> {
        if self.plans.sources().are_enabled(name, is_enabled) {
            return Ok(());
        }
        self.change_plans(|sources| sources.set_process_enabled(name, is_enabled))
    }

    /// Adds an output of the frame, unless it is there, from the next frame on.
    ///
    /// # Errors
    /// If no process writes it; then nothing changes.
    pub fn add_output(&mut self, target: impl AsRef<str>) -> Result<(), BuildError> {
        if self.plans.sources().has_output(target.as_ref()) {
            return Ok(());
        }
        let target = target.as_ref().to_owned();
        self.change_plans(|sources| {
            sources.add_output(target);
            Ok(())
        })
    }

    /// Removes an output that the engine named, from the next frame on.
    ///
    /// # Errors
    /// If it has named none of this name, or no process leads to the others; then nothing changes.
    pub fn remove_output(&mut self, target: impl AsRef<str>) -> Result<(), BuildError> {
        self.change_plans(|sources| sources.remove_output(target.as_ref()))
    }

    /// # Errors
    /// If the change fails, or the processes make no frame afterwards; then nothing changes.
    fn change_plans(
        &mut self,
        change: impl FnOnce(&mut PlanSources) -> Result<(), PlanError>,
    ) -> Result<(), BuildError> {
        self.plans = self.plans.changed(change)?;
        self.graphs.outdate();
        self.view_cache.invalidate();
        Ok(())
    }

    /// Sets the quality from the next frame on, of the pipeline too.
    ///
    /// # Errors
    /// If the quality is invalid, the processes make no frame with it, or the pipeline panics, as by a step of
    /// post-processing; then nothing changes.
    pub fn set_quality(&mut self, quality: Quality) -> Result<(), BuildError> {
        quality.check()?;
        if quality == self.quality && self.pipeline_has_quality {
            return Ok(());
        }
        if let Some(plans) = self.plans.with_quality(&quality)? {
            self.plans = plans;
            self.graphs.outdate();
        }
        (self.quality, self.pipeline_has_quality) = (quality, true);
        self.tables.invalidate();
        self.view_cache.invalidate();
        Ok(())
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
