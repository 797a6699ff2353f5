//! The backend, for either precision.

use std::convert::Infallible;
use std::ops::Range;
use std::sync::Arc;

use super::SoftwareSubmission;
use super::commands::SoftwareCommands;
use super::executor::Executor;
use super::frame_recording::{BeginFrame, FrameRecording};
use super::rasterizer::{Rasterizer, cpu_shaders_of};
use super::targets;
use crate::backend::{
    Backend, BackendError, BackendExtras, FrameFence, FrameRecorder, FrameRequest, PassRequest, ReadBack, SceneLimits,
    TargetMemory, ViewQueue,
};
use crate::command::DrawState;
use crate::process::{Draws, FramePlan};
use crate::quality::{Quality, VertexFormat};
use crate::scene::Mesh;
use crate::task::Scheduler;
use crate::timeline::{Labels, TuningChoice};

/// Draws on the CPU.
///
/// Every process of a frame needs a [`CpuShader`](crate::process::CpuShader): see
/// [`RenderProcess::cpu_shader`](crate::process::RenderProcess::cpu_shader). Those that come with the crate have one.
///
/// In f32, targets hold what their formats can: values are rounded when they are stored. The reference keeps f64, and
/// only clamps to the range of a format. Neither stores NaN: 0 is stored instead.
///
/// ```
/// use std::sync::Arc;
///
/// use drawloom::Renderer;
/// use drawloom::backend::SoftwareBackend;
/// use drawloom::glam::DVec3;
/// use drawloom::process::{Deferred, targets};
/// use drawloom::scene::{Camera, Material, Mesh, RenderObject, Scene, Topology, Vertex};
/// use drawloom::task::Scheduler;
///
/// let scheduler = Arc::new(Scheduler::new(2)?);
/// let backend = SoftwareBackend::new(Arc::clone(&scheduler));
/// let (mut renderer, submitter) = Renderer::builder(backend).pipeline(Deferred::to_picture()).build(scheduler)?;
///
/// let mut scene = Scene::new();
/// let corner = |x, y| Vertex { position: [x, y, 0.0], normal: [0.0, 0.0, 1.0], uv: [0.0; 2] };
/// let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(0.0, 1.0)];
/// let mesh = scene.add(Mesh::new("triangle", Topology::TriangleList, corners, vec![0, 1, 2])?)?;
/// let material = scene.add(Material::default())?;
/// scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO))?;
/// let camera = Camera::looking_at("main", DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO);
/// scene.cameras.push(Camera { size: [96, 54], ..camera });
///
/// let submitted = submitter.submit(renderer.record(scene.as_scene_ref())?)?;
/// let picture = submitted.submission.read(0, targets::PICTURE)?;
/// assert_eq!(picture.bytes.len(), 96 * 54 * 4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SoftwareBackend {
    rasterizer: Arc<dyn BeginFrame>,
}

/// A frame from `begin` until it was submitted.
pub struct SoftwareFrame {
    recording: Box<dyn FrameRecording>,
}

impl SoftwareBackend {
    /// The greatest width and height of a picture, in pixels.
    pub const MAX_PICTURE_SIZE: u32 = targets::MAX_PICTURE_SIZE;

    /// Draws in f32, on the workers of this scheduler; it may be the scheduler that records.
    pub fn new(scheduler: Arc<Scheduler>) -> Self {
        Self { rasterizer: Arc::new(Rasterizer::<f32>::new(Executor::Scheduler(scheduler))) }
    }

    /// Draws in f64, on the thread that submits, and keeps its targets in f64: the reference for what a picture should
    /// be.
    pub fn reference() -> Self {
        Self { rasterizer: Arc::new(Rasterizer::<f64>::new(Executor::CallingThread)) }
    }
}

impl Backend for SoftwareBackend {
    type Submission = SoftwareSubmission;

    fn adapter_name(&self) -> String {
        self.rasterizer.adapter_name()
    }

    fn limits(&self) -> SceneLimits {
        SceneLimits::NONE
    }

    fn check_mesh(&self, mesh: &Mesh, _vertices: VertexFormat) -> Result<(), BackendError> {
        let can_see = mesh.has_triangles() || mesh.generated_geometry().is_some();
        can_see.then_some(()).ok_or_else(|| BackendError::ImportedMesh { mesh: mesh.name().to_owned() })
    }

    fn prepare_pipelines(
        &self,
        _plan: &FramePlan,
        _draws: &[Draws<'_>],
        _states: &[Vec<DrawState>],
        _quality: &Quality,
    ) -> Result<(), BackendError> {
        Ok(())
    }

    fn begin(&self, request: &FrameRequest<'_>) -> Result<SoftwareFrame, BackendError> {
        let shaders = cpu_shaders_of(request)?;
        Ok(SoftwareFrame { recording: self.rasterizer.begin(request, &shaders)? })
    }

    fn target_memory(&self, _frame: &SoftwareFrame) -> TargetMemory {
        TargetMemory::default()
    }

    fn recording_choice(&self, _: &SoftwareFrame, _pass: usize, _labels: &Arc<Labels>) -> Option<TuningChoice> {
        None
    }

    fn read_back(
        &self,
        frame: &mut SoftwareFrame,
        view: usize,
        target: &str,
    ) -> Result<Box<dyn ReadBack>, BackendError> {
        Ok(Box::new(frame.recording.read_back(view, target)?))
    }

    fn submit(
        &self,
        frame: SoftwareFrame,
        queues: Vec<ViewQueue<SoftwareCommands>>,
        fences: Vec<FrameFence>,
    ) -> Result<SoftwareSubmission, BackendError> {
        frame.recording.submit(queues, fences)
    }

    fn extras(&self) -> &dyn BackendExtras {
        self
    }
}

impl BackendExtras for SoftwareBackend {
    fn inner_extras(&self) -> Option<&dyn BackendExtras> {
        None
    }

    fn can_blend_floats(&self) -> bool {
        true
    }

    fn forget_histories(&self) {
        self.rasterizer.forget_histories();
    }
}

impl FrameRecorder for SoftwareBackend {
    type Frame = SoftwareFrame;
    type Part = Infallible;
    type Commands = SoftwareCommands;

    fn objects_epoch(&self, _frame: &SoftwareFrame) -> u64 {
        0
    }

    fn upload_objects(
        &self,
        frame: &SoftwareFrame,
        request: &FrameRequest<'_>,
        blocks: Range<usize>,
    ) -> Result<(), BackendError> {
        frame.recording.upload(request, blocks);
        Ok(())
    }

    fn prepare(&self, frame: &SoftwareFrame, pass: &PassRequest<'_>) -> Result<(), BackendError> {
        frame.recording.prepare(pass)
    }

    fn part_count(&self, _frame: &SoftwareFrame, _pass: &PassRequest<'_>) -> usize {
        0
    }

    fn record(
        &self,
        _frame: &SoftwareFrame,
        _pass: &PassRequest<'_>,
        _parts: Range<usize>,
        _put: &mut dyn FnMut(Infallible),
    ) -> Result<(), BackendError> {
        Ok(())
    }

    fn shares_encoder(&self, _frame: &SoftwareFrame, _pass: usize) -> bool {
        false
    }

    fn finish(
        &self,
        _frame: &SoftwareFrame,
        passes: &[PassRequest<'_>],
        _parts: &mut [Vec<Infallible>],
        emit: &mut dyn FnMut(SoftwareCommands),
    ) -> Result<(), BackendError> {
        passes.iter().map(|pass| SoftwareCommands::new(pass.list)).for_each(emit);
        Ok(())
    }
}
