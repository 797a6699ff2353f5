//! The engine: its windows, its world, and the loop of frames.

use std::error::Error;
use std::mem;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::Picture;
use drawloom::process::Format;
use winit::application::ApplicationHandler;
use winit::dpi::LogicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::keyboard::KeyCode;
use winit::window::{Window, WindowId};

use crate::frame_pacing::FramePacing;
use crate::graphics::Graphics;
use crate::options::Options;
use crate::view_window::{ViewWindow, pressed_key};
use crate::world::World;

/// The engine: its windows, its world, and the loop of frames.
pub struct Engine {
    options: Options,
    world: World,
    /// `None` until the first window is open.
    graphics: Option<Graphics>,
    windows: Vec<ViewWindow>,
    /// How many windows were opened so far.
    opened: usize,
    vsync: bool,
    frames: u64,
    pacing: FramePacing,
    last_update: Option<Instant>,
    next_check: Instant,
    screenshot: Option<Picture>,
    /// How many textures and buffers there were after the windows.
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
    /// If the world has more objects than a scene can have.
    pub fn new(options: Options) -> Result<Self, Box<dyn Error>> {
        Ok(Self {
            world: World::new(options.objects)?,
            graphics: None,
            windows: Vec::new(),
            opened: 0,
            vsync: !options.no_vsync,
            frames: 0,
            pacing: FramePacing::default(),
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
        println!("{} frames; {}; {textures} textures and {buffers} buffers", self.frames, pacing_text(&self.pacing));
        let Some(path) = &self.options.screenshot else { return Ok(()) };
        let mut picture = self.screenshot.ok_or("the windows were closed before the screenshot")?;
        if picture.format == Format::Bgra8Srgb {
            picture.bytes.chunks_exact_mut(4).for_each(|pixel| pixel.swap(0, 2));
        }
        image::save_buffer(path, &picture.bytes, picture.width, picture.height, image::ColorType::Rgba8)
            .map_err(|error| format!("cannot write {}: {error}", path.display()))?;
        println!("{} written", path.display());
        Ok(())
    }

    fn open_window(&mut self, event_loop: &ActiveEventLoop) -> Result<(), Box<dyn Error>> {
        if self.windows.len() == Self::MAX_WINDOWS {
            return Ok(());
        }
        let [width, height] = self.options.size;
        let attributes =
            Window::default_attributes().with_title("Drawloom").with_inner_size(LogicalSize::new(width, height));
        let window = Arc::new(event_loop.create_window(attributes)?);
        let (graphics, surface) = match self.graphics.take() {
            Some(graphics) => {
                let surface = graphics.instance.create_surface(Arc::clone(&window))?;
                (self.graphics.insert(graphics), surface)
            }
            None => {
                let (graphics, surface) = Graphics::new(event_loop.owned_display_handle(), &window)?;
                (self.graphics.insert(graphics), surface)
            }
        };
        self.opened += 1;
        let view = (self.opened, self.world.radius());
        let mut opened = ViewWindow::new(graphics, (window, surface), view, self.options.convert)?;
        opened.surface.set_vsync(self.vsync);
        opened.request_redraw();
        self.windows.push(opened);
        Ok(())
    }

    /// Draws a frame into all windows that can be seen.
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
        for window in self.windows.iter_mut().filter(|window| window.is_visible()) {
            window.update(step);
            let Some(frame) = window.surface.acquire(graphics)? else {
                window.hide();
                continue;
            };
            graphics.renderer.backend().import_target(window.name(), "picture", frame.target().clone());
            cameras.push(window.camera());
            frames.push((&window.surface, frame));
        }
        let Some(first) = cameras.first() else { return Ok(()) };

        // The world is lent until the frame is recorded, on all workers.
        let mut recorded = graphics.renderer.record(self.world.as_scene_ref(&cameras))?;
        self.frames += 1;
        let is_last = self.options.frames == Some(self.frames);
        let read_back = if is_last && self.options.screenshot.is_some() {
            Some(recorded.read_back(0, "picture", [0, 0], first.size)?)
        } else {
            None
        };

        // This thread, the device thread, submits and presents the frame, while workers update the world for the next one.
        let Graphics { scheduler, submitter, .. } = &*graphics;
        let (world, mut updated) = (&mut self.world, Ok(()));
        let submitted = scheduler.scope(|scope| {
            if !self.options.still {
                scope.spawn(|_, _| updated = world.update(scheduler, step));
            }
            let submitted = submitter.submit(recorded);
            for (surface, frame) in frames.drain(..).filter(|_| submitted.is_ok()) {
                surface.present(graphics, frame);
            }
            submitted
        })?;
        updated?;
        submitted?;
        self.pacing.add_frame(Instant::now());
        if let Some(read_back) = read_back {
            self.screenshot = Some(read_back.read()?);
        }
        if is_last {
            event_loop.exit();
        }
        Ok(())
    }

    fn press(&mut self, event_loop: &ActiveEventLoop, index: usize, key: KeyCode) -> Result<(), Box<dyn Error>> {
        match key {
            KeyCode::Escape => self.close(event_loop, index),
            KeyCode::F11 => self.windows[index].toggle_fullscreen(),
            KeyCode::KeyN => self.open_window(event_loop)?,
            KeyCode::KeyV => {
                self.vsync = !self.vsync;
                self.windows.iter_mut().for_each(|window| window.surface.set_vsync(self.vsync));
            }
            _ => {}
        }
        Ok(())
    }

    fn close(&mut self, event_loop: &ActiveEventLoop, index: usize) {
        self.windows.remove(index);
        if self.windows.is_empty() {
            event_loop.exit();
        }
    }

    fn window_event_or_error(
        &mut self,
        event_loop: &ActiveEventLoop,
        id: WindowId,
        event: &WindowEvent,
    ) -> Result<(), Box<dyn Error>> {
        let Some(index) = self.windows.iter().position(|window| window.id() == id) else { return Ok(()) };
        self.windows[index].handle(event);
        match event {
            // The first window that can be seen sets the pace, and all are drawn in one frame.
            WindowEvent::RedrawRequested => {
                let leader = self.windows.iter().position(ViewWindow::is_visible);
                if leader == Some(index) { self.draw_frame(event_loop) } else { Ok(()) }
            }
            WindowEvent::CloseRequested => {
                self.close(event_loop, index);
                Ok(())
            }
            event => pressed_key(event).map_or(Ok(()), |key| self.press(event_loop, index, key)),
        }
    }

    fn check(&mut self) {
        self.windows.iter_mut().for_each(ViewWindow::check_visibility);
        let vsync = if self.vsync { "on" } else { "off" };
        let text = format!("{} cubes, {}, vsync {vsync}", self.options.objects, pacing_text(&self.pacing));
        self.windows.iter().for_each(|window| window.set_title(&text));
    }

    fn end_with(&mut self, event_loop: &ActiveEventLoop, result: Result<(), Box<dyn Error>>) {
        if let Err(error) = result {
            self.error.get_or_insert(error);
            event_loop.exit();
        }
    }
}

impl ApplicationHandler for Engine {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        while self.opened < usize::from(self.options.windows) && self.error.is_none() {
            let opened = self.open_window(event_loop);
            self.end_with(event_loop, opened);
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, id: WindowId, event: WindowEvent) {
        if !event_loop.exiting() {
            let result = self.window_event_or_error(event_loop, id, &event);
            self.end_with(event_loop, result);
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let now = Instant::now();
        if now >= self.next_check {
            self.next_check = now + Self::CHECK_INTERVAL;
            self.check();
        }
        match self.windows.iter().find(|window| window.is_visible()) {
            Some(window) => {
                window.request_redraw();
                event_loop.set_control_flow(ControlFlow::Wait);
            }
            None => {
                self.pacing.pause();
                self.last_update = None;
                event_loop.set_control_flow(ControlFlow::WaitUntil(self.next_check));
            }
        }
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // Surfaces go before the connection to the display does.
        drop(mem::take(&mut self.windows));
        if let Some(report) = self.graphics.as_ref().and_then(|graphics| graphics.instance.generate_report()) {
            self.resources = [&report.hub.textures, &report.hub.buffers].map(|registry| registry.num_kept_from_user);
        }
    }
}

fn pacing_text(pacing: &FramePacing) -> String {
    let Some([median, longest]) = pacing.median_and_longest() else { return "no frames yet".to_owned() };
    let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
    format!("{:.1} ms a frame, {:.1} at most", milliseconds(median), milliseconds(longest))
}
