//! The synchronisation primitives, in whose place a model checker puts its own.
//!
//! The modules `task`, `graph` and `timeline` take their atomics, locks, threads and deques from here. By default these
//! are the standard library's, parking_lot's and crossbeam-deque's. With `--cfg drawloom_loom` they are those of loom,
//! a model checker that explores all interleavings of a few threads, and all values that each memory ordering allows.
//! With `--cfg drawloom_shuttle` they are those of shuttle, which tries random interleavings in one total order, and so
//! can check whole runs. With either comes `--cfg drawloom_model_check`. The tests for both are beside the code that
//! they check.
//!
//! All variants have the same interface: a lock returns its guard and cannot be poisoned, and a wait takes the guard
//! and returns it.

#[cfg(all(any(drawloom_loom, drawloom_shuttle), not(drawloom_model_check)))]
compile_error!("a model checker also needs --cfg drawloom_model_check");

#[cfg(drawloom_loom)]
use loom as primitives;
#[cfg(drawloom_shuttle)]
use shuttle as primitives;
#[cfg(not(drawloom_model_check))]
use std as primitives;

#[cfg(drawloom_model_check)]
pub(crate) use self::modelled::{Condvar, Deque, Mutex, Stealer};
#[cfg(not(drawloom_model_check))]
pub(crate) use self::native::{Condvar, Deque, Mutex, Stealer};

#[cfg(drawloom_shuttle)]
pub(crate) use self::randomised::Instant;
#[cfg(all(test, drawloom_shuttle))]
pub(crate) use self::randomised::check;
#[cfg(not(drawloom_shuttle))]
pub(crate) use std::time::Instant;

pub(crate) use crossbeam_deque::Steal;

pub(crate) use self::primitives::{
    hint::spin_loop,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU32, AtomicU64, AtomicUsize, Ordering, fence},
    },
    thread, thread_local,
};

#[cfg(not(drawloom_model_check))]
mod native {
    use parking_lot::MutexGuard;

    pub(crate) use crossbeam_deque::{Stealer, Worker as Deque};
    pub(crate) use parking_lot::Mutex;

    /// A condition variable whose wait takes the guard and returns it.
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

#[cfg(drawloom_model_check)]
mod modelled {
    use std::collections::VecDeque;
    use std::sync::PoisonError;

    use crossbeam_deque::Steal;

    use super::primitives::sync::{self, Arc, MutexGuard};

    /// The checker's mutex, without poisoning.
    pub(crate) struct Mutex<T>(sync::Mutex<T>);

    impl<T> Mutex<T> {
        pub(crate) fn new(value: T) -> Self {
            Self(sync::Mutex::new(value))
        }

        pub(crate) fn lock(&self) -> MutexGuard<'_, T> {
            self.0.lock().unwrap_or_else(PoisonError::into_inner)
        }
    }

    /// The checker's condition variable, without poisoning.
    pub(crate) struct Condvar(sync::Condvar);

    impl Condvar {
        pub(crate) fn new() -> Self {
            Self(sync::Condvar::new())
        }

        pub(crate) fn wait<'lock, T>(&self, guard: MutexGuard<'lock, T>) -> MutexGuard<'lock, T> {
            self.0.wait(guard).unwrap_or_else(PoisonError::into_inner)
        }

        pub(crate) fn notify_one(&self) {
            self.0.notify_one();
        }
    }

    /// Replaces crossbeam's deque, which no checker supports, by a queue behind a lock.
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

    /// The end of the deque that other threads steal from.
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

        pub(crate) fn len(&self) -> usize {
            self.0.lock().len()
        }
    }
}

/// A random clock and random interleavings.
#[cfg(drawloom_shuttle)]
mod randomised {
    use std::ops::Add;
    use std::time::Duration;

    use shuttle::rand::{Rng, thread_rng};

    /// A random point in time, so that decisions that depend on the clock go either way, and the same way when an
    /// interleaving is repeated. A later reading may be smaller, which counts as no time between the two.
    #[derive(Clone, Copy, Debug)]
    pub(crate) struct Instant(Duration);

    /// The upper bounds of a reading in nanoseconds. Most readings use the first, so that most work seems short and
    /// some long.
    const MAX_USUAL: u64 = 1_000;
    const MAX_RARE: u64 = 20_000;

    impl Instant {
        pub(crate) fn now() -> Self {
            let mut random = thread_rng();
            let max = if random.gen_ratio(1, 8) { MAX_RARE } else { MAX_USUAL };
            Self(Duration::from_nanos(random.gen_range(0..=max)))
        }

        pub(crate) fn duration_since(self, earlier: Self) -> Duration {
            self.0.saturating_sub(earlier.0)
        }

        pub(crate) fn elapsed(self) -> Duration {
            Self::now().duration_since(self)
        }
    }

    impl Add<Duration> for Instant {
        type Output = Self;

        fn add(self, later: Duration) -> Self {
            Self(self.0 + later)
        }
    }

    /// Runs a test in some thousand interleavings: half of them switch threads at random, and half switch a few times
    /// only, but delay a thread for long each time (Burckhardt et al., "A Randomized Scheduler with Probabilistic
    /// Guarantees of Finding Bugs", 2010).
    #[cfg(test)]
    pub(crate) fn check(run: impl Fn() + Send + Sync + 'static) {
        use shuttle::scheduler::{PctScheduler, RandomScheduler};
        use shuttle::{Config, Runner};

        const INTERLEAVINGS: usize = 2_000;
        const SWITCHES: usize = 3;

        let mut config = Config::new();
        // Shuttle's default stack is too small to format the message of a panic.
        config.stack_size = 256 * 1024;
        let run = std::sync::Arc::new(run);
        let again = std::sync::Arc::clone(&run);
        Runner::new(RandomScheduler::new(INTERLEAVINGS), config.clone()).run(move || run());
        Runner::new(PctScheduler::new(SWITCHES, INTERLEAVINGS), config).run(move || again());
    }
}
