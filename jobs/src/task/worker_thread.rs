//! The threads that a scheduler starts.

use std::sync::mpsc;

use super::affinity::AffinityMask;
use super::current_worker;
use super::placement::Placement;
use super::queues::Queues;
use super::scheduler_error::SchedulerError;
use super::shared::Shared;
use super::worker::{ExitCondition, Worker};
use crate::sync::Arc;
use crate::unwind::{AbortOnUnwind, Contained, catch, emit};

/// A function of the engine's that runs on each thread, with the index of its worker.
pub(super) type Hook = Arc<Contained<Box<dyn Fn(usize) + Send + Sync>>>;

/// The thread of a worker, from start to end.
pub(super) struct WorkerThread {
    pub(super) index: usize,
    pub(super) affinity: Option<AffinityMask>,
    pub(super) on_start: Option<Hook>,
    pub(super) on_stop: Option<Hook>,
    /// Gets the outcome of the start.
    pub(super) ready: mpsc::Sender<Result<(), SchedulerError>>,
    pub(super) shared: Arc<Shared<Worker>>,
}

impl WorkerThread {
    /// Runs on the new thread until the scheduler is dropped.
    pub(super) fn run(self, queues: Box<Queues<Worker>>) {
        let outcome = self.prepare();
        let is_ready = outcome.is_ok();
        let Self { index, on_stop, ready, shared, .. } = self;
        // The builder waits for this only if there are hooks or affinities.
        let _ = ready.send(outcome);
        drop(ready);
        if !is_ready {
            return;
        }
        let worker = Worker::new(index, queues, shared);
        // If the worker were lost, every thread that waits for its jobs would wait for ever.
        let guard = AbortOnUnwind::new("a worker's thread");
        current_worker::enter(&worker, || worker.work(ExitCondition::Shutdown));
        guard.disarm();
        if let Some(on_stop) = on_stop
            && let Err(panic) = catch(|| on_stop(index))
        {
            emit(
                || tracing::error!(target: "drawloom", worker = index, message = %panic, "the hook at the end of a worker's thread"),
            );
        }
    }

    fn prepare(&self) -> Result<(), SchedulerError> {
        let worker = self.index;
        let before = Placement::current_affinity();
        if let Some(affinity) = &self.affinity {
            affinity.apply().map_err(|source| SchedulerError::Affinity {
                worker,
                affinity: affinity.clone(),
                source,
            })?;
        }
        if let Some(on_start) = &self.on_start {
            catch(|| on_start(worker)).map_err(|panic| SchedulerError::StartHook { worker, panic })?;
        }
        self.shared.placement().add_current_thread(before);
        Ok(())
    }
}
