//! From a lost device to the next picture.
//!
//!     cargo bench -p drawloom-benches --bench recovery
//!     cargo bench -p drawloom-benches --bench recovery -- --quick
//!
//! The colonnade is drawn on the machine's adapter, with two workers, until the device is destroyed and a frame says
//! that it is lost. Then another device takes its place. Times are medians: of opening the device, instance and adapter
//! included; of making the backend and replacing the old one; of preparing pipelines, if the engine does; of recording
//! the next frame, with everything that is uploaded and compiled for it; until it is submitted, in sum; and until it is
//! drawn, with the longest. For comparison there is the frame that was drawn last on the device before, from record
//! until it is drawn. Each picture is compared with that of the device before, byte by byte.
//! `target/drawloom/recovery.json` has the same. The last line names the targets that were missed.

use std::error::Error;
use std::panic;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::{BackendError, Picture, WgpuBackend};
use drawloom::process::{Deferred, ToneMapping, targets};
use drawloom::scene::{Changes, Scene, SceneRef};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use drawloom_benches::arguments::ExtentArguments;
use drawloom_benches::harness::progress_bar;
use drawloom_benches::results;
use drawloom_benches::statistics::median;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_output::print_line;
use drawloom_testing::adapter;
use drawloom_testing::demo;
use serde::Serialize;

/// Medians in milliseconds.
#[derive(Serialize)]
struct Row {
    size: [u32; 2],
    pipelines: &'static str,
    rounds: usize,
    open_ms: f64,
    replace_ms: f64,
    prepare_ms: f64,
    record_ms: f64,
    until_submitted_ms: f64,
    until_drawn_ms: f64,
    longest_ms: f64,
    usual_frame_ms: f64,
    same_bytes: bool,
}

/// What a recovery took, step by step.
struct Recovery {
    open: Duration,
    replace: Duration,
    prepare: Duration,
    record: Duration,
    submit: Duration,
    until_drawn: Duration,
    usual_frame: Duration,
    is_same: bool,
}

struct Engine {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    scene: Scene,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let quick = drawloom_output::parse_arguments::<ExtentArguments>().is_quick();
    let adapter = adapter::device().map(|(device, _)| device.adapter_info().name)?;
    let (rounds, sizes): (usize, &[[u32; 2]]) = if quick { (1, &[[96, 54]]) } else { (9, &[[480, 270], [960, 540]]) };
    let progress = progress_bar("rounds");
    progress.set_length((2 * rounds * sizes.len()) as u64);
    // wgpu tells of a lost device by panics, which the backend catches.
    panic::set_hook(Box::new(|_| {}));
    let mut rows = Vec::new();
    for &size in sizes {
        let mut engine = Engine::new(size)?;
        let mut recoveries = [Vec::new(), Vec::new()];
        for _ in 0..rounds {
            for (prepares, recoveries) in [false, true].into_iter().zip(&mut recoveries) {
                recoveries.push(engine.recover(prepares)?);
                progress.inc(1);
            }
        }
        rows.push(row(size, "in the frame", &recoveries[0]));
        rows.push(row(size, "prepared", &recoveries[1]));
    }
    drop(panic::take_hook());
    progress.finish_and_clear();

    print_line!("The colonnade on {adapter}, two workers, ms\n");
    let headings = [
        "picture",
        "pipelines",
        "open device",
        "replace",
        "prepare",
        "record",
        "until submitted",
        "until drawn",
        "longest",
        "usual frame",
        "same bytes",
    ];
    let mut table = Table::new(&headings);
    for row in &rows {
        let number = |ms: f64| format!("{ms:.1}");
        table.row([
            format!("{} × {}", row.size[0], row.size[1]),
            row.pipelines.to_owned(),
            number(row.open_ms),
            number(row.replace_ms),
            number(row.prepare_ms),
            number(row.record_ms),
            number(row.until_submitted_ms),
            number(row.until_drawn_ms),
            number(row.longest_ms),
            number(row.usual_frame_ms),
            if row.same_bytes { "yes" } else { "NO" }.to_owned(),
        ]);
    }
    table.print();
    let targets = targets(&rows);
    targets.print("Targets and results");
    if !quick {
        results::write_json("recovery.json", &rows)?;
    }
    targets.print_missed();
    Ok(())
}

