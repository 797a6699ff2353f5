//! A frame in flight through the wgpu backend: its commands, and its uploads.

use std::sync::Arc;

use super::frame_buffers::FrameBuffers;
use super::pass_state::WgpuPassState;
use crate::backend::error::broken_rule;
use crate::backend::mip_schedule::MipSchedule;
use crate::backend::wgpu::error_scope::{catch_wgpu_panic, with_error_scope};
use crate::backend::wgpu::pipelines::ProcessPipelines;
use crate::backend::wgpu::read_back::{ReadBackCopy, WgpuReadBack, new_read_back};
use crate::backend::wgpu::resources::{
    BindGroupLayouts, ImportedMeshes, LightMeshes, MeshSnapshot, SnapshotToken, StorageBuffers, WgpuTargets,
};
use crate::backend::wgpu::streaming::FrameUse;
use crate::backend::{BackendError, FrameRequest};
use crate::process::{BufferLayout, Pass};
use crate::scene::{GeneratedContents, Topology};
use crate::unwind::emit;

/// A frame in flight through the wgpu backend.
pub struct WgpuFrame {
    /// Counted from the backend's first frame.
    pub(crate) number: u64,
    /// [`FrameRequest::workers`](crate::backend::FrameRequest::workers).
    pub(crate) workers: usize,
    /// One for each render process.
    pub(crate) pipelines: Arc<[Arc<ProcessPipelines>]>,
    pub(crate) layouts: BindGroupLayouts,
    pub(crate) meshes: Arc<MeshSnapshot>,
    /// Keeps its textures from being overwritten.
    pub(crate) _textures: Arc<SnapshotToken>,
    /// Where it marks what it draws.
    pub(crate) frame_use: FrameUse,
    pub(crate) light_meshes: Option<Arc<LightMeshes>>,
    pub(crate) targets: Arc<WgpuTargets>,
    pub(crate) storage_buffers: Arc<StorageBuffers>,
    pub(crate) generated: GeneratedUploads,
    /// After which passes mip levels are generated.
    pub(crate) mip_schedule: MipSchedule,
    pub(crate) background: [f64; 3],
    /// What is read back of it.
    pub(crate) read_backs: Vec<ReadBackCopy>,
    /// Returned to the pool when the frame is dropped.
    pub(crate) buffers: FrameBuffers,
    pub(crate) pending_uploads: PendingUploads,
}

impl WgpuFrame {
    /// Has a rectangle of a view's target read back when the frame is submitted: its upper left pixel, and its width
    /// and height.
    ///
    /// # Errors
    /// See [`new_read_back`].
    pub(crate) fn read_back(
        &mut self,
        view: usize,
        target: &str,
        rectangle: [[u32; 2]; 2],
    ) -> Result<WgpuReadBack, BackendError> {
        let device = self.pending_uploads.device();
        let (read_back, copy) = new_read_back(device, &self.targets, view, target, rectangle)?;
        self.read_backs.push(copy);
        Ok(read_back)
    }

    /// Has a view's target read back as a whole.
    ///
    /// # Errors
    /// See [`new_read_back`].
    pub(crate) fn read_back_whole(&mut self, view: usize, target: &str) -> Result<WgpuReadBack, BackendError> {
        let texture = &self.targets.find(view, target)?.texture;
        let whole = [texture.width(), texture.height()];
        self.read_back(view, target, [[0, 0], whole])
    }

    /// Whether mip levels are generated after a pass, by index in the frame.
    pub(crate) fn generates_mip_levels(&self, pass: usize) -> bool {
        !self.mip_schedule.after(pass).is_empty()
    }

    /// Generates the mip levels that a pass, by index in the frame, leaves out of date.
    ///
    /// # Errors
    /// If a target is missing, or what generates its mip levels. This is a bug in Drawloom.
    pub(crate) fn generate_mip_levels(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pass: usize,
    ) -> Result<(), BackendError> {
        for &(view, target) in self.mip_schedule.after(pass) {
            let levels = self.targets.of_view(view, target)?.mip_levels();
            levels.ok_or_else(|| broken_rule("a target has what generates its mip levels"))?.generate(encoder);
        }
        Ok(())
    }

    /// The state of a pass, by index in the frame.
    pub(crate) fn pass(&self, index: usize) -> &WgpuPassState {
        &self.buffers.passes()[index]
    }

