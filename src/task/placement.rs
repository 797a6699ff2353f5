//! Keeps workers off the processor of the thread that calls them, where the system does not see to that.
//!
//! A worker that is woken should run beside its waker, not in its place. Systems look for an idle processor then, but on
//! some virtual machines every idle processor passes for one that the host has taken away, so the worker is put on the
//! waker's own, and the two take turns for a whole frame. Whether a machine is like that shows when the price of a wake-up is
//! measured. If it is, the threads of the scheduler are kept off the processor that the caller is on, until a later call
//! comes from another one.

// Miri has no processors to choose from.
#[cfg(all(any(target_os = "linux", target_os = "android"), not(miri)))]
pub(super) use self::linux::Placement;
#[cfg(not(all(any(target_os = "linux", target_os = "android"), not(miri))))]
pub(super) use self::other::Placement;

#[cfg(all(any(target_os = "linux", target_os = "android"), not(miri)))]
mod linux {
    use std::io;

    use parking_lot::Mutex;
    use rustix::thread::{CpuSet, Pid, gettid, sched_getaffinity, sched_getcpu, sched_setaffinity};

    use crate::{
        sync::{AtomicBool, AtomicUsize, Ordering},
        unwind::emit,
    };

    /// Where the threads of a scheduler may run.
    pub(in crate::task) struct Placement {
        /// Each with where it may run by itself.
        threads: Mutex<Vec<(Pid, CpuSet)>>,
        is_needed: AtomicBool,
        /// The processor they are kept off.
        avoided: AtomicUsize,
    }

    const NONE: usize = usize::MAX;

    impl Placement {
        pub(in crate::task) fn new() -> Self {
            Self { threads: Mutex::new(Vec::new()), is_needed: AtomicBool::new(false), avoided: AtomicUsize::new(NONE) }
        }

        /// Where the calling thread may run.
        pub(in crate::task) fn of_this_thread() -> Option<CpuSet> {
            sched_getaffinity(None).ok()
        }

        /// Takes note of the calling thread, which is one of the scheduler's, unless somebody has placed it since it was
        /// to run there.
        pub(in crate::task) fn add_this_thread(&self, at_first: Option<CpuSet>) {
            if let Some(allowed) = at_first
                && Self::of_this_thread() == at_first
            {
                self.threads.lock().push((gettid(), allowed));
            }
        }

        /// The processor that the calling thread is on.
        pub(in crate::task) fn processor() -> Option<usize> {
            Some(sched_getcpu())
        }

        /// Has [`make_room`](Self::make_room) do its work from now on, if each thread can have a processor of its own.
        /// Says whether it can.
        pub(in crate::task) fn enable(&self) -> bool {
            let threads = self.threads.lock();
            let is_room = threads.iter().all(|(_, allowed)| threads.len() < allowed.count() as usize);
            // Relaxed, here and below: the flag and the number decide how fast something is, and hand nothing over.
            self.is_needed.store(is_room, Ordering::Relaxed);
            is_room
        }

        /// Keeps the scheduler's threads off the processor that the calling thread is on.
        #[inline]
        pub(in crate::task) fn make_room(&self) {
            if !self.is_needed.load(Ordering::Relaxed) {
                return;
            }
            let here = sched_getcpu();
            if self.avoided.swap(here, Ordering::Relaxed) != here
                && let Err(error) = self.avoid(here)
            {
                // The machine has changed. It costs time, and nothing else.
                self.is_needed.store(false, Ordering::Relaxed);
                self.let_run_anywhere();
                emit(|| tracing::debug!(%error, "workers cannot be kept off the processor of their caller"));
            }
        }

        #[cold]
        fn avoid(&self, processor: usize) -> io::Result<()> {
            for (thread, allowed) in self.threads.lock().iter() {
                let mut others = *allowed;
                if processor < CpuSet::MAX_CPU {
                    others.unset(processor);
                }
                sched_setaffinity(Some(*thread), &others)?;
            }
            Ok(())
        }

        fn let_run_anywhere(&self) {
            for (thread, allowed) in self.threads.lock().iter() {
                if let Err(error) = sched_setaffinity(Some(*thread), allowed) {
                    emit(|| tracing::debug!(%error, "a worker cannot be let go from its processors"));
                }
            }
        }
    }
}

#[cfg(not(all(any(target_os = "linux", target_os = "android"), not(miri))))]
mod other {
    /// Where the threads of a scheduler may run: wherever the system puts them.
    pub(in crate::task) struct Placement;

    impl Placement {
        pub(in crate::task) fn new() -> Self {
            Self
        }

        pub(in crate::task) fn of_this_thread() {}

        pub(in crate::task) fn add_this_thread(&self, _at_first: ()) {}

        pub(in crate::task) fn processor() -> Option<usize> {
            None
        }

        pub(in crate::task) fn enable(&self) -> bool {
            false
        }

        pub(in crate::task) fn make_room(&self) {}
    }
}
