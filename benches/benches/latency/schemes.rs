//! The schemes of buffering beside loops without them.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{Backend, WgpuBackend};
use drawloom::process::Deferred;
use drawloom::task::Scheduler;
use drawloom::{FrameTimes, Renderer};
use drawloom_benches::backends::BackendName;
use drawloom_benches::city;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::moving::{Motion, Moving};
use drawloom_benches::statistics::{median, percentile};
use drawloom_testing::simulated_device::SimulatedDevice;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::contender::{Contender, Kind};

/// The time of the engine's update.
const UPDATE: Duration = Duration::from_millis(2);
/// The frames of a turn. The first ones are not counted, as the device is idle before them.
const FRAMES: usize = 40;
const FIRST_FRAMES: usize = 5;

#[derive(Serialize)]
pub struct Row {
    pub device: String,
    pub name: &'static str,
    /// Medians.
    pub frame_ms: f64,
    pub latency_ms: f64,
    pub latency_99_ms: f64,
    /// Means: most frames wait not at all, or all of them do.
    pub waited_ms: f64,
    pub idle_ms: f64,
    pub buffer_bytes: u64,
}

pub fn measure(backend: BackendName, quick: bool, progress: &ProgressBar) -> Result<Vec<Row>, Box<dyn Error>> {
    let turns = if quick { 1 } else { 15 };
    let mut rows = Vec::new();
    match backend {
        BackendName::Noop => {
            for (name, device_time) in [("1 ms", 1), ("2.5 ms", 2), ("6 ms", 6), ("2 ms, each 8th 8 ms", 2)] {
                let boxes = if quick { 100 } else { 4_000 };
                let device_time = match name {
                    "2.5 ms" => Duration::from_micros(2_500),
                    _ => Duration::from_millis(device_time),
                };
                let open = || {
                    let device = SimulatedDevice::new(BackendName::Noop.open()?, device_time);
                    let all = (turns + 1) * FRAMES;
                    let long = |frame: usize| Duration::from_millis(if frame.is_multiple_of(8) { 8 } else { 2 });
                    let times = name.contains("8th").then(|| (0..all).map(long)).into_iter().flatten();
                    Ok(device.with_next_times(times))
                };
                rows.extend(of_device(name, open, SimulatedDevice::inner, boxes, turns, progress)?);
            }
        }
        BackendName::Adapter => {
            let boxes = if quick { 50 } else { 1_000 };
            rows.extend(of_device(
                "adapter",
                || BackendName::Adapter.open(),
                |backend| backend,
                boxes,
                turns,
                progress,
            )?);
        }
    }
    Ok(rows)
}

fn of_device<B: Backend>(
    device: &str,
    open: impl Fn() -> Result<B, Box<dyn Error>>,
    wgpu_of: impl Fn(&B) -> &WgpuBackend,
    boxes: usize,
    turns: usize,
    progress: &ProgressBar,
) -> Result<Vec<Row>, Box<dyn Error>>
where
    B::Submission: Send,
{
    let mut contenders = Vec::new();
    for kind in Kind::ALL {
        let scheduler = Arc::new(Scheduler::new(2)?);
        let built = Renderer::builder(open()?).deferred(Deferred::to_picture()).build(scheduler)?;
        let world = Moving::new(city::new(boxes, [160, 90])?, Motion::Cameras);
        contenders.push(Contender::new(kind, built, world)?);
    }
    let rounds = Rounds { warm_up: 1, measured: turns };
    let measured =
        Harness::new(rounds, progress).measure(&mut contenders, |contender, _| contender.draw(FRAMES, UPDATE))?;
    let rows = Kind::ALL.into_iter().zip(measured).zip(&mut contenders).map(|((kind, turns), contender)| {
        let buffer_bytes = wgpu_of(contender.backend()).resources().buffer_bytes;
        row(device, kind, &turns, buffer_bytes)
    });
    Ok(rows.collect())
}

fn row(device: &str, kind: Kind, turns: &[Vec<FrameTimes>], buffer_bytes: u64) -> Row {
    let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
    let pairs = || turns.iter().flat_map(|turn| turn.windows(2).skip(FIRST_FRAMES));
    let latencies = || pairs().map(|pair| milliseconds(pair[1].latency()));
    // Over a whole turn, because frames that finish together have no time between them.
    let frame = |turn: &Vec<FrameTimes>| {
        let (first, last) = (&turn[FIRST_FRAMES], &turn[turn.len() - 1]);
        milliseconds(last.finished - first.finished) / (turn.len() - 1 - FIRST_FRAMES) as f64
    };
    let mean = |values: &mut dyn Iterator<Item = Duration>| {
        let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + milliseconds(value), count + 1));
        sum / f64::from(count)
    };
    Row {
        device: device.to_owned(),
        name: kind.name(),
        frame_ms: median(turns.iter().map(frame)),
        latency_ms: median(latencies()),
        latency_99_ms: percentile(99, latencies()),
        waited_ms: mean(&mut pairs().map(|pair| pair[1].waited)),
        idle_ms: mean(&mut pairs().map(|pair| pair[1].device_idle_since(&pair[0]))),
        buffer_bytes,
    }
}
