//! The engine's renderer on plain wgpu: it culls, sorts and records on one thread.

use glam::{Vec4, Vec4Swizzles};

use super::drawables::Sphere;
use super::engine::{Engine, MAIN, MIRROR, SHADOW, SKY};

#[derive(Default)]
pub struct OnWgpu {
    /// The drawables that a view sees: the key in the high half, the index in the low one. Kept for its memory.
    visible: Vec<u64>,
}

impl OnWgpu {
    /// Draws a frame.
    pub fn draw(&mut self, engine: &Engine) {
        let mut encoder = engine.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for view in [SHADOW, MIRROR, MAIN] {
            self.cull(engine, view);
            self.visible.sort_unstable();
            let mut pass = begin_pass(engine, &mut encoder, view);
            engine.draw_all(&mut pass, view, self.visible.iter().map(|&visible| visible as u32));
        }
        engine.queue.submit([encoder.finish()]);
    }

    /// Finds the drawables whose bounding spheres a view sees.
    fn cull(&mut self, engine: &Engine, view: usize) {
        let rows = engine.views[view].clip_from_world.transpose();
        let [x, y, z, w] = [rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis];
        // The normal of an infinite far plane is 0: all spheres are in front of it.
        let planes = [w + x, w - x, w + y, w - y, w - z, z].map(|plane| (plane, plane.xyz().length()));
        let sees = |&Sphere { center, radius }: &Sphere| {
            let is_before = |&(plane, length): &(Vec4, f32)| plane.xyz().dot(center) + plane.w >= -radius * length;
            planes.iter().all(is_before)
        };
        self.visible.clear();
        for (index, sphere) in engine.spheres.iter().enumerate() {
            if engine.view_masks[index] & 1 << view != 0 && sees(sphere) {
                self.visible.push(engine.keys[index] << 32 | index as u64);
            }
        }
    }
}

fn begin_pass<'a>(engine: &Engine, encoder: &'a mut wgpu::CommandEncoder, view: usize) -> wgpu::RenderPass<'a> {
    let targets = &engine.views[view];
    let [r, g, b, a] = SKY;
    let colors = targets.color.as_ref().map(|target| {
        Some(wgpu::RenderPassColorAttachment {
            view: &target.view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
                store: wgpu::StoreOp::Store,
            },
        })
    });
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: colors.as_slice(),
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &targets.depth.view,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        ..wgpu::RenderPassDescriptor::default()
    })
}
