//! The encoders of a frame, and how finishing one fails.

use std::ops::Range;

use parking_lot::Mutex;

use crate::backend::BackendError;
use crate::task::JobPanic;

/// The encoders of a frame: each has passes that follow each other in submission order, most often one. The job of the
/// pass that becomes ready last finishes the encoder.
#[derive(Debug, Default)]
pub(super) struct FrameEncoders {
    encoders: Vec<FrameEncoder>,
    /// By pass: the index of its encoder.
    encoder_of_pass: Vec<usize>,
}

#[derive(Debug)]
struct FrameEncoder {
    passes: Range<usize>,
    /// How many of them are not yet ready to be finished.
    pending: Mutex<usize>,
}

impl FrameEncoders {
    /// The most passes of an encoder.
    pub(super) const MAX_PASSES: usize = 16;

    /// Begins a frame of `passes` passes. `shares_encoder` says of a pass, by its index in submission order, whether it
    /// is in the encoder of the one before it; the first one is not, nor one whose encoder would have too many.
    ///
    /// # Errors
    /// Those of `shares_encoder`.
    pub(super) fn begin_frame<E>(
        &mut self,
        passes: usize,
        shares_encoder: impl Fn(usize) -> Result<bool, E>,
    ) -> Result<(), E> {
        self.encoders.clear();
        self.encoder_of_pass.clear();
        for index in 0..passes {
            match self.encoders.last_mut() {
                Some(encoder) if encoder.passes.len() < Self::MAX_PASSES && shares_encoder(index)? => {
                    encoder.passes.end = index + 1;
                    *encoder.pending.get_mut() += 1;
                }
                _ => self.encoders.push(FrameEncoder { passes: index..index + 1, pending: Mutex::new(1) }),
            }
            self.encoder_of_pass.push(self.encoders.len() - 1);
        }
        Ok(())
    }

    /// A pass, by index, has all of its parts. Returns the passes of its encoder if it is the last of them.
    pub(super) fn complete(&self, pass: usize) -> Option<Range<usize>> {
        let encoder = &self.encoders[self.encoder_of_pass[pass]];
        // Jobs are unordered; what they recorded is behind the locks of their passes.
        let mut pending = encoder.pending.lock();
        *pending -= 1;
        (*pending == 0).then(|| encoder.passes.clone())
    }
}

/// The error of a job that finished an encoder: a pass of it failed, which need not be the one whose job it was.
#[derive(Debug, thiserror::Error)]
#[error("pass {pass} failed: {failure}")]
pub(super) struct FailedPass {
    /// By index in submission order.
    pub(super) pass: usize,
    pub(super) failure: PassFailure,
}

#[derive(Debug, thiserror::Error)]
pub(super) enum PassFailure {
    #[error(transparent)]
    Error(BackendError),
    #[error(transparent)]
    Panic(JobPanic),
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    fn begin(encoders: &mut FrameEncoders, passes: usize, shares_encoder: impl Fn(usize) -> bool) {
        let Ok(()) = encoders.begin_frame(passes, |pass| Ok::<_, Infallible>(shares_encoder(pass)));
    }

    #[test]
    fn the_last_pass_of_an_encoder_is_told_all_of_it() {
        let mut encoders = FrameEncoders::default();
        begin(&mut encoders, 4, |pass| pass != 2);
        assert_eq!(encoders.complete(3), None);
        assert_eq!(encoders.complete(0), None);
        assert_eq!(encoders.complete(1), Some(0..2));
        assert_eq!(encoders.complete(2), Some(2..4));
    }

    #[test]
    fn no_encoder_has_too_many_passes() {
        const MAX: usize = FrameEncoders::MAX_PASSES;
        let mut encoders = FrameEncoders::default();
        begin(&mut encoders, MAX + 1, |_| true);
        assert_eq!(encoders.complete(MAX), Some(MAX..MAX + 1));
        let last = (0..MAX).filter_map(|pass| encoders.complete(pass)).collect::<Vec<_>>();
        assert_eq!((last.len(), last.first()), (1, Some(&(0..MAX))));
    }

    #[test]
    fn an_abandoned_frame_leaves_nothing_behind() {
        let mut encoders = FrameEncoders::default();
        begin(&mut encoders, 3, |_| true);
        assert_eq!(encoders.complete(0), None);
        begin(&mut encoders, 2, |_| true);
        assert_eq!(encoders.complete(0), None);
        assert_eq!(encoders.complete(1), Some(0..2));
    }
}
