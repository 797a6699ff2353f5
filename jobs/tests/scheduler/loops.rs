//! Loops over the items of iterators.

use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom_jobs::task::Worker;
use proptest::prelude::*;

use crate::{assert_intact, scheduler};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn each_item_is_visited_once_and_may_be_changed(workers in 1..5_usize, length in 0..300_usize, chunk in 1..40_usize) {
        let scheduler = scheduler(workers);
        let (mut numbers, mut visits) = (vec![0; length], vec![0; length]);
        let chunks = numbers.chunks_mut(chunk).zip(visits.chunks_mut(chunk)).enumerate();
        let outcome = scheduler.parallel_for_each(chunks, |(index, (numbers, visits)), _worker| {
            for (offset, (number, visits)) in numbers.iter_mut().zip(visits).enumerate() {
                *number = index * chunk + offset;
                *visits += 1;
            }
        });
        prop_assert_eq!(outcome, Ok(()));
        prop_assert_eq!(visits, vec![1; length]);
        prop_assert_eq!(numbers, (0..length).collect::<Vec<_>>());
    }
}

#[test]
fn after_a_panic_in_an_item_the_others_are_skipped() {
    for workers in [1, 4] {
        let scheduler = scheduler(workers);
        let visited = AtomicUsize::new(0);
        let visit = |item: u16, _: &Worker| {
            assert_ne!(item, 0, "in the first item");
            visited.fetch_add(1, Ordering::Relaxed);
        };
        let outcome = scheduler.parallel_for_each(0..1_000_u16, visit);
        assert_eq!(outcome.err().map(|panic| panic.message.contains("in the first item")), Some(true));
        // Other workers may visit items before they hear of the panic.
        assert!(workers > 1 || visited.into_inner() == 0, "items are visited after the panic");
        assert_intact(&scheduler);
    }
}

#[test]
fn a_panic_in_the_iterator_is_an_error() {
    let scheduler = scheduler(3);
    let items = (0..100).inspect(|item| assert_ne!(*item, 50, "in the iterator"));
    let outcome = scheduler.parallel_for_each(items, |_, _| ());
    assert_eq!(outcome.err().map(|panic| panic.message.contains("in the iterator")), Some(true));
    assert_intact(&scheduler);
}

/// Says that it has ten items, and has another number of them.
struct Misleading(usize);

impl Iterator for Misleading {
    type Item = ();

    fn next(&mut self) -> Option<()> {
        self.0 = self.0.checked_sub(1)?;
        Some(())
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (10, Some(10))
    }
}

impl ExactSizeIterator for Misleading {}

#[test]
fn an_iterator_that_is_shorter_than_it_says_ends_the_loop() {
    let visited = AtomicUsize::new(0);
    let visit = |(), _: &Worker| _ = visited.fetch_add(1, Ordering::Relaxed);
    assert_eq!(scheduler(2).parallel_for_each(Misleading(4), visit), Ok(()));
    assert_eq!(visited.into_inner(), 4);
}

/// Panics when it is dropped.
struct Fragile;

impl Drop for Fragile {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            panic!("in a destructor");
        }
    }
}

#[test]
fn a_panic_in_the_destructor_of_the_body_is_an_error() {
    let (scheduler, fragile) = (scheduler(2), Fragile);
    let outcome = scheduler.parallel_for_each(0..3, move |_, _| _ = &fragile);
    assert_eq!(outcome.err().map(|panic| panic.message.contains("in a destructor")), Some(true));
    assert_intact(&scheduler);
}
