//! A frame's slot among the frames in flight, the queues that it passes, and how it ends.

use std::collections::VecDeque;
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom_jobs::internal::{current_thread, list_wait};
use parking_lot::{Condvar, Mutex};

use crate::backend::{Backend, BackendError, GuardedBackend};
use crate::fence::{Fence, FenceError};
use crate::frame::{FrameError, RecordedFrame, SubmitError, SubmittedFrame};
use crate::timeline::Timeline;
use crate::unwind::{Contained, discard_all};

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

/// How far the engine may run ahead of the device: a trade of throughput against latency and memory (S 9.0).
///
/// With `cpu` as the time of updating and recording a frame, and `device` as that of drawing it, a frame takes about
/// this long, and its picture shows the input of about that long ago when it is drawn:
///
/// | | a frame every | latency | buffers of |
/// | --- | --- | --- | --- |
/// | `SameFrame` | `cpu + device` | `cpu + device` | 1 frame |
/// | `Double` | the longer of both | up to twice the longer | 2 frames |
/// | `Triple` | the longer of both, also where single frames take longer | up to three times the longer | 3 frames |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Buffering {
    /// The device draws a frame before the engine begins the next one (S figure 9.2): the least latency and memory.
    /// While one works the other waits.
    SameFrame,
    /// The engine makes a frame while the device draws the one before (S figure 9.1).
    #[default]
    Double,
    /// A frame more, so that neither waits where single frames of the other take longer.
    Triple,
}

impl Buffering {
    /// All of them, from the least latency to the most.
    pub const ALL: [Self; 3] = [Self::SameFrame, Self::Double, Self::Triple];

    /// The most frames from [`FrameLoop::begin`](super::FrameLoop::begin) until the device has drawn them.
    pub fn frames_in_flight(self) -> usize {
        match self {
            Self::SameFrame => 1,
            Self::Double => 2,
            Self::Triple => 3,
        }
    }
}

/// A frame that the device has drawn, or that failed after it was recorded.
pub struct FinishedFrame<B: Backend> {
    /// The number of its [slot](super::FrameSlot::number).
    pub number: u64,
    /// What was submitted, or why the frame is lost.
    pub outcome: Result<SubmittedFrame<B>, FrameLoopError>,
    /// When what happened.
    pub times: FrameTimes,
}

/// When a frame passed each station.
#[derive(Clone, Copy, Debug)]
pub struct FrameTimes {
    /// How long [`FrameLoop::begin`](super::FrameLoop::begin) waited for a slot: the engine was ahead of the device.
    pub waited: Duration,
    /// The end of that wait: from here on the engine samples its input.
    pub begun: Instant,
    /// The frame was recorded and handed over.
    pub recorded: Instant,
    /// The device thread began to submit it.
    pub submission_began: Instant,
    /// It was submitted.
    pub submitted: Instant,
    /// The device had drawn it, or it was found lost.
    pub finished: Instant,
}

impl FrameTimes {
    /// The time from the sampling of the input to the end of the device's work.
    pub fn latency(&self) -> Duration {
        self.finished.saturating_duration_since(self.begun)
    }

    /// How long the device had nothing to do before this frame, which follows `previous`: 0 if that was not finished
    /// yet.
    pub fn device_idle_since(&self, previous: &Self) -> Duration {
        self.submitted.saturating_duration_since(previous.finished)
    }
}