    /// The pipelines of a pass's process.
    pub(crate) fn pipelines(&self, pass: Pass) -> &Arc<ProcessPipelines> {
        &self.pipelines[pass.process_index]
    }
}

/// A part of a pass, recorded before the pass is finished.
pub struct WgpuPart(pub(crate) RecordedPart);

pub(crate) enum RecordedPart {
    Bundle(wgpu::RenderBundle),
    /// One of several encoders.
    Encoder(wgpu::CommandBuffer),
}

/// The commands of a pass, ready to be submitted.
pub struct WgpuCommands(pub(crate) PassCommands);

pub(crate) enum PassCommands {
    Finished(wgpu::CommandBuffer),
    /// In the encoder of an earlier pass of the frame.
    InEarlierPass,
    /// From several encoders, in submission order.
    Parts(Vec<WgpuPart>),
    /// To be finished on the device thread.
    Open(wgpu::CommandEncoder),
}

/// The contents that CPU nodes fill in a frame, with the buffers that they are for.
///
/// They are uploaded right before the frame is submitted, on the device thread. Frames share the buffers on the device,
/// and a frame that is recorded before another one is submitted must not write what that one draws.
pub(crate) struct GeneratedUploads {
    uploads: Vec<GeneratedUpload>,
}

struct GeneratedUpload {
    contents: Arc<GeneratedContents>,
    buffer: wgpu::Buffer,
    /// If it has indices, what triangles these form. The device reads all that the buffer has room for.
    indices_of: Option<Topology>,
}

impl GeneratedUploads {
    pub(crate) fn new(request: &FrameRequest<'_>, buffers: &StorageBuffers, meshes: &ImportedMeshes) -> Self {
        let mut uploads = Vec::new();
        for contents in request.generated {
            let layout = contents.layout();
            let mut add = |buffer: &wgpu::Buffer, indices_of| {
                uploads.push(GeneratedUpload { contents: Arc::clone(contents), buffer: buffer.clone(), indices_of });
            };
            meshes.filled_by(layout.identity).for_each(|(buffer, indices_of)| add(buffer, indices_of));
            let (name, bytes) = (layout.name, layout.bytes() as u64);
            let storage = BufferLayout { name, bytes, is_filled_by_nodes: true };
            if let Some(buffer) = buffers.find(storage).filter(|_| layout.fills_storage) {
                add(buffer, None);
            }
        }
        Self { uploads }
    }

    /// Uploads them, ahead of the next submission.
    pub(crate) fn write(&self, queue: &wgpu::Queue) {
        for GeneratedUpload { contents, buffer, indices_of } in &self.uploads {
            contents.for_each_part(|offset, bytes| queue.write_buffer(buffer, offset as u64, bytes));
            if let Some(topology) = *indices_of {
                let (count, last) = contents.whole_triangles(topology);
                let padding = [last; 1024];
                let capacity = contents.layout().capacity;
                for start in (count..capacity).step_by(padding.len()) {
                    let indices = &padding[..padding.len().min(capacity - start)];
                    queue.write_buffer(buffer, (start * size_of::<u32>()) as u64, bytemuck::cast_slice(indices));
                }
            }
        }
    }
}

/// The uploads of a frame, which wgpu keeps in memory until something is submitted. If the frame never is, an empty
/// submission takes its place when this is dropped, so that frames that are recorded and dropped leave no memory
/// behind.
///
/// What is uploaded early does no harm: buffers of the frame are used by nothing else, and what is shared with earlier
/// frames that are not submitted yet would have been uploaded before them, too.
pub(crate) struct PendingUploads {
    device: wgpu::Device,
    queue: wgpu::Queue,
    are_submitted: bool,
}

impl PendingUploads {
    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        Self { device: device.clone(), queue: queue.clone(), are_submitted: false }
    }

    /// The device of the frame.
    pub(crate) fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The frame was submitted.
    pub(crate) fn submitted(&mut self) {
        self.are_submitted = true;
    }
}

impl Drop for PendingUploads {
    fn drop(&mut self) {
        if self.are_submitted {
            return;
        }
        let label = "the uploads of a frame that was dropped";
        let submit = || with_error_scope(&self.device, label, || self.queue.submit(None));
        if let Err(error) = catch_wgpu_panic(label, submit).flatten() {
            // The next frame meets the same, and returns it.
            let message = "uploads of a frame that was dropped stay in memory";
            emit(|| tracing::warn!(target: "drawloom", %error, "{message}"));
        }
    }
}
