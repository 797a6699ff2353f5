//! What is kept from frame to frame, and how a frame begins.

use std::sync::Arc;

use parking_lot::Mutex;

use super::StartsFrames;
use super::crew::Crew;
use super::frame::{Frame, FramePass, PassDraws, Recording, ViewState};
use super::materials::MaterialCache;
use super::meshes::MeshCache;
use super::number::{CameraPlace, Number};
use super::pass::{Attachments, ColorTarget, DepthTarget};
use super::targets::{FrameTargets, Target, TargetCache};
use crate::backend::subdivisions::Subdivisions;
use crate::backend::{BackendError, FrameRequest};
use crate::process::{Access, ClearColor, Draws, Pass, Twin, TwinShader};
use crate::quality::VertexFormat;
use crate::scene::{Mesh, ViewKind};
use crate::task::catch;
use crate::view::{FixedPosition, GpuView};

/// What draws in one kind of number, with what it keeps from frame to frame.
pub(super) struct Engine<R: Number> {
    pub(super) crew: Crew,
    /// Held while a frame is drawn: one is drawn at a time.
    pub(super) drawing: Mutex<()>,
    pub(super) subdivisions: Subdivisions<Arc<Mesh>>,
    meshes: Mutex<MeshCache>,
    materials: Mutex<MaterialCache>,
    targets: Mutex<TargetCache<R>>,
}

impl<R: Number> Engine<R> {
    pub(super) fn new(crew: Crew) -> Self {
        Self {
            crew,
            drawing: Mutex::default(),
            subdivisions: Subdivisions::default(),
            meshes: Mutex::default(),
            materials: Mutex::default(),
            targets: Mutex::default(),
        }
    }
}

impl<R: Number> StartsFrames for Engine<R> {
    fn name(&self) -> String {
        match &self.crew {
            Crew::Shared(scheduler) => format!("software (f32, {} workers)", scheduler.workers()),
            Crew::Alone => String::from("software (f64 reference)"),
        }
    }

    fn start(self: Arc<Self>, request: &FrameRequest<'_>, twins: &[Twin]) -> Result<Box<dyn Recording>, BackendError> {
        let FrameRequest { plan, views, passes, scene, rejections, .. } = *request;
        let views_of_frame = (0..views.len()).map(|view| view_state(request, view)).collect::<Result<_, _>>()?;
        let targets = self.targets.lock().update(plan, views)?;
        let pass = |&pass: &Pass| frame_pass(request, pass, &twins[pass.process], &targets);
        let passes = passes.iter().map(pass).collect::<Result<_, _>>()?;
        self.subdivisions.begin(scene.assets);
        // The reference draws the scene's own vertices.
        let vertices = if R::ROUNDS { request.quality.vertices } else { VertexFormat::Full };
        let meshes = self.meshes.lock().update(scene.assets, vertices);
        let materials = self.materials.lock().update(scene.assets, rejections);
        Ok(Box::new(Frame {
            views: views_of_frame,
            passes,
            objects: R::objects(scene),
            vertices,
            meshes,
            subdivided: Mutex::default(),
            materials,
            targets,
            engine: self,
        }))
    }
}

/// The twin of each process.
///
/// # Errors
/// If one has none, or panics as it is asked.
pub(super) fn twins_of(request: &FrameRequest<'_>) -> Result<Vec<Twin>, BackendError> {
    let twin = |planned: &crate::process::PlannedProcess| {
        let process = || planned.process.name().to_owned();
        let asked = catch(|| planned.process.twin());
        let twin = asked.map_err(|panic| BackendError::TwinPanicked { process: process(), message: panic.message })?;
        twin.ok_or_else(|| BackendError::NoTwin { process: process() })
    };
    request.plan.processes().iter().map(twin).collect()
}