/// The targets: the next picture comes within a second.
fn targets(rows: &[Row]) -> Targets {
    let mut targets = Targets::new();
    for Row { size: [width, height], pipelines, until_drawn_ms, .. } in rows {
        let figure = format!("{width} × {height}, pipelines {pipelines}, s until drawn");
        targets.at_most(figure, 1.0, until_drawn_ms / 1e3);
    }
    targets
}

fn row(size: [u32; 2], pipelines: &'static str, recoveries: &[Recovery]) -> Row {
    let milliseconds = |part: fn(&Recovery) -> Duration| -> Vec<f64> {
        recoveries.iter().map(|recovery| part(recovery).as_secs_f64() * 1e3).collect()
    };
    let median_of = |part| median(milliseconds(part));
    Row {
        size,
        pipelines,
        rounds: recoveries.len(),
        open_ms: median_of(|recovery| recovery.open),
        replace_ms: median_of(|recovery| recovery.replace),
        prepare_ms: median_of(|recovery| recovery.prepare),
        record_ms: median_of(|recovery| recovery.record),
        until_submitted_ms: median_of(Recovery::until_submitted),
        until_drawn_ms: median_of(|recovery| recovery.until_drawn),
        longest_ms: milliseconds(|recovery| recovery.until_drawn).into_iter().fold(0.0, f64::max),
        usual_frame_ms: median_of(|recovery| recovery.usual_frame),
        same_bytes: recoveries.iter().all(|recovery| recovery.is_same),
    }
}

impl Recovery {
    fn until_submitted(&self) -> Duration {
        self.open + self.replace + self.prepare + self.record + self.submit
    }
}

impl Engine {
    fn new(size: [u32; 2]) -> Result<Self, Box<dyn Error>> {
        let mut scene = demo::colonnade()?;
        scene.cameras.iter_mut().for_each(|camera| camera.size = size);
        let (device, queue) = adapter::device()?;
        let builder = Renderer::builder(WgpuBackend::new(device, queue)?);
        let deferred = Deferred::new().post(ToneMapping::default());
        let (renderer, submitter) = builder.pipeline(deferred).build(Arc::new(Scheduler::new(2)?))?;
        Ok(Self { renderer, submitter, scene })
    }

    /// Loses the device, and draws the next picture on another one.
    fn recover(&mut self, prepares: bool) -> Result<Recovery, Box<dyn Error>> {
        // Settled, as a running engine is.
        let mut expected = self.picture()?.0;
        let mut usual_frame = Duration::ZERO;
        for _ in 0..3 {
            (expected, usual_frame) = self.picture()?;
        }
        self.renderer.backend().device().destroy();
        match self.renderer.record(self.scene.as_scene_ref()).err().as_ref().and_then(|error| error.backend_error()) {
            Some(BackendError::DeviceLost { .. }) => {}
            other => return Err(format!("a lost device: {other:?}").into()),
        }

        let noticed = Instant::now();
        let (device, queue) = adapter::device()?;
        let open = noticed.elapsed();
        let start = Instant::now();
        self.submitter = self.renderer.replace_backend(WgpuBackend::new(device, queue)?);
        let replace = start.elapsed();
        let start = Instant::now();
        if prepares {
            self.renderer.prepare_pipelines(self.scene.as_scene_ref())?;
        }
        let prepare = start.elapsed();
        let start = Instant::now();
        let scene = SceneRef { changes: Changes::NONE, ..self.scene.as_scene_ref() };
        let recorded = self.renderer.record(scene)?;
        let record = start.elapsed();
        let start = Instant::now();
        let submission = self.submitter.submit(recorded)?.submission;
        let submit = start.elapsed();
        submission.wait()?;
        let until_drawn = noticed.elapsed();
        let is_same = submission.read(0, targets::PICTURE)? == expected;
        Ok(Recovery { open, replace, prepare, record, submit, until_drawn, usual_frame, is_same })
    }

    /// A picture, and what it took until it was drawn.
    fn picture(&mut self) -> Result<(Picture, Duration), Box<dyn Error>> {
        let start = Instant::now();
        let scene = SceneRef { changes: Changes::NONE, ..self.scene.as_scene_ref() };
        let submission = self.submitter.submit(self.renderer.record(scene)?)?.submission;
        submission.wait()?;
        let took = start.elapsed();
        Ok((submission.read(0, targets::PICTURE)?, took))
    }
}
