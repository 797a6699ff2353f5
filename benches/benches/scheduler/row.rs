//! The rows of the table: what each contender runs, and how it is measured.

use drawloom_benches::harness::Harness;
use drawloom_benches::statistics::{median, percentile};
use drawloom_benches::work::{Record, Work};
use indicatif::ProgressBar;

use crate::Failure;
use crate::timer::{Pace, Timer};

type Run = Box<dyn FnMut(&Work, &mut Timer) -> Result<(), Failure>>;

/// An executor, and how it runs a row's jobs.
pub struct Contender {
    pub name: &'static str,
    pub workers: usize,
    /// Samples are divided by this.
    divisor: usize,
    /// Whether its task is easier than that of the others, which therefore are not compared with it.
    pub is_easier: bool,
    /// The number of jobs it runs; `None` for all of the row.
    jobs: Option<usize>,
    /// Builds a pool, times frames on it, and drops it.
    run: Run,
    /// In the unit of the row.
    samples: Vec<f64>,
}

impl Contender {
    pub fn new(
        name: &'static str,
        workers: usize,
        run: impl FnMut(&Work, &mut Timer) -> Result<(), Failure> + 'static,
    ) -> Self {
        Self { name, workers, divisor: 1, is_easier: false, jobs: None, run: Box::new(run), samples: Vec::new() }
    }

    /// Runs only this many of the row's jobs, from the first on.
    pub fn with_jobs(self, jobs: usize) -> Self {
        Self { jobs: Some(jobs), ..self }
    }

    /// Marks its task as easier than that of the others in the row.
    pub fn with_easier_task(self) -> Self {
        Self { is_easier: true, ..self }
    }

    /// Divides its samples by `divisor`.
    pub fn per(self, divisor: usize) -> Self {
        Self { divisor: self.divisor * divisor, ..self }
    }

    /// A plain loop over the first `jobs` jobs.
    pub fn plain_loop(jobs: usize) -> Self {
        let run = move |work: &Work, timer: &mut Timer| {
            timer.frames(|| {
                (0..jobs).for_each(|job| work.job(job));
                Ok(())
            })
        };
        Self::new("loop", 1, run).with_easier_task()
    }

    /// The time of the plain loop, if splitting it among the workers were free.
    pub fn ideal(jobs: usize, workers: usize) -> Self {
        Self { name: "ideal", workers, ..Self::plain_loop(jobs) }.per(workers)
    }

    fn sample(&mut self, row: &str, work: &Work, pace: Pace) -> Result<Vec<f64>, Failure> {
        let mut timer = Timer::new(pace);
        (self.run)(work, &mut timer).map_err(|failure| format!("{row}, {}: {failure}", self.name))?;
        Ok(timer.into_samples())
    }

    /// In the row's unit; zero before the first round.
    pub fn median(&self) -> f64 {
        median(self.samples.iter().copied())
    }

    /// In the row's unit; zero before the first round.
    pub fn percentile_95(&self) -> f64 {
        percentile(95, self.samples.iter().copied())
    }
}

/// Checks the order in which a frame's jobs ran.
pub type Order = Box<dyn Fn(&Record) -> Result<(), String> + Sync>;

/// A task, and the contenders that are compared at it.
pub struct Row {
    pub name: &'static str,
    pub unit: &'static str,
    /// Units in a second.
    pub scale: f64,
    pub pace: Pace<'static>,
    pub work: Work,
    /// Jobs in a frame.
    pub jobs: usize,
    /// Checks a frame. That each job runs once is checked for every row.
    pub order: Order,
    pub contenders: Vec<Contender>,
}

impl Row {
    /// Checks that each contender runs each job once, and in order.
    ///
    /// # Errors
    /// Returns an error if a contender fails or breaks one of these rules.
    pub fn check(&mut self) -> Result<(), Failure> {
        for contender in &mut self.contenders {
            let jobs = contender.jobs.unwrap_or(self.jobs);
            let recorded = self.work.recorded(self.jobs);
            let record = recorded.record().ok_or("there is no record")?;
            let check = |record: &Record| check_frame(record, jobs, &self.order);
            contender.sample(self.name, &recorded, Pace::Check { record, check: &check })?;
        }
        Ok(())
    }

    /// Runs each contender once.
    ///
    /// # Errors
    /// Returns an error if a contender fails.
    pub fn round(&mut self, harness: &mut Harness, progress: &ProgressBar) -> Result<(), Failure> {
        progress.set_message(self.name);
        let Self { name, scale, pace, work, .. } = self;
        harness.round(&mut self.contenders, |contender| {
            let scale = *scale / contender.divisor as f64;
            let samples = contender.sample(name, work, *pace)?;
            contender.samples.extend(samples.into_iter().map(|sample| sample * scale));
            Ok::<_, Failure>(())
        })?;
        Ok(())
    }
}

fn check_frame(record: &Record, jobs: usize, order: impl Fn(&Record) -> Result<(), String>) -> Result<(), String> {
    if let Some((job, runs)) = record.runs().take(jobs).enumerate().find(|&(_, runs)| runs != 1) {
        return Err(format!("job {job} of {jobs} ran {runs} times"));
    }
    order(record)
}
