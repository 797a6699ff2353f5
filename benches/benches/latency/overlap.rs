//! Update and record of the next frame, and submit of this one, at once.

use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::{EncodingStrategy, RecordingStrategy, WgpuBackend};
use drawloom::process::Deferred;
use drawloom::task::Scheduler;
use drawloom::{Buffering, Renderer, Submitter};
use drawloom_benches::backends::BackendName;
use drawloom_benches::city;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::moving::{Motion, Moving};
use drawloom_benches::statistics::median;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::contender::{Contender, Kind};

const FRAMES: usize = 60;
const FIRST_FRAMES: usize = 10;

/// Two threads, with equal parts of a frame.
#[derive(Serialize)]
pub struct Row {
    pub record_ms: f64,
    pub submit_ms: f64,
    pub serial_ms: f64,
    pub overlapped_ms: f64,
    /// `serial_ms / overlapped_ms`: at most 2.
    pub ratio: f64,
}

/// The device thread encodes everything, so that it has as much to do as the engine's thread. The engine's update fills
/// up what the encoding takes longer than recording. One worker, as the two threads are all that the machine has.
pub fn measure(quick: bool, progress: &ProgressBar) -> Result<Row, Box<dyn Error>> {
    let (boxes, turns) = if quick { (100, 1) } else { (20_000, 21) };
    let (_, record, submit) = parts(boxes, Duration::ZERO)?;
    let update = submit.saturating_sub(record);
    let mut contenders = [Kind::Plain(2), Kind::Loop(Buffering::Triple)]
        .map(|kind| Contender::new(kind, renderer()?, world(boxes)?))
        .into_iter()
        .collect::<Result<Vec<_>, _>>()?;
    let rounds = Rounds { warm_up: 2, measured: turns };
    let measured = Harness::new(rounds, progress).measure(&mut contenders, |contender, _| {
        let times = contender.draw(FRAMES, update)?;
        let (first, last) = (&times[FIRST_FRAMES], &times[FRAMES - 1]);
        let frames = (FRAMES - 1 - FIRST_FRAMES) as f64;
        Ok::<_, Box<dyn Error>>((last.submitted - first.submitted).as_secs_f64() * 1e3 / frames)
    })?;
    let [serial, overlapped] = [&measured[0], &measured[1]].map(|times| median(times.iter().copied()));
    let (update, record, submit) = parts(boxes, update)?;
    Ok(Row {
        record_ms: (update + record).as_secs_f64() * 1e3,
        submit_ms: submit.as_secs_f64() * 1e3,
        serial_ms: serial,
        overlapped_ms: overlapped,
        ratio: serial / overlapped,
    })
}

fn world(boxes: usize) -> Result<Moving, Box<dyn Error>> {
    Ok(Moving::new(city::new(boxes, [160, 90])?, Motion::Cameras))
}

fn renderer() -> Result<(Renderer<WgpuBackend>, Submitter<WgpuBackend>), Box<dyn Error>> {
    let backend = BackendName::Noop.open()?;
    let backend = backend.recording_strategy(RecordingStrategy::Direct).encoding_strategy(EncodingStrategy::OnSubmit);
    let scheduler = Arc::new(Scheduler::new(1)?);
    // Without instancing each box is a draw, so that there is much to encode.
    Ok(Renderer::builder(backend).pipeline(Deferred::to_picture()).instancing(false).build(scheduler)?)
}

/// The medians of an update, of recording and of submitting, on one thread.
fn parts(boxes: usize, update: Duration) -> Result<(Duration, Duration, Duration), Box<dyn Error>> {
    let (mut renderer, submitter) = renderer()?;
    let mut world = world(boxes)?;
    let mut times = [const { Vec::new() }; 2];
    for _ in 0..FRAMES {
        world.step();
        let start = Instant::now();
        let recorded = renderer.record(world.as_scene_ref())?;
        let middle = Instant::now();
        submitter.submit(recorded)?;
        times[0].push((middle - start).as_secs_f64());
        times[1].push(middle.elapsed().as_secs_f64());
    }
    let [record, submit] = times.map(|times| Duration::from_secs_f64(median(times.into_iter().skip(FIRST_FRAMES))));
    Ok((update, record, submit))
}
