//! What values of settings cost, measured in turns with the chosen ones.

use std::collections::{HashMap, VecDeque};
use std::fmt::{self, Display, Formatter};
use std::mem;
use std::time::Instant;

use drawloom::FrameStatistics;
use drawloom::quality::{Knob, Quality};

/// A value of a knob, both by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct KnobValue {
    pub knob: usize,
    pub value: usize,
}

/// What a frame takes longer with a value than with the chosen one.
#[derive(Clone, Debug, PartialEq)]
pub enum Price {
    Measured {
        /// Thread time until frames are recorded, in milliseconds.
        cpu: f64,
        /// Time between frames, in milliseconds.
        interval: f64,
    },
    /// The value does not go with the other settings: why.
    Refused(String),
}

/// The prices measured so far.
#[derive(Debug, Default)]
pub struct PriceList {
    prices: HashMap<KnobValue, Price>,
}

/// Measures values one after the other: frames with a value and frames with the chosen one take turns.
#[derive(Debug)]
pub struct Measurement {
    baseline: Quality,
    pending: VecDeque<KnobValue>,
    values: usize,
    /// The turns that are over, and the frames of the present one.
    turn: usize,
    frames: usize,
    last_frame: Option<Instant>,
    /// The sums over the present turn of CPU times and intervals, in milliseconds.
    sums: [f64; 2],
    /// The means of the turns without and with the value.
    means: [Vec<[f64; 2]>; 2],
    /// The quality that the next frame needs, unless it is set.
    next: Option<Quality>,
}

impl PriceList {
    pub fn get(&self, value: KnobValue) -> Option<&Price> {
        self.prices.get(&value)
    }

    /// Prices were measured against settings that are no longer chosen.
    pub fn clear(&mut self) {
        self.prices.clear();
    }
}

impl Measurement {
    const TURNS: usize = 6;
    /// The first frames of a turn pay for the change, and choices by measurement settle.
    const WARM_UP: usize = 12;
    /// Enough for events of every 2nd, 4th or 8th frame to have their share.
    const MEASURED: usize = 16;
    const FRAMES: usize = Self::WARM_UP + Self::MEASURED;

    /// Measures values against a quality.
    pub fn new(baseline: Quality, values: impl IntoIterator<Item = KnobValue>) -> Self {
        let pending: VecDeque<_> = values.into_iter().collect();
        Self {
            baseline,
            values: pending.len(),
            pending,
            turn: 0,
            frames: 0,
            last_frame: None,
            sums: [0.0; 2],
            means: [Vec::new(), Vec::new()],
            next: Some(baseline),
        }
    }

    /// The quality against which values are measured.
    pub fn baseline(&self) -> Quality {
        self.baseline
    }

    /// Adds a frame that was just recorded.
    pub fn add_frame(&mut self, statistics: &FrameStatistics) {
        let stages = &statistics.stages;
        let cpu = stages.visibility + stages.fill + stages.sort + stages.instance + stages.record;
        self.add_sample(cpu.as_secs_f64() * 1e3, Instant::now());
    }

    fn add_sample(&mut self, cpu: f64, now: Instant) {
        // A frame that was recorded before the turn's quality was set does not count.
        if self.next.is_some() {
            return;
        }
        let interval = self.last_frame.replace(now).map(|last| (now - last).as_secs_f64() * 1e3);
        self.frames += 1;
        if let Some(interval) = interval.filter(|_| self.frames > Self::WARM_UP) {
            self.sums = [self.sums[0] + cpu, self.sums[1] + interval];
        }
        if self.frames == Self::FRAMES {
            self.means[self.turn % 2].push(mem::take(&mut self.sums).map(|sum| sum / Self::MEASURED as f64));
            (self.turn, self.frames, self.last_frame) = (self.turn + 1, 0, None);
            self.next = Some(self.quality_of_turn());
        }
    }

    /// The quality to set before the next frame, if it changes. Adds a price to the list when it is known.
    pub fn next_quality(&mut self, prices: &mut PriceList) -> Option<Quality> {
        if self.turn == Self::TURNS {
            let [without, with] = [0, 1].map(|side| [0, 1].map(|kind| median(&self.means[side], kind)));
            self.finish(prices, Price::Measured { cpu: with[0] - without[0], interval: with[1] - without[1] });
        }
        self.next.take()
    }

    /// The renderer refused the quality.
    pub fn refuse(&mut self, prices: &mut PriceList, error: String) {
        self.finish(prices, Price::Refused(error));
    }

    /// Whether all values have a price.
    pub fn has_ended(&self) -> bool {
        self.pending.is_empty()
    }

    /// How much of it is done, from 0 to 1.
    pub fn progress(&self) -> f32 {
        let frames =
            (self.values - self.pending.len()) * Self::TURNS * Self::FRAMES + self.turn * Self::FRAMES + self.frames;
        frames as f32 / (self.values * Self::TURNS * Self::FRAMES).max(1) as f32
    }

