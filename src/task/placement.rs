//! Keeps workers off the processor of the thread that calls them, where the system does not see to that.
//!
//! A worker that is woken should run beside its waker, not in its place. Systems look for an idle processor then, but on
//! some virtual machines every idle processor passes for one that the host has taken away, so the worker is put on the
//! waker's own, and the two take turns for a whole frame. Whether a machine is like that shows when the price of a wake-up is
//! measured. If it is, the threads of the scheduler are kept off the processor that the caller is on, until a later call
//! comes from another one.

#[cfg(any(target_os = "linux", target_os = "android"))]
pub(super) use self::linux::Placement;
#[cfg(not(any(target_os = "linux", target_os = "android")))]
pub(super) use self::other::Placement;

#[cfg(any(target_os = "linux", target_os = "android"))]
mod linux {
    use std::io;

    use parking_lot::Mutex;
    use rustix::thread::{CpuSet, Pid, gettid, sched_getaffinity, sched_getcpu, sched_setaffinity};

    use crate::sync::{AtomicBool, AtomicUsize, Ordering};

    /// Where the threads of a scheduler may run.
    pub(in crate::task) struct Placement {
        threads: Mutex<Vec<Pid>>,
        is_needed: AtomicBool,
        /// The processor they are kept off.
        avoided: AtomicUsize,
    }

    const NONE: usize = usize::MAX;

    impl Placement {
        pub(in crate::task) fn new() -> Self {
            Self { threads: Mutex::new(Vec::new()), is_needed: AtomicBool::new(false), avoided: AtomicUsize::new(NONE) }
        }

        /// Takes note of the calling thread, which is one of the scheduler's.
        pub(in crate::task) fn add_this_thread(&self) {
            self.threads.lock().push(gettid());
        }

        /// The processor that the calling thread is on.
        pub(in crate::task) fn processor() -> Option<usize> {
            Some(sched_getcpu())
        }

        /// Has [`make_room`](Self::make_room) do its work from now on, if each thread can have a processor of its own.
        /// Says whether it can.
        pub(in crate::task) fn enable(&self) -> bool {
            let threads = self.threads.lock().len();
            let is_room = sched_getaffinity(None).is_ok_and(|allowed| threads < allowed.count() as usize);
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
                tracing::debug!(%error, "workers cannot be kept off the processor of their caller");
                self.is_needed.store(false, Ordering::Relaxed);
            }
        }

        #[cold]
        fn avoid(&self, processor: usize) -> io::Result<()> {
            let mut others = sched_getaffinity(None)?;
            others.unset(processor);
            if others.count() == 0 {
                // The caller may run here only, which says nothing about where the others may.
                others = every_processor_but(processor);
            }
            for &thread in self.threads.lock().iter() {
                sched_setaffinity(Some(thread), &others)?;
            }
            Ok(())
        }
    }

    /// The system takes those that there are.
    fn every_processor_but(processor: usize) -> CpuSet {
        let mut set = CpuSet::new();
        (0..CpuSet::MAX_CPU).filter(|&other| other != processor).for_each(|other| set.set(other));
        set
    }
}

#[cfg(not(any(target_os = "linux", target_os = "android")))]
mod other {
    /// Where the threads of a scheduler may run: wherever the system puts them.
    pub(in crate::task) struct Placement;

    impl Placement {
        pub(in crate::task) fn new() -> Self {
            Self
        }

        pub(in crate::task) fn add_this_thread(&self) {}

        pub(in crate::task) fn processor() -> Option<usize> {
            None
        }

        pub(in crate::task) fn enable(&self) -> bool {
            false
        }

        pub(in crate::task) fn make_room(&self) {}
    }
}
