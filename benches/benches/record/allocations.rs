//! Counts memory allocations.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// The system's allocator, which counts allocations and reallocations of all threads inside [`requests_in`] only. Timed
/// frames therefore share no counter.
pub struct Counting;

static IS_COUNTING: AtomicBool = AtomicBool::new(false);
static REQUESTS: AtomicUsize = AtomicUsize::new(0);

/// Runs `work`, and returns the number of allocations of all threads meanwhile.
pub fn requests_in<R>(work: impl FnOnce() -> R) -> (R, usize) {
    let before = REQUESTS.load(Ordering::Relaxed);
    IS_COUNTING.store(true, Ordering::Relaxed);
    let result = work();
    IS_COUNTING.store(false, Ordering::Relaxed);
    (result, REQUESTS.load(Ordering::Relaxed) - before)
}

fn count() {
    if IS_COUNTING.load(Ordering::Relaxed) {
        REQUESTS.fetch_add(1, Ordering::Relaxed);
    }
}

// SAFETY: A `GlobalAlloc` must return valid memory and must not unwind: every method forwards to `System`, and counting
// cannot unwind.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: `System` has the same contract as this method, which the caller fulfils.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: `System` has the same contract as this method, which the caller fulfils.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: `System` has the same contract as this method, which the caller fulfils; all memory was allocated by
        // `System`.
        unsafe { System.realloc(memory, layout, size) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: `System` has the same contract as this method, which the caller fulfils; all memory was allocated by
        // `System`.
        unsafe { System.dealloc(memory, layout) }
    }
}