/// # Errors
/// If the camera is out of reach.
fn view_state<R: Number>(request: &FrameRequest<'_>, index: usize) -> Result<ViewState<R>, BackendError> {
    let (view, lights, scene) = (&request.views[index], &request.lights[index], request.scene);
    let out_of_reach = || BackendError::ViewOutOfReach { view: view.name().to_owned() };
    let record = GpuView::new(view, scene, lights.gpu_lights().len()).ok_or_else(out_of_reach)?;
    let exact = view.camera.position;
    let camera = CameraPlace {
        exact,
        fixed: FixedPosition::from_halves(record.position_low, record.position_high),
        transforms: request.quality.transforms,
    };
    let light = |(record, (light, map)): (_, (usize, Option<usize>))| {
        R::light(record, &scene.lights[light], &camera, map.map(|map| &request.views[map]))
    };
    let values = R::view(view, &record, scene);
    Ok(ViewState { values, lights: lights.gpu_lights().iter().zip(lights.sources()).map(light).collect(), camera })
}

/// # Errors
/// If the process cannot draw on this backend.
fn frame_pass<R: Number>(
    request: &FrameRequest<'_>,
    pass: Pass,
    twin: &Twin,
    targets: &FrameTargets<R>,
) -> Result<FramePass<R>, BackendError> {
    let planned = &request.plan.processes()[pass.process];
    let process = planned.process.name().to_owned();
    let draws = match (&request.draws[pass.process], R::shader(twin)) {
        (Draws::Commands(draws), TwinShader::Objects(twin)) => {
            PassDraws::Objects { twin: Arc::clone(twin), writes_depth: draws.writes_depth }
        }
        (Draws::FullScreen(draws), TwinShader::FullScreen(twin)) => {
            PassDraws::FullScreen { twin: Arc::clone(twin), blend: draws.blend }
        }
        (Draws::Lights(draws), TwinShader::Lights(twin)) => {
            let lights = request.lights[pass.view].range(draws.class);
            PassDraws::Lights { twin: Arc::clone(twin), lights: lights.start as usize..lights.end as usize }
        }
        _ => {
            let message = String::from("its twin is of another kind than what it draws");
            return Err(BackendError::Validation { label: process, message });
        }
    };
    let attachments = attachments(request, pass, targets)?;
    attachments.check(&process)?;
    Ok(FramePass { pass, process, draws, attachments })
}

/// # Errors
/// If a target is missing: an error of Drawloom's own.
fn attachments<R: Number>(
    request: &FrameRequest<'_>,
    pass: Pass,
    targets: &FrameTargets<R>,
) -> Result<Attachments<R>, BackendError> {
    let declaration = &request.plan.processes()[pass.process].declaration;
    let missing = |name: &str| BackendError::UnknownTarget { view: pass.view, target: name.to_owned() };
    let own = |name: &str| -> Result<Target<R>, BackendError> {
        targets.find(pass.view, name).cloned().ok_or_else(|| missing(name))
    };
    let layered = |kind: ViewKind, name: &str| targets.find_layered(kind, name).ok_or_else(|| missing(name));
    let color = |(name, clear): (&str, Option<ClearColor>)| {
        let clear = clear.map(|clear| clear_color(clear, request));
        Ok(ColorTarget { target: own(name)?, clear })
    };
    let depth = |(name, access): (&str, Access)| {
        let is_writable = access.writes();
        let clears = is_writable && access != Access::DrawDepth;
        Ok(DepthTarget { target: own(name)?, clears, is_writable, matches: access == Access::MatchDepth })
    };
    let sampled = declaration.accesses.iter().filter_map(|(name, access)| match access {
        Access::Sample => Some(own(name)),
        Access::SampleLayers(kind) => Some(layered(*kind, name)),
        _ => None,
    });
    Ok(Attachments {
        colors: declaration.colors().map(color).collect::<Result<_, BackendError>>()?,
        depth: declaration.depth().map(depth).transpose()?,
        sampled: sampled.collect::<Result<_, _>>()?,
    })
}

fn clear_color<R: Number>(clear: ClearColor, request: &FrameRequest<'_>) -> [R; 4] {
    let color = match clear {
        ClearColor::Value(value) => value,
        // Past this a half float would be infinite.
        ClearColor::Background => {
            let [red, green, blue] =
                request.scene.background.as_dvec3().to_array().map(|radiance| radiance.min(60_000.0));
            [red, green, blue, 1.0]
        }
    };
    color.map(R::of)
}
