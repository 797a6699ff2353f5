//! A queue behind a lock, and a count that spares those who find it empty the lock.
//!
//! The count is a hint, so it is relaxed. That a sleeping worker learns of what is put here is up to the fences of
//! [`Sleep`](super::sleep::Sleep), and the lock orders the items themselves.

use std::collections::VecDeque;

use crate::sync::{AtomicUsize, Mutex, Ordering};

/// Items, the oldest first. Its memory grows and stays.
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

    pub(super) fn put(&self, item: T) {
        self.change(|items| items.push_back(item));
    }

    pub(super) fn change<R>(&self, change: impl FnOnce(&mut VecDeque<T>) -> R) -> R {
        let mut items = self.items.lock();
        let result = change(&mut items);
        self.count.store(items.len(), Ordering::Relaxed);
        result
    }
}
