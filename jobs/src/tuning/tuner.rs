//! A tuner: chooses among alternatives by measured cost.

use super::{Estimate, Filter, Hysteresis};

/// Chooses one of several alternatives from frame to frame.
///
/// Every frame measures the alternative in use. At first, and when the cost or the amount of work changes much, the
/// tuner learns: it tries each other alternative for a few frames, and takes the cheapest. Later it tries one of them
/// for a single frame now and then; the pause before its next trial doubles each time it loses. The tuner switches only
/// to an alternative that is cheaper by a margin in several frames.
#[derive(Clone, Debug)]
pub struct Tuner {
    candidates: Vec<Candidate>,
    current: usize,
    trial: Option<Trial>,
    /// Whether all alternatives are being tried one after the other.
    is_learning: bool,
    /// The number of units in the latest frame, and in the frame in which learning started.
    units: usize,
    learned_units: usize,
    /// For how many frames in a row the number of units has been far from that of learning.
    changed_frames: u32,
    /// Whether the current alternative's cost has shown a step since learning started.
    has_stepped: bool,
    /// Learning does not restart before this frame, so that a scene that oscillates does not restart it all the time.
    next_learning: u64,
    learning_pause: u64,
}

/// What an alternative cost in one frame.
#[derive(Clone, Copy, Debug)]
pub struct CostSample {
    /// In nanoseconds, summed over all workers.
    pub nanoseconds: f64,
    /// What the cost is divided by: batches, objects.
    pub units: usize,
    /// Whether caches are as this alternative leaves them. The sample of a frame with cold caches does not count.
    pub is_warm: bool,
}

/// An alternative.
#[derive(Clone, Debug)]
struct Candidate {
    /// Nanoseconds per unit, in its latest trial or while it is in use.
    cost: Estimate,
    /// The first frame in which it may be tried again, and how long it is paused if it loses then.
    due: u64,
    pause: u64,
    max_pause: u64,
}

#[derive(Clone, Debug)]
struct Trial {
    candidate: usize,
    begun: u64,
}

/// The average over 8 frames is steadier than the three frames of a trial, which are compared with it.
const FILTER: Filter = Filter::limiting_outliers(8.0);

/// Outside of learning, a candidate replaces the current alternative if it is cheaper by this factor.
const HYSTERESIS: Hysteresis = Hysteresis::new(1.11);

/// In frames.
const MIN_PAUSE: u64 = 64;
const MIN_LEARNING_PAUSE: u64 = 256;
const MAX_LEARNING_PAUSE: u64 = 8192;

/// A trial ends without a result after this many frames, because its frames are not submitted.
const MAX_TRIAL_FRAMES: u64 = 16;

/// Learning restarts if the number of units has more than doubled or halved since, by more than this many, for
/// [`Estimate::STEP_SAMPLES`] frames: a few units more change no cost.
const UNITS_THRESHOLD: usize = 64;

impl Tuner {
    /// A tuner that begins with the first alternative. `max_pauses` has, for each, the longest pause between two trials
    /// in frames: longer where its trials are expensive.
    pub fn new(max_pauses: impl IntoIterator<Item = u64>) -> Self {
        let candidate = |max_pause| Candidate { cost: Estimate::default(), due: 0, pause: MIN_PAUSE, max_pause };
        Self {
            candidates: max_pauses.into_iter().map(candidate).collect(),
            current: 0,
            trial: None,
            is_learning: true,
            units: 0,
            learned_units: 0,
            changed_frames: 0,
            has_stepped: false,
            next_learning: 0,
            learning_pause: MIN_LEARNING_PAUSE,
        }
    }

    /// Chooses a frame's alternative: its index, and whether this is a trial. The tuners of a frame share `may_try`:
    /// the first that begins a trial outside of learning clears it. `is_distinct` says whether an alternative, by
    /// index, differs from the others at this number of units.
    pub fn choose(
        &mut self,
        frame: u64,
        may_try: &mut bool,
        is_distinct: impl Fn(usize, usize) -> bool,
    ) -> (usize, bool) {
        if let Some(Trial { candidate, begun }) = self.trial {
            if frame < begun + MAX_TRIAL_FRAMES {
                return (candidate, true);
            }
            self.end_trial(candidate, frame);
        }
        if self.has_stepped && frame >= self.next_learning {
            self.start_learning(frame);
        }
        if !self.candidates[self.current].cost.is_settled() {
            return (self.current, false);
        }
        let due = (0..self.candidates.len()).filter(|&candidate| {
            candidate != self.current && self.candidates[candidate].due <= frame && is_distinct(candidate, self.units)
        });
        let Some(candidate) = due.min_by_key(|&candidate| self.candidates[candidate].due) else {
            self.is_learning = false;
            return (self.current, false);
        };
        if !self.is_learning && !std::mem::take(may_try) {
            return (self.current, false);
        }
        self.candidates[candidate].cost = Estimate::default();
        self.trial = Some(Trial { candidate, begun: frame });
        (candidate, true)
    }

