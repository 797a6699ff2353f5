//! Recording: batches into bundles, bundles into passes.

use super::WgpuFrame;
use super::pipelines::full_screen_state;
use crate::backend::BackendError;
use crate::process::{ClearColor, Declaration, Draws, Pass, RawPass, Resolved};
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
    let mut encoder = device.create_render_bundle_encoder(&pipelines.bundle_descriptor(label, &color_formats));
    encoder.set_bind_group(0, frame.buffers.group(pass), &[]);
    encoder.set_bind_group(1, &frame.assets.group, &[]);
    if let Some(group) = &frame.process_groups[pass] {
        encoder.set_bind_group(2, group, &[]);
    }
    encoder.set_vertex_buffer(0, frame.assets.vertices.slice(..));
    encoder.set_index_buffer(frame.assets.indices.slice(..), wgpu::IndexFormat::Uint32);
    for run in batches.chunk_by(|one, next| one.state == next.state) {
        let pipeline = by_state.get(&run[0].state).ok_or_else(|| broken("a pipeline is made before it is used"))?;
        encoder.set_pipeline(pipeline);
        for batch in run {
            let mesh = frame.assets.meshes.get(batch.mesh as usize).copied().flatten();
            let mesh = mesh.ok_or_else(|| broken("a batch draws a mesh that is there"))?;
            let indices = mesh.first_index..mesh.first_index + mesh.index_count;
            encoder.draw_indexed(indices, mesh.base_vertex, batch.first..batch.first + batch.count);
        }
    }
    Ok(encoder.finish(&wgpu::RenderBundleDescriptor { label: Some(label) }))
}

/// Encodes a pass: clears its targets, and replays its bundles or draws its full-screen triangle.
///
/// # Errors
/// If what the pass needs was not made before: an error of Drawloom's own.
pub(super) fn pass(
    encoder: &mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    index: usize,
    declaration: &Declaration,
    draws: &Draws<'_>,
    bundles: &[wgpu::RenderBundle],
) -> Result<(), BackendError> {
    let targets = &frame.targets[frame.passes[index].view];
    let colors: Vec<_> = declaration
        .colors()
        .map(|(name, clear)| {
            targets.find(name).map(|target| wgpu::RenderPassColorAttachment {
                view: &target.view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: load(clear, frame.background), store: wgpu::StoreOp::Store },
            })
        })
        .collect();
    let depth = declaration.depth().and_then(|(name, cleared)| {
        let target = targets.find(name)?;
        // Reversed: 0 is infinitely far away.
        let clear = wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store };
        Some(wgpu::RenderPassDepthStencilAttachment {
            view: &target.view,
            depth_ops: cleared.then_some(clear),
            stencil_ops: None,
        })
    });
    let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(&frame.labels[index]),
        color_attachments: &colors,
        depth_stencil_attachment: depth,
        ..wgpu::RenderPassDescriptor::default()
    });
    let Draws::FullScreen(full_screen) = draws else {
        render_pass.execute_bundles(bundles);
        return Ok(());
    };
    let by_state = frame.pipelines[frame.passes[index].process].prepared();
    let pipeline = by_state.get(&full_screen_state(full_screen.blend));
    render_pass.set_pipeline(pipeline.ok_or_else(|| broken("a pipeline is made before it is used"))?);
    render_pass.set_bind_group(0, frame.buffers.group(index), &[]);
    render_pass.set_bind_group(1, &frame.assets.group, &[]);
    if let Some(group) = &frame.process_groups[index] {
        render_pass.set_bind_group(2, group, &[]);
    }
    render_pass.draw(0..3, 0..1);
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
    pass: Pass,
    raw: &dyn RawPass,
) -> Result<(), BackendError> {
    let targets = &frame.targets[pass.view];
    let textures = |name: &str| targets.find(name).map(|target| &target.texture);
    let resources = Resolved { device, view: pass.view, size: targets.size, textures: &textures };
    raw.encode(encoder, &resources).map_err(BackendError::RawPass)
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
