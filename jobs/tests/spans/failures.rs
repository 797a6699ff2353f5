//! Failing nodes and panicking subscribers: no run hangs, no span stays entered, and the next run is unaffected.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicIsize, Ordering};
use std::sync::{Arc, Barrier};
use std::thread;
use std::time::Duration;

use drawloom_jobs::task::Scheduler;
use proptest::prelude::*;
use tracing::level_filters::LevelFilter;
use tracing::span::{Attributes, Id};
use tracing::{Event, Subscriber, dispatcher};
use tracing_subscriber::layer::{Context, Layer};
use tracing_subscriber::registry::LookupSpan;

use crate::recorder::{ChangeKind, Recorder, scheduler, subscriber};
use crate::work::{Failure, Mode, RunContext, schedules};

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(10) })]

    #[test]
    fn spans_of_failed_nodes_are_exited_and_closed(mut schedule in schedules(), number in 0..12_usize, panics in any::<bool>()) {
        let number = number % schedule.len();
        let failure = if panics { Failure::Panic(number) } else { Failure::Error(number) };
        let is_empty = schedule.nodes().any(|(_, work)| work.number == number && work.width == 0);
        for workers in [1, 2, 4] {
            for mode in Mode::ALL {
                mode.set(&mut schedule);
                let recorder = Recorder::default();
                let dispatch = subscriber(recorder.clone(), LevelFilter::TRACE);
                let scheduler = scheduler(mode.scheduler(workers), &dispatch);
                dispatcher::with_default(&dispatch, || for failure in [failure, Failure::None, failure] {
                    let context = RunContext { failure, ..RunContext::default() };
                    let outcome = schedule.run(&scheduler, &context);
                    assert_eq!(outcome.is_ok(), failure == Failure::None || is_empty);
                    let record = recorder.take();
                    record.check_nesting();
                    assert_eq!(record.named("chunk").count(), context.ran_chunks.into_inner().unwrap().len());
                });
            }
        }
    }

    #[test]
    fn a_panicking_subscriber_fails_no_run(mut schedule in schedules(), at in 1..30_isize) {
        for kind in [ChangeKind::New, ChangeKind::Enter, ChangeKind::Exit, ChangeKind::Close] {
            for workers in [1, 2, 4] {
                for mode in Mode::ALL {
                    mode.set(&mut schedule);
                    let fuse = Arc::new(AtomicIsize::new(isize::MAX));
                    let recorder = Recorder::default();
                    let layer = recorder.clone().and_then(PanickingLayer { kind, fuse: Arc::clone(&fuse) });
                    let dispatch = subscriber(layer, LevelFilter::TRACE);
                    let scheduler = scheduler(mode.scheduler(workers), &dispatch);
                    dispatcher::with_default(&dispatch, || {
                        for fuse_length in [at, isize::MAX] {
                            fuse.store(fuse_length, Ordering::Relaxed);
                            let context = RunContext::default();
                            let outcome = catch_unwind(AssertUnwindSafe(|| schedule.run(&scheduler, &context)));
                            let panicked = fuse.load(Ordering::Relaxed) <= 0;
                            let record = recorder.take();
                            // A subscriber that panics while a span is created or entered leaves that span behind.
                            if !panicked && [ChangeKind::Exit, ChangeKind::Close].contains(&kind) {
                                record.check_nesting();
                            }
                            let outcome = outcome.expect("no panic reaches the caller");
                            assert!(outcome.is_ok(), "{kind:?}: {outcome:?}");
                            let done: usize = context.ran_chunks.into_inner().unwrap().iter().map(|chunk| chunk.items.len()).sum();
                            let all: usize = schedule.nodes().map(|(_, work)| work.width).sum();
                            assert_eq!(done, all, "{kind:?}");
                        }
                    });
                }
            }
        }
    }
}

/// A layer that panics once, when `fuse` more changes of this kind have happened.
struct PanickingLayer {
    kind: ChangeKind,
    fuse: Arc<AtomicIsize>,
}

impl PanickingLayer {
    fn count(&self, kind: ChangeKind) {
        let is_last = kind == self.kind && self.fuse.fetch_sub(1, Ordering::Relaxed) == 1;
        assert!(!is_last, "as planned");
    }
}

impl<S> Layer<S> for PanickingLayer
where
    S: Subscriber + for<'a> LookupSpan<'a>,
{
    fn on_new_span(&self, _attributes: &Attributes<'_>, _id: &Id, _context: Context<'_, S>) {
        self.count(ChangeKind::New);
    }

    fn on_enter(&self, _id: &Id, _context: Context<'_, S>) {
        self.count(ChangeKind::Enter);
    }

    fn on_exit(&self, _id: &Id, _context: Context<'_, S>) {
        self.count(ChangeKind::Exit);
    }

    fn on_close(&self, _id: Id, _context: Context<'_, S>) {
        self.count(ChangeKind::Close);
    }
}

/// A layer that panics at every event.
struct PanickingSubscriber {
    found: Arc<AtomicIsize>,
}

impl<S: Subscriber> Layer<S> for PanickingSubscriber {
    fn on_event(&self, _event: &Event<'_>, _context: Context<'_, S>) {
        self.found.fetch_add(1, Ordering::Relaxed);
        panic!("as planned");
    }
}

#[test]
fn a_panic_in_an_event_ends_no_worker() {
    const JOBS: isize = 8;
    const WORKERS: usize = 4;
    let found = Arc::new(AtomicIsize::new(0));
    let dispatch = subscriber(PanickingSubscriber { found: Arc::clone(&found) }, LevelFilter::TRACE);
    dispatcher::with_default(&dispatch, || {
        let builder = Scheduler::builder().workers(WORKERS);
        let scheduler = scheduler(builder.on_stop(|_worker| panic!("as planned")), &dispatch);
        // No thread waits for these jobs. The last owner of a job, its worker or this thread, reports its panic.
        (0..JOBS).for_each(|_job| drop(scheduler.background(|| panic!("as planned"))));
        for _try in 0..10_000 {
            if found.load(Ordering::Relaxed) == JOBS {
                break;
            }
            thread::sleep(Duration::from_millis(1));
        }
        assert_eq!(found.load(Ordering::Relaxed), JOBS, "a worker or its report is lost");
        // The barrier only opens if all workers are still alive.
        let together = Barrier::new(WORKERS);
        let outcome = scheduler.parallel_for(WORKERS, 1, |_range, _worker| _ = together.wait());
        assert_eq!(outcome, Ok(()));
        // Each thread reports the panic of its `on_stop` hook.
        drop(scheduler);
        assert_eq!(found.load(Ordering::Relaxed), JOBS + WORKERS as isize - 1);
    });
}
