//! The engine: its windows, its world, and the loop of frames.

use std::error::Error;
use std::f64::consts::TAU;
use std::mem;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::{Picture, SurfaceFrame, WgpuBackend, WindowDevice};
use drawloom::glam::DVec3;
use drawloom::process::{Format, targets};
use drawloom::task::{JobPanic, Scheduler};
use drawloom::{RecordedFrame, SubmitError};
use drawloom_egui::Inspector;
use drawloom_output::{path_text, print_line};
use winit::application::ApplicationHandler;
use winit::dpi::LogicalSize;
use winit::event::{ElementState, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::{Window, WindowId};

use crate::fly_camera::FlyCamera;
use crate::frame_pacing::FramePacing;
use crate::graphics::Graphics;
use crate::key_presses::KeyPresses;
use crate::options::Options;
use crate::view_window::ViewWindow;
use crate::world::World;

/// The engine: its windows, its world, and the loop of frames.
pub struct Engine {
    options: Options,
    world: World,
    /// `None` until the first window is open.
    graphics: Option<Graphics>,
    windows: Vec<ViewWindow>,
    windows_opened: usize,
    vsync: bool,
    frames: u64,
    pacing: FramePacing,
    inspector: Inspector,
    keys: KeyPresses,
    last_update: Option<Instant>,
    next_check: Instant,
    screenshot: Option<Picture>,
    /// The numbers of textures and buffers that are left when all windows are closed.
    resources: [usize; 2],
    /// What ended the loop, unless the user did.
    error: Option<Box<dyn Error>>,
}

impl Engine {
    /// How often titles change, and the system is asked which windows are minimised.
    const CHECK_INTERVAL: Duration = Duration::from_millis(250);
    /// What a frame simulates if the number of frames is given.
    const FIXED_STEP: Duration = Duration::from_nanos(1_000_000_000 / 60);
    /// What a frame simulates at most, for example after the window was dragged.
    const MAX_STEP: Duration = Duration::from_millis(100);
    const MAX_WINDOWS: usize = 8;

    /// An engine without windows.
    ///
    /// # Errors
    /// If a mesh or a material of the world is refused.
    pub fn new(options: Options) -> Result<Self, Box<dyn Error>> {
        Ok(Self {
            world: World::new(options.objects as usize)?,
            graphics: None,
            windows: Vec::new(),
            windows_opened: 0,
            vsync: !options.no_vsync,
            frames: 0,
            pacing: FramePacing::default(),
            inspector: Inspector::new(options.inspector),
            keys: KeyPresses::default(),
            last_update: None,
            next_check: Instant::now(),
            screenshot: None,
            resources: [0; 2],
            error: None,
            options,
        })
    }

    /// Reports what the loop did, and writes the screenshot.
    ///
    /// # Errors
    /// If something ended the loop, or the screenshot cannot be written.
    pub fn finish(self) -> Result<(), Box<dyn Error>> {
        if let Some(error) = self.error {
            return Err(error);
        }
        let [textures, buffers] = self.resources;
        print_line!("{} frames; {}; {textures} textures and {buffers} buffers", self.frames, pacing_text(&self.pacing));
        let Some(file) = &self.options.screenshot else { return Ok(()) };
        let mut picture = self.screenshot.ok_or("the windows were closed before the screenshot")?;
        if picture.format == Format::Bgra8Srgb {
            picture.bytes.chunks_exact_mut(4).for_each(|pixel| pixel.swap(0, 2));
        }
        file.write([picture.width, picture.height], &picture.bytes)?;
        print_line!("{} written", path_text(file.path()));
        Ok(())
    }

    fn open_window(&mut self, event_loop: &ActiveEventLoop) -> Result<(), Box<dyn Error>> {
        let [width, height] = self.options.size;
        let attributes =
            Window::default_attributes().with_title("Drawloom").with_inner_size(LogicalSize::new(width, height));
        let window = Arc::new(event_loop.create_window(attributes)?);
        let (graphics, mut surface) = match &mut self.graphics {
            Some(graphics) => {
                let surface = graphics.device.surface(Arc::clone(&window))?;
                let surface = surface.with_picture_format(graphics.picture_format)?;
                (graphics, surface)
            }
            none => {
                let (graphics, surface) = Graphics::new(event_loop.owned_display_handle(), Arc::clone(&window))?;
                (none.insert(graphics), surface)
            }
        };
        if self.options.convert {
            surface = surface.always_converting()?;
        }
        surface.set_vsync(self.vsync);
        self.windows_opened += 1;
        let name = format!("window {}", self.windows_opened);
        // Each looks at the middle from another side.
        let (direction, radius) = (TAU * (0.13 + 0.22 * self.windows_opened as f64), self.world.radius());
        let position = DVec3::new(direction.sin() * radius, radius * 0.45, direction.cos() * radius) * 1.25;
        let mut window = ViewWindow::new(name, window, surface, FlyCamera::looking_at(position, DVec3::ZERO));
        if self.inspector.is_open() && self.windows.is_empty() {
            window.show_overlay(graphics);
        }
        window.request_redraw();
        self.windows.push(window);
        Ok(())
    }

    /// Draws a frame into all windows that are due.
    fn draw_frame(&mut self, event_loop: &ActiveEventLoop) -> Result<(), Box<dyn Error>> {
        let Some(graphics) = &mut self.graphics else { return Ok(()) };
        let step = if self.options.frames.is_some() {
            Self::FIXED_STEP
        } else {
            let now = Instant::now();
            let last = self.last_update.replace(now).unwrap_or(now);
            (now - last).min(Self::MAX_STEP)
        };

        // Each window is a view, and its surface's texture is what that view draws into.
        let (mut cameras, mut frames) = (Vec::new(), Vec::new());
        for window in self.windows.iter_mut().filter(|window| window.is_due()) {
            window.update(step);
            if let Some(frame) = window.acquire()? {
                graphics.renderer.backend().import_target(window.name(), targets::PICTURE, frame.target().clone());
                cameras.push(window.camera(&frame));
                frames.push((window, frame));
            }
        }
        let Some(first) = cameras.first() else { return Ok(()) };

        // The world is lent until the frame is recorded, on all workers.
        let mut recorded = graphics.renderer.record(self.world.as_scene_ref(&cameras))?;
        self.inspector.add_frame(&graphics.renderer, &recorded);
        self.frames += 1;
        let is_last = self.options.frames == Some(self.frames);
        let takes_screenshot = is_last && self.options.screenshot.is_some();
        let read_back =
            if takes_screenshot { Some(recorded.read_back(0, targets::PICTURE, [0, 0], first.size)?) } else { None };

        let world = (!self.options.still).then_some(&mut self.world);
        submit_and_update(graphics, recorded, frames, &mut self.inspector, |scheduler| match world {
            Some(world) => world.update(scheduler, step),
            None => Ok(()),
        })?;
        self.pacing.add_frame(Instant::now());
        // Its own button closes it too.
        if !self.inspector.is_open() {
            self.windows.iter_mut().for_each(ViewWindow::hide_overlay);
        }
        if let Some(read_back) = read_back {
            self.screenshot = Some(read_back.read()?);
        }
        if is_last {
            event_loop.exit();
        }
        self.windows.iter_mut().filter(|window| window.is_visible()).for_each(ViewWindow::request_redraw);
        Ok(())
    }

    fn press(&mut self, event_loop: &ActiveEventLoop, index: usize, key: KeyCode) {
        match key {
            KeyCode::Escape => self.close(event_loop, index),
            KeyCode::F1 => self.toggle_inspector(index),
            KeyCode::F11 => self.windows[index].toggle_fullscreen(),
            KeyCode::KeyN if self.windows.len() == Self::MAX_WINDOWS => {
                tracing::warn!("there are {} windows, and no more are opened", Self::MAX_WINDOWS);
            }
            KeyCode::KeyN => {
                if let Err(error) = self.open_window(event_loop) {
                    tracing::error!("no other window can be opened: {error}");
                }
            }
            KeyCode::KeyV => {
                self.vsync = !self.vsync;
                self.windows.iter_mut().for_each(|window| window.surface.set_vsync(self.vsync));
            }
            _ => {}
        }
    }

    /// Shows the inspector in a window, and in no other, or nowhere.
    fn toggle_inspector(&mut self, index: usize) {
        let Some(graphics) = &mut self.graphics else { return };
        let was_here = self.windows[index].has_overlay();
        self.windows.iter_mut().for_each(ViewWindow::hide_overlay);
        if was_here {
            self.inspector.close(&mut graphics.renderer);
        } else {
            self.inspector.open();
            self.windows[index].show_overlay(graphics);
        }
    }

    fn close(&mut self, event_loop: &ActiveEventLoop, index: usize) {
        let closed = self.windows.remove(index);
        if let Some(graphics) = &mut self.graphics
            && closed.has_overlay()
        {
            self.inspector.close(&mut graphics.renderer);
        }
        if self.windows.is_empty() {
            event_loop.exit();
        }
    }

    fn update_titles_and_visibility(&mut self) {
        let vsync = if self.vsync { "on" } else { "off" };
        let text = format!("{} cubes, {}, vsync {vsync}", self.options.objects, pacing_text(&self.pacing));
        for window in &mut self.windows {
            window.set_title(&text);
            window.check_visibility();
            if window.is_visible() && !window.is_due() {
                window.request_redraw();
            }
        }
    }

    fn end_with(&mut self, event_loop: &ActiveEventLoop, error: Box<dyn Error>) {
        self.error.get_or_insert(error);
        event_loop.exit();
    }
}

/// Submits and presents a frame on this thread, the device thread, while workers update the world for the next one.
fn submit_and_update(
    graphics: &mut Graphics,
    recorded: RecordedFrame<WgpuBackend>,
    frames: Vec<(&mut ViewWindow, SurfaceFrame)>,
    inspector: &mut Inspector,
    update: impl FnOnce(&Scheduler) -> Result<(), JobPanic> + Send,
) -> Result<(), Box<dyn Error>> {
    let Graphics { scheduler, submitter, renderer, device: WindowDevice { device, queue, .. }, .. } = graphics;
    let mut updated = Ok(());
    let submitted = scheduler.scope(|scope| {
        scope.spawn(|_, _| {
            // What the inspector shows in the lane of this thread.
            let _span = scheduler.timeline().span("update");
            updated = update(scheduler);
        });
        submitter.submit(recorded)?;
        for (window, frame) in frames {
            window.present(device, queue, frame, |ui| inspector.show(ui.ctx(), renderer));
        }
        Ok::<_, SubmitError>(())
    })?;
    updated?;
    Ok(submitted?)
}

impl ApplicationHandler for Engine {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        while self.windows_opened < usize::from(self.options.windows) {
            if let Err(error) = self.open_window(event_loop) {
                return self.end_with(event_loop, error);
            }
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, id: WindowId, event: WindowEvent) {
        let Some(index) = self.windows.iter().position(|window| window.id() == id) else { return };
        let is_used = self.windows[index].handle(&event);
        match event {
            WindowEvent::CloseRequested => self.close(event_loop, index),
            WindowEvent::Focused(true) => self.keys.gain_focus(),
            WindowEvent::KeyboardInput { event, is_synthetic, .. } => {
                let PhysicalKey::Code(key) = event.physical_key else { return };
                match (event.state, is_synthetic) {
                    (ElementState::Pressed, true) => self.keys.find_held(key),
                    (ElementState::Pressed, false) if self.keys.press(key) && !is_used => {
                        self.press(event_loop, index, key);
                    }
                    (ElementState::Released, false) => self.keys.release(key),
                    _ => {}
                }
            }
            _ => {}
        }
    }

    /// All events of this turn of the loop were handled.
    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        if event_loop.exiting() {
            return;
        }
        if self.windows.iter().any(ViewWindow::is_due)
            && let Err(error) = self.draw_frame(event_loop)
        {
            return self.end_with(event_loop, error);
        }
        let now = Instant::now();
        if now >= self.next_check {
            self.next_check = now + Self::CHECK_INTERVAL;
            self.update_titles_and_visibility();
        }
        if !self.windows.iter().any(ViewWindow::is_visible) {
            self.pacing.pause();
            self.last_update = None;
        }
        event_loop.set_control_flow(ControlFlow::WaitUntil(self.next_check));
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // On Wayland, surfaces must go before the connection to the display does.
        drop(mem::take(&mut self.windows));
        if let Some(report) = self.graphics.as_ref().and_then(|graphics| graphics.device.instance.generate_report()) {
            self.resources = [&report.hub.textures, &report.hub.buffers].map(|registry| registry.num_kept_from_user);
        }
    }
}

fn pacing_text(pacing: &FramePacing) -> String {
    let Some([median, longest]) = pacing.median_and_longest() else { return "no frames yet".to_owned() };
    let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
    format!("{:.1} ms a frame, {:.1} at most", milliseconds(median), milliseconds(longest))
}
