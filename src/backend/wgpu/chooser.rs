//! Which way a pass is recorded, by what each way was measured to cost.

use super::ways::{Encode, Way};
use crate::command::DrawList;

/// Chooses a way for one pass from frame to frame.
///
/// The way in use is measured in every frame. At first, and when the pass has become another, each of the others is tried for
/// a few frames; later one of them for a frame now and then, and the longer it has been dearer the seldomer. Another way is
/// taken only if it is cheaper by a margin, several times.
pub(super) struct Chooser {
    /// One for each way that is offered.
    candidates: Vec<Candidate>,
    current: usize,
    trial: Option<Trial>,
    /// Whether all ways are being tried one after the other.
    is_learning: bool,
    /// The number of batches in the latest frame, and in the one that learning began with.
    batches: usize,
    learned_batches: usize,
    /// What the way in use costs as a rule: a cost far above it is a reason to learn anew.
    usual: Option<f64>,
    /// For how many frames it has cost far more.
    dear: u32,
    /// Not before this frame, lest a scene that goes to and fro is never left alone.
    next_learning: u64,
    learning_pause: u64,
}

/// What a frame has spent on a pass.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// In nanoseconds, over all workers.
    pub(super) price: f64,
    pub(super) batches: usize,
    /// Whether what this way keeps from frame to frame was there.
    pub(super) is_warm: bool,
}

struct Candidate {
    samples: Samples,
    /// The frame in which it may be tried again, and how long it then has to wait if it fails.
    due: u64,
    pause: u64,
}

struct Trial {
    candidate: usize,
    begun: u64,
}

/// In frames.
const SHORTEST_PAUSE: u64 = 64;
const LONGEST_PAUSE: u64 = 2048;
const SHORTEST_LEARNING_PAUSE: u64 = 256;
const LONGEST_LEARNING_PAUSE: u64 = 8192;
/// A trial that tells nothing for so long, because its frames are not submitted, is given up.
const LONGEST_TRIAL: u64 = 16;
/// How much cheaper another way must be.
const MARGIN: f64 = 0.9;
/// How much dearer than usual the way in use must become for all to be tried again.
const ALARM: f64 = 1.6;
/// And for how many frames: a few may come one after the other in which somebody else had the processor.
const ALARMED_FRAMES: u32 = 8;

impl Chooser {
    pub(super) fn new(ways: usize) -> Self {
        let candidate = || Candidate { samples: Samples::default(), due: 0, pause: SHORTEST_PAUSE };
        Self {
            candidates: (0..ways).map(|_| candidate()).collect(),
            current: 0,
            trial: None,
            is_learning: true,
            batches: 0,
            learned_batches: 0,
            usual: None,
            dear: 0,
            next_learning: 0,
            learning_pause: SHORTEST_LEARNING_PAUSE,
        }
    }

