//! Passes that are finished together.

use std::ops::Range;

use parking_lot::Mutex;

/// The passes of a frame in runs: neighbours in submission order that are finished together, by the job of the pass
/// that becomes ready last. A pass that is finished alone is a run of its own.
#[derive(Debug, Default)]
pub(super) struct PassRuns {
    runs: Vec<PassRun>,
    /// By pass: the index of its run.
    run_of_pass: Vec<usize>,
    failures: Mutex<Vec<PassFailure>>,
}

/// A pass that failed while another one's job finished its run.
#[derive(Clone, Copy, Debug)]
pub(super) struct PassFailure {
    pub(super) failed: usize,
    /// The pass whose job it was.
    pub(super) job_of: usize,
}

#[derive(Debug)]
struct PassRun {
    passes: Range<usize>,
    /// How many of them are not yet ready to be finished.
    pending: Mutex<usize>,
}

impl PassRuns {
    /// The passes of the longest run.
    pub(super) const MAX_PASSES: usize = 16;

    /// Begins a frame of `passes` passes. `continues` says of a pass, by its index in submission order, whether it is
    /// finished together with the one before it; the first one is not, nor one that would make its run too long.
    ///
    /// # Errors
    /// Those of `continues`.
    pub(super) fn begin_frame<E>(
        &mut self,
        passes: usize,
        continues: impl Fn(usize) -> Result<bool, E>,
    ) -> Result<(), E> {
        self.runs.clear();
        self.run_of_pass.clear();
        self.failures.get_mut().clear();
        for index in 0..passes {
            match self.runs.last_mut() {
                Some(run) if run.passes.len() < Self::MAX_PASSES && continues(index)? => {
                    run.passes.end = index + 1;
                    *run.pending.get_mut() += 1;
                }
                _ => self.runs.push(PassRun { passes: index..index + 1, pending: Mutex::new(1) }),
            }
            self.run_of_pass.push(self.runs.len() - 1);
        }
        Ok(())
    }

    /// A pass, by index, has all of its parts. Returns the passes to finish if it is the last of its run.
    pub(super) fn complete(&self, pass: usize) -> Option<Range<usize>> {
        let run = &self.runs[self.run_of_pass[pass]];
        // Jobs are unordered; what they recorded is behind the locks of their passes.
        let mut pending = run.pending.lock();
        *pending -= 1;
        (*pending == 0).then(|| run.passes.clone())
    }

    /// Notes that a pass failed in a job of another one.
    pub(super) fn add_failure(&self, failure: PassFailure) {
        self.failures.lock().push(failure);
    }

    /// The passes that failed in jobs of others.
    pub(super) fn failures(&mut self) -> &[PassFailure] {
        self.failures.get_mut()
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    fn begin(runs: &mut PassRuns, passes: usize, continues: impl Fn(usize) -> bool) {
        let Ok(()) = runs.begin_frame(passes, |pass| Ok::<_, Infallible>(continues(pass)));
    }

    #[test]
    fn the_last_pass_of_a_run_is_told_all_of_it() {
        let mut runs = PassRuns::default();
        begin(&mut runs, 4, |pass| pass != 2);
        assert_eq!(runs.complete(3), None);
        assert_eq!(runs.complete(0), None);
        assert_eq!(runs.complete(1), Some(0..2));
        assert_eq!(runs.complete(2), Some(2..4));
    }

    #[test]
    fn no_run_is_longer_than_the_longest() {
        let mut runs = PassRuns::default();
        begin(&mut runs, PassRuns::MAX_PASSES + 1, |_| true);
        assert_eq!(runs.complete(PassRuns::MAX_PASSES), Some(PassRuns::MAX_PASSES..PassRuns::MAX_PASSES + 1));
        let last = (0..PassRuns::MAX_PASSES).filter_map(|pass| runs.complete(pass)).collect::<Vec<_>>();
        assert_eq!((last.len(), last.first()), (1, Some(&(0..PassRuns::MAX_PASSES))));
    }

    #[test]
    fn an_abandoned_frame_leaves_nothing_behind() {
        let mut runs = PassRuns::default();
        begin(&mut runs, 3, |_| true);
        assert_eq!(runs.complete(0), None);
        begin(&mut runs, 2, |_| true);
        assert_eq!(runs.complete(0), None);
        assert_eq!(runs.complete(1), Some(0..2));
    }
}
