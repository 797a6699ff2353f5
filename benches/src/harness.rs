//! Interleaves contenders, so that other activity on the machine disturbs all of them alike.

use drawloom_testing::random::Random;
use indicatif::{ProgressBar, ProgressStyle};

/// Warm-up rounds that suffice where nothing is tuned: tables grow and pipelines are created in them.
pub const WARM_UP: usize = 2;

/// The number of rounds of a harness.
#[derive(Clone, Copy, Debug)]
pub struct Rounds {
    /// Rounds at the start. Their results are dropped.
    pub warm_up: usize,
    pub measured: usize,
}

/// A round, in which each contender runs once.
#[derive(Clone, Copy, Debug)]
pub struct Round {
    index: usize,
    warm_up: usize,
}

impl Round {
    /// Its index among the measured rounds; `None` for a warm-up round.
    pub fn measured(self) -> Option<usize> {
        self.index.checked_sub(self.warm_up)
    }

    pub fn is_warm_up(self) -> bool {
        self.measured().is_none()
    }
}

/// Runs contenders in rounds.
///
/// Each round has a random order of its own: a contender that leaves the caches cold or the device busy must not always
/// precede the same one. The random numbers are the same in every process.
pub struct Harness<'a> {
    rounds: Rounds,
    random: Random,
    progress: &'a ProgressBar,
}

impl<'a> Harness<'a> {
    pub fn new(rounds: Rounds, progress: &'a ProgressBar) -> Self {
        Self { rounds, random: Random::new(), progress }
    }

    /// All rounds in order. The progress bar expects `contenders` runs in each.
    pub fn rounds(&self, contenders: usize) -> impl Iterator<Item = Round> + use<> {
        let Rounds { warm_up, measured } = self.rounds;
        self.progress.inc_length(((warm_up + measured) * contenders) as u64);
        (0..warm_up + measured).map(move |index| Round { index, warm_up })
    }

    /// Runs each contender once, and returns the results in the contenders' order.
    ///
    /// # Errors
    /// Returns the first error of `run`.
    pub fn round<C, R, E>(
        &mut self,
        contenders: &mut [C],
        mut run: impl FnMut(&mut C) -> Result<R, E>,
    ) -> Result<Vec<R>, E> {
        let mut results: Vec<_> = contenders.iter().map(|_| None).collect();
        for index in self.random.order(contenders.len()) {
            results[index] = Some(run(&mut contenders[index])?);
            self.progress.inc(1);
        }
        Ok(results.into_iter().flatten().collect())
    }

    /// Runs all rounds, and returns each contender's results of the measured ones.
    ///
    /// # Errors
    /// Returns the first error of `run`.
    pub fn measure<C, R, E>(
        &mut self,
        contenders: &mut [C],
        mut run: impl FnMut(&mut C, Round) -> Result<R, E>,
    ) -> Result<Vec<Vec<R>>, E> {
        let mut samples: Vec<_> = contenders.iter().map(|_| Vec::new()).collect();
        for round in self.rounds(contenders.len()) {
            let results = self.round(contenders, |contender| run(contender, round))?;
            if !round.is_warm_up() {
                samples.iter_mut().zip(results).for_each(|(samples, result)| samples.push(result));
            }
        }
        Ok(samples)
    }
}

/// A progress bar that counts in this unit. Its length grows with the rounds that are announced later.
pub fn progress_bar(unit: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} {prefix}, {eta} left  {msg}");
    ProgressBar::new(0).with_style(style.expect("the template is valid")).with_prefix(unit)
}
