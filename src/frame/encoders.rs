//! The encoders of a frame and what is recorded for them, and how finishing one fails.

use std::ops::Range;

use parking_lot::{Mutex, MutexGuard};

use crate::backend::{Backend, BackendError};
use crate::task::JobPanic;
use crate::unwind::{discard, discard_all};

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

/// What the jobs of one pass record: its parts in any order, then the finished pass. It keeps its memory from frame to
/// frame, and is empty between frames: a frame takes out what is finished, or is abandoned and drops it.
pub(super) struct PassRecording<B: Backend> {
    /// By part index.
    parts: Mutex<Vec<Option<B::Part>>>,
    /// All parts in order, when they are handed to the backend.
    ordered_parts: Mutex<Vec<B::Part>>,
    finished: Mutex<Option<B::Commands>>,
}

impl<B: Backend> Default for PassRecording<B> {
    fn default() -> Self {
        Self { parts: Mutex::default(), ordered_parts: Mutex::default(), finished: Mutex::default() }
    }
}

impl<B: Backend> PassRecording<B> {
    /// Makes room for `count` parts.
    pub(super) fn reserve(&self, count: usize) {
        self.parts.lock().resize_with(count, || None);
    }

    /// A function that stores parts, the first at index `first`.
    pub(super) fn put_parts_from(&self, first: usize) -> impl FnMut(B::Part) {
        let mut index = first;
        move |part| {
            let mut parts = self.parts.lock();
            if index >= parts.len() {
                drop(parts);
                discard(part);
                panic!("`record` emitted more parts than `part_count` announced");
            }
            let before = parts[index].replace(part);
            drop(parts);
            discard(before);
            index += 1;
        }
    }

    /// All parts in order, to finish the pass with.
    ///
    /// # Errors
    /// If a part is missing.
    pub(super) fn ordered_parts(&self) -> Result<MutexGuard<'_, Vec<B::Part>>, BackendError> {
        let (mut parts, mut ordered_parts) = (self.parts.lock(), self.ordered_parts.lock());
        let count = parts.len();
        ordered_parts.extend(parts.drain(..).flatten());
        if ordered_parts.len() < count {
            return Err(BackendError::BrokenRule {
                rule: "every part is recorded before its pass is finished".to_owned(),
            });
        }
        Ok(ordered_parts)
    }

    /// Keeps the memory of parts that were taken out, for the next frame.
    pub(super) fn keep_memory(&self, mut parts: Vec<B::Part>) {
        discard_all(parts.drain(..));
        *self.ordered_parts.lock() = parts;
    }

    /// Stores the finished pass.
    pub(super) fn put_finished(&self, commands: B::Commands) {
        let before = self.finished.lock().replace(commands);
        discard(before);
    }

    /// Takes the finished pass, if there is one, and drops what an unfinished frame has left.
    pub(super) fn take(&mut self) -> Option<B::Commands> {
        discard_all(self.parts.get_mut().drain(..));
        discard_all(self.ordered_parts.get_mut().drain(..));
        self.finished.get_mut().take()
    }

    /// Drops everything. It keeps the memory.
    pub(super) fn clear(&mut self) {
        discard(self.take());
    }
}

/// Makes `recordings` one for each pass, empty.
pub(super) fn reset_recordings<B: Backend>(recordings: &mut Vec<PassRecording<B>>, passes: usize) {
    recordings.resize_with(passes, PassRecording::default);
    recordings.iter_mut().for_each(PassRecording::clear);
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;
    use crate::backend::NullBackend;

    #[test]
    fn a_pass_without_a_part_is_not_finished() {
        let recording = PassRecording::<NullBackend>::default();
        recording.reserve(0);
        assert!(recording.ordered_parts().is_ok_and(|parts| parts.is_empty()));
        recording.reserve(1);
        assert!(recording.ordered_parts().is_err());
    }

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