/// Why a [`FrameLoop`](super::FrameLoop) cannot start, or lost a frame. The frames behind a lost one are not affected
/// by that, unless they keep a [view](crate::scene::Redraw) that it was to draw: those that were recorded before it was
/// lost are refused, with [`SubmitError::LostView`].
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrameLoopError {
    /// The submitter belongs to another renderer.
    #[error("the submitter belongs to another renderer")]
    ForeignSubmitter,
    /// The OS started no thread.
    #[error("a thread of the frame loop could not start: {0}")]
    Thread(#[source] io::Error),
    /// The frame was not submitted.
    #[error(transparent)]
    Submit(#[from] SubmitError),
    /// No fence can be set at the frame's end.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The device was lost before it had drawn the frame.
    #[error("the device did not finish the frame: {0}")]
    Device(#[from] BackendError),
    /// The device took longer for the frame than its [limit](super::FrameLoop::set_device_limit).
    #[error("the device did not finish the frame: {0}")]
    Unfinished(#[from] FenceError),
    /// What the engine does [after the submission](super::FrameSlot::submit_then) panicked, or the backend while the
    /// device drew.
    #[error("the engine's code or the backend panicked after the submission of the frame: {message}")]
    Panicked {
        /// What the panic said.
        message: String,
    },
}

impl FrameLoopError {
    /// What the backend or its device says, if that is why the frame is lost: after [`BackendError::DeviceLost`] the
    /// engine [replaces the backend](super::FrameLoop::replace_backend).
    pub fn backend_error(&self) -> Option<&BackendError> {
        match self {
            Self::Submit(error) => error.backend_error(),
            Self::Frame(error) => error.backend_error(),
            Self::Device(error) => Some(error),
            Self::ForeignSubmitter | Self::Thread(_) | Self::Unfinished(_) | Self::Panicked { .. } => None,
        }
    }
}

/// The frames of a loop on their way from recording to submission, to the device, and back to the engine, and who may
/// begin another one. `Task` is what the device thread does.
pub(super) struct LoopQueues<Task, Awaited, Finished> {
    state: Mutex<State<Task, Awaited, Finished>>,
    /// Notified at each change: no more than three threads wait.
    changed: Condvar,
}

struct State<Task, Awaited, Finished> {
    buffering: Buffering,
    device_limit: Duration,
    /// Slots that are taken.
    in_flight: usize,
    tasks: VecDeque<Task>,
    awaited: VecDeque<Awaited>,
    finished: Vec<Finished>,
    /// No task comes after those in `tasks`.
    is_closed: bool,
    /// No frame comes after those in `awaited`.
    is_submission_over: bool,
}

impl<Task, Awaited, Finished> LoopQueues<Task, Awaited, Finished> {
    pub(super) fn new(buffering: Buffering, device_limit: Duration) -> Self {
        let state = State {
            buffering,
            device_limit,
            in_flight: 0,
            tasks: VecDeque::new(),
            awaited: VecDeque::new(),
            finished: Vec::new(),
            is_closed: false,
            is_submission_over: false,
        };
        Self { state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Waits for a free slot, if it may, and takes one, with the frames that have finished.
    pub(super) fn take_slot(&self, may_wait: bool) -> Vec<Finished> {
        let mut state = self.state.lock();
        if may_wait && state.in_flight >= state.buffering.frames_in_flight() {
            // Whoever waits too long for what comes after this is told of this wait, too.
            let _listed = list_wait(current_thread(), "a slot of the frame loop");
            while state.in_flight >= state.buffering.frames_in_flight() {
                self.changed.wait(&mut state);
            }
        }
        state.in_flight += 1;
        std::mem::take(&mut state.finished)
    }

    pub(super) fn free_slot(&self) {
        self.change(|state| state.in_flight -= 1);
    }

    pub(super) fn take_finished(&self) -> Vec<Finished> {
        std::mem::take(&mut self.state.lock().finished)
    }

    /// Adds a task for the device thread. After the loop has ended there is none, and the task is dropped.
    pub(super) fn add_task(&self, task: Task) {
        let mut state = self.state.lock();
        if state.is_closed {
            // Dropping a frame frees its slot, which locks.
            drop(state);
            drop(task);
            return;
        }
        state.tasks.push_back(task);
        drop(state);
        self.changed.notify_all();
    }

    /// Waits for the device thread's next task; `None` when the loop ends.
    pub(super) fn next_task(&self) -> Option<Task> {
        self.next(|state| state.tasks.pop_front(), |state| state.is_closed)
    }

    pub(super) fn add_awaited(&self, frame: Awaited) {
        self.change(|state| state.awaited.push_back(frame));
    }

    /// Waits for the next frame that the device draws; `None` when the loop ends.
    pub(super) fn next_to_await(&self) -> Option<Awaited> {
        self.next(|state| state.awaited.pop_front(), |state| state.is_submission_over)
    }

    pub(super) fn add_finished(&self, frame: Finished) {
        self.change(|state| state.finished.push(frame));
    }

    /// Ends the loop when all tasks are done.
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

    fn change(&self, change: impl FnOnce(&mut State<Task, Awaited, Finished>)) {
        change(&mut self.state.lock());
        self.changed.notify_all();
    }

    /// Waits until `take` finds something, or `is_over`.
    fn next<T>(
        &self,
        take: impl Fn(&mut State<Task, Awaited, Finished>) -> Option<T>,
        is_over: impl Fn(&State<Task, Awaited, Finished>) -> bool,
    ) -> Option<T> {
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

/// The frames that nobody has taken. Whoever drops the last slot, or a thread of a loop that has ended itself, may drop
/// them. No others are left: each holds a slot, and so the queues.
impl<Task, Awaited, Finished> Drop for LoopQueues<Task, Awaited, Finished> {
    fn drop(&mut self) {
        discard_all(self.state.get_mut().finished.drain(..));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::NullBackend;

    #[test]
    fn the_device_is_idle_from_the_end_of_a_frame_to_the_submission_of_the_next() {
        let start = Instant::now();
        let times = |submitted: u64, finished: u64| {
            let at = |milliseconds| start + Duration::from_millis(milliseconds);
            FrameTimes {
                waited: Duration::ZERO,
                begun: start,
                recorded: start,
                submission_began: start,
                submitted: at(submitted),
                finished: at(finished),
            }
        };
        assert_eq!(times(9, 12).device_idle_since(&times(1, 4)), Duration::from_millis(5));
        assert_eq!(times(3, 12).device_idle_since(&times(1, 4)), Duration::ZERO);
    }

    #[test]
    fn what_the_backend_says_is_found_wherever_the_frame_was_lost() {
        let lost = || BackendError::DeviceLost { message: String::new() };
        let errors = [
            FrameLoopError::Device(lost()),
            FrameLoopError::Frame(FrameError::Backend(lost())),
            FrameLoopError::Submit(SubmitError::Backend(lost())),
        ];
        assert!(errors.iter().all(|error| error.backend_error().is_some()));
        assert!(FrameLoopError::ForeignSubmitter.backend_error().is_none());
    }

    #[test]
    fn a_slot_knows_how_long_it_was_waited_for() {
        let queues = Arc::new(FrameQueues::<NullBackend>::new(Buffering::Double, Duration::ZERO));
        drop(queues.take_slot(false));
        let slot = FrameSlot::new(Arc::clone(&queues), 7, Instant::now(), Duration::from_millis(3));
        assert_eq!((slot.number(), slot.waited()), (7, Duration::from_millis(3)));
    }
}
