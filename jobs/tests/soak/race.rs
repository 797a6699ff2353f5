//! An intentional data race. `.ci/run` checks that the thread sanitizer reports it, so its silence about the
//! soak is evidence.

use std::cell::UnsafeCell;
use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom_jobs::task::Scheduler;

/// A number without synchronization.
struct Unprotected(UnsafeCell<u64>);

// SAFETY: Unsound on purpose. Two threads change the number at once, in a test that only the thread sanitizer runs, to
// report this.
unsafe impl Sync for Unprotected {}

impl Unprotected {
    fn increase(&self) {
        // SAFETY: Unsound on purpose, for the same reason.
        unsafe { *self.0.get() += 1 };
    }
}

/// Two chunks of one loop change the same number, and nothing orders them. If the scheduler did, it would hide races of
/// its jobs from the sanitizer.
#[test]
#[ignore = "a data race for the thread sanitizer to find"]
fn two_chunks_race_deliberately() {
    let scheduler = Scheduler::new(2).expect("a thread can be started");
    // The sanitizer remembers only a few accesses, so it may miss one pair of them, but not all.
    for _round in 0..100 {
        let (number, begun) = (Unprotected(UnsafeCell::new(0)), AtomicUsize::new(0));
        let outcome = scheduler.parallel_for(2, 1, |_range, _worker| {
            // Relaxed: both chunks run at the same time, and nothing orders them.
            begun.fetch_add(1, Ordering::Relaxed);
            while begun.load(Ordering::Relaxed) < 2 {
                std::hint::spin_loop();
            }
            (0..1_000).for_each(|_| number.increase());
        });
        assert_eq!(outcome, Ok(()));
    }
}
