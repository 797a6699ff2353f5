//! The speed-up of a second worker on the software backend.
//!
//!     cargo bench -p drawloom-benches --bench software
//!     cargo bench -p drawloom-benches --bench software -- --quick
//!
//! The software backend draws the project's own scene in f32, on one worker and on two, interleaved. Measured is one
//! frame, from the hand-over of the scene to the return of submit, by which time it is drawn. The table compares
//! medians; both pictures must have the same bytes. `target/drawloom/software.json` has the same.

use std::error::Error;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::process::{Deferred, Fxaa, ToneMapping, targets};
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::{Renderer, Submitter};
use drawloom_benches::arguments::ExtentArguments;
use drawloom_benches::harness::{Harness, Rounds, WARM_UP, progress_bar};
use drawloom_benches::results;
use drawloom_benches::statistics::median_duration;
use drawloom_benches::stopwatch::timed_frame;
use drawloom_benches::table::Table;
use drawloom_testing::demo;
use indicatif::ProgressBar;
use serde::Serialize;

/// A frame of one scene and size.
#[derive(Serialize)]
struct Row {
    scene: &'static str,
    size: [u32; 2],
    rounds: usize,
    one_worker_ms: f64,
    two_workers_ms: f64,
    /// Speed-up of two workers over one.
    ratio: f64,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let quick = drawloom_output::parse_arguments::<ExtentArguments>().is_quick();
    let (rounds, sizes): (_, &[[u32; 2]]) = match quick {
        true => (Rounds { warm_up: 0, measured: 1 }, &[[96, 54]]),
        false => (Rounds { warm_up: WARM_UP, measured: 15 }, &[[480, 270], [960, 540]]),
    };
    let maps = ShadowMaps::default();
    let maps = if quick { ShadowMaps { side: 64, ..maps } } else { maps };
    let progress = progress_bar("frames");
    let rows: Result<Vec<_>, _> =
        sizes.iter().map(|&size| measure(demo::colonnade()?, size, maps, rounds, &progress)).collect();
    progress.finish_and_clear();
    let rows = rows?;

    let mut table = Table::new(&["scene", "picture", "1 worker, ms", "2 workers, ms", "times as fast"]);
    for Row { scene, size: [width, height], one_worker_ms, two_workers_ms, ratio, .. } in &rows {
        let figures = [one_worker_ms, two_workers_ms].map(|milliseconds| format!("{milliseconds:.1}"));
        let [one, two] = figures;
        table.row([(*scene).to_owned(), format!("{width} × {height}"), one, two, format!("{ratio:.2}")]);
    }
    table.print();
    if !quick {
        results::write_json("software.json", &rows)?;
    }
    Ok(())
}

/// A renderer on the software backend.
struct Runner {
    renderer: Renderer<SoftwareBackend>,
    submitter: Submitter<SoftwareBackend>,
}

impl Runner {
    fn new(workers: usize, maps: ShadowMaps) -> Result<Self, Box<dyn Error>> {
        let scheduler = Arc::new(Scheduler::new(workers)?);
        let backend = SoftwareBackend::new(Arc::clone(&scheduler));
        let deferred = Deferred::new().shadow_maps(Some(maps)).post(ToneMapping::default()).post(Fxaa::default());
        let (renderer, submitter) = Renderer::builder(backend).pipeline(deferred).build(scheduler)?;
        Ok(Self { renderer, submitter })
    }

    fn frame(&mut self, scene: &Scene) -> Result<(Picture, Duration), Box<dyn Error>> {
        let (submitted, time) = timed_frame(&mut self.renderer, &self.submitter, scene.as_scene_ref(), |_| Ok(()))?;
        Ok((submitted.submission.read(0, targets::PICTURE)?, time.cpu))
    }
}

fn measure(
    mut scene: Scene,
    size: [u32; 2],
    maps: ShadowMaps,
    rounds: Rounds,
    progress: &ProgressBar,
) -> Result<Row, Box<dyn Error>> {
    scene.cameras.iter_mut().for_each(|camera| camera.size = size);
    let mut runners = [Runner::new(1, maps)?, Runner::new(2, maps)?];
    let mut expected = None;
    let times = Harness::new(rounds, progress).measure(&mut runners, |runner, _round| {
        let (picture, time) = runner.frame(&scene)?;
        if *expected.get_or_insert_with(|| picture.clone()) != picture {
            return Err(Box::<dyn Error>::from("the number of workers changes the picture"));
        }
        Ok(time)
    })?;
    let milliseconds = |times: &Vec<Duration>| median_duration(times.iter().copied()).as_secs_f64() * 1e3;
    let (one, two) = (milliseconds(&times[0]), milliseconds(&times[1]));
    Ok(Row {
        scene: "colonnade",
        size,
        rounds: rounds.measured,
        one_worker_ms: one,
        two_workers_ms: two,
        ratio: one / two,
    })
}
