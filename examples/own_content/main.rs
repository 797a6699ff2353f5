//! What an engine brings of its own: data of objects and vertices, a material, vertex code, buffers and compute shaders,
//! post-processing with histories and smaller targets, and picking.
//!
//!     cargo run --release --example own_content -- --out pictures
//!
//! It draws 20,000 objects and three rings, and writes pictures:
//!
//! - `tints.png`: a colour of the engine's own for each object (`tints.rs`), beside a material of its own on vertices of its own
//!   (`metal.rs`);
//! - `bloom.png`: the same with a glow around bright objects, at a half and a quarter of the picture's size (`bloom.rs`);
//! - `particles.png`: a fountain that a compute shader moves, drawn by an indirect draw (`particles.rs`), with the glow;
//! - `smooth.png`: the objects after frames of temporal anti-aliasing, while camera and objects move (`temporal.rs`);
//! - `characters.png`: characters with a morph target and joints (`characters.rs`), one of them outlined (`outline.rs`).
//!
//! And it prints which object is in the middle of the picture (`picking.rs`). All of it uses the public interfaces only.

mod bloom;
mod characters;
mod device;
mod metal;
mod outline;
mod particles;
mod picking;
mod temporal;
mod tints;
mod world;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Parser;
use drawloom::backend::{Picture, WgpuBackend, WgpuReadBack};
use drawloom::process::{Deferred, Fxaa, ToneMapping};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use indicatif::ProgressBar;

use crate::bloom::{BloomDown, BloomUp};
use crate::characters::{Characters, Crowd};
use crate::metal::Metal;
use crate::outline::{Outline, Selected};
use crate::picking::ObjectIndex;
use crate::temporal::{Motion, TemporalFilter};
use crate::tints::TintedGeometryBuffer;
use crate::world::World;

#[derive(Parser)]
struct Arguments {
    /// The folder that the pictures are written to.
    #[arg(long, default_value = "own_content")]
    out: PathBuf,
    /// The number of objects.
    #[arg(long, default_value_t = 20_000)]
    objects: usize,
    /// The number of frames that the particles live for, and that the temporal filter sees.
    #[arg(long, default_value_t = 48)]
    frames: usize,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    std::fs::create_dir_all(&arguments.out)?;
    let engine = Engine::new()?;
    let progress = ProgressBar::new((2 * arguments.frames + 3) as u64);

    let tinted = Deferred::new().replace("geometry buffer", TintedGeometryBuffer::default());
    let mut world = World::new(arguments.objects)?;
    let (mut renderer, submitter) = engine.renderer(tinted.clone().post(ToneMapping::new(1.0)), false)?;
    let (picture, under_cursor) = draw(&mut renderer, &submitter, &world)?;
    save(&arguments.out.join("tints.png"), &picture)?;
    progress.inc(1);
    let object = u32::from_le_bytes(under_cursor.read()?.bytes[..4].try_into()?);

    let (mut renderer, submitter) = engine.renderer(tinted.clone().post(ToneMapping::new(1.0)), true)?;
    save(&arguments.out.join("bloom.png"), &draw(&mut renderer, &submitter, &world)?.0)?;
    progress.inc(1);

    let fountain = engine.builder(tinted.clone().post(ToneMapping::new(1.0)), true)?;
    let fountain = fountain.process(particles::Begin).process(particles::Move::default()).process(particles::Draw);
    let (mut renderer, submitter) = fountain.build(Arc::clone(&engine.scheduler))?;
    let mut picture = None;
    for _ in 0..arguments.frames {
        picture = Some(draw(&mut renderer, &submitter, &world)?.0);
        progress.inc(1);
    }
    if let Some(picture) = picture {
        save(&arguments.out.join("particles.png"), &picture)?;
    }

