//! A frame's place among the frames in flight.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::queues::{LoopQueues, RecordedFrame};
use crate::backend::Backend;
use crate::frame::{Recorded, Submitted};

/// A frame's place among the frames in flight. It is free again when the device has drawn the frame, or when this is dropped.
#[must_use = "a slot is freed when it is dropped"]
pub struct FrameSlot<B: Backend>
where
    B::Submission: Send,
{
    queues: Arc<LoopQueues<B>>,
    number: u64,
    begun: Instant,
    waited: Duration,
}

impl<B: Backend> FrameSlot<B>
where
    B::Submission: Send,
{
    pub(super) fn new(queues: Arc<LoopQueues<B>>, number: u64, begun: Instant, waited: Duration) -> Self {
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
    pub fn submit(self, recorded: Recorded<B>) {
        self.submit_then(recorded, |_| ());
    }

    /// Hands a recorded frame to the device thread, which calls `after` when the frame is submitted: to present it, for example. If `after`
    /// panics, the frame is [reported](super::FrameLoopError::Panicked) as failed.
    pub fn submit_then(self, recorded: Recorded<B>, after: impl FnOnce(&Submitted<B>) + Send + 'static) {
        let queues = Arc::clone(&self.queues);
        let frame = RecordedFrame { slot: self, recorded, after: Box::new(after), recorded_at: Instant::now() };
        queues.add_recorded(frame);
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
