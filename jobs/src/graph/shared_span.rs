//! The span of a node whose chunks several workers run.

use std::mem;

use crate::sync::Mutex;
use crate::unwind::CaughtSpan;

/// What the worker that opens a node hands to those that join it. Only used if the run is instrumented.
pub(super) struct SharedSpan(Mutex<Opened>);

/// When a node was opened, and its tracing span.
#[derive(Clone)]
pub(super) struct Opened {
    /// A timestamp of the timeline's clock.
    pub(super) at: u64,
    pub(super) span: CaughtSpan,
}

impl SharedSpan {
    pub(super) fn new() -> Self {
        Self(Mutex::new(Opened { at: 0, span: CaughtSpan::none() }))
    }

    pub(super) fn set(&self, opened: Opened) {
        let before = mem::replace(&mut *self.0.lock(), opened);
        // Not while it is locked, as this may call the subscriber.
        drop(before);
    }

    /// Clones of the span share it, so this does not call the subscriber under the lock.
    pub(super) fn get(&self) -> Opened {
        self.0.lock().clone()
    }

    /// Takes the tracing span out. It closes when it is dropped, if all workers have left it.
    pub(super) fn take(&self) -> CaughtSpan {
        mem::replace(&mut self.0.lock().span, CaughtSpan::none())
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use tracing::span::{Attributes, Id, Record};
    use tracing::{Event, Metadata, Subscriber};

    use super::{CaughtSpan, Opened, SharedSpan};

    /// Counts the spans that are cloned, and those that are closed.
    struct Counts([Arc<AtomicUsize>; 2]);

    impl Subscriber for Counts {
        fn enabled(&self, _: &Metadata<'_>) -> bool {
            true
        }

        fn new_span(&self, _: &Attributes<'_>) -> Id {
            Id::from_u64(1)
        }

        fn record(&self, _: &Id, _: &Record<'_>) {}

        fn record_follows_from(&self, _: &Id, _: &Id) {}

        fn event(&self, _: &Event<'_>) {}

        fn enter(&self, _: &Id) {}

        fn exit(&self, _: &Id) {}

        fn clone_span(&self, id: &Id) -> Id {
            self.0[0].fetch_add(1, Ordering::Relaxed);
            id.clone()
        }

        fn try_close(&self, _: Id) -> bool {
            self.0[1].fetch_add(1, Ordering::Relaxed);
            true
        }
    }

    #[test]
    fn a_worker_gets_the_span_without_a_call_of_the_subscriber() {
        let counts: [Arc<AtomicUsize>; 2] = Default::default();
        let [cloned, closed] = counts.each_ref().map(|count| || count.load(Ordering::Relaxed));
        tracing::subscriber::with_default(Counts(counts.each_ref().map(Arc::clone)), || {
            let shared = SharedSpan::new();
            shared.set(Opened { at: 7, span: CaughtSpan::new(|| tracing::error_span!("node")) });
            let joined = shared.get();
            assert_eq!((joined.at, joined.span.id()), (7, Some(Id::from_u64(1))));
            drop(shared.take());
            assert_eq!((cloned(), closed()), (0, 0), "another worker is in it");
            drop(joined);
            assert_eq!((cloned(), closed()), (0, 1));
        });
    }
}
