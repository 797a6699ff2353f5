//! Where one thread sleeps until another wakes it.

use crate::sync::{Condvar, Mutex};

/// Parks one thread. A notification that comes before the thread parks is kept for it.
pub(super) struct Parker {
    is_notified: Mutex<bool>,
    notified: Condvar,
}

impl Parker {
    pub(super) fn new() -> Self {
        Self { is_notified: Mutex::new(false), notified: Condvar::new() }
    }

    /// Waits for a notification, and consumes it.
    pub(super) fn park(&self) {
        let mut is_notified = self.is_notified.lock();
        while !*is_notified {
            is_notified = self.notified.wait(is_notified);
        }
        *is_notified = false;
    }

    /// Notifies the thread that parks here.
    pub(super) fn unpark(&self) {
        *self.is_notified.lock() = true;
        self.notified.notify_one();
    }
}
