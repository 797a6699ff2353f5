//! What a backend does between frames.

use super::FrameError;
use crate::backend::{Backend, CallPanic, GuardedBackend};
use crate::task::{BackgroundJob, Scheduler};

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
