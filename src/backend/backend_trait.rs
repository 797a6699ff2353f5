//! The interface between frames and devices, in three traits: the device, what records its frames, and its extras.

use std::ops::Range;
use std::sync::Arc;

use super::error::BackendError;
use super::picture::Picture;
use super::requests::{FrameFence, FrameRequest, PassRequest, SceneLimits, TargetMemory, ViewQueue};
use crate::command::DrawState;
use crate::process::{Draws, FramePlan};
use crate::quality::{Quality, VertexFormat};
use crate::scene::Mesh;
use crate::timeline::{Labels, TuningChoice};

/// A device that frames are recorded for. It needs all methods of this trait and of [`FrameRecorder`]; what only some
/// devices can do is in [`BackendExtras`]. To change some calls of another backend, implement
/// [`BackendLayer`](super::BackendLayer) instead.
///
/// The order within a frame:
///
/// 1. `limits`, `check_mesh` for each mesh that is new, and `begin`.
/// 2. In any order and at the same time: `upload_objects` for every block of objects, unless `objects_epoch` is the
///    current epoch, and the passes. Of each pass of commands `prepare`, then `record` for each range of its parts;
///    then `finish` of each encoder, most often one pass. If all objects changed, a block is uploaded as soon as it is
///    described, while other jobs describe other blocks.
/// 3. `recording_choice` for every pass, and `target_memory`.
/// 4. `read_back`.
/// 5. Later, on the device thread, `submit`.
///
/// `prepare_pipelines` is called at any time, also beside a frame. A panic of a method fails the frame with an error
/// that names the method or the stage of the pass, and the next frame is not affected.
///
/// What a backend must honour:
///
/// - Depth is reversed: 1 at the near plane, and 0 at the far plane or at infinity. Depth targets are cleared to 0, and
///   what is nearer has a greater depth.
/// - Views with [`RenderView::is_cached`](crate::view::RenderView::is_cached) have no passes in the frame, but
///   processes of other views sample their targets. So the targets of a cached view keep their content from frame to
///   frame.
/// - Batches whose state has a [subdivision level](crate::command::DrawState::subdivision_level) above 0 draw their
///   mesh [subdivided](crate::scene::Mesh::subdivided), as a triangle list whose longest edge is that of the mesh,
///   halved that often. Objects whose mesh cannot be subdivided that far are drawn nevertheless, and counted as
///   [`CoarseEdges`](crate::view::IssueReason::CoarseEdges).
/// - Partial batches draw only the triangles in [`DrawList::remaining`](crate::command::DrawList::remaining).
/// - Batches are drawn in the order of their list, and passes in that of the queues.
pub trait Backend: FrameRecorder {
    /// A submitted frame.
    type Submission;

    /// The name of the device, for reports.
    fn adapter_name(&self) -> String;

    /// What the backend can hold of a scene, asked before each frame: none is lost because of what is beyond.
    /// [`SceneLimits::NONE`] if there is no limit.
    fn limits(&self) -> SceneLimits;

    /// Whether frames can draw a mesh with vertices in this format. Asked once for each mesh of the assets, used or
    /// not, before the first frame with it, and again after another backend or format was set. Objects with a mesh that
    /// cannot be drawn are left out, and counted as [`UndrawableMesh`](crate::view::IssueReason::UndrawableMesh);
    /// the error becomes a warning. `begin` never sees that mesh among the used ones.
    ///
    /// # Errors
    /// If it cannot be drawn, as it exceeds a limit of the device, or is in buffers that the backend cannot read.
    fn check_mesh(&self, mesh: &Mesh, vertices: VertexFormat) -> Result<(), BackendError>;

