//! An allocator that notes who asks for memory.

use std::alloc::{GlobalAlloc, Layout, System};
use std::backtrace::Backtrace;
use std::cell::Cell;
use std::collections::HashMap;
use std::ffi::{c_int, c_void};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{LazyLock, Mutex, PoisonError};

/// The system's allocator, which notes the stack of every request while [`count`] says so.
struct Noting;

#[global_allocator]
static ALLOCATOR: Noting = Noting;

static IS_COUNTING: AtomicBool = AtomicBool::new(false);
/// By a hash of the stack's addresses: a stack is resolved once, which takes milliseconds, and then only counted.
static NOTED: LazyLock<Mutex<HashMap<u64, Request>>> = LazyLock::new(Mutex::default);

thread_local! {
    /// What notes a request asks for memory itself.
    static IS_NOTING: Cell<bool> = const { Cell::new(false) };
}

/// Requests with one stack.
#[derive(Clone)]
pub struct Request {
    pub count: usize,
    /// As the standard library prints it.
    pub stack: String,
}

/// Whether requests are counted from here on.
pub fn count(is_counting: bool) {
    IS_COUNTING.store(is_counting, Ordering::SeqCst);
}

/// Begins to count from 0; stacks that are known stay so.
pub fn forget() {
    noted().values_mut().for_each(|request| request.count = 0);
}

/// What was counted.
pub fn take() -> Vec<Request> {
    let requests = noted().values().filter(|request| request.count > 0).cloned().collect();
    forget();
    requests
}

fn noted() -> std::sync::MutexGuard<'static, HashMap<u64, Request>> {
    NOTED.lock().unwrap_or_else(PoisonError::into_inner)
}

fn note() {
    // A thread that ends has no such variable any more, and is no part of a frame.
    let is_first = IS_COUNTING.load(Ordering::SeqCst) && IS_NOTING.try_with(|noting| !noting.replace(true)) == Ok(true);
    if !is_first {
        return;
    }
    let address = hash_of_stack();
    let stack = || Request { count: 0, stack: Backtrace::force_capture().to_string() };
    noted().entry(address).or_insert_with(stack).count += 1;
    let _ = IS_NOTING.try_with(|noting| noting.set(false));
}

fn hash_of_stack() -> u64 {
    unsafe extern "C" fn mix(context: *mut c_void, hash: *mut c_void) -> c_int {
        // SAFETY: The unwinder passes its own context on.
        let address = unsafe { _Unwind_GetIP(context) };
        // SAFETY: It passes on what `hash_of_stack` gave it, which nobody else looks at meanwhile.
        let hash = unsafe { &mut *hash.cast::<u64>() };
        *hash = (*hash ^ address as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
        0
    }
    let mut hash = 0_u64;
    // SAFETY: `mix` does not unwind, and `hash` outlives the call.
    unsafe { _Unwind_Backtrace(mix, (&raw mut hash).cast()) };
    hash
}

// What unwinds panics, which the standard library is linked to.
unsafe extern "C" {
    fn _Unwind_Backtrace(
        visit: unsafe extern "C" fn(*mut c_void, *mut c_void) -> c_int,
        argument: *mut c_void,
    ) -> c_int;
    fn _Unwind_GetIP(context: *mut c_void) -> usize;
}

// SAFETY: Everything is left to the system's allocator, which is one.
unsafe impl GlobalAlloc for Noting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note();
        // SAFETY: Whoever calls this has promised the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note();
        // SAFETY: Whoever calls this has promised the same.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note();
        // SAFETY: Whoever calls this has promised the same, and the memory is the system's.
        unsafe { System.realloc(memory, layout, size) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: Whoever calls this has promised the same, and the memory is the system's.
        unsafe { System.dealloc(memory, layout) }
    }
}
