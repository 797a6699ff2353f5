//! egui over the picture of a winit window.

use std::mem;

use drawloom::wgpu;
use egui::{Context, Order, Pos2, ViewportId};
use egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};
use egui_winit::State;
use winit::event::WindowEvent;
use winit::window::Window;

/// egui over the picture of a winit window: its events, its textures and its pass.
pub struct Overlay {
    state: State,
    renderer: Renderer,
    /// In points.
    pointer: Pos2,
    format: wgpu::TextureFormat,
}

impl Overlay {
    /// An overlay for a window, drawn into views of this format. egui's colours are meant for a format without sRGB:
    /// with sRGB, its shades look slightly different.
    pub fn new(window: &Window, device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let side = device.limits().max_texture_dimension_2d as usize;
        let scale_factor = window.scale_factor() as f32;
        let state =
            State::new(Context::default(), ViewportId::ROOT, window, Some(scale_factor), window.theme(), Some(side));
        Self { state, renderer: Renderer::new(device, format, RendererOptions::default()), pointer: Pos2::ZERO, format }
    }

    /// The context, for its style or fonts.
    pub fn context(&self) -> &Context {
        self.state.egui_ctx()
    }

    /// Passes an event of the window on. Returns whether egui uses it, so that the engine must not.
    pub fn handle(&mut self, window: &Window, event: &WindowEvent) -> bool {
        let is_consumed = self.state.on_window_event(window, event).consumed;
        match event {
            WindowEvent::CursorMoved { position, .. } => {
                let points = position.to_logical::<f32>(f64::from(self.context().pixels_per_point()));
                self.pointer = Pos2::new(points.x, points.y);
                is_consumed
            }
            // egui knows where the pointer was in the latest frame, and it may have moved since.
            WindowEvent::MouseInput { .. } | WindowEvent::MouseWheel { .. } => is_consumed || self.covers_pointer(),
            _ => is_consumed,
        }
    }

    /// Runs the user interface `run`, and draws it over a picture in the window's texture, which the queue draws
    /// before.
    ///
    /// `texture` has the size of the window in pixels, and allows views of the overlay's format.
    pub fn draw(
        &mut self,
        window: &Window,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        texture: &wgpu::Texture,
        run: impl FnMut(&mut egui::Ui),
    ) {
        let mut output = self.state.egui_ctx().clone().run_ui(self.state.take_egui_input(window), run);
        self.state.handle_platform_output(window, output.platform_output);
        let pixels_per_point = output.pixels_per_point;
        let screen = ScreenDescriptor { size_in_pixels: [texture.width(), texture.height()], pixels_per_point };
        let primitives = self.state.egui_ctx().tessellate(output.shapes, pixels_per_point);
        for (id, deltas) in output.textures_delta.set.drain() {
            deltas.iter().for_each(|delta| self.renderer.update_texture(device, queue, id, delta));
        }
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("egui") });
        let mut commands = self.renderer.update_buffers(device, queue, &mut encoder, &primitives, &screen);
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            format: Some(self.format),
            ..wgpu::TextureViewDescriptor::default()
        });
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("egui"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        self.renderer.render(&mut pass.forget_lifetime(), &primitives, &screen);
        commands.push(encoder.finish());
        queue.submit(commands);
        mem::take(&mut output.textures_delta.free).iter().for_each(|id| self.renderer.free_texture(id));
    }

    fn covers_pointer(&self) -> bool {
        self.context().layer_id_at(self.pointer).is_some_and(|layer| layer.order != Order::Background)
    }
}
