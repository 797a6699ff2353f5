//! Recording of whole passes, or segments of them.

use std::ops::Range;

use super::batch_recorder::BatchRecorder;
use super::begin_pass::{begin_pass, set_stencil_reference};
use crate::backend::error::broken_rule;
use crate::backend::subdivision_cache::SubdividedMeshes;
use crate::backend::wgpu::frame::{WgpuFrame, WgpuPassState};
use crate::backend::wgpu::pipelines::{PipelineVariant, fixed_state};
use crate::backend::wgpu::strategy::PassSegment;
use crate::backend::{BackendError, FrameRequest};
use crate::command::DrawList;
use crate::process::{DrawCount, Draws, Pass, PlannedProcess, ProceduralDraws, RawAccess, RawPass, RawPassResources};

/// Records the batches of a segment directly into the pass.
///
/// # Errors
/// If a resource of a batch is missing. This is a bug in Drawloom.
pub(crate) fn record_batches(
    encoder: &mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    index: usize,
    segment: PassSegment,
    list: &DrawList,
    bundles: Range<usize>,
) -> Result<(), BackendError> {
    let pass = frame.pass(index);
    let pipelines = frame.pipelines(pass.pass).variants();
    let subdivided = frame.buffers.subdivided().read();
    let indices = pass.partial_indices.read();
    let partial_indices = indices.buffer();
    let recorder = BatchRecorder { frame, pass, list, pipelines: &pipelines, subdivided: &subdivided, partial_indices };
    let batches = match bundles.clone().next_back() {
        Some(last) => list.bundle_range(bundles.start).start..list.bundle_range(last).end,
        None => 0..0,
    };
    let mut render_pass = begin_pass(encoder, frame, request, index, segment);
    set_stencil_reference(&mut render_pass, frame, request, index);
    if batches.is_empty() { Ok(()) } else { recorder.draw(&mut render_pass, batches) }
}

/// Records a segment of a pass that replays bundles.
pub(crate) fn replay_bundles<'a>(
    encoder: &mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    index: usize,
    segment: PassSegment,
    bundles: impl IntoIterator<Item = &'a wgpu::RenderBundle>,
) {
    let pass = frame.pass(index).pass;
    let pipelines = frame.pipelines(pass).variants();
    let mut render_pass = begin_pass(encoder, frame, request, index, segment);
    set_stencil_reference(&mut render_pass, frame, request, index);
    // wgpu gives the device the reference only with a pipeline that tests it, and does not look for one in bundles.
    if let Some(pipeline) = pipelines.values().next().filter(|_| request.draws[pass.process_index].stencil().is_some())
    {
        render_pass.set_pipeline(pipeline);
    }
    render_pass.execute_bundles(bundles);
}

/// Records a pass that draws lights, a full-screen triangle, or vertices that the shader makes.
///
/// # Errors
/// If a resource of the pass is missing. This is a bug in Drawloom.
pub(crate) fn record_without_commands(
    encoder: &mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    index: usize,
) -> Result<(), BackendError> {
    let pass = frame.pass(index);
    let Pass { process_index: process, view_index: view } = pass.pass;
    let draws = &request.draws[process];
    let pipelines = frame.pipelines(pass.pass).variants();
    let variant = fixed_state(draws).map(|state| PipelineVariant::of_pages(state).clamping(pass.clamps_depth));
    let pipeline = variant.and_then(|variant| pipelines.get(&variant));
    let pipeline = pipeline.ok_or_else(|| broken_rule("a pipeline is created before it is used"))?;
    let (list, subdivided) = (DrawList::default(), SubdividedMeshes::new());
    let recorder = BatchRecorder {
        frame,
        pass,
        list: &list,
        pipelines: &pipelines,
        subdivided: &subdivided,
        partial_indices: None,
    };
    let mut render_pass = begin_pass(encoder, frame, request, index, PassSegment::WHOLE);
    set_stencil_reference(&mut render_pass, frame, request, index);
    render_pass.set_pipeline(pipeline);
    recorder.set_bind_groups(&mut render_pass);
    match draws {
        Draws::Lights(draws) => {
            let meshes = frame.light_meshes.as_ref();
            let meshes = meshes.ok_or_else(|| broken_rule("light volumes are uploaded before they are drawn"))?;
            let lights = request.light_tables[view].range(draws.class);
            if !lights.is_empty() {
                render_pass.set_vertex_buffer(0, meshes.vertices.slice(..));
                render_pass.draw(meshes.range(draws.class.kind), lights);
            }
        }
        Draws::Procedural(ProceduralDraws { count: DrawCount::Count { vertices, instances }, .. }) => {
            render_pass.draw(0..*vertices, 0..*instances);
        }
        Draws::Procedural(ProceduralDraws { count: DrawCount::Indirect(offset), .. }) => {
            let buffer = frame.storage_buffers.find(offset.buffer);
            let buffer = buffer.ok_or_else(|| broken_rule("a buffer is made before it is used"))?;
            render_pass.draw_indirect(buffer, offset.bytes);
        }
        _ => render_pass.draw(0..3, 0..1),
    }
    Ok(())
}

/// Has a raw pass encode itself.
///
/// # Errors
/// If the raw pass asks for what its process does not declare, or reports an error, or a resource of the pass is
/// missing. The latter is a bug in Drawloom.
pub(crate) fn encode_raw(
    device: &wgpu::Device,
    encoder: &mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    index: usize,
    raw: &dyn RawPass,
) -> Result<(), BackendError> {
    let &WgpuPassState { pass, timed_pass_index, .. } = frame.pass(index);
    let textures = |name: &str| frame.targets.find(pass.view_index, name).map(|target| &target.texture);
    let layered = |kind, name: &str| frame.targets.find_layered(kind, name).map(|(texture, _)| texture);
    let size = request.views[pass.view_index].camera.size;
    let PlannedProcess { name, declaration, requests, .. } = &request.plan.processes()[pass.process_index];
    let columns = |column| frame.buffers.objects().column(column);
    let materials = |material_type| {
        let index = declaration.material_types.iter().position(|declared| *declared == material_type)?;
        frame.buffers.resource_bytes().of_process(pass.process_index).nth(index)
    };
    let buffers = |buffer| frame.storage_buffers.find(buffer);
    let of_frame = frame.pass(index).frame_bind_group.as_ref();
    let of_frame = of_frame.ok_or_else(|| broken_rule("a pass has bind groups before it is recorded"))?;
    let of_materials = frame.buffers.materials_bind_group();
    let of_materials = of_materials.ok_or_else(|| broken_rule("a frame has its materials before it is recorded"))?;
    let resources = RawPassResources {
        device,
        view: pass.view_index,
        size,
        bind_group_layouts: [&frame.layouts.frame, &frame.layouts.assets],
        bind_groups: [of_frame, of_materials],
        access: RawAccess::new(name, declaration, requests),
        columns: &columns,
        materials: &materials,
        buffers: &buffers,
        textures: &textures,
        layered: &layered,
    };
    let queries = timed_pass_index.and_then(|timed_pass| frame.buffers.timestamps()?.queries(timed_pass));
    if let Some((set, [begin, _])) = queries {
        encoder.write_timestamp(set, begin);
    }
    let encoded = raw.encode(encoder, &resources);
    // Before the pass's own error, which may follow from it, and even if there is none: a pass that goes on without a
    // resource draws something else than its process promises.
    resources.access.end().map_err(BackendError::Access)?;
    encoded.map_err(BackendError::RawPass)?;
    if let Some((set, [_, end])) = queries {
        encoder.write_timestamp(set, end);
    }
    Ok(())
}
