//! Errors of building a renderer, recording a frame and submitting it.

use super::encoders::{FailedPass, PassFailure};
use crate::backend::{BackendError, CallPanic};
use crate::fence::FenceError;
use crate::graph::{GraphProblem, NodeError, RunError};
use crate::process::PlanError;
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
    /// A view that is a face of a cube map, and not square.
    #[error("view {view:?} is a face of a cube map, and has {width}x{height} pixels")]
    OblongCubeFace {
        /// The view.
        view: String,
        /// In pixels.
        width: u32,
        /// In pixels.
        height: u32,
    },
    /// More views than [`FrameError::MAX_VIEWS`].
    #[error("{views} views are more than the {} of a frame", Self::MAX_VIEWS)]
    TooManyViews {
        /// How many.
        views: usize,
    },
    /// The [predicate on materials](crate::scene::ViewFilter::materials) of a view's filter panicked. Where the
    /// program is built with `panic = "abort"` the program ends instead.
    #[error("the filter of view {view:?} panicked: {message}")]
    FilterPanicked {
        /// The view.
        view: String,
        /// What the panic said.
        message: String,
    },
    /// What the processes declare or draw is invalid, or the scene lacks what they read.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The scene cannot be drawn.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A process draws items in a view, and the engine lends none for that. A frame without items lends empty slices.
    #[error("process {process:?} draws items in view {view:?}, and none are lent for it")]
    MissingItems {
        /// The process.
        process: String,
        /// The view.
        view: String,
    },
    /// Items are lent for a process that does not draw items.
    #[error("items are lent for process {process:?}, which does not draw items")]
    UnexpectedItems {
        /// The process.
        process: String,
    },
    /// Two sets of items are lent for a process in one view.
    #[error("two sets of items are lent for process {process:?} in view {view:?}")]
    RepeatedItems {
        /// The process.
        process: String,
        /// The view.
        view: String,
    },
    /// [`Items::data`](crate::process::Items::data) has a length that is not a multiple of 4.
    #[error("the items of process {process:?} have {bytes} bytes of data, which is not a multiple of 4")]
    ItemDataSize {
        /// The process.
        process: String,
        /// The length of the data.
        bytes: usize,
    },
    /// Slices of [`Items`](crate::process::Items) whose lengths differ.
    #[error("the items of process {process:?} have {keys} keys but {count} {slice}")]
    UnequalItems {
        /// The process.
        process: String,
        /// The name of the slice.
        slice: &'static str,
        /// Its length.
        count: usize,
        /// The length of `keys`.
        keys: usize,
    },
    /// An item changed, and [`Items::changes`](crate::process::Items::changes) do not report it. Only found with debug
    /// assertions.
    #[error("item {item} of process {process:?} changed, which is not reported")]
    UnreportedItemChange {
        /// The process.
        process: String,
        /// The item's index.
        item: usize,
    },
    /// Items are more than can be numbered by 32 bits.
    #[error("{count} items are lent for process {process:?}, and at most {} can be drawn", u32::MAX)]
    TooManyItems {
        /// The process.
        process: String,
        /// Their number.
        count: usize,
    },
    /// The backend could not begin the frame, or a pass was not finished.
    #[error("the backend refused the frame: {0}")]
    Backend(#[from] BackendError),
    /// A stage failed, or a node of the engine's own.
    #[error("{stage} failed: {source}")]
    Failed {
        /// The process, the view and the stage; or the name of the node.
        stage: String,
        /// Why.
        source: NodeError,
    },
    /// A stage panicked, in the code of a process, of a node, of a backend, or in Drawloom's own; or a call of the
    /// backend beside the stages. Where the program is built with `panic = "abort"` the program ends instead, as no
    /// panic can be caught.
    #[error("{stage} panicked: {message}")]
    Panicked {
        /// The process, the view and the stage; the stage alone where it is the whole frame's; the name of the node; or
        /// the call, such as "the backend's begin".
        stage: String,
        /// What the panic said.
        message: String,
    },
    /// A frame failed, and the backend panicked when it was told to discard what the engine has set for that frame. The
    /// next frame may still have that.
    #[error("{error}; then the backend's discard_frame panicked: {message}")]
    DiscardPanicked {
        /// Why the frame failed.
        error: Box<FrameError>,
        /// What the panic said.
        message: String,
    },
    /// A callback of the scheduler panicked.
    #[error(transparent)]
    Scheduler(#[from] JobPanic),
    /// A frame has no such [place](super::FencePoint).
    #[error("the frame draws nothing at this place: {place}")]
    UnknownPlace {
        /// The place.
        place: String,
    },
    /// The [nodes](super::CpuNode) of the engine's own make no graph with the frame's stages.
    #[error("the nodes of the frame make no graph: {0}")]
    Nodes(GraphProblem),
    /// A [node](super::CpuNode) declares what no node can, or has the name of a stage.
    #[error("node {node:?} {problem}")]
    InvalidNode {
        /// The node.
        node: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A node declares to fill a [buffer](crate::scene::GeneratedBuffer), and leaves out some of the elements that
    /// count.
    #[error("no node has filled chunk {chunk} of buffer {buffer:?}")]
    UnfilledBuffer {
        /// The buffer.
        buffer: String,
        /// The first chunk that is not filled.
        chunk: usize,
    },
    /// There is not enough memory for what a node declares to fill a [buffer](crate::scene::GeneratedBuffer) with.
    #[error("there is not enough memory for the {capacity} elements of {stride} bytes of buffer {buffer:?}")]
    GeneratedMemory {
        /// The buffer.
        buffer: String,
        /// The number of elements that it has room for.
        capacity: usize,
        /// The size of an element in bytes.
        stride: usize,
    },
    /// The frame's stage graph does not compile: a bug in Drawloom.
    #[error("the frame's stage graph does not compile: {0}")]
    StageGraph(GraphProblem),
}

impl FrameError {
    /// The most views of a frame, shadow maps among them. Each has passes and targets of its own.
    pub const MAX_VIEWS: usize = 4_096;

    /// What the backend or its device says, if that is why the frame failed.
    pub fn backend_error(&self) -> Option<&BackendError> {
        match self {
            Self::Backend(error) => Some(error),
            Self::Failed { source, .. } => source.downcast_ref(),
            Self::DiscardPanicked { error, .. } => error.backend_error(),
            _ => None,
        }
    }

    /// The error of a frame's run. If a pass was not finished, the error has the name that `finish_of` gives that pass,
    /// by index: the job of another pass of its encoder may have met it.
    pub(super) fn of_run(error: RunError, finish_of: impl FnOnce(usize) -> String) -> Self {
        let (stage, source) = match error {
            RunError::Failed { node, source } => (node, source),
            RunError::Panicked { node, message } => return Self::Panicked { stage: node, message },
            RunError::Scheduler(panic) => return Self::Scheduler(panic),
            other => ("the run of the graph".to_owned(), other.into()),
        };
        match source.downcast::<FailedPass>() {
            Err(source) => Self::Failed { stage, source },
            Ok(failed) => match failed.failure {
                PassFailure::Error(error) => Self::Failed { stage: finish_of(failed.pass), source: error.into() },
                PassFailure::Panic(panic) => Self::Panicked { stage: finish_of(failed.pass), message: panic.message },
            },
        }
    }
}

impl From<CallPanic> for FrameError {
    fn from(CallPanic { call, message }: CallPanic) -> Self {
        Self::Panicked { stage: format!("the backend's {call}"), message }
    }
}

/// Why a [`ViewBudget`](super::ViewBudget) is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BudgetError {
    /// The time is no budget.
    #[error(
        "a budget of {milliseconds} ms a frame is not from {} to {} ms",
        Self::MIN_MILLISECONDS,
        Self::MAX_MILLISECONDS
    )]
    InvalidBudget {
        /// The time.
        milliseconds: f64,
    },
    /// A quality level of a view's quality levels is invalid.
    #[error("quality level {level} of view {view:?} has {problem}")]
    InvalidQualityLevel {
        /// The view.
        view: String,
        /// The quality level.
        level: usize,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// A quality level of a view's quality levels comes after the one that leaves the view out.
    #[error(
        "quality level {level} of view {view:?} comes after the quality level that leaves the view out, which must be the last one"
    )]
    QualityLevelAfterLeftOut {
        /// The view.
        view: String,
        /// The quality level.
        level: usize,
    },
    /// Two cameras of one name.
    #[error("the budget has two cameras named {camera:?}: in view {:?} and in view {:?}", views[0], views[1])]
    DuplicateCamera {
        /// The name.
        camera: String,
        /// The views that have them, which may be the same.
        views: [String; 2],
    },
    /// Two views of one name.
    #[error("the budget has two views named {view:?}")]
    DuplicateView {
        /// The name.
        view: String,
    },
}

