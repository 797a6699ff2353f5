//! The clock in the hand of whoever has its turn.

use std::hint;
use std::sync::{Arc, OnceLock};
use std::thread::{self, ThreadId};
use std::time::{Duration, Instant};

use drawloom_benches::work::Record;

use crate::Failure;

/// How frames follow on each other, and what of them is measured.
#[derive(Clone, Copy)]
pub enum Pace<'a> {
    /// Frames back to back for about so long; a sample is the mean of them, in seconds.
    Hot { turn: Duration },
    /// So many frames, one every so often; each is a sample, in seconds.
    Cold { every: Duration, frames: usize },
    /// So many frames, one every so often; a sample is the processor's time a frame, in seconds.
    Processor { every: Duration, frames: usize },
    /// One frame, and then none for so long; a sample is the processor's time a second, in seconds.
    Asleep { still: Duration },
    /// So many single jobs, each after nothing for so long; each is a sample: until it begins, in seconds.
    Wakes { still: Duration, jobs: usize },
    /// Some frames, each of which is looked at.
    Check { record: &'a Record, verdict: &'a (dyn Fn(&Record) -> Result<(), String> + Sync) },
}

/// Times frames, or checks them.
pub struct Watch<'a> {
    pace: Pace<'a>,
    samples: Vec<f64>,
}

/// Frames before those that count, back to back: this many, and more of short ones and less of long ones.
const WARM_UP: usize = 30;
const LEAST_WARM_UP: usize = 3;
const WARM_UP_TIME: [Duration; 2] = [Duration::from_millis(5), Duration::from_millis(40)];
/// The same where frames are far apart.
const COLD_WARM_UP: usize = 10;
const CHECKED_FRAMES: usize = 20;
const START: Duration = Duration::from_millis(10);

impl<'a> Watch<'a> {
    pub fn new(pace: Pace<'a>) -> Self {
        Self { pace, samples: Vec::new() }
    }

    pub fn into_samples(self) -> Vec<f64> {
        self.samples
    }

    /// Has as many frames drawn as it takes.
    ///
    /// # Errors
    /// If a frame fails, or does not do what it must.
    pub fn frames(&mut self, mut frame: impl FnMut() -> Result<(), Failure>) -> Result<(), Failure> {
        match self.pace {
            Pace::Hot { turn } => {
                let estimate = warm_up(&mut frame)?;
                // The clock is looked at so rarely that it does not show in short frames.
                let looks = 16.0;
                let between = (turn.as_secs_f64() / looks / estimate.as_secs_f64()).ceil() as usize;
                let (start, mut count) = (Instant::now(), 0);
                while start.elapsed() < turn {
                    (0..between).try_for_each(|_| frame())?;
                    count += between;
                }
                self.samples.push(start.elapsed().as_secs_f64() / count as f64);
            }
            Pace::Cold { every, frames } => {
                paced(every, COLD_WARM_UP, &mut frame)?;
                let timed = || {
                    let start = Instant::now();
                    frame()?;
                    self.samples.push(start.elapsed().as_secs_f64());
                    Ok(())
                };
                paced(every, frames, timed)?;
            }
            Pace::Processor { every, frames } => {
                paced(every, COLD_WARM_UP, &mut frame)?;
                let before = processor_time();
                paced(every, frames, &mut frame)?;
                self.samples.push((processor_time() - before).as_secs_f64() / frames as f64);
            }
            Pace::Asleep { still } => {
                // Whatever the pool does to begin with is over by then.
                thread::sleep(START);
                frame()?;
                let before = processor_time();
                thread::sleep(still);
                self.samples.push((processor_time() - before).as_secs_f64() / still.as_secs_f64());
            }
            Pace::Wakes { .. } => return Err("a row of single jobs has no frames".into()),
            Pace::Check { record, verdict } => {
                for index in 0..CHECKED_FRAMES {
                    // Every other frame finds workers that may have gone to sleep.
                    if index % 2 == 1 {
                        thread::sleep(Duration::from_millis(1));
                    }
                    record.clear();
                    frame()?;
                    verdict(record)?;
                }
            }
        }
        Ok(())
    }

    /// Has as many jobs submitted as it takes: `submit` is to submit one that calls [`Arrival::begin`], after
    /// [`Arrival::submit`] and before [`Arrival::wait`].
    ///
    /// # Errors
    /// If a job fails, or does not begin on another thread.
    pub fn wakes(&mut self, mut submit: impl FnMut(&Arc<Arrival>) -> Result<(), Failure>) -> Result<(), Failure> {
        let (still, jobs) = match self.pace {
            Pace::Wakes { still, jobs } => (still, COLD_WARM_UP + jobs),
            Pace::Check { .. } => (Duration::from_millis(2), CHECKED_FRAMES),
            _ => return Err("a row of frames has no single jobs".into()),
        };
        for job in 0..jobs {
            thread::sleep(still);
            let arrival = Arc::new(Arrival::default());
            submit(&arrival)?;
            let time = arrival.time()?;
            if job >= COLD_WARM_UP {
                self.samples.push(time.as_secs_f64());
            }
        }
        Ok(())
    }
}

/// Returns how long a frame takes, or a little less; not zero, where the clock is a coarse one.
fn warm_up(mut frame: impl FnMut() -> Result<(), Failure>) -> Result<Duration, Failure> {
    let [least, most] = WARM_UP_TIME;
    let (start, mut count) = (Instant::now(), 0);
    let mut shortest = Duration::MAX;
    loop {
        let elapsed = start.elapsed();
        if count >= LEAST_WARM_UP && elapsed >= least && (count >= WARM_UP || elapsed >= most) {
            return Ok(shortest.max(Duration::from_nanos(50)));
        }
        frame()?;
        shortest = shortest.min(start.elapsed() - elapsed);
        count += 1;
    }
}

/// Calls `frame` so many times, after a sleep each time, so that it begins once every so often.
fn paced(every: Duration, frames: usize, mut frame: impl FnMut() -> Result<(), Failure>) -> Result<(), Failure> {
    let mut next = Instant::now();
    for _ in 0..frames {
        next += every;
        thread::sleep(next.saturating_duration_since(Instant::now()));
        frame()?;
    }
    Ok(())
}

/// When one job was submitted, and when and where it began.
#[derive(Default)]
pub struct Arrival {
    submitted: OnceLock<(Instant, ThreadId)>,
    began: OnceLock<(Instant, ThreadId)>,
}

impl Arrival {
    /// What the submitter calls right before it submits.
    pub fn submit(&self) {
        let thread = thread::current().id();
        self.submitted.get_or_init(|| (Instant::now(), thread));
    }

    /// What the job calls.
    pub fn begin(&self) {
        let time = Instant::now();
        self.began.get_or_init(|| (time, thread::current().id()));
    }

    /// What the submitter calls after it has submitted: it goes on with something else, and does not help.
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

/// Of all threads of this process.
#[cfg(target_os = "linux")]
fn processor_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// No row asks for it here.
#[cfg(not(target_os = "linux"))]
fn processor_time() -> Duration {
    Duration::ZERO
}
