//! A closure whose type and lifetime are erased.
//!
//! A closure that captures little lives in the job itself. So ten thousand small jobs a frame cost no allocations, each
//! of which one worker would make and another free. That more than halves the cost of a small job.

use std::fmt;
use std::mem::{ManuallyDrop, MaybeUninit};

/// Space for the captures of a closure, or for a box that holds it.
type Storage = MaybeUninit<[usize; 4]>;

/// A closure that is called once, on any thread, with a region and a worker. If it is never called, it is dropped.
pub(super) struct Closure<Region: 'static, Worker> {
    storage: Storage,
    call: unsafe fn(*mut Storage, &'static Region, &Worker),
    discard: unsafe fn(*mut Storage),
}

impl<Region: 'static, Worker> Closure<Region, Worker> {
    /// Erases the type and the lifetime of a closure.
    ///
    /// # Safety
    /// The closure must be called or dropped before the lifetime of anything that it borrows ends.
    pub(super) unsafe fn new<F>(closure: F) -> Self
    where
        F: FnOnce(&'static Region, &Worker) + Send,
    {
        if fits::<F>() {
            Self::store(closure)
        } else {
            let closure = Box::new(closure);
            Self::store(move |region: &'static Region, worker: &Worker| closure(region, worker))
        }
    }

    /// Calls the closure. When this returns or unwinds, the closure and its captures have been dropped.
    pub(super) fn call(self, region: &'static Region, worker: &Worker) {
        let mut this = ManuallyDrop::new(self);
        // SAFETY: `call` needs a closure of its type in the storage, and nobody may use it afterwards. `store` made
        // `call` for the type that it stored. This takes `self`, and `ManuallyDrop` keeps `drop` from running. The
        // caller of `new` guarantees that what the closure borrows is still valid.
        unsafe { (this.call)(&raw mut this.storage, region, worker) }
    }

    /// Moves a closure that fits into the storage.
    fn store<F>(closure: F) -> Self
    where
        F: FnOnce(&'static Region, &Worker) + Send,
    {
        assert!(fits::<F>(), "a closure that does not fit is boxed");
        let mut storage = Storage::uninit();
        // SAFETY: The pointer must be valid for writes of an `F` and aligned. The assertion checks size and alignment,
        // and the storage is a local that holds nothing yet.
        unsafe { storage.as_mut_ptr().cast::<F>().write(closure) };
        Self { storage, call: call::<F, Region, Worker>, discard: discard::<F> }
    }
}

impl<Region: 'static, Worker> Drop for Closure<Region, Worker> {
    fn drop(&mut self) {
        // SAFETY: `discard` needs a closure of its type in the storage, and nobody may use it afterwards. `store` made
        // `discard` for the type that it stored. Only `call` takes the closure out, and it keeps this from running.
        unsafe { (self.discard)(&raw mut self.storage) }
    }
}

impl<Region: 'static, Worker> fmt::Debug for Closure<Region, Worker> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Closure").finish_non_exhaustive()
    }
}

const fn fits<F>() -> bool {
    size_of::<F>() <= size_of::<Storage>() && align_of::<F>() <= align_of::<Storage>()
}

/// # Safety
/// The storage must hold an `F` that nobody uses after this call.
unsafe fn call<F, Region: 'static, Worker>(storage: *mut Storage, region: &'static Region, worker: &Worker)
where
    F: FnOnce(&'static Region, &Worker),
{
    // SAFETY: The storage must hold an `F`, and it must be read only once. The caller guarantees both.
    let closure = unsafe { storage.cast::<F>().read() };
    closure(region, worker);
}

/// # Safety
/// The storage must hold an `F` that nobody uses after this call.
unsafe fn discard<F>(storage: *mut Storage) {
    // SAFETY: The storage must hold an `F`, and it must be dropped only once. The caller guarantees both.
    unsafe { storage.cast::<F>().drop_in_place() }
}
