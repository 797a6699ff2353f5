//! Times the frames of one contender.

use std::hint;
use std::sync::{Arc, OnceLock};
use std::thread::{self, ThreadId};
use std::time::{Duration, Instant};

use drawloom_benches::cpu_time::cpu_time;
use drawloom_benches::work::Record;

use crate::Failure;

/// How frames follow each other, and what is measured of them.
#[derive(Clone, Copy)]
pub enum Pace<'a> {
    /// Frames back to back for about this long; a sample is their mean time, in seconds.
    BackToBack { duration: Duration },
    /// One frame each interval; each frame is a sample, in seconds.
    Paced { interval: Duration, frames: usize },
    /// One frame each interval; a sample is the CPU time per frame, in seconds.
    CpuTime { interval: Duration, frames: usize },
    /// One frame, and then none for this long; a sample is the CPU time per second, in seconds.
    Asleep { idle: Duration },
    /// Single jobs, each after this long without any; a sample is the time from submission to start, in seconds.
    Wakes { idle: Duration, jobs: usize },
    /// Some frames, and each is checked.
    Check { record: &'a Record, check: &'a (dyn Fn(&Record) -> Result<(), String> + Sync) },
}

/// Times or checks frames according to its pace.
pub struct Timer<'a> {
    pace: Pace<'a>,
    samples: Vec<f64>,
}

/// Warm-up frames back to back: this many, but more of short ones and fewer of long ones.
const WARM_UP: usize = 30;
const MIN_WARM_UP: usize = 3;
/// Least and greatest duration of that warm-up.
const WARM_UP_TIME: [Duration; 2] = [Duration::from_millis(5), Duration::from_millis(40)];
/// Warm-up frames where frames are paced.
const PACED_WARM_UP: usize = 10;
const CHECKED_FRAMES: usize = 20;
/// After this time a pool has finished its start-up.
const START_UP: Duration = Duration::from_millis(10);

impl<'a> Timer<'a> {
    pub fn new(pace: Pace<'a>) -> Self {
        Self { pace, samples: Vec::new() }
    }

    pub fn into_samples(self) -> Vec<f64> {
        self.samples
    }

    /// Calls `frame` as often as the pace requires.
    ///
    /// # Errors
    /// Returns an error if a frame fails or does not pass its check.
    pub fn frames(&mut self, mut frame: impl FnMut() -> Result<(), Failure>) -> Result<(), Failure> {
        match self.pace {
            Pace::BackToBack { duration } => {
                let estimate = warm_up(&mut frame)?;
                // The clock is read about 16 times, which does not show even in short frames.
                let reads = 16.0;
                let between = (duration.as_secs_f64() / reads / estimate.as_secs_f64()).ceil() as usize;
                let (start, mut count) = (Instant::now(), 0);
                while start.elapsed() < duration {
                    (0..between).try_for_each(|_| frame())?;
                    count += between;
                }
                self.samples.push(start.elapsed().as_secs_f64() / count as f64);
            }
            Pace::Paced { interval, frames } => {
                paced(interval, PACED_WARM_UP, &mut frame)?;
                let timed = || {
                    let start = Instant::now();
                    frame()?;
                    self.samples.push(start.elapsed().as_secs_f64());
                    Ok(())
                };
                paced(interval, frames, timed)?;
            }
            Pace::CpuTime { interval, frames } => {
                paced(interval, PACED_WARM_UP, &mut frame)?;
                let before = cpu_time().unwrap_or_default();
                paced(interval, frames, &mut frame)?;
                self.samples.push((cpu_time().unwrap_or_default() - before).as_secs_f64() / frames as f64);
            }
            Pace::Asleep { idle } => {
                thread::sleep(START_UP);
                frame()?;
                let before = cpu_time().unwrap_or_default();
                thread::sleep(idle);
                self.samples.push((cpu_time().unwrap_or_default() - before).as_secs_f64() / idle.as_secs_f64());
            }
            Pace::Wakes { .. } => return Err("a row of single jobs has no frames".into()),
            Pace::Check { record, check } => {
                for index in 0..CHECKED_FRAMES {
                    // Every other frame finds workers that may have gone to sleep.
                    if index % 2 == 1 {
                        thread::sleep(Duration::from_millis(1));
                    }
                    record.clear();
                    frame()?;
                    check(record)?;
                }
            }
        }
        Ok(())
    }

