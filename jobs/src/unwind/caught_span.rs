//! Spans of `tracing`, whose subscriber is code of the engine's.

use std::marker::PhantomData;
use std::sync::Arc;

use tracing::Span;

use super::{catch, discard};

/// A span of `tracing`. If the subscriber panics, what it was told is lost, the panic hook gets the message, and
/// nothing else happens.
///
/// Clones share the span, so a clone does not call the subscriber. The last one that is dropped closes it.
#[derive(Clone)]
pub struct CaughtSpan(Option<Arc<Span>>);

impl CaughtSpan {
    /// `make` calls a macro of `tracing`, or asks for the current span.
    pub fn new(make: impl FnOnce() -> Span) -> Self {
        Self(catch(make).ok().filter(|span| !span.is_none()).map(Arc::new))
    }

    /// No span.
    pub const fn none() -> Self {
        Self(None)
    }

    /// For the `parent` of a macro.
    pub fn id(&self) -> Option<tracing::span::Id> {
        self.0.as_ref().and_then(|span| span.id())
    }

    /// Enters the span until the result is dropped.
    pub fn enter(self) -> EnteredSpan {
        // Not `Span::enter`, whose guard exits the span in a destructor: where that panics as well, the process ends.
        self.tell(|id, subscriber| subscriber.enter(id));
        EnteredSpan { span: self, not_send: PhantomData }
    }

    fn tell(&self, tell: impl FnOnce(&tracing::span::Id, &tracing::Dispatch)) {
        if let Some(span) = &self.0 {
            // `catch` drops the payload of a panic, and ignores what that panics with.
            let _ = catch(|| span.with_subscriber(|(id, subscriber)| tell(id, subscriber)));
        }
    }
}

impl Drop for CaughtSpan {
    fn drop(&mut self) {
        discard(self.0.take());
    }
}

/// A span that this thread has entered. It is exited when this is dropped, even if the subscriber has panicked when it
/// was entered: most have noted by then that the thread is in it.
pub struct EnteredSpan {
    span: CaughtSpan,
    /// It is exited by the thread that has entered it.
    not_send: PhantomData<*const ()>,
}

impl EnteredSpan {
    /// Exits the span.
    pub fn exit(mut self) -> CaughtSpan {
        let span = std::mem::replace(&mut self.span, CaughtSpan::none());
        span.tell(|id, subscriber| subscriber.exit(id));
        span
    }
}

impl Drop for EnteredSpan {
    fn drop(&mut self) {
        self.span.tell(|id, subscriber| subscriber.exit(id));
    }
}
