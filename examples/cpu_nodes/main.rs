//! Work of an engine's own in the frame's graph: the jobs of each frame make what it draws, and what it does not.
//!
//!     cargo run --release --example cpu_nodes -- --out pictures
//!     cargo run --release --example cpu_nodes -- --backend noop --frames 300 --explain --timeline trace.json
//!
//! Nothing of this world is kept from frame to frame but its assets and the positions of its objects:
//!
//! - `walkers.rs` moves a crowd, before the frame reads where its objects are;
//! - `terrain.rs` makes the land around the camera, and `creature.rs` the skin of a creature as a Catmull-Clark surface
//!   (`subdivision.rs`): the whole pipeline draws both, with shadows;
//! - `sparks.rs` moves particles, which the frame draws as often as the node says;
//! - `mirror.rs` traces what a mirror shows, for a few pixels, from what other nodes make in the same frame (`bvh.rs`);
//! - `sound.rs` mixes sound beside all that.

mod arguments;
mod bvh;
mod colors;
mod creature;
mod ground;
mod mirror;
mod random;
mod sound;
mod sparks;
mod subdivision;
mod terrain;
mod walkers;
mod world;

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::Renderer;
use drawloom::backend::{Picture, WgpuBackend};
use drawloom::process::{Deferred, ToneMapping, targets};
use drawloom::report::{FrameReport, SchedulerCosts, write_chrome_trace};
use drawloom::task::Scheduler;
use drawloom::timeline::Log;
use drawloom_output::{OutputError, PictureFile, create_folder, path_text, print_line};
use drawloom_testing::adapter;

use arguments::{Arguments, BackendName};
use mirror::DrawMirror;
use sparks::DrawSparks;
use world::World;

/// Width and height of the pictures in pixels.
const PICTURE: [u32; 2] = [960, 540];

/// The frames at the end that the timeline has.
const RECORDED_FRAMES: u32 = 30;

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_ansi(false)
        .with_writer(drawloom_output::diagnostics)
        .without_time()
        .with_target(false)
        .init();
    drawloom_output::exit_code(run(&drawloom_output::parse_arguments::<Arguments>()))
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    arguments.out.as_deref().map_or(Ok(()), create_folder)?;
    let builder = Scheduler::builder().timeline_capacity(1 << 18);
    let scheduler = Arc::new(match arguments.workers {
        Some(workers) => builder.workers(workers.get()).build()?,
        None => builder.build()?,
    });
    let (device, queue) = match arguments.backend {
        BackendName::Wgpu => adapter::device()?,
        BackendName::Noop => adapter::noop_device()?,
    };
    let (mut renderer, submitter) = Renderer::builder(WgpuBackend::new(device, queue)?)
        .pipeline(Deferred::new().post(ToneMapping::new(1.0)))
        .process(DrawMirror)
        .process(DrawSparks)
        .build(Arc::clone(&scheduler))?;
    let mut world = World::new()?;
    let (mut times, mut generated) = (Vec::new(), 0);
    for frame in 0..arguments.frames {
        if frame == arguments.frames.saturating_sub(RECORDED_FRAMES) {
            scheduler.timeline().start();
        }
        let begin = Instant::now();
        let recorded = world.record(&mut renderer, frame as f32 / 30.0)?;
        times.push(begin.elapsed());
        generated = recorded.statistics().generated;
        let submission = submitter.submit(recorded)?.submission;
        submission.wait()?;
        let is_shown = [0, arguments.frames / 2, arguments.frames - 1].contains(&frame);
        if let Some(folder) = arguments.out.as_ref().filter(|_| is_shown && arguments.backend == BackendName::Wgpu) {
            save(folder.join(format!("frame_{frame}.png")), &submission.read(0, targets::PICTURE)?)?;
        }
    }
    times.sort_unstable();
    print_line!(
        "{} frames on {} workers: recorded in {:.2} ms (median); the last one had {} walkers, {} sparks and {} KiB that nodes made, and a sound \
         of up to {:.2}",
        arguments.frames,
        scheduler.workers(),
        milliseconds(times[times.len() / 2]),
        walkers::COUNT,
        world.sparks(),
        generated >> 10,
        world.sound.peak(),
    );
    explain(arguments, &scheduler.timeline().take())
}

/// Writes the trace, and explains the last frame, if that is asked for.
fn explain(arguments: &Arguments, log: &Log) -> Result<(), Box<dyn Error>> {
    if let Some(file) = &arguments.timeline {
        file.write(|writer| write_chrome_trace(log, writer))?;
        print_line!("{} written", path_text(file.path()));
    }
    if let Some(frame) = log.frames.last().filter(|_| arguments.explain) {
        print_line!("\n{}", FrameReport::new(log, frame.number, &SchedulerCosts::measure()?)?);
    }
    Ok(())
}

fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1000.0
}

fn save(path: PathBuf, picture: &Picture) -> Result<(), OutputError> {
    let file = PictureFile::new(path)?;
    file.write([picture.width, picture.height], &picture.bytes)?;
    print_line!("{} written", path_text(file.path()));
    Ok(())
}
