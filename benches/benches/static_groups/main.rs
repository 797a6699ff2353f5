//! What static groups save: frames of many objects that stand still, and some that move.
//!
//!     cargo bench -p drawloom-benches --bench static groups
//!     cargo bench -p drawloom-benches --bench static groups -- --quick
//!
//! Measured is one frame on wgpu's `noop` device and on one worker, from the hand-over of the scene to the return of
//! submit. Blocks of boxes of 16 meshes stand on a plain, and 1,000 boxes move in each frame. One process draws them.
//! The contenders are drawn in turn, in an order of its own in each round:
//!
//! - *static groups*: each block is a static group;
//! - *without*: the same scene without static groups. Its renderer keeps what it can, and caches bundles where it
//!   measures that this is cheaper;
//! - *by hand*: a loop of wgpu calls that executes the ready bundles of the blocks in sight. It tests no other object,
//!   and draws all that move.
//!
//! `target/drawloom/static_groups.json` has the same.

mod by_hand;
mod world;

use std::error::Error;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::WgpuBackend;
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use drawloom_benches::arguments::ExtentArguments;
use drawloom_benches::harness::{Harness, Rounds, progress_bar};
use drawloom_benches::plain::Plain;
use drawloom_benches::results;
use drawloom_benches::statistics::median_duration;
use drawloom_benches::stopwatch::timed_frame;
use drawloom_benches::table::Table;
use drawloom_testing::adapter;
use serde::Serialize;

use by_hand::ByHand;
use world::{Cameras, World};

#[derive(Serialize)]
struct Row {
    cameras: &'static str,
    objects: usize,
    static_groups: usize,
    /// Objects that all views draw, with static groups and without, in the last frame.
    drawn: [usize; 2],
    /// Draws of all views, likewise.
    draws: [usize; 2],
    /// With static groups, without, and by hand.
    microseconds: [f64; 3],
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: ExtentArguments = drawloom_output::parse_arguments();
    // Trials of recording strategies are over after some hundred frames.
    let (rounds, sizes): (_, &[(usize, usize)]) = if arguments.is_quick() {
        (Rounds { warm_up: 4, measured: 3 }, &[(4, 100)])
    } else {
        (Rounds { warm_up: 200, measured: 801 }, &[(40, 250), (400, 250), (100, 1_000), (25, 4_000)])
    };
    let progress = progress_bar("frames");
    let mut rows = Vec::new();
    for &(blocks, in_block) in sizes {
        for cameras in Cameras::ALL {
            let mut contenders = [
                Contender::Drawloom(Box::new(Runner::new(cameras, blocks, in_block, true)?)),
                Contender::Drawloom(Box::new(Runner::new(cameras, blocks, in_block, false)?)),
                Contender::ByHand(Box::new(ByHand::new(World::new(cameras, blocks, in_block)?)?)),
            ];
            let times =
                Harness::new(rounds, &progress).measure(&mut contenders, |contender, _round| contender.frame())?;
            let [with, without] = [0, 1].map(|index| match &contenders[index] {
                Contender::Drawloom(runner) => [runner.drawn, runner.draws],
                Contender::ByHand(_) => [0; 2],
            });
            let microseconds = [0, 1, 2].map(|index| median_duration(times[index].iter().copied()).as_secs_f64() * 1e6);
            rows.push(Row {
                cameras: cameras.name(),
                objects: blocks * in_block + World::MOVING,
                static_groups: blocks,
                drawn: [with[0], without[0]],
                draws: [with[1], without[1]],
                microseconds,
            });
        }
    }
    progress.finish_and_clear();

