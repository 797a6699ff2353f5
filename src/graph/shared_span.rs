//! The span of a node whose chunks several workers run.

use std::mem;

use crate::sync::Mutex;
use crate::unwind::CaughtSpan;

/// What the worker that opens a node hands to those that join it. Only used if the run is instrumented.
pub(super) struct SharedSpan(Mutex<Opened>);

/// When a node was opened, and its tracing span.
#[derive(Clone)]
pub(super) struct Opened {
    /// A timestamp of the timeline's clock.
    pub(super) at: u64,
    pub(super) span: CaughtSpan,
}

impl SharedSpan {
    pub(super) fn new() -> Self {
        Self(Mutex::new(Opened { at: 0, span: CaughtSpan::none() }))
    }

    pub(super) fn set(&self, opened: Opened) {
        let before = mem::replace(&mut *self.0.lock(), opened);
        // Not while it is locked, as this may call the subscriber.
        drop(before);
    }

    pub(super) fn get(&self) -> Opened {
        self.0.lock().clone()
    }

    /// Takes the tracing span out. It closes when it is dropped, if all workers have left it.
    pub(super) fn take(&self) -> CaughtSpan {
        mem::replace(&mut self.0.lock().span, CaughtSpan::none())
    }
}
