//! Loads and draws what tests generate.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use drawloom::backend::{Picture, WgpuBackend};
use drawloom::process::{Deferred, Fxaa, ToneMapping};
use drawloom::task::Scheduler;
use drawloom::{Renderer, wgpu};
use drawloom_gltf::{GltfLimits, LoadError, LoadOptions, World, draw, load};
use libtest_mimic::Failed;

use crate::generate::builder::Builder;

/// Width and height of pictures in tests, in pixels.
pub const SIZE: [u32; 2] = [192, 108];

pub const AT_REST: LoadOptions =
    LoadOptions { time: None, animation: 0, camera: None, size: SIZE, limits: GltfLimits::DEFAULT };

/// The adapter's device; `None` without an adapter.
pub fn device() -> Option<(wgpu::Device, wgpu::Queue)> {
    static DEVICE: LazyLock<Option<(wgpu::Device, wgpu::Queue)>> = LazyLock::new(|| draw::open_device().ok());
    DEVICE.clone()
}

/// An empty folder for a test.
pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("gltf").join(name);
    // It may be there from an earlier run.
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("the target folder can be written");
    folder
}

/// Loads the bytes of a file.
pub fn load_bytes(name: &str, bytes: &[u8], options: &LoadOptions) -> Result<World, LoadError> {
    let path = folder(name).join("scene.glb");
    fs::write(&path, bytes).expect("the target folder can be written");
    load_file(&path, options)
}

pub fn load_file(path: &Path, options: &LoadOptions) -> Result<World, LoadError> {
    load(path, options, &SCHEDULER, &mut |_| ())
}

/// Loads a file that is only in memory.
pub fn load_memory(name: &str, bytes: Vec<u8>, options: &LoadOptions) -> Result<World, LoadError> {
    drawloom_gltf::load_bytes(Path::new(name), bytes, options, &SCHEDULER, &mut |_| ())
}

/// Loads a generated file, which has nothing to warn of but that its tangents are the shader's.
pub fn load_whole(name: &str, builder: &Builder, options: &LoadOptions) -> Result<World, Failed> {
    let world = load_bytes(name, &builder.glb(), options)?;
    let warning = world.warnings.iter().find(|warning| !warning.contains("MikkTSpace"));
    if let Some(warning) = warning { Err(warning.into()) } else { Ok(world) }
}

/// Draws a generated file.
pub fn draw_builder(name: &str, builder: &Builder, options: &LoadOptions) -> Result<Drawn, Failed> {
    draw_world(name, &load_whole(name, builder, options)?)
}

/// Draws a world, and leaves the picture in the folder of the test, to look at.
pub fn draw_world(name: &str, world: &World) -> Result<Drawn, Failed> {
    let device = device().ok_or("there is no graphics adapter")?;
    let picture = picture_of(device, world).map_err(|error| error.to_string())?;
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("gltf").join(name).join("picture.png");
    let (width, height) = (picture.width, picture.height);
    image::save_buffer(path, &picture.bytes, width, height, image::ColorType::Rgba8)?;
    Ok(Drawn { size: [width, height], bytes: picture.bytes })
}

/// As the example draws it.
fn picture_of((device, queue): (wgpu::Device, wgpu::Queue), world: &World) -> Result<Picture, Box<dyn Error>> {
    let deferred = Deferred::new().shadow_maps(Some(draw::shadow_maps(world)));
    let deferred = deferred.post(ToneMapping::new(1.0)).post(Fxaa::default());
    let builder = Renderer::builder(WgpuBackend::new(device, queue)?);
    let builder = draw::add_world(builder, deferred, world);
    let (mut renderer, submitter) = builder.build(Arc::clone(&SCHEDULER))?;
    let recorded = renderer.record(world.as_scene_ref(&world.columns()))?;
    Ok(submitter.submit(recorded)?.submission.read(0, "picture")?)
}

static SCHEDULER: LazyLock<Arc<Scheduler>> =
    LazyLock::new(|| Arc::new(Scheduler::with_available_parallelism().expect("threads can be started")));

/// A picture.
pub struct Drawn {
    pub size: [u32; 2],
    bytes: Vec<u8>,
}

impl Drawn {
    /// Red, green and blue at a point: (0, 0) is the upper left, and (1, 1) the lower right.
    pub fn at(&self, x: f32, y: f32) -> [i32; 3] {
        let [column, row] = [x * self.size[0] as f32, y * self.size[1] as f32].map(|at| at as usize);
        let pixel = (row * self.size[0] as usize + column) * 4;
        [0, 1, 2].map(|channel| self.bytes[pixel + channel].into())
    }

    /// The least and the greatest sum of the channels in a region.
    pub fn extremes(&self, [left, right]: [f32; 2], [top, bottom]: [f32; 2]) -> [i32; 2] {
        let steps = |from: f32, to: f32| (0..40).map(move |step| from + (to - from) * step as f32 / 40.0);
        let sums = steps(top, bottom).flat_map(|y| steps(left, right).map(move |x| self.at(x, y).iter().sum()));
        sums.fold([i32::MAX, i32::MIN], |[least, greatest], sum: i32| [least.min(sum), greatest.max(sum)])
    }

    /// The number of pixels with a channel that differs by more than 12 of 255.
    pub fn difference(&self, other: &Self) -> usize {
        let pixels = self.bytes.chunks(4).zip(other.bytes.chunks(4));
        pixels.filter(|(one, other)| one.iter().zip(*other).any(|(one, other)| one.abs_diff(*other) > 12)).count()
    }
}

/// # Errors
/// If it does not hold.
pub fn expect(holds: bool, otherwise: impl FnOnce() -> String) -> Result<(), Failed> {
    if holds { Ok(()) } else { Err(otherwise().into()) }
}

/// # Errors
/// If the color at a point is not within 12 of 255 of another.
pub fn expect_color(drawn: &Drawn, [x, y]: [f32; 2], expected: [i32; 3]) -> Result<(), Failed> {
    let color = drawn.at(x, y);
    let is_near = color.iter().zip(expected).all(|(one, other)| (one - other).abs() <= 12);
    expect(is_near, || format!("at ({x}, {y}) it is {color:?}, not {expected:?}"))
}
