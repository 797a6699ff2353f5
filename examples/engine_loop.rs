//! An engine that owns its device, its world and its loop, and renders its frames with Drawloom.
//!
//!     cargo run --release --example engine_loop
//!
//! Each iteration of the loop lends the world to the renderer, which returns it when the frame is recorded. It then
//! submits the frame on this thread, the device thread, while the next update runs on another thread. The example opens
//! no window: it copies the picture into a texture in place of a surface's, and finally saves it as `engine_loop.png`.

use std::error::Error;
use std::process::ExitCode;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use drawloom::backend::WgpuBackend;
use drawloom::command::Selection;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::process::{
    CommandDraws, Declare, Deferred, Draws, Format, RawPass, RawPassResources, RenderProcess, ToneMapping, targets,
};
use drawloom::scene::{Assets, Blend, Bounds, Camera, Light, Material, Mesh, SceneError, SceneRef};
use drawloom::task::Scheduler;
use drawloom::{Renderer, wgpu};
use drawloom_output::{PictureFile, path_text, print_line};
use parking_lot::Mutex;

const FRAMES: usize = 60;
const STEP: Duration = Duration::from_millis(16);

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let file = PictureFile::new("engine_loop.png")?;
    // The engine's own device. WgpuBackend's constants list the features and limits that Drawloom needs.
    let (device, queue) = open_device()?;
    let surface = Arc::new(Surface::new(&device, [960, 540]));

    // One scheduler for the engine's own jobs and for Drawloom's.
    let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
    // The picture has the format of the surface, so presenting it is a copy.
    let tone_mapping = ToneMapping { format: Format::Bgra8Srgb, ..ToneMapping::new(1.2) };
    let (mut renderer, submitter) = Renderer::builder(WgpuBackend::new(device.clone(), queue)?)
        .pipeline(Deferred::new().post(tone_mapping).replace("transparency", Glow))
        .process(Present { surface: Arc::clone(&surface) })
        .build(Arc::clone(&scheduler))?;

    let mut world = World::new()?;
    let mut lent_times = Vec::with_capacity(FRAMES);
    let mut last = None;
    for frame in 0..FRAMES {
        if frame == FRAMES / 2 {
            world.camera.size = [640, 480];
            surface.resize(&device, world.camera.size);
        }
        let lent = Instant::now();
        let recorded = renderer.record(world.as_scene_ref())?;
        lent_times.push(lent.elapsed());

        let submitted = thread::scope(|scope| {
            let update = scope.spawn(|| world.update(&scheduler));
            let submitted = submitter.submit(recorded);
            update.join().map_err(|_| "the update panicked")??;
            Ok::<_, Box<dyn Error>>(submitted?)
        })?;
        last = Some(submitted.submission);
    }

    lent_times.sort();
    print_line!("{} objects, {FRAMES} frames on {}", world.positions.len(), adapter_name(&device));
    print_line!(
        "the world was lent for {:?} per frame (median), {:?} at most",
        lent_times[FRAMES / 2],
        lent_times[FRAMES - 1]
    );
    let submission = last.ok_or("no frame was drawn")?;
    let mut picture = submission.read(0, targets::PICTURE)?;
    // Files have red first.
    picture.bytes.chunks_exact_mut(4).for_each(|pixel| pixel.swap(0, 2));
    file.write([picture.width, picture.height], &picture.bytes)?;
    print_line!("{} written, {}x{} after the resize", path_text(file.path()), picture.width, picture.height);
    Ok(())
}

/// The engine's own storage: one array per property. Drawloom reads the arrays without copying them first.
struct World {
    time: f64,
    camera: Camera,
    lights: Vec<Light>,
    assets: Assets,
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
    meshes: Vec<Handle<Mesh>>,
    materials: Vec<Handle<Material>>,
}

impl World {
    fn new() -> Result<Self, SceneError> {
        let mut assets = Assets::default();
        let cube = Mesh::cuboid("cube", Vec3::splat(2.0))?;
        let bounds = cube.bounds();
        let cube = assets.add(cube)?;
        let stone = assets.add(Material { name: "stone".into(), diffuse: Vec3::splat(0.6), ..Material::default() })?;
        let ember = assets.add(Material {
            name: "ember".into(),
            diffuse: Vec3::new(1.0, 0.35, 0.1),
            blend: Blend::Additive,
            ..Material::default()
        })?;
        let count = 40 * 40;
        let material = |index: usize| if index.is_multiple_of(7) { ember } else { stone };
        Ok(Self {
            time: 0.0,
            camera: Camera::looking_at("main", DVec3::new(0.0, 9.0, 22.0), DVec3::ZERO),
            lights: vec![
                Light::Directional {
                    direction: Vec3::new(-0.5, -0.7, -0.5).normalize(),
                    illuminance: Vec3::splat(2.5),
                    casts_shadow: true,
                },
                Light::Point {
                    position: DVec3::Y * 4.0,
                    intensity: Vec3::new(20.0, 30.0, 60.0),
                    range: 30.0,
                    casts_shadow: false,
                },
            ],
            assets,
            positions: vec![DVec3::ZERO; count],
            orientations: vec![Quat::IDENTITY; count],
            scales: vec![Vec3::splat(0.35); count],
            bounds: vec![bounds; count],
            meshes: vec![cube; count],
            materials: (0..count).map(material).collect(),
        })
    }

