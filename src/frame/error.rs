//! Errors of building a renderer, recording a frame and submitting it.

use crate::backend::BackendError;
use crate::graph::{GraphProblem, NodeError, RunError};
use crate::process::{PlanError, ProcessError};
use crate::quality::QualityError;
use crate::scene::{SceneError, ViewKind};
use crate::task::JobPanic;

/// Why a renderer cannot be built.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// The processes make no frame.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The quality is invalid.
    #[error(transparent)]
    Quality(#[from] QualityError),
    /// [`Granularity::Chunk`](super::Granularity::Chunk) of 0.
    #[error("`Granularity::Chunk` must be at least 1")]
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
    #[error("view {view:?} has kind {kind:?}, which no process draws")]
    NoProcess {
        /// The view.
        view: String,
        /// Its kind.
        kind: ViewKind,
    },
    /// Views that sample each other in a circle: see
    /// [`Declare::samples_view`](crate::process::Declare::samples_view).
    #[error("views sample each other: {0}")]
    CircularViews(GraphProblem),
    /// Views that draw layers of one texture differ in size.
    #[error("views {:?} and {:?} share the target {target:?}, but differ in size", views[0], views[1])]
    UnequalLayers {
        /// The target.
        target: String,
        /// Two views.
        views: [String; 2],
    },
    /// The processes that the scene requires make no frame.
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
    /// The backend could not begin the frame, or a pass was not finished.
    #[error("the backend refused the frame: {0}")]
    Backend(#[from] BackendError),
    /// A stage failed.
    #[error("{stage} failed: {source}")]
    Failed {
        /// The process, the view and the stage.
        stage: String,
        /// Why.
        source: NodeError,
    },
    /// A stage panicked, in the code of a process or in Drawloom's own. Where the program is built with `panic =
    /// "abort"` the program ends instead, as no panic can be caught.
    #[error("{stage} panicked: {message}")]
    Panicked {
        /// The process, the view and the stage.
        stage: String,
        /// What the panic said.
        message: String,
    },
    /// What a process declares or draws is invalid.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// A callback of the scheduler panicked.
    #[error(transparent)]
    Scheduler(#[from] JobPanic),
    /// The frame's stage graph does not compile: a bug in Drawloom.
    #[error("the frame's stage graph does not compile: {0}")]
    StageGraph(GraphProblem),
}

impl From<RunError> for FrameError {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Failed { node, source } => Self::Failed { stage: node, source },
            RunError::Panicked { node, message } => Self::Panicked { stage: node, message },
            RunError::Scheduler(panic) => Self::Scheduler(panic),
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
