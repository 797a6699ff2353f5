//! Begins frames in one precision, and caches what they share.

use std::sync::Arc;

use parking_lot::Mutex;

use super::attachments::{Attachments, ColorAttachment, DepthAttachment};
use super::draw_context::DrawContext;
use super::executor::Executor;
use super::frame::TypedFrame;
use super::frame_recording::{BeginFrame, FrameRecording};
use super::materials::MaterialCache;
use super::meshes::MeshCache;
use super::precision::Precision;
use super::software_pass::{DepthWrites, SoftwareDraws, SoftwarePass};
use super::targets::{SoftwareTarget, SoftwareTargets, TargetCache};
use super::view_state::ViewState;
use crate::backend::error::broken_rule;
use crate::backend::mip_schedule::MipSchedule;
use crate::backend::{BackendError, FrameRequest};
use crate::process::{Access, ClearColor, CpuShader, Draws, Pass, PipelineState, PlannedProcess, TypedCpuShader};
use crate::quality::VertexFormat;
use crate::scene::PREVIOUS_OBJECTS;
use crate::task::catch;

/// Draws frames in one precision, and keeps meshes, materials and targets over frames.
pub(super) struct Rasterizer<R: Precision> {
    context: Arc<DrawContext>,
    meshes: Mutex<MeshCache>,
    materials: Mutex<MaterialCache>,
    targets: Mutex<TargetCache<R>>,
}

impl<R: Precision> Rasterizer<R> {
    pub(super) fn new(executor: Executor) -> Self {
        let (drawing, undrawable, subdivisions) = Default::default();
        Self {
            context: Arc::new(DrawContext { executor, drawing, undrawable, subdivisions }),
            meshes: Mutex::default(),
            materials: Mutex::default(),
            targets: Mutex::default(),
        }
    }
}

impl<R: Precision> BeginFrame for Rasterizer<R> {
    fn adapter_name(&self) -> String {
        match &self.context.executor {
            Executor::Scheduler(scheduler) => format!("software (f32, {} workers)", scheduler.workers()),
            Executor::CallingThread => String::from("software (f64 reference)"),
        }
    }

    fn forget_histories(&self) {
        self.targets.lock().forget_histories();
    }

    fn begin(
        &self,
        request: &FrameRequest<'_>,
        shaders: &[CpuShader],
    ) -> Result<Box<dyn FrameRecording>, BackendError> {
        let FrameRequest { plan, views, passes, scene, scene_issues, .. } = *request;
        let transforms = request.quality.transforms;
        let view_state = |view| ViewState::new(&request.view(view), transforms);
        let view_states = (0..views.len()).map(view_state).collect::<Result<_, _>>()?;
        let targets = self.targets.lock().update(plan, views)?;
        let mip_schedule = MipSchedule::new(plan, views, (passes, request.sampled_views));
        let pass = |(index, &pass): (usize, &Pass)| {
            let found = |&(view, target): &_| targets.get(view, target).cloned().ok_or_else(missing_target);
            let outdated_mip_levels = mip_schedule.after(index).iter().map(found).collect::<Result<_, _>>()?;
            software_pass(request, (pass, outdated_mip_levels), &shaders[pass.process_index], &targets)
        };
        let passes = passes.iter().enumerate().map(pass).collect::<Result<_, _>>()?;
        self.context.subdivisions.begin_frame(scene.assets);
        // The reference draws the scene's own vertices.
        let vertices = if R::ROUNDS { request.quality.vertices } else { VertexFormat::Full };
        let meshes = self.meshes.lock().update(scene.assets, request.objects.used_meshes(), vertices);
        self.context.undrawable.count_objects(request, &meshes);
        let materials = self.materials.lock().update(scene.assets, scene_issues);
        let column = |&layout: &_| Some((layout, Box::from(scene.column(layout)?.bytes())));
        let columns = plan.columns().iter().filter_map(column).collect();
        Ok(Box::new(TypedFrame {
            context: Arc::clone(&self.context),
            views: view_states,
            passes,
            objects: R::objects(scene),
            columns,
            vertices,
            meshes,
            generated: request.generated.to_vec(),
            subdivided: Mutex::default(),
            materials,
            targets,
            read_backs: Vec::new(),
        }))
    }
}

/// The CPU shader of each process.
///
/// # Errors
/// If a process has none, or panics when its `cpu_shader` is called.
pub(super) fn cpu_shaders_of(request: &FrameRequest<'_>) -> Result<Vec<CpuShader>, BackendError> {
    let shader_of = |planned: &PlannedProcess| {
        let process = || planned.name.clone();
        let shader = catch(|| planned.process.cpu_shader())
            .map_err(|panic| BackendError::CpuShaderPanicked { process: process(), message: panic.message })?;
        shader.ok_or_else(|| BackendError::NoCpuShader { process: process() })
    };
    request.plan.processes().iter().map(shader_of).collect()
}

