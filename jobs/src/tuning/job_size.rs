//! The size of jobs that follows from the cost of an item and the number of workers. Frames are divided by it, and
//! replays of frames on other numbers of workers.

use std::time::Duration;

use super::Hysteresis;
use crate::chunked_array::BLOCK_SIZE;

/// Work that is worth a second job: more than it costs another worker to take the job and to fetch what the job reads
/// into its caches.
pub const PARALLEL_THRESHOLD: Duration = Duration::from_micros(12);

/// Jobs per worker: with several, workers do not wait long for the last one to end.
const JOBS_PER_WORKER: f32 = 4.0;

/// The shortest job: its scheduling costs a few percent.
pub const MIN_JOB: Duration = Duration::from_micros(6);

/// The longest job: an urgent one does not queue behind it for long.
pub const MAX_JOB: Duration = Duration::from_micros(60);

/// A job that is too long or too short by less costs next to nothing.
const HYSTERESIS: Hysteresis = Hysteresis::new(1.6);

/// The number of items that make a job, of `width` items that take `per_item` nanoseconds each; `usize::MAX` for a
/// single job. `previous` is the latest choice; `None` if that was a single job, or if there was none.
///
/// One job is best for little work, and for a single worker. Otherwise each worker gets several jobs, none shorter than
/// [`MIN_JOB`]. Hysteresis around the latest choice keeps it from flapping. For equal choices before, which this
/// function made, more workers never get larger jobs.
pub fn job_size(per_item: f32, width: usize, workers: usize, previous: Option<usize>) -> usize {
    let nanoseconds = |time: Duration| time.as_nanos() as f32;
    let work = per_item * width as f32;
    if workers == 1 || !HYSTERESIS.is_above(work, nanoseconds(PARALLEL_THRESHOLD), previous.is_some()) {
        return usize::MAX;
    }
    let job = work / (JOBS_PER_WORKER * workers as f32);
    let items = job.clamp(nanoseconds(MIN_JOB), nanoseconds(MAX_JOB)) / per_item;
    match previous {
        Some(previous) if HYSTERESIS.keeps(previous as f32, items) => previous,
        _ => whole_blocks(items as usize),
    }
}

/// Rounds down to whole blocks of objects and commands: jobs that share no block do not contend for its lock.
fn whole_blocks(items: usize) -> usize {
    if items < BLOCK_SIZE { items.max(1) } else { items - items % BLOCK_SIZE }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn work_is_divided_among_workers_within_the_bounds_of_a_job() {
        // 1 ms: on four workers sixteen jobs of 62.5 µs would be too long, and on 64 workers 256 jobs of 3.9 µs too
        // short.
        let sizes = [1, 2, 4, 8, 16, 32, 64].map(|workers| job_size(1000.0, 1000, workers, None));
        assert_eq!(sizes, [usize::MAX, 60, 60, 31, 15, 7, 6]);
        // 19 µs are one job, unless they were several before; then 12 µs are.
        let sizes = [None, Some(6)].map(|previous| [11, 13, 19, 20].map(|width| job_size(1000.0, width, 2, previous)));
        assert_eq!(sizes, [[usize::MAX, usize::MAX, usize::MAX, 6], [usize::MAX, 6, 6, 6]]);
        // Whole blocks of 256 items.
        assert_eq!(job_size(1.0, 100_000, 16, None), 6_000 / 256 * 256);
    }

    proptest! {
        #[test]
        fn a_choice_is_repeated_and_more_workers_never_have_larger_jobs(
            per_item in 0.5..100_000.0_f32,
            width in 0..100_000_usize,
            workers in 1..64_usize,
        ) {
            let chosen = job_size(per_item, width, workers, None);
            let previous = Some(chosen).filter(|&items| items != usize::MAX);
            prop_assert_eq!(job_size(per_item, width, workers, previous), chosen);
            let sizes: Vec<_> = (1..=64).map(|workers| job_size(per_item, width, workers, previous)).collect();
            prop_assert!(sizes.is_sorted_by(|fewer, more| fewer >= more), "{:?}", sizes);
        }
    }
}
