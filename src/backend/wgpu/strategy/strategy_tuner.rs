//! The tuner that chooses a pass's strategy by measured cost.

use super::pass_strategy::{EncodingStrategy, PassStrategy};
use crate::command::DrawList;

/// Chooses the strategy of one pass from frame to frame.
///
/// Every frame measures the strategy in use. At first, and when the pass changes much, the tuner tries each other
/// strategy for a few frames. Later it tries one of them for a single frame now and then, less often the more often it
/// lost. The tuner switches only to a strategy that is cheaper by a margin in several frames (hysteresis).
pub(crate) struct StrategyTuner {
    /// One for each strategy of the set.
    candidates: Vec<Candidate>,
    current: usize,
    trial: Option<Trial>,
    /// Whether all strategies are being tried one after the other.
    is_learning: bool,
    /// The number of batches in the latest frame, and in the frame in which learning started.
    batches: usize,
    learned_batches: usize,
    /// The running mean of the current strategy's cost. A cost far above it restarts learning.
    usual_cost: Option<f64>,
    /// For how many frames the cost has been far above the usual one.
    costly_frames: u32,
    /// Learning does not restart before this frame, so that a scene that oscillates does not restart it all the time.
    next_learning: u64,
    learning_pause: u64,
}

/// What recording a pass cost in one frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CostSample {
    /// In nanoseconds, summed over all workers.
    pub(crate) cost: f64,
    pub(crate) batches: usize,
    /// Whether the strategy's cache from earlier frames was there.
    pub(crate) is_warm: bool,
}

struct Candidate {
    samples: Samples,
    /// The first frame in which it may be tried again, and how long it is paused if it loses then.
    due: u64,
    pause: u64,
}

struct Trial {
    candidate: usize,
    begun: u64,
}

/// In frames.
const MIN_PAUSE: u64 = 64;
const MAX_PAUSE: u64 = 2048;
const MIN_LEARNING_PAUSE: u64 = 256;
const MAX_LEARNING_PAUSE: u64 = 8192;
/// A trial ends without a result after this many frames, because its frames are not submitted.
const MAX_TRIAL_FRAMES: u64 = 16;
/// A candidate replaces the current strategy if its cost is below this ratio of the current cost.
const SWITCH_RATIO: f64 = 0.9;
/// Learning restarts if the current cost is above this multiple of the usual cost for [`REGRESSION_FRAMES`] frames.
const REGRESSION_RATIO: f64 = 1.6;
/// Another program may take the processor for a few frames in a row; this is more.
const REGRESSION_FRAMES: u32 = 8;

impl StrategyTuner {
    /// A tuner for a set of `strategies` strategies.
    pub(crate) fn new(strategies: usize) -> Self {
        let candidate = || Candidate { samples: Samples::default(), due: 0, pause: MIN_PAUSE };
        Self {
            candidates: (0..strategies).map(|_| candidate()).collect(),
            current: 0,
            trial: None,
            is_learning: true,
            batches: 0,
            learned_batches: 0,
            usual_cost: None,
            costly_frames: 0,
            next_learning: 0,
            learning_pause: MIN_LEARNING_PAUSE,
        }
    }

    /// Chooses a frame's strategy: its index in `strategies`, and whether this is a trial. A frame has at most one
    /// trial outside of learning: the trial takes `may_try`.
    pub(crate) fn choose(&mut self, strategies: &[PassStrategy], frame: u64, may_try: &mut bool) -> (usize, bool) {
        if let Some(Trial { candidate, begun }) = self.trial {
            if frame < begun + MAX_TRIAL_FRAMES {
                return (candidate, true);
            }
            self.end_trial(candidate, frame);
        }
        if !self.candidates[self.current].samples.are_enough() {
            return (self.current, false);
        }
        let due = (0..self.candidates.len()).filter(|&candidate| {
            let differs = strategies[candidate].encoding != EncodingStrategy::Split
                || self.batches > 2 * DrawList::BATCHES_PER_BUNDLE;
            candidate != self.current && differs && self.candidates[candidate].due <= frame
        });
        let Some(candidate) = due.min_by_key(|&candidate| self.candidates[candidate].due) else {
            self.is_learning = false;
            return (self.current, false);
        };
        if !self.is_learning && !std::mem::take(may_try) {
            return (self.current, false);
        }
        self.candidates[candidate].samples = Samples::default();
        self.trial = Some(Trial { candidate, begun: frame });
        (candidate, true)
    }

    /// Reports the measured cost of a frame that was recorded with `strategy`.
    pub(crate) fn report(&mut self, frame: u64, strategy: usize, sample: CostSample) {
        if sample.batches == 0 {
            return;
        }
        self.batches = sample.batches;
        let (fewer, more) = (self.learned_batches.min(self.batches), self.learned_batches.max(self.batches));
        if more > 2 * fewer + DrawList::BATCHES_PER_BUNDLE / 4 && frame >= self.next_learning {
            self.start_learning(frame);
        }
        if !sample.is_warm {
            return;
        }
        self.candidates[strategy].samples.push(sample.cost / sample.batches as f64);
        match self.trial {
            Some(Trial { candidate, .. }) if candidate == strategy => self.decide_trial(strategy, frame),
            _ if strategy == self.current => self.detect_regression(frame),
            _ => {}
        }
    }

