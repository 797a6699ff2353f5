//! How a worker that finds nothing to do passes its time: it looks again for a while, and then sleeps.
//!
//! Looking costs the processor, sleeping costs a wake-up. In the midst of a frame more work is likely, so a worker looks
//! for as long as a wake-up takes, which at worst doubles what waiting costs. Between frames it looks for
//! [`HOT`], so that frames that follow at once meet workers that are awake; then it sleeps.

use std::time::Duration;

use crate::{
    sync::{Instant, spin_loop},
    timeline::IdleKind,
};

use super::{
    sleep::WakeFor,
    worker::{Until, Worker},
};

/// How long workers stay awake after the end of a frame.
const HOT: Duration = Duration::from_micros(10);

/// How long they look at most, whatever a wake-up is said to cost.
const LONGEST: Duration = Duration::from_micros(100);

/// The pauses of the processor between two looks, at most.
const MOST_PAUSES: u32 = 8;

/// How often a worker looks before it asks the time, and counts as a searcher: gaps between the passes of a frame are over
/// by then.
const SILENT_LOOKS: u32 = 16;

/// Under a model checker workers sleep at once: each look would be one more branch. Under Miri too: a look takes as long as
/// a job.
const SLEEP_AT_ONCE: bool = cfg!(any(drawloom_loom, drawloom_shuttle, miri));

/// A worker's time without work.
#[derive(Default)]
pub(super) struct Idle {
    looks: u32,
    is_searcher: bool,
    /// Since when the worker has been looking, and whether it was in a frame then.
    since: Option<(Instant, bool)>,
}

impl Idle {
    /// There was nothing again: pauses, or sleeps.
    pub(super) fn go_on(&mut self, worker: &Worker, until: Until) {
        if self.looks == 0 {
            worker.timeline().start_idle(worker.index(), IdleKind::Searching);
        }
        if SLEEP_AT_ONCE {
            self.sleep(worker, until);
            return;
        }
        (0..(1 << self.looks.min(8)).min(MOST_PAUSES)).for_each(|_| spin_loop());
        self.looks = self.looks.saturating_add(1);
        if self.looks > SILENT_LOOKS && self.has_looked_enough(worker) {
            self.sleep(worker, until);
        } else if self.looks > SILENT_LOOKS && !self.is_searcher && until.wake_for() == WakeFor::Any {
            self.is_searcher = true;
            worker.shared().sleep().start_search();
        }
    }

    /// There is something, or it is time to stop.
    #[inline]
    pub(super) fn end(&mut self, worker: &Worker) {
        if self.looks > 0 {
            self.end_looking(worker);
        }
    }

    // Apart, so that one job after another costs no call.
    #[cold]
    fn end_looking(&mut self, worker: &Worker) {
        worker.timeline().end_idle(worker.index());
        if self.is_searcher {
            worker.shared().sleep().end_search(|bands| worker.sees_loot(bands));
        }
        *self = Self::default();
    }

    fn has_looked_enough(&mut self, worker: &Worker) -> bool {
        let now = Instant::now();
        let is_live = worker.shared().is_live();
        let since = match self.since {
            Some((since, was_live)) if was_live == is_live => since,
            _ => now,
        };
        self.since = Some((since, is_live));
        let most = if is_live { worker.shared().wake_up_cost().min(LONGEST) } else { HOT };
        now.duration_since(since) >= most
    }

    fn sleep(&mut self, worker: &Worker, until: Until) {
        let sleep = worker.shared().sleep();
        worker.timeline().start_idle(worker.index(), IdleKind::Asleep);
        let is_searcher = sleep.sleep(worker.index(), until.wake_for(), self.is_searcher, || worker.sees_work(until));
        worker.timeline().start_idle(worker.index(), IdleKind::Searching);
        // Awake it looks for a while again, as it was called for something.
        *self = Self { looks: 1, is_searcher, since: None };
    }
}
