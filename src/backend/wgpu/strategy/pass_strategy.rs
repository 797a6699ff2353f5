//! Strategies to record and to encode a pass.

use std::ops::Range;

use super::pass_segment::PassSegment;
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
}
