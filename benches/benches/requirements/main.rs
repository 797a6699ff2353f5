//! What a change of what the scene requires costs: the longest frames when lights, glass and a mirror come and go.
//!
//!     cargo bench -p drawloom-benches --bench requirements
//!     cargo bench -p drawloom-benches --bench requirements -- --quick --backend noop
//!
//! Boxes, panes, and a light of every class. Fifty times a class of lights, the glass or the mirror comes or goes, in a
//! random order, and then twenty frames are drawn without a change. All cameras move in every frame. A frame is timed
//! from the hand-over of the scene to the return of submit; on an adapter until the device is idle. *At rest* are the
//! frames of one more contender in which nothing comes or goes: what is beyond the ratio of their longest frame to
//! their median is due to the changes. Drivers keep what they have compiled on disk, so that only the first run on a
//! machine shows what they take; Mesa's compile in each run with `MESA_SHADER_CACHE_DISABLE=true`.
//!
//! The second table has the colonnade drawn by a pipeline that keeps all of its processes, and by one that has what the
//! scene requires. `target/drawloom/requirements.json` has the same. The last line names the targets that were missed.

mod unneeded;
mod world;

use std::error::Error;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Parser;
use drawloom::backend::WgpuBackend;
use drawloom::process::Deferred;
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter, WarmUp};
use drawloom_benches::arguments::BackendArguments;
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::progress_bar;
use drawloom_benches::mirror::Mirror;
use drawloom_benches::results;
use drawloom_benches::statistics::median_duration;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_testing::demo;
use drawloom_testing::random::Random;
use drawloom_testing::scenes::everything::everything;
use indicatif::ProgressBar;
use serde::Serialize;

use world::World;

/// The changes of what the scene requires.
const CHANGES: usize = 50;
/// The frames from one change to the next.
const FRAMES_PER_CHANGE: usize = 20;
/// The frames before the first change.
const WARM_UP: usize = 60;

#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    backend: BackendArguments,
}

/// How a renderer prepares for what scenes may require.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Preparation {
    /// Everything is made in the first frame that needs it.
    None,
    /// [`Renderer::prepare_pipelines`] is called once, before the first frame.
    Prepared,
    /// The frames of a [`WarmUp`] are drawn before the first one.
    WarmedUp,
    /// As `WarmedUp`, and nothing comes or goes.
    AtRest,
}

/// The frames of one renderer.
#[derive(Serialize)]
struct Row {
    backend: BackendName,
    boxes: usize,
    preparation: Preparation,
    median_us: f64,
    longest_us: f64,
    /// The longest frame divided by the median.
    longest_by_median: f64,
    /// The median over the changes of the first frame after one.
    changed_us: f64,
    /// The largest quotient of a frame and the median of the frames until the next change.
    longest_by_own_median: f64,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments = drawloom_output::parse_arguments::<Arguments>().backend;
    let quick = arguments.is_quick();
    let counts = if quick { [2, 1] } else { [WARM_UP, CHANGES] };
    let progress = progress_bar("frames");
    let mut rows = Vec::new();
    let backends = arguments.backends()?;
    for &backend in &backends {
        // The processor draws the pixels of software drivers.
        let (numbers, size): (&[usize], _) = match backend {
            _ if quick => (&[100], [32, 32]),
            BackendName::Noop => (&[10_000, 100_000], [480, 270]),
            BackendName::Adapter => (&[1_000], [160, 90]),
        };
        for boxes in numbers {
            rows.extend(measure(backend, counts, *boxes, size, &progress)?);
        }
    }
    let mut unneeded = Vec::new();
    for backend in backends {
        let (rounds, size) = if quick { (2, [32, 32]) } else { (101, [480, 270]) };
        let scene = || if quick { Ok(everything()) } else { demo::colonnade() };
        unneeded.extend(unneeded::measure(backend, scene, rounds, size, &progress)?);
    }
    progress.finish_and_clear();

    let headings =
        ["backend", "boxes", "preparation", "median, µs", "longest, µs", "ratio", "ratio to own", "after a change, µs"];
    let mut table = Table::new(&headings);
    for row in &rows {
        table.row([
            row.backend.name().to_owned(),
            row.boxes.to_string(),
            format!("{:?}", row.preparation),
            format!("{:.0}", row.median_us),
            format!("{:.0}", row.longest_us),
            format!("{:.2}", row.longest_by_median),
            format!("{:.2}", row.longest_by_own_median),
            format!("{:.0}", row.changed_us),
        ]);
    }
    table.print();
    unneeded::print(&unneeded);
    let targets = targets(&rows);
    targets.print("Targets and results after a warm-up");
    if !quick {
        results::write_json("requirements.json", &(rows, unneeded))?;
    }
    targets.print_missed();
    Ok(())
}

