//! Render passes with their attachments.

use crate::backend::FrameRequest;
use crate::backend::wgpu::frame::WgpuFrame;
use crate::backend::wgpu::strategy::PassSegment;
use crate::process::{ClearColor, Pass};

/// No device supports more colour attachments.
const MAX_COLOR_ATTACHMENTS: usize = 8;

/// Begins a pass, or a segment of it. Only the first segment clears the targets.
pub(crate) fn begin_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    index: usize,
    segment: PassSegment,
) -> wgpu::RenderPass<'a> {
    let pass = frame.pass(index);
    let Pass { process_index: process, view_index: view } = pass.pass;
    let declaration = &request.plan.processes()[process].declaration;
    let resolved_into = |source: &str| {
        let (_, into) = declaration.resolves.iter().find(|(other, _)| other == source)?;
        Some(&frame.targets.find(view, into)?.view)
    };
    let mut colors = [const { None }; MAX_COLOR_ATTACHMENTS];
    let mut count = 0;
    for (color, (name, clear)) in colors.iter_mut().zip(declaration.colors()) {
        let clear = clear.filter(|_| segment.is_first);
        *color = frame.targets.find(view, name).map(|target| wgpu::RenderPassColorAttachment {
            view: &target.view,
            depth_slice: None,
            resolve_target: resolved_into(name).filter(|_| segment.is_last),
            ops: wgpu::Operations { load: load_op(clear, frame.background), store: wgpu::StoreOp::Store },
        });
        count += 1;
    }
    let depth = declaration.depth().and_then(|(name, access)| {
        let target = frame.targets.find(view, name)?;
        let (is_loaded, store) = (access.keeps_depth() || !segment.is_first, wgpu::StoreOp::Store);
        // Depth is reversed: 0 is infinitely far away.
        let depth = if is_loaded { wgpu::LoadOp::Load } else { wgpu::LoadOp::Clear(0.0) };
        let stencil = if is_loaded { wgpu::LoadOp::Load } else { wgpu::LoadOp::Clear(0) };
        let writes_depth = target.format().has_depth() && access.writes_depth();
        let writes_stencil = target.format().has_stencil() && access.writes();
        Some(wgpu::RenderPassDepthStencilAttachment {
            view: &target.view,
            depth_ops: writes_depth.then_some(wgpu::Operations { load: depth, store }),
            stencil_ops: writes_stencil.then_some(wgpu::Operations { load: stencil, store }),
        })
    });
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(&pass.label),
        color_attachments: &colors[..count],
        depth_stencil_attachment: depth,
        timestamp_writes: pass
            .timed_pass_index
            .and_then(|timed_pass| frame.buffers.timestamps()?.writes_of_segment(timed_pass, segment)),
        ..wgpu::RenderPassDescriptor::default()
    })
}

/// Sets what the process's stencil test compares with, if it has one.
pub(crate) fn set_stencil_reference(
    render_pass: &mut wgpu::RenderPass<'_>,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    index: usize,
) {
    if let Some(stencil) = request.draws[frame.pass(index).pass.process_index].stencil() {
        render_pass.set_stencil_reference(u32::from(stencil.reference));
    }
}

fn load_op(clear: Option<ClearColor>, background: [f64; 3]) -> wgpu::LoadOp<wgpu::Color> {
    let [r, g, b, a] = match clear {
        None => return wgpu::LoadOp::Load,
        Some(ClearColor::Value(value)) => value,
        // A larger value would be infinite in a half float.
        Some(ClearColor::Background) => {
            let [r, g, b] = background.map(|radiance| radiance.min(60_000.0));
            [r, g, b, 1.0]
        }
    };
    wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a })
}