    /// Compiles the shaders of a plan's processes, and makes the pipelines for objects of these states of each process,
    /// ahead of the first frame that needs them. A backend without pipelines does nothing.
    ///
    /// # Errors
    /// If the device refuses a shader or a pipeline.
    fn prepare_pipelines(
        &self,
        plan: &FramePlan,
        draws: &[Draws<'_>],
        states: &[Vec<DrawState>],
        quality: &Quality,
    ) -> Result<(), BackendError>;

    /// Begins a frame: uploads changed meshes, materials and textures, and creates targets and pipelines. Of the
    /// meshes, the frame draws none but the [used ones](crate::view::ObjectTable::used_meshes).
    ///
    /// # Errors
    /// If the device lacks room for the frame's resources, or refuses them.
    fn begin(&self, request: &FrameRequest<'_>) -> Result<Self::Frame, BackendError>;

    /// The memory of the targets of a frame; all 0 for a backend that does not know.
    fn target_memory(&self, frame: &Self::Frame) -> TargetMemory;

    /// How a pass, by index, of a recorded frame was recorded, and why; `None` if the backend had no choice, or made
    /// none by measured cost. `labels` are those of the pass.
    fn recording_choice(&self, frame: &Self::Frame, pass: usize, labels: &Arc<Labels>) -> Option<TuningChoice>;

    /// Has a view's target read back as a recorded frame leaves it, when the frame is submitted. It does not wait.
    ///
    /// # Errors
    /// If there is no such target, or the device refuses; [`BackendError::CannotReadBack`] from a backend that reads
    /// nothing back.
    fn read_back(&self, frame: &mut Self::Frame, view: usize, target: &str) -> Result<Box<dyn ReadBack>, BackendError>;

    /// Submits a frame's queues one after the other. Called only on the device thread.
    ///
    /// A view has one queue, unless its plan has it submitted [process by
    /// process](crate::process::internal::ViewOrder::ProcessByProcess): then it has several, with other views' between
    /// them.
    ///
    /// The device sets each of `fences` when it has done all passes up to the fence's place; they are in the order of
    /// their places. A fence that is dropped is abandoned, so after an error none need be set.
    ///
    /// # Errors
    /// If the device refuses.
    fn submit(
        &self,
        frame: Self::Frame,
        queues: Vec<ViewQueue<Self::Commands>>,
        fences: Vec<FrameFence>,
    ) -> Result<Self::Submission, BackendError>;

    /// What this backend can do that others cannot: `&NoExtras` if that is nothing.
    fn extras(&self) -> &dyn BackendExtras;
}

/// What records the passes of a frame. Jobs of the frame call it, several at once (M 10.3), from `begin` until all
/// passes are finished; [`FrameRecorder::shares_encoder`] is called before the first of these jobs.
pub trait FrameRecorder: Send + Sync + 'static {
    /// The state of a frame in flight, from `begin` to `submit`.
    type Frame: Send + Sync;
    /// A part of a pass that is recorded before the pass is finished, such as a bundle.
    type Part: Send;
    /// A finished pass, ready to be submitted.
    type Commands: Send;

    /// The [epoch](crate::view::ObjectTable::epoch) of the object table that the frame's buffers hold already; 0 if
    /// they hold none. If it is the current one, nothing is uploaded.
    fn objects_epoch(&self, frame: &Self::Frame) -> u64;

    /// Uploads blocks of objects, as [`FrameRequest::objects`] describes them, and the
    /// [columns](crate::scene::ObjectColumn) of these objects that the plan reads: at least what changed since
    /// [`FrameRecorder::objects_epoch`]. Other blocks may be described meanwhile.
    ///
    /// # Errors
    /// If the device refuses.
    fn upload_objects(
        &self,
        frame: &Self::Frame,
        request: &FrameRequest<'_>,
        blocks: Range<usize>,
    ) -> Result<(), BackendError>;

    /// Prepares a pass of commands for recording: uploads the indices of its objects, and creates missing pipelines.
    ///
    /// # Errors
    /// If the device refuses. Compile errors of the process's shader are reported here at the latest.
    fn prepare(&self, frame: &Self::Frame, pass: &PassRequest<'_>) -> Result<(), BackendError>;

    /// The number of parts to record before the pass is finished; 0 if `finish` records the whole pass. Constant
    /// throughout a frame.
    fn part_count(&self, frame: &Self::Frame, pass: &PassRequest<'_>) -> usize;

    /// Records a range of a pass's parts, and calls `emit` with each of them, in order.
    ///
    /// # Errors
    /// If the device refuses what was recorded.
    fn record(
        &self,
        frame: &Self::Frame,
        pass: &PassRequest<'_>,
        parts: Range<usize>,
        emit: &mut dyn FnMut(Self::Part),
    ) -> Result<(), BackendError>;

    /// Whether a pass, by index, of a frame that has begun is encoded in the encoder of the pass before it in
    /// submission order; always `false` if every pass has an encoder of its own. Constant throughout a frame. At most
    /// 16 passes share an encoder.
    fn shares_encoder(&self, frame: &Self::Frame, pass: usize) -> bool;

    /// Finishes an encoder: passes that follow each other in submission order, most often one. A layer may have them
    /// share an encoder even if the backend does not. Each pass is finished from its parts, or recorded if it has none;
    /// the draw list of a pass without commands is empty. Calls `emit` with the commands of each pass, in order.
    ///
    /// `parts` has those of each pass. The backend may take parts out; the caller drops those it leaves, and reuses the
    /// memory of the vectors.
    ///
    /// # Errors
    /// If the device refuses a pass: the one after those whose commands were emitted.
    fn finish(
        &self,
        frame: &Self::Frame,
        passes: &[PassRequest<'_>],
        parts: &mut [Vec<Self::Part>],
        emit: &mut dyn FnMut(Self::Commands),
    ) -> Result<(), BackendError>;
}

/// What only some backends can do. A method without an implementation asks the [inner](Self::inner_extras) backend, and
/// if there is none says that the backend can do no such thing.
pub trait BackendExtras {
    /// The [extras](Backend::extras) of the backend that this one wraps; `None` if it wraps none.
    fn inner_extras(&self) -> Option<&dyn BackendExtras>;

    /// The number of bytes uploaded to the device so far.
    fn uploaded_bytes(&self) -> u64 {
        self.inner_extras().map_or(0, BackendExtras::uploaded_bytes)
    }

    /// Whether targets of [`Format::Rgba32FloatBlendable`](crate::process::Format::Rgba32FloatBlendable) can be drawn
    /// into. Without them, some of [`RadianceSum`](crate::quality::RadianceSum) falls back to half floats.
    fn can_blend_floats(&self) -> bool {
        self.inner_extras().is_some_and(BackendExtras::can_blend_floats)
    }

    /// Whether there is work that a background job does between two frames, such as uploads of what is streamed.
    fn has_background_work(&self) -> bool {
        self.inner_extras().is_some_and(BackendExtras::has_background_work)
    }

    /// Does as much of that work as should be done between two frames. The renderer has a [background
    /// job](crate::task::Scheduler::background) call it after a frame was recorded, unless the last such job still
    /// runs; a scheduler with a single worker has no time for such jobs, so there the calling thread does it when a
    /// frame was recorded.
    fn work_in_background(&self) {
        if let Some(inner) = self.inner_extras() {
            inner.work_in_background();
        }
    }

    /// Calls `count` with the name and value of each number that the timeline shows for every frame, beside the bytes
    /// that it uploaded.
    fn counters(&self, count: &mut dyn FnMut(&'static str, f64)) {
        if let Some(inner) = self.inner_extras() {
            inner.counters(count);
        }
    }

    /// A frame failed while it was recorded, perhaps before `begin`: drops what the engine has set for this frame
    /// alone.
    fn discard_frame(&self) {
        if let Some(inner) = self.inner_extras() {
            inner.discard_frame();
        }
    }

    /// Makes the next frame's [histories](crate::process::Declare::samples_previous) empty.
    fn forget_histories(&self) {
        if let Some(inner) = self.inner_extras() {
            inner.forget_histories();
        }
    }

    /// Whether the next frame draws a target of the view of this name into a texture of the engine's own. That view is
    /// never cached.
    fn imports_targets_of(&self, view: &str) -> bool {
        self.inner_extras().is_some_and(|inner| inner.imports_targets_of(view))
    }
}

/// The [extras](Backend::extras) of a backend that has none.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoExtras;

impl BackendExtras for NoExtras {
    fn inner_extras(&self) -> Option<&dyn BackendExtras> {
        None
    }
}

/// A target as one frame leaves it, on its way to the CPU: see [`Backend::read_back`].
pub trait ReadBack: Send {
    /// The pixels, if the device is done with the frame; `None` if it is not, or the frame is not submitted yet. It
    /// does not wait.
    ///
    /// # Errors
    /// If the frame was dropped, or the device is lost.
    fn try_read(&self) -> Result<Option<Picture>, BackendError>;

    /// Waits until the device is done with the frame, which is submitted, and returns the pixels.
    ///
    /// # Errors
    /// If the frame is not submitted, or the device is lost.
    fn read(&self) -> Result<Picture, BackendError>;
}
