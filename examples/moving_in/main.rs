//! An engine with pipelines, bind groups and draw calls of its own moves to Drawloom.
//!
//!     cargo run --release --example moving_in
//!     cargo run --release --example moving_in -- --objects 40000 --workers 8 --out moving_in.png
//!     cargo run --release --example moving_in -- --backend noop
//!
//! [`engine`] is a small engine as people write them with plain wgpu, and [`on_drawloom`] is the same engine on Drawloom:
//! not one shader, pipeline or bind group differs. The program draws a frame with both, and ends with exit status 1 if
//! their bytes differ. Then it measures how long a frame takes on this thread, from the engine's arrays to submission,
//! and prints medians. In the column *moving* the camera and every eighth object move; in *at rest* nothing does. What
//! the engine writes into its buffers itself is not measured, as it is the same in both.
//!
//! With `--backend noop` wgpu has no device, so that only the processor's work counts, and there are no bytes to
//! compare.

mod content;
mod engine;
mod on_drawloom;

use std::error::Error;
use std::num::NonZeroUsize;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Parser, ValueEnum};
use drawloom::task::Scheduler;
use drawloom::wgpu;
use drawloom_output::{PictureFile, path_text, print_line};
use drawloom_testing::adapter;

use engine::{Engine, MAIN, SIZES};
use on_drawloom::EngineOnDrawloom;

/// Frames before those that are measured: in them Drawloom finds out how it records best.
const WARM_UP: u32 = 60;

/// Draws and measures a plain engine and the same engine on Drawloom.
#[derive(Parser)]
#[command(name = "moving_in")]
struct Arguments {
    /// About how many objects the engine has.
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    objects: u32,

    /// The frames that are measured, for each row and column.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    frames: u32,

    /// Threads that run jobs in the last row, the calling thread included. Default: the number of cores.
    #[arg(long, value_name = "N")]
    workers: Option<NonZeroUsize>,

    /// `adapter` draws on the machine's adapter; `noop` is wgpu without a device.
    #[arg(long, value_enum, default_value = "adapter")]
    backend: BackendName,

    /// Where the picture goes, a .png, .jpg, .tga or .bmp.
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(PictureFile::new))]
    out: Option<PictureFile>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum BackendName {
    Adapter,
    Noop,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run(&drawloom_output::parse_arguments::<Arguments>()))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    if arguments.backend == BackendName::Noop && arguments.out.is_some() {
        return Err("--out: with --backend noop there is no picture".into());
    }
    let (device, queue) = match arguments.backend {
        BackendName::Adapter => adapter::device()?,
        BackendName::Noop => adapter::noop_device()?,
    };
    let engine = || Engine::new(device.clone(), queue.clone(), arguments.objects as usize);
    if arguments.backend == BackendName::Adapter {
        compare(engine(), engine(), arguments.out.as_ref())?;
    }

    let cores = std::thread::available_parallelism()?;
    let mut workers = vec![1, 2, arguments.workers.unwrap_or(cores).get()];
    workers.sort_unstable();
    workers.dedup();
    print_line!("{} objects, 3 views, {}", engine().objects.len(), device.adapter_info().name);
    print_line!("| µs a frame | moving | at rest |");
    print_line!("| --- | ---: | ---: |");
    let mut plain = engine();
    let draw = |plain: &mut Engine| {
        plain.draw();
        Ok(())
    };
    print_row("plain engine", measure(arguments.frames, &mut plain, |plain| plain, draw)?);
    for workers in workers {
        let mut moved = EngineOnDrawloom::new(engine(), Arc::new(Scheduler::new(workers)?))?;
        let times = measure(arguments.frames, &mut moved, |moved| &mut moved.engine, |moved| moved.draw())?;
        let noun = if workers == 1 { "worker" } else { "workers" };
        print_row(&format!("Drawloom, {workers} {noun}"), times);
    }
    Ok(())
}

/// Draws a frame with both.
///
/// # Errors
/// If their bytes differ.
fn compare(mut plain: Engine, moved: Engine, out: Option<&PictureFile>) -> Result<(), Box<dyn Error>> {
    plain.draw();
    let picture = plain.read_picture()?;
    let mut moved = EngineOnDrawloom::new(moved, Arc::new(Scheduler::with_available_parallelism()?))?;
    moved.draw()?;
    if let Some(file) = out {
        file.write_opaque(SIZES[MAIN], &picture)?;
        print_line!("{} written", path_text(file.path()));
    }
    let on_drawloom = moved.engine.read_picture()?;
    let differing = picture.iter().zip(&on_drawloom).filter(|(plain, moved)| plain != moved).count();
    if differing > 0 {
        return Err(format!("{differing} of {} bytes differ between the two", picture.len()).into());
    }
    print_line!("both draw the same {} bytes", picture.len());
    Ok(())
}

/// The median times of frames in which the world moves, and in which it does not.
fn measure<T>(
    frames: u32,
    drawn: &mut T,
    engine: impl Fn(&mut T) -> &mut Engine,
    draw: impl Fn(&mut T) -> Result<(), Box<dyn Error>>,
) -> Result<[Duration; 2], Box<dyn Error>> {
    let mut medians = [Duration::ZERO; 2];
    for (median, moves) in medians.iter_mut().zip([true, false]) {
        let mut times = Vec::new();
        for frame in 0..WARM_UP + frames {
            if moves {
                engine(drawn).update(frame as f32 * 0.02);
            }
            let began = Instant::now();
            draw(drawn)?;
            times.push(began.elapsed());
            engine(drawn).device.poll(wgpu::PollType::wait_indefinitely())?;
        }
        times.drain(..WARM_UP as usize);
        times.sort_unstable();
        *median = times[times.len() / 2];
    }
    Ok(medians)
}

fn print_row(name: &str, times: [Duration; 2]) {
    let [moving, at_rest] = times.map(|time| time.as_secs_f64() * 1e6);
    print_line!("| {name} | {moving:.0} | {at_rest:.0} |");
}
