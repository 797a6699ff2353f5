//! What a fence and its setter share.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex};

use super::device_progress::DeviceProgress;
use crate::unwind::{Contained, catch, emit};

/// How a fence ended.
#[derive(Clone, Debug)]
pub(super) enum Outcome {
    Set(Instant),
    Abandoned,
    /// The device says why.
    Failed(Arc<str>),
}

type Callback = Box<dyn FnOnce(Outcome) + Send>;

/// What a fence and its setter share.
pub(super) struct FenceState {
    name: String,
    current: Mutex<Current>,
    /// Notified when the fence has an outcome, and when it has a device.
    changed: Condvar,
    /// The device that sets the fence, once the frame is submitted.
    progress: OnceLock<Contained<Arc<dyn DeviceProgress>>>,
}

#[derive(Default)]
struct Current {
    outcome: Option<Outcome>,
    callbacks: Vec<Callback>,
}

impl FenceState {
    pub(super) fn new(name: String) -> Self {
        Self { name, current: Mutex::default(), changed: Condvar::new(), progress: OnceLock::new() }
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn outcome(&self) -> Option<Outcome> {
        self.current.lock().outcome.clone()
    }

    pub(super) fn progress(&self) -> Option<&dyn DeviceProgress> {
        self.progress.get().map(|progress| &***progress)
    }

    /// Ends the fence, unless it has ended, and calls back.
    pub(super) fn finish(&self, outcome: Outcome) {
        let callbacks = {
            let mut current = self.current.lock();
            if current.outcome.is_some() {
                return;
            }
            current.outcome = Some(outcome.clone());
            std::mem::take(&mut current.callbacks)
        };
        self.changed.notify_all();
        for callback in callbacks {
            self.call(callback, outcome.clone());
        }
    }

    pub(super) fn set_progress(&self, progress: Arc<dyn DeviceProgress>) {
        if self.progress.set(Contained::new(progress)).is_ok() {
            // Taken so that no one who has found no device is between that and waiting.
            drop(self.current.lock());
            self.changed.notify_all();
        }
    }

    /// Waits until the fence ends, or has a device and did not have one when the caller looked; at most as long as
    /// `limit`.
    pub(super) fn wait(&self, limit: Duration, had_device: bool) -> Option<Outcome> {
        let mut current = self.current.lock();
        let goes_on = |current: &mut Current| current.outcome.is_none() && self.progress.get().is_some() == had_device;
        self.changed.wait_while_for(&mut current, goes_on, limit);
        current.outcome.clone()
    }

    /// Calls back when the fence ends; now, if it has ended.
    pub(super) fn call_back(&self, callback: Callback) {
        let ended = {
            let mut current = self.current.lock();
            match current.outcome.clone() {
                Some(outcome) => Some((callback, outcome)),
                None => {
                    current.callbacks.push(callback);
                    None
                }
            }
        };
        if let Some((callback, outcome)) = ended {
            self.call(callback, outcome);
        }
    }

    fn call(&self, callback: Callback, outcome: Outcome) {
        if let Err(panic) = catch(|| callback(outcome)) {
            let message = panic.message;
            emit(
                || tracing::error!(target: "drawloom", fence = self.name, message, "the callback of a fence panicked"),
            );
        }
    }
}
