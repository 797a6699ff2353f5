//! What the threads of a frame loop share: the frames on their way from one to the next.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex};

use super::{Buffering, FinishedFrame, FrameLoopError, FrameSlot};
use crate::backend::Backend;
use crate::fence::Fence;
use crate::frame::{Recorded, Submitted};

/// What the engine does when a frame is submitted.
type AfterSubmission<B> = Box<dyn FnOnce(&Submitted<B>) + Send>;

/// A frame on its way to the device thread.
pub(super) struct RecordedFrame<B: Backend>
where
    B::Submission: Send,
{
    pub(super) slot: FrameSlot<B>,
    pub(super) recorded: Recorded<B>,
    pub(super) after: AfterSubmission<B>,
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
    /// With the fence at the frame's end.
    pub(super) outcome: Result<(Submitted<B>, Fence), FrameLoopError>,
}

/// The frames of a loop, and who may begin another one.
pub(super) struct LoopQueues<B: Backend>
where
    B::Submission: Send,
{
    state: Mutex<State<B>>,
    /// Notified at each change: no more than three threads wait.
    changed: Condvar,
}

struct State<B: Backend>
where
    B::Submission: Send,
{
    buffering: Buffering,
    device_limit: Duration,
    /// Slots that are taken.
    in_flight: usize,
    recorded: VecDeque<RecordedFrame<B>>,
    awaited: VecDeque<AwaitedFrame<B>>,
    finished: Vec<FinishedFrame<B>>,
    /// No frame comes after those in `recorded`.
    is_closed: bool,
    /// No frame comes after those in `awaited`.
    is_submission_over: bool,
}

impl<B: Backend> LoopQueues<B>
where
    B::Submission: Send,
{
    pub(super) fn new(buffering: Buffering, device_limit: Duration) -> Self {
        let state = State {
            buffering,
            device_limit,
            in_flight: 0,
            recorded: VecDeque::new(),
            awaited: VecDeque::new(),
            finished: Vec::new(),
            is_closed: false,
            is_submission_over: false,
        };
        Self { state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Waits for a free slot and takes it, with the frames that have finished.
    pub(super) fn take_slot(&self) -> Vec<FinishedFrame<B>> {
        let mut state = self.state.lock();
        while state.in_flight >= state.buffering.frames_in_flight() {
            self.changed.wait(&mut state);
        }
        state.in_flight += 1;
        std::mem::take(&mut state.finished)
    }

    pub(super) fn free_slot(&self) {
        self.change(|state| state.in_flight -= 1);
    }

    pub(super) fn take_finished(&self) -> Vec<FinishedFrame<B>> {
        std::mem::take(&mut self.state.lock().finished)
    }

    /// Adds a frame for the device thread. After the loop has ended there is none, and the frame is dropped.
    pub(super) fn add_recorded(&self, frame: RecordedFrame<B>) {
        let mut state = self.state.lock();
        if state.is_closed {
            // Dropping it frees its slot, which locks.
            drop(state);
            drop(frame);
            return;
        }
        state.recorded.push_back(frame);
        drop(state);
        self.changed.notify_all();
    }

    /// Waits for the next frame to submit; `None` when the loop ends.
    pub(super) fn next_to_submit(&self) -> Option<RecordedFrame<B>> {
        self.next(|state| state.recorded.pop_front(), |state| state.is_closed)
    }

    pub(super) fn add_awaited(&self, frame: AwaitedFrame<B>) {
        self.change(|state| state.awaited.push_back(frame));
    }

    /// Waits for the next frame that the device draws; `None` when the loop ends.
    pub(super) fn next_to_await(&self) -> Option<AwaitedFrame<B>> {
        self.next(|state| state.awaited.pop_front(), |state| state.is_submission_over)
    }

    pub(super) fn add_finished(&self, frame: FinishedFrame<B>) {
        self.change(|state| state.finished.push(frame));
    }

    /// Ends the loop when the frames that are recorded are submitted.
    pub(super) fn close(&self) {
        self.change(|state| state.is_closed = true);
    }

    /// The device thread has submitted its last frame.
    pub(super) fn end_submission(&self) {
        self.change(|state| state.is_submission_over = true);
    }

    pub(super) fn buffering(&self) -> Buffering {
        self.state.lock().buffering
    }

    pub(super) fn set_buffering(&self, buffering: Buffering) {
        self.change(|state| state.buffering = buffering);
    }

    pub(super) fn device_limit(&self) -> Duration {
        self.state.lock().device_limit
    }

    pub(super) fn set_device_limit(&self, limit: Duration) {
        self.change(|state| state.device_limit = limit);
    }

    fn change(&self, change: impl FnOnce(&mut State<B>)) {
        change(&mut self.state.lock());
        self.changed.notify_all();
    }

    /// Waits until `take` finds something, or `is_over`.
    fn next<T>(&self, take: impl Fn(&mut State<B>) -> Option<T>, is_over: impl Fn(&State<B>) -> bool) -> Option<T> {
        let mut state = self.state.lock();
        loop {
            if let Some(taken) = take(&mut state) {
                return Some(taken);
            }
            if is_over(&state) {
                return None;
            }
            self.changed.wait(&mut state);
        }
    }
}
