//! A window, and the view of the world in it.

use std::error::Error;
use std::f64::consts::TAU;
use std::sync::Arc;
use std::time::Duration;

use drawloom::glam::{DVec2, DVec3};
use drawloom::scene::Camera;
use drawloom::wgpu;
use winit::event::{ElementState, MouseButton, WindowEvent};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::{Fullscreen, Window, WindowId};

use crate::fly_camera::FlyCamera;
use crate::graphics::Graphics;
use crate::window_surface::WindowSurface;

/// A window, and the view of the world in it.
pub struct ViewWindow {
    /// Of the window and of its view.
    name: String,
    window: Arc<Window>,
    pub surface: WindowSurface,
    camera: FlyCamera,
    is_occluded: bool,
    is_minimized: bool,
}

impl ViewWindow {
    /// The `number`-th window, with a camera that looks at the middle of a world of this radius, in metres.
    ///
    /// # Errors
    /// If the device cannot present in it.
    pub fn new(
        graphics: &Graphics,
        (window, surface): (Arc<Window>, wgpu::Surface<'static>),
        (number, radius): (usize, f64),
        converts: bool,
    ) -> Result<Self, Box<dyn Error>> {
        // Each looks from another side.
        let direction = TAU * (0.13 + 0.22 * number as f64);
        let position = DVec3::new(direction.sin() * radius, radius * 0.45, direction.cos() * radius) * 1.25;
        Ok(Self {
            name: format!("window {number}"),
            surface: WindowSurface::new(graphics, Arc::clone(&window), surface, converts)?,
            window,
            camera: FlyCamera::looking_at(position, DVec3::ZERO),
            is_occluded: false,
            is_minimized: false,
        })
    }

    /// The name of its view.
    pub fn name(&self) -> &str {
        &self.name
    }

    pub fn id(&self) -> WindowId {
        self.window.id()
    }

    /// Its view, if a frame is drawn into its surface.
    pub fn camera(&self) -> Camera {
        Camera {
            position: self.camera.position,
            orientation: self.camera.orientation(),
            size: self.surface.size(),
            ..Camera::looking_at(self.name.clone(), DVec3::ZERO, DVec3::NEG_Z)
        }
    }

    /// Flies for a while.
    pub fn update(&mut self, elapsed: Duration) {
        self.camera.update(elapsed);
    }

    /// Whether somebody can see it, as far as the system tells.
    pub fn is_visible(&self) -> bool {
        !self.is_occluded && !self.is_minimized
    }

    /// Asks the system whether the window is minimised: not every system sends an event for it.
    pub fn check_visibility(&mut self) {
        self.is_minimized = self.window.is_minimized() == Some(true);
    }

    /// There was nothing to draw into, so the window counts as hidden until the next check.
    pub fn hide(&mut self) {
        self.is_minimized = true;
    }

    pub fn request_redraw(&self) {
        self.window.request_redraw();
    }

    pub fn set_title(&self, text: &str) {
        self.window.set_title(&format!("Drawloom, {}: {text}", self.name));
    }

    pub fn toggle_fullscreen(&self) {
        let is_window = self.window.fullscreen().is_none();
        self.window.set_fullscreen(is_window.then_some(Fullscreen::Borderless(None)));
    }

    /// What happens to the window and its camera.
    pub fn handle(&mut self, event: &WindowEvent) {
        match event {
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => self.surface.resize(),
            WindowEvent::Occluded(is_occluded) => self.is_occluded = *is_occluded,
            WindowEvent::Focused(false) => self.camera.release_all(),
            WindowEvent::KeyboardInput { event, .. } => {
                if let PhysicalKey::Code(key) = event.physical_key {
                    self.camera.set_key(key, event.state.is_pressed());
                }
            }
            WindowEvent::MouseInput { button: MouseButton::Left | MouseButton::Right, state, .. } => {
                self.camera.set_dragging(*state == ElementState::Pressed);
            }
            WindowEvent::CursorMoved { position, .. } => {
                let position = position.to_logical::<f64>(self.window.scale_factor());
                self.camera.move_pointer(DVec2::new(position.x, position.y));
            }
            _ => {}
        }
    }
}

/// The key that an event presses, unless it repeats, or was held when the window got the focus.
pub fn pressed_key(event: &WindowEvent) -> Option<KeyCode> {
    let WindowEvent::KeyboardInput { event, is_synthetic: false, .. } = event else { return None };
    match event.physical_key {
        PhysicalKey::Code(key) if event.state.is_pressed() && !event.repeat => Some(key),
        _ => None,
    }
}
