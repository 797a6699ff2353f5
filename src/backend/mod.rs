//! Backends: what turns batches into recorded chunks, and submits them (M 10.3, "Submitting a RenderCommand to the API").

mod null;
mod picture;
mod software;
mod subdivisions;
mod texels;
#[cfg(feature = "wgpu")]
mod wgpu;
use std::ops::Range;

use crate::command::DrawList;
use crate::process::{Draws, FramePlan, Pass};
use crate::quality::Quality;
use crate::scene::SceneRef;
use crate::task::Worker;
use crate::view::{LightTable, ObjectTable, Rejections, RenderView};

#[cfg(feature = "wgpu")]
pub use self::wgpu::{
    DeviceClock, Encode, PassTime, PassTimes, Record, WgpuBackend, WgpuPass, WgpuResources, WgpuSubmission,
};
pub use null::{NullBackend, NullPass, NullSubmission};
pub use picture::Picture;
pub use software::{SoftwareBackend, SoftwareSubmission};

/// What a frame needs of a device. Everything but [`Backend::submit`] is called while a frame is recorded, most of it from
/// several workers at once; each of those takes the worker as proof that it runs in a job (M 10.3 asserts it).
///
/// The order within a frame: `begin`; then `upload_objects` for every block of objects, and for every pass `prepare`,
/// `record` for each run of its parts, and `finish`; then, later and on the device thread, `submit`.
pub trait Backend: Send + Sync + 'static {
    /// What one frame holds from `begin` until it was submitted.
    type Frame: Send + Sync;
    /// What is recorded of a pass before it is finished: a bundle, say.
    type Part: Send;
    /// A finished pass, ready to be submitted.
    type Commands: Send;
    /// What is known of a frame that was submitted.
    type Submission;

    /// What draws, as reports print it.
    fn adapter(&self) -> String;

    /// How many bytes were uploaded to the device since the backend was made: 0 where nothing is.
    fn uploaded(&self) -> u64 {
        0
    }

    /// Starts a frame: uploads what changed of meshes, materials and textures, and makes targets and pipelines.
    ///
    /// # Errors
    /// If the device cannot hold or make what the frame needs.
    fn begin(&self, request: &FrameRequest<'_>) -> Result<Self::Frame, BackendError>;

    /// Uploads objects: these blocks of the table.
    ///
    /// # Errors
    /// If the device refuses.
    fn upload_objects(
        &self,
        worker: &Worker,
        frame: &Self::Frame,
        objects: &ObjectTable,
        blocks: Range<usize>,
    ) -> Result<(), BackendError>;

    /// Makes a pass of commands ready to be recorded: uploads which objects it draws, and makes the pipelines it needs.
    ///
    /// # Errors
    /// If the device refuses; a shader of the process that does not compile is found here at the latest.
    fn prepare(&self, worker: &Worker, frame: &Self::Frame, pass: &PassRequest<'_>) -> Result<(), BackendError>;

    /// How many parts of a pass are to be recorded before it is finished; 0 where it is recorded as it is finished. The same
    /// throughout a frame.
    fn parts(&self, frame: &Self::Frame, pass: &PassRequest<'_>) -> usize;

    /// Records parts of a pass, and puts each of them, in order.
    ///
    /// # Errors
    /// If the device refuses what was recorded.
    fn record(
        &self,
        worker: &Worker,
        frame: &Self::Frame,
        pass: &PassRequest<'_>,
        parts: Range<usize>,
        put: &mut dyn FnMut(Self::Part),
    ) -> Result<(), BackendError>;

    /// Finishes a pass: its parts in order, or what it draws without any. A pass without commands has an empty list. What it
    /// leaves of the parts is dropped; the memory is used again.
    ///
    /// # Errors
    /// If the device refuses the pass.
    fn finish(
        &self,
        worker: &Worker,
        frame: &Self::Frame,
        pass: &PassRequest<'_>,
        parts: &mut Vec<Self::Part>,
    ) -> Result<Self::Commands, BackendError>;

    /// Submits a frame's passes in this order. Called on the device thread alone.
    ///
    /// # Errors
    /// If the device refuses.
    fn submit(&self, frame: Self::Frame, passes: Vec<(Pass, Self::Commands)>)
    -> Result<Self::Submission, BackendError>;
}

/// What a frame is to be.
#[derive(Clone, Copy)]
pub struct FrameRequest<'a> {
    /// The processes and their targets.
    pub plan: &'a FramePlan,
    /// What each process draws, in the plan's order.
    pub draws: &'a [Draws<'a>],
    /// The views. A kept one's targets still hold what an earlier frame drew: see [`RenderView::is_cached`].
    pub views: &'a [RenderView],
    /// The lights that reach each view.
    pub lights: &'a [LightTable],
    /// Each process in each of its views, in the order they are submitted.
    pub passes: &'a [Pass],
    /// The scene.
    pub scene: &'a SceneRef<'a>,
    /// How accurate the frame is to be.
    pub quality: &'a Quality,
    /// Where the backend counts what it leaves out.
    pub rejections: &'a Rejections,
}

