//! The software backend: it draws on the CPU what the others have a device for.
//!
//! It executes the same commands, with each process's [`Twin`] in the place of its WGSL: in f32 on all workers of a scheduler, so
//! that a machine without a graphics adapter has a picture too; or in f64 on one thread, as the reference that the others
//! are judged by.
//!
//! What is recorded of a pass is the list of what it draws. All drawing is done when a frame is submitted: pass after pass,
//! triangles are set up in pieces of a fixed size, sorted into squares of the picture, and each square is drawn by one job,
//! with its triangles in the order of the commands. Pieces and squares depend on nothing but the frame, so neither the number
//! of workers nor how they share the work changes a byte.

mod crew;
mod engine;
mod formats;
mod frame;
mod light_bounds;
mod materials;
mod meshes;
mod mip_chain;
mod number;
mod object_pass;
mod pass;
mod picture_pass;
mod pieces;
mod submission;
mod targets;
mod tiles;
mod values;

use std::convert::Infallible;
use std::ops::Range;
use std::sync::Arc;

use self::crew::Crew;
use self::engine::Engine;
use self::frame::{Recording, SoftwareCommands};
use super::{Backend, BackendError, FrameRequest, PassRequest};
use crate::process::{Pass, Twin};
use crate::task::{Scheduler, Worker};
use crate::view::ObjectTable;

pub use submission::SoftwareSubmission;

/// Draws on the CPU.
///
/// Every process of a frame needs a [`Twin`]: see [`RenderProcess::twin`](crate::process::RenderProcess::twin). Those that come with
/// the crate have one.
///
/// In f32 targets hold what their formats can: it is rounded as it is stored, and read back rounded. The reference keeps f64,
/// and only cuts off what a format has no number for. Neither stores what is not a number: 0 is stored instead.
///
/// ```
/// use std::sync::Arc;
///
/// use drawloom::Renderer;
/// use drawloom::backend::SoftwareBackend;
/// use drawloom::glam::DVec3;
/// use drawloom::process::Deferred;
/// use drawloom::scene::{Camera, Material, Mesh, RenderObject, Scene, Topology, Vertex};
/// use drawloom::task::Scheduler;
///
/// let scheduler = Arc::new(Scheduler::new(2)?);
/// let backend = SoftwareBackend::new(Arc::clone(&scheduler));
/// let (mut renderer, submitter) = Renderer::builder(backend).deferred(Deferred::to_picture()).build(scheduler)?;
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
/// let picture = submitted.submission.read(0, "picture")?;
/// assert_eq!(picture.bytes.len(), 96 * 54 * 4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct SoftwareBackend {
    engine: Arc<dyn StartsFrames>,
}

/// A frame on its way through the software backend.
pub struct SoftwareFrame {
    recording: Box<dyn Recording>,
}

/// What starts frames, in either kind of number.
trait StartsFrames: Send + Sync {
    fn name(&self) -> String;

    fn start(self: Arc<Self>, request: &FrameRequest<'_>, twins: &[Twin]) -> Result<Box<dyn Recording>, BackendError>;
}

impl SoftwareBackend {
    /// The greatest width and height of a picture, in pixels.
    pub const LARGEST_PICTURE: u32 = 16_384;

    /// One that draws in f32, on the workers of this scheduler; it may be the one that records.
    pub fn new(scheduler: Arc<Scheduler>) -> Self {
        Self { engine: Arc::new(Engine::<f32>::new(Crew::Shared(scheduler))) }
    }

    /// One that draws in f64, on the thread that submits, and keeps what it draws in f64. It says what a picture should be.
    pub fn reference() -> Self {
        Self { engine: Arc::new(Engine::<f64>::new(Crew::Alone)) }
    }
}

impl Backend for SoftwareBackend {
    type Frame = SoftwareFrame;
    type Part = Infallible;
    type Commands = SoftwareCommands;
    type Submission = SoftwareSubmission;

    fn adapter(&self) -> String {
        self.engine.name()
    }

    fn begin(&self, request: &FrameRequest<'_>) -> Result<SoftwareFrame, BackendError> {
        let twins = engine::twins_of(request)?;
        Ok(SoftwareFrame { recording: Arc::clone(&self.engine).start(request, &twins)? })
    }

    fn upload_objects(
        &self,
        _worker: &Worker,
        frame: &SoftwareFrame,
        objects: &ObjectTable,
        blocks: Range<usize>,
    ) -> Result<(), BackendError> {
        frame.recording.upload(objects, blocks);
        Ok(())
    }

    fn prepare(&self, _worker: &Worker, frame: &SoftwareFrame, pass: &PassRequest<'_>) -> Result<(), BackendError> {
        frame.recording.prepare(pass)
    }

    fn parts(&self, _frame: &SoftwareFrame, _pass: &PassRequest<'_>) -> usize {
        0
    }

    fn record(
        &self,
        _worker: &Worker,
        _frame: &SoftwareFrame,
        _pass: &PassRequest<'_>,
        _parts: Range<usize>,
        _put: &mut dyn FnMut(Infallible),
    ) -> Result<(), BackendError> {
        Ok(())
    }

    fn finish(
        &self,
        _worker: &Worker,
        _frame: &SoftwareFrame,
        pass: &PassRequest<'_>,
        _parts: &mut Vec<Infallible>,
    ) -> Result<SoftwareCommands, BackendError> {
        Ok(SoftwareCommands::new(pass.list))
    }

    fn submit(
        &self,
        frame: SoftwareFrame,
        passes: Vec<(Pass, SoftwareCommands)>,
    ) -> Result<SoftwareSubmission, BackendError> {
        frame.recording.submit(passes)
    }
}
