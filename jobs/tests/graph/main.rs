//! Compares compiled graphs with a naive oracle of the rules, and runs with simple counters.

mod compile;
mod dot;
mod extremes;
mod graph_model;
mod measurements;
mod oracle;
mod problems;
mod run;
mod stops;
mod stress;
mod timeline;

use std::sync::LazyLock;

use drawloom_jobs::task::Scheduler;

/// Schedulers of one, two and four workers, shared by all tests.
static SCHEDULERS: LazyLock<[Scheduler; 3]> =
    LazyLock::new(|| [1, 2, 4].map(|workers| Scheduler::new(workers).expect("four threads can be started")));
