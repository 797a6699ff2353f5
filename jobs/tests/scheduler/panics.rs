//! Each panic in a job becomes an error with its message, and the scheduler keeps working.

use std::panic::panic_any;
use std::sync::Barrier;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use drawloom_jobs::task::{JobPanic, Scheduler, Scope, Worker, catch};

use crate::{assert_intact, scheduler};

fn message<R>(outcome: Result<R, JobPanic>) -> String {
    outcome.err().expect("a panic").message
}

#[test]
fn a_loop_of_usize_max_chunks_ends_at_its_first_panic() {
    for (workers, chunk) in [(1, 0), (1, 1), (4, 0), (4, 1)] {
        let together = Barrier::new(workers);
        let begun: Vec<_> = (0..workers).map(|_| AtomicUsize::new(0)).collect();
        // If a wake-up costs nothing, workers are woken before the first chunk runs.
        let scheduler = Scheduler::builder().workers(workers).wake_up_cost(Duration::ZERO).build().unwrap();
        let outcome = scheduler.parallel_for(usize::MAX, chunk, |range, _worker| {
            // The first chunk of each worker waits for those of the others, so that all workers are in the loop.
            let Some(begun) = begun.get(range.start / range.len()) else { return };
            if begun.fetch_add(1, Ordering::Relaxed) == 0 {
                together.wait();
            }
            assert!(range.start < (workers - 1) * range.len(), "as planned");
        });
        assert_eq!(message(outcome), "as planned");
        assert!(begun.iter().all(|begun| begun.load(Ordering::Relaxed) == 1), "the counter of chunks has wrapped");
    }
}

#[test]
fn a_panic_is_an_error_and_the_scheduler_works_as_before() {
    for workers in [1, 4] {
        let scheduler = scheduler(workers);
        let others = AtomicUsize::new(0);
        let count = |_scope: &Scope<'_>, _worker: &Worker| {
            others.fetch_add(1, Ordering::Relaxed);
        };
        let in_body = scheduler.scope(|scope| {
            scope.spawn(count);
            panic!("in the body");
        });
        assert_eq!(message::<()>(in_body), "in the body");
        assert_intact(&scheduler);
        let in_job = scheduler.scope(|scope| {
            scope.spawn(count);
            scope.spawn(|_scope, worker| panic!("in job {}", worker.index() / workers));
            scope.spawn(count);
        });
        assert_eq!(message(in_job), "in job 0");
        assert_intact(&scheduler);
        let in_pinned = scheduler.scope(|scope| {
            scope.spawn_pinned(|_scope, _worker| panic!("in a pinned job"));
            scope.spawn_pinned(count);
        });
        assert_eq!(message(in_pinned), "in a pinned job");
        assert_intact(&scheduler);
        let in_chunk = scheduler.parallel_for(1_000, 10, |range, _worker| assert!(!range.contains(&500), "in a chunk"));
        assert_eq!(message(in_chunk), "in a chunk");
        assert_intact(&scheduler);
        let nested = scheduler.parallel_for(10, 1, |_range, _worker| {
            let inner = scheduler.parallel_for(10, 1, |range, _worker| assert_ne!(range.start, 5, "inner"));
            assert!(inner.is_err());
        });
        assert_eq!(nested, Ok(()));
        assert_intact(&scheduler);
        assert_eq!(others.into_inner(), 4, "other jobs of the scope run despite the panic");
    }
}

#[test]
fn the_first_panic_is_returned() {
    let outcome = scheduler(1).scope(|scope| {
        scope.spawn_pinned(|_scope, _worker| panic!("second"));
        scope.spawn_pinned(|_scope, _worker| panic!("third"));
        panic!("first");
    });
    assert_eq!(message::<()>(outcome), "first");
}

#[test]
fn chunks_after_a_panic_are_skipped() {
    let ran = AtomicUsize::new(0);
    let outcome = scheduler(1).parallel_for(100, 1, |range, _worker| {
        ran.fetch_add(1, Ordering::Relaxed);
        assert!(range.start < 10);
    });
    assert!(outcome.is_err());
    assert_eq!(ran.into_inner(), 11);
}

#[test]
fn catch_keeps_the_text_of_a_panic() {
    struct PanicsWhenDropped;
    impl Drop for PanicsWhenDropped {
        fn drop(&mut self) {
            panic!("dropped");
        }
    }
    assert_eq!(catch(|| 7), Ok(7));
    assert_eq!(message::<()>(catch(|| panic!("plain"))), "plain");
    assert_eq!(message::<()>(catch(|| panic!("with {}", 1))), "with 1");
    assert_eq!(message::<()>(catch(|| panic_any(7))), "a panic whose payload is not text");
    assert_eq!(message::<()>(catch(|| panic_any(PanicsWhenDropped))), "a panic whose payload is not text");
    // A result that is dropped because of a panic may panic itself.
    let outcome = scheduler(2).scope(|scope| {
        scope.spawn(|_scope, _worker| panic!("in the job"));
        PanicsWhenDropped
    });
    assert_eq!(message(outcome), "in the job");
}
