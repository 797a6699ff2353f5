//! An engine's own pipeline in place of `Deferred`: forward, with a depth pre-pass and requirements of its own.
//!
//!     cargo run --release --example forward
//!
//! It switches lamps on, prints which processes each frame has, and saves the last picture as `forward.png`.
//! [`pipeline`] is what an engine copies; it uses the public interfaces only.

mod pipeline;

use std::error::Error;
use std::f64::consts::TAU;
use std::process::ExitCode;
use std::sync::Arc;

use drawloom::backend::WgpuBackend;
use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Blend, Camera, Light, Material, Mesh, RenderObject, Scene, SceneError};
use drawloom::task::Scheduler;
use drawloom::{Renderer, wgpu};
use drawloom_output::{PictureFile, path_text, print_line};
use pipeline::Forward;

/// How many lamps are lit, frame by frame.
const LAMPS: [usize; 5] = [0, 3, 4, 16, 48];

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let file = PictureFile::new("forward.png")?;
    let (device, queue) = open_device()?;
    let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
    let (mut renderer, submitter) =
        Renderer::builder(WgpuBackend::new(device, queue)?).pipeline(Forward).build(scheduler)?;

    let mut scene = world()?;
    // No frame waits for a shader, however many lamps are switched on.
    renderer.prepare_pipelines(scene.as_scene_ref())?;
    let mut last = None;
    for lit in LAMPS {
        scene.lights = lamps(lit);
        let recorded = renderer.record(scene.as_scene_ref())?;
        last = Some(submitter.submit(recorded)?.submission);
        let names: Vec<_> = renderer.plan().processes().iter().map(|planned| planned.name.as_str()).collect();
        print_line!("{lit:2} lamps: {}", names.join(", "));
    }
    let picture = last.ok_or("no frame was drawn")?.read(0, "picture")?;
    file.write([picture.width, picture.height], &picture.bytes)?;
    print_line!("{} written, of {} plans", path_text(file.path()), renderer.plan_count());
    Ok(())
}

/// A floor with rows of boxes, some of them of glass.
fn world() -> Result<Scene, SceneError> {
    let mut scene = Scene::new();
    let cube = scene.add(Mesh::cuboid("cube", Vec3::ONE)?)?;
    let stone = scene.add(Material { diffuse: Vec3::splat(0.6), ..Material::default() })?;
    let glass =
        Material { diffuse: Vec3::new(0.3, 0.7, 0.9), opacity: 0.4, blend: Blend::Alpha, ..Material::default() };
    let glass = scene.add(glass)?;
    let mut floor = RenderObject::new(cube, stone, DVec3::NEG_Y * 0.5);
    floor.scale = Vec3::new(40.0, 1.0, 40.0);
    scene.add_object(floor)?;
    for index in 0..100 {
        let (x, z) = (f64::from(index % 10) - 4.5, f64::from(index / 10) - 4.5);
        let material = if index % 7 == 0 { glass } else { stone };
        scene.add_object(RenderObject::new(cube, material, DVec3::new(x * 2.0, 0.5, z * 2.0)))?;
    }
    scene.ambient = Vec3::splat(0.03);
    scene.background = Vec3::new(0.01, 0.012, 0.02);
    let camera = Camera::looking_at("main", DVec3::new(0.0, 9.0, 17.0), DVec3::ZERO);
    scene.cameras.push(Camera { size: [960, 540], ..camera });
    Ok(scene)
}

/// Lamps between the boxes, on a spiral.
fn lamps(count: usize) -> Vec<Light> {
    let lamp = |index: usize| {
        let turn = index as f64 * 0.381_966 * TAU;
        let hue = Vec3::new(turn.cos() as f32, (turn + TAU / 3.0).cos() as f32, (turn - TAU / 3.0).cos() as f32);
        let radius = 1.3 * (index as f64 + 0.5).sqrt();
        Light::Point {
            position: DVec3::new(radius * turn.cos(), 1.6, radius * turn.sin()),
            intensity: 2.0 * (Vec3::ONE + hue),
            range: 8.0,
            casts_shadow: false,
        }
    };
    (0..count).map(lamp).collect()
}

/// A device on the machine's best adapter, with the features that Drawloom requires and the optional ones it can use.
fn open_device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let descriptor = wgpu::DeviceDescriptor {
        required_features: WgpuBackend::REQUIRED_FEATURES | WgpuBackend::optional_features(&adapter),
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    };
    Ok(pollster::block_on(adapter.request_device(&descriptor))?)
}