/// A pass, with the targets whose mip levels it leaves out of date.
///
/// # Errors
/// If the process cannot be drawn by this backend.
fn software_pass<R: Precision>(
    request: &FrameRequest<'_>,
    (pass, outdated_mip_levels): (Pass, Vec<SoftwareTarget<R>>),
    shader: &CpuShader,
    targets: &SoftwareTargets<R>,
) -> Result<SoftwarePass<R>, BackendError> {
    let planned = &request.plan.processes()[pass.process_index];
    let process = planned.name.clone();
    let draws = match (&request.draws[pass.process_index], R::shader(shader)) {
        (Draws::Commands(draws), TypedCpuShader::Objects(shader)) => {
            let attributes = planned.declaration.attributes.clone();
            let depth = if !draws.writes_depth {
                DepthWrites::Never
            } else if draws.blend_equations.is_empty() {
                DepthWrites::WhereOpaque
            } else {
                DepthWrites::Always
            };
            SoftwareDraws::Objects { shader: shader.clone(), face_culling: draws.face_culling, depth, attributes }
        }
        (Draws::FullScreen(draws), TypedCpuShader::FullScreen(shader)) => {
            SoftwareDraws::FullScreen { shader: shader.clone(), blend: draws.blend }
        }
        (Draws::Lights(draws), TypedCpuShader::Lights(shader)) => {
            let lights = request.light_tables[pass.view_index].range(draws.class);
            SoftwareDraws::Lights { shader: shader.clone(), lights: lights.start as usize..lights.end as usize }
        }
        _ => {
            let message = String::from("its CPU shader is of another kind than its draws");
            return Err(BackendError::Validation { label: process, message });
        }
    };
    if request.draws[pass.process_index].stencil().is_some() {
        let message = String::from("the software backend has no stencil");
        return Err(BackendError::Validation { label: process, message });
    }
    if request.draws[pass.process_index].pipeline_state().is_some_and(|state| *state != PipelineState::default()) {
        let message =
            String::from("the software backend has no depth bias, and no depth comparisons or masks of its own");
        return Err(BackendError::Validation { label: process, message });
    }
    let declaration = &request.plan.processes()[pass.process_index].declaration;
    if declaration.columns.contains(&PREVIOUS_OBJECTS.layout()) {
        let message = String::from("the software backend does not keep the objects of the frame before");
        return Err(BackendError::Validation { label: process, message });
    }
    if request.plan.attachment_extent(pass.process_index).multisampled {
        return Err(BackendError::Multisampling { process });
    }
    let attachments = attachments(request, pass, targets)?;
    attachments.check(&process)?;
    Ok(SoftwarePass { pass, process, draws, attachments, outdated_mip_levels })
}

/// # Errors
/// If a target is missing. This is a bug in Drawloom.
fn attachments<R: Precision>(
    request: &FrameRequest<'_>,
    pass: Pass,
    targets: &SoftwareTargets<R>,
) -> Result<Attachments<R>, BackendError> {
    let PlannedProcess { targets: used, declaration, .. } = &request.plan.processes()[pass.process_index];
    let of_view = |index: usize| targets.get(pass.view_index, index).cloned().ok_or_else(missing_target);
    let equations = request.draws[pass.process_index].blend_equations();
    let colors = used.colors.iter().enumerate().map(|(output, color)| {
        let clear = color.clear.map(|clear| clear_color(clear, request));
        Ok(ColorAttachment { target: of_view(color.index)?, clear, equation: equations.get(output).copied() })
    });
    let depth = |(index, access): (usize, Access)| {
        let is_writable = access.writes_depth();
        let clears = is_writable && access != Access::DrawDepth;
        let clear = clears.then(|| R::of(f64::from(declaration.depth_clear_value.unwrap_or(0.0))));
        let tests_equal = access == Access::MatchDepth;
        Ok(DepthAttachment { target: of_view(index)?, clear, is_writable, tests_equal })
    };
    let sampled = used.accesses.iter().filter_map(|&(target, access)| match access {
        Access::Sample | Access::SamplePrevious => Some(of_view(target).map(|target| vec![target])),
        Access::SampleView(_, index) | Access::SampleViewPrevious(_, index) => {
            let layer = |view: &Option<usize>| {
                let found = view.and_then(|view| targets.get(view, target).cloned());
                let placeholder = || targets.find_placeholder(&request.plan.targets()[target]);
                found.or_else(placeholder).ok_or_else(missing_target)
            };
            Some(request.sampled_views.find(pass, index).iter().map(layer).collect())
        }
        Access::SampleLayers(_) => Some(targets.layers(target).ok_or_else(missing_target)),
        _ => None,
    });
    Ok(Attachments {
        colors: colors.collect::<Result<_, BackendError>>()?,
        depth: used.depth.map(depth).transpose()?,
        sampled: sampled.collect::<Result<_, _>>()?,
    })
}

fn missing_target() -> BackendError {
    broken_rule("a frame has the targets of its passes")
}

fn clear_color<R: Precision>(clear: ClearColor, request: &FrameRequest<'_>) -> [R; 4] {
    let color = match clear {
        ClearColor::Value(value) => value,
        // A half float would become infinite.
        ClearColor::Background => {
            let [red, green, blue] =
                request.scene.background.as_dvec3().to_array().map(|radiance| radiance.min(60_000.0));
            [red, green, blue, 1.0]
        }
    };
    color.map(R::of)
}