    /// Calls `submit` as often as the pace requires. It calls [`WakeLatency::mark_submitted`], submits one job that
    /// calls [`WakeLatency::mark_begun`], and calls [`WakeLatency::wait`].
    ///
    /// # Errors
    /// Returns an error if a job fails or does not begin on another thread.
    pub fn wakes(&mut self, mut submit: impl FnMut(&Arc<WakeLatency>) -> Result<(), Failure>) -> Result<(), Failure> {
        let (idle, jobs) = match self.pace {
            Pace::Wakes { idle, jobs } => (idle, PACED_WARM_UP + jobs),
            Pace::Check { .. } => (Duration::from_millis(2), CHECKED_FRAMES),
            _ => return Err("a row of frames has no single jobs".into()),
        };
        for job in 0..jobs {
            thread::sleep(idle);
            let latency = Arc::new(WakeLatency::default());
            submit(&latency)?;
            let time = latency.time()?;
            if job >= PACED_WARM_UP {
                self.samples.push(time.as_secs_f64());
            }
        }
        Ok(())
    }
}

/// Returns a lower estimate of the frame time, which is not zero even if the clock is coarse.
fn warm_up(mut frame: impl FnMut() -> Result<(), Failure>) -> Result<Duration, Failure> {
    let [min_time, max_time] = WARM_UP_TIME;
    let (start, mut count) = (Instant::now(), 0);
    let mut shortest = Duration::MAX;
    loop {
        let elapsed = start.elapsed();
        if count >= MIN_WARM_UP && elapsed >= min_time && (count >= WARM_UP || elapsed >= max_time) {
            return Ok(shortest.max(Duration::from_nanos(50)));
        }
        frame()?;
        shortest = shortest.min(start.elapsed() - elapsed);
        count += 1;
    }
}

/// Calls `frame` once each interval, and sleeps in between.
fn paced(interval: Duration, frames: usize, mut frame: impl FnMut() -> Result<(), Failure>) -> Result<(), Failure> {
    let mut next = Instant::now();
    for _ in 0..frames {
        next += interval;
        thread::sleep(next.saturating_duration_since(Instant::now()));
        frame()?;
    }
    Ok(())
}

/// The time from the submission of one job to its start.
#[derive(Default)]
pub struct WakeLatency {
    submitted: OnceLock<(Instant, ThreadId)>,
    began: OnceLock<(Instant, ThreadId)>,
}

impl WakeLatency {
    /// The submitter calls it right before it submits.
    pub fn mark_submitted(&self) {
        let thread = thread::current().id();
        self.submitted.get_or_init(|| (Instant::now(), thread));
    }

    /// The job calls it.
    pub fn mark_begun(&self) {
        let time = Instant::now();
        self.began.get_or_init(|| (time, thread::current().id()));
    }

    /// The submitter calls it after the submission: it spins, as if it did other work, and runs no jobs.
    pub fn wait(&self) {
        let start = Instant::now();
        while self.began.get().is_none() && start.elapsed() < Duration::from_secs(1) {
            hint::spin_loop();
        }
    }

    fn time(&self) -> Result<Duration, Failure> {
        let (submitted, submitter) = self.submitted.get().ok_or("a job was not submitted")?;
        let (began, thread) = self.began.get().ok_or("a job did not begin")?;
        if submitter == thread {
            return Err("a job did not begin on another thread within a second".into());
        }
        Ok(*began - *submitted)
    }
}
