//! The boundary to code of the engine's, which may panic: its steps, backends, and subscriber of `tracing`.
//!
//! A panic is caught where the engine's code is called, and becomes an error that names the call. These are all places
//! where this crate calls such code. `tests/boundary` of the workspace makes each of these calls panic in turn. The
//! module `unwind` of `drawloom` has the renderer's.
//!
//! | code | called in | its panic |
//! | --- | --- | --- |
//! | `AsyncStep`, `ReadBack::read` of its source | `shared.rs` | `AsyncPostErrorReason::Panicked` |
//! | `UploadPicture` | `shared.rs` | `BackendError::Panicked` with the call |
//! | subscribers of `tracing` | [`emit`], and nowhere else: `tests/architecture` checks that | the event is lost |
//! | destructors of steps, of what reads a source back, and of the payloads of panics | [`Contained`] | nothing |

use std::ops::Deref;

use drawloom::task::catch;

/// Calls `event`, which sends an event to the engine's `tracing` subscriber. If the subscriber panics, the event is
/// lost.
pub(crate) fn emit(event: impl FnOnce()) {
    // The panic hook has its message.
    let _ = catch(event);
}

/// A value of the engine's. If its destructor panics, the panic goes no further.
pub(crate) struct Contained<T>(Option<T>);

impl<T> Contained<T> {
    pub(crate) fn new(value: T) -> Self {
        Self(Some(value))
    }
}

impl<T> Deref for Contained<T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.0.as_ref().expect("only the destructor takes a contained value")
    }
}

impl<T> Drop for Contained<T> {
    fn drop(&mut self) {
        let value = self.0.take();
        // The panic hook has its message.
        let _ = catch(|| drop(value));
    }
}
