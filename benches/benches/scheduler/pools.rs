//! The pools of the other executors, with as many threads that run jobs as asked for, the calling thread included.

use std::num::NonZero;
use std::ops::Range;

use drawloom_benches::work::Work;

use crate::Failure;

/// Frames must run inside `install`: the calling thread sleeps there, and one of the pool's threads replaces it.
///
/// # Errors
/// Returns an error if a thread cannot be started.
pub fn rayon(workers: usize) -> Result<rayon::ThreadPool, Failure> {
    Ok(rayon::ThreadPoolBuilder::new().num_threads(workers).build()?)
}

/// A thread that waits for a scope runs its tasks, and bevy_tasks does not count it.
pub fn bevy_tasks(workers: usize) -> bevy_tasks::TaskPool {
    bevy_tasks::TaskPoolBuilder::new().num_threads(workers - 1).build()
}

/// chili counts the calling thread, but not the one that only sets heartbeats.
pub fn chili(workers: usize) -> chili::ThreadPool {
    chili::ThreadPool::with_config(chili::Config { thread_count: NonZero::new(workers), ..chili::Config::default() })
}

/// Splits the range in halves down to single jobs, as join is all that chili offers. Every `TIMES`-th join checks for
/// idle threads.
pub fn join_halves<const TIMES: u8>(scope: &mut chili::Scope, jobs: Range<usize>, work: &Work) {
    match jobs.len() {
        0 => {}
        1 => work.job(jobs.start),
        length => {
            let middle = jobs.start + length / 2;
            let (first, second) = (jobs.start..middle, middle..jobs.end);
            scope.join_with_heartbeat_every::<TIMES, _, _, _, _>(
                |scope| join_halves::<TIMES>(scope, second, work),
                |scope| join_halves::<TIMES>(scope, first, work),
            );
        }
    }
}
