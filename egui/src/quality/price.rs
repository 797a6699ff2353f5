//! What settings of the quality cost, measured in turns with the chosen ones.

use std::collections::{HashMap, VecDeque};
use std::fmt::{self, Display, Formatter};
use std::time::Instant;

use drawloom::FrameStatistics;
use drawloom::quality::Quality;

use super::knobs::KNOBS;

/// A value of a knob, by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Setting {
    pub knob: usize,
    pub index: usize,
}

/// What a frame takes longer with a setting than without.
#[derive(Clone, Debug, PartialEq)]
pub enum Price {
    Measured {
        /// Thread time until frames are recorded, in milliseconds.
        cpu: f64,
        /// Time between frames, in milliseconds.
        interval: f64,
    },
    /// The setting does not go with the others.
    Refused(String),
}

/// The prices measured so far.
#[derive(Debug, Default)]
pub struct PriceList {
    prices: HashMap<Setting, Price>,
}

/// Measures settings one after the other: frames with a setting and frames without take turns.
#[derive(Debug)]
pub struct Measurement {
    baseline: Quality,
    pending: VecDeque<Setting>,
    settings: usize,
    /// The turns and the frames of the present turn that are over.
    turn: usize,
    frames: usize,
    last_frame: Option<Instant>,
    /// CPU time and interval of frames without and with the setting, in milliseconds.
    samples: [Vec<[f64; 2]>; 2],
    /// The quality that the next frame needs, unless it is set.
    next: Option<Quality>,
}

impl PriceList {
    pub fn get(&self, setting: Setting) -> Option<&Price> {
        self.prices.get(&setting)
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
    const FRAMES: usize = 24;

    /// Measures settings against a quality.
    pub fn new(baseline: Quality, settings: impl IntoIterator<Item = Setting>) -> Self {
        let pending: VecDeque<_> = settings.into_iter().collect();
        Self {
            baseline,
            settings: pending.len(),
            pending,
            turn: 0,
            frames: 0,
            last_frame: None,
            samples: [Vec::new(), Vec::new()],
            next: Some(baseline),
        }
    }

    /// The quality against which settings are measured.
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
            self.samples[self.turn % 2].push([cpu, interval]);
        }
        if self.frames == Self::FRAMES {
            (self.turn, self.frames, self.last_frame) = (self.turn + 1, 0, None);
            self.next = Some(self.quality_of_turn());
        }
    }

    /// The quality to set before the next frame, if it changes. Adds a price to the list when it is known.
    pub fn next_quality(&mut self, prices: &mut PriceList) -> Option<Quality> {
        if self.turn == Self::TURNS {
            let [without, with] = [0, 1].map(|side| [0, 1].map(|value| median(&self.samples[side], value)));
            self.finish(prices, Price::Measured { cpu: with[0] - without[0], interval: with[1] - without[1] });
        }
        self.next.take()
    }

    /// The renderer refused the quality.
    pub fn refuse(&mut self, prices: &mut PriceList, error: String) {
        self.finish(prices, Price::Refused(error));
    }

    /// Whether all settings have a price.
    pub fn has_ended(&self) -> bool {
        self.pending.is_empty()
    }

    /// How much of it is done, from 0 to 1.
    pub fn progress(&self) -> f32 {
        let frames =
            (self.settings - self.pending.len()) * Self::TURNS * Self::FRAMES + self.turn * Self::FRAMES + self.frames;
        frames as f32 / (self.settings * Self::TURNS * Self::FRAMES).max(1) as f32
    }

    /// What is measured at present.
    pub fn progress_text(&self) -> String {
        self.pending.front().map_or_else(String::new, |setting| {
            let knob = &KNOBS[setting.knob];
            format!("{}: {}", knob.name, knob.settings[setting.index].0)
        })
    }

    fn finish(&mut self, prices: &mut PriceList, price: Price) {
        if let Some(setting) = self.pending.pop_front() {
            prices.prices.insert(setting, price);
        }
        (self.turn, self.frames, self.last_frame) = (0, 0, None);
        self.samples = [Vec::new(), Vec::new()];
        self.next = Some(self.baseline);
    }

    fn quality_of_turn(&self) -> Quality {
        let mut quality = self.baseline;
        if self.turn % 2 == 1
            && let Some(setting) = self.pending.front()
        {
            (KNOBS[setting.knob].settings[setting.index].1)(&mut quality);
        }
        quality
    }
}

/// For example `+0.12, −0.30 ms`.
impl Display for Price {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Measured { cpu, interval } => write!(formatter, "{}, {} ms", Signed(*cpu), Signed(*interval)),
            Self::Refused(_) => write!(formatter, "not with the other settings"),
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

fn median(samples: &[[f64; 2]], value: usize) -> f64 {
    let mut sorted: Vec<_> = samples.iter().map(|sample| sample[value]).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    /// Runs a measurement on a renderer whose frames take as long as `costs` says, in milliseconds.
    fn measure(
        settings: &[Setting],
        costs: impl Fn(&Quality) -> [f64; 2],
        refused: Option<&Quality>,
    ) -> (PriceList, usize) {
        let mut measurement = Measurement::new(Quality::balanced(), settings.iter().copied());
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
            let [cpu, interval] = costs(&quality);
            now += Duration::from_secs_f64(interval / 1e3);
            measurement.add_sample(cpu, now);
            frames += 1;
            assert!(frames < 10_000, "it does not end");
        }
        (prices, frames)
    }

    fn setting(knob: &str, value: &str) -> Setting {
        let knob = KNOBS.iter().position(|candidate| candidate.name == knob).unwrap();
        Setting { knob, index: KNOBS[knob].settings.iter().position(|(name, _)| *name == value).unwrap() }
    }

    #[test]
    fn a_price_is_the_difference_to_the_chosen_settings() {
        let (on, large) = (setting("depth pre-pass", "on"), setting("size of shadow maps", "4096"));
        let costs = |quality: &Quality| {
            let interval = if quality.shadows.side == 4096 { 9.0 } else { 5.0 };
            [if quality.depth_pre_pass { 1.5 } else { 1.25 }, interval]
        };
        let (prices, frames) = measure(&[on, large], costs, None);
        for (setting, text) in [(on, "+0.25, +0.00 ms"), (large, "+0.00, +4.00 ms")] {
            assert_eq!(prices.get(setting).unwrap().to_string(), text);
        }
        assert!(frames >= 2 * Measurement::TURNS * Measurement::FRAMES);
    }

    #[test]
    fn a_refused_setting_is_skipped() {
        let (on, packed) = (setting("depth pre-pass", "on"), setting("vertices", "packed"));
        let refused = Quality { depth_pre_pass: true, ..Quality::balanced() };
        let (prices, _) = measure(&[on, packed], |_| [1.0, 1.0], Some(&refused));
        assert_eq!(prices.get(on), Some(&Price::Refused("no".into())));
        assert!(matches!(prices.get(packed), Some(Price::Measured { .. })));
    }
}
