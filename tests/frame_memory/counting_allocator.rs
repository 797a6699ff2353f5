//! A global allocator that counts allocations by their backtrace.

use std::alloc::{GlobalAlloc, Layout, System};
use std::backtrace::Backtrace;
use std::cell::Cell;
use std::collections::HashMap;
use std::ffi::{c_int, c_void};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{LazyLock, Mutex, PoisonError};

/// The system's allocator, which also counts every allocation by its backtrace while [`count`] enables that.
struct CountingAllocator;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

static IS_COUNTING: AtomicBool = AtomicBool::new(false);
/// By a hash of the backtrace's addresses: a backtrace is resolved once, which takes milliseconds, and then only
/// counted.
static SITES: LazyLock<Mutex<HashMap<u64, AllocationSite>>> = LazyLock::new(Mutex::default);

thread_local! {
    /// Whether this thread is inside `count_allocation`, which allocates itself.
    static IS_INSIDE: Cell<bool> = const { Cell::new(false) };
}

/// The allocations with one backtrace.
#[derive(Clone)]
pub struct AllocationSite {
    pub count: usize,
    /// As the standard library prints it.
    pub backtrace: String,
}

/// Enables or disables counting.
pub fn count(is_counting: bool) {
    IS_COUNTING.store(is_counting, Ordering::SeqCst);
}

/// Sets all counts to 0, and keeps resolved backtraces.
pub fn reset() {
    sites().values_mut().for_each(|site| site.count = 0);
}

/// Returns and resets all counts.
pub fn take() -> Vec<AllocationSite> {
    let counted = sites().values().filter(|site| site.count > 0).cloned().collect();
    reset();
    counted
}

fn sites() -> std::sync::MutexGuard<'static, HashMap<u64, AllocationSite>> {
    SITES.lock().unwrap_or_else(PoisonError::into_inner)
}

fn count_allocation() {
    // `try_with` fails on a thread that ends; that is not part of a frame.
    let is_counted =
        IS_COUNTING.load(Ordering::SeqCst) && IS_INSIDE.try_with(|inside| !inside.replace(true)) == Ok(true);
    if !is_counted {
        return;
    }
    let hash = hash_of_backtrace();
    let resolve = || AllocationSite { count: 0, backtrace: Backtrace::force_capture().to_string() };
    sites().entry(hash).or_insert_with(resolve).count += 1;
    let _ = IS_INSIDE.try_with(|inside| inside.set(false));
}

fn hash_of_backtrace() -> u64 {
    unsafe extern "C" fn mix(context: *mut c_void, hash: *mut c_void) -> c_int {
        // SAFETY: `context` is valid: the unwinder passes its own.
        let address = unsafe { _Unwind_GetIP(context) };
        // SAFETY: `hash` is valid and not aliased: the unwinder passes the pointer that `hash_of_backtrace` gave it,
        // which does not use the value meanwhile.
        let hash = unsafe { &mut *hash.cast::<u64>() };
        *hash = (*hash ^ address as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
        0
    }
    let mut hash = 0_u64;
    // SAFETY: The callback must not unwind, and its argument must stay valid: `mix` does not, and `hash` outlives the
    // call.
    unsafe { _Unwind_Backtrace(mix, (&raw mut hash).cast()) };
    hash
}

// The unwinder that the standard library links.
unsafe extern "C" {
    fn _Unwind_Backtrace(
        visit: unsafe extern "C" fn(*mut c_void, *mut c_void) -> c_int,
        argument: *mut c_void,
    ) -> c_int;
    fn _Unwind_GetIP(context: *mut c_void) -> usize;
}

// SAFETY: Every method forwards to the system's allocator, which fulfils the contract.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count_allocation();
        // SAFETY: The caller upholds the same contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count_allocation();
        // SAFETY: The caller upholds the same contract.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count_allocation();
        // SAFETY: The caller upholds the same contract, and the memory is from the system's allocator.
        unsafe { System.realloc(memory, layout, size) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: The caller upholds the same contract, and the memory is from the system's allocator.
        unsafe { System.dealloc(memory, layout) }
    }
}
