//! Processes that fail, and subscribers that panic: nothing hangs, nothing stays entered, and the next run is as good as new.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicIsize, Ordering};
use std::sync::{Arc, Barrier};
use std::thread;
use std::time::Duration;

use drawloom::task::Scheduler;
use proptest::prelude::*;
use tracing::level_filters::LevelFilter;
use tracing::span::{Attributes, Id};
use tracing::{Event, Subscriber, dispatcher};
use tracing_subscriber::layer::{Context, Layer};
use tracing_subscriber::registry::LookupSpan;

use crate::recorder::{MoveKind, Recorder, scheduler, subscriber};
use crate::work::{Call, Trouble, Way, schedules};

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(24) })]

    #[test]
    fn what_fails_is_left_and_closed(mut schedule in schedules(), number in 0..12_usize, panics in any::<bool>()) {
        let number = number % schedule.len();
        let trouble = if panics { Trouble::Panic(number) } else { Trouble::Error(number) };
        let is_empty = schedule.nodes().any(|(_, work)| work.number == number && work.width == 0);
        for workers in [1, 2, 4] {
            for way in Way::ALL {
                way.set(&mut schedule);
                let recorder = Recorder::default();
                let dispatch = subscriber(recorder.clone(), LevelFilter::TRACE);
                let scheduler = scheduler(way.scheduler(workers), &dispatch);
                dispatcher::with_default(&dispatch, || for trouble in [trouble, Trouble::None, trouble] {
                    let call = Call { trouble, ..Call::default() };
                    let outcome = schedule.run(&scheduler, &call);
                    assert_eq!(outcome.is_ok(), trouble == Trouble::None || is_empty);
                    let record = recorder.take();
                    record.check_nesting();
                    assert_eq!(record.named("chunk").count(), call.book.into_inner().unwrap().len());
                });
            }
        }
    }

    #[test]
    fn a_subscriber_that_panics_fails_the_run_and_no_more(mut schedule in schedules(), at in 1..30_isize) {
        for kind in [MoveKind::New, MoveKind::Enter, MoveKind::Exit, MoveKind::Close] {
            for workers in [1, 2, 4] {
                for way in Way::ALL {
                    way.set(&mut schedule);
                    let fuse = Arc::new(AtomicIsize::new(isize::MAX));
                    let recorder = Recorder::default();
                    let layer = recorder.clone().and_then(Grumbler { kind, fuse: Arc::clone(&fuse) });
                    let dispatch = subscriber(layer, LevelFilter::TRACE);
                    let scheduler = scheduler(way.scheduler(workers), &dispatch);
                    dispatcher::with_default(&dispatch, || {
                        for left in [at, isize::MAX] {
                            fuse.store(left, Ordering::Relaxed);
                            let call = Call::default();
                            let outcome = catch_unwind(AssertUnwindSafe(|| schedule.run(&scheduler, &call)));
                            let panicked = fuse.load(Ordering::Relaxed) <= 0;
                            let record = recorder.take();
                            // What it was in the midst of making or entering, it has itself left behind.
                            if !panicked && [MoveKind::Exit, MoveKind::Close].contains(&kind) {
                                record.check_nesting();
                            }
                            let outcome = outcome.expect("no panic reaches the caller");
                            assert_eq!(outcome.is_ok(), !panicked, "{kind:?}: {outcome:?}");
                            let done: usize = call.book.into_inner().unwrap().iter().map(|entry| entry.items.len()).sum();
                            let all: usize = schedule.nodes().map(|(_, work)| work.width).sum();
                            assert!(panicked || done == all, "{done} items of {all}");
                        }
                    });
                }
            }
        }
    }
}

/// Panics once, when it is told that for the how-manieth time.
struct Grumbler {
    kind: MoveKind,
    fuse: Arc<AtomicIsize>,
}

impl Grumbler {
    fn hear(&self, kind: MoveKind) {
        let is_over = kind == self.kind && self.fuse.fetch_sub(1, Ordering::Relaxed) == 1;
        assert!(!is_over, "as planned");
    }
}

impl<S> Layer<S> for Grumbler
where
    S: Subscriber + for<'a> LookupSpan<'a>,
{
    fn on_new_span(&self, _attributes: &Attributes<'_>, _id: &Id, _context: Context<'_, S>) {
        self.hear(MoveKind::New);
    }

    fn on_enter(&self, _id: &Id, _context: Context<'_, S>) {
        self.hear(MoveKind::Enter);
    }

    fn on_exit(&self, _id: &Id, _context: Context<'_, S>) {
        self.hear(MoveKind::Exit);
    }

    fn on_close(&self, _id: Id, _context: Context<'_, S>) {
        self.hear(MoveKind::Close);
    }
}

/// Panics at every event.
struct PanickingSubscriber {
    told: Arc<AtomicIsize>,
}

impl<S: Subscriber> Layer<S> for PanickingSubscriber {
    fn on_event(&self, _event: &Event<'_>, _context: Context<'_, S>) {
        self.told.fetch_add(1, Ordering::Relaxed);
        panic!("as planned");
    }
}

#[test]
fn a_subscriber_that_panics_at_a_report_kills_no_worker() {
    const JOBS: isize = 8;
    const WORKERS: usize = 4;
    let told = Arc::new(AtomicIsize::new(0));
    let dispatch = subscriber(PanickingSubscriber { told: Arc::clone(&told) }, LevelFilter::TRACE);
    dispatcher::with_default(&dispatch, || {
        let builder = Scheduler::builder().workers(WORKERS);
        let scheduler = scheduler(builder.on_stop(|_worker| panic!("as planned")), &dispatch);
        // Nobody waits for these: whoever is the last to have one, its worker or this thread, reports it.
        (0..JOBS).for_each(|_job| drop(scheduler.background(|| panic!("as planned"))));
        for _look in 0..10_000 {
            if told.load(Ordering::Relaxed) == JOBS {
                break;
            }
            thread::sleep(Duration::from_millis(1));
        }
        assert_eq!(told.load(Ordering::Relaxed), JOBS, "a worker is lost, or what it was to report");
        // Only that many workers together can pass this.
        let together = Barrier::new(WORKERS);
        let outcome = scheduler.parallel_for(WORKERS, 1, |_range, _worker| _ = together.wait());
        assert_eq!(outcome, Ok(()));
        // Each thread reports its last hook.
        drop(scheduler);
        assert_eq!(told.load(Ordering::Relaxed), JOBS + WORKERS as isize - 1);
    });
}
