//! What a worker without jobs does: it looks for jobs for a while, and then sleeps.
//!
//! Looking costs processor time, sleeping costs a wake-up. Within a frame more jobs are likely, so a worker looks for
//! as long as a wake-up takes, which at worst doubles the cost of waiting. After a frame it looks for as long as
//! `frame_gaps.rs` says. Then it sleeps.

use std::time::Duration;

use super::priority::Priority;
use super::region::JobContext;
use super::shared::Shared;
use super::sleep::WakeFor;
use crate::sync::{Instant, spin_loop};
use crate::timeline::IdleKind;

/// How long a worker looks for jobs in a frame at most, whatever a wake-up costs.
pub(crate) const MAX_SPIN: Duration = Duration::from_micros(100);

/// The most pause instructions between two looks.
const MAX_PAUSES: u32 = 8;

/// How often a worker looks before it reads the clock and counts as a searcher. Most gaps between the nodes of a frame
/// are over by then.
const UNCOUNTED_LOOKS: u32 = 16;

/// Under a model checker workers sleep at once, because each look would be one more branch. Under Miri too, because a
/// look takes as long as a job.
const SLEEP_AT_ONCE: bool = cfg!(any(drawloom_model_check, miri));

/// A worker's time without jobs.
#[derive(Default)]
pub(super) struct Idle {
    looks: u32,
    is_searcher: bool,
    /// When the worker began to look, and whether it was in a frame then.
    since: Option<(Instant, bool)>,
}

impl Idle {
    /// Pauses or sleeps after a look that found nothing. `sees_work` looks for work once more before the worker sleeps.
    pub(super) fn pause<W: JobContext>(
        &mut self,
        worker: usize,
        shared: &Shared<W>,
        wake_for: WakeFor,
        sees_work: impl FnOnce() -> bool,
    ) {
        if self.looks == 0 {
            shared.timeline().start_idle(worker, IdleKind::Searching);
        }
        if SLEEP_AT_ONCE {
            self.sleep(worker, shared, wake_for, sees_work);
            return;
        }
        (0..pauses(self.looks)).for_each(|_| spin_loop());
        self.looks = self.looks.saturating_add(1);
        if self.looks > UNCOUNTED_LOOKS && self.has_looked_enough(shared) {
            self.sleep(worker, shared, wake_for, sees_work);
        } else if self.looks > UNCOUNTED_LOOKS && !self.is_searcher && wake_for == WakeFor::Any {
            self.is_searcher = true;
            shared.sleep().start_search();
        }
    }

    /// Ends the idle time, if there was any: the worker has found a job, or exits. `sees_more_work` looks for further
    /// jobs.
    #[inline]
    pub(super) fn end<W: JobContext>(
        &mut self,
        worker: usize,
        shared: &Shared<W>,
        sees_more_work: impl Fn(&[Priority]) -> bool,
    ) {
        if self.looks > 0 {
            self.end_search(worker, shared, sees_more_work);
        }
    }

    // A function of its own, so that two jobs in a row cost no call.
    #[cold]
    fn end_search<W: JobContext>(
        &mut self,
        worker: usize,
        shared: &Shared<W>,
        sees_more_work: impl Fn(&[Priority]) -> bool,
    ) {
        shared.timeline().end_idle(worker);
        if self.is_searcher {
            shared.sleep().end_search(sees_more_work);
        }
        *self = Self::default();
    }

    fn has_looked_enough<W: JobContext>(&mut self, shared: &Shared<W>) -> bool {
        let now = Instant::now();
        let is_in_frame = shared.is_in_frame();
        let since = match self.since {
            Some((since, was_in_frame)) if was_in_frame == is_in_frame => since,
            _ => now,
        };
        self.since = Some((since, is_in_frame));
        let limit = if is_in_frame { shared.wake_up_cost().min(MAX_SPIN) } else { shared.frame_gaps().spin() };
        now.duration_since(since) >= limit
    }

    fn sleep<W: JobContext>(
        &mut self,
        worker: usize,
        shared: &Shared<W>,
        wake_for: WakeFor,
        sees_work: impl FnOnce() -> bool,
    ) {
        shared.timeline().start_idle(worker, IdleKind::Asleep);
        let is_searcher = shared.sleep().sleep(worker, wake_for, self.is_searcher, sees_work);
        shared.timeline().start_idle(worker, IdleKind::Searching);
        // The worker was woken for something, so it looks for a while again.
        *self = Self { looks: 1, is_searcher, since: None };
    }
}

/// The pause instructions after this many looks.
fn pauses(looks: u32) -> u32 {
    (1 << looks.min(8)).min(MAX_PAUSES)
}

/// How many pause instructions a worker executes before it counts as a searcher.
#[cfg(feature = "report")]
pub(crate) fn uncounted_pauses() -> u32 {
    (0..=UNCOUNTED_LOOKS).map(pauses).sum()
}
