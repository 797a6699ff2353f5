//! A queue behind a lock, and a count with which workers skip the lock if the queue is empty.
//!
//! The count is a hint, so it is relaxed. The fences of [`Sleep`](super::sleep::Sleep) make sure that a worker which
//! goes to sleep finds an item that was pushed here. The lock orders the items themselves.

use std::collections::VecDeque;

use crate::sync::{AtomicUsize, Mutex, Ordering};

/// Items, the oldest first. Its memory grows and is kept.
pub(super) struct LockedQueue<T> {
    count: AtomicUsize,
    items: Mutex<VecDeque<T>>,
}

impl<T> LockedQueue<T> {
    pub(super) fn new() -> Self {
        Self { count: AtomicUsize::new(0), items: Mutex::new(VecDeque::new()) }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.count.load(Ordering::Relaxed) == 0
    }

    pub(super) fn len(&self) -> usize {
        self.count.load(Ordering::Relaxed)
    }

    pub(super) fn push(&self, item: T) {
        self.update(|items| items.push_back(item));
    }

    /// Changes the queue under the lock, and updates the count.
    pub(super) fn update<R>(&self, change: impl FnOnce(&mut VecDeque<T>) -> R) -> R {
        let mut items = self.items.lock();
        let result = change(&mut items);
        self.count.store(items.len(), Ordering::Relaxed);
        result
    }
}