    /// What is measured at present.
    pub fn progress_text(&self) -> String {
        self.pending.front().map_or_else(String::new, |&KnobValue { knob, value }| {
            let knob = &Knob::ALL[knob];
            format!("{}: {}", knob.name, knob.values[value].0)
        })
    }

    fn finish(&mut self, prices: &mut PriceList, price: Price) {
        if let Some(value) = self.pending.pop_front() {
            prices.prices.insert(value, price);
        }
        (self.turn, self.frames, self.last_frame) = (0, 0, None);
        (self.sums, self.means) = ([0.0; 2], [Vec::new(), Vec::new()]);
        self.next = Some(self.baseline);
    }

    fn quality_of_turn(&self) -> Quality {
        let mut quality = self.baseline;
        if self.turn % 2 == 1
            && let Some(&KnobValue { knob, value }) = self.pending.front()
        {
            (Knob::ALL[knob].values[value].1)(&mut quality);
        }
        quality
    }
}

/// For example `+0.12, −0.30 ms`.
impl Display for Price {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Measured { cpu, interval } => write!(formatter, "{}, {} ms", Signed(*cpu), Signed(*interval)),
            Self::Refused(error) => write!(formatter, "refused: {error}"),
        }
    }
}

struct Signed(f64);

impl Display for Signed {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let sign = if self.0 < 0.0 { '−' } else { '+' };
        write!(formatter, "{sign}{:.2}", self.0.abs())
    }
}

fn median(means: &[[f64; 2]], kind: usize) -> f64 {
    let mut sorted: Vec<_> = means.iter().map(|mean| mean[kind]).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    /// Runs a measurement on a renderer whose frames take as long as `costs` says, in milliseconds.
    fn measure(
        values: &[KnobValue],
        costs: impl Fn(&Quality, usize) -> [f64; 2],
        refused: Option<&Quality>,
    ) -> (PriceList, usize) {
        let mut measurement = Measurement::new(Quality::balanced(), values.iter().copied());
        let (mut prices, mut quality, mut now, mut frames) =
            (PriceList::default(), Quality::exact(), Instant::now(), 0);
        while !measurement.has_ended() {
            if let Some(next) = measurement.next_quality(&mut prices) {
                if Some(&next) == refused {
                    measurement.refuse(&mut prices, "no".into());
                } else {
                    quality = next;
                }
            }
            let [cpu, interval] = costs(&quality, frames);
            now += Duration::from_secs_f64(interval / 1e3);
            measurement.add_sample(cpu, now);
            frames += 1;
            assert!(frames < 10_000, "it does not end");
        }
        (prices, frames)
    }

    fn value_of(knob: &str, value: &str) -> KnobValue {
        let knob = Knob::ALL.iter().position(|candidate| candidate.name == knob).unwrap();
        KnobValue { knob, value: Knob::ALL[knob].values.iter().position(|(name, _)| *name == value).unwrap() }
    }

    #[test]
    fn a_price_is_the_difference_to_the_chosen_settings() {
        let (on, large) = (value_of("depth pre-pass", "on"), value_of("size of shadow maps", "4096 pixels"));
        let costs = |quality: &Quality, _| {
            let interval = if quality.shadows.side == 4096 { 9.0 } else { 5.0 };
            [if quality.depth_pre_pass { 1.5 } else { 1.25 }, interval]
        };
        let (prices, frames) = measure(&[on, large], costs, None);
        for (value, text) in [(on, "+0.25, +0.00 ms"), (large, "+0.00, +4.00 ms")] {
            assert_eq!(prices.get(value).unwrap().to_string(), text);
        }
        assert!(frames >= 2 * Measurement::TURNS * Measurement::FRAMES);
    }

    #[test]
    fn a_refused_setting_is_skipped() {
        let (on, packed) = (value_of("depth pre-pass", "on"), value_of("vertices", "packed"));
        let refused = Quality { depth_pre_pass: true, ..Quality::balanced() };
        let (prices, _) = measure(&[on, packed], |_, _| [1.0, 1.0], Some(&refused));
        assert_eq!(prices.get(on), Some(&Price::Refused("no".into())));
        assert!(matches!(prices.get(packed), Some(Price::Measured { .. })));
    }

    #[test]
    fn what_is_done_in_every_fourth_frame_costs_a_fourth() {
        let fourth = value_of("redraw interval of shadow maps", "every 4th frame");
        let costs = |quality: &Quality, frame: usize| {
            let draws_maps = frame.is_multiple_of(quality.shadows.interval as usize);
            [if draws_maps { 3.0 } else { 1.0 }, 10.0]
        };
        let (prices, _) = measure(&[fourth], costs, None);
        assert_eq!(prices.get(fourth).unwrap().to_string(), "−1.50, +0.00 ms");
    }
}