/// The targets: after a warm-up, no frame takes longer than two of those around it.
fn targets(rows: &[Row]) -> Targets {
    let mut targets = Targets::new();
    for row in rows.iter().filter(|row| row.preparation == Preparation::WarmedUp) {
        let figure = format!("{}, {} boxes, a frame ÷ its own median", row.backend.name(), row.boxes);
        targets.at_most(figure, 2.0, row.longest_by_own_median);
    }
    targets
}

fn measure(
    backend: BackendName,
    [warm_up, changes]: [usize; 2],
    boxes: usize,
    size: [u32; 2],
    progress: &ProgressBar,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let preparations = [Preparation::None, Preparation::Prepared, Preparation::WarmedUp, Preparation::AtRest];
    let mut runners = Vec::new();
    // One for all, because the workers of others would wait beside it.
    let scheduler = Arc::new(Scheduler::new(2)?);
    for preparation in preparations {
        runners.push(Runner::new((backend, &scheduler), preparation, boxes, size)?);
    }
    progress.inc_length(((warm_up + changes * FRAMES_PER_CHANGE) * runners.len()) as u64);
    let mut times = vec![Vec::new(); runners.len()];
    for _ in 0..warm_up {
        for runner in &mut runners {
            runner.frame()?;
            progress.inc(1);
        }
    }
    let mut random = Random::new();
    for _ in 0..changes {
        let feature = random.below(World::FEATURES);
        for runner in &mut runners {
            if runner.preparation != Preparation::AtRest {
                runner.world.toggle(feature)?;
            }
        }
        for _ in 0..FRAMES_PER_CHANGE {
            for (runner, times) in runners.iter_mut().zip(&mut times) {
                times.push(runner.frame()?);
                progress.inc(1);
            }
        }
    }
    let rows = preparations.iter().zip(&times).map(|(preparation, times)| row((backend, boxes), *preparation, times));
    Ok(rows.collect())
}

fn row((backend, boxes): (BackendName, usize), preparation: Preparation, times: &[Duration]) -> Row {
    let microseconds = |time: Duration| time.as_secs_f64() * 1e6;
    let longest = |times: &[Duration]| microseconds(times.iter().copied().max().unwrap_or_default());
    let median = |times: &[Duration]| microseconds(median_duration(times.iter().copied()));
    let intervals = || times.chunks(FRAMES_PER_CHANGE);
    let first = intervals().filter_map(|interval| interval.first().copied());
    Row {
        backend,
        boxes,
        preparation,
        median_us: median(times),
        longest_us: longest(times),
        longest_by_median: longest(times) / median(times),
        changed_us: microseconds(median_duration(first)),
        longest_by_own_median: intervals().map(|frames| longest(frames) / median(frames)).fold(0.0, f64::max),
    }
}

struct Runner {
    preparation: Preparation,
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    world: World,
    waits: bool,
}

impl Runner {
    fn new(
        (backend, scheduler): (BackendName, &Arc<Scheduler>),
        preparation: Preparation,
        boxes: usize,
        size: [u32; 2],
    ) -> Result<Self, Box<dyn Error>> {
        let builder = Renderer::builder(backend.open()?).pipeline(Deferred::to_picture()).process(Mirror);
        let (mut renderer, submitter) = builder.build(Arc::clone(scheduler))?;
        let mut world = World::new(boxes, size)?;
        let waits = backend == BackendName::Adapter;
        match preparation {
            Preparation::None => {}
            Preparation::Prepared => renderer.prepare_pipelines(world.frame())?,
            Preparation::WarmedUp | Preparation::AtRest => {
                let mut warm_up = WarmUp::new(world.frame());
                while let Some(frame) = warm_up.record_next(&mut renderer)? {
                    let submitted = submitter.submit(frame)?;
                    if waits {
                        submitted.submission.wait()?;
                    }
                }
            }
        }
        Ok(Self { preparation, renderer, submitter, world, waits })
    }

    fn frame(&mut self) -> Result<Duration, Box<dyn Error>> {
        let start = Instant::now();
        let submitted = self.submitter.submit(self.renderer.record(self.world.frame())?)?;
        if self.waits {
            submitted.submission.wait()?;
        }
        Ok(start.elapsed())
    }
}
