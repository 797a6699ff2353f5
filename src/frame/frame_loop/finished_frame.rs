//! A frame that the device has drawn, or that failed on the way.

use std::io;
use std::time::{Duration, Instant};

use crate::backend::{Backend, BackendError};
use crate::fence::FenceError;
use crate::frame::{FrameError, SubmitError, SubmittedFrame};

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
