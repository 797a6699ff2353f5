//! A frame in one precision.

use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;

use parking_lot::Mutex;

use super::SoftwareSubmission;
use super::commands::SoftwareCommands;
use super::draw_context::DrawContext;
use super::frame_recording::FrameRecording;
use super::materials::MaterialTable;
use super::meshes::{Meshes, as_fetched};
use super::object_pass::ObjectPass;
use super::pass_context::PassContext;
use super::precision::Precision;
use super::read_back::{ReadBackCopy, SoftwareReadBack, new_read_back};
use super::screen_pass::{draw_full_screen, draw_lights};
use super::software_pass::{SoftwareDraws, SoftwarePass};
use super::targets::SoftwareTargets;
use super::triangle_setup::setup_chunks;
use super::view_state::ViewState;
use crate::backend::subdivision_cache::{SubdividedMeshes, missing_mesh_error, subdivision_of};
use crate::backend::{BackendError, FrameFence, FrameRequest, PassRequest, ViewQueue};
use crate::command::Batch;
use crate::quality::VertexFormat;
use crate::scene::{ColumnLayout, GeneratedContents, Mesh};
use crate::unwind::hold_events;

/// A frame in one precision, from `begin` until it was submitted.
pub(super) struct TypedFrame<R: Precision> {
    pub(super) context: Arc<DrawContext>,
    pub(super) views: Vec<ViewState<R>>,
    /// In the order they are submitted.
    pub(super) passes: Vec<SoftwarePass<R>>,
    pub(super) objects: R::Objects,
    /// The columns that the plan's processes read.
    pub(super) columns: Vec<(ColumnLayout, Box<[u8]>)>,
    /// The format of the vertices that it draws.
    pub(super) vertices: VertexFormat,
    pub(super) meshes: Meshes,
    /// What nodes fill in this frame.
    pub(super) generated: Vec<Arc<GeneratedContents>>,
    pub(super) subdivided: Mutex<SubdividedMeshes<Arc<Mesh>>>,
    pub(super) materials: Arc<MaterialTable>,
    pub(super) targets: Arc<SoftwareTargets<R>>,
    /// What is read back when it is drawn.
    pub(super) read_backs: Vec<ReadBackCopy>,
}

impl<R: Precision> FrameRecording for TypedFrame<R> {
    fn upload(&self, request: &FrameRequest<'_>, blocks: Range<usize>) {
        R::upload(&self.objects, request, blocks);
    }

    fn prepare(&self, &PassRequest { frame: request, list, .. }: &PassRequest<'_>) -> Result<(), BackendError> {
        let make = |mesh| Ok(Some(Arc::new(as_fetched(mesh, self.vertices))));
        self.context.subdivisions.collect(request, list, self.vertices, make, |key, mesh| {
            self.subdivided.lock().insert(key, mesh);
        })
    }

    fn read_back(&mut self, view: usize, target: &str) -> Result<SoftwareReadBack, BackendError> {
        self.targets.find(view, target)?;
        let (read_back, copy) = new_read_back(view, target);
        self.read_backs.push(copy);
        Ok(read_back)
    }

    fn submit(
        self: Box<Self>,
        queues: Vec<ViewQueue<SoftwareCommands>>,
        fences: Vec<FrameFence>,
    ) -> Result<SoftwareSubmission, BackendError> {
        hold_events(|| self.draw_all(queues, fences))
    }
}

impl<R: Precision> TypedFrame<R> {
    fn draw_all(
        self,
        queues: Vec<ViewQueue<SoftwareCommands>>,
        mut fences: Vec<FrameFence>,
    ) -> Result<SoftwareSubmission, BackendError> {
        let mut generated = self.context.drawing.lock();
        let meshes = generated.update(&self.generated, &self.meshes, &self.context.undrawable);
        for (before, (pass, commands)) in queues.iter().flat_map(|queue| &queue.passes).enumerate() {
            FrameFence::set_up_to(before, &mut fences);
            let known = self.passes.iter().find(|known| known.pass == *pass);
            let unknown = || BackendError::BrokenRule {
                rule: format!("submitted passes belong to the frame, but {pass:?} does not"),
            };
            self.draw(known.ok_or_else(unknown)?, commands, &meshes)?;
        }
        let drawn: HashSet<_> = queues.iter().map(|queue| queue.view).collect();
        self.targets.copy_histories(|view| drawn.contains(&view));
        self.read_backs.into_iter().for_each(|copy| copy.drawn(&*self.targets));
        fences.into_iter().for_each(|fence| fence.setter.set());
        Ok(SoftwareSubmission::new(Arc::clone(&self.targets) as _))
    }

    fn draw(&self, pass: &SoftwarePass<R>, commands: &SoftwareCommands, meshes: &Meshes) -> Result<(), BackendError> {
        let view = &self.views[pass.pass.view_index];
        let context = PassContext {
            executor: &self.context.executor,
            view,
            materials: &*self.materials,
            attachments: &pass.attachments,
            columns: &self.columns,
        };
        let outcome = match &pass.draws {
            SoftwareDraws::Objects { shader, face_culling, depth, attributes } => {
                let subdivided = self.subdivided.lock();
                let mesh_of = |batch: &Batch| {
                    let mesh = match batch.state.subdivision_level() {
                        0 => meshes.get(batch.mesh as usize).and_then(Option::as_ref),
                        _ => subdivided.get(&subdivision_of(batch)).and_then(|mesh| mesh.geometry.as_ref()),
                    };
                    mesh.cloned().ok_or_else(missing_mesh_error)
                };
                let chunks = setup_chunks(commands, mesh_of)?;
                let object_of = |object: u32| R::object(&self.objects, object as usize, &view.camera);
                let (shader, face_culling, depth) = (&***shader, *face_culling, *depth);
                let (chunks, object_of) = (&chunks, &object_of);
                ObjectPass { context, shader, attributes, face_culling, depth, chunks, object_of }.draw()
            }
            SoftwareDraws::FullScreen { shader, blend } => draw_full_screen(&context, &***shader, *blend),
            SoftwareDraws::Lights { shader, lights } => draw_lights(&context, &***shader, lights.clone()),
        };
        let generate = || {
            pass.outdated_mip_levels
                .iter()
                .try_for_each(|target| target.texture.generate_mip_levels(&self.context.executor))
        };
        outcome
            .and_then(|()| generate())
            .map_err(|panic| BackendError::CpuShaderPanicked { process: pass.process.clone(), message: panic.message })
    }
}
