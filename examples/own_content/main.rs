//! What an engine brings of its own: data of objects and vertices, a material, vertex code, buffers and compute
//! shaders, post-processing with histories and smaller targets, and picking.
//!
//!     cargo run --release --example own_content -- --out pictures
//!
//! It draws 20,000 objects and three rings, and writes pictures:
//!
//! - `tints.png`: a colour of the engine's own for each object (`tints.rs`), beside a material of its own on vertices
//!   of its own (`metal.rs`);
//! - `bloom.png`: the same with a glow around bright objects, at a half and a quarter of the picture's size
//!   (`bloom.rs`);
//! - `particles.png`: a fountain that a compute shader moves, drawn by an indirect draw (`particles.rs`), with the
//!   glow;
//! - `smooth.png`: the objects after frames of temporal anti-aliasing, while camera and objects move (`temporal.rs`);
//! - `characters.png`: characters with a morph target and joints (`characters.rs`), one of them outlined
//!   (`outline.rs`).
//!
//! And it prints which object is in the middle of the picture (`picking.rs`). All of it uses the public interfaces
//! only.

mod bloom;
mod characters;
mod device;
mod engine;
mod metal;
mod outline;
mod particles;
mod picking;
mod temporal;
mod tints;
mod world;

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use drawloom::backend::Picture;
use drawloom_output::{OutputError, PictureFile, create_folder, path_text, print_line};
use indicatif::ProgressBar;

use crate::engine::Engine;
use crate::world::World;

/// Width and height of the pictures in pixels.
const SIZE: [u32; 2] = [960, 540];

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

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Arguments = drawloom_output::parse_arguments();
    create_folder(&arguments.out)?;
    let engine = Engine::new(device::open()?)?;
    let progress = ProgressBar::new((2 * arguments.frames + 3) as u64);
    let step = || progress.inc(1);
    let save = |name: &str, picture: &Picture| {
        step();
        save(arguments.out.join(name), picture)
    };

    let mut world = World::new(arguments.objects, SIZE)?;
    let (picture, object) = engine.tints(&world)?;
    save("tints.png", &picture)?;
    save("bloom.png", &engine.bloom(&world)?)?;
    save("particles.png", &engine.particles(&world, arguments.frames, step)?)?;
    save("smooth.png", &engine.smooth(&mut world, arguments.frames, step)?)?;
    save("characters.png", &engine.characters(SIZE)?)?;
    progress.finish_and_clear();
    print_line!("{} objects; in the middle of the first picture is {}", arguments.objects, picking::describe(object));
    print_line!("the pictures are written to {}", path_text(&arguments.out));
    Ok(())
}

fn save(path: PathBuf, picture: &Picture) -> Result<(), OutputError> {
    PictureFile::new(path)?.write([picture.width, picture.height], &picture.bytes)
}
