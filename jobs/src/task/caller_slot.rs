//! The slot of worker 0, which one thread from outside can take at a time.

use super::queues::Queues;
use super::region::JobContext;
use crate::sync::{Condvar, Mutex};

/// Makes the thread that calls a scheduler its worker 0 for the length of the call.
pub(super) struct CallerSlot<W: JobContext> {
    /// The queues of worker 0 while no thread is worker 0.
    queues: Mutex<Option<Box<Queues<W>>>>,
    freed: Condvar,
}

impl<W: JobContext> CallerSlot<W> {
    pub(super) fn new(queues: Box<Queues<W>>) -> Self {
        Self { queues: Mutex::new(Some(queues)), freed: Condvar::new() }
    }

    /// Waits until the slot is free, and takes it.
    pub(super) fn take(&self) -> Box<Queues<W>> {
        let mut slot = self.queues.lock();
        loop {
            if let Some(queues) = slot.take() {
                return queues;
            }
            slot = self.freed.wait(slot);
        }
    }

    /// Takes the slot if it is free.
    pub(super) fn try_take(&self) -> Option<Box<Queues<W>>> {
        self.queues.lock().take()
    }

    /// Whether no thread from outside is worker 0.
    pub(super) fn is_free(&self) -> bool {
        self.queues.lock().is_some()
    }

    /// Frees the slot, and wakes one thread that waits for it.
    pub(super) fn release(&self, queues: Box<Queues<W>>) {
        *self.queues.lock() = Some(queues);
        self.freed.notify_one();
    }
}