/// What one pass of a frame is to be.
#[derive(Clone, Copy)]
pub struct PassRequest<'a> {
    /// The frame.
    pub frame: &'a FrameRequest<'a>,
    /// The process and the view.
    pub pass: Pass,
    /// What it draws; empty for a pass without commands.
    pub list: &'a DrawList,
}

/// What a device could not do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BackendError {
    /// The device lacks a feature; see the backend's constants for all it needs.
    #[error("the device lacks {missing}, which Drawloom needs")]
    MissingFeature {
        /// The features.
        missing: String,
    },
    /// The device's limits are too low; see the backend's constants for all it needs.
    #[error("the device's {limit} is {allowed}, and {needed} are needed")]
    Limit {
        /// Which limit.
        limit: &'static str,
        /// What the device allows.
        allowed: u64,
        /// What is needed.
        needed: u64,
    },
    /// The device refused what a pass recorded: an error in a process's shader, targets or parameters.
    #[error("the device refused {label}: {message}")]
    Validation {
        /// What it was.
        label: String,
        /// What the device says.
        message: String,
    },
    /// The device is out of memory.
    #[error("the device is out of memory for {label}")]
    OutOfMemory {
        /// What there was no room for.
        label: String,
    },
    /// The device was lost.
    #[error("the device was lost: {message}")]
    DeviceLost {
        /// What the device says.
        message: String,
    },
    /// The view's camera is too far from the world's origin, or its numbers are not finite.
    #[error("view {view:?} is out of reach: its camera is more than 2^32 m from the origin")]
    ViewOutOfReach {
        /// The view.
        view: String,
    },
    /// A process has no CPU shader to run in place of its WGSL on the software backend.
    #[error("process {process:?} has no CPU shader, so the software backend cannot draw it")]
    NoCpuShader {
        /// The process.
        process: String,
    },
    /// A process's CPU shader panicked.
    #[error("the CPU shader of process {process:?} panicked: {message}")]
    CpuShaderPanicked {
        /// The process.
        process: String,
        /// What the panic said.
        message: String,
    },
    /// A raw pass reported an error.
    #[error("the raw pass failed: {0}")]
    RawPass(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// A target that no view has was asked for.
    #[error("view {view} has no target {target:?}")]
    UnknownTarget {
        /// The view's index.
        view: usize,
        /// The name asked for.
        target: String,
    },
    /// When the device drew a pass was asked, and it had not been told to write that down.
    #[error("passes are not timed: see `WgpuBackend::time_passes`")]
    NotTimed,
    /// What was handed over breaks a rule of the frame: an error of Drawloom's own.
    #[error("broken rule: {rule}")]
    BrokenRule {
        /// The rule.
        rule: String,
    },
}
