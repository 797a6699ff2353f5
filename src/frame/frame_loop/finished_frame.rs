//! A frame that the device has drawn, or that failed on the way.

use std::io;
use std::time::{Duration, Instant};

use crate::backend::Backend;
use crate::fence::FenceError;
use crate::frame::{SubmitError, Submitted};

/// A frame that the device has drawn, or that failed after it was recorded.
pub struct FinishedFrame<B: Backend> {
    /// The number of its [slot](super::FrameSlot::number).
    pub number: u64,
    /// What was submitted, or why the frame is lost.
    pub outcome: Result<Submitted<B>, FrameLoopError>,
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

    /// How long the device had nothing to do before this frame, which follows `previous`: 0 if that was not finished yet.
    pub fn device_idle_since(&self, previous: &Self) -> Duration {
        self.submitted.saturating_duration_since(previous.finished)
    }
}

/// Why a [`FrameLoop`](super::FrameLoop) cannot start, or lost a frame. The frames behind a lost one are not affected by that.
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
    /// The device did not finish the frame: it failed, or took longer than its [limit](super::FrameLoop::set_device_limit).
    #[error("the device did not finish the frame: {0}")]
    Unfinished(#[from] FenceError),
    /// Code of the engine's panicked while the frame was submitted.
    #[error("the submission of the frame panicked: {message}")]
    Panicked {
        /// What the panic said.
        message: String,
    },
}
