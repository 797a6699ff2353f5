//! The work of a job: nothing, or arithmetic for a calibrated time.

use std::hint::black_box;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// The work of every job of a row, for all executors.
pub struct Work {
    /// Rounds of arithmetic; 0 for an empty job.
    rounds: u32,
    record: Option<Record>,
}

impl Work {
    /// Jobs that do nothing.
    pub fn empty() -> Self {
        Self { rounds: 0, record: None }
    }

    /// Jobs that keep a core busy for `time`.
    pub fn busy(time: Duration) -> Self {
        const SAMPLE: u32 = 100_000;
        let sample = || {
            let start = Instant::now();
            arithmetic(SAMPLE);
            start.elapsed()
        };
        // The minimum, as disturbances can only add time.
        let minimum = (0..50).map(|_| sample()).min().unwrap_or_default();
        let rounds = time.as_secs_f64() / minimum.as_secs_f64() * f64::from(SAMPLE);
        Self { rounds: rounds.round().max(1.0) as u32, record: None }
    }

    /// The same jobs, which also record when they run.
    pub fn recorded(&self, jobs: usize) -> Self {
        Self { record: Some(Record::new(jobs)), ..*self }
    }

    pub fn record(&self) -> Option<&Record> {
        self.record.as_ref()
    }

    /// Runs one job. Timed and checked frames run the same code: recording costs a well-predicted branch, for all
    /// executors alike.
    #[inline]
    pub fn job(&self, index: usize) {
        let index = black_box(index);
        let record = self.record.as_ref().and_then(|record| record.jobs.get(index).zip(Some(record)));
        if let Some((job, record)) = record {
            job.began.store(record.tick(), Ordering::Relaxed);
        }
        arithmetic(self.rounds);
        if let Some((job, record)) = record {
            job.ended.store(record.tick(), Ordering::Relaxed);
            job.runs.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Each iteration depends on the one before.
#[inline]
fn arithmetic(rounds: u32) {
    let mut state = 1_u64;
    for _ in 0..rounds {
        state = black_box(state.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(17));
    }
}

/// The times at which the jobs of a frame ran, by a logical clock that counts starts and ends.
pub struct Record {
    clock: AtomicU32,
    jobs: Vec<Job>,
}

#[derive(Default)]
struct Job {
    runs: AtomicU32,
    began: AtomicU32,
    ended: AtomicU32,
}

impl Record {
    fn new(jobs: usize) -> Self {
        Self { clock: AtomicU32::new(0), jobs: (0..jobs).map(|_| Job::default()).collect() }
    }

    fn tick(&self) -> u32 {
        self.clock.fetch_add(1, Ordering::AcqRel)
    }

    /// Clears the counts of the last frame.
    pub fn clear(&self) {
        for job in &self.jobs {
            job.runs.store(0, Ordering::Relaxed);
        }
    }

    pub fn runs(&self) -> impl Iterator<Item = u32> {
        self.jobs.iter().map(|job| job.runs.load(Ordering::Relaxed))
    }

    /// Whether job `before` ended before job `after` began.
    pub fn in_order(&self, before: usize, after: usize) -> bool {
        self.ended(before) < self.began(after)
    }

    pub fn began(&self, job: usize) -> u32 {
        self.jobs[job].began.load(Ordering::Relaxed)
    }

    pub fn ended(&self, job: usize) -> u32 {
        self.jobs[job].ended.load(Ordering::Relaxed)
    }
}
