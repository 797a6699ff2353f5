//! A window, and the view of the world in it.

use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{SurfaceError, SurfaceFrame, WindowSurface};
use drawloom::glam::{DVec2, DVec3};
use drawloom::scene::Camera;
use drawloom::wgpu;
use drawloom_egui::Overlay;
use winit::event::{ElementState, MouseButton, WindowEvent};
use winit::keyboard::PhysicalKey;
use winit::window::{Fullscreen, Window, WindowId};

use crate::fly_camera::FlyCamera;
use crate::graphics::Graphics;

/// A window, and the view of the world in it.
pub struct ViewWindow {
    /// Of the window and of its view.
    name: String,
    window: Arc<Window>,
    pub surface: WindowSurface,
    camera: FlyCamera,
    /// egui, while it is shown in this window.
    overlay: Option<Overlay>,
    /// The system asked for a picture. It asks no window that nobody can see, where it knows.
    is_due: bool,
    is_occluded: bool,
    is_minimized: bool,
}

impl ViewWindow {
    pub fn new(name: String, window: Arc<Window>, surface: WindowSurface, camera: FlyCamera) -> Self {
        Self { name, window, surface, camera, overlay: None, is_due: false, is_occluded: false, is_minimized: false }
    }

    /// The name of its view.
    pub fn name(&self) -> &str {
        &self.name
    }

    pub fn id(&self) -> WindowId {
        self.window.id()
    }

    /// What the next picture is drawn into; `None` if there is nothing this time.
    ///
    /// # Errors
    /// If the device refuses, or the surface stays lost.
    pub fn acquire(&mut self) -> Result<Option<SurfaceFrame>, SurfaceError> {
        self.surface.acquire(self.window.inner_size())
    }

    /// The camera of its view, whose picture is drawn into `frame`.
    pub fn camera(&self, frame: &SurfaceFrame) -> Camera {
        Camera {
            position: self.camera.position,
            orientation: self.camera.orientation(),
            size: frame.size(),
            ..Camera::looking_at(self.name.clone(), DVec3::ZERO, DVec3::NEG_Z)
        }
    }

    /// Flies on by so much time.
    pub fn update(&mut self, elapsed: Duration) {
        self.camera.update(elapsed);
    }

    /// Whether somebody can see it, as far as the system tells.
    pub fn is_visible(&self) -> bool {
        // Not on every system does a minimised window have pixels.
        let size = self.window.inner_size();
        !self.is_occluded && !self.is_minimized && size.width > 0 && size.height > 0
    }

    /// Whether a picture is to be drawn for it now.
    pub fn is_due(&self) -> bool {
        self.is_due && self.is_visible()
    }

    /// Asks the system to say when the next picture is due.
    pub fn request_redraw(&mut self) {
        self.is_due = false;
        self.window.request_redraw();
    }

    /// Asks the system whether the window is minimised: not every system sends an event for it.
    pub fn check_visibility(&mut self) {
        self.is_minimized = self.window.is_minimized() == Some(true);
    }

    pub fn set_title(&self, text: &str) {
        self.window.set_title(&format!("Drawloom, {}: {text}", self.name));
    }

    pub fn toggle_fullscreen(&self) {
        let is_window = self.window.fullscreen().is_none();
        self.window.set_fullscreen(is_window.then_some(Fullscreen::Borderless(None)));
    }

    /// Shows egui over the picture.
    pub fn show_overlay(&mut self, graphics: &Graphics) {
        self.overlay = Some(Overlay::new(&self.window, &graphics.device.device, self.surface.overlay_format()));
    }

    pub fn hide_overlay(&mut self) {
        self.overlay = None;
    }

    pub fn has_overlay(&self) -> bool {
        self.overlay.is_some()
    }

    /// Presents a picture that was drawn, with the user interface over it where egui is shown.
    pub fn present(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: SurfaceFrame,
        interface: impl FnMut(&mut egui::Ui),
    ) {
        let (window, overlay) = (&self.window, &mut self.overlay);
        frame.present(|texture| {
            if let Some(overlay) = overlay {
                overlay.draw(window, device, queue, texture, interface);
            }
            window.pre_present_notify();
        });
    }

    /// What happens to the window and its camera. Returns whether egui uses the event, so that nothing else does.
    pub fn handle(&mut self, event: &WindowEvent) -> bool {
        let is_used = self.overlay.as_mut().is_some_and(|overlay| overlay.handle(&self.window, event));
        match event {
            WindowEvent::RedrawRequested => self.is_due = true,
            WindowEvent::Occluded(is_occluded) => self.is_occluded = *is_occluded,
            WindowEvent::Focused(false) => self.camera.release_all(),
            WindowEvent::KeyboardInput { event, .. } => {
                if let PhysicalKey::Code(key) = event.physical_key {
                    self.camera.set_key(key, event.state.is_pressed() && !is_used);
                }
            }
            WindowEvent::MouseInput { button: MouseButton::Left | MouseButton::Right, state, .. } => {
                self.camera.set_dragging(*state == ElementState::Pressed && !is_used);
            }
            WindowEvent::CursorMoved { position, .. } => {
                let position = position.to_logical::<f64>(self.window.scale_factor());
                self.camera.move_pointer(DVec2::new(position.x, position.y));
            }
            _ => {}
        }
        is_used
    }
}
