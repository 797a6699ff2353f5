//! Whether testing for occlusion is worth its time in a view.

/// Decides whether a view tests for occlusion. It tries some frames with the test and some without, keeps what was cheaper, and
/// tries again after a while. The measure is the thread time of the test and of drawing what is left, divided by the number of
/// objects in the frustum. The picture is the same either way.
#[derive(Clone, Debug)]
pub(super) struct OcclusionTuner {
    /// Frames since the latest trial began.
    frame: u32,
    /// The least nanoseconds per object in the latest trial, with and without the test.
    with: f64,
    without: f64,
}

impl OcclusionTuner {
    /// Frames of a trial with the test, and as many without. The first of each is not counted: caches are in the state of the other.
    const TRIAL_FRAMES: u32 = 3;
    /// Frames from one trial to the next where the test is off, and where it is on. It is retried less often while it is on, because
    /// trial frames without it are the slow ones.
    const RETRIAL_FRAMES_OFF: u32 = 60;
    const RETRIAL_FRAMES_ON: u32 = 600;

    /// Whether the next frame tests for occlusion.
    pub(super) fn is_on(&self) -> bool {
        match self.frame / Self::TRIAL_FRAMES {
            0 => true,
            1 => false,
            _ => self.is_worth_it(),
        }
    }

    fn is_worth_it(&self) -> bool {
        self.with <= self.without
    }

    /// Updates the decision with the thread time of a frame that had `objects` in the view's frustum.
    pub(super) fn update(&mut self, nanoseconds: u64, objects: usize) {
        if objects == 0 {
            return;
        }
        if self.frame == 0 {
            (self.with, self.without) = (f64::INFINITY, f64::INFINITY);
        }
        let cost = nanoseconds as f64 / objects as f64;
        let counts = !self.frame.is_multiple_of(Self::TRIAL_FRAMES);
        match self.frame / Self::TRIAL_FRAMES {
            0 if counts => self.with = self.with.min(cost),
            1 if counts => self.without = self.without.min(cost),
            _ => {}
        }
        let retry = if self.is_worth_it() { Self::RETRIAL_FRAMES_ON } else { Self::RETRIAL_FRAMES_OFF };
        self.frame = if self.frame + 1 >= retry { 0 } else { self.frame + 1 };
    }
}

impl Default for OcclusionTuner {
    fn default() -> Self {
        Self { frame: 0, with: f64::INFINITY, without: f64::INFINITY }
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    /// Runs frames that take these times with and without the test, and returns how many were with.
    fn frames_with(tuner: &mut OcclusionTuner, frames: usize, [with, without]: [u64; 2]) -> usize {
        let mut count = 0;
        for frame in 0..frames {
            let is_on = tuner.is_on();
            count += usize::from(is_on);
            // Now and then the system preempts the worker.
            let disturbed = if frame % 7 == 3 { 50 } else { 1 };
            tuner.update(if is_on { with } else { without } * 1000 * disturbed, 1000);
        }
        count
    }

    #[test]
    fn the_test_is_tried_at_first_and_kept_only_where_it_is_cheaper() {
        let mut tuner = OcclusionTuner::default();
        assert!((0..3).all(|_| frames_with(&mut tuner, 1, [100, 300]) == 1));
        assert_eq!(frames_with(&mut tuner, 3, [100, 300]), 0);
        assert_eq!(frames_with(&mut tuner, 594, [100, 300]), 594);
        let mut tuner = OcclusionTuner::default();
        let share = frames_with(&mut tuner, 6000, [300, 100]);
        assert_eq!(share, 300, "3 in 60 are tried");
    }

    #[test]
    fn a_change_of_cost_is_noticed() {
        let mut tuner = OcclusionTuner::default();
        frames_with(&mut tuner, 600, [300, 100]);
        frames_with(&mut tuner, 60, [100, 300]);
        assert!(frames_with(&mut tuner, 600, [100, 300]) > 590);
        frames_with(&mut tuner, 600, [300, 100]);
        assert!(frames_with(&mut tuner, 600, [300, 100]) < 40);
    }

    #[test]
    fn an_empty_view_changes_nothing() {
        let mut tuner = OcclusionTuner::default();
        tuner.update(1_000_000, 0);
        assert_eq!((tuner.frame, tuner.is_on()), (0, true));
    }
}