    /// The data that Drawloom reads until the frame is recorded.
    fn as_scene_ref(&self) -> SceneRef<'_> {
        SceneRef {
            positions: &self.positions,
            orientations: &self.orientations,
            scales: &self.scales,
            bounds: &self.bounds,
            meshes: &self.meshes,
            materials: &self.materials,
            lights: &self.lights,
            cameras: std::slice::from_ref(&self.camera),
            ambient: Vec3::splat(0.05),
            background: Vec3::new(0.01, 0.012, 0.02),
            // Every cube moves in every frame, so nothing is said of changes.
            ..SceneRef::new(&self.assets)
        }
    }

    /// The engine's simulation: waves through a field of cubes, as jobs on the shared scheduler.
    fn update(&mut self, scheduler: &Scheduler) -> Result<(), drawloom::task::JobPanic> {
        self.time += STEP.as_secs_f64();
        let time = self.time;
        let rows = self.positions.chunks_mut(40).zip(self.orientations.chunks_mut(40)).enumerate();
        scheduler.parallel_for_each(rows, |(row, (positions, orientations)), _| {
            for (column, (position, orientation)) in positions.iter_mut().zip(orientations).enumerate() {
                let (x, z) = (column as f64 - 19.5, row as f64 - 19.5);
                let height = (x.hypot(z) * 0.6 - time * 3.0).sin();
                *position = DVec3::new(x * 0.8, height, z * 0.8);
                *orientation = Quat::from_rotation_y((time + height) as f32);
            }
        })
    }
}

/// An engine's process with a pipeline of its own for Drawloom's commands. It replaces Drawloom's transparency: objects
/// with additive materials glow, brightest at their rims.
struct Glow;

impl RenderProcess for Glow {
    fn name(&self) -> &str {
        "glow"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.draws_over(targets::RADIANCE);
        declare.tests_depth(targets::DEPTH);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            selection: Selection::BLENDED,
            shader: "
                struct Rim {
                    @builtin(position) clip: vec4<f32>,
                    @location(0) relative: vec3<f32>,
                    @location(1) normal: vec3<f32>,
                    @location(2) @interpolate(flat) material: u32,
                }

                @vertex
                fn vertex(in: VertexInput) -> Rim {
                    let object = drawn_object(in.instance);
                    let relative = relative_position(object, in.position);
                    return Rim(clip_position(relative), relative, world_normal(object, in.normal), object.material);
                }

                @fragment
                fn fragment(in: Rim) -> @location(0) vec4<f32> {
                    let facing = abs(dot(normalize(in.normal), normalize(in.relative)));
                    return vec4<f32>(materials[in.material].diffuse * (1.5 - facing), 1.0);
                }
            ",
            ..CommandDraws::default()
        })
    }
}

/// An engine's process with a raw pass: it copies the finished picture to the engine's surface.
struct Present {
    surface: Arc<Surface>,
}

impl RenderProcess for Present {
    fn name(&self) -> &str {
        "present"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.reads(targets::PICTURE);
        // No process reads its output, so it must be kept explicitly.
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Raw(self)
    }
}

impl RawPass for Present {
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        let picture = resources.target(targets::PICTURE)?;
        let surface = self.surface.texture.lock();
        encoder.copy_texture_to_texture(picture.as_image_copy(), surface.as_image_copy(), picture.size());
        Ok(())
    }
}

/// A texture in place of a window's surface.
struct Surface {
    texture: Mutex<wgpu::Texture>,
}

impl Surface {
    fn new(device: &wgpu::Device, size: [u32; 2]) -> Self {
        Self { texture: Mutex::new(surface_texture(device, size)) }
    }

    fn resize(&self, device: &wgpu::Device, size: [u32; 2]) {
        *self.texture.lock() = surface_texture(device, size);
    }
}

fn surface_texture(device: &wgpu::Device, [width, height]: [u32; 2]) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("surface"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Bgra8UnormSrgb,
        usage: wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    })
}

fn adapter_name(device: &wgpu::Device) -> String {
    device.adapter_info().name
}

/// A device on the machine's best adapter, with the features that Drawloom requires and the optional ones it can use.
fn open_device() -> Result<(wgpu::Device, wgpu::Queue), Box<dyn Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        ..wgpu::RequestAdapterOptions::default()
    };
    let adapter = pollster::block_on(instance.request_adapter(&options))?;
    let optional = WgpuBackend::optional_features(&adapter);
    let descriptor = wgpu::DeviceDescriptor {
        required_features: WgpuBackend::REQUIRED_FEATURES | optional,
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    };
    Ok(pollster::block_on(adapter.request_device(&descriptor))?)
}
