//! What the threads of a frame loop share: queues of frames, whatever these are at each station.

use std::collections::VecDeque;
use std::time::Duration;

use drawloom_jobs::internal::{current_thread, list_wait};
use parking_lot::{Condvar, Mutex};

use super::Buffering;
use crate::unwind::discard_all;

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
