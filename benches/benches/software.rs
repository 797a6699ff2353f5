//! What a second worker gains where the processor draws.
//!
//!     cargo bench -p drawloom-benches --bench software
//!     cargo bench -p drawloom-benches --bench software -- --quick
//!
//! The project's own scene, drawn in f32 by the software backend on one worker and on two. They take turns,
//! in an order drawn anew each round; a turn is one frame, from the scene's hand-over to the return of submit, by which time it
//! is drawn. Medians are compared, and both must have the same bytes. What was measured is written to
//! `drawloom/software.json` in the target folder too.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use clap::Parser;
use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::demo;
use drawloom::process::{Deferred, Fxaa, ToneMapping};
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::{Renderer, Submitter};
use drawloom_benches::quick::Quick;
use drawloom_benches::results;
use drawloom_benches::stopwatch::{WARM_UP, median, timed_frame};
use drawloom_benches::table::Table;
use drawloom_testing::random::Random;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

/// A frame of one scene and size.
#[derive(Serialize)]
struct Row {
    scene: &'static str,
    size: [u32; 2],
    rounds: usize,
    one_worker_ms: f64,
    two_workers_ms: f64,
    /// How many times as fast two are.
    ratio: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let quick = Quick::parse().is_quick();
    let (rounds, sizes): (usize, &[[u32; 2]]) = if quick { (3, &[[96, 54]]) } else { (15, &[[480, 270], [960, 540]]) };
    let maps = ShadowMaps::default();
    let maps = if quick { ShadowMaps { side: 64, ..maps } } else { maps };
    let progress = ProgressBar::new((sizes.len() * (rounds + WARM_UP)) as u64);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} rounds, {eta} left")?);
    let rows: Result<Vec<_>, _> =
        sizes.iter().map(|&size| measure(demo::colonnade()?, size, maps, rounds, &progress)).collect();
    progress.finish_and_clear();
    let rows = rows?;

    let mut table = Table::new(&["scene", "picture", "1 worker, ms", "2 workers, ms", "times as fast"]);
    for Row { scene, size: [width, height], one_worker_ms, two_workers_ms, ratio, .. } in &rows {
        let figures = [one_worker_ms, two_workers_ms].map(|milliseconds| format!("{milliseconds:.1}"));
        let [one, two] = figures;
        table.line([(*scene).to_owned(), format!("{width} × {height}"), one, two, format!("{ratio:.2}")]);
    }
    table.print();
    // A trial must not take the place of what was measured.
    if !quick {
        results::write_json("software.json", &rows)?;
    }
    Ok(())
}

/// A renderer on the software backend, and how long its frames took.
struct Setting {
    renderer: Renderer<SoftwareBackend>,
    submitter: Submitter<SoftwareBackend>,
    times: Vec<Duration>,
}

impl Setting {
    fn new(workers: usize, maps: ShadowMaps) -> Result<Self, Box<dyn Error>> {
        let scheduler = Arc::new(Scheduler::new(workers)?);
        let backend = SoftwareBackend::new(Arc::clone(&scheduler));
        let deferred = Deferred::new().shadow_maps(Some(maps)).post(ToneMapping::default()).post(Fxaa::default());
        let (renderer, submitter) = Renderer::builder(backend).deferred(deferred).build(scheduler)?;
        Ok(Self { renderer, submitter, times: Vec::new() })
    }

    fn turn(&mut self, scene: &Scene) -> Result<Picture, Box<dyn Error>> {
        let (submitted, time) = timed_frame(&mut self.renderer, &self.submitter, scene.as_scene_ref(), |_| Ok(()))?;
        self.times.push(time.processor);
        Ok(submitted.submission.read(0, "picture")?)
    }
}

fn measure(
    mut scene: Scene,
    size: [u32; 2],
    maps: ShadowMaps,
    rounds: usize,
    progress: &ProgressBar,
) -> Result<Row, Box<dyn Error>> {
    scene.cameras.iter_mut().for_each(|camera| camera.size = size);
    let mut settings = [Setting::new(1, maps)?, Setting::new(2, maps)?];
    let (mut random, mut expected) = (Random::new(), None);
    for _ in 0..rounds + WARM_UP {
        for setting in random.order(settings.len()) {
            let picture = settings[setting].turn(&scene)?;
            if *expected.get_or_insert_with(|| picture.clone()) != picture {
                return Err("the number of workers changes the picture".into());
            }
        }
        progress.inc(1);
    }
    let [one, two] = settings.map(|setting| median(setting.times.into_iter().skip(WARM_UP)).as_secs_f64() * 1e3);
    Ok(Row { scene: "colonnade", size, rounds, one_worker_ms: one, two_workers_ms: two, ratio: one / two })
}
