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

    pub(super) fn take_oldest(&self) -> Option<T> {
        self.change_unless_empty(VecDeque::pop_front)
    }

    /// Takes what `take` takes, unless there is nothing.
    pub(super) fn change_unless_empty(&self, take: impl FnOnce(&mut VecDeque<T>) -> Option<T>) -> Option<T> {
        if self.is_empty() { None } else { self.change(take) }
    }

    pub(super) fn change<R>(&self, change: impl FnOnce(&mut VecDeque<T>) -> R) -> R {
        let mut items = self.items.lock();
        let result = change(&mut items);
        self.count.store(items.len(), Ordering::Relaxed);
        result
    }

    /// Whether there is an item of that kind.
    pub(super) fn has(&self, is_wanted: impl FnMut(&T) -> bool) -> bool {
        !self.is_empty() && self.items.lock().iter().any(is_wanted)
    }
}
