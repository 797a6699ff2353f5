//! A frame on its way through the software backend.

use std::ops::Range;
use std::sync::Arc;

use parking_lot::Mutex;

use super::engine::Engine;
use super::materials::MaterialTable;
use super::meshes::{Meshes, fetched};
use super::number::{CameraPlace, Number};
use super::object_pass::ObjectPass;
use super::pass::{Attachments, DrawingPass};
use super::picture_pass::{draw_full_screen, draw_lights};
use super::pieces::{PassDraw, pieces};
use super::submission::SoftwareSubmission;
use super::targets::FrameTargets;
use crate::backend::subdivisions::{SubdividedMeshes, no_such_mesh};
use crate::backend::{BackendError, PassRequest};
use crate::command::{Batch, DrawList};
use crate::process::{FullScreenTwin, LightTwin, LightValues, ObjectTwin, Pass, ViewValues};
use crate::quality::VertexFormat;
use crate::scene::{Blend, Mesh};
use crate::view::ObjectTable;

/// A frame on its way, in either kind of number.
pub(super) trait Recording: Send + Sync {
    /// Takes in blocks of objects.
    fn upload(&self, objects: &ObjectTable, blocks: Range<usize>);

    /// Subdivides the meshes that a pass draws so.
    ///
    /// # Errors
    /// If it draws what is no mesh: an error of Drawloom's own.
    fn prepare(&self, pass: &PassRequest<'_>) -> Result<(), BackendError>;

    /// Draws everything.
    ///
    /// # Errors
    /// If a twin panics.
    fn submit(self: Box<Self>, passes: Vec<(Pass, SoftwareCommands)>) -> Result<SoftwareSubmission, BackendError>;
}

/// A recorded pass: what it draws.
#[derive(Debug)]
pub struct SoftwareCommands {
    draws: Vec<PassDraw>,
    objects: Vec<u32>,
    /// Of what remains of those that do not draw their mesh whole.
    indices: Arc<[u32]>,
}

impl SoftwareCommands {
    pub(super) fn new(list: &DrawList) -> Self {
        let draws = list.batches.iter().enumerate();
        Self {
            draws: draws.map(|(place, &batch)| (batch, list.remaining(place))).collect(),
            objects: list.objects.clone(),
            indices: list.remaining_indices().into(),
        }
    }
}

/// A frame on its way.
pub(super) struct Frame<R: Number> {
    pub(super) engine: Arc<Engine<R>>,
    pub(super) views: Vec<ViewState<R>>,
    /// In the order they are submitted.
    pub(super) passes: Vec<FramePass<R>>,
    pub(super) objects: R::Objects,
    /// How the vertices lie that it draws from.
    pub(super) vertices: VertexFormat,
    pub(super) meshes: Meshes,
    /// By the mesh's slot, and how often its edges are halved.
    pub(super) subdivided: Mutex<SubdividedMeshes<Arc<Mesh>>>,
    pub(super) materials: Arc<MaterialTable>,
    pub(super) targets: Arc<FrameTargets<R>>,
}

/// A view, as twins read it.
pub(super) struct ViewState<R> {
    pub(super) values: ViewValues<R>,
    /// Those that reach it.
    pub(super) lights: Vec<LightValues<R>>,
    pub(super) camera: CameraPlace,
}

/// One process in one view.
pub(super) struct FramePass<R: Number> {
    pub(super) pass: Pass,
    /// The process's name.
    pub(super) process: String,
    pub(super) draws: PassDraws<R>,
    pub(super) attachments: Attachments<R>,
}

/// What a pass draws.
pub(super) enum PassDraws<R: Number> {
    Objects { twin: Arc<dyn ObjectTwin<R>>, writes_depth: bool },
    FullScreen { twin: Arc<dyn FullScreenTwin<R>>, blend: Blend },
    Lights { twin: Arc<dyn LightTwin<R>>, lights: Range<usize> },
}

impl<R: Number> Recording for Frame<R> {
    fn upload(&self, objects: &ObjectTable, blocks: Range<usize>) {
        R::upload(&self.objects, objects, blocks);
    }

    fn prepare(&self, &PassRequest { frame: request, list, .. }: &PassRequest<'_>) -> Result<(), BackendError> {
        let make = |mesh| Ok(Arc::new(fetched(mesh, self.vertices)));
        self.engine.subdivisions.collect(request, list, self.vertices, make, |key, mesh| {
            self.subdivided.lock().insert(key, mesh);
        })
    }

    fn submit(self: Box<Self>, passes: Vec<(Pass, SoftwareCommands)>) -> Result<SoftwareSubmission, BackendError> {
        let _one_at_a_time = self.engine.drawing.lock();
        for (pass, commands) in &passes {
            let known = self.passes.iter().find(|known| known.pass == *pass);
            let unknown = || BackendError::BrokenRule { rule: format!("{pass:?} is of this frame") };
            self.draw(known.ok_or_else(unknown)?, commands)?;
        }
        Ok(SoftwareSubmission::new(Arc::clone(&self.targets) as _))
    }
}

impl<R: Number> Frame<R> {
    fn draw(&self, pass: &FramePass<R>, commands: &SoftwareCommands) -> Result<(), BackendError> {
        let view = &self.views[pass.pass.view];
        let drawing =
            DrawingPass { crew: &self.engine.crew, view, materials: &*self.materials, attachments: &pass.attachments };
        let outcome = match &pass.draws {
            PassDraws::Objects { twin, writes_depth } => {
                let subdivided = self.subdivided.lock();
                let mesh_of = |batch: &Batch| {
                    let mesh = match batch.state.subdivision_level() {
                        0 => self.meshes.get(batch.mesh as usize).and_then(Option::as_ref),
                        level => subdivided.get(&(batch.mesh, level)).map(|mesh| &mesh.drawn),
                    };
                    mesh.cloned().ok_or_else(no_such_mesh)
                };
                let pieces = pieces(&commands.draws, &commands.objects, &commands.indices, mesh_of)?;
                let object_of = |object: u32| R::object(&self.objects, object as usize, &view.camera);
                let (twin, writes_depth) = (&**twin, *writes_depth);
                ObjectPass { drawing, twin, writes_depth, pieces: &pieces, object_of: &object_of }.run()
            }
            PassDraws::FullScreen { twin, blend } => draw_full_screen(&drawing, &**twin, *blend),
            PassDraws::Lights { twin, lights } => draw_lights(&drawing, &**twin, lights.clone()),
        };
        outcome.map_err(|panic| BackendError::TwinPanicked { process: pass.process.clone(), message: panic.message })
    }
}