    /// Reports the measured cost of a frame in which `alternative` was in use.
    pub fn report(&mut self, frame: u64, alternative: usize, sample: CostSample) {
        if sample.units == 0 {
            return;
        }
        self.units = sample.units;
        let (fewer, more) = (self.learned_units.min(self.units), self.learned_units.max(self.units));
        if self.learned_units == 0 {
            self.learned_units = self.units;
        } else if more <= 2 * fewer + UNITS_THRESHOLD {
            self.changed_frames = 0;
        } else {
            self.changed_frames = self.changed_frames.saturating_add(1);
            if self.changed_frames >= Estimate::STEP_SAMPLES && frame >= self.next_learning {
                self.start_learning(frame);
            }
        }
        if !sample.is_warm {
            return;
        }
        let cost = (sample.nanoseconds / sample.units as f64) as f32;
        let is_step = self.candidates[alternative].cost.add(cost, FILTER);
        if self.trial.as_ref().is_some_and(|trial| trial.candidate == alternative) {
            self.decide_trial(alternative, frame);
        } else if alternative == self.current {
            self.has_stepped |= is_step;
        }
    }

    /// Says that some alternatives cost something else from this frame on: they are measured anew, and soon.
    pub fn invalidate(&mut self, frame: u64, is_invalid: impl Fn(usize) -> bool) {
        for (_, candidate) in self.candidates.iter_mut().enumerate().filter(|(index, _)| is_invalid(*index)) {
            (candidate.cost, candidate.due, candidate.pause) = (Estimate::default(), frame, MIN_PAUSE);
        }
    }

    /// The estimated cost of each alternative in nanoseconds per unit: `None` for those that were not tried since
    /// learning started.
    pub fn costs(&self) -> impl Iterator<Item = Option<f32>> {
        self.candidates.iter().map(|candidate| candidate.cost.get())
    }

    /// Ends the trial if its samples decide it: the candidate becomes the current alternative, or loses.
    fn decide_trial(&mut self, candidate: usize, frame: u64) {
        let cost = self.candidates[candidate].cost;
        let [tried, current] = [cost, self.candidates[self.current].cost].map(|cost| cost.get().unwrap_or(f32::MAX));
        let is_cheaper = if self.is_learning { tried < current } else { HYSTERESIS.replaces(tried, current) };
        match (cost.is_settled(), is_cheaper) {
            (true, true) => {
                // Each loser is paused for longer, so two alternatives of equal cost stop replacing each other.
                let loser = std::mem::replace(&mut self.current, candidate);
                self.has_stepped = false;
                self.end_trial(loser, frame);
            }
            (true, false) => self.end_trial(candidate, frame),
            // During learning a single frame decides nothing.
            (false, false) if !self.is_learning => self.end_trial(candidate, frame),
            (false, _) => {}
        }
    }

    /// Ends the trial, if there is one, and pauses an alternative. It has not lost if it was not measured.
    fn end_trial(&mut self, loser: usize, frame: u64) {
        self.trial = None;
        let loser = &mut self.candidates[loser];
        loser.due = frame + loser.pause;
        if loser.cost.get().is_some() {
            loser.pause = (loser.pause * 2).min(loser.max_pause);
        }
    }