    /// The way of a frame, by its index among those offered; and whether it is only tried. `may_try` is taken by a trial that
    /// could as well be another frame's.
    pub(super) fn choose(&mut self, offered: &[Way], frame: u64, may_try: &mut bool) -> (usize, bool) {
        if let Some(Trial { candidate, begun }) = self.trial {
            if frame < begun + LONGEST_TRIAL {
                return (candidate, true);
            }
            self.give_up(candidate, frame);
        }
        if !self.candidates[self.current].samples.are_telling() {
            return (self.current, false);
        }
        let due = (0..self.candidates.len()).filter(|&candidate| {
            let differs = offered[candidate].encode != Encode::Split || self.batches > 2 * DrawList::BATCHES_PER_BUNDLE;
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

    /// Takes down what a frame that was recorded in a way has spent.
    pub(super) fn note(&mut self, frame: u64, way: usize, sample: Sample) {
        if sample.batches == 0 {
            return;
        }
        self.batches = sample.batches;
        let (few, many) = (self.learned_batches.min(self.batches), self.learned_batches.max(self.batches));
        if many > 2 * few + DrawList::BATCHES_PER_BUNDLE / 4 && frame >= self.next_learning {
            self.learn(frame);
        }
        if !sample.is_warm {
            return;
        }
        self.candidates[way].samples.push(sample.price / sample.batches as f64);
        match self.trial {
            Some(Trial { candidate, .. }) if candidate == way => self.judge(way, frame),
            _ if way == self.current => self.watch(frame),
            _ => {}
        }
    }

    /// Whether a trial has said enough, and what.
    fn judge(&mut self, candidate: usize, frame: u64) {
        let samples = &self.candidates[candidate].samples;
        let is_cheaper = samples.median() < self.candidates[self.current].samples.median() * MARGIN;
        match (samples.are_telling(), is_cheaper) {
            (true, true) => {
                // Who loses has to wait longer each time: two that are as good do not change places for ever.
                (self.usual, self.dear) = (None, 0);
                let loser = std::mem::replace(&mut self.current, candidate);
                self.give_up(loser, frame);
            }
            (true, false) => self.give_up(candidate, frame),
            // While all are tried a single frame decides nothing.
            (false, false) if !self.is_learning => self.give_up(candidate, frame),
            (false, _) => {}
        }
    }

    /// Ends the trial, if there is one, and leaves a way alone for a while.
    fn give_up(&mut self, loser: usize, frame: u64) {
        self.trial = None;
        let loser = &mut self.candidates[loser];
        loser.due = frame + loser.pause;
        loser.pause = (loser.pause * 2).min(LONGEST_PAUSE);
    }

    /// Looks whether the way in use still costs what it did.
    fn watch(&mut self, frame: u64) {
        let samples = &self.candidates[self.current].samples;
        if !samples.are_whole() {
            return;
        }
        let median = samples.median();
        let usual = *self.usual.get_or_insert(median);
        if median <= usual * ALARM {
            self.dear = 0;
            self.usual = Some(usual + (median - usual) / 32.0);
            return;
        }
        self.dear += 1;
        if self.dear >= ALARMED_FRAMES && frame >= self.next_learning {
            self.learn(frame);
        }
    }

    /// Begins to try all ways.
    fn learn(&mut self, frame: u64) {
        for candidate in &mut self.candidates {
            *candidate = Candidate { samples: Samples::default(), due: frame, pause: SHORTEST_PAUSE };
        }
        self.is_learning = true;
        self.trial = None;
        (self.usual, self.dear) = (None, 0);
        self.next_learning = frame + self.learning_pause;
        // The first time is the first there is anything to learn from.
        if self.learned_batches > 0 {
            self.learning_pause = (self.learning_pause * 2).min(LONGEST_LEARNING_PAUSE);
        }
        self.learned_batches = self.batches;
    }
}

/// The latest costs of a way, in nanoseconds a batch.
#[derive(Default)]
struct Samples {
    latest: [f64; Self::MOST],
    count: usize,
}

impl Samples {
    const MOST: usize = 5;

    fn push(&mut self, cost: f64) {
        self.latest[self.count % Self::MOST] = cost;
        self.count += 1;
    }

    /// Whether one of them may be off without any harm.
    fn are_telling(&self) -> bool {
        self.count >= 3
    }

    fn are_whole(&self) -> bool {
        self.count >= Self::MOST
    }

    fn median(&self) -> f64 {
        let mut sorted = self.latest;
        let sorted = &mut sorted[..self.count.min(Self::MOST)];
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(f64::INFINITY)
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;
    use crate::backend::wgpu::ways::Ways;

    /// Ways with costs that a test sets, and how often each is taken.
    struct Play {
        ways: Ways,
        chooser: Chooser,
        frame: u64,
        noise: u64,
        taken: Vec<usize>,
    }

    impl Play {
        fn new() -> Self {
            let ways = Ways::new(true, true);
            let (chooser, taken) = (ways.chooser(), Vec::new());
            Self { ways, chooser, frame: 0, noise: 0x9E37_79B9_7F4A_7C15, taken }
        }

        /// Runs frames, in which a sample is off by as much as `noise`, and one in ten by a factor of six.
        fn run(&mut self, frames: usize, batches: usize, noise: f64, cost: impl Fn(Way) -> f64) {
            self.taken.clear();
            for _ in 0..frames {
                self.noise ^= self.noise << 13;
                self.noise ^= self.noise >> 7;
                self.noise ^= self.noise << 17;
                let share = (self.noise >> 11) as f64 / (1_u64 << 53) as f64;
                let off = if noise > 0.0 && self.noise.is_multiple_of(10) { 6.0 } else { 1.0 + noise * share };
                let (way, _) = self.chooser.choose(self.ways.offered(), self.frame, &mut true);
                let price = cost(self.ways.offered()[way]) * off * batches as f64;
                self.chooser.note(self.frame, way, Sample { price, batches, is_warm: true });
                self.taken.push(way);
                self.frame += 1;
            }
        }

        fn changes(&self) -> usize {
            self.taken.windows(2).filter(|pair| pair[0] != pair[1]).count()
        }

        fn last(&self) -> Way {
            self.ways.offered()[self.chooser.current]
        }
    }

    fn cheapest(record: super::super::ways::Record) -> impl Fn(Way) -> f64 {
        move |way| if way.record == record && way.encode == Encode::PerPass { 10.0 } else { 30.0 }
    }

    #[test]
    fn the_cheapest_way_is_found_within_thirty_frames() {
        let offered = Ways::new(true, true).offered().to_vec();
        for wanted in offered {
            let mut play = Play::new();
            play.run(30, 2000, 0.2, |way| if way == wanted { 10.0 } else { 15.0 });
            assert_eq!(play.last(), wanted);
            assert!(!play.chooser.is_learning, "{wanted:?}");
        }
    }

    #[test]
    fn a_steady_pass_is_seldom_disturbed() {
        use super::super::ways::Record;
        let mut play = Play::new();
        play.run(30, 100, 0.0, cheapest(Record::Kept));
        play.run(10_000, 100, 0.0, cheapest(Record::Kept));
        let tried = play.taken.iter().filter(|&&way| way != 0).count();
        assert!((15..=60).contains(&tried), "{tried}");
    }

    #[test]
    fn ways_that_cost_the_same_do_not_take_turns() {
        let mut play = Play::new();
        play.run(2_000, 2000, 0.3, |_| 20.0);
        play.run(20_000, 2000, 0.3, |_| 20.0);
        let before = play.chooser.current;
        assert!(play.changes() < 700, "{}", play.changes());
        play.run(20_000, 2000, 0.0, |_| 20.0);
        assert_eq!(play.chooser.current, before);
    }

    #[test]
    fn a_little_cheaper_is_not_enough() {
        let mut play = Play::new();
        play.run(5_000, 2000, 0.0, |way| if way == Ways::new(true, true).offered()[0] { 20.0 } else { 19.0 });
        assert_eq!(play.chooser.current, 0);
        play.run(5_000, 2000, 0.0, |way| if way == Ways::new(true, true).offered()[0] { 20.0 } else { 17.0 });
        assert_ne!(play.chooser.current, 0);
    }

    #[test]
    fn what_becomes_dear_is_left_soon_and_taken_again() {
        use super::super::ways::Record;
        let mut play = Play::new();
        // For so long that all others are tried seldom.
        play.run(1_500, 2000, 0.1, cheapest(Record::Kept));
        assert_eq!(play.last().record, Record::Kept);
        play.run(40, 2000, 0.1, |way| if way.record == Record::Kept { 60.0 } else { 30.0 });
        assert_ne!(play.last().record, Record::Kept);
        play.run(3_000, 2000, 0.1, cheapest(Record::Kept));
        assert_eq!(play.last().record, Record::Kept);
    }

    #[test]
    fn another_number_of_batches_is_learned_anew() {
        use super::super::ways::Record;
        let mut play = Play::new();
        play.run(300, 20, 0.1, cheapest(Record::Direct));
        assert_eq!(play.last().record, Record::Direct);
        let cheaper = |way: Way| if way.record == Record::Indirect { 5.0 } else { cheapest(Record::Direct)(way) };
        play.run(30, 5000, 0.1, cheaper);
        assert_eq!(play.last().record, Record::Indirect);
    }

    #[test]
    fn a_trial_whose_frames_are_dropped_ends() {
        let mut play = Play::new();
        play.run(4, 100, 0.0, |_| 10.0);
        let chosen = |play: &mut Play, frame| play.chooser.choose(play.ways.offered(), frame, &mut true).0;
        let tried: Vec<_> = (4..4 + 8 * LONGEST_TRIAL).map(|frame| chosen(&mut play, frame)).collect();
        assert_eq!(tried.last(), Some(&0));
    }

    #[test]
    fn one_trial_a_frame_is_enough() {
        let mut play = Play::new();
        play.run(30, 100, 0.0, |way| if way.record == super::super::ways::Record::Kept { 10.0 } else { 30.0 });
        let mut may_try = false;
        for frame in 30..1000 {
            assert_eq!(play.chooser.choose(play.ways.offered(), frame, &mut may_try), (0, false));
        }
        may_try = true;
        assert!(play.chooser.choose(play.ways.offered(), 1000, &mut may_try).1);
        assert!(!may_try);
    }
}