    /// Ends the trial if its samples decide it: the candidate becomes the current strategy, or loses.
    fn decide_trial(&mut self, candidate: usize, frame: u64) {
        let samples = &self.candidates[candidate].samples;
        let is_cheaper = samples.median() < self.candidates[self.current].samples.median() * SWITCH_RATIO;
        match (samples.are_enough(), is_cheaper) {
            (true, true) => {
                // Each loser is paused for longer, so two strategies of equal cost stop replacing each other.
                (self.usual_cost, self.costly_frames) = (None, 0);
                let loser = std::mem::replace(&mut self.current, candidate);
                self.end_trial(loser, frame);
            }
            (true, false) => self.end_trial(candidate, frame),
            // During learning a single frame decides nothing.
            (false, false) if !self.is_learning => self.end_trial(candidate, frame),
            (false, _) => {}
        }
    }

    /// Ends the trial, if there is one, and pauses a strategy.
    fn end_trial(&mut self, loser: usize, frame: u64) {
        self.trial = None;
        let loser = &mut self.candidates[loser];
        loser.due = frame + loser.pause;
        loser.pause = (loser.pause * 2).min(MAX_PAUSE);
    }

    /// Restarts learning if the current strategy costs far more than usual.
    fn detect_regression(&mut self, frame: u64) {
        let samples = &self.candidates[self.current].samples;
        if !samples.are_full() {
            return;
        }
        let median = samples.median();
        let usual = *self.usual_cost.get_or_insert(median);
        if median <= usual * REGRESSION_RATIO {
            self.costly_frames = 0;
            self.usual_cost = Some(usual + (median - usual) / 32.0);
            return;
        }
        self.costly_frames += 1;
        if self.costly_frames >= REGRESSION_FRAMES && frame >= self.next_learning {
            self.start_learning(frame);
        }
    }

    /// Starts to try all strategies.
    fn start_learning(&mut self, frame: u64) {
        for candidate in &mut self.candidates {
            *candidate = Candidate { samples: Samples::default(), due: frame, pause: MIN_PAUSE };
        }
        self.is_learning = true;
        self.trial = None;
        (self.usual_cost, self.costly_frames) = (None, 0);
        self.next_learning = frame + self.learning_pause;
        // The first frame with batches always starts learning, so it does not lengthen the pause.
        if self.learned_batches > 0 {
            self.learning_pause = (self.learning_pause * 2).min(MAX_LEARNING_PAUSE);
        }
        self.learned_batches = self.batches;
    }
}

/// The latest costs of a strategy, in nanoseconds per batch.
#[derive(Default)]
struct Samples {
    latest: [f64; Self::CAPACITY],
    count: usize,
}

impl Samples {
    const CAPACITY: usize = 5;

    fn push(&mut self, cost: f64) {
        self.latest[self.count % Self::CAPACITY] = cost;
        self.count += 1;
    }

    /// Whether their median tolerates one outlier.
    fn are_enough(&self) -> bool {
        self.count >= 3
    }

    fn are_full(&self) -> bool {
        self.count >= Self::CAPACITY
    }