    let motion = Arc::new(Motion::default());
    let filter = |source: &str, target: &str| TemporalFilter::new(source, target);
    let smooth = tinted.post(filter).post(ToneMapping::new(1.0)).post(Fxaa::default());
    let builder = engine.builder(smooth, true)?.process(Arc::clone(&motion));
    let (mut renderer, submitter) = builder.build(Arc::clone(&engine.scheduler))?;
    let mut picture = None;
    for _ in 0..arguments.frames {
        world.step();
        motion.begin_frame(&world.camera);
        picture = Some(draw(&mut renderer, &submitter, &world)?.0);
        progress.inc(1);
    }
    if let Some(picture) = picture {
        save(&arguments.out.join("smooth.png"), &picture)?;
    }
    save(&arguments.out.join("characters.png"), &engine.characters()?)?;
    progress.finish_and_clear();
    println!("{} objects; in the middle of the first picture is {}", arguments.objects, picking::describe(object));
    println!("the pictures are written to {}", arguments.out.display());
    Ok(())
}

/// The engine's device and scheduler.
struct Engine {
    device: wgpu::Device,
    queue: wgpu::Queue,
    scheduler: Arc<Scheduler>,
}

impl Engine {
    fn new() -> Result<Self, Box<dyn Error>> {
        let (device, queue) = device::open()?;
        Ok(Self { device, queue, scheduler: Arc::new(Scheduler::with_available_parallelism()?) })
    }

    /// A pipeline with the engine's own material and with picking, and perhaps with bloom.
    fn builder(
        &self,
        deferred: Deferred,
        blooms: bool,
    ) -> Result<drawloom::RendererBuilder<WgpuBackend>, Box<dyn Error>> {
        let backend = WgpuBackend::new(self.device.clone(), self.queue.clone())?;
        let mut builder = Renderer::builder(backend).deferred(deferred).process(ObjectIndex).output(picking::TARGET);
        builder = builder.process(Metal::new(&self.device, &self.queue));
        if blooms {
            builder = builder.process(BloomDown::HALF).process(BloomDown::QUARTER).process(BloomUp);
        }
        Ok(builder)
    }

    /// The picture of a crowd.
    fn characters(&self) -> Result<Picture, Box<dyn Error>> {
        let characters = Arc::new(Characters::default());
        let mut crowd = Crowd::new(Arc::clone(&characters))?;
        crowd.walk_to(2.0);
        let deferred = Deferred::to_picture().post(Fxaa::default()).deformation(Arc::clone(&characters));
        let backend = WgpuBackend::new(self.device.clone(), self.queue.clone())?;
        let builder = Renderer::builder(backend).deferred(deferred);
        let builder = builder.process(Selected(Arc::clone(&characters))).process(Outline(characters));
        let (mut renderer, submitter) = builder.build(Arc::clone(&self.scheduler))?;
        let recorded = renderer.record(crowd.as_scene_ref(&crowd.columns()))?;
        Ok(submitter.submit(recorded)?.submission.read(0, "picture")?)
    }

    fn renderer(
        &self,
        deferred: Deferred,
        blooms: bool,
    ) -> Result<(Renderer<WgpuBackend>, Submitter<WgpuBackend>), Box<dyn Error>> {
        Ok(self.builder(deferred, blooms)?.build(Arc::clone(&self.scheduler))?)
    }
}

/// Draws the world. Returns the picture, and the read-back of what is in its middle.
fn draw(
    renderer: &mut Renderer<WgpuBackend>,
    submitter: &Submitter<WgpuBackend>,
    world: &World,
) -> Result<(Picture, WgpuReadBack), Box<dyn Error>> {
    let mut recorded = renderer.record(world.as_scene_ref(&world.columns()))?;
    let middle = world.camera.size.map(|pixels| pixels / 2);
    let under_cursor = recorded.read_back(0, picking::TARGET, middle, [1, 1])?;
    let picture = submitter.submit(recorded)?.submission.read(0, "picture")?;
    Ok((picture, under_cursor))
}

fn save(path: &Path, picture: &Picture) -> Result<(), Box<dyn Error>> {
    image::save_buffer(path, &picture.bytes, picture.width, picture.height, image::ColorType::Rgba8)?;
    Ok(())
}
