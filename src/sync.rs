//! The primitives that threads meet in, behind one switch.
//!
//! Everything in the crate that blocks, counts or hands work over takes its atomics, locks, threads and deques from
//! here. Built as usual, these are the standard library's, parking_lot's and crossbeam-deque's. Built with
//! `--cfg drawloom_loom` they are those of loom, a model checker, so that the tests beside the code walk through the
//! interleavings of their threads. Both sides have one shape: a lock returns its guard and cannot be poisoned, and a
//! wait takes the guard and gives it back.

#[cfg(drawloom_loom)]
pub(crate) use self::modelled::{Condvar, Deque, Mutex, Stealer};
#[cfg(not(drawloom_loom))]
pub(crate) use self::native::{Condvar, Deque, Mutex, Stealer};

pub(crate) use crossbeam_deque::Steal;

#[cfg(drawloom_loom)]
pub(crate) use loom::{
    hint::spin_loop,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering, fence},
    },
    thread, thread_local,
};
#[cfg(not(drawloom_loom))]
pub(crate) use std::{
    hint::spin_loop,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering, fence},
    },
    thread, thread_local,
};

#[cfg(not(drawloom_loom))]
mod native {
    use parking_lot::MutexGuard;

    pub(crate) use crossbeam_deque::{Stealer, Worker as Deque};
    pub(crate) use parking_lot::Mutex;

    /// A condition variable whose wait takes the guard and gives it back.
    #[derive(Default)]
    pub(crate) struct Condvar(parking_lot::Condvar);

    impl Condvar {
        pub(crate) fn new() -> Self {
            Self::default()
        }

        pub(crate) fn wait<'lock, T>(&self, mut guard: MutexGuard<'lock, T>) -> MutexGuard<'lock, T> {
            self.0.wait(&mut guard);
            guard
        }

        pub(crate) fn notify_one(&self) {
            self.0.notify_one();
        }
    }
}

#[cfg(drawloom_loom)]
mod modelled {
    use std::{collections::VecDeque, sync::PoisonError};

    use crossbeam_deque::Steal;
    use loom::sync::{Arc, MutexGuard};

    /// Loom's mutex, without poisoning.
    pub(crate) struct Mutex<T>(loom::sync::Mutex<T>);

    impl<T> Mutex<T> {
        pub(crate) fn new(value: T) -> Self {
            Self(loom::sync::Mutex::new(value))
        }

        pub(crate) fn lock(&self) -> MutexGuard<'_, T> {
            self.0.lock().unwrap_or_else(PoisonError::into_inner)
        }
    }

    /// Loom's condition variable, without poisoning.
    pub(crate) struct Condvar(loom::sync::Condvar);

    impl Condvar {
        pub(crate) fn new() -> Self {
            Self(loom::sync::Condvar::new())
        }

        pub(crate) fn wait<'lock, T>(&self, guard: MutexGuard<'lock, T>) -> MutexGuard<'lock, T> {
            self.0.wait(guard).unwrap_or_else(PoisonError::into_inner)
        }

        pub(crate) fn notify_one(&self) {
            self.0.notify_one();
        }
    }

    /// A locked stand-in for crossbeam's deque, which has no form that loom can look into.
    pub(crate) struct Deque<T>(Arc<Mutex<VecDeque<T>>>);

    impl<T> Deque<T> {
        pub(crate) fn new_lifo() -> Self {
            Self(Arc::new(Mutex::new(VecDeque::new())))
        }

        pub(crate) fn stealer(&self) -> Stealer<T> {
            Stealer(Arc::clone(&self.0))
        }

        pub(crate) fn len(&self) -> usize {
            self.0.lock().len()
        }

        pub(crate) fn push(&self, value: T) {
            self.0.lock().push_back(value);
        }

        pub(crate) fn pop(&self) -> Option<T> {
            self.0.lock().pop_back()
        }
    }

    /// The side of the stand-in that thieves hold.
    pub(crate) struct Stealer<T>(Arc<Mutex<VecDeque<T>>>);

    impl<T> Stealer<T> {
        pub(crate) fn steal(&self) -> Steal<T> {
            match self.0.lock().pop_front() {
                Some(value) => Steal::Success(value),
                None => Steal::Empty,
            }
        }

        pub(crate) fn is_empty(&self) -> bool {
            self.0.lock().is_empty()
        }
    }
}
