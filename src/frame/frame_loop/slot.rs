//! A frame's place among the frames in flight, which it holds on its way.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::finished_frame::{FinishedFrame, FrameLoopError};
use super::queues::LoopQueues;
use crate::backend::{Backend, GuardedBackend};
use crate::fence::Fence;
use crate::frame::{RecordedFrame, SubmittedFrame};
use crate::timeline::Timeline;
use crate::unwind::Contained;

/// The queues of a loop.
pub(super) type FrameQueues<B> = LoopQueues<DeviceTask<B>, AwaitedFrame<B>, FinishedFrame<B>>;

/// A frame's place among the frames in flight. It is free again when the device has drawn the frame, or when this is
/// dropped.
#[must_use = "a slot is freed when it is dropped"]
pub struct FrameSlot<B: Backend>
where
    B::Submission: Send,
{
    queues: Arc<FrameQueues<B>>,
    number: u64,
    begun: Instant,
    waited: Duration,
}

impl<B: Backend> FrameSlot<B>
where
    B::Submission: Send,
{
    pub(super) fn new(queues: Arc<FrameQueues<B>>, number: u64, begun: Instant, waited: Duration) -> Self {
        Self { queues, number, begun, waited }
    }

    /// The frame's number, from 1.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// When the frame began.
    pub fn begun(&self) -> Instant {
        self.begun
    }

    /// How long it waited for the slot.
    pub fn waited(&self) -> Duration {
        self.waited
    }

    /// Hands a recorded frame to the device thread, and does not wait.
    pub fn submit(self, recorded: RecordedFrame<B>) {
        self.submit_then(recorded, |_| ());
    }

    /// Hands a recorded frame to the device thread, which calls `after` when the frame is submitted: to present it, for
    /// example. If `after` panics, the frame is [reported](super::FrameLoopError::Panicked) as failed.
    pub fn submit_then(self, recorded: RecordedFrame<B>, after: impl FnOnce(&SubmittedFrame<B>) + Send + 'static) {
        let queues = Arc::clone(&self.queues);
        let after: AfterSubmission<B> = Box::new(after);
        let after = Contained::new(after);
        let frame = QueuedFrame { slot: self, recorded, after, recorded_at: Instant::now() };
        queues.add_task(DeviceTask::Submit(Box::new(frame)));
    }
}

impl<B: Backend> Drop for FrameSlot<B>
where
    B::Submission: Send,
{
    fn drop(&mut self) {
        self.queues.free_slot();
    }
}

/// What the engine does when a frame is submitted.
pub(super) type AfterSubmission<B> = Box<dyn FnOnce(&SubmittedFrame<B>) + Send>;

/// What the device thread does next.
pub(super) enum DeviceTask<B: Backend>
where
    B::Submission: Send,
{
    Submit(Box<QueuedFrame<B>>),
    /// Go on with another backend: what a submitter on that thread is made of.
    ReplaceBackend(GuardedBackend<B>, Arc<Timeline>),
}

/// A frame on its way to the device thread.
pub(super) struct QueuedFrame<B: Backend>
where
    B::Submission: Send,
{
    pub(super) slot: FrameSlot<B>,
    pub(super) recorded: RecordedFrame<B>,
    pub(super) after: Contained<AfterSubmission<B>>,
    pub(super) recorded_at: Instant,
}

/// A frame on its way to the completion thread.
pub(super) struct AwaitedFrame<B: Backend>
where
    B::Submission: Send,
{
    pub(super) slot: FrameSlot<B>,
    pub(super) recorded_at: Instant,
    /// Begin and end of the submission.
    pub(super) start: Instant,
    pub(super) end: Instant,
    pub(super) outcome: Result<Submission<B>, FrameLoopError>,
}

/// A frame that was submitted, the fence at its end, and whether the engine's code panicked after its submission.
pub(super) type Submission<B> = (SubmittedFrame<B>, Fence, Result<(), FrameLoopError>);
