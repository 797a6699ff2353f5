//! What a spawned job runs: a closure that has forgotten its type and what it borrows.
//!
//! To spawn ten thousand small jobs a frame is not to cost ten thousand allocations, which one worker makes and another
//! gives back. So a closure that captures little is kept in the job itself. That more than halves what a small job costs.

use std::{
    fmt,
    mem::{ManuallyDrop, MaybeUninit},
};

use super::{region::Region, scope::Scope, worker::Worker};

/// Room for what a closure captures, or for a box that holds it.
type Room = MaybeUninit<[usize; 4]>;

/// A closure to be called once, on any thread. One that is never called is dropped.
pub(super) struct Closure {
    room: Room,
    call: unsafe fn(*mut Room, &'static Region, &Worker),
    discard: unsafe fn(*mut Room),
}

impl Closure {
    /// # Safety
    ///
    /// It must be gone, called or dropped, before `'scope` ends, and be called with a region that was opened for a scope of
    /// that lifetime.
    pub(super) unsafe fn new<'scope, F>(closure: F) -> Self
    where
        F: FnOnce(&Scope<'scope>, &Worker) + Send + 'scope,
    {
        if fits::<F>() {
            Self::keep(closure)
        } else {
            let closure = Box::new(closure);
            Self::keep(move |scope: &Scope<'scope>, worker: &Worker| closure(scope, worker))
        }
    }

    /// Calls the closure. By the time this returns, or unwinds, the closure and all it had captured are gone.
    pub(super) fn call(self, region: &'static Region, worker: &Worker) {
        let mut this = ManuallyDrop::new(self);
        // SAFETY: `call` was made for the type that is in the room, which is taken out only here, and is not dropped
        // besides, as this is not. That the lifetime has not ended and the region is the right one was promised to `new`.
        unsafe { (this.call)(&raw mut this.room, region, worker) }
    }

    /// Puts the closure into the room, where it has to fit.
    fn keep<'scope, F>(closure: F) -> Self
    where
        F: FnOnce(&Scope<'scope>, &Worker) + Send + 'scope,
    {
        assert!(fits::<F>(), "a box fits, and nothing else comes here that does not");
        let mut room = Room::uninit();
        // SAFETY: The room is large enough and aligned, as has just been asserted, and nothing is in it.
        unsafe { room.as_mut_ptr().cast::<F>().write(closure) };
        Self { room, call: call::<F>, discard: discard::<F> }
    }
}

impl Drop for Closure {
    fn drop(&mut self) {
        // SAFETY: `discard` was made for the type that is in the room. It is still there, as `call` takes it out only where
        // this is not dropped.
        unsafe { (self.discard)(&raw mut self.room) }
    }
}

impl fmt::Debug for Closure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Closure").finish_non_exhaustive()
    }
}

const fn fits<F>() -> bool {
    size_of::<F>() <= size_of::<Room>() && align_of::<F>() <= align_of::<Room>()
}

/// # Safety
///
/// An `F` is in the room, and is used no more after this.
unsafe fn call<'scope, F>(room: *mut Room, region: &'static Region, worker: &Worker)
where
    F: FnOnce(&Scope<'scope>, &Worker),
{
    // SAFETY: It is there, as the caller promises, and this is the one time that it is taken out.
    let closure = unsafe { room.cast::<F>().read() };
    closure(&Scope::new(region), worker);
}

/// # Safety
///
/// An `F` is in the room, and is used no more after this.
unsafe fn discard<F>(room: *mut Room) {
    // SAFETY: It is there, as the caller promises, and this is the one time that it is dropped.
    unsafe { room.cast::<F>().drop_in_place() }
}
