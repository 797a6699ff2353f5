//! Values of the engine's whose destructors may panic.

use std::ops::{Deref, DerefMut};

use super::discard;

/// A value of the engine's. If its destructor panics, the panic goes no further, even if the value is dropped while
/// another panic unwinds.
pub struct Contained<T>(Option<T>);

impl<T> Contained<T> {
    /// Wraps a value of the engine's.
    pub fn new(value: T) -> Self {
        Self(Some(value))
    }

    /// The value, whose destructor is the caller's to contain.
    pub fn into_inner(mut self) -> T {
        self.0.take().expect(HAS_VALUE)
    }
}

/// Why a value is there: only `into_inner` takes it, which consumes what held it.
const HAS_VALUE: &str = "a contained value is there until it is taken with what holds it";

/// For values whose clone shares them, as that of an [`Arc`](std::sync::Arc).
impl<T: Clone> Clone for Contained<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<T> Deref for Contained<T> {
    type Target = T;

    fn deref(&self) -> &T {
        self.0.as_ref().expect(HAS_VALUE)
    }
}

impl<T> DerefMut for Contained<T> {
    fn deref_mut(&mut self) -> &mut T {
        self.0.as_mut().expect(HAS_VALUE)
    }
}

impl<T> Drop for Contained<T> {
    fn drop(&mut self) {
        discard(self.0.take());
    }
}
