//! Keeps worker threads off the processor of the thread that calls them, if the system does not.
//!
//! A worker that is woken should run beside the thread that wakes it, not on the same processor. Systems look for an
//! idle processor then. But on some virtual machines every idle processor looks as if the host had taken it away, so
//! the system puts the worker on the waker's own processor, and the two take turns for a whole frame. The measurement
//! of the wake-up cost finds out whether a machine does that. If it does, the threads of the scheduler are kept off the
//! processor that the caller runs on, until a later call comes from another processor.

// Miri has no processors to choose from.
#[cfg(all(feature = "affinity", any(target_os = "linux", target_os = "android"), not(miri)))]
pub(super) use self::linux::Placement;
#[cfg(not(all(feature = "affinity", any(target_os = "linux", target_os = "android"), not(miri))))]
pub(super) use self::other::Placement;

#[cfg(all(feature = "affinity", any(target_os = "linux", target_os = "android"), not(miri)))]
mod linux {
    use std::io;

    use parking_lot::Mutex;
    use rustix::thread::{CpuSet, Pid, gettid, sched_getaffinity, sched_getcpu, sched_setaffinity};

    use crate::sync::{AtomicBool, AtomicUsize, Ordering};
    use crate::unwind::emit;

    /// The processors that the threads of a scheduler may run on.
    pub(in crate::task) struct Placement {
        /// The threads, each with the processors that it was allowed at first.
        threads: Mutex<Vec<(Pid, CpuSet)>>,
        is_enabled: AtomicBool,
        /// The processor that the threads are kept off.
        avoided: AtomicUsize,
    }

    const NONE: usize = usize::MAX;

    impl Placement {
        pub(in crate::task) fn new() -> Self {
            Self {
                threads: Mutex::new(Vec::new()),
                is_enabled: AtomicBool::new(false),
                avoided: AtomicUsize::new(NONE),
            }
        }

        /// The processors that the calling thread may run on.
        pub(in crate::task) fn current_affinity() -> Option<CpuSet> {
            sched_getaffinity(None).ok()
        }

        /// Registers the calling thread, one of the scheduler's, unless the engine has changed its affinity since
        /// `before` was read.
        pub(in crate::task) fn add_current_thread(&self, before: Option<CpuSet>) {
            if let Some(allowed) = before
                && Self::current_affinity() == before
            {
                self.threads.lock().push((gettid(), allowed));
            }
        }

        /// The processor that the calling thread runs on.
        pub(in crate::task) fn current_processor() -> Option<usize> {
            Some(sched_getcpu())
        }

        /// Enables [`avoid_current_processor`](Self::avoid_current_processor), if each thread can have a processor of
        /// its own. Returns whether it can.
        pub(in crate::task) fn enable(&self) -> bool {
            let threads = self.threads.lock();
            let is_room = threads.iter().all(|(_, allowed)| threads.len() < allowed.count() as usize);
            // Relaxed, here and below: the flag and the number only affect speed, and hand no data over.
            self.is_enabled.store(is_room, Ordering::Relaxed);
            is_room
        }

        /// Keeps the scheduler's threads off the processor that the calling thread runs on.
        #[inline]
        pub(in crate::task) fn avoid_current_processor(&self) {
            if !self.is_enabled.load(Ordering::Relaxed) {
                return;
            }
            let here = sched_getcpu();
            if self.avoided.swap(here, Ordering::Relaxed) != here
                && let Err(error) = self.avoid(here)
            {
                // The processors of the machine have changed. From now on the system places the workers, which only
                // costs time.
                self.is_enabled.store(false, Ordering::Relaxed);
                self.restore();
                emit(
                    || tracing::debug!(target: "drawloom", %error, "workers cannot be kept off the processor of their caller"),
                );
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

        fn restore(&self) {
            let restore = |(thread, allowed): &(_, CpuSet)| sched_setaffinity(Some(*thread), allowed).err();
            let errors: Vec<_> = self.threads.lock().iter().filter_map(restore).collect();
            for error in errors {
                emit(|| tracing::debug!(target: "drawloom", %error, "the affinity of a worker cannot be restored"));
            }
        }
    }

    #[cfg(all(test, not(drawloom_model_check)))]
    mod tests {
        use std::sync::Arc;
        use std::sync::atomic::{AtomicUsize, Ordering};

        use tracing_subscriber::layer::{Context, Layer, SubscriberExt};

        use super::{CpuSet, NONE, Pid, Placement};

        /// Counts the events at which the list of threads is locked, and those at which it is not.
        struct Hears {
            placement: Arc<Placement>,
            counts: [Arc<AtomicUsize>; 2],
        }

        impl<S: tracing::Subscriber> Layer<S> for Hears {
            fn on_event(&self, _: &tracing::Event<'_>, _: Context<'_, S>) {
                let is_unlocked = self.placement.threads.try_lock().is_some();
                self.counts[usize::from(is_unlocked)].fetch_add(1, Ordering::Relaxed);
            }
        }

        #[test]
        fn what_cannot_be_placed_is_told_without_a_lock() {
            let placement = Arc::new(Placement::new());
            // Linux numbers no thread like this.
            let missing = Pid::from_raw(i32::MAX).unwrap();
            placement.threads.lock().extend([(missing, CpuSet::new()); 2]);
            placement.is_enabled.store(true, Ordering::Relaxed);
            let counts = <[Arc<AtomicUsize>; 2]>::default();
            let hears = Hears { placement: Arc::clone(&placement), counts: counts.clone() };
            tracing::subscriber::with_default(tracing_subscriber::registry().with(hears), || {
                placement.avoid_current_processor();
                // It is disabled then, on whichever processor the next call is.
                placement.avoided.store(NONE, Ordering::Relaxed);
                placement.avoid_current_processor();
            });
            // One for each thread, and one for all.
            assert_eq!(counts.map(|count| count.load(Ordering::Relaxed)), [0, 3]);
        }
    }
}

#[cfg(not(all(feature = "affinity", any(target_os = "linux", target_os = "android"), not(miri))))]
mod other {
    /// Leaves it to the system where the threads of a scheduler run.
    pub(in crate::task) struct Placement;

    impl Placement {
        pub(in crate::task) fn new() -> Self {
            Self
        }

        pub(in crate::task) fn current_affinity() -> Option<()> {
            None
        }

        pub(in crate::task) fn add_current_thread(&self, _before: Option<()>) {}

        pub(in crate::task) fn current_processor() -> Option<usize> {
            None
        }

        pub(in crate::task) fn enable(&self) -> bool {
            false
        }

        pub(in crate::task) fn avoid_current_processor(&self) {}
    }
}
