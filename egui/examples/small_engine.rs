//! The smallest complete engine: a window, a thousand objects that move, a process of its own, egui, and the inspector.
//!
//!     cargo run --release -p drawloom-egui --example small_engine
//!
//! `examples/window` adds what a larger one has: several windows, hidden ones that draw nothing, a camera that flies,
//! frame pacing.

use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

use drawloom::backend::{WgpuBackend, WindowDevice, WindowSurface};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    Declare, Deferred, Draws, FullScreen, InjectionPoint, Parameters, RenderProcess, ToneMapping, targets,
};
use drawloom::quality::Quality;
use drawloom::scene::{Blend, Camera, Light, Material, Mesh, RenderObject, Scene, SceneError, SceneRef};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use drawloom_egui::{Inspector, Overlay};
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::window::{Window, WindowId};

/// A disc of cubes. The scene has what does not change; the engine's own array has what does.
struct World {
    began: Instant,
    positions: Vec<DVec3>,
    scene: Scene,
}

impl World {
    fn new(cubes: usize) -> Result<Self, SceneError> {
        let mut scene = Scene::new();
        let direction = Vec3::new(-0.5, -0.8, -0.4).normalize();
        scene.lights.push(Light::Directional { direction, illuminance: Vec3::splat(2.5), casts_shadow: true });
        scene.ambient = Vec3::splat(0.1);
        scene.cameras.push(Camera::looking_at("main", DVec3::new(0.0, 9.0, 22.0), DVec3::ZERO));
        let cube = scene.add(Mesh::cuboid("cube", Vec3::splat(0.5))?)?;
        let colors = [Vec3::new(0.7, 0.25, 0.15), Vec3::new(0.75, 0.6, 0.35), Vec3::new(0.2, 0.45, 0.55)];
        let paints = colors.map(|diffuse| scene.add(Material { diffuse, ..Material::default() }));
        let paints = paints.into_iter().collect::<Result<Vec<_>, _>>()?;
        for index in 0..cubes {
            scene.add_object(RenderObject::new(cube, paints[index % paints.len()], DVec3::ZERO))?;
        }
        Ok(Self { began: Instant::now(), positions: vec![DVec3::ZERO; cubes], scene })
    }

    fn update(&mut self) {
        let time = self.began.elapsed().as_secs_f64();
        for (index, position) in self.positions.iter_mut().enumerate() {
            let (radius, phase) = (2.0 + 0.4 * (index as f64).sqrt(), 2.4 * index as f64);
            let angle = phase + time * 4.0 / radius;
            *position = DVec3::new(radius * angle.cos(), phase.sin(), radius * angle.sin());
        }
    }

    fn as_scene_ref(&self) -> SceneRef<'_> {
        SceneRef { positions: &self.positions, ..self.scene.as_scene_ref() }
    }
}

/// Fog over what was drawn, of a density per metre.
struct Fog(Parameters<f32>);

impl RenderProcess for Fog {
    fn name(&self) -> &str {
        "fog"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterTransparency);
        declare.samples(targets::DEPTH);
        declare.draws_over(targets::RADIANCE);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(0) var<uniform> density: f32;
            @group(2) @binding(1) var depth_target: texture_depth_2d;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                // Depth is reversed: 0 is infinitely far away.
                let depth = max(textureLoad(depth_target, vec2<i32>(in.position.xy), 0), 1e-6);
                let amount = 1.0 - exp(-density * length(position_from_depth(in.clip, depth)));
                return vec4<f32>(0.25, 0.3, 0.4, amount);
            }
        ";
        let parameters = self.0.bytes();
        Draws::FullScreen(FullScreen { shader, parameters, blend: Blend::Alpha, ..FullScreen::default() })
    }
}

/// A window, and all that draws into it.
struct Engine {
    world: World,
    fog: Parameters<f32>,
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    inspector: Inspector,
    overlay: Overlay,
    surface: WindowSurface,
    graphics: WindowDevice,
    window: Arc<Window>,
}

impl Engine {
    fn new(event_loop: &ActiveEventLoop) -> Result<Self, Box<dyn Error>> {
        let window = Arc::new(event_loop.create_window(Window::default_attributes().with_title("Cubes"))?);
        let (graphics, surface) = WindowDevice::open(event_loop.owned_display_handle(), Arc::clone(&window))?;
        let fog = Parameters::new(0.02);
        let backend = WgpuBackend::new(graphics.device.clone(), graphics.queue.clone())?;
        let (renderer, submitter) = Renderer::builder(backend)
            .pipeline(Deferred::new().post(ToneMapping { format: surface.picture_format(), ..ToneMapping::default() }))
            .process(Fog(fog.clone()))
            .quality(Quality::balanced())
            .build(Arc::new(Scheduler::with_available_parallelism()?))?;
        let overlay = Overlay::new(&window, &graphics.device, surface.overlay_format());
        let (world, inspector) = (World::new(1_000)?, Inspector::default());
        Ok(Self { world, fog, renderer, submitter, inspector, overlay, surface, graphics, window })
    }

    fn draw(&mut self) -> Result<(), Box<dyn Error>> {
        let Some(frame) = self.surface.acquire(self.window.inner_size())? else { return Ok(()) };
        self.world.update();
        self.world.scene.cameras[0].size = frame.size();
        self.renderer.backend().import_target("main", targets::PICTURE, frame.target().clone());
        let recorded = self.renderer.record(self.world.as_scene_ref())?;
        self.inspector.add_frame(&self.renderer, &recorded);
        self.submitter.submit(recorded)?;
        let WindowDevice { device, queue, .. } = &self.graphics;
        frame.present(|texture| {
            self.overlay.draw(&self.window, device, queue, texture, |ui| {
                self.inspector.show(ui.ctx(), &mut self.renderer);
                egui::Window::new("Fog").anchor(egui::Align2::RIGHT_BOTTOM, [-12.0, -12.0]).show(ui.ctx(), |ui| {
                    self.fog.update(|density| ui.add(egui::Slider::new(density, 0.0..=0.2).text("density")));
                });
            });
            self.window.pre_present_notify();
        });
        self.window.request_redraw();
        Ok(())
    }
}

/// The event loop's handler: no engine before its window is open, and what ended it, unless the user did.
#[derive(Default)]
struct App {
    engine: Option<Engine>,
    error: Option<Box<dyn Error>>,
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        match Engine::new(event_loop) {
            Ok(engine) => self.engine = Some(engine),
            Err(error) => (self.error, _) = (Some(error), event_loop.exit()),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(engine) = &mut self.engine else { return };
        engine.overlay.handle(&engine.window, &event);
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::RedrawRequested => {
                if let Err(error) = engine.draw() {
                    (self.error, _) = (Some(error), event_loop.exit());
                }
            }
            // A window that had nothing to draw into, as while it is minimised, may have it now.
            _ => engine.window.request_redraw(),
        }
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // On Wayland, the surface must go before the connection to the display does.
        self.engine = None;
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut app = App::default();
    EventLoop::new()?.run_app(&mut app)?;
    app.error.map_or(Ok(()), Err)
}
