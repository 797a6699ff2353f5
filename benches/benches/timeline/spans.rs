//! The cost of a node's span without a subscriber.

use std::hint::black_box;
use std::time::Instant;

use drawloom_benches::statistics::median;

const SPANS: u32 = 1_000_000;

/// Nanoseconds to open, enter and close a span with a node's fields: the median of `rounds`.
pub fn measure(rounds: usize) -> f64 {
    let parent = tracing::Span::current();
    let (name, view) = (black_box("geometry buffer, view 0, record"), black_box(Some("main")));
    let with = || {
        let span = tracing::debug_span!(target: "drawloom::graph", parent: &parent, "process", name, view);
        drop(black_box(span.entered()));
    };
    let without = || _ = black_box((name, view));
    median((0..rounds).map(|_| time(with) - time(without)))
}

fn time(call: impl Fn()) -> f64 {
    let start = Instant::now();
    (0..SPANS).for_each(|_| call());
    start.elapsed().as_nanos() as f64 / f64::from(SPANS)
}
