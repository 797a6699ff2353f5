//! Recording: batches into bundles, bundles into passes.

use super::WgpuFrame;
use super::pipelines::{ProcessPipelines, full_screen_state};
use crate::backend::BackendError;
use crate::process::{ClearColor, Declaration, Draws, Pass, RawPass, Resolved};
use crate::queue::Batch;

/// Records batches. Whatever stays the same from one batch to the next is set once.
pub(super) fn bundle(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    pass: usize,
    pipelines: &ProcessPipelines,
    batches: &[Batch],
) -> wgpu::RenderBundle {
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
        let Some(pipeline) = by_state.get(&run[0].state) else { continue };
        encoder.set_pipeline(pipeline);
        for batch in run {
            let Some(mesh) = frame.assets.meshes.get(batch.mesh as usize).copied().flatten() else { continue };
            let indices = mesh.first_index..mesh.first_index + mesh.index_count;
            encoder.draw_indexed(indices, mesh.base_vertex, batch.first..batch.first + batch.count);
        }
    }
    encoder.finish(&wgpu::RenderBundleDescriptor { label: Some(label) })
}

/// Encodes a pass: clears its targets, and replays its bundles or draws its full-screen triangle.
pub(super) fn pass(
    encoder: &mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    index: usize,
    pipelines: &ProcessPipelines,
    declaration: &Declaration,
    draws: &Draws<'_>,
    bundles: &[wgpu::RenderBundle],
) {
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
        return;
    };
    if let Some(pipeline) = pipelines.prepared().get(&full_screen_state(full_screen.blend)) {
        render_pass.set_pipeline(pipeline);
        render_pass.set_bind_group(0, frame.buffers.group(index), &[]);
        render_pass.set_bind_group(1, &frame.assets.group, &[]);
        if let Some(group) = &frame.process_groups[index] {
            render_pass.set_bind_group(2, group, &[]);
        }
        render_pass.draw(0..3, 0..1);
    }
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

fn load(clear: Option<ClearColor>, background: [f64; 3]) -> wgpu::LoadOp<wgpu::Color> {
    let [r, g, b, a] = match clear {
        None => return wgpu::LoadOp::Load,
        Some(ClearColor::Value(value)) => value,
        Some(ClearColor::Background) => [background[0], background[1], background[2], 1.0],
    };
    wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a })
}
