//! The pools of the others, with as many threads as ours: the one that has work to share out, and one more.

use std::num::NonZero;
use std::ops::Range;

use drawloom_benches::work::Work;

use crate::{Failure, WORKERS};

/// Frames are to be drawn inside of `install`: then the caller's thread sleeps, and one of the pool's stands for it.
///
/// # Errors
/// If a thread cannot be started.
pub fn rayon() -> Result<rayon::ThreadPool, Failure> {
    Ok(rayon::ThreadPoolBuilder::new().num_threads(WORKERS).build()?)
}

/// A thread that waits for a scope works for it, and is not counted.
pub fn bevy_tasks() -> bevy_tasks::TaskPool {
    bevy_tasks::TaskPoolBuilder::new().num_threads(WORKERS - 1).build()
}

/// The caller's thread is counted, the one that only sets heartbeats is not.
pub fn chili() -> chili::ThreadPool {
    chili::ThreadPool::with_config(chili::Config { thread_count: NonZero::new(WORKERS), ..chili::Config::default() })
}

/// Runs the jobs by halves, down to one: the only thing that chili knows. Whether somebody wants a half is looked up once
/// in `TIMES` joins.
pub fn halve<const TIMES: u8>(scope: &mut chili::Scope, jobs: Range<usize>, work: &Work) {
    match jobs.len() {
        0 => {}
        1 => work.job(jobs.start),
        length => {
            let middle = jobs.start + length / 2;
            let (first, second) = (jobs.start..middle, middle..jobs.end);
            scope.join_with_heartbeat_every::<TIMES, _, _, _, _>(
                |scope| halve::<TIMES>(scope, second, work),
                |scope| halve::<TIMES>(scope, first, work),
            );
        }
    }
}
