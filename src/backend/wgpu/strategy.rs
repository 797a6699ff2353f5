//! How a pass is recorded and encoded: the strategies, and which of them a backend may use.

use std::ops::Range;

use drawloom_jobs::internal::Tuner;

use crate::command::DrawList;

/// How a pass's batches become device commands. Every strategy draws the same picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RecordingStrategy {
    /// Straight into the pass, on the worker that finishes it.
    Direct,
    /// Into [bundles](DrawList::bundle), each on any worker; the pass replays them.
    Bundles,
    /// Into bundles that are cached: a bundle whose batches, meshes, pipelines and bindings equal those of an earlier
    /// frame is replayed instead of recorded. Objects may move in between, as long as the view draws the same ones.
    CachedBundles,
}

/// Where and when a recorded pass is encoded for the device. Every strategy draws the same picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EncodingStrategy {
    /// One encoder per pass, finished on a worker. Small passes that follow each other in one view share one,
    /// and in frames of many small views those of several.
    PerPass,
    /// A pass of more than two bundles is split over up to eight encoders, which several workers finish. The first one
    /// clears the targets; the others load them and draw on, in order. A smaller pass is encoded as with `PerPass`.
    Split,
    /// One encoder per pass, recorded on a worker and finished on the device thread, when the frame is submitted.
    OnSubmit,
}

/// A recording strategy together with an encoding strategy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PassStrategy {
    pub(crate) recording: RecordingStrategy,
    pub(crate) encoding: EncodingStrategy,
}

impl PassStrategy {
    /// Fewer bundles are not worth an encoder of their own.
    const BUNDLES_PER_ENCODER: usize = 2;
    /// Each further encoder loads and stores the pass's targets once more.
    const MAX_ENCODERS: usize = 8;

    /// Its name in reports.
    pub(crate) fn name(self) -> &'static str {
        use EncodingStrategy::{OnSubmit, PerPass, Split};
        use RecordingStrategy::{Bundles, CachedBundles, Direct};
        match (self.recording, self.encoding) {
            (Direct, PerPass) => "direct",
            (Direct, Split) => "split direct",
            (Direct, OnSubmit) => "direct on submit",
            (Bundles, PerPass) => "bundles",
            (Bundles, Split) => "split bundles",
            (Bundles, OnSubmit) => "bundles on submit",
            (CachedBundles, PerPass) => "cached bundles",
            (CachedBundles, Split) => "split cached bundles",
            (CachedBundles, OnSubmit) => "cached bundles on submit",
        }
    }

    /// Whether the strategy differs from all others for a pass of `batches` batches: a small pass is never split.
    pub(crate) fn is_distinct(self, batches: usize) -> bool {
        self.encoding != EncodingStrategy::Split
            || self.encoder_count(batches.div_ceil(DrawList::BATCHES_PER_BUNDLE)) > 1
    }

    /// Whether each bundle of a pass is a part of its own.
    pub(crate) fn divides_bundles(self) -> bool {
        matches!(self.recording, RecordingStrategy::Bundles | RecordingStrategy::CachedBundles)
            && self.encoding != EncodingStrategy::Split
    }

    /// The number of encoders for a pass of `bundles` bundles.
    pub(crate) fn encoder_count(self, bundles: usize) -> usize {
        match self.encoding {
            EncodingStrategy::Split => bundles.div_ceil(Self::BUNDLES_PER_ENCODER).clamp(1, Self::MAX_ENCODERS),
            EncodingStrategy::PerPass | EncodingStrategy::OnSubmit => 1,
        }
    }

    /// The number of parts that are recorded before the pass is finished: the pass's encoders, if it has several; its
    /// bundles, if it has one encoder that replays bundles; otherwise none.
    pub(crate) fn part_count(self, list: &DrawList) -> usize {
        let bundles = list.bundle_count();
        match (self.encoder_count(bundles), self.recording) {
            (1, RecordingStrategy::Direct) => 0,
            (1, RecordingStrategy::Bundles | RecordingStrategy::CachedBundles) => bundles,
            (encoders, _) => encoders,
        }
    }

    /// The bundles that one of several encoders draws.
    pub(crate) fn bundles_of_encoder(self, list: &DrawList, encoder: usize) -> Range<usize> {
        let bundles = list.bundle_count();
        let encoders = self.encoder_count(bundles);
        encoder * bundles / encoders..(encoder + 1) * bundles / encoders
    }

    /// The segment of the pass that one of several encoders records.
    pub(crate) fn segment_of_encoder(self, list: &DrawList, encoder: usize) -> PassSegment {
        PassSegment { is_first: encoder == 0, is_last: encoder + 1 == self.encoder_count(list.bundle_count()) }
    }
}

/// The segment of a pass that one encoder records: the first one clears the targets, and the first and the last one
/// write timestamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PassSegment {
    pub(crate) is_first: bool,
    pub(crate) is_last: bool,
}

impl PassSegment {
    /// The whole pass.
    pub(crate) const WHOLE: Self = Self { is_first: true, is_last: true };
}

/// The strategies that passes may be recorded with: one, or several of which each pass uses the cheapest.
pub(crate) struct StrategySet {
    /// Fixed by the engine.
    recording: Option<RecordingStrategy>,
    encoding: Option<EncodingStrategy>,
    strategies: Vec<PassStrategy>,
}

/// The longest pause between two trials of a strategy, in frames: there are several others, and recording is a small
/// part of the frame.
const MAX_PAUSE: u64 = 2048;