    let titles = [
        "cameras",
        "objects",
        "static groups",
        "drawn",
        "draws",
        "static groups, µs",
        "without, µs",
        "by hand, µs",
        "without ÷ static groups",
    ];
    let mut table = Table::new(&titles);
    for Row { cameras, objects, static_groups, drawn, draws, microseconds: [with, without, by_hand] } in &rows {
        table.row([
            (*cameras).to_owned(),
            objects.to_string(),
            static_groups.to_string(),
            format!("{} and {}", drawn[0], drawn[1]),
            format!("{} and {}", draws[0], draws[1]),
            format!("{with:.1}"),
            format!("{without:.1}"),
            format!("{by_hand:.1}"),
            format!("{:.2}", without / with),
        ]);
    }
    table.print();

    let counts = if arguments.is_quick() { (2, &sizes[..1]) } else { (100, &sizes[1..]) };
    let changes = counts.1.iter().map(|&(blocks, in_block)| measure_changes(blocks, in_block, counts.0));
    let changes = changes.collect::<Result<Vec<_>, _>>()?;
    let mut table = Table::new(&[
        "static groups",
        "of objects",
        "steady, µs",
        "a box changes, µs",
        "recorded, µs",
        "executed again, µs",
    ]);
    for Changes { static_groups, in_static_group, microseconds } in &changes {
        let [steady, changed, recorded, executed] = microseconds.map(|time| format!("{time:.1}"));
        table.row([static_groups.to_string(), in_static_group.to_string(), steady, changed, recorded, executed]);
    }
    table.print();
    if !arguments.is_quick() {
        results::write_json("static_groups.json", &(rows, changes))?;
    }
    Ok(())
}

/// What it costs that a box in a static group changes.
#[derive(Serialize)]
struct Changes {
    static_groups: usize,
    in_static_group: usize,
    /// Of a steady frame, of the one with the change, and of the two that follow.
    microseconds: [f64; 4],
}

/// Medians over changes of a box in a static group, another one each time, while a camera sees all.
fn measure_changes(blocks: usize, in_block: usize, changes: usize) -> Result<Changes, Box<dyn Error>> {
    let mut runner = Runner::new(Cameras::All, blocks, in_block, true)?;
    for _ in 0..200 {
        runner.frame()?;
    }
    let mut times: [Vec<Duration>; 4] = Default::default();
    for change in 0..changes {
        for _ in 0..8 {
            runner.frame()?;
        }
        times[0].push(runner.frame()?);
        runner.world.change_next(change % blocks * in_block);
        for times in &mut times[1..] {
            times.push(runner.frame()?);
        }
    }
    let microseconds = times.map(|times| median_duration(times).as_secs_f64() * 1e6);
    Ok(Changes { static_groups: blocks, in_static_group: in_block, microseconds })
}

enum Contender {
    Drawloom(Box<Runner>),
    ByHand(Box<ByHand>),
}

impl Contender {
    fn frame(&mut self) -> Result<Duration, Box<dyn Error>> {
        match self {
            Self::Drawloom(runner) => runner.frame(),
            Self::ByHand(loop_by_hand) => loop_by_hand.frame(),
        }
    }
}

/// A renderer and its world.
struct Runner {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    world: World,
    drawn: usize,
    draws: usize,
}

impl Runner {
    fn new(cameras: Cameras, blocks: usize, in_block: usize, has_static_groups: bool) -> Result<Self, Box<dyn Error>> {
        let (device, queue) = adapter::noop_device()?;
        let builder = Renderer::builder(WgpuBackend::new(device, queue)?).process(Plain).output("plain");
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(1)?))?;
        let mut world = World::new(cameras, blocks, in_block)?;
        if !has_static_groups {
            world.scene.static_groups.clear();
        }
        Ok(Self { renderer, submitter, world, drawn: 0, draws: 0 })
    }

    fn frame(&mut self) -> Result<Duration, Box<dyn Error>> {
        self.world.step();
        let scene = self.world.as_scene_ref();
        let (submitted, time) = timed_frame(&mut self.renderer, &self.submitter, scene, |_| Ok(()))?;
        let views = &submitted.statistics.views;
        self.drawn = views.iter().map(|view| view.commands).sum();
        self.draws = views.iter().map(|view| view.batches).sum();
        Ok(time.cpu)
    }
}
