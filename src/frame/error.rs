//! What can go wrong with a frame.

use crate::backend::BackendError;
use crate::graph::{GraphProblem, NodeError, RunError};
use crate::process::{PlanError, ProcessError};
use crate::quality::QualityError;
use crate::scene::{SceneError, ViewKind};
use crate::task::JobPanic;

/// Why there is no renderer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// The processes do not make a frame.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The quality cannot be.
    #[error(transparent)]
    Quality(#[from] QualityError),
    /// [`Granularity::Chunk`](super::Granularity::Chunk) of 0.
    #[error("a chunk of 0 draws makes no jobs")]
    EmptyChunk,
}

/// Why a frame was not recorded. The next one can be.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The scene has no camera.
    #[error("the scene has no camera, so there is no view to draw")]
    NoView,
    /// A picture without pixels, as a minimised window has.
    #[error("view {view:?} has a picture of {width}x{height} pixels")]
    EmptyTarget {
        /// The view.
        view: String,
        /// In pixels.
        width: u32,
        /// In pixels.
        height: u32,
    },
    /// A view that no process draws.
    #[error("no process draws views of kind {kind:?}, as view {view:?} is")]
    NoProcess {
        /// The view.
        view: String,
        /// Its kind.
        kind: ViewKind,
    },
    /// Views that draw layers of one texture differ in size.
    #[error("views {:?} and {:?} share the target {target:?}, but differ in size", views[0], views[1])]
    UnequalLayers {
        /// The target.
        target: String,
        /// Two views.
        views: [String; 2],
    },
    /// The processes do not make a frame of what the scene requires.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The scene cannot be drawn as it is.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// More objects than a command can name.
    #[error("{objects} objects are more than a frame can hold")]
    TooManyObjects {
        /// How many.
        objects: usize,
    },
    /// The device could not start the frame.
    #[error("the frame could not be started")]
    Backend(#[from] BackendError),
    /// A process failed in one of its phases.
    #[error("{phase} failed: {source}")]
    Failed {
        /// The process, the view and the phase.
        phase: String,
        /// Why.
        source: NodeError,
    },
    /// A process, or a job of the frame's own, panicked. Where the program is built with `panic = "abort"` the process ends
    /// instead, as no panic can be caught.
    #[error("{phase} panicked: {message}")]
    Panicked {
        /// The process, the view and the phase.
        phase: String,
        /// What the panic said.
        message: String,
    },
    /// A process cannot say what it draws, or says it wrong.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// A job outside of every process panicked.
    #[error(transparent)]
    Job(#[from] JobPanic),
    /// The frame's own jobs have no order: an error of Drawloom's own.
    #[error("the frame's jobs have no order: {0}")]
    Jobs(GraphProblem),
}

impl From<RunError> for FrameError {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Failed { node, source } => Self::Failed { phase: node, source },
            RunError::Panicked { node, message } => Self::Panicked { phase: node, message },
            RunError::Scheduler(panic) => Self::Job(panic),
        }
    }
}

/// Why a recorded frame was not submitted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SubmitError {
    /// It was recorded by another renderer.
    #[error("the frame was recorded by another renderer")]
    ForeignFrame,
    /// The device refused it.
    #[error("the frame could not be submitted: {0}")]
    Backend(#[from] BackendError),
}