    /// Starts to try all alternatives.
    fn start_learning(&mut self, frame: u64) {
        for candidate in &mut self.candidates {
            (candidate.cost, candidate.due, candidate.pause) = (Estimate::default(), frame, MIN_PAUSE);
        }
        self.is_learning = true;
        self.trial = None;
        (self.has_stepped, self.changed_frames) = (false, 0);
        self.next_learning = frame + self.learning_pause;
        self.learning_pause = (self.learning_pause * 2).min(MAX_LEARNING_PAUSE);
        self.learned_units = self.units;
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use drawloom_signal::{ControllerBounds, Signal, check_controller};

    use super::*;

    const ALTERNATIVES: usize = 6;
    const MAX_PAUSE: u64 = 2048;

    /// Frames whose alternatives have costs that a test sets.
    struct Simulation {
        tuner: Tuner,
        frame: u64,
        units: usize,
        signal: Signal,
        /// The alternatives of the latest frames.
        used: Vec<usize>,
    }

    impl Simulation {
        fn new() -> Self {
            let tuner = Tuner::new([MAX_PAUSE; ALTERNATIVES]);
            Self { tuner, frame: 0, units: 2000, signal: Signal::new(1), used: Vec::new() }
        }

        /// With samples that are off by up to `noise`, and one in ten of them by a factor of six.
        fn with_noise(noise: f32) -> Self {
            Self { signal: Signal::new(1).with_noise(noise).with_outliers(10, 6.0), ..Self::new() }
        }

        fn run(&mut self, frames: usize, cost: impl Fn(usize) -> f32) {
            self.used.clear();
            for _ in 0..frames {
                let alternative = frame(&mut self.tuner, self.frame, self.units, &mut self.signal, &cost);
                self.used.push(alternative);
                self.frame += 1;
            }
        }

        fn switches(&self) -> usize {
            self.used.windows(2).filter(|pair| pair[0] != pair[1]).count()
        }
    }

    /// Runs one frame, and returns its alternative.
    fn frame(tuner: &mut Tuner, frame: u64, units: usize, signal: &mut Signal, cost: impl Fn(usize) -> f32) -> usize {
        let (alternative, _) = tuner.choose(frame, &mut true, |_, _| true);
        let nanoseconds = f64::from(signal.sample(cost(alternative))) * units as f64;
        tuner.report(frame, alternative, CostSample { nanoseconds, units, is_warm: true });
        alternative
    }

    /// Costs of which that of one alternative is the lowest.
    fn cheapest(alternative: usize) -> impl Fn(usize) -> f32 {
        move |other| if other == alternative { 10.0 } else { 30.0 }
    }

    #[test]
    fn it_settles_does_not_flap_and_recovers() {
        let bounds = ControllerBounds { settles_within: [30, 60, 2200], max_wrong: 60, max_changes: 80 };
        let controller = || (Tuner::new([MAX_PAUSE; ALTERNATIVES]), 0);
        let cost = |alternative, is_after| match (alternative, is_after) {
            (0, false) => 10.0,
            (0, true) => 60.0,
            (3, _) => 20.0,
            _ => 30.0,
        };
        check_controller(
            &bounds,
            controller,
            |(tuner, number), is_after, signal| {
                *number += 1;
                frame(tuner, *number - 1, 2000, signal, |alternative| cost(alternative, is_after))
            },
            |&alternative, is_after| alternative == if is_after { 3 } else { 0 },
        );
    }

    #[test]
    fn the_cheapest_alternative_is_found_within_thirty_frames() {
        for wanted in 0..ALTERNATIVES {
            let mut simulation = Simulation::with_noise(0.2);
            simulation.run(30, |alternative| if alternative == wanted { 10.0 } else { 15.0 });
            assert_eq!(simulation.tuner.current, wanted);
            assert!(!simulation.tuner.is_learning, "{wanted}");
        }
    }

    #[test]
    fn learning_takes_the_cheapest_alternative_however_little_it_saves() {
        let mut simulation = Simulation::new();
        simulation.run(30, |alternative| if alternative == 2 { 19.0 } else { 20.0 });
        assert_eq!(simulation.tuner.current, 2);
    }

    #[test]
    fn trials_of_a_steady_cost_are_rare() {
        let mut simulation = Simulation::new();
        simulation.run(30, cheapest(0));
        simulation.run(10_000, cheapest(0));
        let trials = simulation.used.iter().filter(|&&alternative| alternative != 0).count();
        assert!((15..=60).contains(&trials), "{trials}");
    }

    #[test]
    fn alternatives_of_equal_cost_do_not_alternate() {
        let mut simulation = Simulation::with_noise(0.3);
        simulation.run(2_000, |_| 20.0);
        simulation.run(20_000, |_| 20.0);
        let before = simulation.tuner.current;
        assert!(simulation.switches() < 700, "{}", simulation.switches());
        simulation.signal = Signal::new(1);
        simulation.run(20_000, |_| 20.0);
        assert_eq!(simulation.tuner.current, before);
    }

    #[test]
    fn a_slightly_cheaper_alternative_does_not_replace_the_current_one() {
        let mut simulation = Simulation::new();
        simulation.run(100, |_| 20.0);
        simulation.run(5_000, |alternative| if alternative == 0 { 20.0 } else { 19.0 });
        assert_eq!(simulation.tuner.current, 0);
        simulation.run(5_000, |alternative| if alternative == 0 { 20.0 } else { 17.0 });
        assert_ne!(simulation.tuner.current, 0);
    }

    #[test]
    fn an_alternative_that_becomes_costly_is_replaced_soon_and_returns_later() {
        let mut simulation = Simulation::with_noise(0.1);
        // Until the pauses of all other alternatives are long.
        simulation.run(1_500, cheapest(0));
        assert_eq!(simulation.tuner.current, 0);
        simulation.run(40, |alternative| if alternative == 0 { 60.0 } else { 30.0 });
        assert_ne!(simulation.tuner.current, 0);
        simulation.run(3_000, cheapest(0));
        assert_eq!(simulation.tuner.current, 0);
    }

    #[test]
    fn many_more_units_restart_learning() {
        let mut simulation = Simulation { units: 20, ..Simulation::with_noise(0.1) };
        simulation.run(300, cheapest(1));
        assert_eq!(simulation.tuner.current, 1);
        simulation.units = 5000;
        simulation.run(30, |alternative| if alternative == 4 { 5.0 } else { cheapest(1)(alternative) });
        assert_eq!(simulation.tuner.current, 4);
    }

    #[test]
    fn a_step_during_the_pause_of_learning_is_not_lost() {
        for factor in [1.8, 6.0] {
            let mut simulation = Simulation::new();
            simulation.run(1500, cheapest(0));
            // Each step makes the tuner learn. The second one falls into the pause after the first.
            simulation.run(60, |alternative| if alternative == 0 { 10.0 * factor } else { 30.0 * factor });
            let mut frames = 0;
            while simulation.tuner.current == 0 && frames < 400 {
                simulation.run(1, |alternative| if alternative == 0 { 10.0 * factor * factor } else { 11.0 * factor });
                frames += 1;
            }
            assert!(frames < MIN_LEARNING_PAUSE, "{factor}: {frames}");
        }
    }

    #[test]
    fn a_frame_with_more_units_does_not_restart_learning() {
        let mut simulation = Simulation::with_noise(0.1);
        simulation.run(600, cheapest(1));
        simulation.units = 10_000;
        simulation.run(Estimate::STEP_SAMPLES as usize - 1, cheapest(1));
        simulation.units = 2000;
        simulation.run(1, cheapest(1));
        assert!(!simulation.tuner.is_learning);
    }

    #[test]
    fn an_alternative_without_use_is_never_tried() {
        let mut tuner = Tuner::new([MAX_PAUSE; 3]);
        for frame in 0..1000 {
            let (alternative, _) = tuner.choose(frame, &mut true, |candidate, units| candidate != 2 && units == 10);
            assert_ne!(alternative, 2);
            let nanoseconds = if alternative == 1 { 10.0 } else { 100.0 };
            tuner.report(frame, alternative, CostSample { nanoseconds, units: 10, is_warm: true });
        }
        assert_eq!(tuner.current, 1);
    }

    #[test]
    fn a_cold_sample_and_an_empty_frame_change_nothing() {
        let mut tuner = Tuner::new([MAX_PAUSE; 2]);
        for (units, is_warm) in [(10, false), (0, true)] {
            tuner.report(0, 0, CostSample { nanoseconds: 1e9, units, is_warm });
            assert!(tuner.costs().all(|cost| cost.is_none()));
        }
    }

    #[test]
    fn an_alternative_that_becomes_cheaper_is_tried_at_once_if_the_tuner_is_told() {
        for is_told in [false, true] {
            let mut simulation = Simulation::new();
            simulation.run(100, |alternative| if alternative == 0 { 40.0 } else { 30.0 });
            assert_ne!(simulation.tuner.current, 0);
            if is_told {
                simulation.tuner.invalidate(simulation.frame, |alternative| alternative == 0);
            }
            simulation.run(8, cheapest(0));
            assert_eq!(simulation.tuner.current == 0, is_told, "{:?}", simulation.used);
        }
        // One that is in use stays in use, and no other is tried.
        let mut simulation = Simulation::new();
        simulation.run(100, cheapest(2));
        let switches = simulation.switches();
        simulation.tuner.invalidate(simulation.frame, |alternative| alternative == 2);
        simulation.run(8, cheapest(2));
        assert_eq!((simulation.switches(), simulation.used[0]), (0, 2), "{switches}");
    }

    #[test]
    fn a_trial_whose_frames_are_dropped_ends() {
        let mut simulation = Simulation::new();
        simulation.run(4, |_| 10.0);
        let choose = |frame| simulation.tuner.choose(frame, &mut true, |_, _| true).0;
        let chosen: Vec<_> = (4..4 + 20 * MAX_TRIAL_FRAMES).map(choose).collect();
        let longest = chosen.chunk_by(PartialEq::eq).filter(|run| run[0] != 0).map(<[_]>::len).max();
        assert_eq!(longest, Some(MAX_TRIAL_FRAMES as usize), "{chosen:?}");
        assert!(chosen.contains(&0), "{chosen:?}");
    }

    #[test]
    fn a_frame_has_at_most_one_trial() {
        let mut simulation = Simulation::new();
        simulation.run(30, cheapest(0));
        let mut may_try = false;
        for frame in 30..1000 {
            assert_eq!(simulation.tuner.choose(frame, &mut may_try, |_, _| true), (0, false));
        }
        may_try = true;
        assert!(simulation.tuner.choose(1000, &mut may_try, |_, _| true).1);
        assert!(!may_try);
    }
}