    fn median(&self) -> f64 {
        let mut sorted = self.latest;
        let sorted = &mut sorted[..self.count.min(Self::CAPACITY)];
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(f64::INFINITY)
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use fastrand::Rng;

    use super::*;
    use crate::backend::wgpu::strategy::{RecordingStrategy, StrategySet};

    /// Simulates frames whose strategies have costs that a test sets, and counts how often each is used.
    struct Simulation {
        set: StrategySet,
        tuner: StrategyTuner,
        frame: u64,
        random: Rng,
        used: Vec<usize>,
    }

    impl Simulation {
        fn new() -> Self {
            let set = StrategySet::new(true, true);
            let tuner = StrategyTuner::new(set.strategies().len());
            Self { set, tuner, frame: 0, random: Rng::with_seed(1), used: Vec::new() }
        }

        /// Runs frames whose samples are off by up to `noise`, and one in ten of them by a factor of six.
        fn run(&mut self, frames: usize, batches: usize, noise: f64, cost: impl Fn(PassStrategy) -> f64) {
            self.used.clear();
            for _ in 0..frames {
                let is_outlier = noise > 0.0 && self.random.u8(..10) == 0;
                let factor = if is_outlier { 6.0 } else { 1.0 + noise * self.random.f64() };
                let (strategy, _) = self.tuner.choose(self.set.strategies(), self.frame, &mut true);
                let cost = cost(self.set.strategies()[strategy]) * factor * batches as f64;
                self.tuner.report(self.frame, strategy, CostSample { cost, batches, is_warm: true });
                self.used.push(strategy);
                self.frame += 1;
            }
        }

        fn switches(&self) -> usize {
            self.used.windows(2).filter(|pair| pair[0] != pair[1]).count()
        }

        fn current(&self) -> PassStrategy {
            self.set.strategies()[self.tuner.current]
        }
    }

    /// Costs of which this recording strategy with one encoder per pass has the lowest.
    fn cheapest(recording: RecordingStrategy) -> impl Fn(PassStrategy) -> f64 {
        move |strategy| {
            let is_cheapest = strategy.recording == recording && strategy.encoding == EncodingStrategy::PerPass;
            if is_cheapest { 10.0 } else { 30.0 }
        }
    }

    #[test]
    fn the_cheapest_strategy_is_found_within_thirty_frames() {
        let strategies = StrategySet::new(true, true).strategies().to_vec();
        for wanted in strategies {
            let mut simulation = Simulation::new();
            simulation.run(30, 2000, 0.2, |strategy| if strategy == wanted { 10.0 } else { 15.0 });
            assert_eq!(simulation.current(), wanted);
            assert!(!simulation.tuner.is_learning, "{wanted:?}");
        }
    }

    #[test]
    fn trials_of_a_steady_pass_are_rare() {
        let mut simulation = Simulation::new();
        simulation.run(30, 100, 0.0, cheapest(RecordingStrategy::CachedBundles));
        simulation.run(10_000, 100, 0.0, cheapest(RecordingStrategy::CachedBundles));
        let trials = simulation.used.iter().filter(|&&strategy| strategy != 0).count();
        assert!((15..=60).contains(&trials), "{trials}");
    }

    #[test]
    fn strategies_of_equal_cost_do_not_alternate() {
        let mut simulation = Simulation::new();
        simulation.run(2_000, 2000, 0.3, |_| 20.0);
        simulation.run(20_000, 2000, 0.3, |_| 20.0);
        let before = simulation.tuner.current;
        assert!(simulation.switches() < 700, "{}", simulation.switches());
        simulation.run(20_000, 2000, 0.0, |_| 20.0);
        assert_eq!(simulation.tuner.current, before);
    }

    #[test]
    fn a_slightly_cheaper_strategy_does_not_replace_the_current_one() {
        let first = StrategySet::new(true, true).strategies()[0];
        let mut simulation = Simulation::new();
        simulation.run(5_000, 2000, 0.0, |strategy| if strategy == first { 20.0 } else { 19.0 });
        assert_eq!(simulation.tuner.current, 0);
        simulation.run(5_000, 2000, 0.0, |strategy| if strategy == first { 20.0 } else { 17.0 });
        assert_ne!(simulation.tuner.current, 0);
    }

    #[test]
    fn a_strategy_that_becomes_costly_is_replaced_soon_and_returns_later() {
        use RecordingStrategy::CachedBundles;
        let mut simulation = Simulation::new();
        // Until the pauses of all other strategies are long.
        simulation.run(1_500, 2000, 0.1, cheapest(CachedBundles));
        assert_eq!(simulation.current().recording, CachedBundles);
        simulation.run(40, 2000, 0.1, |strategy| if strategy.recording == CachedBundles { 60.0 } else { 30.0 });
        assert_ne!(simulation.current().recording, CachedBundles);
        simulation.run(3_000, 2000, 0.1, cheapest(CachedBundles));
        assert_eq!(simulation.current().recording, CachedBundles);
    }

    #[test]
    fn a_much_larger_number_of_batches_restarts_learning() {
        use RecordingStrategy::{Direct, Indirect};
        let mut simulation = Simulation::new();
        simulation.run(300, 20, 0.1, cheapest(Direct));
        assert_eq!(simulation.current().recording, Direct);
        let cheaper = |strategy: PassStrategy| match strategy.recording {
            Indirect => 5.0,
            _ => cheapest(Direct)(strategy),
        };
        simulation.run(30, 5000, 0.1, cheaper);
        assert_eq!(simulation.current().recording, Indirect);
    }

    #[test]
    fn a_trial_whose_frames_are_dropped_ends() {
        let mut simulation = Simulation::new();
        simulation.run(4, 100, 0.0, |_| 10.0);
        let choose = |simulation: &mut Simulation, frame| {
            simulation.tuner.choose(simulation.set.strategies(), frame, &mut true).0
        };
        let chosen: Vec<_> = (4..4 + 8 * MAX_TRIAL_FRAMES).map(|frame| choose(&mut simulation, frame)).collect();
        assert_eq!(chosen.last(), Some(&0));
    }

    #[test]
    fn a_frame_has_at_most_one_trial() {
        let mut simulation = Simulation::new();
        let cost =
            |strategy: PassStrategy| if strategy.recording == RecordingStrategy::CachedBundles { 10.0 } else { 30.0 };
        simulation.run(30, 100, 0.0, cost);
        let mut may_try = false;
        for frame in 30..1000 {
            let chosen = simulation.tuner.choose(simulation.set.strategies(), frame, &mut may_try);
            assert_eq!(chosen, (0, false));
        }
        may_try = true;
        assert!(simulation.tuner.choose(simulation.set.strategies(), 1000, &mut may_try).1);
        assert!(!may_try);
    }
}
