//! What all workers of a scheduler share.

use std::time::Duration;

use crossbeam_utils::CachePadded;

use super::background_queue::BackgroundQueue;
use super::background_slots::BackgroundSlots;
use super::caller_slot::CallerSlot;
use super::frame_gaps::FrameGaps;
use super::mailbox::Mailbox;
use super::placement::Placement;
use super::priority::Priority;
use super::queues::{Queues, Stealers};
use super::region::JobContext;
use super::sleep::Sleep;
use crate::sync::{AtomicBool, AtomicUsize, Instant, Ordering, fence};
use crate::timeline::Timeline;

/// The workers' queues as others see them, their mailboxes, and the state of the scheduler.
pub(super) struct Shared<W: JobContext> {
    stealers: Box<[Stealers<W>]>,
    mailboxes: Box<[CachePadded<Mailbox<W>>]>,
    /// Not the model checker's `Arc`, which has no weak references: a thread that waits for a job may outlive the
    /// scheduler.
    background: std::sync::Arc<BackgroundQueue>,
    background_slots: BackgroundSlots,
    sleep: Sleep,
    placement: Placement,
    caller_slot: CallerSlot<W>,
    /// Not the model checker's `Arc`: the thread that submits frames has a reference too.
    timeline: std::sync::Arc<Timeline>,
    is_shuffled: bool,
    /// In nanoseconds.
    wake_up_cost: AtomicUsize,
    is_in_frame: AtomicBool,
    frame_gaps: FrameGaps,
    shut_down: AtomicBool,
}

impl<W: JobContext> Shared<W> {
    /// Under a model checker workers never stay awake, and gaps would only be more branches.
    const MEASURES_GAPS: bool = cfg!(not(drawloom_model_check));

    /// `stealers` has one entry for each worker, and `first` is the queues of worker 0.
    pub(super) fn new(
        stealers: Box<[Stealers<W>]>,
        first: Box<Queues<W>>,
        timeline: Timeline,
        is_shuffled: bool,
    ) -> Self {
        Self {
            mailboxes: stealers.iter().map(|_| CachePadded::new(Mailbox::new())).collect(),
            background: std::sync::Arc::new(BackgroundQueue::new()),
            background_slots: BackgroundSlots::new(stealers.len()),
            sleep: Sleep::new(stealers.len()),
            placement: Placement::new(),
            caller_slot: CallerSlot::new(first),
            timeline: std::sync::Arc::new(timeline),
            stealers,
            is_shuffled,
            wake_up_cost: AtomicUsize::new(0),
            is_in_frame: AtomicBool::new(false),
            frame_gaps: FrameGaps::new(),
            shut_down: AtomicBool::new(false),
        }
    }

    /// The number of workers.
    #[inline]
    pub(super) fn workers(&self) -> usize {
        self.stealers.len()
    }

    #[inline]
    pub(super) fn stealers(&self) -> &[Stealers<W>] {
        &self.stealers
    }

    #[inline]
    pub(super) fn mailbox(&self, worker: usize) -> &Mailbox<W> {
        &self.mailboxes[worker]
    }

    #[inline]
    pub(super) fn mailboxes(&self) -> impl Iterator<Item = &Mailbox<W>> {
        self.mailboxes.iter().map(|mailbox| &**mailbox)
    }

    #[inline]
    pub(super) fn background(&self) -> &std::sync::Arc<BackgroundQueue> {
        &self.background
    }

    #[inline]
    pub(super) fn background_slots(&self) -> &BackgroundSlots {
        &self.background_slots
    }

    /// Wakes a worker for background jobs, if one of them may run any. The job, or the free slot, must have been
    /// published.
    pub(super) fn wake_for_background(&self) {
        if self.has_background_slot() {
            self.sleep.wake_despite_searchers(Priority::Background);
        }
    }

    /// Whether a worker may take a background job, as seen after all that this thread has published. If it may not, the
    /// worker that frees a slot sees that.
    pub(super) fn has_background_slot(&self) -> bool {
        fence(Ordering::SeqCst);
        self.background_slots.is_free()
    }

    #[inline]
    pub(super) fn sleep(&self) -> &Sleep {
        &self.sleep
    }

    #[inline]
    pub(super) fn placement(&self) -> &Placement {
        &self.placement
    }

    pub(super) fn caller_slot(&self) -> &CallerSlot<W> {
        &self.caller_slot
    }

    #[inline]
    pub(super) fn timeline(&self) -> &std::sync::Arc<Timeline> {
        &self.timeline
    }

    #[inline]
    pub(super) fn is_shuffled(&self) -> bool {
        self.is_shuffled
    }

    // The atomics below are hints and a flag that hand no data over, so relaxed is enough. The lock that
    // `Sleep::wake_all` takes makes sure that sleepers see the flag.

    #[inline]
    pub(super) fn wake_up_cost(&self) -> Duration {
        Duration::from_nanos(self.wake_up_cost.load(Ordering::Relaxed) as u64)
    }

    pub(super) fn set_wake_up_cost(&self, cost: Duration) {
        self.wake_up_cost.store(cost.as_nanos().try_into().unwrap_or(usize::MAX), Ordering::Relaxed);
    }

    /// Whether a thread from outside waits for a frame, or for anything else that it called the scheduler for.
    #[inline]
    pub(super) fn is_in_frame(&self) -> bool {
        self.is_in_frame.load(Ordering::Relaxed)
    }

    pub(super) fn begin_frame(&self) {
        self.is_in_frame.store(true, Ordering::Relaxed);
        if Self::MEASURES_GAPS {
            self.frame_gaps.begin_frame(Instant::now(), self.workers(), self.wake_up_cost());
        }
    }

    pub(super) fn end_frame(&self) {
        self.is_in_frame.store(false, Ordering::Relaxed);
        if Self::MEASURES_GAPS {
            self.frame_gaps.end_frame(Instant::now());
        }
    }

    /// The gaps between the frames that threads from outside have waited for.
    #[inline]
    pub(super) fn frame_gaps(&self) -> &FrameGaps {
        &self.frame_gaps
    }

    #[inline]
    pub(super) fn is_shut_down(&self) -> bool {
        self.shut_down.load(Ordering::Relaxed)
    }

    /// Makes all workers but the caller end when they have no more jobs to run.
    pub(super) fn shut_down(&self) {
        self.shut_down.store(true, Ordering::Relaxed);
        self.sleep.wake_all();
    }
}
