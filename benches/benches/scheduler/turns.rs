//! Contenders that take turns.

use drawloom_benches::work::{Record, Work};
use drawloom_testing::random::Random;
use indicatif::ProgressBar;

use crate::watch::{Pace, Watch};
use crate::{Failure, WORKERS};

type Turn = Box<dyn FnMut(&Work, &mut Watch) -> Result<(), Failure>>;

/// One of those that are compared in a row.
pub struct Contender {
    pub name: &'static str,
    pub workers: usize,
    /// Into how many parts a sample is split.
    parts: usize,
    /// Whether it has an easier task than the others, so that nobody can be compared with it.
    pub is_easier: bool,
    /// How many jobs it runs, if not those of the row.
    jobs: Option<usize>,
    /// Builds its pool, has frames of this work timed, and drops the pool.
    turn: Turn,
    /// In the unit of the row.
    samples: Vec<f64>,
}

impl Contender {
    /// One with [`WORKERS`].
    pub fn new(name: &'static str, turn: impl FnMut(&Work, &mut Watch) -> Result<(), Failure> + 'static) -> Self {
        Self {
            name,
            workers: WORKERS,
            parts: 1,
            is_easier: false,
            jobs: None,
            turn: Box::new(turn),
            samples: Vec::new(),
        }
    }

    /// With so many workers.
    pub fn with_workers(self, workers: usize) -> Self {
        Self { workers, ..self }
    }

    /// One that runs the first so many jobs of its row only.
    pub fn with_jobs(self, jobs: usize) -> Self {
        Self { jobs: Some(jobs), ..self }
    }

    /// One that has an easier task than the others of its row.
    pub fn with_easier_task(self) -> Self {
        Self { is_easier: true, ..self }
    }

    /// One whose samples are a part's only.
    pub fn split(self, parts: usize) -> Self {
        Self { parts: self.parts * parts, ..self }
    }

    /// The plain loop over so many jobs.
    pub fn plain_loop(jobs: usize) -> Self {
        let turn = move |work: &Work, watch: &mut Watch| {
            watch.frames(|| {
                (0..jobs).for_each(|job| work.job(job));
                Ok(())
            })
        };
        Self::new("loop", turn).with_workers(1).with_easier_task()
    }

    /// What the plain loop would take if it cost nothing to share it out.
    pub fn ideal(jobs: usize) -> Self {
        Self { name: "ideal", workers: WORKERS, ..Self::plain_loop(jobs) }.split(WORKERS)
    }

    fn take_turn(&mut self, row: &str, work: &Work, pace: Pace) -> Result<Vec<f64>, Failure> {
        let mut watch = Watch::new(pace);
        (self.turn)(work, &mut watch).map_err(|failure| format!("{row}, {}: {failure}", self.name))?;
        Ok(watch.into_samples())
    }

    /// What was measured, in the row's unit: the one in the middle; of an even number, the later of the two. Zero of none.
    pub fn median(&self) -> f64 {
        let sorted = self.sorted();
        sorted.get(sorted.len() / 2).copied().unwrap_or_default()
    }

    /// What 95 of 100 do not exceed, in the row's unit. Zero of none.
    pub fn percentile_95(&self) -> f64 {
        let sorted = self.sorted();
        let rank = (sorted.len() * 95).div_ceil(100);
        sorted.get(rank.saturating_sub(1)).copied().unwrap_or_default()
    }

    fn sorted(&self) -> Vec<f64> {
        let mut sorted = self.samples.clone();
        sorted.sort_by(f64::total_cmp);
        sorted
    }
}

/// Says what is wrong with the order in which a frame's jobs ran.
pub type Order = Box<dyn Fn(&Record) -> Result<(), String> + Sync>;

/// Who is compared, and in what.
pub struct Row {
    pub name: &'static str,
    pub unit: &'static str,
    /// Of the unit in a second.
    pub scale: f64,
    pub pace: Pace<'static>,
    pub work: Work,
    /// How many jobs a frame has.
    pub jobs: usize,
    /// What must hold of a frame, beyond that each job ran once.
    pub order: Order,
    pub contenders: Vec<Contender>,
}

impl Row {
    /// # Errors
    /// If a contender fails, or does not do what it must.
    pub fn check(&mut self) -> Result<(), Failure> {
        for contender in &mut self.contenders {
            let jobs = contender.jobs.unwrap_or(self.jobs);
            let recorded = self.work.recorded(self.jobs);
            let record = recorded.record().ok_or("there is no record")?;
            let verdict = |record: &Record| verdict(record, jobs, &self.order);
            contender.take_turn(self.name, &recorded, Pace::Check { record, verdict: &verdict })?;
        }
        Ok(())
    }

    /// Lets each contender take a turn. Each round has an order of its own, so that it is not always the same one that comes
    /// after one that left the machine in disorder.
    ///
    /// # Errors
    /// If a contender fails.
    pub fn round(&mut self, random: &mut Random, progress: &ProgressBar) -> Result<(), Failure> {
        progress.set_message(self.name);
        for index in random.order(self.contenders.len()) {
            let contender = &mut self.contenders[index];
            let scale = self.scale / contender.parts as f64;
            let samples = contender.take_turn(self.name, &self.work, self.pace)?;
            contender.samples.extend(samples.into_iter().map(|sample| sample * scale));
            progress.inc(1);
        }
        Ok(())
    }
}

fn verdict(record: &Record, jobs: usize, order: impl Fn(&Record) -> Result<(), String>) -> Result<(), String> {
    if let Some((job, runs)) = record.runs().take(jobs).enumerate().find(|&(_, runs)| runs != 1) {
        return Err(format!("job {job} of {jobs} ran {runs} times"));
    }
    order(record)
}