impl StrategySet {
    /// All strategies that the tuner may choose.
    pub(crate) fn new() -> Self {
        Self { recording: None, encoding: None, strategies: Vec::new() }.enumerated()
    }

    pub(crate) fn with_recording(self, recording: RecordingStrategy) -> Self {
        Self { recording: Some(recording), ..self }.enumerated()
    }

    pub(crate) fn with_encoding(self, encoding: EncodingStrategy) -> Self {
        Self { encoding: Some(encoding), ..self }.enumerated()
    }

    /// The strategy for code that records into passes only. `divides` says whether one that divides passes keeps more
    /// workers busy.
    pub(crate) fn of_passes_alone(&self, divides: bool) -> PassStrategy {
        let encoding = if divides { EncodingStrategy::Split } else { EncodingStrategy::PerPass };
        PassStrategy { recording: RecordingStrategy::Direct, encoding: self.encoding.unwrap_or(encoding) }
    }

    /// In the order in which they are tried.
    pub(crate) fn strategies(&self) -> &[PassStrategy] {
        &self.strategies
    }

    /// A tuner that chooses among the strategies, by index.
    pub(crate) fn tuner(&self) -> PassTuner {
        PassTuner { tuner: Tuner::new(self.strategies.iter().map(|_| MAX_PAUSE)), group_size: 0 }
    }

    fn enumerated(self) -> Self {
        use RecordingStrategy::{Bundles, CachedBundles, Direct};
        let default_recordings = || vec![CachedBundles, Direct, Bundles];
        let recordings = self.recording.map_or_else(default_recordings, |recording| vec![recording]);
        // `OnSubmit` moves work to the device thread, which every frame waits for. So only the engine chooses it.
        let default_encodings = || vec![EncodingStrategy::PerPass, EncodingStrategy::Split];
        let encodings = self.encoding.map_or_else(default_encodings, |encoding| vec![encoding]);
        // Fewer strategies are tuned sooner. Several encoders gain nothing for bundles that are replayed once.
        let is_tuned = self.recording.is_none() && self.encoding.is_none();
        let is_candidate = |strategy: &PassStrategy| {
            !is_tuned
                || strategy.encoding == EncodingStrategy::PerPass
                || matches!(strategy.recording, CachedBundles | Direct)
        };
        let combined = |encoding| recordings.iter().map(move |&recording| PassStrategy { recording, encoding });
        let strategies = encodings.into_iter().flat_map(combined).filter(is_candidate).collect();
        Self { strategies, ..self }
    }
}

/// The tuner of a pass.
pub(crate) struct PassTuner {
    /// It chooses among the strategies of a [`StrategySet`].
    pub(crate) tuner: Tuner,
    /// The size of the groups that bundles of items draw; 0 in a pass without items.
    group_size: usize,
}

impl PassTuner {
    /// Sets the size of the groups that bundles of items draw in a frame: with another one, those that are cached cost
    /// something else.
    pub(crate) fn set_group_size(&mut self, ranks: usize, set: &StrategySet, frame: u64) {
        if std::mem::replace(&mut self.group_size, ranks) != ranks {
            let caches = |strategy: usize| set.strategies[strategy].recording == RecordingStrategy::CachedBundles;
            self.tuner.invalidate(frame, caches);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::{Batch, DrawState};

    fn list(batches: u32) -> DrawList {
        let batch = |first| Batch { mesh: 0, state: DrawState::PLAIN, first, count: 1 };
        let mut list = DrawList::default();
        list.batches.extend((0..batches).map(batch));
        list
    }

    #[test]
    fn encoders_divide_all_bundles_in_order() {
        use RecordingStrategy::{Bundles, CachedBundles, Direct};
        for batches in [0, 1, 256, 257, 512, 513, 1000, 3000, 10_000] {
            let list = list(batches);
            for recording in [Direct, Bundles, CachedBundles] {
                let strategy = PassStrategy { recording, encoding: EncodingStrategy::Split };
                let encoders = strategy.encoder_count(list.bundle_count());
                let divided = (0..encoders).flat_map(|encoder| strategy.bundles_of_encoder(&list, encoder));
                assert_eq!(divided.collect::<Vec<_>>(), (0..list.bundle_count()).collect::<Vec<_>>());
                assert_eq!(encoders > 1, batches > 512);
                assert!(encoders <= 8);
                for encoder in 0..encoders {
                    let expected = PassSegment { is_first: encoder == 0, is_last: encoder == encoders - 1 };
                    assert_eq!(strategy.segment_of_encoder(&list, encoder), expected);
                }
                if encoders > 1 {
                    assert_eq!(strategy.part_count(&list), encoders);
                    assert!((0..encoders).all(|encoder| !strategy.bundles_of_encoder(&list, encoder).is_empty()));
                }
            }
        }
    }

    #[test]
    fn a_fixed_strategy_excludes_all_others() {
        use EncodingStrategy::{OnSubmit, PerPass};
        use RecordingStrategy::{Bundles, CachedBundles};
        let all = StrategySet::new().strategies().to_vec();
        assert_eq!(all[0], PassStrategy { recording: CachedBundles, encoding: PerPass });
        assert!(all.iter().all(|strategy| strategy.encoding != OnSubmit));
        let fixed = StrategySet::new().with_recording(Bundles).with_encoding(OnSubmit);
        assert_eq!(fixed.strategies(), [PassStrategy { recording: Bundles, encoding: OnSubmit }]);
        let recorded = StrategySet::new().with_recording(Bundles);
        assert!(recorded.strategies().iter().all(|strategy| strategy.recording == Bundles));
    }
}