impl BudgetError {
    /// The smallest budget of a frame: a nanosecond.
    pub const MIN_MILLISECONDS: f64 = 1e-6;
    /// The largest budget of a frame.
    pub const MAX_MILLISECONDS: f64 = 1e12;
}

/// Why a recorded frame was not submitted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SubmitError {
    /// It was recorded by another renderer, or for a backend that this renderer [had
    /// before](super::Renderer::replace_backend) or has had since.
    #[error("the frame was recorded by another renderer, or for another backend")]
    ForeignFrame,
    /// The frame keeps a [view](crate::scene::Redraw) that an earlier frame was to draw, and that one was dropped,
    /// refused, or not submitted before this one. A frame that is recorded later draws the view anew.
    #[error("the frame shows view {view:?} as an earlier frame draws it, and that frame was not submitted")]
    LostView {
        /// The view.
        view: String,
    },
    /// A fence that it waits for was not set.
    #[error("the frame could not be submitted: {0}")]
    Fence(#[from] FenceError),
    /// The device refused it.
    #[error("the frame could not be submitted: {0}")]
    Backend(#[from] BackendError),
    /// The backend panicked. Where the program is built with `panic = "abort"` the program ends instead.
    #[error("the submission of the frame panicked: {message}")]
    Panicked {
        /// What the panic said.
        message: String,
    },
}

impl SubmitError {
    /// What the backend or its device says, if that is why the frame was not submitted.
    pub fn backend_error(&self) -> Option<&BackendError> {
        match self {
            Self::Backend(error) => Some(error),
            Self::ForeignFrame | Self::LostView { .. } | Self::Fence(_) | Self::Panicked { .. } => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_backend_says_is_found_behind_a_panic_that_followed() {
        let error = |error: FrameError| FrameError::DiscardPanicked { error: Box::new(error), message: String::new() };
        let lost = BackendError::DeviceLost { message: String::new() };
        assert!(error(FrameError::Backend(lost)).backend_error().is_some());
        assert!(error(FrameError::NoView).backend_error().is_none());
    }
}
