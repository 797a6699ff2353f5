//! Render passes with their attachments.

use crate::backend::FrameRequest;
use crate::backend::wgpu::frame::WgpuFrame;
use crate::backend::wgpu::strategy::PassSegment;
use crate::process::{Access, ClearColor, Pass};

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
    let mut colors = [const { None }; MAX_COLOR_ATTACHMENTS];
    let mut count = 0;
    for (color, (name, clear)) in colors.iter_mut().zip(declaration.colors()) {
        let clear = clear.filter(|_| segment.is_first);
        *color = frame.targets.find(view, name).map(|target| wgpu::RenderPassColorAttachment {
            view: &target.view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: load_op(clear, frame.background), store: wgpu::StoreOp::Store },
        });
        count += 1;
    }
    let depth = declaration.depth().and_then(|(name, access)| {
        let target = frame.targets.find(view, name)?;
        let is_loaded = access == Access::DrawDepth || !segment.is_first;
        // Depth is reversed: 0 is infinitely far away.
        let load = if is_loaded { wgpu::LoadOp::Load } else { wgpu::LoadOp::Clear(0.0) };
        Some(wgpu::RenderPassDepthStencilAttachment {
            view: &target.view,
            depth_ops: access.writes().then_some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
            stencil_ops: None,
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
