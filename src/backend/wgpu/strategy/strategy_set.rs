//! The strategies that a backend may use.

use drawloom_jobs::internal::Tuner;

use super::pass_strategy::{EncodingStrategy, PassStrategy, RecordingStrategy};

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

    /// In the order in which they are tried.
    pub(crate) fn strategies(&self) -> &[PassStrategy] {
        &self.strategies
    }

    /// A tuner that chooses among the strategies, by index.
    pub(crate) fn tuner(&self) -> Tuner {
        Tuner::new(self.strategies.iter().map(|_| MAX_PAUSE))
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

#[cfg(test)]
mod tests {
    use super::*;

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
