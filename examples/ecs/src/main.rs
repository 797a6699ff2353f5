//! The same entities in two entity-component systems, `hecs` and `bevy_ecs`, drawn from their own columns.
//!
//!     cargo run --release -p ecs
//!
//! Where one archetype holds all entities, Drawloom reads its columns in place. Where several do, what changed is
//! gathered: see `scene_columns.rs`. Entities that the system moves to other rows, as when one is despawned, are found
//! by their numbers. Prints medians of what each costs.

mod bevy_world;
mod components;
mod engine_world;
mod graphics;
mod hecs_world;
mod measurement;
mod population;
mod scene_columns;
#[cfg(test)]
mod tests;

use std::error::Error;
use std::process::ExitCode;

use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Parser, ValueEnum};
use drawloom_output::{PictureFile, path_text, print_line};
use drawloom_testing::adapter;

use bevy_world::BevyWorld;
use graphics::Graphics;
use hecs_world::HecsWorld;
use measurement::measure;
use population::Population;

/// The same entities in two entity-component systems, drawn from their own columns.
#[derive(Debug, Parser)]
struct Options {
    /// How many entities there are.
    #[arg(long, default_value_t = 20_000, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    entities: u32,

    /// How many entities are despawned, and as many spawned, in a frame: of 60 a second, for example.
    #[arg(long, default_value_t = 167, value_name = "N")]
    replaced: u32,

    /// How many frames are measured.
    #[arg(long, default_value_t = 300, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,

    /// Where frames are drawn: `noop` is wgpu without a device, which shows what the CPU does.
    #[arg(long, default_value = "noop")]
    backend: BackendName,

    /// Writes the last picture, of the adapter.
    #[arg(long, value_name = "FILE.png", value_parser = PathBufValueParser::new().try_map(PictureFile::new))]
    picture: Option<PictureFile>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum BackendName {
    Noop,
    Adapter,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run(&drawloom_output::parse_arguments::<Options>()))
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    let (device, queue) = match options.backend {
        BackendName::Noop => adapter::noop_device()?,
        BackendName::Adapter => adapter::device()?,
    };
    let mut graphics = Graphics::new(device, queue)?;
    print_line!(
        "{} entities on {}, {} workers",
        options.entities,
        graphics.device_name(),
        graphics.scheduler.workers()
    );
    print_line!(
        "µs in a frame: update, replace, gather (or lend), record, submit; bytes copied; objects reported as changed"
    );
    for population in Population::all(options.entities) {
        for (name, replaced) in [("", 0), (", replaced", options.replaced.min(options.entities))] {
            print_line!("{}{name}", population.name);
            let hecs = measure(&mut graphics, &mut HecsWorld::new(population), population, replaced, options.frames)?;
            print_line!("  hecs      {hecs}");
            let bevy = measure(&mut graphics, &mut BevyWorld::new(population), population, replaced, options.frames)?;
            print_line!("  bevy_ecs  {bevy}");
        }
    }
    if let Some(file) = &options.picture {
        let picture = graphics.picture()?;
        file.write([picture.width, picture.height], &picture.bytes)?;
        print_line!("{} written", path_text(file.path()));
    }
    Ok(())
}
