//! Recording: batches into bundles, bundles into passes.

use super::WgpuFrame;
use super::assets::AssetSnapshot;
use super::pipelines::fixed_state;
use crate::backend::{BackendError, FrameRequest};
use crate::process::{Access, ClearColor, Draws, Pass, RawPass, Resolved};
use crate::queue::Batch;

/// Records batches. Whatever stays the same from one batch to the next is set once.
///
/// # Errors
/// If what a batch needs was not made before: an error of Drawloom's own.
pub(super) fn bundle(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    pass: usize,
    batches: &[Batch],
) -> Result<wgpu::RenderBundle, BackendError> {
    let pipelines = &frame.pipelines[frame.passes[pass].process];
    let color_formats = pipelines.color_formats();
    let label = &frame.labels[pass];
    let by_state = pipelines.prepared();
    let subdivided = frame.subdivided.read();
    let mut encoder = device.create_render_bundle_encoder(&pipelines.bundle_descriptor(label, &color_formats));
    encoder.set_bind_group(0, frame.buffers.group(pass), &[]);
    encoder.set_bind_group(1, &frame.assets.group, &[]);
    if let Some(group) = &frame.process_groups[pass] {
        encoder.set_bind_group(2, group, &[]);
    }
    set_arenas(&mut encoder, &frame.assets);
    for run in batches.chunk_by(|one, next| one.state == next.state) {
        let state = run[0].state;
        let pipeline = by_state.get(&state.of_pipeline());
        encoder.set_pipeline(pipeline.ok_or_else(|| broken("a pipeline is made before it is used"))?);
        for batch in run {
            let objects = batch.first..batch.first + batch.count;
            if state.halvings() > 0 {
                let mesh = subdivided.get(&(batch.mesh, state.halvings()));
                let mesh = mesh.ok_or_else(|| broken("a mesh is subdivided before it is drawn"))?;
                encoder.set_vertex_buffer(0, mesh.vertices.slice(..));
                encoder.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
                encoder.draw_indexed(0..mesh.index_count, 0, objects);
            } else {
                let mesh = frame.assets.meshes.get(batch.mesh as usize).copied().flatten();
                let mesh = mesh.ok_or_else(|| broken("a batch draws a mesh that is there"))?;
                let indices = mesh.first_index..mesh.first_index + mesh.index_count;
                encoder.draw_indexed(indices, mesh.base_vertex, objects);
            }
        }
        if state.halvings() > 0 {
            set_arenas(&mut encoder, &frame.assets);
        }
    }
    Ok(encoder.finish(&wgpu::RenderBundleDescriptor { label: Some(label) }))
}

/// Encodes a pass: clears its targets, and replays its bundles or draws its lights or its full-screen triangle.
///
/// # Errors
/// If what the pass needs was not made before: an error of Drawloom's own.
pub(super) fn pass(
    encoder: &mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    index: usize,
    bundles: &[wgpu::RenderBundle],
) -> Result<(), BackendError> {
    let Pass { process, view } = frame.passes[index];
    let (declaration, draws) = (&request.plan.processes()[process].declaration, &request.draws[process]);
    let colors: Vec<_> = declaration
        .colors()
        .map(|(name, clear)| {
            frame.targets.find(view, name).map(|target| wgpu::RenderPassColorAttachment {
                view: &target.view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: load(clear, frame.background), store: wgpu::StoreOp::Store },
            })
        })
        .collect();
    let depth = declaration.depth().and_then(|(name, access)| {
        let target = frame.targets.find(view, name)?;
        // Reversed: 0 is infinitely far away.
        let load = if access == Access::DrawDepth { wgpu::LoadOp::Load } else { wgpu::LoadOp::Clear(0.0) };
        Some(wgpu::RenderPassDepthStencilAttachment {
            view: &target.view,
            depth_ops: access.writes().then_some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        })
    });
    let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(&frame.labels[index]),
        color_attachments: &colors,
        depth_stencil_attachment: depth,
        ..wgpu::RenderPassDescriptor::default()
    });
    let Some(state) = fixed_state(draws) else {
        render_pass.execute_bundles(bundles);
        return Ok(());
    };
    let by_state = frame.pipelines[process].prepared();
    render_pass.set_pipeline(by_state.get(&state).ok_or_else(|| broken("a pipeline is made before it is used"))?);
    render_pass.set_bind_group(0, frame.buffers.group(index), &[]);
    render_pass.set_bind_group(1, &frame.assets.group, &[]);
    if let Some(group) = &frame.process_groups[index] {
        render_pass.set_bind_group(2, group, &[]);
    }
    match draws {
        Draws::Lights(draws) => {
            let meshes = frame.light_meshes.as_ref();
            let meshes = meshes.ok_or_else(|| broken("the geometry of lights is made before it is drawn"))?;
            let lights = request.lights[view].range(draws.class);
            if !lights.is_empty() {
                render_pass.set_vertex_buffer(0, meshes.corners.slice(..));
                render_pass.draw(meshes.range(draws.class.kind), lights);
            }
        }
        _ => render_pass.draw(0..3, 0..1),
    }
    Ok(())
}

/// Lets a raw pass encode itself.
///
/// # Errors
/// What the pass reports.
pub(super) fn raw(
    device: &wgpu::Device,
    encoder: &mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    pass: Pass,
    raw: &dyn RawPass,
) -> Result<(), BackendError> {
    let textures = |name: &str| frame.targets.find(pass.view, name).map(|target| &target.texture);
    let layered = |kind, name: &str| frame.targets.find_layered(kind, name).map(|(texture, _)| texture);
    let size = request.views[pass.view].camera.size;
    let resources = Resolved { device, view: pass.view, size, textures: &textures, layered: &layered };
    raw.encode(encoder, &resources).map_err(BackendError::RawPass)
}

fn set_arenas<'a>(encoder: &mut wgpu::RenderBundleEncoder<'a>, assets: &'a AssetSnapshot) {
    encoder.set_vertex_buffer(0, assets.vertices.slice(..));
    encoder.set_index_buffer(assets.indices.slice(..), wgpu::IndexFormat::Uint32);
}

fn broken(rule: &str) -> BackendError {
    BackendError::BrokenRule { rule: rule.to_owned() }
}

fn load(clear: Option<ClearColor>, background: [f64; 3]) -> wgpu::LoadOp<wgpu::Color> {
    let [r, g, b, a] = match clear {
        None => return wgpu::LoadOp::Load,
        Some(ClearColor::Value(value)) => value,
        // Past this a half float would be infinite.
        Some(ClearColor::Background) => {
            let [r, g, b] = background.map(|radiance| radiance.min(60_000.0));
            [r, g, b, 1.0]
        }
    };
    wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a })
}
